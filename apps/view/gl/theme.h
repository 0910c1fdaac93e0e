#pragma once

namespace strata::view {

/// Colours, spaces and a font for panels. @pre ImGui has a context, and no font yet
void apply_theme(float scale);

}  // namespace strata::view
