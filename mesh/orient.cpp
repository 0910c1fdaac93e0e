#include "strata/mesh/orient.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

#include "mesh/block_sum.h"
#include "mesh/edge_balance.h"
#include "mesh/edge_uses.h"
#include "mesh/part_measures.h"
#include "mesh/weld.h"
#include "strata/mesh/diagnose.h"
#include "strata/mesh/soup_tools.h"

namespace strata {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;
using detail::DisjointSets;
using detail::Extent;
using detail::Wedge;

struct Part {
  double kept = 0.0, against = 0.0;  ///< area that agrees with the first triangle, and other area
  bool mixed = false, orientable = true, closed = true;
  bool doubled = false;  ///< has second sides, so the file does not tell its orientation
  bool turned = false;   ///< the final orientation is opposite to that of its first triangle
  bool as_file = false;  ///< reversed against the file, and not mixed
  Extent extent;
  Wedge wedge;
};

class Orienter {
 public:
  Orienter(TriangleSoup& mesh, const Execution& execution)
      : mesh_(mesh), execution_(execution), welded_(mesh.positions.size()) {
    detail::weld_first<double>(
        execution, mesh.positions.size(), [&](std::size_t v) { return mesh.positions[v]; },
        welded_.data());
  }

  void run(Orientation& found) {
    removed_.assign(mesh_.triangles.size(), 0);
    doubled_ = removed_;
    find_double_faces(found);
    if (stopped()) return;
    link();
    flood();
    if (stopped()) return;
    check_closed();
    measure();
    choose_larger_side();
    if (stopped()) return;
    turn_inside_out();
    turn_open(found);
    count(found);
  }

  void apply() {
    std::vector<std::uint32_t>& elements = mesh_.face_elements;
    const bool removes = std::find(removed_.begin(), removed_.end(), 1) != removed_.end();
    if (removes && elements.empty()) {
      elements.resize(mesh_.triangles.size());
      std::iota(elements.begin(), elements.end(), 0u);
    }
    std::size_t kept = 0;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (removed_[t] != 0) continue;
      glm::uvec3 corners = mesh_.triangles[t];
      if (turned_[t] != 0) std::swap(corners.y, corners.z);
      mesh_.triangles[kept] = corners;
      if (removes) elements[kept] = elements[t];
      ++kept;
    }
    mesh_.triangles.resize(kept);
    if (removes) elements.resize(kept);
  }

 private:
  [[nodiscard]] bool stopped() const { return execution_.stop.stop_requested(); }

  [[nodiscard]] glm::uvec3 welded_corners(std::size_t t) const {
    const glm::uvec3 corners = mesh_.triangles[t];
    return {welded_[corners.x], welded_[corners.y], welded_[corners.z]};
  }
  /// Whether a triangle is kept and has three different positions.
  [[nodiscard]] bool counts(std::size_t t) const {
    const glm::uvec3 c = welded_corners(t);
    return removed_[t] == 0 && c.x != c.y && c.y != c.z && c.z != c.x;
  }
  [[nodiscard]] detail::EdgeUses edge_uses() const {
    return {mesh_.triangles, welded_, [this](std::size_t t) { return counts(t); }};
  }

  /// For each triangle the equal triangle that faces the opposite way, or kNone.
  [[nodiscard]] std::vector<std::uint32_t> opposite_pairs() const {
    const std::size_t count = mesh_.triangles.size();
    std::vector<std::uint32_t> first(count), partner(count, kNone);
    std::vector<char> several(count, 0);
    const auto sorted = [&](std::size_t t) {
      glm::uvec3 c = welded_corners(t);
      if (!counts(t)) return glm::uvec3(static_cast<std::uint32_t>(t), kNone, kNone);
      std::sort(&c.x, &c.x + 3);
      return c;
    };
    const auto odd = [&](std::size_t t) {
      const glm::uvec3 c = welded_corners(t);
      return ((c.x < c.y) + (c.y < c.z) + (c.z < c.x)) == 2;
    };
    detail::weld_first<std::uint32_t>(execution_, count, sorted, first.data());
    for (std::size_t t = 0; t < count; ++t) {
      const std::uint32_t same = first[t];
      if (same == t) continue;
      if (partner[same] != kNone || odd(same) == odd(t)) several[same] = 1;
      partner[same] = static_cast<std::uint32_t>(t);
      partner[t] = same;
    }
    for (std::size_t t = 0; t < count; ++t) {
      if (several[first[t]] != 0) partner[t] = kNone;
    }
    pair_polygons(partner);
    return partner;
  }

  /// The outlines of polygons, without the diagonals of their triangulations.
  struct Outlines {
    struct Side {
      std::uint32_t low, high;
      int way;
    };
    struct Polygon {
      std::size_t begin, end;   ///< range of triangles
      std::size_t first, last;  ///< range of sides
    };
    static bool less(const Side& a, const Side& b) {
      return std::tie(a.low, a.high) < std::tie(b.low, b.high);
    }
    [[nodiscard]] std::span<const Side> of(const Polygon& polygon) const {
      return std::span(sides).subspan(polygon.first, polygon.last - polygon.first);
    }
    [[nodiscard]] bool before(const Polygon& a, const Polygon& b) const {
      const auto p = of(a), q = of(b);
      return std::lexicographical_compare(p.begin(), p.end(), q.begin(), q.end(), less);
    }
    /// Whether two polygons have the same sides and face opposite ways.
    [[nodiscard]] bool opposite(const Polygon& a, const Polygon& b) const {
      const auto p = of(a), q = of(b);
      return a.end - a.begin == b.end - b.begin &&
             std::equal(p.begin(), p.end(), q.begin(), q.end(),
                        [](const Side& s, const Side& t) { return s.way == -t.way; });
    }
    std::vector<Side> sides;
    std::vector<Polygon> polygons;
  };

  /// The outlines of the faces that consist of several triangles, all of which count.
  [[nodiscard]] Outlines outlines() const {
    Outlines result;
    auto& sides = result.sides;
    const std::vector<std::uint32_t>& elements = mesh_.face_elements;
    for (std::size_t begin = 0, end = 0; begin < elements.size(); begin = end) {
      const std::size_t first = sides.size();
      bool whole = true;
      for (end = begin; end < elements.size() && elements[end] == elements[begin]; ++end) {
        const glm::uvec3 c = welded_corners(end);
        whole = whole && counts(end);
        for (int k = 0; k < 3; ++k) {
          const std::uint32_t a = c[k], b = c[(k + 1) % 3];
          sides.push_back({std::min(a, b), std::max(a, b), a < b ? 1 : -1});
        }
      }
      std::sort(sides.begin() + static_cast<std::ptrdiff_t>(first), sides.end(), Outlines::less);
      std::size_t last = first;  // diagonals are used once in each direction and cancel
      for (std::size_t i = first; i < sides.size();) {
        Outlines::Side side = sides[i];
        for (++i; i < sides.size() && !Outlines::less(side, sides[i]); ++i) {
          side.way += sides[i].way;
        }
        if (side.way != 0) sides[last++] = side;
      }
      if (end - begin < 2 || !whole) last = first;
      sides.resize(last);
      if (last > first) result.polygons.push_back({begin, end, first, last});
    }
    return result;
  }

  /// Pairs polygons that face opposite ways. Their triangulations may use different diagonals.
  void pair_polygons(std::vector<std::uint32_t>& partner) const {
    Outlines found = outlines();
    auto& polygons = found.polygons;
    const auto before = [&](const auto& a, const auto& b) { return found.before(a, b); };
    std::stable_sort(polygons.begin(), polygons.end(), before);
    for (std::size_t i = 0, end = 0; i < polygons.size(); i = end) {
      for (end = i + 1; end < polygons.size() && !before(polygons[i], polygons[end]);) ++end;
      if (end - i != 2 || !found.opposite(polygons[i], polygons[i + 1])) continue;
      for (std::size_t t = polygons[i].begin, u = polygons[i + 1].begin; t < polygons[i].end;
           ++t, ++u) {
        for (const std::uint32_t old : {partner[t], partner[u]}) {
          if (old != kNone) partner[old] = kNone;
        }
        partner[t] = static_cast<std::uint32_t>(u);
        partner[u] = static_cast<std::uint32_t>(t);
      }
    }
  }

  /// Removes the second sides of parts that have every face twice and are closed by one side alone.
  void find_double_faces(Orientation& found) {
    detail::EdgeUses uses = edge_uses();
    bool many = false;
    for (std::size_t v = 0; v < welded_.size() && !many; ++v) {
      uses.for_edges(v, [&](auto edge) { many = many || edge.size() > 2; });
    }
    if (!many) return;
    const std::vector<std::uint32_t> partner = opposite_pairs();
    const auto second = [&](std::size_t t) { return partner[t] < t; };
    DisjointSets sheets(mesh_.triangles.size());
    std::vector<char> refused(mesh_.triangles.size(), 0);
    const auto each_edge = [&](auto&& visit) {
      for (std::size_t v = 0; v < welded_.size(); ++v) uses.for_edges(v, visit);
    };
    each_edge([&](std::span<const detail::EdgeUse> edge) {
      std::uint32_t before = kNone;
      for (const detail::EdgeUse& use : edge) {
        if (partner[use.of()] == kNone || second(use.of())) continue;
        if (before != kNone) sheets.join(before, use.of());
        before = use.of();
      }
    });
    each_edge([&](std::span<const detail::EdgeUse> edge) {
      std::size_t firsts = 0, others = 0;
      for (const detail::EdgeUse& use : edge) {
        others += partner[use.of()] == kNone;
        firsts += partner[use.of()] != kNone && !second(use.of());
      }
      if (others == 0 && firsts % 2 == 0) return;
      for (const detail::EdgeUse& use : edge) {
        if (partner[use.of()] == kNone) continue;
        refused[sheets.find(std::min(use.of(), partner[use.of()]))] = 1;
      }
    });
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (!second(t) || refused[sheets.find(partner[t])] != 0) continue;
      removed_[t] = 1;
      doubled_[partner[t]] = 1;
      ++found.double_faces;
    }
  }

  void connect(const detail::EdgeUse& a, const detail::EdgeUse& b) {
    const auto against = static_cast<std::uint32_t>(a.down() == b.down());
    const auto add = [&](std::uint32_t from, std::uint32_t to) {
      auto& links = links_[from];
      for (std::uint32_t& link : links) {
        if (link == kNone) {
          link = to << 1 | against;
          return;
        }
      }
    };
    add(a.of(), b.of());
    add(b.of(), a.of());
  }

  /// Connects the triangles at edges with two uses. Other uses go to loose_.
  void link() {
    links_.assign(mesh_.triangles.size(), {kNone, kNone, kNone});
    detail::EdgeUses uses = edge_uses();
    std::vector<std::pair<std::uint64_t, detail::EdgeUse>> own;  // by the file's own vertices
    for (std::size_t v = 0; v < welded_.size(); ++v) {
      uses.for_edges(v, [&](std::span<const detail::EdgeUse> edge) {
        if (edge.size() == 2) return connect(edge[0], edge[1]);
        own.clear();
        for (const detail::EdgeUse& use : edge) {
          own.emplace_back(file_edge(use, static_cast<std::uint32_t>(v)), use);
        }
        std::sort(own.begin(), own.end(), [](const auto& a, const auto& b) {
          return std::tie(a.first, a.second.triangle) < std::tie(b.first, b.second.triangle);
        });
        std::size_t left = 0;
        for (std::size_t i = 0, end = 0; i < own.size(); i = end) {
          while (end < own.size() && own[end].first == own[i].first) ++end;
          if (end - i == 2) {
            connect(own[i].second, own[i + 1].second);
          } else {
            for (; i < end; ++i) own[left++] = own[i];
          }
        }
        if (left == 2) return connect(own[0].second, own[1].second);
        for (std::size_t i = 0; i < left; ++i) {
          loose_.push_back({static_cast<std::uint32_t>(v), own[i].second});
        }
      });
    }
  }

  /// The two vertices of an edge as the triangle names them, before welding.
  [[nodiscard]] std::uint64_t file_edge(const detail::EdgeUse& use, std::uint32_t low) const {
    const glm::uvec3 corners = mesh_.triangles[use.of()];
    std::uint64_t a = 0, b = 0;
    for (int k = 0; k < 3; ++k) {
      if (welded_[corners[k]] == low) a = corners[k];
      if (welded_[corners[k]] == use.high) b = corners[k];
    }
    return a << 32 | b;
  }

  /// Finds the parts, and whether each triangle agrees with the first one of its part.
  void flood() {
    part_of_.assign(mesh_.triangles.size(), kNone);
    turned_.assign(mesh_.triangles.size(), 0);
    std::vector<std::uint32_t> queue;
    for (std::size_t seed = 0; seed < mesh_.triangles.size(); ++seed) {
      if (part_of_[seed] != kNone || !counts(seed)) continue;
      const auto number = static_cast<std::uint32_t>(parts_.size());
      Part& part = parts_.emplace_back();
      part_of_[seed] = number;
      queue.assign(1, static_cast<std::uint32_t>(seed));
      while (!queue.empty()) {
        const std::uint32_t t = queue.back();
        queue.pop_back();
        part.doubled = part.doubled || doubled_[t] != 0;
        for (const std::uint32_t link : links_[t]) {
          if (link == kNone) continue;
          const std::uint32_t next = link >> 1;
          const char turned = static_cast<char>(turned_[t] ^ static_cast<char>(link & 1u));
          part.mixed = part.mixed || (link & 1u) != 0;
          if (part_of_[next] == kNone) {
            part_of_[next] = number;
            turned_[next] = turned;
            queue.push_back(next);
          } else if (turned_[next] != turned) {
            part.orientable = false;
          }
        }
      }
    }
    for (std::size_t t = 0; t < turned_.size(); ++t) {
      if (part_of_[t] != kNone && !parts_[part_of_[t]].orientable) turned_[t] = 0;
    }
  }

  /// Checks which parts are closed: those that use each edge of more or fewer than two faces
  /// equally often in both directions.
  void check_closed() {
    struct Sum {
      std::uint32_t part, low, high;
      int sum;
    };
    std::vector<Sum> sums;
    for (const auto& [low, use] : loose_) {
      sums.push_back(
          {part_of_[use.of()], low, use.high, use.down() == (turned_[use.of()] != 0) ? 1 : -1});
    }
    const auto key = [](const Sum& s) { return std::tie(s.part, s.low, s.high); };
    std::sort(sums.begin(), sums.end(),
              [&](const Sum& a, const Sum& b) { return key(a) < key(b); });
    for (std::size_t i = 0; i < sums.size();) {
      const Sum front = sums[i];
      int sum = 0;
      for (; i < sums.size() && key(sums[i]) == key(front); ++i) sum += sums[i].sum;
      if (sum != 0) parts_[front.part].closed = false;
    }
    for (Part& part : parts_) part.closed = part.closed && part.orientable;
  }

  void measure() {
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (part_of_[t] == kNone) continue;
      Part& part = parts_[part_of_[t]];
      const glm::uvec3 at = mesh_.triangles[t];
      const glm::dvec3& a = mesh_.positions[at.x];
      (turned_[t] != 0 ? part.against : part.kept) +=
          glm::length(glm::cross(mesh_.positions[at.y] - a, mesh_.positions[at.z] - a));
      part.extent.include(mesh_, t);
    }
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (part_of_[t] == kNone) continue;
      Part& part = parts_[part_of_[t]];
      const Bounds& box = part.extent.box;
      part.wedge.add(mesh_, t, 0.5 * box.low + 0.5 * box.high, turned_[t] != 0);
    }
  }

  void turn(Part& part) {
    part.turned = !part.turned;
    part.wedge.volume = -part.wedge.volume;
  }

  /// Orients mixed parts. The larger area keeps its orientation; with equal areas the part faces
  /// outward.
  void choose_larger_side() {
    for (Part& part : parts_) {
      if (part.doubled) part.mixed = true;
      if (!part.mixed || !part.orientable) continue;
      const bool equal =
          part.doubled || std::abs(part.kept - part.against) <= 1e-9 * (part.kept + part.against);
      if (equal ? part.wedge.negative() : part.against > part.kept) turn(part);
    }
  }

  /// Reverses closed parts that are inside out and bound no cavity. Parts inside them follow.
  void turn_inside_out() {
    const auto inside_out = [](const Part& part) { return part.closed && part.wedge.negative(); };
    if (std::none_of(parts_.begin(), parts_.end(), inside_out)) return;
    // Closed parts are sorted by decreasing volume: a part inside another one comes after it.
    std::vector<std::uint32_t> order, place(parts_.size(), kNone);
    for (std::uint32_t i = 0; i < parts_.size(); ++i) {
      const Part& part = parts_[i];
      if (part.closed && (part.wedge.negative() || part.wedge.positive())) order.push_back(i);
    }
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::abs(parts_[a].wedge.volume) > std::abs(parts_[b].wedge.volume);
    });
    std::vector<detail::PartSample> samples(order.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) {
      place[order[i]] = i;
      samples[i] = parts_[order[i]].extent.sample();
    }
    std::vector<std::uint32_t> place_of(part_of_.size(), kNone);
    std::vector<char> turned(turned_);
    for (std::size_t t = 0; t < part_of_.size(); ++t) {
      if (part_of_[t] == kNone) continue;
      place_of[t] = place[part_of_[t]];
      turned[t] = static_cast<char>(turned_[t] ^ static_cast<char>(parts_[part_of_[t]].turned));
    }
    const auto windings =
        detail::windings_around(mesh_, place_of, turned, samples, execution_.stop);
    std::vector<char> flipped(order.size(), 0);
    auto next = windings.begin();
    for (std::uint32_t i = 0; i < order.size(); ++i) {
      Part& part = parts_[order[i]];
      int around = 0;
      std::uint32_t parent = kNone;  // the smallest part around this one
      for (; next != windings.end() && next->around == i; ++next) {
        if (next->part >= i) continue;  // a part that is not larger only crosses this one
        around += flipped[next->part] != 0 ? -next->times : next->times;
        parent = next->part;  // sorted by size, so the last one is the smallest
      }
      const bool follows = parent != kNone && !part.mixed && parts_[order[parent]].as_file;
      bool flip = follows;
      if (part.wedge.negative() != flip && around <= 0) flip = !flip;
      if (!flip) continue;
      turn(part);
      flipped[i] = 1;
      part.as_file = !part.mixed;
    }
  }

  /// Orients the open parts together.
  void turn_open(Orientation& found) {
    Bounds box;
    bool even = true;
    for (const Part& part : parts_) {
      if (part.closed) continue;
      box.include(part.extent.box);
      even = false;
    }
    if (even || box.empty()) return;
    Wedge wedge;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (part_of_[t] == kNone || parts_[part_of_[t]].closed) continue;
      wedge.add(mesh_, t, 0.5 * box.low + 0.5 * box.high,
                (turned_[t] != 0) != parts_[part_of_[t]].turned);
    }
    if (!wedge.negative()) return;
    found.turned_open_volume = wedge.volume / 6.0;
    for (Part& part : parts_) {
      if (!part.closed) turn(part);
    }
  }

  /// Sets the final orientation of each triangle and counts the changes.
  void count(Orientation& found) {
    found.parts = parts_.size();
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (part_of_[t] == kNone) continue;
      const Part& part = parts_[part_of_[t]];
      turned_[t] = static_cast<char>(turned_[t] ^ static_cast<char>(part.turned));
      if (part.mixed && !part.doubled && part.orientable &&
          (part.closed || found.turned_open_volume == 0.0)) {
        found.turned_triangles += static_cast<std::uint64_t>(turned_[t]);
      }
    }
    bool mixed = false;
    for (const Part& part : parts_) {
      found.turned_parts += part.closed && !part.mixed && part.turned;
      found.mixed_parts += part.mixed && !part.doubled && part.orientable;
      found.not_orientable += !part.orientable;
      mixed = mixed || part.mixed;
    }
    found.all_turned = !mixed && found.turned_parts == found.parts && found.double_faces == 0;
  }

  TriangleSoup& mesh_;
  const Execution& execution_;
  std::vector<std::uint32_t> welded_;
  std::vector<char> removed_, doubled_;  ///< second sides, and the triangles they duplicate
  std::vector<std::array<std::uint32_t, 3>> links_;  ///< [triangle:31 | faces the opposite way:1]
  std::vector<std::pair<std::uint32_t, detail::EdgeUse>> loose_;  ///< uses without a partner
  std::vector<std::uint32_t> part_of_;
  std::vector<char> turned_;  ///< reversed against the file
  std::vector<Part> parts_;
};

}  // namespace

Orientation orient_parts(TriangleSoup& mesh, const Execution& execution,
                         const OrientOptions& options) {
  Orientation found;
  if (mesh.triangles.empty()) {
    found.closed = true;
    return found;
  }
  std::vector<detail::EdgeSum> by_index =
      detail::unbalanced_by_index(mesh.triangles, mesh.positions.size(), execution);
  found.closed =
      detail::unbalanced_by_position<double>(by_index, std::span(std::as_const(mesh.positions)))
          .empty();
  if (mesh.triangles.size() >= std::size_t{1} << 31) return found;
  if (found.closed && detail::all_outward(mesh, by_index, options.positive, execution))
    return found;
  by_index = {};
  Orienter orienter(mesh, execution);
  orienter.run(found);
  if (execution.stop.stop_requested() || !options.change) return found;
  if (!found.changed()) return found;
  orienter.apply();
  if (!found.all_turned) found.closed = is_closed(mesh, execution);
  return found;
}

std::vector<std::string> sentences(const Orientation& found, bool changed) {
  std::vector<std::string> result;
  if (found.turned_parts > 0 && !found.all_turned) {
    result.push_back(fmt::format("{} of {} parts {}", found.turned_parts, found.parts,
                                 changed ? "were inside out and were reversed" : "are inside out"));
  }
  if (found.turned_triangles > 0) {
    const bool one = found.turned_triangles == 1;
    result.push_back(fmt::format(
        "{} triangle{} against {} neighbours{}", found.turned_triangles,
        changed ? (one ? " faced" : "s faced") : (one ? " faces" : "s face"), one ? "its" : "their",
        !changed ? ""
        : one    ? " and was reversed"
                 : " and were reversed"));
  }
  if (found.double_faces > 0) {
    result.push_back(fmt::format("double-sided: {} triangles occur in both orientations{}",
                                 found.double_faces,
                                 changed ? "; one of the two is used as the solid's surface" : ""));
  }
  return result;
}

}  // namespace strata
