#pragma once

// Meshes and sets of voxels for the tests of the surface voxelizer.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "voxelize/shell_voxels.h"

namespace strata::shell_testing {

inline constexpr std::array kAllAxes = {Axis::kX, Axis::kY, Axis::kZ};
inline constexpr std::array kAllKinds = {SurfaceKind::kConservative, SurfaceKind::k26,
                                         SurfaceKind::k6};

struct Mesh {
  LatticeVertices vertices;
  std::vector<glm::uvec3> triangles;

  void add(glm::ivec3 a, glm::ivec3 b, glm::ivec3 c) {
    const auto i = static_cast<unsigned>(vertices.size());
    vertices.insert(vertices.end(), {a, b, c});
    triangles.emplace_back(i, i + 1, i + 2);
  }
  [[nodiscard]] LatticeMesh lattice() const { return {vertices, triangles}; }
};

inline VoxelGrid grid_of(int nx, int ny, int nz) {
  VoxelGrid grid;
  grid.dims = {nx, ny, nz};
  return grid;
}

// --- sets of voxels -----------------------------------------------------------------------------

class VoxelSet {
 public:
  explicit VoxelSet(glm::ivec3 dims)
      : dims_(dims),
        bits_(static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) *
              static_cast<std::size_t>(dims.z)) {}
  [[nodiscard]] bool inside(glm::ivec3 p) const {
    return p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x < dims_.x && p.y < dims_.y && p.z < dims_.z;
  }
  [[nodiscard]] std::vector<bool>::reference at(glm::ivec3 p) { return bits_[index(p)]; }
  [[nodiscard]] bool at(glm::ivec3 p) const { return bits_[index(p)]; }
  [[nodiscard]] auto count() const { return std::count(bits_.begin(), bits_.end(), true); }
  [[nodiscard]] bool contains(const VoxelSet& other) const {
    for (std::size_t i = 0; i < bits_.size(); ++i) {
      if (other.bits_[i] && !bits_[i]) return false;
    }
    return true;
  }
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (int z = 0; z < dims_.z; ++z) {
      for (int y = 0; y < dims_.y; ++y) {
        for (int x = 0; x < dims_.x; ++x) visit(glm::ivec3(x, y, z));
      }
    }
  }
  friend bool operator==(const VoxelSet&, const VoxelSet&) = default;

 private:
  [[nodiscard]] std::size_t index(glm::ivec3 p) const {
    return static_cast<std::size_t>(p.x) +
           static_cast<std::size_t>(dims_.x) *
               (static_cast<std::size_t>(p.y) +
                static_cast<std::size_t>(dims_.y) * static_cast<std::size_t>(p.z));
  }
  glm::ivec3 dims_;
  std::vector<bool> bits_;
};

// Checks the form of the intervals on the way.
inline void add_to(VoxelSet& set, const VoxelIntervals& slab) {
  const AxisFrame frame(slab.axis());
  for (int v = slab.v_begin(); v < slab.v_end(); ++v) {
    for (int u = 0; u < slab.columns(); ++u) {
      int previous_end = -1;
      for (const Interval& interval : slab.column(u, v)) {
        ASSERT_GT(interval.begin(), previous_end) << "overlapping or touching intervals";
        ASSERT_GE(interval.last, interval.first);
        ASSERT_LT(interval.last, slab.grid().dims[frame.w]);
        previous_end = interval.end();
        for (int w = interval.begin(); w < interval.end(); ++w) {
          glm::ivec3 p{};
          p[frame.u] = u, p[frame.v] = v, p[frame.w] = w;
          set.at(p) = true;
        }
      }
    }
  }
}

inline VoxelSet surface_set(const Mesh& mesh, const VoxelGrid& grid, SurfaceKind kind,
                            Axis axis = Axis::kZ, int threads = 1) {
  VoxelSet set(grid.dims);
  const int rows = grid.dims[AxisFrame(axis).v];
  Execution execution;
  execution.threads = threads;
  const auto slab = voxelize_shell(mesh.lattice(), grid, kind, axis, 0, rows, execution);
  EXPECT_TRUE(slab.has_value()) << slab.error().message;
  if (slab) add_to(set, *slab);
  return set;
}

// A closed surface: a sphere of triangles with a wavy radius, in voxels.
inline Mesh wavy_sphere(glm::dvec3 centre, double radius, double wave, unsigned seed,
                        int rings = 12) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> pick(-wave, wave);
  const int sectors = 2 * rings;
  Mesh mesh;
  const auto at = [&](double theta, double phi, double r) {
    const glm::dvec3 p = centre + r * glm::dvec3(std::sin(theta) * std::cos(phi),
                                                 std::sin(theta) * std::sin(phi), std::cos(theta));
    return glm::ivec3(static_cast<int>(std::lround(p.x * 256)),
                      static_cast<int>(std::lround(p.y * 256)),
                      static_cast<int>(std::lround(p.z * 256)));
  };
  constexpr double kPi = std::numbers::pi;
  mesh.vertices = {at(0, 0, radius), at(kPi, 0, radius)};
  for (int i = 1; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      mesh.vertices.push_back(
          at(kPi * i / rings, 2 * kPi * j / sectors + 0.3, radius * (1 + pick(random))));
    }
  }
  const auto vertex = [&](int i, int j) {
    if (i == 0) return 0u;
    if (i == rings) return 1u;
    return static_cast<unsigned>(2 + (i - 1) * sectors + j % sectors);
  };
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      if (i > 0) mesh.triangles.emplace_back(vertex(i, j), vertex(i + 1, j), vertex(i, j + 1));
      if (i + 1 < rings) {
        mesh.triangles.emplace_back(vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1));
      }
    }
  }
  return mesh;
}

inline Mesh cuboid(glm::ivec3 low, glm::ivec3 high) {
  Mesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.emplace_back(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y,
                               i & 4 ? high.z : low.z);
  }
  constexpr unsigned kFaces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& f : kFaces) {
    mesh.triangles.emplace_back(f[0], f[1], f[2]);
    mesh.triangles.emplace_back(f[0], f[2], f[3]);
  }
  return mesh;
}

}  // namespace strata::shell_testing
