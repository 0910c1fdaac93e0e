#include "csg/result_bounds.h"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <utility>
#include <vector>

#include "csg/picture.h"
#include "csg/view.h"

namespace strata::csg {
namespace {

/// Points that stand for a side: the result reaches it while one of them is in the result.
constexpr std::size_t kWitnesses = 4;

/// A box that the result of a node lies in, and for each side (low x, y, z, high x, y, z) points of
/// the result that lie there. A side without any may be cut off.
struct Reach {
  Bounds box;
  std::array<std::vector<glm::dvec3>, 6> witnesses;
};

/// The less, the farther out.
double side(const Bounds& box, std::size_t i) {
  return i < 3 ? box.low[static_cast<int>(i)] : -box.high[static_cast<int>(i) - 3];
}

Reach reach_of(const Solid& solid) {
  Reach reach;
  if (!solid.mesh || solid.mesh->triangles.empty()) return reach;
  reach.box = bounds(solid);
  const auto reaches = [&](std::size_t i, const glm::dvec3& p) {
    return (i < 3 ? p[static_cast<int>(i)] : -p[static_cast<int>(i) - 3]) == side(reach.box, i);
  };
  const glm::dmat4& place = solid.world_from_mesh;
  for (const glm::uvec3& triangle : solid.mesh->triangles) {
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 p(place * glm::dvec4(solid.mesh->positions[triangle[k]], 1.0));
      for (std::size_t i = 0; i < 6; ++i) {
        if (!reaches(i, p)) continue;
        // Of the many points of a round face, the outermost in each of four directions.
        auto& points = reach.witnesses[i];
        points.resize(kWitnesses, p);
        const int u = static_cast<int>(i + 1) % 3, v = static_cast<int>(i + 2) % 3;
        const auto keep = [&](std::size_t slot, double new_value, double old_value) {
          if (new_value > old_value) points[slot] = p;
        };
        keep(0, p[u] + p[v], points[0][u] + points[0][v]);
        keep(1, p[u] - p[v], points[1][u] - points[1][v]);
        keep(2, -p[u] + p[v], -points[2][u] + points[2][v]);
        keep(3, -p[u] - p[v], -points[3][u] - points[3][v]);
      }
    }
  }
  return reach;
}

bool inside_closed(const glm::dvec3& p, const Bounds& box) {
  return glm::all(glm::lessThanEqual(box.low, p)) && glm::all(glm::lessThanEqual(p, box.high));
}

void unite(Reach& reach, const Reach& one) {
  if (one.box.empty()) return;
  if (reach.box.empty()) {
    reach = one;
    return;
  }
  for (std::size_t i = 0; i < 6; ++i) {
    const double mine = side(reach.box, i), other = side(one.box, i);
    auto& points = reach.witnesses[i];
    if (other < mine) points.clear();
    if (other <= mine && points.size() < 4 * kWitnesses) {
      points.insert(points.end(), one.witnesses[i].begin(), one.witnesses[i].end());
    }
  }
  reach.box.include(one.box);
}

Reach reach_of(const Tree& tree, Tree::NodeId root) {
  std::vector<Reach> all(root + 1);  // operands stand before the nodes that take them
  for (Tree::NodeId id = 0; id <= root; ++id) {
    Reach& reach = all[id];
    const Tree::Node& node = tree.nodes()[id];
    if (node.operation == Operation::kSolid) {
      reach = reach_of(tree.solids()[node.first]);
      continue;
    }
    const auto operands = tree.operands(id);
    if (node.operation == Operation::kUnion) {
      for (const Tree::NodeId operand : operands) unite(reach, all[operand]);
      continue;
    }
    if (operands.empty()) continue;
    reach = std::move(all[operands[0]]);
    for (const Tree::NodeId operand : operands.subspan(1)) {
      const Bounds& other = all[operand].box;
      if (node.operation == Operation::kDifference) {
        for (auto& points : reach.witnesses) {
          std::erase_if(points, [&](const glm::dvec3& p) { return inside_closed(p, other); });
        }
        continue;
      }
      reach.box.low = glm::max(reach.box.low, other.low);
      reach.box.high = glm::min(reach.box.high, other.high);
      reach.witnesses = {};
    }
    if (!glm::all(glm::lessThanEqual(reach.box.low, reach.box.high))) reach = {};
  }
  return std::move(all[root]);
}

}  // namespace

Result<Bounds> result_bounds(const Tree& tree, Tree::NodeId node, double relative_precision,
                             const Execution& execution) {
  if (node == Tree::kNone) return Bounds{};
  const Reach reach = reach_of(tree, node);
  const Bounds outer = reach.box;
  if (outer.empty() || std::none_of(reach.witnesses.begin(), reach.witnesses.end(),
                                    [](const auto& points) { return points.empty(); })) {
    return outer;
  }
  // The other sides are looked at from outside: what is nearest there is the side.
  constexpr int kPixels = 256;
  Tree opaque = tree;
  opaque.set_root(node);
  for (Solid& solid : opaque.solids()) solid.colour.reset();
  Preview preview(std::move(opaque), {}, relative_precision, execution);
  const glm::dvec3 centre = 0.5 * outer.low + 0.5 * outer.high;
  Bounds box = outer;
  for (std::size_t i = 0; i < 6; ++i) {
    if (!reach.witnesses[i].empty()) continue;
    const int axis = static_cast<int>(i) % 3;
    glm::dvec3 out(0.0);
    out[axis] = i < 3 ? -1.0 : 1.0;
    Camera camera = look_at(centre + out, centre);
    camera.projection = Projection::kOrthographic;
    fit_camera(camera, outer);
    const auto view = make_view(camera, glm::ivec2(kPixels), preview.box());
    if (!view) return tl::unexpected(view.error());
    const auto image = preview.draw(*view, execution);
    if (!image) return tl::unexpected(image.error());
    const auto& depths = (*image)->depth;
    const std::uint32_t nearest = *std::min_element(depths.begin(), depths.end());
    if (nearest == SurfaceImage::kNone) return Bounds{};
    const double height = camera.distance - view->distance(nearest + 0.5);
    // Near the operands' box it is likelier that just no ray has met the outermost point.
    const double pixel = glm::length(outer.high - outer.low) / kPixels;
    const double most = 0.5 * (outer.high[axis] - outer.low[axis]);
    if (height > most - 2 * pixel) continue;
    (i < 3 ? box.low : box.high)[axis] = centre[axis] + out[axis] * height;
  }
  return box;
}

}  // namespace strata::csg
