#include "mesh/split_parts.h"

#include <algorithm>
#include <cstddef>

#include "mesh/no_vertex.h"

namespace strata::detail {

std::vector<std::uint32_t> parts_of_triangles(const TriangleSoup& mesh,
                                              const MeshAttributes& attributes) {
  std::vector<std::uint32_t> parts(mesh.triangles.size());
  std::uint32_t last = 0, part = attributes.part_of(0);
  for (std::size_t t = 0; t < parts.size(); ++t) {
    const std::uint32_t element =
        mesh.face_elements.empty() ? static_cast<std::uint32_t>(t) : mesh.face_elements[t];
    if (element != last) part = attributes.part_of(element);
    last = element;
    parts[t] = part;
  }
  return parts;
}

std::vector<TriangleSoup> split_parts(const TriangleSoup& mesh, const MeshAttributes& attributes) {
  std::vector<std::uint32_t> parts = parts_of_triangles(mesh, attributes);
  const auto count = static_cast<std::uint32_t>(attributes.parts.size());
  bool rest = false;
  for (std::uint32_t& part : parts) {
    rest = rest || part == MeshAttributes::kNone;
    part = std::min(part, count);
  }
  // The triangles of part p are order[begins[p]] to order[begins[p + 1]].
  std::vector<std::size_t> begins(std::size_t{count} + 2);
  for (const std::uint32_t part : parts) ++begins[part + 1];
  for (std::size_t p = 1; p < begins.size(); ++p) begins[p] += begins[p - 1];
  std::vector<std::uint32_t> order(parts.size());
  std::vector<std::size_t> next = begins;
  for (std::size_t t = 0; t < parts.size(); ++t) {
    order[next[parts[t]]++] = static_cast<std::uint32_t>(t);
  }
  std::vector<TriangleSoup> split(count + (rest ? 1 : 0));
  std::vector<std::uint32_t> owner(mesh.positions.size(), kNoVertex);
  std::vector<std::uint32_t> index(mesh.positions.size());
  for (std::uint32_t p = 0; p < split.size(); ++p) {
    TriangleSoup& part = split[p];
    for (std::size_t i = begins[p]; i < begins[p + 1]; ++i) {
      glm::uvec3 triangle = mesh.triangles[order[i]];
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t vertex = triangle[k];
        if (owner[vertex] != p) {
          owner[vertex] = p;
          index[vertex] = static_cast<std::uint32_t>(part.positions.size());
          part.positions.push_back(mesh.positions[vertex]);
        }
        triangle[k] = index[vertex];
      }
      part.triangles.push_back(triangle);
      part.face_elements.push_back(mesh.face_elements.empty() ? order[i]
                                                              : mesh.face_elements[order[i]]);
    }
  }
  return split;
}

}  // namespace strata::detail
