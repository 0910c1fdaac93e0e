#include "strata/csg/input/scene_input.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "strata/csg/picture/picture.h"
#include "strata/mesh/shapes.h"

namespace strata::csg {
namespace {

/// The box [0, size] turned so that z points along `normal`, its bottom at the plane.
std::shared_ptr<const TriangleSoup> half_space(const glm::dvec3& normal, double offset,
                                               const glm::dvec3& centre, double radius) {
  const glm::dvec3 other = std::abs(normal.z) > 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 0, 1);
  const glm::dvec3 u = glm::normalize(glm::cross(other, normal)), v = glm::cross(normal, u);
  const glm::dvec3 foot = centre + normal * (offset - glm::dot(normal, centre));
  const glm::dmat4 place(glm::dvec4(u, 0), glm::dvec4(v, 0), glm::dvec4(normal, 0),
                         glm::dvec4(foot, 1));
  const TriangleSoup box =
      make_box(glm::dvec3(-radius, -radius, 0), glm::dvec3(radius, radius, 2 * radius));
  return std::make_shared<const TriangleSoup>(transform(box, place));
}

/// What the unions at the top of a node unite.
std::vector<Tree::NodeId> united(const Tree& tree, Tree::NodeId node) {
  std::vector<Tree::NodeId> stack{node}, parts;
  while (!stack.empty()) {
    const Tree::NodeId id = stack.back();
    stack.pop_back();
    if (tree.nodes()[id].operation != Operation::kUnion) {
      parts.push_back(id);
      continue;
    }
    const auto operands = tree.operands(id);
    stack.insert(stack.end(), operands.rbegin(), operands.rend());
  }
  return parts;
}

}  // namespace

SectionPlane facing(SectionPlane plane, const Camera& camera) {
  const glm::dvec3 to_eye =
      glm::transpose(glm::dmat3(eye_from_world(camera))) * glm::dvec3(0, 0, 1);
  if (plane.towards_eye && glm::dot(plane.normal, to_eye) < 0) {
    plane.normal = -plane.normal;
    plane.offset = -plane.offset;
  }
  plane.towards_eye = false;
  return plane;
}

void cut_scene(Scene& scene, std::span<const SectionPlane> cuts, const Camera& camera) {
  Bounds box;
  for (const Solid& solid : scene.tree.solids()) box.include(bounds(solid));
  if (box.empty()) return;
  const glm::dvec3 centre = 0.5 * box.low + 0.5 * box.high;
  const auto solids = scene.tree.solids();
  const bool has_translucent = std::any_of(solids.begin(), solids.end(), [](const auto& solid) {
    return solid.colour && solid.colour->a < 1.0f;
  });
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    const SectionPlane plane = facing(cuts[i], camera);
    // A little more than all solids reach, so that no other face of it touches them.
    const double radius = glm::length(box.high - box.low) * 0.55 + 1e-9;
    const double above = plane.offset - glm::dot(plane.normal, centre);
    if (above > radius) continue;  // beyond all solids
    const auto mesh =
        half_space(plane.normal, plane.offset, centre, radius + std::max(0.0, -above));
    // Each has a box of its own, for a node stands in one place only.
    const auto cut = [&](Tree::NodeId node, const std::string& of) {
      Solid solid;
      solid.mesh = mesh;
      solid.name = fmt::format("{}{}{}", kSectionName, i + 1, of);
      const Tree::NodeId half = scene.tree.add_solid(std::move(solid));
      return scene.tree.add(Operation::kDifference, {node, half});
    };
    const auto cut_root = [&](Tree::NodeId root) {
      // Translucent solids stay children of the root's union.
      std::vector<Tree::NodeId> parts;
      if (has_translucent) {
        parts = united(scene.tree, root);
        for (std::size_t k = 0; k < parts.size(); ++k) {
          parts[k] = cut(parts[k], parts.size() > 1 ? fmt::format(" of part {}", k + 1) : "");
        }
      }
      return has_translucent ? scene.tree.add(Operation::kUnion, parts) : cut(root, "");
    };
    if (scene.tree.root() != Tree::kNone) scene.tree.set_root(cut_root(scene.tree.root()));
    for (Tree::NodeId& node : scene.shown) node = cut_root(node);
    std::size_t ghosts = 0;
    for (auto* list : {&scene.backgrounds, &scene.highlights}) {
      for (Tree::NodeId& ghost : *list) ghost = cut(ghost, fmt::format(" of ghost {}", ++ghosts));
    }
  }
}

}  // namespace strata::csg
