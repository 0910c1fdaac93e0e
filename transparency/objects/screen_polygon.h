#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <limits>
#include <vector>

#include "raster/triangle_setup.h"

namespace strata::transparency {

/// A convex polygon in the picture, in lattice steps, turned like TriangleSetup's triangles.
using ScreenPolygon = std::vector<glm::dvec2>;

/// The part of a polygon where `side`, which is linear, is not below 0.
template <class Side>
void clip_polygon(const ScreenPolygon& polygon, const Side& side, ScreenPolygon& kept) {
  kept.clear();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec2 &a = polygon[i], &b = polygon[i + 1 == polygon.size() ? 0 : i + 1];
    const double at_a = side(a), at_b = side(b);
    if (at_a >= 0) kept.push_back(a);
    if ((at_a >= 0) != (at_b >= 0)) kept.push_back(a + (b - a) * (at_a / (at_a - at_b)));
  }
}

/// What two polygons share, and up to `margin` lattice steps more. @return false if it is nothing
inline bool overlap_of(const ScreenPolygon& one, const ScreenPolygon& other, double margin,
                       ScreenPolygon& overlap) {
  ScreenPolygon clipped;
  overlap = one;
  for (std::size_t i = 0; i < other.size() && overlap.size() > 2; ++i) {
    const glm::dvec2 &a = other[i], &b = other[i + 1 == other.size() ? 0 : i + 1];
    const glm::dvec2 along = b - a;
    const double length = glm::length(along);
    if (length < 1e-9) continue;
    const glm::dvec2 inward = glm::dvec2(-along.y, along.x) / length;
    clip_polygon(
        overlap, [&](const glm::dvec2& p) { return glm::dot(inward, p - a) + margin; }, clipped);
    overlap.swap(clipped);
  }
  return overlap.size() > 2;
}

/// Calls body(u, v) for each sample in the polygon or up to half a lattice step beside it, until it
/// returns false.
template <class Body>
void for_each_sample(const ScreenPolygon& polygon, Body&& body) {
  constexpr double kBeside = 0.5, kMiddle = kLatticeSteps / 2.0;
  double top = std::numeric_limits<double>::max(), bottom = -top;
  for (const glm::dvec2& p : polygon) {
    top = std::min(top, p.y);
    bottom = std::max(bottom, p.y);
  }
  const auto first = [&](double low) {
    return static_cast<int>(std::ceil((low - kBeside - kMiddle) / kLatticeSteps));
  };
  const auto last = [&](double high) {
    return static_cast<int>(std::floor((high + kBeside - kMiddle) / kLatticeSteps));
  };
  for (int v = first(top), end = last(bottom); v <= end; ++v) {
    const double y = std::clamp(v * double{kLatticeSteps} + kMiddle, top, bottom);
    double left = std::numeric_limits<double>::max(), right = -left;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const glm::dvec2 &a = polygon[i], &b = polygon[i + 1 == polygon.size() ? 0 : i + 1];
      if (std::min(a.y, b.y) > y || std::max(a.y, b.y) < y) continue;
      const bool flat = std::abs(b.y - a.y) < 1e-9;
      const double x = flat ? a.x : a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x);
      left = std::min({left, x, flat ? b.x : x});
      right = std::max({right, x, flat ? b.x : x});
    }
    if (left > right) continue;
    for (int u = first(left), stop = last(right); u <= stop; ++u) {
      if (!body(u, v)) return;
    }
  }
}

}  // namespace strata::transparency
