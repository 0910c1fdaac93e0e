#include "strata/transparency/media/shadow_map.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#include "transparency/media/float4.h"
#include "transparency/media/media_tile.h"
#include "transparency/media/shadow_functions.h"
#include "transparency/stream/mesh_source.h"
#include "transparency/stream/render_tiles.h"

// S. Lefebvre, S. Hornus, A. Lasram, "HA-buffer: coherent hashing for single-pass A-buffer" (2013):
// translucent shadow maps, a second set of lists seen from the light. We differ: media and
// particles cast shadows, too, and the bias is derived.

namespace strata::transparency {
namespace {

/// One picture seen from the light.
struct ShadowFace {
  explicit ShadowFace(const View& of)
      : view(of), rays(of), tiles_u((of.size.x + kTileSide - 1) / kTileSide) {
    tiles.resize(static_cast<std::size_t>(tiles_u) * static_cast<std::size_t>(tiles_u));
  }

  View view;
  PixelRays rays;
  int tiles_u;
  std::vector<ShadowTile> tiles;
  std::unique_ptr<ShadowFunctions> functions;  ///< instead of lists

  /// What comes through all that is nearer than `limit` along the ray of a pixel.
  [[nodiscard]] glm::vec3 through(int u, int v, double limit) const {
    const int tile = v / kTileSide * tiles_u + u / kTileSide;
    const auto pixel = static_cast<std::uint32_t>(v % kTileSide * kTileSide + u % kTileSide);
    if (functions) return glm::vec3(functions->through(tile, pixel, static_cast<float>(limit)));
    return through(tiles[static_cast<std::size_t>(tile)].ray(pixel), limit);
  }

 private:
  static glm::vec3 through(std::span<const ShadowEntry> list, double limit);
};

constexpr std::array<glm::dvec3, 6> kSides{glm::dvec3(1, 0, 0), glm::dvec3(-1, 0, 0),
                                           glm::dvec3(0, 1, 0), glm::dvec3(0, -1, 0),
                                           glm::dvec3(0, 0, 1), glm::dvec3(0, 0, -1)};

/// The views of a light on what lies in `box`.
Result<std::vector<View>> light_views(const MediaLight& light, const Bounds& box) {
  std::vector<View> views;
  const glm::ivec2 size(light.shadow_size);
  std::vector<Camera> cameras;
  if (light.point) {
    for (const glm::dvec3& side : kSides) {
      cameras.push_back(look_at(light.at, light.at + side));
      cameras.back().field_of_view = 90.0;
    }
  } else {
    const glm::dvec3 centre = 0.5 * (box.low + box.high);
    const double radius = 0.5 * glm::length(box.high - box.low) * (1.0 + 1e-6) + 1e-12;
    Camera& camera =
        cameras.emplace_back(look_at(centre + glm::normalize(light.at) * (2.0 * radius), centre));
    camera.projection = Projection::kOrthographic;
    camera.field_of_view = glm::degrees(2.0 * std::atan(0.5));  // as high as the ball about the box
  }
  for (const Camera& camera : cameras) {
    auto view = make_view(camera, size, box);
    if (!view) return tl::unexpected(view.error());
    views.push_back(*view);
  }
  return views;
}

/// The lists of all rays of a face.
Result<void> fill(ShadowFace& face, const Scene& scene, const MediaSettings& settings,
                  const MediaTable& table, std::atomic<std::uint64_t>& bytes,
                  const Execution& execution) {
  const auto source = make_mesh_source(scene, table.looks, face.view, 1, execution);
  if (!source) return tl::unexpected(source.error());
  const ParticleBins particles(settings.particles, face.view, face.rays);
  MediaFrame frame{settings, table, face.view, face.rays, particles};
  std::vector<EyeSolid> eye_solids;
  if ((*source)->triangles()->part.cut) {
    eye_solids = find_eye_solids(scene, table, face.view, execution);
    frame.eye_solids = eye_solids;
  }
  frame.shadow_tiles = face.tiles;
  frame.shadow_bytes = &bytes;
  frame.memory_limit = execution.memory_limit;
  const auto make = [&frame]() -> Result<TileRenderer> {
    return [tile = std::make_shared<MediaTile>(frame)](TileStream& stream, TileImage& image) {
      return tile->render(stream, image);
    };
  };
  auto done = render_tiles(**source, {}, make, true, execution);
  if (!done) return tl::unexpected(done.error());
  if (settings.light.visibility != ShadowVisibility::kLists) {
    // The corners' rays are the longest. With some room at both ends: what lies in the last slice
    // shades nothing, and a series goes on at its beginning.
    const double nearest = face.view.near;
    const double farthest = face.view.far * face.rays.ray(0, 0).length;
    const double room = (farthest - nearest) / 16.0;
    const DepthRange range{static_cast<float>(nearest - room), static_cast<float>(farthest + room)};
    face.functions = make_shadow_functions(settings.light, face.tiles, range, execution);
  }
  return {};
}

glm::vec3 ShadowFace::through(std::span<const ShadowEntry> list, double limit) {
  const auto next = std::lower_bound(
      list.begin(), list.end(), limit,
      [](const ShadowEntry& e, double at) { return static_cast<double>(e.at) < at; });
  const ShadowEntry before = next == list.begin() ? ShadowEntry{} : *(next - 1);
  glm::vec3 depth = before.depth;
  if (next != list.end() && next->at > before.at) {
    const double part = (limit - static_cast<double>(before.at)) /
                        (static_cast<double>(next->at) - static_cast<double>(before.at));
    depth += (next->depth - before.depth) * static_cast<float>(std::clamp(part, 0.0, 1.0));
  }
  return before.surfaces * to_vec3(exp_minus(from(depth)));
}

/// What depth is linear in, where a ray of the light meets a plane through `point`: the distance
/// along the view axis, or its reciprocal in a perspective view. It is linear in the pixel, too.
double depth_on_plane(const PixelRay& ray, const glm::dvec3& point, const glm::dvec3& normal,
                      bool reciprocal) {
  const double up = glm::dot(normal, point - ray.origin), down = glm::dot(normal, ray.direction);
  return reciprocal ? down / up : up / down;
}

}  // namespace

struct ShadowMapData {
  bool point = false;
  glm::dvec3 at{0.0};  ///< place of the light
  std::vector<ShadowFace> faces;

  /// The face, and the pixel of it, whose ray is nearest to the one through a point.
  struct Place {
    const ShadowFace* face;
    glm::dvec3 in_eye;  ///< the point
    int u, v;
  };
  [[nodiscard]] std::optional<Place> find(const glm::dvec3& p) const {
    if (faces.empty()) return std::nullopt;
    std::size_t chosen = 0;
    if (point) {
      const auto along = [&](std::size_t i) { return glm::dot(kSides[i], p - at); };
      for (std::size_t i = 1; i < faces.size(); ++i) {
        if (along(i) > along(chosen)) chosen = i;
      }
    }
    const ShadowFace& face = faces[chosen];
    const glm::dvec3 in_eye(face.view.eye_from_world * glm::dvec4(p, 1.0));
    const double scale = point ? -in_eye.z : 1.0;
    if (point && !(scale > 0.0)) return std::nullopt;
    const glm::dvec2 pixel =
        glm::floor(glm::dvec2(in_eye) / scale * face.rays.scale() - face.rays.shift());
    const glm::dvec2 end(face.view.size);
    if (!point && !(pixel.x >= 0 && pixel.y >= 0 && pixel.x < end.x && pixel.y < end.y)) {
      return std::nullopt;
    }
    const glm::dvec2 inside = glm::clamp(pixel, glm::dvec2(0.0), end - 1.0);
    return Place{&face, in_eye, static_cast<int>(inside.x), static_cast<int>(inside.y)};
  }
};

Result<ShadowMap> ShadowMap::make(const Scene& scene, const MediaSettings& settings,
                                  const Execution& execution) try {
  if (auto good = check_media(settings); !good) return tl::unexpected(good.error());
  auto table = make_media_table(scene, settings, {});
  if (!table) return tl::unexpected(table.error());
  for (Look& look : table->looks) look.opaque = false;
  Bounds box = bounds(scene.mesh, execution);
  for (const Particle& p : settings.particles) {
    box.include(p.centre - p.radius);
    box.include(p.centre + p.radius);
  }
  auto data = std::make_shared<ShadowMapData>();
  data->point = settings.light.point;
  data->at = settings.light.at;
  if (!box.empty()) {
    const auto views = light_views(settings.light, box);
    if (!views) return tl::unexpected(views.error());
    data->faces.reserve(views->size());
    std::atomic<std::uint64_t> bytes = 0;
    for (const View& view : *views) {
      if (auto done =
              fill(data->faces.emplace_back(view), scene, settings, *table, bytes, execution);
          !done) {
        return tl::unexpected(done.error());
      }
    }
  }
  return ShadowMap(std::move(data));
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory for a shadow map of {0} x {0} pixels",
              settings.light.shadow_size);
}

glm::vec3 ShadowMap::transmittance(const glm::dvec3& point) const {
  const auto place = data_->find(point);
  if (!place) return glm::vec3(1.0f);
  const double distance = data_->point ? glm::length(place->in_eye) : -place->in_eye.z;
  return place->face->through(place->u, place->v, distance);
}

// The bias: how much nearer to the light than it is the map may have the surface itself. Vertices
// are snapped to 1/256 of a pixel, so they are at most 1/512 beside their place in each direction,
// and half a depth step off; a crossing's depth is rounded down by less than a step; and an entry's
// distance is a float.
glm::vec3 ShadowMap::transmittance(const glm::dvec3& point, const glm::dvec3& normal) const {
  const auto place = data_->find(point);
  if (!place) return glm::vec3(1.0f);
  const ShadowFace& face = *place->face;
  const View& view = face.view;
  const bool perspective = view.perspective;
  const glm::dvec3 in_eye = glm::dmat3(view.eye_from_world) * normal;
  const auto depth_at = [&](int du, int dv) {
    const PixelRay ray = face.rays.ray(place->u + du, place->v + dv);
    return depth_on_plane(ray, place->in_eye, in_eye, perspective);
  };
  const double depth = depth_at(0, 0);
  const double slope = std::abs(depth_at(1, 0) - depth) + std::abs(depth_at(0, 1) - depth);
  const double step =
      (perspective ? 1.0 / view.near - 1.0 / view.far : view.far - view.near) / kPictureDepthLimit;
  const double bias = 1.5 * step + slope / 512.0;
  const double along = perspective ? 1.0 / (depth + bias) : depth - bias;
  // Along the light there is no such point.
  if (!(along > 0.0 && std::isfinite(along))) return transmittance(point);
  const double distance = along * face.rays.ray(place->u, place->v).length;
  return face.through(place->u, place->v, distance * (1.0 - 0x1p-23));
}

}  // namespace strata::transparency
