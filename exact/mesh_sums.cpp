#include "exact/mesh_sums.h"

#include <cmath>

#include "exact/directions.h"
#include "exact/flat_predicates.h"

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

Int320 VolumeSum::determinant(const FinePoint& a, const FinePoint& b, const FinePoint& c) {
  const auto area = [&](std::size_t i, std::size_t j) {  // at most 2 * 2^184
    return product<Int192>(b[i], c[j]) - product<Int192>(b[j], c[i]);
  };
  return product<Int320>(a[0], area(1, 2)) + product<Int320>(a[1], area(2, 0)) +
         product<Int320>(a[2], area(0, 1));
}

void VolumeSum::add(const FinePoint& a, const FinePoint& b, const FinePoint& c) {
  fine_ += determinant(a, b, c);
}

void VolumeSum::add(const VolumeSum& other) {
  lattice_ += other.lattice_;
  fine_ += other.fine_;
}

Int320 VolumeSum::six_volumes() const { return fine_ + (Int320(lattice_) << 3 * kFineBits); }

double VolumeSum::volume() const {
  return std::ldexp(ratio_to_double(six_volumes(), Wide<1>(6)), -3 * kFineBits);
}

void MomentSum::add(const FinePoint& a, const FinePoint& b, const FinePoint& c) {
  volume_.add(a, b, c);
  const Int320 d = VolumeSum::determinant(a, b, c);
  const FinePoint sum{a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2]};  // 94 bits
  for (std::size_t k = 0; k < 3; ++k) first_[k] += product<Wide<7>>(d, sum[k]);
  for (std::size_t k = 0; k < 6; ++k) {
    const std::size_t i = k < 3 ? k : (k - 2) % 3, j = k < 3 ? k : (k - 1) % 3;
    const Int192 squares = product<Int192>(a[i], a[j]) + product<Int192>(b[i], b[j]) +
                           product<Int192>(c[i], c[j]) + product<Int192>(sum[i], sum[j]);
    second_[k] += product<Wide<8>>(d, squares);  // 188 bits, and 278
  }
}

void MomentSum::add(const MomentSum& other) {
  volume_.add(other.volume_);
  for (std::size_t k = 0; k < 3; ++k) first_[k] += other.first_[k];
  for (std::size_t k = 0; k < 6; ++k) second_[k] += other.second_[k];
}

// (F / 24) / (D / 6) = F / (4 D), with D six times the volume: 313 bits.
double MomentSum::centre(int k) const {
  const Int320 d = volume_.six_volumes();
  const Wide<7>& first = first_[static_cast<std::size_t>(k)];
  return std::ldexp(ratio_to_double(d.negative() ? -first : first, magnitude(d) << 2), -kFineBits);
}

// S / 120 - (F_i / 24) (F_j / 24) / (D / 6) = (4 S D - 5 F_i F_j) / (480 D). S D has at most
// 498 + 311 bits, F_i F_j 808; 480 D has 319, all that an Int320 holds.
double MomentSum::central_moment(int i, int j) const {
  const auto place = static_cast<std::size_t>(i == j ? i : 6 - i - j);  // yz: 3, zx: 4, xy: 5
  const Wide<6> d(volume_.six_volumes());
  const auto& fi = first_[static_cast<std::size_t>(i)];
  const auto& fj = first_[static_cast<std::size_t>(j)];
  const Wide<14> products = product<Wide<14>>(fi, fj);
  const Wide<14> top = (product<Wide<14>>(second_[place], d) << 2) - ((products << 2) + products);
  const Wide<6> bottom = product<Wide<6>>(magnitude(d), std::int64_t{480});
  return std::ldexp(ratio_to_double(d.negative() ? -top : top, bottom), -5 * kFineBits);
}

void FileSum::add(const FilePoint& origin, const FilePoint& a, const FilePoint& b,
                  const FilePoint& c) {
  const Int192 d = orient3d_value(origin, a, b, c);
  six_volumes_ += Int256(d);
  for (int k = 0; k < 3; ++k) {
    const std::int64_t sum = (a[k] - origin[k]) + (b[k] - origin[k]) + (c[k] - origin[k]);
    first_[static_cast<std::size_t>(k)] += product<Int256>(d, sum);
  }
}

void FileSum::add(const FileSum& other) {
  six_volumes_ += other.six_volumes_;
  for (std::size_t k = 0; k < 3; ++k) first_[k] += other.first_[k];
}

double FileSum::volume() const { return ratio_to_double(six_volumes_, Wide<1>(6)); }

double FileSum::centre(int k) const {  // as MomentSum
  const Int256& first = first_[static_cast<std::size_t>(k)];
  return ratio_to_double(six_volumes_.negative() ? -first : first, magnitude(six_volumes_) << 2);
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
