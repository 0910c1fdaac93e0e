#pragma once

#include <string>
#include <string_view>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/mesh_attributes.h"

namespace strata::detail {

/// Decodes a JPEG by libjpeg. @return as read_texture()
Result<Texture> read_jpeg(const std::string& name, std::string_view bytes,
                          const Execution& execution);

/// Checks the sides of a picture against what is read, and `bytes` against the memory limit.
/// @return kInput, kLimit
Result<void> check_texture_size(const std::string& name, std::uint64_t width, std::uint64_t height,
                                std::uint64_t bytes, const Execution& execution);

}  // namespace strata::detail
