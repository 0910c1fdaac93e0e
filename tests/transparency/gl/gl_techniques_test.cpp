// Techniques on the GPU: their pictures are those of the sorted lists, or what their formulas say.

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>
#include <vector>

#include <glm/ext/matrix_transform.hpp>

#include "strata/mesh/shapes.h"
#include "strata/transparency/techniques.h"
#include "tests/gl/gl_testing.h"
#include "transparency/gl/gl_frame.h"

namespace strata::transparency {

static void PrintTo(const GlTechnique& technique, std::ostream* out) { *out << technique.name; }

namespace {

constexpr glm::ivec2 kSize(150, 110);

/// Spheres in a row along the line of sight, each seen through those before it.
Scene spheres(int count, float opacity) {
  Scene scene;
  for (int i = 0; i < count; ++i) {
    // Turned, so that no edge runs through a column of pixel centres.
    TriangleSoup sphere = transform(make_uv_sphere(1.0, 24, 12),
                                    glm::rotate(glm::dmat4(1.0), 0.4, glm::dvec3(0.3, 0.8, 0.5)));
    for (glm::dvec3& p : sphere.positions) p += glm::dvec3(0.23 * i, 0.11 * i, -2.5 * i);
    const std::size_t before = scene.mesh.triangles.size();
    append(scene.mesh, sphere);
    scene.object_of.resize(scene.mesh.triangles.size(), static_cast<std::uint32_t>(i));
    EXPECT_GT(scene.mesh.triangles.size(), before);
    const float hue = static_cast<float>(i) / static_cast<float>(count);
    scene.objects.push_back({"sphere", {hue, 1.0f - hue, 0.5f, opacity}});
  }
  return scene;
}

/// Squares behind each other, the nearest first.
Scene squares(int count, float opacity) {
  Scene scene = spheres(count, opacity);
  scene.mesh = {};
  scene.object_of.clear();
  for (int i = 0; i < count; ++i) {
    const auto first = static_cast<std::uint32_t>(scene.mesh.positions.size());
    for (const glm::dvec2 corner :
         {glm::dvec2(-1.1, -1), glm::dvec2(1, -1.2), glm::dvec2(1.3, 1), glm::dvec2(-1, 1)}) {
      scene.mesh.positions.emplace_back(corner + 0.21 * i, -2.5 * i);
    }
    scene.mesh.triangles.emplace_back(first, first + 1, first + 2);
    scene.mesh.triangles.emplace_back(first, first + 2, first + 3);
    scene.object_of.insert(scene.object_of.end(), 2, static_cast<std::uint32_t>(i));
  }
  return scene;
}

Frame frame_of(const Scene& scene) {
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.rotation = glm::dvec3(0.0);
  const Bounds box = bounds(scene.mesh);
  centre_camera(camera, box);
  fit_camera(camera, box, 150.0 / 110.0);
  camera.distance *= 0.25;
  FrameOptions options;
  options.opaque_first = false;
  auto frame = Frame::make(scene, *make_view(camera, kSize, box), options);
  EXPECT_TRUE(frame);
  return *frame;
}

Image reference(const Frame& frame, std::uint64_t* most_layers = nullptr) {
  auto rendering = frame.render(**find_technique("count-scan"));
  EXPECT_TRUE(rendering);
  if (most_layers != nullptr) *most_layers = rendering->costs.most_layers;
  return rendering->image;
}

/// Pixels with a channel that differs by more than `limit`.
int differing(const Image& a, const Image& b, float limit) {
  int count = a.pixels.size() == b.pixels.size() ? 0 : 1 << 30;
  for (std::size_t i = 0; i < std::min(a.pixels.size(), b.pixels.size()); ++i) {
    const glm::vec4 by = glm::abs(a.pixels[i] - b.pixels[i]);
    count += std::max({by.r, by.g, by.b, by.a}) > limit ? 1 : 0;
  }
  return count;
}

class GlTechniques : public test::GlTest, public testing::WithParamInterface<GlTechnique> {
 protected:
  /// Skips where the driver cannot.
  void render(const Frame& frame, GlRasterizer rasterizer, const Settings& settings,
              Rendering& out) {
    auto renderer = GetParam().make(*context_, settings);
    if (!renderer) {
      ASSERT_EQ(renderer.error().code, ErrorCode::kUsage);
      GTEST_SKIP() << renderer.error().message;
    }
    auto on_gpu = GlFrame::make(*context_, frame.source(), rasterizer);
    ASSERT_TRUE(on_gpu) << on_gpu.error().message;
    auto rendering = (*on_gpu)->render(**renderer);
    ASSERT_TRUE(rendering) << rendering.error().message;
    const auto again = (*on_gpu)->render(**renderer);
    ASSERT_TRUE(again);
    EXPECT_EQ(differing(again->image, rendering->image, 1e-6f), 0) << "a second time";
    out = std::move(*rendering);
  }
};

constexpr float kRounding = 2e-6f;

class Exact : public GlTechniques {};
class UnorderedExact : public GlTechniques {};
class Rows : public GlTechniques {};
class Mlab : public GlTechniques {};
class Sums : public GlTechniques {};

TEST_P(UnorderedExact, GiveThePictureOfTheCpu) {
  if (GetParam().accuracy != Accuracy::kExact || GetParam().ordered)
    GTEST_SKIP() << "is another test";
  const Scene scene = spheres(9, 0.4f);
  const Frame frame = frame_of(scene);
  std::uint64_t layers = 0;
  const Image expected = reference(frame, &layers);
  ASSERT_GE(layers, 16u);
  Rendering rendering;
  render(frame, GlRasterizer::kCompute, {}, rendering);
  if (rendering.image.pixels.empty()) return;
  EXPECT_EQ(differing(rendering.image, expected, kRounding), 0);
  EXPECT_GT(rendering.costs.geometry_passes, 0u);
  EXPECT_GT(rendering.costs.allocated_bytes, 0u);
}

TEST_P(Exact, DifferInFewPixelsWithTheHardwareRasterizer) {
  const Scene scene = spheres(7, 0.4f);
  const Frame frame = frame_of(scene);
  Rendering rendering;
  render(frame, GlRasterizer::kHardware, {}, rendering);
  if (rendering.image.pixels.empty()) return;
  EXPECT_LT(differing(rendering.image, reference(frame), 0.5f / 255), kSize.x * kSize.y / 200);
}

TEST_P(Rows, AreExactWithAsManyAsLayers) {
  if (!GetParam().ordered || GetParam().accuracy == Accuracy::kExact)
    GTEST_SKIP() << "is another test";
  const Scene scene = spheres(1, 0.4f);  // two layers
  const Frame frame = frame_of(scene);
  Rendering rendering;
  render(frame, GlRasterizer::kHardware, {}, rendering);
  if (rendering.image.pixels.empty()) return;
  EXPECT_LT(differing(rendering.image, reference(frame), 0.5f / 255), kSize.x * kSize.y / 200);
}

TEST_P(Mlab, IsExactForObjectsFromTheFrontToTheBack) {
  const Scene scene = squares(7, 0.4f);
  const Frame frame = frame_of(scene);
  Rendering rendering;
  render(frame, GlRasterizer::kHardware, {}, rendering);
  if (rendering.image.pixels.empty()) return;
  EXPECT_LT(differing(rendering.image, reference(frame), 0.5f / 255), kSize.x * kSize.y / 200);
}

TEST_P(Sums, HaveTheValueOfTheirFormula) {
  const bool average = GetParam().name == "weighted-average";
  Scene scene = spheres(3, 0.3f);
  const Frame frame = frame_of(scene);
  Rendering rendering;
  render(frame, GlRasterizer::kCompute, {}, rendering);
  ASSERT_FALSE(rendering.image.pixels.empty());
  // Three spheres: n = 0, 2, 4 or 6 fragments of opacity 0.3.
  int six = 0;
  for (const glm::vec4& pixel : rendering.image.pixels) {
    bool found = false;
    for (const int n : {0, 2, 4, 6}) {
      const float sum = 0.3f * static_cast<float>(n);
      const float alpha = average ? 1.0f - std::pow(0.7f, static_cast<float>(n)) : sum;
      if (std::abs(pixel.a - alpha) > 1e-4f) continue;
      found = true;
      six += n == 6 ? 1 : 0;
    }
    ASSERT_TRUE(found) << pixel.a;
  }
  EXPECT_GT(six, 3000);
}

std::string test_name(const testing::TestParamInfo<GlTechnique>& info) {
  std::string name;
  bool upper = true;
  for (const char c : info.param.name) {
    const bool letter = std::isalnum(static_cast<unsigned char>(c)) != 0;
    if (letter) name += upper ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
    upper = !letter;
  }
  return name;
}

template <class Chosen>
auto those(Chosen&& chosen) {
  std::vector<GlTechnique> some;
  for (const GlTechnique& technique : gl_techniques()) {
    if (chosen(technique)) some.push_back(technique);
  }
  return testing::ValuesIn(some);
}
bool is_exact(const GlTechnique& of) { return of.accuracy == Accuracy::kExact; }

INSTANTIATE_TEST_SUITE_P(Gl, Exact, those(is_exact), test_name);
INSTANTIATE_TEST_SUITE_P(Gl, UnorderedExact,
                         those([](const GlTechnique& of) { return is_exact(of) && !of.ordered; }),
                         test_name);
INSTANTIATE_TEST_SUITE_P(Gl, Rows,
                         those([](const GlTechnique& of) { return !is_exact(of) && of.ordered; }),
                         test_name);
INSTANTIATE_TEST_SUITE_P(Gl, Mlab, those([](const GlTechnique& of) { return of.name == "mlab"; }),
                         test_name);
INSTANTIATE_TEST_SUITE_P(Gl, Sums, those([](const GlTechnique& of) {
                           return of.name.starts_with("weighted-");
                         }),
                         test_name);

}  // namespace
}  // namespace strata::transparency
