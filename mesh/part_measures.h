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

// The measures of parts that orient_parts() uses; private to mesh/.

namespace strata::detail {

/// A volume counts as zero below this fraction of the summed absolute volumes.
inline constexpr double kNoVolume = 1e-9;

/// Six times the volume between triangles and a point, and the sum of the absolute values.
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

/// A point on a closed part, and the part's box.
struct PartSample {
  glm::dvec3 point{0.0}, low{0.0}, high{0.0};
};

/// A triangle's sorted positions, independent of their order in the file.
using Corners = std::array<glm::dvec3, 3>;

inline bool less(const glm::dvec3& a, const glm::dvec3& b) {
  return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

/// The extent of a part.
struct Extent {
  Bounds box;
  Corners least{};  ///< positions of the least triangle

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

/// How often the surface of `part` winds around the sample of the part `around`.
struct Winding {
  std::uint32_t around = 0, part = 0;
  int times = 0;
};

/// The non-zero windings of parts around the samples of other parts, sorted. Only parts whose box
/// contains the box of the sample's part are examined.
/// @param part_of  the part of each triangle; triangles with values >= samples.size() do not count
/// @param turned  the triangles that count as reversed
/// @param stop  after a stop request some windings are missing
[[nodiscard]] std::vector<Winding> windings_around(const TriangleSoup& mesh,
                                                   const std::vector<std::uint32_t>& part_of,
                                                   const std::vector<char>& turned,
                                                   const std::vector<PartSample>& samples,
                                                   const std::stop_token& stop);

/// Whether each vertex-connected piece of a closed mesh has a positive volume or bounds a cavity.
/// @param by_index  edges that are balanced by position only; their ends are merged
/// @param all_positive  the volume of the whole mesh is known to be positive
[[nodiscard]] bool all_outward(const TriangleSoup& mesh, std::span<const EdgeSum> by_index,
                               bool all_positive, const Execution& execution);

}  // namespace strata::detail
