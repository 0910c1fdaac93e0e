#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/file_identity.h"
#include "strata/core/result.h"

namespace strata {

/// A material of a Wavefront .mtl file.
struct Material {
  std::string name;                 ///< after `newmtl`
  std::optional<glm::vec3> colour;  ///< Kd, in [0, 1]
  std::optional<float> opacity;     ///< d, or 1 - Tr where there is no d; in [0, 1]
};

/// The materials of a mesh file, and which faces have them.
struct FaceMaterials {
  /// Faces from `first` to the next group's have a material.
  struct Group {
    static constexpr std::uint32_t kNone = 0xffffffffu;  ///< no material
    std::uint64_t first = 0;                             ///< face element of the file, from 0
    std::uint32_t material = kNone;  ///< index; kNone: the name is not that of a material
  };
  std::vector<Material> materials;    ///< in the order of the files
  std::vector<Group> groups;          ///< increasing
  std::vector<FileIdentity> files;    ///< the .mtl files that were read
  std::vector<std::string> missing;   ///< sentences: files that are not there
  std::vector<std::string> warnings;  ///< other sentences for the user

  /// The material of a face element, TriangleSoup::face_elements.
  [[nodiscard]] std::optional<std::uint32_t> of_element(std::uint64_t element) const;
};

/// Reads the `mtllib` and `usemtl` statements of an OBJ file and the .mtl files that they name,
/// which lie in the folder of the OBJ file or are named from there. A file that is not there is a
/// warning. @param root  files outside of this folder are refused, links followed; empty: none is
/// @return kInput naming file and line; kLimit; kCancelled
Result<FaceMaterials> read_obj_materials(const std::string& path, const std::string& root = {},
                                         const Execution& execution = {});

/// Reads the text of a .mtl file; statements that are not known are skipped. @param name  stands
/// for the path in messages @param warnings  gets remarks; may be null
/// @return kInput naming the line and what stands there
Result<std::vector<Material>> parse_mtl(std::string_view text, const std::string& name,
                                        std::vector<std::string>* warnings = nullptr);

}  // namespace strata
