#include "strata/transparency/media/media.h"

#include <memory>
#include <new>
#include <optional>
#include <utility>

#include "strata/mesh/diagnose.h"
#include "transparency/media/media_tile.h"
#include "transparency/stream/mesh_source.h"
#include "transparency/stream/render_tiles.h"

namespace strata::transparency {

Result<MediaRendering> render_media(const Scene& scene, const View& view,
                                    const MediaSettings& settings, const FrameOptions& options,
                                    const Execution& execution) try {
  if (auto good = check_frame(scene, view, options); !good) return tl::unexpected(good.error());
  if (auto good = check_media(settings); !good) return tl::unexpected(good.error());
  const auto table = make_media_table(scene, settings, options);
  if (!table) return tl::unexpected(table.error());
  const auto source = make_mesh_source(scene, table->looks, view, options.samples, execution);
  if (!source) return tl::unexpected(source.error());
  const FrameTriangles& triangles = *(*source)->triangles();
  const PixelRays rays(triangles.view);
  const ParticleBins particles(settings.particles, triangles.view, rays);
  MediaFrame frame{settings, *table, triangles.view, rays, particles};
  const glm::vec4& b = options.background;
  frame.background = glm::vec4(glm::vec3(b) * b.a, b.a);
  frame.lit = settings.light.radiance != glm::vec3(0.0f);
  frame.to_light = glm::normalize(glm::dmat3(triangles.view.eye_from_world) * settings.light.at);
  std::vector<EyeSolid> eye_solids;
  if (triangles.part.cut) {
    eye_solids = find_eye_solids(scene, *table, triangles.view, execution);
    frame.eye_solids = eye_solids;
  }

  frame.scene = &scene;
  std::optional<ShadowMap> shadows;
  if (frame.lit && settings.light.shadows) {
    auto map = ShadowMap::make(scene, settings,
                               {execution.threads, execution.stop, {}, execution.memory_limit});
    if (!map) return tl::unexpected(map.error());
    frame.shadows = &shadows.emplace(std::move(*map));
  }

  std::vector<std::shared_ptr<MediaTile>> tiles;
  const auto make = [&]() -> Result<TileRenderer> {
    tiles.push_back(std::make_shared<MediaTile>(frame));
    return [tile = tiles.back()](TileStream& stream, TileImage& image) {
      return tile->render(stream, image);
    };
  };
  auto rendering = render_tiles(**source, options, make, true, execution);
  if (!rendering) return tl::unexpected(rendering.error());
  MediaRendering result{std::move(*rendering), {}};
  for (std::size_t i = 0; i < table->solids.size(); ++i) {
    SolidReport& report = result.solids.emplace_back();
    report.object = scene.objects[table->objects[i]].name;
    for (const auto& tile : tiles) {
      report.pixels += tile->reports()[i].pixels;
      report.unbalanced_pixels += tile->reports()[i].unbalanced_pixels;
    }
  }
  return result;
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory for a picture of {} x {} pixels with media",
              view.size.x, view.size.y);
}

}  // namespace strata::transparency
