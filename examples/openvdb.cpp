// Voxels of a mesh as a grid of OpenVDB, in memory: link strata::openvdb.
#include <openvdb/openvdb.h>

#include <cstdio>

#include <strata/voxelize/formats/openvdb_bridge.h>
#include <strata/voxels.h>

int main() {
  const auto file = strata::read_mesh("data/knot.obj");
  if (!file) return std::fprintf(stderr, "%s\n", file.error().message.c_str()), 1;
  const auto grid = strata::fit_grid(strata::bounds(file->soup), {.resolution = 128});
  // Each voxel has 4 x 4 x 4 samples; its label says how many of them are solid.
  const auto set = strata::voxelize(file->soup, grid.value(), {.samples = 4});
  if (!set) return std::fprintf(stderr, "%s\n", set.error().message.c_str()), 1;

  const auto fog = strata::to_openvdb<openvdb::FloatGrid>(*set, {.full_label = 64});
  if (!fog) return std::fprintf(stderr, "%s\n", fog.error().message.c_str()), 1;
  double volume = 0;
  for (auto voxel = (*fog)->cbeginValueOn(); voxel; ++voxel) {
    volume += static_cast<double>(*voxel) * static_cast<double>(voxel.getVoxelCount());
  }
  volume *= (*fog)->voxelSize().x() * (*fog)->voxelSize().y() * (*fog)->voxelSize().z();
  std::printf("%s: %llu active voxels, volume %.2f\n", (*fog)->getName().c_str(),
              static_cast<unsigned long long>((*fog)->activeVoxelCount()), volume);
}
