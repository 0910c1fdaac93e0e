#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "csg/geometry.h"
#include "csg/program.h"
#include "csg/transition.h"
#include "raster/triangle_setup.h"
#include "strata/csg/view.h"
#include "strata/raster/lattice_mesh.h"

// What a ray sees first of a Boolean tree. Private to csg/.

namespace strata::csg {

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

  [[nodiscard]] double world_error() const { return world_error_; }

  /// How much nearer and how much farther the face behind a crossing may be, in depth steps.
  struct Bound {
    double nearer = 0, farther = 0;
  };
  /// @param share  of the world error, Geometry::Part::error_share
  [[nodiscard]] Bound bound(const LatticeMesh& mesh, std::uint32_t triangle, std::uint32_t depth,
                            double share = 1.0) const;

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
  [[nodiscard]] double flat(double depth, double share) const {
    const double nearness = a_ - b_ * depth;
    return 1.5 + share * flat_ * nearness * nearness;
  }
  double a_ = 1, b_ = 0;  ///< 1 / distance = a - b * depth; 1 for an orthographic view
  double world_error_ = 0;
  double flat_ = 0;  ///< depth steps of world_error, times distance squared
  double steep_from_ = 0;
};

/// The faces behind flips, as SurfaceFinder asks about them.
class FlipFaces {
 public:
  /// Keeps references to all of them.
  FlipFaces(const std::vector<Geometry::Part>& parts, const std::vector<ViewPart>& view_parts,
            const Coincidence& coincidence)
      : parts_(&parts), view_parts_(&view_parts), coincidence_(&coincidence) {}

  [[nodiscard]] Coincidence::Bound bound(const Flip& flip) const {
    if (flip.triangle == Surface::kNone) return {};
    return coincidence_->bound((*view_parts_)[flip.solid].mesh, flip.triangle, flip.depth,
                               (*parts_)[flip.solid].error_share);
  }
  /// Whether the face of `below` lies beneath the plane of `above`, but not the other way around:
  /// it begins at that plane, and `above` may go on where it does so.
  [[nodiscard]] bool ends_at(const Flip& below, const Flip& above) const {
    return beneath(below, above) && !beneath(above, below);
  }

 private:
  [[nodiscard]] bool beneath(const Flip& below, const Flip& above) const;

  const std::vector<Geometry::Part>* parts_;
  const std::vector<ViewPart>* view_parts_;
  const Coincidence* coincidence_;
};

/// Finds the visible surface among all flips of one ray. The tree is evaluated after all flips of a
/// depth. Then coincidence (law 5):
/// - an interval inside the tree that is no longer than the bounds of its two ends together is
///   nothing: two faces that coincide, or the outermost 1/256 of a pixel of an outline, where the
///   snap may have moved the outline of another solid to the other side. A solid that is just
///   united with the rest has no such other side, and stays;
/// - of several solids whose faces coincide with the surface and contribute to it, the one shown is
///   one without which it would not be there (a hidden face that ends in it has no part in it),
///   then one that the ray enters rather than one that it leaves, then the first of the tree; but
///   a face that ends at the plane of another gives way to it: the slope of a solid whose top lies
///   in the top of another one, where the snap has put it in front.
/// A ray that begins inside the tree (the eye is in the material) shows where it leaves it.
class SurfaceFinder {
 public:
  explicit SurfaceFinder(const Program& program) : state_(program), last_(program.leaves.size()) {}

  /// Sorts `flips`.
  Surface find(std::vector<Flip>& flips, const FlipFaces& faces);

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

  /// A flip whose face coincides with the surface.
  struct Candidate {
    const Flip* flip;
    bool alone;  ///< without it the surface would not be there
  };
  [[nodiscard]] static bool goes_before(const Candidate& a, const Candidate& b) {
    if (a.alone != b.alone) return a.alone;
    if (a.flip->exit != b.flip->exit) return b.flip->exit;
    return a.flip->solid < b.flip->solid;
  }
  /// The one that is shown. @pre there are candidates
  [[nodiscard]] const Flip& choose(const FlipFaces& faces) const;

  [[nodiscard]] bool is_plain_entry(const Flip& flip) const {
    return !flip.exit && state_.program().plain(flip.solid);
  }

  ProgramState state_;
  std::vector<std::uint64_t> order_, other_order_;  ///< [depth:32 | index:32]
  std::vector<Flip> sorted_;
  std::vector<std::uint32_t> turned_;
  std::vector<std::size_t> last_;  ///< of each solid: one of its flips
  std::vector<Candidate> candidates_;
};

}  // namespace strata::csg
