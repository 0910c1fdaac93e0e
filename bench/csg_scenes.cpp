#include "bench/csg_scenes.h"

#include <cmath>
#include <glm/ext/matrix_transform.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <memory>
#include <random>
#include <utility>

#include "strata/csg/scene/scene.h"
#include "strata/mesh/formats/read_mesh.h"
#include "strata/mesh/shapes.h"

namespace strata::bench {
namespace {

using csg::Operation;
using csg::Tree;

/// World units that the height of the picture shows in the target's plane.
const std::map<std::string, double>& heights() {
  static const std::map<std::string, double> kHeights{
      {"drill", 22},           {"plate100", 110},       {"plate400", 110},
      {"menger3", 90},         {"union_cubes50", 140},  {"union_mixed200", 140},
      {"inter_spheres20", 24}, {"inter_spheres50", 24}, {"diff_u30_u30", 140},
      {"diff_u50_u50", 140}};
  return kHeights;
}

void finish(CsgScene& scene) {
  for (const csg::Solid& solid : scene.tree.solids()) {
    if (solid.mesh) scene.triangles += solid.mesh->triangles.size();
  }
}

void see_all(CsgScene& scene) {
  const Bounds box = bounds(scene.tree, scene.tree.root());
  centre_camera(scene.camera, box);
  fit_camera(scene.camera, box);
}

Result<CsgScene> turned_bunny(const std::string& folder, const std::string& name,
                              const Execution& execution) {
  auto file = read_mesh(folder + "/bunny00.off", {}, execution);
  if (!file) return tl::unexpected(file.error());
  TriangleSoup mesh = std::move(file->soup);
  if (name == "bunny-1m") mesh = subdivide(subdivide(mesh));
  const auto shared = std::make_shared<const TriangleSoup>(std::move(mesh));
  CsgScene scene;
  scene.name = name;
  scene.concave_convexity = 6;
  const auto a = scene.tree.add_solid({.mesh = shared});
  const auto b = scene.tree.add_solid(
      {.mesh = shared,
       .world_from_mesh = glm::rotate(glm::dmat4(1.0), glm::radians(40.0), glm::dvec3(0, 0, 1))});
  scene.tree.set_root(scene.tree.add(Operation::kDifference, {a, b}));
  see_all(scene);
  finish(scene);
  return scene;
}

}  // namespace

std::vector<std::string> csg_scene_names() {
  return {"drill",         "plate100",       "plate400",        "menger3",
          "union_cubes50", "union_mixed200", "inter_spheres20", "inter_spheres50",
          "diff_u30_u30",  "diff_u50_u50",   "bunny-75k",       "bunny-1m"};
}

Result<CsgScene> csg_scene(const std::string& folder, const std::string& name,
                           const Execution& execution) {
  if (name.starts_with("bunny-")) return turned_bunny(folder, name, execution);
  auto read = csg::read_scene(folder + "/" + name + ".csg", {}, execution);
  if (!read) return tl::unexpected(read.error());
  CsgScene scene;
  scene.name = name;
  scene.tree = std::move(read->tree);
  scene.relative_precision = read->relative_precision;
  if (const auto found = heights().find(name); found != heights().end()) {
    const double half = glm::radians(scene.camera.field_of_view) / 2;
    scene.camera.distance = found->second / 2 / std::tan(half);
  } else {
    see_all(scene);
  }
  finish(scene);
  return scene;
}

CsgScene nested_differences(int depth) {
  CsgScene scene;
  scene.name = "nested-" + std::to_string(depth);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto box = std::make_shared<const TriangleSoup>(make_box(glm::dvec3(-1), glm::dvec3(1)));
  std::vector<Tree::NodeId> boxes;
  for (int i = 0; i < depth; ++i) {
    // Turned and moved, so that each one looks out of others somewhere.
    glm::dmat4 place = glm::translate(
        glm::dmat4(1.0), 0.4 * glm::dvec3(uniform(random), uniform(random), uniform(random)));
    place = glm::rotate(place, 3.0 * uniform(random),
                        glm::dvec3(uniform(random), uniform(random), 1.5 + uniform(random)));
    boxes.push_back(scene.tree.add_solid({.mesh = box, .world_from_mesh = place}));
  }
  Tree::NodeId root = boxes.back();
  for (int i = depth - 2; i >= 0; --i) {
    root = scene.tree.add(Operation::kDifference, {boxes[static_cast<std::size_t>(i)], root});
  }
  scene.tree.set_root(root);
  see_all(scene);
  finish(scene);
  return scene;
}

CsgScene small_boxes(int count) {
  CsgScene scene;
  scene.name = "boxes-" + std::to_string(count);
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto box = std::make_shared<const TriangleSoup>(make_box(glm::dvec3(-1), glm::dvec3(1)));
  const double half = 0.15 * std::sqrt(100.0 / count);
  std::vector<Tree::NodeId> sides[2];
  for (int i = 0; i < count; ++i) {
    glm::dmat4 place =
        glm::translate(glm::dmat4(1.0),
                       (1 - half) * glm::dvec3(uniform(random), uniform(random), uniform(random)));
    place = glm::scale(place, glm::dvec3(half));
    sides[i % 2].push_back(scene.tree.add_solid({.mesh = box, .world_from_mesh = place}));
  }
  const auto a = scene.tree.add(Operation::kUnion, sides[0]);
  const auto b = scene.tree.add(Operation::kUnion, sides[1]);
  scene.tree.set_root(scene.tree.add(Operation::kDifference, {a, b}));
  const double room = 1.2;
  scene.camera.distance = room * 2 / std::tan(glm::radians(scene.camera.field_of_view) / 2);
  finish(scene);
  return scene;
}

}  // namespace strata::bench
