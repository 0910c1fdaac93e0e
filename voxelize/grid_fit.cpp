#include "strata/voxelize/grid_fit.h"

#include <algorithm>
#include <cmath>

#include "strata/raster/lattice_mesh.h"

namespace strata {
namespace {

constexpr const char* kAxisNames[3] = {"x", "y", "z"};

// Vertices are snapped to the nearest lattice point, so what is less than half a step beyond a
// border comes to lie on it. This also absorbs the rounding of the divisions here, which is below
// 2^-30 voxels for any grid that can be had.
constexpr double kHalfStep = 0.5 / kLatticeSteps;

bool finite(const glm::dvec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

/// The box that the grid shall cover.
Result<Bounds> covered_box(const Bounds& mesh_bounds, const GridRequest& request) {
  const bool given = request.bounds.has_value();
  Bounds box = given ? *request.bounds : mesh_bounds;
  if (!given && box.empty())
    return fail(ErrorCode::kGeometry, "the mesh has no triangles to fit a grid to");
  if (given && request.origin) {
    return fail(ErrorCode::kUsage,
                "bounds and an origin cannot be combined: each sets the lower corner");
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (!std::isfinite(box.low[axis]) || !std::isfinite(box.high[axis]) ||
        !std::isfinite(box.high[axis] - box.low[axis])) {
      return fail(ErrorCode::kGeometry, "the {} from {} to {} along {}; this range is too large",
                  given ? "bounds run" : "mesh runs", box.low[axis], box.high[axis],
                  kAxisNames[axis]);
    }
    if (!(box.low[axis] <= box.high[axis])) {
      return fail(ErrorCode::kUsage, "the bounds end at {} = {}, before they begin at {}",
                  kAxisNames[axis], box.high[axis], box.low[axis]);
    }
    if (!request.origin) continue;
    if (box.high[axis] < (*request.origin)[axis]) {
      return fail(ErrorCode::kGeometry, "the mesh ends at {} = {}, below the origin {}",
                  kAxisNames[axis], box.high[axis], (*request.origin)[axis]);
    }
    box.low[axis] = (*request.origin)[axis];
  }
  return box;
}

/// World length of a voxel. @pre the request has passed its check
Result<glm::dvec3> voxel_size_for(const Bounds& box, const GridRequest& request) {
  const glm::dvec3 extent = box.high - box.low;
  const double longest = box.longest_side();
  if (!(longest > 0.0)) {
    return fail(ErrorCode::kGeometry, "the mesh has no extent: all of it lies at ({}, {}, {})",
                box.low.x, box.low.y, box.low.z);
  }
  if (request.voxel_size) return *request.voxel_size;
  if (!(longest > 1e-300)) {
    return fail(ErrorCode::kGeometry, "the mesh is {} long, which is too small to be divided",
                longest);
  }
  if (request.resolution) {
    return glm::dvec3(longest / static_cast<double>(*request.resolution));
  }
  if (request.cubic) {
    return glm::dvec3(longest / static_cast<double>(*request.cubic - 2 * request.padding));
  }
  glm::dvec3 size;
  double least = longest;  // of the sides that have a length: for those that have none
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t inner =
        (*request.dims)[static_cast<std::size_t>(axis)] - 2 * request.padding;
    size[axis] = extent[axis] / static_cast<double>(inner);
    if (extent[axis] > 0.0) least = std::min(least, size[axis]);
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (!(extent[axis] > 0.0)) size[axis] = least;
  }
  return size;
}

Result<void> check_cubic(const GridRequest& request) {
  const std::int64_t count = *request.cubic;
  if (count < 1) {
    return fail(ErrorCode::kUsage, "a cubic grid must have at least 1 voxel a side, got {}", count);
  }
  if (count > kMaxGridSide) {
    return fail(ErrorCode::kLimit, "a cubic grid must have at most {} voxels a side, got {}",
                kMaxGridSide, count);
  }
  if (count <= 2 * request.padding) {
    return fail(ErrorCode::kUsage, "the {} voxels a side of the cubic grid are all padding", count);
  }
  if (request.align || request.origin) {
    return fail(ErrorCode::kUsage,
                "a cubic grid has the mesh in its middle; {} cannot be combined with it",
                request.align ? "alignment" : "an origin");
  }
  return {};
}

/// The lattice must still tell its points apart where the grid lies.
Result<void> check_resolved(const VoxelGrid& grid, int axis) {
  const double s = grid.voxel_size[axis], step = s / kLatticeSteps;
  const double far =
      std::max(std::abs(grid.origin[axis]), std::abs(grid.origin[axis] + grid.dims[axis] * s));
  if (std::isfinite(far) && step > 0.0 && far + step > far) return {};
  return fail(ErrorCode::kGeometry,
              "voxels of {} are too small for coordinates of {} along {}: double precision "
              "cannot resolve them",
              s, far, kAxisNames[axis]);
}

/// A cube of voxels with the box in its middle.
Result<VoxelGrid> cubic_grid(const Bounds& box, const GridRequest& request, double size) {
  VoxelGrid grid;
  grid.dims = glm::ivec3(static_cast<int>(*request.cubic));
  grid.voxel_size = glm::dvec3(size);
  const glm::dvec3 extent = box.high - box.low;
  const double longest = box.longest_side();
  for (int axis = 0; axis < 3; ++axis) {
    // Along the longest side the padding is left, and nothing is rounded.
    const double before = extent[axis] == longest
                              ? static_cast<double>(request.padding) * size
                              : 0.5 * (static_cast<double>(grid.dims[axis]) * size - extent[axis]);
    grid.origin[axis] = box.low[axis] - before;
    if (auto fine = check_resolved(grid, axis); !fine) return tl::unexpected(fine.error());
  }
  return grid;
}

}  // namespace

Result<void> check_grid_request(const GridRequest& request) {
  const int sizes = int{request.resolution.has_value()} + int{request.voxel_size.has_value()} +
                    int{request.dims.has_value()} + int{request.cubic.has_value()};
  if (sizes != 1) {
    return fail(ErrorCode::kUsage,
                "exactly one of resolution, voxel size, grid and cubic must be given, got {}",
                sizes);
  }
  if (request.resolution && *request.resolution < 1) {
    return fail(ErrorCode::kUsage, "the resolution must be at least 1 voxel, got {}",
                *request.resolution);
  }
  if (request.padding < 0) {
    return fail(ErrorCode::kUsage, "the padding must be at least 0 voxels, got {}",
                request.padding);
  }
  if (request.padding >= kMaxGridSide / 2) {
    return fail(ErrorCode::kLimit,
                "a padding of {} voxels is too large: a grid has at most {} along a side",
                request.padding, kMaxGridSide);
  }
  if (request.resolution && *request.resolution > kMaxGridSide - 2 * request.padding) {
    return fail(
        ErrorCode::kLimit,
        "a resolution of {} voxels with a padding of {} exceeds the limit of {} along a side",
        *request.resolution, request.padding, kMaxGridSide);
  }
  if (request.cubic) {
    if (auto valid = check_cubic(request); !valid) return valid;
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (request.voxel_size && !((*request.voxel_size)[axis] > 0.0)) {
      return fail(ErrorCode::kUsage, "the voxel size along {1} must be above 0, got {0}",
                  (*request.voxel_size)[axis], kAxisNames[axis]);
    }
    if (request.voxel_size && !std::isfinite((*request.voxel_size)[axis])) {
      return fail(ErrorCode::kUsage, "the voxel size along {1} must be finite, got {0}",
                  (*request.voxel_size)[axis], kAxisNames[axis]);
    }
    if (!request.dims) continue;
    const std::int64_t count = (*request.dims)[static_cast<std::size_t>(axis)];
    if (count < 1) {
      return fail(ErrorCode::kUsage, "the grid must have at least 1 voxel along {1}, got {0}",
                  count, kAxisNames[axis]);
    }
    if (count <= 2 * request.padding) {
      return fail(ErrorCode::kUsage, "the {} voxels of the grid along {} are all padding", count,
                  kAxisNames[axis]);
    }
    if (count > kMaxGridSide) {
      return fail(ErrorCode::kLimit, "the grid must have at most {2} voxels along {1}, got {0}",
                  count, kAxisNames[axis], kMaxGridSide);
    }
  }
  if (request.align && request.dims) {
    return fail(ErrorCode::kUsage, "a grid of fixed size cannot be aligned; give the voxel size");
  }
  if (request.align && request.origin) {
    return fail(ErrorCode::kUsage, "an origin and alignment cannot be combined");
  }
  if (request.origin && !finite(*request.origin)) {
    return fail(ErrorCode::kUsage, "the origin ({}, {}, {}) must be finite", request.origin->x,
                request.origin->y, request.origin->z);
  }
  return {};
}

Result<VoxelGrid> fit_grid(const Bounds& mesh_bounds, const GridRequest& request) {
  if (auto valid = check_grid_request(request); !valid) return tl::unexpected(valid.error());
  const auto box = covered_box(mesh_bounds, request);
  if (!box) return tl::unexpected(box.error());
  const auto size = voxel_size_for(*box, request);
  if (!size) return tl::unexpected(size.error());

  if (request.cubic) return cubic_grid(*box, request, size->x);
  VoxelGrid grid;
  grid.voxel_size = *size;
  const auto padding = static_cast<double>(request.padding);
  for (int axis = 0; axis < 3; ++axis) {
    const double s = grid.voxel_size[axis];
    const double low = box->low[axis], high = box->high[axis];
    // The lower corner in voxels from the world's origin; only multiples need it.
    const double first = request.align ? std::floor(low / s + kHalfStep) : 0.0;
    const double reach = request.align ? high / s - first : (high - low) / s;
    double count = std::max(1.0, std::ceil(reach - kHalfStep));
    if (request.dims) {
      count = static_cast<double>((*request.dims)[static_cast<std::size_t>(axis)]) - 2 * padding;
    }
    const double total = count + 2 * padding;
    if (!(total <= kMaxGridSide)) {
      return fail(ErrorCode::kLimit, "voxels of {} make a grid of {:.0f} along {}; the limit is {}",
                  s, total, kAxisNames[axis], kMaxGridSide);
    }
    grid.dims[axis] = static_cast<int>(total);
    grid.origin[axis] = request.align ? (first - padding) * s : low - padding * s;
    // A flat side would lie on the border of its voxels, where no centre is near it.
    if (!(high > low) && !request.align && !request.origin) grid.origin[axis] -= 0.5 * count * s;
    if (auto fine = check_resolved(grid, axis); !fine) return tl::unexpected(fine.error());
  }
  return grid;
}

Result<void> check_grid(const VoxelGrid& grid) {
  for (int axis = 0; axis < 3; ++axis) {
    if (grid.dims[axis] < 1 || grid.dims[axis] > kMaxGridSide) {
      return fail(ErrorCode::kUsage, "a grid must have 1 to {} voxels along {}, got {}",
                  kMaxGridSide, kAxisNames[axis], grid.dims[axis]);
    }
    const double size = grid.voxel_size[axis], origin = grid.origin[axis];
    if (!(size > 0) || !std::isfinite(size)) {
      return fail(ErrorCode::kUsage,
                  "a grid's voxel size along {} must be finite and above 0, got {}",
                  kAxisNames[axis], size);
    }
    if (!std::isfinite(origin)) {
      return fail(ErrorCode::kUsage, "a grid's origin along {} must be finite, got {}",
                  kAxisNames[axis], origin);
    }
  }
  return {};
}

}  // namespace strata
