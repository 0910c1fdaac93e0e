#include "csg/outline/formats/outline_import.h"
#include "tests/fuzz/scene_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto outline = csg::read_svg(text, "input", {});
  if (outline) {
    check_outline(*outline);
  } else {
    check_refusal(outline.error(), "input");
  }
  return 0;
}
