#include "csg/outline/outline.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "mesh/polygons/plane_predicates.h"

namespace strata::csg {
namespace {

bool finite(const glm::dvec2& p) { return std::isfinite(p.x) && std::isfinite(p.y); }

}  // namespace

Outline make_square(const glm::dvec2& size, bool centre) {
  if (!finite(size) || !(size.x > 0) || !(size.y > 0)) return {};
  const glm::dvec2 low = centre ? -size / 2.0 : glm::dvec2(0);
  const glm::dvec2 high = centre ? size / 2.0 : size;
  return {{{low, {high.x, low.y}, high, {low.x, high.y}}}};
}

Outline make_circle(double radius, const Segments& segments) {
  if (!std::isfinite(radius) || !(radius > 0)) return {};
  const int count = segments.count(radius);
  std::vector<glm::dvec2> points;
  points.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double angle = 360.0 * i / count;
    points.emplace_back(radius * cos_degrees(angle), radius * sin_degrees(angle));
  }
  return {{std::move(points)}};
}

Result<Outline> make_polygon(std::span<const glm::dvec2> points,
                             std::span<const std::vector<std::uint32_t>> paths, OutlineJob* job) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!finite(points[i])) {
      return fail(ErrorCode::kInput, "polygon: point {} is ({}, {}), not finite", i, points[i].x,
                  points[i].y);
    }
  }
  Outline raw;
  if (paths.empty()) raw.contours.emplace_back(points.begin(), points.end());
  for (std::size_t p = 0; p < paths.size(); ++p) {
    auto& contour = raw.contours.emplace_back();
    for (const std::uint32_t index : paths[p]) {
      if (index >= points.size()) {
        return fail(ErrorCode::kInput, "polygon: path {} refers to point {}, but there are {}", p,
                    index, points.size());
      }
      contour.push_back(points[index]);
    }
  }
  Outline outline = clean(raw, Fill::kEvenOdd, job);
  if (job && job->error) return tl::unexpected(*job->error);
  return outline;
}

Outline convex_hull(std::span<const Outline> operands) {
  std::vector<glm::dvec2> points;
  for (const Outline& operand : operands) {
    for (const auto& contour : operand.contours) {
      std::copy_if(contour.begin(), contour.end(), std::back_inserter(points), finite);
    }
  }
  const auto less = [](const glm::dvec2& a, const glm::dvec2& b) {
    return a.x < b.x || (a.x == b.x && a.y < b.y);
  };
  std::sort(points.begin(), points.end(), less);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return {};
  // A. M. Andrew, "Another efficient algorithm for convex hulls in two dimensions", 1979.
  std::vector<glm::dvec2> hull;
  const auto add = [&](const glm::dvec2& p, std::size_t least) {
    while (hull.size() >= least && orient(hull[hull.size() - 2], hull.back(), p) <= 0) {
      hull.pop_back();
    }
    hull.push_back(p);
  };
  for (const glm::dvec2& p : points) add(p, 2);
  const std::size_t upper = hull.size() + 1;
  for (std::size_t i = points.size() - 1; i-- > 0;) add(points[i], upper);
  hull.pop_back();
  if (hull.size() < 3) return {};
  return {{std::move(hull)}};
}

Outline without_holes(const Outline& outline, OutlineJob* job) {
  Outline outer;
  for (const auto& contour : outline.contours) {
    if (signed_area(contour) > 0) outer.contours.push_back(contour);
  }
  // Outer contours cover the islands inside their holes.
  return clean(outer, Fill::kNonzero, job);
}

Outline transform(const Outline& outline, const glm::dmat3& m) {
  const double determinant = m[0].x * m[1].y - m[1].x * m[0].y;
  if (!std::isfinite(determinant) || determinant == 0 || !finite(glm::dvec2(m[2]))) return {};
  Outline result = outline;
  for (auto& contour : result.contours) {
    for (glm::dvec2& p : contour) p = glm::dvec2(m * glm::dvec3(p, 1.0));
    if (!std::all_of(contour.begin(), contour.end(), finite)) return {};
    if (determinant < 0) std::reverse(contour.begin(), contour.end());
  }
  return result;
}

Outline resize(const Outline& outline, const glm::dvec2& size, const bool (&follow)[2]) {
  if (outline.empty() || !finite(size)) return outline;
  glm::dvec2 low(std::numeric_limits<double>::infinity()), high = -low;
  for (const auto& contour : outline.contours) {
    for (const glm::dvec2& p : contour) low = glm::min(low, p), high = glm::max(high, p);
  }
  const glm::dvec2 extent = high - low;
  glm::dvec2 factor(1);
  for (int axis = 0; axis < 2; ++axis) {
    if (size[axis] > 0 && extent[axis] > 0) factor[axis] = size[axis] / extent[axis];
  }
  const int largest = size.y > size.x ? 1 : 0;
  for (int axis = 0; axis < 2; ++axis) {
    if (!(size[axis] > 0) && follow[axis]) factor[axis] = factor[largest];
  }
  return transform(outline, glm::dmat3({factor.x, 0, 0}, {0, factor.y, 0}, {0, 0, 1}));
}

}  // namespace strata::csg
