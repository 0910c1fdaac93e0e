#pragma once

#include <atomic>
#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <tuple>
#include <vector>

#include "strata/transparency/media/media.h"
#include "strata/transparency/media/shadow_map.h"
#include "transparency/media/eye_state.h"
#include "transparency/media/media_table.h"
#include "transparency/media/particle_bins.h"
#include "transparency/media/pixel_rays.h"
#include "transparency/media/shadow_tile.h"
#include "transparency/stream/sorted_tile.h"

namespace strata::transparency {

/// What all threads know of a picture with media.
struct MediaFrame {
  const MediaSettings& settings;
  const MediaTable& table;
  const View& view;  ///< of the samples
  const PixelRays& rays;
  const ParticleBins& particles;
  glm::vec4 background{0.0f};  ///< premultiplied
  bool lit = false;            ///< there is a light
  glm::dvec3 to_light{0.0};    ///< eye space, of length 1
  /// Solids in which rays may begin.
  std::span<const EyeSolid> eye_solids = {};
  const Scene* scene = nullptr;
  /// Shadows of the light that falls on surfaces and, if there are steps, on media; or null.
  const ShadowMap* shadows = nullptr;
  /// The tiles of a shadow map, to be filled instead of a picture.
  std::span<ShadowTile> shadow_tiles = {};
  std::uint64_t memory_limit = 0;  ///< bytes of all of them; 0: none
  std::atomic<std::uint64_t>* shadow_bytes = nullptr;

  /// The light that media scatter to the eye is not the same all along a ray.
  [[nodiscard]] bool light_changes() const {
    return lit && (settings.light.point || (shadows != nullptr && settings.light.shadow_steps > 0));
  }
};

/// A ray of the picture, in world space.
struct WorldRay {
  glm::dvec3 origin{0.0}, direction{0.0};  ///< of length 1
};

/// The walks along the rays of a tile, for one thread.
class MediaTile {
 public:
  explicit MediaTile(const MediaFrame& frame);

  Result<void> render(TileStream& stream, TileImage& image);

  /// What was seen of each solid; `object` is empty.
  [[nodiscard]] const std::vector<SolidReport>& reports() const { return reports_; }

 private:
  /// What a walk has reached.
  struct Ray {
    Float4 depth = splat(0.0f);       ///< optical depth of the media so far
    float at = 0.0f;                  ///< distance along the ray
    Float4 light = splat(0.0f);       ///< that media scatter to the eye
    Float4 glow = splat(0.0f);        ///< of it, with the albedo of the media at hand
    Float4 albedo = splat(0.0f);      ///< of the media at hand
    Float4 extinction = splat(0.0f);  ///< of the media at hand
    MediaSums sums;
  };
  /// A part of a ray: a segment through media, then perhaps a surface. Parts are collected first,
  /// so that the exponential functions of a ray do not wait for one another.
  struct Part {
    Float4 depth;    ///< optical depth from the eye to the end of the segment
    Float4 glow;     ///< light and albedo
    Float4 surface;  ///< premultiplied colour, opacity; in a shadow map what comes through
    float at;        ///< distance along the ray
  };
  struct SolidState {
    std::int32_t inside = 0;  ///< times that the ray has entered it more than it has left it
    std::uint32_t last = 0;   ///< the last pixel that crossed it, counted over all tiles
  };

  void walk(std::uint32_t pixel, int u, int v);
  bool walk_back(std::span<const DepthItem> list);
  void begin_inside(const PixelRay& view_ray, Ray& ray);
  void leave_out_unbalanced(std::span<const DepthItem> list);
  void pass_particles(float until, Ray& ray);
  void cross(std::uint32_t solid, bool exit, Ray& ray);
  void move_to(float distance, Ray& ray);
  static void change(Ray& ray);
  void move_in_changing_light(float distance, Ray& ray);
  [[nodiscard]] Float4 light_at(const glm::dvec3& point) const;
  void add_surface(DepthItem item, const Ray& ray);
  [[nodiscard]] glm::vec4 shade(DepthItem item) const;
  [[nodiscard]] float distance_of(DepthItem item) const {
    return static_cast<float>(distances_(item.depth()) * along_);
  }
  void finish(std::uint32_t pixel);
  void finish_shadow();
  Result<void> finish_shadow_tile();

  const MediaFrame& frame_;
  DepthDistances distances_;
  std::vector<Part> parts_;  ///< of the ray
  std::vector<SolidReport> reports_;
  std::vector<SolidState> solids_;
  std::vector<std::uint32_t> crossed_;  ///< the solid of each item of a list, or kNone
  std::vector<float> distance_;         ///< of each item, along the ray
  std::uint32_t pixels_ = 0;            ///< that were walked
  SortedTile lists_;
  ParticleBins::Tile particles_;
  /// Crossings before the near plane: distance, solid, whether the ray enters.
  std::vector<std::tuple<float, std::uint32_t, bool>> starts_;
  std::vector<std::uint8_t> may_hold_eye_;  ///< of each solid
  std::span<const ParticleEvent> events_;   ///< of the pixel, those to come
  TileStream* stream_ = nullptr;
  TileImage* image_ = nullptr;
  double along_ = 1.0;  ///< world units along the ray per unit along the view axis
  WorldRay world_ray_;  ///< where light changes or surfaces are lit by the light
  const bool light_changes_, relit_, shadow_;
  const Float4 no_surface_;  ///< of a part
  ShadowTile* shadow_tile_ = nullptr;
};

}  // namespace strata::transparency
