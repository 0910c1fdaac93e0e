#include "python/voxel_values.h"

#include "strata/mesh/colours/surface_colours.h"
#include "strata/voxelize/colours/voxel_colours.h"
#include "strata/voxelize/distance/signed_distance.h"

namespace strata::python {
Result<void> colour_of_mesh(const MeshData& mesh, const TriangleSoup& soup, bool solid,
                            const std::optional<glm::u8vec3>& inside, VoxelsData& voxels,
                            const Execution& execution) {
  const VoxelGrid& grid = voxels.volume.grid();
  SurfaceColourOptions look;
  look.footprint = grid.voxel_size;
  const auto surface = SurfaceColours::make(soup, mesh.input.attributes, look, execution);
  if (!surface) return tl::unexpected(surface.error());
  VoxelColourOptions options;
  options.solid = solid;
  if (inside) options.inside = glm::u8vec4(*inside, 255);
  auto colouring = VoxelColouring::create(soup, grid, *surface, options, execution);
  if (!colouring) return tl::unexpected(colouring.error());
  auto coloured = colouring->colour(voxels.volume.set, execution);
  if (!coloured) return tl::unexpected(coloured.error());
  voxels.volume.set = *std::move(coloured);
  voxels.volume.kind = VoxelKind::kColours;
  voxels.rgba = true;
  return {};
}

Result<void> colour_of_solids(std::span<const glm::vec4> colours, VoxelsData& voxels,
                              const Execution& execution) {
  std::vector<std::uint32_t> packed;
  for (const glm::vec4& colour : colours) {
    packed.push_back(packed_colour(solid_colour_bytes(colour)));
  }
  voxels.volume.set = relabelled(
      voxels.volume.set, [&](std::uint32_t label) { return packed[label - 1]; }, execution);
  voxels.volume.kind = VoxelKind::kColours;
  voxels.rgba = true;
  return {};
}

Result<void> distances(const TriangleSoup& soup, const VoxelGrid& grid,
                       const VoxelizeOptions& options, const TriangleSoup* surface, double band,
                       VoxelsData& voxels, const Execution& execution) {
  DistanceOptions distance;
  distance.everywhere = band == 0;
  if (band != 0) distance.band = band;
  distance.solid = options;
  distance.surface = surface;
  VoxelIntervals inside(grid, Axis::kX);
  distance.inside = [&](const VoxelIntervals& slab) -> Result<void> {
    add_slab(inside, slab);
    return {};
  };
  DistanceReport report;
  auto field = signed_distance(soup, grid, distance, execution, &report);
  if (!field) return tl::unexpected(field.error());
  voxels.volume.set = std::move(inside);
  voxels.volume.values = *std::move(field);
  voxels.volume.kind = VoxelKind::kDistances;
  voxels.made = true;
  voxels.band = report.band;
  return {};
}

}  // namespace strata::python
