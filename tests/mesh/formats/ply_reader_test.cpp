#include <bit>
#include <cstring>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/mesh/formats/reading.h"

namespace strata {
namespace {
using namespace testing_mesh;
constexpr auto kPly = MeshFormat::kPly;

/// Appends a number in the byte order asked for.
template <class T>
void put(std::string& out, T value, bool big) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  if (big == (std::endian::native == std::endian::little)) std::reverse(bytes, bytes + sizeof(T));
  out.append(bytes, sizeof(T));
}

const std::string kAsciiSquare =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\n"
    "property float y\nproperty float z\nelement face 2\nproperty list uchar int vertex_indices\n"
    "end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";

TEST(PlyReader, ReadsAscii) {
  const MeshFile file = parsed(kPly, kAsciiSquare);
  EXPECT_EQ(file.stats.format, "ply ascii");
  EXPECT_EQ(file.soup.triangles, kTwoTriangles);
  EXPECT_EQ(file.soup.positions[2], glm::dvec3(1, 1, 0));
}

TEST(PlyReader, ReadsBothByteOrdersAndAllHeaderLineEnds) {
  for (const bool big : {false, true}) {
    for (const std::string end : {"\n", "\r\n", "\r"}) {
      std::string text = "ply" + end + "format binary_" + (big ? "big" : "little") + "_endian 1.0" +
                         end + "element vertex 4" + end + "property double x" + end +
                         "property double y" + end + "property double z" + end + "element face 2" +
                         end + "property list uchar int vertex_index" + end + "end_header" + end;
      // The first byte of the body looks like a line feed.
      const double low = std::bit_cast<double>(big == (std::endian::native == std::endian::little)
                                                   ? 0x3ff000000000000aull
                                                   : 0x3ff000000000000aull);
      for (const double value : {low, 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.})
        put(text, value, big);
      for (const int triangle : {0, 1}) {
        put(text, std::uint8_t{3}, big);
        for (int k = 0; k < 3; ++k) {
          put(text, static_cast<std::int32_t>(kTwoTriangles[static_cast<std::size_t>(triangle)][k]),
              big);
        }
      }
      const MeshFile file = parsed(kPly, text);
      EXPECT_EQ(file.soup.triangles, kTwoTriangles);
      ASSERT_EQ(file.soup.positions.size(), 4u);
      EXPECT_EQ(file.soup.positions[0].x, low);
    }
  }
}

TEST(PlyReader, StepsOverExtraElementsPropertiesAndListsOfAnyType) {
  for (const bool big : {false, true}) {
    std::string text =
        std::string("ply\nformat binary_") + (big ? "big" : "little") +
        "_endian 1.0\nobj_info x\nelement material 2\nproperty list ushort double w\n"
        "element vertex 3\nproperty uchar red\nproperty short z\nproperty list char float t\n"
        "property uint x\nproperty int8 y\nelement face 1\nproperty float quality\n"
        "property list uint uint16 vertex_indices\nproperty list int8 int8 flags\n"
        "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n";
    for (int i = 0; i < 2; ++i) {
      put(text, std::uint16_t{2}, big);
      put(text, 1.0, big);
      put(text, 2.0, big);
    }
    for (int v = 0; v < 3; ++v) {
      put(text, std::uint8_t{255}, big);
      put(text, static_cast<std::int16_t>(-v), big);
      put(text, static_cast<std::int8_t>(v), big);
      for (int i = 0; i < v; ++i) put(text, 0.5f, big);
      put(text, 4000000000u + static_cast<unsigned>(v), big);
      put(text, static_cast<std::int8_t>(-v * v), big);
    }
    put(text, 0.25f, big);
    put(text, 3u, big);
    for (const int i : {2, 0, 1}) put(text, static_cast<std::uint16_t>(i), big);
    put(text, std::int8_t{1}, big);
    put(text, std::int8_t{7}, big);
    put(text, 0, big);
    put(text, 1, big);
    const MeshFile file = parsed(kPly, text);
    EXPECT_EQ(file.soup.triangles, (std::vector<glm::uvec3>{{2, 0, 1}}));
    ASSERT_EQ(file.soup.positions.size(), 3u);
    EXPECT_EQ(file.soup.positions[2], glm::dvec3(4000000002.0, -4, -2));
    EXPECT_EQ(file.stats.ignored, 3u);  // two materials, one edge
  }
}

TEST(PlyReader, FacesMayStandBeforeVertices) {
  const MeshFile file =
      parsed(kPly,
             "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\n"
             "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
             "3 0 1 2\n0 0 0\n1 0 0\n0 1 0");
  EXPECT_EQ(file.soup.triangles.size(), 1u);
}

TEST(PlyReader, PolygonsAreFansAndShortFacesAreCounted) {
  std::string text = kAsciiSquare;
  text.replace(text.find("3 0 1 2"), std::string::npos, "4 0 1 2 3\n2 0 1\n");
  const MeshFile file = parsed(kPly, text);
  EXPECT_EQ(file.soup.triangles, kTwoTriangles);
  EXPECT_EQ(file.soup.face_elements, (std::vector<std::uint32_t>{0, 0}));
  EXPECT_EQ(only_warning(file), "file:16: face has fewer than 3 vertices; 1 face was dropped");
}

TEST(PlyReader, BadIndicesAreDroppedWithTheirPlace) {
  for (const char* bad : {"4", "-1", "1.5", "1e20", "nan"}) {
    std::string text = kAsciiSquare;
    text.replace(text.rfind("3 0 2 3"), 7, std::string("3 0 2 ") + bad);
    const MeshFile file = parsed(kPly, text);
    EXPECT_EQ(file.stats.out_of_range, 1u) << bad;
    EXPECT_CONTAINS(only_warning(file), "file:16: face refers to vertex ");
  }
}

TEST(PlyReader, CountsInHeadersAreClaims) {
  for (const char* count : {"5000000", "18446744073709551615"}) {
    std::string text = kAsciiSquare;
    text.replace(text.find("vertex 4"), 8, std::string("vertex ") + count);
    EXPECT_CONTAINS(refusal(kPly, text), "elements 'vertex' are claimed");
    text = kAsciiSquare;
    text.replace(text.find("face 2"), 6, std::string("face ") + count);
    EXPECT_CONTAINS(refusal(kPly, text), "elements 'face' are claimed");
  }
  std::string text = kAsciiSquare;
  text.replace(text.find("face 2"), 6, "face 3");
  EXPECT_CONTAINS(refusal(kPly, text), "the file ends in element face 2 of 3");
  text = kAsciiSquare;
  text.replace(text.find("3 0 1 2"), 7, "9999999999 0 1 2");
  EXPECT_CONTAINS(refusal(kPly, text), "the file ends in element face 0 of 2");
  // An element that takes no bytes may claim what it likes.
  text = kAsciiSquare;
  text.insert(text.find("element vertex"), "element nothing 18446744073709551615\n");
  EXPECT_EQ(parsed(kPly, text).soup.triangles.size(), 2u);
}

TEST(PlyReader, ListLengthsThatLieAreRefused) {
  std::string text =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n";
  for (int i = 0; i < 9; ++i) put(text, static_cast<float>(i), false);
  std::string lying = text;
  put(lying, 0xffffffffu, false);
  EXPECT_CONTAINS(refusal(kPly, lying), "the file ends in element face 0 of 1");
  std::string negative = text;
  negative.replace(negative.find("list uint"), 9, "list int8");
  negative.replace(negative.find("int vertex_ind"), 3, "int");
  put(negative, std::int8_t{-3}, false);
  EXPECT_CONTAINS(refusal(kPly, negative), "claims -3 vertices");
}

TEST(PlyReader, AsciiElementsAreLinesWhateverElseStandsOnThem) {
  std::string text = kAsciiSquare;
  for (const char* line : {"1 1 0\n", "3 0 1 2\n", "3 0 2 3\n"}) {
    text.replace(text.find(line), std::string(line).size() - 1,
                 std::string(line, std::string(line).size() - 1) + " 9 1 0.5 x");
  }
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string other;
    for (const char c : text) c == '\n' ? other += end : other += c;
    const MeshFile file = parsed(kPly, other);
    EXPECT_EQ(file.soup.triangles, kTwoTriangles);
    EXPECT_EQ(file.soup.positions, parsed(kPly, kAsciiSquare).soup.positions);
    EXPECT_TRUE(file.stats.warnings.empty());
  }
}

TEST(PlyReader, AsciiElementsThatDoNotFitTheirLinesAreReadByTokens) {
  const std::string header = kAsciiSquare.substr(0, kAsciiSquare.find("0 0 0\n"));
  for (const char* body : {"0 0 0 1 0 0\n1 1 0 0 1 0\n3 0 1 2 3 0 2 3\n",
                           "0 0 0\n1 0\n0\n1 1 0 0 1 0\n3\n0\n1\n2 3\n0 2 3"}) {
    EXPECT_EQ(parsed(kPly, header + body).soup.triangles, kTwoTriangles) << body;
  }
  EXPECT_CONTAINS(refusal(kPly, header + "0 0 0 1 0 0\n1 1 0 0 1 0\n3 0 1 2 3 0 2 3 7\n"), "file");
}

TEST(PlyReader, TriangleStripsTurnAlikeAndRestart) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
      "property float z\nelement tristrips 2\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n";
  // Four sides of a cube as one strip, then bottom and top; a corner is repeated to lead on.
  const MeshFile file =
      parsed(kPly, header + "10 4 0 5 1 6 2 7 3 4 0\n12 0 3 1 2 -1 -1 4 4 4 5 7 6\n");
  EXPECT_EQ(file.soup.triangles.size(), 12u);
  EXPECT_EQ(six_volumes(file.soup), 6.0);
  EXPECT_TRUE(is_closed(file.soup));
  EXPECT_TRUE(file.stats.warnings.empty());
  const MeshFile bad = parsed(kPly, header + "4 0 1 2 3\n6 4 5 -1 5 6 8\n");
  EXPECT_EQ(bad.soup.triangles, (std::vector<glm::uvec3>{{0, 1, 2}, {2, 1, 3}}));
  EXPECT_EQ(only_warning(bad),
            "file:19: face refers to vertex 8, the file has 8; 1 face was dropped");
  // Only -1 begins a new strip.
  const MeshFile negative = parsed(kPly, header + "4 0 1 2 3\n6 4 5 -1 5 6 -7\n");
  EXPECT_EQ(negative.soup.triangles, bad.soup.triangles);
  EXPECT_EQ(only_warning(negative),
            "file:19: face refers to vertex with no valid number, the file has 8; 1 face was "
            "dropped");
}

TEST(PlyReader, BinaryTriangleStripsAreReadToo) {
  for (const bool big : {false, true}) {
    std::string text = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                       "_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                       "property float z\nelement tristrips 1\n"
                       "property list uchar int vertex_indices\nend_header\n";
    for (const int value : {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}) {
      put(text, static_cast<float>(value), big);
    }
    put(text, std::uint8_t{8}, big);
    for (const int corner : {0, 1, 2, 3, -1, 3, 2, 1}) put(text, corner, big);
    EXPECT_EQ(parsed(kPly, text).soup.triangles,
              (std::vector<glm::uvec3>{{0, 1, 2}, {2, 1, 3}, {3, 2, 1}}));
  }
}

TEST(PlyReader, HeaderErrorsNameTheLine) {
  EXPECT_EQ(refusal(kPly, "plx\n"), "file:1: expected 'ply'");
  EXPECT_EQ(refusal(kPly, "ply\nformat binary_middle 1.0\n"),
            "file:2: unknown format 'binary_middle'");
  EXPECT_EQ(refusal(kPly, "ply\nformat ascii 1.0\nelement vertex -4\n"),
            "file:3: '-4' is not an element count");
  EXPECT_EQ(refusal(kPly, "ply\nformat ascii 1.0\nproperty int x\n"),
            "file:3: a property before the first element");
  EXPECT_EQ(refusal(kPly, "ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\n"),
            "file:4: unknown type 'quad'");
  EXPECT_EQ(refusal(kPly, "ply\nformat ascii 1.0\n"), "file:2: the file ends inside the header");
  EXPECT_EQ(refusal(kPly, "ply\nend_header\n"), "file:2: no 'format' line in the header");
  std::string text = kAsciiSquare;
  text.replace(text.find("property float y\n"), 17, "");
  EXPECT_EQ(refusal(kPly, text), "file: element vertex has no property y");
  text = kAsciiSquare;
  text.replace(text.find("vertex_indices"), 14, "corners");
  EXPECT_EQ(refusal(kPly, text), "file: element face has no list vertex_indices");
}

TEST(PlyReader, UnknownHeaderLinesAreReportedAndSkipped) {
  std::string text = kAsciiSquare;
  text.replace(text.find("comment made"), 7, "Created");
  EXPECT_EQ(only_warning(parsed(kPly, text)), "file:3: header line 'Created' is ignored");
}

TEST(PlyReader, PointCloudHasNoFaces) {
  EXPECT_EQ(refusal(kPly,
                    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                    "property float z\nend_header\n0 0 0\n"),
            "file: no faces");
}

TEST(PlyReader, BadNumberNamesTheLine) {
  std::string text = kAsciiSquare;
  text.replace(text.find("1 1 0"), 5, "1 1e 0");
  EXPECT_EQ(refusal(kPly, text), "file:13: '1e' is not a value in element vertex 2 of 4");
}

TEST(PlyReader, WrittenMeshComesBackBitForBit) {
  const TriangleSoup mesh = make_icosphere(1.0, 3);
  const MeshFile file = parsed(kPly, mesh_to_bytes(mesh, kPly));
  EXPECT_TRUE(file.soup.positions == mesh.positions);
  EXPECT_TRUE(file.soup.triangles == mesh.triangles);
}

}  // namespace
}  // namespace strata
