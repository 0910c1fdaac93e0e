#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "hashbuffer/tile_store.h"
#include "strata/hashbuffer/offsets.h"
#include "transparency/lists/list_bytes.h"
#include "transparency/stream/tile_stream.h"

namespace strata::transparency {

/// The HA-buffer of a tile (strata/hashbuffer/table_law.h) with the maximum ages of its blocks of
/// 8 x 8 pixels. Its memory stays from tile to tile; clear() ends a tile.
template <class Record>
class TileHash {
 public:
  using Bits = typename Record::Word;

  /// An empty table of `cells` cells, at least one a pixel.
  void begin(const TileStream& stream, std::uint64_t cells, OffsetKind kind, std::uint64_t seed) {
    width_ = static_cast<std::uint32_t>(stream.width());
    height_ = static_cast<std::uint32_t>(stream.height());
    inverse_width_ = (kOne + width_ - 1) / width_;
    if (table_.cells.size() < cells + table_.kPadding) {
      table_.cells.resize(cells + cells / 4 + table_.kPadding, Bits{0});
    }
    table_.size = cells;
    const std::uint64_t pixels = stream.pixel_count();
    if (kind == OffsetKind::kFarthestPoint) {
      table_.offsets = farthest_points(pixels, cells, seed);
    } else {
      const std::uint64_t tile = static_cast<std::uint64_t>(stream.rect().v0) << 32 |
                                 static_cast<std::uint64_t>(stream.rect().u0);
      table_.offsets = offsets_of(kind, pixels, cells, seed ^ tile * 0x9e3779b97f4a7c15u);
    }
    table_.age_limit = static_cast<unsigned>(table_.offsets.size()) - 1;
    table_.planes = 0;
    if (kind == OffsetKind::kPlaneFirst && pixels == kTilePixels) {
      table_.planes = static_cast<int>(std::min<std::uint64_t>(cells / pixels, table_.age_limit));
    }
    max_ages_.fill(0);
  }

  /// Inserts a fragment. @param stored  called with (pixel, age) when a cell takes a record
  template <class Concurrency, class Stored>
  void insert(std::uint32_t pixel, DepthItem item, Stored&& stored) {
    table_.template insert<Concurrency>(key(pixel), Record::pack(1, item.depth(), item.payload()),
                                        [&](std::uint64_t at, unsigned age) {
                                          std::uint16_t& most =
                                              max_ages_[block(static_cast<std::uint32_t>(at))];
                                          most = std::max(most, static_cast<std::uint16_t>(age));
                                          stored();
                                        });
  }

  /// Inserts the fragments of a geometry pass.
  template <class Concurrency, class Stored>
  void insert_all(TileStream& stream, Stored&& stored) {
    if constexpr (std::is_same_v<Record, Record64> && !Concurrency::kAnyThread) {
      if (table_.planes > 0) {
        stream.count_pass(stream.size());
        return insert_into(stream.pixels(), stream.items(), table_, max_ages_.data());
      }
    }
    stream.pass(
        [&](std::uint32_t pixel, DepthItem item) { insert<Concurrency>(pixel, item, stored); });
  }

  /// Calls visit(cell, record, age) for the records of a pixel, front to back, while it returns
  /// true.
  template <class Visit>
  void for_each(std::uint32_t pixel, Visit&& visit) const {
    const std::uint32_t at = key(pixel);
    const unsigned last = max_ages_[block(at)];
    const auto go_on = [&](std::size_t cell, unsigned age) {
      const Bits record = table_.cells[cell];
      // A record further back would have displaced a younger one here.
      if (Record::age(record) < age) return false;
      return Record::age(record) != age || visit(cell, record, age);
    };
    const unsigned planes = std::min(last, static_cast<unsigned>(table_.planes));
    unsigned age = 1;
    for (; age <= planes; ++age) {
      if (!go_on(at + (age - 1) * std::size_t{kTilePixels}, age)) return;
    }
    for (; age <= last; ++age) {
      std::size_t cell = at + std::size_t{table_.offsets[age]};
      if (cell >= table_.size) cell -= table_.size;
      if (!go_on(cell, age)) return;
    }
  }

  /// Records that found no cell at any age.
  [[nodiscard]] std::uint64_t failures() const { return table_.failures; }
  /// Probes of such a record.
  [[nodiscard]] std::uint64_t age_limit() const { return table_.age_limit; }
  /// The sum of the ages of all records, which is the number of their probes.
  [[nodiscard]] std::uint64_t ages() const {
    std::uint64_t sum = 0;
    for (std::size_t cell = 0; cell < used(); ++cell) sum += Record::age(table_.cells[cell]);
    return sum;
  }

  /// Empties the table.
  void clear() {
    std::fill_n(table_.cells.begin(), used(), Bits{0});
    table_.oldest = 0;
    table_.mixed = false;
    table_.failures = 0;
  }
  /// The same. @return the records that it held
  std::uint64_t clear_and_count() {
    const auto held =
        used() - static_cast<std::size_t>(std::count(
                     table_.cells.begin(),
                     table_.cells.begin() + static_cast<std::ptrdiff_t>(used()), Bits{0}));
    clear();
    return held;
  }

  /// Bytes of the table and of the maximum ages; an age of 8 bits takes one.
  [[nodiscard]] std::uint64_t bytes() const {
    return table_.size * sizeof(Bits) + blocks() * kAgeBytes;
  }
  [[nodiscard]] std::uint64_t blocks() const { return list_bytes::blocks(width_, height_); }
  static constexpr std::uint64_t kAgeBytes = Record::kAgeBits > 8 ? 2 : 1;

 private:
  /// Cells that may hold records.
  [[nodiscard]] std::size_t used() const {
    if (table_.mixed || table_.planes == 0) return table_.size;
    return std::min(table_.size, static_cast<std::size_t>(table_.oldest) * kTilePixels);
  }

  static constexpr std::uint64_t kOne = 1 << 20;  ///< fixed point for divisions of pixels

  [[nodiscard]] std::vector<std::uint32_t> offsets_of(OffsetKind kind, std::uint64_t pixels,
                                                      std::uint64_t cells,
                                                      std::uint64_t seed) const {
    const auto offsets = make_offsets(
        kind,
        {.pixels = pixels, .cells = cells, .width = width_, .ages = Record::kAgeMax, .seed = seed});
    return {offsets.begin(), offsets.end()};
  }
  /// They take long to make: those of a somewhat smaller table serve, too.
  const std::vector<std::uint32_t>& farthest_points(std::uint64_t pixels, std::uint64_t cells,
                                                    std::uint64_t seed) {
    const std::uint64_t step = std::max<std::uint64_t>(1, pixels / 2);
    cells = std::max(pixels, cells / step * step);
    for (const Points& points : points_) {
      if (points.pixels == pixels && points.cells == cells && points.width == width_) {
        return points.offsets;
      }
    }
    points_.push_back(
        {pixels, cells, width_, offsets_of(OffsetKind::kFarthestPoint, pixels, cells, seed)});
    return points_.back().offsets;
  }

  /// Pixels are numbered without gaps.
  [[nodiscard]] std::uint32_t key(std::uint32_t pixel) const {
    return pixel - pixel / kTileSide * (kTileSide - width_);
  }
  [[nodiscard]] std::size_t block(std::uint32_t at) const {
    const auto v = static_cast<std::uint32_t>(at * inverse_width_ / kOne);
    return v / 8 * (kTileSide / 8) + (at - v * width_) / 8;
  }

  struct Points {
    std::uint64_t pixels = 0, cells = 0;
    std::uint32_t width = 0;
    std::vector<std::uint32_t> offsets;
  };

  TileTable<Record, 1> table_;
  std::vector<Points> points_;
  std::array<std::uint16_t, kTilePixels / 64> max_ages_{};
  std::uint32_t width_ = 0, height_ = 0;
  std::uint64_t inverse_width_ = 0;
};

}  // namespace strata::transparency
