#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "csg/surface/tile_surface.h"
#include "csg/surface/visible_surface.h"
#include "strata/csg/picture/picture.h"
#include "strata/hashbuffer/build_ldi.h"
#include "tests/csg/surface/surface_checks.h"

namespace strata::csg {

/// The visible surfaces from the full lists of all solids in an HA-buffer. They hold that pictures,
/// which cull, see what measurements see, and use much of what draws pictures: whether that is
/// right, ray_oracle_test.cpp tells.
inline SurfaceImage by_full_lists(const Tree& tree, const View& view, double relative_precision) {
  const Geometry geometry(tree);
  std::vector<ViewPart> parts;
  LatticeMesh all;
  std::vector<glm::uvec3> triangles;
  std::vector<std::uint32_t> solid_of, first_of;
  for (const Geometry::Part& part : geometry.parts()) {
    auto seen = view_part(part.placed(), view);
    EXPECT_TRUE(seen.has_value());
    const auto first = static_cast<std::uint32_t>(all.vertices.size());
    first_of.push_back(static_cast<std::uint32_t>(triangles.size()));
    for (const glm::uvec3& t : seen->mesh.triangles) triangles.push_back(t + first);
    all.vertices.insert(all.vertices.end(), seen->mesh.vertices.begin(), seen->mesh.vertices.end());
    solid_of.resize(triangles.size(), static_cast<std::uint32_t>(parts.size()));
    parts.push_back(std::move(*seen));
  }
  all.triangles = triangles;
  const RasterTarget target{Axis::kZ, view.size.x, view.size.y, kPictureDepthLimit};
  const auto lists = build_ldi(all, target);
  EXPECT_TRUE(lists.has_value());

  const Program program = compile(tree, tree.root());
  const bool cut = std::ranges::any_of(parts, &ViewPart::cut);
  FirstHit finder(program);
  const Coincidence coincidence(view, geometry.world_error(tree, relative_precision));
  SurfaceImage result;
  result.width = view.size.x, result.height = view.size.y;
  for (int v = 0; v < view.size.y; ++v) {
    for (int u = 0; u < view.size.x; ++u) {
      std::vector<Transition> transitions;
      std::vector<std::vector<DepthItem>> of_solid(parts.size());
      for (const DepthItem item : lists->list(u, v)) {
        const std::uint32_t solid = solid_of[item.triangle()];
        of_solid[solid].emplace_back(item.depth(), item.exit(), item.triangle() - first_of[solid]);
      }
      for (std::uint32_t solid = 0; solid < parts.size(); ++solid) {
        const Geometry::Part& part = geometry.parts()[solid];
        if (kind_of(program, solid, part, cut) == LeafLayers::Kind::kFirstEntryOnly) {
          first_entry_of(of_solid[solid], solid, transitions);
        } else {
          transitions_of(of_solid[solid], solid, part.rule, parts[solid].cut, transitions);
        }
      }
      const Surface surface =
          finder.find(transitions, TransitionFaces(geometry.parts(), parts, coincidence));
      const bool seen = surface.depth != Surface::kNone;
      const std::uint32_t triangle = seen ? parts[surface.solid].source(surface.triangle) : 0;
      result.depth.push_back(seen ? surface.depth : SurfaceImage::kNone);
      result.solid.push_back(surface.solid);
      result.triangle.push_back(triangle | (surface.exit ? SurfaceImage::kExit : 0u));
    }
  }
  return result;
}

/// Compares a preview with the full lists, pixel by pixel. @return how many pixels show something
inline std::size_t expect_same(const Tree& tree, const Camera& camera, const glm::ivec2& size,
                               const std::string& what) {
  Preview preview(tree, {}, 0.0);
  const auto view = make_view(camera, size, preview.box());
  EXPECT_TRUE(view.has_value()) << what;
  if (!view) return 0;
  const auto image = preview.draw(*view);
  EXPECT_TRUE(image.has_value()) << what << ": " << image.error().message;
  if (!image) return 0;
  return expect_same_surface(**image, by_full_lists(tree, *view, 0.0), what);
}

}  // namespace strata::csg
