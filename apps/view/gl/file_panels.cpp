#include <fmt/core.h>
#include <imgui.h>

#include <filesystem>
#include <string>

#include "apps/view/gl/panel_items.h"
#include "apps/view/gl/panels.h"
#include "core/printable.h"

// What opens files: the first row of the panel, the tabs, and the window without a file.

namespace strata::view {

/// A menu of the files that were opened last.
void Panels::recent(Viewer& viewer) {
  const auto files = recent_files(viewer.folders());
  if (files.empty()) faint("no file was opened before");
  for (const std::string& file : files) {
    if (ImGui::Selectable(std::filesystem::path(file).filename().string().c_str())) {
      viewer.open_files({file});
    }
    hint(file.c_str());
  }
}

void Panels::files(Viewer& viewer) {
  const float third = share(3), fifth = share(5);
  if (ImGui::Button("Open ...", {third, 0})) viewer.key("ctrl+o");
  hint("ctrl+o; or drop files into the window");
  ImGui::SameLine();
  if (ImGui::Button("Recent", {third, 0})) ImGui::OpenPopup("recent");
  if (ImGui::BeginPopup("recent")) {
    recent(viewer);
    ImGui::EndPopup();
  }
  ImGui::SameLine();
  ImGui::BeginDisabled(viewer.model() == nullptr);
  if (ImGui::Button("Export ...", {third, 0})) ImGui::OpenPopup("export");
  ImGui::EndDisabled();
  hint("write a mesh, voxels, slices or a picture of what is seen");
  ImGui::SetNextWindowSize({330 * scale_, 0});
  if (ImGui::BeginPopup("export")) {
    exports(viewer);
    ImGui::EndPopup();
  }
  const auto step = [&](const char* name, bool can, const char* keys, const char* what) {
    ImGui::BeginDisabled(!can);
    if (ImGui::Button(name, {fifth, 0})) viewer.key(keys);
    ImGui::EndDisabled();
    hint(what);
    ImGui::SameLine();
  };
  step("Undo", viewer.history().can_undo(), "ctrl+z",
       "camera, section, slice and hidden solids; ctrl+z");
  step("Redo", viewer.history().can_redo(), "ctrl+shift+z", "ctrl+shift+z");
  const std::size_t lines = viewer.console().size();
  const std::string label =
      lines == 0 ? "Console###console" : fmt::format("Console ({})###console", lines);
  if (toggle(label.c_str(), viewer.show_console, 2 * fifth + ImGui::GetStyle().ItemSpacing.x))
    viewer.key("c");
  hint("console: warnings and what programs print; c");
  ImGui::SameLine();
  if (toggle("Keys", viewer.show_keys, fifth)) viewer.key("?");
  hint("all keys; ? or F1");
}

void Panels::tab_bar(Viewer& viewer, const Area& area) {
  const float height = static_cast<float>(tabs_height(viewer));
  if (height < 1) return;
  ImGui::SetNextWindowPos({0, 0});
  ImGui::SetNextWindowSize({static_cast<float>(area.size.x), height});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {6 * scale_, 3 * scale_});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, {1, 1});
  ImGui::Begin("tabs", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus);
  std::size_t wanted = viewer.tab(), closed = viewer.tabs().size();
  if (ImGui::BeginTabBar("files", ImGuiTabBarFlags_FittingPolicyScroll |
                                      ImGuiTabBarFlags_NoCloseWithMiddleMouseButton)) {
    for (std::size_t i = 0; i < viewer.tabs().size(); ++i) {
      const Tab& tab = viewer.tabs()[i];
      bool stays = true;
      // ImGui follows the viewer when the tab was changed by a key.
      const bool follow = i == viewer.tab() && drawn_tab_ != i;
      ImGui::PushID(static_cast<int>(i));
      if (ImGui::BeginTabItem(fmt::format("{}###tab", tab.title).c_str(), &stays,
                              follow ? ImGuiTabItemFlags_SetSelected : 0)) {
        if (drawn_tab_ == viewer.tab()) wanted = i;
        ImGui::EndTabItem();
      }
      ImGui::PopID();
      if (!stays) closed = i;
    }
    ImGui::EndTabBar();
  }
  ImGui::End();
  ImGui::PopStyleVar(2);
  drawn_tab_ = viewer.tab();
  if (closed < viewer.tabs().size()) {
    viewer.close_tab(closed);
    drawn_tab_ = viewer.tabs().size();
  } else if (wanted != viewer.tab()) {
    viewer.show_tab(wanted);
    drawn_tab_ = wanted;
  }
}

/// What to do in a window without a file.
void Panels::start(Viewer& viewer, const Area& area) {
  if (!viewer.tabs().empty() || viewer.loading() || viewer.dialog || viewer.show_keys) return;
  ImGui::SetNextWindowPos({static_cast<float>(area.at.x) + static_cast<float>(area.size.x) / 2,
                           static_cast<float>(area.at.y) + static_cast<float>(area.size.y) / 2},
                          0, {0.5f, 0.5f});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {20 * scale_, 16 * scale_});
  ImGui::Begin("start", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoFocusOnAppearing);
  text("Drop a scene, a mesh or a file of voxels into this window, or press ctrl+o to open one.");
  faint("Scenes: .csg, .scad (needs openscad). Meshes: .obj .stl .ply .off .3mf .amf .gltf .glb.");
  faint("Voxels: .vdb .npy .npz .nrrd .vti .binvox .vox. Keys: F1.");
  ImGui::Dummy({0, 6 * scale_});
  if (ImGui::Button("Open ...", {140 * scale_, 0})) viewer.key("ctrl+o");
  const auto files = recent_files(viewer.folders());
  if (!files.empty()) {
    ImGui::Dummy({0, 6 * scale_});
    faint("Opened before");
    recent(viewer);
  }
  ImGui::End();
  ImGui::PopStyleVar();
}

}  // namespace strata::view
