#pragma once

#include <string>

#include "strata/core/result.h"
#include "strata/mesh/formats/read_mesh.h"
#include "strata/mesh/triangle_soup.h"

namespace strata {

/// Writes a mesh as OBJ, OFF, ascii PLY (text: the shortest decimals that give back each double) or
/// binary STL (float: positions are rounded). Face elements are not written; -0 is kept in text.
/// @param path    a file, which appears only when complete, or "-" for standard output
/// @param format  kAuto: by the extension of the path
/// @return kUsage: no format for the path; kOutput; kLimit: memory, or more than 2^32 - 1 STL
/// triangles
Result<void> write_mesh(const std::string& path, const TriangleSoup& mesh,
                        MeshFormat format = MeshFormat::kAuto);

/// The bytes that write_mesh would write. @pre format is not kAuto, k3mf, kAmf or kGltf
[[nodiscard]] std::string mesh_to_bytes(const TriangleSoup& mesh, MeshFormat format);

}  // namespace strata
