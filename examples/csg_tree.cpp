#include <cstdio>

#include <strata/csg.h>

namespace csg = strata::csg;

int main() {
  const csg::Tree a(strata::make_box({-10, -10, -10}, {10, 10, 10}));
  const csg::Tree b(strata::make_icosphere(12.5, 5));
  const csg::Tree c(strata::make_cylinder(4, 30, 64));  // stands on z = 0
  const csg::Tree tree = (a - b) | c;

  const auto picture = csg::picture(tree);  // the whole tree in view, 512 x 512
  if (!picture) return std::fprintf(stderr, "%s\n", picture.error().message.c_str()), 1;
  if (!csg::write_png(*picture, "csg_tree.png")) return 1;

  const auto measures = csg::measure(tree);
  std::printf("volume %.0f, area %.0f\n", measures->volume, measures->area);

  const auto boundary = csg::boundary_mesh(tree, tree.root());  // exact, closed, 2-manifold
  if (!boundary) return std::fprintf(stderr, "%s\n", boundary.error().message.c_str()), 1;
  if (!strata::write_solid("csg_tree.3mf", boundary->mesh)) return 1;

  strata::GridRequest request;
  request.resolution = 256;  // voxels along the longest side
  const auto grid = strata::fit_grid(csg::bounds(tree), request);
  const auto voxels = csg::voxelize(tree, grid.value());
  std::printf("%llu solid voxels\n", static_cast<unsigned long long>(voxels->solid_voxels()));
}
