#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "strata/core/execution.h"
#include "strata/raster/view.h"
#include "strata/transparency/stream/transparent_scene.h"
#include "transparency/media/media_table.h"

namespace strata::transparency {

/// A closed solid that the near plane cuts: rays begin inside of it, or cross it before the near
/// plane, where lists have no crossings.
struct EyeSolid {
  std::uint32_t solid = 0;  ///< index into MediaTable::solids
  bool eye_inside = false;
  /// The plane of the triangle that is nearest to the eye: dot(normal, x) = offset in eye space.
  glm::dvec3 normal{0.0};
  double offset = 0.0;

  /// Where a ray from the eye crosses the wall, if that is at most `near` away.
  [[nodiscard]] double wall(const glm::dvec3& direction, double near) const {
    const double t = offset / glm::dot(normal, direction);
    return t >= 0.0 && t <= near ? t : near;
  }
};

/// Those of a perspective view. Open solids are none: where the eye is cannot be said.
[[nodiscard]] std::vector<EyeSolid> find_eye_solids(const Scene& scene, const MediaTable& table,
                                                    const View& view, const Execution& execution);

}  // namespace strata::transparency
