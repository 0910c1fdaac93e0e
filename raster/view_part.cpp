#include "raster/view_part.h"

#include <algorithm>
#include <cmath>
#include <glm/mat4x4.hpp>
#include <limits>
#include <utility>

#include "raster/triangle_setup.h"

namespace strata {
namespace {

/// Triangles from which a part's are sorted into tiles. Fewer are set up again in each tile, which
/// costs less than sorting.
constexpr std::size_t kBinnedFrom = 512;
constexpr std::size_t kVerticesAtOnce = 16384;

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
Result<void> cut_part(const PlacedMesh& part, const View& view, ViewPart& out) {
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

Result<ViewPart> view_part(const PlacedMesh& part, const View& view, const Execution& execution) {
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
    // Vertices have no value where the work was not begun.
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
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

}  // namespace strata
