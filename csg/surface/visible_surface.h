#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "csg/geometry.h"
#include "csg/program.h"
#include "csg/transition.h"
#include "raster/triangle_setup.h"
#include "strata/raster/lattice_mesh.h"
#include "strata/raster/view.h"

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
  /// What the bounds of a triangle's crossings have in common.
  struct Face {
    double slopes = 0;                 ///< (|slope_u| + |slope_v|) / 2
    double nearest = 0, farthest = 0;  ///< of its corners
    bool seen = false;                 ///< false: no ray crosses it
  };
  [[nodiscard]] static Face face(const LatticeMesh& mesh, std::uint32_t triangle);
  /// @param share  of the world error, Geometry::Part::error_share
  [[nodiscard]] Bound bound(const Face& face, std::uint32_t depth, double share = 1.0) const {
    return bound(face, depth, depth, share);
  }
  /// At least that of each crossing between two depths.
  [[nodiscard]] Bound bound(const Face& face, std::uint32_t from, std::uint32_t to,
                            double share) const {
    if (!face.seen) return {};
    const double least = flat(to, share);
    return {least + std::min(face.slopes, std::max(0.0, from - face.nearest)),
            least + std::min(face.slopes, std::max(0.0, face.farthest - to))};
  }

  /// Steepness (see TriangleSetup) from which a triangle's bound is more than a tenth of a pixel:
  /// there are few such pixels, and each is looked at by itself.
  [[nodiscard]] double steep_from() const { return steep_from_; }
  /// A little more than the sum of the bounds of two crossings near a depth, of triangles that are
  /// not steep: constant + quadratic * nearness * nearness with nearness = intercept - slope *
  /// depth.
  struct Range {
    float intercept, slope, constant, quadratic;
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

/// Faces that were met before, of one view. Scratch of one thread.
class KeptFaces {
 public:
  void clear() {
    for (Kept& kept : kept_) kept.triangle = Surface::kNone;
  }
  [[nodiscard]] const Coincidence::Face& find(const LatticeMesh& mesh, std::uint32_t solid,
                                              std::uint32_t triangle) {
    Kept& kept = kept_[(solid * 5 + triangle) % kept_.size()];
    if (kept.solid != solid || kept.triangle != triangle) {
      kept = {solid, triangle, Coincidence::face(mesh, triangle)};
    }
    return kept.face;
  }

 private:
  struct Kept {
    std::uint32_t solid = Surface::kNone, triangle = Surface::kNone;
    Coincidence::Face face;
  };
  std::vector<Kept> kept_ = std::vector<Kept>(256);
};

/// The faces behind transitions, as FirstHit asks about them.
class TransitionFaces {
 public:
  /// Keeps references to all of them. @param kept  null: no face is kept
  TransitionFaces(const std::vector<Geometry::Part>& parts, const std::vector<ViewPart>& view_parts,
                  const Coincidence& coincidence, KeptFaces* kept = nullptr)
      : parts_(&parts), view_parts_(&view_parts), coincidence_(&coincidence), kept_(kept) {}

  [[nodiscard]] Coincidence::Bound bound(const Transition& transition) const {
    if (transition.triangle == Surface::kNone) return {};
    return coincidence_->bound(face(transition), transition.depth, share(transition));
  }
  /// @pre transition.triangle is one
  [[nodiscard]] Coincidence::Face face(const Transition& transition) const {
    const LatticeMesh& mesh = (*view_parts_)[transition.solid].mesh;
    if (kept_ == nullptr) return Coincidence::face(mesh, transition.triangle);
    return kept_->find(mesh, transition.solid, transition.triangle);
  }
  /// Of the world error, that counts for the solid.
  [[nodiscard]] double share(const Transition& transition) const {
    return (*parts_)[transition.solid].error_share;
  }
  /// Whether the face of `below` lies beneath the plane of `above`, but not the other way around:
  /// it begins at that plane, and `above` may go on where it does so.
  [[nodiscard]] bool ends_at(const Transition& below, const Transition& above) const {
    return beneath(below, above) && !beneath(above, below);
  }

 private:
  [[nodiscard]] bool beneath(const Transition& below, const Transition& above) const;

  const std::vector<Geometry::Part>* parts_;
  const std::vector<ViewPart>* view_parts_;
  const Coincidence* coincidence_;
  KeptFaces* kept_;
};

/// Finds the visible surface among all transitions of one ray: image-based CSG, as J. Goldfeather,
/// S. Molnar, G. Turk and H. Fuchs, "Near real-time CSG rendering using tree normalization and
/// geometric pruning" (1989), and N. Stewart, G. Leach and S. John, "An improved Z-buffer CSG
/// rendering algorithm" (1998). We differ: no normal form of the tree, one evaluation of it along
/// the ray, and faces that coincide within a derived bound are one face. The tree is evaluated
/// after all transitions of a depth. Then coincidence (law 5):
/// - an interval inside the tree that is no longer than the bounds of its two ends together is
///   nothing: two faces that coincide, or the outermost 1/256 of a pixel of an outline, where the
///   snap may have moved the outline of another solid to the other side. A union operand has
///   no such other side, and stays;
/// - of several solids whose faces coincide with the surface and contribute to it, the one shown is
///   one without which it would not be there (a hidden face that ends in it has no part in it),
///   then one that the ray enters rather than one that it leaves, then the first of the tree; but
///   a face that ends at the plane of another gives way to it: the slope of a solid whose top lies
///   in the top of another one, where the snap has put it in front. A solid whose state changes
///   nothing there does not contribute (ProgramState::contributes()), so solids that a tile's
///   program leaves out change nothing.
/// A ray that begins inside the tree (the eye is in the material) shows where it leaves it.
class FirstHit {
 public:
  explicit FirstHit(const Program& program) : state_(program), last_(program.leaves.size()) {}

  /// Sorts `transitions`.
  Surface find(std::vector<Transition>& transitions, const TransitionFaces& faces);

  /// What comes of transitions whose faces all coincide, whatever their order.
  struct Verdict {
    bool inside = false;  ///< the ray is in the tree behind them
    Surface surface;      ///< then: what is shown, without its depth; no solid if the order decides
    /// Of the transitions, a bit each: it leads out of the tree after some of the others.
    std::uint32_t outward = 0;
  };
  static constexpr std::size_t kMostJudged = 8;
  /// @param inside  the solids that the ray is in before
  /// @param coincident  at most kMostJudged, each of another solid
  Verdict judge(std::span<const std::uint32_t> inside, std::span<const Transition> coincident,
                const TransitionFaces& faces);

 private:
  [[nodiscard]] static Surface surface_of(const Transition& transition, std::uint32_t depth) {
    return {depth, transition.solid, transition.triangle, transition.exit};
  }
  /// By depth, then solid.
  void sort(std::vector<Transition>& transitions);
  /// Applies all transitions at the depth of transitions[at]; gives the index after them.
  std::size_t apply(const std::vector<Transition>& transitions, std::size_t at) {
    std::size_t end = at + 1;
    while (end < transitions.size() && transitions[end].depth == transitions[at].depth) ++end;
    toggle_all(transitions, at, end);
    return end;
  }
  void toggle_all(const std::vector<Transition>& transitions, std::size_t begin, std::size_t end) {
    constexpr std::size_t kFew = 4;
    if (end - begin < kFew) {
      for (std::size_t i = begin; i < end; ++i) state_.toggle(transitions[i].solid);
      return;
    }
    toggled_.clear();
    for (std::size_t i = begin; i < end; ++i) toggled_.push_back(transitions[i].solid);
    state_.toggle_all(toggled_);
  }

  /// An interval inside the tree, in indices of transitions.
  struct Interval {
    std::size_t begin = 0, group_end = 0;      ///< the group where it begins
    std::size_t settled = 0;                   ///< the end of what is settled with its beginning
    std::size_t exit_begin = 0, exit_end = 0;  ///< the group where it ends
    bool union_operand = false;                ///< a union operand is entered in it
  };
  /// Applies transitions from index `at` on until the tree is false.
  /// @param settles  depth up to which transitions are settled with the beginning
  Interval walk_inside(const std::vector<Transition>& transitions, std::size_t begin,
                       std::size_t at, double settles);
  /// What the tree's value rests on among transitions of one depth, at which it has changed.
  struct Change {
    Coincidence::Bound bound;  ///< the largest of their bounds
    std::size_t first = 0;     ///< the first of them
  };
  [[nodiscard]] Change find_change(const std::vector<Transition>& transitions, std::size_t begin,
                                   std::size_t end, const TransitionFaces& faces);
  /// candidates_ become the transitions whose faces coincide with the surface at an interval's
  /// beginning and contribute to it.
  void list_candidates(const std::vector<Transition>& transitions, const Interval& interval,
                       const Coincidence::Bound& surface_bound, const TransitionFaces& faces);

  /// A transition whose face coincides with the surface.
  struct Candidate {
    const Transition* transition;
    bool alone;  ///< without it the surface would not be there
  };
  [[nodiscard]] static bool goes_before(const Candidate& a, const Candidate& b) {
    if (a.alone != b.alone) return a.alone;
    if (a.transition->exit != b.transition->exit) return b.transition->exit;
    return a.transition->solid < b.transition->solid;
  }
  /// Takes away the candidates that do not contribute, where those of toggled_ vary and all other
  /// solids stay as they are.
  void keep_contributing();
  /// Those of `transitions`, a bit each, that may lead out of the tree.
  [[nodiscard]] std::uint32_t find_outward(std::span<const Transition> transitions);
  /// The one that is shown. @pre there are candidates
  [[nodiscard]] const Transition& choose(const TransitionFaces& faces) const;

  [[nodiscard]] bool enters_union_operand(const Transition& transition) const {
    return !transition.exit && state_.program().is_union_operand(transition.solid);
  }

  ProgramState state_;
  std::vector<std::uint64_t> order_, other_order_;  ///< [depth:32 | index:32]
  std::vector<Transition> sorted_;
  std::vector<std::uint32_t> toggled_;
  std::vector<std::size_t> last_;  ///< of each solid: one of its transitions
  std::vector<Candidate> candidates_;
  std::vector<std::uint8_t> values_;  ///< of the tree, for each set of transitions
};

}  // namespace strata::csg
