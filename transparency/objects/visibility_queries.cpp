#include <algorithm>
#include <functional>
#include <numeric>
#include <vector>

#include "transparency/objects/object_techniques.h"
#include "transparency/objects/ordered_blending.h"
#include "transparency/objects/query_order.h"
#include "transparency/stream/sorted_tile.h"
#include "transparency/stream/triangle_distances.h"

// N. Govindaraju, M. Henson, M. Lin, D. Manocha, "Interactive visibility ordering and transparency
// computations among geometric primitives in complex environments" (2005): the order of the objects
// comes from occlusion queries of pairs; objects that hide each other, or themselves, are taken
// apart, and their triangles queried. What all queries would answer is found by drawing all objects
// once; those that the order asks for are counted.

namespace strata::transparency {
namespace {

/// The distinct pairs that one thread has met.
class Pairs {
 public:
  void add(std::uint32_t front, std::uint32_t behind) {
    const std::uint64_t key = std::uint64_t{front} << 32 | behind;
    std::uint64_t& recent = recent_[key * 0x9e3779b97f4a7c15u >> 52];
    if (recent == key + 1) return;
    recent = key + 1;
    if (pairs_.size() == pairs_.capacity()) tidy();
    pairs_.push_back({front, behind});
  }
  void tidy() {
    std::sort(pairs_.begin(), pairs_.end());
    pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
    pairs_.reserve(std::max<std::size_t>(1024, 2 * pairs_.size()));
  }
  [[nodiscard]] const std::vector<Occlusion>& get() const { return pairs_; }

 private:
  std::vector<Occlusion> pairs_;
  std::vector<std::uint64_t> recent_ = std::vector<std::uint64_t>(4096, 0);
};

/// Calls body(list, pairs) for the sorted list of each pixel of the frame. @return the pairs of all
template <class Body>
Result<std::vector<Occlusion>> find_pairs(const FrameInfo& frame, const Execution& execution,
                                          const Body& body) {
  struct Worker {
    std::unique_ptr<FragmentSource::Worker> source;
    TileFragments fragments;
    SortedTile lists;
    Pairs pairs;
    Result<void> failure;
  };
  const int across = (frame.size.x + kTileSide - 1) / kTileSide;
  const int down = (frame.size.y + kTileSide - 1) / kTileSide;
  std::vector<std::unique_ptr<Worker>> workers(static_cast<std::size_t>(execution.thread_count()));
  Execution quiet = execution;
  quiet.progress = {};
  parallel_for(quiet, static_cast<std::size_t>(across) * static_cast<std::size_t>(down),
               [&](std::size_t i, int of) {
                 auto& worker = workers[static_cast<std::size_t>(of)];
                 if (!worker) {
                   worker = std::make_unique<Worker>();
                   worker->source = frame.source->worker();
                 }
                 if (!worker->failure) return;
                 const int tu = static_cast<int>(i) % across, tv = static_cast<int>(i) / across;
                 worker->failure = worker->source->tile(tu, tv, false, worker->fragments);
                 if (!worker->failure) return;
                 const PixelRect rect{tu * kTileSide, tv * kTileSide,
                                      std::min(frame.size.x, (tu + 1) * kTileSide),
                                      std::min(frame.size.y, (tv + 1) * kTileSide)};
                 Costs costs;
                 TileStream stream(worker->fragments, frame, rect, costs);
                 worker->lists.build(stream);
                 for_each_pixel(stream, [&](std::uint32_t pixel) {
                   body(worker->lists.list(pixel), worker->pairs);
                 });
               });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  std::vector<Occlusion> all;
  for (const auto& worker : workers) {
    if (!worker) continue;
    if (!worker->failure) return tl::unexpected(worker->failure.error());
    all.insert(all.end(), worker->pairs.get().begin(), worker->pairs.get().end());
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

struct VisibilityQueriesOrder {
  std::vector<std::uint32_t> ranks;  ///< of each triangle, the first to be drawn first
  std::uint64_t queries = 0, comparisons = 0;
};

/// The pixels that each object may cover.
std::vector<PixelRect> object_boxes(const FrameTriangles& triangles) {
  std::vector<PixelRect> boxes(triangles.objects,
                               PixelRect{kMaxPictureSide, kMaxPictureSide, 0, 0});
  for (std::uint32_t t = 0; t < triangles.part.mesh.triangles.size(); ++t) {
    const std::uint32_t source = triangles.part.source(t);
    PixelRect& box = boxes[triangles.object_of.empty() ? 0 : triangles.object_of[source]];
    for (int i = 0; i < 3; ++i) {
      const glm::ivec3& p = triangles.part.mesh.vertices[triangles.part.mesh.triangles[t][i]];
      const int u = p.x >> kLatticeBits, v = p.y >> kLatticeBits;
      box = {std::min(box.u0, u), std::min(box.v0, v), std::max(box.u1, u + 1),
             std::max(box.v1, v + 1)};
    }
  }
  return boxes;
}

class Ordering {
 public:
  Ordering(const FrameInfo& frame, const Execution& execution)
      : frame_(frame), execution_(execution), out_(std::make_shared<VisibilityQueriesOrder>()) {}

  Result<std::shared_ptr<const void>> run() {
    if (auto done = order_objects(); !done) return tl::unexpected(done.error());
    if (auto done = order_triangles(); !done) return tl::unexpected(done.error());
    return std::shared_ptr<const void>(std::move(out_));
  }

 private:
  [[nodiscard]] std::uint32_t object_of(std::uint32_t triangle) const {
    return frame_.objects.empty() ? 0 : frame_.objects[triangle];
  }
  Result<void> order_objects() {
    auto pairs = find_pairs(frame_, execution_, [&](std::span<const DepthItem> list, Pairs& found) {
      for (std::size_t i = 0; i < list.size(); ++i) {
        const std::uint32_t front = object_of(list[i].triangle());
        for (std::size_t j = i + 1; j < list.size(); ++j) {
          found.add(front, object_of(list[j].triangle()));
        }
      }
    });
    if (!pairs) return tl::unexpected(pairs.error());
    // The farthest first.
    const FrameTriangles& triangles = *frame_.triangles;
    std::vector<double> keys = object_distances(triangles);
    for (double& key : keys) key = -key;
    const std::vector<std::uint32_t> ranks = ranks_of(keys, out_->comparisons);
    std::vector<std::uint32_t> start(ranks.size());
    for (std::uint32_t i = 0; i < ranks.size(); ++i) start[ranks[i]] = i;
    apart_.assign(start.size(), 0);
    for (const Occlusion& pair : *pairs) {
      if (pair.front == pair.behind) apart_[pair.front] = 1;
    }
    std::erase_if(*pairs, [](const Occlusion& pair) { return pair.front == pair.behind; });
    const QueriedOrder order = order_by_queries(*pairs, start, object_boxes(triangles));
    // A query of each object alone tells whether it hides itself.
    out_->queries = order.queries + start.size();
    group_of_.resize(start.size());
    for (std::uint32_t g = 0; g < order.groups.size(); ++g) {
      const auto group = order.groups.group(g);
      for (const std::uint32_t object : group) {
        group_of_[object] = g;
        if (group.size() > 1) apart_[object] = 1;
      }
    }
    return {};
  }

  /// Triangles of the objects that are taken apart.
  Result<void> order_triangles() {
    std::vector<double> keys = triangle_distances(frame_).centroid;
    for (std::size_t t = 0; t < keys.size(); ++t) keys[t] = -keys[t];
    // Nodes, the farthest first.
    const std::vector<std::uint32_t> nodes = ranks_of(keys, out_->comparisons);
    std::vector<DrawEdge> edges;
    if (std::find(apart_.begin(), apart_.end(), 1) != apart_.end()) {
      auto pairs = find_triangle_pairs();
      if (!pairs) return tl::unexpected(pairs.error());
      out_->queries += pairs->size();
      for (const Occlusion& pair : *pairs) edges.push_back({nodes[pair.behind], nodes[pair.front]});
    }
    const DrawGroups order = ordered_groups(static_cast<std::uint32_t>(nodes.size()), edges);
    std::vector<std::uint32_t> triangles(nodes.size()), places(nodes.size());
    for (std::uint32_t t = 0; t < nodes.size(); ++t) triangles[nodes[t]] = t;
    for (std::uint32_t i = 0; i < order.nodes.size(); ++i) places[triangles[order.nodes[i]]] = i;
    std::sort(triangles.begin(), triangles.end(), [&](std::uint32_t a, std::uint32_t b) {
      const std::uint32_t group_a = group_of_[object_of(a)], group_b = group_of_[object_of(b)];
      return group_a != group_b ? group_a < group_b : places[a] < places[b];
    });
    out_->ranks.resize(triangles.size());
    for (std::uint32_t i = 0; i < triangles.size(); ++i) out_->ranks[triangles[i]] = i;
    return {};
  }
  /// Pairs that follow each other in a pixel, within a group of objects that is taken apart.
  Result<std::vector<Occlusion>> find_triangle_pairs() {
    return find_pairs(frame_, execution_, [&](std::span<const DepthItem> list, Pairs& found) {
      for (std::size_t i = 0; i < list.size(); ++i) {
        const std::uint32_t object = object_of(list[i].triangle());
        if (apart_[object] == 0) continue;
        for (std::size_t j = i + 1; j < list.size(); ++j) {
          if (group_of_[object_of(list[j].triangle())] != group_of_[object]) continue;
          if (list[j].triangle() != list[i].triangle()) {
            found.add(list[i].triangle(), list[j].triangle());
          }
          break;
        }
      }
    });
  }

  const FrameInfo& frame_;
  const Execution& execution_;
  std::shared_ptr<VisibilityQueriesOrder> out_;
  std::vector<std::uint8_t> apart_;      ///< of each object: its triangles are ordered
  std::vector<std::uint32_t> group_of_;  ///< of each object
};

Result<std::shared_ptr<const void>> prepare_visibility_queries(const FrameInfo& frame,
                                                               const Settings&,
                                                               const Execution& execution) {
  return Ordering(frame, execution).run();
}

Result<TileRenderer> make_visibility_queries(const FrameInfo&, const Settings&,
                                             const std::shared_ptr<const void>& prepared) {
  return [order = std::static_pointer_cast<const VisibilityQueriesOrder>(prepared),
          blending = std::make_shared<OrderedBlending>()](TileStream& stream,
                                                          TileImage& image) -> Result<void> {
    if (is_first_tile(stream)) {
      stream.costs().comparisons += order->comparisons;
      stream.costs().queries += order->queries;
    }
    blending->render(stream, image, 4 * order->ranks.size(),
                     [&](std::uint32_t, DepthItem item) { return order->ranks[item.triangle()]; });
    return {};
  };
}

}  // namespace

const Technique kVisibilityQueries{
    .name = "visibility-queries",
    .title = "Objects and triangles sorted by occlusion queries",
    .paper = "Govindaraju, Henson, Lin, Manocha 2005",
    .accuracy = Accuracy::kBounded,
    .blending = Blending::kBackToFront,
    .memory = "16 bytes a pixel, 4 a triangle",
    .fails = "triangles that cross each other, or overlap in a circle",
    .needs_triangles = true,
    .prepare = prepare_visibility_queries,
    .make = make_visibility_queries,
};

}  // namespace strata::transparency
