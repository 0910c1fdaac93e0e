#include "mesh/archives/model_looks.h"

#include <utility>

namespace strata::detail {

void ModelLooks::start_part() {
  if (!is_pending_) return;
  is_pending_ = false;
  attributes.part_ranges.push_back({count_, static_cast<std::uint32_t>(attributes.parts.size())});
  attributes.parts.push_back({names_.unique(pending_), {}});
}

void ModelLooks::skip(std::uint64_t triangles) {
  if (triangles == 0) return;
  start_part();
  count_ += triangles;
}

void ModelLooks::add(const TriangleLook& look, const glm::uvec3& triangle, bool mirrored) {
  start_part();
  MeshAttributes& to = attributes;
  const std::uint32_t last =
      to.material_ranges.empty() ? MeshAttributes::kNone : to.material_ranges.back().index;
  if (look.material != last) to.material_ranges.push_back({count_, look.material});
  const bool even = look.colours[0] == look.colours[1] && look.colours[1] == look.colours[2];
  if (look.coloured && even) {
    to.element_colours.resize(count_, glm::u8vec4(255));
    to.element_colours.push_back(look.colours[0]);
  }
  if (look.textured || (look.coloured && !even)) {
    to.corner_offsets.resize(count_ + 1, static_cast<std::uint32_t>(to.corners.size()));
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t from = mirrored ? (3 - i) % 3 : i;
      MeshAttributes::Corner& corner = to.corners.emplace_back();
      corner.vertex = triangle[static_cast<int>(i)];
      corner.texture_at = look.places[from];
      if (look.coloured && !even) corner.colour = look.colours[from];
    }
    to.corner_offsets.push_back(static_cast<std::uint32_t>(to.corners.size()));
    to.corner_colours = to.corner_colours || (look.coloured && !even);
  }
  ++count_;
}

MeshAttributes ModelLooks::finish() {
  MeshAttributes& to = attributes;
  if (!to.element_colours.empty()) to.element_colours.resize(count_, glm::u8vec4(255));
  if (!to.corner_offsets.empty()) {
    to.corner_offsets.resize(count_ + 1, static_cast<std::uint32_t>(to.corners.size()));
  }
  return std::move(attributes);
}

}  // namespace strata::detail
