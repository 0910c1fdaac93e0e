#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"

namespace strata {

/// A box of lattice points; both corners belong to it. @invariant low <= high
struct LatticeBox {
  glm::ivec3 low, high;
};

/// Two boxes that share a point.
struct BoxPair {
  std::uint32_t first, second;  ///< first < second

  friend auto operator<=>(const BoxPair&, const BoxPair&) = default;
};

/// Called with some pairs at a time, by several threads at once. `worker` is as in parallel_for().
using BoxPairVisit = std::function<void(std::span<const BoxPair> pairs, int worker)>;

/// Calls visit() for all pairs of boxes that share a point, each pair once. Their order means
/// nothing; the set depends on the boxes alone. A cube around all boxes is divided in eight,
/// recursively. A pair is found in the cell that has the least point which both boxes share, so
/// none is found twice. A box that covers a whole cell is compared there and not passed on, so
/// large boxes cost what they find. Boxes that no division separates are sorted and swept.
///
/// Cost: 0.3 us a box and 3 ns a pair, for boxes like those of a mesh's triangles, on one thread.
/// @param groups  empty, or a number for each box: pairs of one group are not found, and cells that
/// boxes of one group touch cost nothing
/// @return kCancelled; kLimit when the boxes in cells take more than the memory limit
Result<void> for_box_pairs(std::span<const LatticeBox> boxes, std::span<const std::uint32_t> groups,
                           const BoxPairVisit& visit, const Execution& execution = {});

/// The pairs, sorted. kLimit when they take more than the memory limit.
Result<std::vector<BoxPair>> box_pairs(std::span<const LatticeBox> boxes,
                                       std::span<const std::uint32_t> groups,
                                       const Execution& execution = {});

}  // namespace strata
