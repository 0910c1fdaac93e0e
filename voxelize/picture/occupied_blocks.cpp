#include "voxelize/picture/occupied_blocks.h"

#include <algorithm>
#include <bit>
#include <glm/common.hpp>
#include <limits>

namespace strata {
namespace {

/// Blocks along the longest side at most: 256^3 of them take 4 MB.
constexpr int kMostBlocks = 512;

}  // namespace

/// What is counted for the blocks above one block of columns; entry i is the change at block i.
struct OccupiedBlocks::Columns {
  std::vector<int> some, full;
  glm::ivec3 low{std::numeric_limits<int>::max()}, high{0};  ///< around all solid voxels so far
};

/// The blocks above columns [bu, bu + 1) x [bv, bv + 1) << shift_.
void OccupiedBlocks::add_columns(const VoxelIntervals& set, int bu, int bv, Columns& scratch) {
  const int side = 1 << shift_, rows = set.v_end() - set.v_begin();
  const int u_end = std::min((bu + 1) * side, set.columns()),
            v_end = std::min((bv + 1) * side, rows);
  bool any = false;
  for (int v = bv * side; v < v_end; ++v) {
    for (int u = bu * side; u < u_end; ++u) {
      const std::span<const Interval> runs = set.column(u, v + set.v_begin());
      if (runs.empty()) continue;
      scratch.low = glm::min(scratch.low, glm::ivec3(u, v, runs.front().begin()));
      scratch.high = glm::max(scratch.high, glm::ivec3(u + 1, v + 1, runs.back().end()));
      for (std::size_t i = 0; i < runs.size();) {
        const int begin = runs[i].begin();
        int end = runs[i].end();
        for (++i; i < runs.size() && runs[i].begin() == end; ++i) end = runs[i].end();
        any = true;
        ++scratch.some[static_cast<std::size_t>(begin >> shift_)];
        --scratch.some[static_cast<std::size_t>((end - 1) >> shift_) + 1];
        const int first = (begin + side - 1) >> shift_, last = end >> shift_;  // whole blocks
        if (first >= last) continue;
        ++scratch.full[static_cast<std::size_t>(first)];
        --scratch.full[static_cast<std::size_t>(last)];
      }
    }
  }
  if (!any) return;
  int some = 0, full = 0;
  for (std::size_t bw = 0; bw + 1 < scratch.some.size(); ++bw) {
    some += scratch.some[bw];
    full += scratch.full[bw];
    if (some == 0) continue;
    Brick& brick = bricks_[index(bu >> 2, bv >> 2, static_cast<int>(bw >> 2))];
    const std::uint64_t one = std::uint64_t{1} << bit(bu & 3, bv & 3, static_cast<int>(bw & 3));
    brick.some |= one;
    if (full == side * side) brick.full |= one;
  }
  std::fill(scratch.some.begin(), scratch.some.end(), 0);
  std::fill(scratch.full.begin(), scratch.full.end(), 0);
}

Result<OccupiedBlocks> OccupiedBlocks::make(const VoxelIntervals& set, const Execution& execution) {
  const AxisFrame frame(set.axis());
  const glm::ivec3 sides(set.columns(), set.v_end() - set.v_begin(), set.grid().dims[frame.w]);
  OccupiedBlocks made;
  if (sides.x < 1 || sides.y < 1) return made;
  while ((kMostBlocks << made.shift_) < std::max({sides.x, sides.y, sides.z})) ++made.shift_;
  const int brick = 1 << made.brick_shift();
  made.bricks_a_side_ = (sides + brick - 1) / brick;
  const glm::ivec3& n = made.bricks_a_side_;
  const std::size_t count =
      static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z);
  if (execution.memory_limit != 0 && count * sizeof(Brick) > execution.memory_limit) {
    return fail(ErrorCode::kLimit,
                "a picture of {} x {} x {} voxels needs {} bytes; the limit is {}", sides.x,
                sides.y, sides.z, count * sizeof(Brick), execution.memory_limit);
  }
  made.bricks_.resize(count);
  const auto workers = static_cast<std::size_t>(execution.thread_count());
  std::vector<Columns> scratch(workers);
  for (Columns& one : scratch) {
    one.some.assign(static_cast<std::size_t>(n.z) * 4 + 2, 0);
    one.full = one.some;
  }
  const int side = 1 << made.shift_;
  parallel_for(execution, static_cast<std::size_t>(n.y), [&](std::size_t row, int worker) {
    for (int bv = static_cast<int>(row) * 4; bv < static_cast<int>(row) * 4 + 4; ++bv) {
      for (int bu = 0; bv * side < sides.y && bu * side < sides.x; ++bu) {
        // A block of at most a tile lies in one tile.
        if (side <= VoxelIntervals::kTileSide &&
            set.tile_empty(bu * side / VoxelIntervals::kTileSide,
                           bv * side / VoxelIntervals::kTileSide)) {
          continue;
        }
        made.add_columns(set, bu, bv, scratch[static_cast<std::size_t>(worker)]);
      }
    }
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  Box box{glm::ivec3(std::numeric_limits<int>::max()), glm::ivec3(0)};
  for (const Columns& one : scratch) {
    box.low = glm::min(box.low, one.low);
    box.high = glm::max(box.high, one.high);
  }
  if (box.low.x < box.high.x) made.box_ = box;
  return made;
}

}  // namespace strata
