// This work is based on: 3MF Consortium, "3D Manufacturing Format, Core Specification" 1.3 and
// "Materials and Properties Extension" 1.2.
#include "mesh/archives/model_properties.h"

namespace strata::detail {
namespace {

/// "#RRGGBB" or "#RRGGBBAA".
std::optional<glm::u8vec4> colour_of(std::string_view text) {
  if (!text.starts_with('#') || (text.size() != 7 && text.size() != 9)) return std::nullopt;
  glm::u8vec4 colour(255);
  for (std::size_t i = 1; i < text.size(); i += 2) {
    const char* const end = text.data() + i + 2;
    std::uint8_t value = 0;
    if (std::from_chars(text.data() + i, end, value, 16).ptr != end) return std::nullopt;
    colour[static_cast<int>(i / 2)] = value;
  }
  return colour;
}

class PropertyReader {
 public:
  PropertyReader(const XmlMesh& file, const ReadPicture& picture, MeshAttributes& to,
                 std::vector<std::string>& warnings)
      : file_(file), picture_(picture), to_(to), warnings_(warnings) {}

  Result<PropertyGroups> read(const pugi::xml_node& resources) {
    PropertyGroups groups;
    // groups of coordinates may come before their pictures
    for (const pugi::xml_node& node : resources.children()) {
      if (local_name(node) != "texture2d") continue;
      if (auto done = picture(node); !done) return tl::unexpected(done.error());
    }
    for (const pugi::xml_node& node : resources.children()) {
      const std::string_view kind = local_name(node);
      PropertyGroup group;
      if (kind == "basematerials") {
        base_materials(node, group);
      } else if (kind == "colorgroup") {
        colours(node, group);
      } else if (kind == "texture2dgroup") {
        places(node, group);
      } else if (kind == "compositematerials" || kind == "multiproperties") {
        group.skipped = true;
        warnings_.push_back(file_
                                .refuse(node, fmt::format("<{}> is not read; faces that use it "
                                                          "have no colour",
                                                          kind))
                                .value()
                                .message);
      } else {
        continue;
      }
      groups.try_emplace(node.attribute("id").value(), std::move(group));
    }
    return groups;
  }

 private:
  void base_materials(const pugi::xml_node& node, PropertyGroup& group) {
    for (const pugi::xml_node& base : node.children()) {
      if (local_name(base) != "base") continue;
      SurfaceMaterial material;
      material.name = base.attribute("name").value();
      const auto colour = colour_of(base.attribute("displaycolor").value());
      if (colour) material.colour = glm::vec4(*colour) / 255.0f;
      material.coloured = colour.has_value();
      group.materials.push_back(static_cast<std::uint32_t>(to_.materials.size()));
      to_.materials.push_back(std::move(material));
    }
  }

  void colours(const pugi::xml_node& node, PropertyGroup& group) {
    for (const pugi::xml_node& one : node.children()) {
      if (local_name(one) != "color") continue;
      const auto colour = colour_of(one.attribute("color").value());
      if (!colour) {
        warnings_.push_back(
            file_.refuse(one, "a colour is not #RRGGBB or #RRGGBBAA").value().message +
            "; white is taken");
      }
      group.colours.push_back(colour.value_or(glm::u8vec4(255)));
    }
  }

  void places(const pugi::xml_node& node, PropertyGroup& group) {
    for (const pugi::xml_node& one : node.children()) {
      if (local_name(one) != "tex2coord") continue;
      const double u = read_number(one.attribute("u").value()).value_or(0.0);
      const double v = read_number(one.attribute("v").value()).value_or(0.0);
      group.places.emplace_back(static_cast<float>(u), static_cast<float>(v));
    }
    const auto found = pictures_.find(std::string_view(node.attribute("texid").value()));
    if (found != pictures_.end()) group.texture = found->second;
  }

  Result<void> picture(const pugi::xml_node& node) {
    if (!picture_) return {};
    const std::string_view path = node.attribute("path").value();
    auto texture = picture_(path);
    if (!texture && (texture.error().code == ErrorCode::kLimit ||
                     texture.error().code == ErrorCode::kCancelled)) {
      return tl::unexpected(texture.error());
    }
    if (!texture) {
      warnings_.push_back(texture.error().message + "; the texture is not shown");
      return {};
    }
    const auto wrap = [&](const char* style) {
      const std::string_view word = node.attribute(style).value();
      return word == "mirror"                    ? TextureWrap::kMirror
             : word == "clamp" || word == "none" ? TextureWrap::kClamp
                                                 : TextureWrap::kRepeat;
    };
    texture->wrap_u = wrap("tilestyleu");
    texture->wrap_v = wrap("tilestylev");
    SurfaceMaterial material;
    material.name = path;
    material.coloured = true;
    material.texture = static_cast<std::uint32_t>(to_.textures.size());
    to_.textures.push_back(*std::move(texture));
    pictures_.emplace(node.attribute("id").value(),
                      static_cast<std::uint32_t>(to_.materials.size()));
    to_.materials.push_back(std::move(material));
    return {};
  }

  const XmlMesh& file_;
  const ReadPicture& picture_;
  MeshAttributes& to_;
  std::vector<std::string>& warnings_;
  std::map<std::string, std::uint32_t, std::less<>> pictures_;  // materials by the ids of pictures
};

}  // namespace

TriangleLook PropertyGroup::look(const std::array<std::uint32_t, 3>& corners) const {
  TriangleLook look;
  if (corners[0] < materials.size()) look.material = materials[corners[0]];
  if (corners[0] < colours.size() && corners[1] < colours.size() && corners[2] < colours.size()) {
    look.coloured = true;
    for (std::size_t i = 0; i < 3; ++i) look.colours[i] = colours[corners[i]];
  }
  if (texture != MeshAttributes::kNone && corners[0] < places.size() &&
      corners[1] < places.size() && corners[2] < places.size()) {
    look.textured = true;
    look.material = texture;
    for (std::size_t i = 0; i < 3; ++i) look.places[i] = places[corners[i]];
  }
  return look;
}

Result<PropertyGroups> read_properties(const XmlMesh& file, const pugi::xml_node& resources,
                                       const ReadPicture& picture, MeshAttributes& to,
                                       std::vector<std::string>& warnings) {
  return PropertyReader(file, picture, to, warnings).read(resources);
}

}  // namespace strata::detail
