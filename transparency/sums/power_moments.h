#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

// C. Muenstermann, S. Krumpen, R. Klein, C. Peters, "Moment-based order-independent transparency"
// (2018), with power moments. The absorbance of a pixel is a measure over depth in [-1, 1], known
// by its moments b_0 to b_2n. Of all measures with these moments, one has a mass at a chosen depth
// z and n others (canonical representation); the absorbance in front of z lies between the sum of
// the masses in front, and that plus the mass at z, for every such measure.
//
// Written from the mathematics: with the Hankel matrix B of the moments and v(x) = (1, x, .., x^n),
// the other masses lie at the roots of v(x)^T B^-1 v(z), and the mass at x is 1 / (v(x)^T B^-1
// v(x)).

namespace strata::transparency {

namespace detail {

/// Places of the mass at most; those farther out than kFarthestRoot have next to none.
inline constexpr double kFarthestRoot = 64.0;

template <std::size_t kSize>
[[nodiscard]] double polynomial(const std::array<double, kSize>& c, double x) {
  double value = 0.0;
  for (std::size_t i = kSize; i-- > 0;) value = value * x + c[i];
  return value;
}
template <std::size_t kSize>
[[nodiscard]] std::array<double, kSize - 1> derivative(const std::array<double, kSize>& c) {
  std::array<double, kSize - 1> slope;
  for (std::size_t i = 1; i < kSize; ++i) slope[i - 1] = static_cast<double>(i) * c[i];
  return slope;
}

// The roots of polynomials whose roots are all real. A leading coefficient of next to 0 gives roots
// that are far out or not finite.

inline std::array<double, 2> real_roots(const std::array<double, 3>& c, double = 0.0) {
  const double root = std::sqrt(std::max(0.0, c[1] * c[1] - 4.0 * c[0] * c[2]));
  const double q = -0.5 * (c[1] + std::copysign(root, c[1]));
  return {q / c[2], c[0] / q};
}

inline std::array<double, 3> real_roots(const std::array<double, 4>& c, double = 0.0) {
  const double a = c[2] / c[3] / 3.0, b = c[1] / c[3], d = c[0] / c[3];
  const double q = a * a - b / 3.0;
  if (!(std::abs(a) < 1e7 && q > 0.0)) {
    const auto two = real_roots(std::array<double, 3>{c[0], c[1], c[2]});
    return {two[0], two[1], c[2] / c[3] * -1.0};
  }
  const double r = a * a * a - 0.5 * a * b + 0.5 * d;
  const double angle = std::acos(std::clamp(r / (q * std::sqrt(q)), -1.0, 1.0)) / 3.0;
  const double cosine = std::cos(angle), sine = 0.8660254037844386 * std::sin(angle);
  const double scale = 2.0 * std::sqrt(q);
  std::array<double, 3> roots{-scale * cosine - a, scale * (0.5 * cosine + sine) - a,
                              scale * (0.5 * cosine - sine) - a};
  const auto slope = derivative(c);
  for (double& root : roots) {  // cancellation near 0
    const double better = root - polynomial(c, root) / polynomial(slope, root);
    if (std::isfinite(better)) root = better;
  }
  return roots;
}

/// The root between two places where the values have different signs: Newton, halving where that
/// leaves the interval. @param x  where it begins
inline double root_between(const std::array<double, 5>& c, const std::array<double, 4>& slope,
                           double low, double high, bool rising, double x) {
  for (int step = 0; step < 60; ++step) {
    const double value = polynomial(c, x);
    ((value < 0.0) == rising ? low : high) = x;
    double next = x - value / polynomial(slope, x);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - x) < 1e-8) return next;
    x = next;
  }
  return x;
}

/// @param end  roots from here on are not needed
inline std::array<double, 4> real_roots(const std::array<double, 5>& c, double end) {
  const std::array<double, 4> slope = derivative(c);
  std::array<double, 3> turns = real_roots(slope);
  // All roots lie within this radius of their mean (P. Samuelson's inequality); Newton's steps from
  // there fall towards the outermost roots without passing them.
  const double a = c[3] / c[4], mean = -0.25 * a;
  const double radius = 0.75 * std::sqrt(std::max(0.0, a * a - 8.0 / 3.0 * c[2] / c[4]));
  const auto within = [](double x) {
    return std::isnan(x) ? kFarthestRoot : std::clamp(x, -kFarthestRoot, kFarthestRoot);
  };
  std::array<double, 5> ends{within(mean - radius - 1e-9), within(turns[0]), within(turns[1]),
                             within(turns[2]), within(mean + radius + 1e-9)};
  std::sort(ends.begin(), ends.end());
  std::array<double, 4> roots;
  roots.fill(2.0 * kFarthestRoot);
  double before = polynomial(c, ends[0]);
  for (std::size_t i = 0; i < 4 && ends[i] < end; ++i) {
    const double here = polynomial(c, ends[i + 1]);
    const double start = i == 0 ? ends[0] : i == 3 ? ends[4] : 0.5 * (ends[i] + ends[i + 1]);
    if ((before < 0.0) != (here < 0.0)) {
      roots[i] = root_between(c, slope, ends[i], ends[i + 1], before < 0.0, start);
    }
    before = here;
  }
  return roots;
}

}  // namespace detail

/// The paper's numbers for moments in single precision: towards which moments, and how far, those
/// of a pixel are moved, so that they are moments of a measure in spite of rounding.
template <std::size_t kHalf>
struct MomentBias;
template <>
struct MomentBias<2> {
  static constexpr double kWeight = 5e-7;
  static constexpr std::array<double, 3> kEven{1.0, 0.375, 0.375};
};
template <>
struct MomentBias<3> {
  static constexpr double kWeight = 5e-6;
  static constexpr std::array<double, 4> kEven{1.0, 0.48, 0.451, 0.45};
};
template <>
struct MomentBias<4> {
  static constexpr double kWeight = 5e-5;
  static constexpr std::array<double, 5> kEven{1.0, 0.75, 0.67666666666666664, 0.63,
                                               0.60030303030303034};
};

/// A measure of which the moments 0 to 2 kHalf are known.
template <std::size_t kHalf>
class PowerMoments {
 public:
  static constexpr std::size_t kCount = 2 * kHalf + 1;
  /// Between the least absorbance in front of a depth, 0, and the most, 1: the paper's number.
  static constexpr double kOverestimation = 0.25;

  /// Factorizes B = L D L^T. @param moments  kCount sums, the first one above 0
  explicit PowerMoments(const float* moments) {
    std::array<double, kCount> b;
    for (std::size_t i = 0; i < kCount; ++i) {
      const double bias = i % 2 == 0 ? MomentBias<kHalf>::kEven[i / 2] : 0.0;
      const double moment = static_cast<double>(moments[i]) / static_cast<double>(moments[0]);
      b[i] = moment + MomentBias<kHalf>::kWeight * (bias - moment);
    }
    for (std::size_t j = 0; j <= kHalf; ++j) {
      for (std::size_t i = j; i <= kHalf; ++i) {
        double sum = b[i + j];
        for (std::size_t k = 0; k < j; ++k) sum -= low_[i][k] * low_[j][k] * diagonal_[k];
        if (i == j) {
          diagonal_[j] = std::max(sum, kLeastDiagonal);
        } else {
          low_[i][j] = sum / diagonal_[j];
        }
      }
    }
  }

  /// The share of every such measure in front of a depth is `least` to `least + own`.
  struct Shares {
    double least = 0.0, own = 0.0;
  };
  [[nodiscard]] Shares shares(double depth) const {
    Vector y = forward(depth);
    Shares shares{0.0, mass(y)};
    for (std::size_t i = 0; i <= kHalf; ++i) y[i] /= diagonal_[i];
    for (std::size_t i = kHalf; i-- > 0;) {
      for (std::size_t k = i + 1; k <= kHalf; ++k) y[i] -= low_[k][i] * y[k];
    }
    for (const double root : detail::real_roots(y, depth)) {
      if (root > -detail::kFarthestRoot && root < depth) shares.least += mass(forward(root));
    }
    return shares;
  }
  /// The share in front as the paper estimates it: in [0, 1].
  [[nodiscard]] double share_before(double depth) const {
    const Shares both = shares(depth);
    return std::clamp(both.least + kOverestimation * both.own, 0.0, 1.0);
  }

 private:
  using Vector = std::array<double, kHalf + 1>;
  static constexpr double kLeastDiagonal = 1e-14;

  /// L^-1 v(x).
  [[nodiscard]] Vector forward(double x) const {
    Vector y;
    double power = 1.0;
    for (std::size_t i = 0; i <= kHalf; ++i, power *= x) {
      y[i] = power;
      for (std::size_t k = 0; k < i; ++k) y[i] -= low_[i][k] * y[k];
    }
    return y;
  }
  /// 1 / (v^T B^-1 v).
  [[nodiscard]] double mass(const Vector& y) const {
    double sum = 0.0;
    for (std::size_t i = 0; i <= kHalf; ++i) sum += y[i] * y[i] / diagonal_[i];
    return 1.0 / sum;
  }

  std::array<Vector, kHalf + 1> low_{};  ///< below its diagonal, which is 1
  Vector diagonal_{};
};

}  // namespace strata::transparency
