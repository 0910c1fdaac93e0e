#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "strata/core/grid.h"
#include "strata/raster/lattice_mesh.h"
#include "voxelize/open/winding_angles.h"

// Open meshes: which voxels are inside by the generalized winding number. Private to voxelize/.

namespace strata {

/// A change of a column's winding number that no crossing makes.
struct WindingStep {
  std::uint32_t pixel = 0;  ///< row * kTileSide + column of the tile
  std::int32_t voxel = 0;   ///< the first beyond it
  std::int32_t change = 0;
};

/// What the winding numbers of an open mesh and of the mesh closed by caps differ by. A point's
/// generalized winding number w is the mean over all directions of how often a ray enters the mesh
/// minus how often it leaves it, so it is the vote of all rays: 1 inside and 0 outside of what is
/// closed, and between them near holes. Of the closed mesh it is a whole number c, which depth
/// lists give; the caps' own is the solid angle that they take up, s / 4 pi. So w rounds to
///     c - s / 4 pi, rounded = c + k,  k = -s / 4 pi, rounded,
/// and k is 0 but near caps that are not flat or overlap. Halves round k to 0: flat caps decide.
/// Caps that are sure count as the mesh's own triangles: a field is of the doubtful ones.
class WindingField {
 public:
  /// Keeps no reference. About n log n for n caps; incomplete once `stop` is requested.
  WindingField(const LatticeMesh& mesh, std::span<const glm::uvec3> caps, const VoxelGrid& grid,
               const std::stop_token& stop);

  /// Scratch memory of a thread.
  struct Scratch {
    struct Run {
      std::uint32_t pixel;
      std::int32_t begin, end, number;
    };
    /// What is where seen from a cube, by the depth of its subdivision.
    struct Level {
      std::vector<std::uint32_t> near, far;  ///< nodes
      WindingSeries farther;                 ///< around the cube's middle
      double radius = 0.0;                   ///< of the ball around the cube
      double series = 0.0;                   ///< distance beyond which nodes are farther
      double far_bound = 0.0;                ///< on the solid angle of far and farther nodes

      void add_far(std::uint32_t index, const WindingNode& node, const glm::dvec3& to,
                   double distance);
    };
    std::vector<Level> levels;
    std::vector<std::uint32_t> stack, near, close, rest;
    std::vector<Run> runs, sorted;
    std::vector<std::uint32_t> next;
    std::vector<WindingStep> steps;
    WindingPoints points;
    WindingSum sum;
  };

  /// The changes of k in tile (tu, tv) of rays along `axis`, sorted by pixel and voxel. The numbers
  /// k are the same for every axis. Incomplete once `stop` is requested.
  std::span<const WindingStep> steps(Axis axis, int tu, int tv, const std::stop_token& stop,
                                     Scratch& scratch) const;

 private:
  /// A cube of voxels in a tile of rays along frame.w.
  struct Cube {
    AxisFrame frame;
    glm::ivec3 tile;    ///< lower corner of the tile
    glm::ivec3 corner;  ///< of the cube
    int size;
    std::size_t level;  ///< how often the tile's cubes were cut
  };
  /// Voxels of a cube of side 4, x fastest.
  struct Voxels {
    std::size_t count = 0;
    std::uint8_t at[WindingPoints::kMost];
    void add(std::uint8_t voxel) { at[count++] = voxel; }
  };
  enum class Sight { kNothing, kSmooth, kMet };

  void split(std::uint32_t node, std::uint32_t first, std::uint32_t count,
             const std::stop_token& stop);
  Sight look(const Cube& cube, Scratch& scratch) const;
  Sight sort(Scratch::Level& here, bool single, Scratch& scratch) const;
  void visit(const Cube& cube, Scratch& scratch) const;
  static WindingView view_of(const Cube& cube, const Scratch& scratch);
  [[nodiscard]] bool fill(const Cube& cube, Scratch& scratch) const;
  [[nodiscard]] std::optional<bool> same_number(const Cube& cube, WindingSum::Way way,
                                                Scratch& scratch, int& number) const;
  void visit_voxels(const Cube& cube, Scratch& scratch) const;
  [[nodiscard]] Voxels find_numbers(const Cube& cube, WindingSum::Way way, const Voxels& voxels,
                                    Voxels& apart, Scratch& scratch,
                                    int (&number)[WindingPoints::kMost]) const;
  [[nodiscard]] Voxels find_numbers_apart(const Cube& cube, WindingSum::Way way,
                                          const Voxels& voxels, Scratch& scratch,
                                          int (&number)[WindingPoints::kMost]) const;
  void add_runs(const Cube& cube, const int (&number)[WindingPoints::kMost],
                Scratch& scratch) const;
  static const std::vector<Scratch::Run>& sorted_runs(Scratch& scratch);
  [[nodiscard]] bool within(const WindingNode& leaf, const glm::dvec3& from, double middle,
                            double distance) const;
  static void place(const Cube& cube, int step, WindingPoints& points);
  static void place(const Cube& cube, const Voxels& voxels, WindingPoints& points);
  void caps_of(std::span<const std::uint32_t> leaves, std::vector<std::uint32_t>& caps) const;

  glm::ivec3 dims_;
  WindingCaps all_;
};

}  // namespace strata
