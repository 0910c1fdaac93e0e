#pragma once

#include <cstdint>
#include <span>

// Which voxels columns have in common. Private to voxelize/area. Intervals of a column are disjoint
// and increase: [last:16 | first:16].

namespace strata {

/// Voxels that are in both columns.
[[nodiscard]] std::uint64_t shared_voxels(std::span<const std::uint32_t> a,
                                          std::span<const std::uint32_t> b);

/// kTileSide columns side by side.
struct ColumnRow {
  const std::uint32_t* offsets = nullptr;  ///< kTileSide + 1; null where all columns are empty
  const std::uint32_t* intervals = nullptr;
};

/// Voxels of a tile that are in a column and in its neighbour.
struct NeighbourVoxels {
  std::uint64_t u = 0;  ///< in neighbours of a row, both in the tile
  std::uint64_t v = 0;  ///< in neighbours of two rows, among them `above` and the first
};
/// @param tile  its kTileSide rows: kTileSide * kTileSide + 1 offsets
[[nodiscard]] NeighbourVoxels neighbour_voxels(const ColumnRow& tile, const ColumnRow& above);

}  // namespace strata
