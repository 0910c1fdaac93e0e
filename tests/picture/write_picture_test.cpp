// PNG files, read back by libpng.

#include <gtest/gtest.h>
#include <png.h>

#include <cstdint>
#include <random>
#include <vector>

#include "picture/encode_png.h"

namespace strata {
namespace {

/// A picture of runs of `colours` colours, or of noise where that is 0.
Picture random_runs(int width, int height, std::uint32_t colours, bool opaque, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Rgba> palette;
  for (std::uint32_t i = 0; i < colours; ++i) {
    // All differ: red and green are the number.
    palette.emplace_back(i & 0xff, i >> 8, random() & 0xff, opaque ? 255 : random() & 0xff);
  }
  Picture picture{width, height, {}};
  const auto count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::size_t next = 0;  // each colour comes once at least, in a picture that is large enough
  while (picture.pixels.size() < count) {
    const std::size_t at = next < palette.size() ? next++ : random() % std::max(colours, 1u);
    const Rgba colour = colours > 0 ? palette[at]
                                    : Rgba(random() & 0xff, random() & 0xff, random() & 0xff,
                                           opaque ? 255 : random() & 0xff);
    for (auto run = colours > 0 ? 1 + random() % 40 : 1; run > 0; --run) {
      if (picture.pixels.size() < count) picture.pixels.push_back(colour);
    }
  }
  return picture;
}

struct Read {
  int bits = 0, colour_type = 0;
  std::vector<Rgba> pixels;
};

/// By libpng; all checksums are looked at.
Read read_by_libpng(const std::vector<std::uint8_t>& file) {
  Read read;
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_memory(&png, file.data(), file.size()), 0) << png.message;
  png.format = PNG_FORMAT_RGBA;
  read.pixels.resize(std::size_t{png.width} * png.height);
  EXPECT_NE(png_image_finish_read(&png, nullptr, read.pixels.data(), 0, nullptr), 0) << png.message;
  EXPECT_EQ(png.warning_or_error, 0u) << png.message;
  read.bits = file[24], read.colour_type = file[25];
  return read;
}

struct Form {
  std::uint32_t colours;
  bool opaque;
  int bits, colour_type;
};
constexpr Form kForms[] = {{1, true, 1, 3},    {2, true, 1, 3},   {3, false, 2, 3},
                           {5, true, 4, 3},    {16, false, 4, 3}, {17, true, 8, 3},
                           {256, false, 8, 3}, {257, true, 8, 2}, {257, false, 8, 6},
                           {0, true, 8, 2},    {0, false, 8, 6}};

TEST(WritePicture, LibpngReadsTheSamePixelsInEveryForm) {
  unsigned seed = 1;
  for (const Form& form : kForms) {
    for (const auto& [width, height] : {std::pair(131, 97), {64, 200}, {1027, 703}}) {
      const Picture picture = random_runs(width, height, form.colours, form.opaque, ++seed);
      const Read read = read_by_libpng(encode_png(picture));
      EXPECT_EQ(read.bits, form.bits) << form.colours;
      EXPECT_EQ(read.colour_type, form.colour_type) << form.colours;
      EXPECT_TRUE(read.pixels == picture.pixels) << form.colours << ' ' << width;
    }
  }
}

TEST(WritePicture, RowsOfAnyWidthAreReadBack) {
  for (int width = 1; width <= 70; ++width) {
    for (const Form& form : kForms) {
      const Picture picture = random_runs(width, 5, form.colours, form.opaque, 7);
      EXPECT_TRUE(read_by_libpng(encode_png(picture)).pixels == picture.pixels) << width;
    }
  }
}

TEST(WritePicture, OnePixelAndRowsLongerThanABandAreReadBack) {
  for (const Form& form : kForms) {
    for (const auto& [width, height] : {std::pair(1, 1), {300000, 3}}) {
      const Picture picture = random_runs(width, height, form.colours, form.opaque, 7);
      EXPECT_TRUE(read_by_libpng(encode_png(picture)).pixels == picture.pixels) << width;
    }
  }
}

TEST(WritePicture, TheFileHasTheSameBytesForAnyNumberOfThreadsAndEachTime) {
  for (const Form& form : kForms) {
    const Picture picture = random_runs(1500, 1100, form.colours, form.opaque, 3);
    const auto one = encode_png(picture, 1);
    for (const int threads : {2, 3, 7, 1}) EXPECT_TRUE(encode_png(picture, threads) == one);
  }
}

TEST(WritePicture, APaletteIsInTheOrderOfThePicture) {
  // Colours of later bands come after those of the first.
  Picture picture{600, 600, std::vector<Rgba>(600 * 600, Rgba(9, 9, 9, 255))};
  for (std::size_t i = 0; i < 200; ++i) picture.pixels[i * 1800] = Rgba(i, 1, 2, 255);
  const auto file = encode_png(picture, 4);
  // [length | PLTE | red, green, blue, ...] comes after 8 bytes and the header's 25.
  ASSERT_EQ(std::string(file.begin() + 37, file.begin() + 41), "PLTE");
  EXPECT_EQ(std::vector<std::uint8_t>(file.begin() + 41, file.begin() + 50),
            (std::vector<std::uint8_t>{0, 1, 2, 9, 9, 9, 1, 1, 2}));
  EXPECT_TRUE(read_by_libpng(file).pixels == picture.pixels);
}

}  // namespace
}  // namespace strata
