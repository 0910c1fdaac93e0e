#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "strata/raster/raster_target.h"
#include "transparency/objects/draw_order.h"

namespace strata::transparency {

/// What occlusion queries tell of a pair: a fragment of `front` lies before one of `behind` in some
/// pixel. Both orders may be true of a pair.
struct Occlusion {
  std::uint32_t front = 0, behind = 0;
  friend auto operator<=>(const Occlusion&, const Occlusion&) = default;
};

/// An order to draw in, and what it took.
struct QueriedOrder {
  DrawGroups groups;  ///< a group of several has no order
  std::uint64_t queries = 0;
};

/// Sorts objects such that none is drawn before one that it hides. Each is inserted into the order
/// so far by queries of the object against the first so many; one that passes the query against all
/// is drawn last: an order that is right costs one query an object. If one must be drawn before
/// others and after others that are drawn later, all pairs whose boxes meet are asked.
/// (N. Govindaraju, M. Henson, M. Lin, D. Manocha, "Interactive visibility ordering and
/// transparency computations among geometric primitives in complex environments", 2005)
/// @param occlusions  increasing, without pairs of one object
/// @param start  the objects in the order of the frame before, or any other
/// @param boxes  the pixels of each object
[[nodiscard]] QueriedOrder order_by_queries(std::span<const Occlusion> occlusions,
                                            std::span<const std::uint32_t> start,
                                            std::span<const PixelRect> boxes);

}  // namespace strata::transparency
