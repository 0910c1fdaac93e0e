// The laws of techniques with bounded memory: where each is exact, on which side it errs, and what
// it costs.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/transparency/choices.h"

namespace strata::transparency {
namespace {

const std::vector<std::string> kMetrics = {"transmittance",
                                           "colour",
                                           "depth",
                                           "transmittance-colour",
                                           "transmittance-depth",
                                           "colour-depth",
                                           "transmittance-colour-depth"};

TEST(Bounded, OneLayerIsExact) {
  const ListedFrame frame = single_layers();
  const auto reference = oracle_picture(frame, Blending::kFrontToBack);
  for (const std::string choice :
       {"relaxed", "mlab:1", "mlab", "ht:1", "ht", "at:1", "at", "at::normalized", "at-lists",
        "opacity-map:1", "opacity-map", "opacity-map::sum", "occupancy-map", "fourier-map:1",
        "fourier-map"}) {
    EXPECT_LE(largest_difference(render(frame, choice).image, reference), 2e-6f) << choice;
  }
  for (const std::string choice : {"mlab-packed:1", "mlab-packed", "ht-packed:1", "ht-packed"}) {
    EXPECT_LE(largest_difference(render(frame, choice).image, reference), 1.01f / 255.0f) << choice;
  }
}

TEST(Bounded, EnoughRowsGiveTheBitsOfTheSortedLists) {
  ListedFrame frame = random_frame("Ties", {70, 66}, 6.0, 4, 41, 0.0f, 1.0f);
  const auto reference = oracle_picture(frame, Blending::kFrontToBack);
  std::mt19937 random(1);
  for (int order = 0; order < 3; ++order) {
    for (const std::string& metric : kMetrics) {
      const Rendering mlab = render(frame, "mlab:32:" + metric);
      EXPECT_TRUE(same_bits(mlab.image, reference)) << metric;
      EXPECT_EQ(mlab.costs.merged, 0u);
    }
    EXPECT_TRUE(same_bits(render(frame, "ht:33").image, reference));
    std::shuffle(frame.fragments.begin(), frame.fragments.end(), random);
  }
}

TEST(Bounded, EnoughNodesAreExactUpToTies) {
  const ListedFrame frame = random_frame("Mixed", {70, 66}, 6.0, 1 << 24, 42, 0.0f, 1.0f);
  const auto reference = oracle_picture(frame, Blending::kFrontToBack);
  EXPECT_LE(largest_difference(render(frame, "at:32").image, reference), 1e-5f);
  EXPECT_LE(largest_difference(render(frame, "at:32:normalized").image, reference), 1e-5f);
}

/// A frame whose stream is sorted.
ListedFrame sorted(ListedFrame frame, bool front_to_back) {
  std::stable_sort(frame.fragments.begin(), frame.fragments.end(),
                   [&](const auto& a, const auto& b) {
                     const auto key = [](const ListedFragment& f) {
                       return std::tuple(f.depth, f.exit, f.face);
                     };
                     return front_to_back ? key(a) < key(b) : key(b) < key(a);
                   });
  return frame;
}

TEST(Bounded, OneRowIsExactForSortedStreams) {
  for (const ListedFrame& frame :
       {random_frame("Mixed", {70, 66}, 6.0, 1 << 24, 43),
        random_frame("Ties", {33, 20}, 6.0, 5, 44), deep_frame(590, 45)}) {
    for (const bool front_to_back : {true, false}) {
      const auto blending = front_to_back ? Blending::kFrontToBack : Blending::kBackToFront;
      const auto reference = oracle_picture(frame, blending);
      const ListedFrame stream = sorted(frame, front_to_back);
      // Equal fragments in front are blended in the other order.
      const float rounding = frame.name == "Ties" ? 1e-6f : 0.0f;
      for (const std::string choice : {"relaxed", "mlab:1"}) {
        EXPECT_LE(largest_difference(render(stream, choice).image, reference), rounding)
            << frame.name << ' ' << choice;
      }
    }
  }
}

TEST(Bounded, RowsMendAStreamFromBackToFrontThatIsLateByLessThanTheirNumber) {
  // Groups of four come from back to front, each from front to back within.
  ListedFrame frame = layers(random_frame("Mixed", {1, 1}, 0, 1, 40).colours, {}, {1, 1});
  for (std::uint32_t i = 0; i < 40; ++i) {
    const std::uint32_t group = 9 - i / 4;
    frame.fragments.push_back({0, 0, 1000 * (4 * group + i % 4), i, i % 3 == 0});
  }
  const auto reference = oracle_picture(frame, Blending::kFrontToBack);
  EXPECT_LE(largest_difference(render(frame, "mlab:4").image, reference), 1e-6f);
  EXPECT_GT(largest_difference(render(frame, "mlab:3").image, reference), 1e-3f);
}

TEST(Bounded, MlabWithOneRowIsRelaxedBlending) {
  const ListedFrame frame = random_frame("Mixed", {70, 66}, 6.0, 64, 46, 0.0f, 1.0f);
  const Image relaxed = render(frame, "relaxed").image;
  EXPECT_TRUE(same_bits(render(frame, "mlab:1").image, relaxed.pixels));
  EXPECT_GT(largest_difference(relaxed, oracle_picture(frame, Blending::kFrontToBack)), 0.1f);
}

TEST(Bounded, MlabHasTheExactTransmittanceAlways) {
  const ListedFrame frame = random_frame("Mixed", {70, 66}, 12.0, 1 << 24, 47, 0.01f, 0.4f);
  const auto reference = oracle_picture(frame, Blending::kFrontToBack);
  std::vector<std::string> choices{"relaxed", "at:2", "opacity-map:2"};
  for (const std::string& metric : kMetrics) {
    for (const char* rows : {"1", "2", "5"})
      choices.push_back("mlab:" + std::string(rows) + ":" + metric);
  }
  for (const std::string& choice : choices) {
    const Image image = render(frame, choice).image;
    float most = 0.0f;
    for (std::size_t i = 0; i < reference.size(); ++i) {
      most = std::max(most, std::abs(image.pixels[i].a - reference[i].a));
    }
    EXPECT_LE(most, 2e-6f) << choice;
  }
}

/// Multi-layer alpha blending, slowly and in doubles: a list of rows, and the pair that a formula
/// chooses.
struct SlowRow {
  std::tuple<std::uint32_t, bool, std::uint32_t> place;
  glm::dvec3 colour;
  double through;
};

double pair_weight(const std::vector<SlowRow>& rows, std::size_t i, const std::string& metric) {
  double weight = 1.0;
  if (metric.find("transmittance") != std::string::npos) {
    for (std::size_t j = 0; j <= i + 1; ++j) weight *= rows[j].through;
  }
  if (metric.find("colour") != std::string::npos) {
    double squares = 0.0;
    for (int c = 0; c < 3; ++c) {
      squares +=
          (rows[i].colour[c] - rows[i + 1].colour[c]) * (rows[i].colour[c] - rows[i + 1].colour[c]);
    }
    weight *= std::sqrt(squares);
  }
  if (metric.find("depth") != std::string::npos) {
    weight *= static_cast<double>(std::get<0>(rows[i + 1].place)) -
              static_cast<double>(std::get<0>(rows[i].place));
  }
  return weight;
}

std::vector<glm::vec4> slow_mlab(const ListedFrame& frame, std::size_t most,
                                 const std::string& metric) {
  const glm::ivec2 size = frame.options.size;
  std::vector<std::vector<SlowRow>> pixels(static_cast<std::size_t>(size.x * size.y));
  for (const ListedFragment& f : frame.fragments) {
    auto& rows = pixels[static_cast<std::size_t>(f.v * size.x + f.u)];
    const glm::dvec4 c(frame.colours[f.face]);
    rows.push_back({{f.depth, f.exit, f.face}, glm::dvec3(c) * c.a, 1.0 - c.a});
    std::stable_sort(rows.begin(), rows.end(),
                     [](const auto& a, const auto& b) { return a.place < b.place; });
    if (rows.size() <= most) continue;
    std::size_t best = 0;
    for (std::size_t i = 1; i + 1 < rows.size(); ++i) {
      if (pair_weight(rows, i, metric) <= pair_weight(rows, best, metric)) best = i;
    }
    rows[best].colour += rows[best].through * rows[best + 1].colour;
    rows[best].through *= rows[best + 1].through;
    rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(best) + 1);
  }
  std::vector<glm::vec4> image;
  for (const auto& rows : pixels) {
    glm::dvec3 colour(0.0);
    double through = 1.0;
    for (const SlowRow& row : rows) {
      colour += through * row.colour;
      through *= row.through;
    }
    image.emplace_back(glm::vec3(colour), static_cast<float>(1.0 - through));
  }
  return image;
}

TEST(Bounded, MlabMergesThePairOfItsMetric) {
  const ListedFrame frame = random_frame("Mixed", {70, 66}, 10.0, 1 << 24, 48);
  std::vector<Image> images;
  for (const std::string& metric : kMetrics) {
    images.push_back(render(frame, "mlab:3:" + metric).image);
    const auto slow = slow_mlab(frame, 3, metric);
    std::size_t wrong = 0;  // rounding may turn a choice
    for (std::size_t i = 0; i < slow.size(); ++i) {
      for (int c = 0; c < 4; ++c)
        wrong += std::abs(slow[i][c] - images.back().pixels[i][c]) > 1e-5f ? 1 : 0;
    }
    EXPECT_LE(wrong, slow.size() / 1000) << metric;
  }
  for (std::size_t i = 1; i < images.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_NE(images[i].pixels, images[j].pixels) << kMetrics[i];
  }
}

TEST(Bounded, OpaqueFragmentsAreAZBufferForRows) {
  const ListedFrame frame = random_frame("Opaque", {70, 66}, 6.0, 1 << 24, 49, 1.0f, 1.0f);
  const auto reference = oracle_picture(frame, Blending::kFrontToBack);
  for (const std::string choice : {"relaxed", "mlab:1", "mlab:3", "ht:2", "ht:5", "at:1", "at:4"}) {
    EXPECT_TRUE(same_bits(render(frame, choice).image, reference)) << choice;
  }
  for (const std::string choice : {"mlab-packed:1", "mlab-packed:3", "ht-packed:2"}) {
    EXPECT_LE(largest_difference(render(frame, choice).image, reference), 0.51f / 255.0f) << choice;
  }
}

TEST(Bounded, ErrorsFallWithMoreRowsNodesAndSlices) {
  const std::vector<std::vector<std::string>> ladders = {
      {"mlab:1", "mlab:2", "mlab:4", "mlab:8", "mlab:16"},
      {"mlab-packed:1", "mlab-packed:2", "mlab-packed:4", "mlab-packed:8"},
      {"ht:1", "ht:2", "ht:4", "ht:8", "ht:16"},
      {"ht-packed:1", "ht-packed:2", "ht-packed:4", "ht-packed:8"},
      {"at:1", "at:2", "at:4", "at:8", "at:16"},
      {"at:1:normalized", "at:2:normalized", "at:4:normalized", "at:8:normalized"},
      {"opacity-map:1", "opacity-map:4", "opacity-map:16", "opacity-map:64", "opacity-map:512"},
      {"fourier-map:1", "fourier-map:3", "fourier-map:7", "fourier-map:20"},
      {"occupancy-map:32", "occupancy-map:128"}};
  for (const auto& ladder : ladders) {
    double last = 1.0;
    for (const std::string& choice : ladder) {
      const double error = mean_square(choice);
      EXPECT_LT(error, 0.9 * last) << choice;
      last = error;
    }
  }
}

TEST(Bounded, PackedRowsAreTheFloatOnesRounded) {
  const ListedFrame frame = random_frame("Mixed", {70, 66}, 5.0, 1 << 24, 50);
  for (const std::string rows : {"2", "4"}) {
    for (const std::string name : {"mlab", "ht"}) {
      const Image exact = render(frame, name + ":" + rows).image;
      const Image packed = render(frame, name + "-packed:" + rows).image;
      const float by = largest_difference(packed, exact.pixels);
      EXPECT_LE(by, 8.0f / 255.0f) << name << rows;
      EXPECT_GT(by, 0.2f / 255.0f) << name << rows;
    }
  }
}

TEST(Bounded, TheTailOfHybridTransparencyIsTheWeightedAverage) {
  const std::vector<glm::vec4> c{
      {1, 0, 0, 0.5f}, {0, 1, 0, 0.25f}, {0, 0, 1, 0.75f}, {1, 1, 0, 0.1f}};
  glm::dvec3 sum(0.0);
  double opacities = 0.0;
  for (int i = 1; i < 4; ++i) {
    const glm::dvec4 d(c[static_cast<std::size_t>(i)]);
    sum += d.a * glm::dvec3(d);
    opacities += d.a;
  }
  const double through = std::pow(1.0 - opacities / 3.0, 3.0);
  const glm::dvec3 expected = glm::dvec3(0.5, 0, 0) + 0.5 * (1.0 - through) / opacities * sum;
  std::vector<std::uint32_t> depths{10, 20, 30, 40};
  do {
    const ListedFrame frame = layers(c, depths);
    if (depths[0] != 10) continue;
    const glm::vec4 pixel = render(frame, "ht:2").image.pixels[0];
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(pixel[i], expected[i], 1e-6);
    EXPECT_NEAR(pixel.a, 1.0 - 0.5 * through, 1e-6);
    const glm::vec4 packed = render(frame, "ht-packed:2").image.pixels[0];
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(packed[i], expected[i], 1.5 / 255.0);
  } while (std::next_permutation(depths.begin(), depths.end()));
}

TEST(Bounded, WhatFallsOutOfTheRowsIsMergedAndNotLost) {
  // The printed listings merge a row that they never wrote.
  const ListedFrame frame =
      layers({{1, 0, 0, 0.5f}, {0, 1, 0, 0.5f}, {0, 0, 1, 0.5f}}, {30, 20, 10});
  for (const std::string choice : {"mlab:1", "mlab:2"}) {
    const glm::vec4 pixel = render(frame, choice).image.pixels[0];
    EXPECT_EQ(pixel, glm::vec4(0.125f, 0.25f, 0.5f, 0.875f)) << choice;
  }
  const glm::vec4 tail = render(frame, "ht:1").image.pixels[0];
  EXPECT_NEAR(tail.a, 0.875, 1e-6);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(tail[i], 0.875 / 3.0, 1e-6);
}

TEST(Bounded, AFragmentWithinAMergedSpanIsWrongByTheFormula) {
  // Red and blue are merged; green comes between them and is blended behind both.
  const ListedFrame frame =
      layers({{1, 0, 0, 0.5f}, {0, 0, 1, 0.5f}, {0, 1, 0, 0.5f}}, {10, 30, 20});
  EXPECT_EQ(render(frame, "mlab:1").image.pixels[0], glm::vec4(0.5f, 0.125f, 0.25f, 0.875f));
  EXPECT_EQ(render(frame, "mlab:3").image.pixels[0], glm::vec4(0.5f, 0.25f, 0.125f, 0.875f));
}

TEST(Bounded, AdaptiveTransparencyIsNeverTooBright) {
  ListedFrame frame = random_frame("White", {70, 66}, 10.0, 1 << 24, 51);
  for (glm::vec4& colour : frame.colours) colour = glm::vec4(1, 1, 1, colour.a);
  const auto reference = oracle_picture(frame, Blending::kFrontToBack);
  const Image image = render(frame, "at:3").image;
  const Image normalized = render(frame, "at:3:normalized").image;
  double sum = 0.0, expected = 0.0;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    EXPECT_LE(image.pixels[i].r, reference[i].r + 1e-5f);
    EXPECT_NEAR(normalized.pixels[i].r, reference[i].r, 1e-5);  // all have one colour
    sum += static_cast<double>(image.pixels[i].r);
    expected += static_cast<double>(reference[i].r);
  }
  EXPECT_LT(sum, 0.97 * expected);
}

TEST(Bounded, AdaptiveListsGiveTheBitsOfTheNodesAndTheMemoryOfAnABuffer) {
  const ListedFrame frame = random_frame("Mixed", {130, 70}, 10.0, 1000, 52);
  for (const std::string rest : {":2", ":8", ":5:normalized"}) {
    const Rendering nodes = render(frame, "at" + rest), lists = render(frame, "at-lists" + rest);
    EXPECT_TRUE(same_bits(lists.image, nodes.image.pixels)) << rest;
    EXPECT_EQ(lists.costs.geometry_passes, 1u);
    EXPECT_EQ(nodes.costs.geometry_passes, 2u);
    EXPECT_EQ(lists.costs.allocated_bytes, 12 * frame.fragments.size() + 4 * 130 * 70);
    EXPECT_EQ(lists.costs.formula_bytes, lists.costs.allocated_bytes);
    EXPECT_EQ(lists.costs.merged, nodes.costs.merged);
  }
}

TEST(Bounded, FragmentsOfOneDepthDoNotAttenuateOneAnotherInTwoPassTechniques) {
  const ListedFrame frame =
      layers({{1, 0, 0, 0.5f}, {0, 1, 0, 0.5f}, {0, 0, 1, 0.5f}}, {10, 10, 20});
  for (const std::string choice : {"at", "opacity-map:1024:sum"}) {
    const glm::vec4 pixel = render(frame, choice).image.pixels[0];
    EXPECT_EQ(pixel.r, 0.5f) << choice;
    EXPECT_EQ(pixel.g, 0.5f) << choice;
    EXPECT_EQ(pixel.a, 0.875f) << choice;
  }
  EXPECT_EQ(render(frame, "at").image.pixels[0].b, 0.125f);
}

TEST(Bounded, MemoryIsTheFormulaAndDoesNotGrowWithFragments) {
  const std::vector<std::pair<std::string, std::uint64_t>> bytes = {{"relaxed", 24},
                                                                    {"mlab:4", 96},
                                                                    {"mlab-packed:4", 32},
                                                                    {"mlab-packed:8", 64},
                                                                    {"ht-packed:4", 32},
                                                                    {"ht-packed:8", 64},
                                                                    {"ht:4", 92},
                                                                    {"at:8", 64},
                                                                    {"at:8:normalized", 68},
                                                                    {"opacity-map:16:sum", 64},
                                                                    {"occupancy-map", 24},
                                                                    {"fourier-map:7:sum", 60}};
  for (const double layers : {0.5, 8.0}) {
    const ListedFrame frame = random_frame("Mixed", {130, 70}, layers, 1 << 24, 53);
    for (const auto& [choice, each] : bytes) {
      const Costs costs = render(frame, choice).costs;
      EXPECT_EQ(costs.formula_bytes, each * 130 * 70) << choice;
      EXPECT_EQ(costs.allocated_bytes, costs.formula_bytes) << choice;
      EXPECT_EQ(costs.stored, frame.fragments.size()) << choice;
      EXPECT_EQ(costs.kept + costs.merged, costs.stored) << choice;
      const bool two = choice.find("at:") == 0 || choice.find("-map") != std::string::npos;
      EXPECT_EQ(costs.geometry_passes, two ? 2u : 1u) << choice;
      EXPECT_EQ(costs.shaded, frame.fragments.size()) << choice;
    }
  }
}

TEST(Bounded, RowsMustBeInRange) {
  for (const std::string choice :
       {"mlab:65", "at:65", "ht:0", "occupancy-map:31", "mlab:4:nearest"}) {
    EXPECT_FALSE(parse_technique(choice)) << choice;
  }
}

}  // namespace
}  // namespace strata::transparency
