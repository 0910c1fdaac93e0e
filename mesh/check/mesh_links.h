#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "exact/cut_points.h"
#include "strata/core/execution.h"

namespace strata {

/// How the triangles of a mesh are connected.
struct MeshLinks {
  bool by_index = false;  ///< vertices are told apart by index, not by position
  std::uint64_t edges = 0, unbalanced_edges = 0, non_manifold_edges = 0, non_manifold_vertices = 0;
  std::vector<std::array<std::uint32_t, 2>> edge_examples;  ///< non-manifold: vertices, sorted
  std::vector<std::uint32_t> vertex_examples;               ///< non-manifold, sorted
  std::uint32_t shells = 0;
  std::vector<std::uint32_t> shell_of;  ///< of each triangle: 0 to shells - 1, in order
  std::vector<std::uint32_t> vertex;    ///< the first that is the same; empty: by index
};

inline constexpr std::size_t kLinkExamples = 8;

/// See MeshCheck. Triangles without three different vertices have no edges that count, and are in
/// shells of their own. After a stop request the result means nothing.
/// @pre fewer than 2^30 triangles; indices < positions.size()
MeshLinks mesh_links(std::span<const exact::FilePoint> positions,
                     std::span<const glm::uvec3> triangles, const Execution& execution);

}  // namespace strata
