#include "mesh/polygons/polygon_cutter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <random>
#include <set>

namespace strata {
namespace {

using Points = std::vector<glm::dvec3>;
using Triangles = std::vector<glm::uvec3>;

/// The triangles of a polygon, the fan written out.
Triangles cut(const Points& polygon) {
  PolygonCutter cutter;
  const auto found = cutter.cut(polygon);
  Triangles triangles(found.begin(), found.end());
  if (triangles.empty()) {
    for (std::uint32_t k = 2; k < polygon.size(); ++k) triangles.emplace_back(0, k - 1, k);
  }
  return triangles;
}

glm::dvec3 area_vector(const Points& p, const glm::uvec3& t) {
  return glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x]) / 2.0;
}

glm::dvec3 area_vector(const Points& p) {
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < p.size(); ++i) sum += glm::cross(p[i], p[(i + 1) % p.size()]) / 2.0;
  return sum;
}

/// Each edge of the polygon once, and each other as often there as back.
void expect_outline(const Triangles& triangles, std::uint32_t count) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  for (const glm::uvec3& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      ++uses[{t[k], t[(k + 1) % 3]}];
      --uses[{t[(k + 1) % 3], t[k]}];
    }
  }
  for (const auto& [edge, balance] : uses) {
    const int wanted = edge.second == (edge.first + 1) % count   ? 1
                       : edge.first == (edge.second + 1) % count ? -1
                                                                 : 0;
    EXPECT_EQ(balance, wanted) << edge.first << " " << edge.second;
  }
}

/// Triangles that turn with the polygon and fill it once.
void expect_filled(const Points& polygon, const Triangles& triangles) {
  expect_outline(triangles, static_cast<std::uint32_t>(polygon.size()));
  const glm::dvec3 whole = area_vector(polygon);
  double sum = 0.0;
  for (const glm::uvec3& t : triangles) {
    EXPECT_GE(glm::dot(area_vector(polygon, t), whole), -1e-12 * glm::dot(whole, whole));
    sum += glm::length(area_vector(polygon, t));
  }
  EXPECT_NEAR(sum, glm::length(whole), 1e-9 * glm::length(whole));
}

/// Flat points put in some plane in space.
Points tilted(const std::vector<glm::dvec2>& flat, std::mt19937& random) {
  std::normal_distribution<double> number;
  const glm::dvec3 n = glm::normalize(glm::dvec3(number(random), number(random), number(random)));
  const glm::dvec3 u = glm::normalize(glm::cross(n, glm::dvec3(0.31, -0.7, 0.4)));
  const glm::dvec3 v = glm::cross(n, u), origin(number(random), number(random), number(random));
  Points points;
  for (const glm::dvec2& p : flat) points.push_back(origin + p.x * u + p.y * v);
  return points;
}

/// A star-shaped polygon.
std::vector<glm::dvec2> star(std::size_t corners, std::mt19937& random) {
  std::uniform_real_distribution<double> radius(0.2, 1.0);
  std::vector<glm::dvec2> points;
  for (std::size_t i = 0; i < corners; ++i) {
    const double angle = 6.283185307 * static_cast<double>(i) / static_cast<double>(corners);
    const double r = radius(random);
    points.emplace_back(r * std::cos(angle), r * std::sin(angle));
  }
  return points;
}

std::vector<glm::dvec2> comb(int teeth) {
  std::vector<glm::dvec2> points = {{0, -1}, {2.0 * teeth, -1}};
  for (int i = teeth; i-- > 0;) {
    points.emplace_back(2 * i + 1.5, 50);
    points.emplace_back(2 * i + 0.5, 0.5 * (i % 3));
  }
  return points;
}

std::set<std::array<std::uint32_t, 3>> as_set(const Triangles& triangles, std::uint32_t first,
                                              std::uint32_t count) {
  std::set<std::array<std::uint32_t, 3>> result;
  for (const glm::uvec3& t : triangles) {
    std::array<std::uint32_t, 3> one{(t.x + first) % count, (t.y + first) % count,
                                     (t.z + first) % count};
    std::rotate(one.begin(), std::min_element(one.begin(), one.end()), one.end());
    result.insert(one);
  }
  return result;
}

TEST(PolygonCutter, FlatConvexPolygonsAreFansFromTheirFirstCorner) {
  std::mt19937 random(1);
  for (const std::size_t corners : {4u, 5u, 6u, 17u}) {
    std::vector<glm::dvec2> flat;
    for (std::size_t i = 0; i < corners; ++i) {
      const double angle = 6.283185307 * static_cast<double>(i) / static_cast<double>(corners);
      flat.emplace_back(3 * std::cos(angle), std::sin(angle));
    }
    const Points points = tilted(flat, random);
    PolygonCutter cutter;
    EXPECT_TRUE(cutter.cut(points).empty());
    EXPECT_FALSE(cutter.bend().large());
    EXPECT_TRUE(corners != 4 || cut_quad(points[0], points[1], points[2], points[3]).fan);
  }
}

TEST(PolygonCutter, ConcavePolygonsAreFilledOnceInAnyPlane) {
  std::mt19937 random(2);
  for (int round = 0; round < 300; ++round) {
    const Points points = tilted(star(4 + random() % 30, random), random);
    expect_filled(points, cut(points));
  }
  for (const int teeth : {2, 7, 40}) {
    const Points points = tilted(comb(teeth), random);
    expect_filled(points, cut(points));
  }
}

TEST(PolygonCutter, WholeCoordinatesWithCornersOnLinesAreFilledOnce) {
  // A U with corners along its edges: a sweep meets many of them in one line.
  std::vector<glm::dvec2> flat;
  const auto walk = [&flat](int dx, int dy, int steps) {
    for (int i = 0; i < steps; ++i) flat.push_back(flat.back() + glm::dvec2(dx, dy));
  };
  flat.emplace_back(0, 0);
  walk(1, 0, 9), walk(0, 1, 6), walk(-1, 0, 3), walk(0, -1, 4), walk(-1, 0, 3), walk(0, 1, 4);
  walk(-1, 0, 3), walk(0, -1, 5);
  for (int turn = 0; turn < 4; ++turn) {
    Points points;
    for (glm::dvec2& p : flat) p = {-p.y, p.x}, points.emplace_back(p, 1);
    const Triangles triangles = cut(points);
    EXPECT_EQ(triangles.size(), points.size() - 2);
    expect_filled(points, triangles);
  }
}

TEST(PolygonCutter, PolygonsThatTouchThemselvesAreFilledOnce) {
  const auto expect_area = [](const Points& points, double area) {
    double sum = 0.0;
    for (const glm::uvec3& t : cut(points)) {
      EXPECT_GE(area_vector(points, t).z, 0.0);
      sum += area_vector(points, t).z;
    }
    EXPECT_EQ(sum, area);
  };
  // A square with a square hole, joined by a bridge that is walked twice; begun anywhere.
  Points keyhole = {{0, 0, 0}, {9, 0, 0}, {9, 9, 0}, {0, 9, 0}, {0, 0, 0},
                    {3, 3, 0}, {3, 6, 0}, {6, 6, 0}, {6, 3, 0}, {3, 3, 0}};
  for (std::size_t i = 0; i < keyhole.size(); ++i) {
    std::rotate(keyhole.begin(), keyhole.begin() + 1, keyhole.end());
    expect_area(keyhole, 72.0);
  }
  // A spike, two squares that meet in a corner, and a hole that touches the outline.
  expect_area({{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {9, 9, 0}, {4, 4, 0}, {2, 1, 0}, {0, 4, 0}}, 10.0);
  expect_area(
      {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {8, 4, 0}, {8, 8, 0}, {4, 8, 0}, {4, 4, 0}, {0, 4, 0}},
      32.0);
  expect_area({{0, 0, 0}, {9, 0, 0}, {9, 9, 0}, {0, 9, 0}, {0, 0, 0}, {2, 5, 0}, {5, 5, 0}},
              81 - 7.5);
}

TEST(PolygonCutter, OutlinesAreKeptWhateverTheyAreLike) {
  // Few places, so that corners meet, edges cross and corners lie above each other.
  std::mt19937 random(6);
  int cuts = 0;
  for (int round = 0; round < 5000; ++round) {
    Points points;
    const auto side = 2 + random() % 4, high = 1 + random() % 3;
    const std::size_t count = 4 + random() % 12;
    while (points.size() < count) {
      points.emplace_back(random() % side, random() % side,
                          0.3 * static_cast<double>(random() % high));
    }
    PolygonCutter cutter;
    const auto triangles = cutter.cut(points);
    if (triangles.empty()) continue;
    ++cuts;
    EXPECT_LE(triangles.size(), count - 2);
    std::map<std::array<double, 6>, int> uses;
    const auto use = [&](const glm::dvec3& a, const glm::dvec3& b, int times) {
      uses[{a.x, a.y, a.z, b.x, b.y, b.z}] += times;
      uses[{b.x, b.y, b.z, a.x, a.y, a.z}] -= times;
    };
    for (std::size_t i = 0; i < count; ++i) use(points[i], points[(i + 1) % count], -1);
    for (const glm::uvec3& t : triangles) {
      for (int k = 0; k < 3; ++k) use(points[t[k]], points[t[(k + 1) % 3]], 1);
    }
    for (const auto& [edge, balance] : uses) ASSERT_EQ(balance, 0) << round;
  }
  EXPECT_GT(cuts, 3000);
}

TEST(PolygonCutter, CutsDoNotDependOnTheFirstCorner) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> bend(-0.3, 0.3);
  for (int round = 0; round < 200; ++round) {
    const auto count = static_cast<std::uint32_t>(4 + random() % 9);
    Points points;
    for (const glm::dvec2& p : star(count, random)) points.emplace_back(p, bend(random));
    if (round % 3 == 0) {  // a grid's cell: both cuts are equally long
      points = {{0, 0, bend(random)}, {2, 0, 0}, {2, 1, bend(random)}, {0, 1, 0}};
    }
    const auto n = static_cast<std::uint32_t>(points.size());
    const auto expected = as_set(cut(points), 0, n);
    EXPECT_EQ(expected.size(), n - 2);
    for (std::uint32_t first = 1; first < n; ++first) {
      Points turned = points;
      std::rotate(turned.begin(), turned.begin() + first, turned.end());
      EXPECT_EQ(as_set(cut(turned), first, n), expected) << round << " " << first;
      if (n != 4) continue;
      const bool fan = cut_quad(turned[0], turned[1], turned[2], turned[3]).fan;
      const Triangles quad =
          fan ? Triangles{{0, 1, 2}, {0, 2, 3}} : Triangles{{1, 2, 3}, {1, 3, 0}};
      EXPECT_EQ(as_set(quad, first, n), expected) << round << " " << first;
    }
  }
}

TEST(PolygonCutter, BentPolygonsAreDelaunayInTheirView) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> bend(-0.02, 0.02);
  const auto angle = [](const Points& p, std::uint32_t at, std::uint32_t a, std::uint32_t b) {
    const glm::dvec2 u(p[a] - p[at]), v(p[b] - p[at]);
    return std::abs(std::atan2(u.x * v.y - u.y * v.x, glm::dot(u, v)));
  };
  for (int round = 0; round < 100; ++round) {
    Points points;
    for (const glm::dvec2& p : star(4 + random() % 20, random))
      points.emplace_back(p, bend(random));
    const Triangles triangles = cut(points);
    ASSERT_EQ(triangles.size(), points.size() - 2);
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> opposite;
    for (const glm::uvec3& t : triangles) {
      for (int k = 0; k < 3; ++k) opposite[{t[k], t[(k + 1) % 3]}] = t[(k + 2) % 3];
    }
    for (const auto& [edge, corner] : opposite) {
      const auto back = opposite.find({edge.second, edge.first});
      if (back == opposite.end()) continue;
      EXPECT_LT(angle(points, corner, edge.first, edge.second) +
                    angle(points, back->second, edge.first, edge.second),
                3.14159265 + 0.011);
    }
  }
}

TEST(PolygonCutter, SizeOfTheBendIsTold) {
  PolygonCutter cutter;
  (void)cutter.cut(Points{{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {0, 4, 0}, {-1, 1, 0.5}});
  EXPECT_TRUE(cutter.bend().large());
  EXPECT_NEAR(cutter.bend().height, 0.5, 0.2);
  EXPECT_NEAR(cutter.bend().size, std::sqrt(16 + 16 + 0.25), 1e-12);
  const QuadCut quad = cut_quad({0, 0, 14}, {10, 0, 10}, {10, 10, 14}, {0, 10, 10});
  EXPECT_TRUE(quad.bend.large());
  EXPECT_DOUBLE_EQ(quad.bend.height, 4.0);
  EXPECT_NE(quad.bend.text().find("deviate 4 from a plane"), std::string::npos) << quad.bend.text();
}

TEST(PolygonCutter, WhatHasNoPlaneStaysAFan) {
  PolygonCutter cutter;
  EXPECT_TRUE(cutter.cut(Points(5, {1, 2, 3})).empty());
  EXPECT_TRUE(cutter.cut(Points{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}}).empty());
  EXPECT_TRUE(
      cutter.cut(Points{{0, 0, 0}, {1e200, 0, 0}, {1e200, 1e200, 1}, {0, 1e200, 0}}).empty());
  EXPECT_TRUE(cut_quad({0, 0, 0}, {1e200, 0, 0}, {1e200, 1e200, 1e180}, {0, 1e200, 0}).fan);
}

TEST(PolygonCutter, TimeGrowsWithTheCornersNotWithTheirSquare) {
  const auto time_of = [](int teeth) {
    std::mt19937 random(5);  // the same plane
    const Points points = tilted(comb(teeth), random);
    double least = 1e9;
    for (int i = 0; i < 3; ++i) {
      const auto start = std::chrono::steady_clock::now();
      EXPECT_EQ(cut(points).size(), points.size() - 2);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      least = std::min(least, took.count());
    }
    return least;
  };
  // 16 times the corners; squared it would be 256 times, and caches help the small one.
  EXPECT_LT(time_of(64'000), 150.0 * time_of(4'000));
}

TEST(PolygonCutter, TimeOfPolygonsThatCrossThemselvesStaysBounded) {
  const auto time_of = [](const Points& points) {
    const auto start = std::chrono::steady_clock::now();
    const Triangles triangles = cut(points);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    glm::dvec3 sum(0.0);
    for (const glm::uvec3& t : triangles) sum += area_vector(points, t);
    const glm::dvec3 wanted = area_vector(points);
    EXPECT_NEAR(sum.z, wanted.z, 1e-9 * std::abs(wanted.z));
    return took.count();
  };
  const auto scattered = [](int count) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> place(0.0, 1.0);
    Points points(static_cast<std::size_t>(count));
    for (glm::dvec3& p : points) p = {place(random), place(random), 0.0};
    return points;
  };
  // Four times the corners: 64 times where each ear is looked for among all that is left.
  EXPECT_LT(time_of(scattered(4'000)), 24.0 * time_of(scattered(1'000)));
  const auto rounds = [](int times) {
    Points points;
    for (int i = 0; i < times; ++i) points.insert(points.end(), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    return points;
  };
  EXPECT_LT(time_of(rounds(32'000)), 100.0 * time_of(rounds(2'000)));
}

}  // namespace
}  // namespace strata
