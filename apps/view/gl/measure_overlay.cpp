#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "apps/view/gl/panels.h"

// What is measured, and guides, drawn over the picture: solid where they are seen, dashed where
// faces hide them.

namespace strata::view {
namespace {

constexpr ImU32 kRuler = IM_COL32(255, 170, 30, 255);
constexpr ImU32 kGround = IM_COL32(20, 22, 26, 215), kInk = IM_COL32(255, 255, 255, 255);

ImU32 faded(ImU32 colour, float part) {
  ImVec4 c = ImGui::ColorConvertU32ToFloat4(colour);
  c.w *= part;
  return ImGui::ColorConvertFloat4ToU32(c);
}

/// Draws into the picture of one frame.
class Drawing {
 public:
  Drawing(const Area& area, const View& view, const DepthImage& depth, float scale)
      : area_(area),
        view_(view),
        depth_(depth),
        scale_(scale),
        list_(ImGui::GetBackgroundDrawList()) {
    list_->PushClipRect(at({0, 0}), at(glm::dvec2(area.size)), true);
  }
  Drawing(const Drawing&) = delete;
  Drawing& operator=(const Drawing&) = delete;
  ~Drawing() { list_->PopClipRect(); }

  [[nodiscard]] float scale() const { return scale_; }
  [[nodiscard]] std::optional<glm::dvec2> pixel(const glm::dvec3& world) const {
    return pixel_of(view_, world);
  }
  [[nodiscard]] const View& view() const { return view_; }
  [[nodiscard]] const DepthImage& depth() const { return depth_; }

  void stroke(const glm::dvec2& a, const glm::dvec2& b, ImU32 colour, float width,
              bool rim = true) {
    if (rim) list_->AddLine(at(a), at(b), IM_COL32(0, 0, 0, 130), (width + 2) * scale_);
    list_->AddLine(at(a), at(b), colour, width * scale_);
  }
  void dashed(const glm::dvec2& a, const glm::dvec2& b, ImU32 colour, float width) {
    const double length = glm::distance(a, b), dash = 4.0 * static_cast<double>(scale_);
    if (!(length > 0.0)) return;
    const glm::dvec2 along = (b - a) / length;
    for (double t = 0.0; t < length; t += 2.0 * dash) {
      list_->AddLine(at(a + along * t), at(a + along * std::min(t + dash, length)), colour,
                     width * scale_);
    }
  }
  enum class Hidden { kDashed, kNot, kGone };
  void line(const glm::dvec3& a, const glm::dvec3& b, ImU32 colour, float width, Hidden hidden,
            bool rim = true) {
    for (const Stretch& one : stretches(view_, depth_, a, b)) {
      if (!one.hidden || hidden == Hidden::kNot) {
        stroke(one.from, one.to, colour, width, rim);
      } else if (hidden == Hidden::kDashed) {
        dashed(one.from, one.to, faded(colour, 0.75f), width * 0.75f);
      }
    }
  }
  void dot(const glm::dvec2& pixel, ImU32 colour, bool square = false) {
    const ImVec2 p = at(pixel);
    const float r = 4.0f * scale_;
    if (square) {
      list_->AddRectFilled({p.x - r - 1, p.y - r - 1}, {p.x + r + 1, p.y + r + 1},
                           IM_COL32(0, 0, 0, 190));
      list_->AddRectFilled({p.x - r + 1, p.y - r + 1}, {p.x + r - 1, p.y + r - 1}, colour);
      return;
    }
    list_->AddCircleFilled(p, r + 1.5f, IM_COL32(0, 0, 0, 190));
    list_->AddCircleFilled(p, r - 0.5f, colour);
  }
  /// Text on a ground of its own, around a point, and within the picture.
  void label(const glm::dvec2& middle, const std::string& words, ImU32 colour = kInk) {
    const ImVec2 size = ImGui::CalcTextSize(words.c_str());
    const float px = 6 * scale_, py = 2.5f * scale_;
    ImVec2 p = at(middle);
    const ImVec2 low = at({0, 0}), high = at(glm::dvec2(area_.size));
    p.x = std::clamp(p.x, low.x + size.x / 2 + px + 2,
                     std::max(low.x + size.x / 2 + px + 2, high.x - size.x / 2 - px - 2));
    p.y = std::clamp(p.y, low.y + size.y / 2 + py + 2,
                     std::max(low.y + size.y / 2 + py + 2, high.y - size.y / 2 - py - 2));
    list_->AddRectFilled({p.x - size.x / 2 - px, p.y - size.y / 2 - py},
                         {p.x + size.x / 2 + px, p.y + size.y / 2 + py}, kGround, 4 * scale_);
    list_->AddText({p.x - size.x / 2, p.y - size.y / 2}, colour, words.c_str());
  }
  /// Text without a ground.
  void plain(const glm::dvec2& middle, const std::string& words, ImU32 colour, ImU32 rim) {
    const ImVec2 size = ImGui::CalcTextSize(words.c_str());
    const ImVec2 p = at(middle - glm::dvec2(size.x, size.y) * 0.5);
    for (const ImVec2 by : {ImVec2(1, 0), ImVec2(-1, 0), ImVec2(0, 1), ImVec2(0, -1)}) {
      list_->AddText({p.x + by.x, p.y + by.y}, rim, words.c_str());
    }
    list_->AddText(p, colour, words.c_str());
  }

 private:
  [[nodiscard]] ImVec2 at(const glm::dvec2& p) const {
    return {static_cast<float>(area_.at.x + p.x), static_cast<float>(area_.at.y + p.y)};
  }
  const Area& area_;
  const View& view_;
  const DepthImage& depth_;
  float scale_;
  ImDrawList* list_;
};
using Hidden = Drawing::Hidden;

void draw_distance(Drawing& to, const Measured& m) {
  const auto a = to.pixel(m.at[0].where), b = to.pixel(m.at[1].where);
  to.line(m.at[0].where, m.at[1].where, kRuler, 2, Hidden::kDashed);
  if (!a || !b) return;
  const double length = glm::distance(*a, *b);
  if (length > 1.0) {  // the ends of a dimension line
    const glm::dvec2 along = (*b - *a) / length;
    const glm::dvec2 across(-along.y * 6.0 * to.scale(), along.x * 6.0 * to.scale());
    to.stroke(*a - across, *a + across, kRuler, 2);
    to.stroke(*b - across, *b + across, kRuler, 2);
  }
  to.label((*a + *b) * 0.5, m.label, kRuler);
}

void draw_angle(Drawing& to, const Measured& m) {
  glm::dvec2 sum(0.0);
  for (const Probe& probe : m.at) {
    const auto foot = to.pixel(probe.where);
    if (!foot) return;
    const auto out = to.pixel(probe.where + probe.point.normal);
    if (out && glm::distance(*foot, *out) > 0.0) {
      // As long as a normal seen from the side would be in 40 pixels.
      const glm::dvec3 right(glm::transpose(glm::dmat3(to.view().eye_from_world))[0]);
      const auto beside = to.pixel(probe.where + right);
      const double unit = beside ? glm::distance(*foot, *beside) : 1.0;
      to.stroke(*foot, *foot + (*out - *foot) * (40.0 * to.scale() / std::max(unit, 1e-9)), kRuler,
                2);
    }
    to.dot(*foot, kRuler);
    sum += *foot;
  }
  to.label(sum * 0.5, m.label, kRuler);
}

void draw_radius(Drawing& to, const Measured& m) {
  const Probe& probe = m.at[0];
  const csg::RoundFit& fit = probe.round;
  const auto pixel = to.pixel(probe.where);
  if (!pixel) return;
  using Kind = csg::RoundFit::Kind;
  if (fit.kind == Kind::kNone || fit.kind == Kind::kFlat) {
    to.dot(*pixel, kRuler);
    return to.label(*pixel + glm::dvec2(0, -18.0 * to.scale()), m.label, kRuler);
  }
  const bool sphere = fit.kind == Kind::kSphere;
  const glm::dvec3 axis = sphere ? probe.point.normal : fit.axis;
  glm::dvec3 centre = fit.centre;
  if (!sphere) centre += axis * glm::dot(probe.where - centre, axis);
  const glm::dvec3 out = probe.where - centre;
  // On a sphere a great circle through the pick.
  glm::dvec3 u = glm::normalize(out - (sphere ? glm::dvec3(0.0) : axis * glm::dot(out, axis)));
  if (!(glm::length(out) > 1e-9 * fit.radius)) {
    u = glm::normalize(
        glm::cross(axis, std::abs(axis.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0)));
  }
  const glm::dvec3 side =
      sphere ? (std::abs(u.z) < 0.99 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0)) : axis;
  const glm::dvec3 v = glm::normalize(glm::cross(side, u));
  constexpr int kSides = 96;
  const auto on = [&](int i) {
    const double angle = 2.0 * std::numbers::pi * i / kSides;
    return centre + fit.radius * (std::cos(angle) * u + std::sin(angle) * v);
  };
  for (int i = 0; i < kSides; ++i) to.line(on(i), on(i + 1), kRuler, 1.5f, Hidden::kDashed, false);
  if (fit.kind == Kind::kCylinder) {
    const glm::dvec3 half = axis * (0.6 * fit.length);
    to.line(fit.centre - half, fit.centre + half, kRuler, 1, Hidden::kDashed, false);
  }
  to.line(centre, on(0), kRuler, 2, Hidden::kDashed);
  if (const auto middle = to.pixel(centre)) to.dot(*middle, kRuler);
  to.dot(*pixel, kRuler);
  if (const auto middle = to.pixel((centre + on(0)) * 0.5)) {
    to.label(*middle + glm::dvec2(0, -16.0 * to.scale()), m.label, kRuler);
  }
}

void draw_thickness(Drawing& to, const Measured& m) {
  const Probe& probe = m.at[0];
  const auto pixel = to.pixel(probe.where);
  if (!pixel) return;
  if (std::isfinite(probe.along_normal)) {
    const glm::dvec3 end = probe.where - probe.point.normal * probe.along_normal;
    to.line(probe.where, end, kRuler, 2, Hidden::kDashed);
    if (const auto there = to.pixel(end)) to.dot(*there, kRuler);
  }
  to.dot(*pixel, kRuler);
  to.label(*pixel + glm::dvec2(0, -20.0 * to.scale()), m.label, kRuler);
}

void draw_size(Drawing& to, const Measured& m) {
  const SolidSize& size = m.at[0].size;
  for (const Guide& edge : box_guide(to.view(), size.box).edges) {
    to.line(edge.from, edge.to, kRuler, 1, Hidden::kDashed, false);
  }
  if (const auto pixel = to.pixel(m.at[0].where)) to.label(*pixel, m.label, kRuler);
}

void draw_measured(Drawing& to, const Measured& m) {
  switch (m.tool) {
    case Tool::kDistance:
      return draw_distance(to, m);
    case Tool::kAngle:
      return draw_angle(to, m);
    case Tool::kRadius:
      return draw_radius(to, m);
    case Tool::kThickness:
      return draw_thickness(to, m);
    case Tool::kSize:
      return draw_size(to, m);
    case Tool::kNone:
      return;
  }
}

/// Ink that can be read on a ground, and its rim.
struct Inks {
  ImU32 ink, rim;
};
Inks inks_on(const glm::u8vec3& ground) {
  const float light = 0.3f * static_cast<float>(ground.r) + 0.59f * static_cast<float>(ground.g) +
                      0.11f * static_cast<float>(ground.b);
  return light > 128 ? Inks{IM_COL32(45, 50, 60, 255), IM_COL32(255, 255, 255, 160)}
                     : Inks{IM_COL32(225, 230, 240, 255), IM_COL32(0, 0, 0, 160)};
}

void draw_grid(Drawing& to, const GridGuide& grid, const Inks& inks) {
  for (const Guide& one : grid.lines) {
    to.line(one.from, one.to, faded(inks.ink, 0.22f), 1, Hidden::kGone, false);
  }
  for (const Guide& one : grid.strong) {
    to.line(one.from, one.to, faded(inks.ink, 0.45f), 1, Hidden::kGone, false);
  }
  if (const auto corner = to.pixel(grid.corner)) {
    to.plain(*corner + glm::dvec2(0, 12.0 * to.scale()), "grid " + number(grid.spacing), inks.ink,
             inks.rim);
  }
}

void draw_ticks(Drawing& to, const TicksGuide& ticks, const Inks& inks) {
  constexpr ImU32 kColours[] = {IM_COL32(230, 60, 60, 255), IM_COL32(50, 170, 60, 255),
                                IM_COL32(70, 120, 255, 255)};
  for (int axis = 0; axis < 3; ++axis) {
    const Guide& line = ticks.axes[axis];
    to.line(line.from, line.to, kColours[axis], 1.5f, Hidden::kDashed, false);
    const auto a = to.pixel(line.from), b = to.pixel(line.to);
    if (!a || !b || glm::distance(*a, *b) < 30.0) continue;  // it points at the eye
    const glm::dvec2 along = glm::normalize(*b - *a);
    glm::dvec2 across(-along.y, along.x);
    if (across.y < 0) across = -across;  // numbers stand below or beside the line
    for (const GuideLabel& mark : ticks.marks[axis]) {
      const auto at = to.pixel(mark.at);
      if (!at) continue;
      const float shown = is_hidden(to.view(), to.depth(), mark.at) ? 0.45f : 1.0f;
      to.stroke(*at - across * (4.0 * to.scale()), *at + across * (4.0 * to.scale()),
                faded(kColours[axis], shown), 1.5f, false);
      to.plain(*at + across * (15.0 * to.scale()), mark.text, faded(kColours[axis], shown),
               faded(inks.rim, shown * shown));
    }
  }
}

void draw_scale_bar(Drawing& to, const Area& area, const ScaleBar& bar, bool perspective,
                    const Inks& inks) {
  const double s = to.scale();
  const glm::dvec2 middle(area.size.x * 0.5, area.size.y - 24.0 * s);
  const glm::dvec2 half(bar.pixels * 0.5, 0), up(0, 5.0 * s);
  const ImU32 ink = inks.ink;
  to.stroke(middle - half, middle + half, ink, 2, false);
  to.stroke(middle - half - up, middle - half + up, ink, 2, false);
  to.stroke(middle + half - up, middle + half + up, ink, 2, false);
  to.plain(middle - glm::dvec2(0, 13.0 * s),
           number(bar.length) + (perspective ? " at the target" : ""), ink, inks.rim);
}

}  // namespace

void Panels::guides(const Viewer& viewer, const Area& area) {
  const Frame& frame = *viewer.frame();
  const MeasureBoard& board = viewer.board();
  if (frame.wanted != area.size || viewer.model() == nullptr) return;
  const auto view =
      make_view(frame.camera, frame.wanted, frame.box.empty() ? viewer.model()->box : frame.box);
  if (!view) return;
  const csg::ColourScheme* scheme = viewer.picture_options().scheme;
  if (scheme == nullptr) scheme = &csg::default_scheme();
  const Inks inks = inks_on(scheme->background);
  Drawing to(area, *view, frame.depth, scale_);
  const double pixel = world_per_pixel(frame.camera, frame.wanted);
  if (board.grid) draw_grid(to, grid_guide(frame.box, pixel * static_cast<double>(scale_)), inks);
  if (board.ticks)
    draw_ticks(to, ticks_guide(frame.box, pixel * static_cast<double>(scale_)), inks);
  if (board.box && !frame.box.empty()) {
    const BoxGuide box = box_guide(*view, frame.box);
    for (const Guide& edge : box.edges) {
      to.line(edge.from, edge.to, faded(inks.ink, 0.8f), 1, Hidden::kDashed, false);
    }
    for (const GuideLabel& size : box.sizes) {
      if (const auto at = to.pixel(size.at)) to.label(*at, size.text);
    }
  }
  if (board.scale_bar) {
    draw_scale_bar(to, area, scale_bar(pixel, 180.0 * static_cast<double>(scale_)),
                   frame.camera.projection == Projection::kPerspective, inks);
  }
  for (const Measured& m : board.done()) draw_measured(to, m);
  for (const Probe& probe : board.pending()) {
    if (const auto at = to.pixel(probe.where)) to.dot(*at, kRuler, probe.snap != csg::Snap::kFace);
  }
  const std::string advice = board.advice();
  if (!advice.empty()) to.label({area.size.x * 0.5, 18.0 * static_cast<double>(scale_)}, advice);
}

}  // namespace strata::view
