#pragma once

// Exact overlap of a snapped triangle with the voxels of a window of columns. Used by surface.cpp
// and the tests of it; not part of the library's interface.
//
// This work is based on:
// Tomas Akenine-Moeller. Fast 3D triangle-box overlap testing. 2001.
// Michael Schwarz, Hans-Peter Seidel. Fast parallel surface and solid voxelization on GPUs. 2010.
// Jian Huang, Roni Yagel, Vassily Filippov, Yair Kurzion. An accurate method for voxelizing polygon
// meshes. 1998.
// Samuli Laine. A topological approach to voxelization. 2013.
//
// We differ: nothing is tested voxel by voxel. The 13 separating axes are the plane's normal, and
// those of three 2D problems (a triangle's projection against a square). Each gives, for a fixed
// column, a range of voxels, in integers; their intersection is the run of voxels touched.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <limits>

#include "strata/raster/lattice_mesh.h"

namespace strata::shell {

__extension__ typedef __int128 Wide;  // not ISO C++: -Wpedantic
/// A lattice point or vector as (u, v, w): two axes of the image, then the axis of the columns.
using Vector = std::array<std::int64_t, 3>;
using Triangle = std::array<Vector, 3>;

/// The columns [u_begin, u_end) x [v_begin, v_end) of voxels 0 .. w_end - 1 along w. At most
/// kWindowSide columns along u and along v.
struct Window {
  int u_begin = 0, u_end = 0, v_begin = 0, v_end = 0, w_end = 0;
};
inline constexpr int kWindowSide = 64;

/// Voxels first..last, both inclusive; empty while first > last.
struct Range {
  std::int32_t first = std::numeric_limits<std::int32_t>::max();
  std::int32_t last = std::numeric_limits<std::int32_t>::min();

  void include(std::int64_t low, std::int64_t high) {
    first = std::min(first, static_cast<std::int32_t>(low));
    last = std::max(last, static_cast<std::int32_t>(high));
  }
};

/// a = quotient b + remainder, 0 <= remainder < b.
struct Division {
  std::int64_t quotient = 0, remainder = 0;

  /// Moves from a to a + by.quotient b + by.remainder: one carry, no division.
  void advance(const Division& by, std::int64_t b) {
    quotient += by.quotient;
    remainder += by.remainder;
    if (remainder >= b) {
      remainder -= b;
      ++quotient;
    }
  }
};

/// @pre b > 0
[[nodiscard]] inline Division divide(std::int64_t a, std::int64_t b) {
  const std::int64_t q = a / b, r = a % b;
  return r < 0 ? Division{q - 1, r + b} : Division{q, r};
}
/// The same; the quotient must fit in 64 bits.
[[nodiscard]] inline Division divide(Wide a, std::int64_t b) {
  if (a == static_cast<std::int64_t>(a)) return divide(static_cast<std::int64_t>(a), b);
  const Wide q = a / b;
  const auto r = static_cast<std::int64_t>(a - q * b);
  const auto narrow = static_cast<std::int64_t>(q);
  return r < 0 ? Division{narrow - 1, r + b} : Division{narrow, r};
}

/// Range of cells (closed, 2^bits lattice steps a side) that the closed triangle touches along axis
/// b within each strip of cells begin <= i < end along axis a: out[i - begin]. A strip that it does
/// not touch stays as it is. All of it fits in 64 bits: coordinates are at most 2^28.
void strip_ranges(const Triangle& triangle, int a, int b, int bits, int begin, int end, Range* out);

[[nodiscard]] inline Vector subtract(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
/// At most 2^59 a component for differences of lattice points.
[[nodiscard]] inline Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
[[nodiscard]] inline Vector normal(const Triangle& t) {
  return cross(subtract(t[1], t[0]), subtract(t[2], t[0]));
}

/// The voxels along axis `axis` that are no farther than `margin` lattice steps from the triangle's
/// box; closed boxes touch.
[[nodiscard]] inline Range voxel_bounds(const Triangle& t, int axis, int margin = 0) {
  const auto index = static_cast<std::size_t>(axis);
  const auto [low, high] = std::minmax({t[0][index], t[1][index], t[2][index]});
  return {static_cast<std::int32_t>((low - 1 - margin) >> kLatticeBits),
          static_cast<std::int32_t>((high + margin) >> kLatticeBits)};
}

/// Calls run(u, v, first, last) once for every column of the window in which the closed triangle
/// touches a voxel; first..last are all the voxels it touches there.
template <class Run>
void conservative_runs(const Triangle& triangle, const Window& window, Run&& run) {
  const Range box_u = voxel_bounds(triangle, 0), box_v = voxel_bounds(triangle, 1);
  const int u_begin = std::max(window.u_begin, box_u.first);
  const int u_end = std::min(window.u_end, box_u.last + 1);
  const int v_begin = std::max(window.v_begin, box_v.first);
  const int v_end = std::min(window.v_end, box_v.last + 1);
  if (u_begin >= u_end || v_begin >= v_end) return;

  std::array<Range, kWindowSide> row_u, row_w, column_w;
  strip_ranges(triangle, 1, 0, kLatticeBits, v_begin, v_end, row_u.data());
  strip_ranges(triangle, 1, 2, kLatticeBits, v_begin, v_end, row_w.data());
  strip_ranges(triangle, 0, 2, kLatticeBits, u_begin, u_end, column_w.data());

  // Plane n . x = d. A triangle seen edge-on (n_w = 0) has this axis among those of row_u already.
  Vector n = normal(triangle);
  if (n[2] < 0) n = {-n[0], -n[1], -n[2]};
  const bool tilted = n[2] > 0;
  const std::int64_t divisor = tilted ? n[2] : 1;
  const Wide d =
      Wide{n[0]} * triangle[0][0] + Wide{n[1]} * triangle[0][1] + Wide{n[2]} * triangle[0][2];
  // The lowest corner of voxel k must not lie above the plane, the highest not below it:
  //   n_w k <= floor(d / 256) - n_u u - n_v v - min(n_u, 0) - min(n_v, 0) = last
  //   n_w (k + 1) >= ceil(d / 256) - n_u u - n_v v - max(n_u, 0) - max(n_v, 0) = last - gap
  const std::int64_t zero = 0;
  const Wide upper = (d >> kLatticeBits) - std::min(n[0], zero) - std::min(n[1], zero);
  const std::int64_t gap = std::abs(n[0]) + std::abs(n[1]) - (d % kLatticeSteps == 0 ? 0 : 1);
  const Division step = divide(-n[0], divisor);
  const Division to_first = divide(-gap - 1, divisor);  // ceil(x / n) - 1 = floor((x - 1) / n)
  Division last;

  for (int v = v_begin; v < v_end; ++v) {
    const Range& row = row_u[static_cast<std::size_t>(v - v_begin)];
    const Range& row_depth = row_w[static_cast<std::size_t>(v - v_begin)];
    const int from = std::max(u_begin, row.first), to = std::min(u_end - 1, row.last);
    if (from > to) continue;
    const std::int64_t row_first = std::max(row_depth.first, 0);
    const std::int64_t row_last = std::min(row_depth.last, window.w_end - 1);
    if (tilted) last = divide(upper - Wide{n[0]} * from - Wide{n[1]} * v, divisor);
    for (int u = from; u <= to; ++u) {
      const Range& column = column_w[static_cast<std::size_t>(u - u_begin)];
      std::int64_t low = std::max<std::int64_t>(row_first, column.first);
      std::int64_t high = std::min<std::int64_t>(row_last, column.last);
      if (tilted) {
        Division first = last;
        first.advance(to_first, divisor);
        low = std::max(low, first.quotient);
        high = std::min(high, last.quotient);
        last.advance(step, divisor);
      }
      if (low <= high) run(u, v, static_cast<int>(low), static_cast<int>(high));
    }
  }
}

/// The thin tests: whether a triangle meets one of the segments through a voxel's centre.
class SegmentTest {
 public:
  /// @param all_13 also the segments to the middles of the edges and to the corners
  SegmentTest(const Triangle& triangle, bool all_13);

  /// Calls hit(first, last) for the runs of voxels of column (u, v) within first..last that the
  /// triangle fills.
  template <class Hit>
  void runs(int u, int v, int first, int last, Hit&& hit) {
    move_to(u, v, first);
    int begin = -1;
    for (int w = first; w <= last; ++w) {
      if (meets()) {
        if (begin < 0) begin = w;
      } else if (begin >= 0) {
        hit(begin, w - 1);
        begin = -1;
      }
      advance();
    }
    if (begin >= 0) hit(begin, last);
  }

 private:
  struct Direction {
    Vector d;            ///< components -1, 0, 1; the segment is centre + [-128, 128] d
    std::int64_t slope;  ///< normal . d
  };
  void move_to(int u, int v, int w);
  void advance();
  [[nodiscard]] bool meets() const;
  [[nodiscard]] bool meets_in_plane(const Vector& d) const;

  Triangle triangle_;
  Vector normal_;
  std::array<Direction, 13> directions_;  ///< by falling |slope|
  std::size_t count_;
  Vector centre_{};
  Wide height_ = 0;                ///< normal . (vertex 0 - centre)
  std::array<Vector, 3> edges_{};  ///< (a - centre) x (b - centre) of the edges
};

}  // namespace strata::shell
