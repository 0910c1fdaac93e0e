#include "apps/strata/memory_estimate.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "raster/tile_bins.h"

namespace strata::apps {
namespace {

double columns(const VoxelGrid& grid, Axis axis) {
  const AxisFrame frame(axis);
  return static_cast<double>(grid.dims[frame.u]) * static_cast<double>(grid.dims[frame.v]);
}

/// Of all solids of a tree, those that are taken away included. In squares of side `unit`.
double area_of(const TriangleSoup& soup, double unit) {
  double twice = 0;
  for (const glm::uvec3& t : soup.triangles) {
    const glm::dvec3& a = soup.positions[t.x];
    twice +=
        glm::length(glm::cross((soup.positions[t.y] - a) / unit, (soup.positions[t.z] - a) / unit));
  }
  return twice / 2;
}

std::uint64_t rounded(double bytes) {
  return bytes < 1e19 ? static_cast<std::uint64_t>(bytes)
                      : std::uint64_t{10'000'000'000'000'000'000u};
}

}  // namespace

MemoryEstimate estimate_memory(const MeshInput& input, const VoxelGrid& voxels, Axis axis,
                               int samples, const VoxelizeCommand& command, std::string_view format,
                               int threads, std::uint64_t limit) {
  MemoryEstimate estimate;
  const int fine = std::max(samples, 1);
  VoxelGrid grid = voxels;  // that is walked: of the samples
  grid.dims *= fine;
  grid.voxel_size /= fine;
  const auto vertices = static_cast<double>(input.soup.positions.size());
  const auto triangles = static_cast<double>(input.soup.triangles.size());
  const double elements = static_cast<double>(input.soup.face_elements.size());
  // Of a tree also whose each triangle is.
  const double owners = input.tree ? triangles * 4 : 0.0;
  estimate.mesh = rounded(vertices * (24 + 12) + triangles * 12 + elements * 4 + owners);

  // Area in voxel faces; a triangle of side d voxels meets about (1 + d / 64)^2 tiles.
  const glm::dvec3 s = grid.voxel_size;
  const double face = std::cbrt(s.x) * std::cbrt(s.y) * std::cbrt(s.z);  // the product may be 0
  const double area = input.tree ? area_of(input.soup, face) : input.area / (face * face);
  const double side = triangles > 0 ? std::sqrt(2 * area / triangles) : 0;
  const double tiles = columns(grid, axis) / kTilePixels + 1;
  const double across = 1 + side / kTileSide;
  const double references = triangles * std::min(across * across, tiles);
  double open = 0;
  if (!input.closed && !input.tree && command.solid && command.open == OpenMode::kVote) {
    // The closed mesh beside the open one, its pieces, and the caps with their tree.
    double edges = 0;
    for (const InputFacts& file : input.files) edges += static_cast<double>(file.unbalanced_edges);
    open = vertices * (12 + 36) + triangles * 12 + edges * 400;
  }
  estimate.bins = rounded(open + triangles * 8 + references * 4 + tiles * (4.0 + 8.0 * threads));

  // Offsets and two intervals a column, with their copies; slabs keep to an eighth of the limit,
  // but hold 64 rows at least (see voxelize_slabs).
  constexpr double kColumnBytes = 16, kDefaultSlab = 512.0 * 1024 * 1024;
  const AxisFrame frame(axis);
  const double least = 64.0 * fine * grid.dims[frame.u] * kColumnBytes;
  const double budget =
      limit > 0 ? std::min(kDefaultSlab, static_cast<double>(limit) / 8) : kDefaultSlab;
  double slab = std::min(columns(grid, axis) * kColumnBytes, std::max(least, budget));
  if (command.surface && command.solid) slab *= 2;
  constexpr double kWorkerBytes = 6e6;
  estimate.slabs = rounded(slab + kWorkerBytes * threads);

  if (format == "vdb") {
    // A surface of area A meets about 1.5 A / 64 leaves, of 64 bytes and their share of nodes; ids
    // are a zlib stream a leaf, which takes about as much, fractions about four
    // times that.
    const double leaf = command.ids ? 144 : command.fog != 0 ? 600 : 72;
    const double there = std::ceil(voxels.dims.x / 8.0) * std::ceil(voxels.dims.y / 8.0) *
                         std::ceil(voxels.dims.z / 8.0);
    estimate.output = rounded(std::min(area / (fine * fine) * 1.5 / 64, there) * leaf);
  } else if (format == "binvox") {
    const double longest = std::max({grid.dims.x, grid.dims.y, grid.dims.z});
    estimate.output = rounded(columns(grid, axis) * 8 + longest * longest / 127 * threads);
  } else if (!format.empty()) {
    // Formats written piece by piece: a few layers of packed or compressed voxels.
    estimate.output = rounded(16e6 + columns(grid, axis));
  }
  return estimate;
}

}  // namespace strata::apps
