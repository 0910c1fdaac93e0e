// The faces between voxels and the rest, against a count over all pairs of neighbouring voxels.

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <vector>

#include "strata/voxelize/area/boundary_area.h"
#include "tests/support/simd_targets.h"

namespace strata {
namespace {

using Faces = std::array<std::uint64_t, 3>;

/// Random columns: empty ones, ones of one interval, and ones of up to `most`.
std::vector<std::vector<Interval>> random_columns(std::mt19937& random, std::size_t count, int side,
                                                  int most) {
  std::vector<std::vector<Interval>> columns(count);
  int kind = 0;
  for (auto& column : columns) {
    if (random() % 8 == 0) kind = static_cast<int>(random() % 4);  // alike for some columns
    if (kind == 0) continue;
    const auto limit = static_cast<std::size_t>(kind < 3 ? 1 : most);
    const int mean_gap = std::max(2, side / static_cast<int>(2 * limit));
    const auto some = [&] { return static_cast<int>(random() % static_cast<unsigned>(mean_gap)); };
    for (int begin = some(); begin < side && column.size() < limit;) {
      const int last = std::min(side - 1, begin + some());
      column.push_back({static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(last)});
      begin = last + 2 + some();
    }
  }
  return columns;
}

Faces count_faces(const std::vector<bool>& solid, const glm::ivec3& dims) {
  Faces faces{};
  const auto at = [&](const glm::ivec3& p) {
    for (int axis = 0; axis < 3; ++axis) {
      if (p[axis] < 0 || p[axis] >= dims[axis]) return false;
    }
    return bool{solid[static_cast<std::size_t>((p.z * dims.y + p.y) * dims.x + p.x)]};
  };
  for (int z = -1; z < dims.z; ++z) {
    for (int y = -1; y < dims.y; ++y) {
      for (int x = -1; x < dims.x; ++x) {
        const bool here = at({x, y, z});
        faces[0] += here != at({x + 1, y, z});
        faces[1] += here != at({x, y + 1, z});
        faces[2] += here != at({x, y, z + 1});
      }
    }
  }
  return faces;
}

/// In slabs of `rows_of_tiles`.
void expect_faces(unsigned seed, const glm::ivec3& dims, Axis axis, int most, int rows_of_tiles) {
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  const VoxelGrid grid{glm::dvec3(0), glm::dvec3(1), dims};
  const AxisFrame frame(axis);
  const int columns_u = dims[frame.u], columns_v = dims[frame.v];
  const auto columns = random_columns(
      random, static_cast<std::size_t>(columns_u) * static_cast<std::size_t>(columns_v),
      dims[frame.w], most);
  std::vector<bool> solid(static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) *
                          static_cast<std::size_t>(dims.z));
  BoundaryArea area(grid, axis);
  Execution execution;
  execution.threads = 2;
  constexpr int kSide = VoxelIntervals::kTileSide;
  for (int v_begin = 0; v_begin < columns_v; v_begin += rows_of_tiles * kSide) {
    VoxelIntervals slab(grid, axis, v_begin, std::min(columns_v, v_begin + rows_of_tiles * kSide));
    for (int tv = 0; tv < slab.tiles_v(); ++tv) {
      for (int tu = 0; tu < slab.tiles_u(); ++tu) {
        std::vector<std::uint32_t> offsets;
        std::vector<Interval> items;
        for (int v = v_begin + tv * kSide; v < v_begin + (tv + 1) * kSide; ++v) {
          for (int u = tu * kSide; u < (tu + 1) * kSide; ++u) {
            offsets.push_back(static_cast<std::uint32_t>(items.size()));
            if (u >= columns_u || v >= slab.v_end()) continue;
            for (const Interval& interval : columns[static_cast<std::size_t>(v * columns_u + u)]) {
              items.push_back(interval);
              glm::ivec3 at;
              at[frame.u] = u, at[frame.v] = v;
              for (int w = interval.begin(); w < interval.end(); ++w) {
                at[frame.w] = w;
                solid[static_cast<std::size_t>((at.z * dims.y + at.y) * dims.x + at.x)] = true;
              }
            }
          }
        }
        offsets.push_back(static_cast<std::uint32_t>(items.size()));
        if (!items.empty()) slab.set_tile(tu, tv, offsets, items);
      }
    }
    area.add(slab, execution);
  }
  const Faces expected = count_faces(solid, dims);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(area.faces()[i], expected[i]) << i;
}

TEST(BoundaryArea, FacesOfRandomColumnsAreThoseBetweenNeighbours) {
  testkit::for_each_simd_target([](const std::string& target) {
    SCOPED_TRACE(target);
    for (unsigned seed = 0; seed < 30; ++seed) {
      std::mt19937 random(seed);
      const auto side = [&](unsigned most) { return 1 + static_cast<int>(random() % most); };
      const glm::ivec3 dims(side(150), side(150), side(150));
      const Axis axis = std::array{Axis::kX, Axis::kY, Axis::kZ}[seed % 3];
      expect_faces(seed, dims, axis, 1 + static_cast<int>(seed % 8), side(3));
    }
  });
}

TEST(BoundaryArea, TheLongestColumnsAreCounted) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    expect_faces(seed, {9, 7, 65536}, Axis::kZ, 5, 1);
    expect_faces(seed, {65536, 3, 70}, Axis::kX, 1, 1);
  }
}

}  // namespace
}  // namespace strata
