#include "apps/commands/scene_options.h"

#include <CLI/App.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>

#include "apps/session/help.h"
#include "apps/session/option_values.h"

namespace strata::apps {
namespace {

namespace fs = std::filesystem;

/// Whether the text of a customizer's file has a set: a name inside of "parameterSets".
bool has_set(std::string_view text, std::string_view name) {
  int depth = 0;
  std::string_view section;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '{' || text[i] == '[') ++depth;
    if (text[i] == '}' || text[i] == ']') --depth;
    if (text[i] != '"') continue;
    const std::size_t begin = i + 1;
    for (i = begin; i < text.size() && text[i] != '"'; ++i) {
      if (text[i] == '\\') ++i;
    }
    if (i >= text.size()) return false;
    const std::size_t next = text.find_first_not_of(" \t\r\n", i + 1);
    if (next == std::string_view::npos || text[next] != ':') continue;  // a value
    const std::string_view key = text.substr(begin, i - begin);
    if (depth == 1) section = key;
    if (depth == 2 && section == "parameterSets" && key == name) return true;
  }
  return false;
}

/// openscad takes its defaults, without a word, where a set is not in the file.
Result<void> check_parameters(const SceneWords& words) {
  if (words.parameter_file.empty() != words.parameter_set.empty()) {
    return fail(ErrorCode::kUsage, "-p FILE and -P SET belong together: {} is missing",
                words.parameter_file.empty() ? "-p" : "-P");
  }
  if (words.parameter_file.empty()) return {};
  std::error_code ignored;
  if (!fs::is_regular_file(words.parameter_file, ignored)) {
    return fail(ErrorCode::kUsage, "-p {}: there is no such file", words.parameter_file);
  }
  std::ifstream in(words.parameter_file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  // Other characters may be written as escapes.
  const bool plain =
      std::all_of(words.parameter_set.begin(), words.parameter_set.end(),
                  [](char c) { return c >= ' ' && c <= '~' && c != '"' && c != '\\'; });
  if (plain && !has_set(text, words.parameter_set)) {
    return fail(ErrorCode::kUsage, "-P {}: the file {} has no set of that name",
                words.parameter_set, words.parameter_file);
  }
  return {};
}

}  // namespace

void define_scene_options(CLI::App& app, SceneWords& words) {
  const auto option = [&app](const char* names, std::string& word, const char* what,
                             const char* type, const char* group) {
    app.add_option(names, word, what)->type_name(type)->group(group);
  };
  define_placement_options(app, words.placement);
  const char* input = "Input";
  app.add_option("--part", words.parts,
                 "Keep this part of meshes alone: an OBJ object or group, an STL solid, a 3MF "
                 "object; may be repeated")
      ->type_name("NAME")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->group(input);
  option("--assets", words.assets,
         "Folder in which scenes look for files (default: the scene's own)", "FOLDER", input);
  option("--root", words.root,
         "Folder outside of which scenes and meshes may not read other files (default: no limit)",
         "FOLDER", input);
  option("--scad-timeout", words.scad_timeout,
         "Longest time that openscad may take for a .scad (default: 300)", "SECONDS", input);
  app.add_option("-D", words.definitions,
                 "Set a variable of a .scad: -D 'x=40', -D 'label=\"B\"'; may be repeated")
      ->type_name("NAME=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->group(kOpenscadGroup);
  option("-p", words.parameter_file, "File with the customizer's parameters for a .scad, .json",
         "FILE", kOpenscadGroup);
  option("-P", words.parameter_set, "Parameter set of that file to use", "SET", kOpenscadGroup);
  option("--check-parameters", words.check_parameters,
         "Let openscad check the parameters of modules and functions", "true|false",
         kOpenscadGroup);
  option("--check-parameter-ranges", words.check_ranges,
         "Let openscad check the parameter ranges of built-in modules", "true|false",
         kOpenscadGroup);
}

Result<void> read_scene_options(const SceneWords& words, csg::SceneInput& input) {
  if (auto placed = read_placement_options(words.placement, input.placement); !placed) {
    return placed;
  }
  csg::ReadSceneOptions& scene = input.scene;
  scene.asset_folder = words.assets;
  scene.root_folder = words.root;
  input.parts = words.parts;
  std::error_code ignored;
  if (!words.root.empty() && !fs::is_directory(words.root, ignored)) {
    return fail(ErrorCode::kUsage, "--root {}: there is no such folder", words.root);
  }
  if (!words.scad_timeout.empty()) {
    const auto seconds = parse_seconds("--scad-timeout", words.scad_timeout);
    if (!seconds) return tl::unexpected(seconds.error());
    scene.scad_timeout_s = *seconds;
  }
  std::vector<std::string>& options = scene.openscad_options;
  for (const std::string& definition : words.definitions) {
    if (definition.find('=') == std::string::npos) {
      return fail(ErrorCode::kUsage, "-D must be NAME=VALUE, got '{}'", definition);
    }
    options.insert(options.end(), {"-D", definition});
  }
  if (auto checked = check_parameters(words); !checked) return checked;
  if (!words.parameter_file.empty()) {
    options.insert(options.end(), {"-p", words.parameter_file, "-P", words.parameter_set});
  }
  for (const auto& [name, word] : {std::pair("--check-parameters", &words.check_parameters),
                                   std::pair("--check-parameter-ranges", &words.check_ranges)}) {
    if (word->empty()) continue;
    if (*word != "true" && *word != "false") {
      return fail(ErrorCode::kUsage, "{} must be true or false, got '{}'", name, *word);
    }
    options.insert(options.end(), {name, *word});
  }
  const bool runs = std::any_of(input.files.begin(), input.files.end(),
                                [](const auto& file) { return has_extension(file, ".scad"); });
  if (!options.empty() && !runs) {
    return fail(ErrorCode::kUsage, "{} needs a .scad input", options.front());
  }
  return {};
}

}  // namespace strata::apps
