// `strata voxelize` on the command line, and the grid, which `strata ldi` takes too.

#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <cmath>

#include "apps/commands/choice_words.h"
#include "apps/commands/command_words.h"
#include "apps/session/help.h"
#include "apps/session/option_values.h"
#include "strata/voxelize/distance/signed_distance.h"
#include "strata/voxelize/formats/voxel_writer.h"

namespace strata::apps {
namespace {

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

constexpr const char* kGridGroup =
    "Grid (one of -r, --voxel-size, --grid, --cubic; default: -r 256)";

}  // namespace

void add_grid(CLI::App& app, Words& words) {
  const char* group = kGridGroup;
  add_option(app, group, "-r,--resolution", words.resolution, "N",
             "Voxels along the longest side of the input, 1 to 65536");
  add_option(app, group, "--voxel-size", words.voxel_size, "S",
             "Side of a voxel in the input's units, or three sides: sx,sy,sz");
  add_option(app, group, "--grid", words.grid, "NX,NY,NZ",
             "Voxels along x, y and z, 1 to 65536 each, stretched to fit the input");
  add_option(app, group, "--cubic", words.cubic, "N",
             "N voxels along x, y and z, padding included; cubic voxels, the input in the middle");
  add_option(app, group, "--bounds", words.bounds, "BOX",
             "Box to cover, x0,y0,z0,x1,y1,z1 in the input's units (default: the input's box)");
  add_option(app, group, "--origin", words.origin, "X,Y,Z",
             "Lower corner of the grid in the input's units (default: that of the box)");
  add_option(app, group, "--padding", words.padding, "N",
             "Empty voxels on each side, in addition to -r but included in --grid (default: 0)");
  add_flag(app, group, "--align", words.align, "Make the origin a multiple of the voxel size");
}

namespace {

void read_bounds(const Words& words, GridRequest& grid, Reader& reader) {
  if (words.bounds.empty()) return;
  std::vector<double> numbers;
  reader.take(parse_numbers("--bounds", words.bounds, 6, 6), numbers);
  if (reader.error()) return;
  Bounds box;
  box.low = {numbers[0], numbers[1], numbers[2]};
  box.high = {numbers[3], numbers[4], numbers[5]};
  grid.bounds = box;
  if (box.low == box.high) {
    reader.fail_with(fmt::format("--bounds must be a box with an extent, got {}", words.bounds));
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (box.low[axis] <= box.high[axis]) continue;
    reader.fail_with(fmt::format("--bounds must have its lower corner first, got {} to {} along {}",
                                 box.low[axis], box.high[axis], "xyz"[axis]));
  }
}

}  // namespace

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
  read_bounds(words, grid, reader);
  if (reader.error()) return grid;
  if (!words.origin.empty()) {
    reader.take(parse_numbers("--origin", words.origin, 3, 3), numbers);
    if (reader.error()) return grid;
    grid.origin = vector();
  }
  if (!words.padding.empty()) {
    reader.take(parse_integer("--padding", words.padding), grid.padding);
  }
  grid.align = words.align;
  refuse_impossible(grid, reader);
  return grid;
}

void refuse_impossible(const GridRequest& grid, Reader& reader) {
  const auto valid = check_grid_request(grid);
  if (!valid && valid.error().code == ErrorCode::kUsage) reader.fail_with(valid.error().message);
}

void define_voxelize(CLI::App& app, Words& words) {
  app.description(kVoxelizeExamples);
  add_inputs(app, words);
  const char* output = "Output";
  add_option(app, output, "-o,--output", words.output, "FILE",
             "File or folder to write; - for standard output");
  add_option(app, output, "--format", words.format, "FORMAT",
             "Format of the output, see --list-formats (default: by the file's name)");
  add_flag(app, output, "--list-formats", words.list_formats, "List the formats and exit");
  add_flag(app, output, "--fog{auto}", words.fog,
           "Write a fog volume to a .vdb: the filled fraction of each voxel, 0 to 1, from NxNxN "
           "samples; N is 1 to 16 (default: 4)",
           "[=N]");
  add_coverage(app, words, output);
  add_flag(app, output, "--mask", words.mask,
           "Write a mask grid to a .vdb: smaller, but fewer programs read it");
  add_flag(app, output, "--ids", words.ids,
           "Label each voxel with its solid or file: 1, 2, ...; --json lists the names");
  add_flag(
      app, output, "--sdf", words.sdf,
      "Write signed distances to the surface, negative inside: a level set in a .vdb, floats in "
      "other formats; the grid gets a padding as wide as the band");
  add_option(
      app, output, "--band", words.band, "N|all",
      "With --sdf: voxels to each side of the surface that have their distance, 0.5 to 1024; "
      "others have the band's (default: 3). all: every voxel has its own, not in a .vdb");
  add_flag(app, output, "--colours,--colors", words.voxel_colours,
           "Give each voxel the colour of the nearest point of the surface: textures, materials, "
           "vertices; in a scene the colour of its solid");
  add_option(
      app, output, "--fill-colour,--fill-color", words.fill_colour, "COLOUR",
      "Colour of what lies deeper in a solid than a voxel: white, #8080ff ... (default: #808080, "
      "in a scene the colour of the solid)");
  add_option(app, output, "--name", words.name, "NAME",
             "Name of the grid in a .vdb, .nrrd or .vti (default: density, ids, surface or solid)");
  add_option(app, output, "--levels", words.levels, "N",
             "Resolutions in an .ome.zarr, each half of the one before (default: 1)");
  add_flag(app, output, "--stats", words.stats, "Print statistics");
  add_json(app, words, output);
  add_flag(app, output, "--checksum", words.checksum,
           "Print a hash of the solid voxels and the grid");
  add_option(app, output, "--shard", words.shard, "I/N",
             "Make the I-th of N parts of the grid, 1/N to N/N, in a folder FILE.shard-I-of-N; "
             "strata merge joins them");
  add_flag(app, output, "--show", words.show, "Open the file in a window, as strata view does");
  add_flag(app, output, "--dry-run", words.dry_run,
           "Print the grid and the memory that the command would take, and exit");
  add_grid(app, words);
  add_option(
      app, kGridGroup, "--like", words.like, "FILE",
      "Take size, spacing, origin and direction of the grid from a voxel file: .nrrd .nhdr .mha "
      ".mhd .nii .nii.gz .h5 .vdb .vti .npz .zarr, .npy with a .npy.json");
  const char* solid = "Solid voxels";
  add_flag(app, solid, "--solid", words.solid, "Voxels whose centre is inside (default)");
  add_flag(app, solid, "--surface{conservative}", words.surface,
           "Voxels of the surface: all it touches, or a 26- or 6-separating shell (default: "
           "conservative); with --solid both",
           "[=" + choices(kSurfaceKindWords) + "]");
  add_option(app, solid, "--rule", words.rule, choices(kRuleWords),
             "Winding numbers that are inside a mesh: above 0, not 0, or odd (default: winding)");
  add_flag(app, solid, "--keep-orientation", words.keep_orientation,
           "Do not reverse meshes that are inside out");
  add_option(
      app, solid, "--open", words.open, choices(kOpenModeWords),
      "Meshes with holes: vote closes holes by caps and winding numbers, surface keeps only the "
      "surface, fail ends the command (default: vote)");
  add_backend(app, words, "Running");
  add_common(app, words);
  add_option(app, kDeveloperGroup, "--axis", words.axis, choices(kAxisWords),
             "Ray direction (default: auto, the format's axis, else the one with fewest rays)");
  add_stores(app, words);
}

namespace {

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

}  // namespace

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
  read_shard(words, command, reader);
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

}  // namespace strata::apps
