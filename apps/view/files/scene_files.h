#pragma once

// A guess from the text which files a scene may read, also where it cannot be loaded: to watch
// them. What a scene really read is in csg::Scene::files.

#include <string>
#include <string_view>
#include <vector>

namespace strata::view {

/// Names in quotes or after include and use in a scene's text: `"part.stl"`, `<lib.scad>`.
[[nodiscard]] std::vector<std::string> quoted_names(std::string_view text);

/// The files, and of those that are scenes what they name and what is there: meshes, outlines,
/// pictures, included programs, and what those name.
/// @param asset_folder where scenes look for files first; empty: beside the scene
/// @param all_scenes `files` are scenes, whatever their names are
[[nodiscard]] std::vector<std::string> with_scene_files(std::vector<std::string> files,
                                                        const std::string& asset_folder,
                                                        bool all_scenes = false);

}  // namespace strata::view
