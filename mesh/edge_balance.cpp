#include "mesh/edge_balance.h"

#include <algorithm>
#include <bit>
#include <mutex>
#include <utility>

#include "mesh/weld.h"
#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace strata::detail {
namespace {

constexpr std::size_t kLanes = 4;

/// Uses at one vertex that wait for their opposite use: (higher vertex << 1 | direction). 0 is a
/// free lane.
struct alignas(16) Bucket {
  std::uint32_t lanes[kLanes] = {};
};

/// Bits 0 to 3: the lane equals `value`. Bits 4 to 7: the lane is free.
unsigned match(const Bucket& bucket, std::uint32_t value) {
#ifdef __SSE2__
  const __m128i lanes = _mm_load_si128(reinterpret_cast<const __m128i*>(bucket.lanes));
  const __m128i equal = _mm_cmpeq_epi32(lanes, _mm_set1_epi32(static_cast<int>(value)));
  const __m128i free = _mm_cmpeq_epi32(lanes, _mm_setzero_si128());
  return static_cast<unsigned>(_mm_movemask_ps(_mm_castsi128_ps(equal)) |
                               _mm_movemask_ps(_mm_castsi128_ps(free)) << 4);
#else
  unsigned mask = 0;
  for (unsigned i = 0; i < kLanes; ++i) {
    mask |= static_cast<unsigned>(bucket.lanes[i] == value) << i;
    mask |= static_cast<unsigned>(bucket.lanes[i] == 0) << (i + 4);
  }
  return mask;
#endif
}

/// Sorts the edges and adds up the sums of equal edges. Edges whose sum is 0 are removed.
void cancel(std::vector<EdgeSum>& edges) {
  std::sort(edges.begin(), edges.end(), [](const EdgeSum& a, const EdgeSum& b) {
    return std::pair(a.low, a.high) < std::pair(b.low, b.high);
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < edges.size();) {
    EdgeSum total = edges[i];
    for (++i; i < edges.size() && edges[i].low == total.low && edges[i].high == total.high; ++i) {
      total.sum += edges[i].sum;
    }
    if (total.sum != 0) edges[kept++] = total;
  }
  edges.resize(kept);
}

/// The unbalanced edges whose lower vertex is in [begin, end).
std::vector<EdgeSum> unbalanced_of_range(std::span<const glm::uvec3> triangles, std::uint32_t begin,
                                         std::uint32_t end) {
  std::vector<Bucket> buckets;
  reserve_large(buckets, end - begin);
  buckets.resize(end - begin);
  std::vector<EdgeSum> rest;
  const std::uint32_t size = end - begin;
  const auto use = [&](std::uint32_t from, std::uint32_t to) {
    const std::uint32_t low = std::min(from, to), high = std::max(from, to);
    const std::uint32_t at = low - begin;
    if (at >= size || from == to) return;
    Bucket& bucket = buckets[at];
    const std::uint32_t code = high << 1 | static_cast<std::uint32_t>(from > to);
    const unsigned mask = match(bucket, code ^ 1u);
    if (mask == 0) {
      rest.push_back({low, high, from < to ? 1 : -1});
      return;
    }
    // An opposite use takes precedence over a free lane. Both are equally likely, so a branch would
    // often be mispredicted.
    const auto lane = static_cast<unsigned>(std::countr_zero(mask));
    bucket.lanes[lane & 3u] = lane < kLanes ? 0u : code;
  };
  for (const glm::uvec3& t : triangles) {
    use(t.x, t.y);
    use(t.y, t.z);
    use(t.z, t.x);
  }
  for (std::uint32_t i = 0; i < size; ++i) {
    for (const std::uint32_t code : buckets[i].lanes) {
      if (code != 0) rest.push_back({begin + i, code >> 1, (code & 1u) == 0 ? 1 : -1});
    }
  }
  cancel(rest);
  return rest;
}

/// For vertex numbers of more than 31 bits.
std::vector<EdgeSum> unbalanced_by_sorting(std::span<const glm::uvec3> triangles) {
  std::vector<EdgeSum> edges;
  edges.reserve(3 * triangles.size());
  for (const glm::uvec3& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t from = t[k], to = t[(k + 1) % 3];
      if (from != to) edges.push_back({std::min(from, to), std::max(from, to), from < to ? 1 : -1});
    }
  }
  cancel(edges);
  return edges;
}

}  // namespace

std::vector<EdgeSum> unbalanced_by_index(std::span<const glm::uvec3> triangles,
                                         std::size_t vertex_count, const Execution& execution) {
  if (vertex_count >= std::size_t{1} << 31) return unbalanced_by_sorting(triangles);
  const std::size_t parts =
      triangles.size() < 50000 ? 1 : static_cast<std::size_t>(execution.thread_count());
  std::vector<std::vector<EdgeSum>> found(parts);
  Execution all = execution;
  all.stop = {};
  parallel_for(all, parts, [&](std::size_t part, int) {
    found[part] =
        unbalanced_of_range(triangles, static_cast<std::uint32_t>(vertex_count * part / parts),
                            static_cast<std::uint32_t>(vertex_count * (part + 1) / parts));
  });
  std::vector<EdgeSum> result = std::move(found.front());
  for (std::size_t part = 1; part < parts; ++part) {
    result.insert(result.end(), found[part].begin(), found[part].end());
  }
  return result;
}

template <class Scalar>
std::vector<EdgeSum> unbalanced_by_position(std::vector<EdgeSum> edges,
                                            std::span<const glm::vec<3, Scalar>> positions) {
  if (edges.empty()) return edges;
  using Table = WeldTable<Scalar>;
  Table table(2 * edges.size());
  const auto weld = [&](std::uint32_t vertex) {
    const auto key = Table::canonical(positions[vertex]);
    return table.find_or_insert(key, Table::hash(key), vertex);
  };
  for (EdgeSum& edge : edges) {
    const std::uint32_t a = weld(edge.low), b = weld(edge.high);
    if (a > b) edge.sum = -edge.sum;
    edge.low = std::min(a, b);
    edge.high = std::max(a, b);
  }
  std::erase_if(edges, [](const EdgeSum& edge) { return edge.low == edge.high; });
  cancel(edges);
  return edges;
}

template std::vector<EdgeSum> unbalanced_by_position<double>(std::vector<EdgeSum>,
                                                             std::span<const glm::dvec3>);
template std::vector<EdgeSum> unbalanced_by_position<int>(std::vector<EdgeSum>,
                                                          std::span<const glm::ivec3>);

}  // namespace strata::detail
