// Small triangles as spans: a vector of triangles at a time gives, row by row, the pixels between
// their edges, cut into blocks of a vector of pixels. What a block costs does not depend on its
// triangle, and no branch does. Compiled once for each SIMD target (Highway's dynamic dispatch);
// every target gives the bits of rasterize_exact() in raster/triangle_setup.h.
//
// Where an edge crosses a row. Edge values at pixel centres are n = n0 + a x + b y, inside where
// n >= 0. For whole n that is n + 1/2 > 0, so x lies beyond t = -(n0 + 1/2 + b y) / a where a > 0,
// and before t where a < 0. At no whole x is |n + 1/2| below 1/2: t keeps 1 / 2|a| from whole
// numbers. Within kSpanExtent |a|, |b| < 2^13, y < 2^5, |n0| <= 2^19. In single precision the
// roundings of 1 / a, of (n0 + 1/2) / a and of b / a, the product with y and the two sums move t by
// at most 2^-24 (3 |n0 + 1/2| + 4 |b y| + |n + 1/2|) / |a| < 0.3 / |a|.
//
// Depth is the floor of (n + 1/2) / area, as in raster/rasterize-inl.h, with n below 2^47 all over
// the tile, since slopes are below 2^30: what the roundings of 1 / area and of the sum of three
// products move is below 2^-53 2^49 / area = 1 / 16 area, and it keeps 1 / 2 area from whole
// numbers. 1.5 2^20 is added to it, so that the upper word of the double ends with its whole part,
// which has less than 20 bits; that moves it by at most 2^-30, not more than 1 / 16 area.

#if defined(STRATA_SPANS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef STRATA_SPANS_INL_H
#undef STRATA_SPANS_INL_H
#else
#define STRATA_SPANS_INL_H
#endif

#include <hwy/highway.h>

#include <bit>
#include <cstring>

#include "raster/rasterize-inl.h"
#include "raster/span_masks.h"
#include "strata/core/depth_list.h"

HWY_BEFORE_NAMESPACE();
namespace strata {
namespace HWY_NAMESPACE {

/// Triangles become spans where they extend over fewer lattice steps across the image, and along
/// the ray, and where the product of both is less than the last: then slopes fit 31 bits.
inline constexpr std::int32_t kSpanExtent = std::int32_t{1} << 13;
inline constexpr std::int32_t kSpanDepthExtent = std::int32_t{1} << 18;
inline constexpr float kSpanProduct = 0x1p29F;

/// A lane a triangle, and then a lane a pixel.
using SpanI32 = hn::CappedTag<std::int32_t, 8>;
using SpanU32 = hn::RebindToUnsigned<SpanI32>;
using SpanF32 = hn::RebindToFloat<SpanI32>;
using SpanVecI32 = hn::Vec<SpanI32>;
using SpanVecU32 = hn::Vec<SpanU32>;
using SpanVecF32 = hn::Vec<SpanF32>;
inline constexpr int kSpanLanes = static_cast<int>(hn::MaxLanes(SpanI32()));
inline constexpr int kSpanParts = kSpanLanes > 1 ? 2 : 1;  ///< vectors of doubles
using SpanF64 = hn::CappedTag<double, kSpanLanes / kSpanParts>;
using SpanVecF64 = hn::Vec<SpanF64>;

/// The part of a vector that a vector of doubles takes.
HWY_INLINE SpanVecF64 span_part(SpanVecI32 values, int part) {
  const SpanF64 df;
#if HWY_TARGET == HWY_SCALAR
  (void)part;
  return hn::PromoteTo(df, values);
#else
  const hn::Rebind<std::int32_t, SpanF64> half;
  return hn::PromoteTo(df, part == 0 ? hn::LowerHalf(half, values) : hn::UpperHalf(half, values));
#endif
}

/// A double plus this holds its floor in the upper word, plus kFloorBias.
inline constexpr double kFloorsInUpper = 0x1.8p20;
inline constexpr std::int32_t kFloorBias = 0x41380000;
/// The upper words of the even columns, which come first, and the odd ones.
HWY_INLINE SpanVecU32 upper_words(const SpanVecF64 (&parts)[2]) {
  const SpanU32 du;
#if HWY_TARGET == HWY_SCALAR
  const auto bits = hn::BitCast(hn::RebindToUnsigned<SpanF64>(), parts[0]);
  return hn::Set(du, static_cast<std::uint32_t>(hn::GetLane(bits) >> 32));
#else
  return hn::OddEven(hn::BitCast(du, parts[1]), hn::DupOdd(hn::BitCast(du, parts[0])));
#endif
}

/// For each column of a tile the numbers of a vector of columns from there on, in the order that
/// upper_words() asks for.
struct SpanColumns {
  alignas(64) double from[kTileSide][kSpanLanes] = {};
  constexpr SpanColumns() {
    for (int first = 0; first < kTileSide; ++first) {
      for (int i = 0; i < kSpanLanes; ++i) {
        from[first][i / kSpanParts + i % kSpanParts * (kSpanLanes / kSpanParts)] = first + i;
      }
    }
  }
};
inline constexpr SpanColumns kSpanColumns;

/// The spans of a vector of triangles.
class SpanBatch {
 public:
  /// The corners of the triangles `ids`, at most one a lane.
  struct Corners {
    alignas(64) std::int32_t at[3][3][kSpanLanes] = {};  ///< [vertex][u, v, w][lane]

    HWY_INLINE void gather(const LatticeMesh& mesh, std::span<const std::uint32_t> ids,
                           const AxisFrame& frame) {
      const std::uint32_t* all = ids.data();
      std::uint32_t some[kSpanLanes];
      if (ids.size() < kSpanLanes) {
        std::fill(std::copy(ids.begin(), ids.end(), some), some + kSpanLanes, ids.front());
        all = some;
      }
      for (int i = 0; i < 3; ++i) {
        std::int32_t(*const to)[kSpanLanes] = at[i];
        std::int32_t* by_axis[3];
        by_axis[frame.u] = to[0], by_axis[frame.v] = to[1], by_axis[frame.w] = to[2];
        gather_corner(mesh, all, i, by_axis);
      }
    }

   private:
    /// Corner `i` of each triangle, x, y and z.
    static HWY_INLINE void gather_corner(const LatticeMesh& mesh, const std::uint32_t* ids, int i,
                                         std::int32_t* const* to) {
      const auto point = [&](int lane) { return &mesh.vertices[mesh.triangles[ids[lane]][i]].x; };
#if HWY_TARGET == HWY_SCALAR
      for (int axis = 0; axis < 3; ++axis) to[axis][0] = point(0)[axis];
#else
      const hn::FixedTag<std::int32_t, 4> d;
      const hn::FixedTag<std::int32_t, 2> pair;
      for (int lane = 0; lane < kSpanLanes; lane += 4) {
        const auto corner = [&](int k) {  // x, y, y, z
          const std::int32_t* const p = point(lane + k);
          return hn::Combine(d, hn::LoadU(pair, p + 1), hn::LoadU(pair, p));
        };
        const auto a = corner(0), b = corner(1), c = corner(2), e = corner(3);
        const auto ab = hn::InterleaveLower(d, a, b), ce = hn::InterleaveLower(d, c, e);
        const auto ab_z = hn::InterleaveUpper(d, a, b), ce_z = hn::InterleaveUpper(d, c, e);
        hn::Store(hn::ConcatLowerLower(d, ce, ab), d, to[0] + lane);
        hn::Store(hn::ConcatUpperUpper(d, ce, ab), d, to[1] + lane);
        hn::Store(hn::ConcatUpperUpper(d, ce_z, ab_z), d, to[2] + lane);
      }
#endif
    }
  };

  SpanBatch(const AxisFrame& frame, const PixelRect& clip, std::uint32_t depth_limit)
      : frame_(frame), clip_(clip), deepest_(static_cast<std::int32_t>(depth_limit - 1)) {}

  /// Collects the blocks of the small triangles among `ids` that `sink` wants.
  /// @return lanes of triangles that may cover pixels and are not small
  template <class Sink>
  HWY_INLINE hn::Mask<SpanI32> load(const Corners& corners, std::span<const std::uint32_t> ids,
                                    const Sink& sink) {
    const SpanI32 di;
    const SpanF32 df;
    const auto get = [&](int i, int axis) { return hn::Load(di, corners.at[i][axis]); };
    const SpanVecI32 zero = hn::Zero(di), one = hn::Set(di, 1);
    const SpanVecI32 half = hn::Set(di, kLatticeSteps / 2);
    const SpanVecI32 u0 = get(0, 0), v0 = get(0, 1), w0 = get(0, 2);
    SpanVecI32 u1 = hn::Sub(get(1, 0), u0), v1 = hn::Sub(get(1, 1), v0),
               w1 = hn::Sub(get(1, 2), w0);
    SpanVecI32 u2 = hn::Sub(get(2, 0), u0), v2 = hn::Sub(get(2, 1), v0),
               w2 = hn::Sub(get(2, 2), w0);
    // The box, relative to vertex 0.
    const auto low = [&](SpanVecI32 a, SpanVecI32 b) { return hn::Min(zero, hn::Min(a, b)); };
    const auto high = [&](SpanVecI32 a, SpanVecI32 b) { return hn::Max(zero, hn::Max(a, b)); };
    const SpanVecI32 u_low = low(u1, u2), u_high = high(u1, u2), v_low = low(v1, v2),
                     v_high = high(v1, v2), w_low = low(w1, w2), w_high = high(w1, w2);
    const auto first = [&](SpanVecI32 at) {
      return hn::ShiftRight<kLatticeBits>(hn::Add(at, hn::Sub(half, one)));
    };
    const auto end = [&](SpanVecI32 at) { return hn::ShiftRight<kLatticeBits>(hn::Add(at, half)); };
    const SpanVecI32 box_u0 = hn::Max(hn::Set(di, clip_.u0), first(hn::Add(u0, u_low)));
    const SpanVecI32 box_u1 = hn::Min(hn::Set(di, clip_.u1), end(hn::Add(u0, u_high)));
    const SpanVecI32 box_v0 = hn::Max(hn::Set(di, clip_.v0), first(hn::Add(v0, v_low)));
    const SpanVecI32 box_v1 = hn::Min(hn::Set(di, clip_.v1), end(hn::Add(v0, v_high)));
    const auto covers = hn::And(hn::FirstN(di, ids.size()),
                                hn::And(hn::Lt(box_u0, box_u1), hn::Lt(box_v0, box_v1)));
    const SpanVecI32 across = hn::Max(hn::Sub(u_high, u_low), hn::Sub(v_high, v_low));
    const SpanVecI32 along = hn::Sub(w_high, w_low);
    const auto product = hn::Mul(hn::ConvertTo(df, across), hn::ConvertTo(df, along));
    const auto fits = hn::RebindMask(di, hn::Lt(product, hn::Set(df, kSpanProduct)));
    const auto small =
        hn::And(hn::And(covers, fits), hn::And(hn::Lt(across, hn::Set(di, kSpanExtent)),
                                               hn::Lt(along, hn::Set(di, kSpanDepthExtent))));
    // Beyond those extents products would not fit.
    const auto keep = [&](SpanVecI32& value) { value = hn::IfThenElseZero(small, value); };
    keep(u1), keep(v1), keep(w1), keep(u2), keep(v2), keep(w2);

    const auto cross = [](SpanVecI32 a1, SpanVecI32 b2, SpanVecI32 a2, SpanVecI32 b1) {
      return hn::Sub(hn::Mul(a1, b2), hn::Mul(a2, b1));
    };
    SpanVecI32 area = cross(u1, v2, u2, v1);
    const auto clockwise = hn::Lt(area, zero);
    const auto swap = [&](SpanVecI32& a, SpanVecI32& b) {
      const SpanVecI32 old = a;
      a = hn::IfThenElse(clockwise, b, a);
      b = hn::IfThenElse(clockwise, old, b);
    };
    swap(u1, u2), swap(v1, v2), swap(w1, w2);
    area = hn::Abs(area);
    auto chosen = hn::And(small, hn::Gt(area, zero));
    const auto exits = hn::VecFromMask(di, frame_.w == 1 ? clockwise : hn::Not(clockwise));
    if constexpr (requires { sink.wants(true); }) {
      const auto wanted = [&](bool exit) { return hn::Set(di, sink.wants(exit) ? -1 : 0); };
      chosen = hn::And(chosen, hn::MaskFromVec(hn::Or(hn::And(exits, wanted(true)),
                                                      hn::AndNot(exits, wanted(false)))));
    }
    height_ = hn::IfThenElseZero(chosen, hn::Sub(box_v1, box_v0));
    rows_ = hn::GetLane(hn::MaxOfLanes(di, height_));
    row_begin_ =
        hn::GetLane(hn::MinOfLanes(di, hn::IfThenElse(chosen, box_v0, hn::Set(di, clip_.v1)))) -
        clip_.v0;
    row_end_ =
        hn::GetLane(hn::MaxOfLanes(di, hn::IfThenElse(chosen, box_v1, hn::Set(di, clip_.v0)))) -
        clip_.v0;

    const auto centre = [&](SpanVecI32 pixel) {
      return hn::Add(hn::ShiftLeft<kLatticeBits>(pixel), half);
    };
    const SpanVecI32 du = hn::IfThenElseZero(small, hn::Sub(centre(box_u0), u0));
    const SpanVecI32 dv = hn::IfThenElseZero(small, hn::Sub(centre(box_v0), v0));
    width_ = hn::Sub(box_u1, box_u0);
    column_ = hn::Sub(box_u0, hn::Set(di, clip_.u0));
    row_ = hn::Sub(box_v0, hn::Set(di, clip_.v0));
    set_edge(0, hn::Neg(v1), u1, du, dv);
    set_edge(1, hn::Sub(v1, v2), hn::Sub(u2, u1), hn::Sub(du, u1), hn::Sub(dv, v1));
    set_edge(2, v2, hn::Neg(u2), du, dv);

    const SpanVecI32 slope_u = cross(w1, v2, w2, v1), slope_v = cross(u1, w2, u2, w1);
    SpanVecI32 tie_down = one;  // see setup_triangle()
    if (frame_.w == 1) tie_down = hn::IfThenElseZero(hn::Lt(slope_u, one), one);
    if (frame_.w == 2) {
      const auto level = hn::And(hn::Eq(slope_u, zero), hn::Lt(slope_v, one));
      tie_down = hn::IfThenElseZero(hn::Or(hn::Lt(slope_u, zero), level), one);
    }
    set_plane(area, slope_u, slope_v, tie_down,
              hn::IfThenElseZero(small, hn::Sub(centre(hn::Set(di, clip_.u0)), u0)), dv);
    base_ = hn::Sub(w0, hn::Set(di, kFloorBias));
    const auto beyond =
        hn::Or(hn::Lt(hn::Add(w0, w_low), one), hn::Gt(hn::Add(w0, w_high), hn::Set(di, deepest_)));
    clamps_ = !hn::AllFalse(di, hn::And(chosen, beyond));
    set_surfaces(ids, hn::ShiftLeft<31>(hn::BitCast(SpanU32(), exits)));
    return hn::AndNot(small, covers);
  }

  /// Hands the pixels of the triangles to `sink`. First comes sink.begin_spans(row_begin, row_end,
  /// pixels), then sink.make_bases(depths, surfaces, bases): what the sink makes of the depth that
  /// those of a triangle count from, and of its surface, which is DepthItem's. Then
  /// sink.put_span(first pixel, depths, covered, base) for each block of kSpanLanes pixels that
  /// follow each other. A pixel counts from that of the tile, kTileSide a row, and kTilePixels
  /// further where a ray leaves, if the sink keeps those pixels apart. Where the sink
  /// has steepness(), the steepness of the triangles stands before `bases`.
  template <class Sink>
  HWY_INLINE void cover(Sink& sink) {
    if (rows_ <= 0) return;
    const std::size_t count = collect_blocks<Sink::kApart>();
    sink.begin_spans(row_begin_, row_end_, pixels_);
    if (clamps_) {
      cover_blocks<true>(count, sink);
    } else {
      cover_blocks<false>(count, sink);
    }
  }

 private:
  static constexpr int kRows = kSpanExtent / kLatticeSteps;
  static constexpr std::size_t kBlocks = static_cast<std::size_t>(kRows * kRows + kSpanLanes);
  static_assert(kTilePixels == 1 << 12 && kRows * kSpanLanes <= 1 << 8);
  static_assert(std::endian::native == std::endian::little);  // cover_blocks() loads parts of words

  /// A function of its own has the registers that it needs.
  template <bool clamps, class Sink>
  HWY_NOINLINE void cover_blocks(std::size_t count, Sink& covered_sink) {
    const SpanU32 d;
    const SpanI32 di;
    const SpanF64 df;
    Sink sink = covered_sink;  // no address of it is taken
    typename Sink::SpanBase bases[kSpanLanes];
    alignas(64) std::int32_t depths[kSpanLanes];
    hn::Store(base_, di, depths);
    const SpanVecI32 lifts = clamps ? hn::Zero(di) : base_;
    if constexpr (requires { sink.steepness(0.0); }) {
      sink.make_bases(lifts, surface_, steepness_, bases);
    } else {
      sink.make_bases(lifts, surface_, bases);
    }
    for (std::size_t i = 0; i < count; ++i) {
      // Loaded apart, which takes less than to take a word apart.
      std::uint16_t pixel;
      std::uint8_t row, pixels;
      const auto* const block = reinterpret_cast<const char*>(blocks_ + i);
      std::memcpy(&pixel, block, sizeof pixel);
      std::memcpy(&row, block + 2, sizeof row);
      std::memcpy(&pixels, block + 3, sizeof pixels);
      const std::size_t lane = row % kSpanLanes, column = pixel % kTileSide;
      const SpanVecF64 begin = hn::Set(df, row_planes_[row]);
      const SpanVecF64 step = hn::Set(df, plane_u_[lane]);
      SpanVecF64 parts[2];
      for (int part = 0; part < kSpanParts; ++part) {
        const std::size_t at = static_cast<std::size_t>(part) * hn::Lanes(df);
        parts[part] = hn::MulAdd(hn::Load(df, kSpanColumns.from[column] + at), step, begin);
      }
      SpanVecI32 depth = hn::BitCast(di, upper_words(parts));
      if constexpr (clamps) {
        depth = hn::Max(hn::Add(depth, hn::Set(di, depths[lane])), hn::Zero(di));
        depth = hn::Min(depth, hn::Set(di, deepest_));
      }
      const auto covered = hn::Load(d, kSpanMasks.lanes[pixels]);
      sink.put_span(d, pixel, hn::BitCast(d, depth), covered, bases[lane]);
    }
    covered_sink = sink;
  }

  /// An edge bounds rows on one side: there it has `at` and `step`, on the other they do nothing.
  HWY_INLINE void set_edge(int i, SpanVecI32 a, SpanVecI32 b, SpanVecI32 at_u, SpanVecI32 at_v) {
    const SpanI32 di;
    const SpanF32 df;
    const SpanVecI32 zero = hn::Zero(di);
    const auto tie_inside = hn::Or(hn::Gt(a, zero), hn::And(hn::Eq(a, zero), hn::Gt(b, zero)));
    const SpanVecI32 value = hn::Sub(hn::Add(hn::Mul(a, at_u), hn::Mul(b, at_v)),
                                     hn::IfThenElse(tie_inside, zero, hn::Set(di, 1)));
    const auto n = hn::ConvertTo(df, hn::ShiftRight<kLatticeBits>(value));
    const auto slope = hn::ConvertTo(df, a);
    // A level edge leaves a row as it is, or nothing of it.
    const auto inverse = hn::IfThenElse(hn::Eq(slope, hn::Zero(df)), hn::Set(df, -128.0F),
                                        hn::Div(hn::Set(df, -1.0F), slope));
    // Less 1/2 and then rounded is the floor.
    const auto at = hn::Add(hn::Mul(hn::Add(n, hn::Set(df, 0.5F)), inverse), hn::Set(df, 0.5F));
    const auto step = hn::Mul(hn::ConvertTo(df, b), inverse);
    const auto begins = hn::Ge(slope, hn::Zero(df));
    begin_[i] = hn::IfThenElse(begins, at, hn::Set(df, -0.25F));
    begin_step_[i] = hn::IfThenElseZero(begins, step);
    const auto width = hn::Sub(hn::ConvertTo(df, width_), hn::Set(df, 0.25F));
    end_[i] = hn::IfThenElse(begins, width, at);
    end_step_[i] = hn::IfThenZeroElse(begins, step);
  }

  HWY_INLINE void set_plane(SpanVecI32 area, SpanVecI32 slope_u, SpanVecI32 slope_v,
                            SpanVecI32 tie_down, SpanVecI32 du, SpanVecI32 dv) {
    const SpanF64 df;
    const SpanVecF64 half = hn::Set(df, 0.5), upper = hn::Set(df, kFloorsInUpper);
    for (int part = 0; part < kSpanParts; ++part) {
      const SpanVecF64 su = span_part(slope_u, part), sv = span_part(slope_v, part),
                       whole = span_part(area, part);
      const SpanVecF64 inverse = hn::Div(hn::Set(df, 1.0), whole);
      const SpanVecF64 numerator =
          hn::Sub(hn::Add(hn::Mul(su, span_part(du, part)), hn::Mul(sv, span_part(dv, part))),
                  span_part(tie_down, part));
      const SpanVecF64 step = hn::Mul(inverse, hn::Set(df, static_cast<double>(kLatticeSteps)));
      plane_[part] = hn::Add(hn::Mul(hn::Add(numerator, half), inverse), upper);
      plane_v_[part] = hn::Mul(sv, step);
      const std::size_t first = static_cast<std::size_t>(part) * hn::Lanes(df);
      hn::Store(hn::Mul(su, step), df, plane_u_ + first);
      hn::Store(hn::Mul(hn::Add(hn::Abs(su), hn::Abs(sv)), inverse), df, steepness_ + first);
    }
  }

  HWY_INLINE void set_surfaces(std::span<const std::uint32_t> ids, SpanVecU32 exits) {
    const SpanU32 d;
    const std::uint32_t* all = ids.data();
    std::uint32_t some[kSpanLanes] = {};
    if (ids.size() < hn::Lanes(d)) all = std::copy(ids.begin(), ids.end(), some) - ids.size();
    surface_ = hn::Or(hn::LoadU(d, all), exits);
  }

  /// Fills blocks_. @return their number
  template <bool apart>
  HWY_INLINE std::size_t collect_blocks() {
    const SpanI32 di;
    const SpanF32 df;
    const SpanVecI32 zero = hn::Zero(di), lanes = hn::Set(di, kSpanLanes);
    constexpr float kRound = 0x1.8p23F;
    const auto rounding = hn::Set(df, kRound);
    const SpanVecI32 column = hn::Sub(column_, hn::BitCast(di, rounding));
    // Blocks but for their columns and what is covered of them.
    SpanVecI32 place = hn::Or(hn::ShiftLeft<16>(hn::Iota(di, 0)), hn::ShiftLeft<6>(row_));
    if constexpr (apart) {
      place = hn::Or(place, hn::BitCast(di, hn::ShiftLeft<12>(hn::ShiftRight<31>(surface_))));
    }
    SpanVecI32 pixels = zero, y = zero;
    auto fy = hn::Zero(df);
    std::size_t count = 0;
    const SpanF64 dd;
    SpanVecF64 dy = hn::Zero(dd);
    double* row_planes = row_planes_;
    for (int row = 0; row < rows_; ++row) {
      for (int part = 0; part < kSpanParts; ++part, row_planes += hn::Lanes(dd)) {
        hn::Store(hn::MulAdd(dy, plane_v_[part], plane_[part]), dd, row_planes);
      }
      const auto begin_at = [&](int i) { return hn::MulAdd(fy, begin_step_[i], begin_[i]); };
      const auto end_at = [&](int i) { return hn::MulAdd(fy, end_step_[i], end_[i]); };
      const auto from = hn::Min(hn::Max(begin_at(0), hn::Max(begin_at(1), begin_at(2))),
                                hn::Set(df, static_cast<float>(kTileSide)));
      const auto to = hn::Min(end_at(0), hn::Min(end_at(1), end_at(2)));
      const SpanVecI32 begin = hn::Add(hn::BitCast(di, hn::Add(from, rounding)), column);
      const SpanVecI32 end = hn::Add(hn::BitCast(di, hn::Add(to, rounding)), column);
      auto valid = hn::And(hn::Lt(begin, end), hn::Lt(y, height_));
      pixels = hn::Add(pixels, hn::IfThenElseZero(valid, hn::Sub(end, begin)));
      SpanVecI32 left = hn::Sub(end, begin);
      SpanVecI32 block = hn::Add(begin, place);
      for (;;) {
        SpanVecI32 length = hn::Min(left, lanes);
        if constexpr (kSpanLanes == 1) length = hn::Max(length, zero);
        const SpanVecI32 word = hn::Add(hn::ShiftLeft<24>(length), block);
        hn::StoreU(hn::Compress(word, valid), di, reinterpret_cast<std::int32_t*>(blocks_ + count));
        count += hn::CountTrue(di, valid);
        left = hn::Sub(left, lanes);
        valid = hn::And(valid, hn::Gt(left, zero));
        if (hn::AllFalse(di, valid)) break;
        block = hn::Add(block, lanes);
      }
      place = hn::Add(place, hn::Set(di, kTileSide + (kSpanLanes << 16)));
      y = hn::Add(y, hn::Set(di, 1));
      fy = hn::Add(fy, hn::Set(df, 1.0F));
      dy = hn::Add(dy, hn::Set(dd, 1.0));
    }
    pixels_ = static_cast<std::size_t>(hn::GetLane(hn::SumOfLanes(di, pixels)));
    return count;
  }

  AxisFrame frame_;
  PixelRect clip_;
  std::int32_t deepest_;
  bool clamps_ = false;
  int rows_ = 0, row_begin_ = 0, row_end_ = 0;
  std::size_t pixels_ = 0;
  SpanVecI32 height_, width_, column_, row_, base_;
  SpanVecU32 surface_;
  SpanVecF32 begin_[3], begin_step_[3], end_[3], end_step_[3];
  SpanVecF64 plane_[2],
      plane_v_[2];  ///< at the first column of the tile and the first row of a box
  alignas(64) double plane_u_[kSpanLanes];
  alignas(64) double steepness_[kSpanLanes];           ///< SetupBatch::steepness()
  alignas(64) double row_planes_[kRows * kSpanLanes];  ///< by row of a box, and lane
  /// [pixels:8 | row of the box:5 | lane:3 | exit:4 | first pixel:12], or with fewer bits for lanes
  std::uint32_t blocks_[kBlocks];
};

/// Rasterizes the triangles `ids` of `mesh` into `sink`, in no order: small ones as spans, see
/// SpanBatch::cover(), others by rasterize_triangles().
template <class Sink>
HWY_INLINE void rasterize_spans(const LatticeMesh& mesh, const RasterTarget& target,
                                std::span<const std::uint32_t> ids, const PixelRect& clip,
                                Sink& sink) {
  if (ids.empty()) return;
  const AxisFrame frame(target.axis);
  constexpr std::size_t kLanes = static_cast<std::size_t>(kSpanLanes);
  SpanBatch batch(frame, clip, target.depth_limit);
  std::uint32_t left[512];
  std::size_t left_count = 0;
  const auto rasterize_left = [&] {
    if (left_count == 0) return;
    Sink copy = sink;  // its address is taken here; the sink itself may stay in registers
    rasterize_triangles(mesh, target, std::span(left).first(left_count), clip, copy);
    sink = copy;
    left_count = 0;
  };
  const auto part_at = [&](std::size_t begin) {
    return ids.subspan(begin, std::min(kLanes, ids.size() - begin));
  };
  // Collected one vector ahead: what was just stored word by word cannot be loaded as a vector yet.
  SpanBatch::Corners corners[2];
  corners[0].gather(mesh, part_at(0), frame);
  int turn = 0;
  for (std::size_t begin = 0; begin < ids.size(); begin += kLanes, turn ^= 1) {
    const auto part = part_at(begin);
    if (begin + kLanes < ids.size()) corners[turn ^ 1].gather(mesh, part_at(begin + kLanes), frame);
    const auto large = batch.load(corners[turn], part, sink);
    if (!hn::AllFalse(SpanI32(), large)) {
      if (left_count + kLanes > std::size(left)) rasterize_left();
      alignas(64) std::int32_t marks[kSpanLanes];
      hn::Store(hn::VecFromMask(SpanI32(), large), SpanI32(), marks);
      for (std::size_t lane = 0; lane < part.size(); ++lane) {
        left[left_count] = part[lane];
        left_count += marks[lane] != 0 ? 1 : 0;
      }
    }
    batch.cover(sink);
  }
  rasterize_left();
}

}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#endif  // include guard
