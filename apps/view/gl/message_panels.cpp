#include <fmt/core.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "apps/view/gl/panel_items.h"
#include "apps/view/gl/panels.h"
#include "core/printable.h"

// The status bar, and what is told on the picture.

namespace strata::view {

void Panels::status(const Viewer& viewer, const glm::ivec2& window) {
  const float height = kStatusHeight * scale_;
  ImGui::SetNextWindowPos({0, static_cast<float>(window.y) - height});
  ImGui::SetNextWindowSize({static_cast<float>(window.x), height});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding,
                      {8 * scale_, (height - ImGui::GetFontSize()) / 2});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, {1, 1});
  ImGui::Begin("status", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoInputs |
                   ImGuiWindowFlags_NoBringToFrontOnFocus);
  const auto& files = viewer.options().command.input.files;
  std::string left = files.empty() ? std::string() : files.front();
  if (files.size() > 1) left += fmt::format(" and {} more", files.size() - 1);
  const Camera& c = viewer.camera();
  if (!files.empty()) {
    left += fmt::format("     rotation {:.0f}, {:.0f}, {:.0f}   distance {:.4g}", c.rotation.x,
                        c.rotation.y, c.rotation.z, c.distance);
  }
  const bool whole = viewer.frame() != nullptr && viewer.frame()->divisor == 1;
  const std::string state = viewer.loading()    ? "loading"
                            : !viewer.settled() ? (whole ? "drawing" : "coarse")
                                                : "";
  const std::string drawn =
      viewer.drawn_by().empty() ? std::string() : fmt::format("drawn by {}, ", viewer.drawn_by());
  const std::string right =
      fmt::format("{}{}{}shown by {}", state, state.empty() ? "" : "   ", drawn, gl_renderer_);
  if (side_width(window) == 0) left = "The panels need a wider window.     " + left;
  text(left);
  const float width = ImGui::CalcTextSize(right.c_str()).x;
  const float left_end = ImGui::CalcTextSize(left.c_str()).x + 24 * scale_;
  const float begin = static_cast<float>(window.x) - width - 10 * scale_;
  if (begin > left_end) {
    ImGui::SameLine(begin);
    faint(right);
  }
  ImGui::End();
  ImGui::PopStyleVar(2);
}

/// A bar for what cannot tell how far it is.
void Panels::waiting(double seconds) const {
  const ImVec2 at = ImGui::GetCursorScreenPos(), size(260 * scale_, ImGui::GetFrameHeight());
  const auto part = static_cast<float>(0.5 - 0.5 * std::cos(seconds * 2.5));
  const float width = size.x * 0.25f, left = at.x + part * (size.x - width);
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddRectFilled(at, {at.x + size.x, at.y + size.y}, ImGui::GetColorU32(ImGuiCol_FrameBg), 3);
  list->AddRectFilled({left, at.y}, {left + width, at.y + size.y},
                      ImGui::GetColorU32(ImGuiCol_PlotHistogram), 3);
  ImGui::Dummy(size);
}

namespace {

constexpr ImGuiWindowFlags kBox =
    ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_AlwaysAutoResize |
    ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing;

ImVec2 place(const Area& area, double x, double y) {
  return {static_cast<float>(area.at.x) + static_cast<float>(x),
          static_cast<float>(area.at.y) + static_cast<float>(y)};
}

}  // namespace

/// Errors of loading and drawing, or the warnings of the scene.
void Panels::trouble(Viewer& viewer, const Area& area) {
  std::string errors = viewer.load_error();
  if (!errors.empty() && !viewer.draw_error().empty()) errors += '\n';
  errors += viewer.draw_error();
  const bool wrong = !errors.empty();
  std::vector<std::string> lines;
  if (viewer.model() != nullptr && hidden_warnings_ != viewer.loads() && !viewer.show_console) {
    lines = viewer.model()->warnings;
  }
  constexpr std::size_t kMostLines = 4;
  if (lines.size() > kMostLines) {
    const std::size_t more = lines.size() - (kMostLines - 1);
    lines.resize(kMostLines - 1);
    lines.push_back(fmt::format("and {} more", counted(more, "warning")));
  }
  if (!wrong && (!viewer.show_panels || lines.empty())) return;
  const float wrap = std::max(80 * scale_, static_cast<float>(area.size.x) - 48 * scale_);
  ImGui::SetNextWindowPos(place(area, 12 * scale_, 12 * scale_));
  ImGui::PushStyleColor(ImGuiCol_WindowBg, wrong ? ImVec4(0.45f, 0.07f, 0.07f, 0.95f)
                                                 : ImVec4(0.36f, 0.27f, 0.05f, 0.93f));
  // The same in both looks: light on dark.
  ImGui::PushStyleColor(ImGuiCol_Text, ImVec4(0.97f, 0.97f, 0.97f, 1));
  ImGui::PushStyleColor(ImGuiCol_TextDisabled, ImVec4(0.85f, 0.82f, 0.8f, 1));
  ImGui::PushStyleColor(ImGuiCol_Button, ImVec4(1, 1, 1, 0.15f));
  ImGui::Begin("trouble", nullptr, kBox);
  ImGui::PushTextWrapPos(wrap);
  if (wrong) {
    text(errors);
    if (viewer.model() != nullptr) faint("The window shows what was there before.");
    if (ImGui::SmallButton("Copy")) ImGui::SetClipboardText(errors.c_str());
    ImGui::SameLine();
    if (ImGui::SmallButton("Hide")) viewer.forget_errors();
  } else {
    for (const std::string& line : lines) text(line);
    if (ImGui::SmallButton("Hide warnings")) hidden_warnings_ = viewer.loads();
    ImGui::SameLine();
    if (ImGui::SmallButton("Console")) viewer.show_console = true;
  }
  ImGui::PopTextWrapPos();
  ImGui::End();
  ImGui::PopStyleColor(4);
}

/// A box with the progress of loading.
void Panels::loading(Viewer& viewer, const Area& area) {
  const ImVec2 middle = place(area, area.size.x / 2.0, area.size.y / 2.0);
  ImGui::SetNextWindowPos(middle, 0, {0.5f, 0.5f});
  ImGui::Begin("loading", nullptr, kBox);
  text(fmt::format("Reading {} ... {:.0f} s", viewer.loading_name(), viewer.load_seconds()));
  const double progress = viewer.load_progress();
  if (progress > 0) {
    ImGui::ProgressBar(static_cast<float>(progress), {260 * scale_, 0});
  } else {
    waiting(viewer.load_seconds());
  }
  ImGui::SameLine();
  if (ImGui::Button("Cancel")) viewer.cancel_load();
  ImGui::End();
}

void Panels::messages(Viewer& viewer, const Area& area) {
  trouble(viewer, area);
  const double width = area.size.x, height = area.size.y;
  const ImVec2 middle = place(area, width / 2, height / 2);
  const bool whole = viewer.frame() != nullptr && viewer.frame()->divisor == 1;
  if (whole && viewer.frame()->report.covered == 0 && !viewer.loading()) {
    ImGui::SetNextWindowPos(middle, 0, {0.5f, 0.5f});
    ImGui::Begin("empty", nullptr, kBox | ImGuiWindowFlags_NoInputs);
    text(viewer.model() != nullptr && viewer.model()->box.empty()
             ? "This scene is empty."
             : "Nothing is in view. Press f to show everything.");
    ImGui::End();
  }
  if (viewer.loading() && viewer.load_seconds() > 0.25) loading(viewer, area);
  if (!told_.empty() && Viewer::Clock::now() - told_at_ < std::chrono::seconds(4)) {
    ImGui::SetNextWindowPos(place(area, width / 2, height - 14 * scale_), 0, {0.5f, 1.0f});
    ImGui::Begin("told", nullptr, kBox | ImGuiWindowFlags_NoInputs);
    text(told_);
    ImGui::End();
  }
}

}  // namespace strata::view
