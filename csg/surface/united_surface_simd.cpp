#include "csg/surface/tile_surface.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "csg/surface/united_surface_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "csg/surface/coincidence_reach-inl.h"
#include "raster/rasterize-inl.h"

// Where all solids of an area are convex and just united with the rest, the nearest entry of a
// pixel is what it shows, and the next two tell whether another is near enough to coincide with it:
// one pass over the triangles, no layers of single solids.

HWY_BEFORE_NAMESPACE();
namespace strata::csg {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace simd = strata::HWY_NAMESPACE;

/// Keeps the three nearest entries of each pixel.
class UnitedSink {
 public:
  UnitedSink(UnitedLayers& layers, const LatticeMesh& mesh, std::uint32_t solid, double steep_from)
      : layers_(&layers), mesh_(&mesh), solid_(solid), steep_from_(steep_from) {}
  HWY_INLINE void steepness(double steepness) { steep_ = steepness > steep_from_; }
  [[nodiscard]] HWY_INLINE bool wants(bool exit) const { return !exit; }
  HWY_INLINE void begin(bool, std::uint32_t triangle, const PixelRect&) {
    face_ = layers_->add_face(*mesh_, solid_, triangle, steep_);
  }
  /// depth + 1, so that 0 is no crossing.
  template <class D2, class V2 = hn::Vec<D2>>
  HWY_INLINE V2 encode(D2 d, V2 depth, hn::Mask<D2> covered) {
    fragments_ += hn::CountTrue(d, covered);
    return hn::IfThenElseZero(covered, hn::Add(depth, hn::Set(d, 1u)));
  }
  static constexpr bool kTakesRows = true;
  template <class D2, class V2 = hn::Vec<D2>>
  HWY_INLINE void put_row(D2 d, int u, int v, V2 depth, hn::Mask<D2> covered) {
    fragments_ += hn::CountTrue(d, covered);
    insert(d, layers_->index(u, v),
           hn::IfThenElse(covered, depth, hn::Set(d, UnitedLayers::kEmpty)));
  }
  template <int columns>
  HWY_INLINE void put_block(int u, int v, const std::uint32_t* words, int rows) {
    const hn::CappedTag<std::uint32_t, columns> d;
    for (int row = 0; row < rows; ++row, words += columns) {
      const std::size_t at = layers_->index(u, v + row);
      for (std::size_t i = 0; i < columns; i += hn::Lanes(d)) {
        insert(d, at + i, hn::Sub(hn::LoadU(d, words + i), hn::Set(d, 1u)));
      }
    }
  }
  HWY_INLINE void put_one(int u, int v, std::uint32_t depth) {
    ++fragments_;
    const hn::CappedTag<std::uint32_t, 1> d;
    insert(d, layers_->index(u, v), hn::Set(d, depth));
  }
  [[nodiscard]] std::uint64_t fragments() const { return fragments_; }

 private:
  /// @param depth  kEmpty where not covered
  template <class D2>
  HWY_INLINE void insert(D2 d, std::size_t at, hn::Vec<D2> depth) {
    std::uint32_t* HWY_RESTRICT behind = layers_->bound_behind + at;
    const auto old_behind = hn::LoadU(d, behind);
    const auto empty = hn::Set(d, UnitedLayers::kEmpty);
    auto face = hn::Set(d, face_);
    if (steep_) {
      if (hn::AllTrue(d, hn::Eq(depth, empty))) return;
    } else if (hn::AllFalse(d, hn::Lt(depth, old_behind))) {
      return;
    }
    for (int k = 0; k < UnitedLayers::kKept; ++k) {
      std::uint32_t* HWY_RESTRICT depths = layers_->depths[k] + at;
      std::uint32_t* HWY_RESTRICT faces = layers_->faces[k] + at;
      const auto old_depth = hn::LoadU(d, depths), old_face = hn::LoadU(d, faces);
      const auto nearer = hn::Lt(depth, old_depth);
      hn::StoreU(hn::Min(depth, old_depth), d, depths);
      hn::StoreU(hn::IfThenElse(nearer, face, old_face), d, faces);
      depth = hn::Max(depth, old_depth);
      face = hn::IfThenElse(nearer, old_face, face);
      if (hn::AllTrue(d, hn::Eq(depth, empty))) return;
    }
    const auto left = hn::Ne(depth, empty);
    hn::StoreU(hn::Min(depth, old_behind), d, behind);
    const auto steep = hn::Ne(hn::And(face, hn::Set(d, UnitedLayers::kSteep)), hn::Zero(d));
    if (hn::AllFalse(d, hn::And(left, steep))) return;
    alignas(64) std::uint32_t depths[HWY_MAX_BYTES / 4], faces[HWY_MAX_BYTES / 4];
    hn::Store(depth, d, depths);
    hn::Store(face, d, faces);
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
      if (depths[i] == UnitedLayers::kEmpty || (faces[i] & UnitedLayers::kSteep) == 0) continue;
      const std::uint32_t extra = layers_->extra_steps[faces[i] & ~UnitedLayers::kSteep];
      behind[i] = std::min(behind[i], depths[i] - std::min(depths[i], extra));
    }
  }

  UnitedLayers* layers_;
  const LatticeMesh* mesh_;
  std::uint32_t solid_;
  double steep_from_;
  std::uint32_t face_ = 0;
  bool steep_ = false;
  std::uint64_t fragments_ = 0;
};

std::uint64_t RasterUnited(const LatticeMesh& mesh, const RasterTarget& target,
                           std::span<const std::uint32_t> triangles, const PixelRect& clip,
                           double steep_from, std::uint32_t solid, UnitedLayers& layers) {
  UnitedSink sink(layers, mesh, solid, steep_from);
  simd::rasterize_triangles(mesh, target, triangles, clip, sink);
  return sink.fragments();
}

void FindHidden(const Coincidence::Range& range, UnitedLayers& layers) {
  using D = hn::CappedTag<std::uint32_t, UnitedLayers::kSide>;
  const D d;
  constexpr auto kWords = static_cast<std::size_t>(UnitedLayers::kSide * UnitedLayers::kSide);
  const auto steep = hn::Set(d, UnitedLayers::kSteep), empty = hn::Set(d, UnitedLayers::kEmpty);
  auto farthest = hn::Zero(d);
  for (std::size_t at = 0; at < kWords; at += hn::Lanes(d)) {
    const auto depth = hn::Load(d, layers.depths[0] + at);
    const auto face = hn::Load(d, layers.faces[0] + at);
    const auto open = hn::Or(hn::Eq(depth, empty), hn::Ne(hn::And(face, steep), hn::Zero(d)));
    if (!hn::AllFalse(d, open)) return;
    farthest = hn::Max(farthest, depth);
  }
  const auto last = hn::MaxOfLanes(d, farthest);
  layers.hidden_beyond = hn::GetLane(hn::Add(last, coincidence_reach(d, range, last))) + 1;
}

void FindUnited(const UnitedLayers& layers, const PixelRect& area, const Coincidence::Range& range,
                const SurfacePart& part, std::vector<std::uint64_t>& doubtful) {
  using D = hn::CappedTag<std::uint32_t, LeafLayers::kLanes>;
  const D d;
  const hn::RebindToSigned<D> di;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const auto empty = hn::Set(d, UnitedLayers::kEmpty), zero = hn::Zero(d);
  const auto steep = hn::Set(d, UnitedLayers::kSteep);
  SurfaceImage& image = *part.image;
  alignas(64) std::uint32_t depths[LeafLayers::kLanes], solids[LeafLayers::kLanes],
      triangles[LeafLayers::kLanes], doubts[LeafLayers::kLanes];
  for (int v = area.v0; v < area.v1; ++v) {
    for (int u = area.u0; u < area.u1; u += lanes) {
      const std::size_t at = layers.index(u, v);
      const std::size_t pixel = part.index(u, v);
      const int count = std::min(lanes, area.u1 - u);
      const auto depth = hn::Load(d, layers.depths[0] + at);
      const auto hit = hn::Ne(depth, empty);
      const auto marked = hn::IfThenElseZero(hit, hn::Load(d, layers.faces[0] + at));
      const auto face = hn::AndNot(steep, marked);
      auto solid = zero, triangle = zero;
      const std::uint32_t first = hn::GetLane(face);
      if (hn::AllTrue(d, hn::Eq(face, hn::Set(d, first)))) {
        if (!layers.face_solids.empty()) {
          solid = hn::Set(d, layers.face_solids[first]);
          triangle = hn::Set(d, layers.face_triangles[first]);
        }
      } else {
        solid = hn::GatherIndex(d, layers.face_solids.data(), hn::BitCast(di, face));
        triangle = hn::GatherIndex(d, layers.face_triangles.data(), hn::BitCast(di, face));
      }
      if (count == lanes) {
        hn::StoreU(depth, d, image.depth.data() + pixel);
        hn::StoreU(solid, d, image.solid.data() + pixel);
        hn::StoreU(triangle, d, image.triangle.data() + pixel);
      } else {
        hn::Store(depth, d, depths);
        hn::Store(solid, d, solids);
        hn::Store(triangle, d, triangles);
        for (int i = 0; i < count; ++i) {
          const std::size_t to = pixel + static_cast<std::size_t>(i);
          image.depth[to] = depths[i];
          image.solid[to] = solids[i];
          image.triangle[to] = triangles[i];
        }
      }
      const auto last = hn::Add(depth, coincidence_reach(d, range, hn::IfThenElseZero(hit, depth)));
      const auto second = hn::Load(d, layers.depths[1] + at);
      const auto third = hn::Load(d, layers.depths[2] + at);
      auto bits = hn::Or(
          marked, hn::IfThenElseZero(hn::Ne(second, empty), hn::Load(d, layers.faces[1] + at)));
      bits =
          hn::Or(bits, hn::IfThenElseZero(hn::Ne(third, empty), hn::Load(d, layers.faces[2] + at)));
      const auto near =
          hn::Not(hn::Gt(hn::Min(second, hn::Load(d, layers.bound_behind + at)), last));
      const auto doubt = hn::And(hit, hn::Or(near, hn::Ne(hn::And(bits, steep), zero)));
      if (hn::AllFalse(d, doubt)) continue;
      hn::Store(hn::VecFromMask(d, doubt), d, doubts);
      for (int i = 0; i < count; ++i) {
        if (doubts[i] != 0) doubtful.push_back(pixel + static_cast<std::size_t>(i));
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace strata::csg
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata::csg {

HWY_EXPORT(RasterUnited);
HWY_EXPORT(FindHidden);
HWY_EXPORT(FindUnited);

std::uint64_t raster_united(const LatticeMesh& mesh, const RasterTarget& target,
                            std::span<const std::uint32_t> triangles, const PixelRect& clip,
                            double steep_from, std::uint32_t solid, UnitedLayers& layers) {
  return HWY_DYNAMIC_DISPATCH(RasterUnited)(mesh, target, triangles, clip, steep_from, solid,
                                            layers);
}
void find_hidden(const Coincidence::Range& range, UnitedLayers& layers) {
  HWY_DYNAMIC_DISPATCH(FindHidden)(range, layers);
}
void find_united(const UnitedLayers& layers, const PixelRect& area, const Coincidence::Range& range,
                 const SurfacePart& part, std::vector<std::uint64_t>& doubtful) {
  HWY_DYNAMIC_DISPATCH(FindUnited)(layers, area, range, part, doubtful);
}

}  // namespace strata::csg
#endif  // HWY_ONCE
