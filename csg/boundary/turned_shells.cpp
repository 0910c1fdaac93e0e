#include "csg/boundary/turned_shells.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <vector>

#include "exact/mesh_sums.h"
#include "mesh/disjoint_sets.h"

namespace strata::csg {
namespace {

using exact::FilePoint;
using Index = std::uint32_t;

// Rough sizes of one shell, in units of file points, about one of its vertices.
struct Shell {
  double six_volumes = 0, permanent = 0, twice_area = 0;
  FilePoint low{0}, high{0};
  bool seen = false;
};

class Shells {
 public:
  explicit Shells(RoundedMesh& mesh) : mesh_(mesh), sets_(mesh.positions.size()) {
    for (const glm::uvec3& t : mesh.triangles) {
      if (sets_.known_same(t.x, t.y, t.z)) continue;
      sets_.join(t.x, t.y);
      sets_.join(t.x, t.z);
    }
    shells_.resize(mesh.positions.size());
    for (const glm::uvec3& t : mesh.triangles) add(t);
  }

  std::vector<Shell>& shells() { return shells_; }
  Index shell_of(const glm::uvec3& t) { return sets_.find(t.x); }

  // Keeps the triangles of the shells that are not named. @return how many are named
  std::uint64_t drop(const std::vector<Index>& shells) {
    if (shells.empty()) return 0;
    std::vector<std::uint8_t> gone(shells_.size(), 0);
    for (const Index shell : shells) gone[shell] = 1;
    std::size_t kept = 0;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (gone[shell_of(mesh_.triangles[t])] != 0) continue;
      mesh_.triangles[kept] = glm::uvec3(mesh_.triangles[t]);
      mesh_.labels[kept] = Index{mesh_.labels[t]};
      mesh_.groups[kept++] = Index{mesh_.groups[t]};
    }
    mesh_.triangles.resize(kept);
    mesh_.labels.resize(kept);
    mesh_.groups.resize(kept);
    return shells.size();
  }

 private:
  void add(const glm::uvec3& t) {
    const Index root = shell_of(t);
    Shell& shell = shells_[root];
    const FilePoint& base = mesh_.positions[root];
    const FilePoint corners[3] = {mesh_.positions[t.x], mesh_.positions[t.y], mesh_.positions[t.z]};
    const glm::dvec3 a(corners[0] - base), b(corners[1] - base), c(corners[2] - base);
    const glm::dvec3 terms = a * glm::cross(b, c);
    shell.six_volumes += terms.x + terms.y + terms.z;
    shell.permanent += glm::length(a) * glm::length(b) * glm::length(c);
    shell.twice_area += glm::length(glm::cross(b - a, c - a));
    if (!shell.seen) shell.low = shell.high = corners[0];
    shell.seen = true;
    for (const FilePoint& p : corners) {
      shell.low = glm::min(shell.low, p);
      shell.high = glm::max(shell.high, p);
    }
  }

  RoundedMesh& mesh_;
  detail::DisjointSets sets_;
  std::vector<Shell> shells_;  // of the vertex that represents them
};

// The exact volume of a shell before and after rounding.
struct Sums {
  exact::FileSum written;
  exact::VolumeSum exact;
};

}  // namespace

// A shell of the area A whose vertices move by d changes its volume by about A d, so only thin
// shells need exact sums.
std::uint64_t drop_turned_shells(
    RoundedMesh& mesh, double most_moved,
    const std::function<exact::FinePoint(std::uint32_t)>& exact_point) {
  Shells shells(mesh);
  std::map<Index, Sums> sums;
  for (Index s = 0; s < shells.shells().size(); ++s) {
    const Shell& shell = shells.shells()[s];
    if (!shell.seen) continue;
    const double thin = 4 * shell.twice_area * (most_moved + 2) + 0x1p-45 * shell.permanent;
    if (std::abs(shell.six_volumes) <= thin) sums.emplace(s, Sums{});
  }
  if (sums.empty()) return 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const auto at = sums.find(shells.shell_of(t));
    if (at == sums.end()) continue;
    at->second.written.add(mesh.positions[at->first], mesh.positions[t.x], mesh.positions[t.y],
                           mesh.positions[t.z]);
    at->second.exact.add(exact_point(t.x), exact_point(t.y), exact_point(t.z));
  }
  std::vector<Index> turned;
  for (const auto& [shell, sum] : sums) {
    const int sign = exact::sign_of(sum.written.six_volumes());
    if (sign == 0 || sign != exact::sign_of(sum.exact.six_volumes())) turned.push_back(shell);
  }
  return shells.drop(turned);
}

std::uint64_t drop_loose_voids(RoundedMesh& mesh) {
  Shells shells(mesh);
  std::vector<Index> voids;
  std::vector<const Shell*> bodies;
  for (Index s = 0; s < shells.shells().size(); ++s) {
    const Shell& shell = shells.shells()[s];
    if (!shell.seen) continue;
    if (shell.six_volumes > 0) {
      bodies.push_back(&shell);
    } else {
      voids.push_back(s);
    }
  }
  std::erase_if(voids, [&](Index s) {
    const Shell& shell = shells.shells()[s];
    return std::ranges::any_of(bodies, [&](const Shell* body) {
      return glm::all(glm::lessThanEqual(body->low, shell.low)) &&
             glm::all(glm::lessThanEqual(shell.high, body->high));
    });
  });
  return shells.drop(voids);
}

}  // namespace strata::csg
