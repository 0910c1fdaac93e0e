#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/strata/commands.h"
#include "apps/strata/csg_options.h"

namespace CLI {
class App;
}

// Parts of the command line that its files share; not for others.

namespace strata::apps {

/// The words of the command line before they are read as numbers and choices. Empty: not given.
struct Words {
  std::vector<std::string> files;
  std::string reader = "own", input_format = "auto", threads, memory_limit, time_limit,
              progress = "auto";
  bool quiet = false, verbose = false, strict = false;
  std::string output, format, json;
  std::string resolution, voxel_size, grid, bounds, origin, padding;
  bool align = false, solid = false, mask = false, ids = false, keep_orientation = false,
       samples = false;
  std::string fog, name;
  std::string surface, rule = "winding", open = "vote", axis = "auto", store = "auto",
                       offsets = "plane-first", backend = "auto";
  bool stats = false, checksum = false, dry_run = false, list_formats = false, gl = false;
  CsgWords csg;
};

/// Reads one option's value into `target`; keeps the first error.
class Reader {
 public:
  template <class T, class U>
  void take(Result<T> value, U& target) {
    if (value) {
      target = *std::move(value);
    } else if (!error_) {
      error_ = std::move(value.error());
    }
  }
  void take(const Result<void>& done) {
    if (!done && !error_) error_ = done.error();
  }
  void fail_with(std::string message) {
    if (!error_) error_ = Error{ErrorCode::kUsage, std::move(message)};
  }
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }

 private:
  std::optional<Error> error_;
};

// What several commands take: its definition, and its words read.
void add_common(CLI::App& app, Words& words);
void add_json(CLI::App& app, Words& words, const char* group);
void add_backend(CLI::App& app, Words& words, const char* group);
CommonOptions common_options(const Words& words, Reader& reader);
/// @param pictures  for strata csg, which reads scenes from standard input too
csg::SceneInput input_options(const Words& words, bool pictures, Reader& reader);

/// The commands of the tool, and what --help says of each.
struct CommandSummary {
  std::string_view name, what;
};
inline constexpr CommandSummary kCommands[] = {
    {"voxelize", "Turn meshes and scenes into a voxel file or statistics"},
    {"info", "Report counts, bounds, area, volume and holes"},
    {"ldi", "Write the depth lists of meshes or a scene: a layered depth image"},
    {"csg", "Draw or measure a scene (.csg, .scad) or an expression over meshes"},
    {"view", "Show a scene or meshes in a window: turn, cut, pick, measure, reload"}};

/// Defines the options of a command, with its description and footer. False: there is no command
/// of that name here; `view` is a program of its own.
bool define_command(std::string_view name, CLI::App& app, Words& words);

/// The text of `strata --help` above its list of commands.
[[nodiscard]] std::string_view top_examples();

// command_line_csg.cpp: `strata csg`
void define_csg(CLI::App& app, Words& words);
CsgCommand csg_command(Words words, Reader& reader);

}  // namespace strata::apps
