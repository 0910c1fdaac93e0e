#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "strata/raster/raster_target.h"
#include "strata/raster/view.h"
#include "strata/transparency/media/media.h"
#include "transparency/media/pixel_rays.h"

namespace strata::transparency {

/// Where a ray enters or leaves a particle. Sorted by distance, then entering before leaving of
/// another one with a greater index.
/// [distance along the ray, as an ordered float:32 | particle:31 | exit:1]
struct ParticleEvent {
  std::uint64_t bits = 0;

  ParticleEvent() = default;
  ParticleEvent(float distance, std::uint32_t particle, bool exit);
  [[nodiscard]] float distance() const;
  [[nodiscard]] std::uint32_t particle() const { return static_cast<std::uint32_t>(bits) >> 1; }
  [[nodiscard]] bool exit() const { return (bits & 1) != 0; }
  friend auto operator<=>(ParticleEvent, ParticleEvent) = default;
};

/// Particles as a view sees them, by tiles.
class ParticleBins {
 public:
  ParticleBins(std::span<const Particle> particles, const View& view, const PixelRays& rays);

  [[nodiscard]] bool empty() const { return balls_.empty(); }

  /// The events of a tile, pixel by pixel, each pixel's sorted.
  struct Tile {
    std::vector<std::uint32_t> ends;  ///< as SortedTile has them
    std::vector<ParticleEvent> events;
    std::vector<glm::dvec3> directions;    // scratch: of each pixel, of length 1
    std::vector<std::uint32_t> pixels;     // scratch
    std::vector<ParticleEvent> unordered;  // scratch

    [[nodiscard]] std::span<const ParticleEvent> of(std::uint32_t pixel) const {
      if (events.empty()) return {};
      return std::span(events).subspan(ends[pixel], ends[pixel + 1] - ends[pixel]);
    }
  };
  void tile(int tu, int tv, Tile& out) const;

 private:
  struct Ball {
    glm::dvec3 centre;  ///< eye space
    double radius = 0.0;
    std::uint32_t particle = 0;
    PixelRect rect;  ///< pixels whose rays may meet it
  };
  void add(const Ball& ball, const PixelRect& clip, Tile& out) const;

  const PixelRays& rays_;
  int tiles_u_ = 0;
  std::vector<Ball> balls_;
  std::vector<std::size_t> offsets_;    ///< of each tile: its part of `members_`
  std::vector<std::uint32_t> members_;  ///< indices of balls
};

}  // namespace strata::transparency
