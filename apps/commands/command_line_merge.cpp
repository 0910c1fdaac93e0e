// `strata merge`, and the option of `strata voxelize` that makes what it joins.

#include <CLI/App.hpp>
#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>
#include <string_view>

#include "apps/commands/command_words.h"
#include "apps/session/option_values.h"

namespace strata::apps {
namespace {

constexpr const char* kMergeExamples =
    R"(Join the shards of a voxel job to one file or report: the same as one process writes.

  for i in 1 2 3; do strata voxelize knot.obj -r 4096 -o knot.zarr --shard $i/3; done
  strata merge knot.zarr.shard-* -o knot.zarr --checksum
  strata voxelize knot.obj -r 65536 --shard 1/2 --json=1.json   the numbers alone
  strata merge 1.json 2.json --stats
)";

/// What a part of a grid cannot have, or nothing.
const char* undivided_option(const VoxelizeCommand& command) {
  return command.sdf           ? "--sdf: distances reach into other parts"
         : command.colours     ? "--colours"
         : command.levels != 1 ? "--levels: coarse voxels reach into other parts"
         : command.show        ? "--show"
         : command.dry_run     ? "--dry-run"
                               : nullptr;
}

/// A number of digits alone; one that is too large is the largest.
std::optional<int> digits_of(std::string_view text) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  if (text.empty() || !std::all_of(text.begin(), text.end(), is_digit)) return std::nullopt;
  int number = 0;
  const auto error = std::from_chars(text.data(), text.data() + text.size(), number).ec;
  return error == std::errc() ? number : std::numeric_limits<int>::max();
}

}  // namespace

void read_shard(const Words& words, VoxelizeCommand& command, Reader& reader) {
  if (words.shard.empty()) return;
  const std::string_view shard = words.shard;
  const std::size_t slash = std::min(shard.find('/'), shard.size());
  const auto index = digits_of(shard.substr(0, slash));
  const auto count = digits_of(shard.substr(std::min(slash + 1, shard.size())));
  if (!index || !count) {
    reader.fail_with(fmt::format("--shard must be I/N, like 1/8, got '{}'", shard));
    return;
  }
  if (*count < 1 || *count > kMostShards || *index < 1 || *index > *count) {
    reader.fail_with(
        fmt::format("--shard must be 1/N to N/N with N from 1 to {}, got {}", kMostShards, shard));
    return;
  }
  command.shard = Shard{*index, *count};
  if (const char* other = undivided_option(command)) {
    reader.fail_with(fmt::format("--shard cannot be combined with {}", other));
  }
  if (command.output == "-") {
    reader.fail_with("--shard writes a folder; -o - cannot be combined with it");
  }
  if (command.output.empty() && !command.json) {
    reader.fail_with("--shard needs -o FILE or --json=FILE, which strata merge reads");
  }
}

void define_merge(CLI::App& app, Words& words) {
  app.description(kMergeExamples);
  app.add_option("SHARD", words.files,
                 "All shards of one job, in any order: folders of --shard, or its reports (--json)")
      ->type_name("")
      ->group("Input");
  const char* output = "Output";
  const auto option = [&](const char* names, std::string& word, const char* value,
                          const char* what) {
    app.add_option(names, word, what)->type_name(value)->group(output);
  };
  option("-o,--output", words.output, "FILE", "File or folder to write; - for standard output");
  option("--format", words.format, "FORMAT",
         "Format of the output; shards of a .zarr or .ome.zarr keep theirs (default: by the file's "
         "name)");
  app.add_flag("--stats", words.stats, "Print statistics")->group(output);
  add_json(app, words, output);
  app.add_flag("--checksum", words.checksum, "Print a hash of the solid voxels and the grid")
      ->group(output);
  add_common(app, words);
}

MergeCommand merge_command(const Words& words, Reader& reader) {
  MergeCommand command;
  command.common = common_options(words, reader);
  command.shards = words.files;
  command.output = words.output;
  command.format = words.format;
  command.stats = words.stats;
  command.checksum = words.checksum;
  if (!words.json.empty()) command.json = words.json;
  if (command.shards.empty()) reader.fail_with("no shard is given");
  if (!command.output.empty()) return command;
  if (!words.format.empty()) reader.fail_with("--format needs -o");
  if (!command.json && !command.checksum) command.stats = true;
  return command;
}

}  // namespace strata::apps
