#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/file_identity.h"
#include "strata/core/inside_rule.h"
#include "strata/core/result.h"
#include "strata/csg/scene/scene.h"
#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/read_mesh.h"
#include "strata/mesh/orient.h"
#include "strata/mesh/triangle_soup.h"

namespace strata::csg {

/// Files and how they are read.
struct SceneInput {
  std::vector<std::string> files;  ///< meshes and scenes; "-": standard input
  MeshReader reader = MeshReader::kOwn;
  /// Of standard input where that is among the files, else of all files; kAuto: by name and
  /// content.
  MeshFormat format = MeshFormat::kAuto;
  bool scene_format = false;               ///< the same: they are .csg, whatever their names are
  ReadSceneOptions scene;                  ///< for the scenes among them
  InsideRule rule = InsideRule::kWinding;  ///< which winding numbers are inside a mesh
  bool keep_orientation = false;           ///< meshes that are inside out are not turned
  /// A Boolean expression over the files, such as "a - b"; empty: their union. load_scene() only.
  std::string expression;
};

/// What is told while files are read, in this order; an empty one is not called.
struct InputMessages {
  /// Something that did not stop the work. @param code  for machines, see docs/json.md
  std::function<void(std::string code, std::string message)> warn;
  std::function<void(std::string_view line)> note;  ///< what was read
  std::function<void(std::string_view line)> echo;  ///< a line that a scene's program prints
  /// The files that a scene has opened; a failure ends the work.
  std::function<Result<void>(std::span<const FileIdentity> files)> opened;
};

/// What a file is taken for.
struct InputKind {
  bool is_scene = false;
  MeshFormat format = MeshFormat::kAuto;  ///< of a mesh; kAuto: its name and content tell
};

/// By the options, and by the file's name.
[[nodiscard]] InputKind kind_of(const std::string& path, const SceneInput& input);

/// What is known about one input file after it was read and turned.
struct InputFacts {
  std::string path;
  MeshReadStats stats;
  bool closed = false;         ///< under the inside rule: every ray enters as often as it leaves
  bool turned_around = false;  ///< all of it was inside out and has been turned
  Orientation orientation;     ///< what was turned, part by part
  /// What is inside: as asked for, but parity where faces have no common side.
  InsideRule rule = InsideRule::kWinding;
  double area = 0.0;    ///< square world units
  double volume = 0.0;  ///< signed, after turning; of an open mesh about the middle of its bounds
  double longest_edge = 0.0;
  Bounds bounds;
  std::uint64_t zero_area_faces = 0;
  std::uint64_t unbalanced_edges = 0;
  std::string open;  ///< a sentence that says what is not closed; empty where all is
  /// A scene: of `stats` there are format, bytes, vertices and triangles; area, volume and
  /// zero_area_faces are not known.
  bool is_scene = false;
};

/// Looks whether a mesh is closed and the right way around, turns it where it is not and may be,
/// and warns of what users should know. @param path  what messages call it @return kCancelled
Result<InputFacts> inspect_mesh(TriangleSoup& soup, MeshReadStats stats, const std::string& path,
                                const SceneInput& input, const InputMessages& messages = {},
                                const Execution& execution = {});

/// One mesh file, read as the options say. @return as read_mesh(); kInput where neither its name
/// nor the options say what format it has
Result<MeshFile> read_mesh_input(const std::string& path, const InputKind& kind,
                                 const SceneInput& input, const Execution& execution = {});

/// The same, then inspected: its triangles go to `soup`. With `read_ms` the time it took to read is
/// added there.
Result<InputFacts> load_mesh(const std::string& path, const InputKind& kind,
                             const SceneInput& input, const InputMessages& messages,
                             const Execution& execution, TriangleSoup& soup,
                             double* read_ms = nullptr);

/// Whether standard input is among the files.
[[nodiscard]] bool reads_standard_input(const SceneInput& input);

/// Whether a file's name or the options say what format it has. @param scenes where scenes can be
/// read, too @return kInput naming what there is
Result<void> check_input_name(const std::string& path, const InputKind& kind, bool scenes);

/// Warnings of the reader about a file.
void warn_of_reading(const std::string& path, const MeshReadStats& stats,
                     const InputMessages& messages);

/// "edge (0, 0, 1) - (0, 1, 1) of face 17 is used once" and the like.
[[nodiscard]] std::string describe(const UnbalancedEdge& edge);

}  // namespace strata::csg
