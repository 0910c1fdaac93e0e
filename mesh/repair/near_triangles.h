#pragma once

#include <unordered_map>
#include <vector>

#include "mesh/repair/mesh_conflicts.h"

namespace strata {

/// Finds the triangles of a mesh near some of them, while the mesh changes.
class NearTriangles {
 public:
  /// The mesh is borrowed.
  explicit NearTriangles(const RoundedMesh& mesh);

  /// To be called for triangles that have new corners or positions and keep them.
  void enter(const std::vector<std::uint32_t>& triangles);
  /// How many conflicts the triangles have, with each other and with all others. Only they may have
  /// changed since enter(). Triangles of which two corners are one vertex are not there.
  /// @param most  counting ends there
  std::size_t count_conflicts(std::vector<std::uint32_t> triangles, std::size_t most);

 private:
  using Index = std::uint32_t;
  struct Box {
    glm::ivec3 low, high;  // in whole steps; both belong to it
    bool touches(const Box& other) const;
  };

  Box box(Index triangle) const;
  bool conflict(Index a, Index b) const;
  template <class Work>
  void for_cells(const Box& box, const Work& work) const;
  bool is_large(const Box& box) const;

  const RoundedMesh& mesh_;
  Box all_{};
  int shift_ = 0;
  glm::ivec3 size_{1};
  std::vector<Index> first_, in_cells_;  // triangles in the cells of a grid, as they were at first
  std::unordered_map<std::size_t, std::vector<Index>> entered_;  // in cells, later
  std::vector<Index> large_;
  std::vector<Box> boxes_;                // of the triangles, as they were entered
  std::vector<Index> visited_, counted_;  // the visit, and the count, that saw a triangle last
  Index visit_ = 0, count_ = 0;
};

}  // namespace strata
