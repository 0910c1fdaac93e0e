#include "apps/view/gl/key_names.h"

#include <GLFW/glfw3.h>
#include <fmt/core.h>

#include <utility>

namespace strata::view {

std::string key_name(int key, int modifiers) {
  std::string name;
  if ((modifiers & GLFW_MOD_CONTROL) != 0) name += "ctrl+";
  if ((modifiers & GLFW_MOD_ALT) != 0) name += "alt+";
  if ((modifiers & GLFW_MOD_SHIFT) != 0) name += "shift+";
  if (key >= GLFW_KEY_A && key <= GLFW_KEY_Z)
    return name + static_cast<char>('a' + key - GLFW_KEY_A);
  if (key >= GLFW_KEY_0 && key <= GLFW_KEY_9)
    return name + static_cast<char>('0' + key - GLFW_KEY_0);
  if (key >= GLFW_KEY_KP_0 && key <= GLFW_KEY_KP_9) {
    return name + static_cast<char>('0' + key - GLFW_KEY_KP_0);
  }
  if (key >= GLFW_KEY_F1 && key <= GLFW_KEY_F12)
    return fmt::format("{}f{}", name, key - GLFW_KEY_F1 + 1);
  constexpr std::pair<int, const char*> kOthers[] = {{GLFW_KEY_LEFT, "left"},
                                                     {GLFW_KEY_RIGHT, "right"},
                                                     {GLFW_KEY_UP, "up"},
                                                     {GLFW_KEY_DOWN, "down"},
                                                     {GLFW_KEY_HOME, "home"},
                                                     {GLFW_KEY_TAB, "tab"},
                                                     {GLFW_KEY_ESCAPE, "escape"},
                                                     {GLFW_KEY_LEFT_BRACKET, "["},
                                                     {GLFW_KEY_RIGHT_BRACKET, "]"},
                                                     {GLFW_KEY_EQUAL, "="},
                                                     {GLFW_KEY_MINUS, "-"},
                                                     {GLFW_KEY_KP_ADD, "+"},
                                                     {GLFW_KEY_KP_SUBTRACT, "-"},
                                                     {GLFW_KEY_PAGE_UP, "page up"},
                                                     {GLFW_KEY_PAGE_DOWN, "page down"}};
  for (const auto& [code, word] : kOthers) {
    if (code == key) return name + word;
  }
  return {};
}

}  // namespace strata::view
