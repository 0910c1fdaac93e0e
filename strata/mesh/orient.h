#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "strata/core/execution.h"
#include "strata/mesh/triangle_soup.h"

namespace strata {

/// What orient_parts() found and did.
///
/// A part is what hangs together over edges of two faces, welded by position. Edges of more faces
/// join those two that share their vertices in the file, where there are two. A part is closed when
/// all its own edges balance once its triangles agree.
struct Orientation {
  bool closed = false;  ///< as is_closed(), afterwards
  /// Counted where there was reason to look: 0 of a closed mesh whose parts are all outward.
  std::uint64_t parts = 0;
  std::uint64_t turned_parts = 0;      ///< whose triangles agreed, and which were inside out
  std::uint64_t turned_triangles = 0;  ///< of parts whose triangles did not agree
  std::uint64_t mixed_parts = 0;       ///< such parts
  std::uint64_t not_orientable = 0;    ///< parts such as a Moebius strip; left as they are
  std::uint64_t double_faces = 0;      ///< second sides of double-sided solids, removed
  /// All triangles were turned, and all agreed: the mesh was inside out.
  bool all_turned = false;
  /// What is not closed was turned as a whole: its volume, with holes closed towards the middle of
  /// its bounds, was this. Else 0.
  double turned_open_volume = 0.0;

  [[nodiscard]] bool changed() const {
    return turned_parts + turned_triangles + double_faces > 0 || turned_open_volume != 0.0;
  }
};

struct OrientOptions {
  bool change = true;  ///< false: only looks; Orientation::closed is that of the mesh as it is
  /// The mesh's signed volume is known to be above 0 by more than rounding; saves a sum.
  bool positive = false;
};

/// Turns triangles so that the parts of a mesh are solids:
///
/// - triangles of a part that do not agree with their neighbours are turned; the larger area keeps
///   its side,
/// - a closed part that is inside out is turned, unless it bounds a cavity: lies where the parts
///   around it wind at least once. What is within a part that is turned is turned with it, so that
///   a mesh that is inside out as a whole is turned as a whole,
/// - of a closed part that has each face twice, once each way, one side stays,
/// - what is not closed is turned where its volume is negative, with holes closed towards the
///   middle.
///
/// Nothing else is touched: parts that may be meant as they are stay. The result depends neither on
/// the order of the triangles nor on threads. A closed mesh of outward parts costs little more than
/// is_closed(), any other one as much as diagnose() and a little more. With a stop request the mesh
/// may be left as it is.
/// @pre indices < positions.size(); fewer than 2^31 triangles, or only closedness is told
Orientation orient_parts(TriangleSoup& mesh, const Execution& execution = {},
                         const OrientOptions& options = {});

/// The same as sentences, of parts and triangles that were turned; none of `all_turned` and
/// `turned_open_volume`, which speak of the mesh. @param changed  OrientOptions::change
[[nodiscard]] std::vector<std::string> sentences(const Orientation& found, bool changed);

}  // namespace strata
