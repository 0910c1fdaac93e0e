#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/archives/model_looks.h"
#include "mesh/archives/xml_mesh.h"

namespace strata::detail {

/// A list of properties of a 3MF part: base materials, colours, or places in a texture.
struct PropertyGroup {
  std::vector<std::uint32_t> materials;           ///< of base materials
  std::vector<glm::u8vec4> colours;               ///< of a colour group
  std::vector<glm::vec2> places;                  ///< of a group of texture coordinates
  std::uint32_t texture = MeshAttributes::kNone;  ///< material of the places
  bool skipped = false;                           ///< of a kind that is not read

  [[nodiscard]] std::size_t size() const {
    return std::max({materials.size(), colours.size(), places.size()});
  }

  /// @param corners  indices into the list; what is not there has no look
  [[nodiscard]] TriangleLook look(const std::array<std::uint32_t, 3>& corners) const;
};

/// The property groups of a part by their ids.
using PropertyGroups = std::map<std::string, PropertyGroup, std::less<>>;

/// Gives the bytes of a picture in the archive.
using ReadPicture = std::function<Result<Texture>(std::string_view path)>;

/// Reads the resources of a part: <basematerials>, <colorgroup>, <texture2d>, <texture2dgroup>.
/// Materials and textures are added to `to`. @param picture  empty: no textures
/// @return kLimit, kCancelled of a picture; other faults are warnings
Result<PropertyGroups> read_properties(const XmlMesh& file, const pugi::xml_node& resources,
                                       const ReadPicture& picture, MeshAttributes& to,
                                       std::vector<std::string>& warnings);

}  // namespace strata::detail
