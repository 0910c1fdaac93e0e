#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace strata::csg {

/// Statistics of a drawing.
struct DrawReport {
  std::uint64_t fragments = 0;  ///< crossings that were computed
  std::uint64_t resolved = 0;   ///< pixels decided individually: coincident faces, deep nesting
  std::uint64_t covered = 0;    ///< pixels that show a solid
};

/// The visible surface of each pixel, row by row from the top.
struct SurfaceImage {
  static constexpr std::uint32_t kNone = 0xffffffffu;  ///< depth of pixels without a solid
  static constexpr std::uint32_t kExit = 0x80000000u;  ///< bit of `triangle`
  int width = 0;                                       ///< pixels
  int height = 0;                                      ///< pixels
  std::vector<std::uint32_t> depth;  ///< in steps of the view, View::distance(); kNone: nothing
  std::vector<std::uint32_t>
      solid;  ///< index into the tree's solids; undefined where no solid is visible
  std::vector<std::uint32_t> triangle;  ///< [exit:1 | triangle:31] of the solid's mesh; exit: a cut
                                        ///< face, where the ray leaves the solid
  /// Makes room for a picture of that size; the content is undefined then.
  void resize(int columns, int rows) {
    width = columns, height = rows;
    const std::size_t pixels = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    for (auto* plane : {&depth, &solid, &triangle}) plane->resize(pixels);
  }
};

}  // namespace strata::csg
