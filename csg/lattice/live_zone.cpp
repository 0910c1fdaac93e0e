#include "csg/lattice/live_zone.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>

namespace strata::csg {
namespace {

// May and must of a node in all rows.
struct NodeVoxels {
  std::vector<std::uint64_t> may, must;
};

// What the tree is in voxels, in three-valued logic.
class TreeVoxels {
 public:
  TreeVoxels(const Tree& tree, const CoarseGrid& grid, std::vector<SolidVoxels> solids)
      : tree_(tree), grid_(grid), solids_(std::move(solids)) {}

  // Depth by depth: operands change what the node has come to.
  NodeVoxels of(Tree::NodeId root);

 private:
  struct Open {
    Tree::NodeId node;
    std::size_t next = 0;  // operand
    NodeVoxels value;
  };

  NodeVoxels nothing() const {
    const std::size_t rows = static_cast<std::size_t>(grid_.dims.y * grid_.dims.z);
    return {std::vector<std::uint64_t>(rows, 0), std::vector<std::uint64_t>(rows, 0)};
  }
  // `first`: the value is that of the operand.
  template <class May, class Must>
  void take(Operation operation, bool first, const LatticeBox& rows, NodeVoxels& value,
            const May& may, const Must& must) const;
  void take_solid(Operation operation, bool first, std::uint32_t solid, NodeVoxels& value) const;

  const Tree& tree_;
  const CoarseGrid& grid_;
  std::vector<SolidVoxels> solids_;
};

template <class May, class Must>
void TreeVoxels::take(Operation operation, bool first, const LatticeBox& rows, NodeVoxels& value,
                      const May& may, const Must& must) const {
  const bool all = operation == Operation::kIntersection && !first;  // rows without it end
  const int z0 = all ? 0 : rows.low.z, z1 = all ? grid_.dims.z - 1 : rows.high.z;
  const int y0 = all ? 0 : rows.low.y, y1 = all ? grid_.dims.y - 1 : rows.high.y;
  for (int z = z0; z <= z1; ++z) {
    for (int y = y0; y <= y1; ++y) {
      const auto row = static_cast<std::size_t>(z * grid_.dims.y + y);
      const bool has = z >= rows.low.z && z <= rows.high.z && y >= rows.low.y && y <= rows.high.y;
      const std::uint64_t its_may = has ? may(y, z) : 0, its_must = has ? must(y, z) : 0;
      if (operation == Operation::kUnion || first) {
        value.may[row] |= its_may;
        value.must[row] |= its_must;
      } else if (operation == Operation::kIntersection) {
        value.may[row] &= its_may;
        value.must[row] &= its_must;
      } else {
        value.may[row] &= ~its_must;
        value.must[row] &= ~its_may;
      }
    }
  }
}

void TreeVoxels::take_solid(Operation operation, bool first, std::uint32_t solid,
                            NodeVoxels& value) const {
  const SolidVoxels& voxels = solids_[solid];
  take(
      operation, first, voxels.rows, value,
      [&](int y, int z) { return voxels.may[voxels.row(y, z)]; },
      [&](int y, int z) { return voxels.must[voxels.row(y, z)]; });
}

NodeVoxels TreeVoxels::of(Tree::NodeId root) {
  NodeVoxels done = nothing();
  if (tree_.nodes()[root].operation == Operation::kSolid) {
    take_solid(Operation::kUnion, true, tree_.nodes()[root].first, done);
    return done;
  }
  std::vector<Open> open;
  open.push_back({root, 0, std::move(done)});
  while (true) {
    Open& top = open.back();
    const auto operands = tree_.operands(top.node);
    const Operation operation = tree_.nodes()[top.node].operation;
    if (top.next < operands.size()) {
      const Tree::NodeId operand = operands[top.next++];
      const Tree::Node& what = tree_.nodes()[operand];
      if (what.operation == Operation::kSolid) {
        take_solid(operation, top.next == 1, what.first, top.value);
      } else {
        open.push_back({operand, 0, nothing()});
      }
      continue;
    }
    done = std::move(top.value);
    open.pop_back();
    if (open.empty()) return done;
    Open& above = open.back();
    const auto row = [&](int y, int z) { return static_cast<std::size_t>(z * grid_.dims.y + y); };
    take(
        tree_.nodes()[above.node].operation, above.next == 1, {glm::ivec3(0), grid_.dims - 1},
        above.value, [&](int y, int z) { return done.may[row(y, z)]; },
        [&](int y, int z) { return done.must[row(y, z)]; });
  }
}

// The most nodes that are open at once.
std::size_t depth_of(const Tree& tree, Tree::NodeId root) {
  std::vector<std::uint32_t> depth(root + 1, 0);
  for (Tree::NodeId node = 0; node <= root; ++node) {  // operands come first
    if (tree.nodes()[node].operation == Operation::kSolid) continue;
    for (const Tree::NodeId operand : tree.operands(node)) {
      depth[node] = std::max(depth[node], depth[operand] + 1);
    }
  }
  return depth[root];
}

// The box that holds the result, by those of its solids.
LatticeBox box_of(const LatticeSolids& solids, const Tree& tree, Tree::NodeId root) {
  std::vector<Bounds> boxes(solids.solid_count());
  for (std::size_t s = 0; s < boxes.size(); ++s) {
    for (std::uint32_t t = solids.first_triangle[s]; t < solids.first_triangle[s + 1]; ++t) {
      for (int k = 0; k < 3; ++k) {
        boxes[s].include(glm::dvec3(solids.vertices[solids.triangles[t][k]]));
      }
    }
  }
  const Bounds all = bounds(tree, root, boxes);
  if (all.empty()) return {glm::ivec3(0), glm::ivec3(-1)};
  return {glm::ivec3(all.low), glm::ivec3(all.high)};
}

// The finest grid that is not too dear; no rows where there is none.
CoarseGrid choose_grid(const LatticeSolids& solids, const LatticeBox& box,
                       std::uint64_t most_rows) {
  CoarseGrid grid;
  constexpr int kAround = 2 * CoarseGrid::kMargin;
  constexpr int kLeastShift = 4;
  grid.low = box.low - kAround;
  const glm::ivec3 extent = box.high + kAround - grid.low;
  const int longest = std::max({extent.x, extent.y, extent.z});
  for (grid.shift = kLeastShift; grid.shift < 30; ++grid.shift) {
    if (longest >> grid.shift >= CoarseGrid::kMostSide) continue;
    grid.dims = (extent >> grid.shift) + 1;
    if (rows_of_triangles(solids, grid) <= most_rows) return grid;
  }
  grid.dims = glm::ivec3(0);
  return grid;
}

}  // namespace

LiveZone LiveZone::find(const LatticeSolids& solids, const Tree& tree, Tree::NodeId root,
                        const std::vector<InsideRule>& rules, std::uint64_t most_rows,
                        const Execution& execution) {
  constexpr std::size_t kMostOpenBytes = std::size_t{1} << 26;
  LiveZone zone;
  if (root == Tree::kNone) return zone;
  const LatticeBox box = box_of(solids, tree, root);
  if (box.low.x > box.high.x) return zone;
  zone.grid_ = choose_grid(solids, box, most_rows);
  if (zone.grid_.dims.x == 0) return zone;
  const auto rows = static_cast<std::size_t>(zone.grid_.dims.y * zone.grid_.dims.z);
  if (depth_of(tree, root) * rows * 2 * sizeof(std::uint64_t) > kMostOpenBytes) return zone;
  std::vector<SolidVoxels> voxels(solids.solid_count());
  parallel_for(execution, voxels.size(), [&](std::size_t s, int) {
    voxels[s] = find_solid_voxels(solids, static_cast<std::uint32_t>(s), rules[s], zone.grid_);
  });
  if (execution.stop.stop_requested()) return zone;
  NodeVoxels whole = TreeVoxels(tree, zone.grid_, std::move(voxels)).of(root);
  zone.live_ = std::move(whole.may);
  for (std::size_t i = 0; i < zone.live_.size(); ++i) zone.live_[i] &= ~whole.must[i];
  zone.count_voxels();
  if (most_rows < std::numeric_limits<std::uint64_t>::max() && !zone.worthwhile(solids)) {
    zone.counts_.clear();
  }
  return zone;
}

void LiveZone::count_voxels() {
  const glm::ivec3 corners = grid_.dims + 1;
  counts_.assign(static_cast<std::size_t>(corners.x * corners.y * corners.z), 0);
  for (int z = 1; z < corners.z; ++z) {
    for (int y = 1; y < corners.y; ++y) {
      const std::uint64_t row = live_[static_cast<std::size_t>((z - 1) * grid_.dims.y + y - 1)];
      std::uint32_t in_row = 0;
      for (int x = 1; x < corners.x; ++x) {
        in_row += (row >> (x - 1)) & 1;
        counts_[corner(x, y, z)] = in_row + counts_[corner(x, y - 1, z)] +
                                   counts_[corner(x, y, z - 1)] - counts_[corner(x, y - 1, z - 1)];
      }
    }
  }
}

// Whether a good part of the triangles' boxes is dead.
bool LiveZone::worthwhile(const LatticeSolids& solids) const {
  constexpr double kLeastShare = 0.125;
  double dead = 0;
  for (const glm::uvec3& t : solids.triangles) {
    const exact::LatticePoint &a = solids.vertices[t.x], &b = solids.vertices[t.y],
                              &c = solids.vertices[t.z];
    const LatticeBox box = grid_.voxels_of(
        {glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c))}, CoarseGrid::kMargin);
    const glm::ivec3 size = glm::max(box.high - box.low + 1, glm::ivec3(0));
    const double all = static_cast<double>(size.x) * size.y * size.z;
    dead += all == 0 ? 1 : 1 - count(box) / all;
  }
  return dead > kLeastShare * static_cast<double>(solids.triangles.size());
}

// In the middle of a dead voxel, a step or more from its sides.
bool LiveZone::surely_dead(const exact::FilePoint& p) const {
  const exact::LatticePoint steps(p >> exact::FilePoint(exact::kFileBits));
  const exact::LatticePoint at = steps - grid_.low, voxel = at >> grid_.shift;
  const int last = (1 << grid_.shift) - 1;
  for (int k = 0; k < 3; ++k) {
    const int within = at[k] & last;
    if (within < 1 || within + 2 > last) return false;
    if (voxel[k] < 0 || voxel[k] >= grid_.dims[k]) return true;
  }
  return !is_live(voxel);
}

bool LiveZone::contains(const exact::FilePoint& a, const exact::FilePoint& b) const {
  if (everywhere()) return true;
  if (surely_dead(a) || surely_dead(b)) return false;
  const LatticeBox box = box_around(a, b);
  const glm::ivec3 first = (box.low - grid_.low) >> grid_.shift,
                   last = (box.high - grid_.low) >> grid_.shift;
  const LatticeBox voxels = grid_.voxels_of(box, 0);
  if (voxels.low == first && voxels.high == last) {
    const glm::ivec3 size = last - first + 1;
    if (count(voxels) == static_cast<std::uint32_t>(size.x * size.y * size.z)) return true;
  }
  if (count(grid_.voxels_of(box, 1)) == 0) return false;
  const auto place = [&](const exact::FilePoint& p) {
    return glm::dvec3(p) * std::ldexp(1.0, -exact::kFileBits) - glm::dvec3(grid_.low);
  };
  return contains_along(place(a), place(b));
}

// From live voxel to live voxel, each a step larger than it is.
bool LiveZone::contains_along(const glm::dvec3& a, const glm::dvec3& b) const {
  const glm::dvec3 along = b - a;
  const double side = std::ldexp(1.0, grid_.shift);
  // How far along the edge leaves a voxel that it is in.
  const auto exit_of = [&](const glm::ivec3& voxel) {
    double result = 1;
    for (int k = 0; k < 3; ++k) {
      const double wall = along[k] > 0 ? (voxel[k] + 1) * side + 1 : voxel[k] * side - 1;
      if (along[k] != 0) result = std::min(result, (wall - a[k]) / along[k]);
    }
    return result;
  };
  for (double t = 0; t < 1;) {
    const glm::dvec3 p = a + along * t;
    const glm::ivec3 low = glm::max(glm::ivec3(glm::floor((p - 1.0) / side)), glm::ivec3(0)),
                     high = glm::min(glm::ivec3(glm::floor((p + 1.0) / side)), grid_.dims - 1);
    double next = t;
    for (int z = low.z; z <= high.z; ++z) {
      for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
          const glm::ivec3 voxel(x, y, z);
          if (is_live(voxel)) next = std::max(next, exit_of(voxel));
        }
      }
    }
    if (next <= t) return false;
    t = next;
  }
  return true;
}

}  // namespace strata::csg
