#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <span>
#include <stop_token>
#include <tuple>
#include <vector>

#include "mesh/disjoint_sets.h"
#include "mesh/edge_balance.h"
#include "strata/core/execution.h"
#include "strata/mesh/soup_tools.h"
#include "strata/mesh/triangle_soup.h"

// What orient_parts() knows of parts; private to mesh/.

namespace strata::detail {

/// Volumes below this share of what they are summed of are none.
inline constexpr double kNoVolume = 1e-9;

/// Six times the volume between a triangle and a point, and its size without the sign.
struct Wedge {
  double volume = 0.0, size = 0.0;
  void add(const TriangleSoup& mesh, std::size_t t, const glm::dvec3& about, bool turned) {
    const glm::dvec3 a = mesh.positions[mesh.triangles[t].x] - about,
                     b = mesh.positions[mesh.triangles[t].y] - about,
                     c = mesh.positions[mesh.triangles[t].z] - about;
    const double six = glm::dot(a, glm::cross(b, c));
    volume += turned ? -six : six;
    size += std::abs(six);
  }
  [[nodiscard]] bool negative() const { return volume < -kNoVolume * size; }
  [[nodiscard]] bool positive() const { return volume > kNoVolume * size; }
};

/// Of a closed part: a point on it, and its box.
struct PartSample {
  glm::dvec3 point{0.0}, low{0.0}, high{0.0};
};

/// A triangle's positions, the least first, so that the order in the file does not matter.
using Corners = std::array<glm::dvec3, 3>;

inline bool less(const glm::dvec3& a, const glm::dvec3& b) {
  return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

/// Where a part lies.
struct Extent {
  Bounds box;
  Corners least{};  ///< of the triangle whose positions are least

  void include(const TriangleSoup& mesh, std::size_t t) {
    const glm::uvec3 at = mesh.triangles[t];
    Corners corners{mesh.positions[at.x], mesh.positions[at.y], mesh.positions[at.z]};
    const bool first = box.empty();
    for (const glm::dvec3& corner : corners) box.include(corner);
    std::sort(corners.begin(), corners.end(), less);
    if (first || std::lexicographical_compare(corners.begin(), corners.end(), least.begin(),
                                              least.end(), less)) {
      least = corners;
    }
  }
  [[nodiscard]] PartSample sample() const {
    return {(least[0] + least[1] + least[2]) / 3.0, box.low, box.high};
  }
};

/// How often the surface of `part` winds around the sample of another one.
struct Winding {
  std::uint32_t around = 0, part = 0;
  int times = 0;
};

/// The windings that are not 0 of each part around the samples of those whose box its own box
/// holds, sorted. @param part_of  of each triangle; those >= samples.size() do not count
/// @param turned  triangles that count the other way around
/// @param stop  some are missing once it is requested
[[nodiscard]] std::vector<Winding> windings_around(const TriangleSoup& mesh,
                                                   const std::vector<std::uint32_t>& part_of,
                                                   const std::vector<char>& turned,
                                                   const std::vector<PartSample>& samples,
                                                   const std::stop_token& stop);

/// Whether every piece of a closed mesh that shares no vertex with the others has a volume above 0,
/// or bounds a cavity.
/// @param by_index  edges that are balanced by position alone: their ends are one
/// @param all_positive  it is known that all of the mesh has
[[nodiscard]] bool all_outward(const TriangleSoup& mesh, std::span<const EdgeSum> by_index,
                               bool all_positive, const Execution& execution);

}  // namespace strata::detail
