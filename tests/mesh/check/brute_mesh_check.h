#pragma once

// Laws L1 and L2 of boundary meshes for small meshes, by brute force and in fractions: each pair of
// triangles is compared. Shares no code with mesh/check.

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cstdint>
#include <glm/vec3.hpp>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tests/mesh/check/triangle_oracle.h"

namespace strata::oracle {

using Exact = Geometry<boost::multiprecision::cpp_rational>;
using Triple = std::array<double, 3>;

struct MeshFaults {
  struct Pair {
    std::uint32_t first, second;
    Exact::Shares shares;
  };
  std::vector<Pair> pairs;  ///< triangles that share more than vertices and edges of both
  std::uint64_t unbalanced_edges = 0;       ///< by position
  std::uint64_t non_manifold_vertices = 0;  ///< by index: triangles around form no single circle
  std::uint64_t unmatched_edges = 0;  ///< by index: directed edges without exactly one opposite
  std::uint64_t degenerate = 0;

  /// L1 and L2.
  [[nodiscard]] bool none() const {
    return pairs.empty() && unmatched_edges == 0 && non_manifold_vertices == 0 && degenerate == 0;
  }
  [[nodiscard]] std::string text() const {
    std::string result = std::to_string(unmatched_edges) + " edges unmatched, " +
                         std::to_string(non_manifold_vertices) + " vertices not manifold, " +
                         std::to_string(degenerate) + " triangles without area, " +
                         std::to_string(pairs.size()) + " pairs meet";
    for (std::size_t i = 0; i < pairs.size() && i < 10; ++i) {
      result += "\n  " + std::to_string(pairs[i].first) + " and " + std::to_string(pairs[i].second);
    }
    return result;
  }
};

inline Triple triple(const glm::dvec3& p) { return {p.x + 0.0, p.y + 0.0, p.z + 0.0}; }

inline Exact::Point exact_point(const glm::dvec3& p) {
  return {boost::multiprecision::cpp_rational(p.x), boost::multiprecision::cpp_rational(p.y),
          boost::multiprecision::cpp_rational(p.z)};
}

inline bool boxes_apart(const std::array<glm::dvec3, 3>& a, const std::array<glm::dvec3, 3>& b) {
  for (int k = 0; k < 3; ++k) {
    const auto [low_a, high_a] = std::minmax({a[0][k], a[1][k], a[2][k]});
    const auto [low_b, high_b] = std::minmax({b[0][k], b[1][k], b[2][k]});
    if (high_a < low_b || high_b < low_a) return true;
  }
  return false;
}

/// Vertices whose triangles' opposite edges do not form one closed walk.
inline std::uint64_t count_bad_links(std::span<const glm::uvec3> triangles) {
  std::map<std::uint32_t, std::vector<std::pair<std::uint32_t, std::uint32_t>>> links;
  for (const glm::uvec3& t : triangles) {
    for (int k = 0; k < 3; ++k) links[t[k]].emplace_back(t[(k + 1) % 3], t[(k + 2) % 3]);
  }
  std::uint64_t bad = 0;
  for (const auto& [vertex, edges] : links) {
    std::map<std::uint32_t, std::uint32_t> next(edges.begin(), edges.end());
    std::size_t steps = 0;
    const std::uint32_t start = edges.front().first;
    std::uint32_t at = start;
    do {
      const auto found = next.find(at);
      if (found == next.end()) break;
      at = found->second;
      ++steps;
    } while (at != start && steps <= edges.size());
    bad += next.size() != edges.size() || at != start || steps != edges.size();
  }
  return bad;
}

/// Time grows as the square of the number of triangles whose boxes touch.
inline MeshFaults faults_of(std::span<const glm::dvec3> positions,
                            std::span<const glm::uvec3> triangles) {
  MeshFaults faults;
  std::vector<std::array<glm::dvec3, 3>> corners;
  std::vector<Exact::Corners> exact;
  std::map<std::pair<Triple, Triple>, int> balance;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  for (const glm::uvec3& t : triangles) {
    corners.push_back({positions[t.x], positions[t.y], positions[t.z]});
    const auto& c = corners.back();
    exact.push_back({exact_point(c[0]), exact_point(c[1]), exact_point(c[2])});
    faults.degenerate += Exact::zero(Exact::normal(exact.back()));
    const bool counts = triple(c[0]) != triple(c[1]) && triple(c[1]) != triple(c[2]) &&
                        triple(c[2]) != triple(c[0]);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = (k + 1) % 3;
      ++uses[{t[static_cast<int>(k)], t[static_cast<int>(next)]}];
      if (!counts) continue;  // its edges cancel each other
      const Triple a = triple(c[k]), b = triple(c[next]);
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  for (const auto& [edge, sum] : balance) faults.unbalanced_edges += sum != 0;
  for (const auto& [edge, count] : uses) {
    const auto opposite = uses.find({edge.second, edge.first});
    faults.unmatched_edges += count != 1 || opposite == uses.end() || opposite->second != 1;
  }
  faults.non_manifold_vertices = count_bad_links(triangles);
  for (std::uint32_t j = 0; j < triangles.size(); ++j) {
    for (std::uint32_t i = 0; i < j; ++i) {
      if (boxes_apart(corners[i], corners[j])) continue;
      const Exact::Shares shares = Exact::compare(exact[i], exact[j]);
      if (shares > Exact::Shares::kEdge) faults.pairs.push_back({i, j, shares});
    }
  }
  return faults;
}

}  // namespace strata::oracle
