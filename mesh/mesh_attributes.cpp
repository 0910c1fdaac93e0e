#include "strata/mesh/mesh_attributes.h"

#include <algorithm>
#include <utility>

#include "mesh/part_names.h"
#include "strata/mesh/soup_tools.h"

namespace strata {
namespace {

using Ranges = std::vector<MeshAttributes::Range>;

std::uint32_t index_at(const Ranges& ranges, std::uint64_t element) {
  const auto after =
      std::upper_bound(ranges.begin(), ranges.end(), element,
                       [](std::uint64_t face, const auto& range) { return face < range.first; });
  return after == ranges.begin() ? MeshAttributes::kNone : after[-1].index;
}

/// Adds ranges whose elements begin at `first` and whose indices begin at `base`.
void append_ranges(Ranges& ranges, std::uint64_t first, const Ranges& other, std::uint32_t base) {
  while (!ranges.empty() && ranges.back().first >= first) ranges.pop_back();
  if (ranges.empty() && other.empty()) return;
  if (other.empty() || other.front().first > 0) ranges.push_back({first, MeshAttributes::kNone});
  for (const MeshAttributes::Range& range : other) {
    ranges.push_back({first + range.first, range.index == MeshAttributes::kNone
                                               ? MeshAttributes::kNone
                                               : range.index + base});
  }
}

/// Adds the colours of `count` things behind those of `before` things.
void append_colours(std::vector<glm::u8vec4>& colours, std::uint64_t before,
                    const std::vector<glm::u8vec4>& other, std::uint64_t count) {
  if (colours.empty() && other.empty()) return;
  colours.resize(before, glm::u8vec4(255));
  colours.insert(colours.end(), other.begin(), other.end());
  colours.resize(before + count, glm::u8vec4(255));
}

/// Parts without ranges are one, of all elements.
void write_out_parts(MeshAttributes& attributes) {
  if (attributes.part_ranges.empty() && !attributes.parts.empty()) {
    attributes.part_ranges.push_back({0, 0});
  }
}

void append_corners(MeshAttributes& all, const MeshExtent& size, const MeshAttributes& other,
                    const MeshExtent& added) {
  if (all.corner_offsets.empty() && other.corner_offsets.empty()) return;
  std::vector<std::uint32_t>& offsets = all.corner_offsets;
  // Elements that no triangle is of may lie behind `size`.
  offsets.resize(size.elements + 1, offsets.empty() ? 0 : offsets.back());
  const std::uint32_t base = offsets.back();
  all.corners.resize(base);
  for (MeshAttributes::Corner corner : other.corners) {
    corner.vertex += static_cast<std::uint32_t>(size.vertices);
    all.corners.push_back(corner);
  }
  for (std::size_t e = 1; e < other.corner_offsets.size(); ++e) {
    offsets.push_back(base + other.corner_offsets[e]);
  }
  offsets.resize(size.elements + added.elements + 1, offsets.back());
  all.corner_colours = all.corner_colours || other.corner_colours;
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

void append(MeshAttributes& attributes, const MeshExtent& size, MeshAttributes other,
            const MeshExtent& added) {
  write_out_parts(attributes);
  write_out_parts(other);
  append_ranges(attributes.part_ranges, size.elements, other.part_ranges,
                static_cast<std::uint32_t>(attributes.parts.size()));
  append_ranges(attributes.material_ranges, size.elements, other.material_ranges,
                static_cast<std::uint32_t>(attributes.materials.size()));
  append_colours(attributes.vertex_colours, size.vertices, other.vertex_colours, added.vertices);
  append_colours(attributes.element_colours, size.elements, other.element_colours, added.elements);
  append_corners(attributes, size, other, added);
  detail::PartNames names;
  for (const MeshPart& part : attributes.parts) (void)names.unique(part.name);
  for (MeshPart& part : other.parts) {
    part.name = names.unique(part.name);
    attributes.parts.push_back(std::move(part));
  }
  const auto textures = static_cast<std::uint32_t>(attributes.textures.size());
  for (SurfaceMaterial& material : other.materials) {
    if (material.texture != SurfaceMaterial::kNoTexture) material.texture += textures;
    attributes.materials.push_back(std::move(material));
  }
  for (Texture& texture : other.textures) attributes.textures.push_back(std::move(texture));
}

void append(TriangleSoup& soup, MeshAttributes& attributes, const TriangleSoup& other,
            MeshAttributes other_attributes, std::uint64_t elements) {
  const std::size_t vertices = soup.positions.size(), triangles = soup.triangles.size();
  append(soup, other);
  std::uint64_t first = triangles;
  if (triangles < soup.face_elements.size()) {
    first = soup.face_elements[triangles] -
            (other.face_elements.empty() ? 0 : other.face_elements.front());
  }
  append(attributes, {first, vertices}, std::move(other_attributes),
         {elements, other.positions.size()});
}

}  // namespace strata
