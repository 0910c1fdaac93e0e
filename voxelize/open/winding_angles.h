#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

// Solid angles of triangles seen from voxel centres, a vector of centres at a time. Private to
// voxelize/.

namespace strata {

/// A triangle. Positions are in lattice steps, which are `scale` long along each axis.
struct WindingCap {
  glm::dvec3 corners[3], normal;  ///< the normal is scaled, and twice the area long
  glm::ivec3 lattice[3];          ///< the corners
  glm::uvec3 vertices{0};         ///< their numbers: caps share corners
  double doubt = 0.0;  ///< the side of a point is in doubt below this, times its distance
};

/// Triangles near each other: `count` > 0: caps [first, first + count); else nodes first, first
/// + 1.
struct WindingNode {
  glm::dvec3 middle;       ///< in lattice steps
  glm::dvec3 dipole{0.0};  ///< sum of the scaled area vectors
  double radius = 0.0, area = 0.0;
  std::uint32_t first = 0, count = 0;
};

/// The solid angle of far nodes around a point, to second order.
struct WindingSeries {
  glm::dvec3 middle{0.0};  ///< in lattice steps
  double angle = 0.0;
  glm::dvec3 gradient{0.0};          ///< by scaled positions, as are all derivatives
  glm::dvec3 pure{0.0}, mixed{0.0};  ///< second derivatives xx, yy, zz and yz, zx, xy

  /// Adds a dipole that lies `to`, scaled, from the middle.
  void add(const glm::dvec3& dipole, const glm::dvec3& to);
  void move(const glm::dvec3& to_middle, const glm::dvec3& scale);
};

/// Voxel centres, and the solid angles that are seen from them: positive from behind.
struct WindingPoints {
  static constexpr std::size_t kMost = 64, kStep = 8;
  std::size_t count = 0;  ///< a multiple of kStep
  alignas(64) double x[kMost], y[kMost], z[kMost], angle[kMost];
  double off[kMost];  ///< what the angles may be off by from exact ones; above 1: not known
};

/// Caps and groups of them, in lattice steps that are `scale` long.
struct WindingCaps {
  std::vector<WindingCap> caps;
  std::vector<WindingNode> nodes;
  glm::dvec3 scale{1.0};
  std::uint32_t vertices = 0;  ///< above the numbers of their corners
};

/// What is seen from the points of a ball.
struct WindingView {
  glm::dvec3 middle;
  double radius;
  std::span<const std::uint32_t> near;      ///< caps
  std::span<const std::uint32_t> far = {};  ///< nodes, as dipoles
  WindingSeries farther = {};               ///< around the middle
  double far_bound = 0.0;                   ///< on the angle of far and farther nodes
};

/// Corners of near caps, far nodes and points, scaled, from the middle of the ball.
struct WindingFloats {
  struct Corner {
    float x, y, z;
  };
  struct Far {
    float x, y, z, dipole_x, dipole_y, dipole_z;
  };
  /// A corner as seen from a vector of points.
  struct alignas(32) Seen {
    float x[WindingPoints::kStep], y[WindingPoints::kStep], z[WindingPoints::kStep],
        length[WindingPoints::kStep];
  };
  std::vector<Corner> corners;
  std::vector<glm::uvec3> triangles;  ///< the caps, by corner
  std::vector<Far> far;
  std::vector<Seen> seen;
  float series[10];  ///< the angle of farther nodes, its gradient, halves of xx, yy, zz; yz, zx, xy
  alignas(64) float x[WindingPoints::kMost], y[WindingPoints::kMost], z[WindingPoints::kMost];
  float base_off = 0.0F;     ///< what angles are off by, but for the caps' complex numbers
  float number_off = 0.0F;   ///< what those are off by
  float nearest_off = 0.0F;  ///< and over the distance of the nearest corner
};

/// Sums the solid angles of caps at voxel centres. One for each thread.
class WindingSum {
 public:
  enum class Way {
    kExact,  ///< arc tangent by arc tangent, in double: the angles that decide
    kQuick   ///< one arc tangent for all near caps, in float
  };
  /// Writes angles. Centres on a triangle's plane see the side that the perturbed sample sees
  /// (raster/triangle_setup.h). Exact angles are the same bits on any SIMD unit.
  void write(Way way, const WindingCaps& caps, const WindingView& view, WindingPoints& points);

 private:
  struct Place {
    std::uint32_t turn = 0, corner = 0;
  };
  void set_corners(const WindingCaps& caps, const WindingView& view);
  void set_rest(const WindingCaps& caps, const WindingView& view, const WindingPoints& points);

  std::vector<Place> places_;  ///< where each vertex is among the corners, if its turn is this one
  std::uint32_t turn_ = 0;
  WindingFloats floats_;
};

/// 1 where the perturbed lattice point sees the cap's back, -1 where its front. Exact.
int winding_side(const WindingCap& cap, const glm::ivec3& p);

}  // namespace strata
