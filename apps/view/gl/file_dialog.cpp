#include "apps/view/gl/file_dialog.h"

#include <fmt/core.h>
#include <imgui.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>

#include "apps/session/session.h"
#include "apps/view/gl/panel_items.h"

namespace strata::view {
namespace {

namespace fs = std::filesystem;

/// The folder of what is shown, else the one that the program was started in.
std::string first_folder(const Viewer& viewer) {
  std::error_code ignored;
  const std::string name = viewer.loading_name();
  if (!name.empty()) {
    const fs::path folder = fs::absolute(name, ignored).parent_path();
    if (fs::is_directory(folder, ignored)) return folder.string();
  }
  return fs::current_path(ignored).string();
}

}  // namespace

void FileDialog::go(const std::string& folder) {
  std::error_code ignored;
  const std::string whole = fs::absolute(folder, ignored).lexically_normal().string();
  auto listed = list_folder(whole);
  if (!listed) {
    error_ = listed.error().message;
    return;
  }
  error_.clear();
  folder_ = whole;
  entries_ = *std::move(listed);
  const std::size_t length = std::min(folder_.size(), path_.size() - 1);
  std::memcpy(path_.data(), folder_.data(), length);
  path_[length] = '\0';
}

void FileDialog::entries(Viewer& viewer, float scale) {
  const float below = ImGui::GetFrameHeightWithSpacing() + ImGui::GetTextLineHeightWithSpacing();
  ImGui::BeginChild("entries", {0, -below}, true);
  std::string chosen;
  ImGuiListClipper clipper;
  clipper.Begin(static_cast<int>(entries_.size()));
  while (clipper.Step()) {
    for (int i = clipper.DisplayStart; i < clipper.DisplayEnd; ++i) {
      const FolderEntry& entry = entries_[static_cast<std::size_t>(i)];
      ImGui::PushID(i);
      const std::string label = entry.is_folder ? entry.name + "/" : entry.name;
      if (ImGui::Selectable(label.c_str())) chosen = entry.name;
      if (!entry.is_folder) {
        const std::string bytes = apps::readable_bytes(entry.bytes);
        ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(bytes.c_str()).x -
                        8 * scale);
        faint(bytes);
      }
      ImGui::PopID();
    }
  }
  if (entries_.empty()) faint("no folder or file that can be opened");
  ImGui::EndChild();
  if (chosen.empty()) return;
  const std::string path = (fs::path(folder_) / chosen).string();
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    go(path);
  } else {
    viewer.open_files({path});
  }
}

void FileDialog::draw(Viewer& viewer, float scale) {
  if (!viewer.dialog) {
    open_ = false;
    return;
  }
  if (!open_ || shown_ != *viewer.dialog) {
    shown_ = *viewer.dialog;
    go(shown_.empty() ? first_folder(viewer) : shown_);
  }
  const bool first = !std::exchange(open_, true);
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({screen.x / 2, screen.y / 2}, 0, {0.5f, 0.5f});
  ImGui::SetNextWindowSize(
      {std::min(620 * scale, screen.x * 0.95f), std::min(520 * scale, screen.y * 0.95f)});
  if (first) ImGui::SetNextWindowFocus();
  bool stays = true;
  ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 1.0f);
  ImGui::Begin("Open a file", &stays,
               ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                   ImGuiWindowFlags_NoSavedSettings);
  if (ImGui::Button("Up")) go(fs::path(folder_).parent_path().string());
  ImGui::SameLine();
  const char* home = std::getenv("HOME");
  if (home != nullptr && ImGui::Button("Home")) go(home);
  if (home != nullptr) ImGui::SameLine();
  ImGui::SetNextItemWidth(-1);
  if (ImGui::InputText("##path", path_.data(), path_.size(),
                       ImGuiInputTextFlags_EnterReturnsTrue)) {
    std::error_code ignored;
    const std::string path(path_.data());
    if (fs::is_directory(path, ignored)) {
      go(path);
    } else {
      viewer.open_files({path});
    }
  }
  entries(viewer, scale);
  if (error_.empty()) {
    faint("scenes .csg .scad; meshes .obj .stl .ply .off .3mf .amf .gltf .glb");
  } else {
    text(error_);
  }
  if (ImGui::Button("Cancel", {110 * scale, 0}) || !stays) viewer.dialog.reset();
  ImGui::End();
  ImGui::PopStyleVar();
}

}  // namespace strata::view
