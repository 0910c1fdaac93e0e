#include "contour/cell_cycles.h"

namespace strata::contouring {
namespace {

CellCase make_case(unsigned corners) {
  CellCase result;
  result.low_inside = (corners & 1) != 0;
  std::array<std::array<std::uint8_t, 2>, 12> neighbours{};  // along the lines
  std::array<std::uint8_t, 12> degree{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    for (unsigned side = 0; side < 2; ++side) {
      const unsigned face = face_corners(corners, axis, side);
      if (side == 0) result.low_face[axis] = static_cast<std::uint8_t>(face);
      result.special = result.special || is_ambiguous(face);
      for (unsigned i = 0; i < kFaceSegments[face].count; ++i) {
        const FaceSegment segment = kFaceSegments[face].at[i];
        const unsigned a = face_edge(axis, side, segment.from);
        const unsigned b = face_edge(axis, side, segment.to);
        neighbours[a][degree[a]++] = static_cast<std::uint8_t>(b);
        neighbours[b][degree[b]++] = static_cast<std::uint8_t>(a);
        result.cut = static_cast<std::uint16_t>(result.cut | 1u << a | 1u << b);
      }
    }
  }
  result.cycle.fill(kNoCycle);
  for (unsigned first = 0; first < 12; ++first) {
    if ((result.cut >> first & 1) == 0 || result.cycle[first] != kNoCycle) continue;
    unsigned edge = first;
    do {
      result.cycle[edge] = result.cycles;
      const auto& next = neighbours[edge];
      edge = result.cycle[next[0]] == kNoCycle ? next[0] : next[1];
    } while (result.cycle[edge] == kNoCycle);
    ++result.cycles;
  }
  result.special = result.special || result.cycles > 1;
  return result;
}

}  // namespace

const std::array<CellCase, 256>& cell_cases() {
  static const std::array<CellCase, 256> table = [] {
    std::array<CellCase, 256> made;
    for (unsigned corners = 0; corners < 256; ++corners) made[corners] = make_case(corners);
    return made;
  }();
  return table;
}

}  // namespace strata::contouring
