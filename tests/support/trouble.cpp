#include "tests/support/trouble.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <map>
#include <tuple>

#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"

namespace strata::testkit {
namespace {

int pick(std::mt19937_64& random, int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(random);
}

glm::ivec3 random_point(std::mt19937_64& random, int step, int shift, int extent) {
  const int steps = (extent - shift) / step;
  return {pick(random, 0, steps) * step + shift, pick(random, 0, steps) * step + shift,
          pick(random, 0, steps) * step + shift};
}

TriangleSoup moved(const TriangleSoup& mesh, const glm::dvec3& by) {
  return transform(mesh, glm::translate(glm::dmat4(1.0), by));
}

}  // namespace

VoxelGrid unit_grid(const glm::ivec3& dims) {
  VoxelGrid grid;
  grid.dims = dims;
  return grid;
}

VoxelGrid grid_around(const TriangleSoup& mesh, int longest, int padding) {
  const Bounds box = bounds(mesh);
  const glm::dvec3 extent = box.high - box.low;
  const double size = std::max({extent.x, extent.y, extent.z}) / longest;
  VoxelGrid grid;
  grid.voxel_size = glm::dvec3(size);
  for (int i = 0; i < 3; ++i) {
    const int needed = std::clamp(static_cast<int>(std::ceil(extent[i] / size - 1e-9)), 1, longest);
    grid.dims[i] = needed + 2 * padding;
  }
  // Centred, so that no side is favoured.
  grid.origin = (box.low + box.high) * 0.5 - glm::dvec3(grid.dims) * (size * 0.5);
  return grid;
}

std::vector<NamedMesh> simple_solids() {
  std::vector<NamedMesh> solids;
  const auto add = [&](const char* name, const TriangleSoup& mesh) {
    solids.push_back({name, mesh});
  };
  add("box", make_box({-1, -1, -1}, {1, 1, 1}));
  add("flat box", make_box({0, 0, 0}, {3, 2, 0.02}));
  add("uv sphere", make_uv_sphere(1, 32, 16));
  add("icosphere", make_icosphere(1, 3));
  add("torus", make_torus(2, 0.7, 40, 20));
  add("cylinder", make_cylinder(1, 3, 24));
  add("cone", make_cone(1, 2, 25));
  add("knot", make_torus_knot(2, 3, 0.4, 160, 12));
  add("fine sphere", subdivide(make_icosphere(1, 5)));
  std::mt19937_64 random(20240);
  const std::size_t upright = solids.size();
  for (std::size_t i = 0; i < upright; ++i) {
    solids.push_back({"turned " + solids[i].name, randomly_rotated(solids[i].mesh, random)});
  }
  return solids;
}

std::vector<NamedMesh> closed_trouble() {
  std::vector<NamedMesh> meshes;
  std::mt19937_64 random(4711);
  // Corners on voxel centres only, on voxel corners only, on both, near both, anywhere.
  struct Raster {
    const char* name;
    int step, shift;
  };
  constexpr Raster kRasters[] = {{"centres", 256, 128}, {"corners", 256, 0}, {"halves", 128, 0},
                                 {"coarse", 1024, 128}, {"odd", 1, 0},       {"tenths", 26, 128}};
  for (const Raster& raster : kRasters) {
    const std::string name = raster.name;
    meshes.push_back({"tetrahedra on " + name,
                      random_tetrahedra(random, 60, raster.step, raster.shift, 24 * 256)});
    meshes.push_back({"few tetrahedra on " + name,
                      random_tetrahedra(random, 3, raster.step, raster.shift, 24 * 256)});
    meshes.push_back(
        {"crumpled sphere on " + name, crumpled_sphere(random, 3, raster.step, 24 * 256)});
    meshes.push_back({"bipyramid on " + name, random_bipyramid(random, 40, raster.step, 24 * 256)});
  }
  // Flat ones: many coplanar and edge-on triangles.
  meshes.push_back(
      {"tetrahedra in a cube of 4 steps", random_tetrahedra(random, 400, 1, 128, 132)});
  TriangleSoup flat = random_tetrahedra(random, 60, 128, 0, 24 * 256);
  for (auto& p : flat.positions) p.z = std::floor(p.z / 8) * 8 + 0.5;
  meshes.push_back({"tetrahedra pressed on planes of voxel centres", flat});
  TriangleSoup lines = random_tetrahedra(random, 60, 128, 0, 24 * 256);
  for (auto& p : lines.positions) p.z = p.x, p.y = std::floor(p.y);
  meshes.push_back({"tetrahedra pressed on a slanted plane", lines});
  // Half in, half out of the grid, on every side.
  TriangleSoup outside = random_tetrahedra(random, 60, 64, 0, 60 * 256);
  for (auto& p : outside.positions) p -= glm::dvec3(18);
  meshes.push_back({"tetrahedra that leave the grid", outside});
  TriangleSoup far = random_tetrahedra(random, 30, 1, 0, 1 << 27);
  for (auto& p : far.positions) p -= glm::dvec3(1 << 18);
  meshes.push_back({"huge tetrahedra", far});

  // Touching, coinciding and nested boxes.
  TriangleSoup boxes = make_box({2, 2, 2}, {10, 10, 10});
  append(boxes, make_box({10, 2, 2}, {18, 10, 10}));          // a shared face
  append(boxes, make_box({10, 10, 2}, {18, 18, 10}));         // a shared edge with the first
  append(boxes, make_box({10, 10, 10}, {18, 18, 18}));        // a shared corner with the first
  append(boxes, make_box({2, 2, 2}, {10, 10, 10}));           // the first once more
  append(boxes, make_box({4.5, 4.5, 4.5}, {7.5, 7.5, 7.5}));  // faces on voxel centres
  meshes.push_back({"boxes that touch", boxes});
  TriangleSoup cavity = make_box({2.5, 2.5, 2.5}, {20.5, 20.5, 20.5});
  TriangleSoup inner = make_box({5.5, 5.5, 5.5}, {17.5, 17.5, 17.5});
  reverse_orientation(inner);
  append(cavity, inner);
  append(cavity, make_box({9.5, 9.5, 9.5}, {12.5, 12.5, 12.5}));
  meshes.push_back({"box with a cavity and a core, all on centres", cavity});
  TriangleSoup inside_out = moved(make_uv_sphere(8.3, 16, 12), glm::dvec3(12.1, 11.9, 12.0));
  reverse_orientation(inside_out);
  meshes.push_back({"sphere inside out", inside_out});
  TriangleSoup cancelled = moved(make_torus(6, 2, 20, 12), glm::dvec3(12));
  TriangleSoup opposite = cancelled;
  reverse_orientation(opposite);
  append(cancelled, opposite);
  meshes.push_back({"a torus and its opposite", cancelled});
  // A square fin is closed by its own back.
  TriangleSoup fin;
  fin.positions = {{3, 3, 3}, {20, 3, 5}, {20, 20, 9.5}, {3, 20, 12}};
  fin.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 2, 1}, {0, 3, 2}};
  meshes.push_back({"a fin and its back", fin});
  // The same with the other diagonal on its back: a tetrahedron, and flat where the four agree.
  fin.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
  meshes.push_back({"a thin tetrahedron", fin});
  std::mt19937_64 voxels(99);
  const VoxelGrid grid = unit_grid({14, 13, 12});
  meshes.push_back(
      {"random voxels",
       boundary_mesh(set_of(grid.dims, [&](const glm::ivec3&) { return voxels() % 2 == 0; }), grid,
                     voxels)});
  return meshes;
}

TriangleSoup random_tetrahedra(std::mt19937_64& random, int count, int step, int shift,
                               int extent) {
  TriangleSoup mesh;
  for (int i = 0; i < count; ++i) {
    const auto first = static_cast<unsigned>(mesh.positions.size());
    for (int corner = 0; corner < 4; ++corner) {
      mesh.positions.push_back(at_lattice(random_point(random, step, shift, extent)));
    }
    constexpr unsigned kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    for (const auto& f : kFaces) {
      mesh.triangles.emplace_back(first + f[0], first + f[1], first + f[2]);
    }
  }
  return mesh;
}

TriangleSoup crumpled_sphere(std::mt19937_64& random, int subdivisions, int step, int extent) {
  TriangleSoup mesh = make_icosphere(1, subdivisions);
  const double half = extent / 2.0;
  for (auto& p : mesh.positions) {
    const double radius = std::uniform_real_distribution<double>(0.2, 0.9)(random);
    const glm::dvec3 steps = (p * (radius * half) + half) / static_cast<double>(step);
    p = glm::dvec3(std::floor(steps.x), std::floor(steps.y), std::floor(steps.z)) * (step / 256.0);
  }
  return mesh;
}

TriangleSoup random_bipyramid(std::mt19937_64& random, int corners, int step, int extent) {
  TriangleSoup mesh;
  for (int i = 0; i < corners + 2; ++i) {
    mesh.positions.push_back(at_lattice(random_point(random, step, 0, extent)));
  }
  const auto n = static_cast<unsigned>(corners);
  for (unsigned i = 0; i < n; ++i) {
    mesh.triangles.emplace_back(i, (i + 1) % n, n);
    mesh.triangles.emplace_back((i + 1) % n, i, n + 1);
  }
  return mesh;
}

TriangleSoup boundary_mesh(const VoxelSet& set, const VoxelGrid& grid, std::mt19937_64& random) {
  TriangleSoup mesh;
  std::map<std::tuple<int, int, int>, unsigned> indices;
  const auto vertex = [&](const glm::ivec3& p) {
    const auto [found, added] =
        indices.try_emplace({p.x, p.y, p.z}, static_cast<unsigned>(mesh.positions.size()));
    if (added) mesh.positions.push_back(grid.origin + glm::dvec3(p) * grid.voxel_size);
    return found->second;
  };
  set.for_each([&](const glm::ivec3& p) {
    if (!set.solid(p)) return;
    for (int axis = 0; axis < 3; ++axis) {
      for (int side = 0; side < 2; ++side) {
        glm::ivec3 step{};
        step[axis] = side == 0 ? -1 : 1;
        if (set.solid(p + step)) continue;
        glm::ivec3 a = p, du{}, dv{};
        a[axis] += side;
        du[(axis + 1) % 3] = 1, dv[(axis + 2) % 3] = 1;
        std::array<unsigned, 4> quad = {vertex(a), vertex(a + du), vertex(a + du + dv),
                                        vertex(a + dv)};
        if (side == 0) std::swap(quad[1], quad[3]);
        const auto turn = static_cast<std::ptrdiff_t>(random() % 4);
        std::rotate(quad.begin(), quad.begin() + turn, quad.end());
        mesh.triangles.emplace_back(quad[0], quad[1], quad[2]);
        mesh.triangles.emplace_back(quad[0], quad[2], quad[3]);
      }
    }
  });
  return mesh;
}

void shuffle(TriangleSoup& mesh, std::mt19937_64& random) {
  std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
  for (auto& t : mesh.triangles) {
    const auto turn = random() % 3;
    if (turn == 1) t = {t.y, t.z, t.x};
    if (turn == 2) t = {t.z, t.x, t.y};
  }
}

TriangleSoup randomly_rotated(const TriangleSoup& mesh, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const glm::dquat q(normal(random), normal(random), normal(random), normal(random));
  return transform(mesh, glm::mat4_cast(glm::normalize(q)));
}

}  // namespace strata::testkit
