#pragma once

#include <functional>
#include <random>
#include <string>
#include <vector>

#include "strata/voxelize/intervals.h"
#include "tests/support/predicate_intervals.h"
#include "tests/support/temporary_folder.h"

// Voxel sets for the tests of writers and checksums.

namespace strata::testing {

struct Sample {
  std::string name;
  VoxelGrid grid;
  std::function<bool(int, int, int)> solid;
};

inline VoxelGrid make_grid(glm::ivec3 dims, glm::dvec3 origin = {-1.5, 20.0, 3.25},
                           glm::dvec3 voxel_size = glm::dvec3(0.125)) {
  VoxelGrid grid;
  grid.dims = dims;
  grid.origin = origin;
  grid.voxel_size = voxel_size;
  return grid;
}

/// True for about `permille` of 1000 voxels, the same ones in every run.
inline bool random_voxel(int i, int j, int k, unsigned permille) {
  std::uint64_t value = static_cast<std::uint64_t>(i) << 40 ^ static_cast<std::uint64_t>(j) << 20 ^
                        static_cast<std::uint64_t>(k);
  value = (value + 0x9e3779b97f4a7c15u) * 0xbf58476d1ce4e5b9u;
  value = (value ^ value >> 27) * 0x94d049bb133111ebu;
  return (value >> 33) % 1000 < permille;
}

/// Small sets with the awkward sizes: not multiples of 8 or 64, one voxel, nothing, everything.
inline std::vector<Sample> small_samples() {
  const auto ball = [](glm::dvec3 centre, double radius) {
    return [centre, radius](int i, int j, int k) {
      const glm::dvec3 d = glm::dvec3(i, j, k) + 0.5 - centre;
      return d.x * d.x + d.y * d.y + d.z * d.z < radius * radius;
    };
  };
  return {
      {"random", make_grid({37, 70, 91}),
       [](int i, int j, int k) { return random_voxel(i, j, k, 300); }},
      {"dense", make_grid({65, 130, 20}),
       [](int i, int j, int k) { return random_voxel(i, j, k, 990); }},
      {"blocks", make_grid({50, 70, 90}),
       [](int i, int j, int k) { return random_voxel(i / 8, j / 8, k / 8, 500); }},
      {"ball", make_grid({75, 70, 80}), ball({35, 37.5, 40}, 33.0)},
      {"one_voxel", make_grid({33, 65, 9}),
       [](int i, int j, int k) { return i == 32 && j == 64 && k == 8; }},
      {"smallest", make_grid({1, 1, 1}), [](int, int, int) { return true; }},
      {"empty", make_grid({20, 70, 30}), [](int, int, int) { return false; }},
      {"full", make_grid({128, 64, 72}), [](int, int, int) { return true; }},
      {"full_ragged", make_grid({129, 66, 131}), [](int, int, int) { return true; }},
      {"long_x", make_grid({700, 3, 2}),
       [](int i, int j, int k) { return random_voxel(i / 50, j, k, 500); }},
      {"long_y", make_grid({3, 700, 2}),
       [](int i, int j, int k) { return random_voxel(i, j / 50, k, 500); }},
      {"long_z", make_grid({3, 2, 700}),
       [](int i, int j, int k) { return random_voxel(i, j, k / 50, 500); }},
  };
}

inline VoxelIntervals intervals_of(const Sample& sample, Axis axis) {
  return intervals_from_predicate(sample.grid, axis, sample.solid);
}

using IdOf = std::function<std::uint32_t(int, int, int)>;

/// Labelled intervals by brute force, of all rows.
inline VoxelIntervals labelled(const VoxelGrid& grid, Axis axis, const IdOf& id) {
  const AxisFrame frame(axis);
  VoxelIntervals result(grid, axis);
  constexpr int kSide = VoxelIntervals::kTileSide;
  for (int tile = 0; tile < result.tiles_u() * result.tiles_v(); ++tile) {
    const int tu = tile % result.tiles_u(), tv = tile / result.tiles_u();
    std::vector<std::uint32_t> offsets(1, 0), labels;
    std::vector<Interval> items;
    for (int local = 0; local < kSide * kSide; ++local) {
      glm::ivec3 at(0);
      at[frame.u] = tu * kSide + local % kSide;
      at[frame.v] = tv * kSide + local / kSide;
      std::uint32_t last = 0;
      for (int k = 0; k < grid.dims[frame.w]; ++k) {
        if (at[frame.u] >= grid.dims[frame.u] || at[frame.v] >= grid.dims[frame.v]) break;
        at[frame.w] = k;
        const std::uint32_t now = id(at.x, at.y, at.z);
        const auto place = static_cast<std::uint16_t>(k);
        if (now != 0 && now != last) {
          items.push_back({place, place});
          labels.push_back(now);
        }
        if (now != 0) items.back().last = place;
        last = now;
      }
      offsets.push_back(static_cast<std::uint32_t>(items.size()));
    }
    if (!items.empty()) result.set_tile(tu, tv, offsets, items, labels);
  }
  return result;
}

/// Blocks, and some voxels by themselves; ids up to `largest`, which is there.
inline IdOf some_ids(std::uint32_t largest) {
  return [largest](int i, int j, int k) -> std::uint32_t {
    if (i + j + k == 0) return largest;
    if (random_voxel(i, j, k, 20)) {
      return 1 + static_cast<std::uint32_t>(i * 7919 + j * 104729 + k * 1299709) % largest;
    }
    if (!random_voxel(i / 9, j / 9, k / 9, 600)) return 0;
    return 1 + static_cast<std::uint32_t>(i / 9 * 31 + j / 9 * 1009 + k / 9 * 65537) % largest;
  };
}

/// Cuts a set into slabs of `tiles` rows of tiles.
inline std::vector<VoxelIntervals> cut(const VoxelIntervals& set, int tiles) {
  std::vector<VoxelIntervals> slabs;
  const int rows = tiles * VoxelIntervals::kTileSide;
  for (int begin = set.v_begin(); begin < set.v_end(); begin += rows) {
    VoxelIntervals& slab =
        slabs.emplace_back(set.grid(), set.axis(), begin, std::min(begin + rows, set.v_end()));
    for (int tv = 0; tv < slab.tiles_v(); ++tv) {
      for (int tu = 0; tu < slab.tiles_u(); ++tu) {
        const int from = (begin - set.v_begin()) / VoxelIntervals::kTileSide + tv;
        if (set.tile_empty(tu, from)) continue;
        const VoxelIntervals::TileView tile = set.tile(tu, from);
        slab.set_tile(tu, tv, tile.offsets, tile.items, tile.labels);
      }
    }
  }
  return slabs;
}

using testkit::TemporaryFolder;

}  // namespace strata::testing
