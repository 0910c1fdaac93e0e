#include "csg/solids/primitives.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace strata::csg {
namespace {

bool positive(double value) { return std::isfinite(value) && value > 0.0; }

/// Adds `count` points of a circle around the z axis: the first on +x, then counter-clockwise seen
/// from above.
void add_ring(TriangleSoup& mesh, int count, double radius, double z) {
  for (int i = 0; i < count; ++i) {
    const double angle = (360.0 * i) / count;
    mesh.positions.emplace_back(radius * cos_degrees(angle), radius * sin_degrees(angle), z);
  }
}

/// Adds the flat end over the `count` points from `first`, facing up or down.
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

/// Adds quads between a ring that begins at `low` and the ring above it, which begins at `high`.
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
  for (int k = rings; k-- > 0;) {  // from the lowest ring upwards
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
  mesh.positions.emplace_back(0.0, 0.0, radius1 > 0.0 ? high : low);  // the tip has index n
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

/// Rotates a face so that its least point comes first. Its fan then does not depend on its first
/// corner in the file.
void begin_at_least_point(std::vector<std::uint32_t>& face, std::span<const glm::dvec3> points) {
  const auto key = [&](std::uint32_t i) {
    return std::tuple(points[i].x, points[i].y, points[i].z);
  };
  const auto least = std::min_element(
      face.begin(), face.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  std::rotate(face.begin(), least, face.end());
}

}  // namespace

TriangleSoup make_faces(std::vector<glm::dvec3> points,
                        std::span<const std::vector<std::uint32_t>> faces, BentFaces* bent) {
  TriangleSoup mesh;
  mesh.positions = std::move(points);
  PolygonCutter cutter;
  std::vector<std::uint32_t> corners;
  std::vector<glm::dvec3> places;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    corners.clear();
    for (const std::uint32_t index : faces[f]) {
      if (corners.empty() || corners.back() != index) corners.push_back(index);
    }
    while (corners.size() > 1 && corners.front() == corners.back()) corners.pop_back();
    if (corners.size() < 3) continue;
    const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
      const glm::uvec3 t(corners[a], corners[b], corners[c]);
      if (t.x == t.y || t.y == t.z || t.z == t.x) return;
      mesh.triangles.push_back(t);
      mesh.face_elements.push_back(static_cast<std::uint32_t>(f));
    };
    if (corners.size() == 3) {
      add(0, 1, 2);
      continue;
    }
    begin_at_least_point(corners, mesh.positions);
    places.clear();
    for (const std::uint32_t index : corners) places.push_back(mesh.positions[index]);
    const std::span<const glm::uvec3> cut = cutter.cut(places);
    for (const glm::uvec3& t : cut) add(t.x, t.y, t.z);
    for (std::size_t i = 2; cut.empty() && i < corners.size(); ++i) add(0, i - 1, i);
    if (bent != nullptr && cutter.bend().large() && bent->count++ == 0) {
      bent->first = f;
      bent->bend = cutter.bend();
    }
  }
  return mesh;
}

}  // namespace strata::csg
