#include "csg/geometry.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vector_relational.hpp>
#include <unordered_map>

#include "mesh/clamp.h"
#include "strata/mesh/diagnose.h"

namespace strata::csg {
namespace {

/// Vertices that no triangle names count too: the box is only larger.
Bounds bounds_of(const Geometry::Part& part) {
  Bounds box;
  for (const glm::dvec3& p : part.positions) box.include(p);
  return box;
}

/// Its distance from the origin.
double farthest_corner(const Bounds& box) {
  return box.empty() ? 0.0 : glm::length(glm::max(glm::abs(box.low), glm::abs(box.high)));
}

bool holds(const Bounds& box, const Bounds& other) {
  return glm::all(glm::lessThanEqual(box.low, other.low)) &&
         glm::all(glm::lessThanEqual(other.high, box.high));
}

/// The vertices of a mesh in a tree of boxes, to find those that lie outside of a plane.
class VertexTree {
 public:
  explicit VertexTree(std::span<const glm::dvec3> points)
      : points_(points.begin(), points.end()),
        boxes_(2 * std::bit_ceil(points_.size() / kFew + 1)) {
    split(0, 0, points_.size());
  }
  /// Whether dot(`across`, p) is more than `most` for a vertex p, and how many boxes and vertices
  /// were looked at, added to `tests`.
  [[nodiscard]] bool any_beyond(const glm::dvec3& across, double most, std::size_t& tests) const {
    return any_beyond(0, 0, points_.size(), across, most, tests);
  }

 private:
  static constexpr std::size_t kFew = 8;  ///< vertices that are not split

  void split(std::size_t node, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) boxes_[node].include(points_[i]);
    if (end - begin <= kFew) return;
    const glm::dvec3 sides = boxes_[node].high - boxes_[node].low;
    const int axis = sides.x >= sides.y && sides.x >= sides.z ? 0 : sides.y >= sides.z ? 1 : 2;
    const auto at = [&](std::size_t i) { return points_.begin() + static_cast<std::ptrdiff_t>(i); };
    const std::size_t middle = begin + (end - begin) / 2;
    std::nth_element(
        at(begin), at(middle), at(end),
        [axis](const glm::dvec3& a, const glm::dvec3& b) { return a[axis] < b[axis]; });
    split(2 * node + 1, begin, middle);
    split(2 * node + 2, middle, end);
  }
  [[nodiscard]] bool any_beyond(std::size_t node, std::size_t begin, std::size_t end,
                                const glm::dvec3& across, double most, std::size_t& tests) const {
    // Sums in the order of dot(), so that the corner rounds to no less than any vertex.
    const glm::dvec3 low = across * boxes_[node].low, high = across * boxes_[node].high;
    ++tests;
    if (!(glm::dot(glm::max(low, high), glm::dvec3(1.0)) > most)) return false;
    if (end - begin <= kFew) {
      tests += end - begin;
      return std::any_of(points_.begin() + static_cast<std::ptrdiff_t>(begin),
                         points_.begin() + static_cast<std::ptrdiff_t>(end),
                         [&](const glm::dvec3& p) { return glm::dot(across, p) > most; });
    }
    const std::size_t middle = begin + (end - begin) / 2;
    return any_beyond(2 * node + 1, begin, middle, across, most, tests) ||
           any_beyond(2 * node + 2, middle, end, across, most, tests);
  }

  std::vector<glm::dvec3> points_;
  std::vector<Bounds> boxes_;  ///< children of node n: 2 n + 1 and 2 n + 2
};

/// The vertices that triangles name; none if one of those is not finite.
std::vector<glm::dvec3> corners_of(const TriangleSoup& mesh) {
  std::vector<std::uint8_t> named(mesh.positions.size(), 0);
  for (const glm::uvec3& t : mesh.triangles) named[t.x] = named[t.y] = named[t.z] = 1;
  std::vector<glm::dvec3> corners;
  for (std::size_t v = 0; v < named.size(); ++v) {
    if (named[v] == 0) continue;
    const glm::dvec3& p = mesh.positions[v];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) return {};
    corners.push_back(p);
  }
  return corners;
}

/// Whether the mesh is closed, has a volume, and no vertex lies outside of any face; meshes too
/// large to try are taken for not convex.
bool is_convex(const TriangleSoup& mesh) {
  constexpr std::size_t kMostTriangles = std::size_t{1} << 16, kMostTests = std::size_t{1} << 22;
  if (mesh.triangles.empty() || mesh.triangles.size() > kMostTriangles ||
      mesh.positions.size() > 3 * kMostTriangles) {
    return false;
  }
  const std::vector<glm::dvec3> corners = corners_of(mesh);
  if (corners.empty()) return false;
  const Bounds box = bounds(mesh);
  const double size = glm::length(box.high - box.low);
  constexpr double kMostSize = 1e75;  // of which the fourth power is a number
  if (!(size < kMostSize)) return false;
  struct Plane {
    glm::dvec3 across;
    double at, little;
  };
  const auto plane_of = [&](const glm::uvec3& t) -> Plane {
    const glm::dvec3& a = mesh.positions[t.x];
    const glm::dvec3 across = glm::cross(mesh.positions[t.y] - a, mesh.positions[t.z] - a);
    return {across, glm::dot(across, a), 1e-9 * size * glm::length(across)};
  };
  // Most that are not convex show it at one of a few triangles.
  constexpr std::size_t kFewTriangles = 16;
  const std::size_t step = mesh.triangles.size() / kFewTriangles + 1;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += step) {
    const Plane plane = plane_of(mesh.triangles[i]);
    if (std::ranges::any_of(corners, [&](const glm::dvec3& p) {
          return glm::dot(plane.across, p) > plane.at + plane.little;
        })) {
      return false;
    }
  }
  const VertexTree vertices(corners);
  std::size_t tests = 0;
  glm::dvec3 below = corners.front();  // a vertex well below the last face
  for (const glm::uvec3& t : mesh.triangles) {
    const auto [across, at, little] = plane_of(t);
    if (tests > kMostTests || vertices.any_beyond(across, at + little, tests)) return false;
    // Flat: a ray leaves it where it enters it, and that is nothing.
    const double least = at - little;
    if (!(little > 0) || glm::dot(across, below) < least) continue;
    below = *std::ranges::min_element(corners, std::less<>(),
                                      [&, n = across](const auto& p) { return glm::dot(n, p); });
    tests += corners.size();
    if (glm::dot(across, below) >= least) return false;
  }
  return is_closed(mesh);
}

}  // namespace

Geometry::Geometry(const Tree& tree, const Execution& execution) {
  const auto solids = tree.solids();
  parts_.resize(solids.size());
  meshes_.reserve(solids.size());
  for (const Solid& solid : solids) {
    meshes_.push_back(solid.mesh);
    places_.push_back(solid.world_from_mesh);
  }
  std::unordered_map<const TriangleSoup*, std::size_t> firsts;
  std::vector<std::size_t> first_with;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    first_with.push_back(firsts.try_emplace(solids[i].mesh.get(), i).first->second);
  }
  std::vector<std::uint8_t> convex(solids.size(), 0);  // of the first solid with a mesh
  parallel_for(execution, solids.size(), [&](std::size_t i, int) {
    parts_[i].rule = solids[i].rule;
    const TriangleSoup* mesh = solids[i].mesh.get();
    if (mesh != nullptr) {
      if (first_with[i] == i) convex[i] = is_convex(*mesh) ? 1 : 0;
    }
    place(static_cast<std::uint32_t>(i));
  });
  // Where faces lie twice, the parity of what they enclose is even: then the solid is empty.
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    parts_[i].convex = convex[first_with[i]] != 0 && parts_[i].rule != InsideRule::kParity;
  }
  any_cut_off_ = cut_off_vast(tree);
  measure();
  share_error(tree);
}

bool Geometry::move_solid(const Tree& tree, std::uint32_t solid,
                          const glm::dmat4& world_from_mesh) {
  places_[solid] = world_from_mesh;
  place(solid);
  parts_[solid].error_share = 1.0;
  const Bounds& moved = parts_[solid].whole;
  const bool is_vast = moved.longest_side() > kVast * box_.longest_side();
  const bool again = any_cut_off_ || (!moved.empty() && is_vast);
  if (again) {  // the others are needed whole, to be cut off where the solid is now
    for (std::uint32_t i = 0; i < parts_.size(); ++i) place(i);
    any_cut_off_ = cut_off_vast(tree);
  }
  measure();
  return again;
}

bool Geometry::cut_off_vast(const Tree& tree) {
  const std::vector<ActiveBox> active = active_boxes(tree, boxes());
  bool any = false;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    Part& part = parts_[i];
    Bounds box = active[i].box;
    if (part.triangles.empty() || box.empty()) continue;
    const double size = box.longest_side();
    const auto around = [&](double sizes) {
      return Bounds{box.low - glm::dvec3(sizes * size), box.high + glm::dvec3(sizes * size)};
    };
    if (!(size > 0) || holds(around(kVast), part.whole)) continue;
    // What is taken away reaches farther than what it is taken from.
    ClampedMesh cut =
        clamp_to_box(part.positions, part.triangles, around(active[i].subtracted ? 0.5 : 0.25));
    part.positions = std::move(cut.positions);
    part.own_triangles = std::move(cut.triangles);
    part.triangles = part.own_triangles;
    part.box = bounds_of(part);
    part.convex = false;  // sheets on the sides
    any = true;
  }
  return any;
}

void Geometry::place(std::uint32_t solid) {
  const glm::dmat4& world_from_mesh = places_[solid];
  Part& part = parts_[solid];
  const TriangleSoup* mesh = meshes_[solid].get();
  if (mesh == nullptr) return;
  part.positions.resize(mesh->positions.size());
  for (std::size_t i = 0; i < part.positions.size(); ++i) {
    part.positions[i] = glm::dvec3(world_from_mesh * glm::dvec4(mesh->positions[i], 1.0));
  }
  part.own_triangles.clear();
  if (glm::determinant(glm::dmat3(world_from_mesh)) < 0) {
    part.own_triangles = mesh->triangles;
    for (glm::uvec3& triangle : part.own_triangles) std::swap(triangle.y, triangle.z);
    part.triangles = part.own_triangles;
  } else {
    part.triangles = mesh->triangles;
  }
  part.box = bounds_of(part);
  if (part.triangles.empty()) part.box = {};
  part.whole = part.box;
}

void Geometry::measure() {
  box_ = {};
  for (const Part& part : parts_) box_.include(part.box);
}

void Geometry::share_error(const Tree& tree) {
  // Rotations about points far away leave errors of that distance: hardly of more than this.
  constexpr double kFarther = 32.0;
  const double error = world_error(tree, 1.0);
  for (Part& part : parts_) {
    const double own = kFarther * farthest_corner(part.box);
    part.error_share = own < error ? own / error : 1.0;
  }
}

std::vector<Bounds> Geometry::boxes() const {
  std::vector<Bounds> boxes;
  boxes.reserve(parts_.size());
  for (const Part& part : parts_) boxes.push_back(part.whole);
  return boxes;
}

double Geometry::world_error(const Tree& tree, double relative_precision) const {
  constexpr double kMostSizes = 8.0;
  if (box_.empty()) return 0;
  Bounds result = bounds(tree, tree.root(), boxes());
  if (result.empty()) result = box_;
  return relative_precision *
         std::min(farthest_corner(box_), kMostSizes * glm::length(result.high - result.low));
}

}  // namespace strata::csg
