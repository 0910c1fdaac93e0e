#include "strata/voxelize/checksum.h"

#include <algorithm>
#include <span>

namespace strata {
namespace {

using Column = std::span<const Interval>;

std::uint64_t length(Column column) {
  std::uint64_t sum = 0;
  for (const Interval& interval : column) sum += static_cast<std::uint64_t>(interval.length());
  return sum;
}

/// Voxels that are in one column and not in the other.
std::uint64_t difference(Column a, Column b) {
  std::uint64_t common = 0;
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    const int begin = std::max(a[i].begin(), b[j].begin());
    const int end = std::min(a[i].end(), b[j].end());
    if (end > begin) common += static_cast<std::uint64_t>(end - begin);
    if (a[i].last < b[j].last) {
      ++i;
    } else {
      ++j;
    }
  }
  return length(a) + length(b) - 2 * common;
}

}  // namespace

BoundaryArea::BoundaryArea(const VoxelGrid& grid, Axis axis)
    : grid_(grid),
      frame_(axis),
      last_offsets_(static_cast<std::size_t>(grid.dims[frame_.u]) + 1, 0) {}

void BoundaryArea::add(const VoxelIntervals& slab, const Execution& execution) {
  const int columns = slab.columns();
  const auto before_slab = [this](int u) {
    const auto i = static_cast<std::size_t>(u);
    return Column(last_items_).subspan(last_offsets_[i], last_offsets_[i + 1] - last_offsets_[i]);
  };
  struct Faces {
    std::uint64_t u = 0, v = 0, w = 0;
  };
  constexpr int kSide = VoxelIntervals::kTileSide;
  std::vector<Faces> parts(static_cast<std::size_t>(slab.tiles_v()));
  parallel_for(execution, parts.size(), [&](std::size_t tile_row, int) {
    Faces sum;
    const int first = slab.v_begin() + static_cast<int>(tile_row) * kSide;
    for (int v = first; v < std::min(first + kSide, slab.v_end()); ++v) {
      Column left;
      for (int u = 0; u < columns; ++u) {
        const Column here = slab.column(u, v);
        const Column above = v > slab.v_begin() ? slab.column(u, v - 1) : before_slab(u);
        sum.w += 2 * run_count(here);
        if (!here.empty() || !left.empty()) sum.u += difference(left, here);
        if (!here.empty() || !above.empty()) sum.v += difference(above, here);
        left = here;
      }
      sum.u += length(left);
    }
    parts[tile_row] = sum;
  });
  for (const Faces& part : parts) {
    faces_[frame_.u] += part.u;
    faces_[frame_.v] += part.v;
    faces_[frame_.w] += part.w;
  }
  std::vector<Interval> items;
  const bool last = slab.v_end() == grid_.dims[frame_.v];
  for (int u = 0; u < columns; ++u) {
    const Column here = slab.column(u, slab.v_end() - 1);
    if (last) faces_[frame_.v] += length(here);
    items.insert(items.end(), here.begin(), here.end());
    last_offsets_[static_cast<std::size_t>(u) + 1] = static_cast<std::uint32_t>(items.size());
  }
  last_items_ = std::move(items);
}

double BoundaryArea::estimate() const {
  const glm::dvec3 s = grid_.voxel_size;
  return 2.0 / 3.0 *
         (static_cast<double>(faces_[0]) * s.y * s.z + static_cast<double>(faces_[1]) * s.x * s.z +
          static_cast<double>(faces_[2]) * s.x * s.y);
}

}  // namespace strata
