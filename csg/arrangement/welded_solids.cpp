#include "csg/arrangement/welded_solids.h"

#include <algorithm>
#include <tuple>

#include "core/buckets.h"
#include "mesh/weld.h"

namespace strata::csg {
namespace {

using exact::LatticePoint;

// A triangle that begins at its least corner; turned when the other way around comes first.
struct Sorted {
  std::uint32_t a, b, c;
  bool turned;

  bool same_corners(const Sorted& other) const {
    return a == other.a && b == other.b && c == other.c;
  }
};

Sorted sorted_corners(glm::uvec3 t) {
  while (t.x > t.y || t.x > t.z) t = {t.y, t.z, t.x};
  return t.y < t.z ? Sorted{t.x, t.y, t.z, false} : Sorted{t.x, t.z, t.y, true};
}

class Weld {
 public:
  Weld(LatticeSolids solids, const Execution& execution)
      : solids_(std::move(solids)), execution_(execution) {}

  Result<WeldedSolids> run() {
    weld_vertices();
    if (execution_.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    start_contents();
    keep_areas();
    return std::move(result_);
  }

 private:
  void weld_vertices() {
    const std::vector<LatticePoint>& points = solids_.vertices;
    std::vector<std::uint32_t> first(points.size());
    Execution all = execution_;
    all.stop = {};
    detail::weld_first<std::int32_t>(
        all, points.size(), [&](std::size_t i) { return points[i]; }, first.data());
    for (std::uint32_t i = 0; i < points.size(); ++i) {  // first[i] <= i
      if (first[i] == i) {
        first[i] = static_cast<std::uint32_t>(result_.vertices.size());
        result_.vertices.push_back(points[i]);
      } else {
        first[i] = first[first[i]];
      }
    }
    for (glm::uvec3& t : solids_.triangles) t = {first[t.x], first[t.y], first[t.z]};
  }

  void start_contents() {
    const auto solid_count = static_cast<std::uint32_t>(solids_.solid_count());
    for (std::uint32_t s = 0; s < solid_count; ++s) {
      result_.first_count.push_back(s);
      result_.counts.push_back({s, 1});
    }
    result_.first_count.push_back(solid_count);
    result_.first_merged = solid_count;
  }

  void keep_areas() {
    for (std::uint32_t s = 0; s < solids_.solid_count(); ++s) {
      for (std::uint32_t i = solids_.first_triangle[s]; i < solids_.first_triangle[s + 1]; ++i) {
        const glm::uvec3& t = solids_.triangles[i];
        if (t.x == t.y || t.y == t.z || t.z == t.x) continue;
        const exact::Normal n =
            exact::normal_of(result_.vertices[t.x], result_.vertices[t.y], result_.vertices[t.z]);
        if (n == exact::Normal(0)) continue;
        result_.triangles.push_back(t);
        result_.content_of.push_back(s);
        if (!solids_.labels.empty()) result_.labels.push_back(solids_.labels[i]);
      }
    }
    solids_ = {};
  }

  LatticeSolids solids_;
  const Execution& execution_;
  WeldedSolids result_;
};

// A count with the least label of its triangles.
struct Counted {
  SolidCount count;
  std::uint32_t label;
};

// Gives equal triangles one content.
class Merge {
 public:
  explicit Merge(WeldedSolids& solids) : solids_(solids) {}

  void run() { merge_equal(); }

 private:
  // Equal triangles lie in one bucket of their least corner.
  void merge_equal() {
    const std::vector<glm::uvec3>& triangles = solids_.triangles;
    const detail::Buckets buckets =
        detail::bucket(triangles.size(), solids_.vertices.size(), [&](std::size_t i) {
          return std::min({triangles[i].x, triangles[i].y, triangles[i].z});
        });
    std::vector<bool> gone(triangles.size(), false);
    bool any = false;
    std::vector<std::pair<Sorted, std::uint32_t>> keys;
    for (std::size_t v = 0; v < solids_.vertices.size(); ++v) {
      const std::uint32_t begin = buckets.first[v], end = buckets.first[v + 1];
      if (end - begin < 2) continue;
      keys.clear();
      for (std::uint32_t i = begin; i < end; ++i) {
        keys.emplace_back(sorted_corners(triangles[buckets.items[i]]), buckets.items[i]);
      }
      std::ranges::sort(keys, [](const auto& x, const auto& y) {
        return std::tie(x.first.b, x.first.c, x.second) < std::tie(y.first.b, y.first.c, y.second);
      });
      for (std::size_t i = 0; i < keys.size();) {
        std::size_t j = i + 1;
        while (j < keys.size() && keys[j].first.same_corners(keys[i].first)) ++j;
        if (j - i > 1) {
          merge(std::span(keys).subspan(i, j - i), gone);
          any = true;
        }
        i = j;
      }
    }
    if (any) drop(gone);
  }

  // Gives the content of all to the first of them.
  void merge(std::span<const std::pair<Sorted, std::uint32_t>> equal, std::vector<bool>& gone) {
    const bool labels = !solids_.labels.empty();
    std::vector<Counted> sum;
    const bool turned = equal.front().first.turned;
    for (const auto& [corners, triangle] : equal) {
      const std::uint32_t solid = solids_.content_of[triangle];
      sum.push_back(
          {{solid, corners.turned == turned ? 1 : -1}, labels ? solids_.labels[triangle] : 0});
      gone[triangle] = true;
    }
    std::ranges::sort(sum, {}, [](const Counted& c) { return std::pair(c.count.solid, c.label); });
    std::vector<Counted> content;
    for (const Counted& one : sum) {
      if (!content.empty() && content.back().count.solid == one.count.solid) {
        content.back().count.count += one.count.count;
      } else {
        content.push_back(one);
      }
    }
    std::erase_if(content, [](const Counted& c) { return c.count.count == 0; });
    if (content.empty()) return;
    const std::uint32_t kept = equal.front().second;
    gone[kept] = false;
    solids_.content_of[kept] = static_cast<std::uint32_t>(solids_.first_count.size() - 1);
    for (const Counted& one : content) {
      solids_.counts.push_back(one.count);
      if (labels) solids_.count_labels.push_back(one.label);
    }
    solids_.first_count.push_back(static_cast<std::uint32_t>(solids_.counts.size()));
  }

  void drop(const std::vector<bool>& gone) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < gone.size(); ++i) {
      if (gone[i]) continue;
      solids_.triangles[kept] = solids_.triangles[i];
      if (!solids_.labels.empty()) solids_.labels[kept] = std::uint32_t{solids_.labels[i]};
      solids_.content_of[kept++] = solids_.content_of[i];
    }
    solids_.triangles.resize(kept);
    solids_.content_of.resize(kept);
    if (!solids_.labels.empty()) solids_.labels.resize(kept);
  }

  WeldedSolids& solids_;
};

}  // namespace

Result<WeldedSolids> weld_solids(LatticeSolids solids, const Execution& execution) {
  return Weld(std::move(solids), execution).run();
}

void merge_equal_triangles(WeldedSolids& solids) { Merge(solids).run(); }

MeshEdges find_mesh_edges(std::span<const glm::uvec3> triangles, std::size_t vertex_count) {
  struct Key {
    std::uint32_t far, use, third;
  };
  const auto key_of = [&](std::uint32_t use) {
    const glm::uvec3& t = triangles[use / 3];
    const int side = static_cast<int>(use % 3);
    const std::uint32_t from = t[side], to = t[side == 2 ? 0 : side + 1];
    return std::pair(std::min(from, to), Key{std::max(from, to), use, t[side == 0 ? 2 : side - 1]});
  };
  MeshEdges result;
  detail::Buckets buckets = detail::bucket(3 * triangles.size(), vertex_count, [&](std::size_t i) {
    return key_of(static_cast<std::uint32_t>(i)).first;
  });
  result.uses = std::move(buckets.items);
  result.edge_of.resize(result.uses.size());
  result.first_use.reserve(result.uses.size() / 2 + 1);
  std::vector<Key> keys;
  for (std::size_t v = 0; v < vertex_count; ++v) {
    const std::uint32_t begin = buckets.first[v], end = buckets.first[v + 1];
    keys.clear();
    for (std::uint32_t i = begin; i < end; ++i) keys.push_back(key_of(result.uses[i]).second);
    std::ranges::sort(keys, [](const Key& x, const Key& y) {
      return std::tie(x.far, x.use) < std::tie(y.far, y.use);
    });
    for (std::uint32_t i = begin; i < end; ++i) {
      const Key& key = keys[i - begin];
      if (i == begin || key.far != keys[i - begin - 1].far) result.first_use.push_back(i);
      result.uses[i] = key.use;
      result.edge_of[key.use] = static_cast<std::uint32_t>(result.first_use.size() - 1);
      for (std::uint32_t other = result.first_use.back(); other < i; ++other) {
        result.equal_triangles = result.equal_triangles || keys[other - begin].third == key.third;
      }
    }
  }
  result.first_use.push_back(static_cast<std::uint32_t>(result.uses.size()));
  return result;
}

}  // namespace strata::csg
