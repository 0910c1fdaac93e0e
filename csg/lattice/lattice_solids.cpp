#include "csg/lattice/lattice_solids.h"

#include <algorithm>
#include <cmath>

namespace strata::csg {
namespace {

constexpr double kReach = 1 << 28;  // steps from the origin

std::vector<bool> solids_below(const Tree& tree, Tree::NodeId root) {
  std::vector<bool> result(tree.solids().size(), false);
  std::vector<Tree::NodeId> open;
  if (root != Tree::kNone) open.push_back(root);
  while (!open.empty()) {
    const Tree::NodeId node = open.back();
    open.pop_back();
    if (tree.nodes()[node].operation == Operation::kSolid) {
      result[tree.nodes()[node].first] = true;
    } else {
      const auto operands = tree.operands(node);
      open.insert(open.end(), operands.begin(), operands.end());
    }
  }
  return result;
}

// How far `all` reaches from the origin along any axis, in steps.
double reach(const Bounds& all, const Lattice& lattice) {
  const glm::dvec3 low = (all.low - lattice.origin) / lattice.step;
  const glm::dvec3 high = (all.high - lattice.origin) / lattice.step;
  return std::max({-low.x, -low.y, -low.z, high.x, high.y, high.z});
}

void choose_lattice(const Bounds& result, const Bounds& all, int bits, LatticeSolids& solids) {
  const auto centred = [&](int exponent) {
    Lattice lattice;
    lattice.step = std::ldexp(1.0, exponent);
    const glm::dvec3 middle = result.low * 0.5 + result.high * 0.5;
    for (int k = 0; k < 3; ++k) {
      lattice.origin[k] = std::floor(middle[k] / lattice.step) * lattice.step;
    }
    return lattice;
  };
  int power = 0;  // longest side = part * 2^power, 0.5 <= part < 1
  const double part = std::frexp(result.longest_side(), &power);
  const int exponent = std::max(power - (part == 0.5 ? 1 : 0) - bits, -1000);
  solids.lattice = centred(exponent);
  while (reach(all, solids.lattice) > kReach - 1) {
    solids.lattice = centred(exponent + ++solids.coarsened);
  }
}

// Floor of t + 1/2, without the rounding of that sum.
std::int32_t nearest(double t) {
  const double down = std::floor(t);
  return static_cast<std::int32_t>(down) + (t - down >= 0.5 ? 1 : 0);
}

struct Counts {
  std::uint64_t vertices = 0, triangles = 0;
};

Result<void> check_sizes(const Counts& counts, const Execution& execution) {
  constexpr std::uint64_t kMost = 0xffffffffu;
  const std::uint64_t bytes =
      counts.vertices * sizeof(exact::LatticePoint) + counts.triangles * sizeof(glm::uvec3);
  if (counts.vertices > kMost || counts.triangles > kMost) {
    return fail(ErrorCode::kLimit, "the solids have {} vertices and {} triangles; at most {} fit",
                counts.vertices, counts.triangles, kMost);
  }
  if (execution.memory_limit != 0 && bytes > execution.memory_limit) {
    return fail(ErrorCode::kLimit, "the solids need {} bytes on a lattice; the memory limit is {}",
                bytes, execution.memory_limit);
  }
  return {};
}

void snap_part(const Geometry::Part& part, LatticeSolids& solids) {
  const auto base = static_cast<std::uint32_t>(solids.vertices.size());
  for (const glm::dvec3& position : part.positions) {
    const glm::dvec3 t = (position - solids.lattice.origin) / solids.lattice.step;
    solids.vertices.emplace_back(nearest(t.x), nearest(t.y), nearest(t.z));
  }
  for (const glm::uvec3& triangle : part.triangles) solids.triangles.push_back(triangle + base);
}

}  // namespace

Result<LatticeSolids> snap_solids(const Tree& tree, Tree::NodeId root, const Geometry& geometry,
                                  int bits, const Execution& execution) {
  LatticeSolids solids;
  solids.first_triangle.assign(tree.solids().size() + 1, 0);
  if (root == Tree::kNone) return solids;
  const Bounds result = bounds(tree, root, geometry.boxes());
  if (result.empty() || result.longest_side() == 0) return solids;
  const std::vector<bool> used = solids_below(tree, root);
  Bounds all = result;
  Counts counts;
  for (std::size_t s = 0; s < used.size(); ++s) {
    if (!used[s]) continue;
    const Geometry::Part& part = geometry.parts()[s];
    all.include(part.box);
    counts.vertices += part.positions.size();
    counts.triangles += part.triangles.size();
  }
  if (auto fits = check_sizes(counts, execution); !fits) return tl::unexpected(fits.error());
  choose_lattice(result, all, bits, solids);
  solids.vertices.reserve(counts.vertices);
  solids.triangles.reserve(counts.triangles);
  for (std::size_t s = 0; s < used.size(); ++s) {
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    if (used[s]) snap_part(geometry.parts()[s], solids);
    solids.first_triangle[s + 1] = static_cast<std::uint32_t>(solids.triangles.size());
  }
  return solids;
}

}  // namespace strata::csg
