#pragma once

// Includes OpenVDB: only for the two benchmark files that do the same work with it.

#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetUtil.h>
#include <openvdb/tools/MeshToVolume.h>

#include <glm/vec3.hpp>
#include <vector>

#include "strata/core/grid.h"
#include "strata/mesh/triangle_soup.h"

namespace strata::bench {

/// The solid voxels of a closed mesh as OpenVDB makes them: the narrowest distance field, and the
/// mask of its inside. In index space, where OpenVDB's voxel centres are whole numbers.
inline openvdb::BoolGrid::Ptr openvdb_solid(const TriangleSoup& mesh, const VoxelGrid& grid) {
  std::vector<openvdb::Vec3s> points;
  points.reserve(mesh.positions.size());
  for (const glm::dvec3& p : mesh.positions) {
    const glm::dvec3 index = (p - grid.origin) / grid.voxel_size - 0.5;
    points.emplace_back(static_cast<float>(index.x), static_cast<float>(index.y),
                        static_cast<float>(index.z));
  }
  std::vector<openvdb::Vec3I> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const glm::uvec3& t : mesh.triangles) triangles.emplace_back(t.x, t.y, t.z);

  const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(
      points, triangles);
  const openvdb::math::Transform::Ptr transform =
      openvdb::math::Transform::createLinearTransform(1.0);
  const auto field =
      openvdb::tools::meshToVolume<openvdb::FloatGrid>(adapter, *transform, 1.0F, 1.0F);
  return openvdb::tools::sdfInteriorMask(*field);
}

}  // namespace strata::bench
