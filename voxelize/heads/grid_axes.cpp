#include "voxelize/heads/grid_axes.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <utility>

#include "core/letters.h"
#include "strata/voxelize/grid_fit.h"

namespace strata {
namespace {

// Cosines in double precision are off by 1e-16; what is closer than this to an axis is the axis.
constexpr double kStraight = 1e-12;
// Of files whose directions are floats or have four decimals.
constexpr double kRightAngle = 1e-4;

/// A direction along an axis, but for rounding, becomes it.
void straighten(glm::dmat3& direction) {
  glm::dmat3 straight = direction;
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) {
      const double nearest = std::round(straight[column][row]);
      if (std::abs(straight[column][row] - nearest) > kStraight) return;
      straight[column][row] = nearest + 0.0;  // no -0
    }
  }
  direction = straight;
}

}  // namespace

Result<VoxelFileGrid> grid_of_axes(const std::string& path, const GridAxes& axes) {
  VoxelFileGrid result;
  for (int axis = 0; axis < 3; ++axis) {
    const double size = axes.sizes[static_cast<std::size_t>(axis)];
    if (!(size >= 1.0) || std::floor(size) != size) {
      return fail(ErrorCode::kInput, "{}: {} voxels along axis {}; it must be 1 or more", path,
                  size, axis);
    }
    if (size > kMaxGridSide) {
      return fail(ErrorCode::kLimit, "{}: {} voxels along axis {}; the limit is {}", path, size,
                  axis, kMaxGridSide);
    }
    result.grid.dims[axis] = static_cast<int>(size);
    const glm::dvec3 step = axes.steps[axis];
    const double length = glm::length(step);
    if (!(length > 0.0) || !std::isfinite(length)) {
      return fail(ErrorCode::kInput,
                  "{}: the step from a voxel to the next along axis {} is ({}, {}, {}); its length "
                  "must be above 0 and finite",
                  path, axis, step.x, step.y, step.z);
    }
    result.grid.voxel_size[axis] = length;
    result.frame.direction[axis] = step / length;
    // Along an axis of the world its length is exact.
    for (int c = 0; c < 3; ++c) {
      if (step[(c + 1) % 3] != 0.0 || step[(c + 2) % 3] != 0.0) continue;
      result.grid.voxel_size[axis] = std::abs(step[c]);
      result.frame.direction[axis] = glm::dvec3(0.0);
      result.frame.direction[axis][c] = step[c] < 0.0 ? -1.0 : 1.0;
    }
  }
  glm::dmat3& direction = result.frame.direction;
  straighten(direction);
  for (const auto& [a, b] : {std::pair(0, 1), std::pair(0, 2), std::pair(1, 2)}) {
    const double cosine = glm::dot(direction[a], direction[b]);
    if (std::abs(cosine) <= kRightAngle) continue;
    return fail(
        ErrorCode::kInput,
        "{}: axes {} and {} of the grid are at {:.3f} degrees; they must be at right angles", path,
        a, b, std::acos(cosine) * 57.29577951308232);
  }
  const glm::dvec3 place =
      result.frame.turned() ? glm::inverse(direction) * axes.place : axes.place;
  result.grid.origin = axes.corner ? place : place - 0.5 * result.grid.voxel_size;
  if (auto valid = check_grid(result.grid); !valid) {
    return fail(ErrorCode::kInput, "{}: {}", path, valid.error().message);
  }
  return result;
}

Result<VoxelFileGrid> grid_of_frame(const std::string& path, const std::array<double, 3>& sizes,
                                    const glm::dvec3& origin, const glm::dvec3& spacing,
                                    const glm::dmat3& direction) {
  GridAxes axes;
  axes.sizes = sizes;
  for (int axis = 0; axis < 3; ++axis) {
    const double length = glm::length(direction[axis]);
    if (!(std::abs(length - 1.0) <= kRightAngle)) {
      return fail(ErrorCode::kInput, "{}: column {} of the direction is {} long; it must be 1",
                  path, axis, length);
    }
    if (!(spacing[axis] > 0.0)) {
      return fail(ErrorCode::kInput, "{}: the spacing along axis {} must be above 0, got {}", path,
                  axis, spacing[axis]);
    }
    axes.steps[axis] = direction[axis] * spacing[axis];
  }
  auto result = grid_of_axes(path, axes);
  if (!result) return result;
  result->grid.origin = origin;
  result->grid.voxel_size = spacing;  // not the length of a rounded product
  if (auto valid = check_grid(result->grid); !valid) {
    return fail(ErrorCode::kInput, "{}: {}", path, valid.error().message);
  }
  return result;
}

double unit_named(std::string_view name) {
  constexpr std::pair<std::string_view, double> kUnits[] = {
      {"um", 1e-6},        {"micrometer", 1e-6}, {"micrometre", 1e-6}, {"micron", 1e-6},
      {"microns", 1e-6},   {"mm", 1e-3},         {"millimeter", 1e-3}, {"millimetre", 1e-3},
      {"cm", 1e-2},        {"centimeter", 1e-2}, {"centimetre", 1e-2}, {"m", 1.0},
      {"meter", 1.0},      {"metre", 1.0},       {"in", 0.0254},       {"inch", 0.0254},
      {"ft", 0.3048},      {"foot", 0.3048},     {"nm", 1e-9},         {"nanometer", 1e-9},
      {"nanometre", 1e-9}, {"\xc2\xb5m", 1e-6}};
  for (const auto& [unit, metres] : kUnits) {
    if (same_word(unit, name)) return metres;
  }
  return 0.0;
}

}  // namespace strata
