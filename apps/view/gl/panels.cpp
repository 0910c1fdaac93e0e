#include "apps/view/gl/panels.h"

#include <imgui.h>

#include <algorithm>
#include <utility>

#include "apps/view/gl/theme.h"

namespace strata::view {
namespace {

constexpr float kSideWidth = 300;

}  // namespace

Panels::Panels(float scale, std::string gl_renderer)
    : scale_(scale), gl_renderer_(std::move(gl_renderer)) {
  apply_theme(scale);
}

Area Panels::picture_area(const glm::ivec2& window, bool with_panels) const {
  if (!with_panels) return {{0, 0}, window};
  const auto side = static_cast<int>(side_width(window));
  const auto status = static_cast<int>(kStatusHeight * scale_);
  return {{0, 0}, glm::max(window - glm::ivec2(side, status), glm::ivec2(1))};
}

float Panels::side_width(const glm::ivec2& window) const {
  return std::min(kSideWidth * scale_, static_cast<float>(window.x / 2));
}

void Panels::tell(std::string words) {
  told_ = std::move(words);
  told_at_ = Viewer::Clock::now();
}

void Panels::draw(Viewer& viewer, const glm::ivec2& window, const Area& area) {
  if (viewer.frame() != nullptr) {
    if (viewer.show_axes) axes(viewer, area);
    handle(viewer, area);
    mark(viewer, area);
    legend(viewer, area);
  }
  if (viewer.show_panels) {
    side(viewer, window);
    status(viewer, window);
  }
  messages(viewer, area);
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
  if (ImGui::CollapsingHeader("Camera", ImGuiTreeNodeFlags_DefaultOpen)) camera(viewer);
  if (ImGui::CollapsingHeader("Appearance", ImGuiTreeNodeFlags_DefaultOpen)) look(viewer);
  if (ImGui::CollapsingHeader("Transparency", ImGuiTreeNodeFlags_DefaultOpen)) transparency(viewer);
  if (ImGui::CollapsingHeader("Section", ImGuiTreeNodeFlags_DefaultOpen)) section(viewer);
  if (ImGui::CollapsingHeader("Picked", ImGuiTreeNodeFlags_DefaultOpen)) picked(viewer);
  if (ImGui::CollapsingHeader("Export")) exports(viewer);
  // In a low window the solids need the room.
  constexpr int kHighEnough = 740;
  ImGui::SetNextItemOpen(static_cast<float>(window.y) >= kHighEnough * scale_,
                         ImGuiCond_FirstUseEver);
  if (ImGui::CollapsingHeader("Statistics")) statistics(viewer);
  if (ImGui::CollapsingHeader("Solids", ImGuiTreeNodeFlags_DefaultOpen)) solids(viewer);
  ImGui::End();
}

}  // namespace strata::view
