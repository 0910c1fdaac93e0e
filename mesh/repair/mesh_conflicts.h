#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "exact/cut_points.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"

namespace strata {

/// A closed mesh whose vertices have been rounded.
struct RoundedMesh {
  std::vector<exact::FilePoint> positions;
  std::vector<glm::uvec3> triangles;
  std::vector<std::uint32_t> labels;  ///< of the triangles
  /// Of the triangles: those of one group are known to have an area, and not to meet each other but
  /// in vertices and edges of both. kUnmoved is the group of those that rounding did not change, or
  /// that were found to be clean; kNoGroup is for those of which nothing is known.
  std::vector<std::uint32_t> groups;
  static constexpr std::uint32_t kUnmoved = 0, kNoGroup = 0xffffffffu;
};

/// Two triangles that meet but in vertices and edges of both; twice the same for a triangle without
/// area.
struct MeshConflict {
  std::uint32_t first, second;  ///< first <= second

  friend auto operator<=>(const MeshConflict&, const MeshConflict&) = default;
};

/// Whether a triangle has three corners that are not on one line.
bool has_area(const exact::FilePoint& a, const exact::FilePoint& b, const exact::FilePoint& c);

/// Finds all conflicts, exactly. Triangles that rounding did not change cost little if no others
/// are near. @return sorted; kCancelled, kLimit
Result<std::vector<MeshConflict>> find_conflicts(const RoundedMesh& mesh,
                                                 const Execution& execution = {});

/// Sets the groups to what find_conflicts() has told: triangles without conflicts become kUnmoved.
void set_groups(RoundedMesh& mesh, const std::vector<MeshConflict>& conflicts);

}  // namespace strata
