#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/file_identity.h"
#include "strata/core/result.h"
#include "strata/csg/tree.h"

namespace strata::csg {

/// A warning about a part of a scene that was done differently than written, or not at all.
struct SceneWarning {
  /// For machines: "not-done" (a node that cannot be done), "missing-file", "missing-font",
  /// "approximate", "ignored", "geometry", "openscad" (openscad's own warning about a program).
  std::string code;
  std::string message;  ///< begins with `file:line:column: `, or with the place that openscad names
};

/// The camera that a program sets by `$vpt`, `$vpr`, `$vpd` and `$vpf`; empty: not set.
struct SceneView {
  std::optional<glm::dvec3> target;     ///< world
  std::optional<glm::dvec3> rotation;   ///< degrees
  std::optional<double> distance;       ///< of the eye from the target, above 0
  std::optional<double> field_of_view;  ///< degrees, of the picture's height, in (0, 180)
};

/// A scene: its tree, and the subtrees that modifiers show as ghosts.
struct Scene {
  Tree tree;  ///< the root is the union of the top level
  /// Subtrees with `%`: shown as grey ghosts, not part of the result.
  std::vector<Tree::NodeId> backgrounds;
  /// Subtrees with `#`: part of the tree, and shown again as red ghosts (nodes of their own).
  std::vector<Tree::NodeId> highlights;
  /// The node that pictures show in place of the root; empty: the root. It shows highlighted parts
  /// only as ghosts, and shows flat parts among solids, which the root leaves out, as slabs.
  std::vector<Tree::NodeId> shown;
  std::vector<SceneWarning> warnings;  ///< in the order of the file; at most a thousand of a kind
  std::vector<std::string> notes;      ///< output of a program's echo() and the like, line by line
  /// The top level is flat: its outlines are slabs of thickness 1, z from -0.5 to 0.5.
  bool flat = false;
  /// How far numbers in the file may be off, relative to their size: 5e-6 for six printed digits.
  double relative_precision = 0.0;
  std::optional<SceneView> view;  ///< if a program sets it
  /// The files that were opened: the scene itself, its imports, and all files that openscad read
  /// for a program. A missing file has no identity.
  std::vector<FileIdentity> files;
};

/// Settings of read_scene().
struct ReadSceneOptions {
  /// Folder in which relative names of imported files are looked up; empty: the folder of the
  /// scene.
  std::string asset_folder = {};
  double scad_timeout_s = 300.0;  ///< for the `openscad` program that turns .scad into .csg
  /// Options of `openscad` for programs, word by word, such as "-D", "x=40".
  std::vector<std::string> openscad_options = {};
  /// A scene may read files below this folder only, links followed; empty: any regular file.
  std::string root_folder = {};
};

/// Finds the file `name` of a scene in `folder`: there, or in a folder above it, since scenes are
/// often written to another folder than their source.
[[nodiscard]] std::optional<std::string> find_asset(const std::string& folder,
                                                    const std::string& name);

/// Reads `.csg` (the whole language of both OpenSCAD 2021.01 and later) or, with the help of an
/// installed `openscad`, `.scad`. @return kInput naming file:line:column, also for a file outside
/// of the root folder; kLimit, kCancelled
Result<Scene> read_scene(const std::string& path, const ReadSceneOptions& options = {},
                         const Execution& execution = {});

/// The same from text; messages call it `name`.
Result<Scene> parse_scene(std::string_view text, const std::string& name,
                          const ReadSceneOptions& options = {}, const Execution& execution = {});

}  // namespace strata::csg
