#include "csg/solids/boundary.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <optional>
#include <unordered_map>

#include "csg/outline/triangulate_pieces.h"
#include "csg/solids/plane_section.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"

namespace strata::csg {
namespace {

/// The subtree below one node, with its leaves prepared for sections.
class Cutter {
 public:
  Cutter(const Tree& tree, Tree::NodeId root) : tree_(tree) {
    reached_.push_back(root);
    for (std::size_t i = 0; i < reached_.size(); ++i) {
      if (tree.nodes()[reached_[i]].operation == Operation::kSolid) continue;
      const auto operands = tree.operands(reached_[i]);
      reached_.insert(reached_.end(), operands.begin(), operands.end());
    }
    std::sort(reached_.begin(), reached_.end());
    leaf_of_.resize(reached_.size(), 0);
    for (std::size_t i = 0; i < reached_.size(); ++i) {
      const Tree::Node& node = tree.nodes()[reached_[i]];
      if (node.operation != Operation::kSolid) continue;
      leaf_of_[i] = leaves_.size();
      leaves_.push_back(make_leaf(tree.solids()[node.first]));
      const Bounds& box = leaves_.back().box;
      if (box.empty()) continue;
      scale_ = std::max({scale_, glm::length(box.high), glm::length(box.low)});
    }
  }

  [[nodiscard]] std::span<const Leaf> leaves() const { return leaves_; }
  [[nodiscard]] double scale() const { return scale_; }
  /// Vertices nearer to a plane than this lie in it. Rounding moves the corners of one polygon by
  /// some 1e-15 of the scale, and by more relative to the plane of a small triangle. Corners that
  /// were stored as float or with six digits differ by more than 1e-8, and so do their planes.
  [[nodiscard]] double tolerance() const { return 1e-10 * scale_; }

  /// @param steps  is increased by the work done
  [[nodiscard]] Outline section(const Plane& plane, Side side, std::uint64_t& steps,
                                OutlineJob* job = nullptr) const {
    std::vector<Outline> results(reached_.size());
    steps += reached_.size();
    std::vector<Outline> operands;
    for (std::size_t i = 0; i < reached_.size(); ++i) {
      if (job != nullptr && job->ended()) return {};
      const Tree::Node& node = tree_.nodes()[reached_[i]];
      if (node.operation == Operation::kSolid) {
        results[i] = csg::section(leaves_[leaf_of_[i]], plane, tolerance(), side, steps);
        continue;
      }
      operands.clear();
      bool first = true, empty = false;
      for (const Tree::NodeId id : tree_.operands(reached_[i])) {
        const auto at = std::lower_bound(reached_.begin(), reached_.end(), id);
        Outline& operand = results[static_cast<std::size_t>(at - reached_.begin())];
        empty |= operand.empty() && (node.operation == Operation::kIntersection ||
                                     (first && node.operation == Operation::kDifference));
        first = false;
        if (!operand.empty()) operands.push_back(std::move(operand));
      }
      if (empty || operands.empty()) continue;
      if (operands.size() == 1) {
        results[i] = std::move(operands[0]);
      } else if (node.operation == Operation::kUnion) {
        results[i] = unite(operands, job);
      } else if (node.operation == Operation::kIntersection) {
        results[i] = intersect(operands, job);
      } else {
        results[i] = subtract(operands, job);
      }
    }
    return std::move(results.back());  // the root is the last node
  }

 private:
  const Tree& tree_;
  std::vector<Tree::NodeId> reached_;  // nodes below the root, sorted
  std::vector<std::size_t> leaf_of_;
  std::vector<Leaf> leaves_;
  double scale_ = 0.0;
};

/// A set of distinct planes. A plane is looked up by its four coefficients, rounded to a grid much
/// coarser than the tolerance; near the border of a cell the neighbouring cells are searched too.
class Planes {
 public:
  explicit Planes(const Cutter& cutter)
      : tolerance_(cutter.tolerance()), grain_{1e-6, 1e-6, 1e-6, 1e-6 * cutter.scale()} {}

  /// Widens the window of the plane that holds the triangle, or adds that plane.
  void add(const std::array<glm::dvec3, 3>& corners, const glm::dvec3& normal) {
    Cell low{}, step{};
    const std::array<double, 4> numbers{normal.x, normal.y, normal.z, glm::dot(normal, corners[0])};
    for (std::size_t i = 0; i < 4; ++i) {
      const double at = numbers[i] / grain_[i];
      low[i] = static_cast<std::int64_t>(std::floor(at));
      step[i] = at - std::floor(at) < 0.5 ? -1 : 1;
    }
    for (unsigned choice = 0; choice < 16; ++choice) {
      Cell cell = low;
      for (std::size_t i = 0; i < 4; ++i) cell[i] += choice >> i & 1u ? step[i] : 0;
      const auto found = cells_.find(cell);
      if (found == cells_.end()) continue;
      for (const std::size_t index : found->second) {
        if (holds(planes_[index], corners)) return widen(planes_[index], corners);
      }
    }
    cells_[low].push_back(planes_.size());
    planes_.push_back(make_plane(corners[0], normal));
    widen(planes_.back(), corners);
  }

  std::vector<Plane> take() { return std::move(planes_); }

 private:
  using Cell = std::array<std::int64_t, 4>;
  struct HashCell {
    std::size_t operator()(const Cell& cell) const {
      std::uint64_t hash = 0;
      for (const std::int64_t part : cell) {
        hash = (hash ^ static_cast<std::uint64_t>(part)) * 0x9e3779b97f4a7c15u;
        hash ^= hash >> 29;
      }
      return hash;
    }
  };

  [[nodiscard]] bool holds(const Plane& plane, const std::array<glm::dvec3, 3>& corners) const {
    return std::all_of(corners.begin(), corners.end(), [&](const glm::dvec3& p) {
      return std::abs(glm::dot(p - plane.origin, plane.normal)) <= tolerance_;
    });
  }

  static void widen(Plane& plane, const std::array<glm::dvec3, 3>& corners) {
    for (const glm::dvec3& p : corners) {
      plane.window.low = glm::min(plane.window.low, p);
      plane.window.high = glm::max(plane.window.high, p);
    }
  }

  double tolerance_;
  std::array<double, 4> grain_;
  std::vector<Plane> planes_;
  std::unordered_map<Cell, std::vector<std::size_t>, HashCell> cells_;
};

/// The planes of all triangles that may contribute to the boundary.
std::vector<Plane> planes_of(const Cutter& cutter, const Bounds& box) {
  Planes planes(cutter);
  for (const Leaf& leaf : cutter.leaves()) {
    for (const glm::uvec3& t : leaf.triangles) {
      const std::array<glm::dvec3, 3> p{leaf.positions[t.x], leaf.positions[t.y],
                                        leaf.positions[t.z]};
      const Bounds around{glm::min(p[0], glm::min(p[1], p[2])),
                          glm::max(p[0], glm::max(p[1], p[2]))};
      if (!meet(box, around, cutter.tolerance())) continue;
      glm::dvec3 normal = glm::cross(p[1] - p[0], p[2] - p[0]);
      const double length = glm::length(normal);
      // A triangle without a meaningful normal bounds nothing.
      if (!(length > 1e-24 * cutter.scale() * cutter.scale())) continue;
      normal /= length;
      const int first = std::abs(normal.x) > 0.5 ? 0 : std::abs(normal.y) > 0.5 ? 1 : 2;
      planes.add(p, normal[first] < 0.0 ? -normal : normal);
    }
  }
  return planes.take();
}

/// Adds the triangles of a region in a plane. Triangles no higher than `tolerance` are left out
/// with the points that only they use: where faces of two leaves coincide, rounding leaves spikes
/// without width that reach out of the region.
void add_pieces(TriangleSoup& mesh, const Plane& plane, const Outline& region, bool up,
                double tolerance) {
  if (region.empty()) return;
  std::vector<glm::dvec2> points;
  for (const auto& contour : region.contours) {
    points.insert(points.end(), contour.begin(), contour.end());
  }
  constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::vector<std::uint32_t> index(points.size(), kNone);
  for (glm::uvec3 t : triangulate(region)) {
    const glm::dvec2 a = points[t.y] - points[t.x], b = points[t.z] - points[t.x];
    const double longest = std::max({glm::length(a), glm::length(b), glm::length(b - a)});
    if (std::abs(a.x * b.y - a.y * b.x) <= tolerance * longest) continue;
    for (int i = 0; i < 3; ++i) {
      std::uint32_t& vertex = index[t[i]];
      if (vertex == kNone) {
        vertex = static_cast<std::uint32_t>(mesh.positions.size());
        const glm::dvec2& p = points[t[i]];
        mesh.positions.push_back(plane.origin + p.x * plane.u + p.y * plane.v);
      }
      t[i] = vertex;
    }
    if (!up) std::swap(t.y, t.z);
    mesh.triangles.push_back(t);
  }
}

Result<TriangleSoup> cut_boundary(const Tree& tree, Tree::NodeId node, std::uint64_t most_steps,
                                  const Execution& execution) {
  const Cutter cutter(tree, node);
  const Bounds box = bounds(tree, node);
  if (box.empty()) return TriangleSoup();
  const std::vector<Plane> planes = planes_of(cutter, box);
  std::vector<TriangleSoup> pieces(planes.size());
  Execution quiet = execution;
  quiet.progress = {};
  std::atomic<std::uint64_t> steps{0};
  parallel_for(quiet, planes.size(), [&](std::size_t i, int) {
    if (steps > most_steps) return;
    std::uint64_t here = 0;
    std::vector<Outline> sides{cutter.section(planes[i], Side::kBelow, here),
                               cutter.section(planes[i], Side::kAbove, here)};
    steps += here;
    if (sides[0].empty() && sides[1].empty()) return;
    // Sections are valid only inside the window.
    const Rectangle window = rectangle_of(planes[i]);
    Outline frame;
    frame.contours.push_back(
        {window.low, {window.high.x, window.low.y}, window.high, {window.low.x, window.high.y}});
    for (const bool up : {true, false}) {
      const std::vector<Outline> seen{subtract(sides), frame};
      if (!seen[0].empty()) {
        add_pieces(pieces[i], planes[i], intersect(seen), up, cutter.tolerance());
      }
      std::swap(sides[0], sides[1]);
    }
  });
  if (steps > most_steps) {
    std::size_t triangles = 0;
    for (const Leaf& leaf : cutter.leaves()) triangles += leaf.triangles.size();
    return fail(ErrorCode::kLimit, "{} triangles and {} planes are too many to be cut", triangles,
                planes.size());
  }
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  TriangleSoup mesh;
  for (const TriangleSoup& piece : pieces) append(mesh, piece);
  mesh.face_elements.clear();
  return mesh;
}

}  // namespace

TriangleSoup world_mesh(const Solid& solid) {
  return solid.mesh ? transform(*solid.mesh, solid.world_from_mesh) : TriangleSoup();
}

void for_each_operand(const Tree& tree, Tree::NodeId node,
                      const std::function<void(Tree::NodeId)>& body) {
  std::vector<Tree::NodeId> waiting{node};
  while (!waiting.empty()) {
    const Tree::NodeId at = waiting.back();
    waiting.pop_back();
    if (tree.nodes()[at].operation != Operation::kUnion) {
      body(at);
      continue;
    }
    const auto operands = tree.operands(at);
    waiting.insert(waiting.end(), operands.rbegin(), operands.rend());
  }
}

Outline cross_section(const Tree& tree, Tree::NodeId node, OutlineJob* job) {
  const Cutter cutter(tree, node);
  const Plane plane;
  std::uint64_t steps = 0;
  std::vector<Outline> sides{cutter.section(plane, Side::kBelow, steps, job),
                             cutter.section(plane, Side::kAbove, steps, job)};
  return unite(sides, job);
}

Result<TriangleSoup> boundary(const Tree& tree, Tree::NodeId node, const Execution& execution,
                              std::uint64_t most_steps) {
  TriangleSoup mesh;
  std::optional<Error> error;
  for_each_operand(tree, node, [&](Tree::NodeId operand) {
    if (error) return;
    const Tree::Node& at = tree.nodes()[operand];
    if (at.operation == Operation::kSolid) {
      append(mesh, world_mesh(tree.solids()[at.first]));
      return;
    }
    auto pieces = cut_boundary(tree, operand, most_steps, execution);
    if (pieces) {
      append(mesh, *pieces);
    } else {
      error = pieces.error();
    }
  });
  if (error) return tl::unexpected(*error);
  return mesh;
}

}  // namespace strata::csg
