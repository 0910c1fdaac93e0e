#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "strata/mesh/triangle_soup.h"

/// Generated solids for tests, demonstrations and benchmarks. All are closed, outward and without
/// self-intersection; neighbours share vertices, so positions agree exactly. Vertices at the seams
/// of round shapes exist once.
namespace strata {

/// The box [low, high]: 8 vertices, 12 triangles. @pre low < high in every component
[[nodiscard]] TriangleSoup make_box(const glm::dvec3& low, const glm::dvec3& high);

/// A sphere about the origin with `rings` bands of latitude along z and `segments` of longitude. 2
/// * segments * (rings - 1) triangles. @pre radius > 0, segments >= 3, rings >= 2
[[nodiscard]] TriangleSoup make_uv_sphere(double radius, int segments, int rings);

/// A sphere about the origin: an icosahedron divided `subdivisions` times, all vertices at
/// `radius`. 20 * 4^subdivisions triangles. @pre radius > 0, 0 <= subdivisions <= 12
[[nodiscard]] TriangleSoup make_icosphere(double radius, int subdivisions);

/// A torus about the z axis, its tube of radius `minor` at distance `major`. 2 * segments * sides
/// triangles. @pre 0 < minor < major, segments >= 3 (around the axis), sides >= 3 (of the tube)
[[nodiscard]] TriangleSoup make_torus(double major, double minor, int segments, int sides);

/// A cylinder along z from 0 to `height`, flat ends. 4 * segments triangles.
/// @pre radius > 0, height > 0, segments >= 3
[[nodiscard]] TriangleSoup make_cylinder(double radius, double height, int segments);

/// A cone with its base at z = 0 and its tip at z = `height`. 2 * segments triangles.
/// @pre radius > 0, height > 0, segments >= 3
[[nodiscard]] TriangleSoup make_cone(double radius, double height, int segments);

/// A tube along a (p, q) torus knot: p times around the z axis, q times around the tube of radius 1
/// at distance 2. 2 * segments * sides triangles; not self-intersecting while `tube` is well below
/// the distance of its strands (0.5 for p = 2, q = 3).
/// @pre p and q coprime and > 0, tube > 0, segments >= 3, sides >= 3
[[nodiscard]] TriangleSoup make_torus_knot(int p, int q, double tube, int segments, int sides);

/// Cuts every triangle into four at the midpoints of its edges, which neighbours share. Shape,
/// volume and closedness stay; face elements go to the children.
[[nodiscard]] TriangleSoup subdivide(const TriangleSoup& mesh);

/// Every position p becomes m * (p, 1). When m mirrors (negative determinant) the triangles are
/// reversed, so that outside stays outside. @pre m is affine
[[nodiscard]] TriangleSoup transform(const TriangleSoup& mesh, const glm::dmat4& m);

}  // namespace strata
