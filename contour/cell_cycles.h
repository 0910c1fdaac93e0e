#pragma once

#include <array>
#include <cstdint>

// How the surface passes a cell, by which of its eight corners are inside. Private to contour/.
//
// Corner dx + 2 dy + 4 dz. Edge 4 a + d + 2 e runs along axis a; d and e are its places along the
// other two axes, in increasing order. The face across axis a has the frame (p, q), with p, q, a
// right-handed; its corners are (0,0), (1,0), (1,1), (0,1), and edge e of it joins corners e, e
// + 1.

namespace strata::contouring {

inline constexpr int kNoCycle = 255;

/// A piece of the surface's line through a face, between two of the face's edges. The inside is on
/// its left, seen from the end of the axis.
struct FaceSegment {
  std::uint8_t from = 0, to = 0;  ///< edges of the face
};

/// The lines through a face of four corners. Where two opposite corners alone are inside, the lines
/// part them; so both cells at the face agree.
struct FaceSegments {
  std::uint8_t count = 0;
  std::array<FaceSegment, 2> at{};
};

constexpr std::array<FaceSegments, 16> make_face_segments() {
  std::array<FaceSegments, 16> table{};
  for (unsigned corners = 1; corners < 15; ++corners) {
    FaceSegments& lines = table[corners];
    for (unsigned c = 0; c < 4; ++c) {
      const unsigned next = (c + 1) % 4;
      if ((corners >> c & 1) == 0 || (corners >> next & 1) != 0) continue;
      // Corner c is the last of a run of inside corners; the line ends where the run begins.
      unsigned first = c;
      while ((corners >> (first + 3) % 4 & 1) != 0) first = (first + 3) % 4;
      lines.at[lines.count++] = {static_cast<std::uint8_t>(c),
                                 static_cast<std::uint8_t>((first + 3) % 4)};
    }
  }
  return table;
}
inline constexpr std::array<FaceSegments, 16> kFaceSegments = make_face_segments();

/// The corner of the cell that is corner `c` of its face across `axis` on `side`.
constexpr unsigned face_corner(unsigned axis, unsigned side, unsigned c) {
  const unsigned p = (axis + 1) % 3, q = (axis + 2) % 3;
  return side << axis | (c == 1 || c == 2 ? 1u : 0u) << p | (c >= 2 ? 1u : 0u) << q;
}
/// The edge of the cell that is edge `e` of that face.
constexpr unsigned face_edge(unsigned axis, unsigned side, unsigned e) {
  const unsigned p = (axis + 1) % 3, q = (axis + 2) % 3;
  const unsigned along = e % 2 == 0 ? p : q, across = e % 2 == 0 ? q : p;
  const unsigned place = e == 1 || e == 2 ? 1u : 0u;
  const unsigned first = axis < across ? side : place, second = axis < across ? place : side;
  return along * 4 + first + 2 * second;
}
/// The corners of a face of a cell, as kFaceSegments takes them.
constexpr unsigned face_corners(unsigned corners, unsigned axis, unsigned side) {
  unsigned result = 0;
  for (unsigned c = 0; c < 4; ++c) result |= (corners >> face_corner(axis, side, c) & 1) << c;
  return result;
}
/// Whether four lines end at a face's edges.
constexpr bool is_ambiguous(unsigned face) { return face == 5 || face == 10; }

/// What is known of a cell by its corners.
struct CellCase {
  std::uint16_t cut = 0;                   ///< bit e: edge e is cut
  std::uint8_t cycles = 0;                 ///< closed lines on the cell's faces; each gets a vertex
  bool special = false;                    ///< several cycles, or an ambiguous face
  bool low_inside = false;                 ///< corner 0 is inside
  std::array<std::uint8_t, 3> low_face{};  ///< corners of its lower face across each axis
  std::array<std::uint8_t, 12> cycle{};    ///< of each edge; kNoCycle if it is not cut
};

/// All 256 cases.
const std::array<CellCase, 256>& cell_cases();

}  // namespace strata::contouring
