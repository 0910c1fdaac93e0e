#include "csg/surface/tile_surface.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "csg/surface/tile_surface_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "csg/surface/coincidence_reach-inl.h"
#include "raster/rasterize-inl.h"
#include "raster/spans-inl.h"

// Visible surfaces without lists: each solid keeps its own sorted layers, and a vector of pixels
// asks the tree where it is met first. A node answers with its value at a depth and the next depth
// where that changes, from the same answers of its children; a node that is true asks on from the
// farthest of them until none is true. Solids behind what is found are not even rasterized.
//
// This work is related to: C. Zanni, F. Claux, S. Lefebvre, "HCSG: Hashing for real-time CSG
// modeling" (2018), which walks depth slabs front to back, and S. Lefebvre, "IceSL: A GPU
// accelerated CSG modeler and slicer" (2013), which sorts all fragments of a ray in an A-buffer
// first. We differ: the window is per vector of pixels and closes by itself, and solids are sorted
// apart, so that no list mixes them.

HWY_BEFORE_NAMESPACE();
namespace strata::csg {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace simd = strata::HWY_NAMESPACE;

using D = hn::CappedTag<std::uint32_t, LeafLayers::kLanes>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

HWY_INLINE M no_lane(D d) { return hn::Ne(hn::Zero(d), hn::Zero(d)); }

/// Inserts crossings into a leaf's layers, sorted by key, then triangle.
class LayerSink {
 public:
  static constexpr bool kApart = false;
  /// @param clip  spans count from its first pixel
  LayerSink(LeafLayers& leaf, Arena& arena, double steep_from, const PixelRect& clip)
      : leaf_(&leaf),
        arena_(&arena),
        steep_from_(steep_from),
        convex_(leaf.kind == LeafLayers::Kind::kConvex),
        u0_(leaf.rect.u0),
        v0_(leaf.rect.v0),
        stride_(leaf.stride),
        spans_at_(pixel_at(clip.u0, clip.v0)) {}
  HWY_INLINE void steepness(double steepness) {
    steep_ = steepness > steep_from_ ? LeafLayers::kSteep : 0;
    leaf_->steep = leaf_->steep || steep_ != 0;
  }
  [[nodiscard]] HWY_INLINE bool wants(bool exit) const {
    if (leaf_->left_out == LeafLayers::LeftOut::kEntries) return exit;
    return !exit || (leaf_->kind != LeafLayers::Kind::kFirstEntryOnly &&
                     leaf_->left_out == LeafLayers::LeftOut::kNothing);
  }
  HWY_INLINE void begin(bool exit, std::uint32_t triangle, const PixelRect&) {
    exit_ = exit ? 1 : 0;
    triangle_ = triangle | steep_;
    own_keys_ = nullptr;
  }
  static constexpr bool kTakesRows = true;
  template <class D2, class V2 = hn::Vec<D2>>
  HWY_INLINE void put_row(D2 d, int u, int v, V2 depth, hn::Mask<D2> covered) {
    fragments_ += hn::CountTrue(d, covered);
    put(d, pixel_at(u, v), depth, covered);
  }
  void begin_spans(int, int, std::size_t pixels) { fragments_ += pixels; }
  struct SpanBase {
    std::uint32_t depth, exit, triangle;
  };
  HWY_INLINE void make_bases(simd::SpanVecI32 depths, simd::SpanVecU32 surfaces,
                             const double* steepness, SpanBase* bases) const {
    alignas(64) std::int32_t from[simd::kSpanLanes];
    alignas(64) std::uint32_t surface[simd::kSpanLanes];
    hn::Store(depths, simd::SpanI32(), from);
    hn::Store(surfaces, simd::SpanU32(), surface);
    for (int i = 0; i < simd::kSpanLanes; ++i) {
      const std::uint32_t steep = steepness[i] > steep_from_ ? LeafLayers::kSteep : 0;
      bases[i] = {static_cast<std::uint32_t>(from[i]), surface[i] >> 31,
                  (surface[i] & 0x7fffffffu) | steep};
    }
  }
  template <class D2, class V2 = hn::Vec<D2>>
  HWY_INLINE void put_span(D2 d, std::size_t pixel, V2 depth, V2 covered, const SpanBase& base) {
    const std::size_t at =
        spans_at_ + pixel / kTileSide * static_cast<std::size_t>(stride_) + pixel % kTileSide;
    if (convex_ && exit_ != base.exit) own_keys_ = nullptr;
    exit_ = base.exit;
    triangle_ = base.triangle;
    marks_ |= base.triangle;
    put(d, at, hn::Add(depth, hn::Set(d, base.depth)), hn::MaskFromVec(covered));
  }
  /// key + 1, so that 0 is no crossing.
  template <class D2, class V2 = hn::Vec<D2>>
  HWY_INLINE V2 encode(D2 d, V2 depth, hn::Mask<D2> covered) {
    fragments_ += hn::CountTrue(d, covered);
    const V2 key = hn::Or(hn::ShiftLeft<1>(depth), hn::Set(d, exit_));
    return hn::IfThenElseZero(covered, hn::Add(key, hn::Set(d, 1u)));
  }
  template <int columns>
  HWY_INLINE void put_block(int u, int v, const std::uint32_t* words, int rows) {
    const hn::CappedTag<std::uint32_t, columns> d;
    for (int row = 0; row < rows; ++row, words += columns) {
      const std::size_t at = pixel_at(u, v + row);
      for (std::size_t i = 0; i < columns; i += hn::Lanes(d)) insert(d, at + i, words + i);
    }
  }
  HWY_INLINE void put_one(int u, int v, std::uint32_t depth) {
    ++fragments_;
    const hn::CappedTag<std::uint32_t, 1> d;
    const std::uint32_t word[1] = {(depth << 1 | exit_) + 1};
    insert(d, pixel_at(u, v), word);
  }
  /// Gives the number of crossings.
  std::uint64_t finish() {
    leaf_->steep = leaf_->steep || (marks_ & LeafLayers::kSteep) != 0;
    return fragments_;
  }

 private:
  [[nodiscard]] HWY_INLINE std::size_t pixel_at(int u, int v) const {
    return static_cast<std::size_t>((v - v0_) * stride_ + (u - u0_));
  }
  HWY_NOINLINE void find_own_layer() {
    while (exit_ >= leaf_->keys.size()) leaf_->add_layer(*arena_);
    own_keys_ = leaf_->keys[exit_];
    own_triangles_ = leaf_->triangles[exit_];
  }
  template <class D2, class V2 = hn::Vec<D2>>
  HWY_INLINE void put(D2 d, std::size_t at, V2 depth, hn::Mask<D2> covered) {
    auto left = covered;
    if (convex_) {  // as place() does
      if (HWY_UNLIKELY(own_keys_ == nullptr)) find_own_layer();
      std::uint32_t* HWY_RESTRICT keys = own_keys_ + at;
      std::uint32_t* HWY_RESTRICT triangles = own_triangles_ + at;
      const auto old_key = hn::LoadU(d, keys);
      const auto take = hn::And(covered, hn::Eq(old_key, hn::Set(d, LeafLayers::kEmpty)));
      hn::StoreU(hn::IfThenElse(take, depth, old_key), d, keys);
      hn::StoreU(hn::IfThenElse(take, hn::Set(d, triangle_), hn::LoadU(d, triangles)), d,
                 triangles);
      left = hn::AndNot(take, covered);
    }
    if (HWY_LIKELY(hn::AllFalse(d, left))) return;
    const V2 key = hn::Or(hn::ShiftLeft<1>(depth), hn::Set(d, exit_));
    insert_key(d, at, hn::IfThenElse(left, key, hn::Set(d, LeafLayers::kEmpty)));
  }
  template <class D2>
  HWY_INLINE void insert(D2 d, std::size_t at, const std::uint32_t* words) {
    insert_key(d, at, hn::Sub(hn::LoadU(d, words), hn::Set(d, 1u)));
  }
  template <class D2>
  HWY_INLINE void insert_key(D2 d, std::size_t at, hn::Vec<D2> key) {
    const auto empty = hn::Set(d, LeafLayers::kEmpty);
    auto triangle = hn::Set(d, triangle_);
    if (hn::AllTrue(d, hn::Eq(key, empty))) return;
    if (leaf_->kind == LeafLayers::Kind::kFirstEntryOnly) return keep_first(d, at, key, triangle);
    if (leaf_->kind == LeafLayers::Kind::kConvex) return place(d, at, key, triangle);
    for (std::size_t k = 0;; ++k) {
      if (k == leaf_->keys.size()) leaf_->add_layer(*arena_);
      std::uint32_t* HWY_RESTRICT keys = leaf_->keys[k] + at;
      std::uint32_t* HWY_RESTRICT triangles = leaf_->triangles[k] + at;
      const auto old_key = hn::LoadU(d, keys), old_triangle = hn::LoadU(d, triangles);
      const auto less = hn::Or(hn::Lt(key, old_key),
                               hn::And(hn::Eq(key, old_key), hn::Lt(triangle, old_triangle)));
      hn::StoreU(hn::IfThenElse(less, key, old_key), d, keys);
      hn::StoreU(hn::IfThenElse(less, triangle, old_triangle), d, triangles);
      key = hn::IfThenElse(less, old_key, key);
      triangle = hn::IfThenElse(less, old_triangle, triangle);
      if (hn::AllTrue(d, hn::Eq(key, empty))) return;
    }
  }

  template <class D2>
  HWY_INLINE void keep_first(D2 d, std::size_t at, hn::Vec<D2> key, hn::Vec<D2> triangle) {
    if (leaf_->keys.empty()) leaf_->add_layer(*arena_);
    std::uint32_t* HWY_RESTRICT keys = leaf_->keys[0] + at;
    std::uint32_t* HWY_RESTRICT triangles = leaf_->triangles[0] + at;
    const auto old_key = hn::LoadU(d, keys), old_triangle = hn::LoadU(d, triangles);
    const auto unmarked = hn::Set(d, ~LeafLayers::kSteep);
    const auto lower = hn::Lt(hn::And(triangle, unmarked), hn::And(old_triangle, unmarked));
    const auto less = hn::Or(hn::Lt(key, old_key), hn::And(hn::Eq(key, old_key), lower));
    hn::StoreU(hn::Min(key, old_key), d, keys);
    hn::StoreU(hn::IfThenElse(less, triangle, old_triangle), d, triangles);
  }
  /// Depths of entries go to layer 0 and of exits to layer 1, keys of what is left to others.
  template <class D2>
  HWY_INLINE void place(D2 d, std::size_t at, hn::Vec<D2> key, hn::Vec<D2> triangle) {
    const auto empty = hn::Set(d, LeafLayers::kEmpty);
    for (std::size_t k = exit_;; k = k < 2 ? 2 : k + 1) {
      while (k >= leaf_->keys.size()) leaf_->add_layer(*arena_);
      std::uint32_t* HWY_RESTRICT keys = leaf_->keys[k] + at;
      std::uint32_t* HWY_RESTRICT triangles = leaf_->triangles[k] + at;
      const auto old_key = hn::LoadU(d, keys);
      const auto take = hn::And(hn::Ne(key, empty), hn::Eq(old_key, empty));
      const auto kept = k < 2 ? hn::ShiftRight<1>(key) : key;
      hn::StoreU(hn::IfThenElse(take, kept, old_key), d, keys);
      hn::StoreU(hn::IfThenElse(take, triangle, hn::LoadU(d, triangles)), d, triangles);
      key = hn::IfThenElse(take, empty, key);
      if (hn::AllTrue(d, hn::Eq(key, empty))) return;
    }
  }

  LeafLayers* leaf_;
  Arena* arena_;
  double steep_from_;
  bool convex_;
  int u0_, v0_, stride_;
  std::size_t spans_at_;
  std::uint32_t* own_keys_ = nullptr;  ///< of a convex solid: of the layer of such triangles
  std::uint32_t* own_triangles_ = nullptr;
  std::uint32_t exit_ = 0, triangle_ = 0, steep_ = 0;
  std::uint32_t marks_ = 0;  ///< of the triangles of all spans
  std::uint64_t fragments_ = 0;
};

std::uint64_t RasterLayers(const LatticeMesh& mesh, const RasterTarget& target,
                           std::span<const std::uint32_t> triangles, const PixelRect& clip,
                           double steep_from, LeafLayers& leaf, Arena& arena) {
  constexpr std::size_t kManyTriangles = 32;
  LayerSink sink(leaf, arena, steep_from, clip);
  if (triangles.size() >= kManyTriangles) {
    simd::rasterize_spans(mesh, target, triangles, clip, sink);
  } else {
    simd::rasterize_triangles(mesh, target, triangles, clip, sink);
  }
  return sink.finish();
}

/// A vector of pixels of a leaf.
struct Normalized {
  M any, special;       ///< something is met; the leaf is not entered and left in turn
  V nearest, farthest;  ///< where it is
};

/// Of a convex solid: layers 0 and 1 are depths already.
HWY_INLINE Normalized normalize_convex(LeafLayers& leaf, std::size_t at, bool all_special) {
  const D d;
  const V empty = hn::Set(d, LeafLayers::kEmpty);
  const std::size_t layers = leaf.keys.size();
  V enter = hn::Load(d, leaf.keys[0] + at);
  const V leave = layers > 1 ? hn::Load(d, leaf.keys[1] + at) : empty;
  if (leaf.left_out == LeafLayers::LeftOut::kEntries) {
    enter = hn::IfThenElseZero(hn::Eq(leave, empty), empty);
    hn::Store(enter, d, leaf.keys[0] + at);
    hn::Store(hn::Zero(d), d, leaf.triangles[0] + at);
  }
  V more = empty;
  for (std::size_t k = 2; k < layers; ++k) more = hn::And(more, hn::Load(d, leaf.keys[k] + at));
  const M some = hn::Ne(hn::And(hn::And(enter, leave), more), empty);
  M once = hn::And(hn::Lt(enter, leave), hn::Eq(more, empty));
  if (leaf.left_out != LeafLayers::LeftOut::kExits) once = hn::And(once, hn::Ne(leave, empty));
  const M special = all_special ? some : hn::AndNot(once, some);
  const M good = hn::AndNot(special, some);
  return {some, special, hn::IfThenElse(good, enter, empty), hn::IfThenElseZero(good, leave)};
}

/// Of any solid, after which its layers are depths.
HWY_INLINE Normalized normalize_sorted(LeafLayers& leaf, std::size_t at, bool all_special) {
  const D d;
  const V empty = hn::Set(d, LeafLayers::kEmpty), one = hn::Set(d, 1u), zero = hn::Zero(d);
  const std::size_t layers = leaf.keys.size();
  Normalized out{no_lane(d), no_lane(d), empty, zero};
  V before = zero;  // depth of the last exit, plus 1
  if (leaf.kind != LeafLayers::Kind::kFirstEntryOnly) {
    for (std::size_t k = 0; k < layers; k += 2) {
      const V enter = hn::Load(d, leaf.keys[k] + at);
      const V leave = k + 1 < layers ? hn::Load(d, leaf.keys[k + 1] + at) : empty;
      const M none = hn::And(hn::Eq(enter, empty), hn::Eq(leave, empty));
      const V enter_depth = hn::ShiftRight<1>(enter), leave_depth = hn::ShiftRight<1>(leave);
      const M facing =
          hn::And(hn::Eq(hn::And(enter, one), zero), hn::Ne(hn::And(leave, one), zero));
      const M ordered =
          hn::And(hn::Lt(enter_depth, leave_depth), hn::Not(hn::Lt(enter_depth, before)));
      const M paired = hn::And(hn::And(facing, ordered), hn::Ne(leave, empty));
      out.special = hn::Or(out.special, hn::Not(hn::Or(none, paired)));
      before = hn::Add(leave_depth, one);
    }
  }
  for (std::size_t k = 0; k < layers; ++k) {
    const V key = hn::Load(d, leaf.keys[k] + at);
    const M some = hn::Ne(key, empty);
    if (all_special) out.special = hn::Or(out.special, some);
    out.any = hn::Or(out.any, some);
  }
  for (std::size_t k = 0; k < layers; ++k) {
    const V key = hn::Load(d, leaf.keys[k] + at);
    const M present = hn::AndNot(out.special, hn::Ne(key, empty));
    const V depth = hn::IfThenElse(present, hn::ShiftRight<1>(key), empty);
    out.nearest = hn::Min(out.nearest, depth);
    out.farthest = hn::Max(out.farthest, hn::IfThenElseZero(present, depth));
    hn::Store(hn::IfThenElse(out.special, key, depth), d, leaf.keys[k] + at);
  }
  return out;
}

void NormalizeLayers(LeafLayers& leaf, bool all_special, TileFinder& finder) {
  const D d;
  const bool convex = leaf.kind == LeafLayers::Kind::kConvex;
  const auto columns = static_cast<std::size_t>(leaf.stride);
  const std::size_t cells = static_cast<std::size_t>(leaf.rect.v1 - leaf.rect.v0) * columns;
  const std::size_t lanes = hn::Lanes(d);
  // Where in the tile the leaf begins, in areas.
  constexpr std::size_t kSide = LeafLayers::kLanes;
  const std::size_t first_column = static_cast<std::size_t>(leaf.rect.u0 % kTileSide) / kSide;
  const std::size_t first_row = static_cast<std::size_t>(leaf.rect.v0 % kTileSide);
  leaf.areas = 0;
  alignas(64) std::uint32_t special_lanes[LeafLayers::kLanes];
  V nearest = hn::Set(d, LeafLayers::kEmpty), farthest = hn::Zero(d);
  leaf.nearest = LeafLayers::kEmpty;
  leaf.farthest = 0;
  std::size_t row = first_row, column = 0;
  unsigned area_row = 1u << (row / kSide * (kTileSide / kSide));
  for (std::size_t at = 0; at < cells; at += lanes, column += lanes) {
    if (column == columns) {
      column = 0;
      area_row = 1u << (++row / kSide * (kTileSide / kSide));
    }
    const Normalized found =
        convex ? normalize_convex(leaf, at, all_special) : normalize_sorted(leaf, at, all_special);
    if (hn::AllFalse(d, found.any)) continue;
    leaf.areas |= static_cast<std::uint16_t>(area_row << (first_column + column / kSide));
    nearest = hn::Min(nearest, found.nearest);
    farthest = hn::Max(farthest, found.farthest);
    if (hn::AllFalse(d, found.special)) continue;
    hn::Store(hn::IfThenElseZero(found.special, hn::Set(d, 1u)), d, special_lanes);
    for (std::size_t i = 0; i < lanes; ++i) {
      if (special_lanes[i] != 0) finder.normalize_pixel(leaf, at + i);
    }
  }
  leaf.nearest = std::min(leaf.nearest, hn::GetLane(hn::MinOfLanes(d, nearest)));
  leaf.farthest = std::max(leaf.farthest, hn::GetLane(hn::MaxOfLanes(d, farthest)));
}

/// The search in one vector of pixels.
class Search {
 public:
  Search(const SearchArea& area, TileFinder& finder) : area_(area), finder_(finder) {
    const TileProgram& program = *area.program;
    const TileProgram::Node& root = program.nodes[program.root];
    flat_ = program.root_inverted && program.depth == 1 && program.edges[root.first].inverted();
  }

  void set_pixels(int u, int v) {
    u_ = u;
    v_ = v;
  }

  /// Depths where the tree becomes true first, kEmpty for never, and the leaf whose transition that
  /// is.
  HWY_INLINE void find(V& depth, V& leaf_at) {
    const D d;
    if (flat_ && find_flat(depth, leaf_at)) return;
    find_from(hn::Zero(d), hn::Not(no_lane(d)), depth, leaf_at);
  }

  /// Whether there is another transition near `depth`, or a steep one that may coincide with it,
  /// and the triangle of the transition at `depth`.
  HWY_INLINE M judge(V depth, V leaf_at, V& triangle) {
    const D d;
    const M hit = hn::Ne(depth, hn::Set(d, LeafLayers::kEmpty));
    const V reach = coincidence_reach(d, area_.range, hn::IfThenElseZero(hit, depth));
    const V last = hn::IfThenElseZero(hit, hn::Add(depth, reach));
    M doubt = no_lane(d);
    M exits = no_lane(d);
    const V zero = hn::Zero(d);
    triangle = zero;
    const std::uint32_t latest = hn::GetLane(hn::MaxOfLanes(d, last));
    for (const std::uint32_t slot : area_.program->leaves) {
      LeafLayers& leaf = area_.leaves[slot];
      if (is_behind(leaf, latest) || !holds(leaf) || is_behind(leaf, latest)) continue;
      const std::size_t offset = offset_in(leaf);
      const M own = hn::Eq(leaf_at, hn::Set(d, slot));
      for (std::size_t k = 0; k < leaf.keys.size(); ++k) {
        const V transition = hn::Load(d, leaf.keys[k] + offset);
        const V gap = hn::Sub(hn::Max(transition, depth), hn::Min(transition, depth));
        const M same = hn::And(own, hn::Eq(transition, depth));
        doubt = hn::Or(doubt, hn::AndNot(same, hn::Not(hn::Gt(gap, reach))));
        if (!leaf.steep && hn::AllFalse(d, same)) continue;
        const V found_triangle = hn::Load(d, leaf.triangles[k] + offset);
        const M steep = is_steep(found_triangle, transition);
        doubt = hn::Or(doubt, may_coincide(leaf, hn::And(hit, steep), found_triangle, transition,
                                           depth, reach));
        triangle = hn::IfThenElse(same, found_triangle, triangle);
        if ((k & 1) != 0) exits = hn::Or(exits, same);
      }
    }
    triangle = hn::Or(triangle, hn::IfThenElseZero(exits, hn::Set(d, 0x80000000u)));
    return hn::And(hit, doubt);
  }

  /// Decides lanes that are in doubt where in many of them faces of the same solids coincide, as
  /// Cluster has it. @return the lanes that stay in doubt
  HWY_NOINLINE M settle(M open, V& depth, V& solid, V& triangle) {
    constexpr int kMostClusters = 6;
    const D d;
    M left = no_lane(d);
    for (int i = 0; i < kMostClusters && !hn::AllFalse(d, open); ++i) {
      const std::size_t lane = hn::FindKnownFirstTrue(d, open);
      const M first = hn::AndNot(hn::FirstN(d, lane), hn::FirstN(d, lane + 1));
      const V reach = coincidence_reach(d, area_.range, hn::IfThenElseZero(open, depth));
      const Cluster* cluster = gather(open, lane, depth, reach);
      M alike = no_lane(d), good = no_lane(d);
      V beyond = hn::Zero(d);
      if (cluster != nullptr) compare(*cluster, open, depth, reach, alike, good, beyond);
      left = hn::Or(left, hn::AndNot(good, hn::Or(first, alike)));
      open = hn::AndNot(hn::Or(first, alike), open);
      if (hn::AllFalse(d, good)) continue;
      if (cluster->outcome == Cluster::Outcome::kShown) {
        const Surface& shown = cluster->surface;
        solid = hn::IfThenElse(good, hn::Set(d, shown.solid), solid);
        triangle = hn::IfThenElse(
            good, hn::Set(d, shown.triangle | (shown.exit ? SurfaceImage::kExit : 0)), triangle);
        continue;
      }
      V next, next_leaf, next_triangle;
      find_from(beyond, good, next, next_leaf);
      open = hn::Or(open, judge(next, next_leaf, next_triangle));
      depth = hn::IfThenElse(good, next, depth);
      solid = hn::IfThenElse(good, solid_at(next_leaf), solid);
      triangle = hn::IfThenElse(good, next_triangle, triangle);
    }
    return hn::Or(left, open);
  }

  /// The solids of leaves.
  HWY_INLINE V solid_at(V leaf_at) {
    const D d;
    return hn::GatherIndex(d, area_.solids, hn::BitCast(hn::RebindToSigned<D>(), leaf_at));
  }

 private:
  /// A leaf that is met near a cluster or before it.
  struct Met {
    const LeafLayers* leaf;
    std::size_t offset;
    std::size_t layer;  ///< of the transition in the cluster; kNoLayer: there is none
    bool inside;        ///< the ray is in it before the cluster
  };
  static constexpr std::size_t kNoLayer = ~std::size_t{0};

  /// met_ become the leaves that are met by one lane near `depth`, or by any of `open` before that.
  /// @return the cluster there; null: it is none that is decided
  HWY_NOINLINE const Cluster* gather(M open, std::size_t lane, V depth, V reach) {
    const D d;
    alignas(64) std::uint32_t depths[LeafLayers::kLanes], reaches[LeafLayers::kLanes];
    hn::Store(depth, d, depths);
    hn::Store(reach, d, reaches);
    const std::uint32_t at = depths[lane], near = reaches[lane];
    const std::uint32_t latest =
        hn::GetLane(hn::MaxOfLanes(d, hn::IfThenElseZero(open, hn::Add(depth, reach))));
    met_.clear();
    members_.clear();
    inside_.clear();
    for (const std::uint32_t slot : area_.program->leaves) {
      LeafLayers& leaf = area_.leaves[slot];
      if (is_behind(leaf, latest) || !holds(leaf) || is_behind(leaf, latest)) continue;
      Met met{&leaf, offset_in(leaf), kNoLayer, false};
      for (std::size_t k = 0; k < leaf.keys.size(); ++k) {
        const std::uint32_t transition = leaf.keys[k][met.offset + lane];
        if (std::max(transition, at) - std::min(transition, at) > near) {
          met.inside = met.inside != (transition < at);
          continue;
        }
        if (met.layer != kNoLayer || members_.size() == Clusters::kMostMembers) return nullptr;
        met.layer = k;
        const std::uint32_t triangle = leaf.triangles[k][met.offset + lane];
        members_.push_back({0, leaf.solid, triangle & ~LeafLayers::kSteep, (k & 1) != 0});
      }
      if (met.inside) inside_.push_back(leaf.solid);
      met_.push_back(met);
    }
    return &finder_.cluster_of(inside_, members_);
  }

  /// `alike` become the lanes that meet a cluster as the lane of met_ does, and `good` those of
  /// them in which its outcome does not depend on order. `beyond` is where it ends.
  HWY_NOINLINE void compare(const Cluster& cluster, M open, V depth, V reach, M& alike, M& good,
                            V& beyond) {
    const D d;
    const V zero = hn::Zero(d), empty = hn::Set(d, LeafLayers::kEmpty);
    V low = depth, high = depth;
    M late = no_lane(d);  // out of the tree after the first depth
    alike = open;
    std::size_t member = 0;
    for (const Met& met : met_) {
      const LeafLayers& leaf = *met.leaf;
      M inside = no_lane(d);
      for (std::size_t k = 0; k < leaf.keys.size(); ++k) {
        const V transition = hn::Load(d, leaf.keys[k] + met.offset);
        const V gap = hn::Sub(hn::Max(transition, depth), hn::Min(transition, depth));
        const M far = hn::Gt(gap, reach);
        inside = hn::Xor(inside, hn::And(far, hn::Lt(transition, depth)));
        const V face = hn::Load(d, leaf.triangles[k] + met.offset);
        if (leaf.steep) {
          const M steep = hn::And(alike, is_steep(face, transition));
          alike = hn::AndNot(may_coincide(leaf, steep, face, transition, depth, reach), alike);
        }
        if (k != met.layer) {
          alike = hn::And(alike, far);
          continue;
        }
        const Transition& own = cluster.members[member];
        alike = hn::AndNot(hn::Or(far, hn::Ne(face, hn::Set(d, own.triangle))), alike);
        low = hn::Min(low, transition);
        high = hn::Max(high, transition);
        if ((cluster.outward >> member & 1) != 0) late = hn::Or(late, hn::Gt(transition, depth));
      }
      alike = met.inside ? hn::And(alike, inside) : hn::AndNot(inside, alike);
      if (met.layer != kNoLayer) ++member;
    }
    beyond = hn::Add(high, hn::Set(d, 1u));
    good = no_lane(d);
    if (hn::AllFalse(d, alike) || cluster.outcome == Cluster::Outcome::kByOrder) return;
    const V width =
        hn::Set(d, cluster.width(finder_.coincidence(),
                                 hn::GetLane(hn::MinOfLanes(d, hn::IfThenElse(alike, low, empty))),
                                 hn::GetLane(hn::MaxOfLanes(d, hn::IfThenElseZero(alike, high)))));
    good = hn::And(alike, hn::Gt(low, zero));  // at 0 the ray begins
    if (cluster.outcome == Cluster::Outcome::kShown) {
      const V most = hn::Max(hn::Sub(high, depth), hn::Sub(depth, low));
      good = hn::AndNot(hn::Or(late, hn::Gt(most, width)), good);
    } else {
      good = hn::AndNot(hn::Gt(hn::Sub(high, low), width), good);
    }
  }

  /// find() from a depth on, in some lanes; kEmpty in all others. @pre the tree is false there
  HWY_INLINE void find_from(V from, M lanes, V& depth, V& leaf_at) {
    const D d;
    M value;
    const bool inverted = area_.program->root_inverted;
    // not(node) becomes true where the node, true at first, becomes false.
    probe(area_.program->root, from, lanes, inverted, !inverted, value, depth, leaf_at);
    const M waits = hn::And(lanes, inverted ? value : hn::Not(value));
    depth = hn::IfThenElse(waits, depth, hn::Set(d, LeafLayers::kEmpty));
  }

  HWY_INLINE M is_steep(V face, V transition) {
    const D d;
    const M marked = hn::Ne(hn::And(face, hn::Set(d, LeafLayers::kSteep)), hn::Zero(d));
    return hn::And(marked, hn::Ne(transition, hn::Set(d, LeafLayers::kEmpty)));
  }
  /// In which of some lanes a steep face may coincide with one at `depth` that is not: it reaches
  /// to its own bound, which no vector has.
  HWY_INLINE M may_coincide(const LeafLayers& leaf, M lanes, V face, V transition, V depth,
                            V reach) {
    const D d;
    if (HWY_LIKELY(hn::AllFalse(d, lanes))) return lanes;
    return may_coincide_one_by_one(leaf, lanes, face, transition, depth, reach);
  }
  HWY_NOINLINE M may_coincide_one_by_one(const LeafLayers& leaf, M lanes, V face, V transition,
                                         V depth, V reach) {
    const D d;
    alignas(64) std::uint32_t faces[LeafLayers::kLanes], transitions[LeafLayers::kLanes],
        depths[LeafLayers::kLanes], reaches[LeafLayers::kLanes], may[LeafLayers::kLanes];
    hn::Store(face, d, faces);
    hn::Store(transition, d, transitions);
    hn::Store(depth, d, depths);
    hn::Store(reach, d, reaches);
    hn::Store(hn::VecFromMask(d, lanes), d, may);
    const TransitionFaces of = finder_.faces();
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
      if (may[i] == 0) continue;
      const std::uint32_t at = transitions[i];
      const Coincidence::Bound bound = of.bound({at, leaf.solid, faces[i] & ~LeafLayers::kSteep});
      const bool behind = at > depths[i];
      const double gap = behind ? at - depths[i] : depths[i] - at;
      if (gap > reaches[i] + (behind ? bound.nearer : bound.farther)) may[i] = 0;
    }
    return hn::Ne(hn::Load(d, may), hn::Zero(d));
  }

  /// Whether all faces of a leaf lie behind a depth. A steep one may stand for a place before its
  /// crossing, which is not in `nearest` of a leaf that is made, but for that of areas.
  [[nodiscard]] static bool is_behind(const LeafLayers& leaf, std::uint32_t depth) {
    return leaf.nearest > depth && (leaf.by_area || !leaf.steep);
  }
  /// Whether the pixels lie in the leaf's rectangle; then its layers are there.
  HWY_INLINE bool holds(LeafLayers& leaf) {
    if (v_ < leaf.rect.v0 || v_ >= leaf.rect.v1 || u_ < leaf.rect.u0 || u_ >= leaf.rect.u1) {
      return false;
    }
    if (!leaf.made) finder_.make(leaf);
    return true;
  }
  HWY_INLINE std::size_t offset_in(const LeafLayers& leaf) const {
    return static_cast<std::size_t>((v_ - leaf.rect.v0) * leaf.stride + (u_ - leaf.rect.u0));
  }

  /// The one transition into a solid that is met at most once, and the one out of it.
  /// @return false: it is met more often
  HWY_INLINE bool interval(LeafLayers& leaf, V& enter, V& leave) {
    const D d;
    enter = leave = hn::Set(d, LeafLayers::kEmpty);
    if (!holds(leaf)) return true;
    const std::size_t layers = leaf.keys.size(), offset = offset_in(leaf);
    if (layers > 2) return false;
    if (layers > 0) enter = hn::Load(d, leaf.keys[0] + offset);
    if (layers > 1) leave = hn::Load(d, leaf.keys[1] + offset);
    return true;
  }

  /// find() in an intersection of solids minus others that are each met once: the ray is inside
  /// from the last entry to the first exit of those intersected, and beyond the exit of each other
  /// that it is in there. @return false: some solid is met more often
  HWY_NOINLINE bool find_flat(V& depth, V& leaf_at) {
    const D d;
    const V none = hn::Set(d, LeafLayers::kEmpty);
    const TileProgram::Node& node = area_.program->nodes[area_.program->root];
    const Program::Edge* edges = area_.program->edges.data() + node.first;
    const std::uint32_t* nearest = area_.program->nearest.data() + node.first;
    V at = hn::Zero(d), leaf = at, end = none, enter, leave;
    std::uint32_t i = 0;
    for (; i < node.count && edges[i].inverted(); ++i) {
      if (!interval(area_.leaves[edges[i].child()], enter, leave)) return false;
      const M later = hn::Not(hn::Lt(enter, at));
      at = hn::IfThenElse(later, enter, at);
      leaf = hn::IfThenElse(later, hn::Set(d, edges[i].child()), leaf);
      end = hn::Min(end, leave);
      if (hn::AllFalse(d, hn::Lt(at, end))) break;
    }
    leaf_at = leaf;
    M open = hn::Lt(at, end);
    const std::uint32_t others = i;
    bool moved = !hn::AllFalse(d, open);
    while (moved) {
      moved = false;
      std::uint32_t last = hn::GetLane(hn::MaxOfLanes(d, hn::IfThenElseZero(open, at)));
      for (i = others; i < node.count && nearest[i] <= last; ++i) {
        LeafLayers& other = area_.leaves[edges[i].child()];
        if (other.nearest > last) continue;
        if (!interval(other, enter, leave)) return false;
        const M inside = hn::And(open, hn::And(hn::Not(hn::Gt(enter, at)), hn::Gt(leave, at)));
        if (hn::AllFalse(d, inside)) continue;
        at = hn::IfThenElse(inside, leave, at);
        leaf_at = hn::IfThenElse(inside, hn::Set(d, edges[i].child()), leaf_at);
        open = hn::And(open, hn::Lt(at, end));
        if (hn::AllFalse(d, open)) break;
        last = hn::GetLane(hn::MaxOfLanes(d, hn::IfThenElseZero(open, at)));
        moved = true;
      }
      moved = moved && !hn::AllFalse(d, open);
    }
    depth = hn::IfThenElse(open, at, none);
    return true;
  }

  /// Whether a ray is inside a leaf after all transitions before `from`, and its next transition.
  HWY_INLINE void probe_leaf(std::uint32_t slot, V from, M& inside, V& next) {
    const D d;
    inside = no_lane(d);
    next = hn::Set(d, LeafLayers::kEmpty);
    LeafLayers& leaf = area_.leaves[slot];
    if (!holds(leaf)) return;
    const std::size_t offset = offset_in(leaf);
    for (std::size_t k = 0; k < leaf.keys.size(); ++k) {
      const V transition = hn::Load(d, leaf.keys[k] + offset);
      const M past = hn::Lt(transition, from);
      inside = hn::Xor(inside, past);
      next = hn::Min(next, hn::Or(transition, hn::VecFromMask(d, past)));
    }
  }

  /// The same for an edge, as its node sees it.
  HWY_INLINE void probe_edge(Program::Edge edge, V from, M active, bool need_true, bool need_false,
                             M& value, V& next, V& leaf_at) {
    const D d;
    if (edge.leaf()) {
      probe_leaf(edge.child(), from, value, next);
      leaf_at = hn::Set(d, edge.child());
    } else {
      probe(edge.child(), from, active, edge.inverted() ? need_false : need_true,
            edge.inverted() ? need_true : need_false, value, next, leaf_at);
    }
    if (edge.inverted()) value = hn::Not(value);
  }

  /// The value of a node after all transitions before `from`, in the lanes `active`; and the next
  /// depth where it changes, where it is true and `need_true`, or false and `need_false`.
  HWY_NOINLINE void probe(std::uint32_t index, V from, M active, bool need_true, bool need_false,
                          M& value, V& next, V& leaf_at) {
    const D d;
    const TileProgram::Node& node = area_.program->nodes[index];
    const Program::Edge* edges = area_.program->edges.data() + node.first;
    const std::uint32_t* nearest = area_.program->nearest.data() + node.first;
    const V none = hn::Set(d, LeafLayers::kEmpty), zero = hn::Zero(d);
    V near = hn::IfThenElse(active, none, zero), near_leaf = zero, far = zero, far_leaf = zero;
    M any = no_lane(d);
    for (std::uint32_t i = 0; i < node.count; ++i) {
      if (!need_true &&
          hn::AllTrue(d, hn::Or(any, hn::Not(hn::Gt(near, hn::Set(d, nearest[i])))))) {
        break;  // what comes is false here and changes later
      }
      M edge_value;
      V edge_next, edge_leaf;
      probe_edge(edges[i], from, active, need_true, need_false, edge_value, edge_next, edge_leaf);
      any = hn::Or(any, edge_value);
      const M nearer = hn::AndNot(edge_value, hn::Lt(edge_next, near));
      near = hn::IfThenElse(nearer, edge_next, near);
      near_leaf = hn::IfThenElse(nearer, edge_leaf, near_leaf);
      const M farther = hn::And(edge_value, hn::Gt(edge_next, far));
      far = hn::IfThenElse(farther, edge_next, far);
      far_leaf = hn::IfThenElse(farther, edge_leaf, far_leaf);
    }
    value = any;
    next = near;
    leaf_at = near_leaf;
    if (!need_true) return;
    M open = hn::And(hn::And(any, active), hn::Lt(far, none));
    while (!hn::AllFalse(d, open)) {
      const V beyond = hn::Add(far, hn::Set(d, 1u));
      M still = no_lane(d);
      V farther = zero, farther_leaf = zero;
      const std::uint32_t first =
          hn::GetLane(hn::MinOfLanes(d, hn::IfThenElse(open, beyond, none)));
      const std::uint32_t last = hn::GetLane(hn::MaxOfLanes(d, hn::IfThenElseZero(open, beyond)));
      for (std::uint32_t i = 0; i < node.count; ++i) {
        if (edges[i].leaf() && !edges[i].inverted()) {  // a ray is outside there
          const LeafLayers& leaf = area_.leaves[edges[i].child()];
          if (leaf.nearest >= last || (leaf.made && leaf.farthest < first)) continue;
        }
        M edge_value;
        V edge_next, edge_leaf;
        probe_edge(edges[i], beyond, open, true, false, edge_value, edge_next, edge_leaf);
        still = hn::Or(still, edge_value);
        const M more = hn::And(edge_value, hn::Gt(edge_next, farther));
        farther = hn::IfThenElse(more, edge_next, farther);
        farther_leaf = hn::IfThenElse(more, edge_leaf, farther_leaf);
      }
      open = hn::And(open, still);
      far = hn::IfThenElse(open, farther, far);
      far_leaf = hn::IfThenElse(open, farther_leaf, far_leaf);
      open = hn::And(open, hn::Lt(far, none));
    }
    next = hn::IfThenElse(any, far, near);
    leaf_at = hn::IfThenElse(any, far_leaf, near_leaf);
  }

  const SearchArea& area_;
  TileFinder& finder_;
  int u_ = 0, v_ = 0;
  bool flat_;  ///< the program is an intersection of solids minus others
  std::vector<Met> met_;
  std::vector<Transition> members_;  ///< of the cluster of met_
  std::vector<std::uint32_t> inside_;
};

void SearchSurface(const SearchArea& area, TileFinder& finder) {
  const D d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  Search search(area, finder);
  SurfaceImage& image = *area.part.image;
  alignas(64) std::uint32_t depths[LeafLayers::kLanes], slots[LeafLayers::kLanes],
      triangles[LeafLayers::kLanes], doubts[LeafLayers::kLanes];
  for (int v = area.rect.v0; v < area.rect.v1; ++v) {
    for (int u = area.rect.u0; u < area.rect.u1; u += lanes) {
      search.set_pixels(u, v);
      V depth, leaf_at, triangle;
      search.find(depth, leaf_at);
      const std::size_t at = area.part.index(u, v);
      const int count = std::min(lanes, area.end - u);
      if (count <= 0) continue;
      hn::Store(depth, d, depths);
      if (hn::AllTrue(d, hn::Eq(depth, hn::Set(d, LeafLayers::kEmpty)))) {
        std::copy(depths, depths + count, image.depth.begin() + static_cast<long>(at));
        continue;
      }
      M doubt = search.judge(depth, leaf_at, triangle);
      V solid = search.solid_at(leaf_at);
      if (!hn::AllFalse(d, doubt)) {
        doubt = hn::And(doubt, hn::FirstN(d, static_cast<std::size_t>(count)));
        if (hn::CountTrue(d, doubt) > hn::Lanes(d) / 2) {
          doubt = search.settle(doubt, depth, solid, triangle);
        }
      }
      if (count == lanes) {
        hn::StoreU(depth, d, image.depth.data() + at);
        hn::StoreU(solid, d, image.solid.data() + at);
        hn::StoreU(triangle, d, image.triangle.data() + at);
      } else {
        hn::Store(depth, d, depths);
        hn::Store(solid, d, slots);
        hn::Store(triangle, d, triangles);
        for (int i = 0; i < count; ++i) {
          const std::size_t pixel = at + static_cast<std::size_t>(i);
          image.depth[pixel] = depths[i];
          image.solid[pixel] = slots[i];
          image.triangle[pixel] = triangles[i];
        }
      }
      if (hn::AllFalse(d, doubt)) continue;
      hn::Store(hn::VecFromMask(d, doubt), d, doubts);
      for (int i = 0; i < count; ++i) {
        if (doubts[i] != 0) {
          area.doubtful->push_back(at + static_cast<std::size_t>(i));
        }
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace strata::csg
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata::csg {

HWY_EXPORT(RasterLayers);
HWY_EXPORT(NormalizeLayers);
HWY_EXPORT(SearchSurface);

std::uint64_t raster_layers(const LatticeMesh& mesh, const RasterTarget& target,
                            std::span<const std::uint32_t> triangles, const PixelRect& clip,
                            double steep_from, LeafLayers& leaf, Arena& arena) {
  return HWY_DYNAMIC_DISPATCH(RasterLayers)(mesh, target, triangles, clip, steep_from, leaf, arena);
}
void normalize_layers(LeafLayers& leaf, bool all_pixels_special, TileFinder& finder) {
  HWY_DYNAMIC_DISPATCH(NormalizeLayers)(leaf, all_pixels_special, finder);
}
void search_surface(const SearchArea& area, TileFinder& finder) {
  HWY_DYNAMIC_DISPATCH(SearchSurface)(area, finder);
}

}  // namespace strata::csg
#endif  // HWY_ONCE
