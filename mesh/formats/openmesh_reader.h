#pragma once

#include <string>

#include "strata/core/result.h"
#include "strata/mesh/formats/read_mesh.h"

namespace strata {

/// Reads a mesh through OpenMesh 9, to compare it with read_mesh(). Expect differences: OBJ, OFF
/// and PLY pass through float, and some faces are lost without a word
/// (tests/mesh/formats/openmesh_test.cpp lists them). A file that our own reader refuses is not
/// shown to OpenMesh, because malformed ones can abort the process or exhaust memory. Exists only
/// in builds with OpenMesh (STRATA_HAVE_OPENMESH). Statistics: format, bytes, vertices, faces,
/// triangles.
/// @return what read_mesh says of the file; kInput when OpenMesh refuses it; kUsage: "-", or a
/// format that is not that of the extension
Result<MeshFile> read_with_openmesh(const std::string& path, const MeshReadOptions& options = {},
                                    const Execution& execution = {});

}  // namespace strata
