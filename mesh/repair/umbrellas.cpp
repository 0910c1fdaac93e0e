#include "mesh/repair/umbrellas.h"

#include <algorithm>
#include <array>

namespace strata {
namespace {

using Index = std::uint32_t;
constexpr std::size_t kFew = 16;  // corners that are searched one by one

// A corner of a triangle at the point: the edge of the triangle that does not touch the point runs
// from `next` to `previous`. Numbers tell edges with the same ends apart.
struct Corner {
  Index half_edge;  // 3 t + k, k the corner
  Index next, next_wedge;
  Index previous, previous_wedge;
};

class Umbrellas {
 public:
  Umbrellas(std::vector<glm::uvec3>& triangles, std::size_t point_count,
            std::span<const WedgeEdge> wedges, const Execution& execution)
      : triangles_(triangles), point_count_(point_count), execution_(execution) {
    for (const WedgeEdge& edge : wedges) {
      wedges_.emplace_back(3 * edge.triangle + edge.corner, edge.wedge);
    }
    std::sort(wedges_.begin(), wedges_.end());
  }

  Result<std::vector<Index>> run();

 private:
  void group_corners();
  bool split(Index point);
  bool one_fan(Index point) const;
  void gather(Index point);
  std::size_t across(std::size_t corner) const;
  Index wedge(Index half_edge) const {
    const auto found = std::lower_bound(wedges_.begin(), wedges_.end(), std::pair(half_edge, 0u));
    return found != wedges_.end() && found->first == half_edge ? found->second : 0;
  }

  std::vector<glm::uvec3>& triangles_;
  std::size_t point_count_;
  const Execution& execution_;
  std::vector<std::pair<Index, Index>> wedges_;  // half-edge, number
  std::vector<Index> first_, at_;                // the corners at each point
  std::vector<Corner> around_;                   // a point, by (next, next_wedge)
  std::vector<std::uint8_t> in_fan_;
  std::vector<Index> additional_;                 // their points
  std::vector<std::pair<Index, Index>> changed_;  // corner, its vertex
};

void Umbrellas::group_corners() {
  first_.assign(point_count_ + 1, 0);
  for (const glm::uvec3& t : triangles_) ++first_[t.x], ++first_[t.y], ++first_[t.z];
  Index sum = 0;
  for (Index& first : first_) first = sum += first;
  at_.resize(3 * triangles_.size());
  for (std::size_t t = triangles_.size(); t-- > 0;) {
    for (Index k = 0; k < 3; ++k) {
      at_[--first_[triangles_[t][static_cast<int>(k)]]] = static_cast<Index>(3 * t) + k;
    }
  }
}

// Whether one walk around the point meets all its corners, where no edge has more than two
// triangles.
bool Umbrellas::one_fan(Index point) const {
  const Index first = first_[point], count = first_[point + 1] - first;
  std::array<Index, kFew> next, previous;
  for (Index i = 0; i < count; ++i) {
    const glm::uvec3& t = triangles_[at_[first + i] / 3];
    const Index k = at_[first + i] % 3;
    next[i] = k == 0 ? t.y : k == 1 ? t.z : t.x;
    previous[i] = k == 0 ? t.z : k == 1 ? t.x : t.y;
  }
  Index met = 0, at = 0;
  do {
    Index following = 0;
    while (following < count && next[following] != previous[at]) ++following;
    if (following == count) return false;
    at = following;
  } while (++met < count && at != 0);
  return met == count && at == 0;
}

void Umbrellas::gather(Index point) {
  around_.clear();
  for (Index i = first_[point]; i < first_[point + 1]; ++i) {
    const Index half_edge = at_[i], t = half_edge / 3, k = half_edge % 3;
    const Index before = 3 * t + (k + 2) % 3;
    around_.push_back({half_edge, triangles_[t][static_cast<int>((k + 1) % 3)], wedge(half_edge),
                       triangles_[t][static_cast<int>((k + 2) % 3)], wedge(before)});
  }
  std::sort(around_.begin(), around_.end(), [](const Corner& a, const Corner& b) {
    return a.next != b.next ? a.next < b.next : a.next_wedge < b.next_wedge;
  });
}

// The corner that follows counter-clockwise.
std::size_t Umbrellas::across(std::size_t corner) const {
  const Corner& from = around_[corner];
  const auto found =
      std::lower_bound(around_.begin(), around_.end(), from, [](const Corner& a, const Corner& b) {
        return a.next != b.previous ? a.next < b.previous : a.next_wedge < b.previous_wedge;
      });
  return found != around_.end() && found->next == from.previous &&
                 found->next_wedge == from.previous_wedge
             ? static_cast<std::size_t>(found - around_.begin())
             : around_.size();
}

bool Umbrellas::split(Index point) {
  gather(point);
  in_fan_.assign(around_.size(), 0);
  bool first_fan = true;
  for (std::size_t start = 0; start < around_.size(); ++start) {
    if (in_fan_[start] != 0) continue;
    Index vertex = point;
    if (!first_fan) {
      vertex = static_cast<Index>(point_count_ + additional_.size());
      additional_.push_back(point);
    }
    first_fan = false;
    std::size_t at = start;
    do {
      if (at == around_.size() || in_fan_[at] != 0) return false;
      in_fan_[at] = 1;
      if (vertex != point) changed_.emplace_back(around_[at].half_edge, vertex);
      at = across(at);
    } while (at != start);
  }
  return true;
}

Result<std::vector<Index>> Umbrellas::run() {
  group_corners();
  std::vector<std::uint8_t> has_wedge(point_count_, 0);
  for (const auto& [half_edge, wedge] : wedges_) {
    const glm::uvec3& t = triangles_[half_edge / 3];
    has_wedge[t[static_cast<int>(half_edge % 3)]] = 1;
    has_wedge[t[static_cast<int>(half_edge % 3 == 2 ? 0 : half_edge % 3 + 1)]] = 1;
  }
  constexpr std::size_t kRange = 1 << 14;
  std::vector<std::vector<Index>> several((point_count_ + kRange - 1) / kRange);
  parallel_for(execution_, several.size(), [&](std::size_t r, int) {
    const std::size_t end = std::min(point_count_, (r + 1) * kRange);
    for (auto point = static_cast<Index>(r * kRange); point < end; ++point) {
      const Index count = first_[point + 1] - first_[point];
      if (count == 0 || (has_wedge[point] == 0 && count <= kFew && one_fan(point))) continue;
      several[r].push_back(point);
    }
  });
  if (execution_.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  for (const std::vector<Index>& points : several) {
    for (const Index point : points) {
      if (!split(point)) {
        return fail(ErrorCode::kInternal,
                    "the triangles around the boundary's point {} do not close", point);
      }
    }
  }
  for (const auto& [half_edge, vertex] : changed_) {
    triangles_[half_edge / 3][static_cast<int>(half_edge % 3)] = vertex;
  }
  return std::move(additional_);
}

}  // namespace

Result<std::vector<Index>> split_umbrellas(std::vector<glm::uvec3>& triangles,
                                           std::size_t point_count,
                                           std::span<const WedgeEdge> wedges,
                                           const Execution& execution) {
  return Umbrellas(triangles, point_count, wedges, execution).run();
}

}  // namespace strata
