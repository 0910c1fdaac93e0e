#pragma once

#include <array>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <span>

#include "strata/core/grid.h"
#include "strata/raster/view.h"
#include "strata/voxelize/picture/voxel_picture.h"
#include "voxelize/picture/voxel_ray.h"

namespace strata {

/// A ray of a view, in voxels; its parameter is the distance along the view axis in world units.
struct ViewRay {
  glm::dvec3 origin{0.0}, direction{0.0};
  RayStart start;
  double end = std::numeric_limits<double>::infinity();
};

/// The rays of a view, between sections.
class ViewRays {
 public:
  ViewRays(const View& view, const VoxelGrid& grid, std::span<const VoxelSection> sections);

  /// @param at  in pixels
  [[nodiscard]] ViewRay at(const glm::dvec2& at) const;
  /// How the direction of the ray changes with a pixel to the right and down; 0 where rays are
  /// parallel, and then the origin changes.
  [[nodiscard]] const glm::dvec3& across() const { return across_; }
  [[nodiscard]] const glm::dvec3& down() const { return down_; }
  [[nodiscard]] bool perspective() const { return perspective_; }
  /// The part of the grid that sections along the borders of voxels leave.
  [[nodiscard]] const RayBox& box() const { return box_; }
  /// Pixels a world unit, at distance 1 in perspective.
  [[nodiscard]] double scale() const { return scale_; }

 private:
  /// A section that cuts voxels, in voxels.
  struct Cut {
    glm::dvec3 normal;
    double offset;
    int section;
  };

  bool perspective_;
  double scale_;
  glm::dvec3 corner_{0.0}, across_{0.0}, down_{0.0};  ///< of what changes with the pixel
  glm::dvec3 fixed_{0.0};                             ///< the eye, or the direction
  RayBox box_;
  std::vector<Cut> cuts_;
};

}  // namespace strata
