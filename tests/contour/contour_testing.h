#pragma once

#include <cstdint>
#include <string>

#include "strata/contour/contour.h"
#include "strata/mesh/triangle_soup.h"

namespace strata::testkit {

/// The triangles of a mesh for voxelize().
[[nodiscard]] TriangleSoup soup_of(const SolidMesh& mesh);

/// What is wrong with a mesh whose vertices are points of a grid's lattice; empty if all is well:
/// an edge without exactly one triangle on each side, a vertex with several fans or none, a
/// triangle without area, two triangles that meet elsewhere than in vertices and edges of both.
/// Exact, by brute force: every triangle against all whose boxes meet its box.
[[nodiscard]] std::string faults_of(const SolidMesh& mesh, const VoxelGrid& grid);

/// Contours `mesh`, and expects all that contour() promises: no faults, the same voxels, the same
/// mesh for other numbers of threads.
SolidMesh checked_contour(const TriangleSoup& mesh, const VoxelGrid& grid,
                          const ContourOptions& options = {}, ContourReport* report = nullptr);

}  // namespace strata::testkit
