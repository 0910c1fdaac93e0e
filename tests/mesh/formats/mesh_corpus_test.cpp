#include "tests/mesh/formats/mesh_corpus.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <map>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/read_mesh.h"

namespace strata {
namespace {
using namespace testing_mesh;

/// Public files that cannot be read, and a part of what is said about them. A refusal that is not
/// in this table, or a file in it that suddenly can be read, fails the test.
const std::map<std::string, std::string> kRefused = {
    {"assimp/OutOfMemory.off", "353535235358 vertices and 6 faces are claimed"},
    {"assimp/box_UTF16BE.obj", "is UTF-16 text"},
    {"assimp/empty.obj", "empty"},
    {"assimp/empty.off", "empty"},
    {"assimp/empty.ply", "empty"},
    {"assimp/invalid.off", ":7: expected corner 0 of the 2 of face 1, found the end of the line"},
    {"assimp/issue623.ply", "is not a value in element vertex 1 of 24"},  // no element face
    {"assimp/number_formats.obj", ":11: '3.1+e2' is not a number"},
    {"assimp/point_cloud.obj", "no faces"},
    {"assimp/points.ply", "no faces"},
    {"assimp/pond.0.ply", "70051 elements 'vertex' are claimed"},  // 69 bytes short
    {"assimp/testline.obj", "no faces"},
    {"assimp/testpoints.obj", "no faces"},
    {"cgal/b9.ply", "no faces"},
    {"cgal/b9_training.ply", "no faces"},
    {"cgal/ball.ply", "no faces"},
    {"cgal/building.ply", "no faces"},
    {"cgal/circles.ply", "no faces"},
    {"cgal/colors.ply", "no faces"},
    {"cgal/example.ply", "no faces"},
    {"cgal/hippo1.ply", "no faces"},
    {"cgal/hippo2.ply", "no faces"},
    {"cgal/kitten.off", "no faces"},
    {"cgal/oni.ply", "no faces"},
    {"cgal/spheres.ply", "no faces"},
    {"openscad/empty.stl", "empty"},
    {"openscad/empty2.stl", "no vertices"},
    {"openscad/invalidvertex.stl", ":89: 'blah' is not a number"},
    {"openscad/unparseable.stl", ":4: byte 0x10 is not a number"},
};

TEST(Corpus, EveryPublicFileIsReadOrRefusedAsKnown) {
  const std::string scratch = testing::TempDir() + "strata_corpus_" + std::to_string(::getpid());
  const auto files = corpus_files(scratch);
  for (const CorpusFile& entry : files) {
    SCOPED_TRACE(entry.name);
    const auto file = read_mesh(entry.path);
    const auto known = kRefused.find(entry.name);
    if (!file) {
      EXPECT_EQ(file.error().code, ErrorCode::kInput);
      ASSERT_NE(known, kRefused.end()) << file.error().message;
      EXPECT_NE(file.error().message.find(known->second), std::string::npos)
          << file.error().message;
      continue;
    }
    EXPECT_EQ(known, kRefused.end()) << "can be read now";
    // What the soup promises.
    ASSERT_EQ(file->stats.triangles, file->soup.triangles.size());
    for (const glm::uvec3& t : file->soup.triangles) {
      ASSERT_LT(std::max({t.x, t.y, t.z}), file->soup.positions.size());
    }
    ASSERT_TRUE(file->soup.face_elements.empty() ||
                file->soup.face_elements.size() == file->soup.triangles.size());
    const MeshDiagnosis d = diagnose(file->soup);
    EXPECT_EQ(d.non_finite_faces, 0u);
    EXPECT_EQ(d.closed, is_closed(file->soup));
    // One thread reads the same.
    Execution one;
    one.threads = 1;
    const auto again = read_mesh(entry.path, {}, one);
    ASSERT_TRUE(again.has_value());
    EXPECT_TRUE(again->soup.positions == file->soup.positions);
    EXPECT_TRUE(again->soup.triangles == file->soup.triangles);
    EXPECT_TRUE(again->soup.face_elements == file->soup.face_elements);
  }
  std::filesystem::remove_all(scratch);
  if (files.empty()) {
    GTEST_SKIP() << "no public meshes here (Debian: assimp-testmodels, openscad-testing-data, "
                    "libcgal-demo)";
  }
}

}  // namespace
}  // namespace strata
