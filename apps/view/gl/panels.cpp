#include "apps/view/gl/panels.h"

#include <imgui.h>

#include <algorithm>
#include <utility>

#include "apps/view/gl/theme.h"

namespace strata::view {
namespace {

constexpr float kSideWidth = 300;
/// What is narrower would cut words of buttons: a small window has no side panel.
constexpr float kLeastSideWidth = 220;

}  // namespace

Panels::Panels(float scale, std::string gl_renderer)
    : scale_(scale), gl_renderer_(std::move(gl_renderer)) {
  load_font(scale);
  apply_theme(scale, light_);
}

Area Panels::picture_area(const glm::ivec2& window, const Viewer& viewer) const {
  if (!viewer.show_panels) return {{0, 0}, window};
  const auto side = static_cast<int>(side_width(window));
  const auto status = static_cast<int>(kStatusHeight * scale_);
  const int above = tabs_height(viewer), below = console_height(viewer) + status;
  return {{0, above}, glm::max(window - glm::ivec2(side, above + below), glm::ivec2(1))};
}

int Panels::tabs_height(const Viewer& viewer) const {
  constexpr float kHeight = 30;
  return viewer.show_panels && viewer.tabs().size() > 1 ? static_cast<int>(kHeight * scale_) : 0;
}

int Panels::console_height(const Viewer& viewer) const {
  constexpr float kHeight = 150;
  return viewer.show_panels && viewer.show_console ? static_cast<int>(kHeight * scale_) : 0;
}

float Panels::side_width(const glm::ivec2& window) const {
  const float half = static_cast<float>(window.x / 2);
  return half < kLeastSideWidth * scale_ ? 0 : std::min(kSideWidth * scale_, half);
}

void Panels::tell(std::string words) {
  told_ = std::move(words);
  told_at_ = Viewer::Clock::now();
}

void Panels::draw(Viewer& viewer, const glm::ivec2& window, const Area& area) {
  if (light_ != viewer.light_look) {
    light_ = viewer.light_look;
    apply_theme(scale_, light_);
  }
  if (viewer.frame() != nullptr) {
    if (viewer.show_axes && !viewer.looks().voxels.slice) axes(viewer, area);
    handle(viewer, area);
    mark(viewer, area);
    guides(viewer, area);
    legend(viewer, area);
  }
  if (viewer.show_panels) {
    if (side_width(window) > 0) side(viewer, window);
    status(viewer, window);
    tab_bar(viewer, area);
    console(viewer, area);
  }
  start(viewer, area);
  messages(viewer, area);
  dialog_.draw(viewer, scale_);
  keys(viewer, window);
}

// --- the side panel -----------------------------------------------------------------------------

void Panels::side(Viewer& viewer, const glm::ivec2& window) {
  const float width = side_width(window), height = kStatusHeight * scale_;
  ImGui::SetNextWindowPos({static_cast<float>(window.x) - width, 0});
  ImGui::SetNextWindowSize({width, static_cast<float>(window.y) - height});
  ImGui::Begin("side", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize |
                   ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus);
  files(viewer);
  if (viewer.tabs().empty()) return ImGui::End();
  const auto open = ImGuiTreeNodeFlags_DefaultOpen;
  if (!viewer.parameters().empty() && ImGui::CollapsingHeader("Parameters", open)) {
    parameters(viewer);
  }
  const bool voxel_file = viewer.shows_voxels();
  if (voxel_file) {
    if (ImGui::CollapsingHeader("Voxels", open)) voxels(viewer);
  } else if (ImGui::CollapsingHeader("Part", open)) {
    numbers(viewer);
  }
  if (ImGui::CollapsingHeader("Camera", open)) camera(viewer);
  if (ImGui::CollapsingHeader("Appearance", open)) look(viewer);
  if (ImGui::CollapsingHeader("Section", open)) section(viewer);
  if (ImGui::CollapsingHeader("Picked", open)) picked(viewer);
  if (!voxel_file && ImGui::CollapsingHeader("Measure", open)) measure(viewer);
  if (ImGui::CollapsingHeader("Export")) exports(viewer);
  if (!voxel_file && ImGui::CollapsingHeader("Transparency")) transparency(viewer);
  if (ImGui::CollapsingHeader("Times and lists")) statistics(viewer);
  if (!voxel_file && ImGui::CollapsingHeader("Solids", open)) solids(viewer);
  ImGui::End();
}

}  // namespace strata::view
