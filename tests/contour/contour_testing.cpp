#include "tests/contour/contour_testing.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "strata/voxelize/checksum.h"
#include "tests/support/voxelized.h"

namespace strata::testkit {
namespace {

using Point = std::array<std::int64_t, 3>;
using Corners = std::array<Point, 3>;

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
/// @pre differences below 2^19, so that no product overflows
int side(const Point& a, const Point& b, const Point& c, const Point& p) {
  const Point n = cross(minus(b, a), minus(c, a)), d = minus(p, a);
  const std::int64_t value = n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
  return value > 0 ? 1 : value < 0 ? -1 : 0;
}

/// In the plane without axis `drop`.
int turn(const Point& a, const Point& b, const Point& c, std::size_t drop) {
  const std::size_t u = (drop + 1) % 3, v = (drop + 2) % 3;
  const std::int64_t value = (b[u] - a[u]) * (c[v] - a[v]) - (b[v] - a[v]) * (c[u] - a[u]);
  return value > 0 ? 1 : value < 0 ? -1 : 0;
}
bool between(const Point& a, const Point& b, const Point& p) {  // on their line
  for (std::size_t i = 0; i < 3; ++i) {
    if (p[i] < std::min(a[i], b[i]) || p[i] > std::max(a[i], b[i])) return false;
  }
  return true;
}
bool flat_segments_meet(const Point& p, const Point& q, const Point& a, const Point& b,
                        std::size_t drop) {
  const int pa = turn(p, q, a, drop), pb = turn(p, q, b, drop);
  const int ap = turn(a, b, p, drop), aq = turn(a, b, q, drop);
  if (pa * pb < 0 && ap * aq < 0) return true;
  return (pa == 0 && between(p, q, a)) || (pb == 0 && between(p, q, b)) ||
         (ap == 0 && between(a, b, p)) || (aq == 0 && between(a, b, q));
}

/// Whether a closed segment and a closed triangle meet.
bool meets(const Point& p, const Point& q, const Corners& t) {
  const int sp = side(t[0], t[1], t[2], p), sq = side(t[0], t[1], t[2], q);
  if (sp * sq > 0) return false;
  if (sp == 0 && sq == 0) {
    const Point n = cross(minus(t[1], t[0]), minus(t[2], t[0]));
    std::size_t drop = 0;
    for (std::size_t i = 1; i < 3; ++i) {
      if (std::abs(n[i]) > std::abs(n[drop])) drop = i;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      if (flat_segments_meet(p, q, t[i], t[(i + 1) % 3], drop)) return true;
    }
    const int a = turn(t[0], t[1], p, drop), b = turn(t[1], t[2], p, drop),
              c = turn(t[2], t[0], p, drop);
    return a == b && b == c;
  }
  const int a = side(p, q, t[0], t[1]), b = side(p, q, t[1], t[2]), c = side(p, q, t[2], t[0]);
  return !((a > 0 || b > 0 || c > 0) && (a < 0 || b < 0 || c < 0));
}

/// Whether two triangles meet elsewhere than in common vertices and edges.
bool pierce(const glm::uvec3& s, const glm::uvec3& t, const std::vector<Point>& points) {
  std::vector<unsigned> common;
  unsigned free_s = 0, free_t = 0;
  for (unsigned i = 0; i < 3; ++i) {
    const auto at = static_cast<int>(i);
    if (s[at] == t.x || s[at] == t.y || s[at] == t.z) {
      common.push_back(s[at]);
    } else {
      free_s = s[at];
    }
    if (t[at] != s.x && t[at] != s.y && t[at] != s.z) free_t = t[at];
  }
  const auto corners = [&](const glm::uvec3& x) {
    return Corners{points[x.x], points[x.y], points[x.z]};
  };
  const Corners a = corners(s), b = corners(t);
  if (common.size() == 3) return true;
  if (common.size() == 2) {
    const Point &p = points[common[0]], &q = points[common[1]];
    if (side(b[0], b[1], b[2], points[free_s]) != 0) return false;
    const Point n = cross(minus(b[1], b[0]), minus(b[2], b[0]));
    std::size_t drop = 0;
    for (std::size_t i = 1; i < 3; ++i) {
      if (std::abs(n[i]) > std::abs(n[drop])) drop = i;
    }
    return turn(p, q, points[free_s], drop) == turn(p, q, points[free_t], drop);
  }
  for (unsigned i = 0; i < 3; ++i) {
    const unsigned j = (i + 1) % 3;
    const auto shared = [&](unsigned v) { return !common.empty() && v == common[0]; };
    const unsigned si = s[static_cast<int>(i)], sj = s[static_cast<int>(j)];
    const unsigned ti = t[static_cast<int>(i)], tj = t[static_cast<int>(j)];
    if (!shared(si) && !shared(sj) && meets(a[i], a[j], b)) return true;
    if (!shared(ti) && !shared(tj) && meets(b[i], b[j], a)) return true;
  }
  return false;
}

std::string connection_faults(const SolidMesh& mesh) {
  std::map<std::pair<unsigned, unsigned>, unsigned> edges;  // directed, with the third corner
  std::vector<std::map<unsigned, unsigned>> links(mesh.positions.size());
  for (const glm::uvec3& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      const unsigned a = t[i], b = t[(i + 1) % 3], c = t[(i + 2) % 3];
      if (!edges.emplace(std::pair(a, b), c).second) {
        return fmt::format("edge {} -> {} is there twice", a, b);
      }
      links[a].emplace(b, c);
    }
  }
  for (const auto& [edge, corner] : edges) {
    if (edges.count({edge.second, edge.first}) == 0) {
      return fmt::format("edge {} -> {} has one triangle", edge.first, edge.second);
    }
  }
  for (std::size_t v = 0; v < links.size(); ++v) {
    if (links[v].empty()) return fmt::format("vertex {} has no triangle", v);
    unsigned at = links[v].begin()->first;
    for (std::size_t n = 0; n + 1 < links[v].size(); ++n) {
      at = links[v].at(at);
      if (at == links[v].begin()->first) return fmt::format("vertex {} has several fans", v);
    }
  }
  return {};
}

}  // namespace

TriangleSoup soup_of(const SolidMesh& mesh) { return {mesh.positions, mesh.triangles, {}}; }

std::string faults_of(const SolidMesh& mesh, const VoxelGrid& grid) {
  if (auto fault = connection_faults(mesh); !fault.empty()) return fault;
  std::vector<Point> points;
  for (const glm::dvec3& p : mesh.positions) {
    const glm::dvec3 lattice = (p - grid.origin) / grid.voxel_size * 256.0;
    Point point;
    for (int i = 0; i < 3; ++i) {
      point[static_cast<std::size_t>(i)] = std::llround(lattice[i]);
      if (std::abs(lattice[i] - std::round(lattice[i])) > 1e-6) {
        return fmt::format("vertex {} is no point of the lattice", points.size());
      }
    }
    points.push_back(point);
  }
  struct Box {
    Point low, high;
    std::size_t triangle;
  };
  std::vector<Box> boxes;
  for (std::size_t n = 0; n < mesh.triangles.size(); ++n) {
    const glm::uvec3& t = mesh.triangles[n];
    Box box{points[t.x], points[t.x], n};
    for (const unsigned v : {t.y, t.z}) {
      for (std::size_t i = 0; i < 3; ++i) {
        box.low[i] = std::min(box.low[i], points[v][i]);
        box.high[i] = std::max(box.high[i], points[v][i]);
      }
    }
    if (cross(minus(points[t.y], points[t.x]), minus(points[t.z], points[t.x])) == Point{}) {
      return fmt::format("triangle {} has no area", n);
    }
    boxes.push_back(box);
  }
  std::sort(boxes.begin(), boxes.end(),
            [](const Box& a, const Box& b) { return a.low[0] < b.low[0]; });
  for (std::size_t a = 0; a < boxes.size(); ++a) {
    for (std::size_t b = a + 1; b < boxes.size() && boxes[b].low[0] <= boxes[a].high[0]; ++b) {
      if (boxes[b].low[1] > boxes[a].high[1] || boxes[a].low[1] > boxes[b].high[1] ||
          boxes[b].low[2] > boxes[a].high[2] || boxes[a].low[2] > boxes[b].high[2]) {
        continue;
      }
      const std::size_t s = boxes[a].triangle, t = boxes[b].triangle;
      if (pierce(mesh.triangles[s], mesh.triangles[t], points)) {
        return fmt::format("triangles {} and {} meet", s, t);
      }
    }
  }
  return {};
}

SolidMesh checked_contour(const TriangleSoup& mesh, const VoxelGrid& grid,
                          const ContourOptions& options, ContourReport* report) {
  auto made = contour(mesh, grid, options, {.threads = 1});
  EXPECT_TRUE(made.has_value()) << made.error().message;
  if (!made) return {};
  EXPECT_EQ(faults_of(made->mesh, grid), "");
  const VoxelizeOptions same{.rule = options.rule,
                             .open = options.open,
                             .closedness = options.closedness,
                             .filter = options.filter};
  const auto wanted = voxelized(mesh, grid, same);
  for (const Axis axis : kAllAxes) {
    const auto given = voxelized(soup_of(made->mesh), grid,
                                 {.axis = axis, .closedness = Closedness::kAssumeClosed});
    EXPECT_EQ(set_checksum(given), set_checksum(wanted)) << "axis " << static_cast<int>(axis);
    EXPECT_EQ(given.solid_voxels(), wanted.solid_voxels());
  }
  for (const int threads : {2, 7}) {
    const auto again = contour(mesh, grid, options, {.threads = threads});
    EXPECT_TRUE(again.has_value());
    if (!again) continue;
    EXPECT_EQ(again->mesh.positions, made->mesh.positions);
    EXPECT_EQ(again->mesh.triangles, made->mesh.triangles);
  }
  if (report != nullptr) *report = made->report;
  return std::move(made->mesh);
}

}  // namespace strata::testkit
