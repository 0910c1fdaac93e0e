#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <stop_token>
#include <string_view>
#include <vector>

#include "mesh/attributes/colour_values.h"
#include "mesh/formats/ply_source.h"
#include "strata/mesh/mesh_attributes.h"

/// Colours of PLY elements; used by the PLY reader.
namespace strata::detail::ply {

/// Where red, green, blue and alpha are among the properties of an element.
struct ColourLayout {
  std::array<int, 4> property{-1, -1, -1, -1};
  bool floats = false;  ///< in [0, 1], or else up to 255

  [[nodiscard]] bool given() const {
    return property[0] >= 0 && property[1] >= 0 && property[2] >= 0;
  }
};

inline ColourLayout colours_of(const Element& element) {
  constexpr std::string_view kNames[4][3] = {{"red", "diffuse_red", "r"},
                                             {"green", "diffuse_green", "g"},
                                             {"blue", "diffuse_blue", "b"},
                                             {"alpha", "diffuse_alpha", "a"}};
  ColourLayout layout;
  for (std::size_t i = 0; i < element.properties.size(); ++i) {
    const Property& property = element.properties[i];
    if (property.list_type) continue;
    for (std::size_t channel = 0; channel < 4; ++channel) {
      const auto& names = kNames[channel];
      if (std::find(std::begin(names), std::end(names), property.name) == std::end(names)) continue;
      layout.property[channel] = static_cast<int>(i);
      layout.floats =
          layout.floats || property.type == Type::kFloat || property.type == Type::kDouble;
    }
  }
  return layout;
}

/// Calls visit(index, values) for the four values of each element, until it returns false. @pre the
/// source holds the element, as the reader has found
template <class Source, class Visit>
void each_colour(Source source, const Element& element, const ColourLayout& layout, Visit&& visit) {
  for (std::uint64_t e = 0; e < element.count; ++e) {
    std::array<float, 4> values{0.0f, 0.0f, 0.0f, -1.0f};
    source.begin_element();
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const Property& property = element.properties[i];
      double value = 0.0;
      if (property.list_type) {
        if (!source.read(*property.list_type, value) || !(value >= 0.0 && value < 9e15) ||
            !source.skip(property.type, static_cast<std::uint64_t>(value))) {
          return;
        }
        continue;
      }
      const auto channel =
          std::find(layout.property.begin(), layout.property.end(), static_cast<int>(i));
      if (channel == layout.property.end()) {
        if (!source.skip(property.type, 1)) return;
        continue;
      }
      if (!source.read(property.type, value)) return;
      if (property.type == Type::kUint16) value /= 257.0;
      values[static_cast<std::size_t>(channel - layout.property.begin())] =
          static_cast<float>(value);
    }
    source.end_element();
    if (!visit(e, values)) return;
  }
}

/// Puts the colours of an element into `colours` from `first` on; not all of them after a stop.
template <class Source>
void read_ply_colours(const Source& source, const Element& element, const ColourLayout& layout,
                      std::uint64_t first, const std::stop_token& stop,
                      std::vector<glm::u8vec4>& colours) {
  constexpr std::uint64_t kRarely = 0xffff;
  float scale = 1.0f;
  if (layout.floats) {
    float most = 0.0f;
    each_colour(source, element, layout, [&](std::uint64_t e, const std::array<float, 4>& values) {
      for (const float value : values) most = std::max(most, value);
      return (e & kRarely) != kRarely || !stop.stop_requested();
    });
    scale = colour_scale(most);
  }
  each_colour(source, element, layout, [&](std::uint64_t e, const std::array<float, 4>& values) {
    glm::u8vec4 colour(255);
    for (int i = 0; i < 4; ++i) {
      const float value = values[static_cast<std::size_t>(i)];
      if (i < 3 || layout.property[3] >= 0) colour[i] = colour_byte(scale * value);
    }
    colours[first + e] = colour;
    return (e & kRarely) != kRarely || !stop.stop_requested();
  });
}

}  // namespace strata::detail::ply
