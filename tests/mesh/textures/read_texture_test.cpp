#include "mesh/textures/read_texture.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <string>

#include "tests/mesh/textures/picture_bytes.h"

#ifdef STRATA_HAVE_JPEG
#include <cstdio>
// jpeglib.h needs what <cstdio> declares.
#include <jpeglib.h>
#endif

namespace strata {
namespace {

using testing_textures::png_chunk;
using testing_textures::png_of;
using namespace std::string_literals;

Texture decoded(const std::string& bytes) {
  auto texture = read_texture("picture", bytes);
  EXPECT_TRUE(texture.has_value()) << (texture ? "" : texture.error().message);
  return texture ? *std::move(texture) : Texture();
}

Error refused(std::string_view bytes, const Execution& execution = {}) {
  const auto texture = read_texture("picture", bytes, execution);
  EXPECT_FALSE(texture.has_value());
  return texture ? Error() : texture.error();
}

const auto kRed = glm::u8vec4(255, 0, 0, 255), kBlue = glm::u8vec4(0, 0, 255, 255);

TEST(Texture, RowsOfAPngComeFromTheTop) {
  const std::string texels = "\xff\0\0\xff\0\xff\0\x80\0\0\xff\xff\1\2\3\0"s;
  const Texture texture = decoded(testing_textures::rgba_png(2, 2, texels));
  ASSERT_EQ(texture.width, 2);
  ASSERT_EQ(texture.height, 2);
  EXPECT_EQ(texture.texels,
            (std::vector<glm::u8vec4>{kRed, {0, 255, 0, 128}, kBlue, {1, 2, 3, 0}}));
  EXPECT_EQ(texture.name, "picture");
}

TEST(Texture, PngOfAnyKind) {
  // grey of 1 bit: white, black, white
  EXPECT_EQ(decoded(png_of(3, 1, 1, 0, "\0\xa0"s)).texels,
            (std::vector<glm::u8vec4>{glm::u8vec4(255), {0, 0, 0, 255}, glm::u8vec4(255)}));
  // a palette of 2 bits, whose second colour is half transparent
  const std::string palette =
      png_chunk("PLTE", "\xff\0\0\0\0\xff"s) + png_chunk("tRNS", "\xff\x80"s);
  EXPECT_EQ(decoded(png_of(2, 1, 2, 3, "\0\x10"s, palette)).texels,
            (std::vector<glm::u8vec4>{kRed, {0, 0, 255, 128}}));
  // red, green, blue of 16 bits
  EXPECT_EQ(decoded(png_of(1, 1, 16, 2, "\0\x80\x80\xff\xff\0\0"s)).texels,
            (std::vector<glm::u8vec4>{{128, 255, 0, 255}}));
  // grey with alpha
  EXPECT_EQ(decoded(png_of(1, 1, 8, 4, "\0\x40\x20"s)).texels,
            (std::vector<glm::u8vec4>{{64, 64, 64, 32}}));
}

TEST(Texture, WhatIsNoPictureIsAnErrorOfTheInput) {
  for (const std::string& bytes : {""s, "GIF89a"s, "\x89PNG"s, std::string(100, '\0')}) {
    const Error error = refused(bytes);
    EXPECT_EQ(error.code, ErrorCode::kInput);
    EXPECT_NE(error.message.find("picture: the picture is neither PNG nor JPEG"),
              std::string::npos);
  }
}

TEST(Texture, EveryTruncatedPngIsRefused) {
  const std::string whole = testing_textures::rgba_png(2, 2, std::string(16, 'x'));
  const std::size_t end_chunk = 12;  // its absence loses nothing
  for (std::size_t length = 0; length < whole.size() - end_chunk; ++length) {
    EXPECT_EQ(refused(whole.substr(0, length)).code, ErrorCode::kInput) << length;
  }
  std::string damaged = whole;
  damaged[45] = static_cast<char>(damaged[45] ^ 1);  // in the packed rows
  EXPECT_EQ(refused(damaged).code, ErrorCode::kInput);
}

TEST(Texture, SizesAreCheckedBeforeMemoryIsTaken) {
  EXPECT_EQ(refused(png_of(100000, 1, 8, 0, "")).code, ErrorCode::kLimit);
  Execution execution;
  execution.memory_limit = 1 << 20;
  const Error error = refused(png_of(1000, 1000, 8, 0, ""), execution);
  EXPECT_EQ(error.code, ErrorCode::kLimit);
  EXPECT_NE(error.message.find("4000000 bytes, but the memory limit is 1048576"), std::string::npos)
      << error.message;
}

#ifdef STRATA_HAVE_JPEG

/// A JPEG of one colour. @param pixel  as many samples as the space has
std::string jpeg_of(int side, J_COLOR_SPACE space, const std::string& pixel, bool progressive,
                    J_COLOR_SPACE stored) {
  jpeg_compress_struct picture = {};
  jpeg_error_mgr errors = {};
  picture.err = jpeg_std_error(&errors);
  jpeg_create_compress(&picture);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&picture, &bytes, &size);
  picture.image_width = picture.image_height = static_cast<JDIMENSION>(side);
  picture.input_components = static_cast<int>(pixel.size());
  picture.in_color_space = space;
  jpeg_set_defaults(&picture);
  jpeg_set_colorspace(&picture, stored);
  jpeg_set_quality(&picture, 100, TRUE);
  if (progressive) jpeg_simple_progression(&picture);
  jpeg_start_compress(&picture, TRUE);
  std::string row;
  for (int x = 0; x < side; ++x) row += pixel;
  auto* samples = reinterpret_cast<unsigned char*>(row.data());
  for (int y = 0; y < side; ++y) jpeg_write_scanlines(&picture, &samples, 1);
  jpeg_finish_compress(&picture);
  jpeg_destroy_compress(&picture);
  const std::string whole(reinterpret_cast<const char*>(bytes), size);
  std::free(bytes);
  return whole;
}

void expect_colour(const std::string& bytes, const glm::ivec4& wanted) {
  const Texture texture = decoded(bytes);
  ASSERT_EQ(texture.texels.size(), 81u);
  for (const glm::u8vec4& texel : texture.texels) {
    for (int i = 0; i < 4; ++i) ASSERT_NEAR(texel[i], wanted[i], 2) << i;
  }
}

TEST(Texture, JpegOfAnyColourSpace) {
  for (const bool progressive : {false, true}) {
    expect_colour(jpeg_of(9, JCS_RGB, "\xc8\x32\x64", progressive, JCS_YCbCr), {200, 50, 100, 255});
    expect_colour(jpeg_of(9, JCS_RGB, "\xc8\x32\x64", progressive, JCS_RGB), {200, 50, 100, 255});
    expect_colour(jpeg_of(9, JCS_GRAYSCALE, "\x50", progressive, JCS_GRAYSCALE), {80, 80, 80, 255});
    // libjpeg marks it as Adobe does: 255 is no ink
    expect_colour(jpeg_of(9, JCS_CMYK, "\xc8\x32\x64\x80", progressive, JCS_CMYK),
                  {100, 25, 50, 255});
    expect_colour(jpeg_of(9, JCS_CMYK, "\xc8\x32\x64\x80", progressive, JCS_YCCK),
                  {100, 25, 50, 255});
  }
}

TEST(Texture, EveryTruncatedJpegIsRefused) {
  for (const bool progressive : {false, true}) {
    const std::string whole = jpeg_of(9, JCS_RGB, "\xc8\x32\x64", progressive, JCS_YCbCr);
    for (std::size_t length = 0; length + 2 < whole.size(); ++length) {
      EXPECT_EQ(refused(whole.substr(0, length)).code, ErrorCode::kInput) << length;
    }
  }
}

TEST(Texture, JpegsKeepToTheMemoryLimitAndStop) {
  const std::string large = jpeg_of(1000, JCS_GRAYSCALE, "\x50", true, JCS_GRAYSCALE);
  Execution execution;
  execution.memory_limit = 5'000'000;  // texels fit, the coefficients do not
  EXPECT_EQ(refused(large, execution).code, ErrorCode::kLimit);
  std::stop_source stop;
  stop.request_stop();
  execution = {.stop = stop.get_token()};
  EXPECT_EQ(refused(large, execution).code, ErrorCode::kCancelled);
}

#endif

}  // namespace
}  // namespace strata
