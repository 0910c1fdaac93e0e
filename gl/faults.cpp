#include "gl/faults.h"

#include "strata/gl/context.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

namespace strata::gl {
namespace {

/// Calls fault(name, value) for what is asked for; the value is "" where there is none.
template <class Fault>
void for_each_fault(Fault&& fault) {
  const char* const variable = std::getenv("STRATA_GL_FAULTS");
  std::string_view words = variable ? variable : "";
  while (!words.empty()) {
    const std::string_view word = words.substr(0, words.find(','));
    words.remove_prefix(std::min(words.size(), word.size() + 1));
    const std::string_view name = word.substr(0, word.find('='));
    fault(name, word.substr(std::min(word.size(), name.size() + 1)));
  }
}

struct Faults {
  std::uint64_t downloads_left = 0;  ///< until the context is lost; 0: it never is
  bool lost = false;
  std::string refused;  ///< "": none
};
thread_local Faults faults;

}  // namespace

Result<void> begin_faults() {
  faults = {};
  Result<void> status;
  for_each_fault([&](std::string_view name, std::string_view value) {
    bool known = name == "hardware" && value.empty();
    if (name == "refuse-shader") {
      faults.refused = value;
      known = !value.empty();
    } else if (name == "lose-context") {
      const char* const end = value.data() + value.size();
      const auto read = std::from_chars(value.data(), end, faults.downloads_left);
      known = read.ec == std::errc() && read.ptr == end && faults.downloads_left > 0;
    }
    if (!known) {
      status = fail(ErrorCode::kUsage, "STRATA_GL_FAULTS: unknown fault {}={}", name, value);
    }
  });
  return status;
}

bool pretends_hardware() {
  bool asked = false;
  for_each_fault([&](std::string_view name, std::string_view) { asked |= name == "hardware"; });
  return asked;
}

bool loses_context_at_download() {
  if (faults.downloads_left > 0) faults.lost = --faults.downloads_left == 0;
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
