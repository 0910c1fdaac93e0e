#include "strata/transparency/media/fxaa.h"

#include <algorithm>
#include <cmath>
#include <glm/vec2.hpp>
#include <vector>

// T. Lottes, "FXAA" (NVIDIA white paper, 2009), and the quality path of its version 3.11. We
// differ: the search along an edge goes pixel by pixel, brightness is that of the picture before
// grey, so that edges of what is drawn over nothing count, too.

namespace strata::transparency {
namespace {

/// How bright a premultiplied linear colour looks before grey.
float brightness(const glm::vec4& c) {
  const float light = 0.2126f * c.r + 0.7152f * c.g + 0.0722f * c.b + 0.25f * (1.0f - c.a);
  return std::sqrt(std::max(0.0f, light));
}

class Filter {
 public:
  Filter(const Image& image, const FxaaOptions& options)
      : image_(image), options_(options), bright_(image.pixels.size()) {}

  void measure(int v) {
    for (int u = 0; u < image_.width; ++u)
      bright_[at({u, v})] = brightness(image_.pixels[at({u, v})]);
  }

  [[nodiscard]] glm::vec4 pixel(const glm::ivec2& p) const {
    const float m = bright(p), n = bright(p + kNorth), s = bright(p - kNorth);
    const float e = bright(p + kEast), w = bright(p - kEast);
    const float most = std::max({m, n, s, e, w}), range = most - std::min({m, n, s, e, w});
    const glm::vec4& own = image_.pixels[at(p)];
    if (range < std::max(options_.least_contrast, most * options_.contrast)) return own;
    const float nw = bright(p + kNorth - kEast), ne = bright(p + kNorth + kEast);
    const float sw = bright(p - kNorth - kEast), se = bright(p - kNorth + kEast);
    const float across_rows = std::abs(nw + sw - 2.0f * w) + 2.0f * std::abs(n + s - 2.0f * m) +
                              std::abs(ne + se - 2.0f * e);
    const float across_columns = std::abs(nw + ne - 2.0f * n) + 2.0f * std::abs(w + e - 2.0f * m) +
                                 std::abs(sw + se - 2.0f * s);
    const bool along_row = across_rows >= across_columns;
    const float one = along_row ? n : w, other = along_row ? s : e;
    const bool first = std::abs(one - m) >= std::abs(other - m);
    const glm::ivec2 towards_one = along_row ? kNorth : -kEast;
    const Edge edge{first ? towards_one : -towards_one, along_row ? kEast : kNorth,
                    0.5f * (m + (first ? one : other)),
                    0.25f * std::abs((first ? one : other) - m)};
    const float single = std::abs((2.0f * (n + s + e + w) + nw + ne + sw + se) / 12.0f - m);
    const float c = std::clamp(single / range, 0.0f, 1.0f);
    const float smooth = c * c * (3.0f - 2.0f * c);
    const float part = std::max(offset(p, edge, m), smooth * smooth * options_.smoothing);
    return own + part * (image_.pixels[at(clamped(p + edge.across))] - own);
  }

 private:
  static constexpr glm::ivec2 kNorth{0, -1}, kEast{1, 0};

  /// An edge between a pixel and its neighbour `across`.
  struct Edge {
    glm::ivec2 across, along;
    float middle;  ///< brightness between both
    float end;     ///< where it changes by more, the edge ends
  };

  [[nodiscard]] glm::ivec2 clamped(const glm::ivec2& p) const {
    return {std::clamp(p.x, 0, image_.width - 1), std::clamp(p.y, 0, image_.height - 1)};
  }
  [[nodiscard]] std::size_t at(const glm::ivec2& p) const {
    return static_cast<std::size_t>(p.y) * static_cast<std::size_t>(image_.width) +
           static_cast<std::size_t>(p.x);
  }
  [[nodiscard]] float bright(const glm::ivec2& p) const { return bright_[at(clamped(p))]; }

  /// How far the edge goes in a direction, and how much brighter than its middle its end is.
  struct End {
    int distance;
    float change;
    bool found;
  };
  [[nodiscard]] End end_of(const glm::ivec2& p, const Edge& edge, int sign) const {
    End end{0, 0.0f, false};
    for (int i = 1; i <= options_.search && !end.found; ++i) {
      const glm::ivec2 q = p + sign * i * edge.along;
      end.distance = i;
      end.change = 0.5f * (bright(q) + bright(q + edge.across)) - edge.middle;
      end.found = std::abs(end.change) >= edge.end;
    }
    return end;
  }

  /// The part of the neighbour that a pixel gets: half at the end of an edge where the pixel is on
  /// the side that ends, none in its middle.
  [[nodiscard]] float offset(const glm::ivec2& p, const Edge& edge, float own) const {
    const End back = end_of(p, edge, -1), ahead = end_of(p, edge, 1);
    const End& nearer = back.distance < ahead.distance ? back : ahead;
    if (!nearer.found) return 0.0f;
    const bool darker = own - edge.middle < 0.0f;
    if ((nearer.change < 0.0f) == darker) return 0.0f;
    // Ends lie between pixels.
    const float length = static_cast<float>(back.distance + ahead.distance - 1);
    return 0.5f - (static_cast<float>(nearer.distance) - 0.5f) / length;
  }

  const Image& image_;
  const FxaaOptions& options_;
  std::vector<float> bright_;
};

}  // namespace

Image fxaa(const Image& image, const FxaaOptions& options, const Execution& execution) {
  Image filtered{image.width, image.height, std::vector<glm::vec4>(image.pixels.size())};
  Filter filter(image, options);
  const auto rows = static_cast<std::size_t>(image.height);
  parallel_for(execution, rows, [&](std::size_t v, int) { filter.measure(static_cast<int>(v)); });
  parallel_for(execution, rows, [&](std::size_t v, int) {
    const auto row = static_cast<int>(v);
    for (int u = 0; u < image.width; ++u) {
      filtered.pixels[v * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(u)] =
          filter.pixel({u, row});
    }
  });
  return filtered;
}

}  // namespace strata::transparency
