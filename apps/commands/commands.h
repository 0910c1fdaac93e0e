#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "apps/session/help.h"
#include "apps/session/session.h"
#include "hashbuffer/tile_builder.h"
#include "strata/csg/boundary/boundary_mesh.h"
#include "strata/csg/input/scene_input.h"
#include "strata/csg/picture/picture.h"
#include "strata/hashbuffer/offsets.h"
#include "strata/mesh/writers/write_solid.h"
#include "strata/raster/camera_file.h"
#include "strata/transparency/techniques.h"
#include "strata/voxelize/grid_fit.h"
#include "strata/voxelize/output/voxel_output.h"
#include "strata/voxelize/picture/voxel_picture.h"
#include "strata/voxelize/readers/read_voxels.h"
#include "strata/voxelize/voxelize.h"

namespace strata::apps {

/// Who makes depth lists and finds surfaces; the results are the same.
enum class Backend {
  kAuto,  ///< a hardware GPU if there is one, else the CPU
  kCpu,
  kGl  ///< OpenGL 4.5, a software renderer too
};

/// Voxels along the longest side where no size is given.
inline constexpr int kDefaultResolution = 256;

/// One of the parts that a job is cut into.
struct Shard {
  int index = 1;  ///< from 1
  int count = 1;  ///< at most kMostShards
};
inline constexpr int kMostShards = 1024;  ///< rows of tiles of the largest grid
/// In the folder of a shard: what it is a part of.
inline constexpr const char* kShardReport = "shard.json";

inline constexpr double kMostGamma = 10;       ///< of --gamma
inline constexpr double kMostExposure = 1000;  ///< of --exposure, seconds

/// `strata voxelize`
struct VoxelizeCommand {
  CommonOptions common;
  csg::SceneInput input;
  std::string output;           ///< empty: none, "-": standard output
  std::string format;           ///< empty: by extension
  int fog = 0;                  ///< samples along a voxel's side of a fog volume; 0: none
  int levels = 1;               ///< resolutions of the file
  bool fog_by_default = false;  ///< of which no number was given
  int coverage = 0;             ///< rays along a voxel's side for its filled fraction; 0: none
  bool floats = false;          ///< fractions are floats in formats of arrays
  LayerOptions layers;          ///< of pictures
  bool mask = false;
  bool ids = false;                        ///< values say which solid
  bool sdf = false;                        ///< values are signed distances
  double band = 3.0;                       ///< of those, in voxels to each side of the surface
  bool band_all = false;                   ///< all voxels have their distance
  bool colours = false;                    ///< values are colours of the surface
  std::optional<glm::u8vec3> fill_colour;  ///< of what is not near the surface; sRGB
  std::optional<std::string> name;         ///< of the grid in the file
  GridRequest grid;
  std::string like;           ///< a file whose grid is taken instead; empty: none
  bool default_size = false;  ///< the grid has kDefaultResolution, since no size was given
  bool solid = true, surface = false;
  SurfaceKind surface_kind = SurfaceKind::kConservative;
  OpenMode open = OpenMode::kVote;
  std::optional<Axis> axis;  ///< empty: auto
  StoreKind store = StoreKind::kAuto;
  OffsetKind offsets = OffsetKind::kPlaneFirst;
  Backend backend = Backend::kAuto;
  bool stats = false, checksum = false, dry_run = false, list_formats = false;
  bool show = false;                ///< the output, in a window
  std::optional<Shard> shard;       ///< only this part is made
  std::optional<std::string> json;  ///< "-": standard output
};

/// The folder of a part of `output`: grid.npy.shard-3-of-8
[[nodiscard]] std::string shard_path(std::string output, const Shard& shard);

/// `strata merge`
struct MergeCommand {
  CommonOptions common;
  std::vector<std::string> shards;
  std::string output, format;  ///< as those of VoxelizeCommand
  bool stats = false, checksum = false;
  std::optional<std::string> json;  ///< "-": standard output
};

/// `strata info`
struct InfoCommand {
  CommonOptions common;
  csg::SceneInput input;
  bool check = false;  ///< also whether each mesh is the boundary of a solid
  bool gl = false;     ///< also what OpenGL there is
  std::optional<std::string> json;
};

/// `strata ldi`
struct LdiCommand {
  CommonOptions common;
  csg::SceneInput input;
  std::string output;
  GridRequest grid;
  bool samples = false;
  Axis axis = Axis::kZ;
  StoreKind store = StoreKind::kAuto;
  OffsetKind offsets = OffsetKind::kPlaneFirst;
  Backend backend = Backend::kAuto;
};

/// What makes a mesh of a tree.
enum class MeshMethod {
  kExact,   ///< the arrangement of all triangles: csg::boundary_mesh()
  kContour  ///< depth lists on a grid
};

/// `strata mesh`
struct MeshCommand {
  CommonOptions common;
  csg::SceneInput input;
  std::string output;                       ///< empty: none, "-": standard output
  SolidFormat format = SolidFormat::kAuto;  ///< of the output; kAuto: there is none
  std::string materials;                    ///< a file beside an OBJ, for colours; empty: none
  MeshMethod method = MeshMethod::kExact;
  csg::BoundaryOptions boundary;    ///< of the exact method
  GridRequest grid;                 ///< of the contour: its resolution or voxel size
  OpenMode open = OpenMode::kVote;  ///< of the contour
  std::optional<std::string> json;  ///< "-": standard output
};

/// What commands that draw have in common: a scene, a camera, a look
struct PictureRequest {
  CommonOptions common;
  csg::SceneInput input;
  std::string output;  ///< a file; empty: none, "-": standard output
  glm::ivec2 size{512};
  Camera camera;
  bool view_all = false, auto_centre = false;
  bool default_camera = false;  ///< none was given
  bool asked_view = false;      ///< --view-all or --auto-center was given
  int turntable = 0;            ///< pictures of one turn; 0: one picture
  bool asked_samples = false;   ///< --samples or --quality was given
  csg::PictureOptions picture;
  std::vector<csg::SectionPlane> cuts;
  std::optional<std::string> json;  ///< "-": standard output
};

/// `strata csg`, and what a window shows
struct CsgCommand : PictureRequest {
  std::string ids, depth;         ///< files; empty: none
  int frames = 0;                 ///< pictures with $t = 0, 1/frames, ...; 0: one without
  int path_frames = 0;            ///< pictures along `path`; 0: one, of its first camera
  std::string camera_file;        ///< --camera-file
  std::vector<TimedCamera> path;  ///< of --camera-file; empty: none was given
  double fps = 25;                ///< pictures a second of a film
  bool summary = false;           ///< the report as text
  bool alone = false;             ///< nothing but a file was given: `strata part.stl`
  bool render = false;  ///< the result alone: no ghosts, no colours, flat scenes from above
  Backend backend = Backend::kAuto;
  std::optional<int> measure_resolution;  ///< of the report's measures; none: csg::MeasureOptions'
  std::vector<FileUse> outputs;           ///< of a window: the pictures that it will write
};

/// `strata picture`: voxels, or what `strata csg` draws
struct PictureCommand : CsgCommand {
  bool voxels = false;  ///< the input is a file of voxels; else all that follows is as made
  VoxelStyle style = VoxelStyle::kAuto;
  VoxelColours colours = VoxelColours::kFile;
  ReadVoxelsOptions reading;
  /// A plane to draw flat: by index, or by the place of a point in it.
  struct Slice {
    Axis axis = Axis::kZ;
    bool by_index = false;
    double at = 0.0;
  };
  std::optional<Slice> slice;
};

/// A technique of transparency as the command line names it: "mlab:8".
struct OitChoice {
  std::string text;
  transparency::ChosenTechnique chosen;
};

/// `strata oit`
struct OitCommand : PictureRequest {
  std::vector<OitChoice> choices;
  bool all = false;  ///< all techniques: those that the input does not suit are left out
  std::optional<float> opacity;     ///< of what has none of its own
  std::string report;               ///< folder of the page; empty: none
  std::string media;                ///< file of media in solids, drawn instead of techniques
  std::optional<glm::dvec3> light;  ///< with media: the direction to a light
  bool fxaa = false;                ///< pictures are filtered before they are written
  bool list = false;                ///< only the list of techniques
};

using Command = std::variant<ParseOutcome, VoxelizeCommand, MeshCommand, InfoCommand, LdiCommand,
                             CsgCommand, PictureCommand, OitCommand, MergeCommand>;

/// Reads the command line.
Command parse_command_line(int argc, const char* const* argv);

}  // namespace strata::apps
