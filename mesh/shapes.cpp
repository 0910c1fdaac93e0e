#include "strata/mesh/shapes.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <numbers>
#include <unordered_map>

#include "strata/mesh/soup_tools.h"

namespace strata {
namespace {

constexpr double kTau = 2.0 * std::numbers::pi;

/// Adds two triangles for the quadrilateral a, b, c, d, counter-clockwise from outside.
void add_quad(TriangleSoup& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c,
              std::uint32_t d) {
  mesh.triangles.emplace_back(a, b, c);
  mesh.triangles.emplace_back(a, c, d);
}

/// Joins rings into a closed surface. Vertex (i, j) has index i * sides + j; both indices wrap
/// around.
void add_closed_grid(TriangleSoup& mesh, int rings, int sides) {
  const auto index = [&](int i, int j) {
    return static_cast<std::uint32_t>(i % rings * sides + j % sides);
  };
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < sides; ++j) {
      add_quad(mesh, index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1));
    }
  }
}

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

}  // namespace

TriangleSoup make_box(const glm::dvec3& low, const glm::dvec3& high) {
  TriangleSoup mesh;
  for (int corner = 0; corner < 8; ++corner) {
    mesh.positions.emplace_back((corner & 1) != 0 ? high.x : low.x,
                                (corner & 2) != 0 ? high.y : low.y,
                                (corner & 4) != 0 ? high.z : low.z);
  }
  add_quad(mesh, 0, 2, 3, 1);  // z low
  add_quad(mesh, 4, 5, 7, 6);  // z high
  add_quad(mesh, 0, 1, 5, 4);  // y low
  add_quad(mesh, 2, 6, 7, 3);  // y high
  add_quad(mesh, 0, 4, 6, 2);  // x low
  add_quad(mesh, 1, 3, 7, 5);  // x high
  return mesh;
}

TriangleSoup make_uv_sphere(double radius, int segments, int rings) {
  TriangleSoup mesh;
  for (int ring = 1; ring < rings; ++ring) {
    const double polar = std::numbers::pi * ring / rings;
    for (int s = 0; s < segments; ++s) {
      const double azimuth = kTau * s / segments;
      mesh.positions.emplace_back(radius * std::sin(polar) * std::cos(azimuth),
                                  radius * std::sin(polar) * std::sin(azimuth),
                                  radius * std::cos(polar));
    }
  }
  const auto top = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.emplace_back(0.0, 0.0, radius);
  mesh.positions.emplace_back(0.0, 0.0, -radius);
  const auto index = [&](int ring, int s) {
    return static_cast<std::uint32_t>((ring - 1) * segments + s % segments);
  };
  for (int s = 0; s < segments; ++s) {
    mesh.triangles.emplace_back(top, index(1, s), index(1, s + 1));
    for (int ring = 1; ring + 1 < rings; ++ring) {
      add_quad(mesh, index(ring, s), index(ring + 1, s), index(ring + 1, s + 1),
               index(ring, s + 1));
    }
    mesh.triangles.emplace_back(top + 1, index(rings - 1, s + 1), index(rings - 1, s));
  }
  return mesh;
}

TriangleSoup make_icosphere(double radius, int subdivisions) {
  constexpr double kGolden = std::numbers::phi;
  TriangleSoup mesh;
  mesh.positions = {{-1, kGolden, 0}, {1, kGolden, 0}, {-1, -kGolden, 0}, {1, -kGolden, 0},
                    {0, -1, kGolden}, {0, 1, kGolden}, {0, -1, -kGolden}, {0, 1, -kGolden},
                    {kGolden, 0, -1}, {kGolden, 0, 1}, {-kGolden, 0, -1}, {-kGolden, 0, 1}};
  mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                    {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                    {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                    {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  const auto project = [&] {
    for (glm::dvec3& p : mesh.positions) p = glm::normalize(p) * radius;
  };
  project();
  for (int i = 0; i < subdivisions; ++i) {
    mesh = subdivide(mesh);
    project();
  }
  mesh.face_elements.clear();
  return mesh;
}

TriangleSoup make_torus(double major, double minor, int segments, int sides) {
  TriangleSoup mesh;
  for (int i = 0; i < segments; ++i) {
    const double azimuth = kTau * i / segments;
    for (int j = 0; j < sides; ++j) {
      const double around = kTau * j / sides;
      const double distance = major + minor * std::cos(around);
      mesh.positions.emplace_back(distance * std::cos(azimuth), distance * std::sin(azimuth),
                                  minor * std::sin(around));
    }
  }
  add_closed_grid(mesh, segments, sides);
  return mesh;
}

TriangleSoup make_cylinder(double radius, double height, int segments) {
  TriangleSoup mesh;
  for (int end = 0; end < 2; ++end) {
    for (int s = 0; s < segments; ++s) {
      const double azimuth = kTau * s / segments;
      mesh.positions.emplace_back(radius * std::cos(azimuth), radius * std::sin(azimuth),
                                  end * height);
    }
  }
  const auto n = static_cast<std::uint32_t>(segments);
  mesh.positions.emplace_back(0.0, 0.0, 0.0);
  mesh.positions.emplace_back(0.0, 0.0, height);
  for (std::uint32_t s = 0; s < n; ++s) {
    const std::uint32_t next = (s + 1) % n;
    add_quad(mesh, s, next, n + next, n + s);
    mesh.triangles.emplace_back(2 * n, next, s);
    mesh.triangles.emplace_back(2 * n + 1, n + s, n + next);
  }
  return mesh;
}

TriangleSoup make_cone(double radius, double height, int segments) {
  TriangleSoup mesh;
  const auto n = static_cast<std::uint32_t>(segments);
  for (std::uint32_t s = 0; s < n; ++s) {
    const double azimuth = kTau * s / segments;
    mesh.positions.emplace_back(radius * std::cos(azimuth), radius * std::sin(azimuth), 0.0);
  }
  mesh.positions.emplace_back(0.0, 0.0, 0.0);
  mesh.positions.emplace_back(0.0, 0.0, height);
  for (std::uint32_t s = 0; s < n; ++s) {
    const std::uint32_t next = (s + 1) % n;
    mesh.triangles.emplace_back(n, next, s);
    mesh.triangles.emplace_back(n + 1, s, next);
  }
  return mesh;
}

TriangleSoup make_torus_knot(int p, int q, double tube, int segments, int sides) {
  TriangleSoup mesh;
  for (int i = 0; i < segments; ++i) {
    const double t = kTau * i / segments;
    const double ct = std::cos(p * t), st = std::sin(p * t);
    const double r = 2.0 + std::cos(q * t), dr = -q * std::sin(q * t);
    const glm::dvec3 centre(r * ct, r * st, std::sin(q * t));
    const glm::dvec3 tangent =
        glm::normalize(glm::dvec3(dr * ct - r * p * st, dr * st + r * p * ct, q * std::cos(q * t)));
    // The frame follows the normal of the torus that holds the knot, so it closes after one turn.
    const glm::dvec3 outward(std::cos(q * t) * ct, std::cos(q * t) * st, std::sin(q * t));
    const glm::dvec3 e1 = glm::normalize(outward - glm::dot(outward, tangent) * tangent);
    const glm::dvec3 e2 = glm::cross(e1, tangent);
    for (int j = 0; j < sides; ++j) {
      const double around = kTau * j / sides;
      mesh.positions.push_back(centre + tube * (std::cos(around) * e1 + std::sin(around) * e2));
    }
  }
  add_closed_grid(mesh, segments, sides);
  return mesh;
}

TriangleSoup subdivide(const TriangleSoup& mesh) {
  TriangleSoup result;
  result.positions = mesh.positions;
  result.positions.reserve(mesh.positions.size() + mesh.triangles.size() * 3 / 2);
  result.triangles.reserve(4 * mesh.triangles.size());
  result.face_elements.reserve(4 * mesh.triangles.size());
  std::unordered_map<std::uint64_t, std::uint32_t> midpoints;
  midpoints.reserve(mesh.triangles.size() * 3 / 2);
  const auto midpoint = [&](std::uint32_t a, std::uint32_t b) {
    const auto [at, fresh] =
        midpoints.try_emplace(edge_key(a, b), static_cast<std::uint32_t>(result.positions.size()));
    if (fresh) {
      // The lower index comes first, so that both neighbours compute the same sum even if they are
      // not merged.
      const std::uint32_t low = std::min(a, b), high = std::max(a, b);
      result.positions.push_back(0.5 * mesh.positions[low] + 0.5 * mesh.positions[high]);
    }
    return at->second;
  };
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3 t = mesh.triangles[i];
    const std::uint32_t ab = midpoint(t.x, t.y), bc = midpoint(t.y, t.z), ca = midpoint(t.z, t.x);
    result.triangles.emplace_back(t.x, ab, ca);
    result.triangles.emplace_back(ab, t.y, bc);
    result.triangles.emplace_back(ca, bc, t.z);
    result.triangles.emplace_back(ab, bc, ca);
    const std::uint32_t element =
        mesh.face_elements.empty() ? static_cast<std::uint32_t>(i) : mesh.face_elements[i];
    result.face_elements.insert(result.face_elements.end(), 4, element);
  }
  return result;
}

TriangleSoup transform(const TriangleSoup& mesh, const glm::dmat4& m) {
  TriangleSoup result = mesh;
  for (glm::dvec3& p : result.positions) p = glm::dvec3(m * glm::dvec4(p, 1.0));
  if (glm::determinant(glm::dmat3(m)) < 0.0) reverse_orientation(result);
  return result;
}

}  // namespace strata
