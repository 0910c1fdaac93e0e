#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "mesh/formats/openmesh_reader.h"
#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/openmesh_bridge.h"
#include "strata/mesh/shapes.h"
#include "tests/support/corpus.h"
#include "tests/support/temporary_folder.h"

namespace strata {
namespace {

TEST(OpenMeshBridge, ClosedMeshGoesThereAndBackUnchanged) {
  const TriangleSoup mesh = make_torus(2.0, 0.7, 20, 10);
  OpenMeshReport report;
  const OpenMeshTriMesh there = to_openmesh(mesh, &report);
  EXPECT_EQ(there.n_vertices(), mesh.positions.size());
  EXPECT_EQ(there.n_faces(), mesh.triangles.size());
  EXPECT_EQ(there.n_edges(), mesh.triangles.size() * 3 / 2);
  EXPECT_EQ(report.detached_triangles + report.dropped_triangles, 0u);
  for (const auto edge : there.edges()) EXPECT_FALSE(there.is_boundary(edge));
  const TriangleSoup back = from_openmesh(there);
  EXPECT_TRUE(back.positions == mesh.positions);
  EXPECT_TRUE(back.face_elements.empty());
  ASSERT_EQ(back.triangles.size(), mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const glm::uvec3 a = mesh.triangles[t], b = back.triangles[t];
    EXPECT_TRUE(b == a || b == glm::uvec3(a.y, a.z, a.x) || b == glm::uvec3(a.z, a.x, a.y));
  }
}

TEST(OpenMeshBridge, NonManifoldTrianglesAreDetachedNotLost) {
  TriangleSoup mesh = make_box({0, 0, 0}, {1, 1, 1});
  const TriangleSoup other = make_box({1, 1, 0}, {2, 2, 1});
  // Sharing the vertices of the common edge, as a file with merged vertices has it.
  append(mesh, other);
  for (glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      for (std::uint32_t v = 0; v < 8; ++v) {
        if (mesh.positions[t[k]] == mesh.positions[v]) {
          t[k] = v;
          break;
        }
      }
    }
  }
  mesh.triangles.emplace_back(3, 3, 0);
  testing::internal::CaptureStderr();
  OpenMeshReport report;
  const TriangleSoup back = from_openmesh(to_openmesh(mesh, &report));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_GT(report.detached_triangles, 0u);
  EXPECT_EQ(report.dropped_triangles, 1u);
  EXPECT_EQ(back.triangles.size(), 24u);
  EXPECT_TRUE(is_closed(back)) << "by position it still is";
  EXPECT_EQ(signed_volume(back), 2.0);
}

TEST(OpenMeshBridge, DeletedFacesStayBehindAndPolygonsBecomeFans) {
  OpenMeshPolyMesh mesh;
  mesh.request_face_status();
  mesh.request_edge_status();
  mesh.request_vertex_status();
  std::vector<OpenMesh::VertexHandle> v;
  for (int i = 0; i < 6; ++i) v.push_back(mesh.add_vertex({i % 2 * 1.0, i / 2 * 1.0, 0.0}));
  mesh.add_face({v[0], v[1], v[3], v[2]});
  const auto face = mesh.add_face({v[2], v[3], v[5], v[4]});
  EXPECT_EQ(from_openmesh(mesh).face_elements, (std::vector<std::uint32_t>{0, 0, 1, 1}));
  mesh.delete_face(face, false);
  EXPECT_EQ(from_openmesh(mesh).triangles.size(), 2u);
}

TEST(OpenMeshReader, FileThatAbortsItIsRefusedBefore) {
  const testkit::TemporaryFolder folder;
  MeshReadOptions options;
  options.reader = MeshReader::kOpenMesh;
  const auto file = read_mesh(folder.write("abort.obj", "f /1"), options);
  ASSERT_FALSE(file.has_value());
  EXPECT_EQ(file.error().code, ErrorCode::kInput);
  EXPECT_NE(file.error().message.find("OpenMesh was not asked"), std::string::npos);
}

TEST(OpenMeshReader, PipesAndForeignExtensionsAreUsageErrors) {
  MeshReadOptions options;
  options.reader = MeshReader::kOpenMesh;
  options.format = MeshFormat::kStl;
  EXPECT_EQ(read_mesh("-", options).error().code, ErrorCode::kUsage);
  EXPECT_EQ(read_mesh("a.obj", options).error().code, ErrorCode::kUsage);
}

/// The corners of every face element, however it is cut into triangles: the edges that no other of
/// its triangles has the other way round, one after the other.
std::vector<std::vector<glm::dvec3>> polygons(const TriangleSoup& soup) {
  std::vector<std::vector<glm::dvec3>> result;
  const auto element = [&](std::size_t t) {
    return soup.face_elements.empty() ? static_cast<std::uint32_t>(t) : soup.face_elements[t];
  };
  for (std::size_t t = 0; t < soup.triangles.size();) {
    std::map<std::uint32_t, std::uint32_t> next;  // along the outline
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    const std::size_t begin = t;
    for (; t < soup.triangles.size() && element(t) == element(begin); ++t) {
      const glm::uvec3& c = soup.triangles[t];
      for (int i = 0; i < 3; ++i) edges.emplace(c[i], c[(i + 1) % 3]);
    }
    for (const auto& [from, to] : edges) {
      if (!edges.contains({to, from})) next[from] = to;
    }
    std::vector<glm::dvec3>& corners = result.emplace_back();
    std::uint32_t at = soup.triangles[begin].x;
    if (!next.contains(at) && !next.empty()) at = next.begin()->first;
    for (std::size_t i = 0; i < next.size(); ++i, at = next[at]) {
      corners.push_back(soup.positions[at]);
    }
  }
  return result;
}

/// Equal up to the first corner and what float loses.
bool same_polygon(const std::vector<glm::dvec3>& a, const std::vector<glm::dvec3>& b,
                  double tolerance) {
  if (a.size() != b.size()) return false;
  for (std::size_t turn = 0; turn < a.size(); ++turn) {
    bool same = true;
    for (std::size_t i = 0; i < a.size() && same; ++i) {
      const glm::dvec3 d = a[i] - b[(i + turn) % b.size()];
      same = std::abs(d.x) <= tolerance && std::abs(d.y) <= tolerance && std::abs(d.z) <= tolerance;
    }
    if (same) return true;
  }
  return false;
}

/// Where the two readers differ on public files, and why. -1: OpenMesh reads nothing.
struct Difference {
  long own, openmesh;
  const char* why;
};
const std::map<std::string, Difference> kKnown = {
    {"assimp/box_longline.obj",
     {478, 12, "a polygon of 470 corners repeats four vertices; OpenMesh drops repeats"}},
    {"assimp/concave_polygon.obj",
     {64, 62, "a polygon passes twice through two vertices (a bridge to a hole)"}},
    {"assimp/space_in_material_name.obj", {64, 62, "the same polygon"}},
    {"cgal/blobby-shuffled.off", {4050, -1, "comments before OFF"}},
    {"cgal/cube-shuffled.off", {12, -1, "comments before OFF"}},
    {"cgal/cube4-shuffled.off", {12, -1, "comments before OFF"}},
    {"cgal/cube_poly.off", {12, -1, "a comment between header and vertices"}},
    {"cgal/mesh_with_colors.off", {6, -1, "comments before OFF"}},
    {"cgal/mpi_triang.off", {180, -1, "comments before OFF"}},
    {"cgal/oblong-shuffled.off", {840, -1, "comments before OFF"}},
    {"cgal/prim.off", {12, -1, "a comment between header and vertices"}},
    {"cgal/quint_tris.off", {20, 1, "blanks after the colour of a face"}},
    {"cgal/sphere966.off", {1848, -1, "comments before OFF"}},
};

TEST(OpenMeshReader, AgreesWithOursOnPublicFilesButForKnownDifferences) {
  if (testkit::mesh_files().empty()) GTEST_SKIP() << testkit::kNoMeshes;
  int compared = 0;
  for (const testkit::CorpusFile& entry : testkit::mesh_files()) {
    SCOPED_TRACE(entry.name);
    const auto own = read_mesh(entry.path);
    if (!own) continue;  // mesh_corpus_test.cpp lists these
    if (own->stats.format == "3mf" || own->stats.format == "amf") continue;
    const auto other = read_with_openmesh(entry.path);
    const long triangles = other ? static_cast<long>(other->stats.triangles) : -1;
    if (const auto known = kKnown.find(entry.name); known != kKnown.end()) {
      EXPECT_EQ(static_cast<long>(own->stats.triangles), known->second.own) << known->second.why;
      EXPECT_EQ(triangles, known->second.openmesh) << known->second.why;
      continue;
    }
    ASSERT_TRUE(other.has_value()) << other.error().message;
    const auto a = polygons(own->soup), b = polygons(other->soup);
    ASSERT_EQ(a.size(), b.size());
    const Bounds box = bounds(own->soup);
    const double size =
        std::max({std::abs(box.low.x), std::abs(box.low.y), std::abs(box.low.z),
                  std::abs(box.high.x), std::abs(box.high.y), std::abs(box.high.z)});
    for (std::size_t i = 0; i < a.size(); ++i) {
      ASSERT_TRUE(same_polygon(a[i], b[i], size * 0x1p-23)) << "polygon " << i;
    }
    ++compared;
  }
  EXPECT_GT(compared, 0);
}

}  // namespace
}  // namespace strata
