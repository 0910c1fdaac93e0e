#pragma once

#include <cstdint>
#include <vector>

#include "mesh/colours/sample_texture.h"
#include "strata/core/execution.h"
#include "strata/mesh/mesh_attributes.h"

// Private to mesh/colours.
//
// This work is based on:
// Lance Williams. Pyramidal parametrics. 1983.
// Joel McCormack et al. Feline: fast elliptical lines for anisotropic texture mapping. 1999.

namespace strata {

/// A texture and its halves: texels of each level are means of those of the level before, in linear
/// light, weighted by alpha. A level has half as many texels as the last along each side, rounded
/// down; where a side is odd the box of a texel cuts through texels.
class MipMap {
 public:
  explicit MipMap(const Texture& texture) : texture_(&texture) {}
  /// Makes all levels. Rows are made by several threads.
  void make_levels(const Execution& execution);

  /// How places are sampled. @param level 0 or more; between two levels both count
  [[nodiscard]] TextureSampling sampling(float level) const;

  [[nodiscard]] int width() const { return texture_->width; }
  [[nodiscard]] int height() const { return texture_->height; }
  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<LightTexel> texels;
  };
  [[nodiscard]] TextureLevel level(std::size_t number) const;
  /// Row y of levels_[number]. @param light of a texel of the level before
  template <class Light>
  void halve_row(std::size_t number, int y, const Light& light);
  void make_row(std::size_t number, int y);

  const Texture* texture_;
  std::vector<Level> levels_;  // from 1 on
  bool opaque_ = false;
};

}  // namespace strata
