#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hashbuffer/tile_builder.h"
#include "strata/core/grid.h"
#include "strata/mesh/triangle_soup.h"

/// Ways from a mesh in memory to its solid voxels, each in the form that is natural to it.
namespace strata::bench {

/// A voxel set in a contender's own form.
class VoxelSet {
 public:
  virtual ~VoxelSet() = default;
  [[nodiscard]] virtual std::uint64_t solid_voxels() const = 0;
};

class Contender {
 public:
  virtual ~Contender() = default;
  [[nodiscard]] virtual std::string name() const = 0;
  [[nodiscard]] virtual int threads() const = 0;
  /// What a process does once: tables, devices. Not timed.
  virtual void prepare() {}
  /// The voxels whose centre is inside. Null when it failed.
  virtual std::shared_ptr<VoxelSet> voxelize(const TriangleSoup& mesh, const VoxelGrid& grid) = 0;
};

/// Strata with a store. @param closed what is known of the meshes
std::unique_ptr<Contender> make_strata(StoreKind store, int threads, bool closed);

/// OpenVDB: meshToVolume with the narrowest band, then sdfInteriorMask: a BoolGrid.
std::unique_ptr<Contender> make_openvdb(int threads);

/// How the rays of the Embree contender are shot. The defaults were the fastest at 1024 a side on
/// 82k triangles: rays one by one took 1.7 times as long, RTC_BUILD_QUALITY_MEDIUM 1.14 times,
/// RTC_SCENE_FLAG_ROBUST 1.05 times, rays not marked coherent 1.7 times, rtcIntersect as long.
struct EmbreeOptions {
  bool occluded = true;  ///< rtcOccluded, which need not go front to back, or rtcIntersect
  int packet = 16;       ///< rays at once: 1, 4, 8, 16
  bool robust = false;   ///< RTC_SCENE_FLAG_ROBUST
  bool coherent = true;  ///< RTC_INTERSECT_CONTEXT_FLAG_COHERENT
  int quality = 0;       ///< RTC_BUILD_QUALITY: 0 low, 1 medium, 2 high
};
/// Embree 3: the BVH, then a ray a column that collects all hits, sort, fill: intervals.
std::unique_ptr<Contender> make_embree(int threads, const EmbreeOptions& options = {});

/// The classical bit grid: a crossing toggles the first voxel behind it, then a prefix XOR runs
/// along each column. One thread, one bit a voxel. @param slab_bytes rows are finished in slabs of
/// this size, which stay in the cache; 0: all crossings first, then one sweep over the whole grid
std::unique_ptr<Contender> make_bit_grid(std::size_t slab_bytes);

}  // namespace strata::bench
