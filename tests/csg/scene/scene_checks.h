#pragma once

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "csg/solids/boundary.h"
#include "strata/csg/scene/scene.h"
#include "strata/mesh/soup_tools.h"

namespace strata::csg {

inline std::string moved(double x, double y, double z) {
  return fmt::format("multmatrix([[1,0,0,{}],[0,1,0,{}],[0,0,1,{}],[0,0,0,1]]) ", x, y, z);
}

inline std::string repeated(std::string_view text, int count) {
  std::string all;
  for (int i = 0; i < count; ++i) all += text;
  return all;
}

/// A cube with its middle at the origin, hollow.
inline const std::string kFrame = "difference() { cube([10,10,10], true); cube([6,6,6], true); }";

/// A scene that must be read; empty, with a failure, if it is refused.
inline Scene scene_of(std::string_view text) {
  auto scene = parse_scene(text, "test.csg");
  EXPECT_TRUE(scene.has_value()) << scene.error().message << "\n" << text;
  return scene ? *std::move(scene) : Scene{};
}

/// The message with which a scene is refused; empty, with a failure, if it is read.
inline std::string refusal_of(std::string_view text) {
  auto scene = parse_scene(text, "test.csg");
  EXPECT_FALSE(scene.has_value()) << text;
  if (scene) return {};
  EXPECT_EQ(scene.error().code, ErrorCode::kInput) << text;
  return scene.error().message;
}

/// The boundary of a node, Booleans done, also where it is a union.
inline TriangleSoup result_of(const Tree& tree, Tree::NodeId node) {
  Tree copy = tree;
  const Tree::NodeId whole = copy.add(Operation::kIntersection, {node});
  auto mesh = boundary(copy, whole);
  EXPECT_TRUE(mesh.has_value()) << mesh.error().message;
  return mesh ? *std::move(mesh) : TriangleSoup();
}

inline double volume_of(const Scene& scene) {
  return signed_volume(result_of(scene.tree, scene.tree.root()));
}
inline double volume_of(std::string_view text) { return volume_of(scene_of(text)); }

inline Bounds box_of(const Scene& scene) {
  return bounds(result_of(scene.tree, scene.tree.root()));
}

inline void expect_box(const Bounds& box, const glm::dvec3& low, const glm::dvec3& high,
                       double tolerance = 1e-9) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(box.low[i], low[i], tolerance) << "low, axis " << i;
    EXPECT_NEAR(box.high[i], high[i], tolerance) << "high, axis " << i;
  }
}

/// The codes of the warnings, in order, each with a space after it.
inline std::string codes_of(const Scene& scene) {
  std::string codes;
  for (const SceneWarning& warning : scene.warnings) codes += warning.code + " ";
  return codes;
}

}  // namespace strata::csg
