#pragma once

#include <string>
#include <string_view>

#include "csg/scene/outline.h"

namespace strata::csg {

/// The readers behind read_outline: from the text of a file; `name` is for messages. Not yet
/// centred.
Result<Outline> read_dxf(std::string_view text, const std::string& name,
                         const OutlineImport& options);
Result<Outline> read_svg(std::string_view text, const std::string& name,
                         const OutlineImport& options);

}  // namespace strata::csg
