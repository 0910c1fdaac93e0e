#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vector_relational.hpp>
#include <numeric>
#include <tuple>

#include "mesh/block_sum.h"
#include "mesh/part_measures.h"
#include "mesh/weld.h"

// Finds which parts of a mesh lie inside others. A ray leads upwards from one point of each part.
// The points are sorted into a grid in x, y; each triangle visits the points that it may lie above.

namespace strata::detail {
namespace {

/// The side of the edge a -> b on which p lies, seen from above: 1 left, -1 right, 0 for an edge
/// without length. Both triangles at an edge compute the same bits. A point on the edge is moved by
/// (e, e^2).
int side(glm::dvec3 a, glm::dvec3 b, const glm::dvec3& p) {
  const bool swapped = std::tie(b.x, b.y) < std::tie(a.x, a.y);
  if (swapped) std::swap(a, b);
  const double dx = b.x - a.x, dy = b.y - a.y;
  const double cross = dx * (p.y - a.y) - dy * (p.x - a.x);
  const int sign = cross != 0.0 ? (cross > 0.0 ? 1 : -1)
                   : dy != 0.0  ? (dy < 0.0 ? 1 : -1)
                                : (dx > 0.0 ? 1 : 0);
  return swapped ? -sign : sign;
}

/// Returns +1 when a triangle that faces upwards lies above p, -1 when it faces downwards, 0 when
/// it does not lie above p.
int crossing(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& p) {
  const int turn = side(a, b, p);
  if (turn == 0 || side(b, c, p) != turn || side(c, a, p) != turn) return 0;
  const double abx = b.x - a.x, aby = b.y - a.y, abz = b.z - a.z;
  const double acx = c.x - a.x, acy = c.y - a.y, acz = c.z - a.z;
  const double nx = aby * acz - abz * acy, ny = abz * acx - abx * acz, nz = abx * acy - aby * acx;
  if (nz == 0.0) return 0;
  const double z = a.z - (nx * (p.x - a.x) + ny * (p.y - a.y)) / nz;
  return z > p.z ? turn : 0;
}

/// The sample points in the cells of a grid in x, y.
class SampleGrid {
 public:
  explicit SampleGrid(const std::vector<PartSample>& samples) {
    low_ = high_ = samples.front().point;
    for (const PartSample& sample : samples) {
      low_ = glm::min(low_, sample.point);
      high_ = glm::max(high_, sample.point);
    }
    side_ = std::clamp(static_cast<int>(std::sqrt(static_cast<double>(samples.size()))), 1, 1024);
    const auto count = static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_);
    begin_.assign(count + 2, 0);
    for (const PartSample& sample : samples) ++begin_[index(cell(sample.point)) + 2];
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    items_.resize(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      items_[begin_[index(cell(samples[i].point)) + 1]++] = static_cast<std::uint32_t>(i);
    }
  }

  /// Calls visit(sample) for the samples in the cells of a box in x, y.
  template <class Visit>
  void within(const glm::dvec3& low, const glm::dvec3& high, Visit&& visit) const {
    if (low.x > high_.x || high.x < low_.x || low.y > high_.y || high.y < low_.y) return;
    const glm::ivec2 first = cell(low), last = cell(high);
    for (int y = first.y; y <= last.y; ++y) {
      const std::size_t end = begin_[index({last.x, y}) + 1];
      for (std::size_t i = begin_[index({first.x, y})]; i < end; ++i) visit(items_[i]);
    }
  }

 private:
  [[nodiscard]] glm::ivec2 cell(const glm::dvec3& p) const {
    const auto along = [&](int k) {
      const double width = high_[k] - low_[k];
      if (!(width > 0.0)) return 0;
      return static_cast<int>(std::clamp((p[k] - low_[k]) / width * side_, 0.0, side_ - 1.0));
    };
    return {along(0), along(1)};
  }
  [[nodiscard]] std::size_t index(const glm::ivec2& at) const {
    return static_cast<std::size_t>(at.y) * static_cast<std::size_t>(side_) +
           static_cast<std::size_t>(at.x);
  }
  glm::dvec3 low_{0.0}, high_{0.0};
  int side_ = 1;
  std::vector<std::size_t> begin_;
  std::vector<std::uint32_t> items_;
};

bool holds(const PartSample& outer, const PartSample& inner) {
  return glm::all(glm::lessThanEqual(outer.low, inner.low)) &&
         glm::all(glm::lessThanEqual(inner.high, outer.high));
}

}  // namespace

std::vector<Winding> windings_around(const TriangleSoup& mesh,
                                     const std::vector<std::uint32_t>& part_of,
                                     const std::vector<char>& turned,
                                     const std::vector<PartSample>& samples,
                                     const std::stop_token& stop) {
  std::vector<Winding> found;
  if (samples.size() < 2) return found;
  const SampleGrid grid(samples);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (t % 1024 == 0 && stop.stop_requested()) break;
    const std::uint32_t part = part_of[t];
    if (part >= samples.size()) continue;
    const glm::dvec3 &a = mesh.positions[mesh.triangles[t].x],
                     &b = mesh.positions[mesh.triangles[t].y],
                     &c = mesh.positions[mesh.triangles[t].z];
    grid.within(glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c)), [&](std::uint32_t i) {
      if (i == part || !holds(samples[part], samples[i])) return;
      const int times = crossing(a, b, c, samples[i].point);
      if (times != 0) found.push_back({i, part, turned[t] != 0 ? -times : times});
    });
  }
  std::sort(found.begin(), found.end(), [](const Winding& a, const Winding& b) {
    return std::tie(a.around, a.part) < std::tie(b.around, b.part);
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < found.size();) {
    Winding sum = found[i];
    for (++i; i < found.size() && found[i].around == sum.around && found[i].part == sum.part; ++i) {
      sum.times += found[i].times;
    }
    if (sum.times != 0) found[kept++] = sum;
  }
  found.resize(kept);
  return found;
}

namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

/// A piece of a part that shares no vertex with the other pieces.
struct Piece {
  Wedge wedge;
  Extent extent;
};

/// Whether every piece that does not face outward bounds a cavity of another one.
/// @param piece_of  the piece of each triangle
bool only_cavities(const TriangleSoup& mesh, std::vector<Piece>& pieces,
                   std::vector<std::uint32_t>& piece_of, const std::stop_token& stop) {
  for (std::size_t t = 0; t < piece_of.size(); ++t) pieces[piece_of[t]].extent.include(mesh, t);
  std::vector<std::uint32_t> order(pieces.size()), place(pieces.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::abs(pieces[a].wedge.volume) > std::abs(pieces[b].wedge.volume);
  });
  std::vector<PartSample> samples;
  for (const std::uint32_t piece : order) {
    place[piece] = static_cast<std::uint32_t>(samples.size());
    samples.push_back(pieces[piece].extent.sample());
  }
  for (std::uint32_t& piece : piece_of) piece = place[piece];
  std::vector<int> around(pieces.size(), 0);
  for (const Winding& winding :
       windings_around(mesh, piece_of, std::vector<char>(piece_of.size(), 0), samples, stop)) {
    const double outer = std::abs(pieces[order[winding.part]].wedge.volume),
                 inner = std::abs(pieces[order[winding.around]].wedge.volume);
    if (outer > (1 + 1e-6) * inner) around[winding.around] += winding.times;
  }
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Wedge& wedge = pieces[order[i]].wedge;
    if (!wedge.positive() && !(wedge.negative() && around[i] > 0)) return false;
  }
  return true;
}

}  // namespace

bool all_outward(const TriangleSoup& mesh, std::span<const EdgeSum> by_index, bool all_positive,
                 const Execution& execution) {
  DisjointSets sets(mesh.positions.size());
  std::size_t joined = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    if (sets.known_same(t.x, t.y, t.z)) continue;
    joined += sets.join(t.x, t.y);
    joined += sets.join(t.x, t.z);
  }
  if (joined + 1 == mesh.positions.size() && all_positive) return true;
  if (!by_index.empty()) {
    WeldTable<double> table(2 * by_index.size());
    for (const EdgeSum& edge : by_index) {
      for (const std::uint32_t end : {edge.low, edge.high}) {
        const auto key = table.canonical(mesh.positions[end]);
        sets.join(end, table.find_or_insert(key, table.hash(key), end));
      }
    }
  }
  const glm::dvec3 about = mesh.positions[mesh.triangles.front().x];
  const std::uint32_t first = sets.find(mesh.triangles.front().x);
  if (std::all_of(mesh.triangles.begin(), mesh.triangles.end(),
                  [&](const glm::uvec3& t) { return sets.find(t.x) == first; })) {
    return fold_blocks<Wedge>(
               execution, mesh.triangles.size(),
               [&](Wedge& sum, std::size_t t) { sum.add(mesh, t, about, false); },
               [](Wedge& sum, const Wedge& part) {
                 sum.volume += part.volume;
                 sum.size += part.size;
               })
        .positive();
  }
  std::vector<Piece> pieces;
  std::vector<std::uint32_t> number(mesh.positions.size(), kNone), piece_of(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::uint32_t& piece = number[sets.find(mesh.triangles[t].x)];
    if (piece == kNone) {
      piece = static_cast<std::uint32_t>(pieces.size());
      pieces.emplace_back();
    }
    piece_of[t] = piece;
    pieces[piece].wedge.add(mesh, t, about, false);
  }
  return std::all_of(pieces.begin(), pieces.end(),
                     [](const Piece& piece) { return piece.wedge.positive(); }) ||
         only_cavities(mesh, pieces, piece_of, execution.stop);
}

}  // namespace strata::detail
