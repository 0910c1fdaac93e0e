#pragma once

#include <cmath>
#include <string>

#include "tests/transparency/listed_frames.h"

namespace strata::transparency {

/// Renders by a text such as "mlab:8"; fails the test if that fails.
inline Rendering render(const ListedFrame& frame, const std::string& choice,
                        const Settings& settings = {}, int threads = 2) {
  const auto chosen = parse_technique(choice, settings);
  if (!chosen) {
    ADD_FAILURE() << chosen.error().message;
    return {};
  }
  return render(frame, *chosen->technique, chosen->settings, threads);
}

/// Fragments of each pixel of a picture, by depth; fragment i has colour i.
inline ListedFrame layers(const std::vector<glm::vec4>& colours,
                          const std::vector<std::uint32_t>& depths, glm::ivec2 size = {1, 1}) {
  ListedFrame frame;
  frame.options.size = size;
  frame.colours = colours;
  for (int v = 0; v < size.y; ++v) {
    for (int u = 0; u < size.x; ++u) {
      for (std::uint32_t i = 0; i < depths.size(); ++i) {
        frame.fragments.push_back({u, v, depths[i], i, false});
      }
    }
  }
  return frame;
}

/// At most one fragment a pixel, of any opacity, 0 and 1 too.
inline ListedFrame single_layers() {
  ListedFrame frame = random_frame("Single", {130, 70}, 0.0, 1 << 24, 31, 0.0f, 1.0f);
  frame.colours[0].a = 0.0f;
  frame.colours[1].a = 1.0f;
  frame.options.background = glm::vec4(0.3f, 0.1f, 0.8f, 0.5f);
  for (int v = 0; v < 70; ++v) {
    for (int u = v % 2; u < 130; u += 2) {
      const auto n = static_cast<std::uint32_t>(v * 130 + u);
      frame.fragments.push_back({u, v, n * 1789 % (1 << 24), n % 50, n % 3 == 0});
    }
  }
  return frame;
}

/// The mean over some frames of the mean square error to the sorted lists.
inline double mean_square(const std::string& choice) {
  double sum = 0.0;
  for (unsigned seed = 60; seed < 66; ++seed) {
    const ListedFrame frame = random_frame("Mixed", {66, 40}, 10.0, 1 << 24, seed, 0.1f, 0.6f);
    const Rendering rendering = render(frame, choice);
    const Image reference{rendering.image.width, rendering.image.height,
                          oracle_picture(frame, Blending::kFrontToBack)};
    sum += std::pow(10.0, -difference(rendering.image, reference).psnr / 10.0);
  }
  return sum / 6.0;
}

}  // namespace strata::transparency
