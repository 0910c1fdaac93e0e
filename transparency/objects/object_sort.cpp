#include <algorithm>
#include <glm/geometric.hpp>
#include <vector>

#include "transparency/objects/object_techniques.h"
#include "transparency/objects/ordered_blending.h"
#include "transparency/stream/triangle_distances.h"

// The oldest answer: the objects are sorted by the distances of their centroids from the eye and
// drawn from the farthest to the nearest, each as it was submitted. (Survey: M. Maule, J. Comba,
// R. Torchelsen, R. Bastos, "A survey of raster-based transparency techniques", 2011)

namespace strata::transparency {
namespace {

struct Order {
  std::vector<std::uint32_t> ranks;  ///< of each object, the farthest first
  std::uint64_t comparisons = 0;
};

Result<std::shared_ptr<const void>> prepare_object_sort(const FrameInfo& frame, const Settings&,
                                                        const Execution&) {
  const FrameTriangles& triangles = *frame.triangles;
  const std::vector<double> distances = object_distances(triangles);
  std::vector<double> keys(distances.size());
  std::transform(distances.begin(), distances.end(), keys.begin(), std::negate<>());
  auto order = std::make_shared<Order>();
  order->ranks = ranks_of(keys, order->comparisons);
  return order;
}

Result<TileRenderer> make_object_sort(const FrameInfo&, const Settings&,
                                      const std::shared_ptr<const void>& prepared) {
  return [order = std::static_pointer_cast<const Order>(prepared),
          blending = std::make_shared<OrderedBlending>()](TileStream& stream,
                                                          TileImage& image) -> Result<void> {
    if (is_first_tile(stream)) stream.costs().comparisons += order->comparisons;
    blending->render(stream, image, 4 * order->ranks.size(), [&](std::uint32_t, DepthItem item) {
      return order->ranks[stream.object(item)];
    });
    return {};
  };
}

}  // namespace

const Technique kObjectSort{
    .name = "object-sort",
    .title = "Objects sorted by their centroids",
    .paper = "survey: Maule, Comba, Torchelsen, Bastos 2011",
    .accuracy = Accuracy::kBounded,
    .blending = Blending::kBackToFront,
    .memory = "16 bytes a pixel, 4 an object",
    .fails = "objects that cross or surround each other; the triangles of an object are not sorted",
    .needs_triangles = true,
    .prepare = prepare_object_sort,
    .make = make_object_sort,
};

}  // namespace strata::transparency
