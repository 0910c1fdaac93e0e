#pragma once

#include <string>
#include <vector>

#include "apps/commands/commands.h"
#include "apps/commands/placement_options.h"
#include "strata/core/result.h"

namespace CLI {
class App;
}

namespace strata::apps {

/// The options of every command that reads scenes, as words. Empty: not given.
struct SceneWords {
  std::string assets, root, scad_timeout;
  std::vector<std::string> parts;        ///< --part
  std::vector<std::string> definitions;  ///< -D
  std::string parameter_file, parameter_set, check_parameters, check_ranges;
  PlacementWords placement;
};

/// Defines them and those of the placement, OpenSCAD's own in a group that says so.
void define_scene_options(CLI::App& app, SceneWords& words);

/// Reads the words into `input`, whose files and format are set. @return kUsage
Result<void> read_scene_options(const SceneWords& words, csg::SceneInput& input);

}  // namespace strata::apps
