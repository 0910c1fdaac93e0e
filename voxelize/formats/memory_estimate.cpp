#include "strata/voxelize/formats/voxel_writer.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <vector>

#include "strata/raster/raster_target.h"
#include "strata/voxelize/voxelize.h"

namespace strata {
namespace {

double columns(const VoxelGrid& grid, Axis axis) {
  const AxisFrame frame(axis);
  return static_cast<double>(grid.dims[frame.u]) * static_cast<double>(grid.dims[frame.v]);
}

std::uint64_t rounded(double bytes) {
  return bytes < 1e19 ? static_cast<std::uint64_t>(bytes)
                      : std::uint64_t{10'000'000'000'000'000'000u};
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

/// Area in voxel faces.
double faces_of(const MemoryFactors& factors, const VoxelGrid& grid) {
  const glm::dvec3 s = grid.voxel_size;
  const double face = std::cbrt(s.x) * std::cbrt(s.y) * std::cbrt(s.z);  // the product may be 0
  return factors.is_tree ? area_of(*factors.mesh, face) : factors.area / (face * face);
}

/// The triangles of each tile, and what a vote on an open mesh holds.
double bin_bytes(const VoxelGrid& grid, const MemoryFactors& factors, double area) {
  const auto triangles = static_cast<double>(factors.mesh->triangles.size());
  // A triangle of side d voxels meets about (1 + d / 64)^2 tiles.
  const double side = triangles > 0 ? std::sqrt(2 * area / triangles) : 0;
  const double tiles = columns(grid, factors.axis) / kTilePixels + 1;
  const double across = 1 + side / kTileSide;
  const double references = triangles * std::min(across * across, tiles);
  double open = 0;
  if (factors.votes) {
    // The closed mesh beside the open one, its pieces, and the caps with their tree.
    open = static_cast<double>(factors.mesh->positions.size()) * (12 + 36) + triangles * 12 +
           static_cast<double>(factors.open_edges) * 400;
  }
  return open + triangles * 8 + references * 4 + tiles * (4.0 + 8.0 * factors.threads);
}

constexpr double kWorkerBytes = 6e6;

/// What a slab is planned to take.
double slab_budget(const MemoryFactors& factors) {
  const std::uint64_t limit = factors.limit > 0 ? factors.limit / 8 : kMostSlabBytes;
  return static_cast<double>(std::min(kMostSlabBytes, limit));
}

/// Fractions: offsets of columns, and intervals with labels, of a slab or all. A surface of area A
/// meets about 1.5 A voxels, which are an interval each, held twice.
double covered_bytes(const VoxelGrid& grid, const MemoryFactors& factors, double area) {
  const double fine = std::max(factors.rays, 1);
  const double columns_there = columns(grid, factors.axis) / (fine * fine);
  const AxisFrame frame(factors.axis);
  const double all = columns_there * 8 + 1.5 * area / (fine * fine) * 16;
  const double rows =
      std::max(64.0, slab_budget(factors) / (129.0 / (fine * fine) * fine * grid.dims[frame.u]));
  const double part = std::min(1.0, 2 * rows * fine / grid.dims[frame.v]);
  const double changes = 64.0 / fine * grid.dims[frame.w] / fine * 4;
  return all * part + (kWorkerBytes + changes) * factors.threads;
}

/// Offsets of the columns that tiles with intervals have, and the intervals. Of a body whose faces
/// look everywhere alike a quarter of the area are runs of solid voxels, and half of it runs of the
/// surface. Slabs keep to an eighth of the limit by 16 bytes a column, but hold 64 rows at least
/// (see voxelize_slabs).
double slab_bytes(const VoxelGrid& grid, const MemoryFactors& factors, double area) {
  constexpr double kPlannedBytes = 16;
  const AxisFrame frame(factors.axis);
  if (factors.rays > 0) return covered_bytes(grid, factors, area);
  const double planned = columns(grid, factors.axis) * kPlannedBytes;
  const double least = 64.0 * std::max(factors.samples, 1) * grid.dims[frame.u] * kPlannedBytes;
  const double share = std::min(1.0, std::max(least, slab_budget(factors)) / planned);
  const double runs = area * ((factors.solid ? 0.25 : 0.0) + (factors.surface ? 0.5 : 0.0));
  // Measured: 1.5 bytes a column, 5.5 a run.
  constexpr double kColumnBytes = 2, kRunBytes = 7, kLabelBytes = 4, kThreadBytes = 4e6;
  const double all = columns(grid, factors.axis) * kColumnBytes +
                     runs * (kRunBytes + (factors.ids ? kLabelBytes : 0));
  return all * share + kThreadBytes * factors.threads;
}

constexpr int kFieldLayers = 64;  // that signed_distance_slabs() holds at once

/// The share of the area of a mesh in those kFieldLayers layers that have the most of it.
double densest_share(const TriangleSoup& soup, const VoxelGrid& grid) {
  constexpr std::size_t kMostLooked = 20'000;  // triangles
  const std::size_t step = soup.triangles.size() / kMostLooked + 1;
  std::vector<double> areas(static_cast<std::size_t>(grid.dims.z / kFieldLayers) + 1);
  const auto place = [&](double z) {
    const double at = (z - grid.origin.z) / (grid.voxel_size.z * kFieldLayers);
    return static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(areas.size() - 1)));
  };
  double sum = 0;
  for (std::size_t t = 0; t < soup.triangles.size(); t += step) {
    const glm::uvec3& corners = soup.triangles[t];
    const glm::dvec3 &a = soup.positions[corners.x], &b = soup.positions[corners.y],
                     &c = soup.positions[corners.z];
    const double area = glm::length(glm::cross(b - a, c - a));
    const std::size_t first = place(std::min({a.z, b.z, c.z}));
    const std::size_t last = place(std::max({a.z, b.z, c.z}));
    for (std::size_t i = first; i <= last; ++i) {
      areas[i] += area / static_cast<double>(last - first + 1);
    }
    sum += area;
  }
  return sum > 0 ? *std::max_element(areas.begin(), areas.end()) / sum : 1.0;
}

/// What the distances in a band of `band` voxels take.
struct DistanceBytes {
  double voxels = 0;  ///< in the band
  double bins = 0;    ///< triangles of each row of tiles, and the mesh on the lattice again
  double held = 0;    ///< the share of the voxels that is held at once
  double layers = 0;  ///< blocks of these layers
  double output = 0;  ///< of a level set
};

DistanceBytes distance_bytes(const VoxelGrid& grid, const MemoryFactors& factors, double area) {
  DistanceBytes bytes;
  if (factors.band <= 0) return bytes;
  const auto triangles = static_cast<double>(factors.mesh->triangles.size());
  const double cells = static_cast<double>(grid.dims.x) * grid.dims.y * grid.dims.z;
  bytes.voxels = factors.everywhere ? cells : std::min(area * 2 * factors.band, cells);
  const double side = triangles > 0 ? std::sqrt(2 * area / triangles) : 0;
  const double across = 1 + (side + 2 * factors.band) / 32;
  const double rows = (grid.dims.y / 32.0 + 1) * (grid.dims.z / 32.0 + 1);
  bytes.bins = static_cast<double>(factors.mesh->positions.size()) * 12 + rows * 8 +
               triangles * 4 * std::min(across * across, rows);
  // Blocks of 8 voxels a side reach as far beyond the band as they are wide.
  const double most = cells / 512 + 1;
  const double blocks =
      factors.everywhere ? most : std::min(area * (2 * factors.band + 8) / 512, most);
  constexpr double kTreeBytes = 300;  // a triangle and its share of boxes
  if (factors.everywhere) bytes.bins += triangles * kTreeBytes;
  const double share = factors.everywhere ? static_cast<double>(kFieldLayers) / grid.dims.z
                                          : densest_share(*factors.mesh, grid) *
                                                (1 + (2 * factors.band + 8) / kFieldLayers);
  bytes.held = std::min(1.0, share);
  bytes.layers = blocks * bytes.held * 2100 + factors.threads * 1e6;
  bytes.output = blocks * 150 + bytes.voxels * 4;
  return bytes;
}

double output_bytes(const VoxelGrid& voxels, const VoxelGrid& grid, const MemoryFactors& factors,
                    double area) {
  if (factors.format.empty()) return 0;
  if (factors.format == "vdb") {
    // A surface of area A meets about 1.5 A / 64 leaves, of 64 bytes and their share of nodes; ids
    // are a zlib stream a leaf, which takes about as much, fractions about four times that.
    const double leaf = factors.ids ? 144 : factors.fog ? 600 : 72;
    const double there = std::ceil(voxels.dims.x / 8.0) * std::ceil(voxels.dims.y / 8.0) *
                         std::ceil(voxels.dims.z / 8.0);
    const int fine = std::max({factors.samples, factors.rays, 1});
    return std::min(area / (fine * fine) * 1.5 / 64, there) * leaf;
  }
  if (factors.format == "binvox") {
    const double longest = std::max({grid.dims.x, grid.dims.y, grid.dims.z});
    return columns(grid, factors.axis) * 8 + longest * longest / 127 * factors.threads;
  }
  if (factors.rays > 0) return 16e6 + columns(voxels, factors.axis);
  // Formats written piece by piece: a few blocks of packed or compressed voxels.
  constexpr double kBlocks = 1.5e6;
  return kBlocks * factors.threads;
}

}  // namespace

MemoryEstimate estimate_memory(const VoxelGrid& voxels, const MemoryFactors& factors) {
  const int fine = std::max({factors.samples, factors.rays, 1});
  VoxelGrid grid = voxels;  // that is walked: of the samples
  grid.dims *= fine;
  grid.voxel_size /= fine;
  // Of a tree also whose each triangle is.
  const auto triangles = static_cast<double>(factors.mesh->triangles.size());
  const double owners = factors.is_tree ? triangles * 4 : 0.0;
  const double area = faces_of(factors, grid);
  const DistanceBytes distances = distance_bytes(grid, factors, area);
  MemoryEstimate estimate;
  estimate.mesh =
      rounded(static_cast<double>(factors.mesh->positions.size()) * (24 + 12) + triangles * 12 +
              static_cast<double>(factors.mesh->face_elements.size()) * 4 + owners);
  estimate.bins = rounded(bin_bytes(grid, factors, area) + distances.bins);
  estimate.slabs = rounded(slab_bytes(grid, factors, area) + distances.layers);
  double output = output_bytes(voxels, grid, factors, area);
  if (factors.band > 0) {
    // Other formats than .vdb take runs of a value and a label; of .zarr all are kept, twice.
    const double runs = distances.voxels * 8;
    output = factors.format == "vdb"    ? distances.output
             : factors.format == "zarr" ? output + 2 * runs
                                        : output + runs * distances.held;
  }
  estimate.output = rounded(factors.format.empty() ? 0 : output);
  return estimate;
}

}  // namespace strata
