// The exact reference against an independent one: orientation determinants of big integers, with
// the sample moved by numbers e, e^2, e^3 that are really there, only very small.

#include "raster/triangle_setup.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <glm/common.hpp>
#include <random>

#include "tests/support/voxel_set.h"

namespace strata {
namespace {

using testkit::kAllAxes;
using Big = boost::multiprecision::int1024_t;

// All coordinates are scaled by 2^300, so that e = 2^-100, e^2 and e^3 are whole numbers. Products
// of differences of coordinates stay below 2^61 lattice units, far less than 1/e; determinants stay
// below 2^1000.
constexpr unsigned kScaleBits = 300;

struct Point {
  Big p[3];
};

Point scaled(const glm::ivec3& p) {
  return {{Big(p.x) << kScaleBits, Big(p.y) << kScaleBits, Big(p.z) << kScaleBits}};
}

/// The lattice point moved by (e, e^2, e^3).
Point moved(const glm::ivec3& p) {
  Point result = scaled(p);
  for (unsigned axis = 0; axis < 3; ++axis) {
    result.p[axis] += Big(1) << (kScaleBits - 100 * (axis + 1));
  }
  return result;
}

/// Sign of the area of (a, b, c) projected along `frame`.
int orient2d(const Point& a, const Point& b, const Point& c, const AxisFrame& frame) {
  const Big area = (b.p[frame.u] - a.p[frame.u]) * (c.p[frame.v] - a.p[frame.v]) -
                   (c.p[frame.u] - a.p[frame.u]) * (b.p[frame.v] - a.p[frame.v]);
  return area.sign();
}

/// Sign of the volume of (a, b, c, d): positive when d is on the side that the normal of a
/// counter-clockwise (a, b, c) looks to.
int orient3d(const Point& a, const Point& b, const Point& c, const Point& d) {
  Big m[3][3];
  for (int axis = 0; axis < 3; ++axis) {
    m[0][axis] = b.p[axis] - a.p[axis];
    m[1][axis] = c.p[axis] - a.p[axis];
    m[2][axis] = d.p[axis] - a.p[axis];
  }
  const Big det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                  m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                  m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  return det.sign();
}

struct Corners {
  glm::ivec3 p[3];
};

/// Looks at one pixel from scratch and compares.
void check_pixel(const Corners& t, const AxisFrame& frame, int u, int v, bool& covered) {
  const Point a = scaled(t.p[0]), b = scaled(t.p[1]), c = scaled(t.p[2]);
  TriangleSetup setup;
  const bool visible = setup_triangle(t.p[0], t.p[1], t.p[2], frame, setup);
  const int area = orient2d(a, b, c, frame);
  ASSERT_EQ(visible, area != 0);
  covered = false;
  if (!visible) return;

  glm::ivec3 sample{};
  sample[frame.u] = u * 256 + 128, sample[frame.v] = v * 256 + 128;
  const Point s = moved(sample);
  const int side0 = orient2d(a, b, s, frame), side1 = orient2d(b, c, s, frame),
            side2 = orient2d(c, a, s, frame);
  ASSERT_NE(side0 * side1 * side2, 0) << "a perturbed sample is on no edge";
  covered = side0 == area && side1 == area && side2 == area;

  std::int64_t depth = -1;
  int hits = 0;
  constexpr std::uint32_t kLimit = 1u << 31;
  rasterize_exact(setup, {u, v, u + 1, v + 1}, kLimit, [&](int pu, int pv, std::uint32_t d) {
    EXPECT_TRUE(pu == u && pv == v);
    depth = d;
    ++hits;
  });
  ASSERT_EQ(hits, covered ? 1 : 0);
  if (!covered) return;
  const std::int64_t floor = exact_depth(setup, u, v);
  EXPECT_EQ(depth, std::clamp<std::int64_t>(floor, 0, kLimit - 1));

  // A sample at the floor is before the surface, one a step further is beyond it. Far along the ray
  // is beyond it for certain, and the outward normal looks there exactly when the ray exits.
  glm::ivec3 at = sample;
  at[frame.w] = 1 << 30;
  const int beyond = orient3d(a, b, c, moved(at));
  ASSERT_NE(beyond, 0);
  EXPECT_EQ(setup.exit, beyond > 0);
  at[frame.w] = static_cast<int>(floor);
  EXPECT_EQ(orient3d(a, b, c, moved(at)), -beyond) << "depth " << floor << " is too small";
  at[frame.w] = static_cast<int>(floor) + 1;
  EXPECT_EQ(orient3d(a, b, c, moved(at)), beyond) << "depth " << floor << " is too large";
}

class RandomTriangles {
 public:
  explicit RandomTriangles(unsigned seed) : random_(seed) {}
  int pick(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  /// Corners at multiples of `step` around the pixel's centre, `extent` steps or less away.
  Corners around(const glm::ivec3& centre, int extent, int step) {
    Corners t;
    for (auto& p : t.p) {
      for (int axis = 0; axis < 3; ++axis) {
        p[axis] = centre[axis] + pick(-extent / step, extent / step) * step;
      }
    }
    return t;
  }

 private:
  std::mt19937_64 random_;
};

TEST(ExactRaster, CoversAndMeasuresAsBigNumbersSay) {
  RandomTriangles random(31);
  constexpr int kExtents[] = {1, 2, 40, 128, 256, 700, 1 << 12, 1 << 16, 1 << 21, 1 << 27};
  int covered_pixels = 0;
  for (const Axis axis : kAllAxes) {
    const AxisFrame frame(axis);
    for (const int extent : kExtents) {
      for (int round = 0; round < 600; ++round) {
        const int u = random.pick(0, 300), v = random.pick(0, 300);
        glm::ivec3 centre{};
        centre[frame.u] = u * 256 + 128, centre[frame.v] = v * 256 + 128;
        centre[frame.w] = random.pick(0, 60000) * 128;
        // Coarse steps put corners, edges and planes on the pixel's centre.
        const int step = std::max(1, round % 2 == 0 ? extent / random.pick(1, 4) : 1);
        const Corners t = random.around(centre, extent, step);
        bool covered = false;
        check_pixel(t, frame, u, v, covered);
        covered_pixels += covered;
        if (HasFailure()) {
          for (const auto& p : t.p) std::printf("corner %d %d %d\n", p.x, p.y, p.z);
          FAIL() << "pixel " << u << ", " << v << ", axis " << frame.w << ", extent " << extent;
        }
      }
    }
  }
  EXPECT_GT(covered_pixels, 2000) << "the triangles miss their pixels";
}

TEST(ExactRaster, DepthOfFlatTrianglesOnVoxelCentresBelongsToBothSidesByTheSameRule) {
  // A face on the plane of voxel centres: along each axis the perturbed centres lie beyond it, so
  // the face of a box [a, b] on centres takes in its lower face's voxels and not its upper one's.
  for (const Axis axis : kAllAxes) {
    const AxisFrame frame(axis);
    Corners t;
    for (int i = 0; i < 3; ++i) {
      t.p[i][frame.u] = i == 1 ? 5000 : 0;
      t.p[i][frame.v] = i == 2 ? 5000 : 0;
      t.p[i][frame.w] = 5 * 256 + 128;
    }
    TriangleSetup setup;
    ASSERT_TRUE(setup_triangle(t.p[0], t.p[1], t.p[2], frame, setup));
    EXPECT_EQ(exact_depth(setup, 1, 1), 5 * 256 + 127);
  }
}

TEST(ExactRaster, SetUpDoesNotOverflowAtTheCornersOfTheLattice) {
  constexpr int kFar = kMaxLatticeCoordinate;
  RandomTriangles random(32);
  int covered_pixels = 0;
  for (int round = 0; round < 3000; ++round) {
    Corners t;
    for (auto& p : t.p) {
      for (int axis = 0; axis < 3; ++axis) p[axis] = random.pick(0, 1) == 0 ? -kFar : kFar;
      if (random.pick(0, 2) == 0) p[random.pick(0, 2)] += random.pick(-1, 1) * random.pick(0, 9);
    }
    for (auto& p : t.p) p = glm::clamp(p, glm::ivec3(-kFar), glm::ivec3(kFar));
    for (const Axis axis : kAllAxes) {
      bool covered = false;
      check_pixel(t, AxisFrame(axis), random.pick(0, 65535), random.pick(0, 65535), covered);
      covered_pixels += covered;
      ASSERT_FALSE(HasFailure()) << "round " << round;
    }
  }
  EXPECT_GT(covered_pixels, 100);
}

TEST(ExactRaster, TheBoxHoldsEveryCoveredPixel) {
  // pixel_bounds() is the only part of rasterize_exact() that a look at single pixels leaves out.
  RandomTriangles random(33);
  for (int round = 0; round < 500; ++round) {
    const Corners t = random.around({10 * 128, 10 * 128, 1000}, 1500, round % 2 == 0 ? 64 : 1);
    for (const Axis axis : kAllAxes) {
      const AxisFrame frame(axis);
      TriangleSetup setup;
      if (!setup_triangle(t.p[0], t.p[1], t.p[2], frame, setup)) continue;
      const PixelRect clip{1, 2, 9, 11};
      const PixelRect box = pixel_bounds(setup, clip);
      for (int v = clip.v0; v < clip.v1; ++v) {
        for (int u = clip.u0; u < clip.u1; ++u) {
          bool covered = true;
          for (int i = 0; i < 3; ++i) {
            const auto e = setup.edge(i);
            covered = covered && e.a * (u * 256 + 128) + e.b * (v * 256 + 128) + e.c >= 0;
          }
          const bool in_box = u >= box.u0 && u < box.u1 && v >= box.v0 && v < box.v1;
          EXPECT_TRUE(in_box || !covered);
        }
      }
    }
  }
}

}  // namespace
}  // namespace strata
