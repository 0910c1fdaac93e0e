// Open meshes: the generalized winding number decides, and holes of solids are closed.

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <optional>
#include <random>
#include <string>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "tests/support/simd_targets.h"
#include "tests/support/trouble.h"
#include "tests/support/voxelized.h"

namespace strata {
namespace {

using namespace testkit;  // NOLINT: the tests' own vocabulary

/// The set of an open mesh, which may not depend on the axis or the number of threads.
VoxelSet voted(const TriangleSoup& mesh, const VoxelGrid& grid,
               InsideRule rule = InsideRule::kWinding) {
  EXPECT_FALSE(is_closed(mesh));
  const VoxelSet first =
      voxel_set(mesh, grid, {.rule = rule, .closedness = Closedness::kAssumeOpen});
  for (const Axis axis : kAllAxes) {
    const int threads = 2 + static_cast<int>(axis);
    const VoxelSet other = set_of(
        voxelized(mesh, grid, {.rule = rule, .axis = axis, .closedness = Closedness::kAssumeOpen},
                  {.threads = threads}));
    EXPECT_EQ(other, first) << "axis " << static_cast<int>(axis);
  }
  return first;
}

/// Takes every triangle away with this probability.
TriangleSoup with_holes(TriangleSoup mesh, double share, std::mt19937_64& random) {
  std::uniform_real_distribution<double> chance(0, 1);
  std::erase_if(mesh.triangles, [&](const glm::uvec3&) { return chance(random) < share; });
  return mesh;
}

/// No two triangles share a vertex, and each vertex is off by up to `gap` along each axis.
TriangleSoup torn(const TriangleSoup& mesh, double gap, std::mt19937_64& random) {
  std::uniform_real_distribution<double> off(-gap, gap);
  TriangleSoup result;
  for (const glm::uvec3& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(result.positions.size());
    for (int i = 0; i < 3; ++i) {
      result.positions.push_back(mesh.positions[t[i]] +
                                 glm::dvec3(off(random), off(random), off(random)));
    }
    result.triangles.emplace_back(first, first + 1, first + 2);
  }
  return result;
}

TriangleSoup moved(TriangleSoup mesh, const glm::dvec3& by) {
  for (auto& p : mesh.positions) p += by;
  return mesh;
}

/// A rectangular sheet of n x n cells over the unit square of `u` and `v`, bent by `bend`.
TriangleSoup sheet(const glm::dvec3& corner, const glm::dvec3& u, const glm::dvec3& v,
                   const glm::dvec3& bend, std::uint32_t n) {
  TriangleSoup result;
  for (std::uint32_t j = 0; j <= n; ++j) {
    for (std::uint32_t i = 0; i <= n; ++i) {
      const double s = static_cast<double>(i) / n, t = static_cast<double>(j) / n;
      result.positions.push_back(corner + s * u + t * v + bend * std::sin(7 * s) * std::cos(6 * t));
      if (i == n || j == n) continue;
      const std::uint32_t at = j * (n + 1) + i;
      result.triangles.emplace_back(at, at + 1, at + n + 2);
      result.triangles.emplace_back(at, at + n + 2, at + n + 1);
    }
  }
  return result;
}

/// The winding number at a voxel's centre, triangle by triangle with the library's arc tangent;
/// none where it lies on a triangle.
std::optional<double> winding_number(const TriangleSoup& mesh, const VoxelGrid& grid,
                                     const glm::ivec3& voxel) {
  const glm::dvec3 p = grid.origin + (glm::dvec3(voxel) + 0.5) * grid.voxel_size;
  double angle = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a = mesh.positions[t.x] - p, b = mesh.positions[t.y] - p,
                     c = mesh.positions[t.z] - p;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    const double volume = glm::dot(a, glm::cross(b, c));
    const double rest =
        la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb;
    if (std::abs(volume) < 1e-9 && rest <= 0) return std::nullopt;
    angle += 2 * std::atan2(volume, rest);
  }
  return angle / (4 * std::numbers::pi);
}

/// Expects what the winding numbers of all voxels say, but where they are within `slack` of a half.
/// @param faces  flat ones that are missing, which count as if they were there
/// @return voxels compared that are solid
std::int64_t expect_winding_numbers(TriangleSoup mesh, const VoxelGrid& grid, double slack,
                                    const TriangleSoup& faces = {}) {
  TriangleSoup whole = mesh;
  append(whole, faces);
  for (TriangleSoup* each : {&mesh, &whole}) {
    for (auto& p : each->positions) {  // to the lattice, as the law says
      const glm::dvec3 steps = glm::floor((p - grid.origin) / grid.voxel_size * 256.0 + 0.5);
      p = grid.origin + steps / 256.0 * grid.voxel_size;
    }
  }
  const VoxelSet solid = voted(mesh, grid), nonzero = voted(mesh, grid, InsideRule::kNonzero),
                 odd = voted(mesh, grid, InsideRule::kParity);
  std::int64_t wrong = 0, close = 0, inside = 0;
  solid.for_each([&](const glm::ivec3& p) {
    const std::optional<double> w = winding_number(whole, grid, p);
    const double number = std::floor(w.value_or(0) + 0.5);
    if (!w || std::abs(*w - number) > 0.5 - slack) {
      ++close;
      return;
    }
    inside += number > 0;
    const bool differs = solid.solid(p) != (number > 0) || nonzero.solid(p) != (number != 0) ||
                         odd.solid(p) != (std::fmod(std::abs(number), 2) == 1);
    wrong += differs;
    if (differs && wrong == 1)
      ADD_FAILURE() << "voxel " << p.x << " " << p.y << " " << p.z << ": " << *w;
  });
  EXPECT_EQ(wrong, 0);
  EXPECT_LT(close, static_cast<std::int64_t>(solid.values().size()) / 10);
  return inside;
}

TEST(LooseTriangle, CutsNoSlit) {
  const TriangleSoup box = make_box({4, 4, 4}, {44, 28, 20});
  const VoxelGrid grid = unit_grid({60, 40, 32});
  const VoxelSet whole = voxel_set(box, grid);
  ASSERT_EQ(count(whole), 40 * 24 * 16);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> x(0, 60), y(0, 40), z(0, 32);
  const auto loose = [&](double size, bool on_centres) {
    std::uniform_real_distribution<double> off(-size, size);
    TriangleSoup result;
    const glm::dvec3 middle(x(random), y(random), z(random));
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 p = middle + glm::dvec3(off(random), off(random), off(random));
      result.positions.push_back(on_centres ? glm::floor(p) + 0.5 : p);  // rays and triangle tie
    }
    result.triangles.emplace_back(0, 1, 2);
    return result;
  };
  for (int round = 0; round < 40; ++round) {
    TriangleSoup mesh = box;
    append(mesh, loose(3.0 + round, round % 2 == 1));
    EXPECT_EQ(voted(mesh, grid), whole) << "round " << round;
    EXPECT_EQ(voted(mesh, grid, InsideRule::kNonzero), whole) << "round " << round;
  }
  // Many small ones. Where two cross, half of each may add up to one.
  TriangleSoup mesh = box;
  for (int i = 0; i < 40; ++i) append(mesh, loose(5, i % 2 == 1));
  EXPECT_LE(differences(voted(mesh, grid), whole), count(whole) / 500);
}

TEST(LooseSheet, IsNoSolidAndCutsNone) {
  const TriangleSoup ball = moved(make_icosphere(14, 4), {24, 24, 24});
  const VoxelGrid grid = unit_grid({48, 48, 48});
  const VoxelSet whole = voxel_set(ball, grid);
  // Flat ones, axis-parallel on voxel centres and slanted.
  for (const glm::dvec3& slope : {glm::dvec3(0), glm::dvec3(0, 0, 13.3)}) {
    TriangleSoup mesh = ball;
    append(mesh, sheet({1.5, 1.5, 20.5}, glm::dvec3(44, 0, 0) + slope, {0, 44, 0}, {}, 20));
    EXPECT_EQ(differences(voted(mesh, grid), whole), 0) << slope.z;
  }
  // A bumpy one may be solid in its dents, but takes nothing away that is not close to it.
  TriangleSoup mesh = ball;
  append(mesh, sheet({1.5, 1.5, 20.5}, {44, 0, 0}, {0, 44, 0}, {0, 0, 3}, 20));
  const VoxelSet found = voted(mesh, grid);
  std::int64_t far = 0;
  found.for_each([&](const glm::ivec3& p) {
    far += std::abs(p.z - 20) > 4 && found.solid(p) != whole.solid(p);
  });
  EXPECT_EQ(far, 0);
}

TEST(Holes, OfFlatFacesAreClosedFlat) {
  // On voxel centres, so that every centre of the lid is a tie, and off them.
  for (const double shift : {0.0, 0.5, 0.3}) {
    const TriangleSoup box = moved(make_box({4, 4, 4}, {24, 20, 18}), glm::dvec3(shift));
    const VoxelGrid grid = unit_grid({28, 28, 28});
    const VoxelSet whole = voxel_set(box, grid);
    for (std::size_t face = 0; face < 12; ++face) {
      TriangleSoup open = box;
      open.triangles.erase(open.triangles.begin() + static_cast<std::ptrdiff_t>(face));
      EXPECT_EQ(voted(open, grid), whole) << "without triangle " << face;
      if (face % 2 == 1) continue;
      open.triangles.erase(open.triangles.begin() + static_cast<std::ptrdiff_t>(face));
      EXPECT_EQ(voted(open, grid), whole) << "without the side of triangle " << face;
    }
  }
  // A tube without its ends, both turned.
  std::mt19937_64 random(3);
  const TriangleSoup tube =
      moved(randomly_rotated(make_cylinder(9, 26, 40), random), glm::dvec3(20));
  TriangleSoup open = tube;
  const VoxelGrid grid = unit_grid({40, 40, 40});
  std::erase_if(open.triangles, [&](const glm::uvec3& t) {
    const glm::dvec3 n = glm::normalize(glm::cross(open.positions[t.y] - open.positions[t.x],
                                                   open.positions[t.z] - open.positions[t.x]));
    const glm::dvec3 middle =
        (open.positions[t.x] + open.positions[t.y] + open.positions[t.z]) / 3.0;
    return std::abs(glm::dot(n, middle - glm::dvec3(20))) > 12.9;
  });
  ASSERT_LT(open.triangles.size(), tube.triangles.size());
  EXPECT_LE(differences(voted(open, grid), voxel_set(tube, grid)), 2);  // the lattice's rounding
}

TEST(Scan, WithManyTrianglesMissingIsTheClosedOne) {
  std::mt19937_64 random(10);
  TriangleSoup overlapping = moved(make_icosphere(15, 4), {20, 26, 26});
  append(overlapping, moved(make_icosphere(13, 4), {34, 26, 24}));
  const NamedMesh solids[] = {
      {"ball", moved(make_icosphere(22, 4), glm::dvec3(26))},
      {"ring", moved(randomly_rotated(make_torus(15, 7, 90, 40), random), glm::dvec3(26))},
      {"knot", moved(make_torus_knot(2, 3, 4, 300, 24), glm::dvec3(26))},
      {"overlapping balls", overlapping},
  };
  const VoxelGrid grid = unit_grid({52, 52, 52});
  for (const auto& [name, closed] : solids) {
    const VoxelSet whole = voxel_set(closed, grid);
    const auto voxels = static_cast<double>(count(whole));
    ASSERT_GT(voxels, 1000);
    for (const double share : {0.01, 0.03, 0.1, 0.2, 0.3}) {
      SCOPED_TRACE(name + ", " + std::to_string(share));
      const TriangleSoup open = with_holes(closed, share, random);
      const VoxelSet found = voted(open, grid);
      EXPECT_NEAR(static_cast<double>(count(found)), voxels,
                  share <= 0.1 ? 0.002 * voxels : 0.01 * voxels);
      EXPECT_LE(static_cast<double>(differences(found, whole)), 0.1 * share * voxels + 2);
      TriangleSoup other = open;
      shuffle(other, random);
      EXPECT_EQ(voxel_set(other, grid, {.closedness = Closedness::kAssumeOpen}), found)
          << "in another order";
    }
  }
}

TEST(Scan, OfTornTrianglesFollowsTheirWindingNumbers) {
  std::mt19937_64 random(20);
  const TriangleSoup ball = moved(make_icosphere(9, 3), glm::dvec3(12));
  const VoxelGrid grid = unit_grid({24, 24, 24});
  const auto voxels = static_cast<double>(count(voxel_set(ball, grid)));
  for (const double gap : {0.01, 0.1, 0.4}) {
    const TriangleSoup open = torn(ball, gap, random);
    const auto inside = static_cast<double>(expect_winding_numbers(open, grid, 0.02));
    EXPECT_NEAR(inside, voxels, 0.1 * voxels) << gap;
  }
}

TEST(WindingNumbers, DecideOnWhatIsHardlyClosed) {
  std::mt19937_64 random(30);
  // Voxels that are no cubes: angles are those of the world.
  VoxelGrid grid = unit_grid({20, 24, 16});
  grid.voxel_size = {1.2, 1.0, 1.5};
  std::uniform_real_distribution<double> in(2, 22);
  std::int64_t inside = 0;
  for (int round = 0; round < 6; ++round) {
    SCOPED_TRACE(round);
    TriangleSoup mesh;  // loose triangles, large and small, on the lattice of the grid
    for (int i = 0; i < 20 + 40 * round; ++i) {
      const glm::dvec3 middle(in(random), in(random), in(random));
      std::uniform_real_distribution<double> off(-2.0 - round, 2.0 + round);
      for (int k = 0; k < 3; ++k) {
        const glm::dvec3 p = middle + glm::dvec3(off(random), off(random), off(random));
        mesh.positions.push_back(glm::round(p / grid.voxel_size * 256.0) / 256.0 * grid.voxel_size);
      }
      const auto first = static_cast<std::uint32_t>(3 * i);
      mesh.triangles.emplace_back(first, first + 1, first + 2);
    }
    inside += expect_winding_numbers(mesh, grid, 0.03);
  }
  // Half a ball, cut along a wave: a large hole that is not flat.
  TriangleSoup bowl = moved(make_icosphere(9.5, 4), {12, 12, 12});
  std::erase_if(bowl.triangles, [&](const glm::uvec3& t) {
    const glm::dvec3 p = bowl.positions[t.x];
    return p.z > 13 + 4 * std::sin(p.x / 2);
  });
  inside += expect_winding_numbers(bowl, grid, 0.02);
  EXPECT_GT(inside, 500);
}

/// A box without one of its faces, which may be inside out.
struct OpenBox {
  TriangleSoup mesh, missing;
};
OpenBox open_box(std::mt19937_64& random, double side) {
  std::uniform_real_distribution<double> low(1, side / 2), size(3, side / 2 - 1);
  const glm::dvec3 from(low(random), low(random), low(random));
  OpenBox box{make_box(from, from + glm::dvec3(size(random), size(random), size(random))), {}};
  if (random() % 3 == 0) {
    for (auto& t : box.mesh.triangles) std::swap(t.y, t.z);
  }
  const int axis = static_cast<int>(random() % 3);
  const double plane = box.mesh.positions[random() % 8][axis];
  box.missing.positions = box.mesh.positions;
  std::erase_if(box.mesh.triangles, [&](const glm::uvec3& t) {
    for (int i = 0; i < 3; ++i) {
      if (box.mesh.positions[t[i]][axis] != plane) return false;
    }
    box.missing.triangles.push_back(t);
    return true;
  });
  return box;
}

TEST(WindingNumbers, DecideOnRandomMixturesOfOpenMeshes) {
  std::int64_t inside = 0;
  for (unsigned seed = 0; seed < 12; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    constexpr double kSide = 18;
    VoxelGrid grid = unit_grid({18, 18, 18});
    if (seed % 2 == 1) {
      grid = unit_grid({15, 18, 12});
      grid.voxel_size = {1.2, 1.0, 1.5};
    }
    std::uniform_real_distribution<double> in(3, kSide - 3), size(3, 7), wave(1, 3);
    TriangleSoup mesh, missing;
    for (int i = static_cast<int>(random() % 3); i >= 0; --i) {
      const OpenBox box = open_box(random, kSide);
      append(mesh, box.mesh);
      append(missing, box.missing);
    }
    for (int i = static_cast<int>(random() % 3); i > 0; --i) {  // bowls with a bent rim
      TriangleSoup bowl = make_icosphere(size(random), 2);
      const double high = wave(random);
      std::erase_if(bowl.triangles, [&](const glm::uvec3& t) {
        const glm::dvec3 p = bowl.positions[t.x];
        return p.z > high * std::sin(p.x);
      });
      append(mesh, moved(bowl, {in(random), in(random), in(random)}));
    }
    for (int i = static_cast<int>(random() % 30); i > 0; --i) {  // loose triangles
      const glm::dvec3 middle(in(random), in(random), in(random));
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      for (int k = 0; k < 3; ++k) {
        mesh.positions.push_back(middle + glm::dvec3(wave(random), wave(random), wave(random)));
      }
      mesh.triangles.emplace_back(first, first + 1, first + 2);
    }
    if (random() % 2 == 0) {
      append(mesh, sheet({1, 1, in(random)}, {15, 0, 3}, {0, 15, 1}, {0, 0, wave(random)}, 5));
    }
    inside += expect_winding_numbers(mesh, grid, 0.03, missing);
  }
  EXPECT_GT(inside, 2000);
}

TEST(WindingNumbers, OfTurnedTrianglesAreMended) {
  // Each turned triangle is closed twice over, which turns it around.
  std::mt19937_64 random(40);
  const TriangleSoup ball = moved(make_icosphere(15, 4), glm::dvec3(16));
  const VoxelGrid grid = unit_grid({32, 32, 32});
  TriangleSoup mesh = ball;
  for (auto& t : mesh.triangles) {
    if (random() % 20 == 0) std::swap(t.y, t.z);
  }
  const VoxelSet whole = voxel_set(ball, grid);
  EXPECT_LE(differences(voted(mesh, grid), whole), count(whole) / 200);
}

TEST(WindingNumbers, AreTheSameBitsOnEverySimdUnit) {
  std::mt19937_64 random(50);
  TriangleSoup mesh = torn(moved(make_icosphere(9, 3), glm::dvec3(12)), 0.3, random);
  append(mesh, sheet({1, 1, 9}, {21, 0, 3}, {0, 21, 5}, {0, 0, 4}, 9));
  const VoxelGrid grid = unit_grid({24, 24, 24});
  const VoxelSet expected = voted(mesh, grid);
  EXPECT_GT(count(expected), 1000);
  EXPECT_GT(for_each_simd_target([&](const std::string& name) {
              EXPECT_EQ(voxel_set(mesh, grid, {.closedness = Closedness::kAssumeOpen}), expected)
                  << name;
            }),
            1);
}

TEST(OpenMesh, ReportsItsOwnCrossingsAndColumns) {
  TriangleSoup box = make_box({2, 2, 2}, {12, 10, 8});
  const VoxelGrid grid = unit_grid({16, 16, 16});
  // Without the triangles that look along +z: 80 columns are entered and never left.
  std::erase_if(box.triangles, [&](const glm::uvec3& t) {
    return box.positions[t.x].z == 8 && box.positions[t.y].z == 8 && box.positions[t.z].z == 8;
  });
  ASSERT_EQ(box.triangles.size(), 10u);
  VoxelizeReport report;
  const VoxelIntervals found =
      voxelized(box, grid, {.closedness = Closedness::kAssumeOpen}, {}, &report);
  EXPECT_EQ(found.solid_voxels(), 480u);
  EXPECT_EQ(report.crossings, 80u);
  EXPECT_EQ(report.unbalanced_columns, 80u);
  voxelized(box, grid, {.axis = Axis::kX, .closedness = Closedness::kAssumeOpen}, {}, &report);
  EXPECT_EQ(report.crossings, 2u * 48);
  EXPECT_EQ(report.unbalanced_columns, 0u);
}

}  // namespace
}  // namespace strata
