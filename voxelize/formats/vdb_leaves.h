#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

#include "strata/voxelize/intervals.h"
#include "voxelize/output/run_deflate.h"

namespace strata {

/// The 512 voxels of an OpenVDB leaf, 8 a side: voxel (x, y, z) is bit z of byte x * 8 + y, which
/// on a little-endian machine is OpenVDB's own word order (offset x << 6 | y << 3 | z).
struct alignas(64) VdbLeaf {
  std::array<std::uint64_t, 8> words{};

  friend bool operator==(const VdbLeaf&, const VdbLeaf&) = default;
  /// Solid voxels.
  [[nodiscard]] int count() const {
    // Bits are added up within bytes, which hold up to 64 of them; plain x86-64 has no popcount.
    std::uint64_t bytes = 0;
    for (std::uint64_t word : words) {
      word -= word >> 1 & 0x5555555555555555u;
      word = (word & 0x3333333333333333u) + (word >> 2 & 0x3333333333333333u);
      bytes += (word + (word >> 4)) & 0x0f0f0f0f0f0f0f0fu;
    }
    // A byte of the product's top would overflow at 256; 512 voxels need two halves.
    const std::uint64_t pairs = (bytes & 0x00ff00ff00ff00ffu) + (bytes >> 8 & 0x00ff00ff00ff00ffu);
    return static_cast<int>(pairs * 0x0001000100010001u >> 48);
  }
};
static_assert(sizeof(VdbLeaf) == 64);

/// The leaves above one 64 x 64 tile of z columns. A leaf column is 8 x 8 columns of voxels and has
/// the index (x / 8 % 8) * 8 + y / 8 % 8; along it, a leaf that is partly solid is stored, one that
/// is all solid is a part of a run, and one that is empty is not there. With values, a leaf that
/// is all solid but of several values is stored too.
struct VdbLeafTile {
  static constexpr int kLeafColumns = 64;
  struct Run {
    std::uint16_t begin = 0, end = 0;  ///< leaf indices along z
  };

  std::array<std::uint32_t, kLeafColumns + 1> first_leaf{};  ///< into leaves, leaf_z
  std::array<std::uint32_t, kLeafColumns + 1> first_run{};   ///< into runs
  std::vector<VdbLeaf> leaves;
  std::vector<std::uint16_t> leaf_z;  ///< z / 8 of a leaf; increasing within a leaf column
  std::vector<Run> runs;              ///< increasing within a leaf column
  // With values only:
  std::vector<std::uint32_t> run_values;  ///< the bits of a float, one a run
  Bytes
      values;  ///< of the leaves, one after the other, those of the solid voxels: see put_values()
  std::vector<std::uint32_t> first_value;  ///< into values; one a leaf and the end

  /// 1 without values.
  [[nodiscard]] std::uint32_t run_value(std::uint32_t run) const {
    return run_values.empty() ? 1 : run_values[run];
  }
  [[nodiscard]] std::span<const std::byte> leaf_values(std::uint32_t leaf) const {
    return std::span(values).subspan(first_value[leaf], first_value[leaf + 1] - first_value[leaf]);
  }

  std::uint64_t voxels = 0;
  glm::ivec3 lower{0}, upper{0};  ///< bounds of the solid voxels, inclusive; unset if voxels == 0
  std::uint64_t hash = 0;         ///< of the voxels and their places; add over tiles
};

/// Turns sorted intervals into leaves. Work and memory grow with the number of interval ends and of
/// partly solid leaves, never with the solid voxels. One builder a thread; it may be used again.
class VdbLeafBuilder {
 public:
  /// Light of red, green and blue of a value that is a colour.
  [[nodiscard]] static std::array<float, 3> light_of(std::uint32_t value);
  /// @param depth voxels along z
  /// @param divisor the value of a voxel is its label divided by that; 0: voxels have no values
  /// @param colours labels are packed colours, and so are values, without alpha; divisor is 1
  VdbLeafBuilder(int depth, std::uint32_t divisor, bool colours = false);
  /// @param slab intervals along z
  /// @return null for a tile without solid voxels
  std::unique_ptr<VdbLeafTile> build(const VoxelIntervals& slab, int tile_u, int tile_v);

 private:
  void collect_leaf_column(int leaf_x, int leaf_y);
  void sweep_leaf_column(std::uint64_t place);
  void put_whole(int begin, int end, std::uint64_t place);
  void put_run(int begin, int end, std::uint32_t value);
  void put_leaf(int z, const VdbLeaf& leaf, std::uint64_t place);
  template <class Run>
  void for_each_value(int z, Run&& run);
  [[nodiscard]] std::uint64_t put_values(int z, std::size_t voxels);
  [[nodiscard]] std::uint64_t put_colours(int z, std::size_t voxels);
  [[nodiscard]] std::uint32_t value_of(std::uint32_t label) const {
    if (colours_) return (label & 0xffffff) | 0x1000000;  // not 0
    return std::bit_cast<std::uint32_t>(
        static_cast<float>(static_cast<double>(label) / static_cast<double>(divisor_)));
  }
  static void set_bounds(const VoxelIntervals::TileView& view, VdbLeafTile& tile);

  /// A column of voxels of the leaf column in work: its items from the first that is not yet
  /// passed.
  struct Column {
    std::uint32_t item = 0, end = 0;
  };

  int leaves_z_;
  std::uint32_t divisor_;
  bool colours_;
  // Of the leaf column in work, by z / 8. All zero between two leaf columns.
  std::vector<VdbLeaf> flips_;  // voxels that differ from those below, for each end below them
  std::vector<std::uint8_t> has_flip_;  // a multiple of 8 long
  // Of the tile in work.
  std::vector<VdbLeaf> leaves_;
  std::vector<std::uint16_t> leaf_z_;
  std::vector<VdbLeafTile::Run> runs_;
  std::size_t first_run_ = 0;  // of the leaf column
  VoxelIntervals::TileView view_;
  std::array<Column, 64> columns_;  // of the leaf column; with values only, as all that follows
  std::vector<std::uint32_t> run_values_, first_value_;
  Bytes values_;
  std::vector<std::array<float, 3>> lights_;  // of a leaf
  RunDeflater deflater_{RunBytes::kIds, sizeof(std::uint32_t)};
  std::uint64_t hash_ = 0;
};

}  // namespace strata
