#include "strata/transparency/stream/frame.h"

#include <gtest/gtest.h>

#include <stop_token>

#include "strata/mesh/shapes.h"
#include "strata/transparency/techniques.h"
#include "tests/transparency/listed_frames.h"

namespace strata::transparency {
namespace {

/// Squares at z = 0, 1, 2 .. that fill the picture, seen from above.
Scene squares(const std::vector<glm::vec4>& colours) {
  Scene scene;
  for (std::uint32_t i = 0; i < colours.size(); ++i) {
    const auto first = static_cast<std::uint32_t>(scene.mesh.positions.size());
    for (const glm::dvec2 corner :
         {glm::dvec2(-9, -9), glm::dvec2(9, -9), glm::dvec2(9, 9), glm::dvec2(-9, 9)}) {
      scene.mesh.positions.emplace_back(corner, i);
    }
    scene.mesh.triangles.emplace_back(first, first + 1, first + 2);
    scene.mesh.triangles.emplace_back(first, first + 2, first + 3);
    scene.object_of.insert(scene.object_of.end(), 2, i);
    scene.objects.push_back({"square", colours[i]});
  }
  return scene;
}

View from_above(const Scene& scene, glm::ivec2 size) {
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.rotation = glm::dvec3(0.0);
  camera.distance = 10.0;
  auto view = make_view(camera, size, bounds(scene.mesh));
  EXPECT_TRUE(view);
  return *view;
}

Image picture(const Scene& scene, const FrameOptions& options, glm::ivec2 size = {70, 66}) {
  auto frame = Frame::make(scene, from_above(scene, size), options);
  EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
  auto rendering = frame->render(*techniques().front());
  EXPECT_TRUE(rendering);
  return rendering->image;
}

/// The light on a face that looks at the eye.
const float kLight = eye_light(glm::dvec3(0, 0, 1));

TEST(Frame, SquaresBlendFromTheTopDown) {
  const Scene scene = squares({{1, 0, 0, 0.5f}, {0, 1, 0, 0.25f}});
  FrameOptions options;
  options.background = glm::vec4(0, 0, 1, 1);
  const Image image = picture(scene, options);
  ASSERT_EQ(image.pixels.size(), 70u * 66u);
  for (const glm::vec4& pixel : image.pixels) {
    ASSERT_NEAR(pixel.g, 0.25 * kLight, 1e-6);
    ASSERT_NEAR(pixel.r, 0.75 * 0.5 * kLight, 1e-6);
    ASSERT_NEAR(pixel.b, 0.75 * 0.5, 1e-6);
    ASSERT_NEAR(pixel.a, 1.0, 1e-6);
  }
}

TEST(Frame, OpaqueObjectsHideWhatLiesBehindThem) {
  const Scene scene = squares({{1, 0, 0, 0.5f}, {0, 1, 0, 1.0f}, {1, 1, 1, 0.5f}});
  const Image image = picture(scene, {});
  for (const glm::vec4& pixel : image.pixels) {
    ASSERT_NEAR(pixel.r, 0.5 * kLight, 1e-6);
    ASSERT_NEAR(pixel.g, kLight, 1e-6);
    ASSERT_NEAR(pixel.b, 0.5 * kLight, 1e-6);
    ASSERT_EQ(pixel.a, 1.0f);
  }
  FrameOptions all;
  all.opaque_first = false;
  EXPECT_EQ(picture(scene, all).pixels, image.pixels);
}

TEST(Frame, SamplesAreTheMeanOfAFinerPicture) {
  Scene scene = squares({{1, 0, 0, 0.5f}});
  for (glm::dvec3& p : scene.mesh.positions) p *= 0.2;  // the edge of the square is in the picture
  FrameOptions options;
  options.samples = 16;
  const Image image = picture(scene, options, {33, 20});
  auto fine_options = FrameOptions{};
  const Image fine = picture(scene, fine_options, {132, 80});
  ASSERT_EQ(image.pixels.size(), 33u * 20u);
  int partly = 0;
  for (int v = 0; v < 20; ++v) {
    for (int u = 0; u < 33; ++u) {
      glm::dvec4 sum(0.0);
      for (int i = 0; i < 16; ++i) {
        sum += glm::dvec4(
            fine.pixels[static_cast<std::size_t>((v * 4 + i / 4) * 132 + u * 4 + i % 4)]);
      }
      const glm::vec4& pixel = image.pixels[static_cast<std::size_t>(v * 33 + u)];
      for (int c = 0; c < 4; ++c) ASSERT_NEAR(pixel[c], sum[c] / 16, 1e-6);
      partly += pixel.a > 0.01f && pixel.a < 0.49f ? 1 : 0;
    }
  }
  EXPECT_GT(partly, 10);
}

TEST(Frame, RefusesWhatIsOutOfRange) {
  const std::vector<glm::vec4> colours{{1, 1, 1, 1}};
  const auto message = [&](ListedFragment f, FrameOptions options) {
    auto frame = Frame::make(std::vector{f}, colours, options);
    return frame ? std::string() : frame.error().message;
  };
  FrameOptions options;
  options.size = {4, 4};
  EXPECT_EQ(message({0, 0, 0, 0, false}, options), "");
  EXPECT_NE(message({4, 0, 0, 0, false}, options).find("pixel (4, 0)"), std::string::npos);
  EXPECT_NE(message({0, 0, 1u << 24, 0, false}, options).find("16777216"), std::string::npos);
  EXPECT_NE(message({0, 0, 0, 1, false}, options).find("face 1"), std::string::npos);
  options.samples = 3;
  EXPECT_NE(message({0, 0, 0, 0, false}, options).find("got 3"), std::string::npos);
}

TEST(Frame, StopsOnRequest) {
  const Scene scene = squares({{1, 0, 0, 0.5f}});
  auto frame = Frame::make(scene, from_above(scene, {200, 200}));
  ASSERT_TRUE(frame);
  std::stop_source stop;
  stop.request_stop();
  Execution execution;
  execution.stop = stop.get_token();
  const auto rendering = frame->render(*techniques().front(), {}, execution);
  ASSERT_FALSE(rendering);
  EXPECT_EQ(rendering.error().code, ErrorCode::kCancelled);
}

TEST(Frame, MemoryThatEndsBeforeTheFirstTileIsAnError) {
  const Scene scene = squares({{1, 0, 0, 0.5f}});
  auto frame = Frame::make(scene, from_above(scene, {20, 20}));
  ASSERT_TRUE(frame);
  Technique hungry = *techniques().front();
  hungry.name = "hungry";
  hungry.prepare = [](const FrameInfo&, const Settings&,
                      const Execution&) -> Result<std::shared_ptr<const void>> {
    throw std::bad_alloc();
  };
  const auto rendering = frame->render(hungry);
  ASSERT_FALSE(rendering);
  EXPECT_EQ(rendering.error().code, ErrorCode::kLimit);
  EXPECT_NE(rendering.error().message.find("hungry"), std::string::npos);
}

TEST(Techniques, AreFoundByTheirNames) {
  for (const Technique* technique : techniques()) {
    EXPECT_EQ(*find_technique(technique->name), technique);
    EXPECT_NE(technique->make, nullptr);
    EXPECT_FALSE(technique->title.empty() || technique->paper.empty());
  }
  const auto none = find_technique("count");
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("count-scan"), std::string::npos);
}

}  // namespace
}  // namespace strata::transparency
