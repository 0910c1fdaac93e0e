#include "hashbuffer/tile_store.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hashbuffer/tile_raster.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "raster/rasterize-inl.h"

HWY_BEFORE_NAMESPACE();
namespace strata {
namespace HWY_NAMESPACE {

/// Values of a vector of fragments in the record's order: larger is nearer.
struct KeyLanes {
  using D = LaneU32;
  using V = hn::Vec<D>;
  V exit_bits;
  HWY_INLINE void begin(bool exit, std::uint32_t) { exit_bits = hn::Set(D(), exit ? 1u : 0u); }
  /// Keys of the covered lanes; the others hold rubbish.
  HWY_INLINE V keys(VecU32 depth) const { return hn::Or(hn::ShiftLeft<1>(depth), exit_bits); }
  HWY_INLINE static hn::Mask<D> mask(MaskU32 covered) { return covered; }
  static std::uint32_t key(std::uint32_t depth, bool exit, std::uint32_t) {
    return depth << 1 | (exit ? 1u : 0u);
  }
};

struct ItemLanes {
  using D = hn::ScalableTag<std::uint64_t>;
  using V = hn::Vec<D>;
  V payload;
  HWY_INLINE void begin(bool exit, std::uint32_t triangle) {
    payload = hn::Set(D(), DepthItem(0, exit, triangle).bits);
  }
  HWY_INLINE V keys(VecU32 depth) const {
    return hn::Or(hn::ShiftLeft<32>(hn::PromoteTo(D(), depth)), payload);
  }
  HWY_INLINE static hn::Mask<D> mask(MaskU32 covered) {
    // Through a vector: masks of different lane widths do not convert.
    const auto ones = hn::IfThenElseZero(covered, hn::Set(LaneU32(), 1u));
    return hn::Ne(hn::PromoteTo(D(), ones), hn::Zero(D()));
  }
  static std::uint64_t key(std::uint32_t depth, bool exit, std::uint32_t triangle) {
    return DepthItem(depth, exit, triangle).bits;
  }
};

template <class Record>
using LanesOf = std::conditional_t<std::is_same_v<Record, Record32>, KeyLanes, ItemLanes>;

/// All of a record but its age.
template <class Record>
inline constexpr typename Record::Word kValueMask = Record::kAgeUnit - 1;

/// Inserts covered pixels into the tile's HA-buffer.
template <class Record>
class TableSink {
 public:
  using Bits = typename Record::Word;
  using Lanes = LanesOf<Record>;

  TableSink(TileTable<Record>& table, const PixelRect& clip)
      : table_(&table),
        cells_(table.cells.data()),
        planes_(std::min(table.planes, static_cast<int>(Record::kAgeMax))),
        u0_(clip.u0),
        v0_(clip.v0) {}
  HWY_INLINE void begin(bool exit, std::uint32_t triangle, const PixelRect& box) {
    exit_ = exit;
    triangle_ = triangle;
    lanes_.begin(exit, triangle);
    result_.add_rows(box.v0 - v0_, box.v1 - v0_);
  }
  HWY_INLINE void put(int u, int v, MaskU32 covered, VecU32 depth) {
    using D = typename Lanes::D;
    const D d;
    const auto mask = Lanes::mask(covered);
    const auto step = hn::Set(d, Record::kAgeUnit);
    const auto value = hn::AndNot(lanes_.keys(depth), hn::Set(d, kValueMask<Record>));
    auto carry = hn::IfThenElseZero(mask, hn::Or(value, step));
    result_.fragments += hn::CountTrue(d, mask);

    const std::size_t pixel = pixel_at(u, v);
    Bits* HWY_RESTRICT cell = cells_ + pixel;
    for (int age = 1; age <= planes_; ++age, cell += kTilePixels) {
      // Only records of the same pixel and age can be smaller here, so no lane evicts a stranger.
      const auto old = hn::LoadU(d, cell);
      hn::StoreU(hn::Max(old, carry), d, cell);
      const auto less = hn::Min(old, carry);
      const auto left = hn::Ne(less, hn::Zero(d));
      if (hn::AllFalse(d, left)) {
        oldest_ = std::max(oldest_, age);
        return;
      }
      carry = hn::Add(less, hn::IfThenElseZero(left, step));
    }
    oldest_ = planes_;
    overflow(*table_, pixel, carry);
  }
  void put_one(int u, int v, std::uint32_t depth) {
    ++result_.fragments;
    const Bits key = Lanes::key(depth, exit_, triangle_);
    table_->insert(pixel_at(u, v), (~key & kValueMask<Record>) | Record::kAgeUnit);
  }
  TileRasterResult finish() {
    table_->oldest = std::max(table_->oldest, oldest_);
    return result_;
  }

 private:
  [[nodiscard]] HWY_INLINE std::size_t pixel_at(int u, int v) const {
    return static_cast<std::size_t>((v - v0_) * kTileSide + (u - u0_));
  }
  /// The planes are exhausted: each lane goes on by itself. Static, so that the sink's members may
  /// stay in registers.
  static HWY_NOINLINE void overflow(TileTable<Record>& table, std::size_t pixel,
                                    typename Lanes::V carry) {
    const typename Lanes::D d;
    alignas(64) Bits records[HWY_MAX_BYTES / sizeof(Bits)];
    hn::Store(carry, d, records);
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
      if (records[i] == 0) continue;
      // After plane 255 the age field has wrapped into nothing: such a record is lost and counted.
      if (table.planes >= static_cast<int>(Record::kAgeMax)) {
        ++table.failures;
      } else {
        table.insert(pixel + i, records[i]);
      }
    }
  }

  TileTable<Record>* table_;
  Bits* cells_;
  int planes_, oldest_ = 0;
  int u0_, v0_;
  Lanes lanes_;
  std::uint32_t triangle_ = 0;
  bool exit_ = false;
  TileRasterResult result_;
};

/// Appends covered pixels to the tile's log.
template <class Record>
class LogSink {
 public:
  using Lanes = LanesOf<Record>;

  LogSink(TileLog<Record>& log, const PixelRect& clip) : log_(&log), clip_(clip) {}
  HWY_INLINE void begin(bool exit, std::uint32_t triangle, const PixelRect& box) {
    exit_ = exit;
    triangle_ = triangle;
    lanes_.begin(exit, triangle);
    result_.add_rows(box.v0 - clip_.v0, box.v1 - clip_.v0);
    log_->reserve(static_cast<std::size_t>(box.u1 - box.u0) *
                  static_cast<std::size_t>(box.v1 - box.v0));
  }
  HWY_INLINE void put(int u, int v, MaskU32 covered, VecU32 depth) {
    const LaneU32 d32;
    const int pixel = (v - clip_.v0) * kTileSide + (u - clip_.u0);
    const auto pixels = hn::Iota(d32, static_cast<std::uint32_t>(pixel));
    hn::CompressStore(pixels, covered, d32, log_->pixels.data() + log_->count);
    const typename Lanes::D d;
    log_->count += hn::CompressStore(
        lanes_.keys(depth), Lanes::mask(covered), d,
        reinterpret_cast<typename Record::Word*>(log_->keys.data()) + log_->count);
  }
  void put_one(int u, int v, std::uint32_t depth) {
    log_->pixels[log_->count] =
        static_cast<std::uint32_t>((v - clip_.v0) * kTileSide + (u - clip_.u0));
    log_->keys[log_->count++] = TileKey<Record>(Lanes::key(depth, exit_, triangle_));
  }

  TileRasterResult finish() {
    result_.fragments = log_->count;
    return result_;
  }

 private:
  TileLog<Record>* log_;
  TileRasterResult result_;
  PixelRect clip_;
  Lanes lanes_;
  std::uint32_t triangle_ = 0;
  bool exit_ = false;
};

template <class Record>
TileRasterResult raster_table(const TileInput& input, TileTable<Record>& table) {
  TableSink<Record> sink(table, input.clip);
  rasterize_triangles(input.mesh, input.target, input.triangles, input.clip, sink);
  return sink.finish();
}

template <class Record>
TileRasterResult raster_log(const TileInput& input, TileLog<Record>& log) {
  LogSink<Record> sink(log, input.clip);
  rasterize_triangles(input.mesh, input.target, input.triangles, input.clip, sink);
  return sink.finish();
}

TileRasterResult raster_key_table(const TileInput& input, TileTable<Record32>& table) {
  return raster_table(input, table);
}
TileRasterResult raster_item_table(const TileInput& input, TileTable<Record64>& table) {
  return raster_table(input, table);
}
TileRasterResult raster_key_log(const TileInput& input, TileLog<Record32>& log) {
  return raster_log(input, log);
}
TileRasterResult raster_item_log(const TileInput& input, TileLog<Record64>& log) {
  return raster_log(input, log);
}

}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata {

HWY_EXPORT(raster_key_table);
HWY_EXPORT(raster_item_table);
HWY_EXPORT(raster_key_log);
HWY_EXPORT(raster_item_log);

TileRasterResult raster_into(const TileInput& input, TileTable<Record32>& table) {
  return HWY_DYNAMIC_DISPATCH(raster_key_table)(input, table);
}
TileRasterResult raster_into(const TileInput& input, TileTable<Record64>& table) {
  return HWY_DYNAMIC_DISPATCH(raster_item_table)(input, table);
}
TileRasterResult raster_into(const TileInput& input, TileLog<Record32>& log) {
  return HWY_DYNAMIC_DISPATCH(raster_key_log)(input, log);
}
TileRasterResult raster_into(const TileInput& input, TileLog<Record64>& log) {
  return HWY_DYNAMIC_DISPATCH(raster_item_log)(input, log);
}

}  // namespace strata
#endif  // HWY_ONCE
