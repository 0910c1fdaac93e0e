#include "strata/raster/lattice_mesh.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>
#include <utility>

#include "mesh/clamp.h"

namespace strata {
namespace {

constexpr std::size_t kNoVertex = ~std::size_t{0};

/// Snaps vertices [begin, end). Returns the first that is out of range or not finite, or kNoVertex.
std::size_t snap_range(const TriangleSoup& mesh, const VoxelGrid& grid, std::size_t begin,
                       std::size_t end, glm::ivec3* out) {
  const glm::dvec3 scale = static_cast<double>(kLatticeSteps) / grid.voxel_size;
  const glm::dvec3 origin = grid.origin;
  constexpr double kLimit = kMaxLatticeCoordinate;
  const auto floor_of = [](double value) {  // |value| < 2^31; exact, and no call into libm
    const auto truncated = static_cast<std::int32_t>(value);
    return truncated - static_cast<std::int32_t>(value < static_cast<double>(truncated));
  };
  for (std::size_t i = begin; i < end; ++i) {
    const glm::dvec3 t = (mesh.positions[i] - origin) * scale + 0.5;
    const double largest = std::max({std::abs(t.x), std::abs(t.y), std::abs(t.z)});
    // Written so that NaN fails it; max() may hide a NaN, the sum does not.
    if (!(largest <= kLimit) || !(t.x + t.y + t.z <= 3 * kLimit)) return i;
    out[i] = {floor_of(t.x), floor_of(t.y), floor_of(t.z)};
  }
  return kNoVertex;
}

}  // namespace

Result<LatticeMesh> snap_to_lattice(const TriangleSoup& mesh, const VoxelGrid& grid,
                                    const Execution& execution) {
  LatticeMesh result;
  result.vertices.resize(mesh.positions.size());
  result.triangles = mesh.triangles;
  constexpr std::size_t kChunk = 4096;
  const std::size_t count = mesh.positions.size();
  std::atomic<std::size_t> bad{kNoVertex};
  parallel_for(execution, (count + kChunk - 1) / kChunk, [&](std::size_t chunk, int) {
    const std::size_t begin = chunk * kChunk;
    const std::size_t found =
        snap_range(mesh, grid, begin, std::min(count, begin + kChunk), result.vertices.data());
    std::size_t seen = bad.load();
    while (found < seen && !bad.compare_exchange_weak(seen, found)) {
    }
  });
  // Vertices have no value where the work was not begun.
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  if (bad != kNoVertex) {
    const glm::dvec3 p = mesh.positions[bad];
    return fail(ErrorCode::kGeometry,
                "vertex {} at ({}, {}, {}) is not within 2^20 voxels of the grid's origin ({}, {}, "
                "{}); the voxel size is ({}, {}, {})",
                bad.load(), p.x, p.y, p.z, grid.origin.x, grid.origin.y, grid.origin.z,
                grid.voxel_size.x, grid.voxel_size.y, grid.voxel_size.z);
  }
  return result;
}

Result<std::vector<std::uint32_t>> fit_lattice(TriangleSoup& mesh, const Bounds& box,
                                               const VoxelGrid& grid, const Execution& execution) {
  constexpr double kMostVoxels = kMaxLatticeCoordinate / kLatticeSteps - 1;
  if (box.empty()) return {};
  bool fits = true;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double at : {box.low[axis], box.high[axis]}) {
      fits = fits && std::abs(at - grid.origin[axis]) / grid.voxel_size[axis] <= kMostVoxels;
      if (std::abs(at) < kMostClamped) continue;
      return fail(ErrorCode::kGeometry,
                  "the mesh reaches {} = {:g}; coordinates must be below {:g}", "xyz"[axis], at,
                  kMostClamped);
    }
  }
  if (fits) return {};
  // As far around the grid as it is from there to the lattice's end, about.
  const glm::dvec3 around = kMostVoxels / 2 * grid.voxel_size;
  const Bounds kept{grid.origin - around,
                    grid.origin + glm::dvec3(grid.dims) * grid.voxel_size + around};
  ClampedMesh cut = clamp_to_box(mesh.positions, mesh.triangles, kept, execution.stop);
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  std::vector<std::uint32_t> elements;
  elements.reserve(cut.sources.size());
  for (const std::uint32_t source : cut.sources) {
    elements.push_back(mesh.face_elements.empty() ? source : mesh.face_elements[source]);
  }
  mesh.positions = std::move(cut.positions);
  mesh.triangles = std::move(cut.triangles);
  mesh.face_elements = std::move(elements);
  return std::move(cut.sources);
}

}  // namespace strata
