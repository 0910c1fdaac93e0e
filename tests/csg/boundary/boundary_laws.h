#pragma once

// What the tests of the laws of boundary meshes share: random trees on a lattice so small that
// everything coincides, and what holds of any mesh. STRATA_LONG_TESTS=N runs N times as many trees,
// from other seeds.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "strata/csg/boundary/boundary_mesh.h"
#include "tests/csg/boundary/tiny_trees.h"
#include "tests/csg/random_tree.h"

namespace strata::csg {

constexpr BoundaryOptions kTiny{.bits = 10};

inline int rounds(int usual) {
  const char* const text = std::getenv("STRATA_LONG_TESTS");
  return usual * (text != nullptr ? std::max(1, std::atoi(text)) : 1);
}

inline SolidMesh mesh_of(const Tree& tree, const BoundaryOptions& options = kTiny,
                         const Execution& execution = {}) {
  auto made = boundary_mesh(tree, tree.root(), options, execution);
  EXPECT_TRUE(made.has_value()) << made.error().message;
  return made ? std::move(made->mesh) : SolidMesh{};
}

inline SolidMesh framed(const Tree& tree) { return mesh_of(tree | tiny_frame()); }

inline ExactMeasures measures_of(const Tree& tree) {
  const auto made = exact_measures(tree, tree.root(), kTiny);
  EXPECT_TRUE(made.has_value()) << made.error().message;
  return made.value_or(ExactMeasures{});
}

inline bool same_bytes(const SolidMesh& a, const SolidMesh& b) {
  return a.positions == b.positions && a.triangles == b.triangles && a.part_of == b.part_of;
}

inline std::string size_of(const SolidMesh& mesh) {
  return std::to_string(mesh.positions.size()) + " vertices, " +
         std::to_string(mesh.triangles.size()) + " triangles";
}

/// Law L1, by index: each directed edge once and its opposite once, one fan around each vertex, an
/// even Euler characteristic of each shell. @return what is wrong
inline std::string broken(const SolidMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> across;  // edge -> third corner
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      if (t[k] >= mesh.positions.size()) return "index out of range";
      if (t[k] == t[(k + 1) % 3]) return "two equal corners";
      if (!across.try_emplace({t[k], t[(k + 1) % 3]}, t[(k + 2) % 3]).second) return "edge twice";
    }
  }
  std::vector<std::uint32_t> degree(mesh.positions.size(), 0), shell(mesh.positions.size());
  std::iota(shell.begin(), shell.end(), 0u);
  const auto find = [&](std::uint32_t v) {
    while (shell[v] != v) v = shell[v] = shell[shell[v]];
    return v;
  };
  for (const auto& [edge, corner] : across) {
    if (!across.contains({edge.second, edge.first})) return "edge without its opposite";
    ++degree[edge.first];
    shell[find(edge.first)] = find(edge.second);
  }
  for (const auto& [edge, corner] : across) {  // around edge.first
    std::uint32_t steps = 0, at = edge.second;
    do {
      at = across.at({edge.first, at});
    } while (++steps <= degree[edge.first] && at != edge.second);
    if (steps != degree[edge.first]) return "a vertex of several fans";
  }
  std::map<std::uint32_t, int> euler;
  for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
    if (degree[v] == 0) return "a vertex without triangles";
    euler[find(v)] += 2 - static_cast<int>(degree[v]);
  }
  for (const glm::uvec3& t : mesh.triangles) euler[find(t.x)] += 2;
  for (const auto& [root, twice] : euler) {
    if (twice % 4 != 0) return "an odd Euler characteristic";
  }
  return "";
}

/// The tree's value at a point by the windings of its solids; nothing where one cannot tell.
class TreeOracle {
 public:
  explicit TreeOracle(const Tree& tree) : tree_(tree) {
    for (const Solid& solid : tree.solids()) {
      solids_.emplace_back(transform(*solid.mesh, solid.world_from_mesh));
    }
  }
  std::optional<bool> at(const glm::dvec3& point) const {
    std::vector<char> inside;
    for (std::size_t s = 0; s < solids_.size(); ++s) {
      const auto winding = solids_[s].at(point);
      if (!winding) return std::nullopt;
      inside.push_back(is_inside(tree_.solids()[s].rule, *winding));
    }
    return evaluate(tree_, tree_.root(), [&](std::uint32_t s) { return inside[s] != 0; });
  }

 private:
  const Tree& tree_;
  std::vector<ExactWinding> solids_;
};

/// Random trees of all kinds and depths, by seed.
template <class Check>
void for_random_trees(int first_seed, int count, int depth, TinyKind kind, const Check& check) {
  for (int i = 0; i < rounds(count); ++i) {
    const int seed = first_seed + i;
    TinyTrees trees(static_cast<std::uint64_t>(seed));
    const Tree tree = trees.tree(trees.pick(0, depth), kind);
    SCOPED_TRACE("seed " + std::to_string(seed) + ", depth " + std::to_string(depth) + ", kind " +
                 std::to_string(static_cast<int>(kind)));
    check(tree, trees);
    if (testing::Test::HasFailure()) return;
  }
}

}  // namespace strata::csg
