#pragma once

#include <algorithm>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "strata/core/grid.h"
#include "strata/voxelize/picture/voxel_picture.h"

namespace strata {

/// Where the voxels of a slice lie in a picture.
class SlicePlace {
 public:
  /// The share of the picture that the slice may fill.
  static constexpr double kFill = 0.94;

  SlicePlace(const VoxelGrid& grid, const VoxelSlice& slice, const glm::ivec2& size)
      : slice_(slice),
        frame_(slice.axis),
        columns_(grid.dims[frame_.u]),
        rows_(grid.dims[frame_.v]) {
    const double width = columns_ * grid.voxel_size[frame_.u];
    const double height = rows_ * grid.voxel_size[frame_.v];
    const double scale = kFill * std::min(size.x / width, size.y / height);
    pixels_ = glm::dvec2(scale * grid.voxel_size[frame_.u], scale * grid.voxel_size[frame_.v]);
    corner_ = (glm::dvec2(size) - pixels_ * glm::dvec2(columns_, rows_)) * 0.5;
  }
  /// In voxels from the lower left corner of the slice; v goes up.
  [[nodiscard]] glm::dvec2 voxels(const glm::dvec2& pixel) const {
    const glm::dvec2 at = (pixel - corner_) / pixels_;
    return {at.x, rows_ - at.y};
  }
  [[nodiscard]] bool holds(const glm::dvec2& at) const {
    return at.x >= 0 && at.y >= 0 && at.x < columns_ && at.y < rows_;
  }
  [[nodiscard]] glm::ivec3 voxel(int a, int b) const {
    glm::ivec3 at;
    at[frame_.u] = std::clamp(a, 0, columns_ - 1);
    at[frame_.v] = std::clamp(b, 0, rows_ - 1);
    at[frame_.w] = slice_.index;
    return at;
  }
  /// The corners of the slice in pixels, the upper left one and the lower right one.
  [[nodiscard]] const glm::dvec2& begin() const { return corner_; }
  [[nodiscard]] glm::dvec2 end() const { return corner_ + pixels_ * glm::dvec2(columns_, rows_); }
  /// Pixels a voxel.
  [[nodiscard]] const glm::dvec2& pixels() const { return pixels_; }

 private:
  VoxelSlice slice_;
  AxisFrame frame_;
  int columns_, rows_;
  glm::dvec2 pixels_{1.0}, corner_{0.0};
};

}  // namespace strata
