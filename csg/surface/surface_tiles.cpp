#include "csg/surface/surface_tiles.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "csg/surface/depth_range.h"

namespace strata::csg {
namespace {

/// Solids with more triangles than this are prepared one after another, each by all threads.
constexpr std::size_t kLargePart = 20000;

}  // namespace

void TileSolids::build(std::span<const ViewPart> parts, int tiles_u, int tiles_v) {
  offsets.assign(static_cast<std::size_t>(tiles_u) * static_cast<std::size_t>(tiles_v) + 1, 0);
  const auto for_each = [&](auto&& body) {
    for (std::uint32_t solid = 0; solid < parts.size(); ++solid) {
      const PixelRect& rect = parts[solid].rect;
      if (rect.empty()) continue;
      for (int tv = rect.v0 / kTileSide; tv <= (rect.v1 - 1) / kTileSide; ++tv) {
        for (int tu = rect.u0 / kTileSide; tu <= (rect.u1 - 1) / kTileSide; ++tu) {
          body(static_cast<std::size_t>(tv) * static_cast<std::size_t>(tiles_u) +
                   static_cast<std::size_t>(tu),
               solid);
        }
      }
    }
  };
  for_each([&](std::size_t tile, std::uint32_t) { ++offsets[tile + 1]; });
  std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
  solids.resize(offsets.back());
  std::vector<std::uint32_t> cursor(offsets.begin(), offsets.end() - 1);
  for_each([&](std::size_t tile, std::uint32_t solid) { solids[cursor[tile]++] = solid; });
}

Result<void> SurfaceTiles::prepare(const Program& program, const Geometry& geometry,
                                   double world_error, const View& of, const Execution& execution) {
  view = of;
  coincidence = Coincidence(view, world_error);
  tiles_u = (view.size.x + kTileSide - 1) / kTileSide;
  tiles_v = (view.size.y + kTileSide - 1) / kTileSide;
  const auto& parts = geometry.parts();
  view_parts.clear();
  view_parts.resize(parts.size());
  std::vector<std::uint32_t> small, large;
  for (std::uint32_t solid = 0; solid < parts.size(); ++solid) {
    if (program.leaves[solid].parent == Program::kNone) continue;
    (parts[solid].triangles.size() > kLargePart ? large : small).push_back(solid);
  }
  std::vector<Result<void>> failures(parts.size());
  const auto prepare_one = [&](std::uint32_t solid, const Execution& how) {
    auto part = view_part(parts[solid].placed(), view, how);
    if (part) {
      view_parts[solid] = std::move(*part);
    } else {
      failures[solid] = tl::unexpected(part.error());
    }
  };
  constexpr std::size_t kAtOnce = 16;
  Execution alone;
  alone.threads = 1;
  parallel_for(execution, (small.size() + kAtOnce - 1) / kAtOnce, [&](std::size_t chunk, int) {
    const std::size_t end = std::min(small.size(), (chunk + 1) * kAtOnce);
    for (std::size_t i = chunk * kAtOnce; i < end; ++i) prepare_one(small[i], alone);
  });
  for (const std::uint32_t solid : large) prepare_one(solid, execution);
  for (const auto& failure : failures) {
    if (!failure) return failure;
  }
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  solids.build(view_parts, tiles_u, tiles_v);
  return {};
}

Result<View> view_of_tree(const Tree& tree, const Geometry& geometry,
                          std::span<const Tree::NodeId> shown, const Camera& camera,
                          const glm::ivec2& size, const Execution& execution) {
  const std::vector<Bounds> boxes = geometry.boxes();
  auto made = make_view(camera, size, picture_box(tree, boxes, shown));
  if (!made || !made->cut_short) return made;
  Bounds seen;
  for (const Tree::NodeId node : shown) seen.include(bounds(tree, node, boxes));
  const auto distances = seen_distances(geometry, *made, seen, execution);
  // A face through the eye is cut off all the same: no depth would be left for all others.
  constexpr double kLeastPart = 1.0 / (1 << 20);
  if (!distances || distances->x < distances->y * kLeastPart) return made;
  constexpr double kRoom = 1e-6;  // so that rounding clamps nothing
  made->set_distances(distances->x * (1 - kRoom), distances->y * (1 + kRoom));
  return made;
}

}  // namespace strata::csg
