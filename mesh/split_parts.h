#pragma once

#include <vector>

#include "strata/mesh/mesh_attributes.h"
#include "strata/mesh/triangle_soup.h"

// Private: not installed.
namespace strata::detail {

/// The triangles of each part, and behind them those of no part, if there are any. Face elements
/// are those of the whole.
[[nodiscard]] std::vector<TriangleSoup> split_parts(const TriangleSoup& mesh,
                                                    const MeshAttributes& attributes);

/// The part of each triangle; MeshAttributes::kNone for none.
[[nodiscard]] std::vector<std::uint32_t> parts_of_triangles(const TriangleSoup& mesh,
                                                            const MeshAttributes& attributes);

}  // namespace strata::detail
