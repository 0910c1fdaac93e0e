// Signed distances in a narrow band, by Strata and by OpenVDB's meshToVolume(3, 3), of the same
// mesh on the same grid with the same number of threads.

#include <fmt/format.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "bench/support.h"
#include "strata/voxelize/distance/signed_distance.h"

namespace strata::bench {
namespace {

/// Points in index space, where OpenVDB's voxel centres are whole numbers.
struct OpenvdbMesh {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;

  OpenvdbMesh(const TriangleSoup& mesh, const VoxelGrid& grid) {
    for (const glm::dvec3& p : mesh.positions) {
      const glm::dvec3 index = (p - grid.origin) / grid.voxel_size - 0.5;
      points.emplace_back(static_cast<float>(index.x), static_cast<float>(index.y),
                          static_cast<float>(index.z));
    }
    for (const glm::uvec3& t : mesh.triangles) triangles.emplace_back(t.x, t.y, t.z);
  }
};

openvdb::FloatGrid::Ptr by_openvdb(const OpenvdbMesh& mesh, float band) {
  const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(
      mesh.points, mesh.triangles);
  const auto transform = openvdb::math::Transform::createLinearTransform(1.0);
  return openvdb::tools::meshToVolume<openvdb::FloatGrid>(adapter, *transform, band, band);
}

std::shared_ptr<ScalarField> by_strata(const TriangleSoup& mesh, const VoxelGrid& grid, double band,
                                       int threads) {
  DistanceOptions options;
  options.band = band;
  options.solid.closedness = Closedness::kAssumeClosed;
  auto made = signed_distance(mesh, grid, options, {.threads = threads});
  return made ? std::make_shared<ScalarField>(*std::move(made)) : nullptr;
}

int run(const std::vector<std::string>& meshes, int resolution, double band, int threads,
        int rounds, bool strata_alone, const std::string& csv) {
  openvdb::initialize();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(threads));
  Table table({"mesh", "triangles", "side", "threads", "ms", "cpu ms", "OpenVDB ms",
               "OpenVDB cpu ms", "ratio", "cpu ratio"});
  for (const std::string& name : meshes) {
    const auto mesh = bench_mesh(name);
    if (!mesh) {
      fmt::print(stderr, "{}\n", mesh.error().message);
      return 1;
    }
    const auto grid = bench_grid(mesh->soup, resolution);
    if (!grid) {
      fmt::print(stderr, "{}\n", grid.error().message);
      return 1;
    }
    const OpenvdbMesh other(mesh->soup, *grid);
    std::vector<Participant> both;
    both.push_back({"Strata", [&] { return by_strata(mesh->soup, *grid, band, threads); }});
    if (!strata_alone) {
      both.push_back({"OpenVDB", [&]() -> std::shared_ptr<void> {
                        return by_openvdb(other, static_cast<float>(band));
                      }});
    }
    run_interleaved(both, rounds, 1e5);
    const Sample ours = median(both[0].samples);
    const Sample theirs = strata_alone ? Sample{} : median(both[1].samples);
    table.add({name, std::to_string(mesh->soup.triangles.size()), std::to_string(resolution),
               std::to_string(threads), short_number(ours.wall_ms), short_number(ours.cpu_ms),
               short_number(theirs.wall_ms), short_number(theirs.cpu_ms),
               short_number(theirs.wall_ms / ours.wall_ms),
               short_number(theirs.cpu_ms / ours.cpu_ms)});
  }
  return publish(table, csv) ? 0 : 1;
}

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) {
  std::vector<std::string> meshes{"bumps-82k", "bumps-328k"};
  int resolution = 1024, threads = 1, rounds = 3;
  double band = 3;
  bool strata_alone = false;
  std::string csv;
  CLI::App app{"Signed distances by Strata and by OpenVDB"};
  app.add_option("MESH", meshes, "names of support.h, or files");
  app.add_option("-r,--resolution", resolution, "voxels along the longest side");
  app.add_option("--band", band, "voxels");
  app.add_option("-j,--threads", threads);
  app.add_option("--rounds", rounds);
  app.add_flag("--strata", strata_alone, "without OpenVDB");
  app.add_option("--csv", csv);
  CLI11_PARSE(app, argc, argv);
  return strata::bench::run(meshes, resolution, band, threads, rounds, strata_alone, csv);
}
