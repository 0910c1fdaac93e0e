#include <gtest/gtest.h>

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <string>
#include <vector>

#include "mesh/gltf/read_gltf.h"
#include "tests/mesh/gltf/glb_files.h"
#include "tests/mesh/textures/picture_bytes.h"

namespace strata {
namespace {

using namespace testing_gltf;
using namespace std::string_literals;

const std::vector<float> kCorners = {0, 0, 0, 1, 0, 0, 0, 1, 0};

/// Red, green; blue, half-transparent white.
std::string four_texels() {
  return testing_textures::rgba_png(2, 2, "\xff\0\0\xff\0\xff\0\xff\0\0\xff\xff\xff\xff\xff\x80"s);
}

std::string as_base64(std::string_view bytes) {
  constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned bits = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += i + k > bytes.size() ? '=' : kLetters[(bits >> (18 - 6 * k)) & 63u];
    }
  }
  return text;
}

void expect_colour(const glm::vec4& got, const glm::vec4& wanted) {
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(got[i], wanted[i], 1e-3) << i;
}

TEST(GltfLooks, BaseColoursBecomeSrgbAndAlphaCountsWhereItIsAsked) {
  GltfText text;
  text.list(kCorners, 3);
  const auto primitive = [](int material) {
    return fmt::format("{{\"attributes\":{{\"POSITION\":0}},\"material\":{}}}", material);
  };
  const GltfModel model = read(text.glb(
      "\"materials\":[{\"name\":\"grey\",\"pbrMetallicRoughness\":"
      "{\"baseColorFactor\":[0.21404114,0,1,0.5]}},"
      "{\"alphaMode\":\"BLEND\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,1,1,0.5]}},"
      "{\"name\":\"plain\"},"
      "{\"extensions\":{\"KHR_materials_pbrSpecularGlossiness\":{\"diffuseFactor\":[0,1,0,1]}},"
      "\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,0,0,1]}}],"
      "\"meshes\":[{\"primitives\":[" +
      primitive(0) + "," + primitive(1) + "," + primitive(1) +
      ",{\"attributes\":{\"POSITION\":0}}," + primitive(3) +
      "]}],\"nodes\":[{\"mesh\":0},{\"mesh\":0}]"));
  const MeshAttributes& look = model.attributes;
  ASSERT_EQ(look.materials.size(), 4u);
  EXPECT_EQ(look.materials[0].name, "grey");
  expect_colour(look.materials[0].colour, {0.5, 0, 1, 1});
  expect_colour(look.materials[1].colour, {1, 1, 1, 0.5});
  expect_colour(look.materials[3].colour, {0, 1, 0, 1});
  EXPECT_TRUE(look.materials[0].coloured);
  EXPECT_FALSE(look.materials[2].coloured);
  EXPECT_TRUE(look.coloured());
  const std::uint32_t wanted[] = {0, 1, 1, MeshAttributes::kNone, 3};
  for (std::uint32_t face = 0; face < 10; ++face) {
    EXPECT_EQ(look.material_of(face), wanted[face % 5]) << face;
  }
}

TEST(GltfLooks, ColoursOfVertices) {
  GltfText text;
  text.list(kCorners, 3);
  text.list(std::vector<float>{0.21404114f, 0, 1, 1, 1, 1, 2, -1, 0}, 3);
  text.list(std::vector<std::uint8_t>{255, 0, 0, 128, 0, 0, 0, 255, 55, 55, 55, 0}, 4,
            ",\"normalized\":true");
  text.list(std::vector<std::uint16_t>{65535, 0, 0, 32768, 0, 0, 0, 0, 0, 0, 0, 0}, 4,
            ",\"normalized\":true");
  const GltfModel model =
      read(text.glb("\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}},"
                    "{\"attributes\":{\"POSITION\":0,\"COLOR_0\":1}},"
                    "{\"attributes\":{\"POSITION\":0,\"COLOR_0\":2}},"
                    "{\"attributes\":{\"POSITION\":0,\"COLOR_0\":3}}]}],"
                    "\"nodes\":[{\"mesh\":0}]"));
  const std::vector<glm::u8vec4>& colours = model.attributes.vertex_colours;
  ASSERT_EQ(colours.size(), 12u);
  EXPECT_EQ(model.soup.positions.size(), 12u);
  const glm::u8vec4 white(255);
  const std::vector<glm::u8vec4> wanted = {white,
                                           white,
                                           white,
                                           {128, 0, 255, 255},
                                           white,
                                           {255, 0, 0, 255},
                                           {255, 0, 0, 128},
                                           {0, 0, 0, 255},
                                           {128, 128, 128, 0},
                                           {255, 0, 0, 128},
                                           {0, 0, 0, 0},
                                           {0, 0, 0, 0}};
  EXPECT_EQ(colours, wanted);
}

/// A triangle with a texture. @param info  more of the texture's place @param image  of the file
GltfModel textured(const std::string& info, const std::string& image, const std::string& more = "",
                   const GltfOptions& options = {.attributes = true}) {
  GltfText text;
  text.list(kCorners, 3);
  text.list(std::vector<float>{0, 0, 1, 0, 0.25f, 0.75f}, 2);
  text.list(std::vector<std::uint8_t>{0, 0, 0, 51, 0, 255}, 2, ",\"normalized\":true");
  text.view(four_texels());
  return read(
      text.glb("\"images\":[" + image +
               "],\"samplers\":[{\"wrapS\":33071,\"wrapT\":33648}],"
               "\"textures\":[{\"source\":0,\"sampler\":0}],"
               "\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0" +
               info + "}}" + more +
               "}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}},"
               "{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1,\"TEXCOORD_1\":2},"
               "\"material\":0}]}],\"nodes\":[{\"mesh\":0}]"),
      options);
}

void expect_places(const GltfModel& model, const std::vector<glm::vec2>& wanted) {
  EXPECT_TRUE(model.attributes.corners_of(0).empty());
  const auto corners = model.attributes.corners_of(1);
  ASSERT_EQ(corners.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(corners[i].texture_at.x, wanted[i].x, 1e-6) << i;
    EXPECT_NEAR(corners[i].texture_at.y, wanted[i].y, 1e-6) << i;
    EXPECT_EQ(corners[i].vertex, model.soup.triangles[1][static_cast<int>(i)]);
  }
}

const std::string kImageOfView = "{\"bufferView\":3,\"mimeType\":\"image/png\"}";

TEST(GltfLooks, TexturesOfTheFileWithTheirWraps) {
  const GltfModel model = textured("", kImageOfView);
  const MeshAttributes& look = model.attributes;
  ASSERT_EQ(look.textures.size(), 1u);
  EXPECT_EQ(look.materials[0].texture, 0u);
  EXPECT_TRUE(look.materials[0].coloured);
  EXPECT_EQ(look.textures[0].wrap_u, TextureWrap::kClamp);
  EXPECT_EQ(look.textures[0].wrap_v, TextureWrap::kMirror);
  EXPECT_EQ(look.textures[0].texels,
            (std::vector<glm::u8vec4>{
                {255, 0, 0, 255}, {0, 255, 0, 255}, {0, 0, 255, 255}, {255, 255, 255, 255}}));
  expect_places(model, {{0, 1}, {1, 1}, {0.25, 0.25}});
  EXPECT_TRUE(model.warnings.empty());
  // alpha counts where the material says so
  const GltfModel clear = textured("", kImageOfView, ",\"alphaMode\":\"MASK\"");
  EXPECT_EQ(clear.attributes.textures[0].texels[3].w, 128);
  // the same picture as text
  const GltfModel text =
      textured("", "{\"uri\":\"data:image/png;base64," + as_base64(four_texels()) + "\"}");
  ASSERT_EQ(text.attributes.textures.size(), 1u);
  EXPECT_EQ(text.attributes.textures[0].texels, look.textures[0].texels);
}

TEST(GltfLooks, OtherSetsOfPlacesAndTransforms) {
  expect_places(textured(",\"texCoord\":1", kImageOfView), {{0, 1}, {0, 0.8}, {0, 0}});
  const auto moved = [](const std::string& how) {
    return ",\"extensions\":{\"KHR_texture_transform\":{" + how + "}}";
  };
  expect_places(textured(moved("\"offset\":[0.5,0.25],\"scale\":[2,4]"), kImageOfView),
                {{0.5, 0.75}, {2.5, 0.75}, {1, -2.25}});
  // a quarter turn counter-clockwise, where v goes down: (u, v) becomes (v, -u)
  expect_places(textured(moved("\"rotation\":1.5707963267948966"), kImageOfView),
                {{0, 1}, {0, 2}, {0.75, 1.25}});
  expect_places(textured(moved("\"texCoord\":1"), kImageOfView), {{0, 1}, {0, 0.8}, {0, 0}});
}

TEST(GltfLooks, CornersOfMirroredNodesKeepTheirPlaces) {
  GltfText text;
  text.list(kCorners, 3);
  text.list(std::vector<float>{0, 0, 1, 0, 0, 1}, 2);
  const int image = text.view(four_texels());
  const GltfModel model = read(
      text.glb(fmt::format("\"images\":[{{\"bufferView\":{}}}],", image) +
               "\"textures\":[{\"source\":0}],"
               "\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}],"
               "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1},"
               "\"material\":0}]}],\"nodes\":[{\"mesh\":0,\"scale\":[1,1,-1]}]"));
  const auto corners = model.attributes.corners_of(0);
  ASSERT_EQ(corners.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t v = model.soup.triangles[0][static_cast<int>(i)];
    EXPECT_EQ(corners[i].vertex, v);
    const glm::dvec3& p = model.soup.positions[v];
    EXPECT_EQ(corners[i].texture_at, glm::vec2(p.x, 1 - p.y)) << i;
  }
  EXPECT_EQ(model.soup.triangles[0], glm::uvec3(0, 2, 1));
}

TEST(GltfLooks, PicturesThatCannotBeShownAreWarnings) {
  for (const auto& [image, text] : std::vector<std::pair<std::string, std::string>>{
           {"{\"uri\":\"none.png\"}", "none.png"},
           {"{\"bufferView\":0}", "images[0]: the picture is neither PNG nor JPEG"},
           {"{}", "images[0] has no bytes"},
           {"{\"uri\":\"data:image/png;base64,???\"}", "images[0].uri is no valid base64"}}) {
    const GltfModel model = textured("", image);
    EXPECT_TRUE(model.attributes.textures.empty());
    EXPECT_EQ(model.attributes.materials[0].texture, SurfaceMaterial::kNoTexture);
    // Files that are not there are told apart: `strata info` lists them.
    const bool is_file = image.find("none.png") != std::string::npos;
    EXPECT_EQ((is_file ? model.warnings : model.missing).size(), 0u);
    const std::vector<std::string>& told = is_file ? model.missing : model.warnings;
    ASSERT_EQ(told.size(), 1u) << image;
    EXPECT_NE(told[0].find(text), std::string::npos) << told[0];
    EXPECT_NE(told[0].find("the texture is not shown"), std::string::npos);
  }
}

TEST(GltfLooks, PicturesAreReadOnlyWhenAsked) {
  const std::string none = "{\"uri\":\"none.png\"}";
  EXPECT_TRUE(textured("", none, "", {.attributes = true, .textures = false}).missing.empty());
  const GltfModel shapes = textured("", none, "", {});
  EXPECT_TRUE(shapes.missing.empty());
  EXPECT_TRUE(shapes.attributes.parts.empty());
  EXPECT_TRUE(shapes.attributes.corners.empty());
  EXPECT_TRUE(shapes.attributes.materials.empty());
}

}  // namespace
}  // namespace strata
