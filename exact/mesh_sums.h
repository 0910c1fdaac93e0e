#pragma once

// Volume, moments and area as sums of integers: the same digits in any order and on any number of
// threads.

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
  /// a . (b x c) of lattice points: at most 4 * 2^84; 2^32 of them: 119 bits.
  void add(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c);
  /// The same in fine steps: at most 4 * 2^276; 2^32 of them: 311 bits.
  void add(const FinePoint& a, const FinePoint& b, const FinePoint& c);
  void add(const VolumeSum& other);

  /// a . (b x c), in 2^-192 cubic step.
  static Int320 determinant(const FinePoint& a, const FinePoint& b, const FinePoint& c);
  /// Six times the volume, in 2^-192 cubic step.
  Int320 six_volumes() const;
  /// The double nearest to the volume in cubic steps.
  double volume() const;

 private:
  Int128 lattice_ = 0;  // in cubic steps
  Int320 fine_;         // in 2^-192 cubic step
};

/// The volume, centre of mass and second moments of a closed mesh of at most 2^32 triangles. The
/// tetrahedron of the origin and a, b, c with the determinant d has the integrals
///   of x_i: d / 24 * s_i, and of x_i x_j: d / 120 * (a_i a_j + b_i b_j + c_i c_j + s_i s_j)
/// with s = a + b + c. Their sums are exact; the doubles are the nearest to them.
class MomentSum {
 public:
  void add(const FinePoint& a, const FinePoint& b, const FinePoint& c);
  void add(const MomentSum& other);

  const VolumeSum& volume() const { return volume_; }
  /// The coordinate k of the centre of mass, in steps. @pre the volume is not 0
  double centre(int k) const;
  /// The integral of (x_i - centre_i) (x_j - centre_j), in steps^5: what tensors of inertia are
  /// made of. @pre the volume is not 0
  double central_moment(int i, int j) const;

 private:
  // d s_i: at most 2^278 * 3 * 2^92; 2^32 of them: 404 bits. The second: at most
  // 2^278 * 12 * 2^184; 2^32 of them: 498 bits.
  VolumeSum volume_;
  std::array<Wide<7>, 3> first_;   // 24 times the integrals, in 2^-256 step^4
  std::array<Wide<8>, 6> second_;  // 120 times, in 2^-320 step^5: xx, yy, zz, yz, zx, xy
};

/// The volume and centre of mass of a closed mesh of at most 2^32 triangles of rounded points. As
/// MomentSum, but without second moments, and about an origin near the points. Coordinates differ
/// from the origin by at most T = 2^53.
class FileSum {
 public:
  void add(const FilePoint& origin, const FilePoint& a, const FilePoint& b, const FilePoint& c);
  void add(const FileSum& other);

  /// Of six times the volume. At most 2 T^3 each; 2^32 of them: 193 bits.
  const Int256& six_volumes() const { return six_volumes_; }
  /// The double nearest to the volume, in cubic units of the points.
  double volume() const;
  /// The coordinate k of the centre of mass about the origin. @pre the volume is not 0
  double centre(int k) const;

 private:
  Int256 six_volumes_;
  std::array<Int256, 3> first_;  // 24 times the integrals: 3 T times as large, 248 bits
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
