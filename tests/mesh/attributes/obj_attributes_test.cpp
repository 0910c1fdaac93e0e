// Objects, groups, materials, pictures and colours of OBJ files.

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/mesh/attributes/attribute_files.h"
#include "tests/mesh/textures/picture_bytes.h"

namespace strata::testing_attributes {
namespace {

const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

MeshFile obj(const std::string& text, std::size_t chunk_bytes = std::size_t{1} << 19) {
  return with_attributes(MeshFormat::kObj, kSquare + text, chunk_bytes);
}

TEST(ObjParts, ObjectsAndTheirGroupsAreParts) {
  const std::string text =
      "f 1 2 3\no car\nf 1 2 3\nf 1 3 4\ng wheel\r\nf 1 2 3\ng  door left \nf 1 2 3\no road\n"
      "f 1 2 3\ng road\nf 1 3 4\ng wheel\nf 1 3 4\no car\ng wheel\nf 2 3 4\n";
  const Names expected = {"default", "car",  "car",        "car/wheel", "car/door left",
                          "road",    "road", "road/wheel", "car/wheel"};
  for (const std::size_t bytes : {std::size_t{1} << 19, std::size_t{9}}) {
    const MeshFile file = obj(text, bytes);
    EXPECT_EQ(part_names_of(file), expected);
    EXPECT_EQ(file.attributes.parts.size(), 6u);
    EXPECT_TRUE(file.stats.warnings.empty());
  }
}

TEST(ObjParts, GroupsAloneAreParts) {
  // As Maya writes: vertices in the group default, faces in others.
  const MeshFile file =
      obj("g default\ng ball\nf 1 2 3\ng default\ng box lid\nf 1 3 4\ng\nf 1 2 4\n"
          "g default\nf 2 3 4\n");
  EXPECT_EQ(part_names_of(file), (Names{"ball", "box lid", "default", "default"}));
  EXPECT_EQ(file.attributes.parts.size(), 3u);
}

TEST(ObjParts, AFileWithoutNamesHasNone) {
  for (const char* text : {"f 1 2 3\n", "g\nf 1 2 3\n", "o\ng \nf 1 2 3\n", "f 1 2 3\ng late\n"}) {
    const MeshFile file = obj(text);
    EXPECT_TRUE(file.attributes.parts.empty()) << text;
    EXPECT_TRUE(file.attributes.part_ranges.empty()) << text;
  }
}

TEST(ObjParts, FacesAreCountedAsTheReaderCountsThem) {
  // Continued lines, a face with two corners, one with a bad corner, comments, old names of faces.
  const MeshFile file = obj(
      "g a\nf 1 2 \\\n3 4\n# f 1 2 3\\\nf 1 2\ng b\nfo 1 2 3\nl 1 2\nf 1 2 99\nf\t2 3 4\ng c \\\n"
      "f 1 2 3\n");
  EXPECT_EQ(part_names_of(file), (Names{"a", "a", "b", "b", "b", "c \\"}));
  // The square is two triangles of element 0.
  EXPECT_EQ(file.soup.face_elements, (std::vector<std::uint32_t>{0, 0, 2, 4, 5}));
}

TEST(ObjParts, OldMacintoshFilesHaveParts) {
  MeshReadOptions options;
  options.format = MeshFormat::kObj;
  options.list_parts = true;
  const auto file =
      parse_mesh("v 0 0 0\rv 1 0 0\rv 0 1 0\rg a\rf 1 2 3\rg b\rf 1 3 2\r", "f", options);
  ASSERT_TRUE(file.has_value());
  EXPECT_EQ(part_names_of(*file), (Names{"a", "b"}));
}

TEST(ObjParts, AMillionGroupsAreRead) {
  std::string text = kSquare;
  for (int i = 0; i < 1'000'000; ++i) text += "g " + std::to_string(i) + "\nf 1 2 3\n";
  const MeshFile file = with_attributes(MeshFormat::kObj, text);
  ASSERT_EQ(file.attributes.parts.size(), 1'000'000u);
  EXPECT_EQ(file.attributes.parts[file.attributes.part_of(777'777)].name, "777777");
}

TEST(ObjColours, VerticesHaveThem) {
  const MeshFile file = with_attributes(
      MeshFormat::kObj,
      "v 0 0 0 1 0 0.5\nv 1 0 0 0.2 0.4 0.6\nv 1 1 0\nv 0 1 0 0.5\nv 0 0 nan 1 1 0\n"
      "v 2 0 0 0 -1 1\nf 1 2 3\nf 1 3 4\nf 1 3 6\n");
  using C = glm::u8vec4;
  // The fourth has a weight, the fifth is not finite.
  EXPECT_EQ(file.attributes.vertex_colours,
            (std::vector<C>{C(255, 0, 128, 255), C(51, 102, 153, 255), C(255), C(255),
                            C(0, 0, 255, 255)}));
  EXPECT_TRUE(file.attributes.coloured());
  EXPECT_FALSE(obj("f 1 2 3\n").attributes.coloured());
}

TEST(ObjColours, ValuesUpTo255AreBytes) {
  const MeshFile file = with_attributes(
      MeshFormat::kObj, "v 0 0 0 255 0 1\nv 1 0 0 0 128 0\nv 1 1 0 1e9 0 0\nf 1 2 3\n", 9);
  using C = glm::u8vec4;
  EXPECT_EQ(file.attributes.vertex_colours,
            (std::vector<C>{C(255, 0, 1, 255), C(0, 128, 0, 255), C(255, 0, 0, 255)}));
}

class ObjMaterials : public AttributeFiles {};

TEST_F(ObjMaterials, FacesHaveThem) {
  folder_.write("a.mtl", "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\nd 0.5\n");
  folder_.write("a.obj", "mtllib a.mtl\n" + kSquare +
                             "f 1 2 3\nusemtl blue\nf 1 2 \\\n3 4\nf 1 2\n# f 1 2 3\nfo 1 2 3\n"
                             "usemtl bleu\nf 1 3 4\nusemtl red\nusemtl blue\nf 2 3 4\n");
  const MeshFile file = good("a.obj");
  EXPECT_EQ(material_names_of(file), (Names{"-", "blue", "blue", "blue", "-", "blue"}));
  ASSERT_EQ(file.attributes.materials.size(), 2u);
  EXPECT_EQ(file.attributes.materials[1].colour, glm::vec4(0, 0, 1, 0.5f));
  EXPECT_TRUE(file.attributes.materials[1].coloured);
  ASSERT_FALSE(file.stats.warnings.empty());
  EXPECT_NE(file.stats.warnings.back().find("there is no material 'bleu'; did you mean blue?"),
            std::string::npos)
      << file.stats.warnings.back();
  ASSERT_EQ(file.opened.size(), 1u);
  EXPECT_EQ(file.opened[0].path, folder_.file("a.mtl"));
}

TEST_F(ObjMaterials, FilesAreFoundBesideTheMeshAndMissingOnesAreSaid) {
  folder_.write("two words.mtl", "newmtl a\nKd 1 1 1\n");
  folder_.write("b.mtl", "newmtl b\n");
  folder_.write("sub/d.mtl", "newmtl d\n");
  folder_.write("a.obj",
                "mtllib two words.mtl\nmtllib b.mtl c.mtl\nmtllib sub\\d.mtl\n"
                "mtllib C:\\other\\b.mtl\nusemtl b\n" +
                    kSquare + "f 1 2 3\n");
  const MeshFile file = good("a.obj");
  EXPECT_EQ(file.attributes.materials.size(), 3u);
  EXPECT_EQ(material_names_of(file), (Names{"b"}));
  ASSERT_EQ(file.stats.missing.size(), 1u);
  EXPECT_NE(file.stats.missing[0].find("c.mtl is not there"), std::string::npos);
  EXPECT_TRUE(file.stats.warnings.empty());
}

TEST_F(ObjMaterials, NothingIsOpenedWhereNoFaceAsks) {
  folder_.write("a.mtl", "newmtl\n");  // would be refused
  folder_.write("a.obj", "mtllib a.mtl\n" + kSquare + "f 1 2 3\n");
  EXPECT_TRUE(good("a.obj").opened.empty());
  folder_.write("b.obj", "mtllib a.mtl\nusemtl x\n" + kSquare + "f 1 2 3\n");
  EXPECT_TRUE(read_mesh(folder_.file("b.obj")).has_value());
  const auto read_b = read("b.obj");
  ASSERT_FALSE(read_b.has_value());
  EXPECT_NE(read_b.error().message.find("a.mtl:1: newmtl has no name"), std::string::npos);
}

TEST_F(ObjMaterials, FilesOutsideOfTheRootAreRefused) {
  folder_.write("secret.mtl", "newmtl a\nmap_Kd secret.png\n");
  folder_.write("secret.png", testing_textures::rgba_png(1, 1, "abcd"));
  folder_.write("inside/a.obj", "mtllib ../secret.mtl\nusemtl a\n" + kSquare + "f 1 2 3\n");
  folder_.write("inside/b.mtl", "newmtl a\nmap_Kd ../secret.png\n");
  folder_.write("inside/b.obj", "mtllib b.mtl\nusemtl a\n" + kSquare + "f 1 2 3\n");
  std::filesystem::create_symlink(folder_.file("secret.mtl"), folder_.file("inside/link.mtl"));
  folder_.write("inside/c.obj", "mtllib link.mtl\nusemtl a\n" + kSquare + "f 1 2 3\n");
  MeshReadOptions options;
  options.root = folder_.file("inside");
  for (const char* name : {"inside/a.obj", "inside/b.obj", "inside/c.obj"}) {
    EXPECT_TRUE(read(name).has_value()) << name;
    const auto refused = read(name, options);
    ASSERT_FALSE(refused.has_value()) << name;
    EXPECT_EQ(refused.error().code, ErrorCode::kInput);
    EXPECT_NE(refused.error().message.find("outside"), std::string::npos);
  }
}

TEST_F(ObjMaterials, PicturesAreShownByTheirCorners) {
  folder_.write("wood.png", testing_textures::rgba_png(2, 1, "\x10\x20\x30\xff\x40\x50\x60\xff"));
  folder_.write("a.mtl",
                "newmtl wood\nKd 0.5 0.5 0.5\nd 0.25\nmap_Kd -s 2 1 -o 0 0.5 wood.png\n"
                "newmtl plain\nKd 1 0 0\n");
  folder_.write("a.obj", "mtllib a.mtl\nv 0 0 nan\n" + kSquare +
                             "vt 0 0\nvt 1 0\nusemtl wood\nf 2/1 3/2 4/-1\nusemtl plain\n"
                             "f 2/1 4/2 5/1\nusemtl wood\nf -4/3 -3/3/1 -2/1 -1/2\nf 2/1 3/2 4\n"
                             "f 2/1 3/2 4/9\nvt 0.25 0.75\n");
  for (const std::size_t bytes : {std::size_t{1} << 19, std::size_t{9}}) {
    MeshReadOptions options;
    options.chunk_bytes = bytes;
    const MeshFile file = good("a.obj", options);
    const MeshAttributes& all = file.attributes;
    ASSERT_EQ(all.textures.size(), 1u);
    EXPECT_EQ(all.textures[0].width, 2);
    EXPECT_EQ(all.textures[0].texels[1], glm::u8vec4(0x40, 0x50, 0x60, 0xff));
    ASSERT_EQ(all.materials.size(), 2u);
    EXPECT_EQ(all.materials[0].texture, 0u);
    EXPECT_EQ(all.materials[0].colour, glm::vec4(1, 1, 1, 0.25f));
    EXPECT_EQ(all.materials[1].texture, SurfaceMaterial::kNoTexture);
    const auto first = all.corners_of(0);
    ASSERT_EQ(first.size(), 3u);
    EXPECT_EQ(first[0].vertex, 0u);  // the first vertex of the file was dropped
    EXPECT_EQ(first[0].texture_at, glm::vec2(0, 0.5f));
    EXPECT_EQ(first[1].texture_at, glm::vec2(2, 0.5f));
    EXPECT_EQ(first[2].texture_at, glm::vec2(2, 0.5f));
    EXPECT_TRUE(all.corners_of(1).empty());
    const auto square = all.corners_of(2);
    ASSERT_EQ(square.size(), 4u);
    EXPECT_EQ(square[1].vertex, 1u);
    EXPECT_EQ(square[1].texture_at, glm::vec2(0.5f, 1.25f));  // a vt behind the face
    EXPECT_EQ(square[2].texture_at, glm::vec2(0, 0.5f));
    EXPECT_TRUE(all.corners_of(3).empty());  // a corner has none
    EXPECT_TRUE(all.corners_of(4).empty());  // nor is there a ninth
    bool told = false;
    for (const std::string& warning : file.stats.warnings) {
      told = told || warning.find(
                         "a.obj:16: corner of a face has a vt that is not there; 1 such "
                         "corner has no place") != std::string::npos;
    }
    EXPECT_TRUE(told) << file.stats.warnings.back();
    EXPECT_EQ(file.opened.size(), 2u);
  }
  MeshReadOptions flat;
  flat.textures = false;
  const MeshFile file = good("a.obj", flat);
  EXPECT_TRUE(file.attributes.textures.empty());
  EXPECT_EQ(file.attributes.materials[0].colour, glm::vec4(0.5f, 0.5f, 0.5f, 0.25f));
  EXPECT_EQ(file.opened.size(), 1u);
}

TEST_F(ObjMaterials, MissingAndDamagedPicturesAreSaid) {
  folder_.write("a.mtl",
                "newmtl a\nKd 0 1 0\nmap_Kd none.png\nnewmtl b\nKd 0 0 1\nmap_Kd a.obj\n"
                "newmtl unused\nmap_Kd also none.png\n");
  folder_.write("a.obj", "mtllib a.mtl\n" + kSquare + "usemtl a\nf 1 2 3\n");
  const MeshFile file = good("a.obj");
  ASSERT_EQ(file.stats.missing.size(), 1u);
  EXPECT_NE(file.stats.missing[0].find("none.png is not there"), std::string::npos);
  EXPECT_EQ(file.attributes.materials[0].colour, glm::vec4(0, 1, 0, 1));
  folder_.write("b.obj", "mtllib a.mtl\n" + kSquare + "usemtl b\nf 1 2 3\n");
  const MeshFile damaged = good("b.obj");
  ASSERT_EQ(damaged.stats.warnings.size(), 1u);
  EXPECT_NE(damaged.stats.warnings[0].find("a.obj: the picture is neither PNG nor JPEG; the "
                                           "texture is not shown"),
            std::string::npos)
      << damaged.stats.warnings[0];
  EXPECT_EQ(damaged.attributes.materials[1].colour, glm::vec4(0, 0, 1, 1));
  EXPECT_EQ(damaged.attributes.materials[1].texture, SurfaceMaterial::kNoTexture);
}

TEST_F(ObjMaterials, OnePictureOfSeveralMaterialsIsReadOnce) {
  folder_.write("p.png", testing_textures::rgba_png(1, 1, "abcd"));
  folder_.write("a.mtl",
                "newmtl a\nmap_Kd p.png\nnewmtl b\nmap_Kd p.png\nnewmtl c\nmap_Kd -clamp on "
                "p.png\n");
  folder_.write("a.obj", "mtllib a.mtl\n" + kSquare +
                             "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\nusemtl c\nf 1 2 4\n");
  const MeshAttributes all = good("a.obj").attributes;
  ASSERT_EQ(all.textures.size(), 2u);
  EXPECT_EQ(all.materials[0].texture, 0u);
  EXPECT_EQ(all.materials[1].texture, 0u);
  EXPECT_EQ(all.materials[2].texture, 1u);
  EXPECT_EQ(all.textures[1].wrap_v, TextureWrap::kClamp);
}

}  // namespace
}  // namespace strata::testing_attributes
