#include <algorithm>
#include <cmath>

#include "csg/scene/evaluator.h"

namespace strata::csg {

double Evaluator::number(std::uint32_t node, std::string_view argument, const ValueRef& value,
                         double otherwise) {
  if (value.given() && !value.is_number()) {
    warn(node, "geometry",
         fmt::format("'{}': {} is {}, not a number; {:g} is used", name(node), argument,
                     value.shown(), otherwise));
  }
  return value.number(otherwise);
}

void Evaluator::read_sizes(std::uint32_t node, std::span<double> sizes) {
  std::fill(sizes.begin(), sizes.end(), 1.0);
  const ValueRef value = arguments(node).find("size", 0);
  if (!value.given()) return;
  if (value.is_number()) return std::fill(sizes.begin(), sizes.end(), value.number(1.0));
  std::size_t count = 0;
  for ([[maybe_unused]] const ValueRef element : value) ++count;
  if (count == sizes.size() && value.numbers(sizes.data(), count) == count) return;
  std::fill(sizes.begin(), sizes.end(), 1.0);
  warn(node, "geometry",
       fmt::format("'{}': size is {}, not a number or {} numbers; 1 is used", name(node),
                   value.shown(), sizes.size()));
}

void Evaluator::read_new_size(std::uint32_t node, std::span<double> sizes) {
  std::fill(sizes.begin(), sizes.end(), 0.0);
  const ValueRef value = arguments(node).find("newsize", 0);
  bool all = !value.given() || value.is_list();
  std::size_t axis = 0;
  for (const ValueRef element : value) {
    const double size = element.number(NAN);
    all &= std::isfinite(size);
    // A negative size keeps the axis, as 0 does in OpenSCAD.
    if (axis < sizes.size()) sizes[axis++] = std::isfinite(size) ? std::max(size, 0.0) : 0.0;
  }
  if (!all) {
    warn(
        node, "geometry",
        fmt::format(
            "'{}': newsize is {}, not finite numbers; axes without a finite number keep their size",
            name(node), value.shown()));
  }
}

double Evaluator::radius(std::uint32_t node, std::string_view radius, std::string_view diameter,
                         std::uint32_t position, double otherwise) {
  const NodeArguments given = arguments(node);
  if (const ValueRef value = given.find(diameter); value.given()) {
    return 0.5 * number(node, diameter, value, 2.0 * otherwise);
  }
  return number(node, radius, given.find(radius, position), otherwise);
}

Segments Evaluator::segments(std::uint32_t node) {
  const NodeArguments given = arguments(node);
  for (const char* const name : {"$fn", "$fa", "$fs"}) {
    const ValueRef value = given.find(name);
    if (!value.given() || value.is_number()) continue;
    warn(node, "geometry",
         fmt::format("'{}': {} is {}, not a number; its default is used", this->name(node), name,
                     value.shown()));
  }
  const Segments segments = given.segments(newer_);
  if (std::isfinite(segments.fn) && segments.fn > Segments::kMost) {
    warn(node, "approximate",
         fmt::format("'{}': $fn is {:g}; {:g} is used", name(node), segments.fn, Segments::kMost));
  }
  return segments;
}

bool Evaluator::is_length(std::uint32_t node, std::string_view argument, double length) {
  if (std::isfinite(length) && length >= 0.0) return true;
  // The sign of a NaN has no meaning.
  warn(node, "geometry",
       fmt::format("'{}': {} is {:g}, {}; it is left out", name(node), argument,
                   std::isnan(length) ? std::abs(length) : length,
                   std::isfinite(length) ? "less than 0" : "not finite"));
  return false;
}

}  // namespace strata::csg
