#include <gtest/gtest.h>

#include <filesystem>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/read_mesh.h"

namespace strata {
namespace {

TEST(Data, IsWhatItsReadmeSays) {
  const struct {
    const char* name;
    std::uint64_t triangles, boundary_edges, components;
  } files[] = {{"knot.obj", 3360, 0, 1},         {"torus.obj", 2304, 0, 1},
               {"two_spheres.stl", 1600, 0, 2},  {"link.ply", 3456, 0, 2},
               {"open_sphere.off", 1776, 48, 1}, {"cavity.off", 1600, 0, 2}};
  for (const auto& file : files) {
    const std::string path = std::string(STRATA_SOURCE_DIR "/data/") + file.name;
    EXPECT_LT(std::filesystem::file_size(path), 100'000u) << file.name;
    const auto mesh = read_mesh(path);
    ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
    EXPECT_TRUE(mesh->stats.warnings.empty()) << mesh->stats.warnings.front();
    const MeshDiagnosis d = diagnose(mesh->soup);
    EXPECT_EQ(d.triangles, file.triangles) << file.name;
    EXPECT_EQ(d.boundary_edges, file.boundary_edges) << file.name;
    EXPECT_EQ(d.unbalanced_edges, file.boundary_edges) << file.name;
    EXPECT_EQ(d.components, file.components) << file.name;
    EXPECT_EQ(d.degenerate_faces + d.duplicate_faces, 0u) << file.name;
    EXPECT_GT(d.volume, 0.0) << file.name;
  }
}

}  // namespace
}  // namespace strata
