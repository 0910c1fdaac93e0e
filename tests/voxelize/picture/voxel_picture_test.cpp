#include "strata/voxelize/picture/voxel_picture.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <set>

#include "tests/support/predicate_intervals.h"

namespace strata {
namespace {

VoxelGrid cube(int side) {
  VoxelGrid grid;
  grid.dims = glm::ivec3(side);
  grid.origin = glm::dvec3(-1.0);
  grid.voxel_size = glm::dvec3(2.0 / side);
  return grid;
}

/// A ball with a hollow.
bool in_ball(const glm::dvec3& at) {
  const double r = glm::length(at);
  return r < 0.9 && r > 0.4;
}
std::shared_ptr<VoxelIntervals> ball(int side, Axis axis = Axis::kZ) {
  const VoxelGrid grid = cube(side);
  return std::make_shared<VoxelIntervals>(
      intervals_from_predicate(grid, axis, [&](int i, int j, int k) {
        return in_ball(grid.origin + (glm::dvec3(i, j, k) + 0.5) * grid.voxel_size);
      }));
}

/// Halves with labels 1 and 2.
std::shared_ptr<VoxelIntervals> halves(int side) {
  const VoxelGrid grid = cube(side);
  auto set = std::make_shared<VoxelIntervals>(grid, Axis::kZ);
  for (int tv = 0; tv < set->tiles_v(); ++tv) {
    for (int tu = 0; tu < set->tiles_u(); ++tu) {
      std::vector<std::uint32_t> offsets(1, 0), labels;
      std::vector<Interval> items;
      for (int local = 0; local < 64 * 64; ++local) {
        const int u = tu * 64 + local % 64, v = tv * 64 + local / 64;
        if (u < side && v < side) {
          items.push_back({0, static_cast<std::uint16_t>(side / 2 - 1)});
          items.push_back(
              {static_cast<std::uint16_t>(side / 2), static_cast<std::uint16_t>(side - 1)});
          labels.insert(labels.end(), {1u, 2u});
        }
        offsets.push_back(static_cast<std::uint32_t>(items.size()));
      }
      set->set_tile(tu, tv, offsets, items, labels);
    }
  }
  return set;
}

Camera camera_on(const Bounds& box) {
  Camera camera;
  centre_camera(camera, box);
  fit_camera(camera, box);
  return camera;
}

VoxelPicture made(std::shared_ptr<const VoxelIntervals> set, VoxelLook look = {}) {
  auto picture = VoxelPicture::create(std::move(set), std::move(look));
  EXPECT_TRUE(picture.has_value());
  return *std::move(picture);
}

std::size_t covered(const Picture& picture, const Rgba& background) {
  return static_cast<std::size_t>(
      std::count_if(picture.pixels.begin(), picture.pixels.end(),
                    [&](const Rgba& pixel) { return pixel != background; }));
}

TEST(VoxelPicture, TheSameBytesForAnyThreadsAndAnyAxis) {
  const Axis axes[] = {Axis::kX, Axis::kY, Axis::kZ};
  for (const VoxelStyle style : {VoxelStyle::kBlocks, VoxelStyle::kSmooth, VoxelStyle::kXray}) {
    VoxelPictureOptions options;
    options.style = style;
    options.sections = {{{1.0, 0.3, 0.2}, 0.31}};
    std::optional<Picture> first;
    for (int i = 0; i < 3; ++i) {
      const VoxelPicture picture = made(ball(40, axes[i]));
      Execution execution;
      execution.threads = i + 1;
      const auto one = picture.draw(camera_on(picture.box()), {120, 90}, options, execution);
      ASSERT_TRUE(one.has_value());
      EXPECT_GT(covered(*one, options.background), 1000u);
      if (!first) first = *one;
      if (style == VoxelStyle::kBlocks) {
        EXPECT_EQ(first->pixels, one->pixels);
        continue;
      }
      // Sums over runs along another axis are rounded in another way.
      for (std::size_t p = 0; p < one->pixels.size(); ++p) {
        for (int c = 0; c < 4; ++c) {
          ASSERT_NEAR(first->pixels[p][c], one->pixels[p][c], 1) << "axis " << i << " pixel " << p;
        }
      }
      execution.threads = 3 - i;
      const auto again = picture.draw(camera_on(picture.box()), {120, 90}, options, execution);
      ASSERT_TRUE(again.has_value());
      EXPECT_EQ(again->pixels, one->pixels);
    }
  }
}

TEST(VoxelPicture, AutomaticStyleIsBlocksWhereVoxelsAreLarge) {
  VoxelPictureOptions options;
  for (const auto& [side, style] :
       {std::pair(20, VoxelStyle::kBlocks), std::pair(120, VoxelStyle::kSmooth)}) {
    const VoxelPicture picture = made(ball(side));
    options.style = VoxelStyle::kAuto;
    const auto chosen = picture.draw(camera_on(picture.box()), {160, 160}, options);
    options.style = style;
    const auto given = picture.draw(camera_on(picture.box()), {160, 160}, options);
    ASSERT_TRUE(chosen.has_value() && given.has_value());
    EXPECT_EQ(chosen->pixels, given->pixels) << side;
  }
}

TEST(VoxelPicture, ShowsColoursOfLabelsAndOfTheFile) {
  VoxelPictureOptions options;
  options.edges = options.occlusion = false;
  options.samples = 1;
  VoxelLook look;
  look.colours = {{255, 0, 0, 255}, {0, 255, 0, 255}};
  const VoxelPicture palette = made(halves(16)), own = made(halves(16), look);
  Camera side = camera_on(own.box());
  side.rotation = {90, 0, 0};
  const auto picture = own.draw(side, {60, 60}, options);
  ASSERT_TRUE(picture.has_value());
  const Rgba low = picture->pixels[40 * 60 + 30], high = picture->pixels[20 * 60 + 30];
  EXPECT_GT(low.r, 100);
  EXPECT_LT(low.g, low.r / 2);
  EXPECT_GT(high.g, 100);
  EXPECT_LT(high.r, high.g / 2);
  EXPECT_EQ(own.colour(2), look.colours[1]);
  std::set<std::uint32_t> different;
  for (std::uint32_t label = 1; label <= 64; ++label) {
    const Rgba colour = palette.colour(label);
    different.insert(static_cast<std::uint32_t>(colour.r << 16 | colour.g << 8 | colour.b));
  }
  EXPECT_EQ(different.size(), 64u);
}

TEST(VoxelPicture, TheBackgroundIsWhereNothingIsAndMayBeTransparent) {
  const VoxelPicture picture = made(ball(24));
  VoxelPictureOptions options;
  options.background = {0, 0, 0, 0};
  const auto clear = picture.draw(camera_on(picture.box()), {80, 80}, options);
  ASSERT_TRUE(clear.has_value());
  EXPECT_EQ(clear->pixels.front(), Rgba(0, 0, 0, 0));
  EXPECT_EQ(clear->pixels[40 * 80 + 40].a, 255);
  EXPECT_TRUE(std::any_of(clear->pixels.begin(), clear->pixels.end(),
                          [](const Rgba& pixel) { return pixel.a > 0 && pixel.a < 255; }));
  const VoxelPicture empty = made(std::make_shared<VoxelIntervals>(cube(8), Axis::kZ));
  EXPECT_TRUE(empty.box().empty());
  const auto nothing = empty.draw(Camera{}, {20, 20}, options);
  ASSERT_TRUE(nothing.has_value());
  EXPECT_EQ(covered(*nothing, options.background), 0u);
}

TEST(VoxelPicture, TheBoxIsThatOfTheSolidVoxels) {
  VoxelGrid grid = cube(100);
  const auto set = std::make_shared<VoxelIntervals>(
      intervals_from_predicate(grid, Axis::kX, [](int i, int j, int k) {
        return (i == 13 && j == 71 && k == 40) || (i == 90 && j == 70 && k == 99);
      }));
  const Bounds box = made(set).box();
  for (const auto& [got, wanted] :
       {std::pair(box.low, glm::dvec3(13, 70, 40)), std::pair(box.high, glm::dvec3(91, 72, 100))}) {
    const glm::dvec3 at = grid.origin + wanted * grid.voxel_size;
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(got[a], at[a], 1e-12);
  }
}

TEST(VoxelPicture, ASliceShowsEachVoxelOfItsPlane) {
  VoxelPictureOptions options;
  options.samples = 1;
  const VoxelPicture picture = made(ball(30));
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    const auto slice = picture.draw_slice({axis, 11}, {200, 150}, options);
    ASSERT_TRUE(slice.has_value());
    // 0.94 of the height: 4.7 pixels a voxel, from pixel 29.5 and 4.5 on.
    const AxisFrame frame(axis);
    for (int b = 0; b < 30; ++b) {
      for (int a = 0; a < 30; ++a) {
        const int u = static_cast<int>(29.5 + 4.7 * (a + 0.5));
        const int v = static_cast<int>(150 - 4.5 - 4.7 * (b + 0.5));
        glm::ivec3 voxel;
        voxel[frame.u] = a, voxel[frame.v] = b, voxel[frame.w] = 11;
        const Rgba pixel = slice->pixels[static_cast<std::size_t>(v * 200 + u)];
        EXPECT_EQ(pixel == picture.colour(1), picture.set().contains(voxel.x, voxel.y, voxel.z))
            << a << " " << b;
      }
    }
  }
}

TEST(VoxelPicture, ASliceOfDistancesHasADarkLineAtZero) {
  const VoxelGrid grid = cube(32);
  VoxelLook look;
  look.distances = true;
  look.value = [&](const glm::ivec3& voxel) {
    const glm::dvec3 at = grid.origin + (glm::dvec3(voxel) + 0.5) * grid.voxel_size;
    return static_cast<float>(glm::length(at) - 0.5);
  };
  const VoxelPicture picture = made(ball(32), look);
  const auto slice = picture.draw_slice({Axis::kZ, 15}, {200, 200});
  ASSERT_TRUE(slice.has_value());
  // Rays from the middle: dark at 0.5 of 1.0 (94 pixels), blue before, orange after.
  for (const double angle : {0.3, 1.2, 2.0, 2.9, 4.1, 5.6}) {
    const auto pixel = [&](double radius) {
      const int u = static_cast<int>(100 + radius * 94 * std::cos(angle));
      const int v = static_cast<int>(100 + radius * 94 * std::sin(angle));
      return slice->pixels[static_cast<std::size_t>(v * 200 + u)];
    };
    EXPECT_LT(pixel(0.5).g, 60) << angle;
    EXPECT_GT(pixel(0.45).b, pixel(0.45).r) << angle;
    EXPECT_LT(pixel(0.55).b, pixel(0.55).r) << angle;
  }
}

TEST(VoxelPicture, RefusesWhatCannotBeDrawnWithTheNumber) {
  const VoxelPicture picture = made(ball(8));
  VoxelPictureOptions options;
  options.samples = 3;
  const auto samples = picture.draw(Camera{}, {8, 8}, options);
  ASSERT_FALSE(samples.has_value());
  EXPECT_NE(samples.error().message.find("got 3"), std::string::npos);
  options.samples = 1;
  options.sections = {{glm::dvec3(0.0), 1.0}};
  ASSERT_FALSE(picture.draw(Camera{}, {8, 8}, options).has_value());
  const auto slice = picture.draw_slice({Axis::kY, 8}, {8, 8});
  ASSERT_FALSE(slice.has_value());
  EXPECT_EQ(slice.error().message, "a slice must be 0 to 7 along y, got 8");
  EXPECT_FALSE(VoxelPicture::create(nullptr).has_value());
  Execution small;
  small.memory_limit = 1'000'000;
  const auto large = picture.draw(Camera{}, {20'000, 20'000}, {}, small);
  ASSERT_FALSE(large.has_value());
  EXPECT_EQ(large.error().code, ErrorCode::kLimit);
  std::stop_source stop;
  stop.request_stop();
  Execution execution;
  execution.stop = stop.get_token();
  const auto stopped = picture.draw(Camera{}, {8, 8}, {}, execution);
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
  // The 4 GB of a large picture are not taken first.
  rusage before{}, after{};
  getrusage(RUSAGE_SELF, &before);
  const auto large_stopped = picture.draw(Camera{}, {8000, 8000}, {}, execution);
  getrusage(RUSAGE_SELF, &after);
  EXPECT_EQ(large_stopped.error().code, ErrorCode::kCancelled);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 500'000) << "kilobytes";
}

}  // namespace
}  // namespace strata
