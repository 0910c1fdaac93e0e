#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/strata/commands.h"
#include "strata/core/result.h"
#include "strata/csg/solid_lists.h"
#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/read_mesh.h"
#include "strata/mesh/orient.h"
#include "strata/mesh/triangle_soup.h"
#include "strata/voxelize/voxelize.h"

namespace strata::apps {

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

/// All inputs as one soup.
struct MeshInput {
  TriangleSoup soup;
  /// Of trees: what makes the lists of the result of the lists of the soup, all solids'. Where
  /// has_scene(), area and volume are not known, and the bounds may be larger than the result.
  std::shared_ptr<csg::SolidLists> tree;
  std::shared_ptr<const csg::Tree> scene;  ///< what `tree` was made of, without meshes
  std::vector<InputFacts> files;
  Bounds bounds;
  bool closed = true;                      ///< all of them
  InsideRule rule = InsideRule::kWinding;  ///< of the soup; solids of a tree have their own
  double area = 0.0, volume = 0.0, longest_edge = 0.0;
  double read_ms = 0.0, diagnose_ms = 0.0;

  /// Counts one more mesh in, all but its triangles.
  void add(InputFacts facts);
  /// The lists of a tree take the place of the soup.
  void set_tree(csg::Tree tree);
  [[nodiscard]] bool has_scene() const;
  /// Cuts off what does not fit the lattice of a grid; rays through the grid see no difference.
  /// @return kGeometry, kCancelled
  Result<void> fit(const VoxelGrid& grid, const Execution& execution);
};

struct MeshInputRules {
  bool keep_orientation = false;
  InsideRule rule = InsideRule::kWinding;
  bool as_tree = false;  ///< meshes become the solids of a tree, each by itself
};

/// Reads the files, looks whether each is closed and the right way around, turns what is not, and
/// warns of what users should know. Of several files of which some take parity a tree is made.
/// @return kInput, kUsage, kLimit, kCancelled
Result<MeshInput> load_meshes(const InputOptions& input, const MeshInputRules& rules,
                              Session& session);

/// The same where some of the files may be scenes (.csg, .scad), or the rules ask for a tree: then
/// all are united into one.
Result<MeshInput> load_solids(const InputOptions& input, const MeshInputRules& rules,
                              Session& session);

/// One of those files by itself: its triangles go to `soup`. With `read_ms` the time it took to
/// read is added there.
Result<InputFacts> load_mesh(const std::string& path, const InputOptions& input,
                             const MeshInputRules& rules, Session& session, TriangleSoup& soup,
                             double* read_ms = nullptr);

/// Whether standard input is among the files.
[[nodiscard]] bool reads_standard_input(const InputOptions& input);

/// The format that the options give a file, whatever its name is; kAuto: its name tells. With
/// standard input among the files, they mean that, and files whose names tell nothing.
[[nodiscard]] MeshFormat format_of(const std::string& path, const InputOptions& input);

/// Whether a file's name or the options say what format it has. @param scenes where scenes can be
/// read, too @return kInput naming what there is, or who reads scenes
Result<void> check_input_name(const std::string& path, const InputOptions& input, bool scenes);

/// One file, read as the options say.
Result<MeshFile> read_input(const std::string& path, const InputOptions& input, Session& session);

/// Warnings of the reader about a file.
void warn_of_reading(const std::string& path, const MeshReadStats& stats, Session& session);

/// "edge (0, 0, 1) - (0, 1, 1) of face 17 is used once" and the like.
[[nodiscard]] std::string describe(const UnbalancedEdge& edge);

}  // namespace strata::apps
