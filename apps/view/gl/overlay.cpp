#include <fmt/core.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include "apps/view/gl/panels.h"

// What lies on the picture: axes, the section's handle, the mark of a pick, the legend.

namespace strata::view {
namespace {

ImVec2 to_window(const Area& area, const glm::dvec2& pixel) {
  return {static_cast<float>(area.at.x + pixel.x), static_cast<float>(area.at.y + pixel.y)};
}

/// Text that can be read on any ground.
void outlined(ImDrawList* list, const ImVec2& at, ImU32 colour, const std::string& words) {
  const ImU32 shade = IM_COL32(0, 0, 0, 170);
  for (const ImVec2 by : {ImVec2(1, 0), ImVec2(-1, 0), ImVec2(0, 1), ImVec2(0, -1)}) {
    list->AddText({at.x + by.x, at.y + by.y}, shade, words.c_str());
  }
  list->AddText(at, colour, words.c_str());
}

/// A line with a dark rim.
void rimmed(ImDrawList* list, const ImVec2& from, const ImVec2& to, ImU32 colour, float width) {
  list->AddLine(from, to, IM_COL32(0, 0, 0, 150), width + 2);
  list->AddLine(from, to, colour, width);
}

}  // namespace

void Panels::axes(const Viewer& viewer, const Area& area) {
  const glm::dmat3 eye(eye_from_world(viewer.camera()));
  struct Axis {
    glm::dvec3 in_eye;
    ImU32 colour;
    const char* name;
  };
  Axis all[] = {{eye[0], IM_COL32(230, 60, 60, 255), "x"},
                {eye[1], IM_COL32(60, 190, 70, 255), "y"},
                {eye[2], IM_COL32(80, 130, 255, 255), "z"}};
  // The one that points at the eye is drawn last.
  std::sort(std::begin(all), std::end(all),
            [](const Axis& a, const Axis& b) { return a.in_eye.z < b.in_eye.z; });
  const double length = 34.0 * scale_;
  const glm::dvec2 middle(52.0 * scale_, area.size.y - 52.0 * scale_);
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  for (const Axis& axis : all) {
    const glm::dvec2 by(axis.in_eye.x, -axis.in_eye.y);
    const ImVec2 tip = to_window(area, middle + by * length);
    rimmed(list, to_window(area, middle), tip, axis.colour, 2.5f * scale_);
    const float half = ImGui::GetFontSize() / 2;
    const ImVec2 label = to_window(area, middle + by * (length + 11.0 * scale_));
    outlined(list, {label.x - half / 2, label.y - half}, axis.colour, axis.name);
  }
}

void Panels::handle(const Viewer& viewer, const Area& area) {
  const auto handle = viewer.section_handle();
  if (!handle) return;
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const ImU32 colour = IM_COL32(255, 170, 30, 255);
  const ImVec2 at = to_window(area, handle->at), tip = to_window(area, handle->tip);
  rimmed(list, at, tip, colour, 3 * scale_);
  const glm::dvec2 along = handle->tip - handle->at;
  const double length = glm::length(along);
  if (length > 6) {
    const glm::dvec2 a = along / length * (10.0 * scale_), b(-a.y * 0.55, a.x * 0.55);
    list->AddTriangleFilled(to_window(area, handle->tip + a), to_window(area, handle->tip + b),
                            to_window(area, handle->tip - b), colour);
  }
  list->AddCircleFilled(at, 7 * scale_, IM_COL32(0, 0, 0, 150));
  list->AddCircleFilled(at, 5.5f * scale_, colour);
}

void Panels::mark(const Viewer& viewer, const Area& area) {
  const auto& picked = viewer.picked();
  if (!picked || !picked->hit) return;
  const auto pixel = project(viewer.camera(), viewer.viewport(), picked->where);
  if (!pixel || pixel->x < 0 || pixel->y < 0 || pixel->x > area.size.x || pixel->y > area.size.y) {
    return;
  }
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const ImVec2 at = to_window(area, *pixel);
  list->AddCircle(at, 6 * scale_, IM_COL32(0, 0, 0, 200), 0, 4 * scale_);
  list->AddCircle(at, 6 * scale_, IM_COL32(255, 255, 255, 255), 0, 2 * scale_);
  const bool mapped = viewer.heat() == Heat::kWall || viewer.heat() == Heat::kThickness;
  if (picked->thickness && mapped) {
    outlined(list, {at.x + 12 * scale_, at.y - ImGui::GetFontSize() / 2},
             IM_COL32(255, 255, 255, 255), fmt::format("{:.4g}", *picked->thickness));
  }
}

void Panels::legend(const Viewer& viewer, const Area& area) {
  const HeatScale& scale = viewer.frame()->scale;
  if (scale.heat == Heat::kOff || !(scale.high > 0)) return;
  constexpr int kSteps = 48;
  const float width = 18 * scale_,
              height = std::min(220 * scale_, static_cast<float>(area.size.y) * 0.5f);
  const float left = static_cast<float>(area.at.x + area.size.x) - 172 * scale_;
  const float top = static_cast<float>(area.at.y) + 44 * scale_;
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  list->AddRectFilled({left - 8 * scale_, top - 34 * scale_},
                      {left + 162 * scale_, top + height + 14 * scale_}, IM_COL32(20, 22, 26, 225),
                      4 * scale_);
  list->AddText({left, top - 26 * scale_}, IM_COL32(255, 255, 255, 255),
                scale.heat == Heat::kThickness ? "thickness along the ray"
                : scale.heat == Heat::kWall    ? "thickness along the normal"
                : scale.heat == Heat::kError   ? "difference from exact"
                                               : "crossings");
  for (int i = 0; i < kSteps; ++i) {
    const csg::Rgba colour = heat_colour(1.0 - (i + 0.5) / kSteps);
    const float y = top + height * static_cast<float>(i) / kSteps;
    list->AddRectFilled({left, y}, {left + width, y + height / kSteps + 1},
                        IM_COL32(colour.r, colour.g, colour.b, 255));
  }
  // Crossings are counted in whole numbers.
  int marks = 4;
  if (scale.heat == Heat::kDepth) {
    const int high = static_cast<int>(scale.high);
    marks = 1;
    for (const int count : {5, 3, 4, 2}) {
      if (high % count == 0 && marks == 1) marks = count;
    }
  }
  for (int i = 0; i <= marks; ++i) {
    const auto part = static_cast<float>(i) / static_cast<float>(marks);
    const double value = scale.low + (scale.high - scale.low) * (1.0 - double{part});
    const float y = top + height * part;
    const char* beyond = i == 0 && scale.above ? "> " : i == marks && scale.below ? "< " : "";
    list->AddLine({left + width, y}, {left + width + 4 * scale_, y}, IM_COL32(255, 255, 255, 255));
    list->AddText({left + width + 8 * scale_, y - ImGui::GetFontSize() / 2},
                  IM_COL32(255, 255, 255, 255), fmt::format("{}{:.4g}", beyond, value).c_str());
  }
}

}  // namespace strata::view
