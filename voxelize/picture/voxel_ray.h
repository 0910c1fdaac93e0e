#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <span>

#include "strata/voxelize/intervals.h"
#include "voxelize/picture/occupied_blocks.h"

// Rays through a set of voxels, exactly.
//
// THE ORDER OF A RAY. A ray is o + t d, in voxels. It crosses the plane between voxels at
// coordinate c of axis a at t = (c - o[a]) * (1 / d[a]), in double arithmetic, which grows with c.
// All crossings are in one order: by t, then axis (x, y, z), then the ray's direction. The voxel of
// the ray after a crossing says how many planes of each axis came before. So the voxels of a ray,
// and the faces through which it enters them, follow from comparisons alone: they do not depend on
// the axis of the intervals or on what is skipped on the way.

namespace strata {

/// Where a ray is from `t` on.
struct RayStart {
  double t = 0.0;
  int section = -1;  ///< the section that begins there, or none
};

/// What a ray meets first.
struct RayHit {
  static constexpr std::uint32_t kNothing = 0xffffffff;

  glm::ivec3 voxel{0};  ///< x, y, z
  /// 0 to 5: 2 axis + 1 if the face looks towards larger coordinates. kSection + n: the cut of
  /// section n.
  int face = 0;
  double t = 0.0;
  std::uint32_t label = kNothing;  ///< kNothing: nothing is met

  [[nodiscard]] bool found() const { return label != kNothing; }
  static constexpr int kSection = 6;
};

/// A box of voxels that rays are confined to, and which of its sides are cuts of sections.
struct RayBox {
  glm::ivec3 low{0}, high{0};         ///< x, y, z; [low, high)
  int low_section[3] = {-1, -1, -1};  ///< of the side at `low`, or -1
  int high_section[3] = {-1, -1, -1};
  [[nodiscard]] bool empty() const { return low.x >= high.x || low.y >= high.y || low.z >= high.z; }
};

/// Sends rays through a set. Borrows it and its blocks. One thread at a time; cheap to make.
class VoxelRays {
 public:
  VoxelRays(const VoxelIntervals& set, const OccupiedBlocks& blocks, const RayBox& box);

  /// The first solid voxel from `start` to `end`, in t. The ray sees nothing of solid voxels that
  /// it starts in, unless a section begins there.
  /// @param origin, direction  in voxels, along x, y, z
  [[nodiscard]] RayHit first(const glm::dvec3& origin, const glm::dvec3& direction,
                             const RayStart& start, double end);
  /// How much of [start, end], in t, is solid.
  [[nodiscard]] double solid_length(const glm::dvec3& origin, const glm::dvec3& direction,
                                    const RayStart& start, double end);

 private:
  /// A crossing. axis is -1 for the start of the ray.
  struct Key {
    double t = 0.0;
    int axis = -1;  ///< of the frame
  };
  /// Where a column ends.
  struct ColumnEnd {
    Key key;
    int w = 0;            ///< last voxel of the ray in the column
    bool leaves = false;  ///< the ray leaves the box in this column
  };

  [[nodiscard]] bool begin(const glm::dvec3& origin, const glm::dvec3& direction,
                           const RayStart& start);
  [[nodiscard]] double plane(int axis, int at) const { return (at - o_[axis]) * inverse_[axis]; }
  [[nodiscard]] bool passed(int axis, int at, const Key& key) const {
    const double t = plane(axis, at);
    return t < key.t || (t == key.t && key.axis >= 0 && rank_[axis] <= rank_[key.axis]);
  }
  [[nodiscard]] bool before(const Key& a, const Key& b) const {
    return a.t < b.t || (a.t == b.t && rank_[a.axis] < rank_[b.axis]);
  }
  /// The ray's voxel along `axis` right after `key`, in [low - 1, high].
  [[nodiscard]] int index_at(int axis, const Key& key, int low, int high) const {
    // Both `moved` and plane() are off by less than 2^-50 of numbers below 2^30, so that nothing
    // but a place this near to a plane needs the comparisons.
    constexpr double kNear = 0x1p-16, kLargest = 0x1p30;
    const double moved = key.t * d_[axis], guess = o_[axis] + moved;
    if (guess > low && guess < high && moved < kLargest && moved > -kLargest) {
      const int at = static_cast<int>(guess);
      const double part = guess - at;
      if (part > kNear && part < 1 - kNear) return at;
    }
    return compared_index_at(axis, key, low, high);
  }
  [[nodiscard]] int compared_index_at(int axis, const Key& key, int low, int high) const;
  [[nodiscard]] bool skip(int shift);
  [[nodiscard]] ColumnEnd column_end() const;
  [[nodiscard]] bool next_column(const ColumnEnd& end);
  [[nodiscard]] bool leave_solid();
  [[nodiscard]] bool search_column(const ColumnEnd& end, RayHit& hit) const;
  [[nodiscard]] double column_length(const ColumnEnd& end, double until) const;
  [[nodiscard]] std::span<const Interval> runs() const {
    return set_->column(p_[0], p_[1] + set_->v_begin());
  }
  void fill(RayHit& hit, std::size_t run, int w, const Key& key) const;

  const VoxelIntervals* set_;
  const OccupiedBlocks* blocks_;
  AxisFrame frame_;
  int rank_[3];            ///< the axis of x, y, z of each axis of the frame
  glm::ivec3 low_, high_;  ///< of the box, in the frame; rows from the set's first
  int low_section_[3], high_section_[3];

  // The ray, in the frame.
  glm::dvec3 o_{0.0}, inverse_{0.0}, d_{0.0};
  int step_[3] = {0, 0, 0};  ///< 0: the ray never crosses planes of that axis
  glm::ivec3 p_{0};          ///< the voxel the ray is in
  Key key_;                  ///< the crossing that led there
  int section_ = -1;         ///< of the start
};

}  // namespace strata
