// The command line. CLI11 takes six seconds to compile: few files know it.

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <array>
#include <filesystem>

#include "apps/strata/choice_words.h"
#include "apps/strata/command_words.h"
#include "apps/strata/csg_scene.h"
#include "apps/strata/option_values.h"
#include "apps/strata/scene_options.h"
#include "core/printable.h"

namespace strata::apps {
namespace {

constexpr const char* kTopHelp = R"(strata: triangle meshes to voxels, exactly and fast

  strata voxelize knot.obj -r 512 -o knot.vdb          solid, 512 voxels along the longest side
  strata voxelize a.stl b.stl --voxel-size 0.2 -o all.nrrd     two meshes on one grid
  strata voxelize scan.ply -r 1024 --stats --json      only statistics, for a program to read
  strata info scan.ply                                 size, volume, closed or not and where
  strata ldi knot.obj -r 512 -o knot.exr               depth lists as a deep image
  strata csg plate.csg -o plate.png                    a picture of a Boolean tree
  strata part.scad -o part.png                         the same: a file instead of a command
  strata view plate.scad --watch                       a window on it

usage: strata COMMAND [OPTIONS] FILE...

commands:
  voxelize    meshes or scenes to a voxel grid, a file of it, or statistics
  info        what a mesh or a scene holds: counts, bounds, area, volume, holes
  ldi         meshes or a scene to a layered depth image
  csg         a scene (.csg, .scad) or an expression over meshes to a picture
  view        the same in a window: turn, cut, pick, measure, reload

  strata COMMAND --help lists the options of a command.
  -h, --help      this text
  -V, --version   the version
)";

constexpr const char* kExitCodes = R"(
exit codes:
  0    done
  1    an error inside strata
  2    options that are wrong or contradict each other
  3    an input file that cannot be read or is malformed
  4    an output that cannot be written
  5    geometry that is refused (--strict, --open fail, no extent, coordinates too large)
  6    a limit: memory, size of the grid, --time-limit
  7    two results differ that should agree
  130  interrupted
)";

constexpr const char* kVoxelizeExamples =
    R"(Meshes and scenes to voxels. A voxel is solid when its centre is inside.

  strata voxelize knot.obj -r 512 -o knot.vdb            512 voxels along the longest side
  strata voxelize a.stl b.stl --voxel-size 0.2 -o all.nrrd       the union, on one grid
  strata voxelize leaf.obj -r 256 --surface -o leaf.npy  every voxel that the surface touches
  strata voxelize part.stl --voxel-size 0.05,0.05,0.1 -o slices/ --format png
  strata voxelize plate.csg -r 256 --ids -o plate.nrrd   which solid a voxel is of
  strata voxelize part.stl -r 300 -o - --format npy | program
  strata voxelize scan.ply -r 1024 --stats               only statistics
)";

constexpr const char* kInfoExamples =
    R"(What meshes and scenes hold: counts, bounds, area, volume, and where they are not closed.

  strata info scan.ply
  strata info --json *.stl
  strata info plate.csg                                measured by rays, with error bounds
  strata info --gl                                     what OpenGL there is, and how it is used
)";

constexpr const char* kLdiExamples =
    R"(Meshes or a scene to a layered depth image: per pixel, the sorted depths where a ray meets it.

  strata ldi knot.obj -r 512 -o knot.exr              solid intervals, deep scanline EXR
  strata ldi knot.obj -r 512 --samples -o knot.exr    a sample for each surface
  strata ldi knot.obj -r 512 --axis x -o knot.npz     arrays for NumPy
)";

void add_inputs(CLI::App& app, Words& words) {
  app.add_option("INPUT", words.files,
                 "Meshes (.obj .stl .ply .off), scenes (.csg .scad); - a pipe of a mesh")
      ->type_name("");
  app.add_option("--input-format", words.input_format,
                 "obj, stl, ply or off: of -, else of all files whatever their names are")
      ->type_name("FORMAT")
      ->group("Input");
  app.add_option("--reader", words.reader, "own (default) or openmesh, to compare")
      ->type_name("NAME")
      ->group("Input");
  define_scene_options(app, words.csg.scene);
}

}  // namespace

void add_common(CLI::App& app, Words& words) {
  const char* group = "Running";
  app.add_option("-j,--threads", words.threads, "Threads; 0 (default): one a processor")
      ->type_name("N")
      ->group(group);
  app.add_option("--memory-limit", words.memory_limit,
                 "Bytes, or with K, M, G; default: three quarters of the machine or container")
      ->type_name("SIZE")
      ->group(group);
  app.add_option("--time-limit", words.time_limit,
                 "Seconds after which the command ends without output (exit code 6)")
      ->type_name("S")
      ->group(group);
  app.add_flag("--strict,--hardwarnings", words.strict, "Warnings are errors (exit code 5)")
      ->group(group);
  app.add_flag("-q,--quiet", words.quiet, "Print errors only")->group(group);
  app.add_flag("-v,--verbose", words.verbose, "Say what is done")->group(group);
  app.add_option("--progress", words.progress, "auto (a bar on terminals), bar or none")
      ->type_name("MODE")
      ->group(group);
}

void add_json(CLI::App& app, Words& words, const char* group) {
  app.add_flag("--json{-}", words.json, "--json[=FILE]: a report for programs (docs/json.md)")
      ->group(group);
}

namespace {

void add_grid(CLI::App& app, Words& words) {
  const char* group = "Grid (one of -r, --voxel-size, --grid)";
  app.add_option("-r,--resolution", words.resolution, "Voxels along the longest side of the mesh")
      ->type_name("N")
      ->group(group);
  app.add_option("--voxel-size", words.voxel_size, "World length of a voxel, or three: sx,sy,sz")
      ->type_name("S")
      ->group(group);
  app.add_option("--grid", words.grid, "nx,ny,nz voxels, stretched to fit the mesh")
      ->type_name("N,N,N")
      ->group(group);
  app.add_option("--bounds", words.bounds, "x0,y0,z0,x1,y1,z1: the box to cover, not the mesh's")
      ->type_name("BOX")
      ->group(group);
  app.add_option("--origin", words.origin, "x,y,z: lower corner of the grid")
      ->type_name("X,Y,Z")
      ->group(group);
  app.add_option("--padding", words.padding,
                 "Empty voxels on each side: added to -r, part of --grid")
      ->type_name("N")
      ->group(group);
  app.add_flag("--align", words.align, "Make the origin a multiple of the voxel size")
      ->group(group);
}

}  // namespace

void add_backend(CLI::App& app, Words& words, const char* group) {
  app.add_option("--backend", words.backend, "cpu, gl (OpenGL 4.5) or auto: a GPU if there is one")
      ->type_name("B")
      ->group(group);
}

namespace {

void add_engine(CLI::App& app, Words& words, const char* axes) {
  const char* group = "Engine (same result whatever is chosen)";
  add_backend(app, words, group);
  app.add_option("--axis", words.axis, axes)->type_name("A")->group(group);
  app.add_option("--store", words.store, "Of the depth lists: ha (HA-buffer), scan or auto")
      ->type_name("S")
      ->group(group);
  app.add_option("--offsets", words.offsets, "Of the HA-buffer: plane-first, random or farthest")
      ->type_name("O")
      ->group(group);
}

void define_voxelize(CLI::App& app, Words& words) {
  app.description(kVoxelizeExamples);
  add_inputs(app, words);
  const char* output = "Output";
  app.add_option("-o,--output", words.output, "File or folder to write; - for standard output")
      ->type_name("FILE")
      ->group(output);
  app.add_option("--format", words.format, "Its format, whatever the name is")
      ->type_name("FORMAT")
      ->group(output);
  app.add_flag("--list-formats", words.list_formats, "List the formats and end")->group(output);
  app.add_flag("--fog{auto}", words.fog,
               "--fog[=N], .vdb: fog volume, 0 to 1 by NxNxN samples a voxel; 4")
      ->group(output);
  app.add_flag("--mask", words.mask, ".vdb: a mask grid: smaller, opened by fewer programs")
      ->group(output);
  app.add_flag("--ids", words.ids,
               "Values say which solid or file: 1, 2, ...; --json has the names")
      ->group(output);
  app.add_option("--name", words.name,
                 "Of the grid: .vdb .nrrd .vti; default: density, ids, surface or solid")
      ->type_name("NAME")
      ->group(output);
  app.add_flag("--stats", words.stats, "Print statistics")->group(output);
  add_json(app, words, output);
  app.add_flag("--checksum", words.checksum, "A hash of the solid voxels and the grid")
      ->group(output);
  app.add_flag("--dry-run", words.dry_run, "Only say what grid and memory it would take")
      ->group(output);
  add_grid(app, words);
  const char* solid = "What is solid";
  app.add_flag("--solid", words.solid, "Voxels whose centre is inside (default)")->group(solid);
  app.add_flag("--surface{conservative}", words.surface,
               "--surface[=conservative|26|6]: voxels of the surface; with --solid: both")
      ->group(solid);
  app.add_option("--rule", words.rule, "Inside is winding (> 0, default), nonzero or parity (odd)")
      ->type_name("RULE")
      ->group(solid);
  app.add_flag("--keep-orientation", words.keep_orientation,
               "Do not turn meshes around that are inside out")
      ->group(solid);
  app.add_option("--open", words.open,
                 "Meshes with holes: vote of rays of all directions (default), surface or fail")
      ->type_name("HOW")
      ->group(solid);
  add_engine(app, words, "Of the rays: x, y, z or auto (that of the format, or fewest rays)");
  add_common(app, words);
}

void define_info(CLI::App& app, Words& words) {
  app.description(kInfoExamples);
  add_inputs(app, words);
  app.add_flag("--gl", words.gl, "What OpenGL there is, and how it is used; files are not needed")
      ->group("Output");
  add_json(app, words, "Output");
  add_common(app, words);
}

void define_ldi(CLI::App& app, Words& words) {
  app.description(kLdiExamples);
  add_inputs(app, words);
  app.add_option("-o,--output", words.output,
                 "File to write: .exr, .npz, or .png (an X-ray picture)")
      ->type_name("FILE")
      ->group("Output");
  app.add_flag("--samples", words.samples, "A sample for each surface, not solid intervals")
      ->group("Output");
  app.add_flag("--keep-orientation", words.keep_orientation,
               "Do not turn a mesh around that is inside out")
      ->group("Input");
  add_grid(app, words);
  add_engine(app, words, "Of the rays: x, y or z (default)");
  add_common(app, words);
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

InputOptions input_options(const Words& words, Reader& reader) {
  InputOptions input;
  input.files = words.files;
  reader.take(parse_choice("--reader", words.reader, kReaderWords), input.reader);
  reader.take(parse_choice("--input-format", words.input_format, kMeshFormatWords), input.format);
  reader.take(read_scene_options(words.csg.scene, input));
  return input;
}

namespace {

GridRequest grid_request(const Words& words, Reader& reader) {
  GridRequest grid;
  const int sizes =
      int{!words.resolution.empty()} + int{!words.voxel_size.empty()} + int{!words.grid.empty()};
  if (sizes != 1) {
    reader.fail_with(fmt::format("{} of -r, --voxel-size and --grid; exactly one decides the size",
                                 sizes == 0   ? "none"
                                 : sizes == 2 ? "two"
                                              : "all"));
    return grid;
  }
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
        reader.fail_with(fmt::format("--grid takes nx,ny,nz, not '{}'", words.grid));
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
  return grid;
}

/// --fog and what else says what a voxel of the file is.
void read_values(const Words& words, VoxelizeCommand& command, Reader& reader) {
  constexpr std::int64_t kFogSamples = 4, kMostFogSamples = 16;
  command.ids = words.ids;
  command.mask = words.mask;
  if (!words.name.empty()) command.name = words.name;
  if (std::any_of(words.name.begin(), words.name.end(),
                  [](unsigned char letter) { return letter < ' ' || letter == 0x7f; })) {
    reader.fail_with("--name must be text without control characters");
  }
  if (!words.fog.empty()) {
    command.fog_by_default = words.fog == "auto";
    std::int64_t samples = command.surface ? 1 : kFogSamples;
    if (!command.fog_by_default) reader.take(parse_integer("--fog", words.fog), samples);
    if (samples < 1 || samples > kMostFogSamples) {
      reader.fail_with(fmt::format("--fog must be 1 to {}, got {}", kMostFogSamples, samples));
    }
    if (command.surface && samples > 1) {
      reader.fail_with("--fog=N with N > 1 is the filled fraction of solids; --surface has none");
    }
    command.fog = static_cast<int>(samples);
  }
  const char* fog_or_mask = command.fog != 0 ? "--fog" : "--mask";
  if (command.ids && (command.surface || command.fog != 0 || command.mask)) {
    reader.fail_with(fmt::format("--ids are of solids; {} has none",
                                 command.surface ? "--surface" : fog_or_mask));
  }
  if (command.fog != 0 && command.mask) {
    reader.fail_with("--fog has numbers, --mask has none; give one of them");
  }
  const bool named = command.name.has_value();
  if (command.output.empty() && (command.fog != 0 || command.mask || named)) {
    reader.fail_with(fmt::format("{} needs -o", named ? "--name" : fog_or_mask));
  }
}

VoxelizeCommand voxelize_command(const Words& words, Reader& reader) {
  VoxelizeCommand command;
  command.common = common_options(words, reader);
  command.list_formats = words.list_formats;
  if (command.list_formats) return command;
  command.input = input_options(words, reader);
  command.output = words.output;
  command.format = words.format;
  command.surface = !words.surface.empty();
  command.solid = words.solid || !command.surface;
  if (command.surface) {
    reader.take(parse_choice("--surface", words.surface, kSurfaceKindWords), command.surface_kind);
  }
  reader.take(parse_choice("--rule", words.rule, kRuleWords), command.rule);
  reader.take(parse_choice("--open", words.open, kOpenModeWords), command.open);
  reader.take(parse_choice("--axis", words.axis, kAxisWords), command.axis);
  reader.take(parse_choice("--store", words.store, kStoreWords), command.store);
  reader.take(parse_choice("--offsets", words.offsets, kOffsetWords), command.offsets);
  reader.take(parse_choice("--backend", words.backend, kBackendWords), command.backend);
  command.keep_orientation = words.keep_orientation;
  command.stats = words.stats;
  command.checksum = words.checksum;
  command.dry_run = words.dry_run;
  if (!words.json.empty()) command.json = words.json;
  if (command.input.files.empty()) reader.fail_with("no mesh file and no scene is given");
  command.grid = grid_request(words, reader);
  read_values(words, command, reader);
  if (command.backend == Backend::kGl && !command.solid) {
    reader.fail_with("--backend gl makes depth lists; --surface alone has none and is the CPU's");
  }
  if (command.output.empty() && !words.format.empty()) reader.fail_with("--format needs -o");
  if (command.output.empty() && !command.stats && !command.json && !command.checksum &&
      !command.dry_run) {
    reader.fail_with("nothing to do: give -o FILE, --stats, --json or --checksum");
  }
  return command;
}

InfoCommand info_command(const Words& words, Reader& reader) {
  InfoCommand command;
  command.common = common_options(words, reader);
  command.input = input_options(words, reader);
  command.gl = words.gl;
  if (!words.json.empty()) command.json = words.json;
  if (command.input.files.empty() && !command.gl)
    reader.fail_with("no mesh file and no scene is given");
  return command;
}

LdiCommand ldi_command(const Words& words, Reader& reader) {
  LdiCommand command;
  command.common = common_options(words, reader);
  command.input = input_options(words, reader);
  command.output = words.output;
  command.samples = words.samples;
  command.keep_orientation = words.keep_orientation;
  std::optional<Axis> axis;
  reader.take(parse_choice("--axis", words.axis, kAxisWords), axis);
  command.axis = axis.value_or(Axis::kZ);
  reader.take(parse_choice("--store", words.store, kStoreWords), command.store);
  reader.take(parse_choice("--offsets", words.offsets, kOffsetWords), command.offsets);
  reader.take(parse_choice("--backend", words.backend, kBackendWords), command.backend);
  if (command.input.files.empty()) reader.fail_with("no mesh file and no scene is given");
  if (command.output.empty())
    reader.fail_with("no output is given: -o FILE.exr, FILE.npz or FILE.png");
  command.grid = grid_request(words, reader);
  return command;
}

ParseOutcome usage_error(std::string_view command, std::string_view message) {
  return {fmt::format("strata: error: {}\nstrata: see strata {}{}--help\n",
                      printable_lines(message), command, command.empty() ? "" : " "),
          true, static_cast<int>(ErrorCode::kUsage)};
}

/// Whether a command line is one of openscad: no command, but a file, or options and a scene.
bool begins_with_a_file(const std::vector<std::string>& words) {
  const std::string& first = words.front();
  for (const char* command : {"voxelize", "info", "ldi", "csg"}) {
    if (first == command) return false;
  }
  if (first.starts_with('-')) return std::any_of(words.begin(), words.end(), is_scene_name);
  std::error_code ignored;
  return is_scene_name(first) || mesh_format_of(first) != MeshFormat::kAuto ||
         std::filesystem::is_regular_file(first, ignored);
}

}  // namespace

Command parse_command_line(int argc, const char* const* argv) {
  if (argc < 2) return ParseOutcome{kTopHelp, true, static_cast<int>(ErrorCode::kUsage)};
  std::string_view name = argv[1];
  int first = 2;
  if (name == "-h" || name == "--help" || name == "help") {
    return ParseOutcome{std::string(kTopHelp) + kExitCodes, false, 0};
  }
  if (name == "-V" || name == "--version") {
    return ParseOutcome{"strata " STRATA_VERSION "\n", false, 0};
  }
  if (begins_with_a_file({argv + 1, argv + argc})) {
    name = "csg";
    first = 1;
  }
  // Only the options of the command asked for are built: that is most of the time CLI11 takes.
  Words words;
  CLI::App app("", "strata " + std::string(name));
  app.get_formatter()->column_width(26);
  if (name == "voxelize") {
    define_voxelize(app, words);
  } else if (name == "info") {
    define_info(app, words);
  } else if (name == "ldi") {
    define_ldi(app, words);
  } else if (name == "csg") {
    define_csg(app, words);
  } else {
    return usage_error("", name.starts_with('-')
                               ? fmt::format("no such option: {}; the command comes first", name)
                               : fmt::format("no such command: {}", name));
  }
  app.footer("strata --help lists the exit codes.");
  try {
    std::vector<std::string> arguments(argv + first, argv + argc);
    if (const auto mistake = empty_value(arguments); !mistake.empty()) {
      return usage_error(name, mistake);
    }
    std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them from the back
    app.parse(std::move(arguments));
  } catch (const CLI::CallForHelp&) {
    return ParseOutcome{app.help(), false, 0};
  } catch (const CLI::ParseError& error) {
    return usage_error(name, error.what());
  }
  Reader reader;
  Command command;
  if (name == "voxelize") command = voxelize_command(words, reader);
  if (name == "info") command = info_command(words, reader);
  if (name == "ldi") command = ldi_command(words, reader);
  if (name == "csg") command = csg_command(words, reader);
  if (reader.error()) return usage_error(name, reader.error()->message);
  return command;
}

}  // namespace strata::apps
