#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "strata/transparency/techniques.h"

// Frames of fragments, and an oracle that sorts and blends them without the library.

namespace strata::transparency {

struct ListedFrame {
  std::string name;
  std::vector<ListedFragment> fragments;
  std::vector<glm::vec4> colours;  // of each face
  FrameOptions options;
};

/// Random fragments: `mean_layers` a pixel, `depths` different depths (few: many ties).
inline ListedFrame random_frame(std::string name, glm::ivec2 size, double mean_layers, int depths,
                                unsigned seed, float least_opacity = 0.05f,
                                float most_opacity = 0.95f) {
  ListedFrame frame;
  frame.name = std::move(name);
  frame.options.size = size;
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(0.0f, 1.0f);
  constexpr int kFaces = 50;
  for (int i = 0; i < kFaces; ++i) {
    frame.colours.emplace_back(unit(random), unit(random), unit(random),
                               least_opacity + (most_opacity - least_opacity) * unit(random));
  }
  const auto count =
      static_cast<int>(mean_layers * static_cast<double>(size.x) * static_cast<double>(size.y));
  for (int i = 0; i < count; ++i) {
    ListedFragment f;
    f.u = static_cast<int>(random() % static_cast<unsigned>(size.x));
    f.v = static_cast<int>(random() % static_cast<unsigned>(size.y));
    f.depth = static_cast<std::uint32_t>(random() % static_cast<unsigned>(depths));
    f.face = static_cast<std::uint32_t>(random() % kFaces);
    f.exit = random() % 2 == 0;
    frame.fragments.push_back(f);
  }
  return frame;
}

/// One pixel that is `layers` deep, submitted in random order, beside shallow ones.
inline ListedFrame deep_frame(int layers, unsigned seed) {
  ListedFrame frame =
      random_frame(std::to_string(layers) + "Layers", {9, 5}, 2.0, 1 << 24, seed, 0.001f, 0.03f);
  std::mt19937 random(seed + 1);
  for (int i = 0; i < layers; ++i) {
    frame.fragments.push_back({4, 2, static_cast<std::uint32_t>(random() % (1 << 24)),
                               static_cast<std::uint32_t>(random() % 50), random() % 2 == 0});
  }
  std::shuffle(frame.fragments.begin(), frame.fragments.end(), random);
  return frame;
}

/// The picture: layers sorted by (depth, exit, face), blended in the given order, in floats.
inline std::vector<glm::vec4> oracle_picture(const ListedFrame& frame, Blending blending) {
  using Layer = std::tuple<std::uint32_t, bool, std::uint32_t>;
  std::map<std::pair<int, int>, std::vector<Layer>> pixels;
  for (const ListedFragment& f : frame.fragments) {
    pixels[{f.v, f.u}].emplace_back(f.depth, f.exit, f.face);
  }
  const glm::ivec2 size = frame.options.size;
  const glm::vec4 b = frame.options.background;
  const glm::vec4 background(b.r * b.a, b.g * b.a, b.b * b.a, b.a);
  std::vector<glm::vec4> image(static_cast<std::size_t>(size.x * size.y), background);
  for (auto& [place, of_place] : pixels) {
    std::vector<Layer>& layers = of_place;  // clang 14 captures no binding
    std::sort(layers.begin(), layers.end());
    const auto at = [&](std::size_t i) {
      const glm::vec4 c = frame.colours[std::get<2>(layers[i])];
      return glm::vec4(c.r * c.a, c.g * c.a, c.b * c.a, c.a);
    };
    const std::size_t front = blending == Blending::kFrontToBack   ? layers.size()
                              : blending == Blending::kBackToFront ? 0
                                                                   : (layers.size() + 1) / 2;
    glm::vec3 colour(0.0f);
    float seen = 1.0f;
    for (std::size_t i = 0; i < front; ++i) {
      const glm::vec4 c = at(i);
      for (int k = 0; k < 3; ++k) colour[k] = colour[k] + seen * c[k];
      seen = seen * (1.0f - c.a);
    }
    glm::vec3 behind(0.0f);
    float seen_behind = 1.0f;
    for (std::size_t i = layers.size(); i-- > front;) {
      const glm::vec4 c = at(i);
      for (int k = 0; k < 3; ++k) behind[k] = c[k] + (1.0f - c.a) * behind[k];
      seen_behind = seen_behind * (1.0f - c.a);
    }
    if (front < layers.size()) {
      for (int k = 0; k < 3; ++k) colour[k] = front == 0 ? behind[k] : colour[k] + seen * behind[k];
      seen = front == 0 ? seen_behind : seen * seen_behind;
    }
    glm::vec4& out = image[static_cast<std::size_t>(place.first * size.x + place.second)];
    for (int k = 0; k < 3; ++k) out[k] = colour[k] + seen * background[k];
    out.a = (1.0f - seen) + seen * background.a;
  }
  return image;
}

/// The largest difference of any channel.
inline float largest_difference(const Image& image, const std::vector<glm::vec4>& reference) {
  float largest = image.pixels.size() == reference.size() ? 0.0f : 1e9f;
  for (std::size_t i = 0; i < std::min(image.pixels.size(), reference.size()); ++i) {
    for (int c = 0; c < 4; ++c) {
      const float by = std::abs(image.pixels[i][c] - reference[i][c]);
      largest = by <= largest ? largest : by;
    }
  }
  return largest;
}

/// Whether the pixels have the same bits.
inline bool same_bits(const Image& image, const std::vector<glm::vec4>& reference) {
  return image.pixels.size() == reference.size() &&
         std::memcmp(image.pixels.data(), reference.data(), reference.size() * sizeof(glm::vec4)) ==
             0;
}

/// Renders, and fails the test if that fails.
inline Rendering render(const ListedFrame& listed, const Technique& technique,
                        const Settings& settings = {}, int threads = 2) {
  auto frame = Frame::make(listed.fragments, listed.colours, listed.options);
  if (!frame) {
    ADD_FAILURE() << frame.error().message;
    return {};
  }
  Execution execution;
  execution.threads = threads;
  auto rendering = frame->render(technique, settings, execution);
  if (!rendering) {
    ADD_FAILURE() << technique.name << ": " << rendering.error().message;
    return {};
  }
  return std::move(*rendering);
}

}  // namespace strata::transparency
