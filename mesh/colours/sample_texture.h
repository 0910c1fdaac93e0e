#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <span>

#include "mesh/colours/light_tables.h"
#include "strata/mesh/mesh_attributes.h"

// Private to mesh/colours.

namespace strata {

/// One level of a mip map: the texture itself, sRGB with straight alpha, or one of its halves.
struct TextureLevel {
  int width = 0, height = 0;
  const glm::u8vec4* texture = nullptr;
  const LightTexel* half = nullptr;
};

/// How places of a texture are sampled.
struct TextureSampling {
  static constexpr std::size_t kPlaces = 64;  ///< at a time

  TextureWrap wrap_u = TextureWrap::kRepeat, wrap_v = TextureWrap::kRepeat;
  bool opaque = false;  ///< alpha of the texture is 255 everywhere
  TextureLevel level, next;
  float part = 0.0f;  ///< of the next level; 0: there need not be one
  int probes = 1;
  glm::dvec2 step{0.0};  ///< from probe to probe
};

/// The sums of light times alpha, and of alpha, 1 at most, over the probes about each place: (0, 0)
/// is the upper left corner of the texture, (1, 1) its lower right one.
/// @pre coordinates are below 2^31
void sample_texture(const TextureSampling& how, std::span<const glm::dvec2> places,
                    std::span<Float4> sums);

}  // namespace strata
