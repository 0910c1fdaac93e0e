#include "csg/arrangement/candidate_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/ext/matrix_transform.hpp>
#include <random>
#include <tuple>

#include "strata/mesh/shapes.h"

namespace strata::csg {
namespace {

using exact::LatticePoint;
using Vec = glm::vec<3, std::int64_t, glm::defaultp>;

Vec outer(const Vec& a, const Vec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Whether two triangles share a point, by separating axes: two convex sets that do not are apart
// along the normal of a face, or a cross product of two edges, or within a common plane of an edge
// and the normal. For small coordinates, and triangles with an area.
bool share_a_point(const Vec (&a)[3], const Vec (&b)[3]) {
  std::vector<Vec> axes;
  const Vec m = outer(a[1] - a[0], a[2] - a[0]), n = outer(b[1] - b[0], b[2] - b[0]);
  axes.insert(axes.end(), {m, n});
  for (int i = 0; i < 3; ++i) {
    const Vec e = a[(i + 1) % 3] - a[i];
    axes.push_back(outer(m, e));
    axes.push_back(outer(n, b[(i + 1) % 3] - b[i]));
    for (int j = 0; j < 3; ++j) axes.push_back(outer(e, b[(j + 1) % 3] - b[j]));
  }
  return std::ranges::none_of(axes, [&](const Vec& axis) {
    const auto range = [&](const Vec(&t)[3]) {
      const auto along = [&](const Vec& p) { return axis.x * p.x + axis.y * p.y + axis.z * p.z; };
      return std::minmax({along(t[0]), along(t[1]), along(t[2])});
    };
    const auto [low_a, high_a] = range(a);
    const auto [low_b, high_b] = range(b);
    return high_a < low_b || high_b < low_a;
  });
}

bool reaches_plane(const Vec (&t)[3], const Vec (&plane)[3]) {
  const Vec n = outer(plane[1] - plane[0], plane[2] - plane[0]);
  const auto side = [&](const Vec& p) {
    const Vec v = p - plane[0];
    return n.x * v.x + n.y * v.y + n.z * v.z;
  };
  const auto [low, high] = std::minmax({side(t[0]), side(t[1]), side(t[2])});
  return low <= 0 && high >= 0;
}

auto find_pairs(const WeldedSolids& solids, const Execution& execution = {}) {
  const MeshEdges edges = find_mesh_edges(solids.triangles, solids.vertices.size());
  return find_candidate_pairs(solids, edges,
                              solids.first_count.empty() ? 0 : solids.first_count.size() - 1,
                              LiveZone(), execution);
}

struct Soup {
  WeldedSolids solids;
  std::vector<std::uint32_t> solid_of;

  void add(std::uint32_t solid, const LatticePoint& a, const LatticePoint& b,
           const LatticePoint& c) {
    const auto base = static_cast<std::uint32_t>(solids.vertices.size());
    solids.vertices.insert(solids.vertices.end(), {a, b, c});
    solids.triangles.emplace_back(base, base + 1, base + 2);
    solids.content_of.push_back(solid);
    if (solids.first_count.empty()) solids.first_count.push_back(0);
    while (solids.counts.size() <= solid) {
      solids.counts.push_back({static_cast<std::uint32_t>(solids.counts.size()), 1});
      solids.first_count.push_back(static_cast<std::uint32_t>(solids.counts.size()));
    }
    solid_of.push_back(solid);
  }
};

// Random triangles in a cube of 8 or 64 steps, of all sizes, then all made larger and moved.
Soup random_soup(std::mt19937_64& random, std::uint32_t solid_count, std::uint32_t each) {
  Soup soup;
  const bool wide = random() % 2 == 0;
  const int side = wide ? 64 : 8, scale = random() % 2 == 0 ? 1 : (1 << 28) / 64;
  const LatticePoint origin = scale == 1 ? LatticePoint(-3) : LatticePoint(-(1 << 28));
  const auto below = [&](int end) {
    return static_cast<int>(random() % static_cast<unsigned>(end));
  };
  for (std::uint32_t s = 0; s < solid_count; ++s) {
    while (soup.solids.triangles.size() < (s + 1) * each) {
      const int extent = below(4) == 0 ? side : 4;
      const auto corner = [&](int) { return below(side - extent + 1); };
      const LatticePoint at(corner(0), corner(1), corner(2));
      const auto point = [&] {
        return (at + LatticePoint(below(extent), below(extent), below(extent))) * scale + origin;
      };
      const LatticePoint a = point(), b = point(), c = point();
      if (exact::normal_of(a, b, c) != exact::Normal(0)) soup.add(s, a, b, c);
    }
  }
  return soup;
}

TEST(CandidatePairs, HoldAllPairsThatShareAPointAndNoneThatBoxesOrPlanesTellApart) {
  std::mt19937_64 random(5);
  std::size_t sharing = 0, found = 0;
  for (int round = 0; round < 60; ++round) {
    const Soup soup = random_soup(random, 2 + static_cast<std::uint32_t>(round) % 3, 120);
    const WeldedSolids& solids = soup.solids;
    const std::vector<std::uint32_t>& solid_of = soup.solid_of;
    const auto result = find_pairs(solids);
    ASSERT_TRUE(result.has_value());
    ASSERT_TRUE(std::ranges::is_sorted(*result));
    ASSERT_EQ(std::ranges::adjacent_find(*result), result->end());
    found += result->size();
    std::size_t checked = 0;
    const auto corners = [&](std::uint32_t t, Vec(&out)[3]) {
      const LatticePoint base = solids.vertices[0];
      const int scale = std::abs(base.x) > 1000 ? (1 << 28) / 64 : 1;  // small again
      for (int k = 0; k < 3; ++k) {
        const LatticePoint& p = solids.vertices[solids.triangles[t][k]];
        out[k] = scale == 1 ? Vec(p) : (Vec(p) + Vec(1 << 28)) / Vec(scale);
      }
    };
    for (std::uint32_t i = 0; i < solid_of.size(); ++i) {
      for (std::uint32_t j = i + 1; j < solid_of.size(); ++j) {
        Vec a[3], b[3];
        corners(i, a);
        corners(j, b);
        bool boxes = true;
        for (int k = 0; k < 3; ++k) {
          const auto [low, high] = std::minmax({a[0][k], a[1][k], a[2][k]});
          const auto [from, to] = std::minmax({b[0][k], b[1][k], b[2][k]});
          boxes = boxes && low <= to && from <= high;
        }
        const bool listed = std::ranges::binary_search(*result, BoxPair{i, j});
        checked += listed;
        const bool planes = reaches_plane(a, b) && reaches_plane(b, a);
        if (!boxes || !planes) {
          ASSERT_FALSE(listed) << round << ": " << i << " " << j;
        } else if (share_a_point(a, b)) {
          ASSERT_TRUE(listed) << round << ": " << i << " " << j;
          ++sharing;
        }
      }
    }
    ASSERT_EQ(checked, result->size());
  }
  EXPECT_GT(sharing, 10000u);
  EXPECT_GT(found, sharing);
}

std::vector<BoxPair> pairs_of(const Tree& tree) {
  auto solids = snap_solids(tree, tree.root(), Geometry(tree));
  EXPECT_TRUE(solids.has_value());
  const WeldedSolids welded = *weld_solids(std::move(*solids), {});
  auto result = find_pairs(welded);
  EXPECT_TRUE(result.has_value());
  return *std::move(result);
}

Tree moved(const TriangleSoup& mesh, const glm::dvec3& by) {
  return transform(glm::translate(glm::dmat4(1), by), Tree(mesh));
}

TEST(CandidatePairs, SolidsThatAreApartHaveNone) {
  const TriangleSoup ball = make_icosphere(1, 5);
  const std::vector<BoxPair> beside = pairs_of(Tree(ball) | moved(ball, {2.5, 0, 0}));
  EXPECT_EQ(beside.size(), 0u);
  const std::vector<BoxPair> nested = pairs_of(Tree(ball) - Tree(make_icosphere(0.5, 5)));
  EXPECT_EQ(nested.size(), 0u);
}

TEST(CandidatePairs, OfTwoBallsAreFewerThanTheirTriangles) {
  const TriangleSoup ball = make_icosphere(1, 6);
  const std::vector<BoxPair> result = pairs_of(Tree(ball) | moved(ball, {0.7, 0.3, 0.1}));
  EXPECT_GT(result.size(), 500u);
  EXPECT_LT(result.size(), ball.triangles.size() / 2);
}

// The two large triangles of each side of a plate meet every hole, and each hole only them.
TEST(CandidatePairs, OfHolesInAPlateGrowWithTheHoles) {
  const auto pairs_a_hole = [](int side) {
    Tree tree(make_box({0, 0, 0}, {static_cast<double>(side), static_cast<double>(side), 1}));
    const TriangleSoup hole = make_cylinder(0.3, 2, 24);
    for (int i = 0; i < side * side; ++i)
      tree -= moved(hole, {i % side + 0.5, i / side + 0.4, -0.5});
    const std::vector<BoxPair> result = pairs_of(tree);
    return static_cast<double>(result.size()) / (side * side);
  };
  const double few = pairs_a_hole(5), many = pairs_a_hole(20);
  EXPECT_GE(few, 2 * 48);  // the sides of a hole are 48 triangles; both faces of the plate cut them
  EXPECT_LT(many, 1.3 * few);
}

TEST(CandidatePairs, DoNotDependOnTheOrderOfTriangles) {
  std::mt19937_64 random(6);
  const Soup soup = random_soup(random, 2, 200);
  const auto result = find_pairs(soup.solids);
  ASSERT_TRUE(result.has_value());
  Soup turned = soup;
  std::reverse(turned.solids.triangles.begin(), turned.solids.triangles.end());
  const auto other = find_pairs(turned.solids);
  ASSERT_TRUE(other.has_value());
  const auto last = static_cast<std::uint32_t>(soup.solids.triangles.size() - 1);
  std::vector<BoxPair> back;
  for (const auto& [i, j] : *other) back.push_back({last - j, last - i});
  std::ranges::sort(back);
  EXPECT_EQ(back, *result);
  EXPECT_GT(back.size(), 100u);
}

TEST(CandidatePairs, LimitsAndStopsAreKept) {
  std::mt19937_64 random(7);
  const Soup soup = random_soup(random, 2, 200);
  Execution execution;
  execution.memory_limit = 100;
  const auto refused = find_pairs(soup.solids, execution);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
  std::stop_source stop;
  stop.request_stop();
  const auto stopped = find_pairs(soup.solids, {.stop = stop.get_token()});
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
  EXPECT_TRUE(find_pairs(WeldedSolids{})->empty());
}

}  // namespace
}  // namespace strata::csg
