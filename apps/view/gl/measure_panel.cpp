#include <fmt/core.h>
#include <imgui.h>

#include <algorithm>
#include <string>

#include "apps/view/gl/panel_items.h"
#include "apps/view/gl/panels.h"

// The panel that measures.

namespace strata::view {

void Panels::measure(Viewer& viewer) {
  struct Button {
    const char* label;
    Tool tool;
    const char* keys;
  };
  constexpr Button kTools[] = {
      {"Distance", Tool::kDistance, "between two picks; m"},
      {"Angle", Tool::kAngle, "of two faces; a"},
      {"Radius", Tool::kRadius, "of a cylinder, sphere or circle; r"},
      {"Wall", Tool::kThickness, "thickness along the normal and along the ray; w"},
      {"Size", Tool::kSize, "size and volume of a solid; v"}};
  MeasureBoard& board = viewer.board();
  const float third = share(3);
  int column = 0;
  for (const Button& one : kTools) {
    if (column++ % 3 != 0) ImGui::SameLine();
    if (toggle(one.label, board.tool() == one.tool, third)) viewer.take_up(one.tool);
    hint(one.keys);
  }
  ImGui::SameLine();
  if (ImGui::Button("Clear", {third, 0})) board.clear();
  hint("remove all measurements; escape");
  const float fourth = share(4);
  const auto guide = [&](const char* label, bool& shown, const char* keys) {
    if (toggle(label, shown, fourth)) shown = !shown;
    hint(keys);
  };
  guide("Box", board.box, "around the result; b");
  ImGui::SameLine();
  guide("Grid", board.grid, "of the plane z = 0; shift+g");
  ImGui::SameLine();
  guide("Scale", board.scale_bar, "a bar of a round length; shift+b");
  ImGui::SameLine();
  guide("Ticks", board.ticks, "axes with numbers; ctrl+3");
  constexpr std::size_t kShown = 4;
  const auto& done = board.done();
  ImGui::PushTextWrapPos(0.0f);
  for (std::size_t i = done.size() - std::min(done.size(), kShown); i < done.size(); ++i) {
    text(fmt::format("{}: {}", facts_of(done[i].tool).name, done[i].text));
  }
  ImGui::PopTextWrapPos();
}

void Panels::heat_range(Viewer& viewer) {
  if (viewer.heat() != Heat::kWall && viewer.heat() != Heat::kThickness) return;
  const Frame* frame = viewer.frame();
  const auto& given = viewer.heat_range();
  double ends[2] = {given              ? given->x
                    : frame != nullptr ? frame->scale.low
                                       : 0.0,
                    given              ? given->y
                    : frame != nullptr ? frame->scale.high
                                       : 0.0};
  const float gap = ImGui::GetStyle().ItemSpacing.x;
  const float auto_width = share(4);
  ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x - auto_width - gap);
  const bool changed = ImGui::InputScalarN("##range", ImGuiDataType_Double, ends, 2, nullptr,
                                           nullptr, "%.4g", ImGuiInputTextFlags_EnterReturnsTrue);
  hint("the thicknesses of the first and the last colour");
  if (changed && ends[0] >= 0.0 && ends[1] > ends[0]) {
    viewer.set_heat_range(glm::dvec2(ends[0], ends[1]));
  }
  ImGui::SameLine();
  if (toggle("Auto", !given, auto_width)) viewer.set_heat_range({});
  hint("from the 2nd to the 98th percentile of the picture");
}

}  // namespace strata::view
