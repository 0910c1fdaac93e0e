#include "csg/outline/formats/svg_path.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace strata::csg {
namespace {

constexpr double kPi = std::numbers::pi;

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool starts_number(char c) { return (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '+'; }

}  // namespace

void SvgScanner::skip() {
  while (at_ < text_.size()) {
    const char c = text_[at_];
    if (c != ' ' && c != ',' && c != '\t' && c != '\n' && c != '\r' && c != '\f') break;
    ++at_;
  }
}

bool SvgScanner::at_end() {
  skip();
  return at_ >= text_.size();
}

char SvgScanner::letter() {
  if (at_end() || !is_letter(text_[at_])) return 0;
  return text_[at_++];
}

bool SvgScanner::number_follows() { return !at_end() && starts_number(text_[at_]); }

bool SvgScanner::number(double& value) {
  if (!number_follows()) return false;
  const std::size_t from = at_ + (text_[at_] == '+' ? 1 : 0);
  if (from < text_.size() && is_letter(text_[from])) return false;  // neither inf nor nan
  const char* last = text_.data() + text_.size();
  const auto [end, error] = std::from_chars(text_.data() + from, last, value);
  constexpr double kLargest = 1e100;
  if (error != std::errc{} || !(std::abs(value) < kLargest)) return false;
  at_ = static_cast<std::size_t>(end - text_.data());
  return true;
}

bool SvgScanner::flag(bool& value) {
  if (at_end() || (text_[at_] != '0' && text_[at_] != '1')) return false;
  value = text_[at_++] == '1';
  return true;
}

namespace {

class PathReader {
 public:
  PathReader(std::string_view data, const Segments& segments) : scan_(data), segments_(segments) {}

  std::vector<SvgLine> run(std::string& error) {
    while (!scan_.at_end()) {
      const std::size_t at = scan_.position();
      const char letter = scan_.letter();
      if (letter != 0) command_ = letter;
      if (command_ == 0 || !step(letter != 0)) {
        error = fmt::format("path data is malformed at character {}", at + 1);
        break;
      }
    }
    std::erase_if(lines_, [](const SvgLine& line) { return line.points.size() < 2; });
    return std::move(lines_);
  }

 private:
  bool relative() const { return command_ >= 'a'; }
  bool point(glm::dvec2& p) {
    if (!scan_.number(p.x) || !scan_.number(p.y)) return false;
    if (relative()) p += here_;
    return true;
  }

  void line_to(const glm::dvec2& p) {
    if (lines_.empty() || lines_.back().closed) lines_.push_back({{start_}, false});
    if (lines_.back().points.back() != p) lines_.back().points.push_back(p);
    here_ = p;
  }

  void curve(const glm::dvec2& b, const glm::dvec2& c, const glm::dvec2& d) {
    const glm::dvec2 a = here_;
    const int steps = curve_steps();
    for (int i = 1; i <= steps; ++i) {
      const double t = static_cast<double>(i) / steps, s = 1 - t;
      line_to(i == steps ? d
                         : s * s * s * a + 3 * s * s * t * b + 3 * s * t * t * c + t * t * t * d);
    }
  }

  void conic(const glm::dvec2& b, const glm::dvec2& c) {
    const glm::dvec2 a = here_;
    const int steps = curve_steps();
    for (int i = 1; i <= steps; ++i) {
      const double t = static_cast<double>(i) / steps, s = 1 - t;
      line_to(i == steps ? c : s * s * a + 2 * s * t * b + t * t * c);
    }
  }

  int curve_steps() const {
    constexpr double kLeast = 20, kMost = 10000;
    return static_cast<int>(std::isfinite(segments_.fn) ? std::clamp(segments_.fn, kLeast, kMost)
                                                        : kLeast);
  }

  /// SVG 1.1, appendix F.6: converts an arc from end points to centre parameters.
  void arc(glm::dvec2 radius, double rotation, bool large, bool sweep, const glm::dvec2& to) {
    const glm::dvec2 from = here_;
    radius = glm::abs(radius);
    if (from == to) return;
    if (radius.x == 0 || radius.y == 0) return line_to(to);
    const double c = cos_degrees(rotation), s = sin_degrees(rotation);
    const glm::dvec2 half = (from - to) / 2.0;
    // Coordinates in the frame of the ellipse, scaled so that the ellipse is a unit circle.
    glm::dvec2 p = glm::dvec2(c * half.x + s * half.y, -s * half.x + c * half.y) / radius;
    const double square = glm::dot(p, p);
    if (square > 1) radius *= std::sqrt(square), p /= std::sqrt(square);
    const double rest = glm::dot(p, p);
    double beside = std::sqrt(std::max(1 / rest - 1, 0.0));
    if (large == sweep) beside = -beside;
    const glm::dvec2 centre = beside * glm::dvec2(p.y, -p.x);
    const glm::dvec2 u = p - centre, v = -p - centre;
    const double begin = std::atan2(u.y, u.x);
    double turn = std::atan2(v.y, v.x) - begin;
    if (sweep && turn < 0) turn += 2 * kPi;
    if (!sweep && turn > 0) turn -= 2 * kPi;
    const double fine = segments_.count(std::max(radius.x, radius.y)) * std::abs(turn) / (2 * kPi);
    const int steps = static_cast<int>(std::max(std::abs(turn) * 10 / kPi + 4, std::ceil(fine)));
    const glm::dvec2 middle = (from + to) / 2.0;
    for (int i = 1; i <= steps; ++i) {
      const double a = begin + turn * i / steps;
      const glm::dvec2 q = (centre + glm::dvec2(std::cos(a), std::sin(a))) * radius;
      line_to(i == steps ? to : middle + glm::dvec2(c * q.x - s * q.y, s * q.x + c * q.y));
    }
  }

  /// Reads one set of arguments of the command.
  bool step(bool fresh) {
    const char kind = static_cast<char>(command_ | 0x20);
    if (kind != 'm' && kind != 'z' && lines_.empty()) return false;  // path data begins with a move
    glm::dvec2 b(0), c(0), d(0);
    switch (kind) {
      case 'z':
        if (!fresh) return false;  // numbers after a close command are an error
        if (!lines_.empty()) {
          lines_.back().closed = true;
          auto& points = lines_.back().points;
          if (points.size() > 1 && points.back() == points.front()) points.pop_back();
        }
        here_ = start_;
        break;
      case 'm':
        if (!point(d)) return false;
        lines_.push_back({{d}, false});
        here_ = start_ = d;
        command_ = relative() ? 'l' : 'L';
        break;
      case 'l':
        if (!point(d)) return false;
        line_to(d);
        break;
      case 'h':
        if (!scan_.number(d.x)) return false;
        line_to({relative() ? here_.x + d.x : d.x, here_.y});
        break;
      case 'v':
        if (!scan_.number(d.y)) return false;
        line_to({here_.x, relative() ? here_.y + d.y : d.y});
        break;
      case 'c':
      case 's':
        b = last_ == 'c' ? 2.0 * here_ - control_ : here_;
        if ((kind == 'c' && !point(b)) || !point(c) || !point(d)) return false;
        curve(b, c, d);
        control_ = c;
        break;
      case 'q':
      case 't':
        b = last_ == 'q' ? 2.0 * here_ - control_ : here_;
        if ((kind == 'q' && !point(b)) || !point(d)) return false;
        conic(b, d);
        control_ = b;
        break;
      case 'a': {
        double rotation = 0;
        bool large = false, sweep = false;
        if (!scan_.number(b.x) || !scan_.number(b.y) || !scan_.number(rotation) ||
            !scan_.flag(large) || !scan_.flag(sweep) || !point(d)) {
          return false;
        }
        arc(b, rotation, large, sweep, d);
        break;
      }
      default:
        return false;
    }
    last_ = kind == 's' ? 'c' : kind == 't' ? 'q' : kind;
    return true;
  }

  SvgScanner scan_;
  const Segments& segments_;
  std::vector<SvgLine> lines_;
  char command_ = 0, last_ = 0;
  glm::dvec2 here_{0}, start_{0}, control_{0};
};

}  // namespace

std::vector<SvgLine> svg_path_lines(std::string_view data, const Segments& segments,
                                    std::string& error) {
  return PathReader(data, segments).run(error);
}

}  // namespace strata::csg
