#include <algorithm>
#include <functional>
#include <vector>

#include "transparency/objects/object_techniques.h"
#include "transparency/objects/ordered_blending.h"
#include "transparency/objects/plane_split.h"
#include "transparency/stream/triangle_distances.h"

// The triangles are sorted by the distances of their centroids, or of their farthest corners, and
// drawn from the farthest to the nearest: M. Newell, R. Newell, T. Sancha, "A solution to the
// hidden surface problem" (1972), without their tests. The variant `split` makes the tests, and
// splits by planes what has no order; see plane_split.h.

namespace strata::transparency {
namespace {

struct PrimitiveSortOrder {
  std::vector<std::uint32_t> ranks;  ///< of each triangle, the farthest first
  std::uint64_t comparisons = 0;
  std::shared_ptr<const SplitOrder> split;  ///< instead of the ranks
};

Result<std::shared_ptr<const void>> prepare_primitive_sort(const FrameInfo& frame,
                                                           const Settings& settings,
                                                           const Execution& execution) {
  auto order = std::make_shared<PrimitiveSortOrder>();
  if (settings.variant == "split") {
    auto split = split_order(frame, settings.k, execution);
    if (!split) return tl::unexpected(split.error());
    order->split = std::move(*split);
    order->comparisons = order->split->comparisons();
    return order;
  }
  TriangleDistances distances = triangle_distances(frame);
  std::vector<double>& keys = settings.variant == "max" ? distances.farthest : distances.centroid;
  std::transform(keys.begin(), keys.end(), keys.begin(), std::negate<>());
  order->ranks = ranks_of(keys, order->comparisons);
  return order;
}

Result<TileRenderer> make_primitive_sort(const FrameInfo&, const Settings&,
                                         const std::shared_ptr<const void>& prepared) {
  return [order = std::static_pointer_cast<const PrimitiveSortOrder>(prepared),
          blending = std::make_shared<OrderedBlending>()](TileStream& stream,
                                                          TileImage& image) -> Result<void> {
    if (is_first_tile(stream)) stream.costs().comparisons += order->comparisons;
    if (order->split == nullptr) {
      blending->render(stream, image, 4 * order->ranks.size(), [&](std::uint32_t, DepthItem item) {
        return order->ranks[item.triangle()];
      });
      return {};
    }
    const PixelRect& rect = stream.rect();
    blending->render(
        stream, image, 4 * order->split->pieces(), [&](std::uint32_t pixel, DepthItem item) {
          return order->split->rank(rect.u0 + static_cast<int>(pixel % kTileSide),
                                    rect.v0 + static_cast<int>(pixel / kTileSide), item);
        });
    return {};
  };
}

}  // namespace

const Technique kPrimitiveSort{
    .name = "primitive-sort",
    .title = "Triangles sorted by depth; split: cut where they have no order",
    .paper = "Newell, Newell, Sancha 1972",
    .accuracy = Accuracy::kBounded,
    .blending = Blending::kBackToFront,
    .k_means = "pieces a triangle",
    .default_k = 64,
    .least_k = 1,
    .most_k = 4096,
    .variants = "centroid max split",
    .memory = "16 bytes a pixel, 4 a triangle (split: a piece)",
    .fails = "triangles that cross, or overlap in a circle; split is exact, and slow for many",
    .needs_triangles = true,
    .prepare = prepare_primitive_sort,
    .make = make_primitive_sort,
};

}  // namespace strata::transparency
