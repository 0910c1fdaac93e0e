#include "transparency/stream/triangle_distances.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numeric>

namespace strata::transparency {

std::vector<glm::dvec3> eye_positions(const FrameTriangles& triangles) {
  const View& view = triangles.view;
  const glm::dmat4 eye_from_image = view.eye_from_world * glm::inverse(view.image_from_world);
  std::vector<glm::dvec3> positions;
  positions.reserve(triangles.part.mesh.vertices.size());
  for (const glm::ivec3& p : triangles.part.mesh.vertices) {
    const glm::dvec4 at = eye_from_image * glm::dvec4(static_cast<double>(p.x) / kLatticeSteps,
                                                      static_cast<double>(p.y) / kLatticeSteps,
                                                      static_cast<double>(p.z), 1.0);
    positions.emplace_back(glm::dvec3(at) / at.w);
  }
  return positions;
}

double eye_distance(const View& view, const glm::dvec3& point) {
  return view.perspective ? glm::length(point) : -point.z;
}

TriangleDistances triangle_distances(const FrameInfo& frame) {
  const FrameTriangles& triangles = *frame.triangles;
  const std::vector<glm::dvec3> eye = eye_positions(triangles);
  const std::size_t count = frame.colours.size() / 2;
  TriangleDistances distances{std::vector<double>(count, 0.0), std::vector<double>(count, 0.0)};
  std::vector<glm::dvec3> sums(count, glm::dvec3(0.0));
  std::vector<std::uint32_t> corners(count, 0);
  for (std::uint32_t t = 0; t < triangles.part.mesh.triangles.size(); ++t) {
    const std::uint32_t source = triangles.part.source(t);
    const glm::uvec3& triangle = triangles.part.mesh.triangles[t];
    for (int i = 0; i < 3; ++i) {
      const glm::dvec3& point = eye[triangle[i]];
      sums[source] += point;
      ++corners[source];
      double& farthest = distances.farthest[source];
      const double distance = eye_distance(triangles.view, point);
      farthest = corners[source] == 1 ? distance : std::max(farthest, distance);
    }
  }
  for (std::size_t t = 0; t < count; ++t) {
    if (corners[t] == 0) continue;
    distances.centroid[t] = eye_distance(triangles.view, sums[t] / static_cast<double>(corners[t]));
  }
  return distances;
}

std::vector<double> object_distances(const FrameTriangles& triangles) {
  const std::vector<glm::dvec3> eye = eye_positions(triangles);
  std::vector<double> areas(triangles.objects, 0.0), distances(triangles.objects, 0.0);
  std::vector<glm::dvec3> sums(triangles.objects, glm::dvec3(0.0));
  for (std::uint32_t t = 0; t < triangles.part.mesh.triangles.size(); ++t) {
    const std::uint32_t source = triangles.part.source(t);
    const std::size_t object = triangles.object_of.empty() ? 0 : triangles.object_of[source];
    const glm::uvec3& triangle = triangles.part.mesh.triangles[t];
    const glm::dvec3 &a = eye[triangle.x], &b = eye[triangle.y], &c = eye[triangle.z];
    const double area = glm::length(glm::cross(b - a, c - a));
    areas[object] += area;
    sums[object] += area * (a + b + c) / 3.0;
  }
  for (std::size_t i = 0; i < distances.size(); ++i) {
    if (areas[i] > 0) distances[i] = eye_distance(triangles.view, sums[i] / areas[i]);
  }
  return distances;
}

std::vector<std::uint32_t> ranks_of(const std::vector<double>& keys, std::uint64_t& comparisons) {
  std::vector<std::uint32_t> order(keys.size()), ranks(keys.size());
  std::iota(order.begin(), order.end(), 0u);
  std::uint64_t compared = 0;
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    ++compared;
    return keys[a] != keys[b] ? keys[a] < keys[b] : a < b;
  });
  comparisons += compared;
  for (std::uint32_t i = 0; i < order.size(); ++i) ranks[order[i]] = i;
  return ranks;
}

}  // namespace strata::transparency
