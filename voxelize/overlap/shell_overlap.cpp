#include "voxelize/overlap/shell_overlap.h"

#include <cstdlib>

namespace strata::shell {
namespace {

// One edge's crossings with the lines between strips. Vertices are the caller's.
void edge_ranges(std::int64_t a0, std::int64_t b0, std::int64_t a1, std::int64_t b1, int bits,
                 int begin, int end, Range* out) {
  if (a0 > a1) {
    std::swap(a0, a1);
    std::swap(b0, b1);
  }
  // Lines strictly between the ends, which border a strip of the window.
  const std::int64_t first = std::max<std::int64_t>((a0 >> bits) + 1, begin);
  const std::int64_t last = std::min<std::int64_t>(((a1 - 1) >> bits), end);
  if (first > last) return;
  const std::int64_t da = a1 - a0, db = b1 - b0, divisor = da << bits;
  const std::int64_t numerator = b0 * da + ((first << bits) - a0) * db;  // < 2^59
  Division at = divide(numerator, divisor);
  Division step = divide(db, da);
  step.remainder <<= bits;
  for (std::int64_t line = first; line <= last; ++line) {
    // A crossing on the border of two cells touches both.
    const std::int64_t low = at.quotient - (at.remainder == 0 ? 1 : 0);
    if (line > begin) out[line - 1 - begin].include(low, at.quotient);
    if (line < end) out[line - begin].include(low, at.quotient);
    at.advance(step, divisor);
  }
}

[[nodiscard]] std::int64_t dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

[[nodiscard]] bool is_zero(const Vector& a) { return a[0] == 0 && a[1] == 0 && a[2] == 0; }

// Whether three numbers have one sign, zeros counting for either.
[[nodiscard]] bool same_sign(std::int64_t a, std::int64_t b, std::int64_t c) {
  return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
}

constexpr std::int64_t kHalf = kLatticeSteps / 2;

// Whether the segments [-kHalf, kHalf] d and a..b (both closed) have a point in common. d has
// components -1, 0, 1.
[[nodiscard]] bool segments_meet(const Vector& d, const Vector& a, const Vector& b) {
  if (dot(d, cross(a, b)) != 0) return false;  // not in one plane
  const Vector e = subtract(b, a);
  const Vector n = cross(d, e);
  for (std::size_t m = 0; m < 3; ++m) {
    if (n[m] == 0) continue;
    // t d = a + s e, times e and times d.
    const std::int64_t sign = n[m] < 0 ? -1 : 1;
    const std::int64_t t = cross(a, e)[m] * sign, s = cross(a, d)[m] * sign, one = n[m] * sign;
    return s >= 0 && s <= one && std::abs(t) <= kHalf * one;
  }
  // Parallel, or a single point.
  if (!is_zero(cross(d, a))) return false;
  for (std::size_t m = 0; m < 3; ++m) {
    if (d[m] == 0) continue;
    return std::max(a[m], b[m]) >= -kHalf && std::min(a[m], b[m]) <= kHalf;
  }
  return false;
}

// The three of k6 first.
constexpr std::array<Vector, 13> kDirections = {{{1, 0, 0},
                                                 {0, 1, 0},
                                                 {0, 0, 1},
                                                 {0, 1, 1},
                                                 {0, 1, -1},
                                                 {1, 0, 1},
                                                 {1, 0, -1},
                                                 {1, 1, 0},
                                                 {1, -1, 0},
                                                 {1, 1, 1},
                                                 {1, 1, -1},
                                                 {1, -1, 1},
                                                 {1, -1, -1}}};

}  // namespace

void strip_ranges(const Triangle& triangle, int a, int b, int bits, int begin, int end,
                  Range* out) {
  const auto ia = static_cast<std::size_t>(a), ib = static_cast<std::size_t>(b);
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector& p = triangle[i];
    const Vector& q = triangle[i == 2 ? 0 : i + 1];
    const std::int64_t low = (p[ib] - 1) >> bits, high = p[ib] >> bits;
    for (std::int64_t strip = (p[ia] - 1) >> bits; strip <= p[ia] >> bits; ++strip) {
      if (strip >= begin && strip < end) out[strip - begin].include(low, high);
    }
    edge_ranges(p[ia], p[ib], q[ia], q[ib], bits, begin, end, out);
  }
}

SegmentTest::SegmentTest(const Triangle& triangle, bool all_13)
    : triangle_(triangle), normal_(normal(triangle)), count_(all_13 ? 13 : 3) {
  for (std::size_t i = 0; i < count_; ++i) {
    directions_[i] = {kDirections[i], dot(normal_, kDirections[i])};
  }
  // The plane can only be met by a segment if it is met by the steepest: test that one first.
  std::stable_sort(
      directions_.begin(), directions_.begin() + static_cast<std::ptrdiff_t>(count_),
      [](const Direction& x, const Direction& y) { return std::abs(x.slope) > std::abs(y.slope); });
}

void SegmentTest::move_to(int u, int v, int w) {
  centre_ = {kLatticeSteps * std::int64_t{u} + kHalf, kLatticeSteps * std::int64_t{v} + kHalf,
             kLatticeSteps * std::int64_t{w} + kHalf};
  std::array<Vector, 3> spokes;
  for (std::size_t i = 0; i < 3; ++i) spokes[i] = subtract(triangle_[i], centre_);
  for (std::size_t i = 0; i < 3; ++i) edges_[i] = cross(spokes[i], spokes[i == 2 ? 0 : i + 1]);
  height_ = Wide{normal_[0]} * spokes[0][0] + Wide{normal_[1]} * spokes[0][1] +
            Wide{normal_[2]} * spokes[0][2];
}

void SegmentTest::advance() {
  centre_[2] += kLatticeSteps;
  height_ -= Wide{normal_[2]} * kLatticeSteps;
  for (std::size_t i = 0; i < 3; ++i) {
    // (a - c) x (b - c) = a x b + c x (a - b), so a step s along w adds s w x (a - b).
    const Vector& a = triangle_[i];
    const Vector& b = triangle_[i == 2 ? 0 : i + 1];
    edges_[i][0] -= kLatticeSteps * (a[1] - b[1]);
    edges_[i][1] += kLatticeSteps * (a[0] - b[0]);
  }
}

bool SegmentTest::meets() const {
  const Wide height = height_ < 0 ? -height_ : height_;
  for (std::size_t i = 0; i < count_; ++i) {
    const Direction& direction = directions_[i];
    if (height > Wide{std::abs(direction.slope)} * kHalf) return false;  // nor do flatter ones
    const Vector& d = direction.d;
    if (direction.slope != 0) {
      const std::int64_t e0 = dot(edges_[0], d), e1 = dot(edges_[1], d);
      if ((e0 > 0 && e1 < 0) || (e0 < 0 && e1 > 0)) continue;
      if (same_sign(e0, e1, dot(edges_[2], d))) return true;
    } else if (meets_in_plane(d)) {
      return true;
    }
  }
  return false;
}

// The centre lies in the triangle's plane and d along it, or the triangle has no area.
bool SegmentTest::meets_in_plane(const Vector& d) const {
  for (std::size_t m = 0; m < 3; ++m) {
    if (normal_[m] == 0) continue;
    if (same_sign(edges_[0][m], edges_[1][m], edges_[2][m])) return true;  // the centre is inside
    break;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    if (segments_meet(d, subtract(triangle_[i], centre_),
                      subtract(triangle_[i == 2 ? 0 : i + 1], centre_))) {
      return true;
    }
  }
  return false;
}

}  // namespace strata::shell
