#include "mesh/check/triangles_meet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <random>

#include "tests/mesh/check/triangle_oracle.h"

namespace strata {
namespace {

using exact::FilePoint;
/// A fraction for coordinates up to 7, whose products stay far below 2^63.
struct Fraction {
  std::int64_t top = 0, bottom = 1;  // bottom > 0, no common divisor

  Fraction(std::int64_t value = 0) : top(value) {}  // NOLINT: a whole number is one
  Fraction(std::int64_t over, std::int64_t under) : top(over), bottom(under) {
    const std::int64_t divisor = std::gcd(top, bottom) * (bottom < 0 ? -1 : 1);
    top /= divisor;
    bottom /= divisor;
  }
  friend Fraction operator+(const Fraction& a, const Fraction& b) {
    return {a.top * b.bottom + b.top * a.bottom, a.bottom * b.bottom};
  }
  friend Fraction operator-(const Fraction& a, const Fraction& b) {
    return {a.top * b.bottom - b.top * a.bottom, a.bottom * b.bottom};
  }
  friend Fraction operator*(const Fraction& a, const Fraction& b) {
    return {a.top * b.top, a.bottom * b.bottom};
  }
  friend Fraction operator/(const Fraction& a, const Fraction& b) {
    return {a.top * b.bottom, a.bottom * b.top};
  }
  friend bool operator==(const Fraction&, const Fraction&) = default;
  friend auto operator<=>(const Fraction& a, const Fraction& b) {
    return a.top * b.bottom <=> b.top * a.bottom;
  }
};
using Small = oracle::Geometry<Fraction>;

Small::Point fraction_point(const FilePoint& p) { return {p.x, p.y, p.z}; }
Small::Corners fractions(const TriangleCorners& t) {
  return {fraction_point(t[0]), fraction_point(t[1]), fraction_point(t[2])};
}

Meeting right_answer(const TriangleCorners& a, const TriangleCorners& b) {
  return static_cast<Meeting>(Small::compare(fractions(a), fractions(b)));
}

std::string text(const TriangleCorners& t) {
  std::string result;
  for (const FilePoint& p : t) {
    result +=
        "(" + std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + ") ";
  }
  return result;
}

/// A one-to-one map with large coefficients: triangles meet as before, and no product is exact in a
/// double any more.
FilePoint enlarge(const FilePoint& p) {
  const std::int64_t s = (std::int64_t{1} << 49) + 12345;
  // The matrix [[1, 0, 0], [1, 1, 0], [1, 1, 1]] times s, and small numbers beside it.
  return {s * p.x + 3 * p.y, s * (p.x + p.y) + 5 * p.z, s * (p.x + p.y + p.z) - 7 * p.x};
}

TriangleCorners enlarged(const TriangleCorners& t) {
  return {enlarge(t[0]), enlarge(t[1]), enlarge(t[2])};
}

void expect_right(const TriangleCorners& a, const TriangleCorners& b,
                  std::map<Meeting, int>& count) {
  const Meeting right = right_answer(a, b);
  ++count[right];
  ASSERT_EQ(triangles_meet(a, b), right) << text(a) << "and " << text(b);
  ASSERT_EQ(triangles_meet(b, a), right) << text(b) << "and " << text(a);
  ASSERT_EQ(triangles_meet(enlarged(a), enlarged(b)), right) << text(a) << "and " << text(b);
}

TEST(TrianglesMeet, AsFractionsSayForAllTrianglesOfACube) {
  std::vector<TriangleCorners> all;  // without order, vertices may coincide
  for (int a = 0; a < 8; ++a) {
    for (int b = a; b < 8; ++b) {
      for (int c = b; c < 8; ++c) {
        const auto corner = [](int i) { return FilePoint(i & 1, i >> 1 & 1, i >> 2); };
        all.push_back({corner(a), corner(b), corner(c)});
      }
    }
  }
  std::map<Meeting, int> count;
  for (const TriangleCorners& a : all) {
    for (const TriangleCorners& b : all) expect_right(a, b, count);
    if (HasFatalFailure()) return;
  }
  EXPECT_EQ(count.size(), 6u);
}

class TrianglesMeetOnGrid : public testing::TestWithParam<std::array<int, 3>> {};
INSTANTIATE_TEST_SUITE_P(Sides, TrianglesMeetOnGrid,
                         testing::Values(std::array{3, 3, 3}, std::array{4, 4, 4},
                                         std::array{4, 4, 1}, std::array{1, 5, 5},
                                         std::array{7, 1, 2}));

TEST_P(TrianglesMeetOnGrid, AsFractionsSay) {
  std::mt19937_64 random(7);
  const auto below = [&](int end) {
    return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(end));
  };
  const auto point = [&] {
    return FilePoint(below(GetParam()[0]), below(GetParam()[1]), below(GetParam()[2]));
  };
  std::map<Meeting, int> count;
  for (int i = 0; i < 20000; ++i) {
    const TriangleCorners a{point(), point(), point()};
    TriangleCorners b{point(), point(), point()};
    for (std::size_t k = 0; k < 3; ++k) {  // often the same vertices
      if (below(4) == 0) b[k] = a[static_cast<std::size_t>(below(3))];
    }
    expect_right(a, b, count);
    if (HasFatalFailure()) return;
  }
  const bool solid = *std::ranges::min_element(GetParam()) > 1;
  EXPECT_GT(count[Meeting::kDisjoint], 100);
  EXPECT_GT(count[Meeting::kSharedVertex], 100);
  EXPECT_GT(count[Meeting::kSharedEdge], 100);
  EXPECT_GT(count[Meeting::kTouch], 100);
  EXPECT_GT(count[Meeting::kOverlap], 100);
  if (solid) {
    EXPECT_GT(count[Meeting::kCross], 100);
  }
}

TEST(TrianglesMeet, ADifferenceOfOneStepIn2To53Counts) {
  const std::int64_t far = std::int64_t{1} << 52;
  const TriangleCorners floor{FilePoint(-far, -far, 1), FilePoint(far, -far, 1),
                              FilePoint(0, far, 1)};
  const auto needle = [&](std::int64_t tip) {
    return TriangleCorners{FilePoint(3, 5, tip), FilePoint(1 - far, 0, far),
                           FilePoint(far, 1, far)};
  };
  EXPECT_EQ(triangles_meet(floor, needle(2)), Meeting::kDisjoint);
  EXPECT_EQ(triangles_meet(floor, needle(1)), Meeting::kTouch);
  EXPECT_EQ(triangles_meet(floor, needle(0)), Meeting::kCross);
}

TEST(TrianglesMeet, ThePlaceIsInBoth) {
  std::mt19937_64 random(11);
  const auto point = [&] { return FilePoint(random() % 5, random() % 5, random() % 5); };
  int places = 0;
  for (int i = 0; i < 20000; ++i) {
    const TriangleCorners a{point(), point(), point()}, b{point(), point(), point()};
    if (triangles_meet(a, b) == Meeting::kDisjoint) continue;
    ++places;
    const glm::dvec3 place = meeting_place(a, b);
    // Far out along a normal of either triangle, or outside of an edge, would be further away.
    for (const TriangleCorners& t : {a, b}) {
      const auto sum = [&](double u, double v) {
        return (1 - u - v) * glm::dvec3(t[0]) + u * glm::dvec3(t[1]) + v * glm::dvec3(t[2]);
      };
      double nearest = 100;
      for (int u = 0; u <= 40; ++u) {
        for (int v = 0; u + v <= 40; ++v) {
          const glm::dvec3 d = sum(u / 40.0, v / 40.0) - place;
          nearest = std::min(nearest, d.x * d.x + d.y * d.y + d.z * d.z);
        }
      }
      ASSERT_LT(std::sqrt(nearest), 0.18) << text(a) << "and " << text(b);
    }
  }
  EXPECT_GT(places, 1000);
}

}  // namespace
}  // namespace strata
