#include "mesh/textures/read_texture.h"
#include "tests/fuzz/scene_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  Execution execution;
  execution.memory_limit = std::uint64_t{1} << 26;
  const auto texture =
      read_texture("input", {reinterpret_cast<const char*>(data), size}, execution);
  if (!texture) {
    if (texture.error().code != ErrorCode::kUsage) check_refusal(texture.error(), "input");
    return 0;
  }
  must(texture->width > 0 && texture->height > 0, "a picture has texels");
  must(texture->texels.size() ==
           static_cast<std::size_t>(texture->width) * static_cast<std::size_t>(texture->height),
       "its texels are all there");
  return 0;
}
