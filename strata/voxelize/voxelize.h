#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/core/inside_rule.h"
#include "strata/core/result.h"
#include "strata/hashbuffer/tile_lists.h"
#include "strata/mesh/triangle_soup.h"
#include "strata/voxelize/intervals.h"

namespace strata {

class ListSource;  // strata/hashbuffer/build_ldi.h

/// Whether a mesh is known to be closed: every edge is used equally often in both directions
/// (is_closed(); with InsideRule::kParity an even number of times suffices).
enum class Closedness {
  kCheck,         ///< voxelize() checks it, at a small part of its cost
  kAssumeClosed,  ///< known to be closed; the voxels of an open mesh would be wrong
  kAssumeOpen     ///< known to be open; for a closed mesh the voxels are the same, but take longer
};
/// What to do with a mesh that is not closed.
enum class OpenMode {
  kVote,     ///< holes are closed by caps; near doubtful caps winding numbers decide
  kSurface,  ///< keep only the voxels that the surface touches
  kFail      ///< ErrorCode::kGeometry
};
/// Voxels that represent a surface.
enum class SurfaceKind {
  kConservative,  ///< every voxel that the surface touches (closed boxes), exactly
  k26,            ///< 26-separating: no path of 26-neighbours crosses it
  k6              ///< 6-separating: no path of face neighbours crosses it; the thinnest
};

/// Rows [begin, end) of a grid: along y for rays along z, else along z (AxisFrame::v).
struct VoxelRows {
  int begin = 0;  ///< a multiple of VoxelIntervals::kTileSide
  int end = 0;    ///< another one, or the end of the grid
  /// Equal ends.
  friend bool operator==(const VoxelRows&, const VoxelRows&) = default;
};

/// Settings of voxelize().
struct VoxelizeOptions {
  InsideRule rule = InsideRule::kWinding;  ///< which winding numbers are inside
  Axis axis = Axis::kZ;                    ///< of the rays and of the intervals returned
  bool solid = true;                       ///< voxels whose centre is inside
  bool surface = false;                    ///< voxels of the surface; with solid: the union
  SurfaceKind surface_kind = SurfaceKind::kConservative;  ///< which voxels are the surface's
  OpenMode open = OpenMode::kVote;  ///< what to do where the mesh is not closed
  /// Where the mesh is not closed, `open` decides what its voxels are. With a filter there is no
  /// check, since a tree's lists are closed.
  Closedness closedness = Closedness::kCheck;
  StoreKind store = StoreKind::kAuto;            ///< where crossings wait to be sorted
  OffsetKind offsets = OffsetKind::kPlaneFirst;  ///< of the HA-buffer
  /// With n > 1, labels give the filled fraction of voxels: the mesh is voxelized at n times the
  /// resolution, so that a voxel has n^3 samples, and its label is the number of solid samples, 1
  /// to n^3. The labels are exact and the same for every axis; intervals end where the label
  /// changes. Takes n^2 times the columns: time and memory grow with the surface at n times the
  /// resolution. Not for labelled lists.
  int samples = 1;
  /// With n > 0, labels give the filled fraction of voxels, n x n rays a voxel, each of which
  /// counts the length inside the solid exactly: a label is the number of lattice steps of a grid
  /// that is n times finer, 1 to 256 n^3. Exact along `axis`, so that the labels depend on it; a
  /// wall along the axis is off by 1 / 2n at most. 0, or a power of two up to 64. Where winding
  /// numbers decide (open meshes), a ray counts whole voxels of the finer grid. Takes n^2 times the
  /// columns; memory grows with the surface in voxels. Not for labelled lists, surfaces, or with
  /// samples.
  int rays = 0;
  bool statistics = false;  ///< count and hash the result
  /// Transforms the mesh's lists before they are filled, e.g. for a Boolean tree. Borrowed. The
  /// rule then applies to the transformed lists, and a voxel belongs to the surface when faces of
  /// solids pass through it and the tree depends on those solids there (with several solids, these
  /// may be a few more voxels than the surface meets). Labelled lists give labelled intervals.
  const TileListFilter* filter = nullptr;
  /// Computes the lists in place of this process's threads, such as on a GPU. Borrowed; used by the
  /// calling thread alone. `store` and `offsets` are ignored then, and surfaces are still found by
  /// the CPU.
  ListSource* source = nullptr;
  /// Only these rows of the grid are made, and counted; voxelize() has no others then. Parts of a
  /// grid that are made apart are the same voxels as one made whole. Empty: all rows.
  std::optional<VoxelRows> rows = std::nullopt;
  /// Of voxelize_slabs(): gives the rows that are made next, of `rows`, until there are no more; so
  /// several processes can share a grid. They increase. Empty: all, one after another.
  std::function<std::optional<VoxelRows>()> next_rows = {};
};

/// The label of a full voxel with VoxelizeOptions::rays.
[[nodiscard]] constexpr std::uint32_t full_coverage(int rays) {
  return std::uint32_t{256} * static_cast<std::uint32_t>(rays * rays * rays);
}

/// Statistics of a voxelization.
struct VoxelizeReport {
  std::uint64_t solid_voxels = 0;          ///< with `statistics`
  std::uint64_t intervals = 0;             ///< with `statistics`
  std::uint64_t filled_steps = 0;          ///< sum of the labels of all voxels, with `rays`
  std::uint64_t crossings = 0;             ///< fragments stored, along the axis asked for
  std::uint64_t max_depth_complexity = 0;  ///< the longest list
  /// Columns with n crossings, n = 0..; the last entry counts the rest. With `statistics`.
  std::array<std::uint64_t, 65> depth_histogram{};
  std::uint64_t unbalanced_columns = 0;  ///< columns entered and left unequally often: holes
  std::uint64_t negative_columns = 0;    ///< columns where the winding number falls below 0
  std::uint64_t rebuilt_tiles = 0;       ///< tiles built again with a larger table
  std::uint64_t checksum =
      0;  ///< see set_checksum in strata/voxelize/checksum.h; with `statistics`
  std::uint64_t checksum_sum = 0;  ///< SetChecksum::sum(), to be added to those of other rows
  bool closed = true;              ///< found or assumed to be closed; false: `open` decided
  double lists_ms = 0;             ///< mean time per thread until the lists are sorted
  double intervals_ms = 0;         ///< mean time per thread from lists to intervals
};

/// Bytes that the intervals of a slab are planned to take at most: larger ones leave the caches and
/// gain nothing.
inline constexpr std::uint64_t kMostSlabBytes = std::uint64_t{64} << 20;

/// Receives the slabs in increasing v.
using SlabSink = std::function<Result<void>(const VoxelIntervals&)>;

/// Voxelizes `mesh` on `grid`, slab by slab of bounded memory. Voxel centres decide (law 7): same
/// set for every axis, store, thread count and order of triangles. A mesh that is not closed is
/// treated as `strata voxelize` does it: VoxelizeOptions::open.
/// @return kUsage (a surface or samples of labelled lists), kGeometry (coordinates too large, open
/// mesh with OpenMode::kFail), kLimit, kCancelled, or the sink's error.
Result<VoxelizeReport> voxelize_slabs(const TriangleSoup& mesh, const VoxelGrid& grid,
                                      const VoxelizeOptions& options, const Execution& execution,
                                      const SlabSink& sink);

/// The same in one piece.
Result<VoxelIntervals> voxelize(const TriangleSoup& mesh, const VoxelGrid& grid,
                                const VoxelizeOptions& options = {},
                                const Execution& execution = {}, VoxelizeReport* report = nullptr);

}  // namespace strata
