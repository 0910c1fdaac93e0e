#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "csg/outline/outline.h"
#include "csg/outline/segments.h"
#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"

namespace strata::csg {

struct LinearExtrude {
  glm::dvec3 direction{0, 0, 1};  ///< unit vector
  double height = 100;
  bool centre = false;
  double twist = 0;  ///< degrees, clockwise looking down
  glm::dvec2 scale{1};
  int slices = 0;               ///< 0: the number follows from `segments`
  int outline_segments = 0;     ///< newer dialect: divide edges to this number; 0: do not
  bool divide_outline = false;  ///< newer dialect: divide the edges of twisted outlines
  Segments segments;
};
/// The number of pieces that an extrusion makes, for limits.
struct ExtrusionSize {
  double steps = 0;      ///< slices, or steps around the axis
  double triangles = 0;  ///< approximate
};
[[nodiscard]] ExtrusionSize size_of(const Outline& outline, const LinearExtrude& options);
/// A closed mesh with shared vertices. Empty for an empty outline, for height <= 0 and beyond 2^28
/// vertices.
[[nodiscard]] TriangleSoup linear_extrude(const Outline& outline, const LinearExtrude& options,
                                          OutlineJob* job = nullptr);

struct RotateExtrude {
  double angle = 360;     ///< degrees
  double start = 0;       ///< degrees; full turns of the older dialect start at 180
  bool round_up = false;  ///< newer dialect: round the number of steps up
  Segments segments;
};
[[nodiscard]] ExtrusionSize size_of(const Outline& outline, const RotateExtrude& options);
/// A closed mesh. @return kLimit beyond 2^28 vertices; kGeometry when the outline crosses the axis;
/// the job's error
Result<TriangleSoup> rotate_extrude(const Outline& outline, const RotateExtrude& options,
                                    OutlineJob* job = nullptr);

/// A closed slab between z = low and z = high. Flat scenes are shown as slabs 1 mm thick.
[[nodiscard]] TriangleSoup make_slab(const Outline& outline, double low, double high,
                                     OutlineJob* job = nullptr);

}  // namespace strata::csg
