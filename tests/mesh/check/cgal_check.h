#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>

// What CGAL says of a mesh, with exact numbers (EPECK). Link strata_test_cgal_check, which is there
// where CGAL is: one file includes it.

namespace strata::oracle {

struct CgalCheck {
  bool mesh = false;    ///< an orientable 2-manifold by index: CGAL takes it as a Surface_mesh
  bool closed = false;  ///< no border
  /// Pairs of triangles that PMP::self_intersections() reports. Where vertices are there several
  /// times, those whose CGAL::intersection() is one vertex or edge of both are left out.
  std::uint64_t meeting_pairs = 0;
  bool bounds_volume = false;  ///< PMP::does_bound_a_volume(); asked if all else is well
  bool outward = false;        ///< PMP::is_outward_oriented(); likewise

  [[nodiscard]] bool sound() const {
    return mesh && closed && meeting_pairs == 0 && bounds_volume && outward;
  }
  [[nodiscard]] std::string text() const {
    return mesh ? std::string(closed ? "closed, " : "open, ") + std::to_string(meeting_pairs) +
                      " pairs meet, " + (bounds_volume ? "" : "no ") + "volume, " +
                      (outward ? "outward" : "not outward")
                : "no 2-manifold";
  }
};

/// @pre triangles have three different vertices
CgalCheck cgal_check(std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles);

}  // namespace strata::oracle
