#include "mesh/attributes/stl_attributes.h"

#include <algorithm>
#include <string>

#include "mesh/part_names.h"

namespace strata::detail {
namespace {

constexpr std::size_t kStlHeaderBytes = 84, kStlFacetBytes = 50, kStlTextBytes = 80;
constexpr std::uint32_t kColourBit = 0x8000;

std::uint32_t byte_at(std::string_view bytes, std::size_t at) {
  return static_cast<unsigned char>(bytes[at]);
}

/// The two bytes behind the corners of a facet.
std::uint32_t attribute_of(std::string_view bytes, std::size_t facet) {
  const std::size_t at = kStlHeaderBytes + kStlFacetBytes * facet + kStlFacetBytes - 2;
  return byte_at(bytes, at) | byte_at(bytes, at + 1) << 8;
}

/// A value of 5 bits as one of 8.
std::uint8_t eight_bits(std::uint32_t five) {
  return static_cast<std::uint8_t>(((five & 31u) * 255 + 15) / 31);
}

glm::u8vec4 low_first(std::uint32_t value) {
  return {eight_bits(value), eight_bits(value >> 5), eight_bits(value >> 10), 255};
}

/// What the attributes of all facets have in common.
struct AttributeBits {
  bool any = false;        ///< one is not 0
  bool any_valid = false;  ///< bit 15 is set in one
  bool consistent = true;  ///< those without bit 15 are 0
};

AttributeBits look_at_attributes(std::string_view bytes, std::size_t count) {
  AttributeBits found;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t value = attribute_of(bytes, i);
    found.any = found.any || value != 0;
    found.any_valid = found.any_valid || (value & kColourBit) != 0;
    found.consistent = found.consistent && (value == 0 || (value & kColourBit) != 0);
  }
  return found;
}

}  // namespace

void set_stl_parts(const std::vector<StlSolid>& solids, std::uint64_t facets,
                   MeshAttributes& attributes) {
  PartNames names;
  bool named = false;
  const auto add = [&](std::uint64_t first, std::uint64_t end, std::string_view name) {
    if (first == end) return;
    named = named || !name.empty();
    attributes.part_ranges.push_back({first, static_cast<std::uint32_t>(attributes.parts.size())});
    attributes.parts.push_back({names.unique(name.empty() ? "solid" : name), {}});
  };
  add(0, solids.empty() ? facets : solids.front().first, {});
  for (std::size_t i = 0; i < solids.size(); ++i) {
    add(solids[i].first, i + 1 < solids.size() ? solids[i + 1].first : facets, solids[i].name);
  }
  if (attributes.parts.size() < 2 && !named) {
    attributes.parts.clear();
    attributes.part_ranges.clear();
  }
}

void read_stl_colours(std::string_view bytes, std::size_t count, MeshAttributes& attributes) {
  constexpr std::string_view kWord = "COLOR=";
  const std::size_t word = bytes.substr(0, kStlTextBytes).find(kWord);
  const bool magics = word != std::string_view::npos && word + kWord.size() + 4 <= kStlTextBytes;
  const AttributeBits bits = look_at_attributes(bytes, count);
  if (!magics && !(bits.any_valid && bits.consistent)) return;
  glm::u8vec4 usual(255);
  if (magics) {
    for (int i = 0; i < 4; ++i) {
      usual[i] = static_cast<std::uint8_t>(
          byte_at(bytes, word + kWord.size() + static_cast<std::size_t>(i)));
    }
    if (usual.a == 0) usual.a = 255;  // not given
  }
  attributes.element_colours.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t value = attribute_of(bytes, i);
    // Magics: bit 15 is 0 where the facet has a colour of its own, red in the low bits. Files
    // without any have 0 everywhere.
    const bool own = magics ? bits.any && (value & kColourBit) == 0 : (value & kColourBit) != 0;
    const glm::u8vec4 colour = low_first(value);
    attributes.element_colours.push_back(!own     ? usual
                                         : magics ? colour
                                                  : glm::u8vec4(colour.b, colour.g, colour.r, 255));
  }
}

}  // namespace strata::detail
