#pragma once

// Integers and fractions without a limit, geometry by its definitions, and input: random points,
// the corners of the largest cubes, and lattices so small that everything coincides.

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "exact/cut_points.h"

namespace strata::exact {

using Whole = boost::multiprecision::cpp_int;
using Fraction = boost::multiprecision::cpp_rational;

template <int kWords>
Whole whole(const Wide<kWords>& value) {
  Whole result = static_cast<std::int64_t>(value.word[kWords - 1]);
  for (int i = kWords - 2; i >= 0; --i) result = result * (Whole(1) << 64) + value.word[i];
  return result;
}
inline Whole whole(Int128 value) { return whole(as_wide(value)); }
inline Whole whole(std::int64_t value) { return value; }

inline int sign_of_whole(const Whole& value) { return value.sign(); }
inline int sign_of_fraction(const Fraction& value) { return numerator(value).sign(); }

inline Whole floor_of(const Fraction& value) {
  Whole quotient, remainder;
  divide_qr(Whole(numerator(value)), Whole(denominator(value)), quotient, remainder);
  return remainder.sign() < 0 ? Whole(quotient - 1) : quotient;
}

inline Fraction fraction_of(double value) {
  int exponent = 0;
  const double part = std::frexp(value, &exponent);
  const Fraction whole_part(Whole(static_cast<std::int64_t>(std::ldexp(part, 53))));
  exponent -= 53;
  const Whole scale = Whole(1) << std::abs(exponent);
  return exponent < 0 ? Fraction(whole_part / Fraction(scale))
                      : Fraction(whole_part * Fraction(scale));
}

/// Whether no double is nearer to `exact`; of two that are as near, the even one is right.
inline bool is_nearest(double value, const Fraction& exact) {
  const double inf = std::numeric_limits<double>::infinity();
  const Fraction error = abs(Fraction(fraction_of(value) - exact));
  for (const double other : {std::nextafter(value, inf), std::nextafter(value, -inf)}) {
    const Fraction other_error = abs(Fraction(fraction_of(other) - exact));
    if (other_error < error) return false;
    const bool odd = (std::bit_cast<std::uint64_t>(value) & 1) != 0;
    if (other_error == error && odd) return false;
  }
  return true;
}

using Vector = std::array<Fraction, 3>;

inline Vector vector_of(const LatticePoint& p) {
  return {Fraction(p.x), Fraction(p.y), Fraction(p.z)};
}
inline Vector vector_of(const RationalPoint& p) {
  return {Fraction(whole(p.x), whole(p.w)), Fraction(whole(p.y), whole(p.w)),
          Fraction(whole(p.z), whole(p.w))};
}
inline Vector operator-(const Vector& a, const Vector& b) {
  return {Fraction(a[0] - b[0]), Fraction(a[1] - b[1]), Fraction(a[2] - b[2])};
}
inline Vector operator+(const Vector& a, const Vector& b) {
  return {Fraction(a[0] + b[0]), Fraction(a[1] + b[1]), Fraction(a[2] + b[2])};
}
inline Vector operator*(const Fraction& t, const Vector& a) {
  return {Fraction(t * a[0]), Fraction(t * a[1]), Fraction(t * a[2])};
}
inline Fraction scalar(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vector outer(const Vector& a, const Vector& b) {
  return {Fraction(a[1] * b[2] - a[2] * b[1]), Fraction(a[2] * b[0] - a[0] * b[2]),
          Fraction(a[0] * b[1] - a[1] * b[0])};
}

/// A plane as its three points, to be given to the oracle and to what is tested.
struct Triangle {
  LatticePoint a, b, c;

  Plane plane() const { return plane_through(a, b, c); }
  Vector normal() const { return outer(vector_of(b) - vector_of(a), vector_of(c) - vector_of(a)); }
  Fraction height(const Vector& point) const { return scalar(normal(), point - vector_of(a)); }
};

/// Where the line through p and q meets the plane. @pre it does, in one point
inline Vector meet(const LatticePoint& p, const LatticePoint& q, const Triangle& t) {
  const Vector from = vector_of(p), along = vector_of(q) - from;
  return from + Fraction(-t.height(from) / scalar(t.normal(), along)) * along;
}

/// The line of two planes meets the third: a point of the line, then along it.
inline Vector meet(const Triangle& a, const Triangle& b, const Triangle& c) {
  const Vector direction = outer(a.normal(), b.normal());
  // From a point of plane a across the line, within plane a, until plane b.
  const Vector across = outer(a.normal(), direction), start = vector_of(a.a);
  const Vector on_line = start + Fraction(-b.height(start) / scalar(b.normal(), across)) * across;
  return on_line + Fraction(-c.height(on_line) / scalar(c.normal(), direction)) * direction;
}

inline bool independent(const Triangle& a, const Triangle& b, const Triangle& c) {
  return scalar(outer(a.normal(), b.normal()), c.normal()) != 0;
}

/// What points are drawn from.
enum class Input { kTiny, kNear, kRandom26, kRandom29, kCorners26, kCorners29 };
inline constexpr Input kInputs[] = {Input::kTiny,     Input::kNear,      Input::kRandom26,
                                    Input::kRandom29, Input::kCorners26, Input::kCorners29};

class Draw {
 public:
  explicit Draw(Input input, std::uint64_t seed = 1) : input_(input), random_(seed) {}

  std::int64_t below(std::int64_t end) {
    return static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(end));
  }

  std::int32_t coordinate() {
    const auto in_cube = [this](int bits) {
      return static_cast<std::int32_t>(below((std::int64_t{1} << bits) + 1) -
                                       (std::int64_t{1} << (bits - 1)));
    };
    const auto corner = [this](int bits) { return (below(2) == 0 ? 1 : -1) * (1 << (bits - 1)); };
    switch (input_) {
      case Input::kTiny:
        return static_cast<std::int32_t>(below(3) == 0 ? below(8) : below(3) * 3);
      case Input::kNear:  // far from the origin, a few lattice planes: nearly coincident
        return (1 << 28) - static_cast<std::int32_t>(below(2) * (1 << 27) + below(3));
      case Input::kRandom26:
        return in_cube(26);
      case Input::kRandom29:
        return in_cube(29);
      case Input::kCorners26:
        return corner(26);
      case Input::kCorners29:
        return corner(29);
    }
    return 0;
  }

  LatticePoint point() { return {coordinate(), coordinate(), coordinate()}; }

  /// With an area.
  Triangle triangle() {
    while (true) {
      const Triangle result{point(), point(), point()};
      if (result.plane().normal != Normal(0)) return result;
    }
  }

  /// Three whose planes have one point.
  std::array<Triangle, 3> three_triangles() {
    while (true) {
      const std::array<Triangle, 3> result{triangle(), triangle(), triangle()};
      if (independent(result[0], result[1], result[2])) return result;
    }
  }

  std::uint64_t word() { return random_(); }

 private:
  Input input_;
  std::mt19937_64 random_;
};

}  // namespace strata::exact
