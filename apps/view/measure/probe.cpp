#include "apps/view/measure/probe.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <memory>
#include <utility>

#include "strata/csg/boundary/boundary_mesh.h"
#include "strata/mesh/soup_tools.h"

namespace strata::view {
namespace {

/// A point of the world in the picture: pixels, and the distance along the view axis.
glm::dvec3 in_picture(const View& view, const glm::dvec3& world) {
  const glm::dvec4 image = view.image_from_world * glm::dvec4(world, 1.0);
  const glm::dvec4 eye = view.eye_from_world * glm::dvec4(world, 1.0);
  return {image.x / image.w, image.y / image.w, -eye.z};
}

/// World units a pixel is wide at a point.
double pixel_size(const View& view, const glm::dvec3& world) {
  const glm::dvec3 right = glm::transpose(glm::dmat3(view.eye_from_world))[0];
  const double pixels = glm::distance(glm::dvec2(in_picture(view, world)),
                                      glm::dvec2(in_picture(view, world + right)));
  return pixels > 0.0 ? 1.0 / pixels : 0.0;
}

class Snapper {
 public:
  Snapper(const csg::TreeRays& rays, const View& part, const csg::SurfaceImage& image)
      : rays_(rays), part_(part), image_(image) {}

  /// Moves a probe. @param at  its pixel in the part
  void snap(Probe& probe, const glm::ivec2& at) const {
    const double size = pixel_size(part_, probe.where);
    const glm::dvec2 centre = glm::dvec2(at) + 0.5;
    const auto points = csg::snap_points(rays_, probe.where, 3.0 * kSnapVertex * size);
    struct Choice {
      csg::Snap kind;
      double pixels;
    };
    for (const Choice& choice :
         {Choice{csg::Snap::kVertex, kSnapVertex}, Choice{csg::Snap::kMidpoint, kSnapMidpoint},
          Choice{csg::Snap::kEdge, kSnapEdge}}) {
      double nearest = choice.pixels;
      for (const csg::SnapPoint& one : points) {
        if (one.kind != choice.kind) continue;
        const glm::dvec3 there = in_picture(part_, one.at);
        const double away = glm::distance(glm::dvec2(there), centre);
        if (!(away < nearest) || !visible(one.at, glm::dvec2(there), size)) continue;
        nearest = away;
        probe.snap = choice.kind;
        probe.where = one.at;
      }
      if (probe.snap != csg::Snap::kFace) return;
    }
  }

 private:
  /// Whether the picture shows a face at a point, or next to it.
  [[nodiscard]] bool visible(const glm::dvec3& world, const glm::dvec2& there, double size) const {
    const glm::dmat4 world_from_image = glm::inverse(part_.image_from_world);
    const glm::ivec2 middle(glm::floor(there));
    for (int v = middle.y - 1; v <= middle.y + 1; ++v) {
      for (int u = middle.x - 1; u <= middle.x + 1; ++u) {
        if (u < 0 || v < 0 || u >= image_.width || v >= image_.height) continue;
        const std::uint32_t depth = image_.depth[static_cast<std::size_t>(v * image_.width + u)];
        if (depth == csg::SurfaceImage::kNone) continue;
        const glm::dvec4 shown = world_from_image * glm::dvec4(u + 0.5, v + 0.5, depth + 0.5, 1.0);
        if (glm::distance(glm::dvec3(shown) / shown.w, world) < 8.0 * size) return true;
      }
    }
    return false;
  }

  const csg::TreeRays& rays_;
  const View& part_;
  const csg::SurfaceImage& image_;
};

/// Exact, unless that would take long: then as if the mesh did not overlap itself.
Result<SolidSize> size_of(TriangleSoup mesh, InsideRule rule, const Execution& execution) {
  constexpr std::size_t kMany = 300'000;
  SolidSize size;
  size.box = bounds(mesh);
  if (mesh.triangles.size() > kMany) {
    size.volume = std::abs(signed_volume(mesh, execution));
    for (const glm::uvec3& t : mesh.triangles) {
      const glm::dvec3& a = mesh.positions[t.x];
      size.area += 0.5 * glm::length(glm::cross(mesh.positions[t.y] - a, mesh.positions[t.z] - a));
    }
    return size;
  }
  const csg::Tree tree(
      csg::Solid{std::make_shared<TriangleSoup>(std::move(mesh)), glm::dmat4(1.0), {}, rule});
  const auto exact = csg::exact_measures(tree, tree.root(), {}, execution);
  if (!exact) return tl::unexpected(exact.error());
  size.volume = exact->volume;
  size.area = exact->area;
  return size;
}

}  // namespace

View part_of(const View& view, const glm::ivec2& first, const glm::ivec2& size) {
  View part = view;
  part.size = size;
  for (int column = 0; column < 4; ++column) {
    glm::dvec4& m = part.image_from_world[column];
    m.x -= first.x * m.w;
    m.y -= first.y * m.w;
  }
  return part;
}

Result<Probe> probe(csg::Preview& preview, const csg::TreeRays& rays, const View& view,
                    const glm::ivec2& pixel, const ProbeWish& wish, const Execution& execution) {
  Probe result;
  result.pixel = pixel;
  const int around = wish.snap ? static_cast<int>(kSnapVertex) + 2 : 0;
  const View part = part_of(view, pixel - around, glm::ivec2(2 * around + 1));
  const auto drawn = preview.draw(part, execution);
  if (!drawn) return tl::unexpected(drawn.error());
  const csg::SurfaceImage& image = **drawn;
  const glm::ivec2 at(around);
  if (image.depth[static_cast<std::size_t>(at.y * image.width + at.x)] ==
      csg::SurfaceImage::kNone) {
    return result;
  }
  result.hit = true;
  result.point = rays.point(part, image, at.x, at.y);
  result.where = result.point.where;
  result.section = csg::is_section(preview.tree().solids()[result.point.solid]);
  if (wish.snap) Snapper(rays, part, image).snap(result, at);
  if (wish.thickness) {
    const glm::dmat4& eye = view.eye_from_world;
    const glm::dmat3 world_from_eye = glm::transpose(glm::dmat3(eye));
    const glm::dvec3 along = view.perspective
                                 ? result.point.where + world_from_eye * glm::dvec3(eye[3])
                                 : -world_from_eye[2];
    result.along_normal = rays.thickness(result.point.inner, -result.point.normal);
    result.along_ray = rays.thickness(result.point.inner, glm::normalize(along));
  }
  const csg::Geometry::Part& solid = rays.geometry().parts()[result.point.solid];
  // A distance does not wait for the facets of large meshes to be sorted.
  constexpr std::size_t kMany = 200'000;
  if (wish.round && (!wish.snap || solid.triangles.size() <= kMany)) {
    result.round =
        csg::fit_round(solid.positions, solid.triangles, result.point.triangle, result.where);
    // What is taken away leaves a hole.
    if (result.point.cut) result.round.hollow = !result.round.hollow;
  }
  if (wish.size && !result.section) {
    auto size = size_of(rays.solid_mesh(result.point.solid), solid.rule, execution);
    if (!size) return tl::unexpected(size.error());
    result.size = *size;
  }
  return result;
}

}  // namespace strata::view
