// What pictures show: light, ghosts, translucent solids, samples, bands, edges, cameras.

#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <glm/common.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <memory>
#include <optional>
#include <random>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "csg/measure/result_bounds.h"
#include "strata/csg/picture/picture.h"
#include "strata/mesh/shapes.h"
#include "tests/support/temporary_folder.h"

namespace strata::csg {
namespace {

using NodeId = Tree::NodeId;

Solid box(const glm::dvec3& low, const glm::dvec3& high, std::optional<glm::vec4> colour = {}) {
  Solid solid;
  solid.mesh = std::make_shared<const TriangleSoup>(make_box(low, high));
  solid.colour = colour;
  return solid;
}

/// Looks straight down; one world unit is `pixels_a_unit` pixels.
Camera from_above(double pixels_a_unit, int height) {
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.rotation = glm::dvec3(0.0);
  camera.distance = height / pixels_a_unit / 2 / std::tan(glm::radians(camera.field_of_view) / 2.0);
  return camera;
}

/// OpenSCAD's colours and lights: pixels of a face are equal, and known.
PictureOptions openscad_look() {
  PictureOptions options;
  options.scheme = find_colour_scheme("Cornfield");
  return options;
}

Picture draw(Preview& preview, const Camera& camera, const glm::ivec2& size,
             const PictureOptions& options = openscad_look()) {
  auto picture = preview.picture(camera, size, options);
  EXPECT_TRUE(picture.has_value()) << picture.error().message;
  return picture ? *picture : Picture{};
}

Rgba at(const Picture& picture, int u, int v) {
  return picture.pixels[static_cast<std::size_t>(v * picture.width + u)];
}

int difference(Rgba a, Rgba b) {
  const glm::ivec4 d = glm::abs(glm::ivec4(a) - glm::ivec4(b));
  return std::max({d.r, d.g, d.b, d.a});
}

constexpr double kThird = 0.57735026918962576;
const Rgba kBackground(0xff, 0xff, 0xe5, 255);
/// A face that looks up, seen from above.
Rgba lit(const glm::vec3& colour) {
  return Rgba(glm::vec4(colour * static_cast<float>(0.2 + kThird) * 255.0f + 0.5f, 255.0f));
}
const glm::vec3 kYellow = glm::vec3(0xf9, 0xd7, 0x2c) / 255.0f;
const glm::vec3 kGreen = glm::vec3(0x9d, 0xcb, 0x51) / 255.0f;

/// `front` at `alpha` over `behind`.
Rgba over(Rgba front, float alpha, Rgba behind) {
  return Rgba(glm::vec4(alpha * glm::vec3(front) + (1 - alpha) * glm::vec3(behind) + 0.5f, 255.0f));
}

TEST(Picture, AFaceTowardsTheEyeHasTheSchemesColourInItsLight) {
  Tree tree;
  tree.set_root(tree.add_solid(box({-1, -1, -1}, {1, 1, 1})));
  Preview preview(std::move(tree), {}, 0);
  const Picture picture = draw(preview, from_above(10, 40), {40, 40});
  EXPECT_EQ(at(picture, 20, 20), lit(kYellow));
  EXPECT_EQ(at(picture, 1, 1), kBackground);
  EXPECT_EQ(preview.report().covered, 400u);
}

TEST(Picture, EachPixelHasTheColourOfTheHighestBoxThere) {
  // Of 1 to 30 boxes, so that neighbours show one box, two, or many.
  std::mt19937 random(1);
  const auto number = [&](int low, int high) {
    return std::uniform_int_distribution(low, high)(random);
  };
  constexpr int kWidth = 90, kHeight = 50;
  for (int round = 0; round < 100; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    std::vector<Rgba> expected(kWidth * kHeight, kBackground);
    std::vector<NodeId> boxes;
    Tree tree;
    const int count = number(1, 30);
    std::uint64_t covered = 0;
    for (int i = 0; i < count; ++i) {
      const glm::ivec2 low(number(-5, kWidth), number(-5, kHeight));
      const glm::ivec2 high = glm::min(low + glm::ivec2(number(1, 40), number(1, 40)),
                                       glm::ivec2(kWidth + 5, kHeight + 5));
      const glm::vec4 colour(
          glm::vec3(glm::ivec3(number(0, 15), number(0, 15), number(0, 15))) / 15.0f, 1.0f);
      const glm::dvec3 middle(kWidth / 2, kHeight / 2, 0);
      boxes.push_back(tree.add_solid(box(glm::dvec3(low.x, kHeight - high.y, -1) - middle,
                                         glm::dvec3(high.x, kHeight - low.y, i) - middle, colour)));
      for (int v = std::max(low.y, 0); v < std::min(high.y, kHeight); ++v) {
        for (int u = std::max(low.x, 0); u < std::min(high.x, kWidth); ++u) {
          expected[static_cast<std::size_t>(v * kWidth + u)] = lit(glm::vec3(colour));
        }
      }
    }
    for (const Rgba& pixel : expected) covered += pixel != kBackground ? 1 : 0;
    tree.set_root(tree.add(Operation::kUnion, boxes));
    Preview preview(std::move(tree), {}, 0);
    const Picture picture = draw(preview, from_above(1, kHeight), {kWidth, kHeight});
    EXPECT_EQ(picture.pixels, expected);
    EXPECT_EQ(preview.report().covered, covered);
  }
}

TEST(Picture, EachPixelHasTheColourOfTheDeepestPocketThere) {
  // Of 0 to 12 pockets in what 1 to 4 blocks have in common: the lowest top is seen beside them.
  std::mt19937 random(2);
  const auto number = [&](int low, int high) {
    return std::uniform_int_distribution(low, high)(random);
  };
  const auto any_colour = [&] {
    return glm::vec4(glm::vec3(glm::ivec3(number(0, 15), number(0, 15), number(0, 15))) / 15.0f,
                     1.0f);
  };
  constexpr int kWidth = 150, kHeight = 90;
  const glm::dvec3 middle(kWidth / 2, kHeight / 2, 0);
  for (int round = 0; round < 100; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    Tree tree;
    std::vector<NodeId> blocks, operands;
    const int count = number(1, 4), lowest = number(0, count - 1);
    glm::ivec2 low(0), high(kWidth, kHeight);
    Rgba top;
    for (int i = 0; i < count; ++i) {
      const glm::ivec2 from(number(-9, 20), number(-9, 20));
      const glm::ivec2 to(number(kWidth - 20, kWidth + 9), number(kHeight - 20, kHeight + 9));
      low = glm::max(low, from), high = glm::min(high, to);
      const glm::vec4 colour = any_colour();
      if (i == lowest) top = lit(glm::vec3(colour));
      const double height = i == lowest ? 0 : 5 + 5 * i;
      blocks.push_back(
          tree.add_solid(box(glm::dvec3(from.x, kHeight - to.y, -40 - i) - middle,
                             glm::dvec3(to.x, kHeight - from.y, height) - middle, colour)));
    }
    operands.push_back(count == 1 ? blocks.front() : tree.add(Operation::kIntersection, blocks));
    std::vector<Rgba> expected(kWidth * kHeight, kBackground);
    std::vector<int> depths(kWidth * kHeight, 0);
    for (int v = low.y; v < high.y; ++v) {
      std::fill_n(expected.begin() + v * kWidth + low.x, high.x - low.x, top);
    }
    const int pockets = number(0, 12);
    for (int i = 0; i < pockets; ++i) {
      const glm::ivec2 from(number(0, kWidth - 20), number(0, kHeight - 20));
      const glm::ivec2 to = from + glm::ivec2(number(1, 90), number(1, 60));
      const int depth = number(0, 4) == 0 ? 60 + i : 1 + 2 * i;  // through all, or not
      const auto colour = number(0, 1) == 0 ? std::optional(any_colour()) : std::nullopt;
      operands.push_back(
          tree.add_solid(box(glm::dvec3(from.x, kHeight - to.y, -depth) - middle,
                             glm::dvec3(to.x, kHeight - from.y, number(1, 40)) - middle, colour)));
      for (int v = std::max(low.y, from.y); v < std::min(high.y, to.y); ++v) {
        for (int u = std::max(low.x, from.x); u < std::min(high.x, to.x); ++u) {
          const auto at = static_cast<std::size_t>(v * kWidth + u);
          if (depth <= depths[at]) continue;
          depths[at] = depth;
          expected[at] = depth >= 60 ? kBackground : lit(colour ? glm::vec3(*colour) : kGreen);
        }
      }
    }
    tree.set_root(operands.size() == 1 ? operands.front()
                                       : tree.add(Operation::kDifference, operands));
    Preview preview(std::move(tree), {}, 0);
    const Picture picture = draw(preview, from_above(1, kHeight), {kWidth, kHeight});
    EXPECT_EQ(picture.pixels, expected);
  }
}

TEST(Picture, ACutFaceHasTheCuttersColourOrTheSchemes) {
  for (const bool coloured : {false, true}) {
    Tree tree;
    const NodeId whole = tree.add_solid(box({-1, -1, -1}, {1, 1, 1}));
    const std::optional<glm::vec4> blue =
        coloured ? std::optional<glm::vec4>({0, 0, 1, 1}) : std::nullopt;
    const NodeId cut = tree.add_solid(box({-2, -2, 0}, {2, 2, 2}, blue));
    tree.set_root(tree.add(Operation::kDifference, {whole, cut}));
    Preview preview(std::move(tree), {}, 0);
    const Picture picture = draw(preview, from_above(10, 40), {40, 40});
    EXPECT_EQ(at(picture, 20, 20), lit(coloured ? glm::vec3(0, 0, 1) : kGreen));
  }
}

TEST(Picture, AGhostAboveIsBlendedWithEachOfItsSurfaces) {
  Tree tree;
  tree.set_root(tree.add_solid(box({-1, -1, -1}, {1, 1, 1})));
  const NodeId ghost = tree.add_solid(box({-0.5, -0.5, 2}, {0.5, 0.5, 3}));
  Preview preview(std::move(tree), {{ghost, kBackgroundGhost}}, 0);
  const Picture picture = draw(preview, from_above(10, 40), {40, 40});
  const glm::vec4 grey = kBackgroundGhost;
  const Rgba face = lit(glm::vec3(grey));
  const Rgba expected = over(face, grey.a, over(face, grey.a, lit(kYellow)));
  EXPECT_LE(difference(at(picture, 20, 20), expected), 1);
  EXPECT_EQ(at(picture, 12, 20), lit(kYellow));
}

TEST(Picture, AGhostBehindSomethingIsNotSeen) {
  Tree tree;
  tree.set_root(tree.add_solid(box({-1, -1, -1}, {1, 1, 1})));
  const NodeId below = tree.add_solid(box({-0.5, -0.5, -3}, {0.5, 0.5, -2}));
  const NodeId within = tree.add_solid(box({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}));
  Preview preview(std::move(tree), {{below, kBackgroundGhost}, {within, kHighlightGhost}}, 0);
  const Picture picture = draw(preview, from_above(10, 40), {40, 40});
  EXPECT_EQ(at(picture, 20, 20), lit(kYellow));
}

TEST(Picture, AHighlightOfAVisibleSolidIsBlendedOverIt) {
  Tree tree;
  tree.set_root(tree.add_solid(box({-1, -1, -1}, {1, 1, 1})));
  const NodeId same = tree.add_solid(box({-1, -1, -1}, {1, 1, 1}));
  Preview preview(std::move(tree), {{same, kHighlightGhost}}, 0);
  const Picture picture = draw(preview, from_above(10, 40), {40, 40});
  const glm::vec4 red = kHighlightGhost;
  EXPECT_LE(difference(at(picture, 20, 20), over(lit(glm::vec3(red)), red.a, lit(kYellow))), 1);
}

TEST(Picture, AGhostIsDrawnAsItsOwnTree) {
  // A ghost difference: only the shell that is left has surfaces. And a ghost union of two boxes
  // that touch has no wall between them.
  Tree tree;
  const NodeId outer = tree.add_solid(box({-1, -1, -1}, {1, 1, 1}));
  const NodeId hole = tree.add_solid(box({-0.5, -0.5, -2}, {0.5, 0.5, 2}));
  const NodeId ring = tree.add(Operation::kDifference, {outer, hole});
  const NodeId lower = tree.add_solid(box({2, -1, -1}, {3, 1, 0}));
  const NodeId upper = tree.add_solid(box({2, -1, 0}, {3, 1, 1}));
  const NodeId stack = tree.add(Operation::kUnion, {lower, upper});
  Preview preview(std::move(tree), {{ring, kBackgroundGhost}, {stack, kBackgroundGhost}}, 0);
  const Picture picture = draw(preview, from_above(10, 80), {80, 80});
  EXPECT_EQ(at(picture, 40, 40), kBackground);
  const glm::vec4 grey = kBackgroundGhost;
  const Rgba face = lit(glm::vec3(grey));
  const Rgba twice = over(face, grey.a, over(face, grey.a, kBackground));
  EXPECT_LE(difference(at(picture, 33, 40), twice), 1);
  EXPECT_LE(difference(at(picture, 65, 40), twice), 1);
}

TEST(Picture, TranslucentSolidsAreBlendedNearFirstWhateverTheirOrder) {
  const glm::vec4 red(1, 0, 0, 0.25), blue(0, 0, 1, 0.5);
  Picture first;
  for (const bool swapped : {false, true}) {
    Tree tree;
    const NodeId ground = tree.add_solid(box({-2, -2, -1}, {2, 2, 0}));
    NodeId high = tree.add_solid(box({-1, -1, 3}, {1, 1, 4}, red));
    NodeId low = tree.add_solid(box({-1, -1, 1}, {1, 1, 2}, blue));
    if (swapped) std::swap(high, low);
    tree.set_root(tree.add(Operation::kUnion, {high, ground, low}));
    Preview preview(std::move(tree), {}, 0);
    const Picture picture = draw(preview, from_above(10, 60), {60, 60});
    Rgba expected = lit(kYellow);
    for (const glm::vec4& colour : {blue, blue, red, red}) {
      expected = over(lit(glm::vec3(colour)), colour.a, expected);
    }
    EXPECT_LE(difference(at(picture, 30, 30), expected), 2);
    if (!swapped) first = picture;
    EXPECT_EQ(picture.pixels, first.pixels);
  }
}

TEST(Picture, AnAlphaAloneMakesTheSchemesColourTranslucent) {
  Tree tree;
  const NodeId ground = tree.add_solid(box({-2, -2, -1}, {2, 2, 0}, glm::vec4(0, 0, 1, 1)));
  const NodeId glass = tree.add_solid(box({-1, -1, 3}, {1, 1, 4}, glm::vec4(kSchemeColour, 0.5f)));
  tree.set_root(tree.add(Operation::kUnion, {ground, glass}));
  Preview preview(std::move(tree), {}, 0);
  const Picture picture = draw(preview, from_above(10, 60), {60, 60});
  const Rgba once = over(lit(kYellow), 0.5f, lit(glm::vec3(0, 0, 1)));
  EXPECT_LE(difference(at(picture, 30, 30), over(lit(kYellow), 0.5f, once)), 2);
}

TEST(Picture, WhatIsTakenFromATranslucentSolidHasItsOwnFaces) {
  Tree tree;
  const NodeId glass = tree.add_solid(box({-1, -1, -1}, {1, 1, 1}, glm::vec4(1, 0, 0, 0.5)));
  const NodeId cut = tree.add_solid(box({-2, -2, 0}, {2, 2, 2}));
  const NodeId rest = tree.add(Operation::kDifference, {glass, cut});
  tree.set_root(tree.add(Operation::kUnion, {rest}));
  Preview preview(std::move(tree), {}, 0);
  EXPECT_EQ(at(draw(preview, from_above(10, 40), {40, 40}), 20, 20), lit(kGreen));
}

TEST(Picture, SamplesGiveTheShareOfAPixelThatIsCovered) {
  // An edge that leans: coverage of a pixel is known.
  const double slope = 0.25;
  TriangleSoup prism = make_box({0, 0, 0}, {1, 1, 1});
  Solid solid;
  for (glm::dvec3& p : prism.positions) {
    p = {(p.x < 0.5 ? -10.0 : slope * (p.y < 0.5 ? -4.0 : 4.0)), p.y < 0.5 ? -4.0 : 4.0, p.z};
  }
  solid.mesh = std::make_shared<const TriangleSoup>(prism);
  for (const int samples : {1, 2, 4, 8, 16, 32, 64}) {
    Tree tree;
    tree.set_root(tree.add_solid(solid));
    Preview preview(std::move(tree), {}, 0);
    PictureOptions options = openscad_look();
    options.samples = samples;
    options.backdrop.emplace();
    const int side = 16;
    const Picture picture = draw(preview, from_above(4, side), {side, side}, options);
    double worst = 0, sum = 0;
    for (int v = 0; v < side; ++v) {
      for (int u = 0; u < side; ++u) {
        // The covered length of each row of the pixel, over many rows.
        double covered = 0;
        constexpr int kRows = 1000;
        for (int i = 0; i < kRows; ++i) {
          const double y = (side / 2.0 - v - (i + 0.5) / kRows) / 4;
          const double edge = slope * y * 4 + side / 2.0;  // in pixels
          covered += std::clamp(edge - u, 0.0, 1.0) / kRows;
        }
        const double seen = at(picture, u, v).a / 255.0;
        worst = std::max(worst, std::abs(seen - covered));
        sum += seen;
      }
    }
    // Each row of samples is off by half a sample's width, and the edge moves by a quarter of a
    // sample's width from the top to the bottom of one.
    const int columns = 1 << (std::bit_width(static_cast<unsigned>(samples)) / 2);
    const int rows = samples / columns;
    EXPECT_LE(worst, 0.5 / columns + slope / 2 / rows + 0.01) << samples;
    EXPECT_NEAR(sum, side * side / 2.0, side * 0.51) << samples;
  }
}

TEST(Picture, AnEdgeAlongTheSamplesIsAveragedExactly) {
  // Covers 5/8 of a column of pixels: with 8 columns of samples exactly that.
  Tree tree;
  tree.set_root(tree.add_solid(box({-10, -10, 0}, {0.625, 10, 1})));
  Preview preview(std::move(tree), {}, 0);
  PictureOptions options = openscad_look();
  options.samples = 64;
  const Picture picture = draw(preview, from_above(1, 8), {8, 8}, options);
  const glm::vec3 face(lit(kYellow)), ground(kBackground);
  const Rgba expected(glm::vec4(face * 0.625f + ground * 0.375f + 0.5f, 255.0f));
  EXPECT_LE(difference(at(picture, 4, 4), expected), 1);
  EXPECT_EQ(at(picture, 3, 4), lit(kYellow));
  EXPECT_EQ(at(picture, 5, 4), kBackground);
}

TEST(Picture, BandsDoNotShow) {
  // 300 x 300 x 64 samples are drawn in several bands, 300 x 300 x 1 in one: every pixel inside a
  // face is the same.
  Tree tree;
  const NodeId a = tree.add_solid(box({-5, -5, -5}, {5, 5, 5}));
  const NodeId b = tree.add_solid(box({-3, -3, -9}, {3, 3, 9}));
  tree.set_root(tree.add(Operation::kDifference, {a, b}));
  Preview preview(std::move(tree), {}, 0);
  Camera camera;
  fit_camera(camera, preview.box());
  PictureOptions options = openscad_look();
  const Picture one = draw(preview, camera, {300, 300}, options);
  options.samples = 64;
  const Picture many = draw(preview, camera, {300, 300}, options);
  std::size_t inside = 0, other = 0;
  for (int v = 1; v < 299; ++v) {
    for (int u = 1; u < 299; ++u) {
      const Rgba here = at(one, u, v);
      bool flat = true;
      for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) flat = flat && at(one, u + x, v + y) == here;
      }
      if (!flat) continue;
      ++inside;
      other += difference(at(many, u, v), here) > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(inside, 70000u);
  EXPECT_EQ(other, 0u);
}

TEST(Picture, ATransparentBackgroundHasStraightAlpha) {
  Tree tree;
  tree.set_root(tree.add_solid(box({-10, -10, 0}, {0.5, 10, 1})));
  Preview preview(std::move(tree), {}, 0);
  PictureOptions options = openscad_look();
  options.samples = 4;
  options.backdrop.emplace();
  const Picture picture = draw(preview, from_above(1, 8), {8, 8}, options);
  EXPECT_EQ(at(picture, 6, 4), Rgba(0));
  EXPECT_LE(difference(at(picture, 4, 4), Rgba(glm::u8vec3(lit(kYellow)), 128)), 1);
}

/// The edges of a box of half side 1 that a view shows, in pixels: those of a face that looks here.
std::vector<std::pair<glm::dvec2, glm::dvec2>> visible_edges(const View& view) {
  const glm::dvec3 eye = glm::inverse(view.eye_from_world)[3];
  const auto pixel = [&](const glm::dvec3& p) {
    const glm::dvec4 at = view.image_from_world * glm::dvec4(p, 1);
    return glm::dvec2(at) / at.w;
  };
  std::vector<std::pair<glm::dvec2, glm::dvec2>> edges;
  for (int along = 0; along < 3; ++along) {
    for (const glm::dvec2& side : {glm::dvec2(-1, -1), {-1, 1}, {1, -1}, {1, 1}}) {
      const int u = (along + 1) % 3, v = (along + 2) % 3;
      if (side.x * eye[u] <= 1 && side.y * eye[v] <= 1) continue;
      glm::dvec3 from, to;
      from[along] = -1, to[along] = 1;
      from[u] = to[u] = side.x, from[v] = to[v] = side.y;
      edges.emplace_back(pixel(from), pixel(to));
    }
  }
  return edges;
}

double distance_to(const std::pair<glm::dvec2, glm::dvec2>& edge, const glm::dvec2& p) {
  const glm::dvec2 along = edge.second - edge.first;
  const double share = glm::dot(p - edge.first, along) / glm::dot(along, along);
  return glm::distance(p, edge.first + glm::clamp(share, 0.0, 1.0) * along);
}

TEST(Picture, EdgesAreDarkBetweenFacesAndNotWithinOne) {
  Tree tree;
  tree.set_root(tree.add_solid(box({-1, -1, -1}, {1, 1, 1})));
  Preview preview(std::move(tree), {}, 0);
  Camera camera;
  fit_camera(camera, preview.box());
  PictureOptions options = openscad_look();
  const Picture plain = draw(preview, camera, {200, 200}, options);
  options.edges = true;
  const Picture dark = draw(preview, camera, {200, 200}, options);
  const auto view = make_view(camera, {200, 200}, preview.box());
  ASSERT_TRUE(view.has_value());
  const auto edges = visible_edges(*view);
  ASSERT_EQ(edges.size(), 9u);
  // A pixel is dark where the next one shows another face: an edge passes within a pixel of its
  // centre, and the snap moves it by less than a hundredth.
  std::size_t face = 0;
  std::vector<glm::dvec2> darkened;
  for (int v = 0; v < 200; ++v) {
    for (int u = 0; u < 200; ++u) {
      face += at(plain, u, v) != kBackground ? 1 : 0;
      if (at(dark, u, v) == at(plain, u, v)) continue;
      EXPECT_NE(at(plain, u, v), kBackground);
      const glm::dvec2 centre(u + 0.5, v + 0.5);
      darkened.push_back(centre);
      EXPECT_TRUE(std::any_of(edges.begin(), edges.end(),
                              [&](const auto& edge) { return distance_to(edge, centre) < 1.01; }))
          << u << ", " << v;
    }
  }
  EXPECT_GT(face, 10000u);
  // And no edge has a gap.
  for (const auto& edge : edges) {
    for (double share = 0; share <= 1; share += 1.0 / 256) {
      const glm::dvec2 point = glm::mix(edge.first, edge.second, share);
      EXPECT_TRUE(
          std::any_of(darkened.begin(), darkened.end(),
                      [&](const glm::dvec2& centre) { return glm::distance(centre, point) < 1.5; }))
          << point.x << ", " << point.y;
    }
  }
}

TEST(Picture, AnEmptySceneIsBackground) {
  Preview preview(Tree(), {}, 0);
  const Picture picture = draw(preview, Camera{}, {20, 10});
  EXPECT_EQ(picture.width, 20);
  EXPECT_EQ(picture.height, 10);
  EXPECT_EQ(std::count(picture.pixels.begin(), picture.pixels.end(), kBackground), 200);
  EXPECT_EQ(preview.report().covered, 0u);
}

TEST(Picture, WhatCannotBeDrawnIsRefused) {
  Tree tree;
  tree.set_root(tree.add_solid(box({-1, -1, -1}, {1, 1, 1})));
  Preview preview(std::move(tree), {}, 0);
  const auto refuses = [&](const Camera& camera, const glm::ivec2& size,
                           const PictureOptions& options) {
    const auto picture = preview.picture(camera, size, options);
    return !picture && picture.error().code == ErrorCode::kUsage;
  };
  EXPECT_TRUE(refuses(Camera{}, {0, 10}, {}));
  EXPECT_TRUE(refuses(Camera{}, {10, kMaxPictureSide + 1}, {}));
  for (const int samples : {0, 3, 128}) {
    PictureOptions options;
    options.samples = samples;
    EXPECT_TRUE(refuses(Camera{}, {10, 10}, options)) << samples;
  }
  PictureOptions many;
  many.samples = 64;
  EXPECT_TRUE(refuses(Camera{}, {kMaxPictureSide, 1}, many));
  Camera camera;
  camera.distance = 0;
  EXPECT_TRUE(refuses(camera, {10, 10}, {}));
  camera = {};
  camera.field_of_view = 180;
  EXPECT_TRUE(refuses(camera, {10, 10}, {}));
  Execution stopped;
  std::stop_source source;
  stopped.stop = source.get_token();
  source.request_stop();
  const auto picture = preview.picture(Camera{}, {10, 10}, {}, stopped);
  ASSERT_FALSE(picture.has_value());
  EXPECT_EQ(picture.error().code, ErrorCode::kCancelled);
}

TEST(Camera, AnEyeAndATargetAreTheSameAsTargetRotationAndDistance) {
  for (const glm::dvec3& eye :
       {glm::dvec3(10, -20, 15), glm::dvec3(-4, 3, -9), glm::dvec3(1, 2, 30)}) {
    const glm::dvec3 target(1, 2, 3);
    const Camera camera = look_at(eye, target);
    const glm::dvec4 at_eye = eye_from_world(camera) * glm::dvec4(eye, 1);
    EXPECT_NEAR(glm::length(glm::dvec3(at_eye)), 0, 1e-12);
    const glm::dvec4 at_target = eye_from_world(camera) * glm::dvec4(target, 1);
    EXPECT_NEAR(at_target.z, -glm::length(eye - target), 1e-12);
    EXPECT_NEAR(at_target.x, 0, 1e-12);
    // Up is up.
    EXPECT_GE((eye_from_world(camera) * glm::dvec4(0, 0, 1, 0)).y, -1e-12);
  }
}

TEST(Camera, FittedViewsShowAllAndTouchAlmost) {
  const Bounds bounds{glm::dvec3(3, -2, 10), glm::dvec3(9, 5, 12)};
  for (const Projection projection : {Projection::kPerspective, Projection::kOrthographic}) {
    for (const glm::ivec2 size :
         {glm::ivec2(100, 100), glm::ivec2(300, 100), glm::ivec2(100, 250)}) {
      for (const bool centred : {true, false}) {
        Camera camera;
        camera.projection = projection;
        if (centred) centre_camera(camera, bounds);
        fit_camera(camera, bounds, static_cast<double>(size.x) / size.y);
        const auto view = make_view(camera, size, bounds);
        ASSERT_TRUE(view.has_value());
        for (int i = 0; i < 8; ++i) {
          const glm::dvec4 p =
              view->image_from_world * glm::dvec4((i & 1) != 0 ? bounds.high.x : bounds.low.x,
                                                  (i & 2) != 0 ? bounds.high.y : bounds.low.y,
                                                  (i & 4) != 0 ? bounds.high.z : bounds.low.z, 1);
          EXPECT_GE(p.x / p.w, 0);
          EXPECT_GE(p.y / p.w, 0);
          EXPECT_LE(p.x / p.w, size.x);
          EXPECT_LE(p.y / p.w, size.y);
        }
      }
    }
  }
}

TEST(ResultBounds, SeeWhatADifferenceCutsOff) {
  Tree tree;
  const NodeId whole = tree.add_solid(box({0, 0, 0}, {10, 10, 10}));
  const NodeId half = tree.add_solid(box({4, -1, -1}, {11, 11, 11}));
  const NodeId hole = tree.add_solid(box({1, 1, -1}, {2, 2, 11}));
  const NodeId rest = tree.add(Operation::kDifference, {whole, half, hole});
  const auto box_of = result_bounds(tree, rest);
  ASSERT_TRUE(box_of.has_value());
  EXPECT_NEAR(box_of->high.x, 4, 1e-4);
  EXPECT_EQ(box_of->low, glm::dvec3(0.0));
  EXPECT_EQ(box_of->high.y, 10);
  EXPECT_EQ(box_of->high.z, 10);
}

TEST(ResultBounds, OfNothingAreEmpty) {
  Tree tree;
  EXPECT_TRUE(result_bounds(tree, Tree::kNone)->empty());
  const NodeId a = tree.add_solid(box({0, 0, 0}, {1, 1, 1}));
  const NodeId b = tree.add_solid(box({-1, -1, -1}, {2, 2, 2}));
  const NodeId nothing = tree.add(Operation::kDifference, {a, b});
  EXPECT_TRUE(result_bounds(tree, nothing)->empty());
}

TEST(ColourScheme, IsFoundWhateverTheCase) {
  ASSERT_NE(find_colour_scheme("TOMORROW night"), nullptr);
  EXPECT_EQ(find_colour_scheme("TOMORROW night")->name, "Tomorrow Night");
  EXPECT_EQ(find_colour_scheme("Tomorrow Nigh"), nullptr);
  EXPECT_EQ(colour_schemes().front().name, "Cornfield");
  EXPECT_EQ(default_scheme().name, "Neutral");
}

// --- PNG ----------------------------------------------------------------------------------------

/// Writes a picture and reads it back with libpng.
std::vector<Rgba> written_and_read(const Picture& picture, unsigned& kind) {
  const testkit::TemporaryFolder folder;
  const std::string path = folder.file("a.png");
  const auto written = write_png(picture, path);
  EXPECT_TRUE(written.has_value());
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  std::vector<Rgba> pixels;
  if (png_image_begin_read_from_file(&png, path.c_str()) == 0) {
    ADD_FAILURE() << png.message;
    return pixels;
  }
  kind = png.format;
  EXPECT_EQ(static_cast<int>(png.width), picture.width);
  EXPECT_EQ(static_cast<int>(png.height), picture.height);
  png.format = PNG_FORMAT_RGBA;
  pixels.resize(static_cast<std::size_t>(png.width) * png.height);
  EXPECT_NE(png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr), 0) << png.message;
  return pixels;
}

TEST(WritePng, KeepsEveryColourInEveryForm) {
  // 1, 2, 4 and 8 bits an index, then colours as they are; widths that do not fill bytes; runs of
  // one colour that end inside bytes, and in the next row.
  for (const unsigned colours : {1u, 2u, 3u, 4u, 5u, 16u, 17u, 256u, 257u, 5000u}) {
    for (const int width : {1, 7, 64, 131}) {
      for (const unsigned run : {1u, 5u, 37u}) {
        for (const bool opaque : {true, false}) {
          Picture picture{width, 61, {}};
          for (unsigned i = 0; i < static_cast<unsigned>(width) * 61; ++i) {
            const unsigned at = i % 100 < 50 ? i : i / run;
            const unsigned c = at * at / 3 % colours;
            picture.pixels.emplace_back(c % 256, c / 256, 255 - c % 256,
                                        opaque || c % 3 != 0 ? 255 : 100);
          }
          unsigned kind = 0;
          EXPECT_EQ(written_and_read(picture, kind), picture.pixels)
              << colours << " colours, width " << width << ", runs of " << run
              << (opaque ? ", opaque" : "");
          EXPECT_TRUE(colours > 256 || (kind & PNG_FORMAT_FLAG_COLORMAP) != 0);
        }
      }
    }
  }
}

/// A tetrahedron of which one face is there `count` times.
Tree equal_faces(std::uint32_t count) {
  TriangleSoup mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles.assign(count, glm::uvec3(0, 1, 2));
  mesh.triangles.insert(mesh.triangles.end(), {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}});
  Tree tree;
  tree.set_root(tree.add_solid({std::make_shared<TriangleSoup>(std::move(mesh))}));
  return tree;
}

TEST(Picture, ManyEqualFacesTakeTimeThatGrowsWithTheirNumber) {
  const auto seconds = [](std::uint32_t count, std::size_t& covered) {
    Preview preview(equal_faces(count), {}, 0);
    Camera camera = look_at({3, 4, 5}, {0.3, 0.3, 0.3});
    const auto view = make_view(camera, {64, 64}, preview.box());
    EXPECT_TRUE(view);
    const auto start = std::chrono::steady_clock::now();
    const auto image = preview.draw(*view);
    EXPECT_TRUE(image);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    covered = 0;
    for (const std::uint32_t depth : (*image)->depth) covered += depth != SurfaceImage::kNone;
    return taken.count();
  };
  std::size_t few = 0, many = 0;
  const double short_time = seconds(1000, few);
  const double long_time = seconds(8000, many);
  EXPECT_GT(few, 50u);
  EXPECT_EQ(few, many);
  EXPECT_LT(long_time, 24 * short_time);  // with its square 64 times
}

}  // namespace
}  // namespace strata::csg
