#pragma once

#include <cstdint>
#include <functional>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
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
#include "strata/raster/view.h"

namespace strata::csg {

/// Where meshes come to lie in the world: p becomes move + scale * turn(unit * p).
struct MeshPlacement {
  /// World unit, in metres. Files that say their unit are converted to it; the numbers of others
  /// are taken as they are. 0: the millimetre where a file is 3MF or AMF, else the metre where one
  /// is glTF, else unknown, and nothing is converted.
  double unit_metres = 0.0;
  /// Whether y is up in the files: they are turned by 90 degrees about x, so that z is up.
  enum class Up {
    kFile,  ///< as the format says: y in glTF, else z
    kY,     ///< y in all files
    kZ      ///< z in all files: nothing is turned
  };
  Up up = Up::kFile;          ///< axis that is up in the files
  glm::dvec3 scale{1.0};      ///< factors along x, y, z; not 0
  glm::dvec3 translate{0.0};  ///< world units
};

/// The input files, and how they are read.
struct SceneInput {
  std::vector<std::string> files;        ///< meshes and scenes; "-": standard input
  MeshReader reader = MeshReader::kOwn;  ///< of meshes
  /// Format of standard input if it is among the files, else of all files; kAuto: by name and
  /// content.
  MeshFormat format = MeshFormat::kAuto;
  bool scene_format = false;               ///< true: that format is .csg
  ReadSceneOptions scene;                  ///< for scenes among the files
  InsideRule rule = InsideRule::kWinding;  ///< which winding numbers are inside a mesh
  bool keep_orientation = false;           ///< meshes that are inside out are not reversed
  MeshPlacement placement;                 ///< of meshes, and of scenes but for their unit
  /// load_solids() turns the solids by it, after their facts were taken: from the world to the
  /// space of a grid. Near to orthonormal; a reflection is allowed.
  glm::dmat3 space_from_world{1.0};
  std::vector<std::string> parts;  ///< names of the parts of meshes to keep; empty: all
  bool split_parts = false;        ///< parts of meshes become solids of their own, united
  bool attributes = false;         ///< read parts, materials and colours of meshes
  bool textures = true;            ///< with `attributes`: and their pictures
  /// A Boolean expression over the files, such as "a - b"; empty: their union.
  std::string expression;
};

/// Callbacks for messages while files are read. An empty callback is not called.
struct InputMessages {
  /// A fault that does not stop the work. @param code  for machines, see docs/json.md
  std::function<void(std::string code, std::string message)> warn;
  std::function<void(std::string_view line)> note;  ///< a sentence about a file that was read
  std::function<void(std::string_view line)> echo;  ///< a line that a scene's program prints
  /// The files that a scene or a mesh has opened; a failure ends the work.
  std::function<Result<void>(std::span<const FileIdentity> files)> opened;
};

/// How a file is read: as a scene, or as a mesh of a format.
struct InputKind {
  bool is_scene = false;                  ///< .csg or .scad
  MeshFormat format = MeshFormat::kAuto;  ///< of a mesh; kAuto: by name and content
};

/// The kind of a file, from the options and from its name.
[[nodiscard]] InputKind kind_of(const std::string& path, const SceneInput& input);

/// The facts about one input file after its faces were reversed where needed.
struct InputFacts {
  std::string path;            ///< as it was given
  MeshReadStats stats;         ///< of the reader
  bool closed = false;         ///< under the inside rule: every ray enters as often as it leaves
  bool turned_around = false;  ///< all of it was inside out and has been reversed
  Orientation orientation;     ///< which parts were reversed
  /// The rule that was asked for, or parity where no side of the mesh is its outside.
  InsideRule rule = InsideRule::kWinding;
  double area = 0.0;    ///< square world units
  double volume = 0.0;  ///< signed, after reversal; an open mesh: about the middle of its bounds
  double longest_edge = 0.0;           ///< of the triangles, world units
  Bounds bounds;                       ///< of the triangles
  std::uint64_t zero_area_faces = 0;   ///< triangles whose area is 0
  std::uint64_t unbalanced_edges = 0;  ///< as MeshDiagnosis::unbalanced_edges
  std::string open;       ///< a sentence that says what is not closed; empty where all is
  std::string open_part;  ///< the part that it speaks of, if parts were split
  /// A sentence where the mesh has an unlikely size and its unit is not known; see unit_doubt().
  std::string unit_doubt;
  /// True for a scene. Then `stats` has only format, bytes, vertices and triangles, and area,
  /// volume and zero_area_faces are not known.
  bool is_scene = false;
  /// With SceneInput::attributes; of load_solids() only the parts, and SolidInput has the rest.
  MeshAttributes attributes;
};

/// Checks whether a mesh is closed and faces outward. Reverses what is inside out, unless
/// input.keep_orientation. Warns of faults that users should know.
/// @param path  the mesh's name in messages
/// @return kCancelled
Result<InputFacts> inspect_mesh(TriangleSoup& soup, MeshReadStats stats, const std::string& path,
                                const SceneInput& input, const InputMessages& messages = {},
                                const Execution& execution = {});

/// Length of the world's unit in metres, as MeshPlacement::unit_metres says; 0: unknown.
[[nodiscard]] double world_unit(const SceneInput& input);

/// How many of a unit another is, rounded once: 25.4 for inch and millimetre.
[[nodiscard]] double unit_ratio(double from_metres, double to_metres);

/// What the numbers of a file are multiplied by: unit_ratio(), or 1 where one of the two is not
/// known.
[[nodiscard]] double unit_factor(double file_metres, double world_metres);

/// "um", "mm", "cm", "m", "in", "ft"; empty for other lengths.
[[nodiscard]] std::string_view unit_symbol(double metres);

/// Moves a mesh from its file's space to the world. A power of two and a turn are exact. Without a
/// placement and where units agree, nothing changes.
/// @return kGeometry naming `path`: beyond the range of double; kCancelled
Result<void> place_mesh(const std::string& path, const MeshReadStats& stats,
                        const SceneInput& input, TriangleSoup& soup,
                        const Execution& execution = {});

/// Multiplies all positions by a matrix; a reflection reverses the triangles.
void turn_mesh(const glm::dmat3& turn, TriangleSoup& soup, const Execution& execution = {});

/// The same for a scene, whose numbers are in the world's unit.
Result<void> place_scene(const std::string& path, const SceneInput& input, Scene& scene);

/// A sentence where a mesh is too small or too large for millimetres, and nothing says its unit or
/// scales it: "0.021 long; the file says nothing about units; if it is in metres, give ...". Else
/// empty. @param bounds  of the mesh in the world
[[nodiscard]] std::string unit_doubt(const MeshReadStats& stats, const SceneInput& input,
                                     const Bounds& bounds);

/// For reports: the world's unit, and whether a file was converted to it. Empty: nothing is known.
[[nodiscard]] std::string describe_unit(double file_metres, double world_metres,
                                        const std::string& doubt);

/// Reads one mesh file as the options say, and moves it to its place. @return as read_mesh();
/// kInput if neither its name nor the options give its format
Result<MeshFile> read_mesh_input(const std::string& path, const InputKind& kind,
                                 const SceneInput& input, const Execution& execution = {});

/// Reads a mesh file, inspects it, and puts its triangles into `soup`. Adds the time of reading to
/// `read_ms` if that is not null.
Result<InputFacts> load_mesh(const std::string& path, const InputKind& kind,
                             const SceneInput& input, const InputMessages& messages,
                             const Execution& execution, TriangleSoup& soup,
                             double* read_ms = nullptr);

/// A part of a mesh, or all of one.
struct MeshSolid {
  TriangleSoup soup;
  InsideRule rule = InsideRule::kWinding;
  std::string name;      ///< of the file, or of its part
  bool is_part = false;  ///< one of several
};

/// The same, in parts that are inspected one by one, where input.split_parts asks for that and the
/// file has at least two. Triangles of no part are one more, named after the file.
Result<InputFacts> load_mesh_solids(const std::string& path, const InputKind& kind,
                                    const SceneInput& input, const InputMessages& messages,
                                    const Execution& execution, std::vector<MeshSolid>& solids,
                                    double* read_ms = nullptr);

/// Whether standard input is among the files.
[[nodiscard]] bool reads_standard_input(const SceneInput& input);

/// Checks that a file's name or the options give its format. @param scenes  true if scenes may be
/// read too @return kInput naming the formats that there are
Result<void> check_input_name(const std::string& path, const InputKind& kind, bool scenes);

/// Warnings of the reader about a file.
void warn_of_reading(const std::string& path, const MeshReadStats& stats,
                     const InputMessages& messages);

/// "edge (0, 0, 1) - (0, 1, 1) of face 17 is used once" and the like.
[[nodiscard]] std::string describe(const UnbalancedEdge& edge);

/// Whether a file is a scene by its name: .csg or .scad.
[[nodiscard]] bool is_scene_name(const std::string& path);

/// The inputs as one scene: a single scene as it is, else the result of the expression or the union
/// of all inputs.
/// @param facts  gets the facts of each file; a scene is closed when all solids of its result are
/// @return as read_scene() and load_mesh(); kUsage for the expression; kLimit when the tree becomes
/// too large
Result<Scene> load_scene(const SceneInput& input, const InputMessages& messages = {},
                         const Execution& execution = {}, std::vector<InputFacts>* facts = nullptr);

/// The box that a camera should see: around the result and the ghosts.
Result<Bounds> visible_box(const Scene& scene, const Execution& execution = {});

/// A section: points p with dot(normal, p) > offset are cut away.
struct SectionPlane {
  glm::dvec3 normal{0.0};    ///< of length 1
  double offset = 0;         ///< world units from the origin, along the normal
  bool towards_eye = false;  ///< true: the side of the eye is cut away
};

/// The plane as it cuts for a camera: one that is towards_eye is turned, and stays as it is then.
[[nodiscard]] SectionPlane facing(SectionPlane plane, const Camera& camera);

/// Cuts the scene and its ghosts by the sections.
void cut_scene(Scene& scene, std::span<const SectionPlane> cuts, const Camera& camera);

}  // namespace strata::csg
