#include "strata/voxelize/checksum.h"

#include <gtest/gtest.h>

#include <bit>
#include <map>
#include <set>

#include "tests/support/predicate_intervals.h"
#include "tests/voxelize/voxel_samples.h"

namespace strata::testing {
namespace {

Execution with_threads(int threads) {
  Execution execution;
  execution.threads = threads;
  return execution;
}

TEST(SetChecksum, IsTheSameForEveryAxisThreadCountAndSlabbing) {
  for (const Sample& sample : small_samples()) {
    SCOPED_TRACE(sample.name);
    const std::uint64_t expected = set_checksum(intervals_of(sample, Axis::kX), with_threads(1));
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      const VoxelIntervals set = intervals_of(sample, axis);
      EXPECT_EQ(set_checksum(set, with_threads(3)), expected);
      auto slabs = cut(set, 1);
      SetChecksum backwards(sample.grid);
      for (std::size_t i = slabs.size(); i-- > 0;) backwards.add(slabs[i], with_threads(2));
      EXPECT_EQ(backwards.value(), expected);
    }
  }
}

TEST(SetChecksum, IsTheSumOverVoxels) {
  // A set checked against the voxels added one by one, each as a set of its own.
  const Sample sample = small_samples().front();
  SetChecksum one_by_one(sample.grid);
  int added = 0;
  for (int i = 0; i < sample.grid.dims.x; i += 5) {
    for (int j = 0; j < sample.grid.dims.y; j += 7) {
      one_by_one.add(intervals_from_predicate(
          sample.grid, Axis::kY, [&](int x, int y, int z) { return x == i && y == j && z == 3; }));
      ++added;
    }
  }
  EXPECT_EQ(added, 80);
  EXPECT_EQ(one_by_one.value(),
            set_checksum(intervals_from_predicate(sample.grid, Axis::kZ, [](int x, int y, int z) {
              return x % 5 == 0 && y % 7 == 0 && z == 3;
            })));
}

TEST(SetChecksum, DiffersWhenOneVoxelDoes) {
  const VoxelGrid grid = make_grid({9, 10, 11});
  std::set<std::uint64_t> seen;
  seen.insert(set_checksum(VoxelIntervals(grid, Axis::kZ)));
  for (int flipped = 0; flipped < 9 * 10 * 11; ++flipped) {
    for (const bool full : {false, true}) {
      const auto set = intervals_from_predicate(grid, Axis::kZ, [&](int i, int j, int k) {
        return ((k * 10 + j) * 9 + i == flipped) != full;
      });
      EXPECT_TRUE(seen.insert(set_checksum(set)).second) << flipped;
    }
  }
}

TEST(SetChecksum, DiffersForShiftedAndMirroredSets) {
  const VoxelGrid grid = make_grid({16, 16, 16});
  std::set<std::uint64_t> seen;
  int sets = 0;
  for (int swap = 0; swap < 3; ++swap) {
    for (int shift = 0; shift < 10; ++shift) {
      const auto set = intervals_from_predicate(grid, Axis::kZ, [&](int i, int j, int k) {
        const glm::ivec3 index(i, j, k);
        return index[swap] >= shift && index[swap] < shift + 3 && index[(swap + 1) % 3] < 5;
      });
      seen.insert(set_checksum(set));
      ++sets;
    }
  }
  EXPECT_EQ(seen.size(), static_cast<std::size_t>(sets));
}

TEST(SetChecksum, DependsOnTheGrid) {
  const auto value = [](glm::ivec3 dims, glm::dvec3 origin, glm::dvec3 size) {
    return set_checksum(intervals_from_predicate(make_grid(dims, origin, size), Axis::kZ,
                                                 [](int i, int, int) { return i == 1; }));
  };
  const std::uint64_t expected = value({5, 6, 7}, {0, 1, 2}, glm::dvec3(1));
  EXPECT_EQ(value({5, 6, 7}, {-0.0, 1, 2}, glm::dvec3(1)), expected);
  EXPECT_NE(value({6, 6, 7}, {0, 1, 2}, glm::dvec3(1)), expected);
  EXPECT_NE(value({5, 6, 7}, {0, 1, 3}, glm::dvec3(1)), expected);
  EXPECT_NE(value({5, 6, 7}, {0, 1, 2}, {1, 1, 2}), expected);
}

__extension__ using Wide = unsigned __int128;

/// splitmix64 (Steele, Lea, Flood, 2014)
std::uint64_t splitmix(std::uint64_t value) {
  value += 0x9e3779b97f4a7c15u;
  value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9u;
  value = (value ^ (value >> 27)) * 0x94d049bb133111ebu;
  return value ^ (value >> 31);
}

/// The checksum as its header defines it, voxel by voxel: the sum of f(x) g(y) h(z) modulo a prime.
std::uint64_t checksum_by_voxels(const Sample& sample) {
  constexpr std::uint64_t kPrime = 2305843009213693951u;  // 2^61 - 1
  const auto factor = [](std::uint64_t axis, int index) {
    return splitmix(splitmix(axis + 1) ^ static_cast<std::uint64_t>(index)) % (kPrime - 1) + 1;
  };
  Wide sum = 0;
  const glm::ivec3 dims = sample.grid.dims;
  for (int i = 0; i < dims.x; ++i) {
    for (int j = 0; j < dims.y; ++j) {
      for (int k = 0; k < dims.z; ++k) {
        if (!sample.solid(i, j, k)) continue;
        sum = (sum + Wide{factor(0, i)} * factor(1, j) % kPrime * factor(2, k)) % kPrime;
      }
    }
  }
  std::uint64_t hash = splitmix(static_cast<std::uint64_t>(sum));
  for (int axis = 0; axis < 3; ++axis) {
    hash = splitmix(hash ^ static_cast<std::uint64_t>(dims[axis]));
    hash = splitmix(hash ^ std::bit_cast<std::uint64_t>(sample.grid.origin[axis]));
    hash = splitmix(hash ^ std::bit_cast<std::uint64_t>(sample.grid.voxel_size[axis]));
  }
  return hash;
}

// The numbers are an interface: they stand in users' files and in other machines' reports.
TEST(SetChecksum, KeepsItsValues) {
  std::map<std::string, std::uint64_t> values;
  for (const Sample& sample : small_samples()) {
    values[sample.name] = set_checksum(intervals_of(sample, Axis::kZ));
    EXPECT_EQ(values[sample.name], checksum_by_voxels(sample)) << sample.name;
  }
  EXPECT_EQ(values["empty"], 8503180249408319751u);
  EXPECT_EQ(values["ball"], 9590650330842228386u);
  EXPECT_EQ(values["random"], 2570825827131100938u);
}

}  // namespace
}  // namespace strata::testing
