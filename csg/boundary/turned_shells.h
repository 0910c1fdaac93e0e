#pragma once

#include <cstdint>
#include <functional>

#include "exact/cut_points.h"
#include "mesh/repair/mesh_conflicts.h"

namespace strata::csg {

/// Takes out the shells of a closed mesh that rounding has turned inside out, or left without a
/// volume: slivers that are thinner than roundings.
/// @param most_moved  how far rounding moved vertices at most, in 2^-24 step
/// @param exact_point  of a vertex, where it was before it was rounded
/// @return how many shells
std::uint64_t drop_turned_shells(RoundedMesh& mesh, double most_moved,
                                 const std::function<exact::FinePoint(std::uint32_t)>& exact_point);

/// Takes out the shells without a positive volume that lie in no other shell's box: voids of
/// nothing.
/// @return how many shells
std::uint64_t drop_loose_voids(RoundedMesh& mesh);

}  // namespace strata::csg
