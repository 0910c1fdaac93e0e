#pragma once

#include "mesh/text/reader_input.h"
#include "strata/core/result.h"
#include "strata/mesh/mesh_file.h"

namespace strata::detail {

/// Reads an OBJ text, which read_obj() has read, a second time: its objects and groups, and with
/// MeshReadOptions::attributes its materials, pictures, places in them, and colours of vertices.
/// @return kInput, kLimit, kCancelled
Result<void> read_obj_attributes(const ReaderInput& input, MeshFile& file);

}  // namespace strata::detail
