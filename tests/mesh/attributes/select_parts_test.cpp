// The parts of a mesh that are kept, and attributes of several meshes as one.

#include <gtest/gtest.h>

#include "strata/mesh/soup_tools.h"
#include "tests/mesh/attributes/attribute_files.h"

namespace strata::testing_attributes {
namespace {

/// Two triangles of the object car, one of them its wheel, and one far away.
const std::string kCar =
    "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0\nv 9 9 9\nv 8 9 9 0 0 1\nv 8 8 9\n"
    "o far\nf 5 6 7\no car\nf 1 2 3\ng wheel\nf 1 3 4\n";

Result<MeshFile> read_parts(const std::string& text, const std::vector<std::string>& parts,
                            bool attributes = true) {
  MeshReadOptions options;
  options.format = MeshFormat::kObj;
  options.attributes = attributes;
  options.parts = parts;
  return parse_mesh(text, "file", options);
}

TEST(SelectParts, OthersAreGone) {
  const auto far = read_parts(kCar, {"far"});
  ASSERT_TRUE(far.has_value()) << far.error().message;
  EXPECT_EQ(far->soup.triangles.size(), 1u);
  EXPECT_EQ(bounds(far->soup).low, glm::dvec3(8, 8, 9));
  EXPECT_EQ(far->soup.positions.size(), 3u);
  EXPECT_EQ(far->stats.triangles, 1u);
  EXPECT_EQ(far->attributes.vertex_colours[1], glm::u8vec4(0, 0, 255, 255));
  ASSERT_EQ(far->attributes.parts.size(), 1u);
  EXPECT_EQ(far->attributes.parts[0].name, "far");

  const auto wheel = read_parts(kCar, {"car/wheel"});
  ASSERT_TRUE(wheel.has_value());
  EXPECT_EQ(wheel->soup.face_elements, (std::vector<std::uint32_t>{2}));  // numbers of the file
  EXPECT_EQ(wheel->attributes.part_of(2), 0u);
  EXPECT_EQ(wheel->attributes.part_of(0), MeshAttributes::kNone);
}

TEST(SelectParts, AnObjectKeepsItsGroups) {
  const auto car = read_parts(kCar, {"car"}, false);
  ASSERT_TRUE(car.has_value());
  EXPECT_EQ(car->soup.triangles.size(), 2u);
  EXPECT_EQ(bounds(car->soup).high, glm::dvec3(1, 1, 0));
  const auto all = read_parts(kCar, {"far", "car"});
  ASSERT_TRUE(all.has_value());
  EXPECT_EQ(all->soup.triangles.size(), 3u);
  EXPECT_EQ(all->attributes.parts.size(), 3u);
}

TEST(SelectParts, UnknownNamesAreRefusedWithTheNamesThatThereAre) {
  const auto refused = read_parts(kCar, {"far", "cra"});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kInput);
  EXPECT_EQ(refused.error().message,
            "file: there is no part 'cra'; did you mean car?; its parts are 'far', 'car', "
            "'car/wheel'");
  const auto none = read_parts("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {"a"});
  ASSERT_FALSE(none.has_value());
  EXPECT_EQ(none.error().message, "file: there is no part 'a': the file names no parts");
  // Names that would speak to a terminal.
  const auto hostile = read_parts("v 0 0 0\nv 1 0 0\nv 0 1 0\ng a\x1b[2Jb\nf 1 2 3\n", {"\x1b[2J"});
  ASSERT_FALSE(hostile.has_value());
  EXPECT_EQ(hostile.error().message.find('\x1b'), std::string::npos);
}

TEST(SelectParts, APartWithoutUsableTrianglesIsRefused) {
  const auto refused = read_parts("v 0 0 0\nv 1 0 0\nv 0 1 0\ng a\nf 1 2 3\ng b\nf 1 2 9\n", {"b"});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().message, "file: no triangle of the part 'b' can be used");
}

TEST(AppendAttributes, NumbersOfTheSecondMeshFollow) {
  const std::string coloured = "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\ng a\nf 1 2 3\n";
  const std::string plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 9\n";
  const MeshFile first = with_attributes(MeshFormat::kObj, plain);
  const MeshFile second = with_attributes(MeshFormat::kObj, coloured);
  MeshFile all;
  for (const MeshFile* one : {&first, &second, &first, &second}) {
    append(all.soup, all.attributes, one->soup, one->attributes, one->stats.faces);
  }
  ASSERT_EQ(all.soup.triangles.size(), 4u);
  Names parts;
  for (std::size_t t = 0; t < 4; ++t) {
    const std::uint32_t element =
        all.soup.face_elements.empty() ? static_cast<std::uint32_t>(t) : all.soup.face_elements[t];
    const std::uint32_t part = all.attributes.part_of(element);
    parts.push_back(part == MeshAttributes::kNone ? "-" : all.attributes.parts[part].name);
    const glm::u8vec4 colour = all.attributes.vertex_colours[all.soup.triangles[t].y];
    EXPECT_EQ(colour, t % 2 == 0 ? glm::u8vec4(255) : glm::u8vec4(255, 0, 0, 255)) << t;
  }
  EXPECT_EQ(parts, (Names{"-", "a", "-", "a (2)"}));
}

}  // namespace
}  // namespace strata::testing_attributes
