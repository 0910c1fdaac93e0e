// Command lines, a word a line: they are read, and nothing is run.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "apps/commands/commands.h"
#include "tests/fuzz/mesh_fuzzing.h"

namespace strata::apps {
namespace {

void check(const ParseOutcome& outcome) {
  must(!outcome.text.empty(), "an outcome says something");
  must(outcome.exit_code == (outcome.to_stderr ? static_cast<int>(ErrorCode::kUsage) : 0),
       "a mistake is code 2, help is code 0");
  must(std::all_of(outcome.text.begin(), outcome.text.end(),
                   [](char c) { return (c < 0 || c >= ' ' || c == '\n') && c != 0x7f; }),
       "a mistake is told without control characters");
}

void check(const CommonOptions& common) {
  must(common.threads >= 0 && common.threads <= 4096, "threads are in range");
  must(common.time_limit_s >= 0, "a time limit is none or above 0");
}

void check(const VoxelizeCommand& command) {
  check(command.common);
  must(command.list_formats || !command.input.files.empty(), "there is an input");
}

void check(const MeshCommand& command) {
  check(command.common);
  must(!command.input.files.empty(), "there is an input");
  must(command.json || !command.output.empty(), "something comes out");
  must(command.output.empty() == (command.format == SolidFormat::kAuto), "an output has a format");
  must(command.boundary.bits >= 10 && command.boundary.bits <= 28, "bits are in range");
}

void check(const MergeCommand& command) {
  check(command.common);
  must(!command.shards.empty(), "there are shards");
  must(!command.output.empty() || command.json || command.stats || command.checksum,
       "something comes out");
}

void check(const InfoCommand& command) { check(command.common); }

void check(const LdiCommand& command) {
  check(command.common);
  must(!command.input.files.empty() && !command.output.empty(), "there are an input and an output");
}

void check(const OitCommand& command) {
  check(command.common);
  must(command.list || !command.input.files.empty(), "there is an input");
  must(command.size.x >= 1 && command.size.y >= 1, "a picture has pixels");
}

void check(const CsgCommand& command) {
  check(command.common);
  must(!command.input.files.empty(), "there is an input");
  must(command.size.x >= 1 && command.size.y >= 1, "a picture has pixels");
  must(command.camera.distance > 0 || command.view_all, "the eye is off the target");
  must(command.summary || command.json || !command.output.empty() || !command.ids.empty() ||
           !command.depth.empty(),
       "something comes out");
  must(command.frames == 0 || !command.output.empty(), "an animation has a file");
}

}  // namespace
}  // namespace strata::apps

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::string> words{"strata"};
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  while (!rest.empty() && words.size() < 64) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    words.emplace_back(line.substr(0, line.find('\0')));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
  }
  // Files of parameters would be read: those of the machine.
  for (const std::string& word : words) {
    if (word.starts_with("-p") || word.starts_with("@")) return 0;
  }
  std::vector<const char*> arguments;
  for (const std::string& word : words) arguments.push_back(word.c_str());
  const auto command =
      strata::apps::parse_command_line(static_cast<int>(arguments.size()), arguments.data());
  std::visit([](const auto& one) { strata::apps::check(one); }, command);
  return 0;
}
