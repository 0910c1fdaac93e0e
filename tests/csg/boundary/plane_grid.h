#pragma once

// Boundaries for tests, made without any geometry: three families of planes divide a box into
// cells, and a solid is a set of cells. Its faces, edges and vertices follow from the cells.

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "csg/arrangement/boundary_faces.h"

namespace strata::csg::test {

using Cell = std::array<int, 3>;

class PlaneGrid {
 public:
  /// Each family has size + 1 planes. Plane i of axis k is about the plane at i * spacing,
  /// tilted by random slopes of up to tilt / (size * spacing).
  PlaneGrid(int size, int spacing, int tilt, std::mt19937& random) : size_(size) {
    std::uniform_int_distribution<int> lift(-tilt, tilt);
    std::vector<exact::LatticePoint> vertices;
    std::vector<glm::uvec3> triangles;
    const int far = std::max(1, size * spacing);
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i <= size; ++i) {
        const auto corner = [&](int u, int v) {
          exact::LatticePoint p(0);
          p[k] = i * spacing + (tilt > 0 ? lift(random) : 0);
          p[(k + 1) % 3] = u;
          p[(k + 2) % 3] = v;
          return p;
        };
        const auto base = static_cast<std::uint32_t>(vertices.size());
        for (const auto& [u, v] : {std::pair(0, 0), std::pair(far, 0), std::pair(0, far)}) {
          vertices.push_back(corner(u, v));
        }
        triangles.emplace_back(base, base + 1, base + 2);
      }
    }
    faces.points = BoundaryPoints(std::move(vertices), std::move(triangles));
  }

  int size() const { return size_; }
  /// Makes the faces of a set of cells, with maximal faces; straight edges are joined.
  void set_cells(const std::set<Cell>& cells) {
    cells_ = cells;
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i <= size_; ++i) {
        for (const int direction : {1, -1}) add_plane(k, i, direction);
      }
    }
  }

  BoundaryFaces faces;
  std::uint32_t label = 0;

 private:
  bool inside(const Cell& cell) const { return cells_.count(cell) != 0; }

  static Cell moved(Cell cell, int axis, int by) {
    cell[static_cast<std::size_t>(axis)] += by;
    return cell;
  }

  // Whether cell lies behind a face of plane i of axis k that looks to `direction`.
  bool has_face(int k, int direction, const Cell& behind) const {
    return inside(behind) && !inside(moved(behind, k, direction));
  }

  std::uint32_t point(const Cell& at) {
    const auto found = point_of_.find(at);
    if (found != point_of_.end()) return found->second;
    BoundaryPoints::Recipe recipe{BoundaryPoints::Kind::kThreePlanes, {}};
    for (std::size_t k = 0; k < 3; ++k) {
      recipe.from[k] = static_cast<std::uint32_t>(static_cast<int>(k) * (size_ + 1) + at[k]);
    }
    const auto rounded = exact::round_for_file(faces.points.rational(recipe));
    return point_of_[at] = faces.points.add(recipe, rounded);
  }

  // Whether the grid edge from `at` along `axis` is an edge of the solid: its four cells are not
  // all alike, nor the same on both sides of one plane.
  std::array<bool, 4> around(const Cell& at, int axis) const {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    return {inside(at), inside(moved(at, u, -1)), inside(moved(moved(at, u, -1), v, -1)),
            inside(moved(at, v, -1))};  // counter-clockwise
  }
  static bool is_edge(const std::array<bool, 4>& c) {
    const int count = c[0] + c[1] + c[2] + c[3];
    return count == 1 || count == 3 || (count == 2 && c[0] == c[2]);
  }
  // Whether the solid has only one straight line of edges at a grid point.
  bool is_straight(const Cell& at, int axis) const {
    for (int k = 0; k < 3; ++k) {
      if (k != axis && (is_edge(around(at, k)) || is_edge(around(moved(at, k, -1), k)))) {
        return false;
      }
    }
    return true;
  }

  void add_plane(int k, int i, int direction) {
    const int u = (k + 1) % 3, v = (k + 2) % 3;
    BoundaryPlane plane;
    const glm::uvec3 t = faces.points.triangles()[static_cast<std::size_t>(k * (size_ + 1) + i)];
    const auto& vertices = faces.points.vertices();
    plane.plane = direction > 0 ? exact::plane_through(vertices[t.x], vertices[t.y], vertices[t.z])
                                : exact::plane_through(vertices[t.x], vertices[t.z], vertices[t.y]);
    plane.label = label;
    plane.first_edge = static_cast<std::uint32_t>(faces.edges.size());
    for (int a = 0; a < size_; ++a) {
      for (int b = 0; b < size_; ++b) {
        Cell behind{};
        behind[static_cast<std::size_t>(k)] = direction > 0 ? i - 1 : i;
        behind[static_cast<std::size_t>(u)] = a;
        behind[static_cast<std::size_t>(v)] = b;
        if (!has_face(k, direction, behind)) continue;
        for (const int axis : {u, v}) {
          for (const int side : {-1, 1}) {  // the edges at low and high coordinates
            const int across = axis == u ? v : u;
            if (has_face(k, direction, moved(behind, across, side))) continue;
            Cell start = behind;
            start[static_cast<std::size_t>(k)] = i;
            if (side > 0) ++start[static_cast<std::size_t>(across)];
            // Seen from the direction of the plane's axis, u to v turns left.
            const bool forward = ((axis == u) == (side < 0)) == (direction > 0);
            add_edge(start, axis, forward, behind);
          }
        }
      }
    }
    plane.edge_count = static_cast<std::uint32_t>(faces.edges.size()) - plane.first_edge;
    if (plane.edge_count > 0) faces.planes.push_back(plane);
  }

  // Adds the straight edge that ends with this grid edge; the others of it are skipped.
  void add_edge(const Cell& start, int axis, bool forward, const Cell& behind) {
    if (is_straight(moved(start, axis, 1), axis)) return;
    const Cell end = moved(start, axis, 1);
    Cell begin = start;
    while (is_straight(begin, axis)) begin = moved(begin, axis, -1);
    // Two cells that touch in an edge: the inside that is bounded by this face is that of the cell
    // behind it.
    std::uint32_t wedge = 0;
    const auto cells = around(start, axis);
    if (cells[0] == cells[2] && cells[1] == cells[3] && cells[0] != cells[1]) {
      const auto u = static_cast<std::size_t>((axis + 1) % 3);
      wedge = behind[u] == start[u] ? 1u : 2u;
    }
    const std::uint32_t from = point(forward ? begin : end), to = point(forward ? end : begin);
    faces.edges.push_back({from, to, wedge});
  }

  int size_;
  std::set<Cell> cells_;
  std::map<Cell, std::uint32_t> point_of_;
};

/// Each cell with the probability `share`.
inline std::set<Cell> random_cells(int size, double share, std::mt19937& random) {
  std::bernoulli_distribution take(share);
  std::set<Cell> cells;
  for (int x = 0; x < size; ++x) {
    for (int y = 0; y < size; ++y) {
      for (int z = 0; z < size; ++z) {
        if (take(random)) cells.insert({x, y, z});
      }
    }
  }
  return cells;
}

/// Puts planes, edges, points and touches into another order, and numbers wedges anew.
inline BoundaryFaces shuffled(const BoundaryFaces& faces, std::mt19937& random) {
  BoundaryFaces result;
  const std::size_t fixed = faces.points.vertices().size(), count = faces.points.size();
  result.points = BoundaryPoints(faces.points.vertices(), faces.points.triangles());
  std::vector<std::uint32_t> order, number(count);
  for (std::size_t i = fixed; i < count; ++i) order.push_back(static_cast<std::uint32_t>(i));
  std::shuffle(order.begin(), order.end(), random);
  for (std::size_t i = 0; i < fixed; ++i) number[i] = static_cast<std::uint32_t>(i);
  for (const std::uint32_t point : order) {
    number[point] = result.points.add(faces.points.recipe(point), faces.points.rounded(point));
  }
  std::vector<BoundaryPlane> planes = faces.planes;
  std::shuffle(planes.begin(), planes.end(), random);
  for (BoundaryPlane plane : planes) {
    std::vector<BoundaryEdge> edges(faces.edges.begin() + plane.first_edge,
                                    faces.edges.begin() + plane.first_edge + plane.edge_count);
    std::shuffle(edges.begin(), edges.end(), random);
    plane.first_edge = static_cast<std::uint32_t>(result.edges.size());
    for (BoundaryEdge edge : edges) {
      edge = {number[edge.from], number[edge.to], edge.wedge == 0 ? 0 : 1000 - edge.wedge};
      result.edges.push_back(edge);
    }
    std::vector<std::uint32_t> touches(
        faces.touches.begin() + plane.first_touch,
        faces.touches.begin() + plane.first_touch + plane.touch_count);
    plane.first_touch = static_cast<std::uint32_t>(result.touches.size());
    std::shuffle(touches.begin(), touches.end(), random);
    for (const std::uint32_t touch : touches) result.touches.push_back(number[touch]);
    result.planes.push_back(plane);
  }
  for (BoundaryFaces::Whole whole : faces.wholes) {
    const int turn = std::uniform_int_distribution<int>(0, 2)(random);
    const glm::uvec3 p = whole.points;
    for (int k = 0; k < 3; ++k) whole.points[k] = number[p[(k + turn) % 3]];
    result.wholes.push_back(whole);
  }
  std::shuffle(result.wholes.begin(), result.wholes.end(), random);
  return result;
}

}  // namespace strata::csg::test
