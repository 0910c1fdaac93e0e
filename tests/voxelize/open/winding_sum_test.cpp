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
  std::size_t known = 0, wrong = 0;  ///< angles; those that are off by more than they say
  double most_off = 0.0;             ///< of those that are known
  std::vector<double> exact;
};

Told tell(const WindingCaps& caps, const WindingView& view, const WindingPoints& centres,
          WindingSum& sum) {
  WindingPoints points = centres;
  Told result;
  sum.write(Way::kExact, caps, view, points);
  result.exact.assign(points.angle, points.angle + points.count);
  EXPECT_EQ(std::count(points.off, points.off + points.count, 0.0),
            static_cast<std::ptrdiff_t>(points.count));
  sum.write(Way::kQuick, caps, view, points);
  for (std::size_t i = 0; i < points.count; ++i) {
    if (!(points.off[i] <= 1)) continue;
    ++result.known;
    result.most_off = std::max(result.most_off, points.off[i]);
    result.wrong += std::abs(points.angle[i] - result.exact[i]) <= points.off[i] ? 0 : 1;
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

/// Of a cube of `side` voxels.
WindingView view_of(int side, const std::vector<std::uint32_t>& near, const WindingCaps& caps) {
  const double half = side * kLatticeSteps / 2.0;
  WindingView view{glm::dvec3(half), half * glm::length(caps.scale), near};
  view.farther.middle = view.middle;
  return view;
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

TEST(QuickAngles, OfCapsAreOffByNoMoreThanTheySay) {
  const auto run = [](const std::string& name) {
    SCOPED_TRACE(name);
    std::mt19937_64 random(60);
    WindingSum sum;
    double most_angle = 0;
    std::size_t known = 0, known_on_centres = 0;
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
      const Told told = tell(caps, view_of(side, near, caps), points, sum);
      EXPECT_EQ(told.wrong, 0u);
      for (const double angle : told.exact) most_angle = std::max(most_angle, std::abs(angle));
      (on_centres ? known_on_centres : known) += told.known;
      if (on_centres) continue;
      for (std::size_t i = 0; i < points.count; ++i) {
        EXPECT_NEAR(told.exact[i], angle_at(caps, near, {points.x[i], points.y[i], points.z[i]}),
                    1e-5);
      }
    }
    EXPECT_GT(most_angle, 4 * std::numbers::pi);  // sums that go around
    EXPECT_GT(known, 200u * WindingPoints::kMost * 95 / 100);
    EXPECT_GT(known_on_centres, 200u * WindingPoints::kMost / 3);
    EXPECT_LT(known_on_centres, 200u * WindingPoints::kMost * 9 / 10);  // caps meet points
  };
  EXPECT_GT(for_each_simd_target(run), 1);
}

TEST(QuickAngles, OfFarNodesAreOffByNoMoreThanTheySay) {
  std::mt19937_64 random(62);
  WindingSum sum;
  std::uniform_real_distribution<double> coordinate(-1, 1);
  const auto direction = [&] {
    return glm::normalize(glm::dvec3(coordinate(random), coordinate(random), coordinate(random)));
  };
  double most_angle = 0;
  for (int round = 0; round < 100; ++round) {
    WindingCaps caps;
    if (round % 2 == 1) caps.scale = {0.4, 1.0, 0.7};
    WindingView view = view_of(4 + round % 60, {}, caps);
    std::vector<std::uint32_t> far;
    for (std::uint32_t i = 0; i < 40; ++i) {
      WindingNode node;
      const double distance = view.radius * (i < 30 ? 2 : 9) * (1 + std::abs(coordinate(random)));
      const glm::dvec3 to = distance * direction();
      node.middle = view.middle + to / caps.scale;
      node.area = 0.2 * distance * distance;
      node.dipole = node.area * direction();
      view.far_bound += node.area / ((distance - view.radius) * (distance - view.radius));
      caps.nodes.push_back(node);
      if (i < 30) far.push_back(i);
      if (i >= 30) view.farther.add(node.dipole, to);
    }
    view.far = far;
    const Told told = tell(caps, view, random_centres(4 + round % 60, random), sum);
    EXPECT_EQ(told.known, std::size_t{WindingPoints::kMost});
    EXPECT_EQ(told.wrong, 0u);
    EXPECT_LT(told.most_off, 1e-3);
    for (const double angle : told.exact) most_angle = std::max(most_angle, std::abs(angle));
  }
  EXPECT_GT(most_angle, 2.0);
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
    const Told told = tell(caps, view_of(8, near, caps), random_centres(8, random), sum);
    EXPECT_EQ(told.known, std::size_t{WindingPoints::kMost});
    EXPECT_EQ(told.wrong, 0u);
    EXPECT_LT(told.most_off, 0.01);
    for (const double angle : told.exact) {
      EXPECT_NEAR(angle, (turned ? -120 : 120) * std::numbers::pi, 2.0);
    }
  }
}

}  // namespace
}  // namespace strata
