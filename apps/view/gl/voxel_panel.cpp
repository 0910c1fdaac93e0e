#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <utility>

#include "apps/view/gl/panel_items.h"
#include "apps/view/gl/panels.h"

// The panel of a file of voxels: what is inside, how it is drawn, slices and the threshold.

namespace strata::view {
namespace {

void styles(VoxelLooks& looks) {
  const float width = share(4);
  const auto style = [&](const char* label, VoxelStyle one, const char* words) {
    if (toggle(label, looks.style == one && !looks.slice, width)) {
      looks.style = one;
      looks.slice.reset();
    }
    hint(words);
  };
  style("Auto", VoxelStyle::kAuto, "blocks where voxels are large, else smooth");
  ImGui::SameLine();
  style("Blocks", VoxelStyle::kBlocks, "every voxel with its faces");
  ImGui::SameLine();
  style("Smooth", VoxelStyle::kSmooth, "lit by the slope of the surface");
  ImGui::SameLine();
  style("X-ray", VoxelStyle::kXray, "the longer a ray is inside, the darker");
}

void slices(const VoxelScene& scene, VoxelLooks& looks) {
  const VoxelVolume& volume = scene.volume();
  const float width = share(4);
  const char* labels[] = {"Slice X", "Slice Y", "Slice Z"};
  for (int axis = 0; axis < 3; ++axis) {
    const bool on = looks.slice && static_cast<int>(looks.slice->axis) == axis;
    if (toggle(labels[axis], on, width)) {
      looks.slice = VoxelSlice{static_cast<Axis>(axis), volume.grid().dims[axis] / 2};
    }
    ImGui::SameLine();
  }
  if (toggle("Solid", !looks.slice, width)) looks.slice.reset();
  if (!looks.slice) return;
  const int axis = static_cast<int>(looks.slice->axis);
  const int first = volume.first_index[axis], last = first + volume.grid().dims[axis] - 1;
  int index = looks.slice->index + first;
  ImGui::SetNextItemWidth(-1);
  ImGui::SliderInt("##slice", &index, first, last);
  hint("the voxels of this plane");
  looks.slice->index = std::clamp(index, first, last) - first;
  const VoxelGrid& grid = volume.grid();
  faint(fmt::format("{} = {:.6g}", "xyz"[axis],
                    grid.origin[axis] + (looks.slice->index + 0.5) * grid.voxel_size[axis]));
}

void threshold(const VoxelScene& scene, VoxelLooks& looks) {
  if (scene.volume().values.empty()) return;
  float value = looks.threshold.value_or(scene.volume().threshold);
  ImGui::SetNextItemWidth(-1);
  if (ImGui::SliderFloat("##threshold", &value, scene.range().least, scene.range().greatest,
                         "threshold %.4g")) {
    looks.threshold = value;
  }
  hint(scene.volume().kind == VoxelKind::kDistances ? "voxels below it are solid"
                                                    : "voxels above it are solid");
}

}  // namespace

void Panels::voxels(Viewer& viewer) {
  const VoxelScene& scene = *viewer.model()->voxels;
  if (ImGui::BeginTable("voxels", 2)) {
    ImGui::TableSetupColumn("what", ImGuiTableColumnFlags_WidthStretch, 0.3f);
    ImGui::TableSetupColumn("value", ImGuiTableColumnFlags_WidthStretch, 0.7f);
    for (const auto& [what, value] : scene.facts()) row(what.c_str(), value);
    ImGui::EndTable();
  }
  Looks looks = viewer.looks();
  styles(looks.voxels);
  slices(scene, looks.voxels);
  threshold(scene, looks.voxels);
  if (!(looks.voxels == viewer.looks().voxels)) viewer.set_looks(std::move(looks));
}

}  // namespace strata::view
