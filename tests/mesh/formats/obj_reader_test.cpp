#include <random>

#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/mesh/formats/reading.h"

namespace strata {
namespace {
using namespace testing_mesh;
constexpr auto kObj = MeshFormat::kObj;
const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(ObjReader, ReadsTrianglesAndSkipsWhatItDoesNotKnow) {
  const MeshFile file =
      parsed(kObj, "# a comment\nmtllib x.mtl\no thing\n" + kSquare +
                       "vt 0 0\nvn 0 0 1\nvp 1\ng part\ns off\nusemtl red\nf 1 2 3\nf 1 3 4\n");
  EXPECT_EQ(file.stats.format, "obj");
  EXPECT_EQ(file.soup.positions.size(), 4u);
  ASSERT_EQ(file.soup.triangles.size(), 2u);
  EXPECT_EQ(file.soup.triangles[1], glm::uvec3(0, 2, 3));
  EXPECT_TRUE(file.soup.face_elements.empty());
  EXPECT_TRUE(file.stats.warnings.empty());
}

TEST(ObjReader, TakesTheVertexOutOfEveryFormOfCorner) {
  for (const char* face : {"f 1 2 3", "f 1/7 2/8 3/9", "f 1//7 2//8 3//9", "f 1/4/7 2/5/8 3/6/9",
                           "f  1/  2/\t3/ ", "f +1 +2 +3", "f -4 -3 -2", "fo 1 2 3",
                           "f 1 2 3 # comment", "  f 1 2 3\r", "f 01 002 0003"}) {
    const MeshFile file = parsed(kObj, kSquare + face);
    ASSERT_EQ(file.soup.triangles.size(), 1u) << face;
    EXPECT_EQ(file.soup.triangles[0], glm::uvec3(0, 1, 2)) << face;
  }
}

TEST(ObjReader, PolygonBecomesAFanThatSharesTheElement) {
  const MeshFile file = parsed(kObj, kSquare + "v 0.5 2 0\nf 1 2 3\nf 1 2 3 5 4\nf 1 3 4\n");
  EXPECT_EQ(file.stats.faces, 3u);
  const std::vector<glm::uvec3> expected = {{0, 1, 2}, {0, 1, 2}, {0, 2, 4}, {0, 4, 3}, {0, 2, 3}};
  EXPECT_EQ(file.soup.triangles, expected);
  EXPECT_EQ(file.soup.face_elements, (std::vector<std::uint32_t>{0, 1, 1, 1, 2}));
}

TEST(ObjReader, NegativeIndicesCountBackFromTheFaceNotFromTheEnd) {
  const MeshFile file = parsed(
      kObj, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf -3 -2 -1 -6\n");
  const std::vector<glm::uvec3> expected = {{0, 1, 2}, {3, 4, 5}, {3, 5, 0}};
  EXPECT_EQ(file.soup.triangles, expected);
}

TEST(ObjReader, BackslashContinuesAStatement) {
  const MeshFile file =
      parsed(kObj, "v 0 \\\n0 0\nv 1\\\r\n 0 0\nv 1 1 0\nf 1 \\\n 2 \\\n 3\\\n\n");
  EXPECT_EQ(file.soup.positions[1], glm::dvec3(1, 0, 0));
  EXPECT_EQ(file.soup.triangles, (std::vector<glm::uvec3>{{0, 1, 2}}));
}

TEST(ObjReader, BackslashEndingACommentDoesNotSwallowTheNextLine) {
  const MeshFile file = parsed(kObj, "# from C:\\models\\\n" + kSquare + "f 1 2 3\n");
  EXPECT_EQ(file.soup.positions.size(), 4u);
}

TEST(ObjReader, ReadsAnyLineEnd) {
  std::string text = kSquare + "f 1 2 3\nf 1 3 4";
  for (const char* end : {"\n", "\r\n", "\r"}) {
    std::string other;
    for (const char c : text) c == '\n' ? other += end : other += c;
    EXPECT_EQ(parsed(kObj, other).soup.triangles.size(), 2u);
  }
}

TEST(ObjReader, FaceOutOfRangeIsDroppedCountedAndNamedWithItsLine) {
  const MeshFile file = parsed(kObj, kSquare + "f 1 2 3\nf 1 2 98213\nf 1 2 3 9\nf 1 3 4\n");
  EXPECT_EQ(file.stats.out_of_range, 2u);
  EXPECT_EQ(file.soup.face_elements, (std::vector<std::uint32_t>{0, 3}));
  EXPECT_EQ(only_warning(file),
            "file:6: face refers to vertex 98213, the file has 4; 2 faces were dropped");
}

TEST(ObjReader, IndexZeroAndBeforeTheFirstAreOutOfRange) {
  for (const char* index : {"0", "-5", "99999999999999999999", "4294967297", "-4294967297"}) {
    const MeshFile file = parsed(kObj, kSquare + "f 1 2 3\nf 1 2 " + index + "\n");
    EXPECT_EQ(file.stats.out_of_range, 1u) << index;
    EXPECT_CONTAINS(only_warning(file), fmt::format("file:6: face refers to vertex {},", index));
  }
}

TEST(ObjReader, VertexAfterItsFaceIsNoError) {
  EXPECT_EQ(parsed(kObj, "f 1 2 3\n" + kSquare).stats.out_of_range, 0u);
}

TEST(ObjReader, FaceWithNonFiniteVertexIsDroppedAndCounted) {
  for (const char* bad :
       {"nan", "-nan(ind)", "inf", "-INF", "1e999", "1.#INF", "-1.#IND", "1.#QNAN"}) {
    const MeshFile file =
        parsed(kObj, "v 9 9 " + std::string(bad) + "\n" + kSquare + "f 2 3 4\nf 1 2 3\nf 2 4 5\n");
    EXPECT_EQ(file.stats.non_finite, 1u) << bad;
    EXPECT_EQ(file.soup.positions.size(), 4u) << bad;  // the bad one is gone
    const std::vector<glm::uvec3> expected = {{0, 1, 2}, {0, 2, 3}};
    EXPECT_EQ(file.soup.triangles, expected) << bad;
    EXPECT_EQ(file.soup.face_elements, (std::vector<std::uint32_t>{0, 2})) << bad;
    EXPECT_CONTAINS(only_warning(file), "file:7: face has a vertex at (9, 9, ");
  }
}

TEST(ObjReader, RepeatedCornerDropsTheTriangleNotThePolygon) {
  const MeshFile file = parsed(kObj, kSquare + "f 1 2 2 3\nf 4 4 4\n");
  EXPECT_EQ(file.stats.degenerate, 2u);
  EXPECT_EQ(file.soup.triangles, (std::vector<glm::uvec3>{{0, 1, 2}}));
}

TEST(ObjReader, ZeroAreaAloneIsKept) {
  EXPECT_EQ(parsed(kObj, "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n").soup.triangles.size(), 1u);
}

TEST(ObjReader, FacesOfTwoVerticesAreCountedLinesAndPointsIgnored) {
  const MeshFile file = parsed(kObj, kSquare + "l 1 2\np 1\nf 1 2\nf\nf 1 2 3\n");
  EXPECT_EQ(file.stats.too_few_vertices, 2u);
  EXPECT_EQ(file.stats.ignored, 2u);
  EXPECT_EQ(file.soup.face_elements, (std::vector<std::uint32_t>{2}));
  EXPECT_EQ(only_warning(file), "file:7: face has fewer than 3 vertices; 2 faces were dropped");
}

TEST(ObjReader, StrictTurnsADroppedFaceIntoAnError) {
  EXPECT_CONTAINS(refusal(kObj, kSquare + "f 1 2 3\nf 1 2 9\n", true),
                  "file:6: face refers to vertex 9");
  EXPECT_CONTAINS(refusal(kObj, kSquare + "f 1 2 3\nf 1 2\n", true), "file:6: face has fewer");
  EXPECT_CONTAINS(refusal(kObj, kSquare + "v 1 nan 0\nf 1 2 3\nf 1 2 5\n", true),
                  "file:7: face has");
  EXPECT_TRUE(parse(kObj, kSquare + "f 1 2 3\nf 1 1 2\n", true).has_value());
}

TEST(ObjReader, MalformedLinesAreNamed) {
  EXPECT_EQ(refusal(kObj, "f /1"), "file:1: '/1' is not a vertex of a face");  // aborts OpenMesh 9
  EXPECT_EQ(refusal(kObj, "v 1 2\nf 1 2 3"), "file:1: vertex has 2 of 3 coordinates");
  EXPECT_EQ(refusal(kObj, "v 1 2 3\nv 1,5 2 3\n"), "file:2: '1,5' is not a number");
  EXPECT_EQ(refusal(kObj, "v 1 2 3\n\nf 1 a 3\n"), "file:3: 'a' is not a vertex of a face");
  EXPECT_EQ(refusal(kObj, kSquare + "f 1 2 3 4\nf 1 2 3 4 x\n"),
            "file:6: 'x' is not a vertex of a face");
  EXPECT_EQ(refusal(kObj, "v 1 2 3x\n"), "file:1: '3x' is not a number");
}

TEST(ObjReader, NothingToReadIsAnError) {
  EXPECT_EQ(refusal(kObj, ""), "file: the file is empty");
  EXPECT_EQ(refusal(kObj, "# nothing\n"), "file: no vertices");
  EXPECT_EQ(refusal(kObj, kSquare), "file: no faces");
  EXPECT_CONTAINS(refusal(kObj, kSquare + "f 1 2 9\n"), "none of its 1 faces can be used");
  EXPECT_CONTAINS(refusal(kObj, "ply\nformat ascii 1.0\n"), "it looks like ply");
}

TEST(ObjReader, BentPolygonIsReportedFlatOneIsNot) {
  EXPECT_TRUE(parsed(kObj, kSquare + "f 1 2 3 4\n").stats.warnings.empty());
  const MeshFile file = parsed(kObj, "v 0 0 0\nv 1 0 0\nv 1 1 0.1\nv 0 1 0\nf 1 2 3 4\n");
  EXPECT_EQ(file.stats.non_planar, 1u);
  EXPECT_CONTAINS(only_warning(file), "file:5: polygon is not flat: its corners deviate 0.0");
  // The same triangles wherever the face begins.
  for (const char* face : {"f 2 3 4 1\n", "f 3 4 1 2\n", "f 4 1 2 3\n"}) {
    const std::string text = std::string("v 0 0 0\nv 1 0 0\nv 1 1 0.1\nv 0 1 0\n") + face;
    EXPECT_EQ(six_volumes(parsed(kObj, text).soup), six_volumes(file.soup)) << face;
  }
}

TEST(ObjReader, PolygonsThatRepeatACornerLoseNothingElse) {
  // A concave polygon, one corner twice, and its first one at the end again.
  const MeshFile file =
      parsed(kObj, "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 2 3 4 5 1\nf 1 2 3\n");
  EXPECT_EQ(file.stats.degenerate, 2u);
  EXPECT_EQ(file.soup.triangles.size(), 4u);
  EXPECT_EQ(file.soup.face_elements, (std::vector<std::uint32_t>{0, 0, 0, 1}));
  EXPECT_CONTAINS(only_warning(file), "2 triangles with two corners at the same vertex");
}

TEST(ObjReader, VertexLinesMayCarryWeightsAndColours) {
  EXPECT_EQ(parsed(kObj, "v 1 2 3 1\nv 1 2 4 0.5 0.5 0.5\nv 2 2 2 red\nf 1 2 3\n").stats.vertices,
            3u);
}

// Larger than several chunks, so that joining them is tested: cuts, relative indices, elements.
TEST(ObjReader, ChunksJoinToTheSameMeshForAnyThreads) {
  std::mt19937 random(7);
  std::string text;
  std::vector<glm::uvec3> expected;
  std::vector<std::uint32_t> elements;
  std::uint32_t vertices = 0, element = 0;
  while (text.size() < 3'000'000) {
    // Four corners of a flat convex polygon.
    const double height = static_cast<double>(random() % 1000) * 1e-3;
    for (int i = 0; i < 4; ++i) {
      text += fmt::format("v {} {} {}\n", vertices * 0.25, i * i, height);
      ++vertices;
    }
    switch (random() % 5) {
      case 0:
        text += "f -4 \\\n -3\\\r\n -2\n";
        expected.emplace_back(vertices - 4, vertices - 3, vertices - 2);
        elements.push_back(element);
        break;
      case 1:
        text += fmt::format("f {} -3/1 {}//4 -1\n", vertices - 3, vertices - 1);
        expected.emplace_back(vertices - 4, vertices - 3, vertices - 2);
        expected.emplace_back(vertices - 4, vertices - 2, vertices - 1);
        elements.insert(elements.end(), 2, element);
        break;
      case 2:
        text += "f 1 2\n";
        break;
      case 3:
        text += "# f 1 2 3 \\\n";
        --element;
        break;
      default:
        text += fmt::format("f 1 {} {}\n", vertices, vertices - 1);
        expected.emplace_back(0, vertices - 1, vertices - 2);
        elements.push_back(element);
    }
    ++element;
  }
  for (const int threads : {1, 2, 5}) {
    const auto file = parse(kObj, text, false, threads);
    ASSERT_TRUE(file.has_value()) << file.error().message;
    EXPECT_EQ(file->soup.positions.size(), vertices);
    EXPECT_EQ(file->stats.faces, element);
    EXPECT_TRUE(file->soup.triangles == expected);
    EXPECT_TRUE(file->soup.face_elements == elements);
  }
}

TEST(ObjReader, FirstErrorOfALargeFileIsReportedForAnyThreads) {
  std::string text;
  std::uint64_t lines = 0;
  for (; text.size() < 2'000'000; ++lines) text += "v 0.125 0.5 1\n";
  text += "v 1 2 x\n";
  for (int i = 0; i < 100000; ++i) text += "v 1 2 y\n";
  for (const int threads : {1, 2, 4}) {
    const auto file = parse(kObj, text, false, threads);
    ASSERT_FALSE(file.has_value());
    EXPECT_EQ(file.error().message, fmt::format("file:{}: 'x' is not a number", lines + 1));
  }
}

TEST(ObjReader, WrittenMeshComesBackBitForBit) {
  const TriangleSoup mesh = make_torus(2.0, 0.7, 200, 100);
  const MeshFile file = parsed(kObj, mesh_to_bytes(mesh, kObj));
  EXPECT_TRUE(file.soup.positions == mesh.positions);
  EXPECT_TRUE(file.soup.triangles == mesh.triangles);
}

}  // namespace
}  // namespace strata
