#include "voxelize/vote.h"

#include <algorithm>
#include <array>
#include <utility>

namespace strata {
namespace {

using Words = std::array<std::uint64_t, 64>;

/// One axis' solid with its unbalanced columns, and how much of each block of 64^3 voxels it fills.
struct Ballot {
  VoxelIntervals intervals;
  ColumnMarks unbalanced;
  std::vector<std::uint32_t> filled;  ///< voxels, by block in x, y, z order, x fastest

  void count_filled(const Execution& execution);
};

/// Blocks of 64 voxels along each axis of a grid, the last ones cut.
struct BlockGrid {
  explicit BlockGrid(const VoxelGrid& grid) : voxels(grid.dims), blocks((grid.dims + 63) / 64) {}
  [[nodiscard]] std::size_t index(const glm::ivec3& block) const {
    return (static_cast<std::size_t>(block.z) * static_cast<std::size_t>(blocks.y) +
            static_cast<std::size_t>(block.y)) *
               static_cast<std::size_t>(blocks.x) +
           static_cast<std::size_t>(block.x);
  }
  [[nodiscard]] std::size_t count() const {
    return static_cast<std::size_t>(blocks.x) * static_cast<std::size_t>(blocks.y) *
           static_cast<std::size_t>(blocks.z);
  }
  /// Voxels of a block that lie in the grid.
  [[nodiscard]] std::uint32_t volume(const glm::ivec3& block) const {
    std::uint32_t product = 1;
    for (int axis = 0; axis < 3; ++axis) {
      product *= static_cast<std::uint32_t>(std::min(64, voxels[axis] - 64 * block[axis]));
    }
    return product;
  }
  glm::ivec3 voxels, blocks;
};

void Ballot::count_filled(const Execution& execution) {
  const BlockGrid grid(intervals.grid());
  const AxisFrame frame(intervals.axis());
  filled.assign(grid.count(), 0);
  const auto depth = static_cast<std::size_t>(grid.blocks[frame.w]);
  const auto tiles = static_cast<std::size_t>(intervals.tiles_u() * intervals.tiles_v());
  parallel_for(execution, tiles, [&](std::size_t tile, int) {
    glm::ivec3 block{0};
    block[frame.u] = static_cast<int>(tile) % intervals.tiles_u();
    block[frame.v] = static_cast<int>(tile) / intervals.tiles_u();
    if (intervals.tile_empty(block[frame.u], block[frame.v])) return;
    // Ends of intervals count at once; whole blocks between them by a running number of columns.
    std::vector<std::uint32_t> part(depth, 0);
    std::vector<std::int32_t> whole(depth + 1, 0);
    const int u0 = block[frame.u] * 64, v0 = block[frame.v] * 64;
    for (int v = v0; v < std::min(v0 + 64, grid.voxels[frame.v]); ++v) {
      for (int u = u0; u < std::min(u0 + 64, grid.voxels[frame.u]); ++u) {
        for (const Interval& interval : intervals.column(u, v)) {
          const auto first = static_cast<std::size_t>(interval.first / 64);
          const auto last = static_cast<std::size_t>(interval.last / 64);
          if (first == last) {
            part[first] += static_cast<std::uint32_t>(interval.length());
            continue;
          }
          part[first] += static_cast<std::uint32_t>(64 - interval.first % 64);
          part[last] += static_cast<std::uint32_t>(interval.last % 64 + 1);
          ++whole[first + 1];
          --whole[last];
        }
      }
    }
    std::int32_t columns = 0;
    for (std::size_t k = 0; k < depth; ++k) {
      columns += whole[k];
      block[frame.w] = static_cast<int>(k);
      filled[grid.index(block)] = part[k] + static_cast<std::uint32_t>(columns) * 64;
    }
  });
}

/// Voxels [low, low + 64) of a column as bits.
std::uint64_t column_bits(std::span<const Interval> column, int low) {
  std::uint64_t bits = 0;
  for (const Interval& interval : column) {
    const int begin = std::max(interval.begin() - low, 0);
    const int end = std::min(interval.end() - low, 64);
    if (begin >= end) continue;
    bits |= (~std::uint64_t{0} >> (64 - (end - begin))) << begin;
  }
  return bits;
}

/// Transposes a matrix of 64 x 64 bits in place (H. S. Warren: Hacker's Delight, 7-3).
void transpose(Words& rows) {
  std::uint64_t mask = 0x00000000ffffffffu;
  for (std::size_t width = 32; width != 0; width >>= 1, mask ^= mask << width) {
    for (std::size_t k = 0; k < 64; k = ((k | width) + 1) & ~width) {
      const std::uint64_t t = ((rows[k] >> width) ^ rows[k | width]) & mask;
      rows[k] ^= t << width;
      rows[k | width] ^= t;
    }
  }
}

/// A block of 64 x 64 x 64 voxels: word [v][u], bit w.
using Block = std::array<Words, 64>;

class Booth {
 public:
  Booth(const VoxelGrid& grid, const AxisFrame& frame, const std::array<Ballot, 3>& ballots)
      : grid_(grid), frame_(frame), ballots_(ballots) {}

  /// Counts the votes of the block with lower corner (u0, v0, w0) into result().
  void count(int u0, int v0, int w0) {
    cast_along_ray(u0, v0, w0);
    cast_across(frame_.u, u0, v0, w0, inside_[1], balanced_[1]);
    cast_across(frame_.v, u0, v0, w0, inside_[2], balanced_[2]);
    for (std::size_t v = 0; v < 64; ++v) {
      for (std::size_t u = 0; u < 64; ++u) {
        const std::uint64_t a = inside_[0][v][u], b = inside_[1][v][u], c = inside_[2][v][u];
        const std::uint64_t ga = balanced_[0][v][u], gb = balanced_[1][v][u],
                            gc = balanced_[2][v][u];
        const std::uint64_t majority = (a & b) | (a & c) | (b & c);
        const std::uint64_t only_a = ga & ~gb & ~gc, only_b = gb & ~ga & ~gc,
                            only_c = gc & ~ga & ~gb;
        const std::uint64_t alone = only_a | only_b | only_c;
        result_[v][u] = (majority & ~alone) | (only_a & a) | (only_b & b) | (only_c & c);
      }
    }
  }
  [[nodiscard]] const Block& result() const { return result_; }

 private:
  void cast_along_ray(int u0, int v0, int w0) {
    const Ballot& ballot = ballots_[static_cast<std::size_t>(frame_.w)];
    for (int v = 0; v < 64; ++v) {
      for (int u = 0; u < 64; ++u) {
        const bool in_grid = u0 + u < grid_.dims[frame_.u] && v0 + v < grid_.dims[frame_.v];
        inside_[0][static_cast<std::size_t>(v)][static_cast<std::size_t>(u)] =
            in_grid ? column_bits(ballot.intervals.column(u0 + u, v0 + v), w0) : 0;
        balanced_[0][static_cast<std::size_t>(v)][static_cast<std::size_t>(u)] =
            in_grid && !ballot.unbalanced.marked(u0 + u, v0 + v) ? ~std::uint64_t{0} : 0;
      }
    }
  }

  /// Rays along `axis`, which is u or v of the block: bits come along the ray and are turned to w.
  void cast_across(int axis, int u0, int v0, int w0, Block& inside, Block& balanced) {
    const Ballot& ballot = ballots_[static_cast<std::size_t>(axis)];
    const AxisFrame ray(static_cast<Axis>(axis));
    const bool along_u = axis == frame_.u;
    glm::ivec3 low{0};
    low[frame_.u] = u0, low[frame_.v] = v0, low[frame_.w] = w0;
    const int fixed = along_u ? frame_.v : frame_.u;
    for (int i = 0; i < 64; ++i) {
      Words bits{}, good{};
      glm::ivec3 at = low;
      at[fixed] += i;
      if (at[fixed] < grid_.dims[fixed]) {
        for (int k = 0; k < 64 && w0 + k < grid_.dims[frame_.w]; ++k) {
          at[frame_.w] = w0 + k;
          bits[static_cast<std::size_t>(k)] =
              column_bits(ballot.intervals.column(at[ray.u], at[ray.v]), low[axis]);
          good[static_cast<std::size_t>(k)] =
              ballot.unbalanced.marked(at[ray.u], at[ray.v]) ? 0 : ~std::uint64_t{0};
        }
      }
      transpose(bits);
      const bool all_good = std::all_of(good.begin(), good.end(), [](auto g) { return ~g == 0; });
      if (!all_good) transpose(good);
      for (std::size_t j = 0; j < 64; ++j) {
        const std::size_t v = along_u ? static_cast<std::size_t>(i) : j;
        const std::size_t u = along_u ? j : static_cast<std::size_t>(i);
        inside[v][u] = bits[j];
        balanced[v][u] = good[j];
      }
    }
  }

  const VoxelGrid& grid_;
  AxisFrame frame_;
  const std::array<Ballot, 3>& ballots_;
  std::array<Block, 3> inside_, balanced_;
  Block result_;
};

/// Gathers runs along w of the 64 x 64 columns of a tile, block by block.
class RunGatherer {
 public:
  RunGatherer() : columns_(kTilePixels) {}
  void add(const Block& block, int w0) {
    for (std::size_t v = 0; v < 64; ++v) {
      for (std::size_t u = 0; u < 64; ++u) {
        std::uint64_t bits = block[v][u];
        auto& column = columns_[v * 64 + u];
        while (bits != 0) {
          const int begin = __builtin_ctzll(bits);
          const std::uint64_t gaps = ~(bits >> begin);
          const int length = gaps == 0 ? 64 : __builtin_ctzll(gaps);
          append(column, w0 + begin, length);
          if (begin + length >= 64) break;
          bits &= ~std::uint64_t{0} << (begin + length);
        }
      }
    }
  }
  /// Voxels [w0, w0 + length) of the first `width` x `height` columns of the tile.
  void add_full(int w0, int length, int width, int height) {
    for (int v = 0; v < std::min(64, height); ++v) {
      for (int u = 0; u < std::min(64, width); ++u) {
        append(columns_[static_cast<std::size_t>(v * 64 + u)], w0, length);
      }
    }
  }
  /// Writes tile (tu, tv) of `out` and empties itself.
  void flush(VoxelIntervals& out, int tu, int tv) {
    offsets_.assign(1, 0);
    items_.clear();
    for (auto& column : columns_) {
      items_.insert(items_.end(), column.begin(), column.end());
      offsets_.push_back(static_cast<std::uint32_t>(items_.size()));
      column.clear();
    }
    if (!items_.empty()) out.set_tile(tu, tv, offsets_, items_);
  }

 private:
  static void append(std::vector<Interval>& column, int begin, int length) {
    const auto last = static_cast<std::uint16_t>(begin + length - 1);
    if (!column.empty() && column.back().end() == begin) {
      column.back().last = last;
    } else {
      column.push_back({static_cast<std::uint16_t>(begin), last});
    }
  }
  std::vector<std::vector<Interval>> columns_;
  std::vector<std::uint32_t> offsets_;
  std::vector<Interval> items_;
};

}  // namespace

Result<void> vote_slabs(const LatticeMesh& mesh, const VoxelGrid& grid,
                        const VoxelizeOptions& options, const Execution& execution, int slab_rows,
                        VoxelizeReport& report,
                        const std::function<Result<void>(VoxelIntervals&&)>& sink) {
  std::array<Ballot, 3> ballots;
  Execution quiet = execution;
  quiet.progress = {};
  int axes_done = 0;
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    auto voxelizer = SolidVoxelizer::create(mesh, grid, axis, options, quiet);
    if (!voxelizer) return tl::unexpected(voxelizer.error());
    Ballot& ballot = ballots[static_cast<std::size_t>(axis)];
    const int rows = voxelizer->target().height;
    ballot.unbalanced = ColumnMarks((voxelizer->target().width + 63) / 64, rows);
    VoxelizeReport unused;
    auto slab =
        voxelizer->slab(0, rows, quiet, axis == options.axis ? report : unused, &ballot.unbalanced);
    if (!slab) return tl::unexpected(slab.error());
    ballot.intervals = std::move(*slab);
    ballot.count_filled(quiet);
    if (execution.progress) execution.progress(++axes_done / 6.0);
  }

  const AxisFrame frame(options.axis);
  // No voxel outside the mesh's box is inside on any axis.
  glm::ivec3 low{kMaxLatticeCoordinate}, high{-kMaxLatticeCoordinate};
  for (const auto& p : mesh.vertices) low = glm::min(low, p), high = glm::max(high, p);
  const int w_begin = std::clamp(low[frame.w] / kLatticeSteps, 0, grid.dims[frame.w]) & ~63;
  const int w_end = std::clamp(high[frame.w] / kLatticeSteps + 1, 0, grid.dims[frame.w]);

  struct Worker {
    Worker(const VoxelGrid& grid, const AxisFrame& frame, const std::array<Ballot, 3>& ballots)
        : booth(grid, frame, ballots) {}
    Booth booth;
    RunGatherer runs;
  };
  std::vector<std::unique_ptr<Worker>> workers;
  for (int i = 0; i < execution.thread_count(); ++i) {
    workers.push_back(std::make_unique<Worker>(grid, frame, ballots));
  }
  const BlockGrid blocks(grid);
  const int rows = grid.dims[frame.v];
  for (int v_begin = 0; v_begin < rows; v_begin += slab_rows) {
    VoxelIntervals slab(grid, options.axis, v_begin, std::min(rows, v_begin + slab_rows));
    parallel_for(quiet, static_cast<std::size_t>(slab.tiles_u() * slab.tiles_v()),
                 [&](std::size_t tile, int index) {
                   Worker& worker = *workers[static_cast<std::size_t>(index)];
                   const int tu = static_cast<int>(tile) % slab.tiles_u();
                   const int tv = static_cast<int>(tile) / slab.tiles_u();
                   glm::ivec3 block{0};
                   block[frame.u] = tu;
                   block[frame.v] = v_begin / 64 + tv;
                   for (int w = w_begin; w < w_end; w += 64) {
                     block[frame.w] = w / 64;
                     const std::size_t at = blocks.index(block);
                     const std::uint32_t filled = ballots[0].filled[at];
                     const bool unanimous =
                         ballots[1].filled[at] == filled && ballots[2].filled[at] == filled;
                     if (unanimous && filled == 0) continue;
                     if (unanimous && filled == blocks.volume(block)) {
                       worker.runs.add_full(w, std::min(64, grid.dims[frame.w] - w),
                                            grid.dims[frame.u] - tu * 64,
                                            grid.dims[frame.v] - block[frame.v] * 64);
                       continue;
                     }
                     worker.booth.count(tu * 64, v_begin + tv * 64, w);
                     worker.runs.add(worker.booth.result(), w);
                   }
                   worker.runs.flush(slab, tu, tv);
                 });
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    if (auto done = sink(std::move(slab)); !done) return done;
    if (execution.progress) {
      execution.progress(0.5 +
                         0.5 * std::min(1.0, static_cast<double>(v_begin + slab_rows) / rows));
    }
  }
  return {};
}

}  // namespace strata
