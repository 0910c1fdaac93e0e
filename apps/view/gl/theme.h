#pragma once

namespace strata::view {

/// A font for panels. @pre ImGui has a context, and no font yet
void load_font(float scale);

/// Colours and spaces for panels. @pre ImGui has a context
void apply_theme(float scale, bool light);

}  // namespace strata::view
