// The laws of random techniques: means, variances, and what is exact in spite of chance.

#include <gtest/gtest.h>

#include <cmath>

#include "strata/mesh/shapes.h"
#include "tests/transparency/choices.h"

namespace strata::transparency {
namespace {

struct Statistics {
  double mean = 0.0, variance = 0.0;
};
Statistics statistics(const std::vector<double>& values) {
  Statistics s;
  for (const double value : values) s.mean += value / static_cast<double>(values.size());
  for (const double value : values) {
    s.variance += (value - s.mean) * (value - s.mean) / static_cast<double>(values.size() - 1);
  }
  return s;
}
std::vector<double> channel(const Image& image, int c) {
  std::vector<double> values;
  for (const glm::vec4& pixel : image.pixels) values.push_back(static_cast<double>(pixel[c]));
  return values;
}

Settings seeded(std::uint64_t seed) {
  Settings settings;
  settings.seed = seed;
  return settings;
}

TEST(Stochastic, OpacityZeroAndOneAreExact) {
  ListedFrame frame = random_frame("Hard", {70, 66}, 5.0, 1 << 24, 91);
  for (std::size_t i = 0; i < frame.colours.size(); ++i) frame.colours[i].a = i % 3 == 0 ? 1 : 0;
  const auto reference = oracle_picture(frame, Blending::kFrontToBack);
  for (const std::string choice :
       {"stochastic:1", "stochastic:8", "stochastic:64:alpha-corrected", "stochastic:8:depth-based",
        "screen-door", "screen-door:same-pattern"}) {
    EXPECT_LE(largest_difference(render(frame, choice).image, reference), 1e-6f) << choice;
  }
}

TEST(Stochastic, OneLayerIsExactWithTheExactOpacity) {
  const ListedFrame frame = single_layers();
  const auto reference = oracle_picture(frame, Blending::kFrontToBack);
  for (const std::string choice : {"stochastic:1:alpha-corrected", "stochastic:8:alpha-corrected",
                                   "stochastic:8:depth-based"}) {
    EXPECT_LE(largest_difference(render(frame, choice).image, reference), 2e-6f) << choice;
  }
  EXPECT_GT(largest_difference(render(frame, "stochastic:8").image, reference), 0.01f);
}

TEST(Stochastic, CoverageHasTheStratifiedMeanAndVariance) {
  constexpr double kOpacity = 0.3, kSamples = 8;
  const ListedFrame frame = layers({{1, 1, 1, 0.3f}}, {5}, {200, 150});
  const Statistics s = statistics(channel(render(frame, "stochastic:8").image, 3));
  const double part = kOpacity * kSamples - std::floor(kOpacity * kSamples);
  const double variance = part * (1 - part) / (kSamples * kSamples);
  EXPECT_NEAR(s.mean, kOpacity, 4 * std::sqrt(variance / 30000));
  EXPECT_NEAR(s.variance, variance, 0.05 * variance);
  EXPECT_LT(s.variance, 0.2 * kOpacity * (1 - kOpacity) / kSamples);  // of independent samples
}

TEST(Stochastic, TheLayerBehindHasTheVarianceOfTheSubsets) {
  constexpr double kFront = 0.3, kBack = 0.6, kSamples = 8;
  const ListedFrame frame = layers({{1, 0, 0, 0.3f}, {0, 1, 0, 0.6f}}, {10, 20}, {200, 150});
  // Over the sizes of both subsets: the mean and variance of a hypergeometric number.
  double mean = 0.0, squares = 0.0;
  for (int i = 0; i < 4; ++i) {
    const double front = std::floor(kFront * kSamples) + (i & 1),
                 back = std::floor(kBack * kSamples) + (i >> 1);
    const double front_part = kFront * kSamples - std::floor(kFront * kSamples),
                 back_part = kBack * kSamples - std::floor(kBack * kSamples);
    const double chance =
        ((i & 1) != 0 ? front_part : 1 - front_part) * ((i >> 1) != 0 ? back_part : 1 - back_part);
    const double hidden = front / kSamples;
    const double seen = back * (1 - hidden);
    const double variance = back * hidden * (1 - hidden) * (kSamples - back) / (kSamples - 1);
    mean += chance * seen / kSamples;
    squares += chance * (variance + seen * seen) / (kSamples * kSamples);
  }
  const double variance = squares - mean * mean;
  const Statistics s = statistics(channel(render(frame, "stochastic:8").image, 1));
  EXPECT_NEAR(mean, kBack * (1 - kFront), 1e-12);
  EXPECT_NEAR(s.mean, mean, 4 * std::sqrt(variance / 30000));
  EXPECT_NEAR(s.variance, variance, 0.05 * variance);
}

TEST(Stochastic, PixelsAreIndependent) {
  const ListedFrame frame = layers({{1, 1, 1, 0.3f}}, {5}, {200, 150});
  const auto values = channel(render(frame, "stochastic:8").image, 3);
  const Statistics s = statistics(values);
  for (const std::size_t step : {1u, 2u, 64u, 200u, 201u}) {
    double sum = 0.0;
    for (std::size_t i = 0; i + step < values.size(); ++i) {
      sum += (values[i] - s.mean) * (values[i + step] - s.mean);
    }
    const auto count = static_cast<double>(values.size() - step);
    EXPECT_LT(std::abs(sum / count / s.variance), 5 / std::sqrt(count)) << step;
  }
}

TEST(Stochastic, EqualFragmentsCoverSamplesOfTheirOwn) {
  ListedFrame frame = layers({{1, 1, 1, 0.5f}}, {5, 5}, {100, 100});
  for (ListedFragment& f : frame.fragments) f.face = 0;
  const Statistics s = statistics(channel(render(frame, "stochastic:8").image, 3));
  EXPECT_NEAR(s.mean, 0.75, 0.005);
}

/// The root of the mean square error of the mean of some pictures.
double error_of_mean(const std::string& choice, int papers) {
  const ListedFrame frame = random_frame("Mixed", {130, 70}, 5.0, 1 << 24, 92, 0.1f, 0.8f);
  const auto reference = oracle_picture(frame, Blending::kFrontToBack);
  std::vector<glm::dvec4> sum(reference.size(), glm::dvec4(0.0));
  for (int i = 0; i < papers; ++i) {
    const Image image = render(frame, choice, seeded(100 + static_cast<std::uint64_t>(i))).image;
    for (std::size_t p = 0; p < sum.size(); ++p) sum[p] += glm::dvec4(image.pixels[p]);
  }
  double squares = 0.0;
  for (std::size_t p = 0; p < sum.size(); ++p) {
    const glm::dvec4 by = sum[p] / static_cast<double>(papers) - glm::dvec4(reference[p]);
    squares += by.x * by.x + by.y * by.y + by.z * by.z;
  }
  return std::sqrt(squares / (3.0 * static_cast<double>(sum.size())));
}

TEST(Stochastic, TheMeanOfPapersConvergesAsTheirRoot) {
  const double one = error_of_mean("stochastic:8", 1);
  EXPECT_NEAR(error_of_mean("stochastic:8", 4) / one, 0.5, 0.03);
  EXPECT_NEAR(error_of_mean("stochastic:8", 64) / one, 0.125, 0.01);
}

TEST(Stochastic, MoreSamplesAndExactOpacityHaveLessNoise) {
  const double eight = error_of_mean("stochastic:8", 1);
  EXPECT_NEAR(error_of_mean("stochastic:32", 1) / eight, 0.5, 0.1);
  EXPECT_LT(error_of_mean("stochastic:8:alpha-corrected", 1), 0.95 * eight);
  EXPECT_LT(error_of_mean("stochastic:8:depth-based", 1), 0.9 * eight);
  // Scaling has a bias, which samples mend.
  EXPECT_LT(error_of_mean("stochastic:32:alpha-corrected", 40), 0.01);
  EXPECT_LT(error_of_mean("stochastic:32:depth-based", 40), 0.01);
}

TEST(Stochastic, PicturesAreThoseOfTheSeed) {
  const ListedFrame frame = random_frame("Mixed", {70, 66}, 4.0, 1 << 24, 93);
  for (const std::string choice : {"stochastic", "stochastic:8:depth-based", "screen-door"}) {
    const Image first = render(frame, choice, seeded(1), 1).image;
    EXPECT_TRUE(same_bits(render(frame, choice, seeded(1), 4).image, first.pixels)) << choice;
    EXPECT_FALSE(same_bits(render(frame, choice, seeded(2), 1).image, first.pixels)) << choice;
  }
}

TEST(Stochastic, MemoryIsTheFormula) {
  const ListedFrame frame = random_frame("Mixed", {130, 70}, 4.0, 1 << 24, 94);
  for (const auto& [choice, bytes, passes] :
       {std::tuple("stochastic:8", 68u, 1u), std::tuple("stochastic:16:alpha-corrected", 140u, 2u),
        std::tuple("stochastic:8:depth-based", 72u, 2u), std::tuple("screen-door", 8u, 1u)}) {
    const Costs costs = render(frame, choice).costs;
    EXPECT_EQ(costs.formula_bytes, bytes * 130 * 70) << choice;
    EXPECT_EQ(costs.allocated_bytes, costs.formula_bytes) << choice;
    EXPECT_EQ(costs.geometry_passes, passes) << choice;
  }
}

TEST(ScreenDoor, OneLayerCoversItsShareOfEachBlock) {
  for (const float opacity : {0.1f, 0.25f, 0.5f, 0.77f}) {
    const ListedFrame frame = layers({{1, 1, 1, opacity}}, {5}, {136, 72});
    for (const std::string choice : {"screen-door", "screen-door:same-pattern"}) {
      const Image image = render(frame, choice).image;
      for (int block = 0; block < 17 * 9; ++block) {
        float covered = 0.0f;
        for (int i = 0; i < 64; ++i) {
          const int u = block % 17 * 8 + i % 8, v = block / 17 * 8 + i / 8;
          covered += image.pixels[static_cast<std::size_t>(v * 136 + u)].a / 64.0f;
        }
        ASSERT_NEAR(covered, opacity, 0.51f / 64.0f) << choice;
      }
    }
  }
}

TEST(ScreenDoor, OnePatternForAllLayersHidesThemWholly) {
  const ListedFrame frame = layers({{1, 0, 0, 0.5f}, {0, 1, 0, 0.5f}}, {10, 20}, {400, 400});
  const Image same = render(frame, "screen-door:same-pattern").image;
  EXPECT_NEAR(statistics(channel(same, 3)).mean, 0.5, 1e-9);
  EXPECT_EQ(statistics(channel(same, 1)).mean, 0.0);
  const Image permuted = render(frame, "screen-door").image;
  EXPECT_NEAR(statistics(channel(permuted, 3)).mean, 0.75, 0.003);
  EXPECT_NEAR(statistics(channel(permuted, 1)).mean, 0.25, 0.003);
  EXPECT_NEAR(statistics(channel(permuted, 0)).mean, 0.5, 1e-9);
  // In each block, too: the part that two random halves of 64 have in common has this variance.
  std::vector<double> blocks;
  for (int block = 0; block < 2500; ++block) {
    double covered = 0.0;
    for (int i = 0; i < 64; ++i) {
      const int u = block % 50 * 8 + i % 8, v = block / 50 * 8 + i / 8;
      covered += static_cast<double>(permuted.pixels[static_cast<std::size_t>(v * 400 + u)].a) / 64;
    }
    blocks.push_back(covered);
  }
  const double variance = 64 * 0.25 * 0.25 * 64 / 63 / (64.0 * 64.0);
  EXPECT_NEAR(statistics(blocks).variance, variance, 0.25 * variance);
}

/// A square that fills the picture, turned about its middle, seen from above without perspective.
Result<Frame> tilted(const Scene& scene, glm::ivec2 size) {
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.rotation = glm::dvec3(0.0);
  camera.distance = 10.0;
  auto view = make_view(camera, size, bounds(scene.mesh));
  if (!view) return tl::unexpected(view.error());
  return Frame::make(scene, *view);
}
Scene tilted_square(double degrees, float opacity) {
  Scene scene;
  const double angle = degrees * 3.14159265358979 / 180.0;
  for (const glm::dvec2 corner :
       {glm::dvec2(-40, -9), glm::dvec2(40, -9), glm::dvec2(40, 9), glm::dvec2(-40, 9)}) {
    scene.mesh.positions.emplace_back(corner.x * std::cos(angle), corner.y,
                                      corner.x * std::sin(angle));
  }
  scene.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.objects = {{"square", {1, 1, 1, opacity}}};
  return scene;
}

TEST(SilhouetteOpaque, ATiltedSurfaceIsMoreOpaque) {
  const Technique& sot = **find_technique("sot");
  constexpr double kOpacity = 0.3;
  double last = 0.0;
  for (const double degrees : {0.0, 30.0, 45.0, 60.0, 75.0}) {
    const Scene scene = tilted_square(degrees, 0.3f);
    const auto frame = tilted(scene, {130, 70});
    ASSERT_TRUE(frame);
    const auto rendering = frame->render(sot);
    ASSERT_TRUE(rendering);
    const double longer = 1.0 / std::cos(degrees * 3.14159265358979 / 180.0);
    const double mean = statistics(channel(rendering->image, 3)).mean;
    EXPECT_GT(mean, 1 - std::exp(-kOpacity * longer) - 0.005) << degrees;
    EXPECT_LT(mean, kOpacity * longer + 0.005) << degrees;
    EXPECT_NEAR(mean, 1 - std::pow(1 - kOpacity, longer), 0.03) << degrees;
    EXPECT_GT(mean, last + 0.02) << degrees;
    last = mean;
    const double points = kOpacity * 130 * 70 * 16 * longer;
    EXPECT_NEAR(static_cast<double>(rendering->costs.stored), points, 0.02 * points) << degrees;
    EXPECT_EQ(rendering->costs.formula_bytes, 8u * 16 * 130 * 70);
    if (degrees == 0.0) {
      EXPECT_NEAR(mean, kOpacity, 0.005);
    }
  }
}

/// A square on the ground, in n x n squares of two triangles, seen from one corner.
Scene ground(int n) {
  Scene scene;
  const double step = 200.0 / n;
  for (int y = 0; y <= n; ++y) {
    for (int x = 0; x <= n; ++x) scene.mesh.positions.emplace_back(x * step - 100, y * step, 0);
  }
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const auto a = static_cast<std::uint32_t>(y * (n + 1) + x),
                 b = a + static_cast<std::uint32_t>(n) + 1;
      scene.mesh.triangles.emplace_back(a, a + 1, b + 1);
      scene.mesh.triangles.emplace_back(a, b + 1, b);
    }
  }
  scene.objects = {{"ground", {1, 1, 1, 0.1f}}};
  return scene;
}

TEST(SilhouetteOpaque, GroundIsTheMoreOpaqueTheFartherItIsWhateverItsTriangles) {
  constexpr int kHeight = 96;
  std::vector<std::vector<double>> rows;
  for (const int n : {1, 64}) {
    const Scene scene = ground(n);
    Camera camera = look_at({0, -1, 2}, {0, 5, 0});
    camera.field_of_view = 40.0;
    const auto view = make_view(camera, {130, kHeight}, bounds(scene.mesh));
    ASSERT_TRUE(view);
    const auto frame = Frame::make(scene, *view);
    ASSERT_TRUE(frame);
    const auto rendering = frame->render(**find_technique("sot"));
    ASSERT_TRUE(rendering);
    rows.emplace_back();
    for (int v = 0; v < kHeight; ++v) {
      double sum = 0.0;
      for (int u = 0; u < 130; ++u) {
        sum +=
            static_cast<double>(rendering->image.pixels[static_cast<std::size_t>(v * 130 + u)].a);
      }
      rows.back().push_back(sum / 130);
    }
  }
  // The view looks down by atan(2 / 6); a row's rays meet the ground at their own angles.
  const double focal = kHeight / 2.0 / std::tan(20.0 * 3.14159265358979 / 180.0);
  for (const int v : {20, 35, 50, 65, 80, 94}) {
    const double down = std::atan2(2.0, 6.0) + std::atan((v + 0.5 - kHeight / 2.0) / focal);
    const double expected = 1 - std::pow(0.9, 1 / std::sin(down));
    for (const auto& row : rows) {
      EXPECT_NEAR(row[static_cast<std::size_t>(v)], expected, 0.1 * expected + 0.01) << v;
    }
    EXPECT_NEAR(rows[0][static_cast<std::size_t>(v)], rows[1][static_cast<std::size_t>(v)], 0.05)
        << v;
  }
}

TEST(SilhouetteOpaque, ASurfaceThatIsSeenFromItsEdgeEnds) {
  const Scene scene = ground(1);
  const auto view = make_view(look_at({0, -1, 1e-7}, {0, 5, 0}), {130, 70}, bounds(scene.mesh));
  ASSERT_TRUE(view);
  const auto frame = Frame::make(scene, *view);
  ASSERT_TRUE(frame);
  const auto rendering = frame->render(**find_technique("sot"));
  ASSERT_TRUE(rendering);
  int seen = 0;
  for (const glm::vec4& pixel : rendering->image.pixels) seen += pixel.a > 0.0f ? 1 : 0;
  EXPECT_LE(seen, 2 * 130);
  EXPECT_LT(rendering->costs.stored, 2'000'000'000u);
}

TEST(SilhouetteOpaque, ABallIsMoreOpaqueAtItsRim) {
  Scene scene;
  scene.mesh = make_icosphere(1.0, 4);
  scene.objects = {{"ball", {1, 1, 1, 0.2f}}};
  Camera camera;
  fit_camera(camera, bounds(scene.mesh));
  const auto view = make_view(camera, {160, 160}, bounds(scene.mesh));
  ASSERT_TRUE(view);
  const auto frame = Frame::make(scene, *view);
  ASSERT_TRUE(frame);
  const auto rendering = frame->render(**find_technique("sot"));
  ASSERT_TRUE(rendering);
  const auto exact = frame->render(*techniques().front());
  ASSERT_TRUE(exact);
  double middle = 0.0, rim = 0.0, rim_exact = 0.0;
  int middles = 0, rims = 0, seen = 0;
  for (const glm::vec4& pixel : exact->image.pixels) seen += pixel.a > 0.0f ? 1 : 0;
  const double radius = std::sqrt(seen / 3.14159265358979);
  ASSERT_GT(radius, 20.0);
  for (int v = 0; v < 160; ++v) {
    for (int u = 0; u < 160; ++u) {
      const double r = std::hypot(u - 79.5, v - 79.5) / radius;
      const auto i = static_cast<std::size_t>(v * 160 + u);
      if (r < 0.2) {
        middle += static_cast<double>(rendering->image.pixels[i].a);
        ++middles;
      } else if (r > 0.85 && r < 0.93) {
        rim += static_cast<double>(rendering->image.pixels[i].a);
        rim_exact += static_cast<double>(exact->image.pixels[i].a);
        ++rims;
      }
    }
  }
  EXPECT_NEAR(rim_exact / rims, 1 - 0.8 * 0.8, 0.02);
  EXPECT_NEAR(middle / middles, 1 - 0.8 * 0.8, 0.02);
  EXPECT_GT(rim / rims, 0.45);
}

TEST(SilhouetteOpaque, OpaqueObjectsHidePointsAndOpacityOneCovers) {
  Scene scene = tilted_square(0.0, 1.0f);
  for (const glm::dvec3 p : tilted_square(0.0, 0.5f).mesh.positions) {
    scene.mesh.positions.push_back(p - glm::dvec3(0, 0, 1));
  }
  scene.mesh.triangles.insert(scene.mesh.triangles.end(), {{4, 5, 6}, {4, 6, 7}});
  scene.object_of = {0, 0, 1, 1};
  scene.objects = {{"above", {1, 0, 0, 1.0f}}, {"below", {0, 1, 0, 0.5f}}};
  const auto hidden = tilted(scene, {70, 66});
  ASSERT_TRUE(hidden);
  const auto rendering = hidden->render(**find_technique("sot"));
  ASSERT_TRUE(rendering);
  for (const glm::vec4& pixel : rendering->image.pixels) ASSERT_EQ(pixel.g, 0.0f);
  FrameOptions options;
  options.opaque_first = false;
  const Scene alone = tilted_square(30.0, 1.0f);
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.rotation = glm::dvec3(0.0);
  camera.distance = 10.0;
  const auto view = make_view(camera, {70, 66}, bounds(alone.mesh));
  ASSERT_TRUE(view);
  const auto covered = Frame::make(alone, *view, options);
  ASSERT_TRUE(covered);
  const auto picture = covered->render(**find_technique("sot"));
  ASSERT_TRUE(picture);
  EXPECT_GT(statistics(channel(picture->image, 3)).mean, 0.999);
}

TEST(SilhouetteOpaque, NeedsTriangles) {
  const ListedFrame frame = single_layers();
  auto made = Frame::make(frame.fragments, frame.colours, frame.options);
  ASSERT_TRUE(made);
  EXPECT_FALSE(made->render(**find_technique("sot")));
}

}  // namespace
}  // namespace strata::transparency
