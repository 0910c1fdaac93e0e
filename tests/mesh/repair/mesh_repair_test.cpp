#include "mesh/repair/mesh_repair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/common.hpp>

namespace strata {
namespace {

using exact::FilePoint;

WrittenPositions doubles() { return *WrittenPositions::make(glm::dvec3(0), 1.0, false); }

// A box with a vertex in the middle of its top, at a height.
RoundedMesh box_with_tip(std::int64_t height) {
  constexpr std::int64_t kSide = std::int64_t{10} << exact::kFileBits;
  RoundedMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.positions.emplace_back(i % 2 * kSide, i / 2 % 2 * kSide, i / 4 * kSide);
  }
  mesh.positions.emplace_back(kSide / 2, kSide / 2, height);
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {0, 1, 4}, {1, 5, 4}, {1, 3, 5}, {3, 7, 5}, {3, 2, 7},
                    {2, 6, 7}, {2, 0, 6}, {0, 4, 6}, {4, 5, 8}, {5, 7, 8}, {7, 6, 8}, {6, 4, 8}};
  mesh.labels.assign(mesh.triangles.size(), 0);
  mesh.groups.assign(mesh.triangles.size(), RoundedMesh::kNoGroup);
  return mesh;
}

TEST(MeshRepair, ACleanMeshIsNotChanged) {
  RoundedMesh mesh = box_with_tip(std::int64_t{15} << exact::kFileBits);
  const RoundedMesh before = mesh;
  const auto repair = repair_mesh(mesh, doubles());
  ASSERT_TRUE(repair.has_value());
  EXPECT_EQ(repair->places, 0u);
  EXPECT_EQ(repair->rounds, 0);
  EXPECT_EQ(mesh.positions, before.positions);
  EXPECT_EQ(mesh.triangles, before.triangles);
}

TEST(MeshRepair, AVertexThatJustPassesThroughAFaceIsMendedByASmallStep) {
  for (const std::int64_t depth : {0, -1, -2, -3}) {
    RoundedMesh mesh = box_with_tip(depth);
    EXPECT_FALSE(find_conflicts(mesh)->empty());
    const auto repair = repair_mesh(mesh, doubles());
    ASSERT_TRUE(repair.has_value()) << repair.error().message;
    EXPECT_EQ(repair->places, 1u);
    EXPECT_EQ(repair->rounds, 1);
    EXPECT_TRUE(find_conflicts(mesh)->empty());
    for (std::size_t v = 0; v < 9; ++v) {  // others are positions of these
      const FilePoint by = glm::abs(mesh.positions[v] - box_with_tip(depth).positions[v]);
      EXPECT_LE(std::max({by.x, by.y, by.z}), 4);
    }
  }
}

TEST(MeshRepair, WhatIsNoMatterOfRoundingIsRefused) {
  RoundedMesh mesh = box_with_tip(-(std::int64_t{5} << exact::kFileBits));
  const auto repair = repair_mesh(mesh, doubles());
  ASSERT_FALSE(repair.has_value());
  EXPECT_EQ(repair.error().code, ErrorCode::kGeometry);
}

TEST(MeshRepair, UnmovedTrianglesAreNotSearched) {
  RoundedMesh mesh = box_with_tip(-1);
  mesh.groups.assign(mesh.triangles.size(), RoundedMesh::kUnmoved);
  EXPECT_TRUE(find_conflicts(mesh)->empty());
  mesh.groups[0] = RoundedMesh::kNoGroup;  // of the bottom: its neighbours are found
  EXPECT_FALSE(find_conflicts(mesh)->empty());
}

}  // namespace
}  // namespace strata
