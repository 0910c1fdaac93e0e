#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <utility>
#include <vector>

namespace strata::detail {

/// Triangulates simple polygons in the plane in O(n log n). It keeps its memory between calls.
class PolygonSweep {
 public:
  /// @param polygon  counter-clockwise and finite; products of coordinates do not overflow
  /// @param triangles  gets n - 2 counter-clockwise triangles of indices into `polygon`
  /// @return false when the polygon crosses or touches itself; then no triangulation was found
  [[nodiscard]] bool cut(std::span<const glm::dvec2> polygon, std::vector<glm::uvec3>& triangles);

 private:
  using Index = std::uint32_t;
  struct Below;

  [[nodiscard]] bool before(Index a, Index b) const;
  [[nodiscard]] Index next(Index i) const;
  [[nodiscard]] Index previous(Index i) const;
  [[nodiscard]] bool find_diagonals();
  void sort_slots();
  void cut_along_diagonals(std::vector<glm::uvec3>& triangles);
  void cut_monotone(std::span<const Index> face, std::vector<glm::uvec3>& triangles);

  std::span<const glm::dvec2> points_;
  std::vector<std::pair<Index, Index>> diagonals_;
  // Slots of a vertex: its outgoing edge, then its diagonals counter-clockwise.
  std::vector<Index> first_slot_, slot_target_, slot_diagonal_, slot_twin_;
  std::vector<Index> order_, face_, stack_, merged_;
  std::vector<std::uint8_t> upper_;
};

}  // namespace strata::detail
