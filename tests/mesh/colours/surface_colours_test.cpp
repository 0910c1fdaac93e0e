#include "strata/mesh/colours/surface_colours.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/gtc/type_ptr.hpp>
#include <string>

namespace strata {
namespace {

// The square [0, side]^2 at z = 0, u along x and v along y, with a texture.
struct TexturedSquare {
  TriangleSoup soup;
  MeshAttributes attributes;
};
TexturedSquare textured_square(double side, int width, int height,
                               const std::function<glm::u8vec4(int x, int y)>& texel,
                               float times = 1.0f) {
  TexturedSquare made;
  made.soup.positions = {{0, 0, 0}, {side, 0, 0}, {side, side, 0}, {0, side, 0}};
  made.soup.triangles = {{0, 1, 2}, {0, 2, 3}};
  made.soup.face_elements = {0, 0};
  MeshAttributes& a = made.attributes;
  Texture texture{"made here", width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) texture.texels.push_back(texel(x, y));
  }
  a.textures = {texture};
  a.materials.resize(1);
  a.materials[0].coloured = true;
  a.materials[0].texture = 0;
  a.material_ranges = {{0, 0}};
  a.corner_offsets = {0, 4};
  const glm::vec2 at[] = {{0, 0}, {times, 0}, {times, times}, {0, times}};
  for (std::uint32_t i = 0; i < 4; ++i) a.corners.push_back({i, at[i], glm::u8vec4(255)});
  return made;
}

// The colour at (x, y) of the square.
glm::u8vec4 colour_at(const TexturedSquare& square, double x, double y, double footprint) {
  SurfaceColourOptions options;
  options.footprint = glm::dvec3(footprint);
  auto surface = SurfaceColours::make(square.soup, square.attributes, options);
  EXPECT_TRUE(surface) << surface.error().message;
  auto probe = surface->probe();
  const double side = square.soup.positions[1].x, u = x / side, v = y / side;
  return u >= v ? probe.colour(0, {1 - u, u - v, v}) : probe.colour(1, {1 - v, u, v - u});
}

std::string text(const glm::u8vec4& c) {
  return std::to_string(c.x) + " " + std::to_string(c.y) + " " + std::to_string(c.z) + " " +
         std::to_string(c.w);
}
void expect_near(const glm::u8vec4& got, const glm::ivec4& wanted, int tolerance) {
  for (int c = 0; c < 4; ++c) EXPECT_NEAR(int{got[c]}, wanted[c], tolerance) << text(got);
}

const glm::u8vec4 kRed{255, 0, 0, 255}, kGreen{0, 255, 0, 255}, kBlue{0, 0, 255, 255};
const glm::u8vec4 kYellow{255, 255, 0, 255}, kBlack{0, 0, 0, 255}, kWhite{255, 255, 255, 255};

TEST(SurfaceColours, TexturesStandUprightWithUAlongRows) {
  // Upper row: red, green. Lower row: blue, yellow.
  const auto square = textured_square(2, 2, 2, [](int x, int y) {
    return y == 0 ? (x == 0 ? kRed : kGreen) : (x == 0 ? kBlue : kYellow);
  });
  EXPECT_EQ(text(colour_at(square, 0.5, 1.5, 0.01)), text(kRed));
  EXPECT_EQ(text(colour_at(square, 1.5, 1.5, 0.01)), text(kGreen));
  EXPECT_EQ(text(colour_at(square, 0.5, 0.5, 0.01)), text(kBlue));
  EXPECT_EQ(text(colour_at(square, 1.5, 0.5, 0.01)), text(kYellow));
}

TEST(SurfaceColours, ACheckerboardBelowTheFootprintIsItsMeanLight) {
  const auto board =
      textured_square(16, 64, 64, [](int x, int y) { return (x + y) % 2 == 0 ? kBlack : kWhite; });
  for (const double at : {3.0, 3.13, 7.77, 12.5}) {
    expect_near(colour_at(board, at, at * 0.9, 1.0), {188, 188, 188, 255}, 1);  // light 1/2
  }
}

TEST(SurfaceColours, MeansOfTexturesOfAnySizeAreExact) {
  // Not powers of two: 7 columns, of which 3 are red, and 5 rows.
  const auto stripes = textured_square(1, 7, 5, [](int x, int) { return x < 3 ? kRed : kBlack; });
  const double light = 3.0 / 7.0;
  const double srgb = 255.0 * (1.055 * std::pow(light, 1 / 2.4) - 0.055);
  expect_near(colour_at(stripes, 0.5, 0.5, 64.0), {std::lround(srgb), 0, 0, 255}, 1);
}

TEST(SurfaceColours, AStretchedTextureIsFilteredAlongItsStretchAlone) {
  // 64 columns in one unit, 4 rows in one unit: a footprint of 1/4 covers 16 columns and a row.
  const auto rows = textured_square(1, 64, 4, [](int x, int y) {
    return y == 1 ? kGreen : x % 2 == 0 ? kBlack : kWhite;
  });
  expect_near(colour_at(rows, 0.5, 0.625, 0.25), {0, 255, 0, 255}, 2);
  expect_near(colour_at(rows, 0.51, 0.125, 0.25), {188, 188, 188, 255}, 2);
}

TEST(SurfaceColours, TransparentTexelsDoNotColourTheirNeighbours) {
  const auto cut_out = textured_square(1, 64, 64, [](int x, int y) {
    return (x + y) % 2 == 0 ? glm::u8vec4(255, 0, 255, 0) : kGreen;
  });
  expect_near(colour_at(cut_out, 0.4, 0.6, 0.5), {0, 255, 0, 128}, 1);
  const auto nothing = textured_square(1, 4, 4, [](int, int) { return glm::u8vec4(9, 9, 9, 0); });
  EXPECT_EQ(colour_at(nothing, 0.4, 0.6, 0.5), glm::u8vec4(0));
}

TEST(SurfaceColours, TexturesGoOnAsTheyAreToldTo) {
  auto square = textured_square(
      4, 4, 4, [](int x, int) { return x == 0   ? kRed
                                       : x == 3 ? kBlue
                                                : kGreen; }, 4.0f);
  // At x = 1 1/8 u is 1 1/8 too: half a texel into the second copy.
  EXPECT_EQ(text(colour_at(square, 1.125, 2, 0.01)), text(kRed));
  square.attributes.textures[0].wrap_u = TextureWrap::kMirror;
  EXPECT_EQ(text(colour_at(square, 1.125, 2, 0.01)), text(kBlue));
  EXPECT_EQ(text(colour_at(square, 1.875, 2, 0.01)), text(kRed));
  square.attributes.textures[0].wrap_u = TextureWrap::kClamp;
  EXPECT_EQ(text(colour_at(square, 1.875, 2, 0.01)), text(kBlue));
}

TEST(SurfaceColours, MaterialsTintTexturesInLight) {
  auto square = textured_square(1, 2, 2, [](int, int) { return kWhite; });
  square.attributes.materials[0].colour = glm::vec4(188 / 255.0f, 0.0f, 1.0f, 0.5f);
  expect_near(colour_at(square, 0.5, 0.5, 0.1), {188, 0, 255, 128}, 0);
}

TEST(SurfaceColours, ColoursOfVerticesAreInterpolatedInLight) {
  TriangleSoup soup;
  soup.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  soup.triangles = {{0, 1, 2}};
  MeshAttributes attributes;
  attributes.vertex_colours = {kBlack, kWhite, kRed};
  auto surface = SurfaceColours::make(soup, attributes);
  ASSERT_TRUE(surface);
  auto probe = surface->probe();
  EXPECT_EQ(text(probe.colour(0, {1, 0, 0})), text(kBlack));
  EXPECT_EQ(text(probe.colour(0, {0, 0, 1})), text(kRed));
  expect_near(probe.colour(0, {0.5, 0.5, 0}), {188, 188, 188, 255}, 0);
  expect_near(probe.colour(0, {0, 0.5, 0.5}), {255, 188, 188, 255}, 0);
}

TEST(SurfaceColours, AllThatIsGivenIsMultipliedAndElseThePartCounts) {
  TriangleSoup soup;
  soup.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  soup.triangles = {{0, 2, 1}};  // reversed: the element is still number 5
  soup.face_elements = {5};
  MeshAttributes attributes;
  const auto colour = [&] {
    auto surface = SurfaceColours::make(soup, attributes);
    return text(surface->probe().colour(0, {0.2, 0.3, 0.5}));
  };
  EXPECT_EQ(colour(), "204 204 204 255");
  attributes.parts = {{"part", glm::vec4(0, 0, 1, 1)}};
  EXPECT_EQ(colour(), text(kBlue));
  attributes.materials.resize(1);
  attributes.material_ranges = {{3, 0}};
  EXPECT_EQ(colour(), text(kBlue)) << "the material has no colour";
  attributes.materials[0].coloured = true;
  attributes.materials[0].colour = glm::vec4(1, 1, 0, 1);
  EXPECT_EQ(colour(), text(kYellow));
  attributes.element_colours.assign(6, kBlack);
  attributes.element_colours[5] = glm::u8vec4(188, 255, 255, 255);
  EXPECT_EQ(colour(), "188 255 0 255");
  attributes.vertex_colours.assign(3, glm::u8vec4(188, 255, 255, 255));
  EXPECT_EQ(colour(), "138 255 0 255") << "a quarter of the light";
  attributes.corner_colours = true;
  attributes.corner_offsets = {0, 0, 0, 0, 0, 0, 3};
  attributes.corners = {{0, {}, kRed}, {1, {}, kRed}, {2, {}, kRed}};
  EXPECT_EQ(colour(), "138 0 0 255");
  attributes.element_colours.clear();
  attributes.vertex_colours.clear();
  attributes.corners[1].colour = kGreen;  // its weight is 1/2, since corners are found by vertex
  EXPECT_EQ(colour(), "188 188 0 255");
}

TEST(SurfaceColours, PlainColoursOf8BitsStayAsTheyAre) {
  TriangleSoup soup;
  soup.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  soup.triangles = {{0, 1, 2}};
  auto square = textured_square(1, 2, 2, [](int, int) { return kWhite; });
  for (int value = 0; value < 256; ++value) {
    const auto v = static_cast<std::uint8_t>(value);
    const glm::u8vec4 colour(v, 255 - v, v, 255);
    auto flat = SurfaceColours::of_triangles({colour});
    EXPECT_EQ(text(flat.probe().colour(0, {0.1, 0.2, 0.7})), text(colour));
    square.attributes.textures[0].texels.assign(4, colour);  // there and back through light
    EXPECT_EQ(text(colour_at(square, 0.3, 0.6, 0.1)), text(colour));
  }
}

TEST(SurfaceColours, ATextureWithoutItsTexelsIsRefused) {
  auto square = textured_square(1, 2, 2, [](int, int) { return kWhite; });
  square.attributes.textures[0].texels.pop_back();
  const auto surface = SurfaceColours::make(square.soup, square.attributes);
  ASSERT_FALSE(surface);
  EXPECT_EQ(surface.error().message, "made here: a texture of 2 x 2 with 3 texels");
}

}  // namespace
}  // namespace strata
