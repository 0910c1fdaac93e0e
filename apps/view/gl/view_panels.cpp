#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "apps/view/gl/panel_items.h"
#include "apps/view/gl/panels.h"
#include "strata/transparency/techniques.h"

// The panels that say how the scene is looked at.

namespace strata::view {

void Panels::camera(Viewer& viewer) {
  struct Button {
    const char *label, *view, *keys;
  };
  constexpr Button kButtons[] = {{"Top", "top", "ctrl+4"},      {"Front", "front", "ctrl+8"},
                                 {"Left", "left", "ctrl+6"},    {"All", "all", "f"},
                                 {"Below", "bottom", "ctrl+5"}, {"Back", "back", "ctrl+9"},
                                 {"Right", "right", "ctrl+7"},  {"Reset", "reset", "ctrl+alt+0"}};
  const float width = share(4);
  for (int i = 0; i < 8; ++i) {
    if (i % 4 != 0) ImGui::SameLine();
    if (ImGui::Button(kButtons[i].label, {width, 0})) viewer.look(kButtons[i].view);
    hint(kButtons[i].keys);
  }
  const float half = share(2);
  const bool perspective = viewer.camera().projection == Projection::kPerspective;
  const auto project = [&](Projection projection) {
    Camera changed = viewer.camera();
    changed.projection = projection;
    viewer.set_camera(changed);
  };
  if (toggle("Perspective", perspective, half)) project(Projection::kPerspective);
  hint("p");
  ImGui::SameLine();
  if (toggle("Orthographic", !perspective, half)) project(Projection::kOrthographic);
  hint("p");
}

void Panels::look(Viewer& viewer) {
  const float third = share(3);
  if (!viewer.shows_voxels()) surfaces(viewer);
  if (toggle("Axes", viewer.show_axes, third)) viewer.show_axes = !viewer.show_axes;
  hint("ctrl+2");
  ImGui::SameLine();
  if (ImGui::Button(viewer.light_look ? "Dark###look" : "Light###look", {third, 0})) {
    viewer.light_look = !viewer.light_look;
    remember_look(viewer.folders(), viewer.light_look ? "light" : "dark");
  }
  hint("colours of the panels");
  const csg::ColourScheme* scheme = viewer.picture_options().scheme;
  if (scheme == nullptr) scheme = &csg::default_scheme();
  ImGui::SetNextItemWidth(-1);
  if (ImGui::BeginCombo("##scheme", scheme->name.data())) {
    for (const csg::ColourScheme& one : csg::colour_schemes()) {
      if (ImGui::Selectable(one.name.data(), &one == scheme)) viewer.set_scheme(&one);
    }
    ImGui::EndCombo();
  }
  hint("colours of the picture");
}

void Panels::surfaces(Viewer& viewer) {
  const float half = share(2);
  Looks looks = viewer.looks();
  if (toggle("Edges", viewer.picture_options().edges, half)) {
    viewer.set_edges(!viewer.picture_options().edges);
  }
  hint("e");
  ImGui::SameLine();
  if (toggle("Ghosts", looks.ghosts, half)) {
    looks.ghosts = !looks.ghosts;
    viewer.set_looks(looks);
  }
  hint("show subtracted solids; g");
  const float fourth = share(4);
  const auto heat = [&](const char* label, Heat map, const char* keys) {
    if (toggle(label, viewer.heat() == map, fourth)) viewer.set_heat(map);
    hint(keys);
  };
  heat("Shaded", Heat::kOff, "the scene's colours");
  ImGui::SameLine();
  heat("Wall", Heat::kWall, "thickness along the normal; t");
  ImGui::SameLine();
  heat("Ray", Heat::kThickness, "thickness of the first wall along the ray; shift+t");
  ImGui::SameLine();
  heat("Depth", Heat::kDepth, "depth complexity: crossings of all solids; d");
  heat_range(viewer);
}

void Panels::transparency(Viewer& viewer) {
  const float half = share(2);
  std::optional<SeenThrough> how = viewer.see_through();
  if (toggle("See through", how.has_value(), half)) {
    how = how ? std::nullopt : std::optional<SeenThrough>(SeenThrough{});
  }
  hint("draw all surfaces, front to back");
  ImGui::SameLine();
  SeenThrough set = how.value_or(SeenThrough{});
  if (toggle("Errors", set.errors && how, half)) set.errors = !set.errors;
  hint("at rest: how much the technique's picture differs from the exact one");
  if (viewer.media() != nullptr) {
    if (toggle("Media", set.media != nullptr && how, half)) {
      set.media = set.media ? nullptr : viewer.media();
      if (!how) how = set;
    }
    hint("at rest: light through the media inside the solids");
  }
  ImGui::SetNextItemWidth(-1);
  ImGui::SliderFloat("##opacity", &set.opacity, 0.0f, 1.0f, "opacity %.2f");
  set.opacity = std::clamp(set.opacity, 0.0f, 1.0f);  // a number that is typed may be any
  hint("of all that is opaque by its colour");
  ImGui::SetNextItemWidth(-1);
  if (ImGui::BeginCombo("##technique", set.technique.c_str())) {
    for (const transparency::Technique* technique : transparency::techniques()) {
      if (technique->needs_triangles) continue;  // a tree's surfaces are not those of a mesh
      const std::string name(technique->name);
      if (ImGui::Selectable(name.c_str(), name == set.technique)) set.technique = name;
    }
    ImGui::EndCombo();
  }
  hint("of the picture at rest");
  if (how) how = set;
  viewer.set_see_through(how);
}

void Panels::section(Viewer& viewer) {
  const auto& plane = viewer.looks().section;
  const float width = share(5);
  const char* axes[] = {"X", "Y", "Z"};
  const char* keys[] = {"x", "y", "z"};
  for (int axis = 0; axis < 3; ++axis) {
    const bool on = plane && std::abs(plane->normal[axis]) > 0.999;
    if (toggle(axes[axis], on, width)) viewer.key(keys[axis]);
    hint(keys[axis]);
    ImGui::SameLine();
  }
  if (ImGui::Button("Flip", {width, 0})) viewer.flip_section();
  hint("i");
  ImGui::SameLine();
  if (toggle("Off", !plane, width) && plane) viewer.toggle_section();
  hint("s");
  if (!plane) return;
  // Along a world axis people think in its coordinate, whichever side is cut away.
  const glm::dvec3& n = plane->normal;
  const double sign = n.x + n.y + n.z < 0 ? -1.0 : 1.0;
  const glm::dvec2 range = viewer.section_range() * sign;
  double least = std::min(range.x, range.y), most = std::max(range.x, range.y);
  double offset = plane->offset * sign + 0.0;  // no -0
  ImGui::SetNextItemWidth(-1);
  if (ImGui::SliderScalar("##offset", ImGuiDataType_Double, &offset, &least, &most, "%.4g")) {
    Looks looks = viewer.looks();
    looks.section->offset = offset * sign;
    viewer.set_looks(std::move(looks));
  }
}

}  // namespace strata::view
