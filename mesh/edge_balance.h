#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "strata/core/execution.h"

namespace strata::detail {

/// The number of uses low -> high minus the number of uses high -> low of an undirected edge.
/// @invariant low < high, sum != 0
struct EdgeSum {
  std::uint32_t low = 0, high = 0;
  std::int64_t sum = 0;
  friend bool operator==(const EdgeSum&, const EdgeSum&) = default;
};

/// The edges, by vertex index, that are not used equally often in both directions, sorted. The
/// result is exact. A use waits in the bucket of its lower vertex until the opposite use removes
/// it; uses that find no free lane are sorted. @pre indices < vertex_count
[[nodiscard]] std::vector<EdgeSum> unbalanced_by_index(std::span<const glm::uvec3> triangles,
                                                       std::size_t vertex_count,
                                                       const Execution& execution);

/// Adds up the sums of edges that join the same two positions. Edges with equal ends are removed.
/// `Scalar` is double or int.
template <class Scalar>
[[nodiscard]] std::vector<EdgeSum> unbalanced_by_position(
    std::vector<EdgeSum> edges, std::span<const glm::vec<3, Scalar>> positions);

}  // namespace strata::detail
