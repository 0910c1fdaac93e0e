#include "strata/voxelize/area/boundary_area.h"

#include <algorithm>
#include <bit>
#include <iterator>
#include <numeric>
#include <span>
#include <utility>

#include "strata/raster/raster_target.h"
#include "voxelize/area/shared_voxels.h"

namespace strata {
namespace {

using Run = BoundaryArea::Seam::Run;

/// [last:16 | first:16] each.
std::span<const std::uint32_t> interval_words(std::span<const Interval> intervals) {
  static_assert(std::endian::native == std::endian::little && sizeof(Interval) == 4);
  return {reinterpret_cast<const std::uint32_t*>(intervals.data()), intervals.size()};
}

std::vector<Run> runs_of_row(const VoxelIntervals& slab, int v) {
  std::vector<Run> runs;
  for (int u = 0; u < slab.columns(); ++u) {
    for (const Interval& interval : slab.column(u, v)) {
      runs.push_back({static_cast<std::uint16_t>(u), interval});
    }
  }
  return runs;
}

std::uint64_t count_voxels(std::span<const Run> row) {
  std::uint64_t sum = 0;
  for (const Run& run : row) sum += static_cast<std::uint64_t>(run.interval.length());
  return sum;
}

/// Faces between two rows of voxels.
std::uint64_t faces_between(std::span<const Run> a, std::span<const Run> b) {
  std::uint64_t faces = count_voxels(a) + count_voxels(b);
  std::vector<Interval> columns[2];
  while (!a.empty() && !b.empty()) {
    const int u = std::min(a.front().u, b.front().u);
    for (auto* row : {&a, &b}) {
      std::vector<Interval>& column = columns[row == &a ? 0 : 1];
      column.clear();
      for (; !row->empty() && row->front().u == u; *row = row->subspan(1)) {
        column.push_back(row->front().interval);
      }
    }
    faces -= 2 * shared_voxels(interval_words(columns[0]), interval_words(columns[1]));
  }
  return faces;
}

}  // namespace

BoundaryArea::BoundaryArea(const VoxelGrid& grid, Axis axis) : grid_(grid), frame_(axis) {}

// Between neighbours lie the voxels of both, less twice those that they share. Each voxel is in two
// pairs of neighbours, those outside of the grid among them.
void BoundaryArea::add(const VoxelIntervals& slab, const Execution& execution) {
  if (slab.v_begin() == next_v_) {
    faces_[frame_.v] += count_voxels(last_row_);
  } else {
    end_part();
    seams_.push_back({slab.v_begin(), true, runs_of_row(slab, slab.v_begin())});
    faces_[frame_.v] -= count_voxels(seams_.back().runs);
    last_row_.clear();
  }
  // The row before the slab, as that of tiles.
  std::vector<Interval> last_items;
  std::vector<std::uint32_t> last_offsets(static_cast<std::size_t>(slab.tiles_u()) * kTileSide + 1);
  for (const Run& run : last_row_) {
    last_items.push_back(run.interval);
    ++last_offsets[run.u + 1u];
  }
  std::partial_sum(last_offsets.begin(), last_offsets.end(), last_offsets.begin());
  const auto row_above = [&](int tu, int tv) -> ColumnRow {
    if (tv == 0) return {last_offsets.data() + tu * kTileSide, interval_words(last_items).data()};
    const VoxelIntervals::TileView tile = slab.tile(tu, tv - 1);
    if (tile.offsets.empty()) return {};
    return {tile.offsets.data() + kTilePixels - kTileSide, interval_words(tile.items).data()};
  };
  struct Part {
    std::uint64_t voxels = 0;
    NeighbourVoxels shared;
  };
  std::vector<Part> parts(static_cast<std::size_t>(slab.tiles_v()));
  parallel_for(execution, parts.size(), [&](std::size_t tile_row, int) {
    const int tv = static_cast<int>(tile_row), first = slab.v_begin() + tv * kTileSide;
    Part sum;
    for (int tu = 0; tu < slab.tiles_u(); ++tu) {
      const VoxelIntervals::TileView tile = slab.tile(tu, tv);
      if (tile.items.empty()) continue;
      for (const Interval& item : tile.items) {
        sum.voxels += static_cast<std::uint64_t>(item.length());
      }
      const NeighbourVoxels inner = neighbour_voxels(
          {tile.offsets.data(), interval_words(tile.items).data()}, row_above(tu, tv));
      sum.shared.u += inner.u;
      sum.shared.v += inner.v;
      if (tu == 0 || slab.tile_empty(tu - 1, tv)) continue;
      for (int v = first; v < std::min(first + kTileSide, slab.v_end()); ++v) {
        sum.shared.u += shared_voxels(interval_words(slab.column(tu * kTileSide - 1, v)),
                                      interval_words(slab.column(tu * kTileSide, v)));
      }
    }
    parts[tile_row] = sum;
  });
  for (const Part& part : parts) {
    faces_[frame_.u] += 2 * (part.voxels - part.shared.u);
    faces_[frame_.v] += 2 * (part.voxels - part.shared.v);
  }
  faces_[frame_.w] += 2 * slab.interval_count();
  last_row_ = runs_of_row(slab, slab.v_end() - 1);
  next_v_ = slab.v_end();
  if (next_v_ < grid_.dims[frame_.v]) faces_[frame_.v] -= count_voxels(last_row_);
}

/// The last row is that before a gap.
void BoundaryArea::end_part() {
  if (next_v_ == 0 || next_v_ == grid_.dims[frame_.v]) return;
  seams_.push_back({next_v_ - 1, false, std::move(last_row_)});
}

std::vector<BoundaryArea::Seam> BoundaryArea::take_seams() {
  end_part();
  next_v_ = grid_.dims[frame_.v];
  return std::exchange(seams_, {});
}

void BoundaryArea::add(const std::uint64_t (&faces)[3], std::vector<Seam> seams) {
  for (int axis = 0; axis < 3; ++axis) faces_[axis] += faces[axis];
  std::move(seams.begin(), seams.end(), std::back_inserter(seams_));
  std::sort(seams_.begin(), seams_.end(), [](const Seam& a, const Seam& b) {
    return a.v != b.v ? a.v < b.v : a.first && !b.first;
  });
  std::vector<Seam> open;
  for (Seam& seam : seams_) {
    if (seam.first && !open.empty() && !open.back().first && open.back().v + 1 == seam.v) {
      faces_[frame_.v] += faces_between(open.back().runs, seam.runs);
      open.pop_back();
    } else {
      open.push_back(std::move(seam));
    }
  }
  seams_ = std::move(open);
}

double BoundaryArea::estimate() const {
  const glm::dvec3 s = grid_.voxel_size;
  return 2.0 / 3.0 *
         (static_cast<double>(faces_[0]) * s.y * s.z + static_cast<double>(faces_[1]) * s.x * s.z +
          static_cast<double>(faces_[2]) * s.x * s.y);
}

}  // namespace strata
