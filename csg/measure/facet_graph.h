#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace strata::csg {

/// The facets of a mesh and their neighbours across edges. Vertices are equal if their positions
/// are. An edge has neighbours where exactly two facets use it.
class FacetGraph {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// Borrows both.
  FacetGraph(std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles);

  [[nodiscard]] std::size_t size() const { return triangles_.size(); }
  [[nodiscard]] double largest() const { return largest_; }  ///< coordinate, without its sign
  [[nodiscard]] const glm::dvec3& corner(std::uint32_t t, int k) const {
    return positions_[triangles_[t][k]];
  }
  [[nodiscard]] glm::dvec3 normal(std::uint32_t t) const;  ///< of length 1; 0 without an area
  [[nodiscard]] double area(std::uint32_t t) const;
  [[nodiscard]] glm::dvec3 middle(std::uint32_t t) const {
    return (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3.0;
  }
  [[nodiscard]] double circumradius(std::uint32_t t) const;
  template <class Test>
  [[nodiscard]] bool all_corners(std::uint32_t t, const Test& test) const {
    return test(corner(t, 0)) && test(corner(t, 1)) && test(corner(t, 2));
  }

  /// Across the edges from corner k to the next one; kNone: no one facet.
  [[nodiscard]] const std::array<std::uint32_t, 3>& neighbours(std::uint32_t t) const {
    return across_[t];
  }
  /// Neighbours whose normal is within 50 degrees.
  [[nodiscard]] std::vector<std::uint32_t> smooth_neighbours(std::uint32_t t) const;
  /// In one plane, as far as six digits tell.
  [[nodiscard]] bool coplanar(std::uint32_t a, std::uint32_t b) const;
  /// The facets around one that are coplanar with it, itself included.
  [[nodiscard]] std::vector<std::uint32_t> flat_patch(std::uint32_t seed) const;
  /// The `count` facets nearest to one across smooth edges.
  [[nodiscard]] std::vector<std::uint32_t> smooth_patch(std::uint32_t seed,
                                                        std::size_t count) const;

  /// The different corners of facets.
  [[nodiscard]] std::vector<glm::dvec3> points(const std::vector<std::uint32_t>& facets) const;
  /// How wide facets are, in their first one's plane, across an axis.
  [[nodiscard]] double width(const std::vector<std::uint32_t>& facets,
                             const glm::dvec3& axis) const;
  /// The largest side of the box around facets.
  [[nodiscard]] double extent(const std::vector<std::uint32_t>& facets) const;
  /// The closed lines around facets. A line that meets itself is left out.
  [[nodiscard]] std::vector<std::vector<glm::dvec3>> rims(
      const std::vector<std::uint32_t>& facets) const;

 private:
  std::span<const glm::dvec3> positions_;
  std::span<const glm::uvec3> triangles_;
  std::vector<std::uint32_t> first_;  ///< of each position: the first that is equal
  std::vector<std::array<std::uint32_t, 3>> across_;
  double largest_ = 0.0;
};

}  // namespace strata::csg
