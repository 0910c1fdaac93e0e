#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <optional>
#include <string>
#include <vector>

namespace strata {

/// A part of a mesh: what a file may show by itself. 3MF writes each as an object, OBJ as a group.
struct MeshPart {
  std::string name;                 ///< of the solid or file that it comes from; may be empty
  std::optional<glm::vec4> colour;  ///< red, green, blue, alpha in [0, 1]
};

/// The boundary of a solid: what writers of meshes take. Its triangles are counter-clockwise seen
/// from outside, each edge belongs to two of them, and around each vertex they form one fan. Where
/// a solid touches itself in an edge or a point, positions are there several times.
struct SolidMesh {
  std::vector<glm::dvec3> positions;  ///< world space
  std::vector<glm::uvec3> triangles;  ///< indices into positions
  /// The index into `parts` of each triangle; empty: all belong to the first part.
  std::vector<std::uint32_t> part_of;
  std::vector<MeshPart> parts;  ///< at least one where there are triangles
};

}  // namespace strata
