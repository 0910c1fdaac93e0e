#pragma once

#include <cstdint>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <string_view>
#include <utility>

#include "transparency/stream/tile_stream.h"

// Rows of a pixel: blended fragments with the place of the nearest one, sorted by place.

namespace strata::transparency {

/// In floats, placed by the total order of fragments: 24 bytes.
struct FloatRow {
  glm::vec3 colour{0.0f};  ///< premultiplied
  float transmittance = 1.0f;
  DepthItem place = TileFragments::kNothing;

  static constexpr std::string_view kMemory = "24 bytes a row and pixel";

  static FloatRow of(const glm::vec4& fragment, DepthItem item) {
    return {glm::vec3(fragment), 1.0f - fragment.a, item};
  }
  [[nodiscard]] bool empty() const { return place == TileFragments::kNothing; }
  [[nodiscard]] bool before(const FloatRow& other) const { return place < other.place; }
  [[nodiscard]] std::uint32_t depth() const { return place.depth(); }
  [[nodiscard]] glm::vec4 value() const { return {colour, transmittance}; }
  /// Blends with what lies behind, and stays in its place.
  void merge(const FloatRow& behind) {
    colour += transmittance * behind.colour;
    transmittance *= behind.transmittance;
  }
};
static_assert(sizeof(FloatRow) == 24);

/// The rows of the papers: [red:8 | green:8 | blue:8 | transmittance:8 | depth:32]. Fragments at
/// one depth stay in the order of their arrival.
struct PackedRow {
  std::uint32_t packed = 255;
  std::uint32_t place = ~std::uint32_t{0};

  static constexpr std::string_view kMemory = "8 bytes a row and pixel";

  static PackedRow of(const glm::vec4& fragment, DepthItem item) {
    return {pack({glm::vec3(fragment), 1.0f - fragment.a}), item.depth()};
  }
  [[nodiscard]] bool empty() const { return place == ~std::uint32_t{0}; }
  [[nodiscard]] bool before(const PackedRow& other) const { return place < other.place; }
  [[nodiscard]] std::uint32_t depth() const { return place; }
  [[nodiscard]] glm::vec4 value() const {
    return glm::vec4(packed >> 24, packed >> 16 & 255, packed >> 8 & 255, packed & 255) / 255.0f;
  }
  void merge(const PackedRow& behind) {
    const glm::vec4 a = value(), b = behind.value();
    packed = pack({glm::vec3(a) + a.a * glm::vec3(b), a.a * b.a});
  }

 private:
  static std::uint32_t pack(const glm::vec4& value) {
    const glm::uvec4 bytes(glm::min(value, 1.0f) * 255.0f + 0.5f);
    return bytes.r << 24 | bytes.g << 16 | bytes.b << 8 | bytes.a;
  }
};
static_assert(sizeof(PackedRow) == 8);

/// Makes a pixel's rows empty. Rows after the first empty one are not read.
template <class Row>
void clear_rows(Row* rows, unsigned count) {
  if (count > 0) rows[0] = Row();
}

/// Puts a row into its place; it or a farther one falls out when all are full. What falls out is
/// local: the printed listings read it from a row that they never wrote. A row goes in front of
/// one with the same place, so that streams from back to front are exact.
/// @return what fell out, or an empty row
template <class Row>
Row insert_row(Row* rows, unsigned count, Row row, std::uint64_t& comparisons) {
  unsigned i = 0;
  while (i < count && rows[i].before(row)) ++i;
  comparisons += i + 1;
  for (; i < count; ++i) {
    if (rows[i].empty()) {
      rows[i] = row;
      if (i + 1 < count) rows[i + 1] = Row();
      return Row();
    }
    std::swap(rows[i], row);
  }
  return row;
}

}  // namespace strata::transparency
