#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "mesh/part_names.h"
#include "strata/mesh/mesh_attributes.h"

/// What 3MF and AMF say of their triangles. Private to this room.
namespace strata::detail {

/// What a triangle looks like: a material, colours of its corners, places in the material's
/// texture.
struct TriangleLook {
  std::uint32_t material = MeshAttributes::kNone;
  bool coloured = false;
  bool textured = false;
  std::array<glm::u8vec4, 3> colours{glm::u8vec4(255), glm::u8vec4(255), glm::u8vec4(255)};
  std::array<glm::vec2, 3> places{};
};

/// Collects the attributes of a mesh, triangle by triangle.
class ModelLooks {
 public:
  /// The next triangles are those of this part.
  void begin_part(std::string_view name) {
    pending_ = name;
    is_pending_ = true;
  }
  /// Adds triangle t, which is element t. @param mirrored  the second and third corner were swapped
  void add(const TriangleLook& look, const glm::uvec3& triangle, bool mirrored);
  /// Passes over triangles that have no look.
  void skip(std::uint64_t triangles);
  /// The attributes of all triangles added.
  [[nodiscard]] MeshAttributes finish();

  MeshAttributes attributes;  ///< materials and textures are put here by the readers

 private:
  void start_part();

  PartNames names_;
  std::string pending_;
  bool is_pending_ = false;
  std::uint64_t count_ = 0;
};

}  // namespace strata::detail
