#include <gtest/gtest.h>

#include <random>

#include "raster/gl/triangle.glsl.h"
#include "raster/triangle_setup.h"

// The arithmetic of the compute rasterizer, compiled as C++, against the reference.

namespace strata {
namespace {

using Random = std::mt19937_64;

std::int32_t between(Random& random, std::int64_t low, std::int64_t high) {
  return static_cast<std::int32_t>(std::uniform_int_distribution<std::int64_t>(low, high)(random));
}

struct Pair {
  TriangleSetup reference;
  glsl::RasterTriangle shared;
  bool covers_reference = false, covers_shared = false;
};

Pair set_up(const glm::ivec3 (&p)[3], Axis axis) {
  const AxisFrame frame(axis);
  Pair pair;
  pair.covers_reference = setup_triangle(p[0], p[1], p[2], frame, pair.reference);
  const auto turned = [&](const glm::ivec3& q) {
    return glm::ivec3(q[frame.u], q[frame.v], q[frame.w]);
  };
  pair.covers_shared =
      glsl::raster_setup(turned(p[0]), turned(p[1]), turned(p[2]), frame.w, pair.shared);
  return pair;
}

std::int64_t shared_depth(const Pair& pair, const glsl::RasterFraction& at) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(pair.shared.p0.z) + at.quotient);
}

/// Compares coverage and depth of a triangle at pixel (u, v), by division and by strides from
/// (u0, v0). Depths are compared where the pixel is covered.
bool same_at(const Pair& pair, int u0, int v0, int u, int v, bool& covered) {
  const std::int64_t pu = std::int64_t{u} * kLatticeSteps + kLatticeSteps / 2;
  const std::int64_t pv = std::int64_t{v} * kLatticeSteps + kLatticeSteps / 2;
  covered = true;
  for (int i = 0; i < 3; ++i) {
    const auto e = pair.reference.edge(i);
    covered = covered && e.a * pu + e.b * pv + e.c >= 0;
  }
  const glsl::RasterTriangle& t = pair.shared;
  const glm::ivec3 corners[] = {t.p0, t.p1, t.p2};
  bool shared = true, strided = true;
  for (int i = 0; i < 3; ++i) {
    const auto& from = corners[i];
    const auto& to = corners[(i + 1) % 3];
    shared = shared && glsl::raster_edge(from, to, u, v).at >= 0;
    const auto e = glsl::raster_edge(from, to, u0, v0);
    strided = strided &&
              e.at + std::int64_t{e.along_u} * (u - u0) + std::int64_t{e.along_v} * (v - v0) >= 0;
  }
  if (shared != covered || strided != covered) return false;
  if (!covered) return true;
  const std::int64_t expected = exact_depth(pair.reference, u, v);
  if (shared_depth(pair, glsl::raster_depth_at(t, u, v)) != expected) return false;
  if (u < u0 || v < v0) return true;
  const auto base = glsl::raster_depth_at(t, u0, v0);
  const auto by_u = glsl::raster_depth_along_u(t), by_v = glsl::raster_depth_along_v(t);
  const auto area = static_cast<std::uint64_t>(t.area);
  const auto far = glsl::raster_stride(base, by_u, u - u0, by_v, v - v0, area);
  return far.remainder < area && shared_depth(pair, far) == expected;
}

TEST(TriangleGlsl, SetsUpAndCoversAsTheReferenceAtEverySize) {
  Random random(1);
  std::size_t covered_pixels = 0;
  for (int round = 0; round < 20000; ++round) {
    // From parts of a pixel to all that a lattice holds, around a random place.
    const int bits = between(random, 2, 28);
    const std::int64_t reach = std::int64_t{1} << bits;
    const int depth_bits = between(random, 0, 28);
    const std::int64_t depth_reach = std::int64_t{1} << depth_bits;
    glm::ivec3 p[3];
    const auto axis = static_cast<Axis>(between(random, 0, 2));
    const AxisFrame frame(axis);
    for (auto& q : p) {
      q[frame.u] = between(random, -reach, reach);
      q[frame.v] = between(random, -reach, reach);
      q[frame.w] = between(random, -depth_reach, depth_reach);
      if (round % 3 == 0) q = q / 128 * 128;  // ties with centres
    }
    const Pair pair = set_up(p, axis);
    ASSERT_EQ(pair.covers_reference, pair.covers_shared);
    if (!pair.covers_reference) continue;
    ASSERT_EQ(pair.reference.exit, pair.shared.exit_flag != 0);
    ASSERT_EQ(pair.reference.tie_down, pair.shared.tie_down);
    ASSERT_EQ(pair.reference.area, pair.shared.area);
    const PixelRect box = pixel_bounds(pair.reference, {-(1 << 21), -(1 << 21), 1 << 21, 1 << 21});
    if (box.empty()) continue;
    ASSERT_EQ(box.u0, glsl::raster_first_pixel(static_cast<int>(std::min(
                          {pair.reference.u[0], pair.reference.u[1], pair.reference.u[2]}))));
    ASSERT_EQ(box.u1, glsl::raster_end_pixel(static_cast<int>(std::max(
                          {pair.reference.u[0], pair.reference.u[1], pair.reference.u[2]}))));
    for (int pixel = 0; pixel < 20; ++pixel) {
      const int u = between(random, box.u0, box.u1 - 1), v = between(random, box.v0, box.v1 - 1);
      const int u0 = between(random, std::max(box.u0, u - (1 << 16)), u);
      const int v0 = between(random, std::max(box.v0, v - (1 << 16)), v);
      bool covered = false;
      ASSERT_TRUE(same_at(pair, u0, v0, u, v, covered))
          << "round " << round << ": pixel " << u << ", " << v << " from " << u0 << ", " << v0;
      covered_pixels += covered ? 1 : 0;
    }
  }
  EXPECT_GT(covered_pixels, 50000u);
}

TEST(TriangleGlsl, StepsCarryExactlyOnce) {
  Random random(2);
  for (int round = 0; round < 300; ++round) {
    const std::int64_t reach = std::int64_t{1} << between(random, 6, 16);
    glm::ivec3 p[3];
    for (auto& q : p) {
      q = {between(random, 0, reach), between(random, 0, reach), between(random, 0, 1 << 24)};
    }
    const Pair pair = set_up(p, Axis::kZ);
    if (!pair.covers_reference) continue;
    const auto area = static_cast<std::uint64_t>(pair.shared.area);
    const auto by_u = glsl::raster_depth_along_u(pair.shared);
    const auto by_v = glsl::raster_depth_along_v(pair.shared);
    auto row = glsl::raster_depth_at(pair.shared, 0, 0);
    for (int v = 0; v < 20; ++v) {
      auto at = row;
      for (int u = 0; u < 20; ++u) {
        ASSERT_LT(at.remainder, area);
        ASSERT_EQ(at.quotient, static_cast<std::uint32_t>(exact_depth(pair.reference, u, v) -
                                                          pair.reference.w0));
        glsl::raster_step(at, by_u, area);
      }
      glsl::raster_step(row, by_v, area);
    }
  }
}

TEST(TriangleGlsl, DepthIsClampedNotDropped) {
  EXPECT_EQ(glsl::raster_depth(-5, 3, 100), 0u);
  EXPECT_EQ(glsl::raster_depth(-5, 6, 100), 1u);
  EXPECT_EQ(glsl::raster_depth(1000, 6, 100), 99u);
  EXPECT_EQ(glsl::raster_depth(10, ~0u, 1u << 24), 9u);
}

}  // namespace
}  // namespace strata
