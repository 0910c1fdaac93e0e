#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <utility>
#include <vector>

namespace strata::detail {

/// Triangles of simple polygons in the plane in O(n log n). Room is kept from one to the next.
class PolygonSweep {
 public:
  /// @param polygon  counter-clockwise; finite, products do not overflow
  /// @param triangles  gets n - 2 triangles, counter-clockwise, of indices into `polygon`
  /// @return false when the polygon crosses or touches itself, so that no such triangles were found
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
  // At each vertex its edge out and then its diagonals, counter-clockwise: slots.
  std::vector<Index> first_slot_, slot_target_, slot_diagonal_, slot_twin_;
  std::vector<Index> order_, face_, stack_, merged_;
  std::vector<std::uint8_t> upper_;
};

}  // namespace strata::detail
