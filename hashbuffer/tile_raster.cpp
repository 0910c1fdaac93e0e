#include "hashbuffer/tile_store.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hashbuffer/tile_raster.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "raster/rasterize-inl.h"

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

/// DepthItems of a vector of depths and surfaces.
template <class D64, class V32>
HWY_INLINE hn::Vec<D64> pack_items(D64 d, V32 depth, V32 surface) {
  return hn::Or(hn::ShiftLeft<32>(hn::PromoteTo(d, depth)), hn::PromoteTo(d, surface));
}

/// Fragments of small triangles on their way into a table, as records of age 1.
template <class Record>
struct WaitingRecords {
  /// Fragments that a call of make_room() asks for, and a vector beyond them.
  static constexpr std::size_t kMore = (SetupBatch::kLaneSide + 1) * kMaxLanes;
  static constexpr std::size_t kRoom = 1024;
  static_assert(kRoom > kMore);
  std::uint32_t pixels[kRoom];
  typename Record::Word records[kRoom];
};

/// Inserts covered pixels into the tile's HA-buffer.
template <class Record>
class TableSink {
 public:
  using Bits = typename Record::Word;
  static constexpr bool kKeys = Record::kPayloadBits == 0;
  static constexpr bool kTakesLanes = true;
  using Waiting = WaitingRecords<Record>;

  /// @param waiting  needed for put_lanes()
  TableSink(TileTable<Record>& table, const PixelRect& clip, BlockAges ages = {},
            Waiting* waiting = nullptr)
      : table_(&table),
        waiting_(waiting),
        ages_(ages),
        cells_(table.cells.data()),
        planes_(std::min(table.planes, static_cast<int>(Record::kAgeMax))),
        u0_(clip.u0),
        v0_(clip.v0) {}
  HWY_INLINE void begin(bool exit, std::uint32_t triangle, const PixelRect& box) {
    exit_ = exit;
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
  HWY_INLINE void begin_lanes(int row_begin, int row_end) { result_.add_rows(row_begin, row_end); }
  HWY_INLINE void make_room() {
    if (waiting_count_ + Waiting::kMore > Waiting::kRoom) insert_waiting();
  }
  /// Keeps fragments, which insert_waiting() inserts word by word: short rows, inserted as vectors,
  /// would wait for the words that the neighbouring triangle has just stored.
  template <class D, class V = hn::Vec<D>>
  HWY_INLINE void put_lanes(D d, V pixel, V depth, V surface, hn::Mask<D> covered) {
    hn::StoreU(hn::Compress(pixel, covered), d, waiting_->pixels + waiting_count_);
    if constexpr (kKeys) {
      const auto nearest =
          hn::Sub(hn::Set(d, Record::kAgeUnit + kValueMask<Record>), hn::ShiftRight<31>(surface));
      hn::StoreU(hn::Compress(hn::Sub(nearest, hn::ShiftLeft<1>(depth)), covered), d,
                 waiting_->records + waiting_count_);
    } else {
      const hn::RebindToUnsigned<LaneF64> d64;
      const auto items =
          pack_items(d64, hn::Compress(depth, covered), hn::Compress(surface, covered));
      hn::StoreU(hn::Sub(hn::Set(d64, Record::kAgeUnit + kValueMask<Record>), items), d64,
                 waiting_->records + waiting_count_);
    }
    waiting_count_ += hn::CountTrue(d, covered);
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
        const auto next = hn::Eq(hn::LoadU(d32, pixels.data() + i), hn::Iota(d32, pixel));
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
    if (waiting_count_ > 0) insert_waiting();
    // The first two planes are not watched: the bound may be 2 where the tile is one layer deep.
    const int first = result_.fragments > 0 ? std::min(planes_, 2) : 0;
    table_->oldest = std::max({table_->oldest, oldest_, first});
    return result_;
  }

 private:
  /// Inserts what put_lanes() kept.
  HWY_INLINE void insert_waiting() {
    result_.fragments += waiting_count_;
    oldest_ = std::max(oldest_, insert_each(*table_, waiting_->pixels, waiting_->records,
                                            waiting_count_, planes_));
    waiting_count_ = 0;
  }
  /// @return the largest age beyond the second plane. Static, so that the sink's members may stay
  /// in registers.
  static HWY_NOINLINE int insert_each(TileTable<Record>& table, const std::uint32_t* pixels,
                                      const Bits* records, std::size_t count, int planes) {
    if (planes < 2) {
      for (std::size_t i = 0; i < count; ++i) table.insert(pixels[i], records[i]);
      return 0;
    }
    int oldest = 0;
    Bits* const cells = table.cells.data();
    const auto exchange = [](Bits& cell, Bits record) {  // see insert()
      const Bits less = std::min(cell, record);
      cell = std::max(cell, record);
      return less != 0 ? less + Record::kAgeUnit : less;
    };
    for (std::size_t i = 0; i < count; ++i) {
      Bits* cell = cells + pixels[i];
      // Both are loaded before one is stored: their addresses agree in the bits by which a
      // processor guesses that a load needs what a store writes.
      Bits first = cell[0], second = cell[kTilePixels];
      Bits carry = exchange(second, exchange(first, records[i]));
      cell[0] = first;
      cell[kTilePixels] = second;
      if (HWY_LIKELY(carry == 0)) continue;
      int age = 2;
      while (carry != 0 && age < planes) {
        cell += kTilePixels;
        carry = exchange(cell[kTilePixels], carry);
        ++age;
      }
      oldest = std::max(oldest, age);
      if (carry != 0) overflow_one(table, pixels[i], carry, BlockAges{});
    }
    return oldest;
  }
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
    return static_cast<std::size_t>((v - v0_) * kTileSide + (u - u0_));
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
    Bits* HWY_RESTRICT cell = cells_ + pixel;
    const auto exchange = [&] {  // the larger stays, the smaller is one older
      const auto old = hn::LoadU(d, cell);
      hn::StoreU(hn::Max(old, carry), d, cell);
      const auto less = hn::Min(old, carry);
      const auto left = hn::Ne(less, hn::Zero(d));
      carry = hn::Add(less, hn::IfThenElseZero(left, step));
      cell += kTilePixels;
      return left;
    };
    int age = 0;
    if (planes_ >= 2) {
      // Which of the first two planes a row ends in cannot be predicted: both are always done.
      exchange();
      if (hn::AllFalse(d, exchange())) return 2;
      age = 2;
    }
    while (age < planes_) {
      ++age;
      if (hn::AllFalse(d, exchange())) {
        oldest_ = std::max(oldest_, age);
        return age;
      }
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
  Waiting* waiting_;
  std::size_t waiting_count_ = 0;
  BlockAges ages_;
  Bits* cells_;
  int planes_, oldest_ = 0;
  int u0_, v0_;
  Bits nearest_ = 0;
  std::uint32_t triangle_ = 0;
  bool exit_ = false;
  TileRasterResult result_;
};

/// Appends covered pixels to the tile's log.
/// @tparam in_order  triangle by triangle
template <class Record, bool in_order>
class LogSink {
 public:
  static constexpr bool kTakesLanes = !in_order;
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
  HWY_INLINE void begin_lanes(int row_begin, int row_end) { result_.add_rows(row_begin, row_end); }
  HWY_INLINE void make_room() { reserve(SetupBatch::kLaneSide * kMaxLanes); }
  template <class D, class V = hn::Vec<D>>
  HWY_INLINE void put_lanes(D d, V pixel, V depth, V surface, hn::Mask<D> covered) {
    hn::StoreU(hn::Compress(pixel, covered), d, pixels_ + count_);
    if constexpr (Record::kPayloadBits == 0) {
      const auto key = hn::Or(hn::ShiftLeft<1>(depth), hn::ShiftRight<31>(surface));
      hn::StoreU(hn::Compress(key, covered), d, keys_ + count_);
    } else {
      const hn::RebindToUnsigned<LaneF64> d64;
      hn::StoreU(pack_items(d64, hn::Compress(depth, covered), hn::Compress(surface, covered)), d64,
                 &keys_[count_].bits);
    }
    count_ += hn::CountTrue(d, covered);
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
    const auto pixel = static_cast<std::uint32_t>((v - clip_.v0) * kTileSide + (u - clip_.u0));
    for (std::size_t i = 0; i < columns; i += hn::Lanes(d)) {
      const auto lifted = hn::Load(d, words + i);
      const auto covered = hn::Ne(lifted, hn::Zero(d));
      const std::size_t found = hn::CountTrue(d, covered);
      // Whole vectors are stored: to store a compressed part takes some processors 100 cycles.
      const auto pixels = hn::Iota(d, pixel + static_cast<std::uint32_t>(i));
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
  WaitingRecords<Record> waiting;
  TableSink<Record> sink(table, input.clip, {}, &waiting);
  rasterize_triangles(input.mesh, input.target, input.triangles, input.clip, sink);
  return sink.finish();
}

template <class Record>
TileRasterResult raster_log(const TileInput& input, TileLog<Record>& log) {
  const auto raster = [&](auto sink) {
    rasterize_triangles(input.mesh, input.target, input.triangles, input.clip, sink);
    return sink.finish();
  };
  return input.in_order ? raster(LogSink<Record, true>(log, input.clip))
                        : raster(LogSink<Record, false>(log, input.clip));
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
