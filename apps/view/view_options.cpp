// The only file of the window that knows CLI11.
#include "apps/view/view_options.h"

#include <fmt/core.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <utility>

#include "apps/commands/choice_words.h"
#include "apps/commands/csg_options.h"
#include "apps/commands/file_uses.h"
#include "apps/commands/scene_options.h"
#include "apps/session/file_conflicts.h"
#include "apps/session/help.h"
#include "apps/session/option_values.h"
#include "apps/view/files/editor.h"
#include "apps/view/scene/exporter.h"
#include "apps/view/script.h"
#include "apps/view/viewer.h"

namespace strata::view {
namespace {

constexpr const char* kExamples =
    R"(Show a scene, the union of meshes or an expression over them in a window.

  strata view                           an empty window: drop files into it, or press ctrl+o
  strata view plate.csg                 turn, cut, pick, measure
  strata view part.scad --watch         draw again whenever the file is saved
  strata view plate.stl holes.stl --expr 'plate - holes' --ghosts
  strata view part.csg --screenshot part.png --script tour.txt    unattended
)";

constexpr std::pair<std::string_view, Heat> kHeats[] = {{"off", Heat::kOff},
                                                        {"wall", Heat::kWall},
                                                        {"ray", Heat::kThickness},
                                                        {"thickness", Heat::kThickness},
                                                        {"depth", Heat::kDepth}};

constexpr std::pair<std::string_view, bool> kLooks[] = {{"dark", false}, {"light", true}};

struct Words {
  std::vector<std::string> files;
  std::string rule = "winding", format = "auto", heat = "off", backend = "auto", threads, look;
  bool no_panels = false;
  apps::CsgWords csg;
};

void define(CLI::App& app, Words& words, ViewOptions& options) {
  app.set_version_flag("-V,--version", "strata-view " STRATA_VERSION, "Print the version and exit")
      ->group("Help");
  apps::CsgWords& csg = words.csg;
  const auto option = [&app](const char* names, std::string& word, const char* what,
                             const std::string& value, const char* group) {
    app.add_option(names, word, what)->type_name(value)->group(group);
  };
  const auto flag = [&app](const char* names, bool& target, const char* what, const char* group) {
    app.add_flag(names, target, what)->group(group);
  };
  const char* input = "Input";
  app.add_option("INPUT", words.files,
                 "Scenes (.csg .scad) and meshes (.obj .stl .ply .off .3mf .amf .gltf .glb)")
      ->type_name("")
      ->group(input);
  option("--expr", csg.expression,
         "Boolean expression to show, such as 'a - b' (default: the union of all inputs)", "EXPR",
         input);
  option("--input-format", words.format,
         "Format of every file, whatever its name (default: auto, by name and content)",
         "csg|" + apps::choices(apps::kMeshFormatWords), input);
  option("--rule", words.rule,
         "Winding numbers that are inside a mesh: above 0, not 0, or odd (default: winding)",
         apps::choices(apps::kRuleWords), input);
  flag("--keep-orientation", options.command.input.keep_orientation,
       "Do not reverse meshes that are inside out", input);
  flag("--watch", options.watch, "Load the files again when they change; the camera stays", input);
  const char* look = "Appearance";
  option("--size", csg.size, "Width and height of the window in pixels (default: 1280,800)", "W,H",
         look);
  option("--camera", csg.camera,
         "Target x,y,z, rotation rx,ry,rz in degrees and distance; or eye x,y,z and target x,y,z",
         "NUMBERS", look);
  option("--camera-file", csg.camera_file,
         "Camera as a file, such as the script's save-camera writes; of several the first", "FILE",
         look);
  option("--projection", csg.projection, "Perspective or orthographic (default: p)", "p|o", look);
  option("--colorscheme", csg.scheme,
         "Neutral, or one of OpenSCAD's, with its lights (default: Neutral)", "SCHEME", look);
  app.add_option("--cut", csg.cuts,
                 "Section plane: x=5 removes the half towards the camera, z<10 keeps z below 10, "
                 "nx,ny,nz,d keeps nx*x + ny*y + nz*z below d")
      ->type_name("PLANE")
      ->expected(1)
      ->group(look);
  flag("--edges", csg.edges, "Draw dark lines along the edges of faces", look);
  flag("--ghosts", options.ghosts, "Show subtracted solids, transparent", look);
  option("--heat", words.heat,
         "Colour by the thickness of walls, by that along the ray (ray or thickness) or by depth "
         "complexity instead of the scene's colours (default: off)",
         apps::choices(kHeats), look);
  option("--media", options.media,
         "Light through media inside solids, as FILE (.json) says; the panel Transparency turns it "
         "off and on",
         "FILE", look);
  option("--look", words.look, "Colours of the panels (default: as they were left, else dark)",
         apps::choices(kLooks), look);
  option("--editor", options.editor,
         "Command that opens a scene at a line from the panel Picked; %f is the file, %l the line "
         "(default: $VISUAL or $EDITOR, if it has a window)",
         "COMMAND", look);
  flag("--no-panels", words.no_panels, "Show the picture without panels", look);
  apps::define_scene_options(app, csg.scene);
  const char* drive = "Unattended";
  option("--screenshot", options.screenshot,
         "Write a picture of the window, .png, once everything is drawn, and exit", "FILE", drive);
  option("--script", options.script, "Run the commands of FILE, one a line; - for standard input",
         "FILE", drive);
  const char* running = "Running";
  option(
      "--backend", words.backend,
      "Processor for the visible surface: cpu, gl (OpenGL 4.5), or auto, which is a hardware GPU "
      "if there is one, else the CPU (default: auto); the picture is the same",
      apps::choices(apps::kBackendWords), running);
  option("-j,--threads", words.threads,
         "Number of threads, 0 to 4096; 0 means one per processor (default: 0)", "N", running);
}

std::string footer() {
  return "Keys and mouse:\n" + key_help() + "\nCommands of a script:\n" + script_help() +
         "\n`strata --help` lists the exit codes.";
}

/// Refuses what voxels do not have.
Result<void> check_voxel_looks(const Words& words, const ViewOptions& options) {
  if (words.files.size() != 1 || !is_voxel_file(words.files.front())) return {};
  for (const auto& [option, given] :
       {std::pair("--edges", words.csg.edges), std::pair("--ghosts", options.ghosts),
        std::pair("--heat", options.heat != Heat::kOff),
        std::pair("--media", !options.media.empty()),
        std::pair("--expr", !words.csg.expression.empty())}) {
    if (!given) continue;
    return fail(ErrorCode::kUsage, "{} needs meshes or scenes, but {} is a file of voxels", option,
                words.files.front());
  }
  return {};
}

Result<void> read(Words& words, ViewOptions& options) {
  apps::CsgCommand& command = options.command;
  command.input.scene_format = words.format == "csg";
  if (command.input.scene_format) words.format = "auto";
  command.input.files = words.files;
  auto format = apps::parse_choice("--input-format", words.format, apps::kMeshFormatWords);
  if (!format) return tl::unexpected(format.error());
  command.input.format = *format;
  const bool given = command.input.scene_format || *format != MeshFormat::kAuto;
  const auto stream =
      apps::check_stream_format(words.files, given, "csg, obj, stl, ply, off or glb");
  if (!stream) return stream;
  auto rule = apps::parse_choice("--rule", words.rule, apps::kRuleWords);
  if (!rule) return tl::unexpected(rule.error());
  command.input.rule = *rule;
  auto heat = apps::parse_choice("--heat", words.heat, kHeats);
  if (!heat) return tl::unexpected(heat.error());
  options.heat = *heat;
  options.panels = !words.no_panels;
  auto backend = apps::parse_choice("--backend", words.backend, apps::kBackendWords);
  if (!backend) return tl::unexpected(backend.error());
  options.command.backend = *backend;
  if (!words.threads.empty()) {
    auto threads = apps::parse_integer("--threads", words.threads);
    if (!threads) return tl::unexpected(threads.error());
    if (*threads < 0 || *threads > 4096) {
      return fail(ErrorCode::kUsage, "--threads must be 0 to 4096, got {}", *threads);
    }
    command.common.threads = static_cast<int>(*threads);
  }
  for (const std::string& file : words.files) {
    if (file == "-") {
      return fail(ErrorCode::kUsage, "strata view cannot read standard input; give files");
    }
  }
  if (!words.look.empty()) {
    const auto look = apps::parse_choice("--look", words.look, kLooks);
    if (!look) return tl::unexpected(look.error());
    options.look = words.look;
  }
  if (!options.editor.empty()) {
    const auto command_words = split_command(options.editor);
    if (!command_words) return tl::unexpected(command_words.error());
  }
  options.default_size = words.csg.size.empty();
  if (options.default_size) words.csg.size = "1280,800";
  if (words.csg.samples.empty()) words.csg.samples = "8";
  const bool empty = words.files.empty();
  if (empty && !words.csg.expression.empty()) {
    return fail(ErrorCode::kUsage, "--expr needs input files");
  }
  command.output = "window.png";                     // strata csg asks for some output
  if (empty) command.input.files = {"nothing.csg"};  // and for some input
  if (auto done = apps::read_scene_options(words.csg.scene, command.input); !done) return done;
  if (auto done = apps::read_csg_options(words.csg, command); !done) return done;
  if (auto done = check_voxel_looks(words, options); !done) return done;
  command.output.clear();
  if (empty) command.input.files.clear();
  if (options.screenshot.empty()) return {};
  return apps::check_picture_name("--screenshot ", options.screenshot);
}

}  // namespace

void visit_view_options(const std::function<void(const CLI::App&)>& visit) {
  Words words;
  ViewOptions options;
  CLI::App app(kExamples, "strata view");
  apps::define_help(app);
  define(app, words, options);
  app.footer(footer());
  visit(app);
}

std::variant<apps::ParseOutcome, ViewOptions> parse_view_options(int argc,
                                                                 const char* const* argv) {
  Words words;
  ViewOptions options;
  CLI::App app(kExamples, "strata view");
  apps::define_help(app);
  define(app, words, options);
  const auto mistake = [](std::string_view message) {
    return apps::ParseOutcome{
        fmt::format("strata view: error: {}\nstrata view: see strata view --help\n", message), true,
        static_cast<int>(ErrorCode::kUsage)};
  };
  try {
    std::vector<std::string> arguments(argv + std::min(argc, 1), argv + argc);
    if (const auto empty = apps::empty_value(arguments); !empty.empty()) return mistake(empty);
    std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them from the back
    app.parse(std::move(arguments));
  } catch (const CLI::CallForHelp&) {
    app.footer(footer());
    return apps::ParseOutcome{apps::help_text(app, false), false, 0};
  } catch (const CLI::CallForAllHelp&) {
    app.footer(footer());
    return apps::ParseOutcome{apps::help_text(app, true), false, 0};
  } catch (const CLI::CallForVersion&) {
    return apps::ParseOutcome{"strata-view " STRATA_VERSION "\n", false, 0};
  } catch (const CLI::ParseError& error) {
    return mistake(apps::parse_mistake(app, error));
  }
  if (auto done = read(words, options); !done) return mistake(done.error().message);
  return options;
}

Result<void> check_files(ViewOptions& options, const std::vector<ScriptCommand>& commands) {
  std::vector<apps::FileUse> written;
  for (const ScriptCommand& command : commands) {
    if (command.action == Action::kSaveCamera) {
      written.push_back(
          {fmt::format("{}:{}: save-camera", options.script, command.line), command.word});
      continue;
    }
    const bool exported = command.action == Action::kExport;
    if (!exported && command.action != Action::kScreenshot && command.action != Action::kPicture) {
      continue;
    }
    const std::string asked_by = fmt::format(
        "{}:{}: {}", options.script == "-" ? "standard input" : options.script, command.line,
        exported                             ? "export"
        : command.action == Action::kPicture ? "picture"
                                             : "screenshot");
    if (!exported) written.push_back({asked_by, command.word});
    if (!exported) continue;
    for (std::string& file : export_files(command.word)) {
      written.push_back({asked_by, std::move(file)});
    }
  }
  if (!options.screenshot.empty()) written.push_back({"--screenshot", options.screenshot});
  std::vector<apps::FileUse> read = apps::inputs_of(options.command);
  if (!options.script.empty()) read.push_back({"--script", options.script});
  if (!options.media.empty()) read.push_back({"--media", options.media});
  options.command.outputs = written;
  return apps::check_files(read, written);
}

}  // namespace strata::view
