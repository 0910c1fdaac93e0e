#include "mesh/repair/mesh_conflicts.h"

#include <algorithm>
#include <glm/common.hpp>

#include "exact/determinants.h"
#include "mesh/check/box_pairs.h"
#include "mesh/check/triangles_meet.h"

namespace strata {
namespace {

using exact::FilePoint;
using Index = std::uint32_t;

// Cells of a cube that triangles which were moved touch.
class Neighbourhood {
 public:
  explicit Neighbourhood(const LatticeBox& all) : all_(all), marked_(kSide * kSide * kSide, 0) {
    const glm::ivec3 extent = all.high - all.low;
    while (std::max({extent.x, extent.y, extent.z}) >> shift_ >= kSide) ++shift_;
  }
  void mark(const LatticeBox& box) {
    for_cells(box, [](std::uint8_t& cell) {
      cell = 1;
      return false;
    });
  }
  bool touches(const LatticeBox& box) {
    bool result = false;
    for_cells(box, [&result](const std::uint8_t& cell) { return result = cell != 0; });
    return result;
  }

 private:
  static constexpr int kSide = 64;

  // Calls work(cell) for the cells that a box touches, until it returns true.
  template <class Work>
  void for_cells(const LatticeBox& box, const Work& work) {
    const glm::ivec3 first = (glm::max(box.low, all_.low) - all_.low) >> shift_,
                     last = (glm::min(box.high, all_.high) - all_.low) >> shift_;
    for (int z = first.z; z <= last.z; ++z) {
      for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x; x <= last.x; ++x) {
          if (work(marked_[static_cast<std::size_t>((z * kSide + y) * kSide + x)])) return;
        }
      }
    }
  }

  LatticeBox all_;
  int shift_ = 0;
  std::vector<std::uint8_t> marked_;
};

class Search {
 public:
  Search(const RoundedMesh& mesh, const Execution& execution)
      : mesh_(mesh), execution_(execution) {}

  Result<std::vector<MeshConflict>> run();

 private:
  TriangleCorners corners(Index triangle) const {
    const glm::uvec3& t = mesh_.triangles[triangle];
    return {mesh_.positions[t.x], mesh_.positions[t.y], mesh_.positions[t.z]};
  }
  // In whole steps, around the triangle.
  LatticeBox box(Index triangle) const {
    const auto [a, b, c] = corners(triangle);
    constexpr std::int64_t kRest = (std::int64_t{1} << exact::kFileBits) - 1;
    return {glm::ivec3(glm::min(a, glm::min(b, c)) >> FilePoint(exact::kFileBits)),
            glm::ivec3((glm::max(a, glm::max(b, c)) + kRest) >> FilePoint(exact::kFileBits))};
  }
  void choose();
  void prepare();
  bool surely_clean(std::size_t first, std::size_t second) const;

  const RoundedMesh& mesh_;
  const Execution& execution_;
  std::vector<Index> chosen_;  // triangles that may be in conflicts
  std::vector<LatticeBox> boxes_;
  std::vector<Index> groups_;
  // The double area vectors of chosen triangles, in double, with the bounds that filters need.
  std::vector<exact::filters::BoundedCross> normals_;
};

// Chooses the triangles that were moved and those that are near.
void Search::choose() {
  const auto add = [this](Index t, const LatticeBox& box) {
    chosen_.push_back(t);
    boxes_.push_back(box);
    // A number of its own, above those of groups.
    groups_.push_back(mesh_.groups[t] == RoundedMesh::kNoGroup ? ~t : mesh_.groups[t]);
  };
  LatticeBox all{glm::ivec3(0), glm::ivec3(-1)};
  for (Index t = 0; t < mesh_.triangles.size(); ++t) {
    if (mesh_.groups[t] == RoundedMesh::kUnmoved) continue;
    add(t, box(t));
    const LatticeBox& last = boxes_.back();
    all = chosen_.size() == 1
              ? last
              : LatticeBox{glm::min(all.low, last.low), glm::max(all.high, last.high)};
  }
  if (chosen_.empty() || chosen_.size() == mesh_.triangles.size()) return;
  Neighbourhood near(all);
  for (const LatticeBox& moved : boxes_) near.mark(moved);
  for (Index t = 0; t < mesh_.triangles.size(); ++t) {
    if (mesh_.groups[t] != RoundedMesh::kUnmoved) continue;
    const LatticeBox around = box(t);
    if (near.touches(around)) add(t, around);
  }
}

void Search::prepare() {
  normals_.resize(chosen_.size());
  constexpr std::size_t kRange = 4096;
  parallel_for(execution_, (chosen_.size() + kRange - 1) / kRange, [this](std::size_t r, int) {
    for (std::size_t i = r * kRange; i < std::min(chosen_.size(), (r + 1) * kRange); ++i) {
      const auto [a, b, c] = corners(chosen_[i]);
      normals_[i] = exact::filters::cross(exact::filters::RealNormal(b - a),
                                          exact::filters::RealNormal(c - a));
    }
  });
}

// Most pairs: all vertices of the second triangle that the first one does not have lie on one side
// of its plane. Vertices with the same position but another number leave the pair undecided.
bool Search::surely_clean(std::size_t first, std::size_t second) const {
  if constexpr (!exact::kFilters) return false;
  const glm::uvec3 &s = mesh_.triangles[chosen_[first]], &t = mesh_.triangles[chosen_[second]];
  const FilePoint& base = mesh_.positions[s.x];
  int sum = 0, count = 0;
  for (int k = 0; k < 3; ++k) {
    if (t[k] == s.x || t[k] == s.y || t[k] == s.z) continue;
    const exact::filters::RealNormal along(mesh_.positions[t[k]] - base);
    sum += exact::filters::dot(along, normals_[first]).sign();
    ++count;
  }
  return count > 0 && (sum == count || sum == -count);
}

Result<std::vector<MeshConflict>> Search::run() {
  choose();
  prepare();
  std::vector<std::vector<MeshConflict>> found(static_cast<std::size_t>(execution_.thread_count()));
  const auto visit = [&](std::span<const BoxPair> pairs, int worker) {
    for (const BoxPair& pair : pairs) {
      if (surely_clean(pair.first, pair.second) || surely_clean(pair.second, pair.first)) continue;
      const Index s = chosen_[pair.first], t = chosen_[pair.second];
      if (is_clean(triangles_meet(corners(s), corners(t)))) continue;
      found[static_cast<std::size_t>(worker)].push_back({std::min(s, t), std::max(s, t)});
    }
  };
  std::vector<MeshConflict> result;
  for (const Index t : chosen_) {
    if (mesh_.groups[t] != RoundedMesh::kNoGroup) continue;
    const auto [a, b, c] = corners(t);
    if (!has_area(a, b, c)) result.push_back({t, t});
  }
  const Result<void> searched = for_box_pairs(boxes_, groups_, visit, execution_);
  if (!searched) return tl::unexpected(searched.error());
  for (const auto& conflicts : found) {
    result.insert(result.end(), conflicts.begin(), conflicts.end());
  }
  std::sort(result.begin(), result.end());
  return result;
}

}  // namespace

bool has_area(const FilePoint& a, const FilePoint& b, const FilePoint& c) {
  // Differences are at most 2^53, products 2^107.
  const exact::Cross normal = exact::cross(b - a, c - a);
  return normal[0] != 0 || normal[1] != 0 || normal[2] != 0;
}

void set_groups(RoundedMesh& mesh, const std::vector<MeshConflict>& conflicts) {
  mesh.groups.assign(mesh.triangles.size(), RoundedMesh::kUnmoved);
  for (const MeshConflict& conflict : conflicts) {
    mesh.groups[conflict.first] = mesh.groups[conflict.second] = RoundedMesh::kNoGroup;
  }
}

Result<std::vector<MeshConflict>> find_conflicts(const RoundedMesh& mesh,
                                                 const Execution& execution) {
  return Search(mesh, execution).run();
}

}  // namespace strata
