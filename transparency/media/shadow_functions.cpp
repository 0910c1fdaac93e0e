#include "transparency/media/shadow_functions.h"

#include <cmath>
#include <utility>

namespace strata::transparency {
namespace {

/// Occluders that a way through media becomes: these functions know points alone.
constexpr int kPartsOfMedia = 16;

float mean(const glm::vec3& v) { return (v.x + v.y + v.z) / 3.0f; }

/// Functions of one kind, such as OpacityShadowMap.
template <class Kind>
class Functions final : public ShadowFunctions {
 public:
  Functions(const Kind& kind, std::vector<ShadowTile>& tiles, const Execution& execution)
      : kind_(kind), words_(tiles.size()) {
    parallel_for(execution, tiles.size(), [&](std::size_t tile, int) {
      if (tiles[tile].ends.empty()) return;
      words_[tile].resize(kind_.words() * kTilePixels);
      for (std::uint32_t pixel = 0; pixel < kTilePixels; ++pixel) {
        add(tiles[tile].ray(pixel), words_[tile].data() + kind_.words() * pixel);
      }
      tiles[tile] = ShadowTile{};
    });
  }

  [[nodiscard]] float through(int tile, std::uint32_t pixel, float distance) const override {
    const auto& words = words_[static_cast<std::size_t>(tile)];
    if (words.empty()) return 1.0f;
    return kind_.transmittance(words.data() + kind_.words() * pixel, distance);
  }

 private:
  void add(std::span<const ShadowEntry> ray, typename Kind::Word* words) const {
    kind_.clear(words);
    ShadowEntry before;
    for (const ShadowEntry& entry : ray) {
      const float depth = mean(entry.depth - before.depth) / kPartsOfMedia;
      for (int i = 0; i < kPartsOfMedia && depth > 0.0f; ++i) {
        const float part = (static_cast<float>(i) + 0.5f) / kPartsOfMedia;
        kind_.add(words, before.at + part * (entry.at - before.at), -std::expm1(-depth));
      }
      const float was = mean(before.surfaces), is = mean(entry.surfaces);
      if (is < was) kind_.add(words, entry.at, 1.0f - is / was);
      before = entry;
    }
    kind_.finish(words);
  }

  Kind kind_;
  std::vector<std::vector<typename Kind::Word>> words_;  ///< of each tile
};

template <class Kind>
std::unique_ptr<ShadowFunctions> make(const Kind& kind, std::vector<ShadowTile>& tiles,
                                      const Execution& execution) {
  return std::make_unique<Functions<Kind>>(kind, tiles, execution);
}

}  // namespace

std::unique_ptr<ShadowFunctions> make_shadow_functions(const MediaLight& light,
                                                       std::vector<ShadowTile>& tiles,
                                                       const DepthRange& range,
                                                       const Execution& execution) {
  const auto count = static_cast<unsigned>(light.visibility_size);
  switch (light.visibility) {
    case ShadowVisibility::kLists:
      break;
    case ShadowVisibility::kSlices:
      return make(OpacityShadowMap(count, range), tiles, execution);
    case ShadowVisibility::kOccupancy:
      return make(OccupancyMap(count, range), tiles, execution);
    case ShadowVisibility::kFourier:
      return make(FourierOpacityMap(count, range), tiles, execution);
    case ShadowVisibility::kNodes:
      return make(AdaptiveNodes(count), tiles, execution);
  }
  return nullptr;
}

}  // namespace strata::transparency
