#pragma once

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <vector>

#include "csg/outline/outline.h"
#include "mesh/polygons/plane_predicates.h"

namespace strata::csg::testing {

inline Outline moved(const Outline& outline, double x, double y) {
  return transform(outline, glm::dmat3({1, 0, 0}, {0, 1, 0}, {x, y, 1}));
}

inline Segments with_fn(double fn) {
  Segments segments;
  segments.fn = fn;
  return segments;
}

/// Area of a clean outline.
inline double area(const Outline& outline) {
  double sum = 0;
  for (const auto& contour : outline.contours) sum += signed_area(contour);
  return sum;
}

inline std::vector<glm::dvec2> points(const Outline& outline) {
  std::vector<glm::dvec2> all;
  for (const auto& contour : outline.contours)
    all.insert(all.end(), contour.begin(), contour.end());
  return all;
}

struct TriangulationReport {
  double positive = 0;  ///< area of counter-clockwise triangles
  double negative = 0;  ///< area of turned triangles
  bool closed = true;   ///< its boundary is the outline, edge for edge, by position
};

/// Compares the triangles with the outline.
inline TriangulationReport check(const Outline& outline, const std::vector<glm::uvec3>& triangles) {
  TriangulationReport report;
  const auto p = points(outline);
  std::map<std::pair<double, double>, unsigned> places;
  std::vector<unsigned> place;
  for (const glm::dvec2& q : p) {
    place.push_back(
        places.try_emplace({q.x, q.y}, static_cast<unsigned>(places.size())).first->second);
  }
  std::map<std::pair<unsigned, unsigned>, int> edges;
  const auto add = [&](unsigned from, unsigned to, int sign) {
    const unsigned a = place[from], b = place[to];
    if (a < b)
      edges[{a, b}] += sign;
    else if (b < a)
      edges[{b, a}] -= sign;
  };
  for (const glm::uvec3& t : triangles) {
    const std::array<glm::dvec2, 3> corners{p[t.x], p[t.y], p[t.z]};
    const double size = signed_area(corners);
    (size >= 0 ? report.positive : report.negative) += std::abs(size);
    add(t.x, t.y, 1);
    add(t.y, t.z, 1);
    add(t.z, t.x, 1);
  }
  unsigned first = 0;
  for (const auto& contour : outline.contours) {
    const auto count = static_cast<unsigned>(contour.size());
    for (unsigned i = 0; i < count; ++i) add(first + i, first + (i + 1) % count, -1);
    first += count;
  }
  for (const auto& [ends, count] : edges) report.closed = report.closed && count == 0;
  return report;
}

}  // namespace strata::csg::testing
