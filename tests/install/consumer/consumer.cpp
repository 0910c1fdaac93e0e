// Uses an installed Strata as a whole: a cube becomes voxels.
#include <cstdio>

#include "strata/voxelize/voxelize.h"

int main() {
  strata::TriangleSoup cube;
  for (int corner = 0; corner < 8; ++corner) {
    cube.positions.emplace_back(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
  }
  cube.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  strata::VoxelGrid grid;
  grid.dims = {16, 16, 16};
  grid.voxel_size = glm::dvec3(1.0 / 16.0);

  const auto voxels = strata::voxelize(cube, grid);
  if (!voxels) {
    std::fprintf(stderr, "%s\n", voxels.error().message.c_str());
    return 1;
  }
  if (voxels->solid_voxels() != 4096) {
    std::fprintf(stderr, "%llu voxels instead of 4096\n",
                 static_cast<unsigned long long>(voxels->solid_voxels()));
    return 1;
  }
  std::puts("strata works");
  return 0;
}
