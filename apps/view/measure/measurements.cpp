#include "apps/view/measure/measurements.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <utility>

namespace strata::view {
namespace {

constexpr ToolFacts kTools[] = {
    {Tool::kDistance,
     "distance",
     2,
     {.snap = true, .round = true},
     {"click on the first point", "click on the second point"}},
    {Tool::kAngle, "angle", 2, {}, {"click on the first face", "click on the second face"}},
    {Tool::kRadius, "radius", 1, {.round = true}, {"click on a round face", ""}},
    {Tool::kThickness, "thickness", 1, {.thickness = true}, {"click on a wall", ""}},
    {Tool::kSize, "size", 1, {.size = true}, {"click on a solid", ""}},
};

/// The size of the numbers that a difference is taken of.
double scale_of(const glm::dvec3& p) {
  return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
}

std::string place(const Probe& probe) {
  constexpr const char* kWords[] = {"", "vertex ", "midpoint ", "edge "};
  return kWords[static_cast<int>(probe.snap)] + numbers(probe.where, scale_of(probe.where));
}

void distance(Measured& m) {
  const glm::dvec3 a = m.at[0].where, b = m.at[1].where, d = b - a;
  const double scale = std::max(scale_of(a), scale_of(b));
  m.label = number(glm::length(d), scale);
  m.text = fmt::format("{}, dx {} dy {} dz {}, from {} to {}", m.label, number(d.x, scale),
                       number(d.y, scale), number(d.z, scale), place(m.at[0]), place(m.at[1]));
  const csg::RoundFit &p = m.at[0].round, &q = m.at[1].round;
  const auto turns = [](const csg::RoundFit& fit) {
    return fit.kind == csg::RoundFit::Kind::kCylinder || fit.kind == csg::RoundFit::Kind::kCircle;
  };
  if (!turns(p) || !turns(q) || glm::length(glm::cross(p.axis, q.axis)) > 1e-6) return;
  const glm::dvec3 between = q.centre - p.centre;
  const double apart = glm::length(between - p.axis * glm::dot(between, p.axis));
  if (apart > 1e-9 * scale) m.text += fmt::format(", axes {} apart", number(apart, scale));
}

void angle(Measured& m) {
  const csg::SurfacePoint &a = m.at[0].point, &b = m.at[1].point;
  const double between = glm::degrees(
      std::atan2(glm::length(glm::cross(a.normal, b.normal)), glm::dot(a.normal, b.normal)));
  if (between < 1e-4 || between > 180 - 1e-4) {
    const double apart = std::abs(glm::dot(b.where - a.where, a.normal));
    m.label = "parallel";
    m.text = fmt::format("parallel faces, {} apart", number(apart, scale_of(a.where)));
    return;
  }
  m.label = number(180 - between, 180) + "\xc2\xb0";
  m.text = fmt::format("{} degrees between the faces, {} between their normals",
                       number(180 - between, 180), number(between, 180));
}

void radius(Measured& m) {
  const csg::RoundFit& fit = m.at[0].round;
  const double scale = std::max(scale_of(fit.centre), fit.radius);
  using Kind = csg::RoundFit::Kind;
  if (fit.kind == Kind::kNone || fit.kind == Kind::kFlat) {
    m.label = fit.kind == Kind::kFlat ? "flat" : "not round";
    m.text = fit.kind == Kind::kFlat ? "no cylinder here: the face is flat"
                                     : "no cylinder here: the facets fit neither a cylinder nor a "
                                       "sphere";
    return;
  }
  const std::string diameter = number(2 * fit.radius, scale);
  m.label = "r " + number(fit.radius, scale);
  m.text = fmt::format("{}, diameter {}, ", number(fit.radius, scale), diameter);
  const std::string arc =
      fit.span < 360 ? fmt::format(", arc of {} degrees", number(fit.span, 360)) : "";
  if (fit.kind == Kind::kSphere) {
    m.text += fmt::format("{} around {}", fit.hollow ? "hollow sphere" : "sphere",
                          numbers(fit.centre, scale));
  } else if (fit.kind == Kind::kCircle) {
    m.text +=
        fmt::format("circle around {}, axis {}", numbers(fit.centre, scale), numbers(fit.axis));
  } else {
    // Some of the length of what is taken away may be air.
    const bool cut = m.at[0].point.cut;
    m.text += fmt::format("{} along {} through {}{}{}", fit.hollow ? "hole" : "cylinder",
                          numbers(fit.axis), numbers(fit.centre, scale),
                          cut ? "" : ", " + number(fit.length, scale) + " long", arc);
  }
  if (fit.deviation > 1e-4 * fit.radius) {
    m.text += fmt::format(", vertices up to {} off", number(fit.deviation, scale));
  }
}

std::string thick(double value) {
  if (std::isinf(value)) return "endless";
  return value > 0 ? number(value) : "nothing";
}

void thickness(Measured& m) {
  m.label = thick(m.at[0].along_normal);
  m.text = fmt::format("{} along the normal, {} along the ray", m.label, thick(m.at[0].along_ray));
}

void size(Measured& m) {
  const SolidSize& of = m.at[0].size;
  const glm::dvec3 sides = of.box.high - of.box.low;
  m.label = fmt::format("{} x {} x {}", number(sides.x), number(sides.y), number(sides.z));
  m.text = fmt::format("{}, volume {}, area {}", m.label, number(of.volume), number(of.area));
}

}  // namespace

const ToolFacts& facts_of(Tool tool) {
  return *std::find_if(std::begin(kTools), std::end(kTools) - 1,
                       [&](const ToolFacts& one) { return one.tool == tool; });
}

std::string number(double value, double scale) {
  if (std::abs(value) < 1e-9 * scale) value = 0;
  return fmt::format("{:.6g}", value);
}

double tidy(double value, double whole) {
  if (!(whole > 0.0)) return value;
  const double unit = std::pow(10.0, std::ceil(std::log10(whole)) - 6.0);
  return std::round(value / unit) * unit;
}

std::string numbers(const glm::dvec3& value, double scale) {
  return fmt::format("{} {} {}", number(value.x, scale), number(value.y, scale),
                     number(value.z, scale));
}

Measured measured(Tool tool, std::vector<Probe> at) {
  Measured result;
  result.tool = tool;
  result.at = std::move(at);
  switch (tool) {
    case Tool::kDistance:
      distance(result);
      break;
    case Tool::kAngle:
      angle(result);
      break;
    case Tool::kRadius:
      radius(result);
      break;
    case Tool::kThickness:
      thickness(result);
      break;
    case Tool::kSize:
      size(result);
      break;
    case Tool::kNone:
      break;
  }
  return result;
}

void MeasureBoard::take_up(Tool tool) {
  tool_ = tool;
  pending_.clear();
  missed_ = on_section_ = false;
}

std::string MeasureBoard::advice() const {
  if (tool_ == Tool::kNone) return {};
  const std::string_view next = facts_of(tool_).next[pending_.size() % 2];
  return fmt::format("{}{}; esc ends",
                     on_section_ ? "a section is no solid; "
                     : missed_   ? "there is no face; "
                                 : "",
                     next);
}

const Measured* MeasureBoard::take(Probe probe) {
  on_section_ = probe.hit && probe.section && tool_ == Tool::kSize;
  missed_ = !probe.hit || on_section_;
  if (missed_ || tool_ == Tool::kNone) return nullptr;
  pending_.push_back(std::move(probe));
  if (pending_.size() < facts_of(tool_).picks) return nullptr;
  ++completed_;
  if (done_.size() == kMost) done_.erase(done_.begin());
  done_.push_back(measured(tool_, std::exchange(pending_, {})));
  return &done_.back();
}

void MeasureBoard::say(std::string text) {
  if (!done_.empty()) done_.back().text = std::move(text);
}

void MeasureBoard::clear() {
  pending_.clear();
  done_.clear();
  missed_ = false;
}

}  // namespace strata::view
