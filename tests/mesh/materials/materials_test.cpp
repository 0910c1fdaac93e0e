// The materials of OBJ files.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "strata/mesh/formats/read_mesh.h"
#include "strata/mesh/materials/read_materials.h"
#include "tests/support/temporary_folder.h"

namespace strata {
namespace {

std::vector<Material> parsed(const std::string& text,
                             std::vector<std::string>* warnings = nullptr) {
  const auto materials = parse_mtl(text, "m.mtl", warnings);
  EXPECT_TRUE(materials.has_value()) << materials.error().message;
  return materials.value_or(std::vector<Material>{});
}

TEST(Mtl, ColoursAndOpacityAreRead) {
  const auto materials = parsed(
      "# two\nnewmtl first one \r\nKd 0.25 0.5 1\nNs 10\nd 0.5\n\nnewmtl b\n  Kd 0.5\nTr 0.25\n"
      "newmtl c\nd -halo 0.125\nKd spectral curve.rfl\nnewmtl d\n");
  ASSERT_EQ(materials.size(), 4u);
  EXPECT_EQ(materials[0].name, "first one");
  EXPECT_EQ(materials[0].colour, glm::vec3(0.25f, 0.5f, 1.0f));
  EXPECT_EQ(materials[0].opacity, 0.5f);
  EXPECT_EQ(materials[1].colour, glm::vec3(0.5f));
  EXPECT_EQ(materials[1].opacity, 0.75f);
  EXPECT_EQ(materials[2].opacity, 0.125f);
  EXPECT_FALSE(materials[2].colour);
  EXPECT_FALSE(materials[3].opacity);
}

TEST(Mtl, OpacityCountsMoreThanTransparencyWhereverItStands) {
  EXPECT_EQ(parsed("newmtl a\nd 1\nTr 1\n")[0].opacity, 1.0f);
  EXPECT_EQ(parsed("newmtl a\nTr 1\nd 0.75\n")[0].opacity, 0.75f);
}

TEST(Mtl, MistakesAreNamedByLine) {
  for (const auto& [text, part] :
       {std::pair("newmtl\n", "m.mtl:1: newmtl has no name"),
        std::pair("Kd 1 1 1\n", "m.mtl:1: Kd stands before the first newmtl"),
        std::pair("newmtl a\nd\n", "m.mtl:2: d: "),
        std::pair("newmtl a\n\nKd 1 x 1\n", "m.mtl:3: Kd: 'x' is not a number"),
        std::pair("newmtl a\nTr 1e999\n", "m.mtl:2: Tr must be 0 to 1, got '1e999'"),
        std::pair("newmtl a\nd 0.5x\n", "m.mtl:2: d: '0.5x' is not a number")}) {
    const auto read = parse_mtl(text, "m.mtl");
    ASSERT_FALSE(read.has_value()) << text;
    EXPECT_EQ(read.error().code, ErrorCode::kInput);
    EXPECT_TRUE(read.error().message.starts_with(part)) << read.error().message;
  }
}

TEST(Mtl, NumbersBeyondOneAreClampedWithAWarning) {
  std::vector<std::string> warnings;
  const auto materials = parsed("newmtl a\nKd 1.5 -1 1\nd 7\n", &warnings);
  EXPECT_EQ(materials[0].colour, glm::vec3(1.0f, 0.0f, 1.0f));
  EXPECT_EQ(materials[0].opacity, 1.0f);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0], "m.mtl:2: Kd is 1.5; it counts as 1");
}

TEST(Mtl, EveryTruncatedLengthIsReadOrRefused) {
  const std::string whole = "newmtl red\nKd 1 0.5 0\nd 0.5\nnewmtl blue\nTr 0.25\n";
  for (std::size_t length = 0; length <= whole.size(); ++length) {
    const auto read = parse_mtl(whole.substr(0, length), "m.mtl");
    if (!read) {
      EXPECT_FALSE(read.error().message.empty());
    }
  }
}

class ObjMaterials : public testing::Test {
 protected:
  void put(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary) << text;
  }
  [[nodiscard]] std::string path(const std::string& name) const {
    return (std::filesystem::path(folder_.path()) / name).string();
  }
  testkit::TemporaryFolder folder_;
};

TEST_F(ObjMaterials, FacesCountAsTheReaderCountsThem) {
  put("a.mtl", "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n");
  put("a.obj",
      "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nusemtl blue\nf 1 2 \\\n3 4\n"
      "f 1 2\n# f 1 2 3\nfo 1 2 3\nusemtl none\nf 1 3 4\nusemtl red\nusemtl blue\nf 2 3 4\n");
  const auto mesh = read_mesh(path("a.obj"));
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  EXPECT_EQ(mesh->stats.faces, 6u);
  const auto read = read_obj_materials(path("a.obj"));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  ASSERT_EQ(read->materials.size(), 2u);
  EXPECT_FALSE(read->of_element(0));
  for (const int element : {1, 2, 3, 5}) {
    EXPECT_EQ(read->of_element(static_cast<std::uint64_t>(element)), 1u) << element;
  }
  EXPECT_FALSE(read->of_element(4));
  ASSERT_EQ(read->warnings.size(), 1u);
  EXPECT_NE(read->warnings[0].find("there is no material 'none'"), std::string::npos);
  EXPECT_EQ(read->files.size(), 1u);
}

TEST_F(ObjMaterials, FilesAreFoundBesideTheMeshAndMissingOnesAreSaid) {
  put("two words.mtl", "newmtl a\nKd 1 1 1\n");
  put("b.mtl", "newmtl b\n");
  put("a.obj",
      "mtllib two words.mtl\nmtllib b.mtl c.mtl\nusemtl b\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const auto read = read_obj_materials(path("a.obj"));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_EQ(read->materials.size(), 2u);
  EXPECT_EQ(read->of_element(0), 1u);
  ASSERT_EQ(read->missing.size(), 1u);
  EXPECT_NE(read->missing[0].find("c.mtl is not there"), std::string::npos);
}

TEST_F(ObjMaterials, FilesOutsideOfTheRootAreRefused) {
  std::filesystem::create_directory(path("inside"));
  put("secret.mtl", "newmtl a\n");
  put("inside/a.obj", "mtllib ../secret.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_TRUE(read_obj_materials(path("inside/a.obj")).has_value());
  const auto read = read_obj_materials(path("inside/a.obj"), path("inside"));
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().code, ErrorCode::kInput);
  EXPECT_NE(read.error().message.find("outside"), std::string::npos);
}

}  // namespace
}  // namespace strata
