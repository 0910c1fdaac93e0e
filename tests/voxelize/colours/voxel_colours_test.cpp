#include "strata/voxelize/colours/voxel_colours.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <tuple>

#include "strata/mesh/shapes.h"
#include "strata/raster/lattice_mesh.h"
#include "strata/voxelize/grid_fit.h"
#include "strata/voxelize/voxelize.h"
#include "tests/support/simd_targets.h"

namespace strata {
namespace {

// Triangle t has the colour t + 1, so that colours tell triangles.
glm::u8vec4 number_colour(std::size_t triangle) {
  const auto n = static_cast<std::uint32_t>(triangle + 1);
  return unpacked_colour(n | 0xff000000u);
}
std::vector<glm::u8vec4> number_colours(std::size_t count) {
  std::vector<glm::u8vec4> colours;
  for (std::size_t i = 0; i < count; ++i) colours.push_back(number_colour(i));
  return colours;
}

using Voxels = std::map<std::tuple<int, int, int>, std::uint32_t>;
Voxels voxels_of(const VoxelIntervals& set) {
  Voxels voxels;
  for_each_run(set, [&](const glm::ivec3& first, const glm::ivec3& last, std::uint32_t label) {
    for (glm::ivec3 at = first;; at[static_cast<int>(set.axis())] += 1) {
      voxels[{at.x, at.y, at.z}] = label;
      if (at == last) break;
    }
  });
  return voxels;
}

struct Case {
  TriangleSoup mesh;
  VoxelGrid grid;
  VoxelizeOptions how;
  VoxelColourOptions options;
  int threads = 1;
};
VoxelIntervals coloured(const Case& c, const SurfaceColours& colours) {
  Execution execution;
  execution.threads = c.threads;
  const auto set = voxelize(c.mesh, c.grid, c.how, execution);
  EXPECT_TRUE(set) << set.error().message;
  auto engine = VoxelColouring::create(c.mesh, c.grid, colours, c.options, execution);
  EXPECT_TRUE(engine) << engine.error().message;
  auto result = engine->colour(*set, execution);
  EXPECT_TRUE(result) << result.error().message;
  return *std::move(result);
}

VoxelGrid grid_of(const TriangleSoup& mesh, int resolution) {
  GridRequest request;
  request.resolution = resolution;
  return *fit_grid(bounds(mesh), request);
}

// The distance of p to a triangle by looking at many of its points, refined about the best: slow,
// and another way than the one that is tested.
double sampled_distance(const glm::dvec3& p, const std::array<glm::dvec3, 3>& t) {
  double s0 = 1.0 / 3, s1 = 1.0 / 3, best = 1e300;
  double span = 1.0;
  for (int round = 0; round < 22; ++round) {
    const double c0 = s0, c1 = s1;
    for (int i = -6; i <= 6; ++i) {
      for (int j = -6; j <= 6; ++j) {
        const double a = std::clamp(c0 + span * i / 6, 0.0, 1.0);
        const double b = std::clamp(c1 + span * j / 6, 0.0, 1.0 - a);
        const double d = glm::distance(p, t[0] * (1 - a - b) + t[1] * a + t[2] * b);
        if (d < best) best = d, s0 = a, s1 = b;
      }
    }
    span *= 0.5;
  }
  return best;
}

// The distances of voxel centres to all triangles, in voxels, on the lattice.
class Distances {
 public:
  explicit Distances(const Case& c) : mesh_(*snap_to_lattice(c.mesh, c.grid)) {}
  [[nodiscard]] double of(const std::tuple<int, int, int>& voxel, std::size_t triangle) const {
    const auto [x, y, z] = voxel;
    std::array<glm::dvec3, 3> t;
    for (int i = 0; i < 3; ++i) {
      t[static_cast<std::size_t>(i)] =
          glm::dvec3(mesh_.vertices[mesh_.triangles[triangle][i]]) / 256.0;
    }
    return sampled_distance({x + 0.5, y + 0.5, z + 0.5}, t);
  }
  [[nodiscard]] double nearest(const std::tuple<int, int, int>& voxel) const {
    double best = 1e300;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) best = std::min(best, of(voxel, t));
    return best;
  }

 private:
  LatticeMesh mesh_;
};

TEST(VoxelColouring, EachVoxelOfASurfaceHasTheColourOfTheNearestTriangle) {
  Case c;
  c.mesh = transform(make_icosphere(1, 1), glm::dmat4(1.0));  // 80 triangles
  for (auto& p : c.mesh.positions) p = {p.x, 0.7 * p.y + 0.2 * p.x, p.z + 0.1 * p.y};
  c.grid = grid_of(c.mesh, 9);
  c.how.solid = false, c.how.surface = true;
  const auto colours = SurfaceColours::of_triangles(number_colours(c.mesh.triangles.size()));
  const Distances distances(c);
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    c.how.axis = axis;
    const Voxels voxels = voxels_of(coloured(c, colours));
    const Voxels all = voxels_of(*voxelize(c.mesh, c.grid, c.how));
    ASSERT_EQ(voxels.size(), all.size());
    ASSERT_GT(voxels.size(), 200u);
    for (const auto& [voxel, label] : voxels) {
      const std::size_t triangle = (label & 0xffffff) - 1;
      ASSERT_LT(triangle, c.mesh.triangles.size());
      EXPECT_NEAR(distances.of(voxel, triangle), distances.nearest(voxel), 1e-5);
    }
  }
}

TEST(VoxelColouring, OfEquallyNearTrianglesTheFirstCounts) {
  Case c;
  c.mesh = make_box({0, 0, 0}, {4, 4, 4});
  c.grid = {{4, 4, 4}, glm::dvec3(0.0), glm::dvec3(1.0)};
  c.options.solid = true;
  const std::size_t count = c.mesh.triangles.size();
  const auto number = SurfaceColours::of_triangles(number_colours(count));
  const Distances distances(c);
  for (const auto& [voxel, label] : voxels_of(coloured(c, number))) {
    const auto [x, y, z] = voxel;
    const bool inside = std::min({x, y, z}) >= 1 && std::max({x, y, z}) <= 2;
    ASSERT_EQ(label == packed_colour({128, 128, 128, 255}), inside) << x << y << z;
    if (inside) continue;
    std::size_t first = 0;
    while (distances.of(voxel, first) > distances.nearest(voxel) + 1e-6) ++first;
    EXPECT_EQ((label & 0xffffff) - 1, first) << x << y << z;
  }
}

TEST(VoxelColouring, SixFacesOfABoxHaveTheirColours) {
  Case c;
  c.mesh = make_box({0, 0, 0}, {20, 20, 20});
  c.grid = {{20, 20, 20}, glm::dvec3(0.0), glm::dvec3(1.0)};
  c.options.solid = true;
  c.options.inside = {1, 2, 3, 255};
  // A colour by the axis and the side of each triangle.
  std::vector<glm::u8vec4> faces;
  for (const glm::uvec3& t : c.mesh.triangles) {
    const glm::dvec3 a = c.mesh.positions[t.x];
    const glm::dvec3 n = glm::cross(c.mesh.positions[t.y] - a, c.mesh.positions[t.z] - a);
    glm::u8vec4 colour(100, 100, 100, 255);
    for (int axis = 0; axis < 3; ++axis) {
      if (n[axis] != 0) colour[axis] = n[axis] > 0 ? 255 : 0;
    }
    faces.push_back(colour);
  }
  const Voxels voxels = voxels_of(coloured(c, SurfaceColours::of_triangles(faces)));
  EXPECT_EQ(voxels.size(), 8000u);
  EXPECT_EQ(voxels.at({0, 9, 7}), packed_colour({0, 100, 100, 255}));
  EXPECT_EQ(voxels.at({19, 9, 7}), packed_colour({255, 100, 100, 255}));
  EXPECT_EQ(voxels.at({9, 0, 7}), packed_colour({100, 0, 100, 255}));
  EXPECT_EQ(voxels.at({9, 19, 7}), packed_colour({100, 255, 100, 255}));
  EXPECT_EQ(voxels.at({9, 7, 0}), packed_colour({100, 100, 0, 255}));
  EXPECT_EQ(voxels.at({9, 7, 19}), packed_colour({100, 100, 255, 255}));
  EXPECT_EQ(voxels.at({9, 7, 10}), packed_colour({1, 2, 3, 255}));
}

// The voxels of a solid that share a face with the outside are all in the shell.
TEST(VoxelColouring, WhatCanBeSeenOfASolidHasAColourOfItsSurface) {
  Case c;
  c.mesh = make_torus_knot(2, 3, 0.4, 200, 24);
  c.grid = grid_of(c.mesh, 70);
  c.grid.voxel_size *= glm::dvec3(1.0, 0.9, 1.2);  // cuts some of it off
  c.options.solid = true;
  const glm::u8vec4 shell(200, 10, 10, 255);
  const auto colours =
      SurfaceColours::of_triangles(std::vector<glm::u8vec4>(c.mesh.triangles.size(), shell));
  const VoxelIntervals set = coloured(c, colours);
  const Voxels voxels = voxels_of(set);
  ASSERT_EQ(voxels.size(), voxels_of(*voxelize(c.mesh, c.grid)).size());
  std::size_t seen = 0, inner = 0;
  for (const auto& [voxel, label] : voxels) {
    const auto [x, y, z] = voxel;
    bool exposed = false;
    for (const auto [i, j, k] : std::initializer_list<std::array<int, 3>>{
             {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}) {
      const glm::ivec3 other(x + i, y + j, z + k);
      const bool within = other.x >= 0 && other.y >= 0 && other.z >= 0 && other.x < c.grid.dims.x &&
                          other.y < c.grid.dims.y && other.z < c.grid.dims.z;
      exposed |= within && !voxels.contains({other.x, other.y, other.z});
    }
    seen += exposed;
    inner += label == packed_colour(c.options.inside);
    if (exposed) {
      ASSERT_EQ(label, packed_colour(shell)) << x << " " << y << " " << z;
    }
  }
  EXPECT_GT(seen, 1000u);
  EXPECT_GT(inner, 1000u);
}

TEST(VoxelColouring, ThreadsSlabsAndAxesMakeNoDifference) {
  Case c;
  c.mesh = make_torus_knot(2, 3, 0.4, 300, 40);
  c.grid = grid_of(c.mesh, 150);
  const auto colours = SurfaceColours::of_triangles(number_colours(c.mesh.triangles.size()));
  for (const bool solid : {false, true}) {
    c.how.solid = solid, c.how.surface = !solid, c.options.solid = solid;
    c.how.axis = Axis::kZ;
    c.threads = 1;
    const Voxels one = voxels_of(coloured(c, colours));
    EXPECT_GT(one.size(), 10000u);
    for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
      c.how.axis = axis;
      c.threads = 3;
      EXPECT_EQ(voxels_of(coloured(c, colours)), one);
    }
    auto engine = VoxelColouring::create(c.mesh, c.grid, colours, c.options);
    Voxels slabs;
    Execution small;
    small.memory_limit = 24 << 20;  // several slabs
    ASSERT_TRUE(voxelize_slabs(c.mesh, c.grid, c.how, {}, [&](const VoxelIntervals& slab) {
      const auto done = engine->colour(slab);
      EXPECT_TRUE(done);
      slabs.merge(voxels_of(*done));
      return Result<void>();
    }));
    EXPECT_EQ(slabs, one);
  }
}

// A texture laid on a mesh along z, repeated along u and mirrored along v.
MeshAttributes textured(const TriangleSoup& mesh, bool opaque) {
  MeshAttributes made;
  std::mt19937 random(5);
  Texture texture{"made here", 37, 23, {}};
  texture.wrap_v = TextureWrap::kMirror;
  for (int i = 0; i < 37 * 23; ++i) {
    texture.texels.push_back(unpacked_colour(static_cast<std::uint32_t>(random()) |
                                             (opaque || i % 3 != 0 ? 0xff000000u : 0x01000000u)));
  }
  made.textures = {texture};
  made.materials.resize(1);
  made.materials[0].coloured = true;
  made.materials[0].texture = 0;
  made.material_ranges = {{0, 0}};
  made.corner_offsets = {0};
  for (const glm::uvec3& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      const glm::dvec3& p = mesh.positions[t[i]];
      made.corners.push_back({t[i], glm::vec2(3.1 * p.x, 0.7 * p.y), glm::u8vec4(255)});
    }
    made.corner_offsets.push_back(static_cast<std::uint32_t>(made.corners.size()));
  }
  return made;
}

TEST(VoxelColouring, EverySimdTargetGivesTheSameColours) {
  Case c;
  c.mesh = make_torus_knot(2, 3, 0.4, 60, 20);
  c.mesh.positions.push_back({0, 0, 0});  // and a triangle without area
  c.mesh.triangles.push_back({0, static_cast<std::uint32_t>(c.mesh.positions.size() - 1), 0});
  c.grid = grid_of(c.mesh, 60);
  c.how.solid = false, c.how.surface = true;
  for (const bool opaque : {false, true}) {
    const MeshAttributes attributes = textured(c.mesh, opaque);
    SurfaceColourOptions options;
    options.footprint = c.grid.voxel_size;
    const auto colours = SurfaceColours::make(c.mesh, attributes, options);
    ASSERT_TRUE(colours) << colours.error().message;
    std::optional<Voxels> first;
    const int targets = testkit::for_each_simd_target([&](const std::string& name) {
      const Voxels voxels = voxels_of(coloured(c, *colours));
      if (!first) first = voxels;
      EXPECT_EQ(voxels, *first) << name;
    });
    EXPECT_GE(targets, 1);
    std::set<std::uint32_t> labels;
    for (const auto& [voxel, label] : *first) labels.insert(label);
    EXPECT_GT(labels.size(), 1000u);
  }
}

TEST(VoxelColouring, RandomTrianglesOfAllSizesAreFound) {
  std::mt19937 random(1729);
  std::uniform_real_distribution<double> anywhere(-3.0, 11.0), small(-0.4, 0.4);
  for (int round = 0; round < 40; ++round) {
    SCOPED_TRACE(round);
    Case c;
    for (std::uint32_t t = 0; t < 8; ++t) {
      const glm::dvec3 a(anywhere(random), anywhere(random), anywhere(random));
      for (int i = 0; i < 3; ++i) {
        const bool tiny = t % 3 == 0;
        c.mesh.positions.push_back(
            tiny ? a + glm::dvec3(small(random), small(random), small(random))
                 : glm::dvec3(anywhere(random), anywhere(random), anywhere(random)));
      }
      if (t % 4 == 3) c.mesh.positions.back() = c.mesh.positions[3 * t];  // no area
      c.mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    c.grid = {{8, 8, 8}, glm::dvec3(0.0), glm::dvec3(1.0)};
    c.how.solid = false, c.how.surface = true;
    const auto colours = SurfaceColours::of_triangles(number_colours(c.mesh.triangles.size()));
    const Distances distances(c);
    const Voxels voxels = voxels_of(coloured(c, colours));
    ASSERT_EQ(voxels.size(), voxels_of(*voxelize(c.mesh, c.grid, c.how)).size());
    for (const auto& [voxel, label] : voxels) {
      const std::size_t triangle = (label & 0xffffff) - 1;
      ASSERT_NEAR(distances.of(voxel, triangle), distances.nearest(voxel), 1e-4);
    }
  }
}

TEST(VoxelColouring, TransparentVoxelsOfASurfaceAreLeftOut) {
  Case c;
  c.mesh = make_box({0, 0, 0}, {6, 6, 6});
  c.grid = {{8, 8, 8}, glm::dvec3(-1.0), glm::dvec3(1.0)};
  std::vector<glm::u8vec4> faces(c.mesh.triangles.size(), glm::u8vec4(9, 9, 9, 255));
  for (std::size_t t = 0; t < faces.size(); ++t) {
    const glm::uvec3 corner = c.mesh.triangles[t];
    if (c.mesh.positions[corner.x].z == 6 && c.mesh.positions[corner.y].z == 6 &&
        c.mesh.positions[corner.z].z == 6) {
      faces[t].w = 0;  // the upper face
    }
  }
  const auto colours = SurfaceColours::of_triangles(faces);
  c.how.solid = false, c.how.surface = true;
  const Voxels open = voxels_of(coloured(c, colours));
  EXPECT_TRUE(open.contains({3, 3, 1}));
  EXPECT_FALSE(open.contains({3, 3, 6}));
  EXPECT_FALSE(open.contains({3, 3, 7}));
  c.how.solid = true, c.how.surface = false, c.options.solid = true;
  const Voxels filled = voxels_of(coloured(c, colours));
  EXPECT_EQ(filled.at({3, 3, 6}), packed_colour(c.options.inside));
  EXPECT_EQ(filled.size(), 216u);
}

TEST(VoxelColouring, TheMemoryLimitIsKept) {
  Case c;
  c.mesh = make_icosphere(1, 4);
  c.grid = grid_of(c.mesh, 200);
  c.how.solid = false, c.how.surface = true;
  const auto colours = SurfaceColours::of_triangles(number_colours(c.mesh.triangles.size()));
  auto engine = VoxelColouring::create(c.mesh, c.grid, colours, c.options);
  const auto set = voxelize(c.mesh, c.grid, c.how);
  Execution execution;
  execution.memory_limit = 300000;
  const auto done = engine->colour(*set, execution);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::kLimit);
}

}  // namespace
}  // namespace strata
