#pragma once

#include <cstdint>

#include "mesh/formats/reader_common.h"

namespace strata::detail {

/// Reads a body that has nothing but one line `x y z` a vertex, then one line `3 a b c` a triangle,
/// on all threads. Most large ASCII files of OFF and PLY are so; the readers take what is not.
/// @param begin  of the first vertex, in the text of `input`
/// @return where the triangles begin, null if the body is something else; then `mesh` has no
/// vertices and faces. @pre `mesh` has none
const char* read_plain_body(const ReaderInput& input, const char* begin, std::uint64_t vertices,
                            std::uint64_t triangles, RawMesh& mesh);

}  // namespace strata::detail
