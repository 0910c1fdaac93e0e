#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <vector>

#include "picture/occlusion.h"
#include "strata/core/execution.h"
#include "strata/raster/view.h"

namespace strata {

/// What one ray sees, before light.
struct SeenVoxel {
  glm::vec3 colour{0.0f};              ///< 0 to 1
  glm::vec3 normal{0.0f, 0.0f, 1.0f};  ///< that light falls on; eye space, of length 1
  glm::vec3 face{0.0f, 0.0f, 1.0f};    ///< the normal of what is around: a face's, or `normal`
  /// Along the view axis; infinite: nothing is seen.
  float distance = std::numeric_limits<float>::infinity();
  float corner = 1.0f;  ///< light that voxels beside the face leave
  float line = 1.0f;    ///< light that lines along voxels leave
  bool cut = false;     ///< the cut of a section

  [[nodiscard]] bool found() const { return distance < std::numeric_limits<float>::infinity(); }
};

/// How much of their surroundings the points of a picture see, from one in four pixels.
class SeenOpenness {
 public:
  /// All sees all.
  SeenOpenness() = default;
  /// @param seen  a picture, pixel by pixel @param radius  what is farther does not count
  SeenOpenness(const View& view, const std::vector<SeenVoxel>& seen, double radius,
               const Execution& execution);

  /// Of what a ray through a point of the picture sees, 0 to 1.
  [[nodiscard]] float at(const glm::dvec2& pixel, const SeenVoxel& seen) const;

 private:
  [[nodiscard]] glm::vec3 position(const glm::dvec2& pixel, double distance) const;

  EyeSurfaces surfaces_;
  std::vector<std::uint8_t> open_;
  int step_ = 1;        ///< pixels of the picture a pixel of open_
  double scale_ = 1.0;  ///< as EyeSurfaces::scale, of the whole picture
  glm::dvec2 centre_{0.0};
};

}  // namespace strata
