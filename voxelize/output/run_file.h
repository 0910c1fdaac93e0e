#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "strata/voxelize/voxelize.h"
#include "voxelize/output/writers.h"

namespace strata {

/// A file of the runs of some rows of a grid, tile by tile, that is read only to write another file
/// from it: what a shard holds. (Internal to voxelize/.)
///
///   "strata runs 1\n", then for each tile that is not empty, in the order of v, then u:
///   [u:32 | v:32, in tiles | labelled:32 | packed bytes:32 | unpacked bytes:64 | zlib stream of
///   runs a column: 4096 x 32, first and last: 2 x 16 each run, label: 32 each run if labelled]
///   and an entry of u = v = 2^32 - 1, whose unpacked bytes are the number of tiles.
///
/// Takes slabs of any rows of `axis`.
VoxelWriterResult open_run_writer(const std::string& path, const VoxelGrid& grid, Axis axis);

/// Reads it. The file may be cut or changed by anyone.
class RunFileReader {
 public:
  /// @param rows  those that it holds
  /// @param largest_label  writers rely on it; 0: runs have no labels
  /// @return kInput naming the file
  static Result<RunFileReader> open(const std::string& path, const VoxelGrid& grid, Axis axis,
                                    const VoxelRows& rows, std::uint32_t largest_label);
  /// The next rows, up to `end`: a multiple of VoxelIntervals::kTileSide, or the end of all.
  /// @return kInput naming the file and the tile
  Result<VoxelIntervals> read(int end);
  /// Checks that nothing is left. @return kInput
  Result<void> finish();

 private:
  struct Head {
    std::uint32_t u = 0, v = 0, labelled = 0, packed = 0;
    std::uint64_t bytes = 0;
  };
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  RunFileReader() = default;
  Result<void> next_head();
  Result<void> read_tile(VoxelIntervals& slab);
  [[nodiscard]] tl::unexpected<Error> damaged(std::string_view what) const;
  [[nodiscard]] bool at_end() const { return head_.u == ~std::uint32_t{0}; }

  std::string path_;
  VoxelGrid grid_;
  Axis axis_ = Axis::kZ;
  int next_ = 0, end_ = 0;  // rows
  std::uint32_t largest_label_ = 0;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t left_ = 0;  // bytes of the file
  Head head_;               // of the next tile
  std::uint64_t tiles_ = 0;
  std::vector<unsigned char> packed_, bytes_;
};

}  // namespace strata
