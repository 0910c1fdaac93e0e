#include "csg/scene/boundary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <unordered_map>

#include "mesh/shapes.h"
#include "mesh/soup_tools.h"

namespace strata::csg {
namespace {

/// How many signed distances may be computed: some ten seconds.
constexpr double kMostDistances = 4e9;

struct Plane {
  glm::dvec3 origin{0.0}, normal{0.0, 0.0, 1.0}, u{1.0, 0.0, 0.0}, v{0.0, 1.0, 0.0};
};

Plane make_plane(const glm::dvec3& origin, const glm::dvec3& normal) {
  Plane plane;
  plane.origin = origin;
  plane.normal = normal;
  const glm::dvec3 size = glm::abs(normal);
  const glm::dvec3 axis = size.x <= size.y && size.x <= size.z ? glm::dvec3(1, 0, 0)
                          : size.y <= size.z                   ? glm::dvec3(0, 1, 0)
                                                               : glm::dvec3(0, 0, 1);
  plane.u = glm::normalize(glm::cross(axis, normal));
  plane.v = glm::cross(normal, plane.u);
  return plane;
}

/// A leaf in the space of the tree, its vertices welded by position.
struct Leaf {
  std::vector<glm::dvec3> positions;
  std::vector<glm::uvec3> triangles;
  Bounds box;
  Fill fill = Fill::kNonzero;
};

struct HashPoint {
  std::size_t operator()(const glm::dvec3& p) const {
    const std::hash<double> hash;
    return hash(p.x) * 0x9e3779b97f4a7c15u ^ hash(p.y) * 0xc2b2ae3d27d4eb4fu ^ hash(p.z);
  }
};

Leaf make_leaf(const Solid& solid) {
  Leaf leaf;
  const TriangleSoup mesh = world_mesh(solid);
  std::unordered_map<glm::dvec3, std::uint32_t, HashPoint> index_of;
  std::vector<std::uint32_t> index(mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const glm::dvec3 p = mesh.positions[i] + 0.0;  // -0 equals +0
    const auto [at, is_new] =
        index_of.try_emplace(p, static_cast<std::uint32_t>(leaf.positions.size()));
    if (is_new) leaf.positions.push_back(p);
    index[i] = at->second;
  }
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::uvec3 welded(index[t.x], index[t.y], index[t.z]);
    if (welded.x == welded.y || welded.y == welded.z || welded.z == welded.x) continue;
    leaf.triangles.push_back(welded);
  }
  leaf.box = bounds(mesh);
  leaf.fill = solid.rule == InsideRule::kParity ? Fill::kEvenOdd : Fill::kNonzero;
  return leaf;
}

enum class Side { kBelow, kAbove };  // just below the plane, just above it

/// Where the surface of a leaf goes through a plane, moved off it by less than any distance.
class LeafSection {
 public:
  LeafSection(const Leaf& leaf, const Plane& plane, double tolerance, Side side)
      : leaf_(leaf), plane_(plane) {
    distances_.reserve(leaf.positions.size());
    for (const glm::dvec3& p : leaf.positions) {
      const double distance = glm::dot(p - plane.origin, plane.normal);
      // A vertex in the plane is above a plane that is moved down, and the other way around.
      const bool in_plane = std::abs(distance) <= tolerance;
      distances_.push_back(in_plane ? 0.0 : distance);
      above_.push_back(in_plane ? side == Side::kBelow : distance > 0.0);
    }
  }

  Outline run() {
    for (const glm::uvec3& t : leaf_.triangles) add_triangle(t);
    Outline outline;
    for (std::size_t first = 0; first < segments_.size(); ++first) {
      if (segments_[first].used) continue;
      std::vector<glm::dvec2> contour;
      Edge at = segments_[first].from;
      for (std::size_t next = first; next != kNone; next = following(at)) {
        Segment& segment = segments_[next];
        segment.used = true;
        at = at == segment.from ? segment.to : segment.from;
        contour.push_back(crossing(at));
      }
      if (contour.size() >= 3) outline.contours.push_back(std::move(contour));
    }
    return outline.empty() ? outline : clean(outline, leaf_.fill);
  }

 private:
  using Edge = std::uint64_t;  // [lower vertex:32 | higher vertex:32]
  static constexpr std::size_t kNone = ~std::size_t{0};
  struct Segment {
    Edge from, to;
    bool used;
  };

  static Edge edge(std::uint32_t a, std::uint32_t b) {
    return Edge{std::min(a, b)} << 32 | std::max(a, b);
  }

  void add_triangle(const glm::uvec3& t) {
    const int count = above_[t.x] + above_[t.y] + above_[t.z];
    if (count == 0 || count == 3) return;
    int odd = 0;  // the corner that is alone on its side
    while (above_[t[odd]] != (count == 1)) ++odd;
    const Edge from = edge(t[odd], t[(odd + 1) % 3]), to = edge(t[(odd + 2) % 3], t[odd]);
    // The region is to the left, seen from above.
    segments_.push_back(count == 1 ? Segment{from, to, false} : Segment{to, from, false});
    link(segments_.back().from);
    // Faces that look opposite ways may meet: parity asks for closed lines, not for their sense.
    if (leaf_.fill == Fill::kEvenOdd) link(segments_.back().to);
  }

  /// The last segment can be gone on with from `edge`.
  void link(Edge edge) {
    const auto [at, is_new] = last_link_.try_emplace(edge, links_.size());
    links_.push_back({segments_.size() - 1, is_new ? kNone : at->second});
    at->second = links_.size() - 1;
  }

  std::size_t following(Edge edge) {
    const auto found = last_link_.find(edge);
    if (found == last_link_.end()) return kNone;
    std::size_t& at = found->second;
    while (at != kNone && segments_[links_[at].segment].used) at = links_[at].before;
    return at == kNone ? kNone : links_[at].segment;
  }

  glm::dvec2 crossing(Edge edge) const {
    const auto a = static_cast<std::uint32_t>(edge >> 32), b = static_cast<std::uint32_t>(edge);
    const glm::dvec3 p = leaf_.positions[a] - plane_.origin, q = leaf_.positions[b] - plane_.origin;
    const double along = distances_[a] - distances_[b];
    // Both may lie in the plane; then they are on different sides by rounding alone.
    const double t = along == 0.0 ? 0.5 : distances_[a] / along;
    const glm::dvec3 at = t <= 0.0 ? p : t >= 1.0 ? q : p + t * (q - p);
    return {glm::dot(at, plane_.u), glm::dot(at, plane_.v)};
  }

  const Leaf& leaf_;
  const Plane& plane_;
  std::vector<double> distances_;
  std::vector<bool> above_;
  std::vector<Segment> segments_;
  struct Link {
    std::size_t segment, before;  // the link before it at the same edge
  };
  std::vector<Link> links_;
  std::unordered_map<Edge, std::size_t> last_link_;
};

/// The part of a tree below one node, ready to be cut.
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
  /// Vertices nearer to a plane lie in it. Corners of one polygon are off by some 1e-15 of the
  /// scale, and by more, seen from the plane of a small triangle; corners that were stored as float
  /// or with six digits are off by more than 1e-8, and their planes differ.
  [[nodiscard]] double tolerance() const { return 1e-10 * scale_; }

  [[nodiscard]] Outline section(const Plane& plane, Side side) const {
    std::vector<Outline> results(reached_.size());
    std::vector<Outline> operands;
    for (std::size_t i = 0; i < reached_.size(); ++i) {
      const Tree::Node& node = tree_.nodes()[reached_[i]];
      if (node.operation == Operation::kSolid) {
        results[i] = section(leaves_[leaf_of_[i]], plane, side);
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
        results[i] = unite(operands);
      } else if (node.operation == Operation::kIntersection) {
        results[i] = intersect(operands);
      } else {
        results[i] = subtract(operands);
      }
    }
    return std::move(results.back());  // the root stands last
  }

 private:
  [[nodiscard]] Outline section(const Leaf& leaf, const Plane& plane, Side side) const {
    if (leaf.box.empty()) return {};
    const glm::dvec3 half = 0.5 * (leaf.box.high - leaf.box.low);
    const double reach = glm::dot(half, glm::abs(plane.normal));
    const double distance = glm::dot(leaf.box.low + half - plane.origin, plane.normal);
    if (std::abs(distance) > reach + tolerance()) return {};
    return LeafSection(leaf, plane, tolerance(), side).run();
  }

  const Tree& tree_;
  std::vector<Tree::NodeId> reached_;  // sorted
  std::vector<std::size_t> leaf_of_;
  std::vector<Leaf> leaves_;
  double scale_ = 0.0;
};

/// Planes, each once. They are found again by their numbers, rounded to a grid much coarser than
/// the tolerance: a plane near the border of a cell is looked for in the next cell too.
class Planes {
 public:
  explicit Planes(const Cutter& cutter)
      : tolerance_(cutter.tolerance()), grain_{1e-6, 1e-6, 1e-6, 1e-6 * cutter.scale()} {}

  /// Adds the plane of a triangle unless the triangle lies in one that is here.
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
        if (holds(planes_[index], corners)) return;
      }
    }
    cells_[low].push_back(planes_.size());
    planes_.push_back(make_plane(corners[0], normal));
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

  double tolerance_;
  std::array<double, 4> grain_;
  std::vector<Plane> planes_;
  std::unordered_map<Cell, std::vector<std::size_t>, HashCell> cells_;
};

bool meet(const Bounds& box, const glm::dvec3& low, const glm::dvec3& high, double margin) {
  for (int i = 0; i < 3; ++i) {
    if (low[i] > box.high[i] + margin || high[i] < box.low[i] - margin) return false;
  }
  return true;
}

/// The planes of all triangles that may be boundary.
std::vector<Plane> planes_of(const Cutter& cutter, const Bounds& box) {
  Planes planes(cutter);
  for (const Leaf& leaf : cutter.leaves()) {
    for (const glm::uvec3& t : leaf.triangles) {
      const std::array<glm::dvec3, 3> p{leaf.positions[t.x], leaf.positions[t.y],
                                        leaf.positions[t.z]};
      if (!meet(box, glm::min(p[0], glm::min(p[1], p[2])), glm::max(p[0], glm::max(p[1], p[2])),
                cutter.tolerance())) {
        continue;
      }
      glm::dvec3 normal = glm::cross(p[1] - p[0], p[2] - p[0]);
      const double length = glm::length(normal);
      // Without a direction that means something a triangle has no inside to bound.
      if (!(length > 1e-24 * cutter.scale() * cutter.scale())) continue;
      normal /= length;
      const int first = std::abs(normal.x) > 0.5 ? 0 : std::abs(normal.y) > 0.5 ? 1 : 2;
      planes.add(p, normal[first] < 0.0 ? -normal : normal);
    }
  }
  return planes.take();
}

void add_pieces(TriangleSoup& mesh, const Plane& plane, const Outline& region, bool up) {
  if (region.empty()) return;
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const auto& contour : region.contours) {
    for (const glm::dvec2& p : contour) {
      mesh.positions.push_back(plane.origin + p.x * plane.u + p.y * plane.v);
    }
  }
  for (glm::uvec3 t : triangulate(region)) {
    if (!up) std::swap(t.y, t.z);
    mesh.triangles.push_back(t + first);
  }
}

Result<TriangleSoup> cut_boundary(const Tree& tree, Tree::NodeId node, const Execution& execution) {
  const Cutter cutter(tree, node);
  const Bounds box = bounds(tree, node);
  if (box.empty()) return TriangleSoup();
  const std::vector<Plane> planes = planes_of(cutter, box);
  double triangles = 0;
  for (const Leaf& leaf : cutter.leaves()) triangles += static_cast<double>(leaf.triangles.size());
  const double work = 2.0 * static_cast<double>(planes.size()) * triangles;
  if (work > kMostDistances) {
    return fail(ErrorCode::kLimit, "{} planes would have to be cut with {:.0f} triangles",
                planes.size(), triangles);
  }
  std::vector<TriangleSoup> pieces(planes.size());
  Execution quiet = execution;
  quiet.progress = {};
  parallel_for(quiet, planes.size(), [&](std::size_t i, int) {
    std::vector<Outline> sides{cutter.section(planes[i], Side::kBelow),
                               cutter.section(planes[i], Side::kAbove)};
    if (sides[0].empty() && sides[1].empty()) return;
    add_pieces(pieces[i], planes[i], subtract(sides), true);
    std::swap(sides[0], sides[1]);
    add_pieces(pieces[i], planes[i], subtract(sides), false);
  });
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

Outline cross_section(const Tree& tree, Tree::NodeId node) {
  const Cutter cutter(tree, node);
  const Plane plane;
  std::vector<Outline> sides{cutter.section(plane, Side::kBelow),
                             cutter.section(plane, Side::kAbove)};
  return unite(sides);
}

Result<TriangleSoup> boundary(const Tree& tree, Tree::NodeId node, const Execution& execution) {
  TriangleSoup mesh;
  std::optional<Error> error;
  for_each_operand(tree, node, [&](Tree::NodeId operand) {
    if (error) return;
    const Tree::Node& at = tree.nodes()[operand];
    if (at.operation == Operation::kSolid) {
      append(mesh, world_mesh(tree.solids()[at.first]));
      return;
    }
    auto pieces = cut_boundary(tree, operand, execution);
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
