// The only file of the window that knows CLI11.
#include "apps/view/view_options.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <utility>

#include "apps/strata/choice_words.h"
#include "apps/strata/csg_options.h"
#include "apps/strata/file_conflicts.h"
#include "apps/strata/option_values.h"
#include "apps/strata/scene_options.h"
#include "apps/view/script.h"
#include "apps/view/viewer.h"

namespace strata::view {
namespace {

constexpr const char* kExamples =
    R"(A window on a scene, on meshes united, on an expression over them.

  strata view plate.csg                     turn, cut, pick, measure
  strata view part.scad --watch             drawn again whenever the file is saved
  strata view plate.stl holes.stl --expr 'plate - holes' --ghosts
  strata view part.csg --screenshot part.png --script tour.txt     without a person
)";

constexpr std::pair<std::string_view, Heat> kHeats[] = {
    {"off", Heat::kOff}, {"thickness", Heat::kThickness}, {"depth", Heat::kDepth}};

struct Words {
  std::vector<std::string> files;
  std::string rule = "winding", format = "auto", heat = "off", backend = "auto", threads;
  bool no_panels = false;
  apps::CsgWords csg;
};

void define(CLI::App& app, Words& words, ViewOptions& options) {
  apps::CsgWords& csg = words.csg;
  const auto option = [&app](const char* names, std::string& word, const char* what,
                             const char* type, const char* group) {
    app.add_option(names, word, what)->type_name(type)->group(group);
  };
  app.add_option("INPUT", words.files, "Scenes (.csg .scad), meshes (.obj .stl .ply .off)")
      ->type_name("");
  const char* input = "Input";
  option("--expr", csg.expression, "What is shown, such as 'a - b'; else all inputs united", "EXPR",
         input);
  option("--input-format", words.format, "csg, obj, stl, ply or off, whatever the name is",
         "FORMAT", input);
  option("--rule", words.rule, "Inside of meshes: winding (> 0, default), nonzero, parity (odd)",
         "RULE", input);
  app.add_flag("--keep-orientation", options.command.keep_orientation,
               "Do not turn meshes around that are inside out")
      ->group(input);
  app.add_flag("--watch", options.watch, "Read again what changes on the disk; the camera stays")
      ->group(input);
  const char* look = "Look";
  option("--size", csg.size, "width,height of the window in pixels; 1280,800", "W,H", look);
  option("--camera", csg.camera, "x,y,z,rx,ry,rz,distance or eye x,y,z, target x,y,z", "NUMBERS",
         look);
  option("--projection", csg.projection, "p(erspective, default) or o(rtho)", "P", look);
  option("--colorscheme", csg.scheme, "Cornfield (default) or another of OpenSCAD's", "NAME", look);
  app.add_option("--cut", csg.cuts, "Section: x=5 (cuts what is nearer), z<10 or nx,ny,nz,d")
      ->type_name("PLANE")
      ->expected(1)
      ->group(look);
  app.add_flag("--edges", csg.edges, "Dark lines along the edges of faces")->group(look);
  app.add_flag("--ghosts", options.ghosts, "Show what is subtracted, transparent")->group(look);
  option("--heat", words.heat, "Colours: off (the scene's, default), thickness, depth (complexity)",
         "MAP", look);
  apps::define_scene_options(app, csg.scene);
  app.add_flag("--no-panels", words.no_panels, "The picture alone")->group(look);
  const char* drive = "Without a person";
  option("--screenshot", options.screenshot, "When all is drawn, a picture of the window; then end",
         "FILE.png", drive);
  option("--script", options.script, "Commands, one a line (below); - for standard input", "FILE",
         drive);
  option("--backend", words.backend, "Who finds surfaces: cpu, gl (OpenGL 4.5) or auto", "B",
         "Running");
  option("-j,--threads", words.threads, "Threads; 0 (default): one a processor", "N", "Running");
}

std::string footer() {
  return "keys and mouse:\n" + key_help() + "\ncommands of a script:\n" + script_help() +
         "\nstrata --help lists the exit codes.";
}

Result<void> read(Words& words, ViewOptions& options) {
  apps::CsgCommand& command = options.command;
  command.scene_format = words.format == "csg";
  if (command.scene_format) words.format = "auto";
  command.input.files = words.files;
  auto format = apps::parse_choice("--input-format", words.format, apps::kMeshFormatWords);
  if (!format) return tl::unexpected(format.error());
  command.input.format = *format;
  auto rule = apps::parse_choice("--rule", words.rule, apps::kRuleWords);
  if (!rule) return tl::unexpected(rule.error());
  command.rule = *rule;
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
      return fail(ErrorCode::kUsage, "a window reads files, which it can read again; not -");
    }
  }
  if (words.csg.size.empty()) words.csg.size = "1280,800";
  command.output = "window.png";  // strata csg asks for some output
  if (auto done = apps::read_scene_options(words.csg.scene, command.input); !done) return done;
  if (auto done = apps::read_csg_options(words.csg, command); !done) return done;
  command.output.clear();
  if (options.screenshot.empty()) return {};
  return apps::check_picture_name("--screenshot ", options.screenshot);
}

}  // namespace

std::variant<apps::ParseOutcome, ViewOptions> parse_view_options(int argc,
                                                                 const char* const* argv) {
  Words words;
  ViewOptions options;
  CLI::App app(kExamples, "strata view");
  app.get_formatter()->column_width(26);
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
    return apps::ParseOutcome{app.help(), false, 0};
  } catch (const CLI::ParseError& error) {
    return mistake(error.what());
  }
  if (auto done = read(words, options); !done) return mistake(done.error().message);
  return options;
}

Result<void> check_files(ViewOptions& options, const std::vector<ScriptCommand>& commands) {
  std::vector<apps::FileUse> written;
  for (const ScriptCommand& command : commands) {
    if (command.action != Action::kScreenshot && command.action != Action::kPicture) continue;
    written.push_back(
        {fmt::format("{}:{}: {}", options.script == "-" ? "standard input" : options.script,
                     command.line, command.action == Action::kPicture ? "picture" : "screenshot"),
         command.word});
  }
  if (!options.screenshot.empty()) written.push_back({"--screenshot", options.screenshot});
  std::vector<apps::FileUse> read = apps::inputs_of(options.command.input);
  if (!options.script.empty()) read.push_back({"--script", options.script});
  options.command.outputs = written;
  return apps::check_files(read, written);
}

}  // namespace strata::view
