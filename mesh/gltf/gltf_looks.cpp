#include "mesh/gltf/gltf_looks.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <tuple>

#include "core/printable.h"
#include "core/srgb.h"
#include "mesh/gltf/gltf_shape.h"
#include "mesh/textures/read_texture.h"

namespace strata::detail {
namespace {

/// @param missing  becomes true where a file that is named cannot be read
Result<Texture> decoded(const GltfDocument& document, GltfData& data, std::uint32_t image,
                        bool& missing) {
  const std::optional<std::string>& uri = document.images[image].uri;
  const bool named = uri && !is_data(*uri);
  const std::string name = named ? printable(*uri, 80) : fmt::format("images[{}]", image);
  auto bytes = data.read_image(image);
  missing = named && !bytes;
  if (!bytes) return tl::unexpected(bytes.error());
  return read_texture(data.name() + ": " + name, *bytes, data.execution());
}

}  // namespace

glm::vec2 texture_place(const GltfMaterial& material, const glm::vec2& in_file) {
  // v goes down in glTF, so a turn counter-clockwise has the signs of one clockwise
  const glm::dvec2 scaled = material.texture_scale * glm::dvec2(in_file);
  const double c = std::cos(material.texture_turn), s = std::sin(material.texture_turn);
  const glm::dvec2 place = material.texture_offset +
                           glm::dvec2(c * scaled.x + s * scaled.y, c * scaled.y - s * scaled.x);
  return {place.x, 1.0 - place.y};
}

void add_materials(const GltfDocument& document, GltfData& data,
                   const std::vector<bool>& textures_wanted, MeshAttributes& to,
                   std::vector<std::string>& warnings, std::vector<std::string>& missing) {
  std::map<std::tuple<std::uint32_t, TextureWrap, TextureWrap, bool>, std::uint32_t> known;
  for (std::size_t i = 0; i < document.materials.size(); ++i) {
    const GltfMaterial& from = document.materials[i];
    SurfaceMaterial& material = to.materials.emplace_back();
    material.name = from.name;
    material.coloured = from.coloured;
    for (int c = 0; c < 3; ++c)
      material.colour[c] = static_cast<float>(srgb_of_linear(from.colour[c]));
    material.colour.w = from.opaque ? 1.0f : static_cast<float>(from.colour.w);
    if (!from.texture || !textures_wanted[i]) continue;
    const GltfTexture& texture = document.textures[*from.texture];
    if (!texture.image) {
      warnings.push_back(fmt::format("{}: textures[{}] is neither PNG nor JPEG, so it is not shown",
                                     data.name(), *from.texture));
      continue;
    }
    const auto [place, fresh] = known.try_emplace(
        {*texture.image, texture.wrap_u, texture.wrap_v, from.opaque}, SurfaceMaterial::kNoTexture);
    if (fresh) {
      bool is_missing = false;
      auto picture = decoded(document, data, *texture.image, is_missing);
      if (!picture && (picture.error().code == ErrorCode::kLimit ||
                       picture.error().code == ErrorCode::kCancelled)) {
        throw GltfRefusal{picture.error()};
      }
      if (!picture) {
        (is_missing ? missing : warnings)
            .push_back(picture.error().message + "; the texture is not shown");
        continue;
      }
      picture->wrap_u = texture.wrap_u;
      picture->wrap_v = texture.wrap_v;
      if (from.opaque) {
        for (glm::u8vec4& texel : picture->texels) texel.w = 255;
      }
      place->second = static_cast<std::uint32_t>(to.textures.size());
      to.textures.push_back(*std::move(picture));
    }
    material.texture = place->second;
  }
}

}  // namespace strata::detail
