#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "strata/mesh/mesh_attributes.h"

namespace strata::detail {

/// A `solid NAME` line of an ascii STL file.
struct StlSolid {
  std::uint64_t first = 0;  ///< facets before it
  std::string_view name;
};

/// Makes parts of the solids that have facets. A single one without a name is none.
/// @param facets  of the file
void set_stl_parts(const std::vector<StlSolid>& solids, std::uint64_t facets,
                   MeshAttributes& attributes);

/// Reads the colours of a binary STL file, where it declares them: by "COLOR=" in its header
/// (Materialise Magics), or by bit 15 of the facets that have one (VisCAM, SolidView), if no other
/// facet has anything in its place. @pre bytes hold the header and `count` facets
void read_stl_colours(std::string_view bytes, std::size_t count, MeshAttributes& attributes);

}  // namespace strata::detail
