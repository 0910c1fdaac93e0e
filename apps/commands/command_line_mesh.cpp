// `strata mesh` on the command line.

#include <CLI/App.hpp>

#include <filesystem>
#include <vector>

#include "apps/commands/choice_words.h"
#include "apps/commands/command_words.h"
#include "apps/commands/scene_options.h"
#include "apps/session/file_conflicts.h"
#include "apps/session/help.h"
#include "apps/session/option_values.h"

namespace strata::apps {
namespace {

constexpr const char* kMeshExamples =
    R"(Write the boundary of a Boolean tree as a mesh: a scene, a union, an expression.

  strata mesh plate.csg -o plate.3mf            for a slicer, in millimetres
  strata mesh a.stl b.stl --expr 'a - b' -o c.stl
  strata mesh part.scad -D 'width=40' -o wide.stl           set a variable
  strata mesh part.csg --colours -o part.3mf    each face in its solid's colour
  strata mesh part.csg --ids -o part.obj        a group of faces for each solid
  strata mesh scan.ply --method contour -r 512 -o solid.ply
  strata mesh plate.csg --json                  the report alone

The mesh is closed, each edge has two triangles, and no two triangles meet but
in common edges and vertices. The file appears only after this was checked at
the positions that are written.

The exact method moves all vertices once to a fine lattice. From then on it is
exact, and two trees that are the same set give the same bytes. The contour is
made of depth lists on a grid of -r voxels, for meshes that are not closed.
)";

constexpr std::pair<std::string_view, csg::OpenSolids> kExactOpenWords[] = {
    {"cap", csg::OpenSolids::kCap}, {"fail", csg::OpenSolids::kFail}};
constexpr std::pair<std::string_view, OpenMode> kContourOpenWords[] = {{"vote", OpenMode::kVote},
                                                                       {"fail", OpenMode::kFail}};

constexpr int kLeastBits = 10, kMostBits = 28;

/// The output and what only some formats hold.
void read_output(const Words& words, MeshCommand& command, Reader& reader) {
  command.output = words.output;
  if (!words.json.empty()) command.json = words.json;
  if (command.output.empty()) {
    refuse_bare_outputs(
        words.files,
        [](const std::string& file) { return solid_format_of(file) != SolidFormat::kAuto; },
        reader);
    if (!command.json) reader.fail_with("nothing to do: give -o FILE or --json");
    for (const auto& [given, name] :
         {std::pair(!words.format.empty(), "--format"), std::pair(words.ids, "--ids"),
          std::pair(words.mesh.colours, "--colours")}) {
      if (given) reader.fail_with(fmt::format("{} needs -o", name));
    }
    return;
  }
  if (!words.format.empty()) {
    reader.take(parse_choice("--format", words.format, kSolidFormatWords), command.format);
  } else {
    command.format = solid_format_of(command.output);
    if (command.format == SolidFormat::kAuto) {
      reader.fail_with(fmt::format(
          "{}: meshes are written as .3mf, .stl, .obj, .ply or .off; --format chooses for other "
          "names{}",
          command.output, other_writer(command.output)));
    }
  }
  const bool in_parts = words.ids || words.mesh.colours;
  const char* option = words.ids ? "--ids" : "--colours";
  if (words.ids && words.mesh.colours) {
    reader.fail_with("--ids and --colours cannot be combined; --ids has the solids' colours too");
  }
  if (in_parts && command.format == SolidFormat::kStl) {
    reader.fail_with(fmt::format("{} cannot be written as STL, which holds no parts", option));
  }
  if (!in_parts || command.format != SolidFormat::kObj) return;
  if (is_stream(command.output)) {
    reader.fail_with(fmt::format(
        "{} needs an OBJ file with a name, since its colours are a second file, .mtl", option));
  }
  command.materials = std::filesystem::path(command.output).replace_extension(".mtl").string();
}

void read_exact(const Words& words, MeshCommand& command, Reader& reader) {
  csg::BoundaryOptions& options = command.boundary;
  const MeshWords& mesh = words.mesh;
  if (!words.resolution.empty()) reader.fail_with("-r needs --method contour");
  if (!words.voxel_size.empty()) reader.fail_with("--voxel-size needs --method contour");
  if (mesh.open == "vote") {
    reader.fail_with("--open vote needs --method contour, which winding numbers can decide");
  }
  if (!mesh.open.empty()) {
    reader.take(parse_choice("--open", mesh.open, kExactOpenWords), options.open);
  }
  if (!mesh.faces.empty()) {
    reader.take(parse_choice("--faces", mesh.faces, kFaceKindWords), options.faces);
  }
  if (!mesh.bits.empty()) {
    std::int64_t bits = options.bits;
    reader.take(parse_integer("--bits", mesh.bits), bits);
    if (bits < kLeastBits || bits > kMostBits) {
      reader.fail_with(fmt::format("--bits must be {} to {}, got {}", kLeastBits, kMostBits, bits));
    }
    options.bits = static_cast<int>(bits);
  }
  if (mesh.colours) options.parts = csg::BoundaryParts::kColours;
  if (words.ids) options.parts = csg::BoundaryParts::kSolids;
  options.float_positions = command.format == SolidFormat::kStl;
}

void read_contour(const Words& words, MeshCommand& command, Reader& reader) {
  const MeshWords& mesh = words.mesh;
  for (const auto& [given, name] :
       {std::pair(!mesh.bits.empty(), "--bits"), std::pair(!mesh.faces.empty(), "--faces"),
        std::pair(words.ids, "--ids"), std::pair(mesh.colours, "--colours")}) {
    if (given) reader.fail_with(fmt::format("{} needs --method exact", name));
  }
  if (mesh.open == "cap") reader.fail_with("--open cap needs --method exact");
  if (!mesh.open.empty()) {
    reader.take(parse_choice("--open", mesh.open, kContourOpenWords), command.open);
  }
  if (!words.resolution.empty() && !words.voxel_size.empty()) {
    return reader.fail_with("only one of -r and --voxel-size can be given, got both");
  }
  if (words.resolution.empty() && words.voxel_size.empty()) {
    command.grid.resolution = kDefaultResolution;
    return;
  }
  if (!words.resolution.empty()) {
    reader.take(parse_integer("--resolution", words.resolution), command.grid.resolution);
    return refuse_impossible(command.grid, reader);
  }
  std::vector<double> numbers;
  reader.take(parse_numbers("--voxel-size", words.voxel_size, 1, 3), numbers);
  if (reader.error()) return;
  numbers.resize(3, numbers[0]);
  command.grid.voxel_size = glm::dvec3(numbers[0], numbers[1], numbers[2]);
  refuse_impossible(command.grid, reader);
}

}  // namespace

void define_mesh(CLI::App& app, Words& words) {
  app.description(kMeshExamples);
  define_picture_input(app, words);
  MeshWords& mesh = words.mesh;
  const auto option = [&app](const char* names, std::string& word, const char* what,
                             const std::string& value, const char* group) {
    app.add_option(names, word, what)->type_name(value)->group(group);
  };
  const char* output = "Output";
  option("-o,--output", words.output,
         "Mesh to write: .3mf, .stl, .obj, .ply or .off; - for "
         "standard output",
         "FILE", output);
  option("--format", words.format, "Format of the output (default: by the file's name)",
         choices(kSolidFormatWords), output);
  app.add_flag(
         "--colours,--colors", mesh.colours,
         "Give each face the colour of the solid or of the face of a mesh that it comes from: "
         "not in STL; an OBJ gets a second file, .mtl")
      ->group(output);
  app.add_flag(
         "--ids", words.ids,
         "Make a part for each solid, or for each part of a mesh file: an object of a 3MF where "
         "it is closed by itself, a group of an OBJ, a number in a PLY; with colours as "
         "--colours")
      ->group(output);
  add_json(app, words, output);
  const char* surface = "Surface";
  option("--method", mesh.method,
         "The exact boundary of the tree, or a contour of its depth lists (default: exact)",
         choices(kMeshMethodWords), surface);
  option("--faces", mesh.faces,
         "Faces as large as they can be, which depend on the set alone, or the pieces of the "
         "input's triangles (default: canonical)",
         choices(kFaceKindWords), surface);
  option("--bits", mesh.bits,
         "Lattice steps along the longest side of the result, 2^N, 10 to 28 (default: 26)", "N",
         surface);
  option("-r,--resolution", words.resolution,
         "With --method contour: voxels along the longest side of the input, 1 to 65536 (default: "
         "256)",
         "N", surface);
  option("--voxel-size", words.voxel_size,
         "With --method contour: length of a voxel, or three along x, y, z", "S|SX,SY,SZ", surface);
  option("--open", mesh.open,
         "Meshes with holes: cap closes each hole by triangles (default), vote lets winding "
         "numbers decide (default and only with --method contour), fail ends the command",
         "cap|vote|fail", surface);
  add_common(app, words);
  option("--reader", words.reader, "Mesh reader: Strata's own or OpenMesh's (default: own)",
         choices(kReaderWords), kDeveloperGroup);
  define_scene_options(app, words.csg.scene);
}

MeshCommand mesh_command(const Words& words, Reader& reader) {
  MeshCommand command;
  command.common = common_options(words, reader);
  command.input = input_options(words, true, reader);
  reader.take(parse_choice("--rule", words.rule, kRuleWords), command.input.rule);
  command.input.keep_orientation = words.keep_orientation;
  command.input.expression = words.csg.expression;
  if (command.input.files.empty()) reader.fail_with("no input file is given");
  reader.take(parse_choice("--method", words.mesh.method, kMeshMethodWords), command.method);
  read_output(words, command, reader);
  if (command.method == MeshMethod::kExact) {
    read_exact(words, command, reader);
  } else {
    read_contour(words, command, reader);
  }
  return command;
}

}  // namespace strata::apps
