#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "csg/measure/round_fit.h"
#include "csg/measure/snap_points.h"
#include "csg/measure/tree_rays.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/picture/picture.h"
#include "strata/raster/view.h"

// What is measured at one pixel of a picture.

namespace strata::view {

/// What is wanted of a probe.
struct ProbeWish {
  bool snap = false;       ///< to corners, middles of edges, and edges
  bool thickness = false;  ///< along the normal and along the ray
  bool round = false;      ///< a cylinder, sphere or circle
  bool size = false;       ///< of the solid that the face comes from
  friend bool operator==(const ProbeWish&, const ProbeWish&) = default;
};

/// The sizes of one solid, whatever else of the scene cuts it.
struct SolidSize {
  Bounds box;
  double volume = 0, area = 0;
};

struct Probe {
  glm::ivec2 pixel{0};
  bool hit = false;         ///< there is a face
  bool section = false;     ///< the face is a section's: it belongs to no solid
  csg::SurfacePoint point;  ///< where the ray meets it
  csg::Snap snap = csg::Snap::kFace;
  glm::dvec3 where{0.0};                   ///< the point, or what it was moved to
  double along_normal = 0, along_ray = 0;  ///< thickness; infinity: it is never left
  csg::RoundFit round;
  SolidSize size;
};

/// How far a pick is moved, in pixels.
inline constexpr double kSnapVertex = 12, kSnapMidpoint = 10, kSnapEdge = 6;

/// Measures at a pixel. Needs the drawing of a few pixels around it. A point is only moved to what
/// can be seen. @param preview,rays  of one tree @param view  of the whole picture
/// @return as Preview::draw()
Result<Probe> probe(csg::Preview& preview, const csg::TreeRays& rays, const View& view,
                    const glm::ivec2& pixel, const ProbeWish& wish, const Execution& execution);

/// A view of one part of a picture: the same lattice, moved by whole pixels.
[[nodiscard]] View part_of(const View& view, const glm::ivec2& first, const glm::ivec2& size);

}  // namespace strata::view
