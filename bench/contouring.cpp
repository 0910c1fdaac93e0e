// Meshes from depth lists: contour() beside voxelize() of the same mesh, and beside OpenVDB's
// distance field and volumeToMesh(), whose meshes may pierce themselves and round corners off.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <glm/mat4x4.hpp>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/support.h"
#include "strata/contour/contour.h"
#include "strata/csg/solid_lists.h"
#include "strata/csg/tree.h"
#include "strata/mesh/shapes.h"
#include "strata/voxelize/grid_fit.h"
#ifdef STRATA_HAVE_OPENVDB
#include <openvdb/tools/VolumeToMesh.h>

#include "bench/openvdb_solid.h"
#endif

namespace {

using namespace strata;
using namespace strata::bench;

/// A mesh, or the solids of a tree.
struct Input {
  std::string name;
  TriangleSoup soup;
  std::optional<csg::SolidLists> tree;
  Bounds box;
};

/// A plate with 400 round holes of 30 sides.
Input plate() {
  csg::Tree tree(make_box({0.0, 0.0, 0.0}, {100.0, 100.0, 6.0}));
  for (int n = 0; n < 400; ++n) {
    glm::dmat4 move(1.0);
    move[3] = {2.5 + 5.0 * (n % 20), 2.5 + 5.0 * (n / 20), -1.0, 1.0};
    tree -= csg::Tree(transform(make_cylinder(1.7, 8.0, 30), move));
  }
  Input input{"plate-400", {}, csg::SolidLists(tree, tree.root()), csg::bounds(tree)};
  input.soup = input.tree->take_soup();
  return input;
}

Input mesh(const std::string& name) {
  auto made = bench_mesh(name);
  if (!made) throw std::runtime_error(made.error().message);
  Input input{made->name, std::move(made->soup), std::nullopt, {}};
  input.box = bounds(input.soup);
  return input;
}

#ifdef STRATA_HAVE_OPENVDB
std::shared_ptr<void> by_openvdb(const TriangleSoup& soup, const VoxelGrid& grid) {
  std::vector<openvdb::Vec3s> points;
  for (const glm::dvec3& p : soup.positions) {
    const glm::dvec3 index = (p - grid.origin) / grid.voxel_size - 0.5;
    points.emplace_back(static_cast<float>(index.x), static_cast<float>(index.y),
                        static_cast<float>(index.z));
  }
  std::vector<openvdb::Vec3I> triangles;
  for (const glm::uvec3& t : soup.triangles) triangles.emplace_back(t.x, t.y, t.z);
  const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(
      points, triangles);
  const auto transform = openvdb::math::Transform::createLinearTransform(1.0);
  const auto field =
      openvdb::tools::meshToVolume<openvdb::FloatGrid>(adapter, *transform, 1.0F, 1.0F);
  auto mesher = std::make_shared<openvdb::tools::VolumeToMesh>(0.0);
  (*mesher)(*field);
  return mesher;
}
#endif

void measure(const Input& input, int resolution, int rounds) {
  const auto grid = fit_grid(input.box, {.resolution = resolution});
  if (!grid) throw std::runtime_error(grid.error().message);
  const TileListFilter* filter = input.tree ? &input.tree->filter() : nullptr;
  ContourReport report;
  std::size_t triangles = 0;
  std::vector<Participant> all;
  all.push_back({"contour", [&]() -> std::shared_ptr<void> {
                   auto made = contour(input.soup, *grid, {.filter = filter});
                   if (!made) throw std::runtime_error(made.error().message);
                   report = made->report;
                   triangles = made->mesh.triangles.size();
                   return std::make_shared<SolidMesh>(std::move(made->mesh));
                 }});
  all.push_back({"voxelize", [&]() -> std::shared_ptr<void> {
                   auto made = voxelize(input.soup, *grid, {.filter = filter});
                   if (!made) throw std::runtime_error(made.error().message);
                   return std::make_shared<VoxelIntervals>(*std::move(made));
                 }});
#ifdef STRATA_HAVE_OPENVDB
  if (!input.tree) {
    all.push_back({"OpenVDB", [&] { return by_openvdb(input.soup, *grid); }});
  }
#endif
  run_interleaved(all, rounds, 60'000.0);
  fmt::print("{} at {}: {} crossings, {} triangles\n", input.name, resolution, report.crossings,
             triangles);
  for (const Participant& one : all) {
    const Sample typical = median(one.samples);
    fmt::print("  {:<10} {:8.1f} ms wall {:8.1f} ms CPU\n", one.name, typical.wall_ms,
               typical.cpu_ms);
  }
}

}  // namespace

int main(int argc, char** argv) {
  int rounds = 5;
  std::vector<std::string> meshes = {"bumps-82k"};
  int resolution = 0;
  CLI::App app{"Contours of depth lists"};
  app.add_option("MESH", meshes, "meshes, as bench_mesh() takes them");
  app.add_option("-r,--resolution", resolution, "voxels along the longest side (default: two)");
  app.add_option("-n,--rounds", rounds, "runs of each");
  CLI11_PARSE(app, argc, argv);
  try {
#ifdef STRATA_HAVE_OPENVDB
    openvdb::initialize();
#endif
    measure(plate(), resolution > 0 ? resolution : 512, rounds);
    for (const std::string& name : meshes) {
      measure(mesh(name), resolution > 0 ? resolution : 1024, rounds);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_contouring: {}\n", error.what());
    return 1;
  }
  return 0;
}
