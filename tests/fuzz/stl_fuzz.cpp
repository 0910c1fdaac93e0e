#include "tests/fuzz/mesh_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return strata::fuzz_reader(strata::MeshFormat::kStl, data, size);
}
