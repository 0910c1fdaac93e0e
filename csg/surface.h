#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "csg/program.h"
#include "csg/view.h"
#include "raster/lattice_mesh.h"
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
/// .csg). The face cannot be nearer or farther than its triangle, whatever its slope.
class Coincidence {
 public:
  Coincidence() = default;
  /// @param world_error how far the scene's faces may be from where they are meant, world units
  Coincidence(const View& view, double world_error);

  /// How much nearer and how much farther the face behind a crossing may be, in depth steps.
  struct Bound {
    double nearer = 0, farther = 0;
  };
  [[nodiscard]] Bound bound(const LatticeMesh& mesh, std::uint32_t triangle,
                            std::uint32_t depth) const;

  /// Steepness (see TriangleSetup) from which a triangle's bound is more than a tenth of a pixel:
  /// there are few such pixels, and each is looked at by itself.
  [[nodiscard]] double steep_from() const { return steep_from_; }
  /// A little more than the sum of the bounds of two crossings near a depth, of triangles that are
  /// not steep: offset + nearness * nearness * square with nearness = a - b * depth.
  struct Range {
    float a, b, offset, square;
  };
  [[nodiscard]] Range range() const;

 private:
  [[nodiscard]] double flat(double depth) const {
    const double nearness = a_ - b_ * depth;
    return 1.5 + flat_ * nearness * nearness;
  }
  double a_ = 1, b_ = 0;  ///< 1 / distance = a - b * depth; 1 for an orthographic view
  double flat_ = 0;       ///< depth steps of world_error, times distance squared
  double steep_from_ = 0;
};

/// Finds the visible surface among all flips of one ray. The tree is evaluated after all flips of a
/// depth. Then coincidence (law 5):
/// - an interval inside the tree that is no longer than the bounds of its two ends together is
///   nothing: two faces that coincide, or the outermost 1/256 of a pixel of an outline, where the
///   snap may have moved the outline of another solid to the other side. A solid that is just
///   united with the rest has no such other side, and stays;
/// - of several solids whose faces coincide with the surface and contribute to it, the one shown is
///   one without which it would not be there (a hidden face that ends in it has no part in it),
///   then one that the ray enters rather than one that it leaves, then the first of the tree.
/// A ray that begins inside the tree (the eye is in the material) shows where it leaves it.
class SurfaceFinder {
 public:
  explicit SurfaceFinder(const Program& program) : state_(program), last_(program.leaves.size()) {}

  /// `bound(flip)` gives a flip's bound. Sorts `flips`.
  template <class Bound>
  Surface find(std::vector<Flip>& flips, Bound&& bound);

 private:
  [[nodiscard]] static Surface surface_of(const Flip& flip, std::uint32_t depth) {
    return {depth, flip.solid, flip.triangle, flip.exit};
  }
  /// By depth, then solid.
  void sort(std::vector<Flip>& flips);
  /// Applies all flips at the depth of flips[at]; gives the index after them.
  std::size_t apply(const std::vector<Flip>& flips, std::size_t at) {
    std::size_t end = at + 1;
    while (end < flips.size() && flips[end].depth == flips[at].depth) ++end;
    flip_all(flips, at, end);
    return end;
  }
  void flip_all(const std::vector<Flip>& flips, std::size_t begin, std::size_t end) {
    constexpr std::size_t kFew = 4;
    if (end - begin < kFew) {
      for (std::size_t i = begin; i < end; ++i) state_.flip(flips[i].solid);
      return;
    }
    turned_.clear();
    for (std::size_t i = begin; i < end; ++i) turned_.push_back(flips[i].solid);
    state_.flip_all(turned_);
  }

  [[nodiscard]] bool is_plain_entry(const Flip& flip) const {
    return !flip.exit && state_.program().plain(flip.solid);
  }

  ProgramState state_;
  std::vector<std::uint64_t> order_, other_order_;  ///< [depth:32 | index:32]
  std::vector<Flip> sorted_;
  std::vector<std::uint32_t> turned_;
  std::vector<std::size_t> last_;  ///< of each solid: one of its flips
};

template <class Bound>
Surface SurfaceFinder::find(std::vector<Flip>& flips, Bound&& bound) {
  sort(flips);
  Surface found;
  std::size_t at = 0;
  // Of the flips that the tree's value rests on.
  const auto group_bound = [&](std::size_t begin, std::size_t end) {
    Coincidence::Bound largest;
    for (std::size_t i = begin; i < end; ++i) {
      if (!state_.supports(flips[i].solid)) continue;
      const Coincidence::Bound one = bound(flips[i]);
      largest.nearer = std::max(largest.nearer, one.nearer);
      largest.farther = std::max(largest.farther, one.farther);
    }
    return largest;
  };
  while (at < flips.size()) {
    const std::size_t begin = at;
    at = apply(flips, at);
    if (!state_.value()) continue;
    const std::uint32_t depth = flips[begin].depth;
    const Coincidence::Bound own = group_bound(begin, at);
    const bool embedded = depth == 0 && flips[begin].triangle == Surface::kNone;

    // On to where the interval ends. What lies within the bound of its beginning is settled with
    // it; that must not depend on flips that do not matter.
    const double settles = depth + 2.0 * own.farther;
    std::size_t settled = at, end_begin = at, end = at;
    bool plain = false;
    for (std::size_t i = begin; i < at; ++i) plain = plain || is_plain_entry(flips[i]);
    while (end < flips.size()) {
      end_begin = end;
      end = apply(flips, end);
      if (!state_.value()) break;
      if (flips[end_begin].depth <= settles) settled = end;
      for (std::size_t i = end_begin; i < end; ++i) plain = plain || is_plain_entry(flips[i]);
    }
    if (!state_.value()) {
      if (embedded) {
        for (std::size_t i = end_begin; i < end; ++i) {
          if (!state_.supports(flips[i].solid)) continue;
          found = surface_of(flips[i], flips[i].depth);
          break;
        }
        at = end;
        break;
      }
      if (!plain &&
          flips[end_begin].depth - depth <= own.farther + group_bound(end_begin, end).nearer) {
        at = end;
        continue;
      }
    }
    flip_all(flips, settled, end);

    // Of one solid only its last flip counts, unless it has one in the group.
    for (std::size_t i = 0; i < settled; ++i) last_[flips[i].solid] = i;
    for (std::size_t i = begin; i < at; ++i) last_[flips[i].solid] = i;
    const Flip* best = nullptr;
    bool best_alone = false;
    for (std::size_t i = 0; i < settled; ++i) {
      const Flip& flip = flips[i];
      if (flip.triangle == Surface::kNone) continue;
      if (state_.inside(flip.solid) == flip.exit) continue;
      const bool in_group = i >= begin && i < at;
      if (!in_group) {
        const Coincidence::Bound its = bound(flip);
        if (flip.depth < depth ? depth - flip.depth > own.nearer + its.farther
                               : flip.depth - depth > own.farther + its.nearer) {
          continue;
        }
        if (last_[flip.solid] != i) continue;
      }
      if (!state_.supports(flip.solid)) continue;  // last: it climbs the tree
      const bool alone = state_.decides(flip.solid);
      const bool better =
          best == nullptr || (alone && !best_alone) ||
          (alone == best_alone &&
           ((best->exit && !flip.exit) || (best->exit == flip.exit && flip.solid < best->solid)));
      if (!better) continue;
      best = &flip;
      best_alone = alone;
    }
    if (best == nullptr) best = &flips[begin];
    found = surface_of(*best, depth);
    at = settled;
    break;
  }
  // Copying the state is a sixteenth of a flip's work for each solid and node.
  if (at * 16 > state_.program().nodes.size() + state_.program().leaves.size()) {
    state_.reset();
  } else {
    flip_all(flips, 0, at);
  }
  return found;
}

}  // namespace strata::csg
