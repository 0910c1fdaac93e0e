#include "apps/voxelize/colouring.h"

#include <glm/common.hpp>
#include <utility>

#include "apps/voxelize/voxelize_run.h"
#include "strata/csg/picture/picture.h"
#include "strata/csg/solid_lists.h"
#include "strata/raster/lattice_mesh.h"

namespace strata::apps {
namespace {

/// The colour of each triangle of a tree: that of its solid.
std::vector<glm::u8vec4> triangle_colours(const csg::SolidInput& input) {
  std::vector<glm::u8vec4> of_solids, colours;
  for (const csg::Solid& solid : input.scene->solids()) {
    of_solids.push_back(
        solid_colour_bytes(csg::colour_or(solid.colour, csg::plain_solid_colour())));
  }
  colours.reserve(input.soup.triangles.size());
  for (std::uint32_t t = 0; t < input.soup.triangles.size(); ++t) {
    colours.push_back(of_solids[input.tree->solid_of(t)]);
  }
  return colours;
}

/// Parts of a mesh that does not fit the lattice are moved, and colours with them.
Result<void> check_fit(const csg::SolidInput& input, const VoxelGrid& grid) {
  if (!input.attributes.coloured()) return {};
  for (const glm::dvec3& corner : {input.bounds.low, input.bounds.high}) {
    const glm::dvec3 steps = glm::abs((corner - grid.origin) / grid.voxel_size) * 256.0 + 1.0;
    if (glm::max(steps.x, glm::max(steps.y, steps.z)) < kMaxLatticeCoordinate) continue;
    return fail(ErrorCode::kGeometry,
                "{}: --colours needs a mesh within {} voxels of the grid's origin",
                input.files.front().path, kMaxLatticeCoordinate / kLatticeSteps);
  }
  return {};
}

void warn_of_no_colours(const csg::SolidInput& input, Session& session) {
  if (!input.tree && !input.attributes.coloured()) {
    session.warn("no-colours", fmt::format("{}: no colours are given; all voxels are light grey",
                                           input.files.front().path));
  }
  for (const csg::InputFacts& file : input.files) {
    if (!input.tree || !file.attributes.coloured()) continue;
    session.warn("no-colours",
                 fmt::format("{}: colours of a mesh are not used in a Boolean tree; its solid has "
                             "one colour",
                             file.path));
  }
}

}  // namespace

Result<Colouring> Colouring::create(const VoxelizeCommand& command, VoxelizeOutcome& outcome,
                                    const Execution& execution, Session& session) {
  Colouring made;
  csg::SolidInput& input = outcome.input;
  warn_of_no_colours(input, session);
  if (auto fits = check_fit(input, outcome.grid); !fits) return tl::unexpected(fits.error());
  made.solid_ = !is_surface_alone(command, input);
  const bool surface = command.surface || !made.solid_;
  outcome.colours.emplace().of_solids = input.tree != nullptr;
  if (input.tree && !surface && !command.fill_colour) {
    const auto parts =
        csg::colour_labels(*input.scene, input.scene->root(), csg::plain_solid_colour());
    for (const glm::vec4& colour : parts.colours) {
      made.colour_of_label_.push_back(packed_colour(solid_colour_bytes(colour)));
    }
    if (!parts.colours.empty()) input.tree->set_labels(parts.labels);
    return made;
  }
  if (input.tree) {
    made.surface_ =
        std::make_unique<SurfaceColours>(SurfaceColours::of_triangles(triangle_colours(input)));
  } else {
    SurfaceColourOptions options;
    options.footprint = outcome.grid.voxel_size;
    auto surface_colours = SurfaceColours::make(input.soup, input.attributes, options, execution);
    if (!surface_colours) return tl::unexpected(surface_colours.error());
    made.surface_ = std::make_unique<SurfaceColours>(*std::move(surface_colours));
  }
  VoxelColourOptions options;
  options.solid = made.solid_;
  if (command.fill_colour) options.inside = glm::u8vec4(*command.fill_colour, 255);
  if (made.solid_) outcome.colours->fill = options.inside;
  auto voxels =
      VoxelColouring::create(input.soup, outcome.grid, *made.surface_, options, execution);
  if (!voxels) return tl::unexpected(voxels.error());
  made.voxels_ = *std::move(voxels);
  return made;
}

Result<VoxelIntervals> Colouring::colour(const VoxelIntervals& slab, const Execution& execution) {
  if (voxels_) return voxels_->colour(slab, execution);
  return relabelled(
      slab, [this](std::uint32_t label) { return colour_of_label_[label - 1]; }, execution);
}

}  // namespace strata::apps
