#include <cstdlib>

#include "strata/mesh/materials/read_materials.h"
#include "tests/fuzz/scene_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto materials = parse_mtl(text, "input");
  if (!materials) {
    check_refusal(materials.error(), "input");
    return 0;
  }
  for (const Material& material : *materials) {
    if (material.name.empty()) std::abort();
    if (material.opacity && !(*material.opacity >= 0.0f && *material.opacity <= 1.0f)) std::abort();
    for (int i = 0; material.colour && i < 3; ++i) {
      if (!((*material.colour)[i] >= 0.0f && (*material.colour)[i] <= 1.0f)) std::abort();
    }
  }
  return 0;
}
