// Colours of curved faces, found for many pixels at once, against one pixel after another.

#include "csg/picture/curved_colours.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <random>
#include <vector>

#include "tests/support/simd_targets.h"

namespace strata::csg {
namespace {

/// The normal at a pixel: the mean of the corners' normals by the shares that are positive.
glm::dvec3 normal_at(const CurvedFace& face, int u, int v) {
  const glm::dvec3 at(u + 0.5, v + 0.5, 1.0);
  glm::dvec3 normal(0.0);
  for (std::size_t c = 0; c < 3; ++c) {
    normal += std::max(0.0, glm::dot(face.shares[c], at)) * face.normals[c];
  }
  return normal;
}

class CurvedColours : public ::testing::Test {
 protected:
  double number(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  glm::dvec3 point(double size) {
    return {number(-size, size), number(-size, size), number(-size, size)};
  }
  /// A face of which some pixels between 0 and 200 are inside, some outside.
  CurvedFace some_face() {
    CurvedFace face;
    for (auto& share : face.shares) share = {number(-1, 1), number(-1, 1), number(-100, 100)};
    const glm::dvec3 towards = glm::normalize(point(1));
    for (auto& normal : face.normals) normal = glm::normalize(towards + point(0.4));
    return face;
  }

  std::mt19937 random_{5};
};

TEST_F(CurvedColours, AreThoseOfSinglePixelsOnEachTarget) {
  std::size_t seen = 0, refused = 0;
  testkit::for_each_simd_target([&](const std::string& target) {
    for (int round = 0; round < 2000; ++round) {
      const CurvedFace face = some_face();
      const StudioLights lights{glm::vec3(glm::normalize(point(1)))};
      const glm::vec3 base = glm::vec3(point(0.6)) + 0.5f;
      const int u = static_cast<int>(number(0, 200)), v = static_cast<int>(number(0, 200));
      std::array<float, kCurvedPixels> open;
      for (float& one : open) one = number(0, 1) < 0.5 ? 1.0f : static_cast<float>(number(0, 1));
      std::vector<Rgba> pixels(static_cast<std::size_t>(number(1, kCurvedPixels + 0.99)));
      if (!curved_colours(face, base, lights, u, v, open, pixels)) {
        // The pixels of a vector that begins within these; it may be longer.
        bool none = false;
        for (int i = 0; i < static_cast<int>(kCurvedPixels); ++i) {
          none = none || !(glm::length(normal_at(face, u + i, v)) > 0);
        }
        EXPECT_TRUE(none) << target << ", round " << round;
        ++refused;
        continue;
      }
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        const glm::dvec3 normal = normal_at(face, u + static_cast<int>(i), v);
        ASSERT_GT(glm::length(normal), 0.0) << target << ", round " << round;
        const glm::vec3 colour =
            shaded(base, lights.on(glm::vec3(normal / glm::length(normal))), open[i]);
        const glm::vec3 bytes = glm::clamp(colour, 0.0f, 1.0f) * 255.0f + 0.5f;
        ASSERT_EQ(pixels[i], Rgba(glm::u8vec3(bytes), 255)) << target << ", round " << round;
        ++seen;
      }
    }
  });
  EXPECT_GT(seen, 10000u);
  EXPECT_GT(refused, 100u);
}

}  // namespace
}  // namespace strata::csg
