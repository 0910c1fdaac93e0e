#include "voxelize/colours/nearest_points.h"

#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "voxelize/colours/nearest_points.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace strata {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Products and sums are kept apart: fused ones round otherwise.
using Lane = hn::CappedTag<double, 8>;
using Vec = hn::Vec<Lane>;
static_assert(VoxelCentres::kMost % 8 == 0);  // whole vectors

struct Points {
  Vec u, v, w;
};
HWY_INLINE Points points(const VoxelCentres& centres, std::size_t i) {
  const Lane d;
  return {hn::Load(d, centres.u.data() + i), hn::Load(d, centres.v.data() + i),
          hn::Load(d, centres.w.data() + i)};
}
HWY_INLINE Vec dot(const glm::dvec3& a, const Points& p) {
  const Lane d;
  return hn::Add(hn::Add(hn::Mul(hn::Set(d, a.x), p.u), hn::Mul(hn::Set(d, a.y), p.v)),
                 hn::Mul(hn::Set(d, a.z), p.w));
}
HWY_INLINE Vec square(Vec a) { return hn::Mul(a, a); }

/// How far along an edge its point nearest to p lies.
HWY_INLINE Vec along_edge(const NearTriangle::Edge& edge, const Points& p) {
  const Lane d;
  const Vec t = hn::Sub(dot(edge.along, p), hn::Set(d, edge.start));
  return hn::Min(hn::Max(t, hn::Zero(d)), hn::Set(d, edge.length));
}
/// The square of the distance of p from the point of an edge that lies t along it.
HWY_INLINE Vec edge_distance2(const NearTriangle::Edge& edge, const glm::dvec3& corner,
                              const Points& p, Vec t) {
  const Lane d;
  const auto away = [&](Vec from, double start, double along) {
    return hn::Sub(from, hn::Add(hn::Set(d, start), hn::Mul(hn::Set(d, along), t)));
  };
  const Vec u = away(p.u, corner.x, edge.along.x), v = away(p.v, corner.y, edge.along.y),
            w = away(p.w, corner.z, edge.along.z);
  return hn::Add(hn::Add(square(u), square(v)), square(w));
}

HWY_INLINE Vec line_distance2(const NearTriangle& triangle, const Points& p) {
  const Lane d;
  Vec best = hn::Set(d, std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < 3; ++i) {
    const NearTriangle::Edge& edge = triangle.edges()[i];
    best = hn::Min(best, edge_distance2(edge, triangle.corners()[i], p, along_edge(edge, p)));
  }
  return best;
}

HWY_INLINE Vec area_distance2(const NearTriangle& triangle, const Points& p) {
  const Lane d;
  const Vec zero = hn::Zero(d);
  // Of the place above which p lies, within the plane.
  Vec beside = hn::Set(d, std::numeric_limits<double>::infinity());
  auto inside = hn::Eq(zero, zero);
  for (const NearTriangle::Edge& edge : triangle.edges()) {
    const Vec e = hn::Sub(dot(edge.outward, p), hn::Set(d, edge.border));
    const Vec t = hn::Sub(dot(edge.along, p), hn::Set(d, edge.start));
    const Vec over = hn::Max(hn::Max(hn::Neg(t), hn::Sub(t, hn::Set(d, edge.length))), zero);
    const auto out = hn::Gt(e, zero);
    inside = hn::AndNot(out, inside);
    beside = hn::IfThenElse(out, hn::Min(beside, hn::Add(square(e), square(over))), beside);
  }
  const Vec height = hn::Sub(dot(triangle.normal(), p), hn::Set(d, triangle.height()));
  return hn::Add(square(height), hn::IfThenZeroElse(inside, beside));
}

void distances2(const NearTriangle& triangle, const VoxelCentres& centres, double* squares) {
  const Lane d;
  for (std::size_t i = 0; i < centres.count; i += hn::Lanes(d)) {
    const Points p = points(centres, i);
    hn::StoreU(triangle.has_area() ? area_distance2(triangle, p) : line_distance2(triangle, p), d,
               squares + i);
  }
}

/// Weights of the corners for a vector of points.
HWY_INLINE void weights_of(const NearTriangle& triangle, const Points& p, Vec* weights) {
  const Lane d;
  const Vec zero = hn::Zero(d), one = hn::Set(d, 1.0);
  Vec best = hn::Set(d, std::numeric_limits<double>::infinity());
  weights[0] = one, weights[1] = weights[2] = zero;  // the nearest point of an edge
  Vec inner[3];                                      // the nearest point is the foot of p
  const auto all = hn::Eq(zero, zero), area = triangle.has_area() ? all : hn::Not(all);
  auto inside = area;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t next = (i + 1) % 3, last = (i + 2) % 3;
    const NearTriangle::Edge& edge = triangle.edges()[i];
    const Vec length = hn::Set(d, edge.length);
    const Vec e = hn::Sub(dot(edge.outward, p), hn::Set(d, edge.border));
    const auto on = hn::And(area, hn::Le(e, zero));
    inside = hn::And(inside, on);
    inner[last] = hn::Mul(hn::Neg(e), length);
    const Vec t = along_edge(edge, p);
    const Vec distance = edge_distance2(edge, triangle.corners()[i], p, t);
    const auto nearer = hn::AndNot(on, hn::Lt(distance, best));
    best = hn::IfThenElse(nearer, distance, best);
    const Vec part = edge.length > 0.0 ? hn::Div(t, length) : zero;
    weights[i] = hn::IfThenElse(nearer, hn::Sub(one, part), weights[i]);
    weights[next] = hn::IfThenElse(nearer, part, weights[next]);
    weights[last] = hn::IfThenZeroElse(nearer, weights[last]);
  }
  const Vec sum = hn::Add(hn::Add(inner[0], inner[1]), inner[2]);
  inside = hn::And(inside, hn::Gt(sum, zero));
  for (std::size_t i = 0; i < 3; ++i) {
    weights[i] = hn::IfThenElse(inside, hn::Div(inner[i], sum), weights[i]);
  }
}

void nearest_points(const NearTriangle& triangle, const VoxelCentres& centres, glm::dvec3* found) {
  const Lane d;
  for (std::size_t i = 0; i < centres.count; i += hn::Lanes(d)) {
    Vec weights[3];
    weights_of(triangle, points(centres, i), weights);
    HWY_ALIGN double numbers[3][8];
    for (std::size_t k = 0; k < 3; ++k) hn::Store(weights[k], d, numbers[k]);
    for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
      found[i + lane] = {numbers[0][lane], numbers[1][lane], numbers[2][lane]};
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata {

HWY_EXPORT(distances2);
HWY_EXPORT(nearest_points);

void find_distances2(const NearTriangle& triangle, const VoxelCentres& centres,
                     std::array<double, VoxelCentres::kMost>& squares) {
  HWY_DYNAMIC_DISPATCH(distances2)(triangle, centres, squares.data());
}

void find_nearest_points(const NearTriangle& triangle, const VoxelCentres& centres,
                         std::array<glm::dvec3, VoxelCentres::kMost>& weights) {
  HWY_DYNAMIC_DISPATCH(nearest_points)(triangle, centres, weights.data());
}

}  // namespace strata
#endif  // HWY_ONCE
