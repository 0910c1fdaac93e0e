#include "strata/voxelize/checksum.h"

#include <algorithm>
#include <climits>
#include <iterator>
#include <span>
#include <utility>

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

/// Faces between two rows of voxels.
std::uint64_t faces_between(std::span<const BoundaryArea::Seam::Run> a,
                            std::span<const BoundaryArea::Seam::Run> b) {
  std::uint64_t faces = 0;
  std::vector<Interval> columns[2];
  while (!a.empty() || !b.empty()) {
    const int u =
        std::min(a.empty() ? INT_MAX : int{a.front().u}, b.empty() ? INT_MAX : int{b.front().u});
    for (auto* row : {&a, &b}) {
      std::vector<Interval>& column = columns[row == &a ? 0 : 1];
      column.clear();
      for (; !row->empty() && row->front().u == u; *row = row->subspan(1)) {
        column.push_back(row->front().interval);
      }
    }
    faces += difference(columns[0], columns[1]);
  }
  return faces;
}

}  // namespace

BoundaryArea::BoundaryArea(const VoxelGrid& grid, Axis axis)
    : grid_(grid),
      frame_(axis),
      last_offsets_(static_cast<std::size_t>(grid.dims[frame_.u]) + 1, 0) {}

void BoundaryArea::add(const VoxelIntervals& slab, const Execution& execution) {
  const int columns = slab.columns();
  const bool follows = slab.v_begin() == next_v_;
  if (!follows) end_part();
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
        const bool counted = follows || v > slab.v_begin();
        if (counted && (!here.empty() || !above.empty())) sum.v += difference(above, here);
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
  if (!follows) begin_part(slab);
  std::vector<Interval> items;
  const bool last = slab.v_end() == grid_.dims[frame_.v];
  for (int u = 0; u < columns; ++u) {
    const Column here = slab.column(u, slab.v_end() - 1);
    if (last) faces_[frame_.v] += length(here);
    items.insert(items.end(), here.begin(), here.end());
    last_offsets_[static_cast<std::size_t>(u) + 1] = static_cast<std::uint32_t>(items.size());
  }
  last_items_ = std::move(items);
  next_v_ = slab.v_end();
}

/// The last row is that before a gap.
void BoundaryArea::end_part() {
  if (next_v_ == 0 || next_v_ == grid_.dims[frame_.v]) return;
  Seam seam{next_v_ - 1, false, {}};
  for (std::size_t u = 0; u + 1 < last_offsets_.size(); ++u) {
    for (std::uint32_t i = last_offsets_[u]; i < last_offsets_[u + 1]; ++i) {
      seam.runs.push_back({static_cast<std::uint16_t>(u), last_items_[i]});
    }
  }
  seams_.push_back(std::move(seam));
}

void BoundaryArea::begin_part(const VoxelIntervals& slab) {
  Seam seam{slab.v_begin(), true, {}};
  for (int u = 0; u < slab.columns(); ++u) {
    for (const Interval& interval : slab.column(u, slab.v_begin())) {
      seam.runs.push_back({static_cast<std::uint16_t>(u), interval});
    }
  }
  seams_.push_back(std::move(seam));
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
