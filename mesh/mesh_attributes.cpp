#include "strata/mesh/mesh_attributes.h"

#include <algorithm>

namespace strata {
namespace {

std::uint32_t index_at(const std::vector<MeshAttributes::Range>& ranges, std::uint64_t element) {
  const auto after = std::upper_bound(
      ranges.begin(), ranges.end(), element,
      [](std::uint64_t face, const MeshAttributes::Range& range) { return face < range.first; });
  return after == ranges.begin() ? MeshAttributes::kNone : after[-1].index;
}

}  // namespace

bool MeshAttributes::coloured() const {
  return !vertex_colours.empty() || !element_colours.empty() || corner_colours ||
         std::any_of(materials.begin(), materials.end(),
                     [](const SurfaceMaterial& material) { return material.coloured; }) ||
         std::any_of(parts.begin(), parts.end(),
                     [](const MeshPart& part) { return part.colour.has_value(); });
}

std::uint32_t MeshAttributes::part_of(std::uint64_t element) const {
  if (part_ranges.empty()) return parts.empty() ? kNone : 0;
  return index_at(part_ranges, element);
}

std::uint32_t MeshAttributes::material_of(std::uint64_t element) const {
  return index_at(material_ranges, element);
}

std::span<const MeshAttributes::Corner> MeshAttributes::corners_of(std::uint64_t element) const {
  if (element + 1 >= corner_offsets.size()) return {};
  const std::uint32_t first = corner_offsets[element];
  return std::span(corners).subspan(first, corner_offsets[element + 1] - first);
}

}  // namespace strata
