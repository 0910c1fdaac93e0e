#include "mesh/polygons/face_sweep.h"

#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <chrono>
#include <map>
#include <random>
#include <set>

namespace strata {
namespace {

using boost::multiprecision::cpp_int;
using exact::FlatPoint;
using Key = std::array<std::int64_t, 2>;
using Triangles = std::set<std::array<Key, 3>>;

Key key(const FlatPoint& p) { return {p.x, p.y}; }

// A region: polygons with holes, by positions.
struct Region {
  std::vector<std::pair<FlatPoint, FlatPoint>> edges;
  std::vector<FlatPoint> points;  // without edges

  void add_polygon(const std::vector<FlatPoint>& corners) {
    for (std::size_t i = 0; i < corners.size(); ++i) {
      edges.emplace_back(corners[i], corners[(i + 1) % corners.size()]);
    }
  }
};

struct Numbered {
  std::vector<FlatPoint> points;
  std::vector<FlatEdge> edges;

  explicit Numbered(const Region& region) {
    std::map<Key, std::uint32_t> number;
    for (const auto& [a, b] : region.edges) number[key(a)] = number[key(b)] = 0;
    for (const FlatPoint& p : region.points) number[key(p)] = 0;
    for (auto& [at, index] : number) {
      index = static_cast<std::uint32_t>(points.size());
      points.emplace_back(at[0], at[1]);
    }
    for (const auto& [a, b] : region.edges) edges.push_back({number[key(a)], number[key(b)]});
  }
};

cpp_int cross(const FlatPoint& a, const FlatPoint& b) {
  return cpp_int(a.x) * b.y - cpp_int(a.y) * b.x;
}
cpp_int twice_area(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c) {
  return cross(a, b) + cross(b, c) + cross(c, a);
}

// Above 0 when d lies within the circle of a left turn (a, b, c).
cpp_int in_circle(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c, const FlatPoint& d) {
  const auto lift = [&](const FlatPoint& p) {
    return cpp_int(p.x - d.x) * (p.x - d.x) + cpp_int(p.y - d.y) * (p.y - d.y);
  };
  return lift(a) * cross(b - d, c - d) + lift(b) * cross(c - d, a - d) +
         lift(c) * cross(a - d, b - d);
}

// The triangles, after all checks that do not need the sweep's own reasoning: areas above zero that
// add up, edges in two triangles or one and the outline, and each other edge locally Delaunay, with
// the diagonal at the least of four points of a circle. The last implies that no point that a
// triangle sees lies within its circle.
Triangles checked(const Region& region, bool outline_only = false) {
  const Numbered numbered(region);
  FaceSweep sweep;
  DelaunayMesh mesh;
  EXPECT_TRUE(sweep.cut(numbered.points, numbered.edges, mesh));
  Triangles result;
  cpp_int area = 0, expected = 0;
  for (const auto& [a, b] : region.edges) expected += cross(a, b);
  std::multiset<std::pair<Key, Key>> outline;
  for (const auto& [a, b] : region.edges) outline.emplace(key(a), key(b));
  std::map<std::pair<Key, Key>, FlatPoint> apex;
  std::set<Key> used;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    std::array<FlatPoint, 3> p;
    std::array<Key, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = numbered.points[mesh.triangle(t)[k]];
      corners[k] = key(p[k]);
      used.insert(corners[k]);
    }
    EXPECT_GT(twice_area(p[0], p[1], p[2]), 0);
    area += twice_area(p[0], p[1], p[2]);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto edge = std::pair(corners[k], corners[(k + 1) % 3]);
      EXPECT_TRUE(apex.emplace(edge, p[(k + 2) % 3]).second);
      const auto side = mesh.across(static_cast<std::uint32_t>(3 * t + k));
      EXPECT_EQ(DelaunayMesh::is_outline(side), outline.count(edge) == 1);
      if (DelaunayMesh::is_outline(side)) {
        const FlatEdge& e = numbered.edges[DelaunayMesh::number(side)];
        EXPECT_EQ(std::pair(key(numbered.points[e.from]), key(numbered.points[e.to])), edge);
      }
    }
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    result.insert(corners);
  }
  EXPECT_EQ(area, expected);
  for (const auto& edge : outline) EXPECT_EQ(apex.count(edge), 1u);
  if (!outline_only) {
    for (const FlatPoint& p : region.points) EXPECT_EQ(used.count(key(p)), 1u);
  }
  for (const auto& [edge, d] : apex) {
    if (outline.count(edge) != 0) continue;
    const auto other = apex.find({edge.second, edge.first});
    if (other == apex.end()) {
      ADD_FAILURE() << "an inner edge has one triangle";
      continue;
    }
    const FlatPoint a(edge.first[0], edge.first[1]), c(edge.second[0], edge.second[1]);
    const cpp_int inside = in_circle(a, c, d, other->second);
    EXPECT_LE(inside, 0);
    if (inside == 0) {
      const Key least =
          std::min(std::min(edge.first, edge.second), std::min(key(d), key(other->second)));
      EXPECT_TRUE(least == edge.first || least == edge.second);
    }
  }
  return result;
}

// The outline of cells of a square grid whose corners are moved by `place`.
template <class Place>
Region cells_outline(int size, const std::set<std::pair<int, int>>& cells, const Place& place) {
  Region region;
  for (const auto& cell : cells) {
    const int x = cell.first, y = cell.second;
    const auto add = [&](int dx, int dy, int x0, int y0, int x1, int y1) {
      if (cells.count({x + dx, y + dy}) == 0) {
        region.edges.emplace_back(place(x + x0, y + y0), place(x + x1, y + y1));
      }
    };
    add(0, -1, 0, 0, 1, 0);
    add(1, 0, 1, 0, 1, 1);
    add(0, 1, 1, 1, 0, 1);
    add(-1, 0, 0, 1, 0, 0);
  }
  for (int x = 0; x <= size; ++x) {  // points that all four cells share
    for (int y = 0; y <= size; ++y) {
      if (cells.count({x, y}) != 0 && cells.count({x - 1, y}) != 0 &&
          cells.count({x, y - 1}) != 0 && cells.count({x - 1, y - 1}) != 0 && (x + y) % 2 == 0) {
        region.points.push_back(place(x, y));
      }
    }
  }
  return region;
}

std::set<std::pair<int, int>> some_cells(int size, double share, std::mt19937& random) {
  std::bernoulli_distribution take(share);
  std::set<std::pair<int, int>> cells;
  for (int x = 0; x < size; ++x) {
    for (int y = 0; y < size; ++y) {
      if (take(random)) cells.emplace(x, y);
    }
  }
  return cells;
}

TEST(FaceSweep, GridsWithHolesThatTouchAreDelaunayWithTheLeastDiagonals) {
  for (unsigned seed = 0; seed < 1000; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const int size = 1 + static_cast<int>(seed % 9);
    const auto cells = some_cells(size, 0.2 + 0.75 * (seed % 13) / 12, random);
    std::uniform_int_distribution<int> entry(-3, 3);
    int a = 1, b = 0, c = 0, d = 1;
    if (seed % 2 == 1) {  // sheared and turned
      do {
        a = entry(random), b = entry(random), c = entry(random), d = entry(random);
      } while (a * d - b * c <= 0);
    }
    checked(cells_outline(size, cells,
                          [&](int x, int y) { return FlatPoint(a * x + b * y, c * x + d * y); }));
    if (HasFailure()) break;
  }
}

TEST(FaceSweep, GridsWithRandomCornersAreDelaunay) {
  for (unsigned seed = 0; seed < 500; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const int size = 1 + static_cast<int>(seed % 12);
    const auto cells = some_cells(size, 0.2 + 0.75 * (seed % 13) / 12, random);
    const std::int64_t unit = std::int64_t{1} << (seed % 5 * 11 + 4);
    std::uniform_int_distribution<std::int64_t> shift(-unit / 4, unit / 4);
    std::map<std::pair<int, int>, FlatPoint> at;
    checked(cells_outline(size, cells, [&](int x, int y) {
      const auto [found, added] = at.try_emplace({x, y});
      if (added) found->second = FlatPoint(x * unit + shift(random), y * unit + shift(random));
      return found->second;
    }));
    if (HasFailure()) break;
  }
}

TEST(FaceSweep, TheOrderOfEdgesDoesNotMatter) {
  std::mt19937 random(7);
  for (int i = 0; i < 50; ++i) {
    Region region = cells_outline(9, some_cells(9, 0.7, random),
                                  [](int x, int y) { return FlatPoint(2 * x - y, x + 3 * y); });
    const Triangles triangles = checked(region);
    std::shuffle(region.edges.begin(), region.edges.end(), random);
    EXPECT_EQ(checked(region), triangles);
  }
}

TEST(FaceSweep, AHundredPointsOfACircleBecomeAFanFromTheLeast) {
  // Points of x^2 + y^2 = (5 * 13 * 17)^2.
  constexpr std::int64_t kRadius = 5 * 13 * 17;
  std::vector<FlatPoint> corners;
  for (std::int64_t x = -kRadius; x <= kRadius; ++x) {
    for (std::int64_t y = -kRadius; y <= kRadius; ++y) {
      if (x * x + y * y == kRadius * kRadius) corners.emplace_back(x, y);
    }
  }
  ASSERT_EQ(corners.size(), 108u);
  std::sort(corners.begin(), corners.end(), [](const FlatPoint& a, const FlatPoint& b) {
    return std::atan2(a.y, a.x) < std::atan2(b.y, b.x);
  });
  Region region;
  region.add_polygon(corners);
  const Triangles triangles = checked(region);
  EXPECT_EQ(triangles.size(), corners.size() - 2);
  for (const auto& t : triangles) EXPECT_EQ(t[0], (Key{-kRadius, 0}));
}

TEST(FaceSweep, NestedSquaresAreSeparateRegions) {
  Region region;
  for (std::int64_t i = 0; i < 6; ++i) {
    std::vector<FlatPoint> square = {{i, i}, {20 - i, i}, {20 - i, 20 - i}, {i, 20 - i}};
    if (i % 2 == 1) std::reverse(square.begin(), square.end());
    region.add_polygon(square);
  }
  EXPECT_EQ(checked(region).size(), 24u);
}

TEST(FaceSweep, ASlitHasTheRegionOnBothSides) {
  Region region;
  region.add_polygon({{0, 0}, {30, 0}, {30, 20}, {0, 20}});
  // A cross of slits, with an arm that ends at the outline's corner.
  for (const FlatPoint& end : {FlatPoint(3, 10), FlatPoint(27, 10), FlatPoint(15, 3),
                               FlatPoint(15, 17), FlatPoint(0, 0)}) {
    region.add_polygon({FlatPoint(15, 10), end});
  }
  const Triangles triangles = checked(region);
  EXPECT_EQ(triangles.size(), 4u + 2 * 5 - 2);  // 4 corners, 5 points inside
}

TEST(FaceSweep, PointsOutsideAreIgnored) {
  Region region;
  region.add_polygon({{0, 0}, {10, 0}, {10, 10}, {0, 10}});
  region.add_polygon({{4, 4}, {4, 6}, {6, 6}, {6, 4}});
  region.points = {{-5, 5}, {5, 5}, {15, 5}, {12, -3}};
  EXPECT_EQ(checked(region, true).size(), 8u);
}

TEST(FaceSweep, RefusesWhatBoundsNoRegion) {
  const auto cut = [](const Region& region) {
    const Numbered numbered(region);
    FaceSweep sweep;
    DelaunayMesh mesh;
    return sweep.cut(numbered.points, numbered.edges, mesh);
  };
  Region bow;
  bow.add_polygon({{0, 0}, {10, 10}, {10, 0}, {0, 10}});
  EXPECT_FALSE(cut(bow));
  Region clockwise;
  clockwise.add_polygon({{0, 0}, {0, 10}, {10, 0}});
  EXPECT_FALSE(cut(clockwise));
  Region open;
  open.edges = {{{0, 0}, {10, 0}}, {{10, 0}, {0, 10}}};
  EXPECT_FALSE(cut(open));
  Region twice;
  for (int i = 0; i < 2; ++i) twice.add_polygon({{0, 0}, {10, 0}, {0, 10}});
  EXPECT_FALSE(cut(twice));
  Region crossing;  // two squares, both counter-clockwise
  crossing.add_polygon({{0, 0}, {10, 0}, {10, 10}, {0, 10}});
  crossing.add_polygon({{5, 5}, {15, 5}, {15, 15}, {5, 15}});
  EXPECT_FALSE(cut(crossing));
  Region on_edge;  // a point of an edge
  on_edge.add_polygon({{0, 0}, {10, 0}, {10, 10}, {0, 10}});
  on_edge.points = {{10, 5}};
  EXPECT_FALSE(cut(on_edge));
  Region touching;  // a corner of a hole on an edge
  touching.add_polygon({{0, 0}, {10, 0}, {10, 10}, {0, 10}});
  touching.add_polygon({{5, 5}, {8, 8}, {10, 4}});
  EXPECT_FALSE(cut(touching));
}

TEST(FaceSweep, RandomEdgesNeverEndInARegionThatIsNone) {
  // Whatever is accepted passes all checks.
  int accepted = 0;
  for (unsigned seed = 0; seed < 20000; ++seed) {
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> at(0, 5);
    std::vector<FlatPoint> corners;
    std::set<Key> known;
    while (corners.size() < 3 + seed % 6) {
      const FlatPoint p(at(random), at(random));
      if (known.insert(key(p)).second) corners.push_back(p);
    }
    Region region;
    region.add_polygon(corners);
    const Numbered numbered(region);
    FaceSweep sweep;
    DelaunayMesh mesh;
    if (!sweep.cut(numbered.points, numbered.edges, mesh)) continue;
    ++accepted;
    checked(region);
    if (HasFailure()) break;
  }
  EXPECT_GT(accepted, 1000);
}

// A square with regular polygons cut out of it, in random places of a grid.
Numbered plate(int holes_a_side, int corners, std::mt19937& random) {
  constexpr double kUnit = 1 << 30;
  Region region;
  const auto side = static_cast<std::int64_t>(kUnit) * holes_a_side;
  region.add_polygon({{0, 0}, {side, 0}, {side, side}, {0, side}});
  std::uniform_real_distribution<double> shift(0.3, 0.7), radius(0.02, 0.29);
  for (int x = 0; x < holes_a_side; ++x) {
    for (int y = 0; y < holes_a_side; ++y) {
      const double u = x + shift(random), v = y + shift(random), r = radius(random);
      std::vector<FlatPoint> hole;
      for (int i = 0; i < corners; ++i) {
        const double angle = -6.283185307179586 * (i + 0.25) / corners;
        hole.emplace_back(std::llround((u + r * std::cos(angle)) * kUnit),
                          std::llround((v + r * std::sin(angle)) * kUnit));
      }
      region.add_polygon(hole);
    }
  }
  return Numbered(region);
}

TEST(FaceSweep, TimeGrowsAsTheCornersDo) {
  std::mt19937 random(3);
  const Numbered few = plate(20, 16, random), many = plate(141, 16, random);
  FaceSweep sweep;
  DelaunayMesh mesh;
  const auto seconds = [&](const Numbered& region, int times) {
    double best = 1e9;
    for (int i = 0; i < 3; ++i) {
      const auto start = std::chrono::steady_clock::now();
      for (int k = 0; k < times; ++k) EXPECT_TRUE(sweep.cut(region.points, region.edges, mesh));
      const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
      best = std::min(best, taken.count());
    }
    return best;
  };
  const double ratio = seconds(many, 1) / seconds(few, 50);  // 49.7 times the corners
  EXPECT_LT(ratio, 4.0);
}

}  // namespace
}  // namespace strata
