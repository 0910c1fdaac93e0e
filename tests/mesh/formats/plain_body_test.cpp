// ASCII bodies of OFF and PLY that have nothing but plain lines are read on all threads. The same
// mesh with something else in it is read line by line, and must come out alike.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

#include "strata/mesh/shapes.h"
#include "tests/mesh/formats/reading.h"

namespace strata {
namespace {

using testing_mesh::contains;

const std::string kPlyHead =
    "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float "
    "z\n"
    "element face {}\nproperty list uchar int vertex_indices\nend_header\n";

/// @param blank  stands once behind the first vertex, once behind the first corner
std::string body_of(const TriangleSoup& mesh, const std::string& blank = " ") {
  std::string text;
  std::string gap = blank;
  for (const glm::dvec3& p : mesh.positions) {
    text += fmt::format("{:.6f}{}{:.6f} {:.6f}\n", p.x, gap, p.y, p.z);
    gap = " ";
  }
  gap = blank;
  for (const glm::uvec3& t : mesh.triangles) {
    text += fmt::format("3 {}{}{} {}\n", t.x, gap, t.y, t.z);
    gap = " ";
  }
  return text;
}

std::string off_of(const TriangleSoup& mesh, const std::string& body) {
  return fmt::format("OFF\n{} {} 0\n", mesh.positions.size(), mesh.triangles.size()) + body;
}

std::string ply_of(const TriangleSoup& mesh, const std::string& body) {
  return fmt::format(fmt::runtime(kPlyHead), mesh.positions.size(), mesh.triangles.size()) + body;
}

Result<MeshFile> read(MeshFormat format, const std::string& text, std::size_t chunk_bytes,
                      int threads) {
  MeshReadOptions options;
  options.format = format;
  options.chunk_bytes = chunk_bytes;
  Execution execution;
  execution.threads = threads;
  return parse_mesh(text, "file", options, execution);
}

TEST(PlainBody, IsTheMeshThatIsReadLineByLine) {
  const TriangleSoup mesh = make_uv_sphere(7.5, 60, 40);
  for (const bool ply : {false, true}) {
    const MeshFormat format = ply ? MeshFormat::kPly : MeshFormat::kOff;
    const auto text = [&](const std::string& blank) {
      return ply ? ply_of(mesh, body_of(mesh, blank)) : off_of(mesh, body_of(mesh, blank));
    };
    const auto by_lines = read(format, text("\t"), 1 << 19, 1);
    ASSERT_TRUE(by_lines) << by_lines.error().message;
    ASSERT_EQ(by_lines->soup.triangles, mesh.triangles);
    for (const std::size_t chunk_bytes :
         {std::size_t{40}, std::size_t{5000}, std::size_t{1} << 19}) {
      for (const int threads : {1, 3}) {
        const auto plain = read(format, text(" "), chunk_bytes, threads);
        ASSERT_TRUE(plain) << plain.error().message;
        EXPECT_EQ(plain->soup.positions, by_lines->soup.positions);
        EXPECT_EQ(plain->soup.triangles, by_lines->soup.triangles);
        EXPECT_EQ(plain->soup.face_elements, by_lines->soup.face_elements);
        EXPECT_EQ(plain->stats.faces, mesh.triangles.size());
        EXPECT_EQ(plain->stats.format, by_lines->stats.format);
        EXPECT_TRUE(plain->stats.warnings.empty());
      }
    }
  }
}

TEST(PlainBody, FaultsAreNamedAsInTheMeshThatIsReadLineByLine) {
  const TriangleSoup mesh = make_uv_sphere(7.5, 20, 10);
  const std::string body = body_of(mesh), tabbed = body_of(mesh, "\t");
  const std::string bad_corner = "3 0 1 9999\n";
  const auto expect_alike = [&](MeshFormat format, const std::string& plain,
                                const std::string& slow) {
    const auto a = read(format, plain, 300, 2), b = read(format, slow, 300, 2);
    ASSERT_EQ(a.has_value(), b.has_value()) << (a ? b : a).error().message;
    if (!a) {
      EXPECT_EQ(a.error().message, b.error().message);
      return;
    }
    EXPECT_EQ(a->soup.triangles, b->soup.triangles);
    EXPECT_EQ(a->soup.positions, b->soup.positions);
    EXPECT_EQ(a->stats.warnings, b->stats.warnings);
    EXPECT_FALSE(a->stats.warnings.empty());
  };
  for (const bool ply : {false, true}) {
    const MeshFormat format = ply ? MeshFormat::kPly : MeshFormat::kOff;
    const auto head = [&](std::size_t more_vertices, std::size_t more_faces) {
      TriangleSoup sizes = mesh;
      sizes.positions.resize(sizes.positions.size() + more_vertices);
      sizes.triangles.resize(sizes.triangles.size() + more_faces);
      return ply ? ply_of(sizes, "") : off_of(sizes, "");
    };
    // A corner that is out of range; a face more than is claimed; one fewer; a vertex fewer.
    expect_alike(format, head(0, 1) + body + bad_corner, head(0, 1) + tabbed + bad_corner);
    if (!ply)
      expect_alike(format, head(0, 0) + body + "3 0 1 2\n", head(0, 0) + tabbed + "3 0 1 2\n");
    expect_alike(format, head(0, 1) + body, head(0, 1) + tabbed);
    expect_alike(format, head(1, 0) + body, head(1, 0) + tabbed);
  }
}

}  // namespace
}  // namespace strata
