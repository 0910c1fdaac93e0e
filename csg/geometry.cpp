#include "csg/geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vector_relational.hpp>
#include <unordered_map>

#include "mesh/clamp.h"
#include "strata/mesh/diagnose.h"

namespace strata::csg {
namespace {

/// Triangles from which a part's are sorted into tiles. Fewer are set up again in each tile, which
/// costs less than sorting.
constexpr std::size_t kBinnedFrom = 512;
constexpr std::size_t kVerticesAtOnce = 16384;

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

/// Whether the mesh is closed, has a volume, and no vertex lies outside of any face; meshes too
/// large to try are taken for not convex.
bool is_convex(const TriangleSoup& mesh) {
  constexpr std::size_t kMostTests = std::size_t{1} << 21;
  if (mesh.triangles.empty() || mesh.triangles.size() * mesh.positions.size() > kMostTests) {
    return false;
  }
  const Bounds box = bounds(mesh);
  const double size = glm::length(box.high - box.low);
  constexpr double kMostSize = 1e75;  // of which the fourth power is a number
  if (!(size < kMostSize)) return false;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3& a = mesh.positions[t.x];
    const glm::dvec3 across = glm::cross(mesh.positions[t.y] - a, mesh.positions[t.z] - a);
    const double at = glm::dot(across, a), little = 1e-9 * size * glm::length(across);
    double lowest = at;
    for (const glm::dvec3& p : mesh.positions) {
      const double height = glm::dot(across, p);
      if (height > at + little) return false;
      lowest = std::min(lowest, height);
    }
    // Flat: a ray leaves it where it enters it, and that is nothing.
    if (little > 0 && lowest >= at - little) return false;
  }
  return is_closed(mesh);
}

/// A vertex before the perspective division.
using Homogeneous = glm::dvec4;

/// Where the segment from `a` to `b` meets the plane where `side` is 0. Neighbours have the segment
/// in opposite directions: the one order makes the bits agree.
template <class Side>
Homogeneous cut_segment(Homogeneous a, Homogeneous b, const Side& side) {
  const auto less = [](const Homogeneous& p, const Homogeneous& q) {
    return std::lexicographical_compare(&p.x, &p.x + 4, &q.x, &q.x + 4);
  };
  if (less(b, a)) std::swap(a, b);
  const double at_a = side(a), at_b = side(b);
  return a + (b - a) * (at_a / (at_a - at_b));
}

/// Cuts a convex polygon at a plane, in place.
template <class Side>
void cut_polygon(std::vector<Homogeneous>& polygon, const Side& side) {
  std::vector<Homogeneous> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Homogeneous& a = polygon[i];
    const Homogeneous& b = polygon[(i + 1) % polygon.size()];
    const bool a_in = side(a) >= 0, b_in = side(b) >= 0;
    if (a_in) kept.push_back(a);
    if (a_in != b_in) kept.push_back(cut_segment(a, b, side));
  }
  polygon.swap(kept);
}

bool snap(const glm::dvec3& p, glm::ivec3& out) {
  const glm::dvec3 at(p.x * kLatticeSteps, p.y * kLatticeSteps, p.z);
  for (int i = 0; i < 3; ++i) {
    const double rounded = std::floor(at[i] + 0.5);
    if (!(std::abs(rounded) <= kMaxLatticeCoordinate)) return false;
    out[i] = static_cast<std::int32_t>(rounded);
  }
  return true;
}

/// The triangles of a part that reaches before the near plane or far out of the picture, cut there,
/// so that coordinates stay small.
Result<void> cut_part(const Geometry::Part& part, const View& view, ViewPart& out) {
  const double margin = 2.0 * std::max(view.size.x, view.size.y);
  std::vector<Homogeneous> points(part.positions.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i] = view.image_from_world * glm::dvec4(part.positions[i], 1.0);
  }
  const double near = view.near;
  const auto before_near = [near](const Homogeneous& p) { return p.w - near; };
  const auto left = [margin](const Homogeneous& p) { return p.x + margin * p.w; };
  const auto above = [margin](const Homogeneous& p) { return p.y + margin * p.w; };
  const double right_end = margin + view.size.x, below_end = margin + view.size.y;
  const auto right = [right_end](const Homogeneous& p) { return right_end * p.w - p.x; };
  const auto below = [below_end](const Homogeneous& p) { return below_end * p.w - p.y; };
  // What lies far before or behind all that can be seen is flattened: it counts, but not how far.
  constexpr double kFarBehind = 4.0 * kPictureDepthLimit;
  const auto before_far = [](const Homogeneous& p) { return kFarBehind * p.w - p.z; };
  const auto behind_front = [](const Homogeneous& p) { return p.z + kFarBehind * p.w; };
  std::vector<Homogeneous> polygon, flat;
  const auto add = [&](const std::vector<Homogeneous>& corners, std::uint32_t t) {
    if (corners.size() < 3) return true;
    const auto first = static_cast<std::uint32_t>(out.vertices.size());
    for (const Homogeneous& p : corners) {
      if (!snap(glm::dvec3(p) / p.w, out.vertices.emplace_back())) return false;
    }
    for (std::uint32_t i = 2; i < corners.size(); ++i) {
      out.cut_triangles.emplace_back(first, first + i - 1, first + i);
      out.cut_sources.push_back(t);
    }
    return true;
  };
  const auto flatten = [&](const auto& side, double z, std::uint32_t t) {
    if (std::all_of(polygon.begin(), polygon.end(),
                    [&](const Homogeneous& p) { return side(p) >= 0; })) {
      return true;
    }
    flat = polygon;
    cut_polygon(flat, [&](const Homogeneous& p) { return -side(p); });
    for (Homogeneous& p : flat) p.z = z * p.w;
    cut_polygon(polygon, side);
    return add(flat, t);
  };
  for (std::uint32_t t = 0; t < part.triangles.size(); ++t) {
    const glm::uvec3& triangle = part.triangles[t];
    polygon = {points[triangle.x], points[triangle.y], points[triangle.z]};
    if (view.perspective) cut_polygon(polygon, before_near);
    cut_polygon(polygon, left);
    cut_polygon(polygon, right);
    cut_polygon(polygon, above);
    cut_polygon(polygon, below);
    if (!flatten(before_far, kFarBehind, t) || !flatten(behind_front, -kFarBehind, t) ||
        !add(polygon, t)) {
      return fail(ErrorCode::kGeometry, "a vertex does not fit into the picture's lattice");
    }
  }
  return {};
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
  for (std::size_t i = 0; i < parts_.size(); ++i) parts_[i].convex = convex[first_with[i]] != 0;
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

Result<ViewPart> view_part(const Geometry::Part& part, const View& view,
                           const Execution& execution) {
  ViewPart out;
  if (part.triangles.empty()) return out;
  if (view.perspective) {
    double nearest = 0;
    for (int i = 0; i < 8; ++i) {
      const glm::dvec3 corner((i & 1) != 0 ? part.box.high.x : part.box.low.x,
                              (i & 2) != 0 ? part.box.high.y : part.box.low.y,
                              (i & 4) != 0 ? part.box.high.z : part.box.low.z);
      const double w = (view.image_from_world * glm::dvec4(corner, 1.0)).w;
      nearest = i == 0 ? w : std::min(nearest, w);
    }
    out.cut = nearest < view.near;
  }
  if (!out.cut) {
    out.vertices.resize(part.positions.size());
    const std::size_t chunks = (out.vertices.size() + kVerticesAtOnce - 1) / kVerticesAtOnce;
    std::vector<std::uint8_t> bad(chunks, 0);
    parallel_for(execution, chunks, [&](std::size_t chunk, int) {
      const std::size_t end = std::min(out.vertices.size(), (chunk + 1) * kVerticesAtOnce);
      for (std::size_t i = chunk * kVerticesAtOnce; i < end; ++i) {
        const Homogeneous p = view.image_from_world * glm::dvec4(part.positions[i], 1.0);
        if (!snap(glm::dvec3(p) / p.w, out.vertices[i])) bad[chunk] = 1;
      }
    });
    // A strong zoom: what lies far beside the picture is cut off.
    out.cut = std::find(bad.begin(), bad.end(), 1) != bad.end();
    out.mesh.triangles = part.triangles;
  }
  if (out.cut) {
    out.vertices.clear();
    if (auto done = cut_part(part, view, out); !done) return tl::unexpected(done.error());
    out.mesh.triangles = out.cut_triangles;
  }
  glm::ivec3 low(std::numeric_limits<int>::max()), high(std::numeric_limits<int>::min());
  for (const glm::ivec3& p : out.vertices) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  if (out.vertices.empty()) return out;
  out.rect = {std::max(0, first_pixel(low.x)), std::max(0, first_pixel(low.y)),
              std::min(view.size.x, end_pixel(high.x)), std::min(view.size.y, end_pixel(high.y))};
  out.nearest = clamp_depth(low.z, kPictureDepthLimit);
  out.farthest = clamp_depth(high.z, kPictureDepthLimit);
  out.mesh.vertices = std::move(out.vertices);
  if (!out.rect.empty() && out.mesh.triangles.size() >= kBinnedFrom) {
    const RasterTarget target{Axis::kZ, view.size.x, view.size.y, kPictureDepthLimit};
    auto bins = bin_triangles(out.mesh, target, execution);
    if (!bins) return tl::unexpected(bins.error());
    out.bins = std::move(*bins);
    out.binned = true;
  }
  return out;
}

}  // namespace strata::csg
