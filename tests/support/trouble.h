#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "strata/core/grid.h"
#include "strata/mesh/triangle_soup.h"
#include "tests/support/corpus.h"
#include "tests/support/voxel_set.h"

// Meshes that are made to cause trouble, and the grids they are put on.

namespace strata::testkit {

/// Lattice steps as positions: on a grid with origin 0 and voxel size 1 they snap to themselves.
[[nodiscard]] inline glm::dvec3 at_lattice(const glm::ivec3& p) { return glm::dvec3(p) / 256.0; }

/// A grid of unit voxels at the origin.
[[nodiscard]] VoxelGrid unit_grid(const glm::ivec3& dims);

/// Cubic voxels, `longest` along the longest side of the mesh's box, `padding` more on each side.
[[nodiscard]] VoxelGrid grid_around(const TriangleSoup& mesh, int longest, int padding = 0);

/// Closed, outward, free of self-intersection; some with axes and planes of the lattice, some
/// turned.
[[nodiscard]] std::vector<NamedMesh> simple_solids();

/// Closed, but nothing else: self-intersecting, inside out in parts, degenerate, with faces, edges
/// and vertices on voxel centres, with coincident and edge-on triangles. On a unit_grid of 24
/// to 40.
[[nodiscard]] std::vector<NamedMesh> closed_trouble();

/// `count` tetrahedra of either orientation with corners at random multiples of `step` lattice
/// steps, shifted by `shift`, within [0, extent]. Coarse steps make ties everywhere.
[[nodiscard]] TriangleSoup random_tetrahedra(std::mt19937_64& random, int count, int step,
                                             int shift, int extent);

/// A closed surface of genus 0 whose vertices are thrown about: heavily self-intersecting.
[[nodiscard]] TriangleSoup crumpled_sphere(std::mt19937_64& random, int subdivisions, int step,
                                           int extent);

/// Adds the two halves of a random closed fan: a polygon of lattice points spanned from two apexes,
/// one turned around.
[[nodiscard]] TriangleSoup random_bipyramid(std::mt19937_64& random, int corners, int step,
                                            int extent);

/// The faces between solid voxels and the others, outward, vertices shared, each face cut along a
/// random diagonal. Closed; edges and vertices are not manifold where voxels touch diagonally.
[[nodiscard]] TriangleSoup boundary_mesh(const VoxelSet& set, const VoxelGrid& grid,
                                         std::mt19937_64& random);

/// Shuffles the triangles and rotates their corners.
void shuffle(TriangleSoup& mesh, std::mt19937_64& random);

/// A rotation by a random unit quaternion about the origin.
[[nodiscard]] TriangleSoup randomly_rotated(const TriangleSoup& mesh, std::mt19937_64& random);

}  // namespace strata::testkit
