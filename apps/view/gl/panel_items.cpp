#include "apps/view/gl/panel_items.h"

#include <imgui.h>

namespace strata::view {

void text(const std::string& words) {
  ImGui::TextUnformatted(words.data(), words.data() + words.size());
}
void faint(const std::string& words) {
  ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
  text(words);
  ImGui::PopStyleColor();
}
void row(const char* what, const std::string& value) {
  ImGui::TableNextRow();
  ImGui::TableNextColumn();
  faint(what);
  ImGui::TableNextColumn();
  text(value);
}

bool toggle(const char* label, bool on, float width) {
  if (on) ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_ButtonActive));
  const bool pressed = ImGui::Button(label, {width, 0});
  if (on) ImGui::PopStyleColor();
  return pressed;
}

void hint(const char* words) {
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", words);
}

float share(int count) {
  const float gap = ImGui::GetStyle().ItemSpacing.x * static_cast<float>(count - 1);
  return (ImGui::GetContentRegionAvail().x - gap) / static_cast<float>(count);
}

}  // namespace strata::view
