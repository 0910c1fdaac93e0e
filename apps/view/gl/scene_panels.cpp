#include <fmt/core.h>
#include <imgui.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/view/gl/panel_items.h"
#include "apps/view/gl/panels.h"
#include "strata/core/grid.h"

// The panels about the scene: what was picked, its solids, its numbers, files made of it.

namespace strata::view {

void Panels::picked(Viewer& viewer) {
  if (viewer.picking()) return faint("picking ...");
  const auto& picked = viewer.picked();
  if (!picked) return faint("click on a face");
  if (!picked->hit) return faint("nothing there");
  ImGui::PushTextWrapPos(0.0f);
  text(picked->what.empty() ? short_name(viewer.solid_name(picked->solid)) : picked->what);
  ImGui::PopTextWrapPos();
  if (!picked->what.empty()) {  // a voxel
    return text(fmt::format("at {:.5g}, {:.5g}, {:.5g}", picked->where.x, picked->where.y,
                            picked->where.z));
  }
  text(fmt::format("triangle {}{}", picked->triangle, picked->cut ? ", a cut face" : ""));
  text(fmt::format("at {:.5g}, {:.5g}, {:.5g}", picked->where.x, picked->where.y, picked->where.z));
  if (picked->thickness) text(fmt::format("thickness {:.5g}", *picked->thickness));
  const auto place = viewer.can_edit() ? viewer.picked_place() : std::nullopt;
  if (place && ImGui::Button("Open in the editor", {-1, 0})) open_editor(viewer, *place);
  if (place) hint(fmt::format("{}:{}", place->file, place->line).c_str());
}

void Panels::solids(Viewer& viewer) {
  const Model* model = viewer.model();
  if (model == nullptr) return faint("nothing is loaded");
  const auto all = model->scene.tree.solids();
  ImGui::SetNextItemWidth(-1);
  ImGui::InputTextWithHint("##filter", "find", filter_.data(), filter_.size());
  const std::string_view wanted(filter_.data());
  std::vector<std::uint32_t> some;
  if (!wanted.empty()) {
    for (std::uint32_t i = 0; i < all.size(); ++i) {
      if (all[i].name.find(wanted) != std::string::npos) some.push_back(i);
    }
  }
  const Looks& looks = viewer.looks();
  const auto count = static_cast<int>(wanted.empty() ? all.size() : some.size());
  const float rest = ImGui::GetContentRegionAvail().y;
  ImGui::BeginChild("solids", {0, std::max(rest, 90 * scale_)});
  ImGuiListClipper clipper;
  clipper.Begin(count);
  while (clipper.Step()) {
    for (int line = clipper.DisplayStart; line < clipper.DisplayEnd; ++line) {
      const auto at = static_cast<std::size_t>(line);
      const std::uint32_t solid = wanted.empty() ? static_cast<std::uint32_t>(line) : some[at];
      ImGui::PushID(static_cast<int>(solid));
      bool shown = solid >= looks.hidden.size() || looks.hidden[solid] == 0;
      if (ImGui::Checkbox("##shown", &shown)) viewer.set_hidden(solid, !shown);
      ImGui::SameLine();
      const csg::ColourScheme* scheme = viewer.picture_options().scheme;
      if (scheme == nullptr) scheme = &csg::default_scheme();
      glm::vec4 colour(glm::vec3(scheme->face) / 255.0f, 1.0f);
      colour = csg::colour_or(all[solid].colour, colour);
      if (const auto own = looks.colours.find(solid); own != looks.colours.end()) {
        colour = own->second;
      }
      if (ImGui::ColorEdit4("##colour", &colour.x,
                            ImGuiColorEditFlags_NoInputs | ImGuiColorEditFlags_AlphaPreview)) {
        Looks changed = looks;
        changed.colours[solid] = colour;
        viewer.set_looks(std::move(changed));
      }
      ImGui::SameLine();
      const std::string name =
          all[solid].name.empty() ? fmt::format("solid {}", solid) : short_name(all[solid].name);
      const bool chosen = looks.selected == solid;
      if (ImGui::Selectable(name.c_str(), chosen)) {
        viewer.select(chosen ? std::nullopt : std::optional(solid));
      }
      ImGui::PopID();
    }
  }
  ImGui::EndChild();
}

void Panels::exports(Viewer& viewer) {
  if (viewer.exporting()) {
    ImGui::ProgressBar(static_cast<float>(viewer.export_progress()), {-80 * scale_, 0});
    ImGui::SameLine();
    if (ImGui::Button("Cancel")) viewer.cancel_export();
    return;
  }
  ImGui::SetNextItemWidth(-1);
  ImGui::InputText("##export", export_name_.data(), export_name_.size());
  hint(
      ".3mf .stl .obj .ply .off: mesh; .vdb .npy .nrrd ...: voxels; folder/: slices; .png: "
      "picture");
  const std::string path(export_name_.data());
  const auto kind = export_kind(path);
  if (!kind) return faint("unknown format");
  if (*kind == ExportKind::kVoxels) {
    ImGui::SetNextItemWidth(share(2));
    ImGui::InputInt("voxels", &export_voxels_, 0);
    hint("along the longest side");
    export_voxels_ = std::clamp(export_voxels_, 1, kMaxGridSide);
  }
  std::error_code ignored;
  const char* label =
      std::filesystem::exists(path, ignored) ? "Replace the file###write" : "Export###write";
  if (!ImGui::Button(label, {-1, 0})) return;
  if (auto started = viewer.start_export(path, export_voxels_); !started) {
    tell(started.error().message);
  }
}

void Panels::statistics(const Viewer& viewer) {
  const Statistics& s = viewer.statistics();
  if (!ImGui::BeginTable("statistics", 2)) return;
  ImGui::TableSetupColumn("what", ImGuiTableColumnFlags_WidthStretch, 0.42f);
  ImGui::TableSetupColumn("value", ImGuiTableColumnFlags_WidthStretch, 0.58f);
  if (const Model* model = viewer.model()) {
    row("solids", fmt::format("{}", model->scene.tree.solids().size()));
    row("triangles", fmt::format("{}", model->triangles));
    row("loaded in", fmt::format("{:.0f} ms", model->load_ms));
  }
  row("whole picture", fmt::format("{:.1f} ms", s.whole_ms));
  row("  on screen in", fmt::format("{:.0f} ms", s.whole_latency_ms));
  if (s.coarse_ms > 0)
    row("coarse picture", fmt::format("{:.1f} ms, 1/{}", s.coarse_ms, s.divisor));
  row("reaction", fmt::format("{:.0f} ms, most {:.0f}", s.reaction_ms, s.largest_reaction_ms));
  row("panels", fmt::format("{:.1f} ms", s.present_ms));
  row("crossings", fmt::format("{}", s.report.fragments));
  if (s.report.covered > 0) {
    row("  per pixel", fmt::format("{:.2f}", static_cast<double>(s.report.fragments) /
                                                 static_cast<double>(s.report.covered)));
  }
  if (s.longest_list > 0) row("longest list", fmt::format("{}", s.longest_list));
  row("covered", fmt::format("{} pixels", s.report.covered));
  ImGui::EndTable();
}

}  // namespace strata::view
