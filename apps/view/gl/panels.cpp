#include "apps/view/gl/panels.h"

#include <fmt/core.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <utility>
#include <vector>

#include "apps/session/session.h"
#include "apps/view/gl/theme.h"
#include "strata/core/grid.h"

namespace strata::view {
namespace {

constexpr float kSideWidth = 300, kStatusHeight = 26;

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

/// A button that is lit while something is on.
bool toggle(const char* label, bool on, float width) {
  if (on) ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_ButtonActive));
  const bool pressed = ImGui::Button(label, {width, 0});
  if (on) ImGui::PopStyleColor();
  return pressed;
}

void hint(const char* words) {
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", words);
}

/// The width of one of `count` buttons side by side.
float share(int count) {
  const float gap = ImGui::GetStyle().ItemSpacing.x * static_cast<float>(count - 1);
  return (ImGui::GetContentRegionAvail().x - gap) / static_cast<float>(count);
}

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
  Looks looks = viewer.looks();
  if (toggle("Edges", viewer.picture_options().edges, third)) {
    viewer.set_edges(!viewer.picture_options().edges);
  }
  hint("e");
  ImGui::SameLine();
  if (toggle("Ghosts", looks.ghosts, third)) {
    looks.ghosts = !looks.ghosts;
    viewer.set_looks(looks);
  }
  hint("show subtracted solids; g");
  ImGui::SameLine();
  if (toggle("Axes", viewer.show_axes, third)) viewer.show_axes = !viewer.show_axes;
  hint("ctrl+2");
  const auto heat = [&](const char* label, Heat map, const char* keys) {
    if (toggle(label, viewer.heat() == map, third)) viewer.set_heat(map);
    hint(keys);
  };
  heat("Shaded", Heat::kOff, "the scene's colours");
  ImGui::SameLine();
  heat("Thickness", Heat::kThickness, "thickness of the first wall along the ray; t");
  ImGui::SameLine();
  heat("Depth", Heat::kDepth, "depth complexity: crossings of all solids; d");
  const csg::ColourScheme* scheme = viewer.picture_options().scheme;
  if (scheme == nullptr) scheme = csg::colour_schemes().data();
  ImGui::SetNextItemWidth(-1);
  if (ImGui::BeginCombo("##scheme", scheme->name.data())) {
    for (const csg::ColourScheme& one : csg::colour_schemes()) {
      if (ImGui::Selectable(one.name.data(), &one == scheme)) viewer.set_scheme(&one);
    }
    ImGui::EndCombo();
  }
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

void Panels::picked(Viewer& viewer) {
  if (viewer.picking()) return faint("picking ...");
  const auto& picked = viewer.picked();
  if (!picked) return faint("click on a face");
  if (!picked->hit) return faint("nothing there");
  ImGui::PushTextWrapPos(0.0f);
  text(short_name(viewer.solid_name(picked->solid)));
  ImGui::PopTextWrapPos();
  text(fmt::format("triangle {}{}", picked->triangle, picked->cut ? ", a cut face" : ""));
  text(fmt::format("at {:.5g}, {:.5g}, {:.5g}", picked->where.x, picked->where.y, picked->where.z));
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
      if (scheme == nullptr) scheme = csg::colour_schemes().data();
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
  hint(".3mf .stl .obj .ply .off: mesh; .vdb .npy .nrrd ...: voxels; .png: picture");
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

// --- the status bar and what is told
// ----------------------------------------------------------------

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
  left += fmt::format("     rotation {:.0f}, {:.0f}, {:.0f}   distance {:.4g}", c.rotation.x,
                      c.rotation.y, c.rotation.z, c.distance);
  text(left);
  const bool whole = viewer.frame() != nullptr && viewer.frame()->divisor == 1;
  const std::string state = viewer.loading()    ? "loading"
                            : !viewer.settled() ? (whole ? "drawing" : "coarse")
                                                : "";
  const std::string drawn =
      viewer.drawn_by().empty() ? std::string() : fmt::format("drawn by {}, ", viewer.drawn_by());
  const std::string right =
      fmt::format("{}{}{}shown by {}", state, state.empty() ? "" : "   ", drawn, gl_renderer_);
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
  if (viewer.model() != nullptr && hidden_warnings_ != viewer.loads()) {
    lines = viewer.model()->warnings;
  }
  constexpr std::size_t kMostLines = 4;
  if (lines.size() > kMostLines) {
    const std::size_t more = lines.size() - (kMostLines - 1);
    lines.resize(kMostLines - 1);
    lines.push_back(fmt::format("and {} more", counted(more, "warning")));
  }
  const float wrap = std::max(80 * scale_, static_cast<float>(area.size.x) - 48 * scale_);
  if (wrong || (viewer.show_panels && !lines.empty())) {
    ImGui::SetNextWindowPos(place(area, 12 * scale_, 12 * scale_));
    ImGui::PushStyleColor(ImGuiCol_WindowBg, wrong ? ImVec4(0.45f, 0.07f, 0.07f, 0.95f)
                                                   : ImVec4(0.36f, 0.27f, 0.05f, 0.93f));
    ImGui::Begin("trouble", nullptr, kBox);
    ImGui::PushTextWrapPos(wrap);
    if (wrong) {
      text(errors);
      if (viewer.model() != nullptr) faint("The window shows the version before.");
    } else {
      for (const std::string& line : lines) text(line);
      if (ImGui::SmallButton("Hide warnings")) hidden_warnings_ = viewer.loads();
    }
    ImGui::PopTextWrapPos();
    ImGui::End();
    ImGui::PopStyleColor();
  }
}

/// A box with the progress of loading.
void Panels::loading(Viewer& viewer, const Area& area) {
  const ImVec2 middle = place(area, area.size.x / 2.0, area.size.y / 2.0);
  ImGui::SetNextWindowPos(middle, 0, {0.5f, 0.5f});
  ImGui::Begin("loading", nullptr, kBox);
  text(fmt::format("Reading {} ... {:.0f} s", viewer.options().command.input.files.front(),
                   viewer.load_seconds()));
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
