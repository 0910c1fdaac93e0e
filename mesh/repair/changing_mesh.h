#pragma once

#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "mesh/repair/mesh_conflicts.h"

namespace strata {

/// A closed 2-manifold mesh that is changed in small steps, which can be taken back. Triangles that
/// are taken out keep their numbers, with equal corners.
class ChangingMesh {
 public:
  using Index = std::uint32_t;
  static constexpr Index kNone = 0xffffffffu;

  /// The mesh is borrowed, and changed.
  explicit ChangingMesh(RoundedMesh& mesh);

  const exact::FilePoint& position(Index vertex) const { return mesh_.positions[vertex]; }
  const glm::uvec3& triangle(Index t) const { return mesh_.triangles[t]; }
  bool alive(Index t) const { return mesh_.triangles[t].x != mesh_.triangles[t].y; }
  /// The triangles at a vertex.
  std::span<const Index> around(Index vertex) const;

  void move(Index vertex, const exact::FilePoint& to);
  /// Puts `from` onto `to`, at the other end of an edge. Each of these steps returns false, and
  /// changes nothing, where the mesh would not stay a manifold.
  bool contract(Index from, Index to);
  /// The same where the ends have three neighbours in common: the mesh is cut along the ends and
  /// the third one, x, and closed again on both sides, where each gets copies of its own of `to`
  /// and x.
  bool contract_and_cut(Index from, Index to);
  /// Replaces the edge from a to b by the other diagonal of its two triangles.
  bool flip(Index a, Index b);
  /// Takes out the four triangles that a triangle hangs together with, if they are no more.
  bool take_out_tetrahedron(Index t);

  /// Puts a new vertex into the edge from a to b. @return false where there is no such edge
  bool divide_edge(Index a, Index b, const exact::FilePoint& at);
  /// Puts a new vertex into a triangle.
  void divide_triangle(Index t, const exact::FilePoint& at);

  /// The triangles that were changed since the last keep() or take_back().
  const std::vector<Index>& changed() const { return changed_; }
  void keep();
  void take_back();

 private:
  std::vector<Index>& fan(Index vertex);
  void set_triangle(Index t, const glm::uvec3& corners);
  void change_triangle(Index t, const glm::uvec3& corners);
  void add_triangle(const glm::uvec3& corners, Index like);
  Index triangle_of(Index a, Index b) const;
  Index opposite(Index t, Index a, Index b) const;
  std::vector<Index> neighbours(Index vertex) const;
  std::vector<Index> common_neighbours(Index a, Index b) const;
  bool walk_around(Index centre, Index from, Index to, std::vector<Index>& triangles) const;
  void replace(const std::vector<Index>& triangles, Index vertex, Index by);

  RoundedMesh& mesh_;
  std::vector<Index> first_, at_;                       // the triangles at each vertex at first
  std::unordered_map<Index, std::vector<Index>> fans_;  // at those vertices where they were changed
  std::vector<Index> changed_;
  // What steps have replaced since the last keep() or take_back(), in order.
  std::vector<std::pair<Index, glm::uvec3>> old_triangles_;
  std::vector<std::pair<Index, exact::FilePoint>> old_positions_;
  std::size_t old_triangle_count_ = 0, old_vertex_count_ = 0;
};

}  // namespace strata
