#pragma once

#include <string>

#include "strata/core/result.h"
#include "strata/mesh/formats/read_mesh.h"

namespace strata {

/// Reads a mesh through OpenMesh 9, for comparison with read_mesh(). Results differ: OBJ, OFF and
/// PLY pass through float, and OpenMesh silently loses some faces
/// (tests/mesh/formats/openmesh_test.cpp lists them). OpenMesh is not given files that our own
/// reader refuses, because malformed files can abort the process or exhaust memory. Exists only in
/// builds with OpenMesh (STRATA_HAVE_OPENMESH). Sets these statistics: format, bytes, vertices,
/// faces, triangles.
/// @return read_mesh's error for the file; kInput when OpenMesh refuses it; kUsage for "-" or a
/// format that is not that of the extension
Result<MeshFile> read_with_openmesh(const std::string& path, const MeshReadOptions& options = {},
                                    const Execution& execution = {});

}  // namespace strata
