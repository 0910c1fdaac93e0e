#include <algorithm>
#include <utility>

#include "apps/session/json_writer.h"
#include "apps/view/script_runner.h"

// Commands of scripts about files, parameters, and what the window tells.

namespace strata::view {

Result<bool> ScriptRunner::done_loading(const Viewer& viewer) {
  if (!viewer.loaded()) return false;
  loads_seen_ = viewer.loads();
  if (loads_seen_ == loads_before_ || viewer.load_error().empty()) return true;
  return fail(viewer.load_error_code(), "{}", viewer.load_error());
}

namespace {

Result<void> set_parameter(const ScriptCommand& command, Viewer& viewer) {
  const auto& all = viewer.parameters();
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const Parameter& one) { return one.name == command.word; });
  if (found == all.end()) {
    return fail(ErrorCode::kUsage, "there is no parameter '{}'", command.word);
  }
  auto value = parse_value(*found, command.value);
  if (!value) return tl::unexpected(value.error());
  viewer.set_parameter(*found, *std::move(value));
  return {};
}

Result<void> change_parameters(const ScriptCommand& command, Viewer& viewer) {
  if (command.word == "load") return viewer.load_parameters(command.value, command.more);
  if (command.word == "save") return viewer.save_parameters(command.value, command.more);
  viewer.reset_parameters();
  return {};
}

Result<void> change_tab(const ScriptCommand& command, Viewer& viewer) {
  if (command.word == "next" || command.word == "previous") {
    viewer.next_tab(command.word == "next" ? 1 : -1);
  } else if (command.word == "close") {
    viewer.close_tab(viewer.tab());
  } else if (command.numbers[0] > static_cast<double>(viewer.tabs().size())) {
    return fail(ErrorCode::kUsage, "tab must be 1 to {}, got {}", viewer.tabs().size(),
                command.word);
  } else {
    viewer.show_tab(static_cast<std::size_t>(command.numbers[0]) - 1);
  }
  return {};
}

}  // namespace

Result<void> ScriptRunner::window(const ScriptCommand& command, Viewer& viewer) {
  switch (command.action) {
    case Action::kUndo:
      viewer.undo();
      return {};
    case Action::kRedo:
      viewer.redo();
      return {};
    case Action::kMaterial:
      viewer.set_material(*find_material(command.word));
      return {};
    case Action::kLook:
      viewer.light_look = command.word == "light";
      return {};
    case Action::kKeys:
      viewer.show_keys = command.on;
      return {};
    case Action::kScroll:
      viewer.scroll({command.numbers[0], command.numbers[1]}, glm::dvec2(viewer.viewport()) * 0.5,
                    command.word == "shift");
      return {};
    default:
      return fail(ErrorCode::kInternal, "unknown command");
  }
}

bool ScriptRunner::is_of_document(Action action) {
  switch (action) {
    case Action::kOpen:
    case Action::kTab:
    case Action::kParameter:
    case Action::kParameters:
    case Action::kNumbers:
    case Action::kEdit:
    case Action::kConsole:
    case Action::kMessages:
    case Action::kDialog:
      return true;
    default:
      return false;
  }
}

Result<bool> ScriptRunner::document(const ScriptCommand& command, Viewer& viewer, Stage& stage) {
  const auto done = [](const Result<void>& result) -> Result<bool> {
    if (!result) return tl::unexpected(result.error());
    return true;
  };
  // What is read or laid out anew takes another turn.
  const auto begin = [](const Result<void>& result) -> Result<bool> {
    if (!result) return tl::unexpected(result.error());
    return false;
  };
  switch (command.action) {
    case Action::kOpen:
      if (begun_) return done_loading(viewer);
      viewer.open_files({command.word});
      return false;
    case Action::kTab:
      if (begun_) return done_loading(viewer);
      return begin(change_tab(command, viewer));
    case Action::kParameter:
      if (begun_) return done_loading(viewer);
      return begin(set_parameter(command, viewer));
    case Action::kParameters:
      if (begun_) return done_loading(viewer);
      return begin(change_parameters(command, viewer));
    case Action::kNumbers:
      if (viewer.model() == nullptr) return fail(ErrorCode::kUsage, "nothing is loaded");
      if (viewer.measuring_waits()) viewer.measure_now();
      if (!begun_ || viewer.measuring() || !viewer.numbers()) return false;
      if (!*viewer.numbers()) return tl::unexpected(viewer.numbers()->error());
      stage.print(numbers_json(viewer));
      return true;
    case Action::kEdit: {
      const auto place = viewer.picked_place();
      if (!place) return fail(ErrorCode::kUsage, "no solid with a place in a file is picked");
      return done(viewer.edit(*place));
    }
    case Action::kConsole:
      viewer.show_console = command.on;
      return begun_;  // the picture gets another size
    case Action::kDialog:
      viewer.dialog = command.word == "off" ? std::nullopt : std::optional(command.word);
      return begun_;
    case Action::kMessages:
      for (const ConsoleLine& line : viewer.console()) stage.print(line.text);
      return true;
    default:
      return fail(ErrorCode::kInternal, "unknown command");
  }
}

std::string numbers_json(const Viewer& viewer) {
  const PartNumbers& numbers = **viewer.numbers();
  apps::JsonWriter json(apps::JsonWriter::Layout::kOneLine);
  json.begin_object();
  json.member("empty", numbers.empty);
  for (const auto& [name, value] :
       {std::pair("size_x", numbers.size.x), std::pair("size_y", numbers.size.y),
        std::pair("size_z", numbers.size.z), std::pair("volume", numbers.volume)}) {
    json.member(name, value);
  }
  if (viewer.model()->voxels) {
    json.member("voxels", numbers.voxels);
  } else {
    json.member("area", numbers.area);
    json.member("open_holes", numbers.open_holes);
    json.member("triangles", viewer.model()->triangles);
  }
  json.member("material", viewer.material().name);
  json.member("weight_g", weight_of(numbers, viewer.material()));
  json.end_object();
  std::string text = json.take();
  text.pop_back();  // the line's end is the stage's
  return text;
}

}  // namespace strata::view
