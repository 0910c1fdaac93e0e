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

/// A use of an edge: [lower vertex:32 | higher vertex:31 | direction:1], direction 1 from the
/// higher. The opposite use differs in the last bit. No use is 0.
using EdgeCode = std::uint64_t;

EdgeCode code_of(std::uint32_t from, std::uint32_t to) {
  const std::uint32_t low = std::min(from, to), high = std::max(from, to);
  return EdgeCode{low} << 32 | EdgeCode{high} << 1 | static_cast<EdgeCode>(from > to);
}

/// Edges of neighbouring triangles lie close together in most files. Uses wait here for their
/// opposite, in a table that fits the second-level cache; those that another one drives out are
/// left over.
class NearEdges {
 public:
  NearEdges() : waiting_(std::size_t{1} << kBits) {}

  /// Adds the triangles up to the end, or until most of their edges are left over.
  /// @return number of triangles that were added
  std::size_t add(std::span<const glm::uvec3> triangles) {
    for (std::size_t begin = 0; begin < triangles.size(); begin += kBlock) {
      const std::size_t end = std::min(triangles.size(), begin + kBlock);
      add_block(triangles.subspan(begin, end - begin));
      // The first uses fill the table.
      if (3 * end > 4 * waiting_.size() && left_.size() > 3 * end / 8) return end;
    }
    return triangles.size();
  }
  /// The uses that found no opposite.
  std::vector<EdgeCode> take_left() {
    for (const EdgeCode code : waiting_) {
      if (code != 0) left_.push_back(code);
    }
    return std::move(left_);
  }

 private:
  static constexpr unsigned kBits = 15;
  static constexpr std::size_t kBlock = 4096;  // triangles

  void add_block(std::span<const glm::uvec3> triangles) {
    const std::size_t before = left_.size();
    left_.resize(before + 3 * triangles.size());
    EdgeCode* out = left_.data() + before;
    EdgeCode* const waiting = waiting_.data();
    // Without branches: whether an opposite waits is as hard to foretell as the mesh.
    const auto use = [&](std::uint32_t from, std::uint32_t to) {
      const EdgeCode code = code_of(from, to);
      EdgeCode& slot = waiting[(code >> 1) * 0x9e3779b97f4a7c15u >> (64 - kBits)];
      const EdgeCode there = slot;
      const bool opposite = there == (code ^ 1u), real = from != to;
      *out = there;
      out += static_cast<std::size_t>(real && there != 0 && !opposite);
      slot = real ? (opposite ? 0 : code) : there;
    };
    for (const glm::uvec3& t : triangles) {
      use(t.x, t.y);
      use(t.y, t.z);
      use(t.z, t.x);
    }
    left_.resize(static_cast<std::size_t>(out - left_.data()));
  }

  std::vector<EdgeCode> waiting_, left_;
};

/// Uses that are left over, and triangles that no table has seen.
struct Rest {
  std::vector<EdgeCode> left;
  std::span<const glm::uvec3> unseen;
};

EdgeSum sum_of(EdgeCode code) {
  return {static_cast<std::uint32_t>(code >> 32), static_cast<std::uint32_t>(code) >> 1,
          (code & 1u) == 0 ? 1 : -1};
}

/// The unbalanced edges whose lower vertex is in [begin, end).
std::vector<EdgeSum> unbalanced_of_range(std::span<const Rest> all, std::uint32_t begin,
                                         std::uint32_t end) {
  std::vector<Bucket> buckets;
  reserve_large(buckets, end - begin);
  buckets.resize(end - begin);
  std::vector<EdgeSum> rest;
  const std::uint32_t size = end - begin;
  const auto use = [&](std::uint32_t low, std::uint32_t code) {
    const std::uint32_t at = low - begin;
    if (at >= size) return;
    Bucket& bucket = buckets[at];
    const unsigned mask = match(bucket, code ^ 1u);
    if (mask == 0) {
      rest.push_back(sum_of(EdgeCode{low} << 32 | code));
      return;
    }
    // An opposite use takes precedence over a free lane. Both are equally likely, so a branch would
    // often be mispredicted.
    const auto lane = static_cast<unsigned>(std::countr_zero(mask));
    bucket.lanes[lane & 3u] = lane < kLanes ? 0u : code;
  };
  const auto use_edge = [&use](std::uint32_t from, std::uint32_t to) {
    if (from == to) return;
    use(std::min(from, to), std::max(from, to) << 1 | static_cast<std::uint32_t>(from > to));
  };
  constexpr std::size_t kAhead = 16;  // triangles whose buckets are on their way
  const auto fetch = [&](std::uint32_t low) {
    __builtin_prefetch(&buckets[low - begin < size ? low - begin : 0]);
  };
  for (const Rest& part : all) {
    for (const EdgeCode edge : part.left) {
      use(static_cast<std::uint32_t>(edge >> 32), static_cast<std::uint32_t>(edge));
    }
    for (std::size_t i = 0; i < part.unseen.size(); ++i) {
      if (i + kAhead < part.unseen.size()) {
        const glm::uvec3 next = part.unseen[i + kAhead];
        fetch(std::min(next.x, next.y));
        fetch(std::min(next.y, next.z));
        fetch(std::min(next.z, next.x));
      }
      const glm::uvec3 t = part.unseen[i];
      use_edge(t.x, t.y);
      use_edge(t.y, t.z);
      use_edge(t.z, t.x);
    }
  }
  for (std::uint32_t i = 0; i < size; ++i) {
    for (const std::uint32_t code : buckets[i].lanes) {
      if (code != 0) rest.push_back(sum_of(EdgeCode{begin + i} << 32 | code));
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
  Execution all = execution;
  all.stop = {};
  std::vector<Rest> rests(parts);
  parallel_for(all, parts, [&](std::size_t part, int) {
    const std::size_t begin = triangles.size() * part / parts,
                      end = triangles.size() * (part + 1) / parts;
    NearEdges near;
    const std::size_t seen = near.add(triangles.subspan(begin, end - begin));
    rests[part] = {near.take_left(), triangles.subspan(begin + seen, end - begin - seen)};
  });
  std::size_t left = 0, unseen = 0;
  for (const Rest& rest : rests) {
    left += rest.left.size();
    unseen += rest.unseen.size();
  }
  std::vector<EdgeSum> result;
  if (unseen == 0 && left < vertex_count / 16) {  // fewer than are worth a bucket for each vertex
    for (const Rest& rest : rests) {
      for (const EdgeCode code : rest.left) result.push_back(sum_of(code));
    }
    cancel(result);
    return result;
  }
  std::vector<std::vector<EdgeSum>> found(parts);
  parallel_for(all, parts, [&](std::size_t part, int) {
    found[part] =
        unbalanced_of_range(rests, static_cast<std::uint32_t>(vertex_count * part / parts),
                            static_cast<std::uint32_t>(vertex_count * (part + 1) / parts));
  });
  for (const std::vector<EdgeSum>& one : found) result.insert(result.end(), one.begin(), one.end());
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
