#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/commands/commands.h"
#include "apps/commands/csg_options.h"
#include "apps/commands/oit_options.h"

namespace CLI {
class App;
}

// Parts of the command line that its files share; not for others.

namespace strata::apps {

/// The options of `strata mesh` alone, as words. Empty: not given.
struct MeshWords {
  std::string method = "exact", faces, bits, open;
  bool colours = false;
};

/// The options of `strata picture` for voxels alone, as words. Empty: not given.
struct VoxelWords {
  std::string style, slice, colours, threshold;
};

/// The options of `strata voxelize` for filled fractions and pictures of layers.
struct CoverageWords {
  std::string coverage, gamma, flip, slice_axis, display, exposure;
  bool grey = false, floats = false;
};

/// The words of the command line before they are read as numbers and choices. Empty: not given.
struct Words {
  std::vector<std::string> files;
  std::string reader = "own", input_format = "auto", threads, memory_limit, time_limit,
              progress = "auto";
  bool quiet = false, verbose = false, strict = false;
  std::string output, format, json, shard;
  std::string resolution, voxel_size, grid, cubic, like, bounds, origin, padding;
  bool align = false, solid = false, mask = false, ids = false, sdf = false, voxel_colours = false,
       keep_orientation = false, samples = false;
  std::string fog, name, band, fill_colour, levels;
  std::string surface, rule = "winding", open = "vote", axis = "auto", store = "auto",
                       offsets = "plane-first", backend = "auto";
  bool stats = false, checksum = false, dry_run = false, show = false, list_formats = false,
       gl = false, check = false;
  CsgWords csg;
  OitWords oit;
  MeshWords mesh;
  VoxelWords voxels;
  CoverageWords coverage;
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

/// Defines an option with a value.
void add_option(CLI::App& app, const char* group, const char* names, std::string& word,
                const std::string& value, const char* what);
/// Defines an option without one.
void add_flag(CLI::App& app, const char* group, const char* names, bool& target, const char* what);
/// Defines an option whose value may be left out: `--fog[=N]`.
void add_flag(CLI::App& app, const char* group, const char* names, std::string& target,
              const char* what, const std::string& value);

// What several commands take: its definition, and its words read.
void add_common(CLI::App& app, Words& words);
void add_json(CLI::App& app, Words& words, const char* group);
void add_backend(CLI::App& app, Words& words, const char* group);
void add_coverage(CLI::App& app, Words& words, const char* group);
void add_inputs(CLI::App& app, Words& words);
void add_stores(CLI::App& app, Words& words);
CommonOptions common_options(const Words& words, Reader& reader);
/// @param pictures  for strata csg, which reads scenes from standard input too
csg::SceneInput input_options(const Words& words, bool pictures, Reader& reader);

struct VoxelizeCommand;
/// --coverage and what pictures of layers take. After the output and what else values are.
void read_coverage(const Words& words, VoxelizeCommand& command, Reader& reader);

// command_line_merge.cpp: `strata merge`, and what is common to jobs in parts.
void define_merge(CLI::App& app, Words& words);
MergeCommand merge_command(const Words& words, Reader& reader);
/// --shard. After all other options.
void read_shard(const Words& words, VoxelizeCommand& command, Reader& reader);

/// Where no output is given: refuses a last input that does not exist and has the name of an
/// output, `strata voxelize knot.obj knot.vdb`.
/// @param writes whether the command writes files of this name
void refuse_bare_outputs(const std::vector<std::string>& files, bool (*writes)(const std::string&),
                         Reader& reader);

/// What `strata-mpi --help` prints.
inline constexpr const char* kRanksHelp =
    R"(Run strata voxelize by the ranks of an MPI job, on one machine or on many.

  mpirun -n 64 strata-mpi voxelize part.stl -r 32768 -o part.zarr
  srun -n 64 strata-mpi voxelize part.stl -r 65536 --stats --checksum

The ranks take rows of tiles of the grid in turn. The result is that of one process, byte for byte:
.zarr, .ome.zarr, .npy, .raw and .nhdr on a file system that all machines reach, and reports. A .vdb
becomes a folder of one .vdb a rank and an index.json.

Options are those of strata voxelize. --threads and --memory-limit are those of one rank; by default
the ranks of a machine share its processors and memory. --sdf, --colours, --levels, --show, --dry-run
and --shard are for one process.
)";

/// The commands of the tool, and what --help says of each.
struct CommandSummary {
  std::string_view name, what;
};
inline constexpr CommandSummary kCommands[] = {
    {"voxelize", "Turn meshes and scenes into a voxel file or statistics"},
    {"merge", "Join the shards of `strata voxelize --shard` to one voxel file or report"},
    {"mesh", "Write the boundary of a scene or of meshes: 3MF, STL, OBJ, PLY, OFF"},
    {"info", "Report counts, bounds, area, volume and holes"},
    {"ldi", "Write the depth lists of meshes or a scene: a layered depth image"},
    {"csg", "Draw or measure a scene (.csg, .scad) or an expression over meshes"},
    {"picture", "Draw a voxel file (.vdb, .npy, .nrrd ...), a scene or meshes"},
    {"oit", "Draw transparent meshes or scenes, and compare techniques for that"},
    {"view", "Show a scene or meshes in a window: turn, cut, pick, measure, reload"}};

/// Defines the options of a command, with its description and footer. False: there is no command
/// of that name here; `view` is a program of its own.
bool define_command(std::string_view name, CLI::App& app, Words& words);

/// The text of `strata --help` above its list of commands.
[[nodiscard]] std::string_view top_examples();

/// Heading of the options that say how a picture looks.
inline constexpr const char* kLookGroup = "Appearance";

// command_line_csg.cpp: `strata csg`
void define_csg(CLI::App& app, Words& words);
CsgCommand csg_command(Words words, Reader& reader);

// The parts of it that all commands that draw have.
void define_picture_input(CLI::App& app, Words& words);
void define_picture_camera(CLI::App& app, CsgWords& csg);
/// Colours and samples.
void define_picture_quality(CLI::App& app, CsgWords& csg);
/// Background and sections.
void define_picture_cuts(CLI::App& app, CsgWords& csg);
/// Reads common options, inputs, output and report.
void picture_request(const Words& words, Reader& reader, PictureRequest& request);

// command_line_voxelize.cpp: `strata voxelize`
void define_voxelize(CLI::App& app, Words& words);
VoxelizeCommand voxelize_command(const Words& words, Reader& reader);
void add_grid(CLI::App& app, Words& words);
GridRequest grid_request(const Words& words, Reader& reader);
/// Refuses what no grid can be. Limits are no mistakes of the command line, and have another exit
/// code: fit_input_grid() tells them.
void refuse_impossible(const GridRequest& grid, Reader& reader);

// command_line_mesh.cpp: `strata mesh`
void define_mesh(CLI::App& app, Words& words);
MeshCommand mesh_command(const Words& words, Reader& reader);

// command_line_picture.cpp: `strata picture`
void define_picture(CLI::App& app, Words& words);
PictureCommand picture_command(Words words, Reader& reader);

// command_line_oit.cpp: `strata oit`
void define_oit(CLI::App& app, Words& words);
OitCommand oit_command(Words words, Reader& reader);

}  // namespace strata::apps
