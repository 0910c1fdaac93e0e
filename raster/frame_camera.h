#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <span>

#include "strata/mesh/soup_tools.h"
#include "strata/raster/view.h"

// A camera that stands where the things before it fill the picture. Private to Strata.

namespace strata {

/// How far something reaches across the four sides of a picture: right, left, top, bottom. A side
/// is a plane through the eye; its reach is the largest product of its normal with a point.
using FrameReach = std::array<double, 4>;

/// Most times that a fit is narrowed before it is placed.
inline constexpr int kNarrowings = 8;

/// Finds the place of a camera whose direction and lens are given. Points see the sides of the
/// picture along normals that do not depend on that place, so the reach of a thing is measured once
/// and the place follows.
class FrameFit {
 public:
  /// @param aspect the picture's width / height
  FrameFit(const Camera& camera, double aspect);

  /// Of nothing.
  [[nodiscard]] static FrameReach nothing();
  /// The normals of the sides, in world space.
  [[nodiscard]] std::span<const glm::dvec3> normals() const { return normals_; }
  [[nodiscard]] FrameReach reach(const Bounds& box) const;
  void include(FrameReach& reach, const glm::dvec3& point) const;

  /// Places the camera so that `reach` just fits, the target at the depth of `centre`. False when
  /// there is nothing to fit: the camera stays.
  bool place(Camera& camera, const FrameReach& reach, const glm::dvec3& centre) const;
  /// Becomes the fit of a narrower picture, so that what place() leaves empty above and below, or
  /// at the left and right, is equal on both sides. @return whether another time would still matter
  bool narrow(const FrameReach& reach, const glm::dvec3& centre);
  /// With `centre` as the target. @return the distance; 0: nothing to fit
  [[nodiscard]] double distance(const FrameReach& reach, const glm::dvec3& centre) const;

 private:
  void set_normals();
  /// The reach from a point instead of the origin.
  [[nodiscard]] FrameReach from(const glm::dvec3& centre, FrameReach reach) const;

  /// The sides between which there is room.
  enum class Loose { kUnknown, kAcross, kUp };

  bool perspective_ = true;
  Loose loose_ = Loose::kUnknown;
  double most_up_ = 1, most_across_ = 1;  ///< before they were narrowed
  double last_side_ = 0, last_sum_ = 0;   ///< of the loose sides before the last time
  double up_ = 1, across_ = 1;            ///< half of the filled part of the sides, at distance 1
  std::array<glm::dvec3, 3> axes_;        ///< right, up, towards the eye
  std::array<glm::dvec3, 4> normals_;
};

}  // namespace strata
