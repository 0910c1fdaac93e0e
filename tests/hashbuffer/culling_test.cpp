// Opacity culling and K nearest (techniques.md H15, H16): what is dropped was invisible.

#include <gtest/gtest.h>

#include <cmath>

#include "strata/hashbuffer/hash_buffer.h"
#include "tests/hashbuffer/store_support.h"

namespace strata {
namespace {

using test::Fragment;
using test::random_fragments;
using test::sort_everything;
using test::Submission;
using test::submit;

/// The low 8 bits of a payload, over 255.
double opacity_of(std::uint32_t payload) { return (payload & 0xff) / 255.0; }

/// opacity_of(), and that from a table, as a caller with materials has it.
struct OpacityTable {
  std::vector<double> of_low_bits;
  double operator()(std::uint32_t payload) const { return of_low_bits[payload & 0xff]; }
};
OpacityTable opacity_table() {
  OpacityTable table;
  for (std::uint32_t low = 0; low < 256; ++low) table.of_low_bits.push_back(opacity_of(low));
  return table;
}

template <class Form, class Opacity = NoOpacity>
HashBuffer<Record64, Form, Opacity> make(int width, int height, const HashBufferOptions& options,
                                         Opacity opacity = {}) {
  auto buffer =
      HashBuffer<Record64, Form, Opacity>::create(width, height, options, std::move(opacity));
  if (!buffer) throw std::runtime_error(buffer.error().message);
  return std::move(*buffer);
}

/// Each list cut behind the fragment that brings its transmittance below 1 - threshold.
LayeredDepthImage cut_at_opacity(const LayeredDepthImage& image, double threshold) {
  LayeredDepthImage result = image;
  result.items.clear();
  for (std::size_t pixel = 0; pixel + 1 < image.offsets.size(); ++pixel) {
    double transmittance = 1.0;
    for (std::uint64_t i = image.offsets[pixel]; i < image.offsets[pixel + 1]; ++i) {
      if (transmittance < 1.0 - threshold) break;
      result.items.push_back(image.items[i]);
      transmittance *= 1.0 - opacity_of(image.items[i].payload());
    }
    result.offsets[pixel + 1] = result.items.size();
  }
  return result;
}

/// Sum of opacity times colour, front to back; the colour is bits 8 to 15 of the payload.
double composite(std::span<const DepthItem> list) {
  double colour = 0.0, transmittance = 1.0;
  for (const DepthItem item : list) {
    const double opacity = opacity_of(item.payload());
    colour += transmittance * opacity * ((item.payload() >> 8 & 0xff) / 255.0);
    transmittance *= 1.0 - opacity;
  }
  return colour;
}

TEST(Culling, IsOffByDefault) {
  const HashBufferOptions options;
  EXPECT_EQ(options.keep_nearest, 0u);
  EXPECT_FALSE((HashBuffer<Record64, Exclusive>::kHasOpacity));
}

// Erratum E3: the printed culling counts a record twice when another thread pushes it on.
TEST(Culling, E3ListsAreTheVisiblePartForAnyOrderAndThreads) {
  Random random(41);
  for (int scene = 0; scene < 60; ++scene) {
    const double threshold = 0.5 + 0.49 * static_cast<double>(random.below(100)) / 100.0;
    auto fragments = random_fragments(random, 9, 5, 700, 200);
    const LayeredDepthImage visible =
        cut_at_opacity(sort_everything<Record64>(9, 5, fragments), threshold);
    for (const int threads : {1, 2, 4, 8}) {
      test::shuffle(random, fragments);
      auto buffer =
          make<Concurrent>(9, 5, {.cells = 800, .opacity_threshold = threshold}, opacity_table());
      submit(buffer, fragments, threads);
      ASSERT_EQ(buffer.failures(), 0u);
      EXPECT_EQ(buffer.stored() + buffer.dropped(), fragments.size());
      EXPECT_EQ(buffer.depth_image(Execution{.threads = 1}).value(), visible) << scene;
    }
  }
}

TEST(Culling, TheLostWeightIsBelowOneMinusTheThreshold) {
  Random random(42);
  const auto fragments = random_fragments(random, 8, 8, 2000);
  const LayeredDepthImage exact = sort_everything<Record64>(8, 8, fragments);
  auto buffer = make<Exclusive>(8, 8, {.cells = 3000}, &opacity_of);
  submit(buffer, fragments);
  const auto culled = buffer.depth_image(Execution{.threads = 1}).value();
  EXPECT_LT(culled.items.size(), exact.items.size());
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      EXPECT_LE(std::abs(composite(exact.list(x, y)) - composite(culled.list(x, y))), 0.01);
    }
  }
}

TEST(Culling, SequentiallyFrontToBackStoresLittleAndMoreOpacityNeverMore) {
  Random random(43);
  auto fragments = random_fragments(random, 8, 8, 2000);
  for (Fragment& fragment : fragments) fragment.payload = fragment.payload & ~0xffu;
  const auto stored_with = [&](std::uint32_t opacity, double threshold) {
    auto submitted = fragments;
    for (Fragment& fragment : submitted) fragment.payload |= opacity;
    auto buffer =
        make<Exclusive>(8, 8, {.cells = 100 * 64, .opacity_threshold = threshold}, &opacity_of);
    submit(buffer, submitted);
    return buffer.stored();
  };
  std::uint64_t last = ~0ull;
  for (std::uint32_t opacity = 0; opacity < 256; opacity += 15) {
    EXPECT_LE(stored_with(opacity, 0.9), last);
    last = stored_with(opacity, 0.9);
  }
  last = 0;
  for (const double threshold : {0.1, 0.5, 0.9, 0.99, 0.999}) {
    EXPECT_GE(stored_with(60, threshold), last);
    last = stored_with(60, threshold);
  }
  std::sort(fragments.begin(), fragments.end(),
            [](const Fragment& a, const Fragment& b) { return a.depth < b.depth; });
  EXPECT_EQ(stored_with(255, 0.9), 64u);  // opaque, front to back: a z-buffer
  std::reverse(fragments.begin(), fragments.end());
  EXPECT_EQ(stored_with(0, 0.9), 2000u);
}

TEST(KeepNearest, EqualsTheExactListsCutToTheirFirstItems) {
  Random random(44);
  for (int scene = 0; scene < 40; ++scene) {
    const auto keep = static_cast<unsigned>(1 + random.below(6));
    auto fragments = random_fragments(random, 7, 6, 600, scene % 2 == 0 ? 4 : 1 << 24, 3);
    const LayeredDepthImage nearest =
        test::cut_lists(sort_everything<Record64>(7, 6, fragments), keep);
    for (const int threads : {1, 2, 4, 8}) {
      test::shuffle(random, fragments);
      auto buffer = make<Concurrent>(7, 6, {.cells = 700, .keep_nearest = keep});
      submit(buffer, fragments, threads);
      ASSERT_EQ(buffer.failures(), 0u);
      EXPECT_EQ(buffer.depth_image(Execution{.threads = 1}).value(), nearest) << scene;
    }
  }
}

TEST(KeepNearest, StoresFarFewerThanItIsGiven) {
  Random random(45);
  auto fragments = random_fragments(random, 8, 8, 6400);
  auto buffer = make<Exclusive>(8, 8, {.keep_nearest = 4});
  const auto report = build(buffer, Submission(fragments));
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_LT(report->fragments, 6400u / 4);
  EXPECT_EQ(buffer.depth_image().value(),
            test::cut_lists(sort_everything<Record64>(8, 8, fragments), 4));
}

TEST(KeepNearest, MoreLayersThanAgesAreNoErrorWhileTheyAreDropped) {
  std::vector<Fragment> fragments;
  for (std::uint32_t i = 0; i < 5000; ++i) fragments.push_back({2, 2, i * 7919 % 5000, 0});
  auto buffer = make<Concurrent>(4, 4, {.keep_nearest = 8});
  const auto report = build(buffer, Submission(fragments, 4));
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(buffer.depth_image().value(),
            test::cut_lists(sort_everything<Record64>(4, 4, fragments), 8));
}

}  // namespace
}  // namespace strata
