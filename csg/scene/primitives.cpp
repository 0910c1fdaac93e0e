#include "csg/scene/primitives.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "csg/scene/outline.h"

namespace strata::csg {
namespace {

bool positive(double value) { return std::isfinite(value) && value > 0.0; }

/// Adds `count` points of a circle about the z axis, the first on +x, counter-clockwise from above.
void add_ring(TriangleSoup& mesh, int count, double radius, double z) {
  for (int i = 0; i < count; ++i) {
    const double angle = (360.0 * i) / count;
    mesh.positions.emplace_back(radius * cos_degrees(angle), radius * sin_degrees(angle), z);
  }
}

/// The flat end over the `count` points from `first`: up, or down.
void add_end(TriangleSoup& mesh, std::uint32_t first, int count, bool up) {
  for (std::uint32_t i = 1; i + 1 < static_cast<std::uint32_t>(count); ++i) {
    const std::uint32_t a = first + i, b = first + i + 1;
    if (up) {
      mesh.triangles.emplace_back(first, a, b);
    } else {
      mesh.triangles.emplace_back(first, b, a);
    }
  }
}

/// Quads between a ring at `low` and one above it at `high`.
void add_band(TriangleSoup& mesh, std::uint32_t low, std::uint32_t high, int count) {
  const auto n = static_cast<std::uint32_t>(count);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.emplace_back(low + i, low + j, high + j);
    mesh.triangles.emplace_back(low + i, high + j, high + i);
  }
}

}  // namespace

TriangleSoup make_cube(const glm::dvec3& size, bool centre) {
  TriangleSoup mesh;
  if (!positive(size.x) || !positive(size.y) || !positive(size.z)) return mesh;
  const glm::dvec3 low = centre ? -0.5 * size : glm::dvec3(0.0);
  const glm::dvec3 high = centre ? 0.5 * size : size;
  mesh.positions = {{low.x, low.y, low.z},    {high.x, low.y, low.z}, {high.x, high.y, low.z},
                    {low.x, high.y, low.z},   {low.x, low.y, high.z}, {high.x, low.y, high.z},
                    {high.x, high.y, high.z}, {low.x, high.y, high.z}};
  add_end(mesh, 0, 4, false);
  add_end(mesh, 4, 4, true);
  add_band(mesh, 0, 4, 4);
  return mesh;
}

double sphere_triangle_count(double radius, const Segments& segments) {
  const double n = segments.count(radius);
  return n * (n + 1.0);
}

TriangleSoup make_sphere(double radius, const Segments& segments) {
  TriangleSoup mesh;
  if (!positive(radius)) return mesh;
  const int count = segments.count(radius);
  const int rings = (count + 1) / 2;
  for (int k = rings; k-- > 0;) {  // from the lowest up
    const double angle = (180.0 * (k + 0.5)) / rings;
    add_ring(mesh, count, radius * sin_degrees(angle), radius * cos_degrees(angle));
  }
  const auto n = static_cast<std::uint32_t>(count);
  const auto top = static_cast<std::uint32_t>(rings - 1) * n;
  add_end(mesh, 0, count, false);
  for (std::uint32_t ring = 0; ring < top; ring += n) add_band(mesh, ring, ring + n, count);
  add_end(mesh, top, count, true);
  return mesh;
}

TriangleSoup make_cylinder(double height, double radius1, double radius2, bool centre,
                           const Segments& segments) {
  TriangleSoup mesh;
  const bool radii = std::isfinite(radius1) && std::isfinite(radius2) && radius1 >= 0.0 &&
                     radius2 >= 0.0 && (radius1 > 0.0 || radius2 > 0.0);
  if (!positive(height) || !radii) return mesh;
  const int count = segments.count(std::max(radius1, radius2));
  const auto n = static_cast<std::uint32_t>(count);
  const double low = centre ? -height / 2.0 : 0.0, high = centre ? height / 2.0 : height;
  if (radius1 > 0.0) add_ring(mesh, count, radius1, low);
  if (radius2 > 0.0) add_ring(mesh, count, radius2, high);
  if (radius1 > 0.0) add_end(mesh, 0, count, false);
  if (radius1 > 0.0 && radius2 > 0.0) {
    add_band(mesh, 0, n, count);
    add_end(mesh, n, count, true);
    return mesh;
  }
  mesh.positions.emplace_back(0.0, 0.0, radius1 > 0.0 ? high : low);  // the tip, index n
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    if (radius1 > 0.0) {
      mesh.triangles.emplace_back(i, j, n);
    } else {
      mesh.triangles.emplace_back(j, i, n);
    }
  }
  if (radius1 == 0.0) add_end(mesh, 0, count, true);
  return mesh;
}

namespace {

/// Twice the area vector of a polygon (Newell's method): its direction is the normal.
glm::dvec3 area_vector(std::span<const glm::dvec3> points, std::span<const std::uint32_t> face) {
  glm::dvec3 sum(0.0);
  const glm::dvec3 about = points[face[0]];
  for (std::size_t i = 1; i + 1 < face.size(); ++i) {
    sum += glm::cross(points[face[i]] - about, points[face[i + 1]] - about);
  }
  return sum;
}

bool is_convex(std::span<const glm::dvec2> polygon) {
  const std::size_t n = polygon.size();
  double turned = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const glm::dvec2 a = polygon[(i + 1) % n] - polygon[i];
    const glm::dvec2 b = polygon[(i + 2) % n] - polygon[(i + 1) % n];
    const double cross = a.x * b.y - a.y * b.x;
    if (cross < 0.0) return false;
    turned += std::atan2(cross, a.x * b.x + a.y * b.y);
  }
  return turned < 7.0;  // once around is 6.28; stars go around twice
}

/// Adds the triangles of one face.
void add_face(TriangleSoup& mesh, std::span<const std::uint32_t> face, std::uint32_t element) {
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (a == b || b == c || c == a) return;
    mesh.triangles.emplace_back(a, b, c);
    mesh.face_elements.push_back(element);
  };
  const auto fan = [&] {
    for (std::size_t i = 1; i + 1 < face.size(); ++i) add(face[0], face[i], face[i + 1]);
  };
  const glm::dvec3 area = area_vector(mesh.positions, face);
  const double length = glm::length(area);
  if (face.size() == 3 || !(length > 0.0)) return fan();
  // Seen along the longest axis of the normal the polygon keeps its shape up to an affine map.
  const glm::dvec3 size = glm::abs(area);
  const int along = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const int u = (along + 1) % 3, v = (along + 2) % 3;
  std::vector<glm::dvec2> flat;
  for (const std::uint32_t index : face) {
    const glm::dvec3& p = mesh.positions[index];
    flat.push_back(area[along] > 0.0 ? glm::dvec2(p[u], p[v]) : glm::dvec2(p[v], p[u]));
  }
  if (is_convex(flat)) return fan();
  Outline outline;
  outline.contours.push_back(std::move(flat));
  const std::vector<glm::uvec3> cut = triangulate(outline);
  // A face that crosses itself in this view is no region; its fan counts as often as it winds.
  if (cut.size() != face.size() - 2) return fan();
  for (const glm::uvec3& t : cut) add(face[t.x], face[t.y], face[t.z]);
}

}  // namespace

TriangleSoup make_faces(std::vector<glm::dvec3> points,
                        std::span<const std::vector<std::uint32_t>> faces) {
  TriangleSoup mesh;
  mesh.positions = std::move(points);
  std::vector<std::uint32_t> corners;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    corners.clear();
    for (const std::uint32_t index : faces[f]) {
      if (corners.empty() || corners.back() != index) corners.push_back(index);
    }
    while (corners.size() > 1 && corners.front() == corners.back()) corners.pop_back();
    if (corners.size() >= 3) add_face(mesh, corners, static_cast<std::uint32_t>(f));
  }
  return mesh;
}

}  // namespace strata::csg
