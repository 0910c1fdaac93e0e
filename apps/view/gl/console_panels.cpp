#include <fmt/core.h>
#include <imgui.h>

#include <algorithm>
#include <string>
#include <vector>

#include "apps/view/gl/panel_items.h"
#include "apps/view/gl/panels.h"
#include "core/printable.h"

// The console, and the overlay of all keys.

namespace strata::view {
namespace {

std::string summary_of(const std::vector<ConsoleLine>& lines) {
  using Kind = ConsoleLine::Kind;
  std::string text;
  for (const auto& [kind, noun] :
       {std::pair(Kind::kError, "error"), std::pair(Kind::kWarning, "warning"),
        std::pair(Kind::kEcho, "echo"), std::pair(Kind::kNote, "note")}) {
    const std::size_t count = count_of(lines, kind);
    if (count == 0) continue;
    if (!text.empty()) text += ", ";
    text += kind == Kind::kEcho ? fmt::format("{} printed", counted(count, "line"))
                                : counted(count, noun);
  }
  return text.empty() ? "nothing was said" : text;
}

ImVec4 colour_of(ConsoleLine::Kind kind, bool light) {
  switch (kind) {
    case ConsoleLine::Kind::kError:
      return light ? ImVec4(0.75f, 0.05f, 0.05f, 1) : ImVec4(1.0f, 0.5f, 0.45f, 1);
    case ConsoleLine::Kind::kWarning:
      return light ? ImVec4(0.55f, 0.36f, 0.0f, 1) : ImVec4(1.0f, 0.8f, 0.4f, 1);
    default:
      return ImGui::GetStyleColorVec4(ImGuiCol_Text);
  }
}

}  // namespace

void Panels::console(Viewer& viewer, const Area& area) {
  const float height = static_cast<float>(console_height(viewer));
  if (height < 1) return;
  ImGui::SetNextWindowPos(
      {static_cast<float>(area.at.x), static_cast<float>(area.at.y + area.size.y)});
  ImGui::SetNextWindowSize({static_cast<float>(area.size.x), height});
  ImGui::Begin("console", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBringToFrontOnFocus);
  const auto& lines = viewer.console();
  ImGui::AlignTextToFramePadding();
  faint(summary_of(lines));
  ImGui::SameLine(ImGui::GetContentRegionMax().x - 150 * scale_);
  if (ImGui::Button("Copy", {70 * scale_, 0})) ImGui::SetClipboardText(text_of(lines).c_str());
  ImGui::SameLine();
  if (ImGui::Button("Close", {70 * scale_, 0})) viewer.show_console = false;
  ImGui::BeginChild("lines");
  ImGuiListClipper clipper;
  clipper.Begin(static_cast<int>(lines.size()));
  while (clipper.Step()) {
    for (int i = clipper.DisplayStart; i < clipper.DisplayEnd; ++i) {
      const ConsoleLine& line = lines[static_cast<std::size_t>(i)];
      ImGui::PushID(i);
      ImGui::PushStyleColor(ImGuiCol_Text, colour_of(line.kind, viewer.light_look));
      if (line.place && viewer.can_edit()) {
        if (ImGui::Selectable(line.text.c_str())) open_editor(viewer, *line.place);
        hint("open in the editor");
      } else {
        text(line.text);
      }
      ImGui::PopStyleColor();
      ImGui::PopID();
    }
  }
  ImGui::EndChild();
  ImGui::End();
}

void Panels::open_editor(const Viewer& viewer, const TextPlace& place) {
  if (auto opened = viewer.edit(place); !opened) tell(opened.error().message);
}

void Panels::keys(Viewer& viewer, const glm::ivec2& window) const {
  if (!viewer.show_keys) return;
  const std::vector<KeyHelp> all = key_list();
  const ImVec2 screen(static_cast<float>(window.x), static_cast<float>(window.y));
  ImGui::SetNextWindowPos({screen.x / 2, screen.y / 2}, 0, {0.5f, 0.5f});
  ImGui::SetNextWindowSizeConstraints({100, 60}, {screen.x * 0.96f, screen.y * 0.94f});
  bool stays = true;
  ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 1.0f);
  ImGui::Begin("Mouse and keys", &stays,
               ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_HorizontalScrollbar);
  const float line = ImGui::GetTextLineHeightWithSpacing();
  const auto fit = static_cast<std::size_t>(std::max(8.0f, screen.y * 0.84f / line));
  const auto most = static_cast<std::size_t>(std::clamp(screen.x / (420 * scale_), 1.0f, 3.0f));
  const std::size_t least = std::min<std::size_t>(screen.x > 1000 * scale_ ? 2 : 1, most);
  const std::size_t columns = std::clamp((all.size() + fit - 1) / fit, least, most);
  const std::size_t rows = (all.size() + columns - 1) / columns;
  if (ImGui::BeginTable("keys", static_cast<int>(columns) * 2, ImGuiTableFlags_SizingFixedFit)) {
    for (std::size_t r = 0; r < rows; ++r) {
      ImGui::TableNextRow();
      for (std::size_t c = 0; c < columns; ++c) {
        ImGui::TableNextColumn();
        const std::size_t i = c * rows + r;
        if (i < all.size()) text(std::string(all[i].name));
        ImGui::TableNextColumn();
        if (i < all.size()) faint(std::string(all[i].what) + "    ");
      }
    }
    ImGui::EndTable();
  }
  ImGui::End();
  ImGui::PopStyleVar();
  if (!stays) viewer.show_keys = false;
}

}  // namespace strata::view
