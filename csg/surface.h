#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "csg/program.h"
#include "csg/view.h"
#include "raster/triangle_setup.h"

// What a ray sees first of a Boolean tree. Private to csg/.

namespace strata::csg {

/// Where a ray enters or leaves one solid: its flips along a ray increase in depth and begin with
/// an entry.
struct Flip {
  std::uint32_t depth = 0;
  std::uint32_t solid = 0;
  std::uint32_t triangle = 0;  ///< of the solid's ViewPart
  bool exit = false;
};

/// The visible surface of one pixel.
struct Surface {
  static constexpr std::uint32_t kNone = 0xffffffffu;
  std::uint32_t depth = kNone;  ///< kNone: the ray meets nothing
  std::uint32_t solid = kNone;
  std::uint32_t triangle = kNone;  ///< of the solid's ViewPart
  bool exit = false;  ///< the ray leaves that solid there: a cut face, or the eye is inside
  friend bool operator==(const Surface&, const Surface&) = default;
};

/// How far apart two crossings of a ray may be and still be the same face, told twice (law 5).
///
/// Snapping moves a vertex by at most half a lattice step along u, v and depth. A point of a
/// snapped triangle is the same mean of moved vertices, so at a fixed pixel its depth is off by at
/// most 1/2 + (|slope_u| + |slope_v|) / 2, slopes in depth steps per lattice step; the floor adds
/// one step. The scene's own coordinates may be off as well (`world_error`: six printed digits of a
/// .csg). Slopes grow without limit towards the outline of a solid, where nothing can be told
/// apart: the bound is cut off at a tenth of a pixel.
class Coincidence {
 public:
  Coincidence() = default;
  /// @param world_error how far the scene's faces may be from where they are meant, world units
  Coincidence(const View& view, double world_error);

  /// Bound for the crossing of triangle `t` at `depth`, in depth steps.
  [[nodiscard]] double error(const TriangleSetup& t, std::uint32_t depth) const;
  /// The largest bound at `depth`.
  [[nodiscard]] double largest(double depth) const {
    const double nearness = a_ - b_ * depth;
    return 1.5 + flat_ * nearness * nearness + pixel_ * nearness;
  }
  /// A little more than twice largest(depth), as offset + nearness * (linear + nearness * square)
  /// with nearness = a - b * depth, in single precision.
  struct Range {
    float a, b, offset, linear, square;
  };
  [[nodiscard]] Range range() const;

 private:
  double a_ = 1, b_ = 0;  ///< 1 / distance = a - b * depth; 1 for an orthographic view
  double flat_ = 0;       ///< depth steps of world_error, times distance squared
  double pixel_ = 0;      ///< depth steps of a tenth of a pixel, times distance
};

/// Finds the visible surface among all flips of one ray. The tree is evaluated after all flips of a
/// depth. Then coincidence (law 5):
/// - an interval inside the tree that begins with one solid and ends with another, and is no longer
///   than the sum of their bounds, is two faces that coincide, not a body: it is passed over;
/// - of several solids whose faces coincide with the surface and contribute to it, the one shown is
///   one that the ray enters rather than one that it leaves, then the first of the tree.
/// A ray that begins inside the tree (the eye is in the material) shows where it leaves it.
class SurfaceFinder {
 public:
  explicit SurfaceFinder(const Program& program) : state_(program) {}

  /// `error(flip)` gives a flip's bound. `flips` is sorted.
  template <class Error>
  Surface find(std::vector<Flip>& flips, const Coincidence& coincidence, Error&& error);

 private:
  [[nodiscard]] static Surface surface_of(const Flip& flip, std::uint32_t depth) {
    return {depth, flip.solid, flip.triangle, flip.exit};
  }
  /// Applies all flips at the depth of flips[at]; gives the index after them.
  std::size_t apply(const std::vector<Flip>& flips, std::size_t at) {
    const std::uint32_t depth = flips[at].depth;
    for (; at < flips.size() && flips[at].depth == depth; ++at) state_.flip(flips[at].solid);
    return at;
  }
  void undo(const std::vector<Flip>& flips, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) state_.flip(flips[i].solid);
  }

  ProgramState state_;
  std::vector<std::uint32_t> beginners_;  ///< solids that the interval begins with
};

template <class Error>
Surface SurfaceFinder::find(std::vector<Flip>& flips, const Coincidence& coincidence,
                            Error&& error) {
  std::sort(flips.begin(), flips.end(), [](const Flip& a, const Flip& b) {
    return a.depth != b.depth ? a.depth < b.depth : a.solid < b.solid;
  });
  Surface found;
  std::size_t at = 0;
  const auto group_error = [&](std::size_t begin, std::size_t end) {
    double largest = 0;
    for (std::size_t i = begin; i < end; ++i) {
      if (state_.supports(flips[i].solid)) largest = std::max(largest, error(flips[i]));
    }
    return largest;
  };
  const bool from_inside = state_.value();  // a tree whose idle value is true has no outside
  while (at < flips.size()) {
    const std::size_t begin = at;
    at = apply(flips, at);
    if (!state_.value() || from_inside) continue;
    const std::uint32_t depth = flips[begin].depth;
    const double reach = 2.0 * coincidence.largest(depth);
    const bool alone_before = begin == 0 || depth - flips[begin - 1].depth > reach;
    const bool alone_after = at == flips.size() || flips[at].depth - depth > reach;
    const bool embedded = depth == 0 && flips[begin].triangle == Surface::kNone;
    if (alone_before && alone_after && at == begin + 1 && !embedded) {
      found = surface_of(flips[begin], depth);
      break;
    }
    const double own_error = group_error(begin, at);
    beginners_.clear();
    for (std::size_t i = begin; i < at; ++i) {
      if (state_.supports(flips[i].solid)) beginners_.push_back(flips[i].solid);
    }
    // Where the interval ends, if that is near (or anywhere, for an eye inside).
    std::size_t after = at, settled = at, last_begin = begin;
    while (after < flips.size() && (embedded || flips[after].depth - depth <= reach)) {
      last_begin = after;
      after = apply(flips, after);
      if (!state_.value()) break;
      settled = after;
    }
    if (!state_.value()) {
      if (embedded) {
        for (std::size_t i = last_begin; i < after; ++i) {
          if (state_.supports(flips[i].solid)) {
            found = surface_of(flips[i], flips[i].depth);
            break;
          }
        }
        at = after;
        break;
      }
      bool same_solid = false;
      for (std::size_t i = last_begin; i < after; ++i) {
        const std::uint32_t solid = flips[i].solid;
        same_solid = same_solid ||
                     (state_.supports(solid) &&
                      std::find(beginners_.begin(), beginners_.end(), solid) != beginners_.end());
      }
      const double end_error = group_error(last_begin, after);
      if (!same_solid && flips[last_begin].depth - depth <= own_error + end_error) {
        at = after;
        continue;
      }
      // A body after all: its surface is judged where it begins.
      undo(flips, at, after);
      settled = at;
    }
    // The state is the one after flips[0, settled).
    const Flip* best = nullptr;
    for (std::size_t i = begin; i-- > 0 && depth - flips[i].depth <= reach;) last_begin = i;
    const std::size_t first = std::min(last_begin, begin);
    for (std::size_t i = first; i < settled; ++i) {
      const Flip& flip = flips[i];
      if (flip.triangle == Surface::kNone) continue;
      if (state_.inside(flip.solid) == flip.exit || !state_.supports(flip.solid)) continue;
      const bool in_group = i >= begin && i < at;
      const std::uint32_t gap = flip.depth > depth ? flip.depth - depth : depth - flip.depth;
      if (!in_group && gap > own_error + error(flip)) continue;
      // Of one solid only its last flip counts, unless it has one in the group.
      bool superseded = false;
      for (std::size_t j = first; j < settled; ++j) {
        const bool other_in_group = j >= begin && j < at;
        if (j == i || flips[j].solid != flip.solid) continue;
        superseded = superseded || (!in_group && (other_in_group || j > i));
      }
      if (superseded) continue;
      const bool better = best == nullptr || (best->exit && !flip.exit) ||
                          (best->exit == flip.exit && flip.solid < best->solid);
      if (better) best = &flip;
    }
    if (best == nullptr) best = &flips[begin];
    found = surface_of(*best, depth);
    at = settled;
    break;
  }
  undo(flips, 0, at);
  return found;
}

}  // namespace strata::csg
