#include <fmt/format.h>

#include "apps/view/script_runner.h"

// Commands that measure, and those that show guides and say what they show.

namespace strata::view {
namespace {

Tool tool_of(Action action) {
  switch (action) {
    case Action::kDistance:
      return Tool::kDistance;
    case Action::kAngle:
      return Tool::kAngle;
    case Action::kRadius:
      return Tool::kRadius;
    case Action::kThickness:
      return Tool::kThickness;
    default:
      return Tool::kSize;
  }
}

std::string box_text(const Bounds& box) {
  if (box.empty()) return "nothing is left";
  const double scale = box.longest_side();
  const auto tidied = [&](const glm::dvec3& p) {
    return glm::dvec3(tidy(p.x, scale), tidy(p.y, scale), tidy(p.z, scale)) + 0.0;  // no -0
  };
  const glm::dvec3 size = tidied(box.high - box.low);
  return fmt::format("{} x {} x {}, from {} to {}", number(size.x), number(size.y), number(size.z),
                     numbers(tidied(box.low)), numbers(tidied(box.high)));
}

}  // namespace

bool ScriptRunner::measures(Action action) {
  return action >= Action::kDistance && action <= Action::kSize;
}

bool ScriptRunner::is_guide(Action action) {
  return action >= Action::kBox && action <= Action::kTicks;
}

/// One pick after the other; the line is printed after the last one.
Result<bool> ScriptRunner::measure(const ScriptCommand& command, Viewer& viewer, Stage& stage) {
  const auto& n = command.numbers;
  const ToolFacts& facts = facts_of(tool_of(command.action));
  MeasureBoard& board = viewer.board();
  if (!begun_) {
    board.take_up(facts.tool);
    measured_ = board.completed();
    moves_ = 0;
  } else if (viewer.picking()) {
    return false;
  }
  const auto made = static_cast<std::size_t>(moves_);
  const std::string words = fmt::format("{} {:.6g}", facts.name, fmt::join(n, " "));
  if (made > 0 && board.missed()) {
    const char* what = board.on_section() ? "a section, which is no solid," : "nothing";
    board.take_up(Tool::kNone);
    const double* at = n.data() + 2 * (made - 1);
    stage.print(fmt::format("{}: {} at {:.6g} {:.6g}", words, what, at[0], at[1]));
    return true;
  }
  if (made == facts.picks) {
    board.take_up(Tool::kNone);
    if (board.completed() == measured_) {
      return fail(ErrorCode::kInternal, "{}: {}", words, viewer.draw_error());
    }
    stage.print(fmt::format("{}: {}", words, board.done().back().text));
    return true;
  }
  viewer.measure_at(glm::ivec2(static_cast<int>(n[2 * made]), static_cast<int>(n[2 * made + 1])));
  ++moves_;
  return false;
}

Result<bool> ScriptRunner::guide(const ScriptCommand& command, Viewer& viewer, Stage& stage) {
  MeasureBoard& board = viewer.board();
  if (!begun_) {
    bool& shown = command.action == Action::kBox        ? board.box
                  : command.action == Action::kGrid     ? board.grid
                  : command.action == Action::kScaleBar ? board.scale_bar
                                                        : board.ticks;
    shown = command.on;
    return !command.on;
  }
  if (!viewer.settled()) return false;
  if (viewer.frame() == nullptr) return true;
  const Frame& frame = *viewer.frame();
  const double pixel = world_per_pixel(frame.camera, frame.wanted);
  switch (command.action) {
    case Action::kBox:
      stage.print("box: " + box_text(frame.box));
      return true;
    case Action::kGrid:
      stage.print("grid: spacing " + number(grid_guide(frame.box, pixel).spacing));
      return true;
    case Action::kTicks:
      stage.print("ticks: spacing " + number(ticks_guide(frame.box, pixel).spacing));
      return true;
    default: {
      const ScaleBar bar = scale_bar(pixel);
      const bool perspective = frame.camera.projection == Projection::kPerspective;
      stage.print(fmt::format("scale-bar: {}, {:.1f} pixels{}", number(bar.length), bar.pixels,
                              perspective ? " at the target" : ""));
      return true;
    }
  }
}

}  // namespace strata::view
