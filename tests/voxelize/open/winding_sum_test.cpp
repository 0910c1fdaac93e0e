// Quick sums of solid angles: as far from exact ones as they say, wherever the points are.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "strata/raster/lattice_mesh.h"
#include "tests/support/simd_targets.h"
#include "voxelize/open/winding_angles.h"

namespace strata {
namespace {

using testkit::for_each_simd_target;
using Way = WindingSum::Way;

WindingCaps caps_of(const std::vector<glm::ivec3>& vertices,
                    const std::vector<glm::uvec3>& triangles, const glm::dvec3& scale) {
  WindingCaps result;
  result.scale = scale;
  result.vertices = static_cast<std::uint32_t>(vertices.size());
  for (const glm::uvec3& t : triangles) {
    WindingCap cap;
    cap.vertices = t;
    for (int i = 0; i < 3; ++i) {
      cap.lattice[i] = vertices[t[i]];
      cap.corners[i] = cap.lattice[i];
    }
    const glm::dvec3 e = (cap.corners[1] - cap.corners[0]) * scale,
                     f = (cap.corners[2] - cap.corners[0]) * scale;
    cap.normal = glm::cross(e, f);
    cap.doubt = 4e-15 * glm::length(e) * glm::length(f);
    if (glm::dot(cap.normal, cap.normal) > 0) result.caps.push_back(cap);
  }
  return result;
}

/// What the two ways say of the same points.
struct Told {
  double off = 0.0;       ///< what the quick way says it may be off by
  double farthest = 0.0;  ///< how far it is off
  bool known = true;
  std::vector<double> exact;
};

Told tell(const WindingCaps& caps, const std::vector<std::uint32_t>& near, WindingPoints points,
          WindingSum& sum) {
  Told result;
  EXPECT_EQ(sum.write(Way::kExact, caps, near, {}, {}, points), 0.0);
  result.exact.assign(points.angle, points.angle + points.count);
  const auto off = sum.write(Way::kQuick, caps, near, {}, {}, points);
  result.known = off.has_value();
  if (!off) return result;
  result.off = *off;
  for (std::size_t i = 0; i < points.count; ++i) {
    result.farthest = std::max(result.farthest, std::abs(points.angle[i] - result.exact[i]));
  }
  return result;
}

WindingPoints random_centres(int side, std::mt19937_64& random) {
  WindingPoints points;
  points.count = WindingPoints::kMost;
  const auto centre = [&] {
    return static_cast<double>(random() % static_cast<unsigned>(side)) * kLatticeSteps +
           kLatticeSteps / 2.0;
  };
  for (std::size_t i = 0; i < points.count; ++i) {
    points.x[i] = centre(), points.y[i] = centre(), points.z[i] = centre();
  }
  return points;
}

/// The sum by the mathematical library, of points that lie on no cap.
double angle_at(const WindingCaps& caps, const std::vector<std::uint32_t>& near,
                const glm::dvec3& p) {
  double sum = 0;
  for (const std::uint32_t index : near) {
    const auto& corners = caps.caps[index].corners;
    const glm::dvec3 a = (corners[0] - p) * caps.scale, b = (corners[1] - p) * caps.scale,
                     c = (corners[2] - p) * caps.scale;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    sum += 2 * std::atan2(
                   glm::dot(a, glm::cross(b, c)),
                   la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
  }
  return sum;
}

TEST(QuickAngles, AreOffByNoMoreThanTheySay) {
  const auto run = [](const std::string& name) {
    SCOPED_TRACE(name);
    std::mt19937_64 random(60);
    WindingSum sum;
    double most_angle = 0;
    int unknown = 0;
    for (int round = 0; round < 400; ++round) {
      SCOPED_TRACE(round);
      // Vertices anywhere, or on voxel centres: points then lie on caps, their edges and corners.
      const bool on_centres = round % 2 == 1;
      const int side = 2 + round % 9;
      std::vector<glm::ivec3> vertices(4 + random() % 12);
      for (glm::ivec3& v : vertices) {
        for (int i = 0; i < 3; ++i) {
          v[i] = static_cast<int>(random() % static_cast<unsigned>(side * kLatticeSteps));
          if (on_centres) v[i] = v[i] / kLatticeSteps * kLatticeSteps + kLatticeSteps / 2;
        }
      }
      std::vector<glm::uvec3> triangles(1 + random() % 40);
      for (glm::uvec3& t : triangles) {
        for (int i = 0; i < 3; ++i) t[i] = static_cast<std::uint32_t>(random() % vertices.size());
      }
      const glm::dvec3 scale = round % 3 == 0 ? glm::dvec3(1, 0.8, 0.3) : glm::dvec3(1.0);
      const WindingCaps caps = caps_of(vertices, triangles, scale);
      std::vector<std::uint32_t> near;
      for (std::uint32_t i = 0; i < caps.caps.size(); ++i) {
        if (random() % 4 > 0) near.push_back(i);
      }
      const WindingPoints points = random_centres(side, random);
      const Told told = tell(caps, near, points, sum);
      EXPECT_LE(told.farthest, told.off);
      EXPECT_LE(told.off, 1e-5);
      for (const double angle : told.exact) most_angle = std::max(most_angle, std::abs(angle));
      if (on_centres) {
        unknown += told.known ? 0 : 1;
        continue;
      }
      EXPECT_TRUE(told.known);
      for (std::size_t i = 0; i < points.count; ++i) {
        EXPECT_NEAR(told.exact[i], angle_at(caps, near, {points.x[i], points.y[i], points.z[i]}),
                    1e-5);
      }
    }
    EXPECT_GT(most_angle, 4 * std::numbers::pi);  // sums that go around
    EXPECT_GT(unknown, 0);                        // points that are corners
    EXPECT_LT(unknown, 200);
  };
  EXPECT_GT(for_each_simd_target(run), 1);
}

TEST(QuickAngles, OfManyCapsGoAroundOftenBothWays) {
  // Sheets above and below the points, each seen as almost half of everything.
  WindingSum sum;
  for (const bool turned : {false, true}) {
    std::vector<glm::ivec3> vertices;
    std::vector<glm::uvec3> triangles;
    for (int sheet = 0; sheet < 60; ++sheet) {
      const int z = 3000 + 7 * sheet, far = 1 << 22;
      const auto first = static_cast<std::uint32_t>(vertices.size());
      vertices.insert(vertices.end(), {{-far, -far, z}, {far, -far, z}, {0, far, z}});
      triangles.emplace_back(first, first + 1, first + 2);
      if (turned) std::swap(triangles.back().y, triangles.back().z);
    }
    const WindingCaps caps = caps_of(vertices, triangles, glm::dvec3(1.0));
    std::vector<std::uint32_t> near(caps.caps.size());
    for (std::uint32_t i = 0; i < near.size(); ++i) near[i] = i;
    std::mt19937_64 random(61);
    const Told told = tell(caps, near, random_centres(8, random), sum);
    ASSERT_TRUE(told.known);
    EXPECT_LE(told.farthest, told.off);
    for (const double angle : told.exact) {
      EXPECT_NEAR(angle, (turned ? -120 : 120) * std::numbers::pi, 2.0);
    }
  }
}

}  // namespace
}  // namespace strata
