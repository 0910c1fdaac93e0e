// The bridge to Clipper 6 (Debian: libpolyclipping), which works on integers. Its exceptions and
// its header stay here.
#include "csg/scene/outline_clip.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <new>
#include <numbers>
#include <polyclipping/clipper.hpp>
#include <unordered_map>
#include <utility>

#include "csg/scene/orient.h"

namespace strata::csg {
namespace {

using ClipperLib::IntPoint;
using ClipperLib::Path;
using ClipperLib::Paths;

/// Coordinates on the grid stay below 2^kGridBits. More than this and Clipper's own arithmetic in
/// double would round by more than a step of the grid; offsets leave room for long mitres.
constexpr int kGridBits = 45, kOffsetGridBits = 38;

struct PointHash {
  std::size_t operator()(const IntPoint& p) const {
    const auto x = static_cast<std::uint64_t>(p.X), y = static_cast<std::uint64_t>(p.Y);
    std::uint64_t h = x * 0x9e3779b97f4a7c15u ^ (y + 0x7f4a7c15u) * 0xc2b2ae3d27d4eb4fu;
    return static_cast<std::size_t>(h ^ (h >> 29));
  }
};

/// Between doubles and a grid of a power of two around the middle of the operands. A point of the
/// grid that an operand has becomes that operand's point again, to the last bit: walls that met
/// before an operation meet after it.
class Grid {
 public:
  Grid(std::span<const Outline> operands, int bits, double margin = 0.0) {
    glm::dvec2 low(std::numeric_limits<double>::infinity()), high = -low;
    std::size_t count = 0;
    for (const Outline& operand : operands) {
      for (const auto& contour : operand.contours) {
        if (!usable(contour)) continue;
        count += contour.size();
        for (const glm::dvec2& p : contour) low = glm::min(low, p), high = glm::max(high, p);
      }
    }
    if (count == 0) return;
    const double extent = std::max({high.x - low.x, high.y - low.y, 0x1p-1000}) / 2.0 + margin;
    int exponent = 0;
    std::frexp(extent, &exponent);
    shift_ = bits - exponent;
    // The middle lies on a coarse grid, so that short binary fractions are on the fine one.
    const double coarse = std::ldexp(1.0, exponent - 1);
    centre_ = glm::round((low / 2.0 + high / 2.0) / coarse) * coarse;
    originals_.reserve(count);
  }

  IntPoint to_grid(const glm::dvec2& p) const {
    const glm::dvec2 q = p - centre_;
    return {std::llround(std::ldexp(q.x, shift_)), std::llround(std::ldexp(q.y, shift_))};
  }

  Paths to_grid(const Outline& outline, bool remember = true) {
    Paths paths;
    for (const auto& contour : outline.contours) {
      if (!usable(contour)) continue;
      Path& path = paths.emplace_back();
      path.reserve(contour.size());
      for (const glm::dvec2& p : contour) {
        path.push_back(to_grid(p));
        if (remember) originals_.try_emplace(path.back(), p);
      }
    }
    return paths;
  }

  Outline from_grid(const Paths& paths) const {
    Outline outline;
    Path cleaned;
    for (const Path& path : paths) {
      // Points that are a step of the grid apart, or off a straight line, come from rounding.
      ClipperLib::CleanPolygon(path, cleaned);
      if (cleaned.size() < 3) continue;
      auto& contour = outline.contours.emplace_back();
      contour.reserve(cleaned.size());
      for (const IntPoint& p : cleaned) contour.push_back(from_grid(p));
    }
    return outline;
  }

  glm::dvec2 from_grid(const IntPoint& p) const {
    if (const auto found = originals_.find(p); found != originals_.end()) return found->second;
    return centre_ + glm::dvec2(std::ldexp(static_cast<double>(p.X), -shift_),
                                std::ldexp(static_cast<double>(p.Y), -shift_));
  }

  double length(double world) const { return std::ldexp(world, shift_); }

 private:
  /// Contours with numbers that are not finite, or too large, are left out.
  static bool usable(const std::vector<glm::dvec2>& contour) {
    return contour.size() >= 3 && std::all_of(contour.begin(), contour.end(), [](const auto& p) {
             return std::abs(p.x) < kMostCoordinate && std::abs(p.y) < kMostCoordinate;
           });
  }

  glm::dvec2 centre_{0};
  int shift_ = 0;
  std::unordered_map<IntPoint, glm::dvec2, PointHash> originals_;
};

Paths execute(ClipperLib::ClipType type, const Paths& subject, const Paths& clip,
              ClipperLib::PolyFillType fill) {
  Paths result;
  try {
    ClipperLib::Clipper clipper;
    const bool has_subject = clipper.AddPaths(subject, ClipperLib::ptSubject, true);
    const bool has_clip = clipper.AddPaths(clip, ClipperLib::ptClip, true);
    if (!has_subject && !has_clip) return {};  // nothing has an area
    // It catches what it throws inside, above all that memory has run out.
    if (!clipper.Execute(type, result, fill, fill)) throw std::bad_alloc();
  } catch (const ClipperLib::clipperException&) {
    return {};  // a coordinate out of range; the grid excludes it
  }
  return result;
}

/// Union of counter-clockwise paths, halved until it is small: Clipper's sweep is quadratic in the
/// edges that are active at once, and most edges vanish early.
Paths unite_in_halves(std::span<const Paths> parts) {
  constexpr std::size_t kAtOnce = 8000;
  std::size_t points = 0;
  for (const Paths& part : parts) {
    for (const Path& path : part) points += path.size();
  }
  if (parts.size() <= 1 || points <= kAtOnce) {
    Paths all;
    for (const Paths& part : parts) all.insert(all.end(), part.begin(), part.end());
    return execute(ClipperLib::ctUnion, all, {}, ClipperLib::pftNonZero);
  }
  const std::size_t half = parts.size() / 2;
  Paths left = unite_in_halves(parts.first(half));
  const Paths right = unite_in_halves(parts.subspan(half));
  left.insert(left.end(), right.begin(), right.end());
  return execute(ClipperLib::ctUnion, left, {}, ClipperLib::pftNonZero);
}

Outline offset(const Outline& outline, double delta, ClipperLib::JoinType join, int segments) {
  if (outline.empty() || !std::isfinite(delta)) return {};
  if (delta == 0) return outline;
  Grid grid(std::span(&outline, 1), kOffsetGridBits, std::abs(delta));
  const double size = std::abs(grid.length(delta));
  // Clipper makes an arc of as many steps as keep it within the tolerance of the circle.
  const double tolerance = size * (1.0 - std::cos(std::numbers::pi / std::max(segments, 3)));
  constexpr double kMitreLimit = 1e6;
  Paths result;
  try {
    ClipperLib::ClipperOffset work(join == ClipperLib::jtMiter ? kMitreLimit : 2.0, tolerance);
    work.AddPaths(grid.to_grid(outline, false), join, ClipperLib::etClosedPolygon);
    work.Execute(result, grid.length(delta));
  } catch (const ClipperLib::clipperException&) {
    return {};
  }
  return grid.from_grid(result);
}

bool is_convex(const Outline& outline) {
  if (outline.contours.size() != 1) return false;
  const auto& c = outline.contours[0];
  // Every turn is to the left, and all of them make one turn: the direction goes up once only.
  std::size_t rises = 0;
  for (std::size_t i = 0; i < c.size(); ++i) {
    const glm::dvec2 &p = c[i], &q = c[(i + 1) % c.size()], &r = c[(i + 2) % c.size()];
    if (orient(p, q, r) < 0) return false;
    const bool up = q.y > p.y || (q.y == p.y && q.x > p.x);
    const bool then_up = r.y > q.y || (r.y == q.y && r.x > q.x);
    if (!up && then_up) ++rises;
  }
  return rises == 1;
}

/// What moving `shape` along the edges of `path` covers, one part for each edge.
void sweep_along(const Path& path, const Paths& shape, bool convex, std::vector<Paths>& parts) {
  for (std::size_t i = 0; i < path.size(); ++i) {
    const IntPoint p = path[i], q = path[(i + 1) % path.size()];
    Paths& part = parts.emplace_back();
    if (convex) {
      // Both ends of a convex shape and the edge between are convex: one hull.
      Outline ends;
      auto& points = ends.contours.emplace_back();
      for (const IntPoint& s : shape[0]) {
        points.emplace_back(static_cast<double>(s.X + p.X), static_cast<double>(s.Y + p.Y));
        points.emplace_back(static_cast<double>(s.X + q.X), static_cast<double>(s.Y + q.Y));
      }
      Path hull;
      for (const auto& contour : convex_hull(std::span(&ends, 1)).contours) {
        for (const glm::dvec2& h : contour) hull.emplace_back(std::llround(h.x), std::llround(h.y));
      }
      part.push_back(std::move(hull));
      continue;
    }
    for (const Path& contour : shape) {
      for (std::size_t j = 0; j < contour.size(); ++j) {
        const IntPoint s = contour[j], t = contour[(j + 1) % contour.size()];
        Path quad{{p.X + s.X, p.Y + s.Y},
                  {q.X + s.X, q.Y + s.Y},
                  {q.X + t.X, q.Y + t.Y},
                  {p.X + t.X, p.Y + t.Y}};
        if (!ClipperLib::Orientation(quad)) ClipperLib::ReversePath(quad);
        part.push_back(std::move(quad));
      }
    }
  }
}

Paths moved(const Paths& paths, const IntPoint& by) {
  Paths result = paths;
  for (Path& path : result) {
    for (IntPoint& p : path) p.X += by.X, p.Y += by.Y;
  }
  return result;
}

}  // namespace

Outline clean(const Outline& outline, Fill fill) {
  Grid grid(std::span(&outline, 1), kGridBits);
  const Paths paths = grid.to_grid(outline);
  return grid.from_grid(
      execute(ClipperLib::ctUnion, paths, {},
              fill == Fill::kEvenOdd ? ClipperLib::pftEvenOdd : ClipperLib::pftNonZero));
}

Outline unite(std::span<const Outline> operands) {
  if (operands.size() == 1) return operands[0];
  Grid grid(operands, kGridBits);
  std::vector<Paths> parts;
  for (const Outline& operand : operands) parts.push_back(grid.to_grid(operand));
  return grid.from_grid(unite_in_halves(parts));
}

Outline intersect(std::span<const Outline> operands) {
  if (operands.empty()) return {};
  for (const Outline& operand : operands) {
    if (operand.empty()) return {};
  }
  if (operands.size() == 1) return operands[0];
  Grid grid(operands, kGridBits);
  Paths result = grid.to_grid(operands[0]);
  for (const Outline& operand : operands.subspan(1)) {
    result =
        execute(ClipperLib::ctIntersection, result, grid.to_grid(operand), ClipperLib::pftNonZero);
  }
  return grid.from_grid(result);
}

Outline subtract(std::span<const Outline> operands) {
  if (operands.empty() || operands[0].empty()) return {};
  if (operands.size() == 1) return operands[0];
  Grid grid(operands, kGridBits);
  const Paths first = grid.to_grid(operands[0]);
  Paths others;
  for (const Outline& operand : operands.subspan(1)) {
    const Paths paths = grid.to_grid(operand);
    others.insert(others.end(), paths.begin(), paths.end());
  }
  return grid.from_grid(execute(ClipperLib::ctDifference, first, others, ClipperLib::pftNonZero));
}

Outline minkowski_sum(std::span<const Outline> operands) {
  Outline sum;
  for (const Outline& operand : operands) {
    if (operand.empty()) return {};  // no point to move anything to
    if (&operand == operands.data()) {
      sum = operand;
      continue;
    }
    // The grid must hold both around the same origin, and their sum.
    double reach = 0;
    for (const Outline* side : {&std::as_const(sum), &operand}) {
      double largest = 0;
      for (const auto& contour : side->contours) {
        for (const glm::dvec2& p : contour) {
          largest = std::max({largest, std::abs(p.x), std::abs(p.y)});
        }
      }
      reach += largest;
    }
    const Outline frame{{{{-reach, -reach}, {reach, -reach}, {reach, reach}, {-reach, reach}}}};
    Grid grid(std::span(&frame, 1), kGridBits);
    const bool sum_convex = is_convex(sum), operand_convex = is_convex(operand);
    const bool swap = sum_convex && !operand_convex;
    const Outline &path_side = swap ? operand : sum, &shape_side = swap ? sum : operand;
    const Paths paths = grid.to_grid(path_side, false), shape = grid.to_grid(shape_side, false);
    if (paths.empty() || shape.empty()) return {};
    std::vector<Paths> parts;
    for (const Path& path : paths) {
      sweep_along(path, shape, sum_convex || operand_convex, parts);
    }
    // The sum of the boundaries, and each side at one point of every piece of the other.
    for (const Path& path : shape) {
      if (ClipperLib::Orientation(path)) parts.push_back(moved(paths, path[0]));
    }
    for (const Path& path : paths) {
      if (ClipperLib::Orientation(path)) parts.push_back(moved(shape, path[0]));
    }
    sum = grid.from_grid(unite_in_halves(parts));
    if (sum.empty()) return {};
  }
  return sum;
}

Outline offset_round(const Outline& outline, double radius, const Segments& segments) {
  return offset(outline, radius, ClipperLib::jtRound, segments.count(std::abs(radius)));
}

Outline offset_delta(const Outline& outline, double delta, bool chamfer) {
  return offset(outline, delta, chamfer ? ClipperLib::jtSquare : ClipperLib::jtMiter, 0);
}

Outline stroke(std::span<const glm::dvec2> line, bool closed, double width, StrokeCap cap,
               StrokeJoin join, int segments) {
  if (line.empty() || !std::isfinite(width) || !(width > 0)) return {};
  Outline frame;
  frame.contours.emplace_back(line.begin(), line.end());
  frame.contours[0].resize(std::max<std::size_t>(line.size(), 3), line[0]);
  Grid grid(std::span(&frame, 1), kOffsetGridBits, width);
  Path path;
  for (const glm::dvec2& p : line) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) return {};
    path.push_back(grid.to_grid(p));
  }
  const double half = grid.length(width / 2.0);
  const auto joins = join == StrokeJoin::kMiter   ? ClipperLib::jtMiter
                     : join == StrokeJoin::kRound ? ClipperLib::jtRound
                                                  : ClipperLib::jtSquare;
  const auto ends = closed                     ? ClipperLib::etClosedLine
                    : cap == StrokeCap::kButt  ? ClipperLib::etOpenButt
                    : cap == StrokeCap::kRound ? ClipperLib::etOpenRound
                                               : ClipperLib::etOpenSquare;
  Paths result;
  try {
    constexpr double kMitreLimit = 4.0;  // of SVG
    ClipperLib::ClipperOffset work(
        kMitreLimit, half * (1.0 - std::cos(std::numbers::pi / std::max(segments, 3))));
    work.AddPath(path, joins, ends);
    work.Execute(result, half);
  } catch (const ClipperLib::clipperException&) {
    return {};
  }
  return grid.from_grid(result);
}

}  // namespace strata::csg
