#pragma once

#include <string>

namespace strata::view {

/// GLFW's name of a key as Viewer::key() has it; empty for those that mean nothing.
[[nodiscard]] std::string key_name(int key, int modifiers);

}  // namespace strata::view
