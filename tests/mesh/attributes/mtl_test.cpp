// The text of .mtl files.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "mesh/attributes/mtl_file.h"

namespace strata::detail {
namespace {

std::vector<MtlMaterial> parsed(const std::string& text,
                                std::vector<std::string>* warnings = nullptr) {
  const auto materials = parse_mtl(text, "m.mtl", warnings);
  EXPECT_TRUE(materials.has_value()) << materials.error().message;
  return materials.value_or(std::vector<MtlMaterial>{});
}

TEST(Mtl, ColoursAndOpacityAreRead) {
  const auto materials = parsed(
      "# two\nnewmtl first one \r\nKd 0.25 0.5 1\nNs 10\nd 0.5\n\nnewmtl b\n  Kd 0.5\nTr 0.25\n"
      "newmtl c\nd -halo 0.125\nKd spectral curve.rfl\nnewmtl d\n");
  ASSERT_EQ(materials.size(), 4u);
  EXPECT_EQ(materials[0].surface.name, "first one");
  EXPECT_EQ(glm::vec3(materials[0].surface.colour), glm::vec3(0.25f, 0.5f, 1.0f));
  EXPECT_EQ(materials[0].surface.colour.a, 0.5f);
  EXPECT_EQ(glm::vec3(materials[1].surface.colour), glm::vec3(0.5f));
  EXPECT_EQ(materials[1].surface.colour.a, 0.75f);
  EXPECT_EQ(materials[2].surface.colour.a, 0.125f);
  EXPECT_FALSE(materials[2].surface.coloured);
  EXPECT_TRUE(materials[1].surface.coloured);
  EXPECT_EQ(materials[3].surface.colour.a, 1.0f);
}

TEST(Mtl, OpacityCountsMoreThanTransparencyWhereverItStands) {
  EXPECT_EQ(parsed("newmtl a\nd 1\nTr 1\n")[0].surface.colour.a, 1.0f);
  EXPECT_EQ(parsed("newmtl a\nTr 1\nd 0.75\n")[0].surface.colour.a, 0.75f);
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
  EXPECT_EQ(glm::vec3(materials[0].surface.colour), glm::vec3(1.0f, 0.0f, 1.0f));
  EXPECT_EQ(materials[0].surface.colour.a, 1.0f);
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

TEST(Mtl, PicturesAreNamedBehindTheirOptions) {
  const auto materials = parsed(
      "newmtl a\nmap_Kd -s 2 3 1 -o 0.5 -clamp on -mm 0 1 -imfchan r two words.png \r\n"
      "newmtl b\nmap_Kd C:\\pictures\\wood.png\nnewmtl c\nmap_Kd -s 2 2 01.png\n"
      "newmtl d\nmap_Kd -odd.png\nnewmtl e\nmap_Kd\nKd 1 0 0\n");
  ASSERT_EQ(materials.size(), 5u);
  EXPECT_EQ(materials[0].picture, "two words.png");
  EXPECT_EQ(materials[0].scale, glm::vec2(2, 3));
  EXPECT_EQ(materials[0].offset, glm::vec2(0.5f, 0));
  EXPECT_EQ(materials[0].wrap, TextureWrap::kClamp);
  EXPECT_EQ(materials[1].picture, "C:\\pictures\\wood.png");
  EXPECT_EQ(materials[1].wrap, TextureWrap::kRepeat);
  EXPECT_EQ(materials[2].picture, "01.png");
  EXPECT_EQ(materials[2].scale, glm::vec2(2, 2));
  EXPECT_EQ(materials[3].picture, "-odd.png");
  EXPECT_EQ(materials[4].picture, "");
  EXPECT_EQ(materials[4].surface.colour, glm::vec4(1, 0, 0, 1));
}

}  // namespace
}  // namespace strata::detail
