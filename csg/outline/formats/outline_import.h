#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "csg/outline/outline.h"
#include "strata/core/execution.h"

namespace strata::csg {

/// The readers behind read_outline(). They parse the text of a file, which messages call `name`.
/// The result is not centred.
Result<Outline> read_dxf(std::string_view text, const std::string& name,
                         const OutlineImport& options, const Execution& execution = {},
                         std::vector<std::string>* warnings = nullptr);
Result<Outline> read_svg(std::string_view text, const std::string& name,
                         const OutlineImport& options, const Execution& execution = {});

}  // namespace strata::csg
