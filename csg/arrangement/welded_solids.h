#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "csg/lattice/lattice_solids.h"

namespace strata::csg {

/// How often a triangle belongs to a solid: 1, or more where the solid has it several times, or
/// less than 0 where the solid has it the other way around.
struct SolidCount {
  std::uint32_t solid;
  std::int32_t count;

  friend bool operator==(const SolidCount&, const SolidCount&) = default;
};

/// Solids of which equal points are one vertex. Triangles without area are gone: corners of their
/// neighbours lie on edges of other neighbours, as such corners do anywhere.
struct WeldedSolids {
  std::vector<exact::LatticePoint> vertices;  ///< all different
  std::vector<glm::uvec3> triangles;          ///< with area
  /// The index into contents() of each triangle.
  std::vector<std::uint32_t> content_of;

  /// The solids of a triangle, sorted, and how it faces.
  std::span<const SolidCount> content(std::uint32_t triangle) const {
    const std::uint32_t c = content_of[triangle];
    return std::span(counts).subspan(first_count[c], first_count[c + 1] - first_count[c]);
  }
  /// Content s for s < solid count is {s, 1}; others follow.
  std::vector<SolidCount> counts;
  std::vector<std::uint32_t> first_count;

  std::vector<std::uint32_t> labels;        ///< of the triangles, or empty
  std::vector<std::uint32_t> count_labels;  ///< of counts that several triangles were made one of

  /// The label that a triangle has as a face of a solid; none where the solid does not have it.
  /// @pre there are labels
  std::optional<std::uint32_t> label(std::uint32_t triangle, std::uint32_t solid) const {
    const std::uint32_t c = content_of[triangle];
    for (std::uint32_t i = first_count[c]; i < first_count[c + 1]; ++i) {
      if (counts[i].solid != solid) continue;
      return i < first_merged ? labels[triangle] : count_labels[i - first_merged];
    }
    return std::nullopt;
  }
  std::uint32_t first_merged = 0;  ///< the count at which those of count_labels begin
};

/// Welds. @return kCancelled
Result<WeldedSolids> weld_solids(LatticeSolids solids, const Execution& execution);

/// The corner `next` places after that where a side begins. @param use  3 * triangle + side
inline std::uint32_t corner_of(std::span<const glm::uvec3> triangles, std::uint32_t use,
                               std::uint32_t next) {
  return triangles[use / 3][static_cast<int>((use % 3 + next) % 3)];
}

/// Whether an edge has two triangles that continue each other: it runs to and fro. @param uses of
/// it
inline bool to_and_fro(std::span<const glm::uvec3> triangles, std::span<const std::uint32_t> uses) {
  return uses.size() == 2 && corner_of(triangles, uses[0], 0) == corner_of(triangles, uses[1], 1);
}

/// The edges of a mesh's triangles, each with all its triangles.
struct MeshEdges {
  /// The edge of each side: [3 * triangle + side].
  std::vector<std::uint32_t> edge_of;
  std::vector<std::uint32_t> first_use;  ///< of each edge; one more than edges
  std::vector<std::uint32_t> uses;       ///< 3 * triangle + side
  bool equal_triangles = false;          ///< some triangles have the same corners

  std::size_t size() const { return first_use.size() - 1; }
  std::span<const std::uint32_t> uses_of(std::uint32_t edge) const {
    return std::span(uses).subspan(first_use[edge], first_use[edge + 1] - first_use[edge]);
  }
};

/// Makes one triangle of equal ones, which have several solids in their content then. Triangles
/// that a solid has in both directions equally often are gone.
void merge_equal_triangles(WeldedSolids& solids);

MeshEdges find_mesh_edges(std::span<const glm::uvec3> triangles, std::size_t vertex_count);

}  // namespace strata::csg
