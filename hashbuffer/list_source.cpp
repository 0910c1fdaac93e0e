#include "strata/hashbuffer/build_ldi.h"

#include <algorithm>
#include <utility>

namespace strata {

ListSourceOrCpu::ListSourceOrCpu(ListSource& source, Execution execution,
                                 std::function<void(const Error&)> on_failure)
    : source_(&source), execution_(std::move(execution)), on_failure_(std::move(on_failure)) {
  execution_.progress = {};
}

void ListSourceOrCpu::give_up(const Error& error) {
  source_ = nullptr;
  on_failure_(error);
}

Result<void> ListSourceOrCpu::set_mesh(const LatticeMesh& mesh) {
  mesh_ = &mesh;
  filter_ = nullptr;
  if (source_ == nullptr) return {};
  if (auto done = source_->set_mesh(mesh); !done) give_up(done.error());
  return {};
}

bool ListSourceOrCpu::use_filter(const TileListFilter& filter) {
  filter_ = source_ != nullptr && source_->use_filter(filter) ? &filter : nullptr;
  return filter_ != nullptr;
}

int ListSourceOrCpu::rows_at_once(const RasterTarget& target) const {
  constexpr int kRowsOfTheCpu = 16 * kTileSide;
  return source_ != nullptr ? source_->rows_at_once(target) : kRowsOfTheCpu;
}

Result<LayeredDepthImage> ListSourceOrCpu::lists(const RasterTarget& target, int v_begin,
                                                 int v_end) {
  if (source_ != nullptr) {
    auto rows = source_->lists(target, v_begin, v_end);
    crossings_ = source_->crossings();
    if (rows || rows.error().code == ErrorCode::kCancelled) return rows;
    give_up(rows.error());
  }
  // A screen that begins at another row sees the mesh moved by whole pixels.
  LatticeMesh moved{mesh_->vertices, mesh_->triangles};
  const AxisFrame frame(target.axis);
  for (glm::ivec3& p : moved.vertices) p[frame.v] -= v_begin * kLatticeSteps;
  RasterTarget rows = target;
  rows.height = v_end - v_begin;
  auto made = build_ldi(moved, rows, {}, execution_);
  if (!made) return made;
  crossings_ = made->items.size();
  return filter_ == nullptr ? std::move(made) : filter_lists(*made, *filter_, execution_);
}

TileLists<DepthItem> TileCutter::cut(const LayeredDepthImage& rows, int v_begin, int tu, int tv) {
  offsets_.assign(kTilePixels + 1, 0);
  keys_.clear();
  TileLists<DepthItem> lists;
  const int first = tv * kTileSide - v_begin, u0 = tu * kTileSide;
  const int height = std::min(kTileSide, rows.height - first);
  const auto width = static_cast<std::size_t>(std::min(kTileSide, rows.width - u0));
  lists.row_begin = kTileSide;
  std::size_t pixel = 0;
  for (int row = 0; row < kTileSide; ++row) {
    const std::size_t before = keys_.size();
    const std::size_t end = pixel + kTileSide;
    if (row < height) {
      const std::size_t at =
          static_cast<std::size_t>(first + row) * static_cast<std::size_t>(rows.width) +
          static_cast<std::size_t>(u0);
      const std::uint64_t begin = rows.offsets[at];
      keys_.insert(keys_.end(), rows.items.begin() + static_cast<std::ptrdiff_t>(begin),
                   rows.items.begin() + static_cast<std::ptrdiff_t>(rows.offsets[at + width]));
      for (std::size_t u = 0; u < width; ++u) {
        offsets_[pixel++] = static_cast<std::uint32_t>(before + (rows.offsets[at + u] - begin));
      }
    }
    for (; pixel < end; ++pixel) offsets_[pixel] = static_cast<std::uint32_t>(keys_.size());
    if (keys_.size() > before) {
      lists.row_begin = std::min(lists.row_begin, row);
      lists.row_end = row + 1;
    }
  }
  offsets_[kTilePixels] = static_cast<std::uint32_t>(keys_.size());
  lists.row_begin = std::min(lists.row_begin, lists.row_end);
  lists.fragments = keys_.size();
  lists.offsets = offsets_.data();
  lists.keys = keys_.data();
  return lists;
}

}  // namespace strata
