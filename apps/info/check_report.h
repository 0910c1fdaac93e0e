#pragma once

#include <string>
#include <vector>

#include "apps/session/json_writer.h"
#include "apps/session/session.h"
#include "strata/csg/tree.h"
#include "strata/mesh/check/mesh_check.h"
#include "strata/mesh/orient.h"

namespace strata::apps {

/// What `strata info --check` found in a mesh file.
struct FileCheck {
  MeshCheck mesh;
  Orientation orientation;          ///< parts that are inside out
  std::uint64_t dropped_faces = 0;  ///< that the reader did not accept, those without area included

  [[nodiscard]] bool passed() const;
  /// The faults, one a sentence; empty when it passed.
  [[nodiscard]] std::vector<std::string> faults() const;
};

/// What it found in a scene: the meshes of the result's solids, each once.
struct SceneCheck {
  struct Faulty {
    std::string name;  ///< of the first solid of the mesh
    std::vector<std::string> faults;
  };
  std::uint64_t meshes = 0;
  std::vector<Faulty> faulty;
};

/// Checks each mesh of a tree once. Errors as of check_mesh().
Result<SceneCheck> check_solids(const csg::Tree& tree, const Execution& execution);

/// The lines of the report, a topic and a text each; a line with an empty topic goes on with the
/// one before.
using ReportLines = std::vector<std::pair<std::string, std::string>>;
[[nodiscard]] ReportLines check_lines(const FileCheck& check);
[[nodiscard]] ReportLines check_lines(const SceneCheck& check);

/// The member "check" of a file's report.
void write_check(JsonWriter& json, const FileCheck& check);
void write_check(JsonWriter& json, const SceneCheck& check);

/// The warning for a file that did not pass.
void warn_of_check(const std::string& path, const FileCheck& check, Session& session);
void warn_of_check(const std::string& path, const SceneCheck& check, Session& session);

}  // namespace strata::apps
