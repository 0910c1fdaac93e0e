#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "apps/view/scene/camera_control.h"

namespace strata::view {
namespace {

constexpr glm::ivec2 kSize(800, 600);

Camera camera_at(Projection projection) {
  Camera camera;
  camera.projection = projection;
  camera.target = {3, -4, 5};
  camera.rotation = {40, 0, 130};
  camera.distance = 50;
  return camera;
}

class BothProjections : public testing::TestWithParam<Projection> {};
INSTANTIATE_TEST_SUITE_P(, BothProjections,
                         testing::Values(Projection::kPerspective, Projection::kOrthographic),
                         [](const auto& one) {
                           return one.param == Projection::kPerspective ? "Perspective"
                                                                        : "Orthographic";
                         });

TEST_P(BothProjections, TheTargetIsInTheMiddle) {
  const Camera camera = camera_at(GetParam());
  const auto pixel = project(camera, kSize, camera.target);
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x, 400, 1e-9);
  EXPECT_NEAR(pixel->y, 300, 1e-9);
}

TEST_P(BothProjections, ProjectAgreesWithTheViewThatPicturesAreDrawnIn) {
  const Camera camera = camera_at(GetParam());
  Bounds box;
  box.low = {-5, -10, 0}, box.high = {10, 5, 9};
  const auto view = make_view(camera, kSize, box);
  ASSERT_TRUE(view);
  for (const glm::dvec3 point : {glm::dvec3(1, 2, 3), glm::dvec3(-4, 0, 8), glm::dvec3(9, -9, 1)}) {
    const glm::dvec4 image = view->image_from_world * glm::dvec4(point, 1);
    const auto pixel = project(camera, kSize, point);
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->x, image.x / image.w, 1e-9);
    EXPECT_NEAR(pixel->y, image.y / image.w, 1e-9);
    const glm::dvec3 back = world_of(*view, *pixel, image.z / image.w);
    EXPECT_NEAR(glm::distance(back, point), 0, 1e-6);
  }
}

TEST_P(BothProjections, PanMovesTheTargetsPlaneWithTheMouse) {
  Camera camera = camera_at(GetParam());
  const glm::dvec3 point = camera.target;
  pan(camera, {37, -21}, kSize);
  const auto pixel = project(camera, kSize, point);
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x, 437, 1e-6);
  EXPECT_NEAR(pixel->y, 279, 1e-6);
}

TEST_P(BothProjections, ZoomKeepsWhatIsBelowTheCursor) {
  Camera camera = camera_at(GetParam());
  Camera moved = camera;
  pan(moved, {-150, 90}, kSize);  // then the target lies at (400, 300) + (150, -90) of the old one
  const glm::dvec3 point = moved.target;
  const glm::dvec2 cursor = *project(camera, kSize, point);
  EXPECT_NEAR(cursor.x, 550, 1e-6);
  for (const double steps : {3.0, -7.0, 0.5}) {
    zoom(camera, steps, cursor, kSize);
    const auto pixel = project(camera, kSize, point);
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->x, cursor.x, 1e-6);
    EXPECT_NEAR(pixel->y, cursor.y, 1e-6);
  }
}

TEST_P(BothProjections, SlideFollowsTheMouseAlongTheDirection) {
  const Camera camera = camera_at(GetParam());
  for (const glm::dvec3 direction : {glm::dvec3(0, 0, 1), glm::dvec3(1, 0, 0)}) {
    const glm::dvec3 from = camera.target, to = camera.target + direction * 0.5;
    const glm::dvec2 pixels = *project(camera, kSize, to) - *project(camera, kSize, from);
    EXPECT_NEAR(slide(camera, kSize, from, direction, pixels), 0.5, 0.02);
    const glm::dvec2 across(-pixels.y, pixels.x);
    EXPECT_NEAR(slide(camera, kSize, from, direction, across), 0, 1e-9);
  }
}

TEST_P(BothProjections, ViewAllHoldsTheWholeBox) {
  Bounds box;
  box.low = {100, 0, -3}, box.high = {140, 10, 8};
  for (const glm::ivec2 size : {glm::ivec2(800, 600), glm::ivec2(300, 900)}) {
    Camera camera = camera_at(GetParam());
    view_all(camera, box, size);
    for (int i = 0; i < 8; ++i) {
      const glm::dvec3 corner((i & 1) != 0 ? box.high.x : box.low.x,
                              (i & 2) != 0 ? box.high.y : box.low.y,
                              (i & 4) != 0 ? box.high.z : box.low.z);
      const auto pixel = project(camera, size, corner);
      ASSERT_TRUE(pixel);
      EXPECT_TRUE(pixel->x >= 0 && pixel->x <= size.x && pixel->y >= 0 && pixel->y <= size.y);
    }
  }
}

TEST(Camera, OrbitTurnsTheSceneWithTheMouse) {
  Camera camera;
  camera.rotation = {90, 0, 0};  // from the front, +x to the right
  const glm::dvec3 near_point(0, -10, 0);
  orbit(camera, {20, 0});
  EXPECT_GT(project(camera, kSize, near_point)->x, 400);
  camera.rotation = {90, 0, 0};
  orbit(camera, {0, 20});
  EXPECT_GT(project(camera, kSize, near_point)->y, 300);
  EXPECT_DOUBLE_EQ(camera.rotation.x, 76);
}

TEST(Camera, OrbitComesAroundAfterAFullTurn) {
  Camera camera;
  const Camera before = camera;
  for (int i = 0; i < 36; ++i) orbit(camera, {100 / 7.0, -100 / 7.0});
  EXPECT_NEAR(camera.rotation.x, before.rotation.x, 1e-9);
  EXPECT_NEAR(camera.rotation.z, before.rotation.z, 1e-9);
}

TEST(Camera, NamedViewsAreOpenScads) {
  struct Expected {
    const char* name;
    glm::dvec3 right, up;  // world directions that lie along the screen's axes
  };
  const Expected all[] = {{"top", {1, 0, 0}, {0, 1, 0}},   {"bottom", {1, 0, 0}, {0, -1, 0}},
                          {"front", {1, 0, 0}, {0, 0, 1}}, {"back", {-1, 0, 0}, {0, 0, 1}},
                          {"left", {0, -1, 0}, {0, 0, 1}}, {"right", {0, 1, 0}, {0, 0, 1}}};
  for (const Expected& one : all) {
    SCOPED_TRACE(one.name);
    Camera camera;
    look_from(camera, *find_named_view(one.name));
    const glm::dvec2 right = *project(camera, kSize, one.right),
                     up = *project(camera, kSize, one.up);
    EXPECT_GT(right.x, 401);
    EXPECT_NEAR(right.y, 300, 1e-6);
    EXPECT_LT(up.y, 299);
    EXPECT_NEAR(up.x, 400, 1e-6);
  }
  Camera camera;
  camera.rotation = {};
  look_from(camera, NamedView::kDiagonal);
  EXPECT_EQ(camera.rotation, Camera{}.rotation);
  EXPECT_FALSE(find_named_view("upside down"));
}

TEST(Camera, ZoomHasAnEnd) {
  Camera camera;
  zoom(camera, 1e6, {400, 300}, kSize);
  EXPECT_GT(camera.distance, 0);
  zoom(camera, -1e7, {0, 0}, kSize);
  EXPECT_LE(camera.distance, 1e12);
}

TEST(Camera, NothingBehindTheEyeHasAPixel) {
  Camera camera = camera_at(Projection::kPerspective);
  camera.rotation = {0, 0, 0};  // looks down
  EXPECT_FALSE(project(camera, kSize, camera.target + glm::dvec3(0, 0, 60)));
}

}  // namespace
}  // namespace strata::view
