// The command line. CLI11 takes six seconds to compile: few files know it.

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "apps/commands/choice_words.h"
#include "apps/commands/command_words.h"
#include "apps/commands/scene_options.h"
#include "apps/commands/version_report.h"
#include "apps/session/help.h"
#include "apps/session/option_values.h"
#include "core/did_you_mean.h"
#include "core/printable.h"
#include "strata/csg/input/scene_input.h"
#include "strata/voxelize/distance/signed_distance.h"
#include "strata/voxelize/formats/voxel_writer.h"

namespace strata::apps {
namespace {

/// Without arguments. The files are those of data/.
constexpr const char* kFirstHelp = R"(strata: exact voxels, meshes and pictures of solids

Five commands to try in the folder of the project:

  strata view data/plate.csg                          look at a scene in a window
  strata voxelize data/knot.obj -o knot.vdb           voxels, 256 along the longest side
  strata picture knot.vdb -o knot.png                 a picture of the voxels
  strata csg data/plate.csg --cut y=0 -o plate.png    a picture of a scene, cut open
  strata mesh data/plate.csg -o plate.3mf             the exact mesh, for a slicer

`strata FILE` says what a file holds and measures it. `strata --help` lists all commands, and
`strata COMMAND --help` lists the options of a command.
)";

constexpr const char* kTopHelp = R"(strata: exact voxels, depth lists and pictures of solids

  strata voxelize knot.obj -r 512 -o knot.vdb      solid voxels, the longest side 512
  strata voxelize a.stl b.stl --voxel-size 0.2 -o all.nrrd   the union
  strata voxelize scan.ply -r 1024 --stats --json  statistics for a program
  strata info scan.ply                             size, volume, holes
  strata ldi knot.obj -r 512 -o knot.exr           depth lists as a deep image
  strata mesh plate.csg -o plate.3mf               the exact mesh of a Boolean tree
  strata csg plate.csg -o plate.png                a picture of a Boolean tree
  strata part.scad -o part.png                     a picture, without naming the command
  strata oit knot.obj --opacity 0.4 -o knot.png    a transparent picture
  strata view plate.scad --watch                   a window that shows the scene
)";

std::string top_help() {
  std::string text =
      std::string(kTopHelp) + "\nUsage: strata COMMAND [OPTIONS] FILE...\n\nCommands:\n";
  for (const auto& [name, what] : kCommands) text += fmt::format("  {:<12}{}\n", name, what);
  text +=
      "\nOptions:\n"
      "  -h, --help      Print this help and exit\n"
      "  --help-all      Print the help of every command with all options, and exit\n"
      "  -V, --version   Print the version; with --json, also how it was built\n"
      "\n`strata COMMAND --help` lists the options of a command.\n"
      "\nExit codes:\n";
  for (const auto& [code, what] : kExitCodes) text += fmt::format("  {:<5}{}\n", code, what);
  return text;
}

constexpr const char* kVoxelizeExamples =
    R"(Turn meshes and scenes into voxels. A voxel is solid when its centre is inside.

  strata voxelize knot.obj -r 512 -o knot.vdb      the longest side 512
  strata voxelize a.stl b.stl --voxel-size 0.2 -o all.nrrd    the union
  strata voxelize leaf.obj -r 256 --surface -o leaf.npy     the surface
  strata voxelize part.stl --voxel-size 0.05,0.05,0.1 -o slices/ --format png
  strata voxelize plate.csg -r 256 --ids -o plate.nrrd     label voxels by solid
  strata voxelize part.stl -r 300 -o - --format npy | program
  strata voxelize scan.ply -r 1024 --stats         statistics only
)";

constexpr const char* kInfoExamples =
    R"(Report what meshes and scenes hold: counts, bounds, area, volume and holes.

  strata info scan.ply
  strata info --json *.stl
  strata info part.3mf --check         is it a solid? which triangles meet?
  strata info plate.csg                measured by rays, with error bounds
  strata info --gl                     OpenGL: what is found and how it is used
)";

constexpr const char* kLdiExamples =
    R"(Write a layered depth image: for each pixel the sorted depths of all surfaces.

  strata ldi knot.obj -r 512 -o knot.exr              solid intervals, deep EXR
  strata ldi knot.obj -r 512 --samples -o knot.exr    a sample each surface
  strata ldi knot.obj -r 512 --axis x -o knot.npz     arrays for NumPy
)";

/// Defines an option with a value on `app`.
CLI::Option* option(CLI::App& app, const char* group, const char* names, std::string& word,
                    const std::string& value, const char* what) {
  return app.add_option(names, word, what)->type_name(value)->group(group);
}

/// Defines an option without one, or with one that may be left out: `--fog[=N]`.
template <class T>
void flag(CLI::App& app, const char* group, const char* names, T& target, const char* what,
          const std::string& value = "") {
  app.add_flag(names, target, what)->type_name(value)->group(group);
}

void add_inputs(CLI::App& app, Words& words) {
  const char* group = "Input";
  app.add_option("INPUT", words.files,
                 "Meshes (.obj .stl .ply .off .3mf .amf .gltf .glb) and scenes (.csg .scad); - "
                 "reads a mesh from "
                 "standard input")
      ->type_name("")
      ->group(group);
  option(app, group, "--input-format", words.input_format, choices(kMeshFormatWords),
         "Format of standard input, or of every file where standard input is not read (default: "
         "auto, by name and content)");
  option(app, kDeveloperGroup, "--reader", words.reader, choices(kReaderWords),
         "Mesh reader: Strata's own or OpenMesh's (default: own)");
  define_scene_options(app, words.csg.scene);
}

}  // namespace

void add_common(CLI::App& app, Words& words) {
  const char* group = "Running";
  option(app, group, "-j,--threads", words.threads, "N",
         "Number of threads, 0 to 4096; 0 means one per processor (default: 0)");
  option(app, group, "--memory-limit", words.memory_limit, "SIZE",
         "Largest amount of memory to use, in bytes or with K, M, G or T: 512M, 2G (default: three "
         "quarters of "
         "the machine's or container's)");
  option(app, group, "--time-limit", words.time_limit, "SECONDS",
         "Stop after this time, without output and with exit code 6 (default: no limit)");
  flag(app, group, "--strict,--hardwarnings", words.strict,
       "Treat warnings as errors, with exit code 5");
  flag(app, group, "-q,--quiet", words.quiet, "Print errors only");
  flag(app, group, "-v,--verbose", words.verbose, "Also print each file read and each step");
  option(app, group, "--progress", words.progress, choices(kProgressWords),
         "Progress bar on standard error (default: auto, on terminals only)");
}

void add_json(CLI::App& app, Words& words, const char* group) {
  flag(app, group, "--json{-}", words.json,
       "Write a report for programs to FILE (default: to standard output)", "[=FILE]");
}

namespace {

constexpr const char* kGridGroup =
    "Grid (one of -r, --voxel-size, --grid, --cubic; default: -r 256)";

void add_grid(CLI::App& app, Words& words) {
  const char* group = kGridGroup;
  option(app, group, "-r,--resolution", words.resolution, "N",
         "Voxels along the longest side of the input, 1 to 65536");
  option(app, group, "--voxel-size", words.voxel_size, "S",
         "Side of a voxel in the input's units, or three sides: sx,sy,sz");
  option(app, group, "--grid", words.grid, "NX,NY,NZ",
         "Voxels along x, y and z, 1 to 65536 each, stretched to fit the input");
  option(app, group, "--cubic", words.cubic, "N",
         "N voxels along x, y and z, padding included; cubic voxels, the input in the middle");
  option(app, group, "--bounds", words.bounds, "BOX",
         "Box to cover, x0,y0,z0,x1,y1,z1 in the input's units (default: the input's box)");
  option(app, group, "--origin", words.origin, "X,Y,Z",
         "Lower corner of the grid in the input's units (default: that of the box)");
  option(app, group, "--padding", words.padding, "N",
         "Empty voxels on each side, in addition to -r but included in --grid (default: 0)");
  flag(app, group, "--align", words.align, "Make the origin a multiple of the voxel size");
}

}  // namespace

void add_backend(CLI::App& app, Words& words, const char* group) {
  option(app, group, "--backend", words.backend, choices(kBackendWords),
         "Processor for the depth lists: cpu, gl (OpenGL 4.5), or auto, which is a hardware GPU if "
         "there is one, else the CPU (default: auto); the result is the same");
}

namespace {

void add_stores(CLI::App& app, Words& words) {
  option(app, kDeveloperGroup, "--store", words.store, choices(kStoreWords),
         "Store of the depth lists: ha (HA-buffer), scan (count/scan) or auto (default: auto)");
  option(app, kDeveloperGroup, "--offsets", words.offsets, choices(kOffsetWords),
         "Probe offsets of the HA-buffer (default: plane-first)");
}

void define_voxelize(CLI::App& app, Words& words) {
  app.description(kVoxelizeExamples);
  add_inputs(app, words);
  const char* output = "Output";
  option(app, output, "-o,--output", words.output, "FILE",
         "File or folder to write; - for standard output");
  option(app, output, "--format", words.format, "FORMAT",
         "Format of the output, see --list-formats (default: by the file's name)");
  flag(app, output, "--list-formats", words.list_formats, "List the formats and exit");
  flag(app, output, "--fog{auto}", words.fog,
       "Write a fog volume to a .vdb: the filled fraction of each voxel, 0 to 1, from NxNxN "
       "samples; N is 1 to 16 (default: 4)",
       "[=N]");
  add_coverage(app, words, output);
  flag(app, output, "--mask", words.mask,
       "Write a mask grid to a .vdb: smaller, but fewer programs read it");
  flag(app, output, "--ids", words.ids,
       "Label each voxel with its solid or file: 1, 2, ...; --json lists the names");
  flag(app, output, "--sdf", words.sdf,
       "Write signed distances to the surface, negative inside: a level set in a .vdb, floats in "
       "other formats; the grid gets a padding as wide as the band");
  option(app, output, "--band", words.band, "N|all",
         "With --sdf: voxels to each side of the surface that have their distance, 0.5 to 1024; "
         "others have the band's (default: 3). all: every voxel has its own, not in a .vdb");
  flag(app, output, "--colours,--colors", words.voxel_colours,
       "Give each voxel the colour of the nearest point of the surface: textures, materials, "
       "vertices; in a scene the colour of its solid");
  option(
      app, output, "--fill-colour,--fill-color", words.fill_colour, "COLOUR",
      "Colour of what lies deeper in a solid than a voxel: white, #8080ff ... (default: #808080, "
      "in a scene the colour of the solid)");
  option(app, output, "--name", words.name, "NAME",
         "Name of the grid in a .vdb, .nrrd or .vti (default: density, ids, surface or solid)");
  option(app, output, "--levels", words.levels, "N",
         "Resolutions in an .ome.zarr, each half of the one before (default: 1)");
  flag(app, output, "--stats", words.stats, "Print statistics");
  add_json(app, words, output);
  flag(app, output, "--checksum", words.checksum, "Print a hash of the solid voxels and the grid");
  flag(app, output, "--show", words.show, "Open the file in a window, as strata view does");
  flag(app, output, "--dry-run", words.dry_run,
       "Print the grid and the memory that the command would take, and exit");
  add_grid(app, words);
  option(app, kGridGroup, "--like", words.like, "FILE",
         "Take size, spacing, origin and direction of the grid from a voxel file: .nrrd .nhdr .mha "
         ".mhd .nii .nii.gz .h5 .vdb .vti .npz .zarr, .npy with a .npy.json");
  const char* solid = "Solid voxels";
  flag(app, solid, "--solid", words.solid, "Voxels whose centre is inside (default)");
  flag(app, solid, "--surface{conservative}", words.surface,
       "Voxels of the surface: all it touches, or a 26- or 6-separating shell (default: "
       "conservative); with --solid both",
       "[=" + choices(kSurfaceKindWords) + "]");
  option(app, solid, "--rule", words.rule, choices(kRuleWords),
         "Winding numbers that are inside a mesh: above 0, not 0, or odd (default: winding)");
  flag(app, solid, "--keep-orientation", words.keep_orientation,
       "Do not reverse meshes that are inside out");
  option(app, solid, "--open", words.open, choices(kOpenModeWords),
         "Meshes with holes: vote closes holes by caps and winding numbers, surface keeps only the "
         "surface, fail ends the command (default: vote)");
  add_backend(app, words, "Running");
  add_common(app, words);
  option(app, kDeveloperGroup, "--axis", words.axis, choices(kAxisWords),
         "Ray direction (default: auto, the format's axis, else the one with fewest rays)");
  add_stores(app, words);
}

void define_info(CLI::App& app, Words& words) {
  app.description(kInfoExamples);
  add_inputs(app, words);
  flag(app, "Output", "--check", words.check,
       "Check that each mesh is the boundary of a solid: closed, 2-manifold, no triangles that "
       "meet; "
       "with --strict a mesh that fails ends with exit code 5");
  flag(app, "Output", "--gl", words.gl,
       "Report the OpenGL that is found and how it is used; needs no input");
  add_json(app, words, "Output");
  add_common(app, words);
}

void define_ldi(CLI::App& app, Words& words) {
  app.description(kLdiExamples);
  add_inputs(app, words);
  flag(app, "Input", "--keep-orientation", words.keep_orientation,
       "Do not reverse meshes that are inside out");
  option(app, "Output", "-o,--output", words.output, "FILE",
         "File to write: .exr, .npz, or .png (an X-ray picture)");
  flag(app, "Output", "--samples", words.samples,
       "Write one sample for each surface instead of solid intervals");
  option(app, "Output", "--axis", words.axis, "x|y|z", "Ray direction (default: z)");
  add_grid(app, words);
  add_backend(app, words, "Running");
  add_common(app, words);
  add_stores(app, words);
}

}  // namespace

std::string_view top_examples() { return kTopHelp; }

bool define_command(std::string_view name, CLI::App& app, Words& words) {
  define_help(app);
  app.footer("`strata --help` lists the commands and the exit codes.");
  if (name == "voxelize") {
    define_voxelize(app, words);
  } else if (name == "mesh") {
    define_mesh(app, words);
  } else if (name == "info") {
    define_info(app, words);
  } else if (name == "ldi") {
    define_ldi(app, words);
  } else if (name == "csg") {
    define_csg(app, words);
  } else if (name == "picture") {
    define_picture(app, words);
  } else if (name == "oit") {
    define_oit(app, words);
  } else {
    return false;
  }
  return true;
}

namespace {

std::string command_help(std::string_view name) {
  Words words;
  CLI::App app("", "strata " + std::string(name));
  define_command(name, app, words);
  return help_text(app, true);
}

}  // namespace

CommonOptions common_options(const Words& words, Reader& reader) {
  CommonOptions common;
  common.quiet = words.quiet;
  common.verbose = words.verbose;
  common.strict = words.strict;
  if (!words.time_limit.empty()) {
    reader.take(parse_seconds("--time-limit", words.time_limit), common.time_limit_s);
  }
  std::int64_t threads = 0;
  if (!words.threads.empty()) reader.take(parse_integer("--threads", words.threads), threads);
  if (threads < 0 || threads > 4096) {
    reader.fail_with(fmt::format("--threads must be 0 to 4096, got {}", threads));
  }
  common.threads = static_cast<int>(threads);
  if (!words.memory_limit.empty()) {
    reader.take(parse_bytes("--memory-limit", words.memory_limit), common.memory_limit);
  }
  reader.take(parse_choice("--progress", words.progress, kProgressWords), common.progress);
  return common;
}

csg::SceneInput input_options(const Words& words, bool pictures, Reader& reader) {
  csg::SceneInput input;
  input.scene_format = pictures && words.input_format == "csg";
  input.files = words.files;
  reader.take(parse_choice("--reader", words.reader, kReaderWords), input.reader);
  if (!input.scene_format) {
    reader.take(parse_choice("--input-format", words.input_format, kMeshFormatWords), input.format);
  }
  reader.take(check_stream_format(
      input.files, input.scene_format || input.format != MeshFormat::kAuto,
      pictures ? "csg, obj, stl, ply, off or glb" : "obj, stl, ply, off or glb"));
  reader.take(read_scene_options(words.csg.scene, input));
  return input;
}

namespace {

GridRequest grid_request(const Words& words, Reader& reader) {
  GridRequest grid;
  std::string sizes;
  int count = 0;
  for (const auto& [name, word] :
       {std::pair("-r", &words.resolution), std::pair("--voxel-size", &words.voxel_size),
        std::pair("--grid", &words.grid), std::pair("--cubic", &words.cubic),
        std::pair("--like", &words.like)}) {
    if (word->empty()) continue;
    sizes += fmt::format("{}{}", sizes.empty() ? "" : ", ", name);
    ++count;
  }
  if (count > 1) {
    reader.fail_with(fmt::format(
        "only one of -r, --voxel-size, --grid, --cubic and --like can be given, got {}", sizes));
    return grid;
  }
  if (!words.like.empty()) {
    for (const auto& [name, given] :
         {std::pair("--bounds", !words.bounds.empty()),
          std::pair("--origin", !words.origin.empty()),
          std::pair("--padding", !words.padding.empty()), std::pair("--align", words.align)}) {
      if (!given) continue;
      reader.fail_with(fmt::format(
          "--like takes the whole grid from a file; {} cannot be combined with it", name));
    }
    return grid;
  }
  if (count == 0) grid.resolution = kDefaultResolution;
  if (!words.cubic.empty()) reader.take(parse_integer("--cubic", words.cubic), grid.cubic);
  if (!words.resolution.empty()) {
    reader.take(parse_integer("--resolution", words.resolution), grid.resolution);
  }
  std::vector<double> numbers;
  const auto vector = [&] { return glm::dvec3(numbers[0], numbers[1], numbers[2]); };
  if (!words.voxel_size.empty()) {
    reader.take(parse_numbers("--voxel-size", words.voxel_size, 1, 3), numbers);
    if (reader.error()) return grid;
    numbers.resize(3, numbers[0]);
    grid.voxel_size = vector();
  }
  if (!words.grid.empty()) {
    std::string_view rest = words.grid;
    std::array<std::int64_t, 3> dims{};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t comma = i < 2 ? rest.find(',') : rest.size();
      if (comma == std::string_view::npos) {
        reader.fail_with(fmt::format("--grid must be nx,ny,nz, got '{}'", words.grid));
        return grid;
      }
      reader.take(parse_integer("--grid", rest.substr(0, comma)), dims[i]);
      rest.remove_prefix(std::min(comma + 1, rest.size()));
    }
    grid.dims = dims;
  }
  if (!words.bounds.empty()) {
    reader.take(parse_numbers("--bounds", words.bounds, 6, 6), numbers);
    if (reader.error()) return grid;
    Bounds box;
    box.low = vector();
    box.high = {numbers[3], numbers[4], numbers[5]};
    grid.bounds = box;
  }
  if (!words.origin.empty()) {
    reader.take(parse_numbers("--origin", words.origin, 3, 3), numbers);
    if (reader.error()) return grid;
    grid.origin = vector();
  }
  if (!words.padding.empty()) {
    reader.take(parse_integer("--padding", words.padding), grid.padding);
  }
  grid.align = words.align;
  // Limits are no mistakes of the command line, and have another exit code.
  const auto valid = check_grid_request(grid);
  if (!valid && valid.error().code == ErrorCode::kUsage) reader.fail_with(valid.error().message);
  return grid;
}

/// --sdf and --band.
void read_distances(const Words& words, VoxelizeCommand& command, Reader& reader) {
  command.sdf = words.sdf;
  if (!words.band.empty()) {
    if (!command.sdf) reader.fail_with("--band needs --sdf");
    command.band_all = words.band == "all";
    std::vector<double> band;
    if (!command.band_all) reader.take(parse_numbers("--band", words.band, 1, 1), band);
    if (!band.empty()) command.band = band[0];
    if (!(command.band >= 0.5 && command.band <= kMaxDistanceBand)) {
      reader.fail_with(
          fmt::format("--band must be 0.5 to {}, or all, got {}", kMaxDistanceBand, words.band));
    }
  }
  if (!command.sdf) return;
  // Otherwise the band would be cut off where the mesh reaches the sides of the grid.
  const bool sized = command.grid.resolution || command.grid.voxel_size;
  if (sized && words.padding.empty() && words.bounds.empty() && words.origin.empty()) {
    command.grid.padding = static_cast<std::int64_t>(std::ceil(command.band));
  }
  const char* other = command.ids        ? "--ids"
                      : command.fog != 0 ? "--fog"
                      : command.mask     ? "--mask"
                      : command.colours  ? "--colours"
                      : command.surface  ? "--surface"
                                         : nullptr;
  if (other != nullptr) reader.fail_with(fmt::format("--sdf cannot be combined with {}", other));
  if (command.axis && *command.axis != Axis::kX) {
    reader.fail_with("--sdf needs rays along x; without --axis the distances are the same");
  }
}

/// --fog and what else says what a voxel of the file is.
void read_values(const Words& words, VoxelizeCommand& command, Reader& reader) {
  constexpr std::int64_t kFogSamples = 4, kMostFogSamples = 16;
  command.ids = words.ids;
  command.mask = words.mask;
  if (!words.levels.empty()) {
    constexpr std::int64_t kMostLevels = 17;  // 65536 voxels to one
    std::int64_t levels = 1;
    reader.take(parse_integer("--levels", words.levels), levels);
    if (levels < 1 || levels > kMostLevels) {
      reader.fail_with(fmt::format("--levels must be 1 to {}, got {}", kMostLevels, levels));
    }
    command.levels = static_cast<int>(levels);
    if (command.output.empty()) reader.fail_with("--levels needs -o");
  }
  if (!words.name.empty()) command.name = words.name;
  if (std::any_of(words.name.begin(), words.name.end(),
                  [](unsigned char letter) { return letter < ' ' || letter == 0x7f; })) {
    reader.fail_with("--name must not contain control characters");
  }
  if (!words.fog.empty()) {
    command.fog_by_default = words.fog == "auto";
    std::int64_t samples = command.surface ? 1 : kFogSamples;
    if (!command.fog_by_default) reader.take(parse_integer("--fog", words.fog), samples);
    if (samples < 1 || samples > kMostFogSamples) {
      reader.fail_with(fmt::format("--fog must be 1 to {}, got {}", kMostFogSamples, samples));
    }
    if (command.surface && samples > 1) {
      reader.fail_with("--fog=N with N > 1 needs a solid voxelization; remove --surface");
    }
    command.fog = static_cast<int>(samples);
  }
  command.colours = words.voxel_colours;
  command.input.attributes = command.colours;
  if (!words.fill_colour.empty()) {
    reader.take(parse_colour("--fill-colour must be", words.fill_colour), command.fill_colour);
    if (!command.colours) reader.fail_with("--fill-colour needs --colours");
    if (!command.solid) reader.fail_with("--fill-colour needs a solid; remove --surface");
  }
  if (command.colours && (command.ids || command.fog != 0 || command.mask)) {
    reader.fail_with(fmt::format("--colours cannot be combined with {}", command.ids ? "--ids"
                                                                         : command.fog != 0
                                                                             ? "--fog"
                                                                             : "--mask"));
  }
  const char* fog_or_mask = command.fog != 0 ? "--fog" : "--mask";
  if (command.ids && (command.surface || command.fog != 0 || command.mask)) {
    reader.fail_with(fmt::format("--ids cannot be combined with {}",
                                 command.surface ? "--surface" : fog_or_mask));
  }
  if (command.fog != 0 && command.mask) {
    reader.fail_with("--fog and --mask cannot be combined");
  }
  read_distances(words, command, reader);
  const bool named = command.name.has_value();
  if (command.output.empty() && (command.fog != 0 || command.mask || named || command.colours)) {
    reader.fail_with(fmt::format("{} needs -o", named             ? "--name"
                                                : command.colours ? "--colours"
                                                                  : fog_or_mask));
  }
}

VoxelizeCommand voxelize_command(const Words& words, Reader& reader) {
  VoxelizeCommand command;
  command.common = common_options(words, reader);
  command.list_formats = words.list_formats;
  if (command.list_formats) return command;
  command.input = input_options(words, false, reader);
  command.output = words.output;
  command.format = words.format;
  command.surface = !words.surface.empty();
  command.solid = words.solid || !command.surface;
  if (command.surface) {
    reader.take(parse_choice("--surface", words.surface, kSurfaceKindWords), command.surface_kind);
  }
  reader.take(parse_choice("--rule", words.rule, kRuleWords), command.input.rule);
  reader.take(parse_choice("--open", words.open, kOpenModeWords), command.open);
  reader.take(parse_choice("--axis", words.axis, kAxisWords), command.axis);
  reader.take(parse_choice("--store", words.store, kStoreWords), command.store);
  reader.take(parse_choice("--offsets", words.offsets, kOffsetWords), command.offsets);
  reader.take(parse_choice("--backend", words.backend, kBackendWords), command.backend);
  command.input.keep_orientation = words.keep_orientation;
  command.stats = words.stats;
  command.checksum = words.checksum;
  command.dry_run = words.dry_run;
  command.show = words.show;
  if (!words.json.empty()) command.json = words.json;
  if (command.input.files.empty()) reader.fail_with("no input file is given");
  command.grid = grid_request(words, reader);
  command.like = words.like;
  command.default_size = command.grid.resolution && words.resolution.empty();
  read_values(words, command, reader);
  read_coverage(words, command, reader);
  if (command.backend == Backend::kGl && !command.solid) {
    reader.fail_with(
        "--backend gl cannot be combined with --surface alone, which needs no depth lists");
  }
  if (command.output.empty() && !words.format.empty()) reader.fail_with("--format needs -o");
  if (command.show && (command.output.empty() || command.output == "-" || command.dry_run)) {
    reader.fail_with(command.dry_run ? "--show and --dry-run cannot be combined"
                                     : "--show needs -o FILE, which it opens");
  }
  if (!command.output.empty()) return command;
  refuse_bare_outputs(
      command.input.files,
      [](const std::string& file) { return voxel_format_for(file, "").has_value(); }, reader);
  if (!command.json && !command.checksum && !command.dry_run) command.stats = true;
  return command;
}

InfoCommand info_command(const Words& words, Reader& reader) {
  InfoCommand command;
  command.common = common_options(words, reader);
  command.input = input_options(words, false, reader);
  command.check = words.check;
  command.gl = words.gl;
  if (!words.json.empty()) command.json = words.json;
  if (command.input.files.empty() && !command.gl) reader.fail_with("no input file is given");
  return command;
}

LdiCommand ldi_command(const Words& words, Reader& reader) {
  LdiCommand command;
  command.common = common_options(words, reader);
  command.input = input_options(words, false, reader);
  command.output = words.output;
  command.samples = words.samples;
  command.input.keep_orientation = words.keep_orientation;
  std::optional<Axis> axis;
  reader.take(parse_choice("--axis", words.axis, kAxisWords), axis);
  command.axis = axis.value_or(Axis::kZ);
  reader.take(parse_choice("--store", words.store, kStoreWords), command.store);
  reader.take(parse_choice("--offsets", words.offsets, kOffsetWords), command.offsets);
  reader.take(parse_choice("--backend", words.backend, kBackendWords), command.backend);
  if (command.input.files.empty()) reader.fail_with("no input file is given");
  if (command.output.empty())
    reader.fail_with("no output is given: give -o FILE.exr, -o FILE.npz or -o FILE.png");
  command.grid = grid_request(words, reader);
  return command;
}

ParseOutcome usage_error(std::string_view command, std::string_view message) {
  return {fmt::format("strata: error: {}\nstrata: see strata {}{}--help\n",
                      printable_lines(message), command, command.empty() ? "" : " "),
          true, static_cast<int>(ErrorCode::kUsage)};
}

/// What other programs call what the commands do.
constexpr std::pair<std::string_view, std::string_view> kOtherNames[] = {
    {"check", "info"},     {"contour", "mesh"}, {"convert", "mesh"},   {"draw", "csg"},
    {"export", "mesh"},    {"layers", "ldi"},   {"lists", "ldi"},      {"measure", "csg"},
    {"open", "view"},      {"raster", "ldi"},   {"render", "csg"},     {"repair", "mesh"},
    {"scene", "csg"},      {"show", "view"},    {"slice", "voxelize"}, {"stats", "info"},
    {"transparent", "oit"}};

ParseOutcome no_such_command(std::string_view name) {
  if (name.starts_with('-')) {
    constexpr std::string_view kOptions[] = {"--help", "--help-all", "--version"};
    const std::string meant = did_you_mean(name, kOptions);
    return usage_error("", fmt::format("unknown option {}{}", name,
                                       meant.empty() ? "; the command comes first" : meant));
  }
  std::error_code ignored;
  if (std::filesystem::is_directory(name, ignored)) {
    return usage_error("", fmt::format("{}: it is a folder, not a file or a command", name));
  }
  if (name.find_first_of("./") != std::string_view::npos) {
    return usage_error("", fmt::format("{}: there is no such file or command", name));
  }
  std::vector<std::string_view> names;
  for (const auto& [command, what] : kCommands) names.push_back(command);
  std::string meant = did_you_mean(name, names);
  for (const auto& [other, command] : kOtherNames) {
    if (name == other) meant = fmt::format("; did you mean {}?", command);
  }
  return usage_error("", fmt::format("no such command '{}'{}", name, meant));
}

/// `strata help COMMAND`
ParseOutcome help_on(std::string_view name) {
  Words words;
  CLI::App app("", "strata " + std::string(name));
  if (name == "view")
    return {"`strata view --help` lists the options, the mouse and the keys.\n", false, 0};
  if (!define_command(name, app, words)) return no_such_command(name);
  return {help_text(app, false), false, 0};
}

/// What stands behind --version.
ParseOutcome version(const std::vector<std::string>& words) {
  if (words.empty()) return {"strata " STRATA_VERSION "\n", false, 0};
  if (words.size() == 1 && words.front() == "--json") return {version_report(), false, 0};
  return usage_error("", fmt::format("--version takes nothing but --json, got {}", words.back()));
}

/// Whether a command line without a command is about a file of voxels.
bool holds_voxels(const std::vector<std::string>& words) {
  return !words.front().starts_with('-') && is_voxel_file(words.front());
}

/// For commands that read scenes and meshes alone.
void refuse_voxels(const std::vector<std::string>& files, Reader& reader) {
  const auto voxels = std::find_if(files.begin(), files.end(), is_voxel_file);
  if (voxels == files.end()) return;
  reader.fail_with(fmt::format(
      "{}: it holds voxels; `strata picture` draws them, `strata view` shows and exports them",
      *voxels));
}

/// Whether a command line is one of openscad: no command, but a file, or options and a scene.
bool begins_with_a_file(const std::vector<std::string>& words) {
  const std::string& first = words.front();
  for (const auto& [command, what] : kCommands) {
    if (first == command) return false;
  }
  if (first.starts_with('-')) return std::any_of(words.begin(), words.end(), csg::is_scene_name);
  std::error_code ignored;
  return csg::is_scene_name(first) || mesh_format_of(first) != MeshFormat::kAuto ||
         (is_voxel_file(first) && std::filesystem::exists(first, ignored)) ||
         std::filesystem::is_regular_file(first, ignored);
}

/// A command that stands behind a file: `strata knot.obj voxelize`.
std::optional<std::string_view> late_command(const std::vector<std::string>& words) {
  std::error_code ignored;
  for (const auto& [command, what] : kCommands) {
    if (words.front() != command && std::find(words.begin(), words.end(), command) != words.end() &&
        !std::filesystem::exists(command, ignored)) {
      return command;
    }
  }
  return std::nullopt;
}

}  // namespace

void refuse_bare_outputs(const std::vector<std::string>& files, bool (*writes)(const std::string&),
                         Reader& reader) {
  if (files.size() < 2) return;
  std::error_code ignored;
  const std::string& last = files.back();
  if (last == "-" || std::filesystem::exists(last, ignored) || !writes(last)) return;
  reader.fail_with(
      fmt::format("{}: there is no such file to read; to write it, give -o {}", last, last));
}

Command parse_command_line(int argc, const char* const* argv) {
  if (argc < 2) return ParseOutcome{kFirstHelp, true, static_cast<int>(ErrorCode::kUsage)};
  std::string_view name = argv[1];
  int first = 2;
  bool alone = false;  // a file without anything else
  if ((name == "help" || name == "-h" || name == "--help") && argc == 3) return help_on(argv[2]);
  if (name == "-h" || name == "--help" || name == "help") {
    return ParseOutcome{top_help(), false, 0};
  }
  if (name == "--help-all") {
    std::string text = top_help();
    for (const auto& [command, what] : kCommands) {
      if (command != "view") text += "\n" + command_help(command);
    }
    return ParseOutcome{std::move(text), false, 0};
  }
  if (name == "-V" || name == "--version" || name == "version") {
    return version({argv + 2, argv + argc});
  }
  if (begins_with_a_file({argv + 1, argv + argc})) {
    if (const auto command = late_command({argv + 1, argv + argc})) {
      return usage_error(
          *command, fmt::format("the command comes first: strata {} {} ...", *command, argv[1]));
    }
    alone = argc == 2;
    const bool voxels = holds_voxels({argv + 1, argv + argc});
    name = !voxels ? "csg" : alone ? "info" : "picture";
    first = 1;
  }
  // Only the options of the command that was named are built: that is most of the time CLI11 takes.
  Words words;
  CLI::App app("", "strata " + std::string(name));
  if (!define_command(name, app, words)) {
    return no_such_command(name);
  }
  try {
    std::vector<std::string> arguments(argv + first, argv + argc);
    if (const auto mistake = empty_value(arguments); !mistake.empty()) {
      return usage_error(name, mistake);
    }
    std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them from the back
    app.parse(std::move(arguments));
  } catch (const CLI::CallForHelp&) {
    return ParseOutcome{help_text(app, false), false, 0};
  } catch (const CLI::CallForAllHelp&) {
    return ParseOutcome{help_text(app, true), false, 0};
  } catch (const CLI::ParseError& error) {
    return usage_error(name, parse_mistake(app, error));
  }
  Reader reader;
  Command command;
  if (name == "voxelize") command = voxelize_command(words, reader);
  if (name == "mesh") command = mesh_command(words, reader);
  if (name == "info") command = info_command(words, reader);
  if (name == "ldi") command = ldi_command(words, reader);
  if (name == "csg") command = csg_command(words, reader);
  if (name == "picture") command = picture_command(words, reader);
  if (name == "oit") command = oit_command(words, reader);
  if (name != "info" && name != "picture") refuse_voxels(words.files, reader);
  if (reader.error()) return usage_error(name, reader.error()->message);
  if (auto* csg = std::get_if<CsgCommand>(&command)) csg->alone = alone;
  return command;
}

}  // namespace strata::apps
