#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/check/triangles_meet.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"

namespace strata {

/// Pairs of a mesh's triangles that share more than vertices and edges of both.
struct SelfMeetings {
  struct Pair {
    std::uint32_t first, second;  ///< triangles; first < second
    Meeting meeting;

    friend auto operator<=>(const Pair&, const Pair&) = default;
  };

  std::uint64_t touching = 0, crossing = 0, overlapping = 0;
  std::vector<Pair> first;  ///< the least ones, sorted
};

/// @param closed  each directed edge is there as often as its opposite, by index: then neighbours
/// are settled a vertex at a time, by plain_stars()
/// @param most  pairs to return
/// @pre points from 0 to 2^53
/// @return as for_box_pairs()
Result<SelfMeetings> find_self_meetings(std::span<const exact::FilePoint> points,
                                        std::span<const glm::uvec3> triangles, bool closed,
                                        std::size_t most, const Execution& execution = {});

}  // namespace strata
