#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/attributes/mtl_file.h"
#include "mesh/text/reader_input.h"
#include "strata/core/result.h"
#include "strata/mesh/mesh_file.h"

namespace strata::detail {

/// What comes before a piece of an OBJ text.
struct ObjChunkStart {
  std::uint64_t faces = 0, vertices = 0, texture_points = 0;
};

/// Reads the places in pictures (vt) of the corners of all faces whose material has one. A face of
/// which a corner has none gets none. @param cuts  pieces of the text @param starts  of each piece
/// and the end @param materials  by number @return kLimit, kCancelled
Result<void> read_obj_corners(const ReaderInput& input, std::span<const char* const> cuts,
                              std::span<const ObjChunkStart> starts,
                              const std::vector<MtlMaterial>& materials, MeshFile& file);

}  // namespace strata::detail
