#pragma once

#include <string>
#include <vector>

#include "mesh/gltf/gltf_data.h"
#include "mesh/gltf/gltf_document.h"
#include "strata/mesh/mesh_attributes.h"

namespace strata::detail {

/// Places of the material's texture: (0, 0) is the lower left corner.
[[nodiscard]] glm::vec2 texture_place(const GltfMaterial& material, const glm::vec2& in_file);

/// Fills in materials, and the textures of those whose pictures are wanted.
/// @param warnings  gets what cannot be shown @param missing  the same of files that are not there
/// @throw GltfRefusal  kLimit, kCancelled
void add_materials(const GltfDocument& document, GltfData& data,
                   const std::vector<bool>& textures_wanted, MeshAttributes& to,
                   std::vector<std::string>& warnings, std::vector<std::string>& missing);

}  // namespace strata::detail
