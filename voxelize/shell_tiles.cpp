#include "voxelize/shell_tiles.h"

namespace strata::shell {
namespace {

constexpr int kSide = VoxelIntervals::kTileSide;
static_assert(kSide == kWindowSide);
constexpr int kTileBits = kLatticeBits + 6;
static_assert(1 << kTileBits == kSide * kLatticeSteps);

struct Reference {
  std::uint32_t tile, triangle;
};

// The tiles along u that the triangle meets in rows of tiles v0..v1.
std::vector<Range> tile_rows(const Triangle& t, int v0, int v1, int margin) {
  const int more = margin > 0 ? 1 : 0;
  std::vector<Range> rows(static_cast<std::size_t>(v1 - v0 + 1 + 2 * more));
  strip_ranges(t, 1, 0, kTileBits, v0 - more, v1 + 1 + more, rows.data());
  if (more == 0) return rows;
  std::vector<Range> wider(rows.size() - 2);  // a margin is less than a tile
  for (std::size_t i = 0; i < wider.size(); ++i) {
    for (std::size_t j = i; j <= i + 2; ++j) {
      if (rows[j].first <= rows[j].last) wider[i].include(rows[j].first - 1, rows[j].last + 1);
    }
  }
  return wider;
}

void bin_triangle(const Triangle& t, std::uint32_t index, const VoxelIntervals& slab, int depth,
                  int margin, std::vector<Reference>& out) {
  const Range u = voxel_bounds(t, 0, margin), v = voxel_bounds(t, 1, margin);
  const Range w = voxel_bounds(t, 2, margin);
  if (u.last < 0 || u.first >= slab.columns() || v.last < slab.v_begin() ||
      v.first >= slab.v_end() || w.last < 0 || w.first >= depth) {
    return;
  }
  const int base = slab.v_begin() / kSide;
  const int u0 = std::max(u.first, 0) / kSide;
  const int u1 = std::min(u.last, slab.columns() - 1) / kSide;
  const int v0 = std::max(v.first, slab.v_begin()) / kSide;
  const int v1 = std::min(v.last, slab.v_end() - 1) / kSide;
  // Tiles are cells of a coarser lattice: a large triangle enters only those it touches.
  std::vector<Range> rows;
  if (u0 != u1 && v0 != v1) rows = tile_rows(t, v0, v1, margin);
  for (int tv = v0; tv <= v1; ++tv) {
    const Range row = rows.empty() ? Range{u0, u1} : rows[static_cast<std::size_t>(tv - v0)];
    for (int tu = std::max(u0, row.first); tu <= std::min(u1, row.last); ++tu) {
      out.push_back({static_cast<std::uint32_t>((tv - base) * slab.tiles_u() + tu), index});
    }
  }
}

}  // namespace

Triangle corners(const LatticeMesh& mesh, std::size_t index, AxisFrame frame) {
  Triangle triangle;
  for (int i = 0; i < 3; ++i) {
    const glm::ivec3& p = mesh.vertices[mesh.triangles[index][i]];
    triangle[static_cast<std::size_t>(i)] = {p[frame.u], p[frame.v], p[frame.w]};
  }
  return triangle;
}

Result<Bins> bin_by_tile(const LatticeMesh& mesh, const VoxelIntervals& slab,
                         const Execution& execution, Budget& budget, int margin) {
  constexpr std::size_t kChunk = 8192;
  const AxisFrame frame(slab.axis());
  const int depth = slab.grid().dims[frame.w];
  const std::size_t count = mesh.triangles.size();
  std::vector<std::vector<Reference>> chunks((count + kChunk - 1) / kChunk);
  Execution quiet = execution;
  quiet.progress = {};
  const Result<void> binned =
      for_each_tile(quiet, chunks.size(), budget.limit(), [&](std::size_t chunk, int) {
        const std::size_t end = std::min(count, (chunk + 1) * kChunk);
        for (std::size_t i = chunk * kChunk; i < end; ++i) {
          bin_triangle(corners(mesh, i, frame), static_cast<std::uint32_t>(i), slab, depth, margin,
                       chunks[chunk]);
        }
        return budget.add(chunks[chunk].size() * (sizeof(Reference) + sizeof(std::uint32_t)));
      });
  if (!binned) return tl::unexpected(binned.error());

  Bins bins;
  bins.offsets.assign(
      static_cast<std::size_t>(slab.tiles_u()) * static_cast<std::size_t>(slab.tiles_v()) + 1, 0);
  for (const auto& chunk : chunks) {
    for (const Reference& reference : chunk) ++bins.offsets[reference.tile + 1];
  }
  for (std::size_t i = 1; i < bins.offsets.size(); ++i) bins.offsets[i] += bins.offsets[i - 1];
  bins.triangles.resize(bins.offsets.back());
  std::vector<std::size_t> next(bins.offsets.begin(), bins.offsets.end() - 1);
  for (auto& chunk : chunks) {
    for (const Reference& reference : chunk) {
      bins.triangles[next[reference.tile]++] = reference.triangle;
    }
    budget.remove(chunk.size() * sizeof(Reference));
    chunk = {};
  }
  return bins;
}

void RunCollector::finish() {
  constexpr std::size_t kColumns = VoxelIntervals::kTileColumns;
  offsets_.assign(kColumns + 1, 0);
  for (const Run& run : runs_) ++offsets_[run.local + 1];
  for (std::size_t i = 0; i < kColumns; ++i) offsets_[i + 1] += offsets_[i];
  next_.assign(offsets_.begin(), offsets_.end() - 1);
  items_.resize(runs_.size());
  for (const Run& run : runs_) items_[next_[run.local]++] = run.interval;
  std::uint32_t out = 0, begin = 0;
  for (std::size_t local = 0; local < kColumns; ++local) {
    const std::uint32_t end = offsets_[local + 1];
    offsets_[local] = out;
    std::sort(items_.begin() + begin, items_.begin() + end,
              [](Interval a, Interval b) { return a.first < b.first; });
    for (std::uint32_t i = begin; i < end; ++i) {
      if (out > offsets_[local] && items_[i].first <= items_[out - 1].last + 1) {
        items_[out - 1].last = std::max(items_[out - 1].last, items_[i].last);
      } else {
        items_[out++] = items_[i];
      }
    }
    begin = end;
  }
  offsets_[kColumns] = out;
  items_.resize(out);
}

Window window_of(const VoxelIntervals& slab, int tu, int tv) {
  const int v_begin = slab.v_begin() + tv * kSide;
  return {tu * kSide, std::min((tu + 1) * kSide, slab.columns()), v_begin,
          std::min(v_begin + kSide, slab.v_end()), slab.grid().dims[AxisFrame(slab.axis()).w]};
}

void collect(const Triangle& triangle, const Window& window, SurfaceKind kind,
             RunCollector& collector) {
  const auto local = [&](int u, int v) {
    return (v - window.v_begin) * kSide + (u - window.u_begin);
  };
  if (kind == SurfaceKind::kConservative) {
    conservative_runs(triangle, window, [&](int u, int v, int first, int last) {
      collector.add(local(u, v), first, last);
    });
    return;
  }
  SegmentTest test(triangle, kind == SurfaceKind::k26);
  conservative_runs(triangle, window, [&](int u, int v, int first, int last) {
    test.runs(u, v, first, last,
              [&](int begin, int end) { collector.add(local(u, v), begin, end); });
  });
}

}  // namespace strata::shell
