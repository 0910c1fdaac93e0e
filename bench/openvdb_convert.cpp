// A program that does with OpenVDB what `strata voxelize IN -r N -o OUT.vdb` does: a mesh file to
// the mask of its solid voxels; with --sdf, as `vdb_tool -read IN -mesh2ls -write OUT` does, to a
// level set, compressed as OpenVDB does by default. It reads with Strata's reader, so that the
// whole processes differ only in the voxelizer and the writer.

#include <fmt/format.h>
#include <openvdb/io/File.h>
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/openvdb_solid.h"
#include "bench/support.h"
#include "strata/mesh/formats/read_mesh.h"

namespace {

void write_level_set(const strata::TriangleSoup& mesh, const strata::VoxelGrid& grid,
                     const std::string& output) {
  std::vector<openvdb::Vec3s> points;
  for (const glm::dvec3& p : mesh.positions) {
    points.emplace_back(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
  }
  std::vector<openvdb::Vec3I> triangles;
  for (const glm::uvec3& t : mesh.triangles) triangles.emplace_back(t.x, t.y, t.z);
  auto transform = openvdb::math::Transform::createLinearTransform(grid.voxel_size.x);
  const glm::dvec3 first = grid.origin + 0.5 * grid.voxel_size;
  transform->postTranslate({first.x, first.y, first.z});
  const auto surface =
      openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*transform, points, triangles, 3.0F);
  surface->setName("surface");
  openvdb::io::File file(output);
  file.write({surface});
  file.close();
  fmt::print("{} voxels\n", surface->activeVoxelCount());
}

}  // namespace

int main(int argc, char** argv) {
  using namespace strata::bench;
  std::string input, output;
  int resolution = 256, threads = 0;
  bool sdf = false;
  CLI::App app{"A mesh file to the mask of its solid voxels, by OpenVDB"};
  app.add_option("INPUT", input)->required();
  app.add_option("-o,--output", output)->required();
  app.add_option("-r,--resolution", resolution, "voxels along the longest side");
  app.add_option("-j,--threads", threads, "0: all");
  app.add_flag("--sdf", sdf, "a level set of 3 voxels to each side");
  CLI11_PARSE(app, argc, argv);
  try {
    strata::Execution execution;
    execution.threads = threads;
    const auto mesh = strata::read_mesh(input, {}, execution);
    if (!mesh) throw std::runtime_error(mesh.error().message);
    const auto grid = bench_grid(mesh->soup, resolution);
    if (!grid) throw std::runtime_error(grid.error().message);
    openvdb::initialize();
    std::optional<tbb::global_control> limit;
    if (threads > 0) {
      limit.emplace(tbb::global_control::max_allowed_parallelism,
                    static_cast<std::size_t>(threads));
    }
    if (sdf) {
      write_level_set(mesh->soup, *grid, output);
      return 0;
    }
    const openvdb::BoolGrid::Ptr inside = openvdb_solid(mesh->soup, *grid);
    const openvdb::MaskGrid::Ptr mask = openvdb::MaskGrid::create();
    mask->topologyUnion(*inside);
    mask->setName("solid");
    auto transform = openvdb::math::Transform::createLinearTransform(grid->voxel_size.x);
    const glm::dvec3 first = grid->origin + 0.5 * grid->voxel_size;
    transform->postTranslate({first.x, first.y, first.z});
    mask->setTransform(transform);
    openvdb::io::File file(output);
    file.write({mask});
    file.close();
    fmt::print("{} voxels\n", mask->activeVoxelCount());
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_openvdb_convert: {}\n", error.what());
    return 1;
  }
  return 0;
}
