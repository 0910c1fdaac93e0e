#include "csg/arrangement/candidate_pairs.h"

#include <algorithm>
#include <bit>
#include <glm/common.hpp>

namespace strata::csg {
namespace {

using exact::LatticePoint;

constexpr std::uint32_t kNobody = 0xffffffffu,
                        kMixed = 0xfffffffeu;  // in a cell instead of a solid
constexpr std::size_t kFewTriangles = 64;
constexpr int kMostGridBits = 7;  // 128 cells a side, 8 MiB

struct Box {
  LatticePoint low, high;  // both belong to it

  bool touches(const Box& other) const {
    for (int k = 0; k < 3; ++k) {
      if (low[k] > other.high[k] || other.low[k] > high[k]) return false;
    }
    return true;
  }
};

struct Placed {
  std::uint32_t triangle;
  Box box;
  exact::Plane plane;
};

class Search {
 public:
  Search(const WeldedSolids& solids, const std::vector<bool>& embedded, const Execution& execution)
      : solids_(solids), embedded_(embedded), execution_(execution) {}

  Result<CandidatePairs> run();

 private:
  Box box_of(std::uint32_t triangle) const {
    const glm::uvec3& t = solids_.triangles[triangle];
    const LatticePoint &a = solids_.vertices[t.x], &b = solids_.vertices[t.y],
                       &c = solids_.vertices[t.z];
    return {glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c))};
  }

  // Of a content: whether its triangles need not be compared with each other.
  bool embedded(std::uint32_t content) const {
    return content < embedded_.size() && embedded_[content];
  }
  void choose_grid();
  Box cell_box(const LatticePoint& cell) const {
    const LatticePoint low = low_ + cell * (1 << shift_);
    return {low, low + ((1 << shift_) - 1)};
  }
  bool mark(std::uint32_t triangle);
  void collect(std::uint32_t triangle);
  bool search(const std::vector<std::uint32_t>& triangles, const Box& box);
  bool compare_all(const std::vector<std::uint32_t>& triangles, const Box& within);
  bool may_meet(const Placed& a, const Placed& b, const Box& within) const;
  bool reaches(std::uint32_t triangle, const Placed& other) const;
  bool compact();

  // work(index of the cell) for the cells of the first grid that a triangle touches.
  template <class Work>
  void for_cells(std::uint32_t triangle, const Work& work) const;

  const WeldedSolids& solids_;
  const std::vector<bool>& embedded_;
  const Execution& execution_;
  LatticePoint low_{0};
  int shift_ = 0, bits_ = 0;           // cells of 2^shift steps, 2^bits along each axis
  std::vector<std::uint32_t> owners_;  // of the cells; then, for mixed ones, their index in lists_
  std::vector<std::vector<std::uint32_t>> lists_;
  std::vector<Box> list_boxes_;
  std::size_t compacted_ = 0;
  CandidatePairs result_;
};

// Whether a cell has points on both sides of a plane, or on it: heights are largest and smallest at
// corners. A cell also has the points between its last lattice points and the next cell, so any
// point that two triangles share, on the lattice or not, lies in a cell that both touch.
bool plane_crosses(const exact::Plane& plane, const Box& box) {
  LatticePoint up, down;
  for (int k = 0; k < 3; ++k) {
    const bool rising = plane.normal[k] > 0;
    up[k] = rising ? box.high[k] + 1 : box.low[k];
    down[k] = rising ? box.low[k] : box.high[k] + 1;
  }
  return exact::height(plane, up) >= 0 && exact::height(plane, down) <= 0;
}

exact::Plane plane_of(const WeldedSolids& solids, std::uint32_t triangle) {
  const glm::uvec3& t = solids.triangles[triangle];
  return exact::plane_through(solids.vertices[t.x], solids.vertices[t.y], solids.vertices[t.z]);
}

void Search::choose_grid() {
  Box all = box_of(0);
  std::uint64_t extents = 0;
  const auto extent = [](const Box& box) {
    const LatticePoint size = box.high - box.low;
    return static_cast<std::uint32_t>(std::max({size.x, size.y, size.z}));
  };
  for (std::uint32_t t = 0; t < solids_.triangles.size(); ++t) {
    const Box box = box_of(t);
    all = {glm::min(all.low, box.low), glm::max(all.high, box.high)};
    extents += extent(box);
  }
  low_ = all.low;
  // Cells about half as large as the triangles: a triangle then touches few, and crowded cells are
  // divided later. More than sqrt(n) cells a side are not worth their memory.
  const std::uint64_t mean = extents / solids_.triangles.size();
  const auto across = static_cast<int>(std::bit_width(extent(all) / (mean + 1) * 2));
  const int most =
      std::min(kMostGridBits, static_cast<int>(std::bit_width(solids_.triangles.size())) / 2);
  bits_ = std::max(1, std::min(across, most));
  shift_ = std::max(0, static_cast<int>(std::bit_width(extent(all))) - bits_);
}

template <class Work>
void Search::for_cells(std::uint32_t triangle, const Work& work) const {
  const Box box = box_of(triangle);
  const LatticePoint first = (box.low - low_) >> shift_, last = (box.high - low_) >> shift_;
  const LatticePoint count = last - first + 1;
  const exact::Plane plane = plane_of(solids_, triangle);
  const bool few = count.x * count.y * count.z <= 8;
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x) {
        if (!few && !plane_crosses(plane, cell_box({x, y, z}))) continue;
        work((static_cast<std::size_t>(z) << bits_ | static_cast<std::size_t>(y)) << bits_ |
             static_cast<std::size_t>(x));
      }
    }
  }
}

bool Search::mark(std::uint32_t triangle) {
  const std::uint32_t solid = solids_.content_of[triangle];
  for_cells(triangle, [&](std::size_t cell) {
    std::uint32_t& owner = owners_[cell];
    owner = owner == kNobody || (owner == solid && embedded(solid)) ? solid : kMixed;
  });
  return triangle % 4096 != 0 || !execution_.stop.stop_requested();
}

void Search::collect(std::uint32_t triangle) {
  for_cells(triangle, [&](std::size_t cell) {
    if (owners_[cell] != kNobody) lists_[owners_[cell]].push_back(triangle);
  });
}

// Whether two triangles may share a point in the cell `within`, as far as boxes and planes tell.
bool Search::may_meet(const Placed& a, const Placed& b, const Box& within) const {
  for (int k = 0; k < 3; ++k) {
    if (std::max({a.box.low[k], b.box.low[k], within.low[k]}) >
        std::min({a.box.high[k], b.box.high[k], within.high[k]})) {
      return false;
    }
  }
  return reaches(b.triangle, a) && reaches(a.triangle, b);
}

// Whether a triangle has points in the plane of another, other than a corner or an edge that both
// have. Corners of both are equal vertices.
bool Search::reaches(std::uint32_t triangle, const Placed& other) const {
  const glm::uvec3& t = solids_.triangles[triangle];
  const glm::uvec3& o = solids_.triangles[other.triangle];
  int above = 0, below = 0, shared = 0;
  for (int k = 0; k < 3; ++k) {
    if (t[k] == o.x || t[k] == o.y || t[k] == o.z) {
      ++shared;
      continue;
    }
    const exact::Int128 height = exact::height(other.plane, solids_.vertices[t[k]]);
    above += height > 0;
    below += height < 0;
  }
  return above + below == 0 || (above + shared < 3 && below + shared < 3);
}

bool Search::compare_all(const std::vector<std::uint32_t>& triangles, const Box& within) {
  std::vector<Placed> placed;
  placed.reserve(triangles.size());
  for (const std::uint32_t t : triangles) placed.push_back({t, box_of(t), plane_of(solids_, t)});
  for (std::size_t j = 1; j < placed.size(); ++j) {
    const std::uint32_t solid = solids_.content_of[triangles[j]];
    for (std::size_t i = 0; i < j; ++i) {
      if ((solids_.content_of[triangles[i]] != solid || !embedded(solid)) &&
          may_meet(placed[i], placed[j], within)) {
        result_.pairs.push_back({triangles[i], triangles[j]});
      }
    }
    if (execution_.stop.stop_requested()) return false;
  }
  return result_.pairs.size() < 2 * compacted_ + (std::size_t{1} << 20) || compact();
}

// Pairs of triangles that share several cells were found several times.
bool Search::compact() {
  std::ranges::sort(result_.pairs);
  result_.pairs.erase(std::unique(result_.pairs.begin(), result_.pairs.end()), result_.pairs.end());
  compacted_ = result_.pairs.size();
  return execution_.memory_limit == 0 ||
         compacted_ * sizeof(TrianglePair) <= execution_.memory_limit;
}

bool Search::search(const std::vector<std::uint32_t>& triangles, const Box& box) {
  const std::uint32_t solid = solids_.content_of[triangles.front()];
  if (embedded(solid) && std::ranges::all_of(triangles, [&](std::uint32_t t) {
        return solids_.content_of[t] == solid;
      })) {
    return true;
  }
  const std::int32_t side = box.high.x - box.low.x + 1;
  if (triangles.size() <= kFewTriangles || side == 1) return compare_all(triangles, box);
  std::vector<std::uint32_t> parts[8];
  Box boxes[8];
  std::size_t total = 0;
  for (int part = 0; part < 8; ++part) {
    const LatticePoint at(part & 1, part >> 1 & 1, part >> 2);
    boxes[part].low = box.low + at * (side / 2);
    boxes[part].high = boxes[part].low + (side / 2 - 1);
  }
  for (const std::uint32_t t : triangles) {
    const Box own = box_of(t);
    const exact::Plane plane = plane_of(solids_, t);
    for (int part = 0; part < 8; ++part) {
      if (own.touches(boxes[part]) && plane_crosses(plane, boxes[part])) parts[part].push_back(t);
    }
  }
  for (const auto& part : parts) total += part.size();
  if (total >= 6 * triangles.size()) return compare_all(triangles, box);  // division does not help
  for (int part = 0; part < 8; ++part) {
    if (!parts[part].empty() && !search(parts[part], boxes[part])) return false;
  }
  return true;
}

Result<CandidatePairs> Search::run() {
  if (solids_.triangles.empty()) return result_;
  choose_grid();
  owners_.assign(std::size_t{1} << 3 * bits_, kNobody);
  const auto count = static_cast<std::uint32_t>(solids_.triangles.size());
  for (std::uint32_t t = 0; t < count; ++t) {
    if (!mark(t)) return fail(ErrorCode::kCancelled, "stopped");
  }
  for (std::size_t cell = 0; cell < owners_.size(); ++cell) {
    if (owners_[cell] != kMixed) {
      owners_[cell] = kNobody;
      continue;
    }
    owners_[cell] = static_cast<std::uint32_t>(list_boxes_.size());
    const std::size_t mask = (std::size_t{1} << bits_) - 1;
    list_boxes_.push_back(
        cell_box({static_cast<int>(cell & mask), static_cast<int>(cell >> bits_ & mask),
                  static_cast<int>(cell >> 2 * bits_)}));
  }
  result_.mixed_cells = list_boxes_.size();
  lists_.resize(list_boxes_.size());
  for (std::uint32_t t = 0; t < count; ++t) collect(t);
  for (std::size_t i = 0; i < lists_.size(); ++i) {
    if (search(lists_[i], list_boxes_[i])) continue;
    if (execution_.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    return fail(ErrorCode::kLimit, "{} pairs of triangles may meet; the memory limit is {} bytes",
                result_.pairs.size(), execution_.memory_limit);
  }
  if (!compact()) {
    return fail(ErrorCode::kLimit, "{} pairs of triangles may meet; the memory limit is {} bytes",
                result_.pairs.size(), execution_.memory_limit);
  }
  return std::move(result_);
}

}  // namespace

Result<CandidatePairs> find_candidate_pairs(const WeldedSolids& solids,
                                            const std::vector<bool>& embedded,
                                            const Execution& execution) {
  return Search(solids, embedded, execution).run();
}

}  // namespace strata::csg
