#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <memory>
#include <random>

#include "strata/voxelize/picture/voxel_picture.h"
#include "tests/support/predicate_intervals.h"

namespace strata {
namespace {

using Solid = std::function<bool(int, int, int)>;

/// A ray of a view, found by undoing the view's matrix.
struct Line {
  glm::dvec3 from, direction;  ///< in the world; `direction` goes one unit along the view axis
  double begin, end = INFINITY;
};

Line line_through(const View& view, const glm::dvec2& at) {
  // Two points of the ray: depth counts from 0 to 2^24.
  const glm::dmat4 world = glm::inverse(view.image_from_world);
  const auto point = [&](double depth) {
    const glm::dvec4 p = world * glm::dvec4(at, depth, 1.0);
    return glm::dvec3(p) / p.w;
  };
  const glm::dvec3 near = point(0), far = point(double(kPictureDepthLimit));
  const auto away = [&](const glm::dvec3& p) {
    return -(view.eye_from_world * glm::dvec4(p, 1.0)).z;
  };
  Line line;
  line.direction = (far - near) / (away(far) - away(near));
  line.from = near - line.direction * away(near);
  line.begin = view.perspective ? 0.0 : -INFINITY;
  return line;
}

/// A voxel of a ray.
struct Piece {
  glm::ivec3 voxel;
  double in, out;
  int axis, side;  ///< of the face that the ray comes through
  bool solid;
};

/// All voxels of a ray in the order it meets them, by asking each voxel of the grid.
std::vector<Piece> pieces(const VoxelGrid& grid, const Solid& solid, const Line& line) {
  std::vector<Piece> found;
  for (int k = 0; k < grid.dims.z; ++k) {
    for (int j = 0; j < grid.dims.y; ++j) {
      for (int i = 0; i < grid.dims.x; ++i) {
        Piece piece{{i, j, k}, -INFINITY, INFINITY, 0, 0, solid(i, j, k)};
        for (int a = 0; a < 3; ++a) {
          const double low = grid.origin[a] + piece.voxel[a] * grid.voxel_size[a];
          double in = (low - line.from[a]) / line.direction[a];
          double out = (low + grid.voxel_size[a] - line.from[a]) / line.direction[a];
          const bool backwards = in > out;
          if (backwards) std::swap(in, out);
          if (in > piece.in) piece.in = in, piece.axis = a, piece.side = backwards ? 1 : -1;
          piece.out = std::min(piece.out, out);
        }
        if (piece.in < piece.out && piece.out > line.begin) found.push_back(piece);
      }
    }
  }
  std::sort(found.begin(), found.end(), [](const Piece& a, const Piece& b) { return a.in < b.in; });
  return found;
}

/// Cuts a line by sections; gives the section at its begin or -1.
int cut(Line& line, const std::vector<VoxelSection>& sections) {
  int first = -1;
  for (std::size_t i = 0; i < sections.size(); ++i) {
    const double at = (sections[i].offset - glm::dot(sections[i].normal, line.from)) /
                      glm::dot(sections[i].normal, line.direction);
    if (glm::dot(sections[i].normal, line.direction) > 0) {
      line.end = std::min(line.end, at);
    } else if (at > line.begin) {
      line.begin = at;
      first = static_cast<int>(i);
    }
  }
  return first;
}

/// What a ray sees, by the definition.
std::optional<VoxelPick> expected(const VoxelGrid& grid, const Solid& solid, Line line,
                                  const std::vector<VoxelSection>& sections) {
  const int section = cut(line, sections);
  if (line.begin >= line.end) return std::nullopt;
  bool from_inside = section < 0;
  double until = line.begin;
  for (const Piece& piece : pieces(grid, solid, line)) {
    if (piece.out <= line.begin + 1e-9) continue;
    if (piece.in >= line.end - 1e-9) break;
    const bool starts = piece.in <= line.begin + 1e-9;
    if (starts && section >= 0 && piece.solid) {
      VoxelPick pick{piece.voxel, -1, 1, section, 1, line.begin, {}};
      return pick;
    }
    if (from_inside) {
      from_inside = piece.solid && (starts || std::abs(piece.in - until) < 1e-9);
      until = piece.out;
      if (from_inside) continue;
    }
    if (piece.solid) return VoxelPick{piece.voxel, piece.axis, piece.side, -1, 1, piece.in, {}};
  }
  return std::nullopt;
}

struct Setting {
  VoxelGrid grid;
  Solid solid;
  std::string name;
};

Setting random_setting(std::mt19937& random) {
  const auto number = [&](int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random);
  };
  Setting setting;
  setting.grid.dims = {number(1, 21), number(1, 21), number(1, 21)};
  setting.grid.origin = {number(-9, 9) * 0.37, number(-9, 9) * 0.41, number(-9, 9) * 0.29};
  setting.grid.voxel_size = {0.1 * number(1, 9), 0.1 * number(1, 9), 0.1 * number(1, 9)};
  const auto seed = static_cast<unsigned>(random());
  const int coarse = number(1, 5), share = number(1, 9);
  setting.solid = [seed, coarse, share](int i, int j, int k) {
    std::uint32_t x = seed;
    for (const int n : {i / coarse, j / coarse, k / coarse}) {
      x = (x ^ static_cast<std::uint32_t>(n + 1)) * 0x9e3779b1u;
      x ^= x >> 15;
    }
    return x % 10 < static_cast<unsigned>(share);
  };
  return setting;
}

Camera random_camera(std::mt19937& random, const VoxelGrid& grid) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Camera camera;
  const glm::dvec3 side = glm::dvec3(grid.dims) * grid.voxel_size;
  camera.target = grid.origin + side * glm::dvec3(unit(random), unit(random), unit(random));
  camera.rotation = {360 * unit(random), 360 * unit(random), 360 * unit(random)};
  camera.distance = glm::length(side) * (unit(random) < 0.4 ? 0.3 * unit(random) + 0.001 : 2.0);
  camera.field_of_view = 10 + 100 * unit(random);
  if (unit(random) < 0.3) camera.projection = Projection::kOrthographic;
  return camera;
}

std::vector<VoxelSection> random_sections(std::mt19937& random, const VoxelGrid& grid) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<VoxelSection> sections;
  const int count = std::uniform_int_distribution<int>(0, 3)(random);
  for (int i = 0; i < count; ++i) {
    VoxelSection section;
    const int kind = std::uniform_int_distribution<int>(0, 2)(random);
    const int axis = std::uniform_int_distribution<int>(0, 2)(random);
    const glm::dvec3 side = glm::dvec3(grid.dims) * grid.voxel_size;
    glm::dvec3 point = grid.origin + side * glm::dvec3(unit(random), unit(random), unit(random));
    if (kind == 0) {  // slanted
      section.normal = {unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5};
    } else {
      section.normal[axis] = unit(random) < 0.5 ? 1 : -2.5;
      if (kind == 1 && grid.dims[axis] > 1) {  // between two layers
        const int layer = std::uniform_int_distribution<int>(1, grid.dims[axis] - 1)(random);
        point[axis] = grid.origin[axis] + layer * grid.voxel_size[axis];
      }
    }
    section.offset = glm::dot(section.normal, point);
    sections.push_back(section);
  }
  return sections;
}

VoxelPicture drawn(const Setting& setting, Axis axis) {
  auto picture = VoxelPicture::create(std::make_shared<VoxelIntervals>(
      intervals_from_predicate(setting.grid, axis, setting.solid)));
  EXPECT_TRUE(picture.has_value());
  return *std::move(picture);
}

/// A random set, its picture by intervals along each axis in turn, and a view of it.
struct Shot {
  Setting setting;
  VoxelPictureOptions options;
  VoxelPicture picture;
  Result<View> view;
};
Shot random_shot(std::mt19937& random, int round, const glm::ivec2& size) {
  Setting setting = random_setting(random);
  const VoxelGrid& grid = setting.grid;
  const Camera camera = random_camera(random, grid);
  VoxelPictureOptions options;
  options.sections = random_sections(random, grid);
  VoxelPicture picture = drawn(setting, static_cast<Axis>(round % 3));
  const Bounds whole{grid.origin, grid.origin + glm::dvec3(grid.dims) * grid.voxel_size};
  auto view = make_view(camera, size, whole);
  return {std::move(setting), std::move(options), std::move(picture), std::move(view)};
}

TEST(VoxelRays, EachPixelShowsTheVoxelAndFaceThatTryingAllVoxelsFinds) {
  std::mt19937 random(20261129);
  const glm::ivec2 size(12, 9);
  int seen = 0, cuts = 0, nothing = 0;
  for (int round = 0; round < 150; ++round) {
    const auto [setting, options, picture, view] = random_shot(random, round, size);
    ASSERT_TRUE(view.has_value());
    for (int v = 0; v < size.y; ++v) {
      for (int u = 0; u < size.x; ++u) {
        const glm::dvec2 at(u + 0.5, v + 0.5);
        const auto pick = picture.pick(*view, at, options);
        const auto wanted =
            expected(setting.grid, setting.solid, line_through(*view, at), options.sections);
        const std::string where = "round " + std::to_string(round) + " pixel " + std::to_string(u) +
                                  " " + std::to_string(v);
        ASSERT_EQ(pick.has_value(), wanted.has_value()) << where;
        if (!pick) {
          ++nothing;
          continue;
        }
        ++seen;
        ASSERT_EQ(pick->voxel, wanted->voxel) << where;
        ASSERT_EQ(pick->axis, wanted->axis) << where;
        ASSERT_EQ(pick->section, wanted->section) << where;
        if (pick->axis >= 0) {
          ASSERT_EQ(pick->side, wanted->side) << where;
        } else {
          ++cuts;
        }
        ASSERT_NEAR(pick->distance, wanted->distance, 1e-7) << where;
      }
    }
  }
  EXPECT_GT(seen, 1500);
  EXPECT_GT(cuts, 100);
  EXPECT_GT(nothing, 2000);
}

TEST(VoxelRays, SolidLengthIsTheSumOverAllVoxels) {
  std::mt19937 random(7);
  const glm::ivec2 size(10, 8);
  double total = 0.0;
  for (int round = 0; round < 120; ++round) {
    const auto [setting, options, picture, view] = random_shot(random, round, size);
    ASSERT_TRUE(view.has_value());
    for (int v = 0; v < size.y; ++v) {
      for (int u = 0; u < size.x; ++u) {
        const glm::dvec2 at(u + 0.5, v + 0.5);
        Line line = line_through(*view, at);
        cut(line, options.sections);
        double sum = 0.0;
        for (const Piece& piece : pieces(setting.grid, setting.solid, line)) {
          if (!piece.solid) continue;
          sum += std::max(0.0, std::min(piece.out, line.end) - std::max(piece.in, line.begin));
        }
        sum *= glm::length(line.direction);
        ASSERT_NEAR(picture.solid_length(*view, at, options), sum, 1e-6 * (1 + sum))
            << "round " << round << " pixel " << u << " " << v;
        total += sum;
      }
    }
  }
  EXPECT_GT(total, 1000.0);
}

TEST(VoxelRays, RaysAlongBordersOfVoxelsSeeTheSameForEveryAxis) {
  // A camera of whole numbers: every ray runs in a plane between voxels, or along one.
  Setting setting;
  setting.grid.dims = {16, 16, 16};
  setting.solid = [](int i, int j, int k) { return (i * 7 + j * 3 + k * 5) % 11 < 4; };
  int seen = 0;
  for (const glm::dvec3 rotation :
       {glm::dvec3(0, 0, 0), glm::dvec3(90, 0, 0), glm::dvec3(90, 0, 90), glm::dvec3(45, 0, 45),
        glm::dvec3(90, 0, 45), glm::dvec3(180, 0, 0)}) {
    Camera camera;
    camera.projection = Projection::kOrthographic;
    camera.target = {8, 8, 8};
    camera.rotation = rotation;
    camera.distance = 10 / std::tan(22.5 / 2 * 3.14159265358979 / 180);
    const VoxelPicture x = drawn(setting, Axis::kX), y = drawn(setting, Axis::kY),
                       z = drawn(setting, Axis::kZ);
    const auto view = x.view(camera, {20, 20});
    ASSERT_TRUE(view.has_value());
    for (int v = 0; v <= 20; ++v) {
      for (int u = 0; u <= 20; ++u) {
        const auto a = x.pick(*view, {u, v}), b = y.pick(*view, {u, v}), c = z.pick(*view, {u, v});
        ASSERT_EQ(a.has_value(), b.has_value());
        ASSERT_EQ(a.has_value(), c.has_value());
        if (!a) continue;
        ++seen;
        ASSERT_EQ(a->voxel, b->voxel);
        ASSERT_EQ(a->voxel, c->voxel);
        ASSERT_EQ(a->axis, b->axis);
        ASSERT_EQ(a->axis, c->axis);
      }
    }
  }
  EXPECT_GT(seen, 1000);
}

}  // namespace
}  // namespace strata
