// From a mesh file to voxels: ask for single ones, sum them up by runs, write a file.
#include <cstdio>

#include <strata/voxels.h>

int main() {
  const auto file = strata::read_mesh("data/knot.obj");
  if (!file) return std::fprintf(stderr, "%s\n", file.error().message.c_str()), 1;
  const auto grid = strata::fit_grid(strata::bounds(file->soup), {.resolution = 256});
  const auto solid = strata::voxelize(file->soup, grid.value());
  if (!solid) return std::fprintf(stderr, "%s\n", solid.error().message.c_str()), 1;

  std::printf("%llu solid voxels\n", static_cast<unsigned long long>(solid->solid_voxels()));
  std::printf("(122, 40, 90) is %s\n", solid->contains(122, 40, 90) ? "solid" : "empty");
  int longest = 0;
  strata::for_each_run(*solid, [&](const glm::ivec3& first, const glm::ivec3& last, unsigned) {
    if (last.z - first.z >= longest) longest = last.z - first.z + 1;
  });
  std::printf("longest run along z: %d voxels\n", longest);

  const auto written = strata::write_voxels(*solid, "knot.npz");
  if (!written) return std::fprintf(stderr, "%s\n", written.error().message.c_str()), 1;
}
