#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "raster/triangle_setup.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "transparency/stream/tile_stream.h"

namespace strata::transparency {

/// An order of the triangles' pieces that is right in every pixel, for the pixels of the frame.
///
/// Pairs of triangles that share pixels are compared as in M. Newell, R. Newell, T. Sancha, "A
/// solution to the hidden surface problem" (1972). Those without an order, since they cross or
/// overlap in a circle, are split by the plane of one of them, as in H. Fuchs, Z. Kedem, B. Naylor,
/// "On visible surface generation by a priori tree structures" (1980): what lies behind it, itself,
/// what lies before it; each side is ordered in the same way. A fragment belongs to the piece on
/// its side of the planes, by the exact depths of the rasterizer, so that ties are ties everywhere.
class SplitOrder {
 public:
  /// The place of a fragment's piece; the least is drawn first. (u, v) is a sample of the picture.
  [[nodiscard]] std::uint32_t rank(int u, int v, DepthItem item) const {
    std::uint32_t node = piece_of(u, v, item.triangle());
    while (nodes_[node].plane != kLeaf) {
      const bool before = item < on_plane(nodes_[node].plane, u, v);
      node = before ? nodes_[node].before : nodes_[node].behind;
    }
    return nodes_[node].rank;
  }
  [[nodiscard]] std::uint64_t pieces() const { return pieces_; }
  /// Pairs of pieces that were compared.
  [[nodiscard]] std::uint64_t comparisons() const { return comparisons_; }

 private:
  friend class SplitBuilder;
  static constexpr std::uint32_t kLeaf = 0xffffffffu;
  /// A piece, or the plane that splits it. The first nodes are whole triangles of the view part.
  struct Node {
    std::uint32_t plane = kLeaf;
    std::uint32_t rank = 0, behind = 0, before = 0;
  };

  /// Where the plane of a triangle lies in a pixel, as a fragment.
  [[nodiscard]] DepthItem on_plane(std::uint32_t triangle, int u, int v) const {
    const TriangleSetup& t = planes_[triangle];
    const std::int64_t du = std::int64_t{u} * kLatticeSteps + kLatticeSteps / 2 - t.u[0];
    const std::int64_t dv = std::int64_t{v} * kLatticeSteps + kLatticeSteps / 2 - t.v[0];
    // As exact_depth(), which far beside a steep triangle would not fit into 64 bits.
    const Int128 steep = Int128{t.slope_u} * du + Int128{t.slope_v} * dv - t.tie_down;
    const Int128 depth =
        std::clamp<Int128>(t.w0 + floor_div(steep, t.area), 0, Int128{kPictureDepthLimit} - 1);
    return {static_cast<std::uint32_t>(depth), t.exit, sources_[triangle]};
  }
  [[nodiscard]] bool covers(std::uint32_t triangle, int u, int v) const {
    const TriangleSetup& t = planes_[triangle];
    if (t.area == 0) return false;
    const std::int64_t pu = std::int64_t{u} * kLatticeSteps + kLatticeSteps / 2;
    const std::int64_t pv = std::int64_t{v} * kLatticeSteps + kLatticeSteps / 2;
    for (int i = 0; i < 3; ++i) {
      const TriangleSetup::Edge e = t.edge(i);
      if (e.a * pu + e.b * pv + e.c < 0) return false;
    }
    return true;
  }
  /// What is cut at the near plane has several triangles for one.
  [[nodiscard]] std::uint32_t piece_of(int u, int v, std::uint32_t source) const {
    std::uint32_t triangle = first_of_[source];
    const std::uint32_t end = first_of_[source + 1];
    while (triangle + 1 < end && !covers(triangle, u, v)) ++triangle;
    return triangle;
  }

  std::vector<TriangleSetup> planes_;    ///< of each triangle of the view part
  std::vector<std::uint32_t> sources_;   ///< of the same
  std::vector<std::uint32_t> first_of_;  ///< of each source triangle, and the end
  std::vector<Node> nodes_;
  std::uint64_t pieces_ = 0, comparisons_ = 0;
};

/// @param most  pieces for each triangle, on average @return kLimit naming it; kCancelled
Result<std::shared_ptr<const SplitOrder>> split_order(const FrameInfo& frame, unsigned most,
                                                      const Execution& execution);

}  // namespace strata::transparency
