#include "exact/mesh_sums.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/common.hpp>

#include "tests/exact/exact_oracle.h"

namespace strata::exact {
namespace {

Whole determinant(const FinePoint& a, const FinePoint& b, const FinePoint& c) {
  const auto w = [](Int128 x) { return whole(x); };
  return w(a[0]) * (w(b[1]) * w(c[2]) - w(b[2]) * w(c[1])) -
         w(a[1]) * (w(b[0]) * w(c[2]) - w(b[2]) * w(c[0])) +
         w(a[2]) * (w(b[0]) * w(c[1]) - w(b[1]) * w(c[0]));
}

struct Corners {
  FinePoint a, b, c;
};

// The box from `low` to `high`, outside out: the six faces of a cube, two triangles each.
std::vector<Triangle> box(const LatticePoint& low, const LatticePoint& high) {
  const auto corner = [&](int bits) {
    return LatticePoint((bits & 1) != 0 ? high.x : low.x, (bits & 2) != 0 ? high.y : low.y,
                        (bits & 4) != 0 ? high.z : low.z);
  };
  std::vector<Triangle> result;
  for (const auto& [a, b, c, d] : {std::array{0, 2, 3, 1},
                                   {4, 5, 7, 6},
                                   {0, 1, 5, 4},
                                   {2, 6, 7, 3},
                                   {0, 4, 6, 2},
                                   {1, 3, 7, 5}}) {
    result.push_back({corner(a), corner(b), corner(c)});
    result.push_back({corner(a), corner(c), corner(d)});
  }
  return result;
}

TEST(VolumeSum, OfABoxIsItsVolumeToTheDigit) {
  Draw random(Input::kRandom29, 71);
  for (int i = 0; i < 200; ++i) {
    const LatticePoint p = random.point(), q = random.point();
    const LatticePoint low = glm::min(p, q), high = glm::max(p, q);
    VolumeSum lattice, fine;
    for (const Triangle& t : box(low, high)) {
      lattice.add(t.a, t.b, t.c);
      fine.add(fine_point(t.a), fine_point(t.b), fine_point(t.c));
    }
    ASSERT_EQ(lattice.six_volumes(), fine.six_volumes());
    const Whole volume = Whole(high.x - low.x) * (high.y - low.y) * (high.z - low.z);
    ASSERT_EQ(whole(lattice.six_volumes()), 6 * volume * (Whole(1) << 192));
    ASSERT_TRUE(is_nearest(lattice.volume(), Fraction(volume)));
  }
}

TEST(VolumeSum, IsTheSumOfDeterminantsInAnyOrder) {
  for (const Input input : kInputs) {
    Draw random(input, 72);
    std::vector<Corners> triangles;
    Whole sum = 0;
    for (int i = 0; i < 2000; ++i) {
      const auto fine = [&] {
        FinePoint p = fine_point(random.point());
        for (Int128& x : p) {  // towards the middle, so that the cube holds it
          const Int128 rest = static_cast<Int128>(random.word());
          x += x > 0 ? -rest : rest;
        }
        return p;
      };
      triangles.push_back({fine(), fine(), fine()});
      sum += determinant(triangles.back().a, triangles.back().b, triangles.back().c);
    }
    VolumeSum forward, backward, half;
    for (const auto& [a, b, c] : triangles) forward.add(a, b, c);
    std::ranges::reverse(triangles);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      (i % 2 == 0 ? backward : half).add(triangles[i].a, triangles[i].b, triangles[i].c);
    }
    backward.add(half);
    ASSERT_EQ(whole(forward.six_volumes()), sum);
    ASSERT_EQ(forward.six_volumes(), backward.six_volumes());
    ASSERT_TRUE(is_nearest(forward.volume(), Fraction(sum, Whole(6) << 192)));
  }
}

// 2^32 of the largest triangles.
TEST(VolumeSum, HasRoomForTheLargestMesh) {
  const std::int32_t m = 1 << 28;
  VolumeSum lattice, fine;
  const LatticePoint a(m, m, -m), b(-m, m, m), c(m, -m, m);
  lattice.add(a, b, c);
  fine.add(fine_point(a), fine_point(b), fine_point(c));
  for (int i = 0; i < 32; ++i) {
    lattice.add(VolumeSum(lattice));
    fine.add(VolumeSum(fine));
  }
  const Whole sum = determinant(fine_point(a), fine_point(b), fine_point(c)) * (Whole(1) << 32);
  EXPECT_EQ(bit_length(fine.six_volumes()), 311);
  EXPECT_EQ(whole(fine.six_volumes()), sum);
  EXPECT_EQ(whole(lattice.six_volumes()), sum);
}

TEST(MomentSum, OfABoxAreThoseOfTheFormulas) {
  Draw random(Input::kRandom29, 76);
  for (int i = 0; i < 200; ++i) {
    const LatticePoint p = random.point(), q = random.point();
    const LatticePoint low = glm::min(p, q), high = glm::max(p, q) + LatticePoint(1);
    MomentSum sum, outside_in;
    for (const Triangle& t : box(low, high)) {
      sum.add(fine_point(t.a), fine_point(t.b), fine_point(t.c));
      outside_in.add(fine_point(t.a), fine_point(t.c), fine_point(t.b));
    }
    const LatticePoint size = high - low;
    const Fraction volume(Whole(size.x) * size.y * size.z);
    ASSERT_TRUE(is_nearest(sum.volume().volume(), volume));
    for (int k = 0; k < 3; ++k) {
      const Fraction middle(Whole(low[k]) + high[k], 2);
      ASSERT_TRUE(is_nearest(sum.centre(k), middle));
      ASSERT_TRUE(is_nearest(outside_in.centre(k), middle));
      for (int j = 0; j < 3; ++j) {
        const Fraction moment = j == k ? Fraction(volume * size[k] * size[k] / 12) : Fraction(0);
        ASSERT_TRUE(is_nearest(sum.central_moment(j, k), moment));
        ASSERT_EQ(outside_in.central_moment(j, k), -sum.central_moment(j, k));
      }
    }
  }
}

// Of a tetrahedron anywhere: V / 20 times the sum over its corners, about its centre, of v v^T.
TEST(MomentSum, OfATetrahedronAreThoseOfItsCorners) {
  for (const Input input : kInputs) {
    Draw random(input, 77);
    for (int i = 0; i < 100; ++i) {
      const LatticePoint p[4] = {random.point(), random.point(), random.point(), random.point()};
      const int side = orient3d(p[0], p[1], p[2], p[3]);
      if (side == 0) continue;
      MomentSum sum, part;
      int face = 0;
      for (const auto& [a, b, c] : {std::array{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}) {
        (face++ % 2 == 0 ? sum : part).add(fine_point(p[a]), fine_point(p[b]), fine_point(p[c]));
      }
      sum.add(part);
      const Fraction volume = Triangle{p[0], p[1], p[2]}.height(vector_of(p[3])) / 6;
      ASSERT_TRUE(is_nearest(sum.volume().volume(), volume));
      Vector corner[4], centre{};
      for (int k = 0; k < 4; ++k) {
        corner[k] = vector_of(p[k]);
        centre = centre + Fraction(1, 4) * corner[k];
      }
      for (std::size_t j = 0; j < 3; ++j) {
        ASSERT_TRUE(is_nearest(sum.centre(static_cast<int>(j)), centre[j]));
        for (std::size_t k = 0; k < 3; ++k) {
          Fraction moment = 0;
          for (const Vector& v : corner) moment += (v[j] - centre[j]) * (v[k] - centre[k]);
          ASSERT_TRUE(is_nearest(sum.central_moment(static_cast<int>(j), static_cast<int>(k)),
                                 Fraction(moment * volume / 20)));
        }
      }
    }
  }
}

// 2^32 of the largest tetrahedra: the sums are doubled, so the centre stays where it is.
TEST(MomentSum, HasRoomForTheLargestMesh) {
  const std::int32_t m = 1 << 28;
  MomentSum sum;
  sum.add(fine_point({m, m, m}), fine_point({-m, m, -m}), fine_point({m, -m, -m}));
  sum.add(fine_point({m, m, m}), fine_point({-m, m, m}), fine_point({m, -m, m}));
  sum.add(fine_point({m, m, -m}), fine_point({-m, m, m}), fine_point({m, m, m}));
  const double centre[3] = {sum.centre(0), sum.centre(1), sum.centre(2)};
  const double moment = sum.central_moment(0, 1), square = sum.central_moment(2, 2);
  for (int i = 0; i < 30; ++i) sum.add(MomentSum(sum));
  for (int k = 0; k < 3; ++k) EXPECT_EQ(sum.centre(k), centre[k]);
  EXPECT_EQ(sum.central_moment(0, 1), std::ldexp(moment, 30));
  EXPECT_EQ(sum.central_moment(2, 2), std::ldexp(square, 30));
}

// MomentSum takes 2^-64 steps for what FileSum takes for whole ones.
TEST(FileSum, IsAsMomentSum) {
  for (const Input input : kInputs) {
    Draw random(input, 78);
    const auto point = [&] {  // with all bits down to the last
      const FilePoint p = file_point(random.point());
      const auto rest = static_cast<std::int64_t>(random.word() >> 40);
      return FilePoint(p.x, p.y > 0 ? p.y - rest : p.y + rest, p.z);
    };
    const auto fine = [](const FilePoint& p) { return FinePoint{p.x, p.y, p.z}; };
    for (int i = 0; i < 200; ++i) {
      const FilePoint p[4] = {point(), point(), point(), point()};
      if (orient3d(p[0], p[1], p[2], p[3]) == 0) continue;
      MomentSum moments;
      FileSum about_zero, about_corner;
      int face = 0;
      for (const auto& [a, b, c] : {std::array{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}) {
        moments.add(fine(p[a]), fine(p[b]), fine(p[c]));
        about_zero.add(FilePoint(0), p[a], p[b], p[c]);
        FileSum part;
        part.add(p[0], p[a], p[b], p[c]);
        (face++ % 2 == 0 ? about_corner.add(part) : about_corner.add(p[0], p[a], p[b], p[c]));
      }
      ASSERT_EQ(whole(about_zero.six_volumes()), whole(moments.volume().six_volumes()));
      ASSERT_EQ(about_zero.six_volumes(), about_corner.six_volumes());
      ASSERT_EQ(std::ldexp(about_zero.volume(), -192), moments.volume().volume());
      for (int k = 0; k < 3; ++k) {
        ASSERT_EQ(std::ldexp(about_zero.centre(k), -kFineBits), moments.centre(k));
        Whole mean = 0;
        for (const FilePoint& corner : p) mean += Whole(corner[k]) - p[0][k];
        ASSERT_TRUE(is_nearest(about_corner.centre(k), Fraction(mean, 4)));
      }
    }
  }
}

// 2^32 of the largest tetrahedra.
TEST(FileSum, HasRoomForTheLargestMesh) {
  const std::int64_t t = std::int64_t{1} << 53;
  FileSum sum;
  sum.add(FilePoint(0), {t, t, 0}, {0, t, t}, {t, 0, t});
  const double volume = sum.volume(), centre = sum.centre(1);
  EXPECT_EQ(volume, std::ldexp(1.0, 160) / 6);
  EXPECT_EQ(centre, 0.5 * std::ldexp(1.0, 53));
  for (int i = 0; i < 32; ++i) sum.add(FileSum(sum));
  EXPECT_EQ(sum.volume(), std::ldexp(volume, 32));
  EXPECT_EQ(sum.centre(1), centre);
}

TEST(AreaSum, OfABoxIsItsAreaToTheDigit) {
  Draw random(Input::kRandom26, 73);
  for (int i = 0; i < 200; ++i) {
    const LatticePoint p = random.point(), q = random.point() + LatticePoint(1);
    const LatticePoint low = glm::min(p, q), high = glm::max(p, q);
    AreaSum sum;
    for (const Triangle& t : box(low, high)) {
      if (t.plane().normal == Normal(0)) continue;
      sum.add(t.plane(), fine_point(t.a), fine_point(t.b), fine_point(t.c));
    }
    const Whole x = high.x - low.x, y = high.y - low.y, z = high.z - low.z;
    ASSERT_TRUE(is_nearest(sum.area(), Fraction(2 * (x * y + y * z + z * x))));
  }
}

TEST(AreaSum, IsWithinItsErrorOfTheExactArea) {
  for (const Input input : kInputs) {
    Draw random(input, 74);
    AreaSum sum, other;
    Whole twice = 0;  // in 2^-200 square step, too small by less than one a triangle
    double rough = 0;
    for (int i = 0; i < 500; ++i) {
      const Triangle t = random.triangle();
      // A part of the triangle whose corners are rounded, so that they are not quite in its plane.
      const auto part = [&](Fraction s, Fraction r) {
        return Vector(vector_of(t.a) + s * (vector_of(t.b) - vector_of(t.a)) +
                      r * (vector_of(t.c) - vector_of(t.a)));
      };
      const auto rounded = [](const Vector& v) {
        FinePoint result;
        for (std::size_t k = 0; k < 3; ++k) {
          const Whole x = floor_of(v[k] * Fraction(Whole(1) << 64) + Fraction(1, 2));
          result[k] = static_cast<Int128>(x);
        }
        return result;
      };
      const Fraction third(1, 3 + random.below(5)), rest(2, 7);
      const Vector b = part(third, 0), c = part(0, rest);
      (i % 2 == 0 ? sum : other).add(t.plane(), fine_point(t.a), rounded(b), rounded(c));
      const Vector n = t.normal();
      const Fraction square = scalar(n, n) * third * third * rest * rest;
      twice += sqrt(floor_of(square * Fraction(Whole(1) << 400)));
      rough += std::sqrt(square.convert_to<double>()) / 2;
    }
    sum.add(other);
    const Fraction error =
        abs(Fraction(fraction_of(sum.area()) - Fraction(twice, Whole(1) << 201)));
    EXPECT_LE(error, Fraction(fraction_of(sum.error())));
    EXPECT_NEAR(sum.area() / rough, 1, 1e-12);
    EXPECT_LT(sum.error(), 1e-14 * rough);
  }
}

TEST(AreaSum, SlopeRatiosAreFlooredRoots) {
  for (const Input input : kInputs) {
    Draw random(input, 75);
    for (int i = 0; i < 3000; ++i) {
      const Normal n = random.triangle().plane().normal;
      const Whole x = n.x, y = n.y, z = n.z;
      const Whole most = std::max({Whole(abs(x)), Whole(abs(y)), Whole(abs(z))});
      const Whole square = (x * x + y * y + z * z) * (Whole(1) << 124);
      const Whole ratio = slope_ratio(n);
      ASSERT_LE(Whole(ratio * ratio * most * most), square);
      ASSERT_GT(Whole((ratio + 1) * (ratio + 1) * most * most), square);
    }
  }
}

}  // namespace
}  // namespace strata::exact
