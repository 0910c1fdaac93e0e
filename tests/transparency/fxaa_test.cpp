// The filter of finished pictures: what it leaves alone, what it blends, what it cannot do.

#include "strata/transparency/media/fxaa.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace strata::transparency {
namespace {

template <class Colour>
Image make_image(int width, int height, const Colour& colour) {
  Image image{width, height, {}};
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) image.pixels.push_back(colour(u, v));
  }
  return image;
}

const glm::vec4 kDark{0.1f, 0.2f, 0.1f, 1.0f}, kLight{0.9f, 0.7f, 1.0f, 1.0f};

/// The part of pixel (u, v) that lies below the line v = a + b u; `samples` squared samples.
double covered(int u, int v, double a, double b, int samples) {
  int below = 0;
  for (int i = 0; i < samples * samples; ++i) {
    const double x = u + (i % samples + 0.5) / samples, y = v + (i / samples + 0.5) / samples;
    below += y > a + b * x ? 1 : 0;
  }
  return static_cast<double>(below) / (samples * samples);
}

double error(const Image& image, const Image& reference) {
  double sum = 0.0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    for (int c = 0; c < 3; ++c) sum += std::pow(image.pixels[i][c] - reference.pixels[i][c], 2);
  }
  return std::sqrt(sum / static_cast<double>(3 * image.pixels.size()));
}

TEST(Fxaa, LeavesAConstantPictureAsItIs) {
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(2, 1), std::pair(33, 17)}) {
    const Image image = make_image(width, height, [](int, int) { return kLight; });
    EXPECT_EQ(fxaa(image).pixels, image.pixels);
  }
  const Image faint = make_image(20, 20, [](int u, int) {
    return u < 10 ? glm::vec4(0.5f, 0.5f, 0.5f, 1.0f) : glm::vec4(0.51f, 0.51f, 0.51f, 1.0f);
  });
  EXPECT_EQ(fxaa(faint).pixels, faint.pixels);
}

TEST(Fxaa, BringsSlantedEdgesNearerToTheirCoverage) {
  for (const double slope : {0.1, 0.25, 0.4, -0.15, -0.3}) {
    for (const bool turned : {false, true}) {
      const auto picture = [&](int samples) {
        return make_image(64, 64, [&](int u, int v) {
          if (turned) std::swap(u, v);
          const auto part = static_cast<float>(covered(u, v, 32.3 - 32 * slope, slope, samples));
          return (1.0f - part) * kDark + part * kLight;
        });
      };
      const Image sharp = picture(1), reference = picture(16);
      const Image filtered = fxaa(sharp);
      EXPECT_LT(error(filtered, reference), 0.6 * error(sharp, reference)) << slope << turned;
    }
  }
}

TEST(Fxaa, BlendsTheEdgeOfWhatIsDrawnOverNothing) {
  const Image sharp = make_image(40, 40, [](int u, int v) {
    return covered(u, v, 15.2, 0.2, 1) > 0.5 ? glm::vec4(0, 0, 0, 1) : glm::vec4(0.0f);
  });
  const Image filtered = fxaa(sharp);
  int blended = 0;
  for (const glm::vec4& pixel : filtered.pixels) blended += pixel.a > 0.05f && pixel.a < 0.95f;
  EXPECT_GT(blended, 20);
}

TEST(Fxaa, StaysBetweenNeighbours) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0.0f, 1.0f);
  const Image image = make_image(50, 41, [&](int, int) {
    return glm::vec4(unit(random), unit(random), unit(random), unit(random));
  });
  const Image filtered = fxaa(image);
  int changed = 0;
  for (int v = 0; v < 41; ++v) {
    for (int u = 0; u < 50; ++u) {
      glm::vec4 low(9.0f), high(-9.0f);
      for (int k = 0; k < 9; ++k) {
        const int x = std::clamp(u + k % 3 - 1, 0, 49), y = std::clamp(v + k / 3 - 1, 0, 40);
        const glm::vec4& near = image.pixels[static_cast<std::size_t>(y * 50 + x)];
        low = glm::min(low, near), high = glm::max(high, near);
      }
      const glm::vec4& pixel = filtered.pixels[static_cast<std::size_t>(v * 50 + u)];
      for (int c = 0; c < 4; ++c) {
        ASSERT_GE(pixel[c], low[c] - 1e-6f);
        ASSERT_LE(pixel[c], high[c] + 1e-6f);
      }
      changed += pixel != image.pixels[static_cast<std::size_t>(v * 50 + u)] ? 1 : 0;
    }
  }
  EXPECT_GT(changed, 1000);
  for (const int threads : {1, 3}) {
    Execution execution;
    execution.threads = threads;
    EXPECT_EQ(fxaa(image, {}, execution).pixels, filtered.pixels);
  }
}

}  // namespace
}  // namespace strata::transparency
