#pragma once

#include <cstdint>
#include <span>
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
  /// Where the plane of a face is.
  /// @param point  of the plane, in eye space
  [[nodiscard]] SeenPlane plane(const glm::dvec3& normal, const glm::dvec3& point) const;
  /// How open the face in a plane is at pixels of the picture from (u, v) on, in [0, 1].
  void along(int u, int v, const SeenPlane& plane, std::span<float> values) const;
  /// Whether along() gives 1 for `count` pixels from (u, v) on, whatever their plane.
  [[nodiscard]] bool open_along(int u, int v, int count) const;

 private:
  /// Of a pixel's middle among those of open_.
  [[nodiscard]] float place(int pixel) const {
    return (static_cast<float>(pixel) + 0.5f) * step_ - 0.5f;
  }

  EyeSurfaces surfaces_;
  std::vector<std::uint8_t> open_;
  float step_ = 1.0f;  ///< pixels of open_ a pixel of the picture
};

}  // namespace strata::csg
