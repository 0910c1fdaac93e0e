#include "apps/view/script_runner.h"

#include <algorithm>
#include <utility>

#include "apps/commands/csg_options.h"
#include "apps/session/json_writer.h"
#include "core/did_you_mean.h"
#include "strata/raster/camera_file.h"

namespace strata::view {
namespace {

/// Moves of a drag: as often as a mouse reports them, more or less.
constexpr std::chrono::milliseconds kMoveEvery{16};
constexpr int kMoves = 12;

tl::unexpected<Error> no_such_key(std::string_view word) {
  const std::vector<KeyHelp> keys = key_list();
  std::vector<std::string_view> names;
  for (const KeyHelp& key : keys) names.push_back(key.name);
  return fail(ErrorCode::kUsage, "unknown key '{}'{}", word, did_you_mean(word, names));
}

/// Whether a command looks at what is on the screen.
bool looks_at_screen(const ScriptCommand& command) {
  switch (command.action) {
    case Action::kKey:
      return command.word == "ctrl+s";
    case Action::kPick:
    case Action::kClick:
    case Action::kScreenshot:
    case Action::kPicture:
    case Action::kExport:
    case Action::kStats:
      return true;
    default:
      return ScriptRunner::measures(command.action);
  }
}

/// Whether a command is of surfaces or solids, which voxels have none of.
bool is_of_surfaces(const ScriptCommand& command) {
  switch (command.action) {
    case Action::kGhosts:
    case Action::kEdges:
    case Action::kMedia:
      return command.on;
    case Action::kHeat:
    case Action::kOpacity:
      return command.word != "off";
    case Action::kHeatRange:
    case Action::kTechnique:
    case Action::kHide:
    case Action::kShow:
    case Action::kColour:
      return true;
    default:
      return ScriptRunner::measures(command.action);
  }
}

/// Whether a command may come while files are read.
bool runs_while_loading(Action action) {
  return action == Action::kCancel || action == Action::kPrint || action == Action::kQuit ||
         action == Action::kResize || action == Action::kWait;
}

MouseButton button_of(const std::string& word) {
  return word == "left"    ? MouseButton::kLeft
         : word == "right" ? MouseButton::kRight
                           : MouseButton::kMiddle;
}

/// Sets, saves or loads the camera.
Result<void> run_camera(const ScriptCommand& command, Viewer& viewer) {
  Camera camera = viewer.camera();
  if (command.action == Action::kSaveCamera) return write_camera(camera, command.word);
  if (command.action == Action::kLoadCamera) {
    const auto cameras = read_cameras(command.word);
    if (!cameras) return tl::unexpected(cameras.error());
    camera = cameras->front().camera;
  } else if (command.action == Action::kProjection) {
    camera.projection = apps::parse_projection(command.word).value_or(camera.projection);
  } else {
    const auto asked = apps::parse_camera(command.word);
    if (!asked) return tl::unexpected(asked.error());
    camera = *asked;
    camera.projection = viewer.camera().projection;
  }
  viewer.set_camera(camera);
  return {};
}

}  // namespace

Result<void> ScriptRunner::step(Viewer& viewer, Stage& stage) {
  // What commands change is seen by the viewer's next tick.
  acted_ = false;
  while (!ended() && !quit_) {
    const ScriptCommand& command = commands_[next_];
    if (!runs_while_loading(command.action) && !viewer.loaded()) return {};
    if (looks_at_screen(command) && !begun_ && (acted_ || !viewer.settled())) return {};
    if (!begun_) loads_before_ = viewer.loads();
    auto done = run(command, viewer, stage);
    if (!done) {
      Error error = std::move(done.error());
      error.message = fmt::format("{}:{}: {}", name_, command.line, error.message);
      return tl::unexpected(std::move(error));
    }
    begun_ = !*done;
    if (!*done) return {};
    acted_ = true;
    ++next_;
  }
  return {};
}

/// How the scene is seen through.
Result<void> ScriptRunner::see_through(const ScriptCommand& command, Viewer& viewer) {
  SeenThrough how = viewer.see_through().value_or(SeenThrough{});
  if (command.action == Action::kMedia) {
    if (viewer.media() == nullptr) {
      return fail(ErrorCode::kUsage, "there are no media: give --media FILE");
    }
    how.media = command.on ? viewer.media() : nullptr;
  } else if (command.action == Action::kTechnique) {
    how.technique = command.word;
  } else if (!command.numbers.empty()) {
    how.opacity = static_cast<float>(command.numbers[0]);
  }
  viewer.set_see_through(command.word == "off" ? std::nullopt : std::optional(std::move(how)));
  return {};
}

/// What is done at once: the camera, and how the scene is shown.
Result<void> ScriptRunner::apply(const ScriptCommand& command, Viewer& viewer) {
  const auto& n = command.numbers;
  switch (command.action) {
    case Action::kOrbit:
      viewer.orbit_by({n[0], n[1]});
      return {};
    case Action::kPan:
      viewer.pan_by({n[0], n[1]});
      return {};
    case Action::kZoom:
      viewer.zoom_by(n[0], n.size() == 3 ? std::optional(glm::dvec2(n[1], n[2])) : std::nullopt);
      return {};
    case Action::kView:
      viewer.look(command.word);
      return {};
    case Action::kCamera:
    case Action::kSaveCamera:
    case Action::kLoadCamera:
    case Action::kProjection:
      return run_camera(command, viewer);
    case Action::kSection:
      return section(command, viewer);
    case Action::kSlice:
    case Action::kThreshold:
    case Action::kVoxels:
      return voxels(command, viewer);
    case Action::kGhosts: {
      Looks looks = viewer.looks();
      looks.ghosts = command.on;
      viewer.set_looks(std::move(looks));
      return {};
    }
    case Action::kEdges:
      viewer.set_edges(command.on);
      return {};
    case Action::kAxes:
      viewer.show_axes = command.on;
      return {};
    case Action::kHeat:
      viewer.set_heat(command.word == "off"     ? Heat::kOff
                      : command.word == "wall"  ? Heat::kWall
                      : command.word == "depth" ? Heat::kDepth
                                                : Heat::kThickness);
      return {};
    case Action::kHeatRange:
      viewer.set_heat_range(n.empty() ? std::nullopt : std::optional(glm::dvec2(n[0], n[1])));
      return {};
    case Action::kClear:
      viewer.board().clear();
      return {};
    case Action::kOpacity:
    case Action::kTechnique:
    case Action::kMedia:
      return see_through(command, viewer);
    case Action::kScheme:
      viewer.set_scheme(csg::find_colour_scheme(command.word));
      return {};
    case Action::kHide:
    case Action::kShow:
    case Action::kColour:
      return solids(command, viewer);
    case Action::kCancel:
      viewer.cancel_load();
      return {};
    case Action::kResetStats:
      viewer.reset_statistics();
      return {};
    default:
      return window(command, viewer);
  }
}

/// What looks at the screen, or takes several turns; else apply().
Result<bool> ScriptRunner::run(const ScriptCommand& command, Viewer& viewer, Stage& stage) {
  const auto& n = command.numbers;
  const auto done = [](const Result<void>& result) -> Result<bool> {
    if (!result) return tl::unexpected(result.error());
    return true;
  };
  if (viewer.shows_voxels() && is_of_surfaces(command)) {
    return fail(ErrorCode::kUsage,
                "{} needs the surfaces of a mesh or scene, but what is shown is a file of voxels",
                command.name);
  }
  switch (command.action) {
    case Action::kDrag:
      return drag(command, viewer);
    case Action::kClick:
      if (!begun_) {
        viewer.mouse_button(MouseButton::kLeft, true, {n[0], n[1]}, false, false);
        viewer.mouse_button(MouseButton::kLeft, false, {n[0], n[1]}, false, false);
        return false;
      }
      return !viewer.picking();
    case Action::kKey:
      if (begun_) return !viewer.wants_screenshot;
      if (!viewer.key(command.word)) {
        return no_such_key(command.word);
      }
      return !viewer.wants_screenshot;  // else the window's next turn takes it
    case Action::kPanels:
      viewer.show_panels = command.on;
      // The window lays itself out anew, and the picture gets another size.
      if (!begun_) return false;
      return true;
    case Action::kPick:
      if (!begun_) {
        viewer.pick(glm::ivec2(static_cast<int>(n[0]), static_cast<int>(n[1])));
        return false;
      }
      if (viewer.picking()) return false;
      stage.print(fmt::format("pick {:.0f} {:.0f}: {}", n[0], n[1],
                              viewer.picked() ? viewer.describe(*viewer.picked()) : "nothing"));
      return true;
    case Action::kReload:
      if (begun_) return done_loading(viewer);
      viewer.reload();
      return false;
    case Action::kResize:
      if (!begun_) {
        stage.resize({static_cast<int>(n[0]), static_cast<int>(n[1])});
        since_ = Clock::now();
        return false;
      }
      // Window managers take their time.
      return Clock::now() - since_ > std::chrono::milliseconds(100);
    case Action::kWait:
      return wait(command, viewer);
    case Action::kScreenshot:
      return done(stage.screenshot(command.word, false));
    case Action::kPicture:
      return done(stage.screenshot(command.word, true));
    case Action::kExport:
      return export_file(command, viewer, stage);
    case Action::kPrint:
      stage.print(command.word);
      return true;
    case Action::kStats:
      stage.print(statistics_json(viewer));
      return true;
    case Action::kQuit:
      quit_ = true;
      return true;
    default:
      if (is_of_document(command.action)) return document(command, viewer, stage);
      if (measures(command.action)) return measure(command, viewer, stage);
      if (is_guide(command.action)) return guide(command, viewer, stage);
      return done(apply(command, viewer));
  }
}

Result<bool> ScriptRunner::export_file(const ScriptCommand& command, Viewer& viewer, Stage& stage) {
  if (!begun_) {
    const int voxels =
        command.numbers.empty() ? kExportVoxels : static_cast<int>(command.numbers[0]);
    if (auto started = viewer.start_export(command.word, voxels); !started) {
      return tl::unexpected(started.error());
    }
    if (viewer.exporting()) return false;
    viewer.wants_picture.clear();
    auto drawn = stage.screenshot(command.word, true);
    if (!drawn) return tl::unexpected(drawn.error());
    return true;
  }
  if (viewer.exporting()) return false;
  if (!viewer.exported()) return tl::unexpected(viewer.exported().error());
  stage.print("export " + *viewer.exported());
  return true;
}

bool ScriptRunner::drag(const ScriptCommand& command, Viewer& viewer) {
  const auto& n = command.numbers;
  const glm::dvec2 from(n[0], n[1]), to(n[2], n[3]);
  const MouseButton button = button_of(command.word);
  const int moves = n.size() == 5 ? std::max(1, static_cast<int>(n[4])) : kMoves;
  const auto now = Clock::now();
  if (!begun_) {
    viewer.mouse_button(button, true, from, false, false);
    moves_ = 0;
    since_ = now;
    return false;
  }
  if (now - since_ < kMoveEvery) return false;
  since_ = now;
  if (moves_ < moves) {
    ++moves_;
    viewer.mouse_move(from + (to - from) * (static_cast<double>(moves_) / moves));
    return false;
  }
  viewer.mouse_button(button, false, to, false, false);
  return true;
}

bool ScriptRunner::wait(const ScriptCommand& command, const Viewer& viewer) {
  if (!begun_) {
    since_ = Clock::now();
    return false;
  }
  if (!viewer.settled()) return false;
  if (command.word == "reload" && viewer.loads() <= loads_seen_) return false;
  if (!command.numbers.empty()) {
    const std::chrono::duration<double> waited = Clock::now() - since_;
    if (waited.count() < command.numbers.front()) return false;
  }
  // A file that changes before a script comes to wait for it is not missed.
  if (command.word == "reload") loads_seen_ = viewer.loads();
  return true;
}

Result<void> ScriptRunner::section(const ScriptCommand& command, Viewer& viewer) {
  if (command.word == "off") {
    viewer.set_section({});
    return {};
  }
  if (command.word == "flip") {
    viewer.flip_section();
    return {};
  }
  const auto plane = apps::parse_section(command.word);
  if (!plane) return tl::unexpected(plane.error());
  viewer.set_section(*plane);
  return {};
}

Result<void> ScriptRunner::solids(const ScriptCommand& command, Viewer& viewer) {
  if (viewer.model() == nullptr) return fail(ErrorCode::kUsage, "nothing is loaded");
  const auto found = find_solids(*viewer.model(), command.word);
  if (!found) return tl::unexpected(found.error());
  Looks looks = viewer.looks();
  looks.hidden.resize(viewer.model()->scene.tree.solids().size(), 0);
  for (const std::uint32_t solid : *found) {
    if (command.action != Action::kColour) {
      looks.hidden[solid] = command.action == Action::kHide ? 1 : 0;
    } else if (const auto colour = parse_colour(command.value)) {
      looks.colours[solid] = *colour;
    } else {
      looks.colours.erase(solid);
    }
  }
  viewer.set_looks(std::move(looks));
  return {};
}

std::string statistics_json(const Viewer& viewer) {
  const Statistics& s = viewer.statistics();
  const Model* model = viewer.model();
  const std::string& error =
      viewer.load_error().empty() ? viewer.draw_error() : viewer.load_error();
  apps::JsonWriter json(apps::JsonWriter::Layout::kOneLine);
  json.begin_object();
  json.member("renderer", viewer.drawn_by());
  json.member("width", viewer.viewport().x);
  json.member("height", viewer.viewport().y);
  json.member("solids", model != nullptr ? model->scene.tree.solids().size() : 0);
  json.member("triangles", model != nullptr ? model->triangles : 0);
  json.member("load_ms", model != nullptr ? model->load_ms : 0.0, 1);
  json.member("prepare_ms", s.prepare_ms, 2);
  json.member("coarse_ms", s.coarse_ms, 2);
  json.member("divisor", s.divisor);
  json.member("whole_ms", s.whole_ms, 2);
  json.member("smooth_ms", s.smooth_ms, 2);
  json.member("samples", s.samples);
  json.member("whole_latency_ms", s.whole_latency_ms, 1);
  json.member("reaction_ms", s.reaction_ms, 1);
  json.member("largest_reaction_ms", s.largest_reaction_ms, 1);
  json.member("reactions", s.reactions);
  json.member("present_ms", s.present_ms, 2);
  json.member("frames", s.frames);
  json.member("crossings", s.report.fragments);
  json.member("resolved", s.report.resolved);
  json.member("covered", s.report.covered);
  json.member("longest_list", s.longest_list);
  json.member("loads", viewer.loads());
  json.member("error", error);
  json.end_object();
  std::string text = json.take();
  text.pop_back();  // the line's end is the stage's
  return text;
}

}  // namespace strata::view
