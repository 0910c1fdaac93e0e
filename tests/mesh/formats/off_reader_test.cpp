#include <algorithm>

#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/mesh/formats/reading.h"

namespace strata {
namespace {
using namespace testing_mesh;
constexpr auto kOff = MeshFormat::kOff;
const std::string kBody = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";

TEST(OffReader, HeaderMayStandOnOneLineOrManyOrBeMissing) {
  for (const char* header :
       {"OFF\n4 2 0\n", "OFF 4 2 5\n", "OFF\n4 2\n", "4 2 0\n", "OFF\n\n# c\n4\n2\n",
        "# first\nOFF # second\n4 2 0 # third\n", "OFF\r\n4 2 0\r\n", "\xef\xbb\xbfOFF\n4 2 0\n"}) {
    EXPECT_EQ(parsed(kOff, header + kBody).soup.triangles, kTwoTriangles) << header;
  }
}

TEST(OffReader, CommentsAndBlankLinesMayStandAnywhere) {
  const MeshFile file =
      parsed(kOff,
             "OFF\n4 2 0\n\n# vertices\n0 0 0 # here\n\n1 0 0\n# and\n1 1 0\n0 1 0#too\n\n\n"
             "3 0 1 2 # face\n#\n\n3 0 2 3#\n# end\n");
  EXPECT_EQ(file.soup.triangles, kTwoTriangles);
  EXPECT_TRUE(file.stats.warnings.empty());
}

TEST(OffReader, NormalsColoursAndTextureAreSkipped) {
  const std::string vertices = "0 0 0 255 0 0 255\n1 0 0 1 1 1\n1 1 0 9\n0 1 0\n";
  const std::string faces = "3 0 1 2 255 0 0\n3 0 2 3 0.5 0.5 0.5 1\n";
  for (const char* prefix : {"C", "N", "CN", "STC", "STCN", "ST", ""}) {
    EXPECT_EQ(parsed(kOff, prefix + ("OFF\n4 2 0\n" + vertices + faces)).soup.triangles,
              kTwoTriangles)
        << prefix;
  }
}

TEST(OffReader, CountsMayBeGluedToTheWord) {
  for (const char* header : {"OFF4 2 0\n", "  OFF4 2 0\n", "COFF4 2 0\r\n", "\n\tOFF 4 2 0\n",
                             "off\n4 2 0\n", "coff4 2 0\n"}) {
    EXPECT_EQ(parsed(kOff, header + kBody).soup.triangles, kTwoTriangles) << header;
  }
}

TEST(OffReader, PrefixesStandInAnyOrder) {
  for (const char* prefix : {"NC", "CN", "NCST", "STCN", "STNC", "CSTN", "NSTC", "NST"}) {
    const std::string text = prefix + std::string("OFF\n4 2 0\n") + kBody;
    EXPECT_EQ(parsed(kOff, text).soup.triangles, kTwoTriangles) << prefix;
  }
  EXPECT_EQ(parsed(kOff, "N4OFF\n3 1 0\n0 0 0 1\n2 0 0 2\n0 2 0 2\n3 0 1 2\n").soup.positions[1],
            glm::dvec3(1, 0, 0));
  EXPECT_CONTAINS(refusal(kOff, "CCOFF\n4 2 0\n" + kBody), "'C' is not a known prefix of OFF");
}

TEST(OffReader, TokensMayStandInAnyLines) {
  const MeshFile expected = parsed(kOff, "OFF\n4 2 0\n" + kBody);
  for (const char* text :
       {"OFF\n4 2 0\n0 0 0 1 0 0\n1 1 0 0 1 0\n3 0 1 2\n3 0 2 3\n",         // two vertices a line
        "OFF\n4 2 0\n0 0 0\n1 0\n0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n",      // over two lines
        "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3\n0\n1\n2\n3\n0\n2 3\n",  // faces over lines
        "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 3 0 2 3\n",        // two faces a line
        "OFF 4 2 0 0 0 0 1 0 0 1 1 0 0 1 0 3 0 1 2 3 0 2 3",                // all in one
        "OFF\n4 2\n0\n0 0 0 1 0 0 # two\n1 1 0 0 1 0\n3 0 1\n2 255 0 0\n3 0 2 3 0 255 0\n",
        "NOFF\n4 2 0\n0 0 0 0 0 1 1 0 0 0 0 1\n1 1 0 0 0 1 0 1 0 0 0 1\n3 0 1 2\n3 0 2 3\n",
        "COFF\n4 2 0\n0 0 0 1 2 3 4 1 0 0 1 2 3 4\n1 1 0 1 2 3 4 0 1 0 1 2 3 4\n3 0 1 2\n3 0 2 3",
        "COFF\n4 2 0\n0 0 0 1 2 3 1 0 0 1 2 3\n1 1 0 1 2 3 0 1 0 1 2 3\n3 0 1 2\n3 0 2 3\n"}) {
    const MeshFile file = parsed(kOff, text);
    EXPECT_EQ(file.soup.positions, expected.soup.positions) << text;
    EXPECT_EQ(file.soup.triangles, expected.soup.triangles) << text;
    EXPECT_TRUE(file.stats.warnings.empty()) << text;
  }
}

TEST(OffReader, NumberOfEdgesMayHaveALineOfItsOwn) {
  // The last coordinate, 4, must not be taken for the size of a face "3 0 1 2".
  const std::string lines = "0 0 0\n1 0 0\n1 1 0\n0 1 4\n3 0 1 2\n3 0 2 3\n";
  std::string tokens = lines;
  std::replace(tokens.begin(), tokens.end(), ' ', '\n');
  for (const std::string& text :
       {"OFF\n4\n2\n5\n" + lines, "OFF\n4\n2\n5 # edges\n" + lines, "OFF\n4\n2\n5\n" + tokens,
        "OFF\n4 2\n5\n" + lines, "OFF\r\n4\r\n2\r\n5\r\n" + lines, "OFF\n4 2\n" + tokens,
        "OFF\n4\n2\n" + lines}) {
    const MeshFile file = parsed(kOff, text);
    ASSERT_EQ(file.soup.positions.size(), 4u) << text;
    EXPECT_EQ(file.soup.positions[0], glm::dvec3(0)) << text;
    EXPECT_EQ(file.soup.positions[3], glm::dvec3(0, 1, 4)) << text;
    EXPECT_EQ(file.soup.triangles, kTwoTriangles) << text;
    EXPECT_TRUE(file.stats.warnings.empty()) << text;
  }
}

TEST(OffReader, LinesThatLeaveSomethingOverAreReadByTokens) {
  // Read by lines, the colours would be vertices, and the last two vertices faces.
  const MeshFile file =
      parsed(kOff,
             "COFF\n4 2 0\n0 0 0\n9 9 9 1\n1 0 0\n9 9 9 1\n3 1 0\n3 0 1 2\n3 2 1\n3 0 1 2\n"
             "3 0 1 2\n3 0 2 3\n");
  EXPECT_EQ(file.soup.positions[1], glm::dvec3(1, 0, 0));
  EXPECT_EQ(file.soup.positions[3], glm::dvec3(3, 2, 1));
  EXPECT_EQ(file.soup.triangles, kTwoTriangles);
  EXPECT_TRUE(file.stats.warnings.empty());
}

TEST(OffReader, TokensInLinesThatMakeNoWholeAreRefused) {
  // One number too few, one too many: never another mesh.
  for (const char* text : {"OFF\n4 2 0\n0 0 0 1 0 0\n1 1 0 0 1\n3 0 1 2\n3 0 2 3\n",
                           "OFF\n4 2 0\n0 0 0 1 0 0\n1 1 0 0 1 0 7\n3 0 1 2\n3 0 2 3\n",
                           "OFF\n4 2 0\n0 0 0 1 0 0\n1 1 0 0 1 0\n3 0 1 2\n3 0 2\n"}) {
    EXPECT_CONTAINS(refusal(kOff, text), "file:") << text;
  }
}

TEST(OffReader, FourthCoordinateDivides) {
  const MeshFile file =
      parsed(kOff, "4OFF\n4 2 0\n0 0 0 1\n2 0 0 2\n1 1 0 1\n0 4 0 4\n3 0 1 2\n3 0 2 3\n");
  EXPECT_EQ(file.soup.positions[1], glm::dvec3(1, 0, 0));
  EXPECT_EQ(file.soup.positions[3], glm::dvec3(0, 1, 0));
  const MeshFile far =
      parsed(kOff, "4OFF\n4 2 0\n0 0 0 1\n1 0 0 1\n1 1 0 1\n0 1 0 0\n3 0 1 2\n3 0 2 3\n");
  EXPECT_EQ(far.stats.non_finite, 1u);  // a point at infinity
}

TEST(OffReader, DimensionThreeIsAccepted) {
  EXPECT_EQ(parsed(kOff, "nOFF 3\n4 2 0\n" + kBody).soup.triangles.size(), 2u);
  EXPECT_CONTAINS(refusal(kOff, "nOFF 5\n4 2 0\n" + kBody), "only 3 dimensions");
}

TEST(OffReader, ReadsDoublesExactly) {
  const MeshFile file = parsed(kOff, "OFF\n3 1 0\n1234567.123456789 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  EXPECT_EQ(file.soup.positions[0].x, 1234567.123456789);
}

TEST(OffReader, PolygonsAreFansShortFacesCounted) {
  const MeshFile file =
      parsed(kOff, "OFF\n4 3 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 1\n0\n4 0 1 2 3\n");
  EXPECT_EQ(file.soup.triangles, kTwoTriangles);
  EXPECT_EQ(file.soup.face_elements, (std::vector<std::uint32_t>{2, 2}));
  EXPECT_EQ(only_warning(file), "file:7: face has fewer than 3 vertices; 2 faces were dropped");
}

TEST(OffReader, BadIndexIsDroppedWithItsLine) {
  for (const char* bad : {"4", "-1", "99999999999999"}) {
    const MeshFile file = parsed(
        kOff, "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 " + std::string(bad) + " 3\n");
    EXPECT_EQ(file.stats.out_of_range, 1u);
    EXPECT_EQ(
        only_warning(file),
        fmt::format("file:8: face refers to vertex {}, the file has 4; 1 face was dropped", bad));
  }
}

TEST(OffReader, CountsInHeadersAreClaims) {
  EXPECT_CONTAINS(refusal(kOff, "OFF\n2000000000 1 0\n0 0 0\n"),
                  "are claimed, but only 7 bytes follow");
  EXPECT_CONTAINS(refusal(kOff, "OFF\n4 2000000000 0\n" + kBody), "2000000000 faces are claimed");
  EXPECT_EQ(refusal(kOff, "OFF\n4 3 0\n" + kBody),
            "file:9: expected the size of face 2 of 3, the file ends");
  EXPECT_EQ(refusal(kOff, "OFF\n5 2 0\n" + kBody + "\n\n\n"),
            "file:12: expected the size of face 1 of 2, the file ends")
      << "the first face was taken for a vertex";
}

TEST(OffReader, HugeFaceSizeEndsWithTheFile) {
  EXPECT_CONTAINS(refusal(kOff, "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n999999999999 0 1 2\n"),
                  "expected corner 3 of the 999999999999 of face 0, the file ends");
}

TEST(OffReader, WhatFollowsTheLastFaceIsReported) {
  EXPECT_EQ(only_warning(parsed(kOff, "OFF\n4 1 0\n" + kBody)),
            "file:8: text after the last face is ignored");
}

TEST(OffReader, MalformedTextIsNamed) {
  EXPECT_EQ(refusal(kOff, "OFX\n"), "file:1: expected OFF, found 'OFX'");
  EXPECT_EQ(refusal(kOff, "XOFF\n"), "file:1: 'X' is not a known prefix of OFF");
  EXPECT_EQ(refusal(kOff, "OFF BINARY\n"), "file:1: binary OFF files are not supported");
  EXPECT_EQ(refusal(kOff, "OFF\nmany\n"), "file:2: expected the number of vertices, found 'many'");
  EXPECT_EQ(refusal(kOff, "OFF\n4 2 0\n0 0 0\n1 0\n1x 1 0\n" + kBody),
            "file:5: expected coordinate 2 of vertex 1 of 4, found '1x'");
  EXPECT_EQ(refusal(kOff, "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n-3 0 1 2\n"),
            "file:6: face 0 of 1 must have corners, its size is -3");
  EXPECT_EQ(refusal(kOff, "OFF\n0 0 0\n"), "file: no vertices");
}

TEST(OffReader, WrittenMeshComesBackBitForBit) {
  const TriangleSoup mesh = make_icosphere(1.0, 3);
  const MeshFile file = parsed(kOff, mesh_to_bytes(mesh, kOff));
  EXPECT_TRUE(file.soup.positions == mesh.positions);
  EXPECT_TRUE(file.soup.triangles == mesh.triangles);
}

}  // namespace
}  // namespace strata
