#pragma once

#include <string>

// What panels are made of.

namespace strata::view {

void text(const std::string& words);
void faint(const std::string& words);
/// A row of a table with two columns.
void row(const char* what, const std::string& value);
/// A button that is lit while something is on. @return whether it was pressed
bool toggle(const char* label, bool on, float width);
/// What the last item says when the mouse is above it.
void hint(const char* words);
/// The width of one of `count` buttons side by side.
[[nodiscard]] float share(int count);

}  // namespace strata::view
