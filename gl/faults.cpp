#include "gl/faults.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>

namespace strata::gl {
namespace {

/// The value of a fault that is asked for; "" where it has none.
std::optional<std::string_view> asked_for(std::string_view fault) {
  const char* const variable = std::getenv("STRATA_GL_FAULTS");
  std::string_view words = variable ? variable : "";
  while (!words.empty()) {
    const std::string_view word = words.substr(0, words.find(','));
    words.remove_prefix(std::min(words.size(), word.size() + 1));
    const std::string_view name = word.substr(0, word.find('='));
    if (name == fault) return word.substr(std::min(word.size(), name.size() + 1));
  }
  return std::nullopt;
}

struct Faults {
  std::uint64_t downloads_left = 0;  ///< until the context is lost
  bool will_lose = false, lost = false;
  std::string refused;  ///< "": none
};
thread_local Faults faults;

}  // namespace

void begin_faults() {
  faults = {};
  if (const auto number = asked_for("lose-context")) {
    faults.will_lose =
        std::from_chars(number->data(), number->data() + number->size(), faults.downloads_left)
            .ec == std::errc();
  }
  faults.refused = asked_for("refuse-shader").value_or("");
}

bool pretends_hardware() { return asked_for("hardware").has_value(); }

bool loses_context_at_download() {
  if (faults.will_lose && !faults.lost) faults.lost = --faults.downloads_left == 0;
  return faults.lost;
}

bool has_lost_context() { return faults.lost; }

bool refuses_shader(std::span<const GlslPiece> pieces) {
  return !faults.refused.empty() &&
         std::any_of(pieces.begin(), pieces.end(), [](const GlslPiece& piece) {
           return piece.name.find(faults.refused) != std::string_view::npos;
         });
}

}  // namespace strata::gl
