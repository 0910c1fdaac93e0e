#pragma once

#include <string_view>

#include "strata/mesh/mesh_file.h"

namespace strata::detail {

/// The format that the bytes of a file show; kAuto when they show none. Looks at the first and the
/// last 64 KiB, and at the size. What it names may still be malformed.
[[nodiscard]] MeshFormat format_of_content(std::string_view bytes);

}  // namespace strata::detail
