#include "csg/measure/round_fit.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "csg/measure/facet_graph.h"

namespace strata::csg {
namespace {

/// Vertices must lie within this part of the height of a chord; first those of a rough fit.
constexpr double kTolerances[] = {0.5, 0.1, 0.01};
/// What six digits leave of a coordinate, as text files have them.
constexpr double kDigits = 6e-6;
constexpr double kLeastSpan = 25.0;  ///< degrees
constexpr std::size_t kLeastPoints = 5;
/// Facets of the patches that first guesses are made of, where facets are many and small.
constexpr std::size_t kPatches[] = {24, 96, 400, 1600};

using Facets = std::vector<std::uint32_t>;

/// The least direction of the sum of n n^T: that to which all n are perpendicular.
glm::dvec3 least_direction(const FacetGraph& graph, const Facets& facets) {
  glm::dmat3 sum(0.0);
  for (const std::uint32_t t : facets) {
    sum += glm::outerProduct(graph.normal(t), graph.normal(t)) * graph.area(t);
  }
  const double size = sum[0][0] + sum[1][1] + sum[2][2];
  const glm::dmat3 inverse = glm::inverse(sum + glm::dmat3(1e-12 * size));
  glm::dvec3 axis(0.48, 0.6, 0.64);
  for (int i = 0; i < 60; ++i) {
    const glm::dvec3 next = inverse * axis;
    if (!(glm::length(next) > 0.0)) return {};
    axis = glm::normalize(next);
  }
  return axis;
}

/// A circle or a sphere.
struct Ball {
  glm::dvec3 centre{0.0};
  double radius = 0.0;
};

/// The ball whose surface the points are nearest to, in the sense of the algebraic distance (I.
/// Kasa, "A circle fitting procedure and its error analysis", 1976). With an axis the circle in the
/// plane through the origin across it, which the points are projected into.
std::optional<Ball> fit_ball(const std::vector<glm::dvec3>& points,
                             const std::optional<glm::dvec3>& axis) {
  if (points.size() < 3) return {};
  glm::dvec3 middle(0.0);
  const auto flat = [&](const glm::dvec3& p) { return axis ? p - *axis * glm::dot(p, *axis) : p; };
  for (const glm::dvec3& p : points) middle += flat(p);
  middle /= static_cast<double>(points.size());
  glm::dmat3 squares(0.0);
  glm::dvec3 right(0.0);
  double mean = 0.0;
  for (const glm::dvec3& p : points) mean += glm::dot(flat(p) - middle, flat(p) - middle);
  mean /= static_cast<double>(points.size());
  for (const glm::dvec3& p : points) {
    const glm::dvec3 d = flat(p) - middle;
    squares += glm::outerProduct(d, d);
    right += d * (0.5 * (glm::dot(d, d) - mean));
  }
  if (axis) squares += glm::outerProduct(*axis, *axis) * (squares[0][0] + squares[1][1] + 1e-300);
  const double size = squares[0][0] + squares[1][1] + squares[2][2];
  if (!(std::abs(glm::determinant(squares)) > 1e-18 * size * size * size)) return {};
  const glm::dvec3 shift = glm::inverse(squares) * right;
  return Ball{middle + shift, std::sqrt(mean + glm::dot(shift, shift))};
}

/// How far the middle of a chord is from a circle.
double sagitta(double radius, double chord) {
  const double half = 0.5 * chord;
  return half < radius ? radius - std::sqrt(radius * radius - half * half) : radius;
}

class Fitter {
 public:
  Fitter(const FacetGraph& graph, std::uint32_t seed) : graph_(graph), seed_(seed) {
    flat_ = graph.flat_patch(seed);
    for (const std::uint32_t t : flat_) {
      for (const std::uint32_t other : graph.smooth_neighbours(t)) {
        if (!graph.coplanar(t, other)) ring_.push_back(other);
      }
    }
    std::sort(ring_.begin(), ring_.end());
    ring_.erase(std::unique(ring_.begin(), ring_.end()), ring_.end());
  }
  [[nodiscard]] const Facets& flat() const { return flat_; }
  [[nodiscard]] bool smooth() const { return !ring_.empty(); }

  RoundFit best() {
    RoundFit best;
    double most = 0.0;
    const auto consider = [&](const std::optional<RoundFit>& fit, double margin) {
      if (!fit || !(area_ > margin * most)) return;
      most = area_;
      best = *fit;
    };
    for (std::size_t i = 0; i < std::min<std::size_t>(ring_.size(), 8); ++i) {
      const glm::dvec3 axis = glm::cross(graph_.normal(seed_), graph_.normal(ring_[i]));
      if (!(glm::length(axis) > 0.0)) continue;
      Facets start = flat_;
      const Facets next = graph_.flat_patch(ring_[i]);
      start.insert(start.end(), next.begin(), next.end());
      consider(cylinder(glm::normalize(axis), start, false), 1.0);
    }
    Facets around = flat_;
    around.insert(around.end(), ring_.begin(), ring_.end());
    std::vector<Facets> patches;
    for (const std::size_t count : kPatches) {
      patches.push_back(graph_.smooth_patch(seed_, count));
      if (patches.back().size() < count) break;
    }
    for (const Facets& patch : patches)
      consider(cylinder(least_direction(graph_, patch), patch, true), 1.2);
    // A row of a ball's facets may be a cylinder.
    consider(sphere(around, false), 1.5);
    for (const Facets& patch : patches) consider(sphere(patch, true), 1.5);
    return best;
  }

 private:
  /// Facets around the seed that `belongs` accepts.
  template <class Belongs>
  Facets grow(const Belongs& belongs) {
    Facets found;
    if (!belongs(seed_)) return found;
    seen_.assign(graph_.size(), 0);
    found.push_back(seed_);
    seen_[seed_] = 1;
    for (std::size_t i = 0; i < found.size(); ++i) {
      for (const std::uint32_t other : graph_.smooth_neighbours(found[i])) {
        if (seen_[other] != 0 || !belongs(other)) continue;
        seen_[other] = 1;
        found.push_back(other);
      }
    }
    return found;
  }

  /// @param whole  the facets at the start must all belong to it
  std::optional<RoundFit> cylinder(glm::dvec3 axis, const Facets& start, bool whole) {
    if (!(glm::length(axis) > 0.5)) return {};
    auto circle = fit_ball(graph_.points(start), axis);
    if (!circle) return {};
    const double chord = whole ? graph_.width(start, axis) : graph_.width(flat_, axis);
    Facets facets;
    double tolerance = 0.0;
    for (const double part : kTolerances) {
      if (!(chord < 2.0 * circle->radius)) return {};
      tolerance = part * sagitta(circle->radius, chord) + kDigits * graph_.largest();
      const auto on = [&](const glm::dvec3& p) {
        const glm::dvec3 d = p - circle->centre;
        const double r = glm::length(d - axis * glm::dot(d, axis));
        return std::abs(r - circle->radius) <= tolerance;
      };
      facets = grow([&](std::uint32_t t) {
        return std::abs(glm::dot(graph_.normal(t), axis)) < 0.02 && graph_.all_corners(t, on);
      });
      if (facets.empty()) return {};
      // Two of the flat facets around the axis are the least that it can be told from.
      if (facets.size() > flat_.size()) axis = least_direction(graph_, facets);
      circle = fit_ball(graph_.points(facets), axis);
      if (!circle) return {};
    }
    if (whole && (facets.size() * 10 < start.size() * 9 || !bounded(facets))) return {};
    return told(axis, *circle, facets, tolerance);
  }

  std::optional<RoundFit> told(glm::dvec3 axis, const Ball& circle, const Facets& facets,
                               double tolerance) {
    for (int k = 0; k < 3; ++k) {
      if (std::abs(axis[k]) < 1e-9) axis[k] = 0.0;
    }
    axis = glm::normalize(axis);
    const glm::dvec3 size = glm::abs(axis);
    const int largest = size.z >= size.x && size.z >= size.y ? 2 : size.y >= size.x ? 1 : 0;
    if (axis[largest] < 0.0) axis = -axis;
    RoundFit fit;
    fit.kind = RoundFit::Kind::kCylinder;
    fit.axis = axis;
    fit.radius = circle.radius;
    fit.facets = facets.size();
    const std::vector<glm::dvec3> points = graph_.points(facets);
    double low = 1e300, high = -1e300;
    for (const glm::dvec3& p : points) {
      const glm::dvec3 d = p - circle.centre;
      const double along = glm::dot(d, axis), r = glm::length(d - axis * along);
      low = std::min(low, along), high = std::max(high, along);
      fit.deviation = std::max(fit.deviation, std::abs(r - fit.radius));
    }
    if (fit.deviation > 2.0 * tolerance) return {};
    fit.length = high - low;
    fit.centre = circle.centre + axis * (0.5 * (low + high));
    std::size_t count = 0;
    fit.span = span_of(points, fit.centre, axis, count);
    if (fit.span < kLeastSpan || count < kLeastPoints) return {};
    if (fit.span < 360.0 &&
        goes_on(facets, axis, glm::radians(fit.span / (static_cast<double>(count) - 1.0))))
      return {};
    summarize(facets, fit.centre, axis, fit);
    return fit;
  }

  /// Whether facets that were found by a rough guess end at creases: else the guess was a part of
  /// something else.
  [[nodiscard]] bool bounded(const Facets& facets) const {
    std::size_t beside = 0;
    for (const std::uint32_t t : facets) {
      for (const std::uint32_t other : graph_.smooth_neighbours(t)) beside += seen_[other] ^ 1;
    }
    return beside * 10 < facets.size();
  }

  /// Whether the surface curves on beside the facets as it does in them: an oval, or a pipe's bend.
  /// @param turn  the angle between neighbours in it
  [[nodiscard]] bool goes_on(const Facets& facets, const glm::dvec3& axis, double turn) const {
    const double chord = graph_.width(flat_, axis);
    for (const std::uint32_t t : facets) {
      for (const std::uint32_t other : graph_.smooth_neighbours(t)) {
        if (seen_[other] != 0 || std::abs(glm::dot(graph_.normal(other), axis)) > 0.05) continue;
        const double angle =
            std::acos(std::clamp(glm::dot(graph_.normal(t), graph_.normal(other)), -1.0, 1.0));
        const double wide = graph_.width(graph_.flat_patch(other), axis);
        if (angle > 0.7 * turn && angle < 1.4 * turn && wide > 0.6 * chord && wide < 1.7 * chord) {
          return true;
        }
      }
    }
    return false;
  }

  void summarize(const Facets& facets, const glm::dvec3& centre, const glm::dvec3& axis,
                 RoundFit& fit) {
    double outwards = 0.0;
    area_ = 0.0;
    for (const std::uint32_t t : facets) {
      const glm::dvec3 d = graph_.middle(t) - centre;
      outwards += graph_.area(t) * glm::dot(graph_.normal(t), d - axis * glm::dot(d, axis));
      area_ += graph_.area(t);
    }
    fit.hollow = outwards < 0.0;
  }

 public:
  /// The angle that points cover around an axis, in degrees. @param count  different angles
  static double span_of(const std::vector<glm::dvec3>& points, const glm::dvec3& centre,
                        const glm::dvec3& axis, std::size_t& count) {
    const glm::dvec3 u = glm::normalize(
        glm::cross(axis, std::abs(axis.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0)));
    const glm::dvec3 v = glm::cross(axis, u);
    std::vector<double> angles;
    for (const glm::dvec3& p : points) {
      angles.push_back(std::atan2(glm::dot(p - centre, v), glm::dot(p - centre, u)));
    }
    std::sort(angles.begin(), angles.end());
    std::vector<double> gaps;
    for (std::size_t i = 0; i < angles.size(); ++i) {
      const double next =
          i + 1 < angles.size() ? angles[i + 1] : angles[0] + 2.0 * std::numbers::pi;
      if (next - angles[i] > 1e-4) gaps.push_back(next - angles[i]);
    }
    count = gaps.size();
    if (gaps.size() < 3) return 0.0;
    std::sort(gaps.begin(), gaps.end());
    // All round: the largest gap is one of many.
    const double largest = gaps.back();
    if (largest < 1.3 * gaps[gaps.size() - 2]) return 360.0;
    return glm::degrees(2.0 * std::numbers::pi - largest);
  }

 private:
  std::optional<RoundFit> sphere(const Facets& start, bool whole) {
    auto ball = fit_ball(graph_.points(start), {});
    if (!ball) return {};
    Facets facets;
    for (const double part : kTolerances) {
      const double chord = whole ? 0.5 * graph_.extent(start) : graph_.extent(flat_);
      const double tolerance = part * sagitta(ball->radius, chord) + kDigits * graph_.largest();
      const auto on = [&](const glm::dvec3& p) {
        return std::abs(glm::length(p - ball->centre) - ball->radius) <= tolerance;
      };
      facets = grow([&](std::uint32_t t) {
        return graph_.circumradius(t) < 0.5 * ball->radius && graph_.all_corners(t, on);
      });
      if (facets.size() < 8) return {};
      ball = fit_ball(graph_.points(facets), {});
      if (!ball) return {};
    }
    if (whole && (facets.size() * 10 < start.size() * 9 || !bounded(facets))) return {};
    RoundFit fit;
    fit.kind = RoundFit::Kind::kSphere;
    fit.centre = ball->centre;
    fit.radius = ball->radius;
    fit.facets = facets.size();
    for (const glm::dvec3& p : graph_.points(facets)) {
      const double off = std::abs(glm::length(p - fit.centre) - fit.radius);
      fit.deviation = std::max(fit.deviation, off);
    }
    summarize(facets, fit.centre, glm::dvec3(0.0), fit);
    return fit;
  }

  const FacetGraph& graph_;
  std::uint32_t seed_;
  Facets flat_, ring_;
  double area_ = 0.0;  ///< of the last fit
  std::vector<std::uint8_t> seen_;
};

double distance_to(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& p) {
  const glm::dvec3 d = b - a;
  const double length = glm::dot(d, d);
  const double t = length > 0.0 ? std::clamp(glm::dot(p - a, d) / length, 0.0, 1.0) : 0.0;
  return glm::length(p - (a + d * t));
}

/// The rim of flat facets that is nearest to a point, as a circle.
RoundFit rim(const FacetGraph& graph, const Facets& flat, const glm::dvec3& at) {
  RoundFit fit;
  fit.kind = RoundFit::Kind::kFlat;
  fit.axis = graph.normal(flat.front());
  double nearest = 1e300;
  std::vector<glm::dvec3> loop;
  for (auto& one : graph.rims(flat)) {
    for (std::size_t i = 0; i < one.size(); ++i) {
      const double away = distance_to(one[i], one[(i + 1) % one.size()], at);
      if (away < nearest) {
        nearest = away;
        loop = one;
        break;
      }
    }
  }
  if (loop.size() < 7) return fit;
  const auto circle = fit_ball(loop, fit.axis);
  if (!circle) return fit;
  double longest = 0.0, off = 0.0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    longest = std::max(longest, glm::length(loop[i] - loop[(i + 1) % loop.size()]));
    const glm::dvec3 d = loop[i] - circle->centre;
    const double r = glm::length(d - fit.axis * glm::dot(d, fit.axis));
    off = std::max(off, std::abs(r - circle->radius));
  }
  if (longest > circle->radius) return fit;
  if (off > kTolerances[2] * sagitta(circle->radius, longest) + kDigits * graph.largest()) {
    return fit;
  }
  fit.kind = RoundFit::Kind::kCircle;
  fit.radius = circle->radius;
  fit.centre = circle->centre + fit.axis * glm::dot(loop.front(), fit.axis);
  fit.deviation = off;
  fit.span = 360.0;
  fit.facets = flat.size();
  const int largest = std::abs(fit.axis.z) >= 0.577 ? 2 : std::abs(fit.axis.y) >= 0.577 ? 1 : 0;
  if (fit.axis[largest] < 0.0) fit.axis = -fit.axis;
  return fit;
}

}  // namespace

RoundFit fit_round(std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles,
                   std::uint32_t seed, const glm::dvec3& at) {
  const FacetGraph graph(positions, triangles);
  if (!(graph.area(seed) > 0.0)) return {};
  Fitter fitter(graph, seed);
  RoundFit fit;
  if (fitter.smooth()) fit = fitter.best();
  if (fit.kind != RoundFit::Kind::kNone) return fit;
  RoundFit flat = rim(graph, fitter.flat(), at);
  const bool circle = flat.kind == RoundFit::Kind::kCircle;
  return circle || !fitter.smooth() ? flat : RoundFit{};
}

}  // namespace strata::csg
