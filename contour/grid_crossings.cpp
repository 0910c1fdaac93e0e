#include "contour/grid_crossings.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <utility>

#include "hashbuffer/tile_builder.h"
#include "strata/hashbuffer/build_ldi.h"

namespace strata::contouring {
namespace {

/// Where a change of the winding number lies: a crossing, or a step of a winding field.
struct Change {
  int edge = 0, change = 0;
  std::uint32_t depth = 0, triangle = CutEdge::kNoTriangle;
};

/// The depth of a triangle's plane on the ray through voxel column (u, v), lattice steps.
double plane_depth(const LatticeMesh& mesh, std::uint32_t triangle, const AxisFrame& frame, int u,
                   int v) {
  const glm::uvec3& t = mesh.triangles[triangle];
  const glm::dvec3 a(mesh.vertices[t.x]), b(mesh.vertices[t.y]), c(mesh.vertices[t.z]);
  if (a[frame.w] == b[frame.w] && a[frame.w] == c[frame.w]) return a[frame.w];
  const double bu = b[frame.u] - a[frame.u], bv = b[frame.v] - a[frame.v];
  const double cu = c[frame.u] - a[frame.u], cv = c[frame.v] - a[frame.v];
  const double du = kLatticeSteps * u + kLatticeSteps / 2 - a[frame.u];
  const double dv = kLatticeSteps * v + kLatticeSteps / 2 - a[frame.v];
  const double area = bu * cv - bv * cu;
  return a[frame.w] + ((du * cv - dv * cu) * (b[frame.w] - a[frame.w]) +
                       (bu * dv - bv * du) * (c[frame.w] - a[frame.w])) /
                          area;
}

}  // namespace

/// Collects tile by tile. One for each thread.
class GridCrossings::Collector {
 public:
  Collector(const LatticeMesh& mesh, const VoxelGrid& grid, const Settings& settings)
      : mesh_(mesh),
        grid_(grid),
        settings_(settings),
        filter_(settings.filter != nullptr ? settings.filter->worker() : nullptr) {}

  /// @param triangles  of the tile
  Result<void> tile(int axis, std::span<const std::uint32_t> triangles, int tu, int tv,
                    const std::stop_token& stop, Tile& out) {
    target_ = raster_target(grid_, static_cast<Axis>(axis));
    std::span<const WindingStep> steps;
    if (settings_.field != nullptr) {
      steps = settings_.field->steps(target_.axis, tu, tv, stop, scratch_);
    }
    if (triangles.empty() && steps.empty()) return {};
    static constexpr std::uint32_t kNone[kTilePixels + 1] = {};
    TileLists<DepthItem> lists;
    lists.offsets = kNone;
    if (!triangles.empty()) {
      auto built = builder_.build(mesh_, target_, triangles, tu, tv);
      if (!built) return tl::unexpected(built.error());
      if (built->fragments > 0) lists = filter_ ? filter_->apply(*built) : *built;
    }
    found_.clear();
    places_.clear();
    std::size_t next = 0;
    for (std::size_t pixel = 0; pixel < size(kTilePixels); ++pixel) {
      changes_.clear();
      for_each_item(lists, pixel, [&](DepthItem item) {
        changes_.push_back({static_cast<int>((item.depth() + kLatticeSteps / 2) >> kLatticeBits),
                            item.exit() ? -1 : 1, item.depth(), item.triangle()});
      });
      if (next < steps.size() && steps[next].pixel == pixel) {
        for (; next < steps.size() && steps[next].pixel == pixel; ++next) {
          const int edge = std::clamp(steps[next].voxel, 0, grid_.dims[AxisFrame(target_.axis).w]);
          changes_.push_back({edge, steps[next].change, 0, CutEdge::kNoTriangle});
        }
        std::stable_sort(changes_.begin(), changes_.end(),
                         [](const Change& a, const Change& b) { return a.edge < b.edge; });
      }
      if (!changes_.empty()) column(static_cast<int>(pixel), tu, tv);
    }
    store(out);
    return {};
  }
  [[nodiscard]] std::uint64_t lost() const { return lost_; }

 private:
  // Walks a column edge by edge.
  void column(int pixel, int tu, int tv) {
    const int u = pixel % kTileSide, v = pixel / kTileSide;
    int winding = 0;
    bool inside = false;
    for (std::size_t i = 0; i < changes_.size();) {
      const int edge = changes_[i].edge;
      const Change* first = nullptr;  // that changes the inside
      for (; i < changes_.size() && changes_[i].edge == edge; ++i) {
        winding += changes_[i].change;
        if (first == nullptr && is_inside(settings_.rule, winding) != inside) first = &changes_[i];
      }
      if (is_inside(settings_.rule, winding) != inside) {
        inside = !inside;
        add(*first, edge, u, v, tu, tv);
      } else if (first != nullptr) {
        ++lost_;
      }
    }
    if (inside) {  // entered and never left: no voxels
      found_.pop_back();
      places_.pop_back();
    }
  }

  void add(const Change& change, int edge, int u, int v, int tu, int tv) {
    const int centre = edge * kLatticeSteps - kLatticeSteps / 2;  // the lower one
    int offset = CutEdge::kMiddle;
    std::uint32_t triangle = change.triangle;
    if (triangle != CutEdge::kNoTriangle) {
      offset = static_cast<int>(change.depth) - centre;
      const int last = static_cast<int>(target_.depth_limit);
      if (change.depth == 0 || change.depth + 1 == target_.depth_limit) {
        // It may have been moved into the grid.
        const double depth = plane_depth(mesh_, triangle, AxisFrame(target_.axis),
                                         tu * kTileSide + u, tv * kTileSide + v);
        const int face = change.depth == 0 ? 0 : last;
        const bool beyond = face == 0 ? !(depth > -0.5) : !(depth < last + 0.5);
        if (beyond) triangle = CutEdge::kGridFace;
        if (beyond || std::abs(depth - face) < 0.5) offset = face - centre;
      }
    }
    found_.emplace_back(u % kBlockSide, v % kBlockSide, edge % kBlockSide,
                        std::clamp(offset, 1, kLatticeSteps - 1), triangle);
    places_.push_back(
        static_cast<std::uint32_t>(edge / kBlockSide * 4 + v / kBlockSide * 2 + u / kBlockSide));
  }

  // Sorts what was found by block.
  void store(Tile& out) {
    if (found_.empty()) return;
    const int blocks = grid_.dims[AxisFrame(target_.axis).w] / kBlockSide + 1;
    out.offsets.assign(size(blocks) * 4 + 1, 0);
    out.edges.resize(found_.size());
    for (const std::uint32_t place : places_) ++out.offsets[place + 1];
    for (std::size_t i = 1; i < out.offsets.size(); ++i) out.offsets[i] += out.offsets[i - 1];
    next_.assign(out.offsets.begin(), out.offsets.end());
    for (std::size_t i = 0; i < found_.size(); ++i) out.edges[next_[places_[i]]++] = found_[i];
  }

  const LatticeMesh& mesh_;
  const VoxelGrid& grid_;
  const Settings& settings_;
  std::unique_ptr<TileListFilter::Worker> filter_;
  ItemTileBuilder builder_;
  WindingField::Scratch scratch_;
  RasterTarget target_;
  std::vector<Change> changes_;
  std::vector<CutEdge> found_;
  std::vector<std::uint32_t> places_, next_;
  std::uint64_t lost_ = 0;
};

Result<GridCrossings> GridCrossings::collect(const LatticeMesh& mesh, const VoxelGrid& grid,
                                             const Settings& settings, const Execution& execution) {
  GridCrossings result;
  result.blocks_ = grid.dims / kBlockSide + 1;
  std::array<TileBins, 3> bins;
  std::array<std::size_t, 4> first{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const RasterTarget target = raster_target(grid, static_cast<Axis>(axis));
    auto made = bin_triangles(mesh, target, execution);
    if (!made) return tl::unexpected(made.error());
    bins[axis] = *std::move(made);
    Side& side = result.sides_[axis];
    side.tiles_u = (target.width + kTileSide - 1) / kTileSide;
    side.tiles_v = (target.height + kTileSide - 1) / kTileSide;
    side.depth_blocks = result.blocks_[static_cast<int>(axis)];
    side.tiles.resize(size(side.tiles_u) * size(side.tiles_v));
    first[axis + 1] = first[axis] + side.tiles.size();
  }
  std::vector<std::unique_ptr<Collector>> collectors(size(execution.thread_count()));
  std::mutex failure_mutex;
  Result<void> status;
  std::atomic<std::uint64_t> bytes{0};
  std::atomic<bool> failed{false};
  parallel_for(execution, first[3], [&](std::size_t index, int worker) {
    if (failed) return;
    const std::size_t axis = index < first[1] ? 0 : index < first[2] ? 1 : 2;
    Side& side = result.sides_[axis];
    const std::size_t at = index - first[axis];
    const int tu = static_cast<int>(at) % side.tiles_u, tv = static_cast<int>(at) / side.tiles_u;
    auto& collector = collectors[size(worker)];
    if (!collector) collector = std::make_unique<Collector>(mesh, grid, settings);
    Tile& tile = side.tiles[at];
    auto done = collector->tile(static_cast<int>(axis), bins[axis].tile(tu, tv), tu, tv,
                                execution.stop, tile);
    const std::uint64_t held = bytes +=
        tile.edges.capacity() * sizeof(CutEdge) + tile.offsets.capacity() * sizeof(std::uint32_t);
    if (done && execution.memory_limit > 0 && held > execution.memory_limit) {
      done = fail(ErrorCode::kLimit,
                  "the crossings of the contour need more than the memory limit of {} bytes; they "
                  "had reached {} bytes",
                  execution.memory_limit, held);
    }
    if (!done) {
      const std::lock_guard lock(failure_mutex);
      if (status) status = done;
      failed = true;
    }
    if (execution.progress && worker == 0) {
      execution.progress(static_cast<double>(index) / static_cast<double>(first[3]));
    }
  });
  if (!status) return tl::unexpected(status.error());
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  for (const auto& collector : collectors) result.lost_ += collector ? collector->lost() : 0;
  result.bytes_ = bytes;
  return result;
}

std::span<const CutEdge> GridCrossings::block(int axis, const glm::ivec3& block) const {
  const AxisFrame frame(static_cast<Axis>(axis));
  const Side& side = sides_[size(axis)];
  const int tu = block[frame.u] / 2, tv = block[frame.v] / 2;
  if (tu >= side.tiles_u || tv >= side.tiles_v) return {};
  const Tile& tile = side.tiles[size(tv) * size(side.tiles_u) + size(tu)];
  if (tile.offsets.empty()) return {};
  const std::size_t at =
      size(block[frame.w]) * 4 + size(block[frame.v] % 2) * 2 + size(block[frame.u] % 2);
  return std::span(tile.edges).subspan(tile.offsets[at], tile.offsets[at + 1] - tile.offsets[at]);
}

}  // namespace strata::contouring
