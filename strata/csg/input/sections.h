#pragma once

#include <glm/vec3.hpp>
#include <span>

#include "strata/csg/scene/scene.h"
#include "strata/raster/view.h"

namespace strata::csg {

/// A section: points p with dot(normal, p) > offset are cut away.
struct SectionPlane {
  glm::dvec3 normal{0.0};    ///< of length 1
  double offset = 0;         ///< world units from the origin, along the normal
  bool towards_eye = false;  ///< true: the side of the eye is cut away
};

/// The plane as it cuts for a camera: one that is towards_eye is turned, and stays as it is then.
[[nodiscard]] SectionPlane facing(SectionPlane plane, const Camera& camera);

/// Cuts the scene and its ghosts by the sections.
void cut_scene(Scene& scene, std::span<const SectionPlane> cuts, const Camera& camera);

}  // namespace strata::csg
