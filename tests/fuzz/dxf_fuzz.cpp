#include "csg/outline/formats/outline_import.h"
#include "tests/fuzz/scene_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  std::vector<std::string> warnings;
  const auto outline = csg::read_dxf(text, "input", {}, {}, &warnings);
  for (const std::string& warning : warnings) {
    must(warning.starts_with("input"), "a warning names the file");
  }
  if (outline) {
    check_outline(*outline);
  } else {
    check_refusal(outline.error(), "input");
  }
  return 0;
}
