#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "csg/outline/segments.h"
#include "mesh/polygons/polygon_cutter.h"
#include "strata/mesh/triangle_soup.h"

/// OpenSCAD's solids, vertex for vertex: the formulas stand in the functions. All but
/// polyhedra are closed and outward, with shared vertices; an empty solid has no triangles.
namespace strata::csg {

/// [0, size] or, with `centre`, [-size / 2, size / 2]. Empty unless all sizes are finite and > 0.
[[nodiscard]] TriangleSoup make_cube(const glm::dvec3& size, bool centre);

/// N = segments.count(r) points on each of floor((N + 1) / 2) rings, at the polar angles
/// 180 (k + 1/2) / rings from +z; flat ends, no poles. Empty unless r is finite and > 0.
[[nodiscard]] TriangleSoup make_sphere(double radius, const Segments& segments);

/// From z = 0 to h, or about 0; a radius of 0 makes a tip. Empty unless h > 0, both radii are
/// >= 0, one is > 0 and all are finite.
[[nodiscard]] TriangleSoup make_cylinder(double height, double radius1, double radius2, bool centre,
                                         const Segments& segments);

/// Triangles that make_sphere would make, for limits.
[[nodiscard]] double sphere_triangle_count(double radius, const Segments& segments);

/// Faces that are not flat.
struct BentFaces {
  std::size_t count = 0, first = 0;
  Bend bend;  ///< of the first
};
/// Faces of any number of corners, counter-clockwise seen from outside, cut by PolygonCutter; how
/// does not depend on where a face begins. Face elements are indices of `faces`. Corners that
/// repeat their predecessor are left out. @pre indices < points.size()
[[nodiscard]] TriangleSoup make_faces(std::vector<glm::dvec3> points,
                                      std::span<const std::vector<std::uint32_t>> faces,
                                      BentFaces* bent = nullptr);

}  // namespace strata::csg
