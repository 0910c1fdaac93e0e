#include "strata/mesh/soup_tools.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <utility>
#include <vector>

#include "mesh/block_sum.h"

namespace strata {

Bounds bounds(const TriangleSoup& mesh, const Execution& execution) {
  return detail::fold_blocks<Bounds>(
      execution, mesh.triangles.size(),
      [&](Bounds& box, std::size_t i) {
        for (int k = 0; k < 3; ++k) {
          box.include(glm::dvec3(mesh.positions[mesh.triangles[i][k]]));
        }
      },
      [](Bounds& box, const Bounds& part) { box.include(part); });
}

double signed_volume(const TriangleSoup& mesh, const Execution& execution) {
  if (mesh.triangles.empty()) return 0.0;
  // Positions are taken relative to a point of the mesh. Meshes far from the origin would lose
  // their digits otherwise.
  const glm::dvec3 origin = mesh.positions[mesh.triangles.front().x];
  const double six = detail::fold_blocks<double>(
      execution, mesh.triangles.size(),
      [&](double& sum, std::size_t i) {
        const glm::uvec3 t = mesh.triangles[i];
        sum += glm::dot(mesh.positions[t.x] - origin,
                        glm::cross(mesh.positions[t.y] - origin, mesh.positions[t.z] - origin));
      },
      [](double& sum, double part) { sum += part; });
  return six / 6.0;
}

void reverse_orientation(TriangleSoup& mesh) {
  for (glm::uvec3& t : mesh.triangles) std::swap(t.y, t.z);
}

void append(TriangleSoup& mesh, const TriangleSoup& other) {
  const auto base = static_cast<std::uint32_t>(mesh.positions.size());
  const auto first_triangle = static_cast<std::uint32_t>(mesh.triangles.size());
  if (!mesh.face_elements.empty() || !other.face_elements.empty()) {
    std::uint32_t first = first_triangle;
    if (!mesh.face_elements.empty()) {
      first = *std::max_element(mesh.face_elements.begin(), mesh.face_elements.end()) + 1;
    }
    for (std::uint32_t t = static_cast<std::uint32_t>(mesh.face_elements.size());
         t < first_triangle; ++t) {
      mesh.face_elements.push_back(t);
    }
    for (std::size_t t = 0; t < other.triangles.size(); ++t) {
      const std::uint32_t element =
          other.face_elements.empty() ? static_cast<std::uint32_t>(t) : other.face_elements[t];
      mesh.face_elements.push_back(first + element);
    }
  }
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  mesh.triangles.insert(mesh.triangles.end(), other.triangles.begin(), other.triangles.end());
  for (std::size_t t = first_triangle; t < mesh.triangles.size(); ++t) mesh.triangles[t] += base;
}

}  // namespace strata
