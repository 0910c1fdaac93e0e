#include "apps/voxelize/distance_surface.h"

#include <utility>

#include "apps/strata/library_session.h"
#include "strata/csg/boundary/boundary_mesh.h"
#include "strata/csg/input/scene_input.h"
#include "strata/voxelize/distance/inner_faces.h"

namespace strata::apps {

Result<std::optional<TriangleSoup>> distance_surface(const VoxelizeCommand& command,
                                                     const VoxelizeOutcome& outcome,
                                                     const VoxelizeOptions& options,
                                                     Session& session) {
  const csg::SolidInput& input = outcome.input;
  if (!input.tree) {
    if (!input.closed) return std::optional<TriangleSoup>();
    const auto inner =
        has_inner_faces(input.soup, outcome.grid, options, session.execution("distances"));
    if (!inner) return tl::unexpected(inner.error());
    if (!*inner) return std::optional<TriangleSoup>();
  }
  session.note("distances are those to the exact boundary of the result");
  // The voxels' input has no meshes any more; what there was to say of the files has been said.
  auto scene = csg::load_scene(command.input, {}, session.execution("reading"));
  if (!scene) return tl::unexpected(scene.error());
  if (input.turned) {
    scene->tree =
        csg::transform(glm::dmat4(command.input.space_from_world), std::move(scene->tree));
  }
  auto made =
      csg::boundary_mesh(scene->tree, scene->tree.root(), {}, session.execution("boundary"));
  if (!made) return tl::unexpected(made.error());
  TriangleSoup soup;
  soup.positions = std::move(made->mesh.positions);
  soup.triangles = std::move(made->mesh.triangles);
  return std::optional(std::move(soup));
}

}  // namespace strata::apps
