// The laws of techniques that add up: what is exact, and by how much the rest is wrong.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/transparency/choices.h"
#include "transparency/sums/power_moments.h"

namespace strata::transparency {
namespace {

const std::vector<std::string> kSums = {"weighted-sum",
                                        "weighted-average",
                                        "weighted-blended",
                                        "weighted-blended:equation-7",
                                        "weighted-blended:equation-8",
                                        "weighted-blended:equation-9",
                                        "moments:4",
                                        "moments:6",
                                        "moments:8"};

TEST(Sums, OneLayerIsExact) {
  const ListedFrame frame = single_layers();
  const auto reference = oracle_picture(frame, Blending::kFrontToBack);
  for (const std::string& choice : kSums) {
    EXPECT_LE(largest_difference(render(frame, choice).image, reference), 2e-6f) << choice;
  }
}

TEST(Sums, EqualLayersAreExact) {
  for (const float opacity : {0.0f, 0.1f, 0.6f, 1.0f}) {
    const glm::vec4 colour(0.2f, 0.7f, 1.0f, opacity);
    ListedFrame frame =
        layers({colour, colour, colour, colour}, {900, 1 << 20, 5, 1 << 23}, {5, 3});
    frame.options.background = {1.0f, 0.5f, 0.0f, 1.0f};
    const auto reference = oracle_picture(frame, Blending::kFrontToBack);
    for (const std::string& choice : kSums) {
      if (choice == "weighted-sum") continue;
      EXPECT_LE(largest_difference(render(frame, choice).image, reference), 1e-5f) << choice;
    }
  }
}

TEST(Sums, TheOrderOfSubmissionDoesNotMatter) {
  ListedFrame frame = random_frame("Mixed", {70, 66}, 8.0, 1 << 24, 71);
  std::vector<Image> before;
  for (const std::string& choice : kSums) before.push_back(render(frame, choice).image);
  std::mt19937 random(2);
  std::shuffle(frame.fragments.begin(), frame.fragments.end(), random);
  for (std::size_t i = 0; i < kSums.size(); ++i) {
    // The reconstruction from moments magnifies rounding.
    const float rounding = kSums[i].find("moments") == 0 ? 5e-3f : 1e-5f;
    EXPECT_LE(largest_difference(render(frame, kSums[i]).image, before[i].pixels), rounding)
        << kSums[i];
  }
}

TEST(Sums, AWeightedSumGivesTheBackgroundANegativeWeight) {
  const glm::vec4 a{1.0f, 0.5f, 0.0f, 0.7f}, b{0.0f, 0.5f, 1.0f, 0.6f};
  ListedFrame frame = layers({a, b}, {10, 20});
  frame.options.background = {0.25f, 0.5f, 1.0f, 1.0f};
  const glm::vec4 pixel = render(frame, "weighted-sum").image.pixels[0];
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(pixel[c], 0.7 * a[c] + 0.6 * b[c] - 0.3 * frame.options.background[c], 1e-6);
  }
  // Red would be 0.7 + 0.3 * 0.4 * 0.25 with sorted layers.
  EXPECT_NEAR(pixel.r - oracle_picture(frame, Blending::kFrontToBack)[0].r, -0.105, 1e-6);
}

TEST(Sums, AWeightedAverageIsWrongByItsFormula) {
  const glm::vec4 front{1.0f, 0.0f, 0.2f, 0.8f}, back{0.0f, 1.0f, 0.6f, 0.3f};
  const double through = std::pow(1.0 - (0.8 + 0.3) / 2.0, 2.0);
  for (const bool swapped : {false, true}) {
    ListedFrame frame = layers({front, back}, {swapped ? 20u : 10u, swapped ? 10u : 20u});
    frame.options.background = glm::vec4(1.0f);
    const glm::vec4 pixel = render(frame, "weighted-average").image.pixels[0];
    const glm::vec4 exact = oracle_picture(frame, Blending::kFrontToBack)[0];
    const glm::vec4 &near = swapped ? back : front, &far = swapped ? front : back;
    for (int c = 0; c < 3; ++c) {
      const double average = (0.8 * front[c] + 0.3 * back[c]) / 1.1;
      const double sorted =
          static_cast<double>(near.a * near[c] + (1 - near.a) * far.a * far[c]) + 0.2 * 0.7;
      const double error = average * (1.0 - through) + through - sorted;
      EXPECT_NEAR(pixel[c] - exact[c], error, 1e-6);
    }
    EXPECT_GT(std::abs(pixel.r - exact.r), 0.05f);
  }
}

TEST(Sums, WeightedBlendingUsesTheWeightsOfThePaper) {
  const glm::vec4 c[2] = {{1.0f, 0.25f, 0.0f, 0.4f}, {0.0f, 0.5f, 1.0f, 0.9f}};
  const std::uint32_t depths[2] = {1u << 20, 3u << 21};
  const ListedFrame frame = layers({c[0], c[1]}, {depths[0], depths[1]});
  const auto weight = [&](int equation, double d) {
    const double z = 0.1 + 499.9 * d;
    const double w = equation == 7   ? 10 / (1e-5 + std::pow(z / 5, 2) + std::pow(z / 200, 6))
                     : equation == 8 ? 10 / (1e-5 + std::pow(z / 10, 3) + std::pow(z / 200, 6))
                     : equation == 9 ? 0.03 / (1e-5 + std::pow(z / 200, 4))
                                     : 3e3 * std::pow(1 - d, 3);
    return std::max(1e-2, std::min(3e3, w));
  };
  std::vector<float> reds;
  for (const int equation : {7, 8, 9, 10}) {
    double sums[4] = {0, 0, 0, 0};
    for (int i = 0; i < 2; ++i) {
      const double w = static_cast<double>(c[i].a) * weight(equation, depths[i] / 16777216.0);
      for (int k = 0; k < 3; ++k) sums[k] += static_cast<double>(c[i][k] * c[i].a) * w;
      sums[3] += static_cast<double>(c[i].a) * w;
    }
    const glm::vec4 pixel =
        render(frame, "weighted-blended:equation-" + std::to_string(equation)).image.pixels[0];
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(pixel[k], sums[k] / sums[3] * (1 - 0.6 * 0.1), 1e-5);
    EXPECT_NEAR(pixel.a, 1 - 0.6 * 0.1, 1e-6);
    for (const float red : reds) EXPECT_GT(std::abs(red - pixel.r), 1e-3f);
    reds.push_back(pixel.r);
  }
}

/// Masses at depths in [-1, 1], and their moments.
struct Masses {
  std::vector<double> depths, masses;

  [[nodiscard]] std::vector<float> moments(std::size_t count) const {
    std::vector<float> all(count);
    for (std::size_t k = 0; k < count; ++k) {
      double sum = 0.0;
      for (std::size_t i = 0; i < depths.size(); ++i) {
        sum += masses[i] * std::pow(depths[i], static_cast<double>(k));
      }
      all[k] = static_cast<float>(sum);
    }
    return all;
  }
  [[nodiscard]] double share_before(double depth, bool with_own) const {
    double before = 0.0, all = 0.0;
    for (std::size_t i = 0; i < depths.size(); ++i) {
      all += masses[i];
      if (depths[i] < depth || (with_own && depths[i] == depth)) before += masses[i];
    }
    return before / all;
  }
};

Masses random_masses(std::size_t count, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Masses all;
  for (std::size_t i = 0; i < count; ++i) {
    all.depths.push_back(2.0 * unit(random) - 1.0);
    all.masses.push_back(0.05 + unit(random));
  }
  return all;
}

template <std::size_t kHalf>
void expect_bounds() {
  std::mt19937 random(81);
  double width = 0.0;
  int places = 0;
  for (int i = 0; i < 300; ++i) {
    const Masses masses = random_masses(5 + random() % 20, random);
    const auto moments = masses.moments(2 * kHalf + 1);
    const PowerMoments<kHalf> power(moments.data());
    for (double depth = -0.95; depth < 1.0; depth += 0.1) {
      const auto shares = power.shares(depth);
      // The bias moves the measure a little.
      EXPECT_GE(masses.share_before(depth, true), shares.least - 0.005);
      EXPECT_LE(masses.share_before(depth, false), shares.least + shares.own + 0.005);
      width += shares.own;
      ++places;
    }
  }
  EXPECT_LT(width / places, kHalf == 2 ? 0.5 : kHalf == 3 ? 0.35 : 0.3);
  EXPECT_GT(width / places, 0.1);
}

TEST(PowerMoments, BoundEveryMeasureThatHasThem) {
  expect_bounds<2>();
  expect_bounds<3>();
  expect_bounds<4>();
}

template <std::size_t kHalf>
void expect_few_masses_found() {
  std::mt19937 random(82);
  for (int i = 0; i < 100; ++i) {
    Masses masses;  // at least 0.3 apart
    for (std::size_t n = 0; n < kHalf; ++n) {
      masses.depths.push_back(-0.8 + 0.45 * static_cast<double>(n) +
                              0.1 * static_cast<double>(random() % 100) / 100.0);
      masses.masses.push_back(0.3 + static_cast<double>(random() % 100) / 100.0);
    }
    const auto moments = masses.moments(2 * kHalf + 1);
    const PowerMoments<kHalf> power(moments.data());
    for (std::size_t n = 0; n < kHalf; ++n) {
      const double depth = masses.depths[n];
      EXPECT_NEAR(power.share_before(depth + 0.15), masses.share_before(depth + 0.15, false), 0.03);
      const double before = masses.share_before(depth, false),
                   own = masses.share_before(depth, true) - before;
      EXPECT_NEAR(power.share_before(depth), before + 0.25 * own, 0.05);
    }
  }
}

TEST(PowerMoments, FindAsManyMassesAsHalfTheMoments) {
  expect_few_masses_found<2>();
  expect_few_masses_found<3>();
  expect_few_masses_found<4>();
}

TEST(Sums, MoreMomentsAreMoreExact) {
  const double average = mean_square("weighted-average");
  const double four = mean_square("moments:4"), six = mean_square("moments:6"),
               eight = mean_square("moments:8");
  EXPECT_LT(four, 0.5 * average);
  EXPECT_LT(six, 0.9 * four);
  EXPECT_LT(eight, 0.9 * six);
  // Weights by depth help, where the view's depths are spread over their range.
  EXPECT_LT(mean_square("weighted-blended"), 0.9 * average);
}

TEST(Sums, OnlyFourSixOrEightMomentsAreTaken) {
  const ListedFrame frame = single_layers();
  auto made = Frame::make(frame.fragments, frame.colours, frame.options);
  ASSERT_TRUE(made);
  Settings settings;
  settings.k = 5;
  const auto rendering = made->render(**find_technique("moments"), settings);
  ASSERT_FALSE(rendering);
  EXPECT_EQ(rendering.error().code, ErrorCode::kUsage);
  EXPECT_NE(rendering.error().message.find("got 5"), std::string::npos);
}

TEST(Sums, MemoryIsTheFormulaAndDoesNotGrowWithFragments) {
  for (const double mean : {0.5, 8.0}) {
    const ListedFrame frame = random_frame("Mixed", {130, 70}, mean, 1 << 24, 72);
    for (const auto& [choice, bytes, passes] :
         {std::tuple("weighted-sum", 16u, 1u), std::tuple("weighted-average", 20u, 1u),
          std::tuple("weighted-blended", 20u, 1u), std::tuple("moments:4", 24u, 2u),
          std::tuple("moments:8", 40u, 2u)}) {
      const Costs costs = render(frame, choice).costs;
      EXPECT_EQ(costs.formula_bytes, bytes * 130 * 70) << choice;
      EXPECT_EQ(costs.allocated_bytes, costs.formula_bytes) << choice;
      EXPECT_EQ(costs.geometry_passes, passes) << choice;
      EXPECT_EQ(costs.shaded, frame.fragments.size()) << choice;
      EXPECT_EQ(costs.lost, 0u) << choice;
    }
  }
}

}  // namespace
}  // namespace strata::transparency
