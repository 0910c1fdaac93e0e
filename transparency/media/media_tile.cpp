#include "transparency/media/media_tile.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

// "Order-independent transparency with per-pixel linked lists" and volumetric attenuation: media of
// constant extinction and albedo between the crossings of a ray, for which the equation of
// radiative transfer has a closed form. We differ: the sums of the media at hand are exact and
// return to 0; surfaces may lie between media; all numbers are kept for red, green and blue.

namespace strata::transparency {
namespace {

/// The part of a light from a direction that is scattered into a sphere's unit of another one:
/// Rayleigh's phase function.
double rayleigh(double cosine) { return 3.0 / (16.0 * std::numbers::pi) * (1.0 + cosine * cosine); }

}  // namespace

MediaTile::MediaTile(const MediaFrame& frame)
    : frame_(frame),
      distances_(frame.view),
      reports_(frame.table.solids.size()),
      solids_(frame.table.solids.size()),
      may_hold_eye_(frame.table.solids.size(), 0),
      light_changes_(frame.light_changes()),
      relit_(frame.shadows != nullptr),
      shadow_(!frame.shadow_tiles.empty()),
      no_surface_(splat(shadow_ ? 1.0f : 0.0f)) {
  for (const EyeSolid& eye : frame.eye_solids) may_hold_eye_[eye.solid] = 1;
}

Result<void> MediaTile::render(TileStream& stream, TileImage& image) {
  stream_ = &stream, image_ = &image;
  lists_.build(stream);
  const PixelRect& rect = stream.rect();
  frame_.particles.tile(rect.u0 / kTileSide, rect.v0 / kTileSide, particles_);
  Costs& costs = stream.costs();
  costs.stored = costs.kept = lists_.size() + particles_.events.size();
  costs.most_layers = lists_.most_layers();
  costs.formula_bytes = costs.allocated_bytes = 8 * costs.stored + 8 * stream.pixel_count();
  if (costs.stored == 0 && frame_.eye_solids.empty() && !relit_) return {};
  if (shadow_) {
    const int across = (stream.frame().size.x + kTileSide - 1) / kTileSide;
    const int tile = rect.v0 / kTileSide * across + rect.u0 / kTileSide;
    shadow_tile_ = &frame_.shadow_tiles[static_cast<std::size_t>(tile)];
    shadow_tile_->ends.assign(kTilePixels, 0);
  }
  for (int v = 0; v < stream.height(); ++v) {
    for (int u = 0; u < stream.width(); ++u) {
      const auto pixel = static_cast<std::uint32_t>(v * kTileSide + u);
      events_ = particles_.of(pixel);
      if (lists_.list(pixel).empty() && events_.empty() && frame_.eye_solids.empty() &&
          !(relit_ && stream.opaque(pixel) != TileFragments::kNothing))
        continue;
      walk(pixel, rect.u0 + u, rect.v0 + v);
      if (shadow_)
        shadow_tile_->ends[pixel] = static_cast<std::uint32_t>(shadow_tile_->entries.size());
    }
  }
  return shadow_ ? finish_shadow_tile() : Result<void>();
}

Result<void> MediaTile::finish_shadow_tile() {
  // Pixels without a list end where those before them do.
  std::uint32_t last = 0;
  for (std::uint32_t& end : shadow_tile_->ends) last = end = std::max(end, last);
  shadow_tile_->entries.shrink_to_fit();
  const std::uint64_t bytes = shadow_tile_->entries.size() * sizeof(ShadowEntry) +
                              shadow_tile_->ends.size() * sizeof(std::uint32_t);
  const std::uint64_t all = frame_.shadow_bytes->fetch_add(bytes) + bytes;
  if (frame_.memory_limit != 0 && all > frame_.memory_limit) {
    return fail(ErrorCode::kLimit,
                "the shadow map needs more than {} bytes, the memory limit; a smaller shadow size "
                "needs less",
                frame_.memory_limit);
  }
  return {};
}

/// From the far end, where there is vacuum, to the near plane: how often is the ray inside of each
/// solid there? @return whether it is inside of none
inline bool MediaTile::walk_back(std::span<const DepthItem> list) {
  ++pixels_;
  if (crossed_.size() < list.size()) {
    crossed_.resize(2 * list.size());
    distance_.resize(2 * list.size());
  }
  int inside = 0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::uint32_t solid = frame_.table.medium_of[stream_->object(list[i])];
    crossed_[i] = solid;
    distance_[i] = distance_of(list[i]);
    if (solid == MediaTable::kNone) continue;
    SolidState& state = solids_[solid];
    const int before = state.inside;
    state.inside += list[i].exit() ? 1 : -1;
    inside += (state.inside != 0 ? 1 : 0) - (before != 0 ? 1 : 0);
    if (state.last != pixels_) {
      state.last = pixels_;
      ++reports_[solid].pixels;
    }
  }
  return inside == 0;
}

/// Where a ray does not enter a solid as often as it leaves it, and cannot begin in it.
void MediaTile::leave_out_unbalanced(std::span<const DepthItem> list) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::uint32_t solid = crossed_[i];
    if (solid == MediaTable::kNone || solids_[solid].inside == 0 || may_hold_eye_[solid] != 0) {
      continue;
    }
    ++reports_[solid].unbalanced_pixels;
    solids_[solid].inside = 0;
    for (std::size_t k = i; k < list.size(); ++k) {
      if (crossed_[k] == solid) crossed_[k] = MediaTable::kNone;
    }
  }
}

/// From the eye to the near plane. No list has crossings there: the wall of a solid that holds the
/// eye or the near plane, but not both, is taken to be its nearest triangle's plane.
void MediaTile::begin_inside(const PixelRay& view_ray, Ray& ray) {
  starts_.clear();
  const double near = frame_.view.near;
  for (const EyeSolid& eye : frame_.eye_solids) {
    const bool near_inside = solids_[eye.solid].inside != 0;
    if (!eye.eye_inside && !near_inside) continue;
    if (eye.eye_inside) starts_.emplace_back(0.0f, eye.solid, true);
    if (eye.eye_inside && near_inside) continue;
    const double wall = eye.wall(view_ray.direction, near) * along_;
    starts_.emplace_back(static_cast<float>(wall), eye.solid, near_inside);
  }
  std::sort(starts_.begin(), starts_.end());
  for (const auto& [distance, solid, enters] : starts_) {
    pass_particles(distance, ray);
    move_to(distance, ray);
    if (enters) {
      ray.sums.add(frame_.table.solids[solid]);
    } else {
      ray.sums.remove(frame_.table.solids[solid]);
    }
    change(ray);
  }
}

void MediaTile::pass_particles(float until, Ray& ray) {
  std::size_t passed = 0;
  for (; passed < events_.size() && events_[passed].distance() <= until; ++passed) {
    const ParticleEvent event = events_[passed];
    move_to(event.distance(), ray);
    const MediumTerms& terms = frame_.table.particles[event.particle()];
    if (event.exit()) {
      ray.sums.remove(terms);
    } else {
      ray.sums.add(terms);
    }
    change(ray);
  }
  events_ = events_.subspan(passed);
}

inline void MediaTile::cross(std::uint32_t solid, bool exit, Ray& ray) {
  std::int32_t& inside = solids_[solid].inside;
  const bool before = inside != 0;
  inside += exit ? -1 : 1;
  if (before == (inside != 0)) return;
  if (before) {
    ray.sums.remove(frame_.table.solids[solid]);
  } else {
    ray.sums.add(frame_.table.solids[solid]);
  }
  change(ray);
}

/// Through the media at hand, which scatter `glow` and let e^-depth through.
inline void MediaTile::move_to(float distance, Ray& ray) {
  if (distance > ray.at && (ray.sums.media() > 0 || shadow_)) {
    if (light_changes_) return move_in_changing_light(distance, ray);
    ray.depth += ray.extinction * splat(distance - ray.at);
    parts_.push_back({ray.depth, ray.glow, no_surface_, distance});
  }
  ray.at = distance;
}

/// In steps, each with the light in its middle.
void MediaTile::move_in_changing_light(float distance, Ray& ray) {
  const int steps = frame_.shadows == nullptr ? 1 : std::max(1, frame_.settings.light.shadow_steps);
  const float from = ray.at, step = (distance - from) / static_cast<float>(steps);
  const Float4 depth = ray.depth, all = ray.extinction * splat(distance - from);
  for (int i = 0; i < steps; ++i) {
    const double middle = static_cast<double>(from) + (i + 0.5) * static_cast<double>(step);
    const Float4 light = light_at(world_ray_.origin + middle * world_ray_.direction);
    ray.depth = depth + all * splat(static_cast<float>(i + 1) / static_cast<float>(steps));
    parts_.push_back({ray.depth, ray.albedo * light, no_surface_, distance});
  }
  ray.at = distance;
}

/// What media at a point scatter to the eye.
Float4 MediaTile::light_at(const glm::dvec3& point) const {
  const MediaLight& light = frame_.settings.light;
  const glm::dvec3 to_light = light.point ? light.at - point : light.at;
  const double length = glm::length(to_light);
  const double cosine = length > 0.0 ? glm::dot(to_light, world_ray_.direction) / length : 0.0;
  Float4 radiance = from(light.radiance) * splat(static_cast<float>(rayleigh(cosine)));
  if (frame_.shadows != nullptr && light.shadow_steps > 0) {
    radiance *= from(frame_.shadows->transmittance(point));
  }
  return from(frame_.settings.ambient) + radiance;
}

/// After the media at hand have changed.
inline void MediaTile::change(Ray& ray) {
  ray.extinction = ray.sums.extinction();
  ray.albedo = ray.sums.albedo();
  ray.glow = ray.albedo * ray.light;
}

/// The colour of a surface, premultiplied, and its opacity.
glm::vec4 MediaTile::shade(DepthItem item) const {
  if (!relit_) return stream_->shade(item);
  const Scene& scene = *frame_.scene;
  const glm::uvec3& triangle = scene.mesh.triangles[item.triangle()];
  const glm::dvec3& corner = scene.mesh.positions[triangle.x];
  const glm::dvec3 normal = glm::cross(scene.mesh.positions[triangle.y] - corner,
                                       scene.mesh.positions[triangle.z] - corner);
  const glm::vec4& base = frame_.table.looks[stream_->object(item)].colour;
  const auto& [origin, direction] = world_ray_;
  const double against = glm::dot(normal, direction);
  double distance = glm::dot(normal, corner - origin) / against;
  if (!std::isfinite(distance)) distance = static_cast<double>(distance_of(item));
  const glm::dvec3 point = origin + distance * direction;
  const MediaLight& light = frame_.settings.light;
  const glm::dvec3 to_light = light.point ? light.at - point : light.at;
  const double towards = glm::dot(normal, to_light);
  const double lengths = glm::length(normal) * glm::length(to_light);
  double cosine = lengths > 0.0 ? std::abs(towards) / lengths : 0.0;
  // An opaque surface is dark if the light is behind it.
  if (base.a >= 1.0f && (towards > 0.0) != (against < 0.0)) cosine = 0.0;
  glm::vec3 lit = frame_.settings.ambient;
  if (cosine > 0.0) {
    const auto part = static_cast<float>(cosine / std::numbers::pi);
    lit += part * light.radiance * frame_.shadows->transmittance(point, normal);
  }
  return {glm::vec3(base) * base.a * lit, base.a};
}

inline void MediaTile::add_surface(DepthItem item, const Ray& ray) {
  Float4 surface;
  if (shadow_) {
    const glm::vec4& base = frame_.table.looks[stream_->object(item)].colour;
    const float rest = 1.0f - base.a;
    surface = splat(rest) * (splat(rest) + splat(base.a) * from(glm::vec3(base)));
  } else {
    const glm::vec4 colour = shade(item);
    surface = Float4{colour.r, colour.g, colour.b, colour.a};
  }
  parts_.push_back({ray.depth, splat(0.0f), surface, ray.at});
}

/// The parts become a ray of the shadow map.
void MediaTile::finish_shadow() {
  ShadowEntry entry;
  for (const Part& part : parts_) {
    entry.at = part.at;
    entry.depth = to_vec3(part.depth);
    entry.surfaces *= to_vec3(part.surface);
    shadow_tile_->entries.push_back(entry);
    if (entry.surfaces == glm::vec3(0.0f)) return;
  }
}

/// A picture keeps one transmittance: what the three differ by is applied to what lies behind.
inline void MediaTile::finish(std::uint32_t pixel) {
  if (shadow_) return finish_shadow();
  for (Part& part : parts_) part.depth = exp_minus(part.depth);
  Float4 gathered = splat(0.0f), media = splat(1.0f);
  float surfaces = 1.0f;
  for (const Part& part : parts_) {
    gathered += splat(surfaces) * (part.glow * (media - part.depth));
    media = part.depth;
    gathered += splat(surfaces) * media * part.surface;
    surfaces *= 1.0f - part.surface[3];
  }
  const glm::vec3 through = to_vec3(splat(surfaces) * media), colour = to_vec3(gathered);
  glm::vec4& out = image_->pixels[pixel];
  const DepthItem opaque = stream_->opaque(pixel);
  if (opaque != TileFragments::kNothing && relit_) {
    out = glm::vec4(colour + through * glm::vec3(shade(opaque)), 0.0f);
    return;
  }
  if (through.x == through.y && through.y == through.z) {
    out = glm::vec4(colour, through.x);
    return;
  }
  if (opaque != TileFragments::kNothing) {
    out = glm::vec4(colour + through * glm::vec3(stream_->shade(opaque)), 0.0f);
    return;
  }
  const float mean = (through.x + through.y + through.z) / 3.0f;
  out = glm::vec4(colour + (through - mean) * glm::vec3(frame_.background), mean);
}

/// From the first crossing to the last one in front of the nearest opaque object.
void MediaTile::walk(std::uint32_t pixel, int u, int v) {
  const std::span<const DepthItem> list = lists_.list(pixel);
  const PixelRay view_ray = frame_.rays.ray(u, v);
  along_ = view_ray.length;
  parts_.clear();
  Ray ray;
  ray.light = from(frame_.settings.ambient);
  if (light_changes_ || relit_) {
    const glm::dmat4& world = frame_.rays.world_from_eye();
    world_ray_ = {glm::dvec3(world * glm::dvec4(view_ray.origin, 1.0)),
                  glm::dmat3(world) * view_ray.direction / along_};
  }
  if (frame_.lit && !light_changes_) {
    const double cosine = glm::dot(view_ray.direction, frame_.to_light) / along_;
    ray.light += from(frame_.settings.light.radiance) * splat(static_cast<float>(rayleigh(cosine)));
  }
  const DepthItem opaque = stream_->opaque(pixel);
  if (!walk_back(list)) leave_out_unbalanced(list);
  if (!frame_.eye_solids.empty()) begin_inside(view_ray, ray);
  std::size_t i = 0;
  for (; i < list.size() && !(opaque < list[i]); ++i) {
    const std::uint32_t solid = crossed_[i];
    if (solid != MediaTable::kNone || ray.sums.media() > 0 || !events_.empty() || shadow_) {
      if (!events_.empty()) pass_particles(distance_[i], ray);
      move_to(distance_[i], ray);
    }
    if (solid == MediaTable::kNone || frame_.table.surface[solid] != 0) add_surface(list[i], ray);
    if (solid != MediaTable::kNone) cross(solid, list[i].exit(), ray);
  }
  for (std::size_t k = i; k < list.size(); ++k) {
    if (crossed_[k] != MediaTable::kNone) solids_[crossed_[k]].inside = 0;
  }
  if (opaque != TileFragments::kNothing) {
    const float distance = distance_of(opaque);
    pass_particles(distance, ray);
    move_to(distance, ray);
  } else {
    pass_particles(std::numeric_limits<float>::infinity(), ray);
    assert(ray.sums.vacuum());
  }
  finish(pixel);
}

}  // namespace strata::transparency
