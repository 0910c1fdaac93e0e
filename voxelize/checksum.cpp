#include "strata/voxelize/checksum.h"

#include <bit>
#include <cstddef>
#include <numeric>

#include "core/split_mix.h"

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
constexpr std::uint64_t subtract_modulo(std::uint64_t a, std::uint64_t b) {
  const std::uint64_t difference = a - b;
  return difference + (kPrime & -(difference >> 63));  // no branch: which is larger is random
}
// 2^61 is 1 here: groups of 61 bits are added.
constexpr std::uint64_t reduce(Wide value) {
  const std::uint64_t sum = (static_cast<std::uint64_t>(value) & kPrime) +
                            (static_cast<std::uint64_t>(value >> 61) & kPrime) +
                            static_cast<std::uint64_t>(value >> 122);
  return add_modulo(sum & kPrime, sum >> 61);
}

// Never 0, so that no layer of voxels is overlooked.
std::uint64_t factor(std::size_t axis, std::size_t index) {
  return split_mix(split_mix(axis + 1) ^ index) % (kPrime - 1) + 1;
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
  const std::uint64_t* const prefix = prefix_[static_cast<std::size_t>(frame.w)].data();
  const auto count =
      static_cast<std::size_t>(slab.tiles_u()) * static_cast<std::size_t>(slab.tiles_v());
  std::vector<std::uint64_t> tile_sums(count, 0);
  parallel_for(execution, count, [&](std::size_t index, int) {
    const int tu = static_cast<int>(index) % slab.tiles_u();
    const int tv = static_cast<int>(index) / slab.tiles_u();
    const VoxelIntervals::TileView tile = slab.tile(tu, tv);
    if (tile.items.empty()) return;
    const auto factors_of = [sums = prefix](const Interval& item) {
      return subtract_modulo(sums[std::size_t{item.last} + 1], sums[item.first]);
    };
    std::array<std::uint64_t, kSide> factor_u;
    for (std::size_t i = 0; i < kSide; ++i) {
      factor_u[i] = factor(axis_u, static_cast<std::size_t>(tu) * kSide + i);
    }
    std::uint64_t tile_sum = 0;
    for (int row = 0; row < kSide; ++row) {
      const std::uint32_t* offsets = tile.offsets.data() + row * kSide;
      if (offsets[0] == offsets[kSide]) continue;
      Wide row_sum = 0;  // 64 products of less than 2^122
      const Interval* item = tile.items.data() + offsets[0];
      for (std::size_t column = 0; column < kSide; ++column) {
        const Interval* const end = tile.items.data() + offsets[column + 1];
        if (item == end) continue;
        std::uint64_t sum = factors_of(*item);
        while (++item != end) sum = add_modulo(sum, factors_of(*item));
        row_sum += Wide{sum} * factor_u[column];
      }
      const auto v = static_cast<std::size_t>(slab.v_begin() + tv * kSide + row);
      tile_sum = add_modulo(tile_sum, reduce(Wide{reduce(row_sum)} * factor(axis_v, v)));
    }
    tile_sums[index] = tile_sum;
  });
  sum_ = std::accumulate(tile_sums.begin(), tile_sums.end(), sum_, add_modulo);
}

void SetChecksum::add_sum(std::uint64_t sum) { sum_ = add_modulo(sum_, sum % kPrime); }

std::uint64_t SetChecksum::value() const {
  std::uint64_t hash = split_mix(sum_);
  for (int axis = 0; axis < 3; ++axis) {
    hash = split_mix(hash ^ static_cast<std::uint64_t>(grid_.dims[axis]));
    // Adding 0 turns -0 into 0: equal grids must not differ here.
    hash = split_mix(hash ^ std::bit_cast<std::uint64_t>(grid_.origin[axis] + 0.0));
    hash = split_mix(hash ^ std::bit_cast<std::uint64_t>(grid_.voxel_size[axis]));
  }
  return hash;
}

std::uint64_t set_checksum(const VoxelIntervals& set, const Execution& execution) {
  SetChecksum checksum(set.grid());
  checksum.add(set, execution);
  return checksum.value();
}

}  // namespace strata
