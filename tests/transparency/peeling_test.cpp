// Techniques that find one layer at a time: how many passes and records they take, and what they
// show when they are stopped early. That they are exact is a law of laws_test.cpp.

#include <gtest/gtest.h>

#include "tests/transparency/listed_frames.h"

namespace strata::transparency {
namespace {

const Technique& technique(std::string_view name) {
  const auto found = find_technique(name);
  EXPECT_TRUE(found) << name;
  return **found;
}

/// Each pixel has `layers` fragments of different depths, submitted in random order.
ListedFrame even_frame(int layers, glm::ivec2 size = {20, 11}) {
  ListedFrame frame = random_frame("Even", size, 0.0, 2, 31);
  std::mt19937 random(77);
  for (int v = 0; v < size.y; ++v) {
    for (int u = 0; u < size.x; ++u) {
      for (int i = 0; i < layers; ++i) {
        const auto depth =
            static_cast<std::uint32_t>(i * 1000) + static_cast<std::uint32_t>(random() % 1000);
        frame.fragments.push_back(
            {u, v, depth, static_cast<std::uint32_t>(random() % 50), random() % 2 == 0});
      }
    }
  }
  std::shuffle(frame.fragments.begin(), frame.fragments.end(), random);
  return frame;
}

TEST(Peeling, TakesThePassesOfThePapers) {
  for (std::uint64_t l = 1; l <= 9; ++l) {
    const ListedFrame frame = even_frame(static_cast<int>(l));
    const auto passes = [&](std::string_view name) {
      const Costs costs = render(frame, technique(name)).costs;
      EXPECT_EQ(costs.most_layers, l) << name;
      EXPECT_EQ(costs.rasterized, costs.geometry_passes * frame.fragments.size()) << name;
      return costs.geometry_passes;
    };
    EXPECT_EQ(passes("depth-peeling"), l);
    EXPECT_EQ(passes("reverse-peeling"), l);
    EXPECT_EQ(passes("virtual-pixel-maps"), l + 1);
    EXPECT_EQ(passes("dual-peeling"), (l + 1) / 2 + 1);
    EXPECT_EQ(passes("f-buffer"), 1u);
    EXPECT_EQ(passes("r-buffer"), 1u);
  }
}

TEST(Peeling, MemoryDoesNotGrowWithLayers) {
  for (const char* name :
       {"depth-peeling", "reverse-peeling", "virtual-pixel-maps", "dual-peeling"}) {
    const Costs one = render(even_frame(1), technique(name)).costs;
    const Costs many = render(even_frame(40), technique(name)).costs;
    EXPECT_EQ(one.allocated_bytes, many.allocated_bytes) << name;
    EXPECT_EQ(one.allocated_bytes, one.formula_bytes) << name;
    EXPECT_EQ(one.allocated_bytes % (20 * 11), 0u) << name;
    EXPECT_GT(one.allocated_bytes, 0u) << name;
  }
}

/// A fragment with n before it in its pixel is written to the FIFO n + 1 times.
TEST(FBuffer, WritesEachFragmentOnceForEachLayerUpToIt) {
  for (const ListedFrame& frame :
       {even_frame(6), random_frame("Ties", {30, 9}, 5.0, 4, 3), deep_frame(200, 4)}) {
    std::map<std::pair<int, int>, std::uint64_t> layers;
    for (const ListedFragment& f : frame.fragments) ++layers[{f.u, f.v}];
    std::uint64_t written = 0;
    for (const auto& [pixel, n] : layers) written += n * (n + 1) / 2;
    const Costs costs = render(frame, technique("f-buffer")).costs;
    EXPECT_EQ(costs.stored, written);
    EXPECT_EQ(costs.kept, frame.fragments.size());
    // The R-buffer looks once more, for what opaque fragments hide.
    EXPECT_EQ(render(frame, technique("r-buffer")).costs.stored, written + frame.fragments.size());
  }
}

TEST(RBuffer, OpaqueFragmentsResolveInTheDepthBuffer) {
  ListedFrame frame;
  frame.options.size = {1, 1};
  frame.colours = {{1, 0, 0, 0.5f}, {0, 1, 0, 1.0f}, {0, 0, 1, 0.5f}};
  const ListedFragment front{0, 0, 10, 0}, opaque{0, 0, 20, 1}, hidden{0, 0, 30, 2};
  const auto costs_of = [&](std::vector<ListedFragment> order) {
    frame.fragments = std::move(order);
    const Rendering rendering = render(frame, technique("r-buffer"));
    EXPECT_TRUE(same_bits(rendering.image, oracle_picture(frame, Blending::kBackToFront)));
    EXPECT_EQ(rendering.image.pixels[0], glm::vec4(0.5f, 0.5f, 0.0f, 1.0f));
    EXPECT_EQ(rendering.costs.kept, 2u);
    EXPECT_EQ(rendering.costs.most_layers, 2u);
    return rendering.costs;
  };
  // Written when rasterized, and when looked at again.
  EXPECT_EQ(costs_of({opaque, hidden, front}).stored, 1u + 1u);
  EXPECT_EQ(costs_of({hidden, opaque, front}).stored, 2u + 1u);
}

TEST(DepthPeeling, EndsWhereNothingComesThrough) {
  ListedFrame frame = even_frame(30);
  const Costs all = render(frame, technique("depth-peeling")).costs;
  EXPECT_EQ(all.geometry_passes, 30u);
  std::vector<ListedFragment> covers;
  for (int v = 0; v < 11; ++v) {
    for (int u = 0; u < 20; ++u) covers.push_back({u, v, 2500, 50, false});
  }
  frame.colours.emplace_back(0.3f, 0.6f, 0.9f, 1.0f);
  frame.fragments.insert(frame.fragments.begin() + 1000, covers.begin(), covers.end());
  const Rendering covered = render(frame, technique("depth-peeling"));
  EXPECT_TRUE(same_bits(covered.image, oracle_picture(frame, Blending::kFrontToBack)));
  // Two layers lie before the cover, a third in some pixels.
  EXPECT_EQ(covered.costs.geometry_passes, 4u);
  EXPECT_EQ(covered.costs.lost, 0u);
}

TEST(Peeling, KeepsEqualFragmentsOfAnyNumber) {
  for (int a = 1; a <= 4; ++a) {
    for (int b = 0; b <= 4; ++b) {
      for (int c = 0; c <= 3; ++c) {
        ListedFrame frame = random_frame("Equal", {1, 1}, 0.0, 2, 5, 0.1f, 0.4f);
        frame.fragments.insert(frame.fragments.end(), static_cast<std::size_t>(b), {0, 0, 7, 2});
        frame.fragments.insert(frame.fragments.end(), static_cast<std::size_t>(a), {0, 0, 7, 1});
        frame.fragments.insert(frame.fragments.end(), static_cast<std::size_t>(c), {0, 0, 9, 3});
        for (const char* name : {"depth-peeling", "reverse-peeling", "virtual-pixel-maps",
                                 "dual-peeling", "f-buffer", "r-buffer"}) {
          const Rendering rendering = render(frame, technique(name));
          EXPECT_TRUE(same_bits(rendering.image, oracle_picture(frame, technique(name).blending)))
              << name << ' ' << a << ' ' << b << ' ' << c;
          EXPECT_EQ(rendering.costs.most_layers, frame.fragments.size()) << name;
          EXPECT_EQ(rendering.costs.kept, frame.fragments.size()) << name;
        }
      }
    }
  }
}

/// The frame with some layers of each pixel alone. @param chosen  (layer, layers), from the front
template <class Chosen>
ListedFrame layers_of(const ListedFrame& frame, Chosen&& chosen) {
  std::map<std::pair<int, int>, std::vector<ListedFragment>> pixels;
  for (const ListedFragment& f : frame.fragments) pixels[{f.u, f.v}].push_back(f);
  ListedFrame some = frame;
  some.fragments.clear();
  for (auto& [place, list] : pixels) {
    std::sort(list.begin(), list.end(), [](const ListedFragment& a, const ListedFragment& b) {
      return std::tie(a.depth, a.exit, a.face) < std::tie(b.depth, b.exit, b.face);
    });
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (chosen(i, list.size())) some.fragments.push_back(list[i]);
    }
  }
  return some;
}

TEST(Peeling, StoppedEarlyShowsTheLayersOfItsPasses) {
  const ListedFrame frame = even_frame(8);
  const auto expect = [&](const char* name, unsigned passes, const ListedFrame& shown) {
    Settings settings;
    settings.k = passes;
    const Rendering rendering = render(frame, technique(name), settings);
    EXPECT_TRUE(same_bits(rendering.image, oracle_picture(shown, technique(name).blending)))
        << name;
    EXPECT_EQ(rendering.costs.geometry_passes, passes) << name;
    EXPECT_EQ(rendering.costs.lost, frame.fragments.size() - shown.fragments.size()) << name;
    EXPECT_EQ(rendering.costs.kept, shown.fragments.size()) << name;
  };
  const auto nearest = layers_of(frame, [](std::size_t i, std::size_t) { return i < 3; });
  const auto farthest = layers_of(frame, [](std::size_t i, std::size_t n) { return i >= n - 3; });
  const auto ends =
      layers_of(frame, [](std::size_t i, std::size_t n) { return i < 3 || i >= n - 3; });
  expect("depth-peeling", 3, nearest);
  expect("reverse-peeling", 3, farthest);
  expect("virtual-pixel-maps", 3, farthest);
  expect("dual-peeling", 4, ends);
}

}  // namespace
}  // namespace strata::transparency
