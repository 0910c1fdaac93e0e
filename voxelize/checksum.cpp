#include "voxelize/checksum.h"

#include <bit>
#include <cstddef>
#include <numeric>

namespace strata {
namespace {

constexpr std::uint64_t kPrime = (std::uint64_t{1} << 61) - 1;
constexpr int kSide = VoxelIntervals::kTileSide;

__extension__ using Wide = unsigned __int128;

// Both are for arguments below the prime.
constexpr std::uint64_t add_modulo(std::uint64_t a, std::uint64_t b) {
  const std::uint64_t sum = a + b;
  return sum >= kPrime ? sum - kPrime : sum;
}
constexpr std::uint64_t multiply_modulo(std::uint64_t a, std::uint64_t b) {
  const Wide product = Wide{a} * b;
  return add_modulo(static_cast<std::uint64_t>(product & kPrime),
                    static_cast<std::uint64_t>(product >> 61));
}

// splitmix64 (Steele, Lea, Flood, 2014)
constexpr std::uint64_t mix(std::uint64_t value) {
  value += 0x9e3779b97f4a7c15u;
  value = (value ^ value >> 30) * 0xbf58476d1ce4e5b9u;
  value = (value ^ value >> 27) * 0x94d049bb133111ebu;
  return value ^ value >> 31;
}

// Never 0, so that no layer of voxels is overlooked.
std::uint64_t factor(std::size_t axis, std::size_t index) {
  return mix(mix(axis + 1) ^ index) % (kPrime - 1) + 1;
}

std::uint64_t column_sum(std::span<const Interval> column,
                         const std::vector<std::uint64_t>& prefix) {
  std::uint64_t sum = 0;
  for (const Interval& interval : column) {
    const std::uint64_t begin = prefix[static_cast<std::size_t>(interval.begin())];
    const std::uint64_t end = prefix[static_cast<std::size_t>(interval.end())];
    sum = add_modulo(sum, end >= begin ? end - begin : end + kPrime - begin);
  }
  return sum;
}

}  // namespace

SetChecksum::SetChecksum(const VoxelGrid& grid) : grid_(grid) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto side = static_cast<std::size_t>(grid.dims[static_cast<int>(axis)]);
    prefix_[axis].resize(side + 1, 0);
    for (std::size_t i = 0; i < side; ++i) {
      prefix_[axis][i + 1] = add_modulo(prefix_[axis][i], factor(axis, i));
    }
  }
}

void SetChecksum::add(const VoxelIntervals& slab, const Execution& execution) {
  const AxisFrame frame(slab.axis());
  const auto axis_u = static_cast<std::size_t>(frame.u), axis_v = static_cast<std::size_t>(frame.v);
  const std::vector<std::uint64_t>& prefix = prefix_[static_cast<std::size_t>(frame.w)];
  const auto count =
      static_cast<std::size_t>(slab.tiles_u()) * static_cast<std::size_t>(slab.tiles_v());
  std::vector<std::uint64_t> tile_sums(count, 0);
  parallel_for(execution, count, [&](std::size_t index, int) {
    const int tu = static_cast<int>(index) % slab.tiles_u();
    const int tv = static_cast<int>(index) / slab.tiles_u();
    const VoxelIntervals::TileView tile = slab.tile(tu, tv);
    if (tile.items.empty()) return;
    std::uint64_t tile_sum = 0;
    for (int row = 0; row < kSide; ++row) {
      const std::uint32_t* offsets = tile.offsets.data() + row * kSide;
      if (offsets[0] == offsets[kSide]) continue;
      std::uint64_t row_sum = 0;
      for (int column = 0; column < kSide; ++column) {
        if (offsets[column] == offsets[column + 1]) continue;
        const std::uint64_t sum = column_sum(
            tile.items.subspan(offsets[column], offsets[column + 1] - offsets[column]), prefix);
        const auto u = static_cast<std::size_t>(tu * kSide + column);
        row_sum = add_modulo(row_sum, multiply_modulo(sum, factor(axis_u, u)));
      }
      const auto v = static_cast<std::size_t>(slab.v_begin() + tv * kSide + row);
      tile_sum = add_modulo(tile_sum, multiply_modulo(row_sum, factor(axis_v, v)));
    }
    tile_sums[index] = tile_sum;
  });
  sum_ = std::accumulate(tile_sums.begin(), tile_sums.end(), sum_, add_modulo);
}

std::uint64_t SetChecksum::value() const {
  std::uint64_t hash = mix(sum_);
  for (int axis = 0; axis < 3; ++axis) {
    hash = mix(hash ^ static_cast<std::uint64_t>(grid_.dims[axis]));
    // Adding 0 turns -0 into 0: equal grids must not differ here.
    hash = mix(hash ^ std::bit_cast<std::uint64_t>(grid_.origin[axis] + 0.0));
    hash = mix(hash ^ std::bit_cast<std::uint64_t>(grid_.voxel_size[axis]));
  }
  return hash;
}

std::uint64_t set_checksum(const VoxelIntervals& set, const Execution& execution) {
  SetChecksum checksum(set.grid());
  checksum.add(set, execution);
  return checksum.value();
}

}  // namespace strata
