#pragma once

#include <cstdint>
#include <vector>

#include "csg/geometry.h"
#include "csg/picture/solid_normals.h"
#include "picture/occlusion.h"
#include "strata/core/execution.h"
#include "strata/csg/surface/surface_image.h"
#include "strata/raster/view.h"

namespace strata::csg {

/// How open the visible surfaces of a picture are, at a resolution of its own. Private to csg/.
class ViewOpenness {
 public:
  /// All is open.
  ViewOpenness() = default;
  /// The view that occlusion looks at: half of the picture's resolution, all of it for small
  /// pictures, at most 1024 pixels along a side.
  static View reduced(const View& whole);
  /// @param image    the surfaces of reduced(whole)
  /// @param normals  of curved solids
  ViewOpenness(const View& whole, const SurfaceImage& image, const Geometry& geometry,
               const SolidNormals& normals, const Execution& execution);

  [[nodiscard]] bool all_open() const { return open_.empty(); }
  /// Where the plane of a face is, for `at`.
  struct Plane {
    glm::vec3 normal{0.0f};  ///< in eye space, of length 1, towards the eye
    float offset = 0.0f;     ///< of the plane along the normal, as EyeSurfaces has positions
  };
  /// @param point  of the plane, in eye space
  [[nodiscard]] Plane plane(const glm::dvec3& normal, const glm::dvec3& point) const;
  /// How open the face in a plane is at pixel (u, v) of the picture, in [0, 1].
  [[nodiscard]] float at(int u, int v, const Plane& plane) const;

 private:
  EyeSurfaces surfaces_;
  std::vector<std::uint8_t> open_;
  float step_ = 1.0f;  ///< pixels of open_ a pixel of the picture
};

}  // namespace strata::csg
