#include "csg/arrangement/point_table.h"

#include <cmath>

#include "mesh/weld.h"

namespace strata::csg {
namespace {

using exact::FilePoint;
using exact::RationalPoint;

int compare(const RationalPoint& a, const RationalPoint& b, int axis) {
  return exact::compare_fractions(exact::numerator(a, axis), a.w, exact::numerator(b, axis), b.w);
}

bool equal(const RationalPoint& a, const RationalPoint& b) {
  return compare(a, b, 0) == 0 && compare(a, b, 1) == 0 && compare(a, b, 2) == 0;
}

}  // namespace

PointTable::PointTable(BoundaryPoints points)
    : points_(std::move(points)), slots_(1024, 0), inserted_(points_.vertices().size(), false) {}

std::size_t PointTable::slot_of(const FilePoint& rounded) const {
  return detail::WeldTable<std::int64_t>::hash(rounded) & (slots_.size() - 1);
}

void PointTable::insert(std::uint32_t point) {
  if (2 * ++used_ > slots_.size()) grow(2 * slots_.size());
  std::size_t at = slot_of(points_.rounded(point));
  while (slots_[at] != 0) at = (at + 1) & (slots_.size() - 1);
  slots_[at] = point + 1;
}

void PointTable::reserve(std::size_t points) {
  std::size_t slots = slots_.size();
  while (slots < 2 * (used_ + points)) slots *= 2;
  if (slots > slots_.size()) grow(slots);
}

void PointTable::grow(std::size_t slots) {
  std::vector<std::uint32_t> old(slots, 0);
  old.swap(slots_);
  for (const std::uint32_t value : old) {
    if (value == 0) continue;
    std::size_t at = slot_of(points_.rounded(value - 1));
    while (slots_[at] != 0) at = (at + 1) & (slots_.size() - 1);
    slots_[at] = value;
  }
}

void PointTable::insert_vertex(std::uint32_t vertex) {
  if (inserted_[vertex]) return;
  inserted_[vertex] = true;
  insert(vertex);
}

NewPoint make_point(const BoundaryPoints& points, const BoundaryPoints::Recipe& recipe) {
  NewPoint result{recipe, {}, false};
  if (recipe.kind == BoundaryPoints::Kind::kEdgePlane) {
    result.rounded = exact::round_for_file(points.edge_plane(recipe), result.moved);
  } else if (recipe.kind == BoundaryPoints::Kind::kEdgeEdge) {
    result.rounded = exact::round_for_file(points.edge_edge(recipe), result.moved);
  } else {
    const RationalPoint exact = points.rational(recipe);
    result.rounded = exact::round_for_file(exact);
    result.moved = !exact::is_file_point(exact, result.rounded);
  }
  return result;
}

std::uint32_t PointTable::find_or_add(const NewPoint& added) {
  const auto& [recipe, rounded, moved] = added;
  for (std::size_t at = slot_of(rounded); slots_[at] != 0; at = (at + 1) & (slots_.size() - 1)) {
    const std::uint32_t point = slots_[at] - 1;
    if (points_.rounded(point) != rounded) continue;
    if (points_.recipe(point) == recipe) return point;
    if (!moved && !points_.moved(point)) return point;
    if (equal(points_.rational(point), points_.rational(recipe))) return point;
  }
  const std::uint32_t point = points_.add(recipe, rounded, moved);
  insert(point);
  return point;
}

int order_along(const BoundaryPoints& points, std::uint32_t a, std::uint32_t b, int axis) {
  const std::int64_t x = points.rounded(a)[axis], y = points.rounded(b)[axis];
  if (x != y) return x < y ? -1 : 1;  // rounding keeps orders
  if (a == b || (points.on_lattice(a) && points.on_lattice(b))) return 0;
  return compare(points.rational(a), points.rational(b), axis);
}

int side_of(const BoundaryPoints& points, std::uint32_t point, const exact::Plane& plane) {
  if (points.on_lattice(point)) {
    return exact::sign_of(exact::height(plane, points.vertices()[point]));
  }
  if constexpr (exact::kFilters) {
    // Heights of the rounded point: it was moved by at most 2^-25 along each axis. Four roundings
    // a term, of the normal's component, of the difference, of the product and in the sum.
    using Real = exact::filters::RealNormal;
    const Real n(plane.normal);
    const Real v = (Real(points.rounded(point)) * 0x1p-24) - Real(plane.base);
    const Real terms = n * v, size(std::abs(n.x), std::abs(n.y), std::abs(n.z));
    const double value = terms.x + terms.y + terms.z;
    const double permanent = std::abs(terms.x) + std::abs(terms.y) + std::abs(terms.z);
    const double bound = 0x1.1p-25 * (size.x + size.y + size.z) + 0x1p-49 * permanent;
    if (value > bound) return 1;
    if (value < -bound) return -1;
  }
  const BoundaryPoints::Recipe recipe = points.recipe(point);
  if (recipe.kind == BoundaryPoints::Kind::kEdgePlane) {
    return exact::side_of_plane(points.edge_plane(recipe), plane);
  }
  return exact::side_of_plane(points.rational(point), plane);
}

}  // namespace strata::csg
