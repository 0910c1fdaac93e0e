#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "mesh/gltf/gltf_data.h"
#include "mesh/gltf/gltf_document.h"
#include "mesh/gltf/read_gltf.h"

namespace strata::detail {

/// Joints that move a vertex.
struct GltfPull {
  glm::uvec4 joints{0u};
  glm::dvec4 weights{0.0};
};

/// The triangles of a mesh, as a node places them.
struct GltfShape {
  /// Triangles of one material, up to the next run's.
  struct Run {
    std::size_t first = 0;
    GltfIndex material;
  };
  std::vector<glm::dvec3> positions;  ///< morphed
  std::vector<glm::uvec3> triangles;
  std::vector<Run> runs;
  std::vector<glm::u8vec4> colours;       ///< of each position, sRGB; or empty
  std::vector<glm::vec2> texture_places;  ///< of each position, as in the file; or empty
  std::size_t pulls_each = 0;             ///< of a position; 0: no skin
  std::vector<GltfPull> pulls;
  std::uint64_t ignored = 0;  ///< points and lines
  GltfLosses losses;
};

/// @param weights  of morph targets
/// @param looks  colours and places in textures are read too
/// @throw GltfRefusal, std::bad_alloc
GltfShape make_shape(const GltfDocument& document, GltfData& data, std::uint32_t mesh,
                     std::span<const double> weights, bool looks);

}  // namespace strata::detail
