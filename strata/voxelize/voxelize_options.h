#pragma once

#include <array>
#include <cstdint>

#include "strata/core/grid.h"
#include "strata/core/inside_rule.h"
#include "strata/hashbuffer/tile_lists.h"

namespace strata {

class ListSource;      // strata/hashbuffer/list_source.h
class TileListFilter;  // strata/hashbuffer/list_filter.h

/// What is known of a mesh: whether it is closed, that is, whether every edge is used equally often
/// in both directions (is_closed(); under InsideRule::kParity an even number of times will do).
enum class Closedness {
  kCheck,         ///< voxelize() finds out, in a small part of the time it takes
  kAssumeClosed,  ///< known to be closed; the voxels of an open mesh would be wrong
  kAssumeOpen     ///< known to be open; of a closed mesh the voxels are the same, later
};
/// What to do with a mesh that is not closed.
enum class OpenMode {
  kVote,     ///< flat holes are closed; else the rays of all directions: winding numbers
  kSurface,  ///< keep only the voxels that the surface touches
  kFail      ///< ErrorCode::kGeometry
};
/// Which voxels a surface fills.
enum class SurfaceKind {
  kConservative,  ///< every voxel that the surface touches (closed boxes), exactly
  k26,            ///< 26-separating: no path of 26-neighbours crosses it
  k6              ///< 6-separating: no path of face neighbours crosses it; the thinnest
};

struct VoxelizeOptions {
  InsideRule rule = InsideRule::kWinding;
  Axis axis = Axis::kZ;  ///< of the rays and of the intervals returned
  bool solid = true;     ///< voxels whose centre is inside
  bool surface = false;  ///< voxels of the surface; with solid: the union
  SurfaceKind surface_kind = SurfaceKind::kConservative;
  OpenMode open = OpenMode::kVote;
  /// Where the mesh is not closed, `open` decides what its voxels are. A tree's lists are closed: a
  /// filter asks for no check.
  Closedness closedness = Closedness::kCheck;
  StoreKind store = StoreKind::kAuto;
  OffsetKind offsets = OffsetKind::kPlaneFirst;
  /// With n > 1 the filled fraction of voxels: the mesh is voxelized with n voxels for one along
  /// each axis, so that a voxel has n^3 samples, and a voxel's label says how many of those are
  /// solid, 1 to n^3. Exact as all voxels are, and the same for every axis; intervals end where the
  /// label changes. Takes n^2 times the columns: time and memory grow with the surface at n times
  /// the resolution. Not of labelled lists.
  int samples = 1;
  bool statistics = false;  ///< count and hash what comes out
  /// Makes other lists of the mesh's before they are filled: a Boolean tree. Borrowed. Then the
  /// rule applies to what it makes, and a voxel is of the surface when faces of solids pass through
  /// it and the tree depends on those solids there (where they are several, that may be some voxels
  /// more than the surface meets). Of labelled lists it makes labelled intervals.
  const TileListFilter* filter = nullptr;
  /// Makes the lists in place of this process's threads: a GPU. Borrowed; used by the calling
  /// thread alone. `store` and `offsets` are its own then, and surfaces are not its work.
  ListSource* source = nullptr;
};

/// What voxelizing found out.
struct VoxelizeReport {
  std::uint64_t solid_voxels = 0;  ///< with `statistics`
  std::uint64_t intervals = 0;     ///< with `statistics`
  std::uint64_t crossings = 0;     ///< fragments stored, along the axis asked for
  std::uint64_t max_depth_complexity = 0;
  /// Columns with n crossings, n = 0..; the last entry counts the rest. With `statistics`.
  std::array<std::uint64_t, 65> depth_histogram{};
  std::uint64_t unbalanced_columns = 0;  ///< columns entered and left unequally often: holes
  std::uint64_t negative_columns = 0;    ///< columns where the winding number falls below 0
  std::uint64_t rebuilt_tiles = 0;       ///< tiles built again with a larger table
  std::uint64_t checksum =
      0;               ///< see set_checksum in strata/voxelize/checksum.h; with `statistics`
  bool closed = true;  ///< found or assumed; false: `open` decided
  double lists_ms = 0, intervals_ms = 0;  ///< mean time per thread of the two phases
};

}  // namespace strata
