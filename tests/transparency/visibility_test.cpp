// The laws of visibility functions: what is exact, what never lies on which side, and that more
// words help.

#include "transparency/stream/visibility.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace strata::transparency {
namespace {

struct Occluder {
  float depth, opacity;
};

std::vector<Occluder> random_occluders(int count, unsigned seed, float most_opacity = 0.6f) {
  std::mt19937 random(seed);
  std::vector<Occluder> all;
  for (int i = 0; i < count; ++i) {
    all.push_back({static_cast<float>(random() % 16777216),
                   most_opacity * static_cast<float>(random() % 1000) / 1000.0f});
  }
  return all;
}

/// The product over all occluders strictly in front.
double exact(const std::vector<Occluder>& occluders, double depth) {
  double through = 1.0;
  for (const Occluder& o : occluders) {
    if (static_cast<double>(o.depth) < depth) through *= 1.0 - static_cast<double>(o.opacity);
  }
  return through;
}

template <class Kind>
class Map {
 public:
  Map(const Kind& kind, const std::vector<Occluder>& occluders)
      : kind_(kind), words_(kind.words()) {
    kind_.clear(words_.data());
    for (const Occluder& o : occluders)
      merged_ += kind_.add(words_.data(), o.depth, o.opacity).merged;
    kind_.finish(words_.data());
  }
  [[nodiscard]] double at(float depth) const {
    return static_cast<double>(kind_.transmittance(words_.data(), depth));
  }
  [[nodiscard]] double total() const { return static_cast<double>(kind_.total(words_.data())); }
  [[nodiscard]] int merged() const { return merged_; }

 private:
  Kind kind_;
  std::vector<typename Kind::Word> words_;
  int merged_ = 0;
};

constexpr float kFar = 16777215.0f;

template <class Kind>
void expect_one_occluder(const Kind& kind) {
  for (const float opacity : {0.0f, 0.3f, 1.0f}) {
    const Map<Kind> map(kind, {{5e6f, opacity}});
    const double through = 1.0 - static_cast<double>(opacity);
    EXPECT_EQ(map.at(0.0f), 1.0);
    EXPECT_EQ(map.at(5e6f), 1.0) << "an occluder shades itself";
    EXPECT_NEAR(map.at(kFar), through, 1e-6);
    EXPECT_NEAR(map.total(), through, 1e-6);
    if (opacity == 1.0f) {
      EXPECT_EQ(map.total(), 0.0);
    }
  }
  const Map<Kind> none(kind, {});
  EXPECT_EQ(none.at(kFar), 1.0);
  EXPECT_EQ(none.total(), 1.0);
}

TEST(Visibility, OneOccluderIsExact) {
  expect_one_occluder(OpacityShadowMap(16));
  expect_one_occluder(OccupancyMap(64));
  expect_one_occluder(AdaptiveNodes(1));
  expect_one_occluder(AdaptiveNodes(8));
}

/// The mean of |T - exact T| at the occluders.
template <class Kind>
double mean_error(const Kind& kind) {
  double sum = 0.0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    const auto occluders = random_occluders(20, seed);
    const Map<Kind> map(kind, occluders);
    EXPECT_NEAR(map.total(), exact(occluders, 1e9), 1e-5);
    double last = 1.0;
    for (float depth = 0.0f; depth < kFar; depth += 65537.0f) {
      const double here = map.at(depth);
      EXPECT_LE(here, 1.0);
      EXPECT_GE(here, 0.0);
      if constexpr (!std::is_same_v<Kind, FourierOpacityMap>) {
        EXPECT_LE(here, last + 1e-6) << "T grows at " << depth;
      }
      last = here;
    }
    for (const Occluder& o : occluders) {
      sum += std::abs(map.at(o.depth) - exact(occluders, static_cast<double>(o.depth)));
    }
  }
  return sum / (40 * 20);
}

TEST(Visibility, MoreWordsAreMoreExact) {
  const double slices[] = {mean_error(OpacityShadowMap(4)), mean_error(OpacityShadowMap(16)),
                           mean_error(OpacityShadowMap(256))};
  EXPECT_LT(slices[1], 0.6 * slices[0]);
  EXPECT_LT(slices[2], 0.3 * slices[1]);
  EXPECT_LT(mean_error(OccupancyMap(128)), mean_error(OccupancyMap(32)));
  EXPECT_LT(mean_error(FourierOpacityMap(7)), mean_error(FourierOpacityMap(2)));
  const double nodes[] = {mean_error(AdaptiveNodes(2)), mean_error(AdaptiveNodes(6)),
                          mean_error(AdaptiveNodes(12)), mean_error(AdaptiveNodes(20))};
  EXPECT_LT(nodes[1], 0.6 * nodes[0]);
  EXPECT_LT(nodes[2], 0.6 * nodes[1]);
  EXPECT_LT(nodes[3], 1e-6);
}

TEST(Visibility, AdaptiveNodesAreNeverTooBright) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    const auto occluders = random_occluders(30, seed);
    const Map<AdaptiveNodes> map(AdaptiveNodes(5), occluders);
    EXPECT_EQ(map.merged(), 25);
    for (float depth = 0.0f; depth < kFar; depth += 131101.0f) {
      ASSERT_LE(map.at(depth), exact(occluders, static_cast<double>(depth)) + 1e-6);
    }
  }
}

TEST(Visibility, TheNodeOfTheLeastAreaGoes) {
  // Areas: (20 - 10) * (.5 - .4) = 1 for the second, (40 - 20) * (.4 - .2) = 4 for the third.
  const Map<AdaptiveNodes> map(AdaptiveNodes(2), {{10, 0.5f}, {20, 0.2f}, {40, 0.5f}});
  EXPECT_NEAR(map.at(15), 0.4, 1e-6);  // the exact value is 0.5
  EXPECT_NEAR(map.at(30), 0.4, 1e-6);
  EXPECT_NEAR(map.at(41), 0.2, 1e-6);
}

TEST(Visibility, OccludersAtOneDepthDoNotShadeOneAnother) {
  const std::vector<Occluder> occluders{{100, 0.5f}, {100, 0.5f}, {200, 0.5f}};
  const Map<AdaptiveNodes> map(AdaptiveNodes(2), occluders);
  EXPECT_EQ(map.at(100), 1.0);
  EXPECT_EQ(map.at(200), 0.25);
  EXPECT_EQ(map.total(), 0.125);
}

TEST(Visibility, SlicesAreExactAtTheirBorders) {
  const auto occluders = random_occluders(50, 3, 0.2f);
  const Map<OpacityShadowMap> map(OpacityShadowMap(8), occluders);
  for (int i = 0; i < 8; ++i) {
    const float border = static_cast<float>(i << 21);
    EXPECT_NEAR(map.at(border), exact(occluders, static_cast<double>(border)), 1e-6);
  }
}

TEST(Visibility, EqualOccludersInSlicesOfTheirOwnAreExact) {
  std::vector<Occluder> occluders;
  for (const int slice : {3, 4, 17, 31, 32, 50, 63}) {
    occluders.push_back({static_cast<float>(slice << 18), 0.25f});
  }
  const Map<OccupancyMap> map(OccupancyMap(64), occluders);
  for (int slice = 0; slice < 64; ++slice) {
    const float depth = static_cast<float>((slice << 18) + 5);
    EXPECT_NEAR(map.at(depth), exact(occluders, static_cast<double>(slice << 18)), 1e-6);
  }
}

TEST(Visibility, OneFourierTermGivesTheFormula) {
  // An absorbance A at a quarter of the range: its integral up to the middle is A (1/2 + 2 / pi).
  const float opacity = 0.3f;
  const Map<FourierOpacityMap> map(FourierOpacityMap(1, {0.0f, 8.0f}), {{2.0f, opacity}});
  const double absorbance = -std::log(1.0 - static_cast<double>(opacity));
  EXPECT_NEAR(map.at(4.0f), std::exp(-absorbance * (0.5 + 2.0 / 3.14159265358979)), 1e-6);
  EXPECT_NEAR(map.at(8.0f), 0.7, 1e-6);
}

TEST(Visibility, DepthsOutsideTheRangeAreItsEnds) {
  const DepthRange range{10.0f, 20.0f};
  const Map<OpacityShadowMap> map(OpacityShadowMap(10, range), {{5.0f, 0.5f}, {25.0f, 0.5f}});
  EXPECT_EQ(map.at(-100.0f), 1.0);
  EXPECT_NEAR(map.at(11.5f), 0.5, 1e-6);
  EXPECT_NEAR(map.at(1000.0f), 0.5, 1e-6);
  EXPECT_NEAR(map.total(), 0.25, 1e-6);
}

}  // namespace
}  // namespace strata::transparency
