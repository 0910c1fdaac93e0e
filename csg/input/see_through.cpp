#include "strata/csg/input/see_through.h"

#include <algorithm>
#include <new>
#include <utility>

#include "strata/mesh/soup_tools.h"

namespace strata::csg {
namespace {

constexpr float kUsualOpacity = 0.5f;

/// Opacity of what has no alpha of its own.
float opacity_of(const Scene& scene, const SeeThroughOptions& options) {
  if (options.opacity) return *options.opacity;
  const auto solids = scene.tree.solids();
  const bool any = !scene.backgrounds.empty() || !scene.highlights.empty() ||
                   std::any_of(solids.begin(), solids.end(), [](const Solid& solid) {
                     return solid.colour && solid.colour->a < 1.0f;
                   });
  return any ? 1.0f : kUsualOpacity;
}

/// All triangles of a solid as a part of a scene.
Result<void> add_faces(const Solid& solid, const glm::vec4& colour, transparency::Scene& scene) {
  if (!solid.mesh || solid.mesh->triangles.empty()) return {};
  const std::uint64_t vertices = scene.mesh.positions.size() + solid.mesh->positions.size();
  const std::uint64_t triangles = scene.mesh.triangles.size() + solid.mesh->triangles.size();
  if (vertices > 0xfffffffeu || triangles > 0x7fffffffu) {
    return fail(ErrorCode::kLimit, "the meshes have {} triangles together; the limit is {}",
                triangles, 0x7fffffffu);
  }
  const auto first = static_cast<std::uint32_t>(scene.mesh.positions.size());
  for (const glm::dvec3& position : solid.mesh->positions) {
    scene.mesh.positions.emplace_back(solid.world_from_mesh * glm::dvec4(position, 1.0));
  }
  for (const glm::uvec3& triangle : solid.mesh->triangles) {
    scene.mesh.triangles.push_back(triangle + first);
  }
  scene.object_of.resize(triangles, static_cast<std::uint32_t>(scene.objects.size()));
  scene.objects.push_back({solid.name, colour});
  return {};
}

}  // namespace

struct SeeThrough::Impl {
  float opacity = 1.0f;
  std::uint64_t objects = 0, triangles = 0;
  transparency::Scene faces;
  Bounds box;

  Result<void> take_faces(const Scene& scene, const ColourScheme& scheme) {
    const glm::vec4 face(glm::vec3(scheme.face) / 255.0f, opacity);
    for (const Solid& solid : scene.tree.solids()) {
      if (auto done = add_faces(solid, colour_or(solid.colour, face), faces); !done) return done;
    }
    box = bounds(faces.mesh);
    objects = faces.objects.size();
    triangles = faces.mesh.triangles.size();
    return {};
  }
};

Result<SeeThrough> SeeThrough::make(Scene scene, const SeeThroughOptions& options,
                                    const Execution&) try {
  if (options.opacity && !(*options.opacity >= 0.0f && *options.opacity <= 1.0f)) {
    return fail(ErrorCode::kUsage, "the opacity must be 0 to 1, got {}", *options.opacity);
  }
  const ColourScheme& scheme =
      options.scheme != nullptr ? *options.scheme : colour_schemes().front();
  auto impl = std::make_shared<Impl>();
  impl->opacity = opacity_of(scene, options);
  if (!options.all_faces) {
    return fail(ErrorCode::kUsage, "scenes with Boolean operations cannot be seen through yet");
  }
  if (auto done = impl->take_faces(scene, scheme); !done) return tl::unexpected(done.error());
  SeeThrough result;
  result.impl_ = std::move(impl);
  return result;
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory for the triangles of the scene");
}

Result<transparency::Frame> SeeThrough::frame(const Camera& camera, const glm::ivec2& size,
                                              const transparency::FrameOptions& options,
                                              const Execution& execution) const try {
  const auto view = make_view(camera, size, impl_->box);
  if (!view) return tl::unexpected(view.error());
  return transparency::Frame::make(impl_->faces, *view, options, execution);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory for a picture of {} x {} pixels", size.x, size.y);
}

float SeeThrough::opacity() const { return impl_->opacity; }
std::uint64_t SeeThrough::objects() const { return impl_->objects; }
std::uint64_t SeeThrough::triangles() const { return impl_->triangles; }

}  // namespace strata::csg
