#include <algorithm>
#include <array>

#include "csg/bounds/area_bounds.h"
#include "strata/raster/view.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "csg/bounds/tile_bounds_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "raster/rasterize-inl.h"

// A vector of triangles at a time against the tile, in double precision. Where a triangle is less
// than kNearby lattice steps deep, and its corners are as near to the tile's first one, areas,
// edges and rises are exact, and slopes are so but for one division. Of all others only the nearest
// and the farthest corner count.

HWY_BEFORE_NAMESPACE();
namespace strata::csg {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace simd = strata::HWY_NAMESPACE;

class TileBounder {
 public:
  using D = simd::LaneF64;
  using V = hn::Vec<D>;
  using M = hn::Mask<D>;

  TileBounder(const LatticeMesh& mesh, const glm::ivec2& tile, double steep_from, bool with_exits,
              AreaBounds& bounds)
      : mesh_(&mesh),
        base_u_(tile.x * kLatticeSteps),
        base_v_(tile.y * kLatticeSteps),
        steep_from_(steep_from),
        with_exits_(with_exits),
        bounds_(&bounds),
        kept_(bounds.triangles.data()),
        entries_{hn::Set(D(), kNone), hn::Set(D(), -1.0)},
        exits_(entries_),
        steep_depth_(hn::Zero(D())) {}

  /// @param ids  at most one a lane
  HWY_INLINE void add(std::span<const std::uint32_t> ids) {
    const D d;
    const simd::LaneI32 di;
    simd::SetupBatch::Corners corners;
    corners.gather(*mesh_, ids, AxisFrame(Axis::kZ));
    V x[3], y[3], z[3];
    for (int i = 0; i < 3; ++i) {
      x[i] = hn::PromoteTo(d, hn::Sub(hn::Load(di, corners.at[i][0]), hn::Set(di, base_u_)));
      y[i] = hn::PromoteTo(d, hn::Sub(hn::Load(di, corners.at[i][1]), hn::Set(di, base_v_)));
      z[i] = hn::PromoteTo(d, hn::Load(di, corners.at[i][2]));
    }
    const Box along_x(x), along_y(y), along_z(z);
    const V first = hn::Set(d, kLatticeSteps * 0.5);
    const V last = hn::Set(d, (kTileSide - 0.5) * kLatticeSteps);
    const M beside = hn::Or(hn::Or(hn::Gt(along_x.low, last), hn::Lt(along_x.high, first)),
                            hn::Or(hn::Gt(along_y.low, last), hn::Lt(along_y.high, first)));
    M met = hn::AndNot(beside, hn::FirstN(d, ids.size()));
    if (hn::AllFalse(d, met)) return;

    const V zero = hn::Zero(d);
    const V u1 = hn::Sub(x[1], x[0]), v1 = hn::Sub(y[1], y[0]), w1 = hn::Sub(z[1], z[0]);
    const V u2 = hn::Sub(x[2], x[0]), v2 = hn::Sub(y[2], y[0]), w2 = hn::Sub(z[2], z[0]);
    const V area = hn::Sub(hn::Mul(u1, v2), hn::Mul(u2, v1));
    const V farthest_out = hn::Max(hn::Max(hn::Abs(along_x.low), hn::Abs(along_x.high)),
                                   hn::Max(hn::Abs(along_y.low), hn::Abs(along_y.high)));
    const V depth = hn::Sub(along_z.high, along_z.low);
    const M far = hn::Not(hn::Lt(hn::Max(farthest_out, depth), hn::Set(d, kNearby)));
    const M entry = hn::Lt(area, zero);
    met = hn::And(met, hn::Or(far, hn::Ne(area, zero)));
    M entries = hn::And(met, hn::Or(far, entry)), exits = hn::And(met, hn::Or(far, hn::Not(entry)));
    if (!with_exits_) {
      met = entries;
      exits = hn::And(exits, hn::Ne(zero, zero));
    }
    // Slopes times the area.
    const V rise_u = hn::Sub(hn::Mul(w1, v2), hn::Mul(w2, v1));
    const V rise_v = hn::Sub(hn::Mul(u1, w2), hn::Mul(u2, w1));
    // A little less, so that what is steep elsewhere is so here.
    const V limit = hn::Mul(hn::Abs(area), hn::Set(d, steep_from_ * (1 - 0x1p-20)));
    const M steep = hn::Or(far, hn::Not(hn::Le(hn::Add(hn::Abs(rise_u), hn::Abs(rise_v)), limit)));
    // Whole depths may count as just below.
    V nearest = hn::Sub(along_z.low, hn::Set(d, 1.0)), farthest = along_z.high;
    const M within = hn::And(
        hn::And(hn::Ge(along_x.low, zero), hn::Ge(along_y.low, zero)),
        hn::And(hn::Le(along_x.high, hn::Set(d, kEnd)), hn::Le(along_y.high, hn::Set(d, kEnd))));
    if (!hn::AllFalse(d, hn::AndNot(within, met))) {
      const V turn = hn::IfThenElse(entry, hn::Set(d, -1.0), hn::Set(d, 1.0));
      const Edge edges[3] = {Edge(x[0], y[0], u1, v1, turn),
                             Edge(x[1], y[1], hn::Sub(u2, u1), hn::Sub(v2, v1), turn),
                             Edge(x[2], y[2], hn::Neg(u2), hn::Neg(v2), turn)};
      const V most = hn::Min(edges[0].most(), hn::Min(edges[1].most(), edges[2].most()));
      const M beyond = hn::AndNot(far, hn::Lt(most, zero));
      met = hn::AndNot(beyond, met);
      if (hn::AllFalse(d, met)) return;
      entries = hn::AndNot(beyond, entries), exits = hn::AndNot(beyond, exits);
      cover(edges, hn::AndNot(far, entries));
      // The plane above what of the triangle's box lies in the tile.
      const V half = hn::Set(d, 0.5);
      const V slope_u = hn::Div(rise_u, area), slope_v = hn::Div(rise_v, area);
      const V x0 = hn::Max(along_x.low, first), x1 = hn::Min(along_x.high, last);
      const V y0 = hn::Max(along_y.low, first), y1 = hn::Min(along_y.high, last);
      const V middle_x = hn::Sub(hn::Mul(hn::Add(x0, x1), half), x[0]);
      const V middle_y = hn::Sub(hn::Mul(hn::Add(y0, y1), half), y[0]);
      const V centre =
          hn::Add(z[0], hn::Add(hn::Mul(slope_u, middle_x), hn::Mul(slope_v, middle_y)));
      const V reach = hn::Add(hn::Mul(hn::Abs(slope_u), hn::Mul(hn::Sub(x1, x0), half)),
                              hn::Mul(hn::Abs(slope_v), hn::Mul(hn::Sub(y1, y0), half)));
      // Depths are floors, and sums of products of slopes and up to 2 kNearby steps are rounded.
      const V slopes = hn::Add(hn::Abs(slope_u), hn::Abs(slope_v));
      const V off = hn::Add(hn::Set(d, 2.0), hn::Mul(slopes, hn::Set(d, 0x1p-50 * 4 * kNearby)));
      const V out = hn::Add(reach, off);
      nearest = hn::IfThenElse(steep, nearest, hn::Max(nearest, hn::Sub(centre, out)));
      farthest = hn::IfThenElse(steep, farthest, hn::Min(farthest, hn::Add(centre, out)));
    }
    keep(ids, met);
    include(entries, nearest, farthest, entries_);
    include(exits, nearest, farthest, exits_);
    const V deep = hn::Add(depth, hn::Set(d, 1.0));
    steep_depth_ = hn::Max(steep_depth_, hn::IfThenElseZero(hn::And(met, steep), deep));
  }

  void finish() {
    const D d;
    bounds_->triangles.resize(static_cast<std::size_t>(kept_ - bounds_->triangles.data()));
    store(entries_, bounds_->entries);
    store(exits_, bounds_->exits);
    bounds_->covered = covered_corners_ == 0xf ? 1u << AreaBounds::kTile : 0;
    const double steep_depth = hn::GetLane(hn::MaxOfLanes(d, steep_depth_));
    bounds_->steep_areas = steep_depth > 0 ? 1u << AreaBounds::kTile : 0;
    bounds_->steep_depth = static_cast<std::uint32_t>(steep_depth);
  }

 private:
  static constexpr double kNearby = 0x1p25;
  static constexpr double kEnd = kTileSide * kLatticeSteps;

  struct Box {
    HWY_INLINE explicit Box(const V (&at)[3])
        : low(hn::Min(at[0], hn::Min(at[1], at[2]))), high(hn::Max(at[0], hn::Max(at[1], at[2]))) {}
    V low, high;
  };
  /// An edge from (x, y) on along (u, v): not negative at one corner of the tile or another where a
  /// triangle on its left, if `turn` is 1, or on its right, if it is -1, may meet the tile.
  struct Edge {
    HWY_INLINE Edge(V x, V y, V u, V v, V turn) {
      const D d;
      const V end = hn::Set(d, kEnd), a = hn::Neg(hn::Mul(v, turn)), b = hn::Mul(u, turn);
      at_x[0] = hn::Neg(hn::Mul(a, x));
      at_x[1] = hn::Mul(a, hn::Sub(end, x));
      at_y[0] = hn::Neg(hn::Mul(b, y));
      at_y[1] = hn::Mul(b, hn::Sub(end, y));
    }
    [[nodiscard]] HWY_INLINE V most() const {
      return hn::Add(hn::Max(at_x[0], at_x[1]), hn::Max(at_y[0], at_y[1]));
    }
    V at_x[2], at_y[2];
  };
  struct Depths {
    V nearest, farthest;
  };
  static constexpr double kNone = 0x1p32;

  HWY_INLINE void keep(std::span<const std::uint32_t> ids, M met) {
    const D d;
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, met, bytes);
    std::uint32_t* to = kept_;
    for (std::size_t lane = 0; lane < ids.size(); ++lane) {  // no branch
      *to = ids[lane];
      to += bytes[lane / 8] >> lane % 8 & 1;
    }
    kept_ = to;
  }
  HWY_INLINE void cover(const Edge (&edges)[3], M entries) {
    const D d;
    for (int corner = 0; corner < 4; ++corner) {
      const auto at = [&](int i) {
        return hn::Add(edges[i].at_x[corner % 2], edges[i].at_y[corner / 2]);
      };
      const M inside = hn::Ge(hn::Min(at(0), hn::Min(at(1), at(2))), hn::Zero(d));
      if (!hn::AllFalse(d, hn::And(inside, entries))) covered_corners_ |= 1u << corner;
    }
  }
  static HWY_INLINE void include(M some, V nearest, V farthest, Depths& depths) {
    const D d;
    const V deepest = hn::Set(d, static_cast<double>(kPictureDepthLimit - 1));
    const auto clamped = [&](V at) { return hn::Min(hn::Max(at, hn::Zero(d)), deepest); };
    depths.nearest =
        hn::Min(depths.nearest, hn::IfThenElse(some, clamped(nearest), hn::Set(d, kNone)));
    depths.farthest =
        hn::Max(depths.farthest, hn::IfThenElse(some, clamped(farthest), hn::Set(d, -1.0)));
  }
  static void store(const Depths& depths, AreaBounds::Range& range) {
    const D d;
    const double nearest = hn::GetLane(hn::MinOfLanes(d, depths.nearest));
    const double farthest = hn::GetLane(hn::MaxOfLanes(d, depths.farthest));
    const bool any = nearest < kNone;
    range.nearest[AreaBounds::kTile] =
        any ? static_cast<std::uint32_t>(nearest) : AreaBounds::kNever;
    range.farthest[AreaBounds::kTile] = any ? static_cast<std::uint32_t>(farthest) + 1 : 0;
  }

  const LatticeMesh* mesh_;
  std::int32_t base_u_, base_v_;
  double steep_from_;
  bool with_exits_;
  AreaBounds* bounds_;
  std::uint32_t* kept_;  ///< behind what is in bounds_->triangles
  Depths entries_, exits_;
  V steep_depth_;
  unsigned covered_corners_ = 0;
};

void FindTileBounds(const LatticeMesh& mesh, std::span<const std::uint32_t> triangles,
                    const glm::ivec2& tile, double steep_from, bool with_exits,
                    AreaBounds& bounds) {
  bounds.triangles.resize(triangles.size());
  TileBounder bounder(mesh, tile, steep_from, with_exits, bounds);
  const std::size_t lanes = hn::Lanes(TileBounder::D());
  for (std::size_t i = 0; i < triangles.size(); i += lanes) {
    bounder.add(triangles.subspan(i, std::min(lanes, triangles.size() - i)));
  }
  bounder.finish();
}

}  // namespace HWY_NAMESPACE
}  // namespace strata::csg
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata::csg {

HWY_EXPORT(FindTileBounds);

void find_tile_bounds(const LatticeMesh& mesh, std::span<const std::uint32_t> triangles,
                      const glm::ivec2& tile, double steep_from, bool with_exits,
                      AreaBounds& bounds) {
  HWY_DYNAMIC_DISPATCH(FindTileBounds)(mesh, triangles, tile, steep_from, with_exits, bounds);
}

}  // namespace strata::csg
#endif  // HWY_ONCE
