// The bridge to Clipper 6 (Debian: libpolyclipping), which computes with integers. Its header is
// included here only, and its exceptions stay here.
#include "csg/outline/outline_clip.h"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <glm/common.hpp>
#include <limits>
#include <memory>
#include <mutex>
#include <new>
#include <numbers>
#include <polyclipping/clipper.hpp>
#include <thread>
#include <unordered_map>
#include <utility>

#include "mesh/polygons/plane_predicates.h"

namespace strata::csg {
namespace {

using ClipperLib::IntPoint;
using ClipperLib::Path;
using ClipperLib::Paths;

/// Coordinates on the grid stay below 2^kGridBits. With more bits Clipper's own arithmetic in
/// double would round by more than a step of the grid. Offsets need room for long mitres.
constexpr int kGridBits = 45, kOffsetGridBits = 38;

struct PointHash {
  std::size_t operator()(const IntPoint& p) const {
    const auto x = static_cast<std::uint64_t>(p.X), y = static_cast<std::uint64_t>(p.Y);
    std::uint64_t h = x * 0x9e3779b97f4a7c15u ^ (y + 0x7f4a7c15u) * 0xc2b2ae3d27d4eb4fu;
    return static_cast<std::size_t>(h ^ (h >> 29));
  }
};

/// Converts between doubles and an integer grid, whose step is a power of two and whose origin lies
/// near the middle of the operands. A point that an operand had before to_grid() comes back from
/// from_grid() bit for bit: walls that met before an operation meet after it.
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
    // The origin is a multiple of a coarse power of two, so that short binary fractions lie on the
    // fine grid.
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
      // Rounding makes points that are one step apart or nearly in line.
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
  /// Whether all coordinates are finite and small enough. Other contours are left out.
  static bool usable(const std::vector<glm::dvec2>& contour) {
    return contour.size() >= 3 && std::all_of(contour.begin(), contour.end(), [](const auto& p) {
             return std::abs(p.x) < kMostCoordinate && std::abs(p.y) < kMostCoordinate;
           });
  }

  glm::dvec2 centre_{0};
  int shift_ = 0;
  std::unordered_map<IntPoint, glm::dvec2, PointHash> originals_;
};

std::size_t count_points(const Paths& paths) {
  std::size_t points = 0;
  for (const Path& path : paths) points += path.size();
  return points;
}

/// Mirrors the paths at the diagonal and reverses them, so that outer contours stay
/// counter-clockwise.
void mirror(Paths& paths) {
  for (Path& path : paths) {
    for (IntPoint& p : path) std::swap(p.X, p.Y);
    std::reverse(path.begin(), path.end());
  }
}

/// Whether a sweep along x would have far fewer active edges at a time. Clipper sweeps along y, in
/// time that grows with the number of active edges; in a line of text all edges are active at once.
bool better_mirrored(const Paths& paths) {
  constexpr std::size_t kFewest = 1000;
  constexpr double kMuch = 4.0;
  if (count_points(paths) < kFewest) return false;
  double along_x = 0, along_y = 0;
  ClipperLib::IntRect box{INT64_MAX, INT64_MAX, INT64_MIN, INT64_MIN};
  for (const Path& path : paths) {
    IntPoint last = path.empty() ? IntPoint() : path.back();
    for (const IntPoint& p : path) {
      along_x += std::abs(static_cast<double>(p.X - last.X));
      along_y += std::abs(static_cast<double>(p.Y - last.Y));
      box.left = std::min(box.left, p.X), box.right = std::max(box.right, p.X);
      box.top = std::min(box.top, p.Y), box.bottom = std::max(box.bottom, p.Y);
      last = p;
    }
  }
  const double width = static_cast<double>(box.right - box.left);
  const double height = static_cast<double>(box.bottom - box.top);
  return along_y * width > kMuch * along_x * height;
}

/// Estimates from a sample how many pairs of edges cross. Returns 0 when too few of the sample
/// cross.
double estimate_crossings(const Paths& subject, const Paths& clip) {
  std::vector<std::pair<glm::dvec2, glm::dvec2>> edges;
  for (const Paths* paths : {&subject, &clip}) {
    for (const Path& path : *paths) {
      for (std::size_t i = 0; i < path.size(); ++i) {
        const IntPoint &p = path[i], &q = path[(i + 1) % path.size()];
        edges.emplace_back(glm::dvec2(p.X, p.Y), glm::dvec2(q.X, q.Y));
      }
    }
  }
  constexpr int kFirst = 20'000, kSamples = 200'000, kFewest = 10;
  std::uint64_t random = 1;
  const auto next = [&] {
    random = random * 6364136223846793005u + 1442695040888963407u;
    return static_cast<std::size_t>((random >> 33) % edges.size());
  };
  int crossing = 0;
  for (int i = 0; i < kSamples; ++i) {
    if (i == kFirst && crossing == 0) return 0;
    const auto& [a, b] = edges[next()];
    const auto& [c, d] = edges[next()];
    crossing += orient(a, b, c) * orient(a, b, d) < 0 && orient(c, d, a) * orient(c, d, b) < 0;
  }
  if (crossing < kFewest) return 0;
  const auto count = static_cast<double>(edges.size());
  return crossing * (count * count / 2) / kSamples;
}

/// Whether the job has ended. Ends it when the outlines cross too often: Clipper takes some
/// microseconds and 400 bytes for each crossing.
bool ends_before(const Paths& subject, const Paths& clip, OutlineJob* job) {
  if (!job || job->ended()) return job != nullptr;
  constexpr double kMostCrossings = 5e5, kBytes = 400;
  const std::size_t points = count_points(subject) + count_points(clip);
  if (static_cast<double>(points) * static_cast<double>(points) / 2 < kMostCrossings) return false;
  const double crossings = estimate_crossings(subject, clip);
  const auto limit = static_cast<double>(job->execution.memory_limit);
  if (crossings > kMostCrossings || (limit > 0 && crossings * kBytes > limit)) {
    job->error = Error{
        ErrorCode::kLimit,
        fmt::format("flat outlines with {} edges have about {:.2g} crossings; the limit is {:.2g}",
                    points, crossings,
                    limit > 0 ? std::min(kMostCrossings, limit / kBytes) : kMostCrossings)};
  }
  return job->error.has_value();
}

/// Returns the result of `work`. Clipper cannot be stopped: work that may take long runs in a
/// thread of its own, which owns all that it needs. After a stop request that thread is left to end
/// by itself.
template <class Work>
Paths run_until_stopped(std::size_t points, OutlineJob* job, Work work) {
  constexpr std::size_t kLong = 5000;
  if (!job || !job->execution.stop.stop_possible() || points < kLong) return work();
  struct Shared {
    std::mutex lock;
    std::condition_variable_any changed;
    bool done = false;
    Paths result;
    std::exception_ptr error;
  };
  const auto shared = std::make_shared<Shared>();
  std::thread([shared, work = std::move(work)]() mutable {
    Paths result;
    std::exception_ptr error;
    try {
      result = work();
    } catch (...) {
      error = std::current_exception();
    }
    const std::lock_guard hold(shared->lock);
    shared->result = std::move(result);
    shared->error = error;
    shared->done = true;
    shared->changed.notify_all();
  }).detach();
  std::unique_lock hold(shared->lock);
  if (!shared->changed.wait(hold, job->execution.stop, [&] { return shared->done; })) {
    job->ended();
    return {};
  }
  if (shared->error) std::rethrow_exception(shared->error);
  return std::move(shared->result);
}

Paths execute(ClipperLib::ClipType type, Paths subject, Paths clip, ClipperLib::PolyFillType fill,
              OutlineJob* job) {
  if (ends_before(subject, clip, job)) return {};
  const std::size_t points = count_points(subject) + count_points(clip);
  return run_until_stopped(
      points, job, [type, subject = std::move(subject), clip = std::move(clip), fill]() mutable {
        const bool mirrored = better_mirrored(subject);
        if (mirrored) mirror(subject), mirror(clip);
        Paths result;
        try {
          ClipperLib::Clipper clipper;
          const bool has_subject = clipper.AddPaths(subject, ClipperLib::ptSubject, true);
          const bool has_clip = clipper.AddPaths(clip, ClipperLib::ptClip, true);
          if (!has_subject && !has_clip) return Paths();  // no contour encloses an area
          // Clipper catches exceptions inside, above all for lack of memory, and then returns
          // false.
          if (!clipper.Execute(type, result, fill, fill)) throw std::bad_alloc();
        } catch (const ClipperLib::clipperException&) {
          return Paths();  // a coordinate out of range, which the grid rules out
        }
        if (mirrored) mirror(result);
        return result;
      });
}

/// Unites counter-clockwise paths by halves. Clipper's sweep is quadratic in the number of active
/// edges, and most edges vanish in the first unions.
Paths unite_in_halves(std::span<const Paths> parts, OutlineJob* job) {
  constexpr std::size_t kAtOnce = 8000;
  std::size_t points = 0;
  for (const Paths& part : parts) points += count_points(part);
  if (parts.size() <= 1 || points <= kAtOnce) {
    Paths all;
    for (const Paths& part : parts) all.insert(all.end(), part.begin(), part.end());
    return execute(ClipperLib::ctUnion, std::move(all), {}, ClipperLib::pftNonZero, job);
  }
  const std::size_t half = parts.size() / 2;
  Paths left = unite_in_halves(parts.first(half), job);
  const Paths right = unite_in_halves(parts.subspan(half), job);
  left.insert(left.end(), right.begin(), right.end());
  return execute(ClipperLib::ctUnion, std::move(left), {}, ClipperLib::pftNonZero, job);
}

Outline offset(const Outline& outline, double delta, ClipperLib::JoinType join, int segments,
               OutlineJob* job) {
  if (outline.empty() || !std::isfinite(delta)) return {};
  if (delta == 0) return outline;
  Grid grid(std::span(&outline, 1), kOffsetGridBits, std::abs(delta));
  const double size = std::abs(grid.length(delta));
  // The tolerance at which Clipper cuts a full circle into `segments` steps.
  const double tolerance = size * (1.0 - std::cos(std::numbers::pi / std::max(segments, 3)));
  constexpr double kMitreLimit = 1e6;
  const double limit = join == ClipperLib::jtMiter ? kMitreLimit : 2.0;
  Paths paths = grid.to_grid(outline, false);
  if (ends_before(paths, {}, job)) return {};
  constexpr double kMostPoints = 2e7;
  const double rounded = static_cast<double>(segments) * static_cast<double>(paths.size());
  if (job && join == ClipperLib::jtRound && rounded > kMostPoints) {
    job->error = Error{ErrorCode::kLimit,
                       fmt::format("'offset': rounding {} contours with {} segments of a circle "
                                   "makes {:.2g} points; the limit is {:g}",
                                   paths.size(), segments, rounded, kMostPoints)};
    return {};
  }
  const bool mirrored = better_mirrored(paths);
  if (mirrored) mirror(paths);
  const std::size_t points = count_points(paths) + static_cast<std::size_t>(segments);
  Paths result = run_until_stopped(
      points, job,
      [paths = std::move(paths), limit, tolerance, join, by = grid.length(delta)]() mutable {
        Paths made;
        try {
          ClipperLib::ClipperOffset work(limit, tolerance);
          work.AddPaths(paths, join, ClipperLib::etClosedPolygon);
          work.Execute(made, by);
        } catch (const ClipperLib::clipperException&) {
          made.clear();
        }
        return made;
      });
  if (mirrored) mirror(result);
  return grid.from_grid(result);
}

bool is_convex(const Outline& outline) {
  if (outline.contours.size() != 1) return false;
  const auto& c = outline.contours[0];
  // A convex path turns only to the left and makes one full turn: its direction rises once only.
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

/// The areas that `shape` covers while it moves along the edges of `path`: one part for each edge.
void sweep_along(const Path& path, const Paths& shape, bool convex, std::vector<Paths>& parts) {
  for (std::size_t i = 0; i < path.size(); ++i) {
    const IntPoint p = path[i], q = path[(i + 1) % path.size()];
    Paths& part = parts.emplace_back();
    if (convex) {
      // A convex shape that moves along an edge covers the hull of its two end positions.
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

/// Whether the job has ended. Ends it when the sum would have too many pieces.
bool ends_before_sum(std::size_t path, std::size_t shape, bool convex, OutlineJob* job) {
  if (!job || job->ended()) return job != nullptr;
  constexpr double kMostPoints = 2e7, kBytes = 100;
  const double points =
      (convex ? 2.0 : 4.0) * static_cast<double>(path) * static_cast<double>(shape);
  const auto limit = static_cast<double>(job->execution.memory_limit);
  if (points > kMostPoints || (limit > 0 && points * kBytes > limit)) {
    job->error = Error{
        ErrorCode::kLimit,
        fmt::format("the sum of flat outlines with {} and {} points has pieces with {:.2g} points; "
                    "the limit is {:.2g}",
                    path, shape, points,
                    limit > 0 ? std::min(kMostPoints, limit / kBytes) : kMostPoints)};
  }
  return job->error.has_value();
}

Paths moved(const Paths& paths, const IntPoint& by) {
  Paths result = paths;
  for (Path& path : result) {
    for (IntPoint& p : path) p.X += by.X, p.Y += by.Y;
  }
  return result;
}

}  // namespace

Outline clean(const Outline& outline, Fill fill, OutlineJob* job) {
  Grid grid(std::span(&outline, 1), kGridBits);
  return grid.from_grid(
      execute(ClipperLib::ctUnion, grid.to_grid(outline), {},
              fill == Fill::kEvenOdd ? ClipperLib::pftEvenOdd : ClipperLib::pftNonZero, job));
}

Outline unite(std::span<const Outline> operands, OutlineJob* job) {
  if (operands.size() == 1) return operands[0];
  Grid grid(operands, kGridBits);
  std::vector<Paths> parts;
  for (const Outline& operand : operands) parts.push_back(grid.to_grid(operand));
  return grid.from_grid(unite_in_halves(parts, job));
}

Outline intersect(std::span<const Outline> operands, OutlineJob* job) {
  if (operands.empty()) return {};
  for (const Outline& operand : operands) {
    if (operand.empty()) return {};
  }
  if (operands.size() == 1) return operands[0];
  Grid grid(operands, kGridBits);
  Paths result = grid.to_grid(operands[0]);
  for (const Outline& operand : operands.subspan(1)) {
    result = execute(ClipperLib::ctIntersection, std::move(result), grid.to_grid(operand),
                     ClipperLib::pftNonZero, job);
  }
  return grid.from_grid(result);
}

Outline subtract(std::span<const Outline> operands, OutlineJob* job) {
  if (operands.empty() || operands[0].empty()) return {};
  if (operands.size() == 1) return operands[0];
  Grid grid(operands, kGridBits);
  Paths first = grid.to_grid(operands[0]), others;
  for (const Outline& operand : operands.subspan(1)) {
    const Paths paths = grid.to_grid(operand);
    others.insert(others.end(), paths.begin(), paths.end());
  }
  return grid.from_grid(execute(ClipperLib::ctDifference, std::move(first), std::move(others),
                                ClipperLib::pftNonZero, job));
}

Outline minkowski_sum(std::span<const Outline> operands, OutlineJob* job) {
  Outline sum;
  for (const Outline& operand : operands) {
    if (operand.empty()) return {};  // the sum with an empty set is empty
    if (&operand == operands.data()) {
      sum = operand;
      continue;
    }
    // The grid must hold both operands and their sum around one origin.
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
    const bool convex = sum_convex || operand_convex;
    if (ends_before_sum(count_points(paths), count_points(shape), convex, job)) return {};
    for (const Path& path : paths) sweep_along(path, shape, convex, parts);
    // The sum is the union of the boundaries' sum, of each operand moved to one point of every
    // piece of the other.
    for (const Path& path : shape) {
      if (ClipperLib::Orientation(path)) parts.push_back(moved(paths, path[0]));
    }
    for (const Path& path : paths) {
      if (ClipperLib::Orientation(path)) parts.push_back(moved(shape, path[0]));
    }
    sum = grid.from_grid(unite_in_halves(parts, job));
    if (sum.empty()) return {};
  }
  return sum;
}

Outline offset_round(const Outline& outline, double radius, const Segments& segments,
                     OutlineJob* job) {
  return offset(outline, radius, ClipperLib::jtRound, segments.count(std::abs(radius)), job);
}

double offset_point_count(const Outline& outline, double radius, const Segments& segments) {
  double points = 0.0, turned = 0.0;
  for (const auto& contour : outline.contours) {
    const std::size_t n = contour.size();
    points += static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i) {
      const glm::dvec2 a = contour[(i + 1) % n] - contour[i];
      const glm::dvec2 b = contour[(i + 2) % n] - contour[(i + 1) % n];
      const double turn = std::atan2(a.x * b.y - a.y * b.x, a.x * b.x + a.y * b.y);
      if (turn * radius > 0.0) turned += std::abs(turn);
    }
  }
  return points + segments.count(std::abs(radius)) * turned / (2.0 * std::numbers::pi);
}

Outline offset_delta(const Outline& outline, double delta, bool chamfer, OutlineJob* job) {
  return offset(outline, delta, chamfer ? ClipperLib::jtSquare : ClipperLib::jtMiter, 0, job);
}

Outline stroke(std::span<const glm::dvec2> line, bool closed, double width, StrokeCap cap,
               StrokeJoin join, int segments, OutlineJob* job) {
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
  Paths paths{std::move(path)};
  if (ends_before(paths, {}, job)) return {};
  const bool mirrored = better_mirrored(paths);
  if (mirrored) mirror(paths);
  const std::size_t points = count_points(paths);
  const double tolerance = half * (1.0 - std::cos(std::numbers::pi / std::max(segments, 3)));
  Paths result = run_until_stopped(
      points, job, [paths = std::move(paths), tolerance, joins, ends, half]() mutable {
        Paths made;
        try {
          constexpr double kMitreLimit = 4.0;  // the default of SVG
          ClipperLib::ClipperOffset work(kMitreLimit, tolerance);
          work.AddPaths(paths, joins, ends);
          work.Execute(made, half);
        } catch (const ClipperLib::clipperException&) {
          made.clear();
        }
        return made;
      });
  if (mirrored) mirror(result);
  return grid.from_grid(result);
}

}  // namespace strata::csg
