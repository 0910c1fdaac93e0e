#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <string>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"

namespace strata::apps {

/// What a Boolean tree is, by CGAL with exact constructions: corefinement of its solids, Nef
/// polyhedra where that refuses (results that are no manifold). Coordinates are the doubles of the
/// solids in world space; nothing is snapped.
class ExactSolid {
 public:
  enum class Side { kOutside, kBoundary, kInside };

  /// How it came about.
  struct Facts {
    std::uint64_t solids = 0;         ///< that were taken in
    std::uint64_t corefinements = 0;  ///< Boolean operations by corefinement
    std::uint64_t nef_operations = 0;
    std::uint64_t triangles = 0;  ///< of the result
  };

  /// @return kGeometry naming the solid that CGAL cannot take (open; faces that intersect within
  /// one component; components whose winding numbers cannot be told apart), kCancelled, kInternal
  /// with CGAL's words
  static Result<ExactSolid> evaluate(const csg::Tree& tree, csg::Tree::NodeId root,
                                     const Execution& execution = {});
  ~ExactSolid();
  ExactSolid(ExactSolid&&) noexcept;
  ExactSolid& operator=(ExactSolid&&) noexcept;

  [[nodiscard]] bool empty() const;
  [[nodiscard]] double volume() const;  ///< cubic world units
  [[nodiscard]] double area() const;    ///< square world units
  /// Six times the volume, exactly: a fraction in lowest terms, `2/3` or `2`.
  [[nodiscard]] std::string six_volumes() const;
  /// Over all edges: length * how much the normal changes there (1-norm), in world units. Half of
  /// it times the distance of rays bounds what counting rays through a face gets its area wrong by.
  [[nodiscard]] double creases() const;
  [[nodiscard]] const Facts& facts() const;
  /// Decided exactly.
  [[nodiscard]] Side side_of(const glm::dvec3& point) const;

 private:
  struct Impl;
  explicit ExactSolid(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace strata::apps
