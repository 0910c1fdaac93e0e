#include "strata/voxelize/distance/inner_faces.h"

#include <gtest/gtest.h>

#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"

namespace strata {
namespace {

TriangleSoup both(TriangleSoup a, const TriangleSoup& b) {
  append(a, b);
  return a;
}

bool found(const TriangleSoup& mesh, InsideRule rule = InsideRule::kWinding) {
  VoxelGrid grid;
  grid.dims = {16, 16, 16};
  VoxelizeOptions options;
  options.rule = rule;
  options.closedness = Closedness::kAssumeClosed;
  const auto inner = has_inner_faces(mesh, grid, options);
  EXPECT_TRUE(inner.has_value()) << inner.error().message;
  return inner.value_or(false);
}

TEST(InnerFaces, AreThoseWithTheInsideOnBothSides) {
  const TriangleSoup box = make_box({2, 2, 2}, {8, 8, 8});
  EXPECT_FALSE(found(box));
  EXPECT_FALSE(found(both(box, make_box({9, 2, 2}, {12, 8, 8}))));
  EXPECT_TRUE(found(both(box, make_box({6, 3, 3}, {12, 7, 7})))) << "they overlap";
  EXPECT_TRUE(found(both(box, make_box({4, 4, 4}, {6, 6, 6})))) << "one lies within";
  EXPECT_TRUE(found(both(box, make_box({8, 2, 2}, {12, 8, 8})))) << "they share a side";
  EXPECT_TRUE(found(both(box, box))) << "all faces are there twice";
}

TEST(InnerFaces, ACavityHasNone) {
  TriangleSoup cavity = make_box({4, 4, 4}, {6, 6, 6});
  reverse_orientation(cavity);
  const TriangleSoup hollow = both(make_box({2, 2, 2}, {8, 8, 8}), cavity);
  EXPECT_FALSE(found(hollow));
  EXPECT_FALSE(found(hollow, InsideRule::kParity));
}

TEST(InnerFaces, TheRuleDecides) {
  const TriangleSoup mesh = both(make_box({2, 2, 2}, {8, 8, 8}), make_box({4, 4, 4}, {6, 6, 6}));
  EXPECT_TRUE(found(mesh));
  EXPECT_FALSE(found(mesh, InsideRule::kParity)) << "the inner box is a cavity";
}

}  // namespace
}  // namespace strata
