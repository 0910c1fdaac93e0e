#include "transparency/objects/query_order.h"

#include <algorithm>

namespace strata::transparency {
namespace {

constexpr std::uint32_t kNowhere = 0xffffffffu;

/// The others of each object's occlusions.
class Neighbours {
 public:
  Neighbours(std::span<const Occlusion> occlusions, std::size_t objects, bool of_front)
      : begins_(objects + 1, 0) {
    for (const Occlusion& o : occlusions) ++begins_[(of_front ? o.front : o.behind) + 1];
    for (std::size_t i = 0; i < objects; ++i) begins_[i + 1] += begins_[i];
    others_.resize(occlusions.size());
    std::vector<std::uint32_t> places(begins_.begin(), begins_.end() - 1);
    for (const Occlusion& o : occlusions) {
      others_[places[of_front ? o.front : o.behind]++] = of_front ? o.behind : o.front;
    }
  }
  [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t object) const {
    return std::span(others_).subspan(begins_[object], begins_[object + 1] - begins_[object]);
  }

 private:
  std::vector<std::uint32_t> begins_, others_;
};

/// @return false if an object has no place
bool insert_all(std::span<const Occlusion> occlusions, std::span<const std::uint32_t> start,
                QueriedOrder& order, std::vector<std::uint32_t>& sorted) {
  const Neighbours hidden_by(occlusions, start.size(), false);
  const Neighbours hides(occlusions, start.size(), true);
  std::vector<std::uint32_t> places(start.size(), kNowhere);
  for (const std::uint32_t object : start) {
    std::uint32_t first = kNowhere;  // that hides it
    for (const std::uint32_t other : hidden_by.of(object)) first = std::min(first, places[other]);
    // The queries: is it hidden by any of the first so many?
    std::uint32_t low = 0, high = static_cast<std::uint32_t>(sorted.size());
    ++order.queries;
    if (first == kNowhere) {
      low = high;
    } else {
      while (low < high) {
        const std::uint32_t middle = (low + high) / 2;
        ++order.queries;
        (first <= middle ? high : low) = first <= middle ? middle : middle + 1;
      }
      ++order.queries;  // does it hide any of the others?
      for (const std::uint32_t other : hides.of(object)) {
        if (places[other] != kNowhere && places[other] >= low) return false;
      }
    }
    sorted.insert(sorted.begin() + low, object);
    for (std::uint32_t i = low; i < sorted.size(); ++i) places[sorted[i]] = i;
  }
  return true;
}

std::uint64_t meeting_pairs(std::span<const PixelRect> boxes) {
  std::vector<PixelRect> sorted(boxes.begin(), boxes.end());
  std::sort(sorted.begin(), sorted.end(),
            [](const PixelRect& a, const PixelRect& b) { return a.u0 < b.u0; });
  std::uint64_t pairs = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    for (std::size_t j = i + 1; j < sorted.size() && sorted[j].u0 < sorted[i].u1; ++j) {
      pairs += sorted[i].v0 < sorted[j].v1 && sorted[j].v0 < sorted[i].v1 ? 1 : 0;
    }
  }
  return pairs;
}

}  // namespace

QueriedOrder order_by_queries(std::span<const Occlusion> occlusions,
                              std::span<const std::uint32_t> start,
                              std::span<const PixelRect> boxes) {
  QueriedOrder order;
  std::vector<std::uint32_t> sorted;
  if (insert_all(occlusions, start, order, sorted)) {
    order.groups.nodes = std::move(sorted);
    for (std::uint32_t i = 0; i <= start.size(); ++i) order.groups.offsets.push_back(i);
    return order;
  }
  order.queries += meeting_pairs(boxes);
  // Nodes are places in the start order, which the groups keep where nothing speaks against it.
  std::vector<std::uint32_t> places(start.size());
  for (std::uint32_t i = 0; i < start.size(); ++i) places[start[i]] = i;
  std::vector<DrawEdge> edges;
  for (const Occlusion& o : occlusions) edges.push_back({places[o.behind], places[o.front]});
  order.groups = ordered_groups(static_cast<std::uint32_t>(start.size()), edges);
  for (std::uint32_t& node : order.groups.nodes) node = start[node];
  return order;
}

}  // namespace strata::transparency
