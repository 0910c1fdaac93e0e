#include "voxelize/distance/triangle_frame.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "strata/raster/lattice_mesh.h"

namespace strata {
namespace {

glm::dvec3 lattice_normal(const glm::ivec3& a, const glm::ivec3& b, const glm::ivec3& c) {
  const auto wide = [](const glm::ivec3& v) { return std::array<std::int64_t, 3>{v.x, v.y, v.z}; };
  const auto u = wide(b - a), v = wide(c - a);
  return {static_cast<double>(u[1] * v[2] - u[2] * v[1]),
          static_cast<double>(u[2] * v[0] - u[0] * v[2]),
          static_cast<double>(u[0] * v[1] - u[1] * v[0])};
}

/// A unit vector across `direction`, which need not be one.
glm::dvec3 any_across(const glm::dvec3& direction) {
  const glm::dvec3 size = glm::abs(direction);
  const glm::dvec3 other = size.x <= size.y && size.x <= size.z ? glm::dvec3(1, 0, 0)
                           : size.y <= size.z                   ? glm::dvec3(0, 1, 0)
                                                                : glm::dvec3(0, 0, 1);
  return glm::normalize(glm::cross(direction, other));
}

}  // namespace

TriangleFrame triangle_frame(const glm::ivec3* given, const glm::dvec3& scale,
                             const glm::ivec3& origin) {
  const glm::dvec3 step = scale / double{kLatticeSteps};
  glm::dvec3 edges[3];
  double squares[3];
  for (int i = 0; i < 3; ++i) {
    edges[i] = glm::dvec3(given[(i + 1) % 3] - given[i]) * step;
    squares[i] = glm::dot(edges[i], edges[i]);
  }
  const int first = squares[0] >= squares[1] && squares[0] >= squares[2] ? 0
                    : squares[1] >= squares[2]                           ? 1
                                                                         : 2;
  TriangleFrame frame;
  const glm::dvec3 exact = lattice_normal(given[0], given[1], given[2]);
  frame.is_line = exact == glm::dvec3(0.0);
  if (!frame.is_line) {
    frame.normal =
        glm::normalize(exact * glm::dvec3(step.y * step.z, step.z * step.x, step.x * step.y));
  } else if (squares[first] > 0.0) {
    frame.normal = any_across(edges[first]);
  } else {
    frame.normal = glm::dvec3(0, 0, 1);
  }
  for (int i = 0; i < 3; ++i) {
    const int from = (first + i) % 3;
    frame.corners[i] = glm::dvec3(given[from] - origin) * step;
    frame.along[i] =
        squares[from] > 0.0 ? edges[from] * (1.0 / std::sqrt(squares[from])) : glm::dvec3(1, 0, 0);
    frame.beside[i] = glm::cross(frame.along[i], frame.normal);
  }
  return frame;
}

}  // namespace strata
