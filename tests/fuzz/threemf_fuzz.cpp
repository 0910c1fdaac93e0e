// An archive, or the text of its parts: each follows a line "#part NAME"; what comes before the
// first is the model.
#include <utility>
#include <vector>

#include "mesh/archives/read_3mf_amf.h"
#include "tests/csg/scene/zip_files.h"
#include "tests/fuzz/input_file.h"
#include "tests/fuzz/scene_fuzzing.h"

namespace {

std::string archive_of(std::string_view text) {
  constexpr std::string_view kPart = "\n#part ";
  std::vector<std::pair<std::string, std::string>> parts;
  std::string name = "3D/3dmodel.model";
  while (true) {
    const std::size_t next = text.find(kPart);
    parts.emplace_back(name, text.substr(0, next));
    if (next == std::string_view::npos) return strata::csg::zip_of(parts);
    text.remove_prefix(next + kPart.size());
    const std::size_t end = text.find('\n');
    name = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const InputFile file(text.starts_with("PK") ? std::string(text) : archive_of(text), ".3mf");
  Execution execution;
  execution.memory_limit = std::uint64_t{1} << 28;
  const auto mesh = read_3mf_model(file.path(), {.attributes = true}, execution);
  if (mesh) {
    check_soup(mesh->soup);
  } else if (mesh.error().code != ErrorCode::kUsage) {  // a build without the libraries
    check_refusal(mesh.error(), file.path());
  }
  return 0;
}
