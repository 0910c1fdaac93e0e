#include <cstdlib>

#include "mesh/attributes/mtl_file.h"
#include "tests/fuzz/scene_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto materials = detail::parse_mtl(text, "input");
  if (!materials) {
    check_refusal(materials.error(), "input");
    return 0;
  }
  for (const detail::MtlMaterial& material : *materials) {
    if (material.surface.name.empty()) std::abort();
    for (int i = 0; i < 4; ++i) {
      const float value = material.surface.colour[i];
      if (!(value >= 0.0f && value <= 1.0f)) std::abort();
    }
    for (int i = 0; i < 2; ++i) {
      const float sum = material.scale[i] + material.offset[i];
      if (sum - sum != 0.0f) std::abort();
    }
  }
  return 0;
}
