// Covered pixels and exact depths of triangles in one tile: set-up of a vector of triangles at a
// time, then coverage and depth of a vector of pixels at a time. Compiled once for each SIMD target
// (Highway's dynamic dispatch); every target, the scalar one included, gives the bits of
// rasterize_exact() in raster/triangle_setup.h.
//
// This work is based on: J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988.
// We differ: depth is the exact floor of the plane, floor(n / a) for whole n and a. It is taken as
// floor((n + 1/2) * (1 / a)) in double precision: (n + 1/2) / a keeps a distance of at least 1 / 2a
// from every whole number, and the two roundings move it by at most 2^-52 n / a, which is less for
// n < 2^51.

#if defined(STRATA_RASTERIZE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef STRATA_RASTERIZE_INL_H
#undef STRATA_RASTERIZE_INL_H
#else
#define STRATA_RASTERIZE_INL_H
#endif

#include <hwy/highway.h>
#include <bit>

#include "core/lanes-inl.h"
#include "raster/triangle_setup.h"

HWY_BEFORE_NAMESPACE();
namespace strata {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using LaneF64 = hn::ScalableTag<double>;
using LaneI32 = hn::Rebind<std::int32_t, LaneF64>;
using VecF64 = hn::Vec<LaneF64>;
using VecI32 = hn::Vec<LaneI32>;
inline constexpr std::size_t kMaxLanes = HWY_MAX_BYTES / sizeof(double);
inline constexpr int kMaxBoxSide = 64;  ///< of boxes within a tile

/// Extents (lattice steps) up to which all numerators stay below 2^51 as they are: across the
/// image, along the ray, and the product of all three, since no numerator exceeds six times that.
/// Then the extent up to which they do once base and slopes are split into quotient and remainder.
inline constexpr std::int32_t kDirectExtent = std::int32_t{1} << 16;
inline constexpr std::int32_t kDirectDepthExtent = std::int32_t{1} << 24;
inline constexpr double kDirectVolume = 0x1p48;
inline constexpr std::int64_t kSplitExtent = std::int64_t{1} << 21;

/// The equations of a triangle at the first pixel of a box in a tile, and their steps by a pixel.
struct TileEquations {
  std::int32_t edge[3], edge_u[3], edge_v[3];
  /// depth = quotient + floor(remainder * inverse), and remainder > 0 wherever it counts.
  double remainder, remainder_u, remainder_v, inverse;
  std::int32_t quotient;
  bool split;  ///< the quotient has steps, too (large triangles)
  double split_quotient, quotient_u, quotient_v;
};

HWY_INLINE void split_fraction(Int128 numerator, std::int64_t area, double& quotient,
                               double& remainder) {
  const auto narrow = static_cast<std::int64_t>(numerator);
  if (HWY_LIKELY(narrow == numerator)) {
    const std::int64_t rest = narrow % area;
    quotient = static_cast<double>(narrow / area - (rest < 0 ? 1 : 0));
    remainder = static_cast<double>(rest < 0 ? rest + area : rest);
    return;
  }
  const Int128 q = floor_div(numerator, area);
  quotient = static_cast<double>(q);
  remainder = static_cast<double>(numerator - q * area);
}

/// The equations of a triangle of any size that fits. @return false when the numbers do not fit:
/// then rasterize_exact() serves.
inline HWY_NOINLINE bool make_split_equations(const TriangleSetup& t, const PixelRect& box,
                                              TileEquations& q) {
  const auto [u_low, u_high] = std::minmax({t.u[0], t.u[1], t.u[2]});
  const auto [v_low, v_high] = std::minmax({t.v[0], t.v[1], t.v[2]});
  if (std::max(u_high - u_low, v_high - v_low) > kSplitExtent) return false;
  const std::int64_t pu = std::int64_t{box.u0} * kLatticeSteps + kLatticeSteps / 2;
  const std::int64_t pv = std::int64_t{box.v0} * kLatticeSteps + kLatticeSteps / 2;
  for (int i = 0; i < 3; ++i) {
    const TriangleSetup::Edge e = t.edge(i);
    // Edge values at pixel centres differ by multiples of 256: the low bits decide nothing. Far
    // edges are clamped beyond what 64 steps can bring back.
    constexpr std::int64_t kFar = std::int64_t{1} << 30;
    const std::int64_t at = (e.a * pu + e.b * pv + e.c) >> kLatticeBits;
    q.edge[i] = static_cast<std::int32_t>(std::clamp(at, -kFar, kFar));
    q.edge_u[i] = static_cast<std::int32_t>(e.a);
    q.edge_v[i] = static_cast<std::int32_t>(e.b);
  }
  const std::int64_t du = pu - t.u[0], dv = pv - t.v[0];
  q.split = true;
  q.quotient = 0;
  q.inverse = 1.0 / static_cast<double>(t.area);
  split_fraction(Int128{t.slope_u} * du + Int128{t.slope_v} * dv - t.tie_down, t.area,
                 q.split_quotient, q.remainder);
  split_fraction(Int128{t.slope_u} * kLatticeSteps, t.area, q.quotient_u, q.remainder_u);
  split_fraction(Int128{t.slope_v} * kLatticeSteps, t.area, q.quotient_v, q.remainder_v);
  constexpr double kLargest = 1099511627776.0;  // 2^40: times 128 steps, sums stay exact
  if (std::abs(q.split_quotient) > kLargest * 128 || std::abs(q.quotient_u) > kLargest ||
      std::abs(q.quotient_v) > kLargest) {
    return false;
  }
  q.remainder += 0.5;
  q.split_quotient += static_cast<double>(t.w0);
  return true;
}

/// Set-up of a vector of triangles. Lanes are read out with at().
class SetupBatch {
 public:
  enum class Kind : std::int32_t { kNothing = 0, kDirect = 1, kLarge = 2 };

  /// The corners of a vector of triangles.
  struct Corners {
    alignas(64) std::int32_t at[3][3][kMaxLanes] = {};  ///< [vertex][u, v, w][lane]

    /// Collects those of the triangles `ids`, at most one a lane.
    HWY_INLINE void gather(const LatticeMesh& mesh, std::span<const std::uint32_t> ids,
                           const AxisFrame& frame) {
      for (std::size_t lane = 0; lane < ids.size(); ++lane) {
        const glm::uvec3& triangle = mesh.triangles[ids[lane]];
        for (int i = 0; i < 3; ++i) {
          const glm::ivec3& p = mesh.vertices[triangle[i]];
          at[i][0][lane] = p[frame.u];
          at[i][1][lane] = p[frame.v];
          at[i][2][lane] = p[frame.w];
        }
      }
    }
  };

  /// Sets up `count` triangles, at most one a lane, in the pixels of `clip`.
  HWY_INLINE void load(const Corners& corners, std::size_t count, const AxisFrame& frame,
                       const PixelRect& clip, std::uint32_t depth_limit) {
    const LaneF64 df;
    const LaneI32 di;
    const auto get = [&](int i, int axis) { return hn::Load(di, corners.at[i][axis]); };
    const VecI32 u0 = get(0, 0), v0 = get(0, 1), w0 = get(0, 2);
    VecI32 iu1 = hn::Sub(get(1, 0), u0), iv1 = hn::Sub(get(1, 1), v0), iw1 = hn::Sub(get(1, 2), w0);
    VecI32 iu2 = hn::Sub(get(2, 0), u0), iv2 = hn::Sub(get(2, 1), v0), iw2 = hn::Sub(get(2, 2), w0);

    // The box, relative to vertex 0.
    const VecI32 zero = hn::Zero(di);
    const VecI32 u_low = hn::Min(zero, hn::Min(iu1, iu2)),
                 u_high = hn::Max(zero, hn::Max(iu1, iu2));
    const VecI32 v_low = hn::Min(zero, hn::Min(iv1, iv2)),
                 v_high = hn::Max(zero, hn::Max(iv1, iv2));
    const VecI32 w_low = hn::Min(zero, hn::Min(iw1, iw2)),
                 w_high = hn::Max(zero, hn::Max(iw1, iw2));
    const VecI32 half = hn::Set(di, kLatticeSteps / 2), one = hn::Set(di, 1);
    const auto first = [&](VecI32 at) {
      return hn::ShiftRight<kLatticeBits>(hn::Add(at, hn::Sub(half, one)));
    };
    const auto end = [&](VecI32 at) {
      return hn::Add(hn::ShiftRight<kLatticeBits>(hn::Sub(at, half)), one);
    };
    const VecI32 box_u0 = hn::Max(hn::Set(di, clip.u0), first(hn::Add(u0, u_low)));
    const VecI32 box_u1 = hn::Min(hn::Set(di, clip.u1), end(hn::Add(u0, u_high)));
    const VecI32 box_v0 = hn::Max(hn::Set(di, clip.v0), first(hn::Add(v0, v_low)));
    const VecI32 box_v1 = hn::Min(hn::Set(di, clip.v1), end(hn::Add(v0, v_high)));
    const auto covers =
        hn::And(hn::FirstN(di, count), hn::And(hn::Lt(box_u0, box_u1), hn::Lt(box_v0, box_v1)));
    const VecI32 most = hn::Set(di, kSmallSide + 1);
    const VecI32 width = hn::Sub(box_u1, box_u0), height = hn::Sub(box_v1, box_v0);
    const auto small = hn::And(hn::Lt(width, most), hn::Lt(height, most));
    const VecI32 u_extent = hn::Sub(u_high, u_low), v_extent = hn::Sub(v_high, v_low),
                 w_extent = hn::Sub(w_high, w_low);
    const VecF64 volume = hn::Mul(hn::Mul(hn::PromoteTo(df, u_extent), hn::PromoteTo(df, v_extent)),
                                  hn::PromoteTo(df, w_extent));
    const VecI32 fits = hn::DemoteTo(
        di, hn::IfThenElseZero(hn::Le(volume, hn::Set(df, kDirectVolume)), hn::Set(df, 1.0)));
    const auto direct =
        hn::And(hn::And(hn::Lt(hn::Max(u_extent, v_extent), hn::Set(di, kDirectExtent + 1)),
                        hn::Lt(w_extent, hn::Set(di, kDirectDepthExtent + 1))),
                hn::Eq(fits, one));

    // All below is exact in double precision for direct triangles.
    VecF64 u1 = hn::PromoteTo(df, iu1), v1 = hn::PromoteTo(df, iv1), w1 = hn::PromoteTo(df, iw1);
    VecF64 u2 = hn::PromoteTo(df, iu2), v2 = hn::PromoteTo(df, iv2), w2 = hn::PromoteTo(df, iw2);
    VecF64 area = hn::Sub(hn::Mul(u1, v2), hn::Mul(u2, v1));
    const VecF64 zero_f = hn::Zero(df), one_f = hn::Set(df, 1.0);
    const auto clockwise = hn::Lt(area, zero_f);
    const auto swap = [&](VecF64& a, VecF64& b) {
      const VecF64 old = a;
      a = hn::IfThenElse(clockwise, b, a);
      b = hn::IfThenElse(clockwise, old, b);
    };
    swap(u1, u2), swap(v1, v2), swap(w1, w2);
    area = hn::Abs(area);
    const VecF64 slope_u = hn::Sub(hn::Mul(w1, v2), hn::Mul(w2, v1));
    const VecF64 slope_v = hn::Sub(hn::Mul(u1, w2), hn::Mul(u2, w1));
    VecF64 tie_down = one_f;  // see setup_triangle()
    if (frame.w == 1) tie_down = hn::IfThenElseZero(hn::Le(slope_u, zero_f), one_f);
    if (frame.w == 2) {
      const auto level = hn::And(hn::Eq(slope_u, zero_f), hn::Le(slope_v, zero_f));
      tie_down = hn::IfThenElseZero(hn::Or(hn::Lt(slope_u, zero_f), level), one_f);
    }
    const VecF64 steps = hn::Set(df, static_cast<double>(kLatticeSteps));
    const auto centre = [&](VecI32 pixel) {
      return hn::Add(hn::ShiftLeft<kLatticeBits>(pixel), half);
    };
    const VecF64 du = hn::PromoteTo(df, hn::Sub(centre(box_u0), u0));
    const VecF64 dv = hn::PromoteTo(df, hn::Sub(centre(box_v0), v0));
    // Depth counts from just below the lowest vertex, so that no numerator is negative.
    const VecI32 base = hn::Sub(w_low, one);
    const VecF64 numerator = hn::Sub(hn::Add(hn::Mul(slope_u, du), hn::Mul(slope_v, dv)), tie_down);
    const VecF64 lifted = hn::Sub(numerator, hn::Mul(hn::PromoteTo(df, base), area));
    hn::Store(hn::Add(lifted, hn::Set(df, 0.5)), df, remainder_);
    hn::Store(hn::Mul(slope_u, steps), df, remainder_u_);
    hn::Store(hn::Mul(slope_v, steps), df, remainder_v_);
    const VecF64 inverse = hn::Div(one_f, area);
    hn::Store(inverse, df, inverse_);
    hn::Store(hn::Mul(hn::Add(hn::Abs(slope_u), hn::Abs(slope_v)), inverse), df, steepness_);
    hn::Store(hn::Add(w0, base), di, quotient_);

    const VecF64 per_step = hn::Set(df, 1.0 / kLatticeSteps);
    const auto store_edge = [&](int i, VecF64 a, VecF64 b, VecF64 at_u, VecF64 at_v) {
      const auto tie_inside =
          hn::Or(hn::Gt(a, zero_f), hn::And(hn::Eq(a, zero_f), hn::Gt(b, zero_f)));
      const VecF64 value = hn::Sub(hn::Add(hn::Mul(a, at_u), hn::Mul(b, at_v)),
                                   hn::IfThenElse(tie_inside, zero_f, one_f));
      // Whole multiples of 256 lie between pixel centres: the low bits decide nothing.
      hn::Store(hn::DemoteTo(di, hn::Floor(hn::Mul(value, per_step))), di, edge_[i]);
      hn::Store(hn::DemoteTo(di, a), di, edge_u_[i]);
      hn::Store(hn::DemoteTo(di, b), di, edge_v_[i]);
    };
    store_edge(0, hn::Neg(v1), u1, du, dv);
    store_edge(1, hn::Sub(v1, v2), hn::Sub(u2, u1), hn::Sub(du, u1), hn::Sub(dv, v1));
    store_edge(2, v2, hn::Neg(u2), du, dv);

    hn::Store(box_u0, di, box_u0_);
    hn::Store(box_u1, di, box_u1_);
    hn::Store(box_v0, di, box_v0_);
    hn::Store(box_v1, di, box_v1_);
    const VecI32 flat =
        hn::DemoteTo(di, hn::IfThenElseZero(hn::Eq(area, zero_f), one_f));  // exact if direct
    const VecI32 kind = hn::IfThenElse(direct, hn::Sub(one, flat), hn::Set(di, 2));
    hn::Store(hn::IfThenElseZero(covers, kind), di, kind_);
    if (hn::CountTrue(di, hn::And(hn::And(small, direct), covers)) * 2 < hn::Lanes(di)) {
      // It pays for a few of the lanes no more than one by one.
      hn::Store(zero, di, small_);
    } else {
      cover_small(hn::And(hn::And(small, direct), covers), box_u1, box_v1, depth_limit);
    }
    const VecI32 turned = hn::DemoteTo(di, hn::IfThenElseZero(clockwise, one_f));
    hn::Store(frame.w == 1 ? turned : hn::Sub(one, turned), di, exit_);
  }

  [[nodiscard]] HWY_INLINE Kind kind(std::size_t lane) const {
    return static_cast<Kind>(kind_[lane]);
  }
  /// Boxes up to this side are covered here, a pixel of each lane at a time.
  static constexpr int kSmallSide = 2;
  /// Not 0 if the triangle is small: then kSmall and the covered pixels, a bit each.
  [[nodiscard]] HWY_INLINE std::uint32_t small(std::size_t lane) const {
    return static_cast<std::uint32_t>(small_[lane]);
  }
  static constexpr std::uint32_t kSmall = 1u << (kSmallSide * kSmallSide);
  [[nodiscard]] HWY_INLINE std::uint32_t small_depth(std::size_t lane, int pixel) const {
    return static_cast<std::uint32_t>(small_depth_[pixel][lane]);
  }
  [[nodiscard]] HWY_INLINE bool exit(std::size_t lane) const { return exit_[lane] != 0; }
  /// Depth steps that a lattice step along u and one along v make together, about.
  [[nodiscard]] HWY_INLINE double steepness(std::size_t lane) const { return steepness_[lane]; }
  [[nodiscard]] HWY_INLINE PixelRect box(std::size_t lane) const {
    return {box_u0_[lane], box_v0_[lane], box_u1_[lane], box_v1_[lane]};
  }
  HWY_INLINE void equations(std::size_t lane, TileEquations& q) const {
    for (int i = 0; i < 3; ++i) {
      q.edge[i] = edge_[i][lane];
      q.edge_u[i] = edge_u_[i][lane];
      q.edge_v[i] = edge_v_[i][lane];
    }
    q.remainder = remainder_[lane];
    q.remainder_u = remainder_u_[lane];
    q.remainder_v = remainder_v_[lane];
    q.inverse = inverse_[lane];
    q.quotient = quotient_[lane];
  }

 private:
  HWY_INLINE void cover_small(hn::Mask<LaneI32> chosen, VecI32 box_u1, VecI32 box_v1,
                              std::uint32_t depth_limit) {
    const LaneF64 df;
    const LaneI32 di;
    const VecI32 zero = hn::Zero(di);
    const VecI32 deepest = hn::Set(di, static_cast<std::int32_t>(depth_limit - 1));
    const VecI32 width = hn::Sub(box_u1, hn::Load(di, box_u0_));
    const VecI32 height = hn::Sub(box_v1, hn::Load(di, box_v0_));
    const VecI32 base = hn::Load(di, quotient_);
    const VecF64 inverse = hn::Load(df, inverse_);
    VecI32 bits = hn::Set(di, static_cast<std::int32_t>(kSmall));
    for (int y = 0; y < kSmallSide; ++y) {
      for (int x = 0; x < kSmallSide; ++x) {
        const int pixel = y * kSmallSide + x;
        VecI32 edges = zero;
        for (int i = 0; i < 3; ++i) {
          VecI32 at = hn::Load(di, edge_[i]);
          if (x > 0) at = hn::Add(at, hn::Mul(hn::Set(di, x), hn::Load(di, edge_u_[i])));
          if (y > 0) at = hn::Add(at, hn::Mul(hn::Set(di, y), hn::Load(di, edge_v_[i])));
          edges = hn::Or(edges, at);
        }
        const auto in_box = hn::And(hn::Lt(hn::Set(di, x), width), hn::Lt(hn::Set(di, y), height));
        const auto covered = hn::AndNot(hn::Lt(edges, zero), in_box);
        bits = hn::Or(bits, hn::IfThenElseZero(covered, hn::Set(di, 1 << pixel)));
        VecF64 remainder = hn::Load(df, remainder_);
        if (x > 0)
          remainder = hn::Add(remainder, hn::Mul(hn::Set(df, x), hn::Load(df, remainder_u_)));
        if (y > 0)
          remainder = hn::Add(remainder, hn::Mul(hn::Set(df, y), hn::Load(df, remainder_v_)));
        const VecI32 depth = hn::Add(base, hn::DemoteTo(di, hn::Mul(remainder, inverse)));
        hn::Store(hn::Min(hn::Max(depth, zero), deepest), di, small_depth_[pixel]);
      }
    }
    hn::Store(hn::IfThenElseZero(chosen, bits), di, small_);
  }

  template <class T>
  using Lanes = T[kMaxLanes];
  alignas(64) Lanes<double> remainder_, remainder_u_, remainder_v_, inverse_, steepness_;
  alignas(64) Lanes<std::int32_t> edge_[3], edge_u_[3], edge_v_[3], quotient_, kind_, exit_;
  alignas(64) Lanes<std::int32_t> small_, small_depth_[kSmallSide * kSmallSide];
  alignas(64) Lanes<std::int32_t> box_u0_, box_u1_, box_v0_, box_v1_;
};

/// The lane layout of a block of pixels: as many 32-bit lanes as a vector holds, `columns` a row (a
/// power of two, at most the lanes), rows below each other.
template <int columns>
struct PixelBlock {
#if HWY_TARGET == HWY_SCALAR
  using I32 = LaneI32;
#else
  using I32 = hn::ScalableTag<std::int32_t>;
#endif
  using U32 = hn::RebindToUnsigned<I32>;
  static constexpr int kColumns = columns;

  /// Narrow triangles fill a vector better with several short rows.
  static int lanes() { return static_cast<int>(hn::Lanes(I32())); }
  static int rows() { return lanes() / columns; }
};

/// Two vectors of doubles become one of integers, rounded towards zero.
template <class Block>
HWY_INLINE hn::Vec<typename Block::I32> to_integers(const VecF64 (&parts)[2]) {
#if HWY_TARGET == HWY_SCALAR
  return hn::DemoteTo(LaneI32(), parts[0]);
#else
  return hn::Combine(typename Block::I32(), hn::DemoteTo(LaneI32(), parts[1]),
                     hn::DemoteTo(LaneI32(), parts[0]));
#endif
}

/// The rows of a box, counted from its first, where the strips of `columns` columns of it may be
/// covered: elsewhere one edge is negative in all of a strip.
template <int columns>
struct StripRows {
  static constexpr int kMost = kMaxBoxSide / columns + 16;  ///< vectors reach beyond the last strip
  alignas(64) std::int32_t begin[kMost], end[kMost];

  /// A vector of strips at a time, and a row too many rather than one too few: a quotient of less
  /// than 64 rows is off by less than kRounding.
  HWY_INLINE void find(const TileEquations& q, int strips, int rows) {
    constexpr float kRounding = 1.0f / 1024;
    const hn::ScalableTag<std::int32_t> di;
    const hn::RebindToFloat<decltype(di)> df;
    const auto zero = hn::Zero(di), all = hn::Set(di, rows);
    const auto most = hn::Set(df, static_cast<float>(rows));
    const auto least = hn::Set(df, -1.0f);
    for (int strip = 0; strip < strips; strip += static_cast<int>(hn::Lanes(di))) {
      const auto step = hn::Mul(count_from(di, strip), hn::Set(di, columns));
      auto first = zero, last = all;
      for (int i = 0; i < 3; ++i) {
        const std::int32_t along = q.edge_u[i], down = q.edge_v[i];
        const auto best = hn::Add(hn::Set(di, q.edge[i] + std::max(0, along * (columns - 1))),
                                  hn::Mul(step, hn::Set(di, along)));
        if (down == 0) {
          last = hn::IfThenElse(hn::Lt(best, zero), zero, last);
          continue;
        }
        const auto part =
            hn::Mul(hn::ConvertTo(df, best), hn::Set(df, 1.0f / static_cast<float>(-down)));
        if (down > 0) {  // best + down * row >= 0 from some row on
          const auto from = hn::Min(hn::Max(part, hn::Zero(df)), most);
          first = hn::Max(first, hn::ConvertTo(di, hn::Add(from, hn::Set(df, 1.0f - kRounding))));
        } else {
          const auto to = hn::Min(hn::Max(part, least), most);
          last = hn::Min(last, hn::ConvertTo(di, hn::Add(to, hn::Set(df, 1.0f + kRounding))));
        }
      }
      hn::StoreU(first, di, begin + strip);
      hn::StoreU(last, di, end + strip);
    }
  }
};

/// Boxes with at least this many rows are searched for those that matter, strip by strip.
inline constexpr int kTallBox = 12;

/// Hands the depths of a block of pixels to `sink`.
template <int columns, class Sink, class V, class M>
HWY_INLINE void give_block(Sink& sink, int u, int v, int rows, V depth, M covered) {
  const typename PixelBlock<columns>::U32 d;
  if constexpr (requires { requires Sink::kTakesRows; }) {
    if (rows == 1) return sink.put_row(d, u, v, depth, covered);
  }
  alignas(64) std::uint32_t words[HWY_MAX_BYTES / 4];
  hn::Store(sink.encode(d, depth, covered), d, words);
  sink.template put_block<columns>(u, v, words, rows);
}

/// Hands the pixels of `box`, which lies within one tile (at most 64 pixels a side), to `sink`: for
/// each block sink.encode(depth, mask) gives a vector of 32-bit words, 0 where `mask` is not set,
/// and sink.put_block<columns>(u, v, words, rows) takes them, row by row from pixel (u, v) on. A
/// sink that kTakesRows gets a block of one row by sink.put_row(d, u, v, depth, mask) instead.
/// Depth is clamped to [0, depth_limit). Blocks may reach beyond the box (words 0).
template <bool split, int columns, class Sink>
HWY_INLINE void rasterize_box(const TileEquations& q, const PixelRect& box,
                              std::uint32_t depth_limit, Sink& sink) {
  using Block = PixelBlock<columns>;
  const typename Block::I32 di;
  const typename Block::U32 du;
  const LaneF64 df;
  constexpr int kParts = HWY_TARGET == HWY_SCALAR ? 1 : 2;
  const int part_lanes = static_cast<int>(hn::Lanes(df));
  const int rows = Block::rows();
  const auto iota = hn::Iota(di, 0);
  const auto column = hn::And(iota, hn::Set(di, columns - 1));
  const auto row = hn::ShiftRight<hwy::CeilLog2(columns)>(iota);
  const auto zero = hn::Zero(di);
  const auto deepest = hn::Set(di, static_cast<std::int32_t>(depth_limit - 1));
  const auto base = hn::Set(di, q.quotient);
  const VecF64 inverse = hn::Set(df, q.inverse);

  const auto edge_step = [&](int i) { return hn::Set(di, q.edge_v[i] * rows); };
  const auto edge_v0 = edge_step(0), edge_v1 = edge_step(1), edge_v2 = edge_step(2);
  const VecF64 remainder_v = hn::Set(df, q.remainder_v * rows);
  const VecF64 quotient_v = hn::Set(df, split ? q.quotient_v * rows : 0.0);

  const auto edge_lanes = [&](int i) {
    return hn::Add(hn::Mul(column, hn::Set(di, q.edge_u[i])),
                   hn::Mul(row, hn::Set(di, q.edge_v[i])));
  };
  const auto edge_lanes0 = edge_lanes(0), edge_lanes1 = edge_lanes(1), edge_lanes2 = edge_lanes(2);
  VecF64 remainder_lanes[2], quotient_lanes[2];
  for (int part = 0; part < kParts; ++part) {
    const auto lane = hn::Iota(df, static_cast<double>(part * part_lanes));
    const auto part_row = hn::Floor(hn::Mul(lane, hn::Set(df, 1.0 / columns)));
    const auto part_column = hn::Sub(lane, hn::Mul(part_row, hn::Set(df, columns)));
    const auto plane = [&](double along_u, double along_v) {
      return hn::Add(hn::Mul(part_column, hn::Set(df, along_u)),
                     hn::Mul(part_row, hn::Set(df, along_v)));
    };
    remainder_lanes[part] = plane(q.remainder_u, q.remainder_v);
    if constexpr (split) quotient_lanes[part] = plane(q.quotient_u, q.quotient_v);
  }
  const int strips = (box.u1 - box.u0 + columns - 1) / columns;
  const int height = box.v1 - box.v0;
  StripRows<columns> ranges;
  if (height >= kTallBox) ranges.find(q, strips, height);

  // Blocks begin at multiples of their width, so that what one stores another loads as it is.
  for (int strip = 0; strip < strips; ++strip) {
    const int step = strip * columns, u = box.u0 + step;
    struct {
      int begin, end;
    } range{0, height};
    if (height >= kTallBox) {
      range = {ranges.begin[strip], ranges.end[strip]};
      if (range.begin >= range.end) continue;
    }
    const auto in_box = hn::Lt(column, hn::Set(di, box.u1 - u));
    const auto edge_at = [&](int i) {
      return hn::Set(di, q.edge[i] + q.edge_u[i] * step + q.edge_v[i] * range.begin);
    };
    auto edge0 = hn::Add(edge_lanes0, edge_at(0)), edge1 = hn::Add(edge_lanes1, edge_at(1)),
         edge2 = hn::Add(edge_lanes2, edge_at(2));
    VecF64 remainder[2], quotient[2];
    for (int part = 0; part < kParts; ++part) {
      remainder[part] =
          hn::Add(remainder_lanes[part],
                  hn::Set(df, q.remainder + q.remainder_u * step + q.remainder_v * range.begin));
      if constexpr (split) {
        quotient[part] = hn::Add(
            quotient_lanes[part],
            hn::Set(df, q.split_quotient + q.quotient_u * step + q.quotient_v * range.begin));
      }
    }
    const int v_end = box.v0 + range.end;
    for (int v = box.v0 + range.begin; v < v_end; v += rows) {
      const auto inside = hn::And(in_box, hn::Lt(row, hn::Set(di, v_end - v)));
      const auto covered = hn::AndNot(hn::Lt(hn::Or3(edge0, edge1, edge2), zero), inside);
      // Blocks of a narrow triangle are seldom empty, and a wrong guess costs more than the work.
      if (columns < Block::lanes() || !hn::AllFalse(di, covered)) {
        VecF64 depth_f[2];
        for (int part = 0; part < kParts; ++part) {
          depth_f[part] = hn::Mul(remainder[part], inverse);
          if constexpr (split) {
            const auto exact = hn::Add(quotient[part], hn::Floor(depth_f[part]));
            const auto far = hn::Set(df, static_cast<double>(depth_limit - 1));
            depth_f[part] = hn::Min(hn::Max(exact, hn::Zero(df)), far);
          }
        }
        // Numerators are positive wherever it counts, so that truncation is the floor.
        auto depth = to_integers<Block>(depth_f);
        if constexpr (!split) depth = hn::Min(hn::Max(hn::Add(base, depth), zero), deepest);
        give_block<columns>(sink, u, v, rows, hn::BitCast(du, depth), hn::RebindMask(du, covered));
      }
      edge0 = hn::Add(edge0, edge_v0);
      edge1 = hn::Add(edge1, edge_v1);
      edge2 = hn::Add(edge2, edge_v2);
      for (int part = 0; part < kParts; ++part) {
        remainder[part] = hn::Add(remainder[part], remainder_v);
        if constexpr (split) quotient[part] = hn::Add(quotient[part], quotient_v);
      }
    }
  }
}

/// The widest block that a box needs, within what the target has.
template <bool split, class Sink>
HWY_INLINE void rasterize_any_box(const TileEquations& q, const PixelRect& box,
                                  std::uint32_t depth_limit, Sink& sink) {
#if HWY_TARGET == HWY_SCALAR
  rasterize_box<split, 1>(q, box, depth_limit, sink);
#else
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(hn::ScalableTag<std::int32_t>()));
  const int width = box.u1 - box.u0;
  if (kLanes <= 4 || width <= 4) return rasterize_box<split, 4>(q, box, depth_limit, sink);
  constexpr int kWide = std::max(4, std::min(8, kLanes));
  if (kLanes <= 8 || width <= 8) return rasterize_box<split, kWide>(q, box, depth_limit, sink);
  constexpr int kWidest = std::max(4, std::min(16, kLanes));
  rasterize_box<split, kWidest>(q, box, depth_limit, sink);
#endif
}

/// Rasterizes the triangles `ids` of `mesh` into `sink`: begin(exit, triangle, box), then encode()
/// and put_block(), or put_one(u, v, depth), for its pixels. A sink that has steepness() is told it
/// before begin(); one that has wants(exit) gets only the triangles it wants.
template <class Sink>
HWY_INLINE void rasterize_triangles(const LatticeMesh& mesh, const RasterTarget& target,
                                    std::span<const std::uint32_t> ids, const PixelRect& clip,
                                    Sink& sink) {
  const AxisFrame frame(target.axis);
  const std::size_t lanes = hn::Lanes(LaneF64());
  SetupBatch batch;
  TileEquations equations;
  const auto part_at = [&](std::size_t begin) {
    return ids.subspan(begin, std::min(lanes, ids.size() - begin));
  };
  // Collected one vector ahead: what was just stored word by word cannot be loaded as a vector yet.
  SetupBatch::Corners corners[2];
  corners[0].gather(mesh, part_at(0), frame);
  int turn = 0;
  for (std::size_t begin = 0; begin < ids.size(); begin += lanes, turn ^= 1) {
    const auto part = part_at(begin);
    if (begin + lanes < ids.size()) corners[turn ^ 1].gather(mesh, part_at(begin + lanes), frame);
    batch.load(corners[turn], part.size(), frame, clip, target.depth_limit);
    for (std::size_t lane = 0; lane < part.size(); ++lane) {
      const auto kind = batch.kind(lane);
      if (kind == SetupBatch::Kind::kNothing) continue;
      const PixelRect box = batch.box(lane);
      constexpr bool kTellSteepness = requires { sink.steepness(0.0); };
      constexpr bool kChooses = requires { sink.wants(true); };
      if (kind == SetupBatch::Kind::kDirect) {
        if constexpr (kChooses) {
          if (!sink.wants(batch.exit(lane))) continue;
        }
        const std::uint32_t small = batch.small(lane);
        if (small == SetupBatch::kSmall) continue;  // between the pixel centres
        if constexpr (kTellSteepness) sink.steepness(batch.steepness(lane));
        sink.begin(batch.exit(lane), part[lane], box);
        if (small != 0) {
          for (std::uint32_t bits = small & (SetupBatch::kSmall - 1); bits != 0; bits &= bits - 1) {
            const int pixel = std::countr_zero(bits);
            sink.put_one(box.u0 + pixel % SetupBatch::kSmallSide,
                         box.v0 + pixel / SetupBatch::kSmallSide, batch.small_depth(lane, pixel));
          }
          continue;
        }
        batch.equations(lane, equations);
        rasterize_any_box<false>(equations, box, target.depth_limit, sink);
        continue;
      }
      TriangleSetup t;
      const glm::uvec3& triangle = mesh.triangles[part[lane]];
      if (!setup_triangle(mesh.vertices[triangle.x], mesh.vertices[triangle.y],
                          mesh.vertices[triangle.z], frame, t)) {
        continue;
      }
      if constexpr (kChooses) {
        if (!sink.wants(t.exit)) continue;
      }
      if constexpr (kTellSteepness) sink.steepness(t.steepness());
      sink.begin(t.exit, part[lane], box);
      TileEquations large;
      if (make_split_equations(t, box, large)) {
        rasterize_any_box<true>(large, box, target.depth_limit, sink);
      } else {
        Sink copy = sink;  // its address is taken here; the sink itself may stay in registers
        rasterize_exact(t, box, target.depth_limit,
                        [&copy](int u, int v, std::uint32_t depth) { copy.put_one(u, v, depth); });
        sink = copy;
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#endif  // include guard
