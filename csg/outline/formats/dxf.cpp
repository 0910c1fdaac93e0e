// Outlines from DXF (Autodesk, "DXF Reference"). Curves have as many segments as in OpenSCAD.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <initializer_list>
#include <numbers>
#include <optional>
#include <set>
#include <string_view>

#include "csg/outline/formats/dxf_file.h"
#include "csg/outline/formats/line_joiner.h"
#include "csg/outline/formats/outline_import.h"

namespace strata::csg {
namespace {

constexpr double kPi = std::numbers::pi;
/// Most lines that a file may make, including those of nested blocks.
constexpr std::size_t kMostLines = 5'000'000;
constexpr int kDeepest = 64;

/// The numbers of an entity, by group code.
class Values {
 public:
  Values(const DxfEntity& entity, const std::string& name) : entity_(entity), name_(name) {}

  /// The first value of `code`, or the fallback. `error` remembers a malformed number.
  double number(int code, double fallback) {
    for (const DxfGroup& group : entity_.groups) {
      if (group.code != code) continue;
      const auto value = dxf_number(group, name_);
      if (value) return *value;
      if (!error) error = value.error();
    }
    return fallback;
  }
  /// The first value of `code`, which must be present.
  double needed(int code) {
    const double value = number(code, std::nan(""));
    if (std::isnan(value) && !error) {
      error = Error{ErrorCode::kInput, fmt::format("{}:{}: {} has no group {}", name_, entity_.line,
                                                   entity_.type, code)};
    }
    return value;
  }
  glm::dvec2 point(int code) { return {needed(code), needed(code + 10)}; }
  int flags() { return static_cast<int>(std::clamp(number(70, 0), 0.0, 1e6)); }
  std::string_view text(int code) const {
    for (const DxfGroup& group : entity_.groups) {
      if (group.code == code) return group.value;
    }
    return {};
  }
  /// All values of `code`, in order.
  std::vector<double> all(int code) {
    std::vector<double> values;
    for (const DxfGroup& group : entity_.groups) {
      if (group.code != code) continue;
      const auto value = dxf_number(group, name_);
      if (!value && !error) error = value.error();
      values.push_back(value.value_or(0));
    }
    return values;
  }

  std::optional<Error> error;

 private:
  const DxfEntity& entity_;
  const std::string& name_;
};

/// p' = rotation and scale * p + shift.
struct Placement {
  glm::dvec2 x{1, 0}, y{0, 1}, shift{0};
  glm::dvec2 operator()(const glm::dvec2& p) const { return x * p.x + y * p.y + shift; }
  Placement operator*(const Placement& inner) const {
    return {x * inner.x.x + y * inner.x.y, x * inner.y.x + y * inner.y.y, (*this)(inner.shift)};
  }
};

class Drawing {
 public:
  Drawing(const DxfFile& file, const std::string& name, const OutlineImport& options,
          const Execution& execution)
      : file_(file), name_(name), options_(options), execution_(execution) {}

  Result<Outline> run(std::vector<std::string>* warnings) {
    coordinate_unit_ = last_place({10, 11, 20, 21, 40});
    angle_unit_ = last_place({50, 51});
    parameter_unit_ = last_place({41, 42});
    bool found = options_.layer.empty() || file_.entities.empty();
    for (const DxfEntity& entity : file_.entities) {
      if (!options_.layer.empty() && entity.layer != options_.layer) continue;
      found = true;
      outermost_ = static_cast<std::uint32_t>(&entity - file_.entities.data());
      if (auto done = draw(entity, {}, 0); !done) return tl::unexpected(done.error());
    }
    if (!found) {
      return fail(ErrorCode::kInput, "{}: layer '{}' is empty; there {}", name_, options_.layer,
                  layers());
    }
    // OpenSCAD snaps to a grid, which joins ends up to 1.5 of its steps apart (units of the scene).
    constexpr double kOpenScad = 1.5e-5;
    if (options_.scale == 0) return Outline{};
    JoinedLines joined = joiner_.join(kOpenScad / std::abs(options_.scale), execution_.stop);
    if (warnings) note_open(joined.open, *warnings);
    for (auto& path : joined.paths) {
      for (glm::dvec2& p : path) p = (p - options_.origin) * options_.scale;
    }
    OutlineJob job(execution_);
    Outline outline = clean({std::move(joined.paths)}, Fill::kEvenOdd, &job);
    if (job.ended()) return fail(job.error->code, "{}: {}", name_, job.error->message);
    return outline;
  }

 private:
  /// The names of the layers that are not empty, for a message; the first few if there are many.
  [[nodiscard]] std::string layers() const {
    constexpr std::size_t kMost = 8;
    std::set<std::string_view> names;
    for (const DxfEntity& entity : file_.entities) names.insert(entity.layer);
    std::string text = names.size() == 1 ? "is" : "are";
    std::size_t count = 0;
    for (const std::string_view name : names) {
      if (count == kMost) return text + fmt::format(" and {} more", names.size() - kMost);
      text += fmt::format("{} '{}'", count++ == 0 ? "" : ",", name);
    }
    return text;
  }

  /// One unit of the last decimal place that the file writes in these groups. 0 if the file writes
  /// fewer than three places: such numbers are taken as exact.
  [[nodiscard]] double last_place(std::initializer_list<int> codes) const {
    int most = 0;
    const auto look = [&](const DxfEntity& entity) {
      for (const DxfGroup& group : entity.groups) {
        if (std::find(codes.begin(), codes.end(), group.code) == codes.end()) continue;
        const std::size_t point = group.value.find('.');
        if (point == std::string_view::npos) continue;
        const std::size_t end = std::min(group.value.find_first_of("eE"), group.value.size());
        if (end > point && end == group.value.size()) {
          most = std::max(most, static_cast<int>(std::min<std::size_t>(end - point - 1, 100)));
        }
      }
    };
    const auto look_at_all = [&](const std::vector<DxfEntity>& entities) {
      for (const DxfEntity& entity : entities) {
        look(entity);
        for (const DxfEntity& part : entity.parts) look(part);
      }
    };
    look_at_all(file_.entities);
    for (const auto& [name, block] : file_.blocks) look_at_all(block.entities);
    constexpr int kFewest = 3;
    return most < kFewest ? 0.0 : std::pow(10.0, -most);
  }

  /// How far an end of an entity may lie from its intended position, in units of the drawing.
  /// Numbers are rounded to half a unit along both axes; the factor leaves some room for the
  /// arithmetic.
  [[nodiscard]] double reach_of(const DxfEntity& entity, Values& values,
                                const Placement& place) const {
    constexpr double kBoth = 0.75;
    double reach = kBoth * coordinate_unit_;
    if (entity.type == "ARC") {
      reach +=
          kBoth * (coordinate_unit_ + std::abs(values.number(40, 0)) * angle_unit_ * kPi / 180);
    } else if (entity.type == "ELLIPSE") {
      reach += kBoth * (2 * coordinate_unit_ + glm::length(values.point(11)) * parameter_unit_);
    }
    return reach * std::max(glm::length(place.x), glm::length(place.y));
  }

  /// Warns of contours that are open and of lines that belong to no contour and are left out.
  void note_open(const std::vector<OpenPath>& open, std::vector<std::string>& warnings) const {
    for (const bool lines : {false, true}) {
      std::size_t count = 0;
      const OpenPath* first = nullptr;
      for (const OpenPath& path : open) {
        if (path.is_line != lines) continue;
        if (count++ == 0) first = &path;
      }
      if (!first) continue;
      const DxfEntity& entity = file_.entities[first->tag];
      const std::string place =
          fmt::format("({:.9g}, {:.9g}) {} ({:.9g}, {:.9g}) in layer '{}', {:.3g} apart",
                      first->from.x, first->from.y, lines ? "to" : "and", first->to.x, first->to.y,
                      entity.layer.substr(0, 80), glm::distance(first->from, first->to));
      const char* text =
          count == 1
              ? (lines ? "{}:{}: {} line is part of no contour and is left out; it leads from {}"
                       : "{}:{}: {} contour does not close; it ends at {}; a straight line "
                         "closes it")
              : (lines ? "{}:{}: {} lines are part of no contour and are left out; the first "
                         "leads from {}"
                       : "{}:{}: {} contours do not close; the first ends at {}; a straight "
                         "line closes each");
      warnings.push_back(fmt::format(fmt::runtime(text), name_, entity.line, count, place));
    }
  }

  Result<void> draw(const DxfEntity& entity, const Placement& place, int depth) {
    if (execution_.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    if (joiner_.size() > kMostLines || ++drawn_ > kMostLines) {
      return fail(ErrorCode::kLimit, "{}:{}: more than {} lines or entities", name_, entity.line,
                  kMostLines);
    }
    Values values(entity, name_);
    std::vector<glm::dvec2> path;
    bool closed = false;
    Result<void> done;
    if (entity.type == "LINE") {
      path = {values.point(10), values.point(11)};
    } else if (entity.type == "CIRCLE") {
      path = arc(values.point(10), values.needed(40), 0, 360, place);
      closed = true;
      if (!path.empty()) path.pop_back();
    } else if (entity.type == "ARC") {
      const double from = values.needed(50), to = values.needed(51);
      path = arc(values.point(10), values.needed(40), from, to, place);
    } else if (entity.type == "ELLIPSE") {
      path = ellipse(values, place);
    } else if (entity.type == "LWPOLYLINE") {
      closed = (values.flags() & 1) != 0;
      path = bulged(light_vertices(entity, values), closed, place);
    } else if (entity.type == "POLYLINE") {
      constexpr int kClosed = 1, kMeshOrFaces = 16 | 64;
      if ((values.flags() & kMeshOrFaces) != 0) return {};
      closed = (values.flags() & kClosed) != 0;
      auto vertices = heavy_vertices(entity);
      if (!vertices) return tl::unexpected(vertices.error());
      path = bulged(*vertices, closed, place);
    } else if (entity.type == "SPLINE") {
      closed = (values.flags() & 1) != 0;
      path = spline(entity, values, place);
    } else if (entity.type == "INSERT") {
      done = insert(entity, values, place, depth);
    }
    if (values.error) return tl::unexpected(*values.error);
    if (!done) return done;
    if (closed && path.size() > 2) path.push_back(path.front());
    const double reach = path.empty() ? 0.0 : reach_of(entity, values, place);
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      joiner_.add(place(path[i]), place(path[i + 1]), reach, outermost_);
    }
    return {};
  }

  /// The number of segments of a full circle of this radius at its place.
  double segments(double radius, const Placement& place) const {
    return options_.segments.count(std::abs(radius * options_.scale) * glm::length(place.x));
  }

  std::vector<glm::dvec2> arc(const glm::dvec2& centre, double radius, double from, double to,
                              const Placement& place) const {
    if (!std::isfinite(radius) || !std::isfinite(from) || !std::isfinite(to)) return {};
    double sweep = std::fmod(to - from, 360.0);
    if (sweep < 0 || (sweep == 0 && to != from)) sweep += 360.0;
    const int steps = static_cast<int>(std::ceil(segments(radius, place) * sweep / 360.0));
    std::vector<glm::dvec2> path;
    for (int i = 0; i <= steps; ++i) {
      const double angle = from + sweep * i / std::max(steps, 1);
      path.push_back(centre + radius * glm::dvec2(cos_degrees(angle), sin_degrees(angle)));
    }
    return path;
  }

  std::vector<glm::dvec2> ellipse(Values& values, const Placement& place) const {
    const glm::dvec2 centre = values.point(10), major = values.point(11);
    const double ratio = values.needed(40), from = values.number(41, 0);
    const double to = values.number(42, 2 * kPi);
    if (values.error) return {};
    const glm::dvec2 minor = ratio * glm::dvec2(-major.y, major.x);
    double sweep = std::fmod(to - from, 2 * kPi);
    if (sweep <= 0) sweep += 2 * kPi;
    if (std::abs(to - from) >= 2 * kPi * (1 - 1e-12)) sweep = 2 * kPi;
    const double whole = segments(glm::length(major), place);
    const int steps = static_cast<int>(std::ceil(whole * sweep / (2 * kPi) * (1 - 1e-12)));
    std::vector<glm::dvec2> path;
    for (int i = 0; i <= steps; ++i) {
      const double angle = from + sweep * i / std::max(steps, 1);
      path.push_back(centre + std::cos(angle) * major + std::sin(angle) * minor);
    }
    return path;
  }

  struct Vertex {
    glm::dvec2 p{0};
    double bulge = 0;
  };

  std::vector<Vertex> light_vertices(const DxfEntity& entity, Values& values) const {
    // Groups 10, 20 and 42 repeat; each 10 begins a vertex.
    const std::vector<double> xs = values.all(10), ys = values.all(20);
    if (xs.size() != ys.size() && !values.error) {
      values.error =
          Error{ErrorCode::kInput, fmt::format("{}:{}: LWPOLYLINE has {} x and {} y", name_,
                                               entity.line, xs.size(), ys.size())};
    }
    std::vector<Vertex> vertices(std::min(xs.size(), ys.size()));
    for (std::size_t i = 0; i < vertices.size(); ++i) vertices[i].p = {xs[i], ys[i]};
    std::size_t begun = 0;
    for (const DxfGroup& group : entity.groups) {
      if (group.code == 10) ++begun;
      if (group.code != 42 || begun == 0 || begun > vertices.size()) continue;
      vertices[begun - 1].bulge = dxf_number(group, name_).value_or(0);
    }
    return vertices;
  }

  Result<std::vector<Vertex>> heavy_vertices(const DxfEntity& entity) const {
    std::vector<Vertex> vertices;
    for (const DxfEntity& part : entity.parts) {
      Values values(part, name_);
      constexpr int kFrameOfCurve = 16;
      if ((values.flags() & kFrameOfCurve) != 0) continue;  // not a point of the curve
      const glm::dvec2 p = values.point(10);
      const double bulge = values.number(42, 0);
      if (values.error) return tl::unexpected(*values.error);
      vertices.push_back({p, bulge});
    }
    return vertices;
  }

  /// Replaces edges with a bulge by arcs. The bulge is the tangent of a quarter of the arc's angle.
  std::vector<glm::dvec2> bulged(const std::vector<Vertex>& vertices, bool closed,
                                 const Placement& place) const {
    std::vector<glm::dvec2> path;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const auto& [p, bulge] = vertices[i];
      path.push_back(p);
      if (bulge == 0 || (i + 1 == vertices.size() && !closed)) continue;
      const glm::dvec2 q = vertices[(i + 1) % vertices.size()].p, half = (q - p) / 2.0;
      const double sweep = 4 * std::atan(bulge);
      // The centre lies at this distance from the middle of the edge, over half its length.
      const double beside = (1 - bulge * bulge) / (2 * bulge);
      const glm::dvec2 centre = p + half + beside * glm::dvec2(-half.y, half.x);
      const glm::dvec2 arm = p - centre;
      const double whole = segments(glm::length(arm), place);
      const int steps = static_cast<int>(std::ceil(whole * std::abs(sweep) / (2 * kPi)));
      for (int k = 1; k < steps; ++k) {
        const double a = sweep * k / steps, c = std::cos(a), s = std::sin(a);
        path.push_back(centre + glm::dvec2(c * arm.x - s * arm.y, s * arm.x + c * arm.y));
      }
    }
    return path;
  }

  /// The points of a B-spline, by de Boor's algorithm (rational if it has weights), or its fit
  /// points.
  std::vector<glm::dvec2> spline(const DxfEntity& entity, Values& values,
                                 const Placement& place) const {
    const auto points_of = [&](int code) {
      const std::vector<double> xs = values.all(code), ys = values.all(code + 10);
      std::vector<glm::dvec3> points;
      for (std::size_t i = 0; i < std::min(xs.size(), ys.size()); ++i) {
        points.emplace_back(xs[i], ys[i], 1);
      }
      return points;
    };
    std::vector<glm::dvec3> points = points_of(10);
    const std::vector<double> knots = values.all(40), weights = values.all(41);
    const auto degree = static_cast<std::size_t>(std::clamp(values.number(71, 3), 1.0, 15.0));
    std::vector<glm::dvec2> path;
    if (values.error) return path;
    if (points.empty()) {
      for (const glm::dvec3& p : points_of(11)) path.emplace_back(p);
      return path;
    }
    if (points.size() <= degree || knots.size() != points.size() + degree + 1 ||
        !std::is_sorted(knots.begin(), knots.end())) {
      values.error = Error{ErrorCode::kInput,
                           fmt::format("{}:{}: SPLINE of degree {} has {} points and {} knots",
                                       name_, entity.line, degree, points.size(), knots.size())};
      return path;
    }
    for (std::size_t i = 0; i < std::min(weights.size(), points.size()); ++i)
      points[i] *= weights[i];
    // Each span has as many steps as a curve of a letter or SVG drawing: an eighth of a circle.
    glm::dvec2 low(points[0] / points[0].z), high = low;
    for (const glm::dvec3& p : points)
      low = glm::min(low, glm::dvec2(p)), high = glm::max(high, glm::dvec2(p));
    const int steps =
        std::max(static_cast<int>(segments(glm::distance(low, high) / 2, place)) / 8 + 1, 4);
    std::vector<glm::dvec3> work(degree + 1);
    for (std::size_t span = degree; span < points.size(); ++span) {
      if (!(knots[span] < knots[span + 1])) continue;
      for (int k = path.empty() ? 0 : 1; k <= steps; ++k) {
        const double t = knots[span] + (knots[span + 1] - knots[span]) * k / steps;
        for (std::size_t j = 0; j <= degree; ++j) work[j] = points[span - degree + j];
        for (std::size_t r = 1; r <= degree; ++r) {
          for (std::size_t j = degree; j >= r; --j) {
            const double from = knots[span - degree + j], to = knots[span + 1 + j - r];
            const double a = to > from ? (t - from) / (to - from) : 0.0;
            work[j] = (1 - a) * work[j - 1] + a * work[j];
          }
        }
        if (work[degree].z != 0) path.push_back(glm::dvec2(work[degree]) / work[degree].z);
      }
    }
    return path;
  }

  Result<void> insert(const DxfEntity& entity, Values& values, const Placement& place, int depth) {
    const std::string_view block_name = values.text(2);
    const auto block = file_.blocks.find(block_name);
    if (block == file_.blocks.end()) {
      return fail(ErrorCode::kInput, "{}:{}: INSERT refers to block '{}', which is not in the file",
                  name_, entity.line, std::string(block_name));
    }
    if (depth >= kDeepest) {
      return fail(ErrorCode::kInput, "{}:{}: blocks are nested {} deep; one may contain itself",
                  name_, entity.line, depth);
    }
    const double angle = values.number(50, 0);
    const glm::dvec2 scale(values.number(41, 1), values.number(42, 1)), at = values.point(10);
    const auto columns = static_cast<int>(std::clamp(values.number(70, 1), 1.0, 1e4));
    const auto rows = static_cast<int>(std::clamp(values.number(71, 1), 1.0, 1e4));
    const glm::dvec2 spacing(values.number(44, 0), values.number(45, 0));
    if (values.error) return {};
    const glm::dvec2 x(cos_degrees(angle), sin_degrees(angle)), y(-x.y, x.x);
    if (block->second.entities.empty()) return {};
    for (int i = 0; i < columns; ++i) {
      for (int j = 0; j < rows; ++j) {
        const glm::dvec2 corner = at + x * (spacing.x * i) + y * (spacing.y * j);
        Placement inner{x * scale.x, y * scale.y, corner};
        inner.shift = inner(-block->second.base);
        for (const DxfEntity& part : block->second.entities) {
          if (auto done = draw(part, place * inner, depth + 1); !done) return done;
        }
      }
    }
    return {};
  }

  const DxfFile& file_;
  const std::string& name_;
  const OutlineImport& options_;
  const Execution& execution_;
  LineJoiner joiner_;
  double coordinate_unit_ = 0, angle_unit_ = 0, parameter_unit_ = 0;  ///< last decimal places
  std::uint32_t outermost_ = 0;  ///< the entity of the file that is drawn, possibly through blocks
  std::size_t drawn_ = 0;  ///< entities drawn; those of a block count each time it is inserted
};

}  // namespace

Result<Outline> read_dxf(std::string_view text, const std::string& name,
                         const OutlineImport& options, const Execution& execution,
                         std::vector<std::string>* warnings) {
  const auto file = parse_dxf(text, name, execution.stop);
  if (!file) return tl::unexpected(file.error());
  if (!std::isfinite(options.scale) || !std::isfinite(options.origin.x) ||
      !std::isfinite(options.origin.y)) {
    return fail(ErrorCode::kInput, "{}: the origin and the scale must be finite", name);
  }
  return Drawing(*file, name, options, execution).run(warnings);
}

}  // namespace strata::csg
