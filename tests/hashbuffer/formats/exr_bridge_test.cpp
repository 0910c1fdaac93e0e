// What others see in the deep EXR files: read here by OpenEXR alone.

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineInputFile.h>
#include <ImfDoubleAttribute.h>
#include <ImfHeader.h>
#include <ImfIntAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "strata/hashbuffer/formats/ldi_io.h"
#include "tests/hashbuffer/formats/ldi_testing.h"

namespace strata {
namespace {

using namespace ldi_testing;  // NOLINT: the vocabulary of this file

constexpr std::uint32_t kNone = 0xffffffffu;

struct Seen {
  float a = -1, z = -1, z_back = -1;
  std::uint32_t id = 9, facing = 9, depth = 9, depth_back = 9, payload = 9, payload_back = 9;
};

// The samples of every pixel; channels that are not in the file keep their defaults.
std::vector<std::vector<Seen>> look(const std::string& path) {
  Imf::DeepScanLineInputFile file(path.c_str());
  const Imath::Box2i window = file.header().dataWindow();
  const auto width = static_cast<std::size_t>(window.max.x + 1);
  const std::size_t pixels = width * static_cast<std::size_t>(window.max.y + 1);
  std::vector<std::uint32_t> counts(pixels);
  std::vector<std::vector<Seen>> seen(pixels);
  const std::vector<std::tuple<std::string, Imf::PixelType, std::size_t>> channels = {
      {"A", Imf::FLOAT, offsetof(Seen, a)},
      {"Z", Imf::FLOAT, offsetof(Seen, z)},
      {"ZBack", Imf::FLOAT, offsetof(Seen, z_back)},
      {"id", Imf::UINT, offsetof(Seen, id)},
      {"facing", Imf::UINT, offsetof(Seen, facing)},
      {"strata.depth", Imf::UINT, offsetof(Seen, depth)},
      {"strata.depthBack", Imf::UINT, offsetof(Seen, depth_back)},
      {"strata.payload", Imf::UINT, offsetof(Seen, payload)},
      {"strata.payloadBack", Imf::UINT, offsetof(Seen, payload_back)}};
  std::vector<std::vector<char*>> pointers(channels.size(), std::vector<char*>(pixels));
  Imf::DeepFrameBuffer frame;
  frame.insertSampleCountSlice(
      Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()), 4, 4 * width));
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const auto& [name, type, offset] = channels[c];
    if (!file.header().channels().findChannel(name)) continue;
    frame.insert(name, Imf::DeepSlice(type, reinterpret_cast<char*>(pointers[c].data()),
                                      sizeof(char*), sizeof(char*) * width, sizeof(Seen)));
  }
  file.setFrameBuffer(frame);
  file.readPixelSampleCounts(0, window.max.y);
  for (std::size_t i = 0; i < pixels; ++i) {
    seen[i].resize(counts[i]);
    for (std::size_t c = 0; c < channels.size(); ++c) {
      pointers[c][i] = reinterpret_cast<char*>(seen[i].data()) + std::get<2>(channels[c]);
    }
  }
  file.readPixels(0, window.max.y);
  return seen;
}

class ExrBridge : public testing::Test {
 protected:
  std::vector<std::vector<Seen>> write_and_look(const LayeredDepthImage& image, bool samples) {
    const auto written = write_ldi_exr(path, image, {.samples = samples});
    EXPECT_TRUE(written.has_value()) << written.error().message;
    return look(path);
  }
  TemporaryFolder folder;
  std::string path = folder.file("lists.exr");
};

TEST_F(ExrBridge, ACleanIntervalIsOneVolumeSample) {
  LayeredDepthImage image = image_of(2, 1,
                                     {{DepthItem(10, false, 3), DepthItem(20, true, 4),
                                       DepthItem(30, false, 5), DepthItem(60, true, 6)},
                                      {}});
  image.world_from_image[2] = {0, 0.3, 0.4, 0};  // a lattice step is half a unit
  const auto pixels = write_and_look(image, false);
  ASSERT_EQ(pixels[0].size(), 2u);
  EXPECT_EQ(pixels[1].size(), 0u);
  const Seen& first = pixels[0][0];
  EXPECT_EQ(first.a, 1.0F);
  EXPECT_EQ(first.z, 5.0F);
  EXPECT_EQ(first.z_back, 10.0F);
  EXPECT_EQ(first.id, 3u);
  EXPECT_EQ(first.depth, 10u);
  EXPECT_EQ(first.depth_back, 20u);
  EXPECT_EQ(first.payload, 3u);
  EXPECT_EQ(first.payload_back, 0x80000004u);
  EXPECT_EQ(pixels[0][1].z, 15.0F);
  EXPECT_EQ(pixels[0][1].z_back, 30.0F);
}

TEST_F(ExrBridge, OverlappingSolidsAdjoin) {
  const auto pixels = write_and_look(image_of(1, 1,
                                              {{DepthItem(30, false, 1), DepthItem(40, false, 2),
                                                DepthItem(50, true, 1), DepthItem(60, true, 2)}}),
                                     false);
  ASSERT_EQ(pixels[0].size(), 3u);
  const std::uint32_t fronts[] = {30, 40, 50}, backs[] = {kNone, kNone, 60};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(pixels[0][i].a, 1.0F);
    EXPECT_EQ(pixels[0][i].z, static_cast<float>(30 + 10 * i));
    EXPECT_EQ(pixels[0][i].z_back, static_cast<float>(40 + 10 * i));
    EXPECT_EQ(pixels[0][i].depth, fronts[i]);
    EXPECT_EQ(pixels[0][i].depth_back, backs[i]);
  }
}

TEST_F(ExrBridge, CrossingsOutsideSolidsAreTransparentMarks) {
  const auto pixels = write_and_look(
      image_of(1, 1, {{DepthItem(5, true, 1), DepthItem(9, false, 2), DepthItem(12, false, 3)}}),
      false);
  ASSERT_EQ(pixels[0].size(), 3u);
  EXPECT_EQ(pixels[0][0].a, 0.0F);  // left before it was entered
  EXPECT_EQ(pixels[0][1].a, 0.0F);  // back to nothing
  EXPECT_EQ(pixels[0][2].a, 1.0F);  // entered and never left
  for (const Seen& sample : pixels[0]) {
    EXPECT_EQ(sample.z, sample.z_back);
    EXPECT_EQ(sample.depth_back, kNone);
  }
}

TEST_F(ExrBridge, SamplesModeHasAPointPerCrossing) {
  const auto pixels =
      write_and_look(image_of(1, 1, {{DepthItem(30, false, 1), DepthItem(40, true, 2)}}), true);
  ASSERT_EQ(pixels[0].size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const Seen& sample = pixels[0][i];
    EXPECT_EQ(sample.a, 1.0F);
    EXPECT_EQ(sample.z, static_cast<float>(30 + 10 * i));
    EXPECT_EQ(sample.z_back, -1.0F) << "no such channel";
    EXPECT_EQ(sample.id, 1 + i);
    EXPECT_EQ(sample.facing, i);
    EXPECT_EQ(sample.depth, 30 + 10 * i);
  }
}

TEST_F(ExrBridge, EveryPixelIsTidy) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const LayeredDepthImage image = random_image(seed, 20, 10);
    for (const bool samples : {false, true}) {
      std::size_t n = 0;
      for (const auto& pixel : write_and_look(image, samples)) {
        n += pixel.size();
        for (std::size_t i = 0; i < pixel.size(); ++i) {
          const float back = samples ? pixel[i].z : pixel[i].z_back;
          ASSERT_GE(pixel[i].z, 0);
          ASSERT_LE(pixel[i].z, back);
          ASSERT_TRUE(pixel[i].a == 1 || (!samples && pixel[i].a == 0 && pixel[i].z == back));
          if (i == 0) continue;
          // Sorted and without overlap, as OpenEXR defines TIDY.
          const float before_back = samples ? pixel[i - 1].z : pixel[i - 1].z_back;
          ASSERT_LT(pixel[i - 1].z, pixel[i].z);
          ASSERT_LE(before_back, pixel[i].z);
        }
      }
      ASSERT_GT(n, 0u);
    }
  }
}

TEST_F(ExrBridge, FloatDepthIsTheExactOneTimesTheScale) {
  std::mt19937_64 random(3);
  LayeredDepthImage image = image_of(1, 1, {clean_list(random, 1000)});
  image.world_from_image[2] = {0, 0, 0.0123, 0};
  const auto pixels = write_and_look(image, false);
  ASSERT_EQ(pixels[0].size(), 1000u);
  for (const Seen& sample : pixels[0]) {
    ASSERT_EQ(sample.z, static_cast<float>(sample.depth * 0.0123));
    ASSERT_EQ(sample.z_back, static_cast<float>(sample.depth_back * 0.0123));
  }
}

TEST_F(ExrBridge, TheHeaderHoldsTheTransform) {
  const LayeredDepthImage image = random_image(4, 6, 5);
  ASSERT_TRUE(write_ldi_exr(path, image));
  Imf::DeepScanLineInputFile file(path.c_str());
  const Imf::Header& header = file.header();
  EXPECT_EQ(header.compression(), Imf::ZIPS_COMPRESSION);
  EXPECT_EQ(header.dataWindow(), Imath::Box2i({0, 0}, {5, 4}));
  EXPECT_EQ(Imf::deepImageState(header), Imf::DIS_TIDY);
  EXPECT_EQ(header.typedAttribute<Imf::StringAttribute>("strata.mode").value(), "intervals");
  EXPECT_EQ(header.typedAttribute<Imf::IntAttribute>("strata.depth_limit").value(), 1 << 24);
  const glm::dmat4& m = image.world_from_image;
  EXPECT_EQ(header.typedAttribute<Imf::DoubleAttribute>("strata.depth_scale").value(),
            std::hypot(m[2][0], m[2][1], m[2][2]));
  // As EXR has it, a row vector times the matrix.
  const Imath::M44d matrix =
      header.typedAttribute<Imf::M44dAttribute>("strata.world_from_image").value();
  const Imath::V3d world = Imath::V3d(1.5, 2.5, 1000) * matrix;
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(world[i], m[0][i] * 1.5 + m[1][i] * 2.5 + m[2][i] * 1000 + m[3][i], 1e-9);
  }
}

TEST_F(ExrBridge, ASizeThatLiesIsRefusedBeforeMemoryIsTaken) {
  ASSERT_TRUE(write_ldi_exr(path, random_image(5, 6, 5)));
  std::string bytes = testkit::bytes_of(path);
  const std::size_t at = bytes.find(std::string("dataWindow\0box2i\0", 17));
  ASSERT_NE(at, std::string::npos);
  const std::int32_t side = 65535;
  std::memcpy(bytes.data() + at + 17 + 4 + 8, &side, 4);
  std::memcpy(bytes.data() + at + 17 + 4 + 12, &side, 4);
  write_bytes(path, bytes);
  const auto read = read_ldi_exr(path);
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().code, ErrorCode::kInput);
  EXPECT_NE(read.error().message.find("65536 x 65536"), std::string::npos) << read.error().message;
}

TEST_F(ExrBridge, WritingLeavesTheApplicationsThreadPoolAsItWas) {
  const LayeredDepthImage image = random_image(6, 50, 50);
  for (const int threads : {0, 3}) {
    Imf::setGlobalThreadCount(threads);
    Execution execution;
    execution.threads = 2;
    ASSERT_TRUE(write_ldi_exr(path, image, {}, execution));
    EXPECT_EQ(Imf::globalThreadCount(), threads);
  }
  Imf::setGlobalThreadCount(0);
}

}  // namespace
}  // namespace strata
