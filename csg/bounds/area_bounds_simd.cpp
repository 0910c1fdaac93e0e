#include "csg/bounds/area_bounds.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "csg/bounds/area_bounds_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <cmath>

#include "strata/raster/view.h"

// A triangle at a time against a vector of areas, in single precision: what is rounded away is
// added to the bounds.

HWY_BEFORE_NAMESPACE();
namespace strata::csg {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using AreaF32 = hn::CappedTag<float, AreaBounds::kAreas>;
using AreaI32 = hn::RebindToSigned<AreaF32>;
using AreaVec = hn::Vec<AreaF32>;

/// Where areas and their corners lie in a tile, in pixels.
struct AreaPlaces {
  static constexpr int kCornersAcross = AreaBounds::kAcross + 1;
  static constexpr int kCorners = kCornersAcross * kCornersAcross, kCornersHeld = 32;
  alignas(64) float u[AreaBounds::kAreas], v[AreaBounds::kAreas];
  alignas(64) float corner_u[kCornersHeld], corner_v[kCornersHeld];
};
constexpr AreaPlaces make_area_places() {
  AreaPlaces places{};
  for (int i = 0; i < AreaBounds::kAreas; ++i) {
    places.u[i] = static_cast<float>(i % AreaBounds::kAcross * AreaBounds::kSide);
    places.v[i] = static_cast<float>(i / AreaBounds::kAcross * AreaBounds::kSide);
  }
  for (int i = 0; i < AreaPlaces::kCorners; ++i) {
    places.corner_u[i] = static_cast<float>(i % AreaPlaces::kCornersAcross * AreaBounds::kSide);
    places.corner_v[i] = static_cast<float>(i / AreaPlaces::kCornersAcross * AreaBounds::kSide);
  }
  return places;
}
constexpr AreaPlaces kPlaces = make_area_places();

/// Sums of three products in single precision are off by less than this share of their sizes.
constexpr float kShare = 0x1p-20F;

class AreaBounder {
 public:
  AreaBounder(const glm::ivec2& tile, double steep_from, bool with_exits, AreaBounds& bounds)
      : tile_(tile), steep_from_(steep_from), with_exits_(with_exits), bounds_(&bounds) {}

  HWY_INLINE void add(const glm::ivec3& p0, glm::ivec3 p1, glm::ivec3 p2, std::uint32_t triangle) {
    constexpr float kTile = kTileSide;
    const int base_u = tile_.x * kLatticeSteps, base_v = tile_.y * kLatticeSteps;
    const std::int64_t area =
        std::int64_t{p1.x - p0.x} * (p2.y - p0.y) - std::int64_t{p2.x - p0.x} * (p1.y - p0.y);
    if (area == 0) return;
    const bool exit = area > 0;
    if (exit && !with_exits_) return;
    if (!exit) std::swap(p1, p2);

    // The edges at the tile's first corner, and their steps by a pixel.
    float edge[3], along_u[3], along_v[3], off[3];
    const auto set_edge = [&](int i, const glm::ivec3& p, const glm::ivec3& q) {
      const double a = p.y - q.y, b = q.x - p.x;
      edge[i] = static_cast<float>(a * (base_u - p.x) + b * (base_v - p.y));
      along_u[i] = static_cast<float>(a * kLatticeSteps);
      along_v[i] = static_cast<float>(b * kLatticeSteps);
      off[i] = kShare * (std::abs(edge[i]) + kTile * (std::abs(along_u[i]) + std::abs(along_v[i])));
    };
    set_edge(0, p0, p1), set_edge(1, p1, p2), set_edge(2, p2, p0);
    if (!exit) cover_corners(edge, along_u, along_v, off);

    const double inverse = 1.0 / std::abs(static_cast<double>(area));
    const double u1 = p1.x - p0.x, v1 = p1.y - p0.y, w1 = p1.z - p0.z;
    const double u2 = p2.x - p0.x, v2 = p2.y - p0.y, w2 = p2.z - p0.z;
    const double slope_u = (w1 * v2 - w2 * v1) * inverse, slope_v = (u1 * w2 - u2 * w1) * inverse;
    const auto [low, high] = std::minmax({p0.z, p1.z, p2.z});
    Plane plane{};
    // Whole depths may count as just below.
    plane.low = static_cast<float>(low - 1), plane.high = static_cast<float>(high);
    const auto place = [](int at, int base) {
      return static_cast<float>(at - base) / kLatticeSteps;
    };
    plane.u0 = place(std::min({p0.x, p1.x, p2.x}), base_u);
    plane.u1 = place(std::max({p0.x, p1.x, p2.x}), base_u);
    plane.v0 = place(std::min({p0.y, p1.y, p2.y}), base_v);
    plane.v1 = place(std::max({p0.y, p1.y, p2.y}), base_v);
    // Beyond the largest size products may be rounded: all of the triangle's depths count.
    constexpr double kLargest = 0x1p52;
    const double size =
        (std::abs(w1) + std::abs(w2)) * (std::abs(u1) + std::abs(u2) + std::abs(v1) + std::abs(v2));
    plane.steep = size > kLargest || !(std::abs(slope_u) + std::abs(slope_v) <= steep_from_);
    plane.slope_u = static_cast<float>(slope_u * kLatticeSteps);
    plane.slope_v = static_cast<float>(slope_v * kLatticeSteps);
    plane.at = static_cast<float>(p0.z + slope_u * (base_u - p0.x) + slope_v * (base_v - p0.y));
    plane.off = 4.0F + kShare * (std::abs(plane.at) +
                                 kTile * (std::abs(plane.slope_u) + std::abs(plane.slope_v)));
    const std::uint32_t met =
        bound(edge, along_u, along_v, off, plane, exit ? bounds_->exits : bounds_->entries);
    if (met != 0 && plane.steep) {
      bounds_->steep_areas |= met;
      const auto deep = static_cast<std::uint32_t>(high - low) + 1;
      bounds_->steep_depth = std::max(bounds_->steep_depth, deep);
    }
    if (met != 0) bounds_->faces.push_back({triangle, static_cast<std::uint16_t>(met), exit});
  }
  [[nodiscard]] std::uint32_t covered_corners() const { return covered_corners_; }

 private:
  struct Plane {
    float at, slope_u, slope_v, off;  ///< depth at the tile's first corner, steps by a pixel
    float low, high;
    float u0, u1, v0, v1;  ///< box of the triangle, pixels of the tile
    bool steep;
  };

  HWY_INLINE void cover_corners(const float (&edge)[3], const float (&along_u)[3],
                                const float (&along_v)[3], const float (&off)[3]) {
    const AreaF32 d;
    for (std::size_t i = 0; i < AreaPlaces::kCornersHeld; i += hn::Lanes(d)) {
      const AreaVec u = hn::Load(d, kPlaces.corner_u + i), v = hn::Load(d, kPlaces.corner_v + i);
      const auto at = [&](int k) {
        return hn::Add(hn::Set(d, edge[k] - off[k]), hn::Add(hn::Mul(u, hn::Set(d, along_u[k])),
                                                             hn::Mul(v, hn::Set(d, along_v[k]))));
      };
      const auto inside = hn::Ge(hn::Min(at(0), hn::Min(at(1), at(2))), hn::Zero(d));
      covered_corners_ |= bits_of(inside) << i;
    }
  }
  static HWY_INLINE std::uint32_t bits_of(hn::Mask<AreaF32> mask) {
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(AreaF32(), mask, bytes);
    return bytes[0] | static_cast<std::uint32_t>(bytes[1]) << 8;
  }
  HWY_INLINE std::uint32_t bound(const float (&edge)[3], const float (&along_u)[3],
                                 const float (&along_v)[3], const float (&off)[3],
                                 const Plane& plane, AreaBounds::Range& range) {
    const AreaF32 d;
    const AreaI32 di;
    constexpr auto kSide = static_cast<float>(AreaBounds::kSide);
    const AreaVec zero = hn::Zero(d), half = hn::Set(d, 0.5F);
    const AreaVec deepest = hn::Set(d, static_cast<float>(kPictureDepthLimit - 1));
    std::uint32_t met = 0;
    for (std::size_t i = 0; i < AreaBounds::kAreas; i += hn::Lanes(d)) {
      // What of the triangle's box lies in the area, as far as pixel centres go.
      const AreaVec area_u = hn::Load(d, kPlaces.u + i), area_v = hn::Load(d, kPlaces.v + i);
      const AreaVec u0 = hn::Max(hn::Add(area_u, half), hn::Set(d, plane.u0));
      const AreaVec u1 = hn::Min(hn::Add(area_u, hn::Set(d, kSide - 0.5F)), hn::Set(d, plane.u1));
      const AreaVec v0 = hn::Max(hn::Add(area_v, half), hn::Set(d, plane.v0));
      const AreaVec v1 = hn::Min(hn::Add(area_v, hn::Set(d, kSide - 0.5F)), hn::Set(d, plane.v1));
      const AreaVec u = hn::Mul(hn::Add(u0, u1), half), v = hn::Mul(hn::Add(v0, v1), half);
      const AreaVec reach_u = hn::Mul(hn::Sub(u1, u0), half),
                    reach_v = hn::Mul(hn::Sub(v1, v0), half);
      // The most that an edge reaches there.
      const auto most = [&](int k) {
        const AreaVec step_u = hn::Set(d, along_u[k]), step_v = hn::Set(d, along_v[k]);
        const AreaVec centre = hn::Add(hn::Mul(u, step_u), hn::Mul(v, step_v));
        const AreaVec reach =
            hn::Add(hn::Mul(reach_u, hn::Abs(step_u)), hn::Mul(reach_v, hn::Abs(step_v)));
        return hn::Add(hn::Set(d, edge[k] + off[k]), hn::Add(centre, reach));
      };
      auto meets = hn::Ge(hn::Min(most(0), hn::Min(most(1), most(2))), zero);
      meets = hn::And(meets, hn::And(hn::Ge(reach_u, zero), hn::Ge(reach_v, zero)));
      if (hn::AllFalse(d, meets)) continue;
      met |= bits_of(meets) << i;
      AreaVec nearest = hn::Set(d, plane.low), farthest = hn::Set(d, plane.high);
      if (!plane.steep) {
        const AreaVec step_u = hn::Set(d, plane.slope_u), step_v = hn::Set(d, plane.slope_v);
        const AreaVec centre =
            hn::Add(hn::Set(d, plane.at), hn::Add(hn::Mul(u, step_u), hn::Mul(v, step_v)));
        const AreaVec reach =
            hn::Add(hn::Set(d, plane.off),
                    hn::Add(hn::Mul(reach_u, hn::Abs(step_u)), hn::Mul(reach_v, hn::Abs(step_v))));
        nearest = hn::Max(nearest, hn::Sub(centre, reach));
        farthest = hn::Min(farthest, hn::Add(centre, reach));
      }
      nearest = hn::Min(hn::Max(nearest, zero), deepest);
      farthest = hn::Min(hn::Max(farthest, zero), deepest);
      const hn::RebindToUnsigned<AreaF32> du;
      const auto never = hn::Set(du, AreaBounds::kNever);
      const auto chosen = hn::RebindMask(du, meets);
      const auto low = hn::IfThenElse(chosen, hn::BitCast(du, hn::ConvertTo(di, nearest)), never);
      const auto high = hn::IfThenElseZero(
          chosen, hn::Add(hn::BitCast(du, hn::ConvertTo(di, farthest)), hn::Set(du, 1u)));
      hn::Store(hn::Min(low, hn::Load(du, range.nearest + i)), du, range.nearest + i);
      hn::Store(hn::Max(high, hn::Load(du, range.farthest + i)), du, range.farthest + i);
    }
    return met;
  }

  glm::ivec2 tile_;
  double steep_from_;
  bool with_exits_;
  AreaBounds* bounds_;
  std::uint32_t covered_corners_ = 0;
};

void FindAreaBounds(const LatticeMesh& mesh, std::span<const std::uint32_t> triangles,
                    const glm::ivec2& tile, double steep_from, bool with_exits, bool bounds_of_tile,
                    AreaBounds& bounds) {
  for (AreaBounds::Range* range : {&bounds.entries, &bounds.exits}) {
    std::fill_n(range->nearest, AreaBounds::kAreas, AreaBounds::kNever);
    std::fill_n(range->farthest, AreaBounds::kAreas, 0u);
  }
  if (!bounds_of_tile) {
    bounds.covered = 0;
    bounds.entries.farthest[AreaBounds::kTile] = AreaBounds::kNever;
    bounds.exits.nearest[AreaBounds::kTile] = 0;
  }
  bounds.steep_areas = 0;
  bounds.steep_depth = 0;
  bounds.faces.clear();
  const int u0 = tile.x * kLatticeSteps, u1 = u0 + kTileSide * kLatticeSteps;
  const int v0 = tile.y * kLatticeSteps, v1 = v0 + kTileSide * kLatticeSteps;
  AreaBounder bounder(tile, steep_from, with_exits, bounds);
  for (const std::uint32_t triangle : triangles) {
    const glm::uvec3& t = mesh.triangles[triangle];
    const glm::ivec3 &p = mesh.vertices[t.x], &q = mesh.vertices[t.y], &r = mesh.vertices[t.z];
    const int beside = int{std::min({p.x, q.x, r.x}) > u1} | int{std::max({p.x, q.x, r.x}) < u0} |
                       int{std::min({p.y, q.y, r.y}) > v1} | int{std::max({p.y, q.y, r.y}) < v0};
    if (beside == 0) bounder.add(p, q, r, triangle);
  }
  const std::uint32_t corners = bounder.covered_corners();
  for (int area = 0; area < AreaBounds::kAreas; ++area) {
    const int first =
        area / AreaBounds::kAcross * AreaPlaces::kCornersAcross + area % AreaBounds::kAcross;
    const std::uint32_t four = 3u << first | 3u << (first + AreaPlaces::kCornersAcross);
    if ((corners & four) == four) bounds.covered |= 1u << area;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace strata::csg
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata::csg {

HWY_EXPORT(FindAreaBounds);

void find_area_bounds(const LatticeMesh& mesh, std::span<const std::uint32_t> triangles,
                      const glm::ivec2& tile, double steep_from, bool with_exits,
                      bool bounds_of_tile, AreaBounds& bounds) {
  HWY_DYNAMIC_DISPATCH(FindAreaBounds)
  (mesh, triangles, tile, steep_from, with_exits, bounds_of_tile, bounds);
}

}  // namespace strata::csg
#endif  // HWY_ONCE
