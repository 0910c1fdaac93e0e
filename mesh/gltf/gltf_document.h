#pragma once

#include <array>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/result.h"
#include "strata/mesh/mesh_attributes.h"

/// The JSON of a glTF 2.0 file, as far as shapes and base colours go. Private to this room.
namespace strata::detail {

/// Ends the reading of a file. It is thrown within this room only: read_gltf() returns it.
struct GltfRefusal {
  Error error;
};
template <class... Args>
[[noreturn]] void refuse_gltf(fmt::format_string<Args...> text, Args&&... args) {
  throw GltfRefusal{{ErrorCode::kInput, fmt::format(text, std::forward<Args>(args)...)}};
}

using GltfIndex = std::optional<std::uint32_t>;  ///< of another list; it is there

struct GltfBuffer {
  std::uint64_t bytes = 0;
  std::optional<std::string> uri;  ///< without one: the binary chunk
};

struct GltfView {
  std::uint32_t buffer = 0;
  std::uint64_t offset = 0, bytes = 0;
  std::uint64_t stride = 0;  ///< 0: elements lie side by side
  bool packed = false;       ///< by EXT_meshopt_compression
};

enum class GltfNumber { kInt8 = 5120, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat };

struct GltfAccessor {
  /// Values that replace others.
  struct Sparse {
    std::uint64_t count = 0;
    std::uint32_t index_view = 0, value_view = 0;
    std::uint64_t index_offset = 0, value_offset = 0;
    GltfNumber index_type = GltfNumber::kUint16;
  };
  GltfIndex view;  ///< without one: zeros
  std::uint64_t offset = 0, count = 0;
  GltfNumber type = GltfNumber::kFloat;
  bool normalized = false;
  int components = 1;  ///< 1 to 4, 16 for matrices of 4 x 4
  std::optional<Sparse> sparse;
};

struct GltfPrimitive {
  int mode = 4;  ///< of OpenGL: 0 points, 1 to 3 lines, 4 triangles, 5 strip, 6 fan
  GltfIndex indices, positions, colours, material;
  std::vector<GltfIndex> texture_places;       ///< TEXCOORD_0, ...
  std::vector<std::array<GltfIndex, 2>> skin;  ///< JOINTS_0 and WEIGHTS_0, ...
  std::vector<GltfIndex> morphs;               ///< of positions, for each target
  bool packed = false;                         ///< by KHR_draco_mesh_compression
};

struct GltfMesh {
  std::string name;
  std::vector<GltfPrimitive> primitives;
  std::vector<double> weights;  ///< of morph targets
};

struct GltfNode {
  std::string name;
  std::vector<std::uint32_t> children;
  GltfIndex mesh, skin;
  glm::dmat4 parent_from_node{1.0};
  std::vector<double> weights;  ///< of morph targets; empty: the mesh's
  /// Accessors of EXT_mesh_gpu_instancing.
  GltfIndex translations, rotations, scales;
};

struct GltfSkin {
  std::vector<std::uint32_t> joints;  ///< nodes
  GltfIndex bind_matrices;            ///< inverse; without: the identity
};

struct GltfImage {
  std::optional<std::string> uri;
  GltfIndex view;  ///< of its bytes, without an uri
};

struct GltfTexture {
  GltfIndex image;
  TextureWrap wrap_u = TextureWrap::kRepeat, wrap_v = TextureWrap::kRepeat;
};

struct GltfMaterial {
  std::string name;
  glm::dvec4 colour{1.0};  ///< linear
  bool coloured = false;   ///< the file gives a colour or a texture
  bool opaque = true;      ///< alpha does not count
  GltfIndex texture;
  std::uint32_t texture_set = 0;  ///< TEXCOORD_n
  // KHR_texture_transform
  glm::dvec2 texture_offset{0.0}, texture_scale{1.0};
  double texture_turn = 0.0;
};

struct GltfDocument {
  std::vector<GltfBuffer> buffers;
  std::vector<GltfView> views;
  std::vector<GltfAccessor> accessors;
  std::vector<GltfMesh> meshes;
  std::vector<GltfNode> nodes;
  std::vector<GltfSkin> skins;
  std::vector<GltfImage> images;
  std::vector<GltfTexture> textures;
  std::vector<GltfMaterial> materials;
  std::vector<std::vector<std::uint32_t>> scenes;  ///< their root nodes
  GltfIndex scene;                                 ///< that is shown
};

/// Reads the JSON. Every index is that of an element of its list.
/// @throw GltfRefusal  kInput, kUsage (a build without nlohmann-json), std::bad_alloc
GltfDocument parse_gltf(std::string_view text, const std::string& name);

}  // namespace strata::detail
