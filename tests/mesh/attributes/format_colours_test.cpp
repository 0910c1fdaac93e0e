// Parts and colours of STL, PLY and OFF files.

#include <gtest/gtest.h>

#include <cstring>

#include "tests/mesh/attributes/attribute_files.h"

namespace strata::testing_attributes {
namespace {

using C = glm::u8vec4;
using Colours = std::vector<C>;

std::string facet(int x) {
  const std::string at = std::to_string(x);
  return "facet normal 0 0 1\nouter loop\nvertex " + at + " 0 0\nvertex " + at + " 1 0\nvertex " +
         at + " 0 1\nendloop\nendfacet\n";
}

TEST(StlParts, SolidsOfATextAreParts) {
  const std::string text = "solid lid\r\n" + facet(0) + facet(1) + "endsolid lid\nsolid\n" +
                           facet(2) + "endsolid\nsolid empty\nendsolid\nsolid lid\n" + facet(3) +
                           "endsolid\nsolidbox 2\n" + facet(4) + "endsolid box\n";
  const Names expected = {"lid", "lid", "solid", "lid (2)", "box 2"};
  for (const std::size_t bytes : {std::size_t{1} << 19, std::size_t{9}}) {
    const MeshFile file = with_attributes(MeshFormat::kStl, text, bytes);
    EXPECT_EQ(part_names_of(file), expected) << bytes;
    EXPECT_EQ(file.attributes.parts.size(), 4u);
  }
  EXPECT_TRUE(with_attributes(MeshFormat::kStl, "solid\n" + facet(0) + "endsolid\n")
                  .attributes.parts.empty());
  const MeshFile one = with_attributes(MeshFormat::kStl, "solid one\n" + facet(0) + "endsolid\n");
  EXPECT_EQ(part_names_of(one), (Names{"one"}));
}

/// A binary file: triangles that only differ in x, with these attributes.
std::string binary_stl(std::string header, const std::vector<std::uint16_t>& attributes) {
  header.resize(80, ' ');
  const auto count = static_cast<std::uint32_t>(attributes.size());
  header.append(reinterpret_cast<const char*>(&count), 4);
  float x = 0.0f;
  for (const std::uint16_t attribute : attributes) {
    const float numbers[12] = {0, 0, 1, x, 0, 0, x, 1, 0, x, 0, 1};
    header.append(reinterpret_cast<const char*>(numbers), sizeof numbers);
    header.append(reinterpret_cast<const char*>(&attribute), 2);
    x += 1.0f;
  }
  return header;
}

Colours stl_colours(const std::string& header, const std::vector<std::uint16_t>& attributes) {
  return with_attributes(MeshFormat::kStl, binary_stl(header, attributes))
      .attributes.element_colours;
}

TEST(StlColours, BitFifteenDeclaresThem) {
  // Blue in the low bits.
  EXPECT_EQ(stl_colours("exported", {0x8000 | 31, 0x8000 | 31 << 10, 0, 0x8000 | 16 << 5}),
            (Colours{C(0, 0, 255, 255), C(255, 0, 0, 255), C(255), C(0, 132, 0, 255)}));
}

TEST(StlColours, AHeaderOfMagicsTurnsTheirOrder) {
  const std::string header = std::string("COLOR=") + "\x10\x20\x30\xff" + ",MATERIAL=";
  EXPECT_EQ(
      stl_colours(header, {31, 31 << 10, 0x8000, 16 << 5}),
      (Colours{C(255, 0, 0, 255), C(0, 0, 255, 255), C(0x10, 0x20, 0x30, 255), C(0, 132, 0, 255)}));
  // No facet has one of its own.
  EXPECT_EQ(stl_colours(header, {0, 0}), (Colours(2, C(0x10, 0x20, 0x30, 255))));
}

TEST(StlColours, OtherBytesAreNone) {
  EXPECT_TRUE(stl_colours("exported", {0, 0, 0}).empty());
  EXPECT_TRUE(stl_colours("exported", {31, 31, 31}).empty());
  EXPECT_TRUE(stl_colours("exported", {0x8000 | 31, 7, 0}).empty());  // bit 15 by chance
  EXPECT_TRUE(stl_colours(std::string(72, ' ') + "COLOR=ab", {0, 0}).empty());
}

TEST(PlyColours, BytesOfVertices) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty uchar red\nproperty float x\n"
      "property float y\nproperty float z\nproperty uchar green\nproperty uchar blue\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const MeshFile file = with_attributes(
      MeshFormat::kPly,
      header + faces + "255 0 0 0 1 2\n0 1 0 0 128 3\n9 nan 0 0 9 9\n7 0 1 0 8 9\n3 0 1 3\n");
  // The third vertex is not finite.
  EXPECT_EQ(file.attributes.vertex_colours,
            (Colours{C(255, 1, 2, 255), C(0, 128, 3, 255), C(7, 8, 9, 255)}));
  EXPECT_TRUE(file.attributes.element_colours.empty());
  const MeshFile alpha =
      with_attributes(MeshFormat::kPly, header + "property uchar alpha\n" + faces +
                                            "255 0 0 0 1 2 3\n0 1 0 0 0 0 4\n0 1 1 0 0 0 5\n"
                                            "0 0 1 0 0 0 0\n3 0 1 3\n");
  EXPECT_EQ(alpha.attributes.vertex_colours[0], C(255, 1, 2, 3));
  EXPECT_EQ(alpha.attributes.vertex_colours[3], C(0, 0, 0, 0));
}

TEST(PlyColours, FacesHaveThemToo) {
  const MeshFile file = with_attributes(
      MeshFormat::kPly,
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face 3\nproperty list uchar int vertex_index\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
      "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 10 20 30\n2 0 1 1 1 1\n3 0 1 2 40 50 60\n");
  EXPECT_EQ(file.attributes.element_colours,
            (Colours{C(10, 20, 30, 255), C(1, 1, 1, 255), C(40, 50, 60, 255)}));
  EXPECT_EQ(file.soup.face_elements.back(), 2u);
}

TEST(PlyColours, FloatsAndWordsOfBinaryFiles) {
  std::string text =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
      "property float y\nproperty float z\nproperty float red\nproperty float green\n"
      "property float blue\nelement face 1\nproperty list uchar int vertex_indices\n"
      "property ushort red\nproperty ushort green\nproperty ushort blue\nend_header\n";
  const auto put = [&](auto value) {
    text.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (const float number : {0.f, 0.f, 0.f, 1.f, 0.5f, 0.f, 1.f, 0.f, 0.f, 0.f, 0.f, 2.f / 255, 0.f,
                             1.f, 0.f, -1.f, 0.f, 0.2f}) {
    put(number);
  }
  put(std::uint8_t{3});
  for (const int index : {0, 1, 2}) put(index);
  for (const int value : {65535, 257, 0}) put(static_cast<std::uint16_t>(value));
  const MeshFile file = with_attributes(MeshFormat::kPly, text);
  EXPECT_EQ(file.attributes.vertex_colours,
            (Colours{C(255, 128, 0, 255), C(0, 0, 2, 255), C(0, 0, 51, 255)}));
  EXPECT_EQ(file.attributes.element_colours, (Colours{C(255, 1, 0, 255)}));
}

TEST(OffColours, VerticesOfCoff) {
  const std::string faces = "3 0 1 2\n";
  const MeshFile bytes =
      with_attributes(MeshFormat::kOff,
                      "COFF\n3 1 0\n0 0 0 255 0 1 255\n1 0 0 0 128 0 255\n0 1 0 0 0 0 7\n" + faces);
  EXPECT_EQ(bytes.attributes.vertex_colours,
            (Colours{C(255, 0, 1, 255), C(0, 128, 0, 255), C(0, 0, 0, 7)}));
  const MeshFile floats = with_attributes(
      MeshFormat::kOff, "COFF\n3 1 0\n0 0 0 1 0 0.2\n1 0 0 0 0.5 0 # half\n0 1 0 \n" + faces);
  EXPECT_EQ(floats.attributes.vertex_colours,
            (Colours{C(255, 0, 51, 255), C(0, 128, 0, 255), C(255)}));
  // Behind normals, and in a file whose vertices are not one a line.
  const MeshFile normals = with_attributes(
      MeshFormat::kOff,
      "CNOFF\n3 1 0\n0 0 0 0 0 1 10 20 30\n1 0 0 0 0 1 11 21 31\n0 1 0 0 0 1 12 22 32\n" + faces);
  EXPECT_EQ(normals.attributes.vertex_colours[2], C(12, 22, 32, 255));
  const MeshFile wrapped =
      with_attributes(MeshFormat::kOff,
                      "COFF 3 1 0\n0 0\n0 255 0 1 255 1 0\n0 0 128 0 255 0 1 0 0 0 0 7\n" + faces);
  EXPECT_EQ(wrapped.attributes.vertex_colours, bytes.attributes.vertex_colours);
}

TEST(OffColours, FacesInTheirLines) {
  const MeshFile file = with_attributes(
      MeshFormat::kOff,
      "OFF\n4 4 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 255 0 10\n3 0 2 3\n3 1 2 3 7\n"
      "4 0 1 2 3  1 2 3 4 # c\n");
  EXPECT_EQ(file.attributes.element_colours,
            (Colours{C(255, 0, 10, 255), C(255), C(255), C(1, 2, 3, 4)}));
  const MeshFile floats =
      with_attributes(MeshFormat::kOff, "OFF\n3 1 0\n0 0 0\n1 0 0\n1 1 0\n3 0 1 2 1.0 0.2 0.0\n");
  EXPECT_EQ(floats.attributes.element_colours, (Colours{C(255, 51, 0, 255)}));
  EXPECT_FALSE(with_attributes(MeshFormat::kOff, "OFF\n3 1 0\n0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n")
                   .attributes.coloured());
}

}  // namespace
}  // namespace strata::testing_attributes
