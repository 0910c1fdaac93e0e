#include <cstdio>

#include <strata/mesh/formats/read_mesh.h>
#include <strata/voxelize/grid_fit.h>
#include <strata/voxelize/voxelize.h>

int main() {
  const auto file = strata::read_mesh("data/knot.obj");
  if (!file) return std::fprintf(stderr, "%s\n", file.error().message.c_str()), 1;
  strata::GridRequest request;
  request.resolution = 256;  // voxels along the longest side
  const auto grid = strata::fit_grid(strata::bounds(file->soup), request);
  const auto solid = strata::voxelize(file->soup, grid.value());
  std::printf("%llu solid voxels\n", static_cast<unsigned long long>(solid->solid_voxels()));
  for (const strata::Interval run : solid->column(122, 40))
    std::printf("z %d..%d\n", run.first, run.last);
}
