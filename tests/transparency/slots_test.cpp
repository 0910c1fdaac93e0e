// Techniques with slots: what they show when the slots are enough, and by how much they are wrong,
// by their formulas, when they are not.

#include <gtest/gtest.h>

#include <cmath>

#include "strata/mesh/shapes.h"
#include "tests/transparency/listed_frames.h"
#include "tests/transparency/mesh_frames.h"

namespace strata::transparency {
namespace {

const Technique& technique(std::string_view name) {
  const auto found = find_technique(name);
  EXPECT_TRUE(found) << name;
  return **found;
}

Settings with(unsigned k, std::string variant = {}) {
  Settings settings;
  settings.k = k;
  settings.variant = std::move(variant);
  return settings;
}

using Pixels = std::map<std::pair<int, int>, std::vector<ListedFragment>>;

/// The fragments of each pixel as they come.
Pixels pixels_of(const ListedFrame& frame) {
  Pixels pixels;
  for (const ListedFragment& f : frame.fragments) pixels[{f.u, f.v}].push_back(f);
  return pixels;
}

std::vector<ListedFragment> sorted(std::vector<ListedFragment> list) {
  std::sort(list.begin(), list.end(), [](const ListedFragment& a, const ListedFragment& b) {
    return std::tie(a.depth, a.exit, a.face) < std::tie(b.depth, b.exit, b.face);
  });
  return list;
}

std::size_t deepest(const ListedFrame& frame) {
  std::size_t most = 0;
  for (const auto& [pixel, list] : pixels_of(frame)) most = std::max(most, list.size());
  return most;
}

ListedFrame with_fragments(const ListedFrame& frame, const Pixels& pixels) {
  ListedFrame some = frame;
  some.fragments.clear();
  for (const auto& [pixel, list] : pixels) {
    some.fragments.insert(some.fragments.end(), list.begin(), list.end());
  }
  return some;
}

std::vector<glm::vec4> exact_picture(const ListedFrame& frame) {
  return oracle_picture(frame, Blending::kFrontToBack);
}

/// One pixel with the given depths, in this order; the face of a fragment is its place.
ListedFrame one_pixel(const std::vector<std::uint32_t>& depths) {
  ListedFrame frame = random_frame("OnePixel", {1, 1}, 0.0, 2, 41, 0.2f, 0.8f);
  for (std::uint32_t i = 0; i < depths.size(); ++i) {
    frame.fragments.push_back({0, 0, depths[i], i, false});
  }
  return frame;
}

/// The faces of a one-pixel frame one over the other, from the front, in doubles.
glm::dvec4 over(const ListedFrame& frame, const std::vector<std::size_t>& faces) {
  glm::dvec3 sum(0.0);
  double seen = 1.0;
  for (const std::size_t face : faces) {
    const glm::dvec4 c(frame.colours[face]);
    sum += seen * c.a * glm::dvec3(c);
    seen *= 1 - c.a;
  }
  return {sum, 1 - seen};
}

void expect_pixel(const Rendering& rendering, const glm::dvec4& expected, const char* what) {
  ASSERT_EQ(rendering.image.pixels.size(), 1u);
  for (int c = 0; c < 4; ++c) {
    EXPECT_NEAR(rendering.image.pixels[0][c], expected[c], 1e-6) << what << ' ' << c;
  }
}

std::vector<ListedFrame> some_frames() {
  return {random_frame("Mixed", {70, 66}, 4.0, 1 << 24, 51),
          random_frame("Ties", {33, 20}, 6.0, 4, 52), deep_frame(120, 53),
          random_frame("Clusters", {40, 30}, 7.0, 90, 54)};
}

TEST(FreePipeSorted, KeepsTheNearestOfTheExactList) {
  for (const ListedFrame& frame : some_frames()) {
    for (const unsigned k : {1u, 2u, 3u, 8u, 20u}) {
      Pixels cut = pixels_of(frame);
      std::uint64_t lost = 0;
      for (auto& [pixel, list] : cut) {
        list = sorted(list);
        if (list.size() > k) {
          lost += list.size() - k;
          list.resize(k);
        }
      }
      const Rendering rendering = render(frame, technique("freepipe-sorted"), with(k));
      EXPECT_TRUE(same_bits(rendering.image, exact_picture(with_fragments(frame, cut))))
          << frame.name << ' ' << k;
      EXPECT_EQ(rendering.costs.lost, lost);
      EXPECT_EQ(rendering.costs.kept, frame.fragments.size() - lost);
    }
  }
}

TEST(FreePipeSorted, DoesNotDependOnTheOrderOfSubmission) {
  ListedFrame frame = random_frame("Ties", {33, 20}, 9.0, 6, 55);
  const Image image = render(frame, technique("freepipe-sorted"), with(4)).image;
  std::mt19937 random(3);
  std::shuffle(frame.fragments.begin(), frame.fragments.end(), random);
  EXPECT_TRUE(same_bits(render(frame, technique("freepipe-sorted"), with(4)).image, image.pixels));
}

TEST(FreePipeCounter, KeepsTheFirstThatCome) {
  for (const ListedFrame& frame : some_frames()) {
    for (const unsigned k : {1u, 2u, 5u, 16u}) {
      Pixels first = pixels_of(frame);
      for (auto& [pixel, list] : first) list.resize(std::min<std::size_t>(list.size(), k));
      const ListedFrame shown = with_fragments(frame, first);
      const Rendering rendering = render(frame, technique("freepipe-counter"), with(k));
      EXPECT_TRUE(same_bits(rendering.image, exact_picture(shown))) << frame.name << ' ' << k;
      EXPECT_EQ(rendering.costs.lost, frame.fragments.size() - shown.fragments.size());
      EXPECT_EQ(rendering.costs.most_layers, deepest(frame));
    }
  }
}

TEST(Slots, OverflowLosesTheFarthestOrTheLast) {
  // The nearest comes last: the counter loses it, the sorted slots lose the farthest.
  const ListedFrame frame = one_pixel({30, 20, 10});
  expect_pixel(render(frame, technique("freepipe-sorted"), with(2)), over(frame, {2, 1}), "sorted");
  expect_pixel(render(frame, technique("freepipe-counter"), with(2)), over(frame, {1, 0}),
               "counter");
  const glm::dvec4 exact = over(frame, {2, 1, 0});
  // What is lost of the light: the farthest behind two layers, the nearest behind none and before
  // all.
  const glm::dvec4 near(frame.colours[2]);
  const glm::dvec4 rest = over(frame, {1, 0});
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(exact[c] - rest[c], near.a * (near[c] - rest[c]), 1e-12);
  }
}

TEST(Slots, AreExactWhenTheyAreEnough) {
  for (const ListedFrame& frame : some_frames()) {
    const auto k = static_cast<unsigned>(deepest(frame));
    for (const char* name : {"freepipe-sorted", "freepipe-counter", "k-buffer", "z3"}) {
      const Rendering rendering = render(frame, technique(name), with(k));
      EXPECT_TRUE(same_bits(rendering.image, exact_picture(frame))) << name << ' ' << frame.name;
      EXPECT_EQ(rendering.costs.lost + rendering.costs.merged, 0u) << name;
      EXPECT_EQ(rendering.costs.formula_bytes, rendering.costs.allocated_bytes) << name;
      EXPECT_GE(rendering.costs.formula_bytes,
                8 * k * static_cast<unsigned>(frame.options.size.x * frame.options.size.y));
    }
  }
}

TEST(StencilRouted, TakesAPassForEachChunk) {
  for (const unsigned layers : {1u, 3u, 7u, 8u, 9u, 16u, 17u, 254u}) {
    ListedFrame frame = deep_frame(0, 61);
    frame.fragments.clear();
    for (unsigned i = 0; i < layers; ++i)
      frame.fragments.push_back({3, 2, 7919 * i % 1000, i % 50});
    for (const unsigned k : {1u, 3u, 8u, 32u}) {
      const Rendering rendering = render(frame, technique("stencil-routed"), with(k));
      const std::uint64_t chunks = (layers + k - 1) / k, pixels = 9 * 5;
      EXPECT_EQ(rendering.costs.geometry_passes, chunks) << layers << ' ' << k;
      EXPECT_EQ(rendering.costs.formula_bytes, (8 * chunks + 1) * k * pixels);
      EXPECT_EQ(rendering.costs.allocated_bytes, (8 * chunks * k + 1) * pixels);
      EXPECT_EQ(rendering.costs.most_layers, layers);
      EXPECT_TRUE(same_bits(rendering.image, exact_picture(frame)));
    }
  }
}

TEST(StencilRouted, DrawsInBatchesBeyondEightBits) {
  // 254 fragments of a pixel at most in a batch; with k = 8 a full batch has 32 passes.
  const std::pair<unsigned, std::uint64_t> passes[] = {{254, 32}, {255, 33}, {262, 33},
                                                       {263, 34}, {508, 64}, {590, 64 + 11}};
  for (const auto& [layers, expected] : passes) {
    ListedFrame frame = one_pixel({});
    for (unsigned i = 0; i < layers; ++i)
      frame.fragments.push_back({0, 0, 7919 * i % 1000, i % 50});
    const Rendering rendering = render(frame, technique("stencil-routed"));
    EXPECT_EQ(rendering.costs.geometry_passes, expected) << layers;
    EXPECT_TRUE(same_bits(rendering.image, exact_picture(frame))) << layers;
    EXPECT_EQ(rendering.costs.kept, layers);
  }
}

/// Depths in one pixel from 0 to 1000, and the number of those in buckets of their own.
std::size_t uniform_buckets(const std::vector<ListedFragment>& list, unsigned k) {
  std::uint32_t low = ~0u, high = 0;
  for (const ListedFragment& f : list) low = std::min(low, f.depth), high = std::max(high, f.depth);
  std::map<std::uint32_t, int> buckets;
  for (const ListedFragment& f : list) {
    const double part = high == low ? 0.0 : static_cast<double>(f.depth - low) / (high - low);
    ++buckets[std::min(k - 1, static_cast<std::uint32_t>(std::floor(k * part)))];
  }
  return buckets.size();
}

TEST(BucketSort, CollisionsAreFragmentsWithoutABucketOfTheirOwn) {
  for (const ListedFrame& frame : some_frames()) {
    for (const unsigned k : {1u, 2u, 8u, 32u}) {
      std::uint64_t collisions = 0;
      for (const auto& [pixel, list] : pixels_of(frame)) {
        collisions += list.size() - uniform_buckets(list, k);
      }
      const Costs lose = render(frame, technique("bucket-sort"), with(k)).costs;
      const Costs merge = render(frame, technique("bucket-sort"), with(k, "merge")).costs;
      EXPECT_EQ(lose.lost, collisions) << frame.name << ' ' << k;
      EXPECT_EQ(merge.merged, collisions) << frame.name << ' ' << k;
      EXPECT_EQ(lose.merged + merge.lost, 0u);
      EXPECT_EQ(lose.geometry_passes, 2u);
      EXPECT_EQ(lose.formula_bytes, lose.allocated_bytes);
      EXPECT_GT(collisions, 0u);
    }
  }
}

TEST(BucketSort, TheAdaptiveFormNeverCollidesMore) {
  for (const ListedFrame& frame : some_frames()) {
    for (unsigned k = 1; k <= 32; ++k) {
      const Costs uniform = render(frame, technique("bucket-sort"), with(k)).costs;
      const Costs adaptive = render(frame, technique("adaptive-bucket-sort"), with(k)).costs;
      EXPECT_LE(adaptive.lost, uniform.lost) << frame.name << ' ' << k;
      EXPECT_EQ(adaptive.geometry_passes, 3u);
    }
  }
  const ListedFrame mixed = random_frame("Mixed", {70, 66}, 4.0, 1 << 24, 51);
  EXPECT_LT(4 * render(mixed, technique("adaptive-bucket-sort")).costs.lost,
            render(mixed, technique("bucket-sort")).costs.lost);
}

TEST(BucketSort, IsExactWithoutCollisions) {
  ListedFrame frame = random_frame("Apart", {30, 20}, 0.0, 2, 71);
  std::mt19937 random(9);
  for (int v = 0; v < 20; ++v) {
    for (int u = 0; u < 30; ++u) {
      // Up to 14 of 32 equal parts of the pixel's range, which the first and the last give.
      frame.fragments.push_back({u, v, 0, 1});
      frame.fragments.push_back({u, v, 3200000, 2});
      for (std::uint32_t i = 1; i < 31; ++i) {
        if (random() % 5 < 2) {
          const auto within = static_cast<std::uint32_t>(random() % 90000);
          frame.fragments.push_back({u, v, i * 100000 + within, i, random() % 2 == 0});
        }
      }
    }
  }
  std::shuffle(frame.fragments.begin(), frame.fragments.end(), random);
  for (const char* name : {"bucket-sort", "adaptive-bucket-sort"}) {
    for (const char* variant : {"lose", "merge"}) {
      const Rendering rendering = render(frame, technique(name), with(32, variant));
      EXPECT_EQ(rendering.costs.lost + rendering.costs.merged, 0u);
      EXPECT_TRUE(same_bits(rendering.image, exact_picture(frame))) << name << ' ' << variant;
    }
  }
}

TEST(BucketSort, LosesAllButTheNearestOfABucketOrMergesThem) {
  // Buckets of 100: {0} and {510, 520, 530}, and {1000} in the last of ten.
  const ListedFrame frame = one_pixel({0, 530, 510, 520, 1000});
  const auto lost = render(frame, technique("bucket-sort"), with(10, "lose"));
  expect_pixel(lost, over(frame, {0, 2, 4}), "lose");
  EXPECT_EQ(lost.costs.lost, 2u);
  // 510 comes to lie before 530; 520 is not the nearest, and goes behind both.
  const auto merged = render(frame, technique("bucket-sort"), with(10, "merge"));
  expect_pixel(merged, over(frame, {0, 2, 1, 3, 4}), "merge");
  EXPECT_EQ(merged.costs.merged, 2u);
  // Ten bins in a thousand: each has its own bucket.
  expect_pixel(render(frame, technique("adaptive-bucket-sort"), with(10)),
               over(frame, {0, 2, 3, 1, 4}), "adaptive");
}

TEST(BucketSort, FurtherPassesRecoverWhatWasLost) {
  for (const ListedFrame& frame : some_frames()) {
    for (const unsigned k : {1u, 5u, 32u}) {
      for (const char* name : {"bucket-sort", "adaptive-bucket-sort"}) {
        const Rendering rendering = render(frame, technique(name), with(k, "repeat"));
        EXPECT_TRUE(same_bits(rendering.image, exact_picture(frame))) << name << k << frame.name;
        EXPECT_EQ(rendering.costs.kept, frame.fragments.size());
        EXPECT_EQ(rendering.costs.lost, 0u);
        EXPECT_EQ(rendering.costs.most_layers, deepest(frame));
      }
    }
  }
  // Three in one of ten buckets: three passes after that for the range.
  const ListedFrame frame = one_pixel({0, 530, 510, 520, 1000});
  EXPECT_EQ(render(frame, technique("bucket-sort"), with(10, "repeat")).costs.geometry_passes, 4u);
}

/// The most fragments behind it that came before a fragment.
std::size_t most_late(const std::vector<std::uint32_t>& depths) {
  std::size_t most = 0;
  for (std::size_t i = 0; i < depths.size(); ++i) {
    std::size_t late = 0;
    for (std::size_t j = 0; j < i; ++j) late += depths[j] > depths[i] ? 1 : 0;
    most = std::max(most, late);
  }
  return most;
}

TEST(KBuffer, IsExactWhereNoFragmentIsLaterThanItsEntries) {
  std::vector<std::uint32_t> depths{1, 2, 3, 4, 5, 6};
  int exact = 0, wrong = 0;
  do {
    const ListedFrame frame = one_pixel(depths);
    for (unsigned k = 1; k <= 5; ++k) {
      const Rendering rendering = render(frame, technique("k-buffer"), with(k));
      const bool right = most_late(depths) <= k;
      EXPECT_EQ(same_bits(rendering.image, exact_picture(frame)), right);
      ++(right ? exact : wrong);
    }
  } while (std::next_permutation(depths.begin(), depths.end()));
  EXPECT_GT(exact, 100);
  EXPECT_GT(wrong, 100);
}

TEST(KBuffer, OverflowBlendsTheNearestOrMergesTheTwoNearestInDepth) {
  // One entry: 30 is there, 20 is blended, then 10, which lies before it, then 30.
  const ListedFrame reversed = one_pixel({30, 20, 10});
  const auto nearest = render(reversed, technique("k-buffer"), with(1));
  expect_pixel(nearest, over(reversed, {1, 2, 0}), "nearest");
  EXPECT_EQ(nearest.costs.merged, 0u);
  // Two entries, 10 and 100: 90 goes to 100 and lies before it; 95 goes behind both.
  const ListedFrame frame = one_pixel({10, 100, 90, 95});
  const auto merged = render(frame, technique("k-buffer"), with(2, "merge"));
  expect_pixel(merged, over(frame, {0, 2, 1, 3}), "merge");
  EXPECT_EQ(merged.costs.merged, 2u);
  EXPECT_EQ(merged.costs.kept, 2u);
}

/// Two squares that cross in the line x = 0, tilted by their slopes dz/dx; red and blue.
Scene crossing_planes(double slope) {
  Scene scene;
  for (const double dz : {slope, -slope}) {
    TriangleSoup square = square_at(0);
    for (glm::dvec3& p : square.positions) p.z = dz * p.x;
    add_object(scene, square,
               scene.objects.empty() ? glm::vec4(1, 0, 0, 0.5f) : glm::vec4(0, 0, 1, 0.5f));
  }
  return scene;
}

TEST(Z3, EqualsThePictureOfAllSamplesWhereSlotsAreEnough) {
  Scene ball{make_icosphere(1.5, 3), {}, {{"ball", {0.9f, 0.4f, 0.1f, 0.4f}}}};
  for (const int samples : {1, 2, 4, 8, 16, 64}) {
    const Frame frame = frame_of(ball, flat_camera({50, 10, 30}), {37, 29}, samples);
    const Rendering exact = rendered(frame, "count-scan");
    const Rendering z3 = rendered(frame, "z3", with(256));
    EXPECT_EQ(z3.costs.merged, 0u);
    EXPECT_GT(exact.costs.fragments, 500u);
    EXPECT_TRUE(same_bits(z3.image, exact.image.pixels)) << samples;
    // A slot holds all samples that a triangle covers.
    EXPECT_LE(z3.costs.stored, exact.costs.fragments);
    if (samples == 64) {
      EXPECT_LT(8 * z3.costs.stored, exact.costs.fragments);
    }
    EXPECT_EQ(z3.costs.formula_bytes, (64u * 256 + 4) * 37 * 29);
    EXPECT_EQ(z3.costs.formula_bytes, z3.costs.allocated_bytes);
  }
}

TEST(Z3, PartsCrossingPlanesAlongTheirLine) {
  const Scene scene = crossing_planes(0.5);
  // 33 pixels: the line x = 0 goes through the middle of a column.
  const Frame frame = frame_of(scene, flat_camera({0, 0, 0}), {33, 20}, 16);
  const Rendering z3 = rendered(frame, "z3");
  EXPECT_TRUE(same_bits(z3.image, rendered(frame, "count-scan").image.pixels));
  const auto red = [&](int u) { return z3.image.pixels[static_cast<std::size_t>(7 * 33 + u)].r; };
  // On one side red is in front, on the other behind; the middle column has both by halves.
  EXPECT_NEAR(red(0) / red(32), 0.5, 1e-6);
  EXPECT_NEAR(red(15), red(0), 1e-6);
  EXPECT_NEAR(red(17), red(32), 1e-6);
  EXPECT_NEAR(red(16), (red(0) + red(32)) / 2, 1e-6);
}

TEST(Z3, OverflowMergesTheTwoNearestInDepth) {
  // One slot: 10 and 20 merge at 15, before which 12 comes to lie, though it lies behind 10.
  const ListedFrame frame = one_pixel({10, 20, 12});
  const auto one = render(frame, technique("z3"), with(1));
  expect_pixel(one, over(frame, {2, 0, 1}), "one slot");
  EXPECT_EQ(one.costs.merged, 2u);
  EXPECT_EQ(one.costs.kept, 1u);
  // Two slots: 10 and 12 are nearest in depth.
  const auto two = render(frame, technique("z3"), with(2));
  expect_pixel(two, over(frame, {0, 2, 1}), "two slots");
  EXPECT_EQ(two.costs.merged, 1u);
}

TEST(Z3, MergedPartsKeepTheMeanColourOfTheirSamples) {
  // Two squares of other halves of the picture, which meet in the middle of a pixel, and one slot.
  Scene scene = crossing_planes(0.0);
  for (std::size_t i = 0; i < 8; ++i) {
    glm::dvec3& p = scene.mesh.positions[i];
    p.z = i < 4 ? 1 : 0;
    if ((i < 4) == (p.x > 0)) p.x = 0;
  }
  const Frame frame = frame_of(scene, flat_camera({0, 0, 0}), {33, 20}, 16);
  const Rendering exact = rendered(frame, "count-scan");
  const Rendering z3 = rendered(frame, "z3", with(1));
  EXPECT_GT(z3.costs.merged, 10u);
  const auto at = [](const Rendering& r, int u) {
    return r.image.pixels[static_cast<std::size_t>(7 * 33 + u)];
  };
  EXPECT_GT(at(exact, 16).r, 0.05f);
  EXPECT_GT(at(exact, 16).b, 0.05f);
  for (int c = 0; c < 4; ++c) EXPECT_NEAR(at(z3, 16)[c], at(exact, 16)[c], 1e-6) << c;
}

TEST(KBuffer, TrianglesComeRoughlySorted) {
  // Squares are submitted from the back to the front: as they come, they would need 11 entries.
  Scene scene;
  for (int i = 0; i < 12; ++i) {
    add_object(scene, square_at(i), {0.08f * static_cast<float>(i), 0.5f, 0.2f, 0.3f});
  }
  const Frame frame = frame_of(scene, flat_camera({0, 0, 0}), {66, 20}, 1);
  const Image exact = rendered(frame, "count-scan").image;
  EXPECT_TRUE(same_bits(rendered(frame, "k-buffer", with(1)).image, exact.pixels));
}

TEST(Slots, OpaqueFragmentsGiveADepthBuffer) {
  ListedFrame frame = random_frame("Opaque", {66, 20}, 4.0, 1 << 24, 81, 1.0f, 1.0f);
  for (glm::vec4& colour : frame.colours) colour.a = 1.0f;
  const auto k = static_cast<unsigned>(deepest(frame));
  for (const char* name : {"stencil-routed", "freepipe-sorted", "freepipe-counter", "bucket-sort",
                           "adaptive-bucket-sort", "k-buffer", "z3"}) {
    const Rendering rendering = render(frame, technique(name), with(std::min(k, 32u)));
    for (const auto& [pixel, list] : pixels_of(frame)) {
      const glm::vec4 nearest = frame.colours[sorted(list).front().face];
      ASSERT_EQ(rendering.image.pixels[static_cast<std::size_t>(pixel.second * 66 + pixel.first)],
                nearest)
          << name;
    }
  }
}

}  // namespace
}  // namespace strata::transparency
