#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <span>

// Where the vertex of a cell lies. Private to contour/.

namespace strata::contouring {

/// The plane of a triangle: normal . p = offset, in lattice steps.
struct Plane {
  glm::dvec3 normal{0.0};  ///< of length 1; 0 if the triangle has no area
  double offset = 0.0;
  /// How well it is known, up to 1: its triangle's corners were rounded, by half a step, so at
  /// the other side of a cell the plane of a triangle of height h is off by about 90 / h steps.
  double weight = 1.0;
};

/// The plane of a triangle; normal 0 if it has no area.
[[nodiscard]] Plane plane_of(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);

/// The different planes of a cell.
class CellPlanes {
 public:
  void clear() { count_ = 0; }
  /// Takes a plane that has a normal. Of planes with the same normal, the best known one counts.
  void add(const Plane& plane);
  [[nodiscard]] std::span<const Plane> all() const { return std::span(planes_).first(count_); }

 private:
  std::array<Plane, 12> planes_;
  std::size_t count_ = 0;
};

/// Where the vertex may lie: inside the cell and inside the grid.
struct CellBounds {
  glm::ivec3 low{1}, high{255};
};

struct CellVertex {
  glm::ivec3 at{0};      ///< lattice steps from the lower corner
  bool clamped = false;  ///< the best place lay outside the bounds
};

/// The lattice point nearest to the mean of the points where a cell's edges are cut.
[[nodiscard]] CellVertex mean_vertex(const glm::dvec3& mean, const CellBounds& bounds = {});
/// The lattice point nearest to that with the least sum of squared distances from the planes; of
/// several, the one nearest to the mean. Where three planes meet in the cell, it is that point.
[[nodiscard]] CellVertex feature_vertex(const glm::dvec3& mean, const CellPlanes& planes,
                                        const CellBounds& bounds = {});

}  // namespace strata::contouring
