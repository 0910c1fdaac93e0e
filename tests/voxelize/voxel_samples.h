#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "voxelize/intervals.h"

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
        slab.set_tile(tu, tv, set.tile(tu, from).offsets, set.tile(tu, from).items);
      }
    }
  }
  return slabs;
}

inline std::string file_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A folder of its own that is removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "strata_test_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder: " + name);
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }
  [[nodiscard]] bool is_empty() const { return std::filesystem::is_empty(path_); }

 private:
  std::filesystem::path path_;
};

}  // namespace strata::testing
