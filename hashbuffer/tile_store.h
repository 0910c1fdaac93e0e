#pragma once

// The memory of a TileBuilder, shared by its SIMD part and its policy. Private to hashbuffer/.

#include <algorithm>
#include <cstdint>
#include <new>
#include <span>
#include <vector>

#include "hashbuffer/tile_builder.h"
#include "strata/hashbuffer/depth_list_store.h"
#include "strata/hashbuffer/table_law.h"

namespace strata {

/// Memory that begins with a cache line, so that few vectors of cells straddle two.
template <class T>
struct LineAllocator {
  using value_type = T;
  static constexpr std::align_val_t kLine{64};
  LineAllocator() = default;
  template <class Other>
  explicit LineAllocator(const LineAllocator<Other>&) {}
  T* allocate(std::size_t count) {
    return static_cast<T*>(::operator new(count * sizeof(T), kLine));
  }
  void deallocate(T* memory, std::size_t) { ::operator delete(memory, kLine); }
  friend bool operator==(const LineAllocator&, const LineAllocator&) { return true; }
};

/// The HA-buffer of one tile, with plain stores; see strata/hashbuffer/table_law.h.
/// @tparam sides  lists a pixel: of keys there are two, where rays enter and then where they leave,
/// so that the first crossings of both kinds find their cells at once
template <class Record, std::size_t sides = kSides<TileKey<Record>>>
struct TileTable {
  using Bits = typename Record::Word;
  /// Cells behind the table that blocks of pixels may touch, without changing them.
  static constexpr std::size_t kPadding = 8 * kTileSide;

  static constexpr std::size_t kLists = sides * kTilePixels;

  std::vector<Bits, LineAllocator<Bits>> cells;
  std::size_t size = 0;                ///< cells of the table
  int planes = 0;                      ///< ages 1..planes have the offsets (age - 1) * kLists
  std::vector<std::uint32_t> offsets;  ///< by age, for ages beyond the planes
  int oldest = 0;                      ///< largest age stored since the last clear
  bool mixed = false;                  ///< a record went beyond the planes
  std::uint64_t failures = 0;          ///< records that found no cell: age field or table exhausted
  unsigned age_limit = Record::kAgeMax;  ///< ages that have offsets

  [[nodiscard]] std::size_t offset(int age) const {
    return age <= planes ? static_cast<std::size_t>(age - 1) * kLists
                         : offsets[static_cast<std::size_t>(age)];
  }

  struct Ignore {
    void operator()(std::uint64_t, unsigned) const {}
  };

  /// Inserts a record, whose age is the first to be tried, into the list `pixel`.
  /// @tparam Concurrency  the kind of maximum @param stored  called with the pixel and the age of
  /// each record that a cell takes, evicted ones included
  template <class Concurrency = Exclusive, class Stored = Ignore>
  void insert(std::size_t pixel, Bits record, Stored&& stored = {}) {
    detail::Flight<Record> flight{record, pixel, Record::age(record)};
    for (;;) {
      const int age = static_cast<int>(flight.age);
      mixed = mixed || age > planes;
      Bits found;
      const std::uint64_t proposer = flight.pixel;
      const detail::Outcome outcome = detail::propose<Record, Concurrency>(
          flight, cells.data(), size, [this](unsigned of) { return offset(static_cast<int>(of)); },
          found);
      if (outcome != detail::Outcome::kLost) {
        oldest = std::max(oldest, age);
        stored(proposer, static_cast<unsigned>(age));
      }
      if (outcome == detail::Outcome::kPlaced) return;
      if (!flight.grow_older(age_limit)) {
        ++failures;
        return;
      }
    }
  }
};

/// The count/scan store of one tile: fragments in order of arrival, sorted when all are known.
template <class Record>
struct TileLog {
  using Key = TileKey<Record>;
  static constexpr std::size_t kPadding = 64;

  std::vector<Key> keys;
  std::vector<std::uint32_t> pixels;
  std::size_t count = 0;

  void reserve(std::size_t more) {
    if (count + more + kPadding > keys.size()) {
      keys.resize((count + more + kPadding) * 2);
      pixels.resize(keys.size());
    }
  }
};

/// What the SIMD part reports of a tile.
struct TileRasterResult {
  std::uint64_t fragments = 0;
  int row_begin = kTileSide, row_end = 0;
  void add_rows(int begin, int end) {
    row_begin = std::min(row_begin, begin);
    row_end = std::max(row_end, end);
  }
};

struct TileInput {
  const LatticeMesh& mesh;
  const RasterTarget& target;
  std::span<const std::uint32_t> triangles;
  PixelRect clip;         ///< the tile's pixels within the target
  bool in_order = false;  ///< a log gets fragments by the number of their triangle
};

TileRasterResult raster_into(const TileInput& input, TileTable<Record32>& table);
TileRasterResult raster_into(const TileInput& input, TileTable<Record64>& table);
/// Inserts fragments one by one into a table with planes; neighbours that follow each other at
/// once.
/// @param ages  of the 8 x 8 blocks of 8 x 8 pixels: raised to the largest ages there, or higher
void insert_into(std::span<const std::uint32_t> pixels, std::span<const DepthItem> items,
                 TileTable<Record64>& table, std::uint16_t* ages);
TileRasterResult raster_into(const TileInput& input, TileLog<Record32>& log);
TileRasterResult raster_into(const TileInput& input, TileLog<Record64>& log);

}  // namespace strata
