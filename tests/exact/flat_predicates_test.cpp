#include "exact/flat_predicates.h"

#include <gtest/gtest.h>

#include "tests/exact/exact_oracle.h"

namespace strata::exact {
namespace {

class FlatByInput : public testing::TestWithParam<Input> {
 protected:
  Draw random{GetParam(), 51};

  // Tiny ones as they are; others in 2^-24 steps, with all bits down to the last.
  std::int64_t coordinate() {
    if (GetParam() == Input::kTiny) return random.coordinate();
    const std::int64_t whole_steps = std::int64_t{random.coordinate()} * (1 << kFileBits);
    const std::int64_t rest = random.below(3) == 0 ? random.below(1 << kFileBits) : 0;
    return whole_steps > 0 ? whole_steps - rest : whole_steps + rest;
  }
  FlatPoint point() { return {coordinate(), coordinate()}; }
  FilePoint point3() { return {coordinate(), coordinate(), coordinate()}; }
};
INSTANTIATE_TEST_SUITE_P(Exact, FlatByInput, testing::ValuesIn(kInputs));

Whole minor(const Whole& a, const Whole& b, const Whole& c, const Whole& d) {
  return a * d - b * c;
}

TEST_P(FlatByInput, Orient2dAndIncircleAreTheirDeterminants) {
  int on_circle = 0;
  for (int i = 0; i < 20000; ++i) {
    const FlatPoint p[4] = {point(), point(), point(), point()};
    Whole x[4], y[4], z[4];
    for (int k = 0; k < 4; ++k) {
      x[k] = p[k].x;
      y[k] = p[k].y;
      z[k] = x[k] * x[k] + y[k] * y[k];
    }
    const auto area = [&](int a, int b, int c) {  // of absolute positions
      return Whole(minor(x[a], y[a], x[b], y[b]) + minor(x[b], y[b], x[c], y[c]) +
                   minor(x[c], y[c], x[a], y[a]));
    };
    ASSERT_EQ(orient2d(p[0], p[1], p[2]), sign_of_whole(area(0, 1, 2)));
    // The last column of the 4 x 4 determinant is 1: expanded by the squares.
    const Whole value =
        z[0] * area(1, 2, 3) - z[1] * area(0, 2, 3) + z[2] * area(0, 1, 3) - z[3] * area(0, 1, 2);
    ASSERT_EQ(whole(incircle_value(p[0], p[1], p[2], p[3])), value);
    const int sign = incircle(p[0], p[1], p[2], p[3]);
    ASSERT_EQ(sign, sign_of_whole(value));
    ASSERT_EQ(incircle(p[1], p[2], p[0], p[3]), sign);
    ASSERT_EQ(incircle(p[1], p[0], p[2], p[3]), -sign);
    ASSERT_EQ(incircle(p[0], p[1], p[3], p[2]), -sign);
    on_circle += value == 0 && area(0, 1, 2) != 0 && area(1, 2, 3) != 0;
  }
  if (GetParam() == Input::kTiny || GetParam() == Input::kCorners26) {
    EXPECT_GT(on_circle, 100);
  }
}

TEST(Incircle, IsPositiveInside) {
  const FlatPoint a(0, 0), b(4, 0), c(0, 4);
  EXPECT_EQ(incircle(a, b, c, {1, 1}), 1);
  EXPECT_EQ(incircle(a, b, c, {4, 4}), 0);
  EXPECT_EQ(incircle(a, b, c, {5, 4}), -1);
}

TEST_P(FlatByInput, Orient3dOfRoundedPointsIsTheDeterminant) {
  for (int i = 0; i < 20000; ++i) {
    const FilePoint a = point3(), b = point3(), c = point3(), d = point3();
    const auto w = [](const FilePoint& p, int k) { return Whole(p[k]); };
    // Four triple products of absolute positions.
    const auto triple = [&](const FilePoint& p, const FilePoint& q, const FilePoint& r) {
      return Whole(w(p, 0) * minor(w(q, 1), w(q, 2), w(r, 1), w(r, 2)) -
                   w(p, 1) * minor(w(q, 0), w(q, 2), w(r, 0), w(r, 2)) +
                   w(p, 2) * minor(w(q, 0), w(q, 1), w(r, 0), w(r, 1)));
    };
    const Whole value = triple(b, c, d) - triple(a, c, d) + triple(a, b, d) - triple(a, b, c);
    ASSERT_EQ(whole(orient3d_value(a, b, c, d)), value);
    ASSERT_EQ(orient3d(a, b, c, d), sign_of_whole(value));
    ASSERT_EQ(orient3d(b, a, c, d), -sign_of_whole(value));
  }
}

TEST_P(FlatByInput, FiltersThatDecideAreExact) {
  for (int i = 0; i < 150000; ++i) {
    const FlatPoint a = point(), b = point(), c = point(), d = point();
    const int sign = filters::incircle(filters::RealFlat(a - d), filters::RealFlat(b - d),
                                       filters::RealFlat(c - d));
    ASSERT_TRUE(sign == 0 || sign == sign_of(incircle_value(a, b, c, d)));
    const FilePoint p = point3(), q = point3(), r = point3(), s = point3();
    const int side = filters::orient3d(p, q, r, s);
    ASSERT_TRUE(side == 0 || side == sign_of(orient3d_value(p, q, r, s)));
  }
}

TEST_P(FlatByInput, Orient2dOfExactPointsIsTheSignOfTheirArea) {
  int zeros = 0;
  for (int i = 0; i < 300; ++i) {
    const auto any = [&]() -> RationalPoint {
      const Triangle a = random.triangle(), b = random.triangle(), c = random.triangle();
      if (random.below(4) == 0) return rational(a.a);
      const EdgePoint edge = edge_plane_point(a.a, a.b, b.plane());
      if (random.below(3) == 0 && edge.weight() != 0) return rational(edge);
      if (!independent(a, b, c)) return rational(a.b);
      return rational(a.plane(), b.plane(), c.plane());
    };
    const RationalPoint p = any(), q = any(), r = any();
    for (int k = 0; k < 3; ++k) {
      const int u = (k + 1) % 3, v = (k + 2) % 3;
      const auto su = static_cast<std::size_t>(u), sv = static_cast<std::size_t>(v);
      const Vector a = vector_of(p), b = vector_of(q), c = vector_of(r);
      const Fraction area = (b[su] - a[su]) * (c[sv] - a[sv]) - (b[sv] - a[sv]) * (c[su] - a[su]);
      const int sign = sign_of_fraction(area);
      ASSERT_EQ(orient2d(p, q, r, u, v), sign);
      ASSERT_EQ(orient2d(q, p, r, u, v), -sign);
      const Whole scale = whole(p.w) * whole(q.w) * whole(r.w);
      ASSERT_EQ(Fraction(whole(orient2d_value(p, q, r, u, v))), Fraction(area * Fraction(scale)));
      ASSERT_EQ(orient2d(p, p, r, u, v), 0);
      zeros += sign == 0;
    }
  }
  if (GetParam() == Input::kTiny) {
    EXPECT_GT(zeros, 5);
  }
}

}  // namespace
}  // namespace strata::exact
