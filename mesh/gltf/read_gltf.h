#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/file_identity.h"
#include "strata/core/result.h"
#include "strata/mesh/mesh_attributes.h"
#include "strata/mesh/triangle_soup.h"

namespace strata {

/// How to read a glTF file.
struct GltfOptions {
  bool attributes = false;      ///< parts, materials, colours and places in textures are read too
  bool textures = true;         ///< with `attributes`: pictures are read
  bool parts = false;           ///< parts are read, with or without the other attributes
  bool standard_input = false;  ///< so that it can name no other files
  std::string root{};           ///< files that it names lie in this folder; empty: anywhere
};

/// Triangles that were dropped.
struct GltfLosses {
  std::uint64_t out_of_range = 0;  ///< an index is not that of a vertex
  std::uint64_t too_few = 0;       ///< the last one of a list has no three corners
  std::uint64_t non_finite = 0;    ///< a vertex has a coordinate that is not finite
  std::string first;               ///< a sentence about one of them
};

/// The contents of a glTF file.
struct GltfModel {
  TriangleSoup soup;  ///< triangle t is element t
  MeshAttributes attributes;
  std::uint64_t ignored = 0;  ///< points and lines
  GltfLosses losses;
  std::vector<std::string> warnings;
  std::vector<std::string> missing;  ///< sentences: pictures that are not there
  std::vector<FileIdentity> opened;  ///< other files: buffers and images
};

/// Whether bytes begin as a .glb does.
[[nodiscard]] bool is_glb(std::string_view bytes);

/// Reads glTF 2.0, as .gltf (JSON) or .glb: the triangles of the scene that is shown, placed by
/// their nodes, in the coordinates of the file. Meshes are morphed by the weights of the file, and
/// meshes with skins are placed by their joints as the file holds them; animations are not played.
/// A part is a node with a mesh.
/// @param name  the file's path
/// Triangles whose vertices are not there, or not finite, are dropped.
/// @return kInput: damaged, a value that is not allowed, a required extension that is not read, no
/// triangles; kLimit: 2^32 - 1 vertices or triangles, the memory limit; kCancelled; kUsage: a build
/// without nlohmann-json
Result<GltfModel> read_gltf(std::string_view bytes, const std::string& name,
                            const GltfOptions& options, const Execution& execution = {});

}  // namespace strata
