// `strata picture` on the command line.

#include <CLI/App.hpp>
#include <algorithm>

#include "apps/commands/choice_words.h"
#include "apps/commands/command_words.h"
#include "apps/commands/film_options.h"
#include "apps/session/help.h"
#include "apps/session/option_values.h"

namespace strata::apps {
namespace {

constexpr const char* kPictureExamples =
    R"(Draw a file of voxels; or a scene or meshes, as strata csg does.

  strata picture knot.vdb -o knot.png               from OpenSCAD's direction
  strata picture knot.vdb -o half.png --cut y=0     cut open
  strata picture plate.nrrd -o ids.png --slice z=2  a plane of voxels, flat
  strata picture fog.vdb -o dense.png --threshold 0.8
  strata picture knot.npy -o xray.png --style xray --size 1024,768
  strata picture plate.csg -o plate.png             the same as strata csg

Voxels are read from .vdb, .npy, .npz, .nrrd, .vti, .binvox, .vox, .zarr, slices
and depth lists, whoever wrote them. Each ray finds the first voxel that it
enters: no voxel is drawn alone, so large grids are drawn as fast as small ones.
)";

constexpr const char* kVoxelGroup = "Voxels";

void define_voxels(CLI::App& app, Words& words) {
  const auto option = [&](const char* names, std::string& word, const char* what,
                          const std::string& value) {
    app.add_option(names, word, what)->type_name(value)->group(kVoxelGroup);
  };
  option("--style", words.voxels.style,
         "Blocks with their faces, the same faces lit smoothly, or the length of solid along each "
         "ray (default: auto, blocks where a voxel is 3 pixels wide or more, else smooth)",
         choices(kStyleWords));
  option(
      "--slice", words.voxels.slice,
      "Draw one plane of voxels flat: the one around z=0.5 in the file's units, or k=12 by index; "
      "x, y, z and i, j, k",
      "PLANE");
  option("--colours,--colors", words.voxels.colours,
         "Colours of the file, of a palette by label, or one colour (default: file, which takes "
         "those of the palette for labels without a colour)",
         choices(kVoxelColourWords));
  option("--threshold", words.voxels.threshold,
         "Values above N are solid, of distances those below (default: half of the greatest value, "
         "of distances 0)",
         "N");
  option("--grid", words.grid, "Name of the grid to draw, of a file with several", "NAME");
}

/// x=0.5 or i=12
Result<PictureCommand::Slice> parse_slice(std::string_view text) {
  const auto mistake = [&] {
    return fail(ErrorCode::kUsage, "--slice must be a plane such as z=0.5 or k=12, got '{}'", text);
  };
  PictureCommand::Slice slice;
  if (text.size() < 3 || text[1] != '=') return mistake();
  const std::size_t axis = std::string_view("xyzijk").find(text[0]);
  if (axis == std::string_view::npos) return mistake();
  slice.axis = static_cast<Axis>(axis % 3);
  slice.by_index = axis >= 3;
  if (slice.by_index) {
    const auto index = parse_integer("--slice", text.substr(2));
    if (!index) return mistake();
    slice.at = static_cast<double>(*index);
  } else {
    const auto at = parse_numbers("--slice", text.substr(2), 1, 1);
    if (!at) return mistake();
    slice.at = at->front();
  }
  return slice;
}

void read_voxel_words(const Words& words, PictureCommand& command, Reader& reader) {
  if (!words.voxels.style.empty()) {
    reader.take(parse_choice("--style", words.voxels.style, kStyleWords), command.style);
  }
  if (!words.voxels.colours.empty()) {
    reader.take(parse_choice("--colours", words.voxels.colours, kVoxelColourWords),
                command.colours);
  }
  if (!words.voxels.slice.empty()) reader.take(parse_slice(words.voxels.slice), command.slice);
  if (!words.voxels.threshold.empty()) {
    std::vector<double> numbers;
    reader.take(parse_numbers("--threshold", words.voxels.threshold, 1, 1), numbers);
    if (!numbers.empty()) command.reading.threshold = static_cast<float>(numbers.front());
  }
  command.reading.grid = words.grid;
}

/// The name of the first option that is given but has no meaning for the input, or nothing.
std::string_view meaningless(const Words& words, const PictureCommand& command) {
  if (!command.voxels) {
    if (!words.voxels.style.empty()) return "--style";
    if (!words.voxels.slice.empty()) return "--slice";
    if (!words.voxels.colours.empty()) return "--colours";
    if (!words.voxels.threshold.empty()) return "--threshold";
    return words.grid.empty() ? "" : "--grid";
  }
  if (!words.csg.expression.empty()) return "--expr";
  if (!command.ids.empty()) return "--ids";
  if (!command.depth.empty()) return "--depth";
  if (command.json) return "--json";
  if (command.render) return "--render";
  if (command.frames > 0) return "--animate";
  if (command.measure_resolution) return "--measure";
  if (!command.input.scene.openscad_options.empty()) return "-D, -p and -P";
  if (!words.csg.scene.placement.given().empty()) return words.csg.scene.placement.given();
  return words.csg.summary.empty() ? "" : "--summary";
}

}  // namespace

void define_picture(CLI::App& app, Words& words) {
  define_csg(app, words);
  app.description(kPictureExamples);
  for (CLI::Option* option : app.get_options()) {
    if (option->get_group().starts_with("Output")) option->group("Output");
    if (option->get_positional() && option->get_name(true) == "INPUT") {
      option->description(
          "A file of voxels; or scenes (.csg .scad) and meshes (.obj .stl .ply .off .3mf .amf "
          ".gltf .glb); - "
          "reads standard input");
    }
  }
  define_voxels(app, words);
}

PictureCommand picture_command(Words words, Reader& reader) {
  PictureCommand command;
  const auto& files = words.files;
  const auto voxel_file = std::find_if(files.begin(), files.end(), is_voxel_file);
  command.voxels = voxel_file != files.end();
  if (command.voxels && files.size() > 1) {
    reader.fail_with(fmt::format("{} holds voxels, which are drawn alone, but {} inputs are given",
                                 *voxel_file, files.size()));
  }
  read_voxel_words(words, command, reader);
  static_cast<CsgCommand&>(command) = csg_command(words, reader);
  if (reader.error()) return command;
  if (const std::string_view option = meaningless(words, command); !option.empty()) {
    reader.fail_with(
        command.voxels
            ? fmt::format("{} is for scenes and meshes, but {} holds voxels", option, files.front())
            : fmt::format("{} is for voxels, but {} is not a file of voxels", option,
                          files.front()));
  }
  if (command.slice && writes_film(command)) {
    reader.fail_with("--slice draws one picture, not a film");
  }
  if (command.slice && !command.cuts.empty()) {
    reader.fail_with("--slice draws a plane of voxels, of which --cut takes nothing away");
  }
  if (command.slice && !words.voxels.style.empty()) {
    reader.fail_with("--slice draws a plane of voxels, which has no --style");
  }
  if (command.output.empty()) reader.fail_with("no output is given: give -o FILE.png");
  return command;
}

}  // namespace strata::apps
