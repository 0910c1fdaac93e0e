#include "mesh/repair/canonical_order.h"

#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <span>
#include <tuple>
#include <utility>

namespace strata {
namespace {

using exact::FilePoint;
using Index = std::uint32_t;
using Keyed = std::uint64_t;  // [key:32 | vertex:32]

bool before(const FilePoint& a, const FilePoint& b) {
  return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
}

// Sorts vertices by position: by radix along an axis, then what is equal there along the next one.
class PositionSort {
 public:
  explicit PositionSort(const std::vector<FilePoint>& positions) : positions_(positions) {}

  void run(std::span<Keyed> vertices) {
    spare_.resize(vertices.size());
    sort(vertices, 0);
  }

 private:
  static constexpr std::size_t kFew = 256;
  static constexpr int kDigit = 11;

  const FilePoint& at(Keyed vertex) const { return positions_[vertex & 0xffffffffu]; }

  void sort(std::span<Keyed> vertices, int axis) {
    if (vertices.size() <= kFew) {
      std::sort(vertices.begin(), vertices.end(),
                [this](Keyed a, Keyed b) { return before(at(a), at(b)); });
      return;
    }
    std::int64_t low = at(vertices[0])[axis], high = low;
    for (const Keyed vertex : vertices) {
      low = std::min(low, at(vertex)[axis]);
      high = std::max(high, at(vertex)[axis]);
    }
    if (low == high) {
      if (axis < 2) sort(vertices, axis + 1);
      return;
    }
    const auto range = static_cast<std::uint64_t>(high - low);
    const int shift = std::max(0, static_cast<int>(std::bit_width(range)) - 32);
    for (Keyed& vertex : vertices) {
      const auto key = static_cast<std::uint64_t>(at(vertex)[axis] - low) >> shift;
      vertex = key << 32 | (vertex & 0xffffffffu);
    }
    radix_sort(vertices);
    for (std::size_t begin = 0, end = 0; begin < vertices.size(); begin = end) {
      while (end < vertices.size() && vertices[end] >> 32 == vertices[begin] >> 32) ++end;
      if (end - begin > 1) sort(vertices.subspan(begin, end - begin), axis);
    }
  }

  void radix_sort(std::span<Keyed> vertices) {
    for (int bit = 32; bit < 64; bit += kDigit) {
      std::array<Index, (1 << kDigit) + 1> place{};
      const auto digit = [bit](Keyed vertex) { return vertex >> bit & ((1 << kDigit) - 1); };
      for (const Keyed vertex : vertices) ++place[digit(vertex) + 1];
      if (place[digit(vertices[0]) + 1] == vertices.size()) continue;
      for (std::size_t i = 1; i < place.size(); ++i) place[i] += place[i - 1];
      for (const Keyed vertex : vertices) spare_[place[digit(vertex)]++] = vertex;
      std::copy_n(spare_.begin(), vertices.size(), vertices.begin());
    }
  }

  const std::vector<FilePoint>& positions_;
  std::vector<Keyed> spare_;
};

class Ordering {
 public:
  using Compare = std::function<int(Index, Index)>;

  Ordering(const RoundedMesh& mesh, const Compare& compare, const Execution& execution)
      : positions_(mesh.positions),
        triangles_(mesh.triangles),
        mesh_(mesh),
        compare_(compare),
        execution_(execution) {}

  RoundedMesh run() {
    sort_vertices();
    sort_equal_positions();
    RoundedMesh result;
    result.positions.reserve(order_.size());
    for (const Keyed vertex : order_) result.positions.push_back(positions_[vertex_of(vertex)]);
    sort_triangles(result);
    return result;
  }

 private:
  static Index vertex_of(Keyed vertex) { return static_cast<Index>(vertex & 0xffffffffu); }
  void sort_vertices();
  void sort_equal_positions();
  void sort_runs(std::vector<Index>& place);
  void sort_triangles(RoundedMesh& result) const;
  template <class Work>
  void in_ranges(std::size_t count, const Work& work) const {
    constexpr std::size_t kRange = 1 << 15;
    parallel_for(execution_, (count + kRange - 1) / kRange,
                 [&](std::size_t r, int) { work(r * kRange, std::min(count, (r + 1) * kRange)); });
  }

  const std::vector<FilePoint>& positions_;
  const std::vector<glm::uvec3>& triangles_;
  const RoundedMesh& mesh_;
  const Compare& compare_;
  const Execution& execution_;
  std::vector<Keyed> order_;
  std::vector<Index> rank_;  // of a vertex
};

void Ordering::sort_vertices() {
  rank_.assign(positions_.size(), 0);
  for (const glm::uvec3& t : triangles_) rank_[t.x] = rank_[t.y] = rank_[t.z] = 1;
  for (Index v = 0; v < rank_.size(); ++v) {
    if (rank_[v] != 0) order_.push_back(v);
  }
  PositionSort(positions_).run(order_);
  for (Index i = 0; i < order_.size(); ++i) rank_[order_[i] & 0xffffffffu] = i;
}

// Sorts vertices of equal positions by compare_. @param place  gets the number of the first vertex
// that is equal in all, by rank
void Ordering::sort_runs(std::vector<Index>& place) {
  place.resize(order_.size());
  for (std::size_t begin = 0, end = 0; begin < order_.size(); begin = end) {
    const FilePoint& at = positions_[vertex_of(order_[begin])];
    while (end < order_.size() && positions_[vertex_of(order_[end])] == at) ++end;
    if (end - begin > 1 && compare_) {
      std::sort(order_.begin() + static_cast<std::ptrdiff_t>(begin),
                order_.begin() + static_cast<std::ptrdiff_t>(end),
                [this](Keyed a, Keyed b) { return compare_(vertex_of(a), vertex_of(b)) < 0; });
    }
    for (std::size_t i = begin; i < end; ++i) {
      const bool same =
          i > begin && (!compare_ || compare_(vertex_of(order_[i - 1]), vertex_of(order_[i])) == 0);
      place[i] = same ? place[i - 1] : static_cast<Index>(i);
      rank_[vertex_of(order_[i])] = static_cast<Index>(i);
    }
  }
}

void Ordering::sort_equal_positions() {
  std::vector<Index> place;
  sort_runs(place);
  // The other corners, as places, of the least triangle at a vertex.
  using Corners = std::pair<Index, Index>;
  std::map<Index, Corners> least;  // of vertices that share their place
  for (std::size_t i = 1; i < order_.size(); ++i) {
    if (place[i] != place[i - 1]) continue;
    for (const std::size_t k : {i - 1, i})
      least[static_cast<Index>(k)] = {0xffffffffu, 0xffffffffu};
  }
  if (least.empty()) return;
  for (const glm::uvec3& t : triangles_) {
    for (int k = 0; k < 3; ++k) {
      const auto found = least.find(rank_[t[k]]);
      if (found == least.end()) continue;
      found->second = std::min(found->second,
                               Corners(place[rank_[t[(k + 1) % 3]]], place[rank_[t[(k + 2) % 3]]]));
    }
  }
  std::vector<std::tuple<Index, Corners, Keyed>> run;
  for (const auto& [rank, corners] : least) run.emplace_back(place[rank], corners, order_[rank]);
  std::sort(run.begin(), run.end());
  std::size_t next = 0;
  for (const auto& [rank, corners] : least) {
    order_[rank] = std::get<2>(run[next++]);
    rank_[vertex_of(order_[rank])] = rank;
  }
}

// Sorts triangles [begin, end), whose first vertex is the same, by the second one.
void sort_bucket(RoundedMesh& mesh, std::size_t begin, std::size_t end) {
  const auto second = [&mesh](std::size_t t) { return mesh.triangles[t].y; };
  if (end - begin <= 12) {
    for (std::size_t i = begin + 1; i < end; ++i) {
      for (std::size_t k = i; k > begin && second(k) < second(k - 1); --k) {
        std::swap(mesh.triangles[k], mesh.triangles[k - 1]);
        std::swap(mesh.labels[k], mesh.labels[k - 1]);
      }
    }
    return;
  }
  std::vector<std::pair<glm::uvec3, Index>> bucket;
  for (std::size_t t = begin; t < end; ++t) bucket.emplace_back(mesh.triangles[t], mesh.labels[t]);
  std::sort(bucket.begin(), bucket.end(),
            [](const auto& a, const auto& b) { return a.first.y < b.first.y; });
  for (std::size_t t = begin; t < end; ++t) {
    std::tie(mesh.triangles[t], mesh.labels[t]) = bucket[t - begin];
  }
}

void Ordering::sort_triangles(RoundedMesh& result) const {
  const std::size_t count = triangles_.size();
  std::vector<glm::uvec3> turned(count);
  in_ranges(count, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const glm::uvec3 r(rank_[triangles_[t].x], rank_[triangles_[t].y], rank_[triangles_[t].z]);
      turned[t] = r.x < r.y && r.x < r.z ? r
                  : r.y < r.z            ? glm::uvec3(r.y, r.z, r.x)
                                         : glm::uvec3(r.z, r.x, r.y);
    }
  });
  std::vector<Index> first(order_.size() + 1, 0);
  for (const glm::uvec3& t : turned) ++first[t.x];
  Index sum = 0;
  for (Index& begin : first) begin = sum += begin;
  result.triangles.resize(count);
  result.labels.resize(count);
  result.groups.resize(count);
  for (std::size_t t = count; t-- > 0;) {
    const Index to = --first[turned[t].x];
    result.triangles[to] = turned[t];
    result.labels[to] = static_cast<Index>(t);  // for now
  }
  // A vertex has few triangles of which it is the least; an edge has one on its left.
  in_ranges(order_.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) sort_bucket(result, first[v], first[v + 1]);
  });
  in_ranges(count, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const Index from = result.labels[t];
      result.labels[t] = mesh_.labels[from];
      result.groups[t] = mesh_.groups[from];
    }
  });
}

}  // namespace

void canonical_order(RoundedMesh& mesh, const std::function<int(Index, Index)>& compare,
                     const Execution& execution) {
  Execution all = execution;
  all.stop = {};  // half an order is none
  mesh = Ordering(mesh, compare, all).run();
}

}  // namespace strata
