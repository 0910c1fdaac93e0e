#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "strata/raster/lattice_mesh.h"
#include "strata/voxelize/voxelize.h"
#include "tests/support/voxel_set.h"

// Calls of the library that are expected to succeed.

namespace strata::testkit {

inline constexpr InsideRule kAllRules[] = {InsideRule::kWinding, InsideRule::kNonzero,
                                           InsideRule::kParity};

inline constexpr Closedness kAllClosedness[] = {Closedness::kCheck, Closedness::kAssumeClosed,
                                                Closedness::kAssumeOpen};

inline VoxelIntervals voxelized(const TriangleSoup& mesh, const VoxelGrid& grid,
                                const VoxelizeOptions& options = {},
                                const Execution& execution = {}, VoxelizeReport* report = nullptr) {
  auto result = voxelize(mesh, grid, options, execution, report);
  EXPECT_TRUE(result.has_value()) << result.error().message;
  return result ? std::move(*result) : VoxelIntervals(grid, options.axis);
}

[[nodiscard]] inline VoxelSet voxel_set(const TriangleSoup& mesh, const VoxelGrid& grid,
                                        const VoxelizeOptions& options = {}) {
  return set_of(voxelized(mesh, grid, options));
}

[[nodiscard]] inline bool same_intervals(const VoxelIntervals& a, const VoxelIntervals& b) {
  if (a.axis() != b.axis() || a.grid() != b.grid() || a.v_begin() != b.v_begin() ||
      a.v_end() != b.v_end()) {
    return false;
  }
  for (int v = a.v_begin(); v < a.v_end(); ++v) {
    for (int u = 0; u < a.columns(); ++u) {
      const auto left = a.column(u, v), right = b.column(u, v);
      if (!std::equal(left.begin(), left.end(), right.begin(), right.end())) return false;
    }
  }
  return true;
}

}  // namespace strata::testkit
