#include <gtest/gtest.h>

#include <array>
#include <map>
#include <utility>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/read_mesh.h"
#include "tests/support/corpus.h"

namespace strata {
namespace {
using testkit::CorpusFile;
using testkit::mesh_files;

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
    {"openscad/3mf-export-expected.3mf", "not a zip archive"},  // its text alone
    {"openscad/amf_broken.amf", ":7: a vertex has no valid y"},
    {"openscad/empty.stl", "empty"},
    {"openscad/empty2.stl", "no vertices"},
    {"openscad/invalidvertex.stl", ":89: 'blah' is not a number"},
    {"openscad/unparseable.stl", ":4: byte 0x10 is not a number"},
};

/// The same of glTF files, by the path of the file or of its folder.
const std::map<std::string, std::string> kRefusedGltf = {
    {"glTF", "1"},  // glTF 1.0
    {"glTF/CesiumMilkTruck", "no asset.version"},
    {"glTF2/BoxTextured-glTF-techniqueWebGL", "it requires the extension KHR_technique_webgl"},
    {"glTF2/BoxWithInfinites-glTF-Binary", "which is not finite; no triangle can be used"},
    {"glTF2/IndexOutOfRange/AllIndicesOutOfRange.gltf", "an index is 65535"},
    {"glTF2/MissingBin", "No such file"},
    {"glTF2/RecursiveNodes", "nodes[0] lies within a circle of children"},
    {"glTF2/SchemaFailures", "scene must be an index of scenes, which has 1 element"},
    {"glTF2/TestNoRootNode/NoScene.gltf", "scene must be an index of scenes, which has 0 elements"},
    {"glTF2/TestNoRootNode/SceneWithoutNodes.gltf", "the scene has no triangles"},
    {"glTF2/draco", "it requires the extension KHR_draco_mesh_compression"},
    {"glTF2/wrongTypes/badArray.gltf", "meshes[0] has no list of primitives"},
    {"glTF2/wrongTypes/badUint.gltf", "must be an index of textures, which has 1 element, got -1"},
};

/// Whether every edge is used as often one way as the other, corners at equal positions being one:
/// counted in a map, without the tables of mesh/.
bool closed_by_counting(const TriangleSoup& soup) {
  using Point = std::array<double, 3>;
  const auto point = [&soup](std::uint32_t i) {
    const glm::dvec3& p = soup.positions[i];
    return Point{p.x + 0.0, p.y + 0.0, p.z + 0.0};  // -0 is 0
  };
  std::map<std::pair<Point, Point>, int> balance;
  for (const glm::uvec3& t : soup.triangles) {
    for (int i = 0; i < 3; ++i) {
      const Point from = point(t[i]), to = point(t[(i + 1) % 3]);
      if (from < to) ++balance[{from, to}];
      if (to < from) --balance[{to, from}];
    }
  }
  for (const auto& [edge, count] : balance) {
    if (count != 0) return false;
  }
  return !balance.empty();
}

/// What a reader promises of every file that it takes. That the meshes are the right ones is held
/// by OpenMesh (openmesh_test.cpp).
void expect_whole(const CorpusFile& entry, const MeshFile& file) {
  ASSERT_EQ(file.stats.triangles, file.soup.triangles.size());
  EXPECT_GT(file.stats.triangles, 0u);
  for (const glm::uvec3& t : file.soup.triangles) {
    ASSERT_LT(std::max({t.x, t.y, t.z}), file.soup.positions.size());
  }
  ASSERT_TRUE(file.soup.face_elements.empty() ||
              file.soup.face_elements.size() == file.soup.triangles.size());
  const MeshDiagnosis d = diagnose(file.soup);
  EXPECT_EQ(d.non_finite_faces, 0u);
  EXPECT_EQ(d.closed, closed_by_counting(file.soup));
  EXPECT_EQ(is_closed(file.soup), d.closed);
  // One thread reads the same.
  Execution one;
  one.threads = 1;
  const auto again = read_mesh(entry.path, {}, one);
  ASSERT_TRUE(again.has_value());
  EXPECT_TRUE(again->soup.positions == file.soup.positions);
  EXPECT_TRUE(again->soup.triangles == file.soup.triangles);
  EXPECT_TRUE(again->soup.face_elements == file.soup.face_elements);
}

TEST(Corpus, EveryPublicFileIsReadOrRefusedAsKnown) {
  if (mesh_files().empty()) GTEST_SKIP() << testkit::kNoMeshes;
  std::size_t read = 0;
  for (const CorpusFile& entry : mesh_files()) {
    SCOPED_TRACE(entry.name);
    const auto file = read_mesh(entry.path);
    const auto known = kRefused.find(entry.name);
    if (!file) {
      if (file.error().code == ErrorCode::kUsage) continue;  // a build without libzip or pugixml
      EXPECT_EQ(file.error().code, ErrorCode::kInput);
      ASSERT_NE(known, kRefused.end()) << file.error().message;
      EXPECT_NE(file.error().message.find(known->second), std::string::npos)
          << file.error().message;
      continue;
    }
    EXPECT_EQ(known, kRefused.end()) << "can be read now";
    expect_whole(entry, *file);
    ++read;
  }
  EXPECT_GT(read, mesh_files().size() / 2);
}

TEST(Corpus, EveryPublicGltfIsReadOrRefusedAsKnown) {
  const std::vector<CorpusFile> files = testkit::gltf_files();
  if (files.empty()) GTEST_SKIP() << testkit::kNoMeshes;
  std::size_t read = 0;
  MeshReadOptions options;
  options.attributes = true;
  for (const CorpusFile& entry : files) {
    SCOPED_TRACE(entry.name);
    const auto file = read_mesh(entry.path, options);
    auto known = kRefusedGltf.end();
    for (auto one = kRefusedGltf.begin(); one != kRefusedGltf.end(); ++one) {
      if (entry.name == one->first || entry.name.starts_with(one->first + "/")) known = one;
    }
    if (file) {
      EXPECT_EQ(known, kRefusedGltf.end()) << "can be read now";
      expect_whole(entry, *file);
      EXPECT_FALSE(file->attributes.parts.empty());
      ++read;
    } else if (file.error().code != ErrorCode::kUsage) {  // a build without nlohmann-json
      EXPECT_EQ(file.error().code, ErrorCode::kInput);
      if (file.error().message.find("no triangles; points and lines") != std::string::npos)
        continue;
      ASSERT_NE(known, kRefusedGltf.end()) << file.error().message;
      EXPECT_NE(file.error().message.find(known->second), std::string::npos)
          << file.error().message;
    }
  }
  EXPECT_GT(read, files.size() / 3);
}

}  // namespace
}  // namespace strata
