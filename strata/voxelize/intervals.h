#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/result.h"

namespace strata {

/// A run of solid voxels along a column, both ends inclusive, so that 16 bits serve the largest
/// grid. [first:16 | last:16]
struct Interval {
  std::uint16_t first = 0;  ///< index of the first voxel
  std::uint16_t last = 0;   ///< index of the last voxel

  [[nodiscard]] int begin() const { return first; }              ///< the first voxel
  [[nodiscard]] int end() const { return last + 1; }             ///< one past the last voxel
  [[nodiscard]] int length() const { return last - first + 1; }  ///< voxels, at least 1
  /// Equal ends.
  friend bool operator==(const Interval&, const Interval&) = default;
};

/// The solid voxels of rows [v_begin, v_end) of a grid as disjoint, increasing, non-touching
/// intervals along `axis`. A column is (u, v) with the axes of AxisFrame(axis). Memory grows with
/// the surface, not with the volume. Storage is by tiles of kTileSide x kTileSide columns; a tile
/// without solid voxels holds nothing.
///
/// Intervals may have labels, such as the number of a solid. Intervals that touch then have
/// different labels.
class VoxelIntervals {
 public:
  static constexpr int kTileSide = 64;  ///< columns along a side of a tile
  /// Columns of a tile.
  static constexpr std::size_t kTileColumns = std::size_t{kTileSide} * kTileSide;

  VoxelIntervals();  ///< holds nothing
  /// Moves the tiles; what is left holds nothing.
  VoxelIntervals(VoxelIntervals&&) noexcept;
  /// Moves the tiles; what is left holds nothing.
  VoxelIntervals& operator=(VoxelIntervals&&) noexcept;
  ~VoxelIntervals();  ///< frees the tiles
  /// An empty slab. @pre v_begin is a multiple of kTileSide, 0 <= v_begin < v_end <= rows of grid
  VoxelIntervals(const VoxelGrid& grid, Axis axis, int v_begin, int v_end);
  /// The same in the memory of another one, of any grid, whose voxels are no longer needed.
  VoxelIntervals(const VoxelGrid& grid, Axis axis, int v_begin, int v_end, VoxelIntervals&& spent);
  /// All rows of the grid, empty.
  VoxelIntervals(const VoxelGrid& grid, Axis axis);

  [[nodiscard]] const VoxelGrid& grid() const { return grid_; }  ///< the whole grid
  [[nodiscard]] Axis axis() const { return axis_; }              ///< of the intervals
  [[nodiscard]] int columns() const { return columns_; }         ///< voxels along u
  [[nodiscard]] int v_begin() const { return v_begin_; }         ///< first row
  [[nodiscard]] int v_end() const { return v_end_; }             ///< one past the last row
  [[nodiscard]] int tiles_u() const { return tiles_u_; }         ///< tiles along u
  [[nodiscard]] int tiles_v() const { return tiles_v_; }         ///< tiles along v, of this slab

  /// The intervals of column (u, v). @pre 0 <= u < columns(), v_begin() <= v < v_end()
  [[nodiscard]] std::span<const Interval> column(int u, int v) const {
    const Tile& tile = tile_of(u, v);
    if (!tile.offsets) return {};
    const std::size_t local = local_of(u, v);
    return {tile.items + tile.offsets[local], tile.offsets[local + 1] - tile.offsets[local]};
  }
  /// The labels of the intervals of column (u, v); empty if none were given.
  [[nodiscard]] std::span<const std::uint32_t> column_labels(int u, int v) const {
    const Tile& tile = tile_of(u, v);
    if (!tile.labels) return {};
    const std::size_t local = local_of(u, v);
    return {tile.labels + tile.offsets[local], tile.offsets[local + 1] - tile.offsets[local]};
  }
  /// Whether voxel (i, j, k) is solid; false outside the grid and the slab. O(log of the column).
  [[nodiscard]] bool contains(int i, int j, int k) const { return label(i, j, k).has_value(); }
  /// The label of voxel (i, j, k), 1 where none was given; none where contains() is false. O(log of
  /// the column).
  [[nodiscard]] std::optional<std::uint32_t> label(int i, int j, int k) const;
  /// True when no column of tile (tu, tv) of this slab is solid anywhere: lets writers skip it.
  [[nodiscard]] bool tile_empty(int tu, int tv) const {
    return !tiles_[static_cast<std::size_t>(tv) * static_cast<std::size_t>(tiles_u_) +
                   static_cast<std::size_t>(tu)]
                .offsets;
  }

  /// The whole of tile (tu, tv) at once, for loops that column() would slow down: offsets as given
  /// to set_tile (kTileColumns + 1 of them, or none for an empty tile) and the intervals.
  struct TileView {
    std::span<const std::uint32_t> offsets;  ///< where the intervals of a column begin
    std::span<const Interval> items;         ///< the intervals, column by column
    std::span<const std::uint32_t> labels;   ///< one for each item, or none
    /// The label of an interval; 1 if there are none.
    [[nodiscard]] std::uint32_t label(std::size_t item) const {
      return labels.empty() ? 1 : labels[item];
    }
  };
  /// @pre 0 <= tu < tiles_u(), 0 <= tv < tiles_v(). Valid until the tile is set again.
  [[nodiscard]] TileView tile(int tu, int tv) const {
    const Tile& stored = tiles_[static_cast<std::size_t>(tv) * static_cast<std::size_t>(tiles_u_) +
                                static_cast<std::size_t>(tu)];
    if (stored.offsets == nullptr) return {};
    const std::size_t count = stored.offsets[kTileColumns];
    return {{stored.offsets, kTileColumns + 1},
            {stored.items, count},
            {stored.labels, stored.labels ? count : 0}};
  }

  /// Stores tile (tu, tv): `offsets` has kTileColumns + 1 entries, row by row (columns outside the
  /// grid are empty), `items` is offsets.back() long, and so is `labels` unless it is empty.
  /// Different tiles may be set by different threads at once. A tile that is set again keeps its
  /// former memory until all is freed.
  void set_tile(int tu, int tv, std::span<const std::uint32_t> offsets,
                std::span<const Interval> items, std::span<const std::uint32_t> labels = {});

  [[nodiscard]] std::uint64_t solid_voxels() const;  ///< sum of the lengths; O(intervals)
  /// Runs of solid voxels, whatever their labels are. O(intervals) where there are labels.
  [[nodiscard]] std::uint64_t interval_count() const;
  [[nodiscard]] bool has_labels() const;             ///< true if any interval has one
  [[nodiscard]] std::uint64_t memory_bytes() const;  ///< bytes held by the tiles

 private:
  class Arena;  // memory of the tiles
  struct Tile {
    const std::uint32_t* offsets = nullptr;
    const Interval* items = nullptr;
    const std::uint32_t* labels = nullptr;
  };
  [[nodiscard]] const Tile& tile_of(int u, int v) const {
    return tiles_[static_cast<std::size_t>((v - v_begin_) / kTileSide) *
                      static_cast<std::size_t>(tiles_u_) +
                  static_cast<std::size_t>(u / kTileSide)];
  }
  [[nodiscard]] std::size_t local_of(int u, int v) const {
    return static_cast<std::size_t>((v - v_begin_) % kTileSide) * kTileSide +
           static_cast<std::size_t>(u % kTileSide);
  }
  VoxelGrid grid_;
  Axis axis_ = Axis::kZ;
  int columns_ = 0, v_begin_ = 0, v_end_ = 0, tiles_u_ = 0, tiles_v_ = 0;
  std::vector<Tile> tiles_;
  std::unique_ptr<Arena> arena_;
};

/// Runs of solid voxels of a column: intervals that touch, of different labels, are one.
[[nodiscard]] inline std::size_t run_count(std::span<const Interval> column) {
  std::size_t count = column.size();
  for (std::size_t i = 1; i < column.size(); ++i) {
    if (column[i].begin() == column[i - 1].end()) --count;
  }
  return count;
}

/// Calls run(interval, label) for the intervals of column (u, v); the label is 1 where none is
/// given.
template <class Run>
void for_each_labelled(const VoxelIntervals& set, int u, int v, Run&& run) {
  const std::span<const Interval> column = set.column(u, v);
  const std::span<const std::uint32_t> labels = set.column_labels(u, v);
  for (std::size_t i = 0; i < column.size(); ++i) {
    run(column[i], labels.empty() ? std::uint32_t{1} : labels[i]);
  }
}

/// Calls run(first, last, label) for each run of solid voxels. `first` and `last` are the first and
/// the last voxel of the run and differ along set.axis() alone. Columns come in the order of v,
/// then u. The label is 1 where none is given.
template <class Run>
void for_each_run(const VoxelIntervals& set, Run&& run) {
  const AxisFrame frame(set.axis());
  glm::ivec3 first, last;
  for (int v = set.v_begin(); v < set.v_end(); ++v) {
    for (int u = 0; u < set.columns(); ++u) {
      first[frame.u] = last[frame.u] = u;
      first[frame.v] = last[frame.v] = v;
      for_each_labelled(set, u, v, [&](const Interval& interval, std::uint32_t label) {
        first[frame.w] = interval.first;
        last[frame.w] = interval.last;
        run(std::as_const(first), std::as_const(last), label);
      });
    }
  }
}

/// An array with a byte for each voxel of the grid: 1 where it is solid, else 0. Voxel (i, j, k) is
/// at i + dims.x * (j + dims.y * k). @return kLimit: execution.memory_limit or memory is exceeded
Result<std::vector<std::uint8_t>> to_dense(const VoxelIntervals& set,
                                           const Execution& execution = {});
/// The same with labels in place of ones.
Result<std::vector<std::uint32_t>> to_dense_labels(const VoxelIntervals& set,
                                                   const Execution& execution = {});

}  // namespace strata
