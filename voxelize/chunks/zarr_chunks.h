#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "voxelize/output/dense_values.h"
#include "voxelize/output/folder_output.h"

namespace strata {

/// Writes the chunks of 64^3 voxels of a Zarr 2 array: zlib, C order, a file each and none for an
/// empty chunk. Chunks at the border are whole, as the format wants it; what lies outside is 0.
/// (Internal to voxelize/.)
class ZarrChunks {
 public:
  static constexpr int kSide = VoxelIntervals::kTileSide;

  enum class Order {
    kXyz,  ///< shape (nx, ny, nz), from intervals along z; colours (nx, ny, nz, 4)
    kZyx   ///< shape (nz, ny, nx), from intervals along x; colours (4, nz, ny, nx)
  };
  /// The name of the file of a chunk. @param plane  of kZyx: the number of the colour's byte
  using Name = std::function<std::string(const glm::ivec3& chunk, std::size_t plane)>;

  ZarrChunks(const DenseValues& values, Order order, Name name);

  /// Writes the chunks of a slab.
  Result<void> write(const VoxelIntervals& slab, const FolderOutput& folder,
                     const Execution& execution);

 private:
  struct Scratch {
    std::vector<std::uint32_t> voxels;                               // by chunk along a column
    std::array<std::uint32_t, VoxelIntervals::kTileColumns> next{};  // interval of a column
    Bytes bytes;
  };
  Result<void> write_column(const VoxelIntervals& slab, int tu, int tv, const FolderOutput& folder,
                            Scratch& scratch) const;
  void make_chunk(const VoxelIntervals::TileView& tile, int chunk, std::size_t plane,
                  Scratch& scratch) const;

  DenseValues values_;
  Order order_;
  Name name_;
  std::size_t planes_;                             // files of a chunk
  Bytes full_chunk_;                               // of flags
  std::vector<std::unique_ptr<Scratch>> scratch_;  // by worker
};

}  // namespace strata
