#include <bit>
#include <cmath>
#include <cstring>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/mesh/formats/reading.h"

namespace strata {
namespace {
using namespace testing_mesh;
constexpr auto kStl = MeshFormat::kStl;

const std::string kFacet =
    "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1 0\n endloop\n"
    "endfacet\n";

std::string cube_bytes() { return mesh_to_bytes(make_box({0, 0, 0}, {1, 1, 1}), kStl); }

TEST(StlReader, BinaryBySizeNotByTheWordSolid) {
  std::string bytes = cube_bytes();
  bytes.replace(0, 16, "solid facet cube");
  const MeshFile file = parsed(kStl, bytes);
  EXPECT_EQ(file.stats.format, "stl binary");
  EXPECT_EQ(file.soup.triangles.size(), 12u);
}

TEST(StlReader, BinaryCornersAreWeldedByExactPosition) {
  const MeshFile file = parsed(kStl, cube_bytes());
  EXPECT_EQ(file.soup.positions.size(), 8u);
  EXPECT_TRUE(is_closed(file.soup));
}

TEST(StlReader, MinusZeroWeldsWithZero) {
  const std::string flat =
      "solid\n" + kFacet +
      "facet normal 0 0 1 outer loop vertex 1 -0 -0 vertex -0 -0.0 0 vertex 1 -1 0 "
      "endloop endfacet\nendsolid\n";
  EXPECT_EQ(parsed(kStl, flat).soup.positions.size(), 4u);
  std::string bytes = cube_bytes();
  for (std::size_t i = 84 + 12; i + 4 <= bytes.size(); i += 4) {
    // In every second facet, all zeros change their sign.
    if ((i - 84) % 100 >= 48) continue;
    if (std::memcmp(&bytes[i], "\0\0\0\0", 4) == 0) bytes[i + 3] = static_cast<char>(0x80);
  }
  const MeshFile file = parsed(kStl, bytes);
  EXPECT_EQ(file.soup.positions.size(), 8u);
  for (const glm::dvec3& p : file.soup.positions) EXPECT_FALSE(std::signbit(p.x + p.y + p.z));
}

TEST(StlReader, SizeDecidesWhereTheCountIsWrong) {
  const std::string whole = cube_bytes();
  std::string bytes = whole;
  for (const std::uint32_t count : {0u, 1u, 11u, 13u, 4294967295u}) {
    std::memcpy(&bytes[80], &count, 4);
    const MeshFile file = parsed(kStl, bytes);
    EXPECT_EQ(file.soup.triangles, parsed(kStl, whole).soup.triangles) << count;
    EXPECT_EQ(
        only_warning(file),
        fmt::format("file: byte 80 claims {} triangle{}, but the file has 684 bytes, room for "
                    "12: all 12 are read",
                    count, count == 1 ? "" : "s"));
    EXPECT_CONTAINS(refusal(kStl, bytes, true), "room for 12");
  }
  // A file that ends within a triangle is cut off.
  EXPECT_CONTAINS(refusal(kStl, whole.substr(0, 650)), "which end at byte 684");
}

TEST(StlReader, TextOfAnotherKindHasNoTriangles) {
  // As long as one triangle, and as two.
  EXPECT_CONTAINS(refusal(kStl, "o box\n" + std::string(128, 'v')), "claims");
  EXPECT_CONTAINS(refusal(kStl, "o box\n" + std::string(178, 'v')), "claims");
}

TEST(StlReader, BinaryFilesWithoutATriangleAreRefused) {
  std::string bytes = cube_bytes();
  EXPECT_EQ(refusal(kStl, bytes.substr(0, 100)),
            "file: byte 80 claims 12 triangles, which end at byte 684, but the file has 100 bytes");
  bytes[80] = 0;
  EXPECT_EQ(refusal(kStl, bytes.substr(0, 84)), "file: no triangles");
  EXPECT_EQ(refusal(kStl, bytes.substr(0, 50)), "file: 50 bytes are too few for an STL file");
}

TEST(StlReader, BytesAfterTheTrianglesAreReported) {
  const MeshFile file = parsed(kStl, cube_bytes() + "abc");
  EXPECT_EQ(file.soup.triangles.size(), 12u);
  EXPECT_EQ(only_warning(file), "file: 3 bytes after the 12 triangles are ignored");
}

TEST(StlReader, NonFiniteCornersDropTheFacet) {
  std::string bytes = cube_bytes();
  const std::uint32_t nan = 0x7fc00000u;
  std::memcpy(&bytes[84 + 50 * 3 + 12], &nan, 4);
  const MeshFile file = parsed(kStl, bytes);
  EXPECT_EQ(file.stats.non_finite, 1u);
  EXPECT_EQ(file.soup.triangles.size(), 11u);
  EXPECT_EQ(file.soup.face_elements[3], 4u);
  EXPECT_CONTAINS(only_warning(file), "file: triangle 3 (byte 234): face has a vertex at (nan, ");
}

TEST(StlReader, NonFiniteNormalsDoNotMatter) {
  std::string bytes = cube_bytes();
  const std::uint32_t nan = 0x7fc00000u;
  std::memcpy(&bytes[84], &nan, 4);
  EXPECT_EQ(parsed(kStl, bytes).soup.triangles.size(), 12u);
  EXPECT_EQ(parsed(kStl,
                   "solid x\nfacet normal nan -nan(ind) 1.#IND\nouter loop\nvertex 0 0 0\n"
                   "vertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n")
                .soup.triangles.size(),
            1u);
}

TEST(StlReader, FacetOfNoExtentIsDroppedAsDegenerate) {
  std::string bytes = cube_bytes();
  std::memcpy(&bytes[84 + 24], &bytes[84 + 12], 12);
  const MeshFile file = parsed(kStl, bytes);
  EXPECT_EQ(file.stats.degenerate, 1u);
  EXPECT_EQ(file.soup.triangles.size(), 11u);
}

TEST(StlReader, ReadsAsciiWithAnyLineEndAndLetterCase) {
  const std::string text = "solid facet vertex 1 2\n" + kFacet + kFacet + "endsolid facet\n";
  for (const char* end : {"\n", "\r\n", "\r"}) {
    std::string other;
    for (const char c : text) c == '\n' ? other += end : other += c;
    const MeshFile file = parsed(kStl, other);
    EXPECT_EQ(file.stats.format, "stl ascii");
    EXPECT_EQ(file.soup.triangles.size(), 2u);
    EXPECT_EQ(file.soup.positions.size(), 3u);
    EXPECT_TRUE(file.stats.warnings.empty());
  }
  std::string upper = text;
  for (char& c : upper) c = static_cast<char>(std::toupper(c));
  EXPECT_EQ(parsed(kStl, upper).soup.triangles.size(), 2u);
}

TEST(StlReader, FacetsThatAreNotPlainAreReadAsPlainOnes) {
  const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at)) {
      text.replace(at, from.size(), to);
      at += to.size();
    }
    return text;
  };
  const std::string plain = kFacet + replaced(kFacet, "vertex 1 0 0", "vertex 1 0 5") + kFacet;
  const MeshFile expected = parsed(kStl, "solid\n" + plain + "endsolid\n");
  EXPECT_EQ(expected.soup.triangles.size(), 3u);
  EXPECT_TRUE(expected.stats.warnings.empty());
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"endloop", "ENDLOOP"},
           {"endloop", "end loop"},
           {"endfacet\n", "endfacet\nendsolid\nsolid b\n"},
           {"endfacet", "end facet"},
           {"facet normal", "facet  normal"},
           {"normal 0 0 1", "normal 0 0 1 7"},
           {"normal 0 0 1", "normal nan 0 1"},
           {"normal 0 0 1", "normal"},
           {"normal 0 0 1\n", ""},
           {"normal 0 0 1\n", "normal 0 0 1 "},
           {" outer loop", " loop"},
           {" outer loop", " outer\tloop"}}) {
    const MeshFile other = parsed(kStl, "solid\n" + replaced(plain, from, to) + "endsolid\n");
    EXPECT_EQ(other.soup.triangles, expected.soup.triangles) << to;
    EXPECT_EQ(other.soup.positions, expected.soup.positions) << to;
    EXPECT_TRUE(other.stats.warnings.empty()) << to;
  }
  for (const char* glued : {"endloopx", "endfacetx", "outerx"}) {
    const std::string word(glued, std::strlen(glued) - 1);
    const auto read = parse(kStl, "solid\n" + replaced(plain, word, glued) + "endsolid\n");
    EXPECT_TRUE(!read || !read->stats.warnings.empty()) << glued;
  }
}

TEST(StlReader, AsciiSolidsFollowEachOther) {
  const std::string one = "solid a\n" + kFacet + "endsolid a\n";
  EXPECT_EQ(parsed(kStl, one + one).soup.triangles.size(), 2u);
}

TEST(StlReader, AsciiNumbersAreReadAsDouble) {
  const MeshFile file = parsed(
      kStl,
      "solid\nfacet normal 0 0 1\nouter loop\nvertex 1234567.123456789 0 0\nvertex 1e-3 1 0\n"
      "vertex 0 1 0\nendloop\nendfacet\nendsolid\n");
  EXPECT_EQ(file.soup.positions[0].x, 1234567.123456789);
}

TEST(StlReader, AsciiLoopOfFourIsAFan) {
  const MeshFile file =
      parsed(kStl,
             "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\n"
             "vertex 0 1 0\nendloop\nendfacet\nendsolid\n");
  EXPECT_EQ(file.stats.faces, 1u);
  EXPECT_EQ(file.soup.face_elements, (std::vector<std::uint32_t>{0, 0}));
}

TEST(StlReader, SpellingsOfExportersAreRead) {
  const MeshFile expected = parsed(kStl, "solid x\n" + kFacet + kFacet + "endsolid x\n");
  const auto with = [](std::string_view from, std::string_view to) {
    std::string text = "solid x\n" + kFacet + kFacet + "endsolid x\n";
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
      text.replace(at, from.size(), to);
    }
    return text;
  };
  for (const std::string& text :
       {with("endsolid x", "end solid x"), with("endsolid x", "endsolidx"),
        with("endsolid x", "EndSolid \"x y\""), with("endloop", "end loop"),
        with("endfacet", "end facet"), with("endfacet", "End  Facet"),
        with("outer loop", "outer  loop"), with("outer loop", "loop"),
        with("outer loop", "OUTER LOOP"), with("solid x\n", "solidx\n"),
        with("endloop\n", "endloop\n  color 0.2 0.3 0.4\n"),
        with("endfacet\n", "endfacet\ncolor 1 0 0\n\n"),
        with("solid x\n", "solid x\nCOLOUR 1 0 0\n"),
        with("vertex 1 0 0\n", "vertex 1 0 0\n  rgb 1 2 3\n"),
        with("endloop\n", "endloop\n  color 0.2 0.3 0.4 endfacet\n"),
        with("endloop\n", "endloop\r\nmaterial steel\r\n")}) {
    const MeshFile file = parsed(kStl, text);
    EXPECT_EQ(file.soup.triangles, expected.soup.triangles) << text;
    EXPECT_TRUE(file.stats.warnings.empty()) << text << file.stats.warnings.front();
  }
  const MeshFile strange = parsed(kStl, with("endloop\n", "endloop\nweight 3\n"));
  EXPECT_EQ(strange.soup.triangles, expected.soup.triangles);
  EXPECT_EQ(only_warning(strange),
            "file:8: 'weight' is not a word of an ASCII STL file; 2 such lines were skipped");
  EXPECT_CONTAINS(refusal(kStl, with("vertex 1 0 0", "vertx 1 0 0")),
                  "file:5: 'vertx' is not a word of a loop");
}

TEST(StlReader, AsciiErrorsNameTheLine) {
  EXPECT_EQ(refusal(kStl, "solid\n" + kFacet + "facet normal 0 0 1\nouter loop\nvertex 1 2 z\n"),
            "file:11: 'z' is not a number");
  EXPECT_EQ(refusal(kStl, "solid\nvertex 0 0 0\n"), "file:2: vertex outside of a loop");
  EXPECT_EQ(refusal(kStl, "solid\nhello\n"), "file:2: 'hello' is not a word of an ASCII STL file");
  EXPECT_CONTAINS(refusal(kStl, "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"),
                  "the file ends inside a facet");
  EXPECT_CONTAINS(refusal(kStl, "solid\nendsolid\n"), "no vertices");
}

TEST(StlReader, MissingEndsolidIsReported) {
  EXPECT_CONTAINS(only_warning(parsed(kStl, "solid\n" + kFacet)), "the file may be cut short");
}

TEST(StlReader, ChunksAndThreadsMakeTheSameMesh) {
  TriangleSoup mesh = make_torus(2.0, 0.7, 300, 150);
  round_to_float(mesh);
  const std::string bytes = mesh_to_bytes(mesh, kStl);
  std::string text = "solid torus\n";
  for (const glm::uvec3& t : mesh.triangles) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 p = mesh.positions[t[k]];
      text += fmt::format("vertex {} {} {}\n", p.x, p.y, p.z);
    }
    text += "endloop\nendfacet\n";
  }
  text += "endsolid torus\n";
  const auto reference = parse(kStl, bytes, false, 1);
  ASSERT_TRUE(reference.has_value());
  EXPECT_EQ(reference->soup.positions.size(), mesh.positions.size());
  EXPECT_EQ(reference->soup.triangles.size(), mesh.triangles.size());
  for (const std::string* file : {&bytes, static_cast<const std::string*>(&text)}) {
    for (const int threads : {1, 2, 3, 7}) {
      const auto again = parse(kStl, *file, false, threads);
      ASSERT_TRUE(again.has_value());
      EXPECT_TRUE(again->soup.positions == reference->soup.positions);
      EXPECT_TRUE(again->soup.triangles == reference->soup.triangles);
    }
  }
  // The same triangles at the same places, in the same order.
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      ASSERT_EQ(reference->soup.positions[reference->soup.triangles[t][k]],
                mesh.positions[mesh.triangles[t][k]]);
    }
  }
}

}  // namespace
}  // namespace strata
