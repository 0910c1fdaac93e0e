#include "exact/mesh_sums.h"

#include <cmath>

#include "exact/directions.h"

namespace strata::exact {
namespace {

// floor(sqrt(value)): the root in double is within 2^-52 of it, then steps of Newton's method from
// above, which stop at the floor.
std::uint64_t root(UInt128 value) {
  if (value == 0) return 0;
  constexpr auto kLargest = static_cast<double>(std::uint64_t{1} << 63);
  const double guess = std::sqrt(static_cast<double>(value)) * (1 + 0x1p-50) + 1;
  UInt128 x = guess < kLargest ? static_cast<UInt128>(guess) : UInt128{1} << 64;
  while (true) {
    const UInt128 next = (x + value / x) / 2;
    if (next >= x) return static_cast<std::uint64_t>(x);
    x = next;
  }
}

}  // namespace

std::uint64_t slope_ratio(const Normal& n) {
  Int128 most = 0;
  for (int k = 0; k < 3; ++k) most = std::max(most, Int128{n[k] < 0 ? -n[k] : n[k]});
  // floor(sqrt(x)) = floor(sqrt(floor(x))). n . n is at most 3 S^4, times 2^124: 4b + 126 bits; 242
  // for b = 29. The quotient is at most 3 * 2^124.
  const auto quotient = divide_floor(Int256(dot(n, n)) << 124, as_wide(most * most)).quotient;
  return root(static_cast<UInt128>(narrow<Int128>(quotient)));
}

void VolumeSum::add(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
  const Normal u(b), v(c);
  const auto area = [&](int i, int j) { return u[i] * v[j] - u[j] * v[i]; };  // at most 2^57
  lattice_ += Int128{area(1, 2)} * a.x + Int128{area(2, 0)} * a.y + Int128{area(0, 1)} * a.z;
}

void VolumeSum::add(const FinePoint& a, const FinePoint& b, const FinePoint& c) {
  const auto area = [&](std::size_t i, std::size_t j) {  // at most 2 * 2^184
    return product<Int192>(b[i], c[j]) - product<Int192>(b[j], c[i]);
  };
  fine_ += product<Int320>(a[0], area(1, 2));
  fine_ += product<Int320>(a[1], area(2, 0));
  fine_ += product<Int320>(a[2], area(0, 1));
}

void VolumeSum::add(const VolumeSum& other) {
  lattice_ += other.lattice_;
  fine_ += other.fine_;
}

Int320 VolumeSum::six_volumes() const { return fine_ + (Int320(lattice_) << 3 * kFineBits); }

double VolumeSum::volume() const {
  return std::ldexp(ratio_to_double(six_volumes(), Wide<1>(6)), -3 * kFineBits);
}

void AreaSum::add(const Plane& plane, const FinePoint& a, const FinePoint& b, const FinePoint& c) {
  const PlaneView view(plane);
  const auto u = static_cast<std::size_t>(view.u()), v = static_cast<std::size_t>(view.v());
  // Twice the shadow: differences up to 2^93, the area up to 2^186; floored to 2^-64 square step.
  const Int192 shadow =
      product<Int192>(b[u] - a[u], c[v] - a[v]) - product<Int192>(b[v] - a[v], c[u] - a[u]);
  sum_ += product<Int256>(shadow >> kFineBits, Int128{slope_ratio(plane.normal)});
  const FinePoint* const corner[4] = {&a, &b, &c, &a};
  for (int i = 0; i < 3; ++i) {
    for (const std::size_t axis : {u, v}) {
      const Int128 side = (*corner[i + 1])[axis] - (*corner[i])[axis];
      perimeters_ += ((side < 0 ? -side : side) >> kFineBits) + 1;
    }
  }
  ++count_;
}

void AreaSum::add(const AreaSum& other) {
  sum_ += other.sum_;
  perimeters_ += other.perimeters_;
  count_ += other.count_;
}

double AreaSum::area() const { return std::ldexp(to_double(sum_), -127); }

// Twice the area, a triangle at a time. The ratio is up to 2^-62 too small and at least 1: 2^-62 of
// the term. The floor takes up to 2^-64, the ratio less than 2 of it. A vertex that moves by 2^-65
// along u and v moves twice the shadow by |du| + |dv| of the opposite side times 2^-65; three that
// move together add products of two moves, less than 2^-120. Half of the sum of these, and half a
// unit in the last place for the double: 2^-53 of the area; 2^-52 covers both relative terms.
double AreaSum::error() const {
  return std::abs(area()) * 0x1p-52 +
         (static_cast<double>(perimeters_) + static_cast<double>(count_)) * 0x1p-64;
}

}  // namespace strata::exact
