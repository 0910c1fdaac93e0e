// What the techniques with whole lists promise beyond the laws of all techniques.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/transparency/listed_frames.h"
#include "transparency/lists/list_bytes.h"

namespace strata::transparency {
namespace {

const Technique& technique(std::string_view name) {
  auto found = find_technique(name);
  EXPECT_TRUE(found) << name;
  return **found;
}

Rendering render(const ListedFrame& frame, std::string_view name, unsigned k = 0,
                 std::string_view variant = {}, double load = 0.5) {
  Settings settings;
  settings.k = k;
  settings.variant = variant;
  settings.load = load;
  return render(frame, technique(name), settings);
}

bool nearer(const ListedFragment& a, const ListedFragment& b) {
  return std::tuple(a.depth, a.exit, a.face) < std::tuple(b.depth, b.exit, b.face);
}

/// The fragments of each pixel in submission order.
std::map<std::pair<int, int>, std::vector<ListedFragment>> by_pixel(const ListedFrame& frame) {
  std::map<std::pair<int, int>, std::vector<ListedFragment>> pixels;
  for (const ListedFragment& f : frame.fragments) pixels[{f.v, f.u}].push_back(f);
  return pixels;
}

/// The frame with the first fragments of each list, as many as length(list) says.
ListedFrame cut_lists(
    const ListedFrame& frame, bool sort,
    const std::function<std::size_t(const std::vector<ListedFragment>&)>& length) {
  ListedFrame cut = frame;
  cut.fragments.clear();
  for (auto& [place, list] : by_pixel(frame)) {
    if (sort) std::sort(list.begin(), list.end(), nearer);
    cut.fragments.insert(cut.fragments.end(), list.begin(),
                         list.begin() + static_cast<std::ptrdiff_t>(length(list)));
  }
  return cut;
}

/// Tiles of 64 x 64 pixels.
struct TileCounts {
  std::uint64_t width = 0, height = 0, fragments = 0, deepest = 0;
  std::map<std::pair<int, int>, std::uint64_t> layers;
  [[nodiscard]] std::uint64_t pixels() const { return width * height; }
};
std::vector<TileCounts> tiles_of(const ListedFrame& frame) {
  std::vector<TileCounts> tiles;
  const glm::ivec2 size = frame.options.size;
  for (int v = 0; v < size.y; v += 64) {
    for (int u = 0; u < size.x; u += 64) {
      TileCounts tile;
      tile.width = static_cast<std::uint64_t>(std::min(64, size.x - u));
      tile.height = static_cast<std::uint64_t>(std::min(64, size.y - v));
      for (const ListedFragment& f : frame.fragments) {
        if (f.u < u || f.u >= u + 64 || f.v < v || f.v >= v + 64) continue;
        ++tile.fragments;
        tile.deepest = std::max(tile.deepest, ++tile.layers[{f.v, f.u}]);
      }
      tiles.push_back(tile);
    }
  }
  return tiles;
}

ListedFrame odd_frame() { return random_frame("Odd", {133, 71}, 4.0, 1 << 24, 31); }

void expect_bytes(const Rendering& rendering, std::uint64_t expected, std::string_view name) {
  EXPECT_EQ(rendering.costs.formula_bytes, expected) << name;
  EXPECT_EQ(rendering.costs.allocated_bytes, expected) << name;
}

TEST(ListBytes, AreTheBytesAllocatedForLists) {
  const ListedFrame frame = odd_frame();
  const std::uint64_t pixels = 133 * 71, fragments = frame.fragments.size();
  expect_bytes(render(frame, "count-scan"), 8 * fragments + 8 * pixels, "count-scan");
  expect_bytes(render(frame, "linked"), 12 * fragments + 4 * pixels, "linked");
  expect_bytes(render(frame, "a-buffer"), 12 * fragments + 4 * pixels, "a-buffer");
  expect_bytes(render(frame, "b3d-k", 16), (8 * 16 + 4) * pixels, "b3d-k");
  std::uint64_t fixed = 0;
  for (const TileCounts& tile : tiles_of(frame)) fixed += (8 * tile.deepest + 4) * tile.pixels();
  expect_bytes(render(frame, "b3d"), fixed, "b3d");
  for (const std::uint64_t page : {1u, 2u, 4u, 7u}) {
    std::uint64_t pages = 0;
    for (const auto& [place, list] : by_pixel(frame)) pages += (list.size() + page - 1) / page;
    const std::uint64_t bytes = 8 * pixels + pages * (8 * page + 4);
    expect_bytes(render(frame, "paged", static_cast<unsigned>(page)), bytes, "paged");
    EXPECT_GE(bytes, list_bytes::paged_least(pixels, fragments, page));
    EXPECT_LE(bytes, list_bytes::paged_most(pixels, fragments, page) + 4 * pixels);
  }
}

TEST(ListBytes, AreTheBytesAllocatedForHashTables) {
  const ListedFrame frame = odd_frame();
  for (const double load : {0.3, 0.5, 0.8, 0.9}) {
    std::uint64_t cells = 0, blocks = 0;
    for (const TileCounts& tile : tiles_of(frame)) {
      cells += std::max(tile.pixels(), static_cast<std::uint64_t>(
                                           std::ceil(static_cast<double>(tile.fragments) / load)));
      blocks += (tile.width + 7) / 8 * ((tile.height + 7) / 8);
    }
    for (const char* name : {"ha64", "ha64-cas", "ha64-nearest"}) {
      expect_bytes(render(frame, name, 0, {}, load), 8 * cells + blocks, name);
    }
    expect_bytes(render(frame, "ha32", 0, {}, load), (4 + 4) * cells + blocks, "ha32");
  }
}

// The paper's table: MiB for 1024 x 1024 pixels and F fragments of 24 + 32 bits.
TEST(ListBytes, GiveThePublishedTable) {
  namespace lb = list_bytes;
  constexpr std::uint64_t kP = 1024 * 1024;
  struct Row {
    std::uint64_t fragments;
    double scan, linked, least, most, ha90, ha80, ha50;
  };
  for (const Row& row : {Row{850'000, 9.7, 12.9, 11.5, 32.5, 7.2, 8.1, 13.0},
                         Row{1'500'000, 14.0, 19.7, 16.4, 37.4, 12.7, 14.3, 22.9},
                         Row{10'000'000, 70.8, 108.9, 81.3, 102.3, 84.8, 95.4, 152.6}}) {
    const std::uint64_t f = row.fragments;
    const auto mib = [](std::uint64_t bytes) {
      return std::round(10.0 * static_cast<double>(bytes) / (1024.0 * 1024.0)) / 10.0;
    };
    const auto hash = [&](double load) {
      return mib(lb::hash_table(lb::cells_at(load, f), lb::blocks(1024, 1024)));
    };
    EXPECT_DOUBLE_EQ(mib(lb::count_scan(kP, f, 56, 32)), row.scan);
    EXPECT_DOUBLE_EQ(mib(lb::linked(kP, f, 56)), row.linked);
    EXPECT_DOUBLE_EQ(mib(lb::paged_least(kP, f, 4, 56, 40)), row.least);
    EXPECT_DOUBLE_EQ(mib(lb::paged_most(kP, f, 4, 56, 40)), row.most);
    EXPECT_DOUBLE_EQ(hash(0.9), row.ha90);
    EXPECT_DOUBLE_EQ(hash(0.8), row.ha80);
    EXPECT_DOUBLE_EQ(hash(0.5), row.ha50);
  }
}

TEST(Hash64, IsExactAtEveryLoadWithAllKindsOfOffsets) {
  for (const ListedFrame& frame :
       {odd_frame(), random_frame("Ties", {70, 66}, 9.0, 5, 32), deep_frame(590, 33)}) {
    const auto reference = oracle_picture(frame, Blending::kFrontToBack);
    for (const char* variant : {"plane-first", "random", "farthest-point"}) {
      for (const double load : {0.3, 0.5, 0.8, 0.95, 0.99, 1.0}) {
        for (const char* name : {"ha64", "ha64-cas", "ha32"}) {
          const Rendering rendering = render(frame, name, 0, variant, load);
          EXPECT_TRUE(same_bits(rendering.image, reference)) << name << variant << load;
          EXPECT_EQ(rendering.costs.kept, frame.fragments.size()) << name << variant << load;
        }
      }
    }
  }
}

// The table is unique: the sum of all ages, which is the number of probes, does not depend on the
// order of submission; a fragment meets the others of its pixel at least.
TEST(Hash64, NumberOfProbesDoesNotDependOnTheOrder) {
  ListedFrame frame = odd_frame();
  std::uint64_t least = 0;
  for (const auto& [place, list] : by_pixel(frame)) least += list.size() * (list.size() + 1) / 2;
  std::mt19937 random(1);
  const std::uint64_t probes = render(frame, "ha64", 0, "random").costs.comparisons;
  EXPECT_GT(probes, least);
  for (int i = 0; i < 3; ++i) {
    std::shuffle(frame.fragments.begin(), frame.fragments.end(), random);
    EXPECT_EQ(render(frame, "ha64", 0, "random").costs.comparisons, probes);
  }
}

TEST(Hash64, ACompareAndSwapIsCountedForEachRecordThatACellTakes) {
  ListedFrame frame;
  frame.options.size = {1, 1};
  frame.colours = {{1, 1, 1, 0.5f}};
  constexpr std::uint64_t kLayers = 20;
  for (std::uint32_t i = 0; i < kLayers; ++i) frame.fragments.push_back({0, 0, 10 * i, 0, false});
  const auto swaps = [&] {
    return render(frame, "ha64-cas").costs.comparisons - render(frame, "ha64").costs.comparisons;
  };
  EXPECT_EQ(swaps(), kLayers);
  std::reverse(frame.fragments.begin(), frame.fragments.end());
  EXPECT_EQ(swaps(), kLayers * (kLayers + 1) / 2);
}

TEST(Hash64, MoreLayersThanAnAgeOfEightBitsCountsAreBuiltAgain) {
  for (const char* name : {"ha64", "ha32"}) {
    EXPECT_EQ(render(deep_frame(200, 3), name).costs.geometry_passes,
              name == std::string_view("ha32") ? 2u : 1u);
    const Rendering rendering = render(deep_frame(590, 3), name);
    EXPECT_GE(rendering.costs.geometry_passes, 2u) << name;
    EXPECT_GE(rendering.costs.most_layers, 590u) << name;
  }
  ListedFrame frame = deep_frame(2000, 4);
  EXPECT_TRUE(
      same_bits(render(frame, "ha64").image, oracle_picture(frame, Blending::kFrontToBack)));
}

TEST(Hash64, ThatIsTooSmallKeepsTheNearestOfEachPixel) {
  for (const char* variant : {"plane-first", "random", "farthest-point"}) {
    const ListedFrame frame = random_frame("Full", {61, 40}, 6.0, 1 << 24, 41);
    const Rendering rendering = render(frame, "ha64-fixed", 2, variant);
    EXPECT_GT(rendering.costs.lost, 0u);
    EXPECT_EQ(rendering.costs.kept + rendering.costs.lost, frame.fragments.size());
    // Of each pixel some first part of the list is blended.
    std::uint64_t kept = 0;
    for (auto& [place, list] : by_pixel(frame)) {
      std::sort(list.begin(), list.end(), nearer);
      const glm::vec4& seen =
          rendering.image.pixels[static_cast<std::size_t>(place.first * 61 + place.second)];
      glm::vec3 colour(0.0f);
      float transmittance = 1.0f;
      std::size_t length = 0;
      while (length < list.size() && glm::vec4(colour, 1.0f - transmittance) != seen) {
        const glm::vec4 c = frame.colours[list[length++].face];
        colour += transmittance * (glm::vec3(c) * c.a);
        transmittance *= 1.0f - c.a;
      }
      EXPECT_EQ(glm::vec4(colour, 1.0f - transmittance), seen);
      kept += length;
    }
    EXPECT_EQ(kept, rendering.costs.kept);
  }
}

TEST(Hash64, GrowsAndShrinksOnceAndThenStays) {
  for (const double layers : {0.1, 0.5, 0.79, 0.85, 2.0, 4.0}) {
    ListedFrame frame;
    frame.options.size = {64, 64};
    frame.colours = {{1, 1, 1, 0.5f}};
    const auto count = static_cast<int>(layers * 4096);
    for (int i = 0; i < count; ++i) {
      frame.fragments.push_back({i % 64, i / 64 % 64, static_cast<std::uint32_t>(i), 0, false});
    }
    const Costs costs = render(frame, "ha64-grown").costs;
    const std::uint64_t cells = (costs.allocated_bytes - 64) / 8;
    const double load = static_cast<double>(count) / static_cast<double>(cells);
    EXPECT_LT(load, 0.8) << layers;
    EXPECT_TRUE(cells == 4096 || load >= 0.3) << layers;
    EXPECT_GE(cells, 4096u);
    EXPECT_EQ(costs.kept, frame.fragments.size());  // counted while the table is cleared
    // A frame that does not fit, and one whose table is then right.
    EXPECT_EQ(costs.geometry_passes, layers < 0.8 ? 1u : 2u) << layers;
    EXPECT_TRUE(same_bits(render(frame, "ha64-grown").image,
                          oracle_picture(frame, Blending::kFrontToBack)));
  }
}

ListedFrame with_opacity(ListedFrame frame, float opacity) {
  for (glm::vec4& colour : frame.colours) colour.a = opacity;
  return frame;
}

TEST(Hash64Culled, GivesThePictureOfTheListsThatEndAtTheThreshold) {
  for (const double threshold : {0.5, 0.9, 0.99, 1.0}) {
    for (const ListedFrame& frame :
         {random_frame("Deep", {70, 20}, 20.0, 1 << 24, 51),
          random_frame("Ties", {20, 70}, 20.0, 6, 52, 0.0f, 1.0f), deep_frame(590, 53)}) {
      const ListedFrame cut = cut_lists(frame, true, [&](const auto& list) {
        double transmittance = 1.0;
        for (std::size_t i = 0; i < list.size(); ++i) {
          transmittance *= 1.0 - static_cast<double>(frame.colours[list[i].face].a);
          if (transmittance < 1.0 - threshold) return i + 1;
        }
        return list.size();
      });
      Settings settings;
      settings.opacity_threshold = threshold;
      ListedFrame shuffled = frame;
      std::mt19937 random(2);
      for (int i = 0; i < 3; ++i) {
        const Rendering rendering = render(shuffled, technique("ha64-culled"), settings);
        EXPECT_TRUE(same_bits(rendering.image, oracle_picture(cut, Blending::kFrontToBack)))
            << frame.name << threshold;
        EXPECT_EQ(rendering.costs.lost, frame.fragments.size() - cut.fragments.size());
        EXPECT_LE(
            largest_difference(rendering.image, oracle_picture(frame, Blending::kFrontToBack)),
            1.0 - threshold + 1e-6);
        std::shuffle(shuffled.fragments.begin(), shuffled.fragments.end(), random);
      }
    }
  }
}

TEST(Hash64Culled, StoresLessOfMoreOpaqueObjectsDrawnFrontToBack) {
  ListedFrame frame = random_frame("Deep", {64, 64}, 30.0, 1 << 24, 54);
  std::sort(frame.fragments.begin(), frame.fragments.end(), nearer);
  const std::uint64_t pixels = by_pixel(frame).size();
  std::uint64_t last = frame.fragments.size() + 1;
  for (const float opacity : {0.0f, 0.125f, 0.25f, 0.5f, 1.0f}) {
    const Costs costs = render(with_opacity(frame, opacity), "ha64-culled").costs;
    EXPECT_LT(costs.stored, last) << opacity;
    EXPECT_EQ(costs.kept, costs.stored) << opacity;
    last = costs.stored;
    if (opacity == 0.0f) {
      EXPECT_EQ(costs.stored, frame.fragments.size());
    }
  }
  EXPECT_EQ(last, pixels);  // opaque objects: a z-buffer
}

TEST(Hash64Nearest, EqualsTheExactListsCutToKFragments) {
  for (const ListedFrame& frame :
       {random_frame("Mixed", {70, 20}, 6.0, 1 << 24, 61),
        random_frame("Ties", {20, 70}, 6.0, 4, 62), deep_frame(590, 63)}) {
    for (const unsigned k : {1u, 3u, 8u, 700u}) {
      const ListedFrame cut = cut_lists(
          frame, true, [&](const auto& list) { return std::min<std::size_t>(k, list.size()); });
      const Rendering rendering = render(frame, "ha64-nearest", k);
      EXPECT_TRUE(same_bits(rendering.image, oracle_picture(cut, Blending::kFrontToBack)))
          << frame.name << k;
      EXPECT_EQ(rendering.costs.lost, frame.fragments.size() - cut.fragments.size());
    }
  }
}

TEST(FixedArray, LosesTheFragmentsThatComeLast) {
  const ListedFrame frame = random_frame("Mixed", {70, 20}, 6.0, 1 << 24, 71);
  for (const unsigned k : {1u, 4u, 40u}) {
    const ListedFrame cut = cut_lists(
        frame, false, [&](const auto& list) { return std::min<std::size_t>(k, list.size()); });
    const Rendering rendering = render(frame, "b3d-k", k);
    EXPECT_TRUE(same_bits(rendering.image, oracle_picture(cut, Blending::kFrontToBack))) << k;
    EXPECT_EQ(rendering.costs.lost, frame.fragments.size() - cut.fragments.size()) << k;
  }
  EXPECT_EQ(render(frame, "b3d").costs.geometry_passes, 1u);
}

TEST(LinkedLists, RenderAFrameThatOutgrewThePoolOnceMore) {
  const ListedFrame frame = random_frame("Mixed", {64, 64}, 6.0, 1 << 24, 81);
  const auto reference = oracle_picture(frame, Blending::kFrontToBack);
  const std::uint64_t fragments = frame.fragments.size();
  EXPECT_EQ(fragments, 6u * 4096u);
  for (const unsigned k : {1u, 5u, 6u, 7u}) {
    const Rendering rendering = render(frame, "linked-grow", k);
    EXPECT_TRUE(same_bits(rendering.image, reference)) << k;
    EXPECT_EQ(rendering.costs.geometry_passes, k < 6 ? 2u : 1u) << k;
    const std::uint64_t nodes = std::max<std::uint64_t>(fragments, k * 4096u);
    expect_bytes(rendering, 4 * 4096 + 12 * nodes, "linked-grow");
  }
}

TEST(PagedLists, DoubleAPoolThatIsTooSmall) {
  const ListedFrame frame = random_frame("Mixed", {64, 64}, 6.0, 1 << 24, 82);
  const auto reference = oracle_picture(frame, Blending::kFrontToBack);
  std::uint64_t needed = 0;
  for (const auto& [place, list] : by_pixel(frame)) needed += (list.size() + 3) / 4;
  for (const unsigned k : {1u, 2u, 5u, 30u}) {
    std::uint64_t pages = k * 4096 / 4, passes = 1;
    for (; pages < needed; pages *= 2) ++passes;
    const Rendering rendering = render(frame, "paged-grow", k);
    EXPECT_TRUE(same_bits(rendering.image, reference)) << k;
    EXPECT_EQ(rendering.costs.geometry_passes, passes) << k;
    expect_bytes(rendering, 8 * 4096 + 36 * pages, "paged-grow");
  }
  for (const unsigned page : {1u, 3u, 256u}) {
    EXPECT_TRUE(same_bits(render(frame, "paged", page).image, reference)) << page;
  }
}

TEST(DeepFrameBuffer, EndsInAnErrorAboveEightFragmentsAPixel) {
  const auto rendered = [](double layers, int threads) {
    const ListedFrame frame = random_frame("Mixed", {130, 70}, layers, 1 << 24, 91);
    Execution execution;
    execution.threads = threads;
    auto made = *Frame::make(frame.fragments, frame.colours, frame.options);
    auto rendering = made.render(technique("dxdfb"), {}, execution);
    // The room is that of a frame, not of all.
    EXPECT_EQ(made.render(technique("dxdfb"), {}, execution).has_value(), rendering.has_value());
    if (rendering) {
      EXPECT_TRUE(same_bits(rendering->image, oracle_picture(frame, Blending::kFrontToBack)));
      EXPECT_EQ(rendering->costs.formula_bytes, 130u * 70u * (8u * 8u + 8u));
    }
    return rendering ? std::string() : rendering.error().message;
  };
  for (const int threads : {1, 2, 4}) {
    EXPECT_EQ(rendered(8.0, threads), "");
    EXPECT_NE(rendered(8.01, threads).find("72800 of them"), std::string::npos);
  }
}

TEST(SBuffer, TakesTheBytesOfCountAndScanAndItsCounters) {
  const ListedFrame frame = odd_frame();
  for (const unsigned k : {1u, 7u, 64u}) {
    const Rendering rendering = render(frame, "s-buffer", k);
    EXPECT_TRUE(same_bits(rendering.image, oracle_picture(frame, Blending::kFrontToBack))) << k;
    expect_bytes(rendering, 8 * frame.fragments.size() + 8 * 133 * 71 + 8 * k * 6, "s-buffer");
  }
}

/// The mean of the samples of each pixel, row by row of samples.
std::vector<glm::vec4> mean_of_samples(const std::vector<glm::vec4>& fine, int width, int height,
                                       int across, int down) {
  std::vector<glm::vec4> mean;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      glm::vec4 sum(0.0f);
      for (int i = 0; i < across * down; ++i) {
        sum += fine[static_cast<std::size_t>((v * down + i / across) * width * across + u * across +
                                             i % across)];
      }
      mean.push_back(sum * (1.0f / static_cast<float>(across * down)));
    }
  }
  return mean;
}

TEST(CoverageMasks, GiveTheMeanOfTheSamples) {
  for (const auto [samples, across, down] :
       {std::array{4, 2, 2}, {16, 4, 4}, {32, 8, 4}, {64, 8, 8}}) {
    // Few faces and depths, so that samples of a pixel share a face, and faces cross.
    ListedFrame frame =
        random_frame("Samples", {20 * across, 9 * down}, 5.0, samples == 4 ? 3 : 1 << 24, 95);
    for (ListedFragment& f : frame.fragments) f.face %= 4;
    const auto fine = oracle_picture(frame, Blending::kFrontToBack);
    frame.options.size = {20, 9};
    frame.options.samples = samples;
    const Rendering rendering = render(frame, "a-buffer-masks");
    EXPECT_TRUE(same_bits(rendering.image, mean_of_samples(fine, 20, 9, across, down))) << samples;
    EXPECT_EQ(rendering.costs.geometry_passes, 2u);
    EXPECT_GT(rendering.costs.merged, 0u);
  }
}

TEST(CoverageMasks, ShadeAndKeepATriangleOnceAPixel) {
  // Two squares, one behind the other, and a third that crosses both if `tilted`.
  for (const bool tilted : {false, true}) {
    ListedFrame frame;
    frame.colours = {{1, 0, 0, 0.5f}, {0, 1, 0, 0.5f}, {0, 0, 1, 0.5f}};
    frame.options.size = {64, 64};
    for (std::uint32_t face = 0; face < 3; ++face) {
      for (int i = 0; i < 64 * 64; ++i) {
        const auto slope = static_cast<std::uint32_t>(face == 2 && tilted ? i % 64 * 10 : 0);
        frame.fragments.push_back({i % 64, i / 64, 100 + 100 * face + slope, face, false});
        if (tilted && face == 2) frame.fragments.back().depth -= 150;
      }
    }
    const auto fine = oracle_picture(frame, Blending::kFrontToBack);
    frame.options.size = {16, 16};
    frame.options.samples = 16;
    const Rendering rendering = render(frame, "a-buffer-masks");
    EXPECT_TRUE(same_bits(rendering.image, mean_of_samples(fine, 16, 16, 4, 4)));
    EXPECT_EQ(rendering.costs.stored, 3u * 16u * 16u);
    EXPECT_EQ(rendering.costs.merged, frame.fragments.size() - 3u * 16u * 16u);
    if (tilted) {
      // The third crosses the second in one column of pixels, which is shaded by samples.
      EXPECT_EQ(rendering.costs.geometry_passes, 2u);
      EXPECT_EQ(rendering.costs.shaded, 3u * 16u * 16u + 16u * 3u * 15u);
    } else {
      EXPECT_EQ(rendering.costs.geometry_passes, 1u);
      EXPECT_EQ(rendering.costs.shaded, 3u * 16u * 16u);
      expect_bytes(rendering, 24 * 3 * 16 * 16 + 4 * 16 * 16, "a-buffer-masks");
    }
  }
}

// Nearest and farthest depths, equal ones and neighbours, entering and leaving, in one list.
TEST(Lists, KeepTheOrderAtBothEndsOfTheDepths) {
  ListedFrame frame;
  frame.options.size = {3, 2};
  std::mt19937 random(5);
  constexpr std::uint32_t kFarthest = (1u << 24) - 1;
  for (const std::uint32_t depth : {0u, 1u, 1u << 23, (1u << 23) + 1, kFarthest - 1, kFarthest}) {
    for (const bool exit : {false, true}) {
      for (int copy = 0; copy < 2; ++copy) {
        const auto face = static_cast<std::uint32_t>(frame.colours.size());
        frame.colours.emplace_back(0.03f * static_cast<float>(face), 0.5f, 0.2f, 0.3f);
        frame.fragments.push_back({1, 1, depth, face, exit});
      }
    }
  }
  for (int i = 0; i < 3; ++i) {
    std::shuffle(frame.fragments.begin(), frame.fragments.end(), random);
    for (const Technique* of : techniques()) {
      if (of->accuracy != Accuracy::kExact || of->needs_triangles) continue;
      EXPECT_TRUE(same_bits(render(frame, *of).image, oracle_picture(frame, of->blending)))
          << of->name;
    }
  }
}

/// Red behind blue behind green, each of opacity 0.4, over white.
ListedFrame example(std::array<std::uint32_t, 3> depths) {
  ListedFrame frame;
  frame.options.size = {1, 1};
  frame.options.background = glm::vec4(1.0f);
  frame.colours = {{1, 0, 0, 0.4f}, {0, 0, 1, 0.4f}, {0, 1, 0, 0.4f}};
  for (std::uint32_t i = 0; i < 3; ++i) frame.fragments.push_back({0, 0, depths[i], i, false});
  return frame;
}

// The example of M. Maule et al., "A survey of raster-based transparency techniques" (2011).
TEST(Compositing, GivesThePublishedNumbers) {
  const auto expect = [](const Technique& of, const ListedFrame& frame,
                         std::array<double, 3> right) {
    const glm::vec4 pixel = render(frame, of).image.pixels[0];
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(pixel[c], right[static_cast<std::size_t>(c)], 1e-6) << of.name;
    }
    EXPECT_NEAR(pixel.a, 1.0, 1e-6);
  };
  for (const Technique* of : techniques()) {
    if (of->accuracy != Accuracy::kExact || of->needs_triangles) continue;
    expect(*of, example({3, 2, 1}), {0.36, 0.616, 0.456});
    expect(*of, example({1, 3, 2}), {0.616, 0.456, 0.36});
  }
  // In transmittance form, fragments of one depth do not attenuate each other.
  expect(technique("transmittance"), example({3, 2, 1}), {0.36, 0.616, 0.456});
  const double behind = 0.6 * 0.6 * 0.6;
  expect(technique("transmittance"), example({7, 7, 7}),
         {0.4 + behind, 0.4 + behind, 0.4 + behind});
  expect(technique("count-scan"), example({7, 7, 7}),
         {0.4 + behind, 0.6 * 0.6 * 0.4 + behind, 0.6 * 0.4 + behind});
}

}  // namespace
}  // namespace strata::transparency
