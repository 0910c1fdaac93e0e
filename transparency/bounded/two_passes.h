#pragma once

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "transparency/stream/tile_stream.h"
#include "transparency/stream/visibility.h"

// A picture of a visibility function: colour = sum of a c T(z) over the fragments, in any order
// (C2). Fragments of equal depth do not attenuate one another, unlike those of sorted lists.

namespace strata::transparency {

/// The sum of a pixel, on its way.
struct VisibleSum {
  glm::vec4* out = nullptr;  ///< colour and transmittance, starts as (0, 0, 0, 1)
  float weight = 0.0f;

  void add(const glm::vec4& fragment, float visible) {
    *out = {glm::vec3(*out) + visible * glm::vec3(fragment), out->a * (1.0f - fragment.a)};
    weight += visible * fragment.a;
  }
  /// Scales the colour so that the weights add up to the opacity, which is known exactly.
  void normalize() const {
    if (weight > 0.0f) *out = {glm::vec3(*out) * ((1.0f - out->a) / weight), out->a};
  }
};

/// The least T of sums that are normalized, so that something is left to normalize.
inline constexpr float kLeastVisible = 1e-6f;

/// Two geometry passes: the function, then the sum.
template <class Kind>
class TwoPasses {
 public:
  TwoPasses(Kind kind, bool normalized)
      : kind_(std::move(kind)),
        normalized_(normalized),
        words_(kTilePixels * kind_.words()),
        weights_(normalized ? kTilePixels : 0) {}

  void render(TileStream& stream, TileImage& image) {
    for_each_pixel(stream, [&](std::uint32_t pixel) { kind_.clear(cell(pixel)); });
    Costs& costs = stream.costs();
    std::uint64_t merged = 0, comparisons = 0;
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const Added added =
          kind_.add(cell(pixel), static_cast<float>(item.depth()), stream.opacity(item));
      merged += added.merged ? 1 : 0;
      comparisons += added.comparisons;
    });
    for_each_pixel(stream, [&](std::uint32_t pixel) { kind_.finish(cell(pixel)); });
    normalized_ ? sum<true>(stream, image) : sum<false>(stream, image);
    costs.stored = stream.size();
    costs.merged = merged;
    costs.kept = stream.size() - merged;
    costs.comparisons = comparisons;
    costs.formula_bytes = costs.allocated_bytes =
        (sizeof(typename Kind::Word) * kind_.words() + (normalized_ ? sizeof(float) : 0)) *
        stream.pixel_count();
  }

 private:
  typename Kind::Word* cell(std::uint32_t pixel) {
    return words_.data() + std::size_t{pixel} * kind_.words();
  }

  template <bool kNormalized>
  void sum(TileStream& stream, TileImage& image) {
    if (kNormalized) std::fill(weights_.begin(), weights_.end(), 0.0f);
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      float visible = kind_.transmittance(cell(pixel), static_cast<float>(item.depth()));
      VisibleSum sum{&image.pixels[pixel]};
      if (kNormalized) {
        visible = std::max(visible, kLeastVisible);
        sum.weight = weights_[pixel];
      }
      sum.add(stream.shade(item), visible);
      if (kNormalized) weights_[pixel] = sum.weight;
    });
    if (!kNormalized) return;
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      VisibleSum{&image.pixels[pixel], weights_[pixel]}.normalize();
    });
  }

  Kind kind_;
  bool normalized_;
  std::vector<typename Kind::Word> words_;
  std::vector<float> weights_;
};

template <class Kind>
TileRenderer two_pass_renderer(const Kind& kind, bool normalized) {
  return [passes = std::make_shared<TwoPasses<Kind>>(kind, normalized)](
             TileStream& stream, TileImage& image) -> Result<void> {
    passes->render(stream, image);
    return {};
  };
}

}  // namespace strata::transparency
