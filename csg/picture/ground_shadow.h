#pragma once

#include <cstdint>
#include <functional>
#include <glm/mat3x3.hpp>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/surface/surface_image.h"
#include "strata/mesh/soup_tools.h"
#include "strata/picture/pixels.h"
#include "strata/raster/view.h"

namespace strata::csg {

/// A soft shadow on the plane that the result stands on: a point of it is the darker, the more of
/// the sky is hidden by the columns between the lowest and the highest surface. Private to csg/.
class GroundShadow {
 public:
  /// Draws surfaces.
  using Draw = std::function<Result<const SurfaceImage*>(const View& view)>;

  /// Looks at the result from below and from above. @param box  around it @return as `draw`
  static Result<GroundShadow> make(const Bounds& box, const Draw& draw, const Execution& execution);

  /// Puts the shadow behind what a picture shows: its empty parts get black with an alpha. Nothing
  /// from below the plane. @param view  of the whole picture
  void lay_under(Picture& picture, const View& view, const Execution& execution) const;

 private:
  /// Heights of the lowest and of the highest surface, pixel by pixel.
  void add_columns(const std::vector<double>& low, const std::vector<double>& high,
                   double pixels_a_unit, const Execution& execution);
  /// In [0, 1], at a point of the map.
  [[nodiscard]] float at(const glm::dvec2& pixel) const;

  double height_ = 0.0;              ///< of the plane, z
  glm::dmat3 map_from_ground_{1.0};  ///< from (x, y, 1) on the plane to pixels of the map
  std::vector<float> dark_;          ///< kSide x kSide; empty: no shadow
};

}  // namespace strata::csg
