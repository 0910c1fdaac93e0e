#include "exact/cut_points.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/exact/exact_oracle.h"

namespace strata::exact {
namespace {

Whole oracle_orient3d(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c,
                      const LatticePoint& d) {
  return numerator(Triangle{a, b, c}.height(vector_of(d)));
}

class ByInput : public testing::TestWithParam<Input> {
 protected:
  Draw random{GetParam(), 11};

  // An edge that crosses the plane, or ends in it; not within it.
  std::pair<LatticePoint, LatticePoint> edge_across(const Triangle& t) {
    while (true) {
      const LatticePoint p = random.point(), q = random.point();
      const int at_p = orient3d(t.a, t.b, t.c, p), at_q = orient3d(t.a, t.b, t.c, q);
      if (at_p * at_q <= 0 && at_p != at_q) return {p, q};
    }
  }
};
INSTANTIATE_TEST_SUITE_P(Exact, ByInput, testing::ValuesIn(kInputs));

TEST_P(ByInput, Orient3dIsTheSignOfTheDeterminant) {
  int zeros = 0;
  for (int i = 0; i < 20000; ++i) {
    const LatticePoint a = random.point(), b = random.point(), c = random.point(),
                       d = random.point();
    const Whole value = oracle_orient3d(a, b, c, d);
    ASSERT_EQ(whole(height(plane_through(a, b, c), d)), value);
    ASSERT_EQ(orient3d(a, b, c, d), sign_of_whole(value));
    ASSERT_EQ(orient3d(b, c, a, d), sign_of_whole(value));
    ASSERT_EQ(orient3d(b, a, c, d), -sign_of_whole(value));
    ASSERT_EQ(orient3d(a, b, d, c), -sign_of_whole(value));
    zeros += value == 0;
  }
  if (GetParam() == Input::kTiny) {
    EXPECT_GT(zeros, 100);
  }
}

TEST_P(ByInput, ThePointOfThreePlanesLiesWhereFractionsSay) {
  int zeros = 0;
  for (int i = 0; i < 1500; ++i) {
    const auto t = random.three_triangles();
    const Triangle other = random.triangle();
    const Plane a = t[0].plane(), b = t[1].plane(), c = t[2].plane(), d = other.plane();
    const Vector point = meet(t[0], t[1], t[2]);
    const RationalPoint rational_point = rational(a, b, c);
    ASSERT_EQ(vector_of(rational_point), point);
    ASSERT_EQ(sign_of(rational_point.w), 1);
    const Fraction height = other.height(point);
    const int side = sign_of_fraction(height);
    ASSERT_EQ(side_of_plane(a, b, c, d), side);
    ASSERT_EQ(side_of_plane(rational_point, d), side);
    const PlaneQuad quad = det4(a, b, c, d);
    ASSERT_EQ(Fraction(whole(quad.height)), Fraction(height * Fraction(whole(quad.weight))));
    for (const Plane& on : {a, b, c}) ASSERT_EQ(side_of_plane(rational_point, on), 0);
    zeros += side == 0;
  }
  if (GetParam() == Input::kTiny || GetParam() == Input::kCorners26) {
    EXPECT_GT(zeros, 10);
  }
}

TEST_P(ByInput, SidesDoNotDependOnTheOrderOfPlanes) {
  for (int i = 0; i < 1000; ++i) {
    const auto t = random.three_triangles();
    std::array<Plane, 3> p{t[0].plane(), t[1].plane(), t[2].plane()};
    const Plane d = random.triangle().plane();
    const int side = side_of_plane(p[0], p[1], p[2], d);
    const int weight = det3_sign(p[0].normal, p[1].normal, p[2].normal);
    ASSERT_EQ(weight, sign_of(det3(p[0].normal, p[1].normal, p[2].normal)));
    for (const auto& [x, y, z, parity] : {std::array{0, 1, 2, 1},
                                          {0, 2, 1, -1},
                                          {1, 0, 2, -1},
                                          {1, 2, 0, 1},
                                          {2, 0, 1, 1},
                                          {2, 1, 0, -1}}) {
      const Plane &a = p[static_cast<std::size_t>(x)], &b = p[static_cast<std::size_t>(y)],
                  &c = p[static_cast<std::size_t>(z)];
      ASSERT_EQ(side_of_plane(a, b, c, d), side);
      ASSERT_EQ(det3_sign(a.normal, b.normal, c.normal), weight * parity);
      const Plane turned{-c.normal, c.base};
      ASSERT_EQ(side_of_plane(a, b, turned, d), side);
      ASSERT_EQ(side_of_plane(a, b, c, Plane{-d.normal, d.base}), -side);
    }
  }
}

TEST_P(ByInput, OrdersAlongALineAreThoseOfFractions) {
  for (int i = 0; i < 1000; ++i) {
    const auto t = random.three_triangles();
    const Triangle other = random.triangle();
    if (!independent(t[0], t[1], other)) continue;
    const Plane a = t[0].plane(), b = t[1].plane(), c = t[2].plane(), d = other.plane();
    const Fraction ahead = scalar(outer(t[0].normal(), t[1].normal()),
                                  meet(t[0], t[1], t[2]) - meet(t[0], t[1], other));
    ASSERT_EQ(order_on_line(a, b, c, d), sign_of_fraction(ahead));
    ASSERT_EQ(order_on_line(a, b, d, c), -sign_of_fraction(ahead));
    ASSERT_EQ(order_on_line(b, a, c, d), -sign_of_fraction(ahead));
    ASSERT_EQ(order_on_line(a, b, c, c), 0);
  }
}

TEST_P(ByInput, EdgePointsLieWhereFractionsSay) {
  for (int i = 0; i < 1500; ++i) {
    const Triangle t = random.triangle(), other = random.triangle();
    const auto [p, q] = edge_across(t);
    const EdgePoint point = edge_plane_point(p, q, t.plane());
    const Vector exact = meet(p, q, t);
    ASSERT_EQ(vector_of(rational(point)), exact);
    const int side = sign_of_fraction(other.height(exact));
    ASSERT_EQ(side_of_plane(point, other.plane()), side);
    ASSERT_EQ(side_of_plane(rational(point), other.plane()), side);
    ASSERT_EQ(side_of_plane(edge_plane_point(q, p, t.plane()), other.plane()), side);
    ASSERT_EQ(side_of_plane(point, t.plane()), 0);
    const Fraction at_p = other.height(vector_of(p)), at_q = other.height(vector_of(q));
    if (at_p == at_q) continue;
    const EdgePoint second = edge_plane_point(p, q, other.plane());
    const Vector along = vector_of(q) - vector_of(p);
    const int order = sign_of_fraction(scalar(along, exact - meet(p, q, other)));
    ASSERT_EQ(order_on_edge(point, second), order);
    ASSERT_EQ(order_on_edge(second, point), -order);
  }
}

// The four ends of where two triangles cross.
TEST_P(ByInput, OrdersOnTheLineOfTwoTrianglesAreThoseOfFractions) {
  int equal = 0;
  for (int i = 0; i < 400; ++i) {
    const Triangle a = random.triangle(), b = random.triangle();
    if (outer(a.normal(), b.normal()) == Vector{}) continue;
    const LatticePoint corner_a[3] = {a.a, a.b, a.c}, corner_b[3] = {b.a, b.b, b.c};
    for (int k = 0; k < 9; ++k) {
      const EdgePoint first =
          edge_plane_point(corner_a[k / 3], corner_a[(k / 3 + 1) % 3], b.plane());
      const EdgePoint second =
          edge_plane_point(corner_b[k % 3], corner_b[(k % 3 + 1) % 3], a.plane());
      if (first.weight() == 0 || second.weight() == 0) continue;
      const Vector x = meet(first.p, first.q, b), y = meet(second.p, second.q, a);
      const int order = sign_of_fraction(scalar(outer(a.normal(), b.normal()), x - y));
      ASSERT_EQ(order_on_common_line(first, second), order);
      equal += order == 0;
    }
  }
  if (GetParam() == Input::kTiny) {
    EXPECT_GT(equal, 100);
  }
}

TEST_P(ByInput, RoundingIsToTheNearestStepAndTiesGoUp) {
  const auto check = [](const RationalPoint& point, const Vector& exact) {
    const FilePoint file = round_for_file(point);
    const FinePoint fine = round_fine(point);
    for (std::size_t k = 0; k < 3; ++k) {
      if (abs(exact[k]) > Fraction(1 << 28)) return;  // not in the cube
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const Fraction half(1, 2);
      ASSERT_EQ(whole(file[static_cast<int>(k)]),
                floor_of(exact[k] * Fraction(Whole(1) << 24) + half));
      ASSERT_EQ(whole(fine[k]), floor_of(exact[k] * Fraction(Whole(1) << 64) + half));
    }
  };
  for (int i = 0; i < 1000; ++i) {
    const Triangle t = random.triangle();
    const auto [p, q] = edge_across(t);
    check(rational(edge_plane_point(p, q, t.plane())), meet(p, q, t));
    // Ties: odd multiples of 2^-25 step.
    const Int128 part = random.below(1 << 24) * 2 + 1;
    const EdgePoint tie{p, q, part, part - (1 << 25)};
    check(rational(tie),
          vector_of(p) + Fraction(whole(part), 1 << 25) * (vector_of(q) - vector_of(p)));
    ASSERT_EQ(vector_of(rational(p)), vector_of(p));
    ASSERT_EQ(round_for_file(rational(p)), file_point(p));
    ASSERT_TRUE(is_file_point(rational(p), file_point(p)));
    ASSERT_EQ(round_fine(rational(p)), fine_point(p));
  }
}

// As above, for points of three planes, which may lie far outside of the cube: those are skipped.
TEST_P(ByInput, PointsOfThreePlanesAreRoundedToTheNearestStep) {
  int inside = 0;
  for (int i = 0; i < 1200; ++i) {
    const auto t = random.three_triangles();
    const Vector exact = meet(t[0], t[1], t[2]);
    if (std::ranges::any_of(exact, [](const Fraction& x) { return abs(x) > Fraction(1 << 28); })) {
      continue;
    }
    ++inside;
    const RationalPoint point = rational(t[0].plane(), t[1].plane(), t[2].plane());
    const FilePoint file = round_for_file(point);
    const FinePoint fine = round_fine(point);
    for (std::size_t k = 0; k < 3; ++k) {
      const Fraction half(1, 2);
      ASSERT_EQ(whole(file[static_cast<int>(k)]),
                floor_of(exact[k] * Fraction(Whole(1) << 24) + half));
      ASSERT_EQ(whole(fine[k]), floor_of(exact[k] * Fraction(Whole(1) << 64) + half));
    }
  }
  EXPECT_GT(inside, 30);
}

TEST(TinyLattice, MovingEverythingByWholeStepsChangesNoSign) {
  Draw random(Input::kTiny, 24);
  for (int i = 0; i < 1000; ++i) {
    const auto t = random.three_triangles();
    const Triangle other = random.triangle();
    const LatticePoint by = Draw(Input::kRandom26, static_cast<std::uint64_t>(i)).point();
    const auto moved = [&](const Triangle& x) { return Triangle{x.a + by, x.b + by, x.c + by}; };
    const auto p = [](const Triangle& x) { return x.plane(); };
    ASSERT_EQ(side_of_plane(p(t[0]), p(t[1]), p(t[2]), p(other)),
              side_of_plane(p(moved(t[0])), p(moved(t[1])), p(moved(t[2])), p(moved(other))));
    const RationalPoint here = rational(p(t[0]), p(t[1]), p(t[2]));
    const RationalPoint there = rational(p(moved(t[0])), p(moved(t[1])), p(moved(t[2])));
    ASSERT_EQ(side_of_plane(here, p(other)), side_of_plane(there, p(moved(other))));
    ASSERT_EQ(round_for_file(here) + file_point(by), round_for_file(there));
  }
}

// Planes of a tiny lattice meet many times in one point, whatever planes name it.
TEST(TinyLattice, OnePointHasOneSideAndOneRoundingUnderAllItsNames) {
  Draw random(Input::kTiny, 21);
  int equal = 0;
  for (int i = 0; i < 200; ++i) {
    const LatticePoint hub = random.point();
    const auto through = [&] {
      while (true) {
        const Triangle t{hub, random.point(), random.point()};
        if (t.plane().normal != Normal(0)) {
          return random.below(2) == 0 ? t : Triangle{t.b, t.c, t.a};
        }
      }
    };
    std::vector<std::array<Triangle, 3>> names;
    while (names.size() < 6) {
      const std::array<Triangle, 3> t{through(), through(), through()};
      if (independent(t[0], t[1], t[2])) names.push_back(t);
    }
    const Plane test = random.triangle().plane();
    for (const auto& x : names) {
      for (const auto& y : names) {
        const std::array<Plane, 3> p{x[0].plane(), x[1].plane(), x[2].plane()};
        const std::array<Plane, 3> q{y[0].plane(), y[1].plane(), y[2].plane()};
        ASSERT_TRUE(same_point(p, q));
        ASSERT_EQ(side_of_plane(p[0], p[1], p[2], test), sign_of(height(test, hub)));
        ASSERT_EQ(round_for_file(rational(p[0], p[1], p[2])), file_point(hub));
      }
    }
    // Two that have nothing to do with each other.
    std::array<std::array<Triangle, 3>, 2> any;
    for (auto& t : any) {
      do {
        t = {random.triangle(), random.triangle(), random.triangle()};
      } while (!independent(t[0], t[1], t[2]));
    }
    const bool same =
        meet(any[0][0], any[0][1], any[0][2]) == meet(any[1][0], any[1][1], any[1][2]);
    ASSERT_EQ(same_point({any[0][0].plane(), any[0][1].plane(), any[0][2].plane()},
                         {any[1][0].plane(), any[1][1].plane(), any[1][2].plane()}),
              same);
    equal += same;
  }
  EXPECT_LT(equal, 200);
}

// A total preorder: whatever is sorted by it comes out in the order of fractions, and equal points
// are neighbours.
TEST(TinyLattice, OrdersAlongALineAreTransitive) {
  Draw random(Input::kTiny, 22);
  int ties = 0;
  for (int i = 0; i < 150; ++i) {
    const Triangle a = random.triangle(), b = random.triangle();
    std::vector<Triangle> cuts;
    for (int k = 0; k < 20; ++k) {
      const Triangle c = random.triangle();
      if (independent(a, b, c)) cuts.push_back(c);
    }
    const Plane pa = a.plane(), pb = b.plane();
    const auto order = [&](const Triangle& c, const Triangle& d) {
      return order_on_line(pa, pb, c.plane(), d.plane());
    };
    for (const Triangle& c : cuts) {
      for (const Triangle& d : cuts) {
        ASSERT_EQ(order(c, d), -order(d, c));
        ties += order(c, d) == 0;
        for (const Triangle& e : cuts) {
          if (order(c, d) <= 0 && order(d, e) <= 0) {
            ASSERT_EQ(order(c, e), std::min(order(c, d), order(d, e)));
          }
        }
      }
    }
  }
  EXPECT_GT(ties, 1000);
}

TEST(TinyLattice, OrdersAlongAnEdgeAreTransitive) {
  Draw random(Input::kTiny, 23);
  int ties = 0;
  for (int i = 0; i < 300; ++i) {
    const LatticePoint p = random.point(), q = random.point();
    if (p == q) continue;
    std::vector<EdgePoint> points;
    while (points.size() < 12) {
      const EdgePoint point = edge_plane_point(p, q, random.triangle().plane());
      if (point.weight() != 0) points.push_back(point);
    }
    for (const EdgePoint& c : points) {
      for (const EdgePoint& d : points) {
        ASSERT_EQ(order_on_edge(c, d), -order_on_edge(d, c));
        ties += &c != &d && order_on_edge(c, d) == 0;
        for (const EdgePoint& e : points) {
          if (order_on_edge(c, d) <= 0 && order_on_edge(d, e) <= 0) {
            ASSERT_EQ(order_on_edge(c, e), std::min(order_on_edge(c, d), order_on_edge(d, e)));
          }
        }
      }
    }
  }
  EXPECT_GT(ties, 1000);
}

// Millions of evaluations in double: none that decides may be wrong, and nearly all of random ones
// must decide.
TEST(Filters, SignsThatTheyDecideAreExact) {
  for (const Input input : kInputs) {
    Draw random(input, 31);
    int undecided = 0;
    constexpr int kCount = 150000;
    for (int i = 0; i < kCount; ++i) {
      const Plane a = random.triangle().plane(), b = random.triangle().plane(),
                  c = random.triangle().plane(), d = random.triangle().plane();
      const filters::QuadSigns signs = filters::det4(a, b, c, d);
      const PlaneQuad quad = det4(a, b, c, d);
      ASSERT_TRUE(signs.height == 0 || signs.height == sign_of(quad.height));
      ASSERT_TRUE(signs.weight == 0 || signs.weight == sign_of(quad.weight));
      const int normals = filters::det3_sign(a.normal, b.normal, d.normal);
      ASSERT_TRUE(normals == 0 || normals == sign_of(det3(a.normal, b.normal, d.normal)));
      if (quad.weight == Int192(0)) continue;
      undecided += signs.height == 0;
      ASSERT_EQ(side_of_plane(a, b, c, d), sign_of(quad.height) * sign_of(quad.weight));
    }
    if (input == Input::kRandom26 || input == Input::kRandom29) {
      EXPECT_EQ(undecided, 0);
    }
    if (input == Input::kTiny) {
      EXPECT_GT(undecided, 0);
    }
  }
}

TEST(Filters, PlainDoublesAreExactUpToTheirExtent) {
  Draw random(Input::kTiny, 32);
  int zeros = 0;
  for (int i = 0; i < 500000; ++i) {
    const auto within = [&](std::int32_t extent) {
      const auto one = [&] {
        return static_cast<std::int32_t>(random.below(3) == 0 ? random.below(2) * extent
                                                              : random.below(extent + 1));
      };
      return LatticePoint(one(), one(), one());
    };
    const LatticePoint at(1 << 27, -(1 << 28), 12345);
    const std::int32_t extent = random.below(4) == 0 ? 3 : kDoubleExtent;
    const LatticePoint a = at + within(extent), b = at + within(extent), c = at + within(extent);
    // Another triangle's box, which touches the first one's.
    const LatticePoint d = at + within(2 * extent);
    ASSERT_EQ(orient3d_in_double(a, b, c, d), orient3d(a, b, c, d));
    zeros += orient3d(a, b, c, d) == 0;
  }
  EXPECT_GT(zeros, 1000);
}

}  // namespace
}  // namespace strata::exact
