#pragma once

// Volume and area as sums of integers: the same digits in any order and on any number of threads.

#include "exact/cut_points.h"

namespace strata::exact {

/// The volume of a closed mesh of at most 2^32 triangles, from the volumes of the tetrahedra that
/// they span with the origin. Coordinates are at most 2^28 steps, 2^92 of the fine ones.
///
/// The sum over fine points is exact. The points themselves were moved by at most sqrt(3) * 2^-65
/// step when they were rounded, so the volume differs from that of the exact points by less than
/// area * 2^-63 cubic steps.
class VolumeSum {
 public:
  /// a . (b x c) of lattice points: at most 4 * 2^84; 2^32 of them: 118 bits.
  void add(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c);
  /// The same in fine steps: at most 4 * 2^276; 2^32 of them: 310 bits.
  void add(const FinePoint& a, const FinePoint& b, const FinePoint& c);
  void add(const VolumeSum& other);

  /// Six times the volume, in 2^-192 cubic step.
  Int320 six_volumes() const;
  /// The double nearest to the volume in cubic steps.
  double volume() const;

 private:
  Int128 lattice_ = 0;  // in cubic steps
  Int320 fine_;         // in 2^-192 cubic step
};

/// The area of at most 2^32 triangles of exact planes: a triangle's area is that of its shadow
/// along the axis k in which the normal n is largest, times |n| / |n_k|. Shadows that overlap
/// because rounding turned a sliver over cancel.
class AreaSum {
 public:
  void add(const Plane& plane, const FinePoint& a, const FinePoint& b, const FinePoint& c);
  void add(const AreaSum& other);

  /// In square steps. The sum is rounded to a double once.
  double area() const;
  /// How far area() is at most from the area of the exact points, in square steps. Only slivers
  /// that rounding turned over may have shadows of the other sign.
  double error() const;

 private:
  // A term is twice the shadow, floored to 2^-64 square step: at most 2^58 square steps, 123
  // bits; times the ratio in 2^-62, below sqrt(3): 63 bits. 2^32 of them: 218 bits.
  Int256 sum_;             // twice the area, in 2^-126 square step
  Int128 perimeters_ = 0;  // of the shadows, |du| + |dv| of each side in steps, rounded up
  Int128 count_ = 0;
};

/// floor(2^62 * |n| / |n_k|) for the largest component n_k: from 2^62 up to sqrt(3) * 2^62.
/// @pre n is not zero
std::uint64_t slope_ratio(const Normal& n);

}  // namespace strata::exact
