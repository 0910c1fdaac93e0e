// Animations, read back by other libraries' decoders, and APNG by one of the test's own.

#include "strata/picture/animation.h"

#include <gtest/gtest.h>
#include <png.h>
#include <unistd.h>
#include <zlib.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#ifdef STRATA_HAVE_GIF
#include <gif_lib.h>
#endif
#ifdef STRATA_HAVE_WEBP
#include <webp/demux.h>
#endif

namespace strata {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

/// A disc that moves over a gradient, with many colours; the third picture equals the second.
std::vector<Picture> film(bool transparent) {
  constexpr int kWidth = 53, kHeight = 37;
  std::vector<Picture> pictures;
  for (int frame = 0; frame < 5; ++frame) {
    const int at = frame == 2 ? 1 : frame;
    Picture picture{kWidth, kHeight, {}};
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const int du = u - 12 - 6 * at, dv = v - 17;
        const bool inside = du * du + dv * dv < 100;
        Rgba colour(200 - v, 210 - v, 220 - v, transparent ? 0 : 255);
        if (inside) colour = Rgba(128 + 10 * du, 100 + 9 * dv, 40 + at * 20, 255);
        if (transparent && inside && du < -8) colour.a = 160;
        picture.pixels.push_back(colour);
      }
    }
    pictures.push_back(std::move(picture));
  }
  return pictures;
}

class Animation : public testing::Test {
 protected:
  Animation() {
    std::string name = (fs::temp_directory_path() / "strata_film_XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~Animation() override { fs::remove_all(folder_); }

  Bytes written(const std::string& name, const std::vector<Picture>& pictures,
                AnimationOptions options = {}) {
    const std::string path = folder_ + "/" + name;
    options.frames = static_cast<int>(pictures.size());
    fs::remove_all(path);
    auto writer = create_animation(path, options);
    EXPECT_TRUE(writer.has_value()) << writer.error().message;
    if (!writer) return {};
    for (const Picture& picture : pictures) {
      const auto added = (*writer)->add(picture);
      EXPECT_TRUE(added.has_value()) << added.error().message;
      EXPECT_FALSE(fs::exists(path));
    }
    const auto done = (*writer)->finish();
    EXPECT_TRUE(done.has_value()) << done.error().message;
    if (fs::is_directory(path)) return {};
    std::ifstream in(path, std::ios::binary);
    return Bytes(std::istreambuf_iterator<char>(in), {});
  }
  std::string folder_;
};

// --- APNG: ISO/IEC 15948 and the specification of APNG ------------------------------------------

std::uint32_t number(const Bytes& bytes, std::size_t at, int count = 4) {
  std::uint32_t value = 0;
  for (int i = 0; i < count; ++i) value = value << 8 | bytes.at(at + static_cast<std::size_t>(i));
  return value;
}

struct Chunk {
  std::string type;
  Bytes data;
};

std::vector<Chunk> chunks_of(const Bytes& file) {
  std::vector<Chunk> chunks;
  EXPECT_EQ(number(file, 0), 0x89504e47u);
  for (std::size_t at = 8; at < file.size();) {
    const std::size_t length = number(file, at);
    const auto data = file.begin() + static_cast<std::ptrdiff_t>(at) + 8;
    const auto end = data + static_cast<std::ptrdiff_t>(length);
    EXPECT_EQ(number(file, at + 8 + length),
              crc32(0, file.data() + at + 4, static_cast<uInt>(length + 4)));
    chunks.push_back({std::string(data - 4, data), Bytes(data, end)});
    at += 12 + length;
  }
  return chunks;
}

/// The rows of compressed data, with their filters undone.
Bytes rows_of(const Bytes& compressed, std::size_t row_bytes, std::size_t rows, std::size_t step) {
  Bytes raw((row_bytes + 1) * rows);
  uLongf size = raw.size();
  EXPECT_EQ(uncompress(raw.data(), &size, compressed.data(), compressed.size()), Z_OK);
  EXPECT_EQ(size, raw.size());
  Bytes result(row_bytes * rows);
  for (std::size_t v = 0; v < rows; ++v) {
    const int filter = raw[v * (row_bytes + 1)];
    for (std::size_t i = 0; i < row_bytes; ++i) {
      const int a = i < step ? 0 : result[v * row_bytes + i - step];
      const int b = v == 0 ? 0 : result[(v - 1) * row_bytes + i];
      const int c = v == 0 || i < step ? 0 : result[(v - 1) * row_bytes + i - step];
      int guess = filter == 1 ? a : filter == 2 ? b : filter == 3 ? (a + b) / 2 : 0;
      if (filter == 4) {
        const int pa = std::abs(b - c), pb = std::abs(a - c), pc = std::abs(a + b - 2 * c);
        guess = pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
      }
      result[v * row_bytes + i] =
          static_cast<std::uint8_t>(raw[v * (row_bytes + 1) + 1 + i] + guess);
    }
  }
  return result;
}

std::vector<Picture> decoded_apng(const Bytes& file, bool alpha, int& hundredths) {
  std::vector<Picture> pictures;
  Picture canvas;
  const std::size_t channels = alpha ? 4 : 3;
  std::array<std::uint32_t, 4> box{};
  std::uint32_t sequence = 0;
  for (const auto& [type, data] : chunks_of(file)) {
    if (type == "IHDR") {
      canvas.width = static_cast<int>(number(data, 0));
      canvas.height = static_cast<int>(number(data, 4));
      EXPECT_EQ(data[9], alpha ? 6 : 2);
      canvas.pixels.resize(static_cast<std::size_t>(canvas.width * canvas.height));
    } else if (type == "fcTL") {
      EXPECT_EQ(number(data, 0), sequence++);
      for (std::size_t i = 0; i < 4; ++i) box[i] = number(data, 4 + 4 * i);
      hundredths += static_cast<int>(number(data, 20, 2) * 100 / number(data, 22, 2));
    } else if (type == "IDAT" || type == "fdAT") {
      Bytes compressed = data;
      if (type == "fdAT") {
        EXPECT_EQ(number(data, 0), sequence++);
        compressed.erase(compressed.begin(), compressed.begin() + 4);
      }
      const auto [width, height, left, top] = box;
      const Bytes rows = rows_of(compressed, width * channels, height, channels);
      for (std::size_t i = 0; i < std::size_t{width} * height; ++i) {
        Rgba& pixel = canvas.pixels[(top + i / width) * static_cast<std::size_t>(canvas.width) +
                                    left + i % width];
        const std::uint8_t* from = rows.data() + i * channels;
        pixel = Rgba(from[0], from[1], from[2], alpha ? from[3] : 255);
      }
      pictures.push_back(canvas);
    }
  }
  return pictures;
}

TEST_F(Animation, ApngHoldsThePicturesBitByBit) {
  for (const bool transparent : {false, true}) {
    const auto pictures = film(transparent);
    const Bytes file = written("a.apng", pictures, {.fps = 20, .transparent = transparent});
    const auto chunks = chunks_of(file);
    ASSERT_GT(chunks.size(), 4u);
    EXPECT_EQ(chunks[1].type, "acTL");
    EXPECT_EQ(number(chunks[1].data, 0), pictures.size());
    EXPECT_EQ(number(chunks[1].data, 4), 0u);  // for ever
    EXPECT_EQ(chunks.back().type, "IEND");
    int hundredths = 0;
    const auto read = decoded_apng(file, transparent, hundredths);
    ASSERT_EQ(read.size(), pictures.size());
    EXPECT_EQ(hundredths, 25);
    for (std::size_t i = 0; i < read.size(); ++i) EXPECT_EQ(read[i].pixels, pictures[i].pixels);
    EXPECT_EQ(written("b.apng", pictures, {.fps = 20, .transparent = transparent}), file);
  }
}

TEST_F(Animation, ApngOpensAsAPngOfTheFirstPicture) {
  const auto pictures = film(false);
  const Bytes file = written("a.apng", pictures);
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_memory(&png, file.data(), file.size()), 0);
  png.format = PNG_FORMAT_RGBA;
  std::vector<Rgba> pixels(pictures[0].pixels.size());
  ASSERT_NE(png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr), 0);
  EXPECT_EQ(pixels, pictures[0].pixels);
}

// --- WebP and GIF -------------------------------------------------------------------------------

TEST_F(Animation, WebpHoldsThePicturesBitByBit) {
#ifdef STRATA_HAVE_WEBP
  for (const bool transparent : {false, true}) {
    const auto pictures = film(transparent);
    const Bytes file = written("a.webp", pictures, {.fps = 20, .transparent = transparent});
    const WebPData data{file.data(), file.size()};
    WebPAnimDecoder* decoder = WebPAnimDecoderNew(&data, nullptr);
    ASSERT_NE(decoder, nullptr);
    WebPAnimInfo info;
    ASSERT_NE(WebPAnimDecoderGetInfo(decoder, &info), 0);
    EXPECT_EQ(info.loop_count, 0u);
    std::size_t count = 0, shown = 0;
    int last = 0;
    while (WebPAnimDecoderHasMoreFrames(decoder) != 0) {
      std::uint8_t* rgba = nullptr;
      int end = 0;
      ASSERT_NE(WebPAnimDecoderGetNext(decoder, &rgba, &end), 0);
      // The encoder joins equal pictures to a longer one.
      const auto index = static_cast<std::size_t>(last / 50);
      for (std::size_t i = 0; i < pictures[index].pixels.size(); ++i) {
        const Rgba& expected = pictures[index].pixels[i];
        EXPECT_EQ(rgba[4 * i + 3], expected.a);
        if (expected.a == 0) continue;
        for (int c = 0; c < 3; ++c) {
          // Blending over what was there rounds where alpha is between.
          const int off = std::abs(rgba[4 * i + static_cast<std::size_t>(c)] - expected[c]);
          ASSERT_LE(off, expected.a == 255 ? 0 : 2) << count << ' ' << i;
        }
      }
      ++count;
      shown += static_cast<std::size_t>((end - last) / 50);
      last = end;
    }
    WebPAnimDecoderDelete(decoder);
    EXPECT_EQ(shown, pictures.size());
    EXPECT_GE(count, 4u);
    EXPECT_EQ(written("b.webp", pictures, {.fps = 20, .transparent = transparent}), file);
  }
#else
  EXPECT_EQ(check_animation_name("a.webp").error().code, ErrorCode::kUsage);
#endif
}

#ifdef STRATA_HAVE_GIF
struct GifFrame {
  Picture canvas;
  int delay = 0;
};

std::vector<GifFrame> decoded_gif(const std::string& path) {
  int error = 0;
  GifFileType* gif = DGifOpenFileName(path.c_str(), &error);
  EXPECT_NE(gif, nullptr);
  EXPECT_EQ(DGifSlurp(gif), GIF_OK);
  std::vector<GifFrame> frames;
  Picture canvas{gif->SWidth, gif->SHeight, {}};
  canvas.pixels.resize(static_cast<std::size_t>(gif->SWidth * gif->SHeight));
  for (int i = 0; i < gif->ImageCount; ++i) {
    const SavedImage& image = gif->SavedImages[i];
    GraphicsControlBlock control;
    EXPECT_EQ(DGifSavedExtensionToGCB(gif, i, &control), GIF_OK);
    const GifImageDesc& place = image.ImageDesc;
    if (control.TransparentColor >= 0)
      std::fill(canvas.pixels.begin(), canvas.pixels.end(), Rgba(0));
    for (int k = 0; k < place.Width * place.Height; ++k) {
      const int index = image.RasterBits[k];
      const int at = (place.Top + k / place.Width) * gif->SWidth + place.Left + k % place.Width;
      const GifColorType& colour = place.ColorMap->Colors[index];
      canvas.pixels[static_cast<std::size_t>(at)] =
          index == control.TransparentColor ? Rgba(0)
                                            : Rgba(colour.Red, colour.Green, colour.Blue, 255);
    }
    frames.push_back({canvas, control.DelayTime});
  }
  DGifCloseFile(gif, &error);
  return frames;
}
#endif

TEST_F(Animation, GifHoldsThePicturesIn256ColoursEach) {
#ifdef STRATA_HAVE_GIF
  for (const bool transparent : {false, true}) {
    const auto pictures = film(transparent);
    const Bytes file = written("a.gif", pictures, {.fps = 30, .transparent = transparent});
    const auto frames = decoded_gif(folder_ + "/a.gif");
    ASSERT_EQ(frames.size(), pictures.size());
    int delays = 0;
    for (std::size_t f = 0; f < frames.size(); ++f) {
      delays += frames[f].delay;
      double off = 0;
      std::size_t solid = 0;
      for (std::size_t i = 0; i < pictures[f].pixels.size(); ++i) {
        const Rgba &expected = pictures[f].pixels[i], found = frames[f].canvas.pixels[i];
        ASSERT_EQ(found.a, expected.a >= 128 ? 255 : 0) << f << ' ' << i;
        if (found.a == 0) continue;
        ++solid;
        for (int c = 0; c < 3; ++c) off += std::abs(found[c] - expected[c]);
      }
      EXPECT_GT(solid, 200u);
      EXPECT_LT(off / static_cast<double>(3 * solid), 4.0) << f;
    }
    EXPECT_NEAR(delays, 100 * 5 / 30.0, 0.51);  // no rounding adds up
    EXPECT_EQ(written("b.gif", pictures, {.fps = 30, .transparent = transparent}), file);
  }
#else
  EXPECT_EQ(check_animation_name("a.gif").error().code, ErrorCode::kUsage);
#endif
}

TEST_F(Animation, GifKeepsFewColoursAsTheyAre) {
#ifdef STRATA_HAVE_GIF
  std::mt19937 random(5);
  std::vector<Picture> pictures(2, Picture{40, 30, {}});
  for (Picture& picture : pictures) {
    std::vector<Rgba> colours;
    // Their upper five bits differ: 100 colours of different cells.
    for (int i = 0; i < 100; ++i) colours.emplace_back(i % 10 * 24, i / 10 * 24, 77, 255);
    for (int i = 0; i < 1200; ++i) picture.pixels.push_back(colours[random() % 100]);
  }
  written("a.gif", pictures);
  const auto frames = decoded_gif(folder_ + "/a.gif");
  ASSERT_EQ(frames.size(), 2u);
  for (std::size_t f = 0; f < 2; ++f) EXPECT_EQ(frames[f].canvas.pixels, pictures[f].pixels);
#else
  GTEST_SKIP() << "this build has no giflib";
#endif
}

// --- all ----------------------------------------------------------------------------------------

TEST_F(Animation, AFolderHasAPngForEach) {
  const auto pictures = film(false);
  written("frames/", pictures);
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const std::string path = folder_ + "/frames/000" + std::to_string(i) + ".png";
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    ASSERT_NE(png_image_begin_read_from_file(&png, path.c_str()), 0) << path;
    png.format = PNG_FORMAT_RGBA;
    std::vector<Rgba> pixels(pictures[i].pixels.size());
    ASSERT_NE(png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr), 0);
    EXPECT_EQ(pixels, pictures[i].pixels);
  }
}

TEST_F(Animation, NothingIsLeftOfOneThatIsNotFinished) {
  for (const char* name : {"a.apng", "a.gif", "a.webp", "frames/"}) {
    if (!check_animation_name(name)) continue;
    auto writer = create_animation(folder_ + "/" + name, {.frames = 5});
    ASSERT_TRUE(writer.has_value());
    ASSERT_TRUE((*writer)->add(film(false).front()).has_value());
    writer->reset();
    EXPECT_TRUE(fs::is_empty(folder_)) << name;
  }
}

TEST_F(Animation, OtherNamesAndNumbersAreRefused) {
  const auto says = [&](const std::string& name, const AnimationOptions& options) {
    const auto writer = create_animation(folder_ + "/" + name, options);
    EXPECT_FALSE(writer.has_value());
    return writer ? std::string() : writer.error().message;
  };
  EXPECT_NE(says("a.mp4", {}).find("written as .gif, .webp or .apng"), std::string::npos);
  EXPECT_NE(says("a.apng", {.frames = 0}).find("of 0 pictures"), std::string::npos);
  EXPECT_NE(says("a.apng", {.fps = 101}).find("101 pictures a second"), std::string::npos);
  EXPECT_NE(says("a.apng", {.fps = 0}).find("there must be 0.1 to 100"), std::string::npos);
  EXPECT_TRUE(fs::is_empty(folder_));
}

}  // namespace
}  // namespace strata
