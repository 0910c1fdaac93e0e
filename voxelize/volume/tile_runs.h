#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "strata/voxelize/intervals.h"

namespace strata {

inline constexpr int kTileSide = VoxelIntervals::kTileSide;

/// Collects runs of the 64 x 64 columns of a tile, in any order, and stores them as intervals. One
/// at a time for each thread; it may be used again. (Internal to voxelize/.)
class TileRuns {
 public:
  /// Voxels first..last of the column, both inclusive. A voxel that is given twice has the label of
  /// the last time.
  /// @param local  v % 64 * 64 + u % 64
  void add(unsigned local, int first, int last, std::uint32_t label) {
    if (!pieces_.empty()) {
      Piece& back = pieces_.back();
      if (back.local == local && back.label == label && back.last + 1 == first) {
        back.last = static_cast<std::uint16_t>(last);
        return;
      }
    }
    pieces_.push_back({static_cast<std::uint16_t>(local), static_cast<std::uint16_t>(first),
                       static_cast<std::uint16_t>(last), label});
  }
  [[nodiscard]] bool empty() const { return pieces_.empty(); }
  [[nodiscard]] std::size_t pieces() const { return pieces_.size(); }
  /// Bytes that the pieces take here.
  [[nodiscard]] std::uint64_t memory_bytes() const { return pieces_.capacity() * sizeof(Piece); }

  /// Stores them as tile (tu, tv) and forgets them. @param labels  store these, too
  void store(VoxelIntervals& set, int tu, int tv, bool labels);

 private:
  struct Piece {
    std::uint16_t local = 0, first = 0, last = 0;
    std::uint32_t label = 0;
  };
  void sort_by_column();
  void take_column(std::size_t begin, std::size_t end, bool labels);
  void flatten(std::size_t begin, std::size_t end);

  std::vector<Piece> pieces_, sorted_;
  std::vector<std::uint32_t> offsets_, labels_;
  std::vector<Interval> items_;
};

}  // namespace strata
