#include "hashbuffer/tile_store.h"

#include <algorithm>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hashbuffer/tile_raster.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/lanes-inl.h"
#include "raster/spans-inl.h"

HWY_BEFORE_NAMESPACE();
namespace strata {
namespace HWY_NAMESPACE {

/// Raises the largest ages of blocks of 8 x 8 pixels, if they are kept.
struct BlockAges {
  std::uint16_t* ages = nullptr;
  void operator()(std::uint64_t pixel, unsigned age) const {
    if (ages == nullptr) return;
    constexpr std::uint64_t kBlocks = kTileSide / 8;
    std::uint16_t& most = ages[pixel / kTileSide / 8 * kBlocks + pixel % kTileSide / 8];
    most = std::max(most, static_cast<std::uint16_t>(age));
  }
};

/// All of a record but its age.
template <class Record>
inline constexpr typename Record::Word kValueMask = Record::kAgeUnit - 1;

/// The key of one fragment.
template <class Record>
TileKey<Record> make_key(std::uint32_t depth, bool exit, std::uint32_t triangle) {
  if constexpr (std::is_same_v<TileKey<Record>, DepthKey>) {
    return depth << 1 | (exit ? 1u : 0u);
  } else {
    return DepthItem(depth, exit, triangle);
  }
}

/// Calls body(lane, [depth:32 | surface:32]) for each lane.
template <class Body>
HWY_INLINE void for_each_surface(SpanVecI32 depths, SpanVecU32 surfaces, Body&& body) {
  alignas(64) std::int32_t depth[kSpanLanes];
  alignas(64) std::uint32_t surface[kSpanLanes];
  hn::Store(depths, SpanI32(), depth);
  hn::Store(surfaces, SpanU32(), surface);
  for (std::size_t lane = 0; lane < kSpanLanes; ++lane) {
    body(lane, std::uint64_t{static_cast<std::uint32_t>(depth[lane])} << 32 | surface[lane]);
  }
}

/// Inserts covered pixels into the tile's HA-buffer.
template <class Record>
class TableSink {
 public:
  using Bits = typename Record::Word;
  static constexpr bool kKeys = Record::kPayloadBits == 0;
  static constexpr bool kApart = kKeys;  ///< where rays enter, and where they leave
  static constexpr std::size_t kPlane = TileTable<Record>::kLists;

  TableSink(TileTable<Record>& table, const PixelRect& clip, BlockAges ages = {})
      : table_(&table),
        ages_(ages),
        cells_(table.cells.data()),
        planes_(std::min(table.planes, static_cast<int>(Record::kAgeMax))),
        u0_(clip.u0),
        v0_(clip.v0) {}
  HWY_INLINE void begin(bool exit, std::uint32_t triangle, const PixelRect& box) {
    exit_ = exit;
    side_ = kApart && exit ? kTilePixels : 0;
    triangle_ = triangle;
    // A record of age 1 at depth 0, from which depths are subtracted.
    if constexpr (kKeys) {
      nearest_ = Record::kAgeUnit + kValueMask<Record> - (exit ? 1 : 0);
    } else {
      nearest_ = Record::kAgeUnit + kValueMask<Record> - DepthItem(0, exit, triangle).bits;
    }
    result_.add_rows(box.v0 - v0_, box.v1 - v0_);
  }
  /// Keys: whole records. Items: depth + 1, since a record needs a wider lane.
  template <class D, class V = hn::Vec<D>>
  HWY_INLINE V encode(D d, V depth, hn::Mask<D> covered) {
    result_.fragments += hn::CountTrue(d, covered);
    if constexpr (kKeys) {
      return hn::IfThenElseZero(covered, hn::Sub(hn::Set(d, static_cast<std::uint32_t>(nearest_)),
                                                 hn::ShiftLeft<1>(depth)));
    } else {
      return hn::IfThenElseZero(covered, hn::Add(depth, hn::Set(d, 1u)));
    }
  }
  template <int columns>
  HWY_INLINE void put_block(int u, int v, const std::uint32_t* words, int rows) {
    const hn::CappedTag<Bits, columns> d;
    for (int row = 0; row < rows; ++row, words += columns) {
      const std::size_t pixel = pixel_at(u, v + row);
      for (std::size_t i = 0; i < columns; i += hn::Lanes(d)) {
        insert(d, pixel + i, decode(d, words + i));
      }
    }
  }
  HWY_INLINE void put_one(int u, int v, std::uint32_t depth) {
    ++result_.fragments;
    const Bits key = bits_of(make_key<Record>(depth, exit_, triangle_));
    table_->insert(pixel_at(u, v), (~key & kValueMask<Record>) | Record::kAgeUnit);
  }
  HWY_INLINE void begin_spans(int row_begin, int row_end, std::size_t pixels) {
    result_.add_rows(row_begin, row_end);
    result_.fragments += pixels;
  }
  /// A record of age 1 at the depth, from which further depth is subtracted.
  using SpanBase = Bits;
  static HWY_INLINE void make_bases(SpanVecI32 depths, SpanVecU32 surfaces, SpanBase* bases) {
    const SpanU32 d;
    if constexpr (kKeys) {
      const auto keys =
          hn::Add(hn::ShiftLeft<1>(hn::BitCast(d, depths)), hn::ShiftRight<31>(surfaces));
      hn::StoreU(hn::Sub(hn::Set(d, Record::kAgeUnit + kValueMask<Record>), keys), d, bases);
    } else {
      for_each_surface(depths, surfaces, [bases](std::size_t lane, std::uint64_t bits) {
        bases[lane] = Record::kAgeUnit + kValueMask<Record> - bits;
      });
    }
  }
  template <class D, class V = hn::Vec<D>>
  HWY_INLINE void put_span(D d, std::size_t pixel, V depth, V covered, SpanBase base) {
    if constexpr (kKeys) {
      const auto records = hn::Sub(hn::Set(d, base), hn::ShiftLeft<1>(depth));
      insert(d, pixel, hn::And(covered, records));
    } else {
      const hn::CappedTag<Bits, HWY_MAX_BYTES / 8> d64;
      alignas(64) std::uint32_t words[HWY_MAX_BYTES / 4];
      hn::Store(hn::And(covered, hn::Add(depth, hn::Set(d, 1u))), d, words);
      nearest_ = base;
      for (std::size_t i = 0; i < hn::Lanes(d); i += hn::Lanes(d64)) {
        insert(d64, pixel + i, decode(d64, words + i));
      }
    }
  }
  /// Inserts fragments one by one, and neighbours that follow each other at once.
  void put_all(std::span<const std::uint32_t> pixels, std::span<const DepthItem> items) {
    const hn::ScalableTag<std::uint64_t> d;
    const hn::Rebind<std::uint32_t, decltype(d)> d32;
    const std::size_t lanes = hn::Lanes(d), count = pixels.size();
    const auto oldest = hn::Set(d, Record::kAgeUnit + kValueMask<Record>);
    for (std::size_t i = 0; i < count;) {
      const std::uint32_t pixel = pixels[i];
      std::size_t run = std::min(lanes, count - i);
      auto carry = hn::Zero(d);
      if (run == lanes) {
        const auto next = hn::Eq(hn::LoadU(d32, pixels.data() + i), count_from(d32, pixel));
        carry = hn::Sub(oldest, hn::LoadU(d, &items[i].bits));
        if (!hn::AllTrue(d32, next)) {
          run = run_length(pixels.data() + i, lanes);
          carry = hn::IfThenElseZero(hn::FirstN(d, run), carry);
        }
      } else {
        run = 1;
        carry = hn::IfThenElseZero(hn::FirstN(d, 1), hn::Set(d, nearest_of(items[i])));
      }
      const int age = insert(d, pixel, carry);
      ages_(pixel, static_cast<unsigned>(age));
      ages_(pixel + run - 1, static_cast<unsigned>(age));
      i += run;
      result_.fragments += run;
    }
  }
  TileRasterResult finish() {
    // The first planes are not watched: the bound may be 2 where the tile is one layer deep.
    const int first = result_.fragments > 0 ? std::min(planes_, kApart ? 1 : 2) : 0;
    table_->oldest = std::max({table_->oldest, oldest_, first});
    return result_;
  }

 private:
  /// Pixels that follow each other from the first on.
  static std::size_t run_length(const std::uint32_t* pixels, std::size_t most) {
    std::size_t run = 1;
    while (run < most && pixels[run] == pixels[0] + run) ++run;
    return run;
  }
  static Bits nearest_of(DepthItem item) {
    return Record::kAgeUnit + kValueMask<Record> - item.bits;
  }
  static std::uint32_t bits_of(DepthKey key) { return key; }
  static std::uint64_t bits_of(DepthItem item) { return item.bits; }
  [[nodiscard]] HWY_INLINE std::size_t pixel_at(int u, int v) const {
    return static_cast<std::size_t>((v - v0_) * kTileSide + (u - u0_)) + side_;
  }

  /// Records of age 1 from encoded words.
  template <class D>
  HWY_INLINE hn::Vec<D> decode(D d, const std::uint32_t* words) const {
    if constexpr (kKeys) {
      return hn::Load(d, words);
    } else {
      const auto lifted =
          hn::PromoteTo(d, hn::LoadU(hn::Rebind<std::uint32_t, decltype(d)>(), words));
      const auto depth = hn::ShiftLeft<32>(hn::Sub(lifted, hn::Set(d, Bits{1})));
      return hn::IfThenElseZero(hn::Ne(lifted, hn::Zero(d)), hn::Sub(hn::Set(d, nearest_), depth));
    }
  }

  /// Inserts a vector of neighbours, records of age 1 or 0. Only records of the same pixel and age
  /// can be smaller than what comes to a plane, so that no lane evicts a stranger.
  /// @return planes that were looked at
  template <class D, class V = hn::Vec<D>>
  HWY_INLINE int insert(D d, std::size_t pixel, V carry) {
    const auto step = hn::Set(d, Record::kAgeUnit);
    const auto zero = hn::Zero(d);
    Bits* HWY_RESTRICT cell = cells_ + pixel;
    const auto exchange = [&] {  // the larger stays, the smaller goes on
      const auto old = hn::LoadU(d, cell);
      hn::StoreU(hn::Max(old, carry), d, cell);
      cell += kPlane;
      return hn::Min(old, carry);
    };
    const auto older = [&](V less) {
      return hn::Add(less, hn::IfThenElseZero(hn::Ne(less, zero), step));
    };
    int age = 0;
    if constexpr (kApart) {
      if (HWY_LIKELY(planes_ > 0)) {
        carry = exchange();
        if (HWY_LIKELY(hn::AllTrue(d, hn::Eq(carry, zero)))) return 1;
        carry = older(carry);
        age = 1;
      }
    } else if (HWY_LIKELY(planes_ >= 2)) {
      // Which of the first two planes a row ends in cannot be predicted: both are always done.
      const auto first = hn::LoadU(d, cell), second = hn::LoadU(d, cell + kPlane);
      hn::StoreU(hn::Max(first, carry), d, cell);
      carry = older(hn::Min(first, carry));
      hn::StoreU(hn::Max(second, carry), d, cell + kPlane);
      carry = hn::Min(second, carry);
      cell += 2 * kPlane;
      if (HWY_LIKELY(hn::AllTrue(d, hn::Eq(carry, zero)))) return 2;
      carry = older(carry);
      age = 2;
    }
    while (age < planes_) {
      ++age;
      carry = exchange();
      if (hn::AllTrue(d, hn::Eq(carry, zero))) {
        oldest_ = std::max(oldest_, age);
        return age;
      }
      carry = older(carry);
    }
    oldest_ = planes_;
    overflow(*table_, d, pixel, carry, ages_);
    return age;
  }
  /// The planes are exhausted: each lane goes on by itself. Static, so that the sink's members may
  /// stay in registers.
  template <class D>
  static HWY_NOINLINE void overflow(TileTable<Record>& table, D d, std::size_t pixel,
                                    hn::Vec<D> carry, BlockAges ages) {
    alignas(64) Bits records[HWY_MAX_BYTES / sizeof(Bits)];
    hn::Store(carry, d, records);
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
      if (records[i] != 0) overflow_one(table, pixel + i, records[i], ages);
    }
  }
  static void overflow_one(TileTable<Record>& table, std::size_t pixel, Bits record,
                           BlockAges ages) {
    // After plane 255 the age field has wrapped into nothing: such a record is lost and counted.
    if (table.planes >= static_cast<int>(Record::kAgeMax)) {
      ++table.failures;
    } else {
      table.insert(pixel, record, ages);
    }
  }

  TileTable<Record>* table_;
  BlockAges ages_;
  Bits* cells_;
  int planes_, oldest_ = 0;
  int u0_, v0_;
  std::size_t side_ = 0;
  Bits nearest_ = 0;
  std::uint32_t triangle_ = 0;
  bool exit_ = false;
  TileRasterResult result_;
};

/// Appends covered pixels to the tile's log.
template <class Record>
class LogSink {
 public:
  static constexpr bool kApart = false;
  LogSink(TileLog<Record>& log, const PixelRect& clip)
      : log_(&log), count_(log.count), clip_(clip) {}
  HWY_INLINE void begin(bool exit, std::uint32_t triangle, const PixelRect& box) {
    exit_ = exit;
    triangle_ = triangle;
    result_.add_rows(box.v0 - clip_.v0, box.v1 - clip_.v0);
    reserve(static_cast<std::size_t>(box.u1 - box.u0) * static_cast<std::size_t>(box.v1 - box.v0));
  }
  template <class D, class V = hn::Vec<D>>
  HWY_INLINE V encode(D d, V depth, hn::Mask<D> covered) const {
    return hn::IfThenElseZero(covered, hn::Add(depth, hn::Set(d, 1u)));
  }
  template <int columns>
  HWY_INLINE void put_block(int u, int v, const std::uint32_t* words, int rows) {
    for (int row = 0; row < rows; ++row) put_row<columns>(u, v + row, words + row * columns);
  }
  HWY_INLINE void put_one(int u, int v, std::uint32_t depth) {
    pixels_[count_] = static_cast<std::uint32_t>((v - clip_.v0) * kTileSide + (u - clip_.u0));
    keys_[count_++] = make_key<Record>(depth, exit_, triangle_);
  }
  HWY_INLINE void begin_spans(int row_begin, int row_end, std::size_t pixels) {
    result_.add_rows(row_begin, row_end);
    reserve(pixels);
  }
  using SpanBase = std::uint64_t;  ///< [depth:32 | surface:32]
  static HWY_INLINE void make_bases(SpanVecI32 depths, SpanVecU32 surfaces, SpanBase* bases) {
    for_each_surface(depths, surfaces,
                     [bases](std::size_t lane, std::uint64_t bits) { bases[lane] = bits; });
  }
  template <class D, class V = hn::Vec<D>>
  HWY_INLINE void put_span(D d, std::size_t pixel, V depth, V covered, SpanBase base) {
    exit_ = (base >> 31 & 1) != 0;
    triangle_ = static_cast<std::uint32_t>(base) & 0x7fffffffu;
    const auto lift = hn::Set(d, static_cast<std::uint32_t>(base >> 32) + 1);
    put_words(d, pixel, hn::And(covered, hn::Add(depth, lift)));
  }
  TileRasterResult finish() {
    log_->count = count_;
    result_.fragments = count_;
    return result_;
  }

 private:
  HWY_INLINE void reserve(std::size_t more) {
    log_->count = count_;
    log_->reserve(more);
    pixels_ = log_->pixels.data();
    keys_ = log_->keys.data();
  }
  template <int columns>
  HWY_INLINE void put_row(int u, int v, const std::uint32_t* words) {
    const hn::CappedTag<std::uint32_t, columns> d;
    const auto pixel = static_cast<std::size_t>((v - clip_.v0) * kTileSide + (u - clip_.u0));
    for (std::size_t i = 0; i < columns; i += hn::Lanes(d)) {
      put_words(d, pixel + i, hn::Load(d, words + i));
    }
  }
  /// Appends neighbours, encoded words.
  template <class D>
  HWY_INLINE void put_words(D d, std::size_t pixel, hn::Vec<D> lifted) {
    const auto covered = hn::Ne(lifted, hn::Zero(d));
    const std::size_t found = hn::CountTrue(d, covered);
    // Whole vectors are stored: to store a compressed part takes some processors 100 cycles.
    const auto pixels = count_from(d, static_cast<std::uint32_t>(pixel));
    hn::StoreU(hn::Compress(pixels, covered), d, pixels_ + count_);
    const auto depth = hn::Compress(hn::Sub(lifted, hn::Set(d, 1u)), covered);
    if constexpr (Record::kPayloadBits == 0) {
      const auto key = hn::Or(hn::ShiftLeft<1>(depth), hn::Set(d, exit_ ? 1u : 0u));
      hn::StoreU(key, d, keys_ + count_);
    } else {
      put_items(d, depth, found);
    }
    count_ += found;
  }
  /// The keys of the first `found` depths; beyond them something.
  template <class D>
  HWY_INLINE void put_items(D d, hn::Vec<D> depth, std::size_t found) {
    alignas(64) std::uint32_t depths[2 * HWY_MAX_BYTES / 4];
    hn::Store(depth, d, depths);
    const hn::CappedTag<std::uint64_t, HWY_MAX_BYTES / 8> d64;
    const hn::Rebind<std::uint32_t, decltype(d64)> d32;
    const auto surface = hn::Set(d64, DepthItem(0, exit_, triangle_).bits);
    for (std::size_t k = 0; k < found; k += hn::Lanes(d64)) {
      const auto high = hn::ShiftLeft<32>(hn::PromoteTo(d64, hn::LoadU(d32, depths + k)));
      hn::StoreU(hn::Or(high, surface), d64, &keys_[count_ + k].bits);
    }
  }

  TileLog<Record>* log_;
  std::size_t count_;
  std::uint32_t* pixels_ = nullptr;
  TileKey<Record>* keys_ = nullptr;
  TileRasterResult result_;
  PixelRect clip_;
  std::uint32_t triangle_ = 0;
  bool exit_ = false;
};

template <class Record>
TileRasterResult raster_table(const TileInput& input, TileTable<Record>& table) {
  TableSink<Record> sink(table, input.clip);
  rasterize_spans(input.mesh, input.target, input.triangles, input.clip, sink);
  return sink.finish();
}

template <class Record>
TileRasterResult raster_log(const TileInput& input, TileLog<Record>& log) {
  LogSink<Record> sink(log, input.clip);
  if (input.in_order) {
    // A tile's triangles come in an order that the number of threads decides.
    std::vector<std::uint32_t> triangles(input.triangles.begin(), input.triangles.end());
    std::sort(triangles.begin(), triangles.end());
    rasterize_triangles(input.mesh, input.target, triangles, input.clip, sink);
  } else {
    rasterize_spans(input.mesh, input.target, input.triangles, input.clip, sink);
  }
  return sink.finish();
}

TileRasterResult raster_key_table(const TileInput& input, TileTable<Record32>& table) {
  return raster_table(input, table);
}
TileRasterResult raster_item_table(const TileInput& input, TileTable<Record64>& table) {
  return raster_table(input, table);
}
void put_items(std::span<const std::uint32_t> pixels, std::span<const DepthItem> items,
               TileTable<Record64>& table, std::uint16_t* ages) {
  TableSink<Record64> sink(table, PixelRect{}, BlockAges{ages});
  sink.put_all(pixels, items);
  sink.finish();
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
HWY_EXPORT(put_items);
HWY_EXPORT(raster_key_log);
HWY_EXPORT(raster_item_log);

TileRasterResult raster_into(const TileInput& input, TileTable<Record32>& table) {
  return HWY_DYNAMIC_DISPATCH(raster_key_table)(input, table);
}
TileRasterResult raster_into(const TileInput& input, TileTable<Record64>& table) {
  return HWY_DYNAMIC_DISPATCH(raster_item_table)(input, table);
}
void insert_into(std::span<const std::uint32_t> pixels, std::span<const DepthItem> items,
                 TileTable<Record64>& table, std::uint16_t* ages) {
  HWY_DYNAMIC_DISPATCH(put_items)(pixels, items, table, ages);
}
TileRasterResult raster_into(const TileInput& input, TileLog<Record32>& log) {
  return HWY_DYNAMIC_DISPATCH(raster_key_log)(input, log);
}
TileRasterResult raster_into(const TileInput& input, TileLog<Record64>& log) {
  return HWY_DYNAMIC_DISPATCH(raster_item_log)(input, log);
}

}  // namespace strata
#endif  // HWY_ONCE
