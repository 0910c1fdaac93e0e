#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <random>

#include "csg/outline/triangulate_pieces.h"
#include "tests/csg/outline/outline_checks.h"

namespace strata::csg {
namespace {

using testing::area;
using testing::check;
using testing::moved;

/// Every point a corner, every contour edge used once, nothing turned around.
void expect_exact(const Outline& outline, std::size_t holes = 0, bool touches = false) {
  const auto triangles = triangulate(outline);
  const auto report = check(outline, triangles);
  const double size = area(outline);
  EXPECT_TRUE(report.closed);
  EXPECT_NEAR(report.positive, size, 1e-9 * size);
  EXPECT_LE(report.negative, 1e-9 * size);
  // Points in one place may be joined without a bridge: two triangles less each time.
  const std::size_t count = testing::points(outline).size();
  const std::size_t loops = outline.contours.size() - holes;
  EXPECT_LE(triangles.size(), count + 2 * holes - 2 * loops);
  if (!touches) {
    EXPECT_EQ(triangles.size(), count + 2 * holes - 2 * loops);
  }
  std::vector<bool> used(count, false);
  for (const glm::uvec3& t : triangles) used[t.x] = used[t.y] = used[t.z] = true;
  EXPECT_TRUE(std::all_of(used.begin(), used.end(), [](bool u) { return u; }));
}

std::vector<glm::dvec2> reversed(std::vector<glm::dvec2> contour) {
  std::reverse(contour.begin(), contour.end());
  return contour;
}

TEST(Triangulate, ConvexConcaveAndHoles) {
  expect_exact(make_square({1, 1}, false));
  expect_exact({{{{0, 0}, {4, 0}, {4, 4}, {2, 1}, {0, 4}}}});
  const std::array ring{make_square({10, 10}, true), make_square({6, 6}, true)};
  expect_exact(subtract(ring), 1);
}

TEST(Triangulate, CollinearPointsAreKept) {
  std::vector<glm::dvec2> contour;
  for (int i = 0; i < 20; ++i) contour.emplace_back(i, 0);
  for (int i = 0; i < 10; ++i) contour.emplace_back(20, i);
  contour.emplace_back(20, 10);
  contour.emplace_back(0, 10);
  expect_exact({{contour}});
  // A triangle whose third corner is all that is off the line.
  contour.clear();
  for (int i = 0; i <= 20; ++i) contour.emplace_back(i, 0);
  contour.emplace_back(7, 3);
  expect_exact({{contour}});
}

TEST(Triangulate, NestedIslands) {
  Outline nested;
  for (int i = 0; i < 21; ++i) {
    const double side = 100 - 4 * i;
    auto contour = make_square({side, side}, true).contours[0];
    nested.contours.push_back(i % 2 ? reversed(contour) : contour);
  }
  expect_exact(nested, 10);
}

TEST(Triangulate, HoleThatTouchesTheOuterContourAtAVertex) {
  const std::vector<glm::dvec2> outer{{0, 0}, {10, 0}, {10, 10}, {0, 10}};
  for (int corner = 0; corner < 4; ++corner) {
    const glm::dvec2 at = outer[static_cast<std::size_t>(corner)];
    const glm::dvec2 to_middle = (glm::dvec2(5, 5) - at) / 5.0;
    std::vector<glm::dvec2> hole{at, at + to_middle * glm::dvec2(3, 1),
                                 at + to_middle * glm::dvec2(3, 3),
                                 at + to_middle * glm::dvec2(1, 3)};
    if (signed_area(hole) > 0) hole = reversed(hole);
    expect_exact({{outer, hole}}, 1, true);
  }
}

TEST(Triangulate, HolesThatTouchTheContourAndEachOther) {
  const std::vector<glm::dvec2> outer{{0, 0}, {12, 0}, {12, 6}, {0, 6}, {0, 3}};
  const std::vector<glm::dvec2> left{{0, 3}, {3, 5}, {6, 3}, {3, 1}};
  const std::vector<glm::dvec2> right{{6, 3}, {8, 5}, {10, 3}, {8, 1}};
  expect_exact({{outer, left, right}}, 2, true);
  expect_exact({{outer, right, left}}, 2, true);
  // Two holes with the same leftmost point, and one that touches an edge between its ends.
  const std::vector<glm::dvec2> up{{4, 3}, {5, 5}, {8, 4}}, down{{4, 3}, {8, 2}, {5, 1}};
  expect_exact({{outer, up, down}}, 2, true);
  const std::vector<glm::dvec2> edge{{0, 1}, {2, 2}, {2, 1}};
  expect_exact({{{{0, 0}, {12, 0}, {12, 6}, {0, 6}}, edge}}, 1);
}

TEST(Triangulate, DiamondWhoseCornersAllTouchTheSquare) {
  const std::vector<glm::dvec2> square{{0, 0}, {2, 0}, {4, 0}, {4, 2},
                                       {4, 4}, {2, 4}, {0, 4}, {0, 2}};
  const std::vector<glm::dvec2> diamond{{2, 0}, {0, 2}, {2, 4}, {4, 2}};
  const auto triangles = triangulate({{square, diamond}});
  const auto report = check({{square, diamond}}, triangles);
  EXPECT_TRUE(report.closed);
  EXPECT_DOUBLE_EQ(report.positive, 8);
  EXPECT_DOUBLE_EQ(report.negative, 0);
}

TEST(Triangulate, ContourThatTouchesItself) {
  // Two squares joined at a corner, run through in one go.
  expect_exact({{{{0, 0}, {2, 0}, {2, 2}, {4, 2}, {4, 4}, {2, 4}, {2, 2}, {0, 2}}}}, 0, true);
}

TEST(Triangulate, RowsOfHolesAtTheSameHeight) {
  Outline plate = make_square({100, 100}, false);
  Segments segments;
  segments.fn = 16;
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) {
      const Outline hole = moved(make_circle(1.5, segments), 2.5 + 5 * i, 2.5 + 5 * j);
      plate.contours.push_back(reversed(hole.contours[0]));
    }
  }
  expect_exact(plate, 400);
}

TEST(Triangulate, SpiralsAndCombs) {
  std::vector<glm::dvec2> spiral;
  for (int i = 0; i <= 4000; ++i) {
    const double a = 0.02 * i;
    spiral.emplace_back((1 + a) * std::cos(a), (1 + a) * std::sin(a));
  }
  for (int i = 4000; i >= 0; --i) {
    const double a = 0.02 * i;
    spiral.emplace_back((2 + a) * std::cos(a), (2 + a) * std::sin(a));
  }
  expect_exact({{reversed(spiral)}});
  std::vector<glm::dvec2> comb;
  for (int i = 0; i < 3000; ++i) {
    comb.emplace_back(i, 0);
    comb.emplace_back(i + 0.5, 100);
  }
  comb.emplace_back(3000, 0);
  comb.emplace_back(3000, -1);
  comb.emplace_back(0, -1);
  expect_exact({{reversed(comb)}});
}

TEST(Triangulate, RandomStarsAndTheirBooleans) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int round = 0; round < 300; ++round) {
    std::vector<Outline> stars;
    for (int s = 0; s < 6; ++s) {
      std::vector<glm::dvec2> star;
      const int n = 5 + static_cast<int>(60 * unit(random));
      for (int i = 0; i < n; ++i) {
        const double a = 2 * std::numbers::pi * i / n, r = 1 + 9 * unit(random);
        star.emplace_back(r * std::cos(a), r * std::sin(a));
      }
      stars.push_back(moved({{star}}, 10 * unit(random), 10 * unit(random)));
    }
    const Outline sum = unite(std::span(stars).first(3)), other = unite(std::span(stars).last(3));
    const std::array both{sum, other};
    for (const Outline& outline : {sum, subtract(both), intersect(both)}) {
      const auto report = check(outline, triangulate(outline));
      EXPECT_TRUE(report.closed) << round;
      EXPECT_NEAR(report.positive - report.negative, area(outline), 1e-9) << round;
      EXPECT_LE(report.negative, 1e-9 * area(outline)) << round;
    }
  }
}

TEST(Triangulate, LatticeBooleansFullOfTouchingPoints) {
  // Unions of cells of a grid touch at corners everywhere.
  std::mt19937 random(11);
  for (int round = 0; round < 300; ++round) {
    std::vector<Outline> cells;
    for (int x = 0; x < 12; ++x) {
      for (int y = 0; y < 12; ++y) {
        if (random() % 2) cells.push_back(moved(make_square({1, 1}, false), x, y));
      }
    }
    const Outline outline = unite(cells);
    const auto report = check(outline, triangulate(outline));
    EXPECT_TRUE(report.closed) << round;
    EXPECT_NEAR(report.positive, static_cast<double>(cells.size()), 1e-9) << round;
    EXPECT_NEAR(report.negative, 0, 1e-9) << round;
  }
}

TEST(Triangulate, NonsenseStillHasTheOutlineAsItsBoundary) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int round = 0; round < 100; ++round) {
    Outline wild;
    for (int c = 0; c < 4; ++c) {
      auto& contour = wild.contours.emplace_back();
      for (int i = 0; i < 3 + round % 20; ++i) contour.emplace_back(unit(random), unit(random));
    }
    EXPECT_TRUE(check(wild, triangulate(wild)).closed) << round;
  }
  EXPECT_TRUE(triangulate({}).empty());
  EXPECT_TRUE(triangulate({{{{0, 0}, {1, 1}}}}).empty());
  EXPECT_TRUE(
      check({{{{1, 1}, {1, 1}, {1, 1}, {1, 1}}}}, triangulate({{{{1, 1}, {1, 1}, {1, 1}, {1, 1}}}}))
          .closed);
}

TEST(Triangulate, HundredThousandPoints) {
  Segments segments;
  segments.fn = 40;
  Outline plate = make_square({1000, 1000}, false);
  for (int i = 0; i < 50; ++i) {
    for (int j = 0; j < 50; ++j) {
      const double r = 4 + (i * 7 + j * 13) % 5;
      plate.contours.push_back(
          reversed(moved(make_circle(r, segments), 10 + 20 * i, 10 + 20 * j).contours[0]));
    }
  }
  expect_exact(plate, 2500);
  segments.fn = 20000;
  expect_exact(make_circle(3, segments));
}

TEST(Triangulate, PiecesWithTheirHolesGiveTheSameRegion) {
  std::mt19937 random(3);
  Outline outline;
  const auto ring = [&](double x, double y, double r, int count, bool hole) {
    auto& contour = outline.contours.emplace_back();
    for (int i = 0; i < count; ++i) {
      const double a = 360.0 * (hole ? count - i : i) / count;
      contour.emplace_back(x + r * cos_degrees(a), y + r * sin_degrees(a));
    }
  };
  // Rings in rows, islands in some of their holes, boxes that overlap; a frame around a part.
  for (int i = 0; i < 300; ++i) {
    const double x = 10 * (i % 60), y = 9.5 * (i / 60);
    ring(x, y, 4.5, 5 + static_cast<int>(random() % 20), false);
    ring(x, y, 2, 3 + static_cast<int>(random() % 9), true);
    if (i % 3 == 0) ring(x, y, 0.5, 4, false);
  }
  std::shuffle(outline.contours.begin(), outline.contours.end(), random);
  outline.contours.push_back({{-50, -50}, {700, -50}, {700, 100}, {-50, 100}});
  outline.contours.push_back({{-40, -40}, {-40, 90}, {690, 90}, {690, -40}});
  const auto triangles = triangulate_pieces(outline);
  const auto report = testing::check(outline, triangles);
  EXPECT_TRUE(report.closed);
  EXPECT_EQ(report.negative, 0);
  EXPECT_NEAR(report.positive, testing::area(outline), 1e-9 * report.positive);
}

}  // namespace
}  // namespace strata::csg
