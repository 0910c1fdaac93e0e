// Text: lines for the font, the direction, the script, and what is set.
#include "csg/outline/outline.h"
#include "csg/outline/text.h"
#include "tests/fuzz/scene_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  const auto line = [&] {
    const std::size_t end = rest.find('\n');
    const std::string_view text = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    return std::string(text);
  };
  csg::TextOptions options;
  options.font = line();
  options.direction = line();
  options.script = line();
  options.language = line();
  options.halign = line();
  options.valign = line();
  options.text = rest;
  std::string missing;
  const auto outline = csg::make_text(options, missing);
  if (outline) {
    check_outline(*outline);
  } else {
    check_refusal(outline.error(), "text: ");
  }
  return 0;
}
