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

}  // namespace

void add_option(CLI::App& app, const char* group, const char* names, std::string& word,
                const std::string& value, const char* what) {
  app.add_option(names, word, what)->type_name(value)->group(group);
}

void add_flag(CLI::App& app, const char* group, const char* names, bool& target, const char* what) {
  app.add_flag(names, target, what)->type_name("")->group(group);
}

void add_flag(CLI::App& app, const char* group, const char* names, std::string& target,
              const char* what, const std::string& value) {
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
  add_option(
      app, group, "--input-format", words.input_format, choices(kMeshFormatWords),
      "Format of standard input, or of every file where standard input is not read (default: "
      "auto, by name and content)");
  add_option(app, kDeveloperGroup, "--reader", words.reader, choices(kReaderWords),
             "Mesh reader: Strata's own or OpenMesh's (default: own)");
  define_scene_options(app, words.csg.scene);
}

void add_common(CLI::App& app, Words& words) {
  const char* group = "Running";
  add_option(app, group, "-j,--threads", words.threads, "N",
             "Number of threads, 0 to 4096; 0 means one per processor (default: 0)");
  add_option(
      app, group, "--memory-limit", words.memory_limit, "SIZE",
      "Largest amount of memory to use, in bytes or with K, M, G or T: 512M, 2G (default: three "
      "quarters of "
      "the machine's or container's)");
  add_option(app, group, "--time-limit", words.time_limit, "SECONDS",
             "Stop after this time, without output and with exit code 6 (default: no limit)");
  add_flag(app, group, "--strict,--hardwarnings", words.strict,
           "Treat warnings as errors, with exit code 5");
  add_flag(app, group, "-q,--quiet", words.quiet, "Print errors only");
  add_flag(app, group, "-v,--verbose", words.verbose, "Also print each file read and each step");
  add_option(app, group, "--progress", words.progress, choices(kProgressWords),
             "Progress bar on standard error (default: auto, on terminals only)");
}

void add_json(CLI::App& app, Words& words, const char* group) {
  add_flag(app, group, "--json{-}", words.json,
           "Write a report for programs to FILE (default: to standard output)", "[=FILE]");
}

void add_backend(CLI::App& app, Words& words, const char* group) {
  add_option(
      app, group, "--backend", words.backend, choices(kBackendWords),
      "Processor for the depth lists: cpu, gl (OpenGL 4.5), or auto, which is a hardware GPU if "
      "there is one, else the CPU (default: auto); the result is the same");
}

void add_stores(CLI::App& app, Words& words) {
  add_option(app, kDeveloperGroup, "--store", words.store, choices(kStoreWords),
             "Store of the depth lists: ha (HA-buffer), scan (count/scan) or auto (default: auto)");
  add_option(app, kDeveloperGroup, "--offsets", words.offsets, choices(kOffsetWords),
             "Probe offsets of the HA-buffer (default: plane-first)");
}

namespace {

void define_info(CLI::App& app, Words& words) {
  app.description(kInfoExamples);
  add_inputs(app, words);
  add_flag(app, "Output", "--check", words.check,
           "Check that each mesh is the boundary of a solid: closed, 2-manifold, no triangles that "
           "meet; "
           "with --strict a mesh that fails ends with exit code 5");
  add_flag(app, "Output", "--gl", words.gl,
           "Report the OpenGL that is found and how it is used; needs no input");
  add_json(app, words, "Output");
  add_common(app, words);
}

void define_ldi(CLI::App& app, Words& words) {
  app.description(kLdiExamples);
  add_inputs(app, words);
  add_flag(app, "Input", "--keep-orientation", words.keep_orientation,
           "Do not reverse meshes that are inside out");
  add_option(app, "Output", "-o,--output", words.output, "FILE",
             "File to write: .exr, .npz, or .png (an X-ray picture)");
  add_flag(app, "Output", "--samples", words.samples,
           "Write one sample for each surface instead of solid intervals");
  add_option(app, "Output", "--axis", words.axis, "x|y|z", "Ray direction (default: z)");
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
  } else if (name == "merge") {
    define_merge(app, words);
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
    {"check", "info"},  {"contour", "mesh"},   {"convert", "mesh"}, {"draw", "csg"},
    {"export", "mesh"}, {"join", "merge"},     {"layers", "ldi"},   {"lists", "ldi"},
    {"measure", "csg"}, {"open", "view"},      {"raster", "ldi"},   {"render", "csg"},
    {"repair", "mesh"}, {"scene", "csg"},      {"show", "view"},    {"slice", "voxelize"},
    {"stats", "info"},  {"transparent", "oit"}};

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

/// A value behind an option whose value is written after '=': `--coverage 4`. It became an input.
void refuse_bare_values(const CLI::App& app, const std::vector<std::string>& arguments,
                        Reader& reader) {
  const auto takes_value = [&](const std::string& word) {
    const CLI::Option* const found = app.get_option_no_throw(word);
    return found != nullptr && found->get_type_name().starts_with("[=");
  };
  std::error_code ignored;
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    const std::string &name = arguments[i - 1], &value = arguments[i];
    if (!name.starts_with("--") || value.starts_with('-') || value.find('.') != value.npos ||
        std::filesystem::exists(value, ignored) || !takes_value(name)) {
      continue;
    }
    reader.fail_with(fmt::format("{}: there is no such file; a value of {} is written {}={}", value,
                                 name, name, value));
  }
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
  const std::vector<std::string> arguments(argv + first, argv + argc);
  try {
    if (const auto mistake = empty_value(arguments); !mistake.empty()) {
      return usage_error(name, mistake);
    }
    // CLI11 takes them from the back.
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::CallForHelp&) {
    return ParseOutcome{help_text(app, false), false, 0};
  } catch (const CLI::CallForAllHelp&) {
    return ParseOutcome{help_text(app, true), false, 0};
  } catch (const CLI::ParseError& error) {
    return usage_error(name, parse_mistake(app, error));
  }
  Reader reader;
  refuse_bare_values(app, arguments, reader);
  Command command;
  if (name == "voxelize") command = voxelize_command(words, reader);
  if (name == "merge") command = merge_command(words, reader);
  if (name == "mesh") command = mesh_command(words, reader);
  if (name == "info") command = info_command(words, reader);
  if (name == "ldi") command = ldi_command(words, reader);
  if (name == "csg") command = csg_command(words, reader);
  if (name == "picture") command = picture_command(words, reader);
  if (name == "oit") command = oit_command(words, reader);
  if (name != "info" && name != "picture" && name != "merge") refuse_voxels(words.files, reader);
  if (reader.error()) return usage_error(name, reader.error()->message);
  if (auto* csg = std::get_if<CsgCommand>(&command)) csg->alone = alone;
  return command;
}

}  // namespace strata::apps
