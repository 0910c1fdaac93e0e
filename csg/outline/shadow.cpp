#include "csg/outline/shadow.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <unordered_map>
#include <utility>

#include "mesh/polygons/plane_predicates.h"
#include "strata/mesh/diagnose.h"

namespace strata::csg {
namespace {

using Index = std::uint32_t;

struct PairHash {
  std::size_t operator()(const std::pair<std::uint64_t, std::uint64_t>& k) const {
    std::uint64_t h =
        k.first * 0x9e3779b97f4a7c15u ^ (k.second + 0x165667b1u) * 0xc2b2ae3d27d4eb4fu;
    return static_cast<std::size_t>(h ^ (h >> 31));
  }
};

/// Numbers points. Points in the same place have the same number; -0 equals 0.
class Places {
 public:
  Index number(const glm::dvec2& p) {
    const auto bits = [](double x) {
      std::uint64_t b = 0;
      const double plain = x + 0.0;
      static_assert(sizeof b == sizeof plain);
      std::memcpy(&b, &plain, sizeof b);
      return b;
    };
    const auto [at, made] =
        numbers_.try_emplace({bits(p.x), bits(p.y)}, static_cast<Index>(points.size()));
    if (made) points.push_back(p);
    return at->second;
  }
  std::vector<glm::dvec2> points;

 private:
  std::unordered_map<std::pair<std::uint64_t, std::uint64_t>, Index, PairHash> numbers_;
};

/// A sum of directed edges between numbered places. An edge and its reverse cancel.
class Chain {
 public:
  void add(Index from, Index to) {
    if (from == to) return;
    const bool forward = from < to;
    edges_[{std::min(from, to), std::max(from, to)}] += forward ? 1 : -1;
  }

  /// The remaining edges as closed loops. As many edges begin as end at each place if only loops
  /// were added; edges that close no loop are left out.
  Outline loops(const std::vector<glm::dvec2>& points) const {
    std::vector<std::pair<Index, Index>> left;
    for (const auto& [ends, count] : edges_) {
      const auto [a, b] = ends;
      for (int i = 0; i < std::abs(count); ++i) {
        left.emplace_back(static_cast<Index>(count > 0 ? a : b),
                          static_cast<Index>(count > 0 ? b : a));
      }
    }
    std::sort(left.begin(), left.end());
    // The edges from a place are [first[place], first[place + 1]). The first `taken` of them are
    // used.
    std::vector<std::size_t> first(points.size() + 1, 0);
    for (const auto& edge : left) ++first[edge.first + 1];
    for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
    std::vector<std::size_t> next(first.begin(), first.end() - 1);
    constexpr std::size_t kNot = ~std::size_t{0};
    std::vector<std::size_t> on_path(points.size(), kNot);
    Outline outline;
    std::vector<Index> path;
    for (Index start = 0; start < points.size(); ++start) {
      Index at = start;
      while (true) {
        if (on_path[at] != kNot) {
          // The path has come back to one of its places: the edges since then are a loop.
          const std::size_t since = on_path[at];
          auto& contour = outline.contours.emplace_back();
          for (std::size_t i = since; i < path.size(); ++i) {
            contour.push_back(points[path[i]]);
            on_path[path[i]] = kNot;
          }
          path.resize(since);
          if (contour.size() < 3) outline.contours.pop_back();
        }
        if (next[at] == first[at + 1]) {
          for (const Index p : path) on_path[p] = kNot;
          path.clear();
          if (next[start] == first[start + 1]) break;
          at = start;
          continue;
        }
        on_path[at] = path.size();
        path.push_back(at);
        at = left[next[at]++].second;
      }
    }
    return outline;
  }

 private:
  std::unordered_map<std::pair<std::uint64_t, std::uint64_t>, int, PairHash> edges_;
};

/// The section of the mesh at z = 0. Vertices at z = 0 count as above the plane or as below it.
Outline section(const TriangleSoup& mesh, bool zero_is_above) {
  const auto above = [&](const glm::dvec3& p) { return zero_is_above ? p.z >= 0 : p.z > 0; };
  // The crossing of an edge is computed from its lower end, so that both triangles get the same
  // point.
  const auto crossing = [&](const glm::dvec3& a, const glm::dvec3& b) {
    const glm::dvec3 &low = above(a) ? b : a, &high = above(a) ? a : b;
    if (low.z == 0) return glm::dvec2(low);
    if (high.z == 0) return glm::dvec2(high);
    const double t = low.z / (low.z - high.z);
    return glm::dvec2(low) + (glm::dvec2(high) - glm::dvec2(low)) * t;
  };
  Places places;
  Chain chain;
  for (const glm::uvec3& t : mesh.triangles) {
    const std::array<glm::dvec3, 3> p{mesh.positions[t.x], mesh.positions[t.y],
                                      mesh.positions[t.z]};
    std::array<bool, 3> up{};
    for (std::size_t i = 0; i < 3; ++i) up[i] = above(p[i]);
    if (up[0] == up[1] && up[1] == up[2]) continue;
    // A triangle crosses the plane once upwards and once downwards. The section runs from the
    // upward crossing to the downward one: then the inside is on its left, seen from above.
    glm::dvec2 from(0), to(0);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3;
      if (!up[i] && up[j]) from = crossing(p[i], p[j]);
      if (up[i] && !up[j]) to = crossing(p[i], p[j]);
    }
    chain.add(places.number(from), places.number(to));
  }
  return clean(chain.loops(places.points), Fill::kNonzero);
}

bool usable(const TriangleSoup& mesh, const glm::uvec3& t) {
  for (const std::uint32_t i : {t.x, t.y, t.z}) {
    const glm::dvec3& p = mesh.positions[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) return false;
  }
  return true;
}

}  // namespace

Outline shadow(const TriangleSoup& mesh, OutlineJob* job) {
  // The triangles that face upwards are added as a chain. Its boundary winds around a point as
  // often as such triangles cover the point, and only the boundary reaches Clipper. An open mesh
  // also needs the triangles that face downwards, reversed.
  const bool closed = is_closed(mesh);
  Places places;
  Chain chain;
  constexpr std::size_t kAsk = 1 << 14;  // triangles between two checks for a stop
  for (std::size_t at = 0; at < mesh.triangles.size(); ++at) {
    if (job != nullptr && at % kAsk == 0 && job->ended()) return {};
    const glm::uvec3& t = mesh.triangles[at];
    if (!usable(mesh, t)) continue;
    const glm::dvec2 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
    const int side = orient(a, b, c);
    if (side == 0 || (closed && side < 0)) continue;
    const Index i = places.number(a), j = places.number(side > 0 ? b : c),
                k = places.number(side > 0 ? c : b);
    chain.add(i, j);
    chain.add(j, k);
    chain.add(k, i);
  }
  return clean(chain.loops(places.points), Fill::kNonzero, job);
}

Outline cross_section(const TriangleSoup& mesh) {
  TriangleSoup finite;
  const TriangleSoup* used = &mesh;
  if (!std::all_of(mesh.triangles.begin(), mesh.triangles.end(),
                   [&](const glm::uvec3& t) { return usable(mesh, t); })) {
    finite.positions = mesh.positions;
    for (const glm::uvec3& t : mesh.triangles) {
      if (usable(mesh, t)) finite.triangles.push_back(t);
    }
    used = &finite;
  }
  const bool touches = std::any_of(used->positions.begin(), used->positions.end(),
                                   [](const glm::dvec3& p) { return p.z == 0; });
  if (!touches) return section(*used, true);
  // Faces in the plane belong to the section, whichever side of them is solid.
  const std::array<Outline, 2> both{section(*used, true), section(*used, false)};
  return unite(both);
}

}  // namespace strata::csg
