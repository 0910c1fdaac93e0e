#pragma once

#include <glm/vec2.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/result.h"
#include "strata/mesh/mesh_attributes.h"

namespace strata::detail {

/// A material of a Wavefront .mtl file.
struct MtlMaterial {
  SurfaceMaterial surface;  ///< name, Kd, and d or 1 - Tr as alpha; no texture yet
  std::string picture{};    ///< of map_Kd, as the file names it; may be empty
  TextureWrap wrap = TextureWrap::kRepeat;
  glm::vec2 scale{1.0f}, offset{0.0f};  ///< a place in the picture is scale * vt + offset
};

/// Reads the text of a .mtl file; statements that are not known are skipped. Where d and Tr are
/// given, d counts. @param name  stands for the path in messages @param warnings  gets remarks; may
/// be null @return kInput naming the line and what stands there
Result<std::vector<MtlMaterial>> parse_mtl(std::string_view text, const std::string& name,
                                           std::vector<std::string>* warnings = nullptr);

}  // namespace strata::detail
