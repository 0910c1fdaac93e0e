#include "apps/commands/file_uses.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "apps/commands/oit_options.h"
#include "apps/session/file_conflicts.h"
#include "core/letters.h"
#include "voxelize/output/file_pair.h"

namespace strata::apps {
namespace {

std::vector<FileUse> outputs(std::initializer_list<FileUse> uses) {
  std::vector<FileUse> result;
  std::copy_if(uses.begin(), uses.end(), std::back_inserter(result),
               [](const FileUse& use) { return !use.path.empty(); });
  return result;
}

/// Files that a format writes, or a reader looks for, beside the one that is named; they may not be
/// there.
std::vector<std::string> beside(const std::string& path, std::string_view format) {
  const auto has = [&](const char* extension) {
    return has_extension(path, extension) || same_word(format, extension + 1);
  };
  if (has(".mhd")) {
    return {FilePair(path, ".mhd", ".zraw").data, FilePair(path, ".mhd", ".raw").data};
  }
  if (!has(".nhdr") && !has(".raw")) return {};
  const FilePair pair(path, ".nhdr", ".raw");
  return {pair.head, pair.data};
}

/// The file that a .mhd or .nhdr names for its data; empty: none.
std::string data_file_of(const std::string& head) {
  if (!has_extension(head, ".mhd") && !has_extension(head, ".nhdr")) return {};
  std::ifstream in(head, std::ios::binary);
  std::string line;
  for (int count = 0; count < 1000 && std::getline(in, line); ++count) {
    const std::size_t mark = line.find_first_of("=:");
    if (mark == std::string::npos) continue;
    std::string word = lower_case(line.substr(0, mark));
    while (!word.empty() && word.back() == ' ') word.pop_back();
    if (word != "elementdatafile" && word != "data file" && word != "datafile") continue;
    const std::size_t first = line.find_first_not_of("= \t:", mark);
    if (first == std::string::npos) return {};
    const std::size_t last = line.find_last_not_of(" \t\r");
    return (std::filesystem::path(head).parent_path() / line.substr(first, last + 1 - first))
        .string();
  }
  return {};
}

}  // namespace

std::vector<FileUse> inputs_of(const csg::SceneInput& input) {
  std::vector<FileUse> uses;
  for (const std::string& path : input.files) uses.push_back({"the input", path});
  const std::vector<std::string>& options = input.scene.openscad_options;
  for (std::size_t i = 0; i + 1 < options.size(); i += 2) {
    if (options[i] == "-p") uses.push_back({"the parameters", options[i + 1]});
  }
  return uses;
}

std::vector<FileUse> inputs_of(const CsgCommand& command) {
  std::vector<FileUse> uses = inputs_of(command.input);
  if (!command.camera_file.empty()) uses.push_back({"--camera-file", command.camera_file});
  return uses;
}

std::vector<FileUse> inputs_of(const OitCommand& command) {
  std::vector<FileUse> uses = inputs_of(command.input);
  if (!command.media.empty()) uses.push_back({"--media", command.media});
  return uses;
}

std::vector<FileUse> inputs_of(const VoxelizeCommand& command) {
  std::vector<FileUse> uses = inputs_of(command.input);
  if (command.like.empty()) return uses;
  uses.push_back({"--like", command.like});
  if (has_extension(command.like, ".npy")) uses.push_back({"--like", command.like + ".json"});
  if (std::string data = data_file_of(command.like); !data.empty()) {
    uses.push_back({"the data of --like", std::move(data)});
  }
  return uses;
}

std::vector<FileUse> inputs_of(const MergeCommand& command) {
  std::vector<FileUse> uses;
  for (const std::string& path : command.shards) uses.push_back({"the shard", path});
  return uses;
}

Result<void> check_no_shard(const std::vector<FileUse>& read) {
  for (const FileUse& in : read) {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(in.path + "/" + kShardReport, ignored)) continue;
    return fail(ErrorCode::kInput,
                "{}: it is a shard of strata voxelize --shard; strata merge joins all shards of a "
                "job",
                in.path);
  }
  return {};
}

std::string shard_path(std::string output, const Shard& shard) {
  while (output.size() > 1 && output.back() == '/') output.pop_back();
  return fmt::format("{}.shard-{}-of-{}", output, shard.index, shard.count);
}

std::vector<FileUse> outputs_of(const VoxelizeCommand& command) {
  if (command.shard && !command.output.empty()) {
    return outputs({{"-o", shard_path(command.output, *command.shard)},
                    {"--json", command.json.value_or("")}});
  }
  const bool sidecar = !command.like.empty() && command.output != "-" &&
                       (same_word(command.format, "npy") ||
                        (command.format.empty() && has_extension(command.output, ".npy")));
  std::vector<FileUse> uses = outputs({{"-o", command.output},
                                       {"the place of -o", sidecar ? command.output + ".json" : ""},
                                       {"--json", command.json.value_or("")}});
  if (command.output == "-") return uses;
  for (const std::string& path : beside(command.output, command.format)) {
    if (path != command.output) uses.push_back({"the other file of -o", path});
  }
  return uses;
}

std::vector<FileUse> outputs_of(const MergeCommand& command) {
  std::vector<FileUse> uses =
      outputs({{"-o", command.output}, {"--json", command.json.value_or("")}});
  if (command.output == "-") return uses;
  for (const std::string& path : beside(command.output, command.format)) {
    if (path != command.output) uses.push_back({"the other file of -o", path});
  }
  return uses;
}

std::vector<FileUse> outputs_of(const MeshCommand& command) {
  return outputs({{"-o", command.output},
                  {"the materials of -o", command.materials},
                  {"--json", command.json.value_or("")}});
}

std::vector<FileUse> outputs_of(const InfoCommand& command) {
  return outputs({{"--json", command.json.value_or("")}});
}

std::vector<FileUse> outputs_of(const LdiCommand& command) {
  return outputs({{"-o", command.output}});
}

std::vector<FileUse> outputs_of(const CsgCommand& command) {
  return outputs({{"-o", command.output},
                  {"--ids", command.ids},
                  {"--depth", command.depth},
                  {"--json", command.json.value_or("")}});
}

std::vector<FileUse> outputs_of(const OitCommand& command) {
  std::vector<FileUse> uses = outputs({{"--json", command.json.value_or("")}});
  if (!command.report.empty()) uses.push_back({"--report", command.report + "/index.html"});
  if (writes_folder(command)) {
    uses.push_back({"-o", command.output});
    return uses;
  }
  for (const OitChoice& choice : command.choices) {
    const std::string picture = picture_of(command, choice);
    if (!picture.empty()) uses.push_back({"-o", picture});
  }
  return uses;
}

}  // namespace strata::apps
