#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "csg/outline/segments.h"
#include "mesh/polygons/polygon_cutter.h"
#include "strata/mesh/triangle_soup.h"

/// OpenSCAD's solids, vertex for vertex; the functions hold the formulas. All except polyhedra are
/// closed and face outward, with shared vertices. An empty solid has no triangles.
namespace strata::csg {

/// The box [0, size], or with `centre` [-size / 2, size / 2]. Empty unless all sizes are finite and
/// > 0.
[[nodiscard]] TriangleSoup make_cube(const glm::dvec3& size, bool centre);

/// A sphere of rings of N = segments.count(r) points each. The floor((N + 1) / 2) rings are at the
/// polar angles 180 (k + 1/2) / rings from +z. The ends are flat; there are no poles. Empty unless
/// r is finite and > 0.
[[nodiscard]] TriangleSoup make_sphere(double radius, const Segments& segments);

/// A cylinder or cone that stands on z = 0, or is centred there with `centre`. A radius of 0 makes
/// a tip. Empty unless h > 0, both radii are >= 0, one is > 0 and all are finite.
[[nodiscard]] TriangleSoup make_cylinder(double height, double radius1, double radius2, bool centre,
                                         const Segments& segments);

/// The number of triangles that make_sphere() makes, for limits.
[[nodiscard]] double sphere_triangle_count(double radius, const Segments& segments);

/// The faces that are not flat.
struct BentFaces {
  std::size_t count = 0, first = 0;
  Bend bend;  ///< the bend of the first one
};
/// Faces with any number of corners, counter-clockwise seen from outside. PolygonCutter cuts them
/// into triangles, whichever corner is first. Corners that repeat the previous one are left out.
/// The mesh's face elements are indices of `faces`. @pre indices < points.size()
[[nodiscard]] TriangleSoup make_faces(std::vector<glm::dvec3> points,
                                      std::span<const std::vector<std::uint32_t>> faces,
                                      BentFaces* bent = nullptr);

}  // namespace strata::csg
