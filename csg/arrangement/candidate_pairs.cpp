#include "csg/arrangement/candidate_pairs.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>

#include "exact/determinants.h"
#include "mesh/check/plain_stars.h"
#include "mesh/disjoint_sets.h"

namespace strata::csg {
namespace {

using exact::LatticePoint;

// Of each solid, whether it is known not to meet itself.
//
// A surface of the topology of a sphere that is convex at each edge is convex. Snapping moves
// corners by less than a step; the angles by which edges are bent inwards, in sum, stay so small
// that the surface is far from meeting itself as long as its triangles are several steps high.
std::vector<bool> find_embedded(const WeldedSolids& solids, const MeshEdges& edges,
                                std::size_t solid_count) {
  constexpr double kHigh = 8.0, kMostBend = 0.1;
  struct Facts {
    bool possible = true;
    std::int64_t vertices = 0, edges = 0, triangles = 0;
    double bend = 0;  // radians
    std::uint32_t last_root = 0xffffffffu;
  };
  std::vector<Facts> facts(solid_count);
  const auto& vertices = solids.vertices;
  detail::DisjointSets pieces(solids.triangles.size());
  for (std::uint32_t e = 0; e < edges.size(); ++e) {
    const auto uses = edges.uses_of(e);
    const std::uint32_t s = uses[0] / 3, t = uses[uses.size() - 1] / 3;
    const std::uint32_t content = solids.content_of[s];
    if (content < solid_count && !facts[content].possible && uses.size() == 2 &&
        solids.content_of[t] == content) {
      continue;
    }
    const auto corner = [&](std::uint32_t use, std::uint32_t next) {
      return corner_of(solids.triangles, use, next);
    };
    const bool simple = solids.content_of[t] == content && content < solid_count &&
                        to_and_fro(solids.triangles, uses);
    if (!simple) {
      for (const std::uint32_t use : uses) {
        for (const SolidCount& count : solids.content(use / 3)) facts[count.solid].possible = false;
      }
      continue;
    }
    Facts& fact = facts[content];
    ++fact.edges;
    pieces.join(s, t);
    const glm::dvec3 a(vertices[corner(uses[0], 0)]), b(vertices[corner(uses[0], 1)]),
        c(vertices[corner(uses[0], 2)]), d(vertices[corner(uses[1], 2)]);
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double area = glm::length(normal), length = glm::length(b - a);
    const double height = glm::dot(normal, d - a);
    const double high = glm::length(glm::cross(b - a, d - a));
    if (area < kHigh * length || high < kHigh * length) fact.possible = false;
    if (height > 0) fact.bend += height / area / (high / length);
    if (!(fact.bend < kMostBend)) fact.possible = false;
  }
  std::vector<std::uint32_t> owner(vertices.size(), 0xffffffffu);  // vertices of two are nobody's
  for (std::uint32_t t = 0; t < solids.triangles.size(); ++t) {
    for (const SolidCount& count : solids.content(t)) {
      Facts& fact = facts[count.solid];
      if (!fact.possible) continue;
      ++fact.triangles;
      const std::uint32_t root = pieces.find(t);
      if (fact.last_root != 0xffffffffu && fact.last_root != root) fact.possible = false;
      fact.last_root = root;
      for (int k = 0; k < 3; ++k) {
        std::uint32_t& own = owner[solids.triangles[t][k]];
        if (own == count.solid) continue;
        if (own != 0xffffffffu) fact.possible = false;
        own = count.solid;
        ++fact.vertices;
      }
    }
  }
  std::vector<bool> result;
  for (const Facts& fact : facts) {
    result.push_back(fact.possible && fact.vertices - fact.edges + fact.triangles == 2 &&
                     fact.bend < kMostBend);
  }
  return result;
}

// Vertices whose triangles are known to meet in vertices and edges of both alone.
std::vector<std::uint8_t> find_plain(const WeldedSolids& solids, const MeshEdges& edges,
                                     const Execution& execution) {
  std::vector<std::uint8_t> plain =
      plain_stars(std::span<const LatticePoint>(solids.vertices), solids.triangles, execution);
  for (std::uint32_t e = 0; e < edges.size(); ++e) {  // a fan has no other edges
    const auto uses = edges.uses_of(e);
    if (to_and_fro(solids.triangles, uses)) continue;
    plain[corner_of(solids.triangles, uses[0], 0)] = 0;
    plain[corner_of(solids.triangles, uses[0], 1)] = 0;
  }
  return plain;
}

class PairFilter {
 public:
  PairFilter(const WeldedSolids& solids, std::vector<std::uint8_t> plain)
      : solids_(solids), plain_(std::move(plain)) {}

  // Whether each of two triangles has points in the plane of the other, not counting a corner or an
  // edge that both have. Corners of both are equal vertices.
  bool may_meet(const BoxPair& pair) const {
    const glm::uvec3 &t = solids_.triangles[pair.first], &o = solids_.triangles[pair.second];
    for (int k = 0; k < 3; ++k) {
      if ((t[k] == o.x || t[k] == o.y || t[k] == o.z) && plain_[t[k]] != 0) return false;
    }
    return reaches(pair.first, pair.second) && reaches(pair.second, pair.first);
  }

 private:
  bool reaches(std::uint32_t triangle, std::uint32_t other) const {
    const glm::uvec3 &t = solids_.triangles[triangle], &o = solids_.triangles[other];
    const auto& vertices = solids_.vertices;
    const exact::Plane plane = exact::plane_through(vertices[o.x], vertices[o.y], vertices[o.z]);
    const exact::filters::RealNormal normal(plane.normal);
    int above = 0, below = 0, shared = 0;
    for (int k = 0; k < 3; ++k) {
      if (t[k] == o.x || t[k] == o.y || t[k] == o.z) {
        ++shared;
        continue;
      }
      int side = 0;
      if constexpr (exact::kFilters) {
        side = exact::filters::offset(normal, vertices[t[k]] - plane.base).sign();
      }
      if (side == 0) side = exact::sign_of(exact::height(plane, vertices[t[k]]));
      above += side > 0;
      below += side < 0;
    }
    return above + below == 0 || (above + shared < 3 && below + shared < 3);
  }

  const WeldedSolids& solids_;
  std::vector<std::uint8_t> plain_;
};

LatticeBox box_of(const WeldedSolids& solids, const glm::uvec3& t) {
  const LatticePoint &a = solids.vertices[t.x], &b = solids.vertices[t.y],
                     &c = solids.vertices[t.z];
  return {glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c))};
}

// Puts lists together. @param count  of triangles
std::vector<BoxPair> sorted_pairs(std::vector<std::vector<BoxPair>>& lists, std::size_t count) {
  std::vector<std::uint32_t> next(count + 1, 0);
  for (const auto& list : lists) {
    for (const BoxPair& pair : list) ++next[pair.first + 1];
  }
  std::partial_sum(next.begin(), next.end(), next.begin());
  std::vector<BoxPair> result(next.back());
  for (auto& list : lists) {
    for (const BoxPair& pair : list) result[next[pair.first]++] = pair;
    list = {};
  }
  for (auto begin = result.begin(); begin != result.end();) {
    auto end = begin + 1;
    while (end != result.end() && end->first == begin->first) ++end;
    std::sort(begin, end);
    begin = end;
  }
  return result;
}

}  // namespace

Result<std::vector<BoxPair>> find_candidate_pairs(const WeldedSolids& solids,
                                                  const MeshEdges& edges, std::size_t solid_count,
                                                  const LiveZone& zone,
                                                  const Execution& execution) {
  const std::vector<bool> embedded = find_embedded(solids, edges, solid_count);
  const auto count = static_cast<std::uint32_t>(solids.triangles.size());
  std::vector<LatticeBox> boxes;
  std::vector<std::uint32_t> groups, triangles;
  for (std::uint32_t t = 0; t < count; ++t) {
    const LatticeBox box = box_of(solids, solids.triangles[t]);
    if (!zone.touches(box)) continue;
    triangles.push_back(t);
    boxes.push_back(box);
    const std::uint32_t content = solids.content_of[t];
    const bool one_group = content < embedded.size() && embedded[content];
    // A group of its own: its pairs with all others are wanted.
    groups.push_back(one_group ? content : static_cast<std::uint32_t>(embedded.size()) + t);
  }
  const bool all_embedded = std::ranges::find(embedded, false) == embedded.end();
  const PairFilter filter(solids, all_embedded
                                      ? std::vector<std::uint8_t>(solids.vertices.size(), 0)
                                      : find_plain(solids, edges, execution));
  std::vector<std::vector<BoxPair>> found(static_cast<std::size_t>(execution.thread_count()));
  std::atomic<std::uint64_t> bytes = 0;
  const auto too_many = [&] {
    return execution.memory_limit != 0 && bytes.load() > execution.memory_limit;
  };
  const auto visit = [&](std::span<const BoxPair> pairs, int worker) {
    if (too_many()) return;
    std::vector<BoxPair>& mine = found[static_cast<std::size_t>(worker)];
    const std::size_t before = mine.size();
    for (const auto& [first, second] : pairs) {
      const BoxPair pair{triangles[first], triangles[second]};
      const LatticeBox &a = boxes[first], &b = boxes[second];
      if (zone.touches({glm::max(a.low, b.low), glm::min(a.high, b.high)}) &&
          filter.may_meet(pair)) {
        mine.push_back(pair);
      }
    }
    bytes += (mine.size() - before) * sizeof(BoxPair);
  };
  if (auto searched = for_box_pairs(boxes, groups, visit, execution); !searched) {
    return tl::unexpected(searched.error());
  }
  if (too_many()) {
    return fail(ErrorCode::kLimit,
                "{} pairs of triangles or more may meet; the memory limit is {} bytes",
                bytes.load() / sizeof(BoxPair), execution.memory_limit);
  }
  return sorted_pairs(found, count);
}

}  // namespace strata::csg
