// How much of its surroundings a visible point sees, against sums over directions.

#include "picture/occlusion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "tests/support/simd_targets.h"

namespace strata {
namespace {

struct Hit {
  glm::dvec3 position, normal;
};
/// The first point of a ray.
using Cast = std::function<std::optional<Hit>(const glm::dvec3& from, const glm::dvec3& along)>;

constexpr double kDistance = 20.0;  ///< of the positions' origin from the eye

/// What a camera that looks along -z sees; the origin is `kDistance` away from it.
EyeSurfaces seen(int width, int height, double pixels, bool perspective, const Cast& cast) {
  EyeSurfaces image;
  image.perspective = perspective;
  image.scale = perspective ? pixels * kDistance : pixels;
  image.centre = {width / 2.0, height / 2.0};
  image.origin_distance = kDistance;
  image.resize(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const glm::dvec3 at((x + 0.5 - image.centre.x) / image.scale,
                          (image.centre.y - y - 0.5) / image.scale, 0);
      const glm::dvec3 eye(0, 0, kDistance);
      const auto hit = perspective ? cast(eye, glm::dvec3(at.x, at.y, -1))
                                   : cast(at + eye, glm::dvec3(0, 0, -1));
      const auto i = static_cast<std::size_t>(y * width + x);
      image.positions[i] = hit ? glm::vec3(hit->position) : EyeSurfaces::kNowhere;
      image.normals[i] = hit ? glm::vec3(hit->normal) : glm::vec3(0, 0, 1);
    }
  }
  return image;
}

/// The point of a plane through the origin.
std::optional<Hit> plane(const glm::dvec3& normal, const glm::dvec3& from,
                         const glm::dvec3& along) {
  const double down = glm::dot(normal, along);
  if (!(down < 0)) return std::nullopt;
  return Hit{from - along * (glm::dot(normal, from) / down), normal};
}

TEST(Openness, OfAPlaneIsAllOfIt) {
  for (const bool perspective : {false, true}) {
    for (const glm::dvec3& n : {glm::dvec3(0, 0, 1), {0.3, 0.5, 0.8}, {0.9, 0, 0.2}}) {
      const glm::dvec3 normal = glm::normalize(n);
      const auto image = seen(120, 90, 20, perspective, [&](const auto& from, const auto& along) {
        return plane(normal, from, along);
      });
      for (const std::uint8_t open : openness(image, 1.0)) ASSERT_EQ(open, 255);
    }
  }
}

/// Three walls that meet at a right-angled corner, seen from inside.
constexpr double kThird = 0.57735026918962576;
const glm::dvec3 kWalls[] = {
    {std::sqrt(2.0 / 3), 0, kThird},
    {-std::sqrt(1.0 / 6), std::sqrt(0.5), kThird},
    {-std::sqrt(1.0 / 6), -std::sqrt(0.5), kThird},
};
std::optional<Hit> corner(const glm::dvec3& from, const glm::dvec3& along) {
  std::optional<Hit> first;
  for (const glm::dvec3& wall : kWalls) {
    const auto hit = plane(wall, from, along);
    if (!hit) continue;
    if (std::all_of(std::begin(kWalls), std::end(kWalls), [&](const glm::dvec3& other) {
          return glm::dot(other, hit->position) > -1e-9;
        })) {
      first = hit;
    }
  }
  return first;
}

/// By definition: over all directions, weighted by the cosine, what two walls that stand on a floor
/// hide of it; less where they are far.
double openness_at(double to_one, double to_other, double radius) {
  constexpr int kTurns = 120, kRings = 40;
  double hidden = 0;
  for (int i = 0; i < kTurns; ++i) {
    const double angle = 2 * 3.141592653589793 * (i + 0.5) / kTurns;
    for (int ring = 0; ring < kRings; ++ring) {
      const double sine = std::sqrt((ring + 0.5) / kRings);  // of the angle to the normal
      const double x = sine * std::cos(angle), y = sine * std::sin(angle);
      double far = 1e30;
      if (x < 0) far = std::min(far, to_one / -x);
      if (y < 0) far = std::min(far, to_other / -y);
      hidden += std::max(0.0, 1 - std::pow(far / radius, 4)) / (kTurns * kRings);
    }
  }
  return 1 - hidden;
}

TEST(Openness, InARightAngledCornerIsThatOfAllDirections) {
  const double radius = 2.0;
  for (const bool perspective : {false, true}) {
    const auto image = seen(240, 240, 30, perspective, corner);
    const auto open = openness(image, radius);
    double worst = 0, sum = 0;
    int count = 0;
    for (int y = 40; y < 200; ++y) {
      for (int x = 40; x < 200; ++x) {
        const auto i = static_cast<std::size_t>(y * 240 + x);
        std::vector<double> distances;
        for (const glm::dvec3& wall : kWalls) {
          distances.push_back(glm::dot(wall, glm::dvec3(image.positions[i])));
        }
        std::sort(distances.begin(), distances.end());
        if (distances[1] < 0.1) continue;  // within three pixels of an edge
        if (++count % 23 != 0) continue;
        const double wanted = openness_at(distances[1], distances[2], radius);
        const double off = open[i] / 255.0 - wanted;
        worst = std::max(worst, std::abs(off));
        sum += std::abs(off);
      }
    }
    ASSERT_GT(count, 10000);
    EXPECT_LT(worst, 0.25) << perspective;
    EXPECT_LT(sum / (count / 23), 0.08) << perspective;
  }
}

TEST(Openness, OfWhatLiesFarBehindIsNotDarkenedAroundAnOutline) {
  const double radius = 1.0;
  const auto image = seen(160, 160, 20, false, [](const glm::dvec3& from, const glm::dvec3&) {
    const bool front = std::abs(from.x) < 2 && std::abs(from.y) < 2;
    return Hit{{from.x, from.y, front ? 3.0 : 0.0}, {0, 0, 1}};
  });
  for (const std::uint8_t open : openness(image, radius)) ASSERT_EQ(open, 255);
}

TEST(Openness, IsTheSameForEverySimdTarget) {
  for (const bool perspective : {false, true}) {
    // No whole number of vectors is as wide; one vector is wider than the last.
    for (const int width : {93, 64, 3}) {
      auto image = seen(width, 57, 12, perspective, corner);
      for (const bool curved : {false, true}) {
        if (curved) {
          image.curved.resize(static_cast<std::size_t>(width) * 57);
          for (std::size_t i = 0; i < image.curved.size(); ++i) image.curved[i] = i % 7 < 4 ? 1 : 0;
        }
        const auto best = openness(image, 1.5);
        ASSERT_NE(*std::min_element(best.begin(), best.end()), 255);
        testkit::for_each_simd_target(
            [&](const std::string& target) { EXPECT_EQ(openness(image, 1.5), best) << target; });
      }
    }
  }
}

TEST(Openness, AlongARowIsThatOfEachPixel) {
  for (const bool perspective : {false, true}) {
    const auto image = seen(93, 57, 12, perspective, corner);
    const auto open = openness(image, 1.5);
    for (const float step : {1.0f, 0.5f, 0.37f}) {
      for (const int v : {0, 20, 41, static_cast<int>(57 / step) - 1}) {
        for (const glm::dvec3& wall : kWalls) {
          const SeenPlane plane{glm::vec3(wall), 0.01f};
          const auto away = [&](const glm::vec3& there) {
            const float distance =
                perspective ? static_cast<float>(kDistance - double{there.z}) : 1;
            return std::abs(glm::dot(plane.normal, there) - plane.offset) /
                   (2.0f * (distance / static_cast<float>(image.scale)));
          };
          const auto row = static_cast<std::size_t>(93 / step);
          std::vector<float> each;
          for (std::size_t u = 0; u < row; ++u) {
            const glm::dvec2 place((static_cast<float>(u) + 0.5f) * step - 0.5f,
                                   (static_cast<float>(v) + 0.5f) * step - 0.5f);
            each.push_back(openness_between(image, open, place, plane.normal, away));
          }
          testkit::for_each_simd_target([&](const std::string& target) {
            std::vector<float> along(row);
            openness_along(image, open, {0, v, step}, plane, along);
            EXPECT_EQ(along, each) << target;
          });
        }
      }
    }
  }
}

TEST(Openness, IsTheSameForAnyNumberOfThreadsAndEmptyPictures) {
  const auto image = seen(97, 61, 12, true, corner);
  Execution one, three;
  one.threads = 1, three.threads = 3;
  EXPECT_EQ(openness(image, 1.5, one), openness(image, 1.5, three));
  EyeSurfaces nothing;
  nothing.resize(5, 4);
  std::fill(nothing.positions.begin(), nothing.positions.end(), EyeSurfaces::kNowhere);
  for (const std::uint8_t open : openness(nothing, 1.0)) EXPECT_EQ(open, 255);
  nothing.resize(0, 0);
  EXPECT_TRUE(openness(nothing, 1.0).empty());
}

}  // namespace
}  // namespace strata
