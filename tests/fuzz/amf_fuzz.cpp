#include "mesh/archives/read_3mf_amf.h"
#include "tests/fuzz/input_file.h"
#include "tests/fuzz/scene_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  const InputFile file({reinterpret_cast<const char*>(data), size}, ".amf");
  Execution execution;
  execution.memory_limit = std::uint64_t{1} << 28;
  const auto mesh = read_amf_model(file.path(), {.attributes = true}, execution);
  if (mesh) {
    check_soup(mesh->soup);
  } else if (mesh.error().code != ErrorCode::kUsage) {  // a build without the libraries
    check_refusal(mesh.error(), file.path());
  }
  return 0;
}
