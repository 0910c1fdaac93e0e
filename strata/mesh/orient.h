#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "strata/core/execution.h"
#include "strata/mesh/triangle_soup.h"

namespace strata {

/// What orient_parts() found and did.
///
/// A part is a set of triangles connected by edges of two faces, welded by position. An edge of
/// more faces connects those two that share its vertices in the file, if there are exactly two. A
/// part is closed when all its own edges balance once its triangles agree.
struct Orientation {
  bool closed = false;  ///< as is_closed(), afterwards
  /// Not counted for a closed mesh whose parts all face outward; 0 then.
  std::uint64_t parts = 0;
  std::uint64_t turned_parts = 0;      ///< parts whose triangles agreed and that were inside out
  std::uint64_t turned_triangles = 0;  ///< triangles of parts whose triangles did not agree
  std::uint64_t mixed_parts = 0;       ///< parts whose triangles did not agree
  std::uint64_t not_orientable = 0;    ///< parts such as a Moebius strip; left as they are
  std::uint64_t double_faces = 0;      ///< second sides of double-sided solids, removed
  /// All triangles agreed and all were reversed: the mesh was inside out.
  bool all_turned = false;
  /// Volume of the open part of the mesh, with holes closed towards the middle of its bounds, if
  /// that part was reversed as a whole; else 0.
  double turned_open_volume = 0.0;

  /// Whether anything was reversed or removed.
  [[nodiscard]] bool changed() const {
    return turned_parts + turned_triangles + double_faces > 0 || turned_open_volume != 0.0;
  }
};

/// Settings of orient_parts().
struct OrientOptions {
  bool change =
      true;  ///< false: only diagnoses; Orientation::closed is then that of the mesh as it is
  /// The mesh's signed volume is known to be above 0 by more than rounding; saves a sum.
  bool positive = false;
};

/// Reverses triangles so that the parts of a mesh are solids:
///
/// - triangles of a part that do not agree with their neighbours are reversed; the larger area
///   keeps its side,
/// - a closed part that is inside out is reversed, unless it bounds a cavity, which means that the
///   winding number of the parts around it is at least 1. Everything within a reversed part is
///   reversed with it, so a mesh that is inside out as a whole is reversed as a whole,
/// - a closed part that has each face twice, in both orientations, keeps one of the two,
/// - an open part is reversed if its volume, with holes closed towards the middle, is negative.
///
/// Nothing else is changed: parts that may be intended as they are stay. The result depends neither
/// on the order of the triangles nor on threads. A closed mesh of outward parts costs little more
/// than is_closed(), any other one a little more than diagnose(). After a stop request the mesh may
/// be unchanged.
/// @pre indices < positions.size(); with 2^31 triangles or more only closedness is determined
Orientation orient_parts(TriangleSoup& mesh, const Execution& execution = {},
                         const OrientOptions& options = {});

/// The result as sentences about reversed parts and triangles. `all_turned` and
/// `turned_open_volume`, which concern the whole mesh, are not included. @param changed
/// OrientOptions::change
[[nodiscard]] std::vector<std::string> sentences(const Orientation& found, bool changed);

}  // namespace strata
