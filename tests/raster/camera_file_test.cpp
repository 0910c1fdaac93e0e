// Camera files, films between their cameras, and boxes that fill a picture.

#include "strata/raster/camera_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <glm/geometric.hpp>
#include <random>
#include <string>

namespace strata {
namespace {

std::string temporary_name() {
  return (std::filesystem::temp_directory_path() / ("strata_camera_" + std::to_string(getpid())))
      .string();
}

void expect_same_view(const Camera& a, const Camera& b, double tolerance) {
  const glm::dmat4 from = eye_from_world(a), to = eye_from_world(b);
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 4; ++k) EXPECT_NEAR(from[i][k], to[i][k], tolerance);
  }
  EXPECT_NEAR(a.field_of_view, b.field_of_view, tolerance);
}

TEST(CameraFile, WhatIsWrittenIsReadBitByBit) {
  Camera camera;
  camera.target = {0.1, -2e-7, 1e20 / 3};
  camera.rotation = {71.3, -12.000000000000002, 359.9};
  camera.distance = 1.0 / 3;
  camera.field_of_view = 33.3;
  camera.projection = Projection::kOrthographic;
  const std::string path = temporary_name();
  ASSERT_TRUE(write_camera(camera, path).has_value());
  const auto read = read_cameras(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(read.has_value()) << read.error().message;
  ASSERT_EQ(read->size(), 1u);
  const Camera& found = read->front().camera;
  EXPECT_EQ(found.target, camera.target);
  EXPECT_EQ(found.rotation, camera.rotation);
  EXPECT_EQ(found.distance, camera.distance);
  EXPECT_EQ(found.field_of_view, camera.field_of_view);
  EXPECT_EQ(found.projection, camera.projection);
}

TEST(CameraPath, GoesThroughItsCamerasWithoutJumps) {
  std::mt19937 random(3);
  const auto number = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<TimedCamera> path;
  double time = 0;
  for (int i = 0; i < 6; ++i) {
    TimedCamera one;
    one.time = time += number(0.5, 3);
    one.camera.target = {number(-1, 1), number(-1, 1), number(-1, 1)};
    one.camera.rotation = {number(20, 160), number(-30, 30), number(0, 90) + 30 * i};
    one.camera.distance = number(20, 40);
    one.camera.field_of_view = number(20, 40);
    path.push_back(one);
  }
  for (const TimedCamera& one : path) {
    expect_same_view(camera_at(path, one.time), one.camera, 1e-9);
    expect_same_view(camera_at(path, one.time + 1e-7), one.camera, 1e-4);
    expect_same_view(camera_at(path, one.time - 1e-7), one.camera, 1e-4);
  }
  expect_same_view(camera_at(path, -5), path.front().camera, 1e-9);
  expect_same_view(camera_at(path, time + 5), path.back().camera, 1e-9);
}

TEST(CameraPath, KeepsTheHorizonLevel) {
  std::vector<TimedCamera> path(2);
  path[1].time = 1;
  path[1].camera.rotation = {80, 0, 140};
  for (int i = 0; i <= 10; ++i) {
    const glm::dmat4 eye = eye_from_world(camera_at(path, i / 10.0));
    // The screen's right is horizontal.
    EXPECT_NEAR(eye[2][0], 0.0, 1e-12) << i;
  }
}

TEST(FrameCamera, ABoxFillsThePictureUpToTheMargin) {
  std::mt19937 random(7);
  const auto number = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int i = 0; i < 200; ++i) {
    const glm::dvec3 low(number(-50, 50), number(-50, 50), number(-50, 50));
    const Bounds box{low, low + glm::dvec3(number(0, 9), number(0.1, 9), number(0.1, 30))};
    Camera camera;
    camera.rotation = {number(0, 180), number(-20, 20), number(0, 360)};
    camera.field_of_view = number(5, 90);
    if (i % 2 == 0) camera.projection = Projection::kOrthographic;
    const glm::ivec2 size(100 + i, 150);
    frame_camera(camera, box, static_cast<double>(size.x) / size.y);
    const auto view = make_view(camera, size, box);
    ASSERT_TRUE(view.has_value());
    glm::dvec2 first(1e9), last(-1e9);
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec4 at =
          view->image_from_world * glm::dvec4((corner & 1) != 0 ? box.high.x : box.low.x,
                                              (corner & 2) != 0 ? box.high.y : box.low.y,
                                              (corner & 4) != 0 ? box.high.z : box.low.z, 1.0);
      first = glm::min(first, glm::dvec2(at) / at.w / glm::dvec2(size));
      last = glm::max(last, glm::dvec2(at) / at.w / glm::dvec2(size));
    }
    constexpr double kMargin = 1 / 24.0;
    EXPECT_NEAR(std::min(first.x, first.y), kMargin, 0.01) << i;
    EXPECT_NEAR(std::max(last.x, last.y), 1 - kMargin, 0.01) << i;
    EXPECT_NEAR(first.x, 1 - last.x, 0.03) << i;
    EXPECT_NEAR(first.y, 1 - last.y, 0.03) << i;
  }
  Camera camera;
  const Camera before = camera;
  frame_camera(camera, Bounds{});
  EXPECT_EQ(camera.distance, before.distance);
  frame_camera(camera, Bounds{glm::dvec3(1), glm::dvec3(1)});
  EXPECT_EQ(camera.distance, before.distance);
}

}  // namespace
}  // namespace strata
