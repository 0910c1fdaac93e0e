#include "voxelize/formats/minecraft_blocks.h"

#include <array>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <iterator>
#include <vector>

#include "core/srgb.h"
#include "voxelize/output/oklab.h"
#include "voxelize/output/palette.h"

namespace strata {
namespace {

struct Block {
  std::string_view name;
  std::array<std::uint8_t, 3> colour;  // sRGB, mean of its texture
};
constexpr Block kBlocks[] = {
    {"stone", {125, 125, 125}},
    {"white_concrete", {207, 213, 214}},
    {"orange_concrete", {224, 97, 0}},
    {"magenta_concrete", {169, 48, 159}},
    {"light_blue_concrete", {35, 137, 198}},
    {"yellow_concrete", {240, 175, 21}},
    {"lime_concrete", {94, 168, 24}},
    {"pink_concrete", {213, 101, 142}},
    {"gray_concrete", {54, 57, 61}},
    {"light_gray_concrete", {125, 125, 115}},
    {"cyan_concrete", {21, 119, 136}},
    {"purple_concrete", {100, 31, 156}},
    {"blue_concrete", {44, 46, 143}},
    {"brown_concrete", {96, 59, 31}},
    {"green_concrete", {73, 91, 36}},
    {"red_concrete", {142, 32, 32}},
    {"black_concrete", {8, 10, 15}},
    {"white_wool", {233, 236, 236}},
    {"orange_wool", {240, 118, 19}},
    {"magenta_wool", {189, 68, 179}},
    {"light_blue_wool", {58, 175, 217}},
    {"yellow_wool", {248, 197, 39}},
    {"lime_wool", {112, 185, 25}},
    {"pink_wool", {237, 141, 172}},
    {"gray_wool", {62, 68, 71}},
    {"light_gray_wool", {142, 142, 134}},
    {"cyan_wool", {21, 137, 145}},
    {"purple_wool", {121, 42, 172}},
    {"blue_wool", {53, 57, 157}},
    {"brown_wool", {114, 71, 40}},
    {"green_wool", {84, 109, 27}},
    {"red_wool", {160, 39, 34}},
    {"black_wool", {20, 21, 25}},
    {"terracotta", {152, 94, 67}},
    {"white_terracotta", {209, 178, 161}},
    {"orange_terracotta", {161, 83, 37}},
    {"magenta_terracotta", {149, 88, 108}},
    {"light_blue_terracotta", {113, 108, 137}},
    {"yellow_terracotta", {186, 133, 35}},
    {"lime_terracotta", {103, 117, 52}},
    {"pink_terracotta", {161, 78, 78}},
    {"gray_terracotta", {57, 42, 35}},
    {"light_gray_terracotta", {135, 106, 97}},
    {"cyan_terracotta", {86, 91, 91}},
    {"purple_terracotta", {118, 70, 86}},
    {"blue_terracotta", {74, 59, 91}},
    {"brown_terracotta", {77, 51, 35}},
    {"green_terracotta", {76, 83, 42}},
    {"red_terracotta", {143, 61, 46}},
    {"black_terracotta", {37, 22, 16}},
};
static_assert(std::size(kBlocks) < 127);

glm::vec3 place_of(const std::array<std::uint8_t, 3>& colour) {
  const std::array<float, 256>& light = linear_light();
  return oklab({light[colour[0]], light[colour[1]], light[colour[2]]});
}

std::size_t find_nearest(const glm::vec3& place) {
  static const std::vector<glm::vec3> kPlaces = [] {
    std::vector<glm::vec3> places;
    for (const Block& block : kBlocks) places.push_back(place_of(block.colour));
    return places;
  }();
  std::size_t best = 0;
  for (std::size_t i = 1; i < kPlaces.size(); ++i) {
    const glm::vec3 a = kPlaces[i] - place, b = kPlaces[best] - place;
    if (glm::dot(a, a) < glm::dot(b, b)) best = i;
  }
  return best;
}

}  // namespace

MinecraftBlocks::MinecraftBlocks() : blocks_(new std::atomic<std::uint8_t>[kCells]()) {}

std::size_t MinecraftBlocks::count() { return std::size(kBlocks); }
std::string_view MinecraftBlocks::name(std::size_t i) { return kBlocks[i].name; }

std::size_t MinecraftBlocks::nearest(std::uint32_t colour) const {
  std::atomic<std::uint8_t>& known = blocks_[ColourCounts::cell_of(colour)];
  if (const std::uint8_t block = known.load(std::memory_order_relaxed); block != 0) {
    return block - std::size_t{1};
  }
  // The middle of the cell, so that the answer does not depend on who asks first.
  const auto middle = [&](int shift) {
    return static_cast<std::uint8_t>((colour >> shift & 0xfc) | 2);
  };
  const std::size_t found = find_nearest(place_of({middle(0), middle(8), middle(16)}));
  known.store(static_cast<std::uint8_t>(found + 1), std::memory_order_relaxed);
  return found;
}

}  // namespace strata
