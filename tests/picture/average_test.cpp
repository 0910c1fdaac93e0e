// Samples to pixels, and what lies behind them.

#include "picture/average.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "strata/picture/backdrop.h"

namespace strata {
namespace {

/// Premultiplied: alpha 0, 255 and between, and runs that are equal.
std::vector<Rgba> random_samples(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Rgba> samples;
  while (samples.size() < count) {
    const auto alpha = static_cast<unsigned>(random() % 3 == 0   ? 0
                                             : random() % 2 == 0 ? 255
                                                                 : random() % 256);
    const auto part = [&] { return static_cast<std::uint8_t>(random() % (alpha + 1)); };
    const Rgba colour(part(), part(), part(), alpha);
    for (auto run = random() % 12; run > 0 && samples.size() < count; --run) {
      samples.push_back(colour);
    }
  }
  return samples;
}

TEST(Average, IsTheMeanOverTheBackground) {
  constexpr int kWidth = 64;
  for (const auto& [across, down] : {std::pair(1, 1), {2, 1}, {2, 2}, {4, 2}, {4, 4}, {8, 8}}) {
    for (const Rgba background : {Rgba(0), Rgba(255, 255, 229, 255), Rgba(1, 2, 3, 255)}) {
      const auto stride = static_cast<std::size_t>(kWidth * across);
      const auto samples =
          random_samples(stride * static_cast<std::size_t>(down), static_cast<unsigned>(across));
      std::vector<Rgba> pixels(kWidth);
      const auto seen = average_row(samples.data(), stride, across, down, background, pixels);
      std::uint64_t expected_seen = 0;
      for (int u = 0; u < kWidth; ++u) {
        double sum[4] = {};
        for (int y = 0; y < down; ++y) {
          for (int x = 0; x < across; ++x) {
            const Rgba& one = samples[static_cast<std::size_t>(y) * stride +
                                      static_cast<std::size_t>(u * across + x)];
            for (int c = 0; c < 4; ++c) sum[c] += one[c];
          }
        }
        for (double& one : sum) one /= across * down;
        expected_seen += sum[3] > 0 ? 1 : 0;
        const Rgba& pixel = pixels[static_cast<std::size_t>(u)];
        for (int c = 0; c < 3; ++c) {
          const double over = sum[c] + background[c] * (255 - sum[3]) / 255;
          const double straight = sum[3] > 0 ? sum[c] * 255 / sum[3] : 0.0;
          ASSERT_NEAR(pixel[c], background.a == 0 ? straight : over, 0.51) << across << down << u;
        }
        ASSERT_NEAR(pixel.a, background.a == 0 ? sum[3] : 255.0, 0.51);
      }
      EXPECT_EQ(seen, expected_seen);
    }
  }
}

TEST(Backdrop, AGradientGoesFromTheFirstRowToTheLast) {
  const Backdrop backdrop{{200, 100, 0, 255}, {100, 200, 0, 255}};
  EXPECT_EQ(backdrop.at(0, 101), backdrop.top);
  EXPECT_EQ(backdrop.at(100, 101), backdrop.bottom);
  EXPECT_EQ(backdrop.at(25, 101), Rgba(175, 125, 0, 255));
  EXPECT_EQ(backdrop.at(0, 1), backdrop.top);
  EXPECT_TRUE(Backdrop{}.transparent());
  const Backdrop grey = gradient_backdrop({100, 150, 200});
  EXPECT_FALSE(grey.transparent());
  for (int c = 0; c < 3; ++c) {
    EXPECT_GT(grey.top[c], grey.bottom[c]);
  }
}

TEST(Backdrop, LiesBehindAPicture) {
  Picture picture{2, 2, {{10, 20, 30, 255}, {200, 100, 0, 51}, {0, 0, 0, 0}, {9, 9, 9, 0}}};
  Picture clear = picture;
  lay_over(clear, Backdrop{});
  EXPECT_EQ(clear.pixels, picture.pixels);
  lay_over(picture, {{100, 100, 100, 255}, {50, 60, 70, 255}});
  EXPECT_EQ(picture.pixels[0], Rgba(10, 20, 30, 255));
  EXPECT_EQ(picture.pixels[1], Rgba(120, 100, 80, 255));
  EXPECT_EQ(picture.pixels[2], Rgba(50, 60, 70, 255));
  EXPECT_EQ(picture.pixels[3], Rgba(50, 60, 70, 255));
}

}  // namespace
}  // namespace strata
