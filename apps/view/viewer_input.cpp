#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "apps/view/viewer.h"

// What the mouse and the keys do.

namespace strata::view {
namespace {

/// A press that moves less is a click.
constexpr double kClickPixels = 3.0;
constexpr std::chrono::milliseconds kDoubleClick{400};
/// How near the section's handle must be taken.
constexpr double kHandlePixels = 14.0;
/// What a key turns and moves.
constexpr double kKeyPixels = 20.0;

struct Key {
  std::string_view name;
  void (*act)(Viewer&);
  std::string_view what;
  std::string_view surfaces = {};  ///< what it is about that voxels do not have; empty: nothing
};

void toggle_heat(Viewer& viewer, Heat heat) {
  viewer.set_heat(viewer.heat() == heat ? Heat::kOff : heat);
}

void section_across(Viewer& viewer, int axis) {
  const Model* model = viewer.model();
  if (model == nullptr || model->box.empty()) return;
  csg::SectionPlane plane;
  plane.normal[axis] = 1.0;
  plane.offset = (model->box.low[axis] + model->box.high[axis]) * 0.5;
  plane.towards_eye = true;
  viewer.set_section(plane);
}

constexpr Key kKeys[] = {
    {"ctrl+4", [](Viewer& v) { v.look("top"); }, "view from the top"},
    {"ctrl+5", [](Viewer& v) { v.look("bottom"); }, "view from below"},
    {"ctrl+6", [](Viewer& v) { v.look("left"); }, "view from the left"},
    {"ctrl+7", [](Viewer& v) { v.look("right"); }, "view from the right"},
    {"ctrl+8", [](Viewer& v) { v.look("front"); }, "view from the front"},
    {"ctrl+9", [](Viewer& v) { v.look("back"); }, "view from behind"},
    {"ctrl+0", [](Viewer& v) { v.look("diagonal"); }, "view diagonally"},
    {"ctrl+shift+0", [](Viewer& v) { v.look("centre"); }, "centre the origin"},
    {"ctrl+alt+0", [](Viewer& v) { v.look("reset"); }, "reset the camera"},
    {"ctrl+shift+v", [](Viewer& v) { v.look("all"); }, "show everything; also f and home"},
    {"f", [](Viewer& v) { v.look("all"); }, ""},
    {"home", [](Viewer& v) { v.look("all"); }, ""},
    {"ctrl+]", [](Viewer& v) { v.zoom_by(1); }, "zoom in; also +"},
    {"ctrl+[", [](Viewer& v) { v.zoom_by(-1); }, "zoom out; also -"},
    {"+", [](Viewer& v) { v.zoom_by(1); }, ""},
    {"=", [](Viewer& v) { v.zoom_by(1); }, ""},
    {"shift+=", [](Viewer& v) { v.zoom_by(1); }, ""},
    {"-", [](Viewer& v) { v.zoom_by(-1); }, ""},
    {"left",
     [](Viewer& v) {
       v.orbit_by({-kKeyPixels, 0});
     },
     "turn; also right, up, down"},
    {"right",
     [](Viewer& v) {
       v.orbit_by({kKeyPixels, 0});
     },
     ""},
    {"up",
     [](Viewer& v) {
       v.orbit_by({0, -kKeyPixels});
     },
     ""},
    {"down",
     [](Viewer& v) {
       v.orbit_by({0, kKeyPixels});
     },
     ""},
    {"shift+left",
     [](Viewer& v) {
       v.pan_by({-kKeyPixels, 0});
     },
     "move; also right, up, down"},
    {"shift+right",
     [](Viewer& v) {
       v.pan_by({kKeyPixels, 0});
     },
     ""},
    {"shift+up",
     [](Viewer& v) {
       v.pan_by({0, -kKeyPixels});
     },
     ""},
    {"shift+down",
     [](Viewer& v) {
       v.pan_by({0, kKeyPixels});
     },
     ""},
    {"p",
     [](Viewer& v) {
       Camera camera = v.camera();
       camera.projection = camera.projection == Projection::kPerspective ? Projection::kOrthographic
                                                                         : Projection::kPerspective;
       v.set_camera(camera);
     },
     "perspective or orthographic"},
    {"ctrl+1", [](Viewer& v) { v.set_edges(!v.picture_options().edges); },
     "edges on or off; also e", "edges"},
    {"e", [](Viewer& v) { v.set_edges(!v.picture_options().edges); }, "", "edges"},
    {"ctrl+2", [](Viewer& v) { v.show_axes = !v.show_axes; }, "axes on or off"},
    {"g",
     [](Viewer& v) {
       Looks looks = v.looks();
       looks.ghosts = !looks.ghosts;
       v.set_looks(std::move(looks));
     },
     "ghosts of subtracted solids on or off", "ghosts"},
    {"s", [](Viewer& v) { v.toggle_section(); }, "section on or off"},
    {"x", [](Viewer& v) { section_across(v, 0); }, "section across x; likewise y and z"},
    {"y", [](Viewer& v) { section_across(v, 1); }, ""},
    {"z", [](Viewer& v) { section_across(v, 2); }, ""},
    {"i", [](Viewer& v) { v.flip_section(); }, "flip the section"},
    {"t", [](Viewer& v) { toggle_heat(v, Heat::kWall); },
     "heat map of the thickness along the normal", "heat maps"},
    {"shift+t", [](Viewer& v) { toggle_heat(v, Heat::kThickness); },
     "heat map of the thickness along the ray", "heat maps"},
    {"d", [](Viewer& v) { toggle_heat(v, Heat::kDepth); }, "heat map of the depth complexity",
     "heat maps"},
    {"m", [](Viewer& v) { v.take_up(Tool::kDistance); }, "measure the distance of two picks",
     "measuring tools"},
    {"a", [](Viewer& v) { v.take_up(Tool::kAngle); }, "measure the angle of two faces",
     "measuring tools"},
    {"r", [](Viewer& v) { v.take_up(Tool::kRadius); },
     "measure the radius of a cylinder, sphere or circle", "measuring tools"},
    {"w", [](Viewer& v) { v.take_up(Tool::kThickness); }, "measure the thickness of a wall",
     "measuring tools"},
    {"v", [](Viewer& v) { v.take_up(Tool::kSize); }, "measure size and volume of a solid",
     "measuring tools"},
    {"b", [](Viewer& v) { v.board().box = !v.board().box; }, "box around the result on or off"},
    {"shift+g", [](Viewer& v) { v.board().grid = !v.board().grid; },
     "grid of the plane z = 0 on or off"},
    {"shift+b", [](Viewer& v) { v.board().scale_bar = !v.board().scale_bar; },
     "scale bar on or off"},
    {"ctrl+3", [](Viewer& v) { v.board().ticks = !v.board().ticks; },
     "axes with numbers on or off"},
    {"h",
     [](Viewer& v) {
       if (v.looks().selected) v.set_hidden(*v.looks().selected, true);
     },
     "hide the picked solid", "hidden solids"},
    {"shift+h",
     [](Viewer& v) {
       Looks looks = v.looks();
       looks.hidden.clear();
       v.set_looks(std::move(looks));
     },
     "show all solids", "hidden solids"},
    {"f5", [](Viewer& v) { v.reload(); }, "load the files again; also F4"},
    {"f4", [](Viewer& v) { v.reload(); }, ""},
    {"tab", [](Viewer& v) { v.show_panels = !v.show_panels; }, "panels on or off"},
    {"ctrl+z", [](Viewer& v) { v.undo(); },
     "undo the last change of camera, section, slice or hiding"},
    {"ctrl+shift+z", [](Viewer& v) { v.redo(); }, "redo it; also ctrl+y"},
    {"ctrl+y", [](Viewer& v) { v.redo(); }, ""},
    {"ctrl+o",
     [](Viewer& v) {
       v.dialog = v.dialog ? std::nullopt : std::optional<std::string>(std::string());
     },
     "open a file"},
    {"ctrl+tab", [](Viewer& v) { v.next_tab(1); }, "next tab; also ctrl+page down"},
    {"ctrl+page down", [](Viewer& v) { v.next_tab(1); }, ""},
    {"ctrl+shift+tab", [](Viewer& v) { v.next_tab(-1); }, "previous tab; also ctrl+page up"},
    {"ctrl+page up", [](Viewer& v) { v.next_tab(-1); }, ""},
    {"ctrl+w", [](Viewer& v) { v.close_tab(v.tab()); }, "close the tab"},
    {"c", [](Viewer& v) { v.show_console = !v.show_console; }, "console on or off"},
    {"?", [](Viewer& v) { v.show_keys = !v.show_keys; }, "these keys; also F1"},
    {"f1", [](Viewer& v) { v.show_keys = !v.show_keys; }, ""},
    {"ctrl+s", [](Viewer& v) { v.wants_screenshot = true; },
     "save a screenshot, strata-view-N.png"},
    {"escape",
     [](Viewer& v) {
       if (v.show_keys) return void(v.show_keys = false);
       if (v.dialog) return v.dialog.reset();
       if (v.loading()) return v.cancel_load();
       if (v.exporting()) return v.cancel_export();
       if (v.board().tool() != Tool::kNone) return v.board().take_up(Tool::kNone);
       v.board().clear();
       v.select({});
     },
     "close what is open; stop loading or an export; put a tool away; clear picks and "
     "measurements"},
    {"ctrl+q", [](Viewer& v) { v.wants_quit = true; }, "close the window"},
};

constexpr KeyHelp kGestures[] = {
    {"left drag", "turn; on the section's arrow: move the section"},
    {"right or middle drag", "move; also shift + left drag"},
    {"wheel, ctrl + drag", "zoom at the cursor"},
    {"shift + wheel", "move; also two fingers sideways"},
    {"click", "pick: show the solid, triangle and position"},
    {"double click", "pick, and turn about that point"},
};

}  // namespace

void Viewer::mouse_button(MouseButton button, bool down, const glm::dvec2& at, bool shift,
                          bool control) {
  if (!down) {
    if (drag_ == Drag::kNone || button != button_) return;
    const Drag was = std::exchange(drag_, Drag::kNone);
    if (moved_ || button != MouseButton::kLeft || was == Drag::kSection) return;
    const auto now = Clock::now();
    centre_on_pick_ =
        now - last_click_ < kDoubleClick && glm::distance(at, last_click_at_) < 2 * kClickPixels;
    last_click_ = now;
    last_click_at_ = at;
    const glm::ivec2 pixel(glm::floor(at));
    board_.tool() == Tool::kNone ? pick(pixel) : measure_at(pixel);
    return;
  }
  if (drag_ != Drag::kNone) return;
  if (camera_set_) history_.rest(state());
  button_ = button;
  mouse_ = pressed_at_ = at;
  moved_ = false;
  const auto handle = section_handle();
  const bool on_handle = handle && (glm::distance(at, handle->at) < kHandlePixels ||
                                    glm::distance(at, handle->tip) < kHandlePixels);
  if (control) {
    drag_ = Drag::kZoom;
  } else if (button != MouseButton::kLeft || shift) {
    drag_ = Drag::kPan;
  } else {
    drag_ = on_handle ? Drag::kSection : Drag::kOrbit;
  }
}

void Viewer::mouse_move(const glm::dvec2& at) {
  const glm::dvec2 by = at - mouse_;
  if (drag_ == Drag::kNone || by == glm::dvec2(0.0)) return;
  if (!moved_ && glm::distance(at, pressed_at_) < kClickPixels) return;
  moved_ = true;
  mouse_ = at;
  switch (drag_) {
    case Drag::kOrbit:
      return orbit_by(by);
    case Drag::kPan:
      return pan_by(by);
    case Drag::kZoom:
      return zoom_by(-by.y / 10.0, pressed_at_);
    case Drag::kSection: {
      if (!looks_.section || !model_) return;
      csg::SectionPlane& plane = *looks_.section;
      const glm::dvec3 centre = (model_->box.low + model_->box.high) * 0.5;
      const glm::dvec3 foot =
          centre + plane.normal * (plane.offset - glm::dot(plane.normal, centre));
      const glm::dvec2 range = section_range();
      plane.offset = std::clamp(plane.offset + slide(camera_, viewport_, foot, plane.normal, by),
                                range.x, range.y);
      return change(true);
    }
    case Drag::kNone:
      return;
  }
}

void Viewer::scroll(const glm::dvec2& steps, const glm::dvec2& at, bool shift) {
  constexpr double kStepPixels = 30.0;
  if (shift) return pan_by(steps * kStepPixels);
  // Fingers that go sideways wander up and down a little.
  if (std::abs(steps.x) > std::abs(steps.y)) return pan_by({steps.x * kStepPixels, 0});
  zoom_by(steps.y, at);
}

bool Viewer::key(std::string_view name) {
  for (const Key& key : kKeys) {
    if (key.name != name) continue;
    if (shows_voxels() && !key.surfaces.empty()) {
      wants_told =
          fmt::format("{}: {} are for meshes and scenes, not for voxels", name, key.surfaces);
    } else {
      key.act(*this);
    }
    return true;
  }
  return false;
}

std::vector<KeyHelp> key_list() {
  std::vector<KeyHelp> list(std::begin(kGestures), std::end(kGestures));
  for (const Key& key : kKeys) {
    if (!key.what.empty()) list.push_back({key.name, key.what});
  }
  return list;
}

std::string key_help() {
  std::string text;
  for (const KeyHelp& one : key_list()) text += fmt::format("  {:<24}{}\n", one.name, one.what);
  return text;
}

}  // namespace strata::view
