// Height maps: pictures, which begin as PNG files do, and rows of numbers.
#include "csg/solids/height_map.h"

#include "tests/fuzz/input_file.h"
#include "tests/fuzz/scene_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const bool picture = bytes.starts_with("\x89PNG");
  const InputFile file(bytes, picture ? ".png" : ".dat");
  Execution execution;
  execution.memory_limit = std::uint64_t{1} << 28;
  std::string short_rows;
  const auto mesh = csg::read_surface(file.path(), !picture, false, &short_rows, execution);
  if (mesh) {
    check_soup(*mesh);
    must(is_closed(*mesh), "a surface is closed");
  } else {
    check_refusal(mesh.error(), file.path());
  }
  return 0;
}
