#include "csg/input/frame_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <vector>

#include "raster/frame_camera.h"

namespace strata::csg {
namespace {

/// Points in the half spaces that sections leave.
class Kept {
 public:
  explicit Kept(std::span<const SectionPlane> planes) : planes_(planes) {}

  [[nodiscard]] bool all() const { return planes_.empty(); }
  /// Calls body(p) for the corners of what is left of a triangle.
  template <class Body>
  void corners(const std::array<glm::dvec3, 3>& triangle, Body&& body) {
    polygon_.assign(triangle.begin(), triangle.end());
    for (const SectionPlane& plane : planes_) clip(plane);
    for (const glm::dvec3& p : polygon_) body(p);
  }
  /// The points where three sections meet: corners of what is left that lie on no face of a solid.
  [[nodiscard]] std::vector<glm::dvec3> meetings() const;

 private:
  static double above(const SectionPlane& plane, const glm::dvec3& p) {
    return glm::dot(plane.normal, p) - plane.offset;
  }
  void clip(const SectionPlane& plane) {
    next_.clear();
    for (std::size_t i = 0; i < polygon_.size(); ++i) {
      const glm::dvec3 &a = polygon_[i], &b = polygon_[(i + 1) % polygon_.size()];
      const double at_a = above(plane, a), at_b = above(plane, b);
      if (at_a <= 0) next_.push_back(a);
      if ((at_a < 0 && at_b > 0) || (at_a > 0 && at_b < 0)) {
        next_.push_back(a + (b - a) * (at_a / (at_a - at_b)));
      }
    }
    polygon_.swap(next_);
  }

  std::span<const SectionPlane> planes_;
  std::vector<glm::dvec3> polygon_, next_;
};

std::vector<glm::dvec3> Kept::meetings() const {
  std::vector<glm::dvec3> points;
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    for (std::size_t j = i + 1; j < planes_.size(); ++j) {
      for (std::size_t k = j + 1; k < planes_.size(); ++k) {
        const glm::dmat3 normals(planes_[i].normal, planes_[j].normal, planes_[k].normal);
        constexpr double kParallel = 1e-9;
        if (std::abs(glm::determinant(normals)) < kParallel) continue;
        points.push_back(glm::dvec3(planes_[i].offset, planes_[j].offset, planes_[k].offset) *
                         glm::inverse(normals));
      }
    }
  }
  return points;
}

/// The reach of results: bounds from above, exact for unions of solids.
class SceneReach {
 public:
  SceneReach(const FrameFit& fit, std::span<const SectionPlane> planes)
      : fit_(&fit), kept_(planes), meetings_(kept_.meetings()) {}

  [[nodiscard]] FrameReach of(const Bounds& box);
  [[nodiscard]] FrameReach of(const Tree& tree, Tree::NodeId root, const Execution& execution);

 private:
  [[nodiscard]] FrameReach of(const Solid& solid);

  const FrameFit* fit_;
  Kept kept_;
  std::vector<glm::dvec3> meetings_;
};

FrameReach SceneReach::of(const Bounds& box) {
  if (kept_.all() || box.empty()) return fit_->reach(box);
  FrameReach reach = FrameFit::nothing();
  const auto corner = [&](unsigned i) {
    return glm::dvec3((i & 1) != 0 ? box.high.x : box.low.x, (i & 2) != 0 ? box.high.y : box.low.y,
                      (i & 4) != 0 ? box.high.z : box.low.z);
  };
  constexpr unsigned kSides[6][4] = {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                     {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}};
  const auto include = [&](const glm::dvec3& p) { fit_->include(reach, p); };
  for (const auto& side : kSides) {
    kept_.corners({corner(side[0]), corner(side[1]), corner(side[2])}, include);
    kept_.corners({corner(side[0]), corner(side[2]), corner(side[3])}, include);
  }
  for (const glm::dvec3& p : meetings_) {
    if (glm::all(glm::lessThanEqual(box.low, p)) && glm::all(glm::lessThanEqual(p, box.high))) {
      include(p);
    }
  }
  return reach;
}

FrameReach SceneReach::of(const Solid& solid) {
  FrameReach reach = FrameFit::nothing();
  if (!solid.mesh) return reach;
  const glm::dmat4& place = solid.world_from_mesh;
  const std::vector<glm::dvec3>& positions = solid.mesh->positions;
  if (kept_.all()) {
    // Normals in the mesh's own space: no point is moved.
    const glm::dmat3 turn(place);
    const glm::dvec3 moved(place[3]);
    std::array<glm::dvec3, 4> own;
    for (std::size_t side = 0; side < own.size(); ++side) own[side] = fit_->normals()[side] * turn;
    for (const glm::dvec3& p : positions) {
      for (std::size_t side = 0; side < own.size(); ++side) {
        reach[side] = std::max(reach[side], glm::dot(own[side], p));
      }
    }
    for (std::size_t side = 0; side < own.size(); ++side) {
      reach[side] += glm::dot(fit_->normals()[side], moved);
    }
    return reach;
  }
  const auto include = [&](const glm::dvec3& p) { fit_->include(reach, p); };
  const auto world = [&](std::uint32_t vertex) {
    return glm::dvec3(place * glm::dvec4(positions[vertex], 1.0));
  };
  for (const glm::uvec3& t : solid.mesh->triangles) {
    kept_.corners({world(t.x), world(t.y), world(t.z)}, include);
  }
  for (const glm::dvec3& p : meetings_) include(p);
  return reach;
}

FrameReach SceneReach::of(const Tree& tree, Tree::NodeId root, const Execution& execution) {
  if (root == Tree::kNone) return FrameFit::nothing();
  std::vector<FrameReach> all(root + 1);  // operands come before the nodes that use them
  for (Tree::NodeId id = 0; id <= root; ++id) {
    const Tree::Node& node = tree.nodes()[id];
    if (node.operation == Operation::kSolid) {
      if (execution.stop.stop_requested()) return FrameFit::nothing();
      all[id] = of(tree.solids()[node.first]);
      continue;
    }
    const auto operands = tree.operands(id);
    FrameReach reach = operands.empty() ? FrameFit::nothing() : all[operands.front()];
    for (const Tree::NodeId operand : operands) {
      for (std::size_t side = 0; side < reach.size(); ++side) {
        if (node.operation == Operation::kUnion) {
          reach[side] = std::max(reach[side], all[operand][side]);
        } else if (node.operation == Operation::kIntersection) {
          reach[side] = std::min(reach[side], all[operand][side]);
        }
      }
    }
    all[id] = reach;
  }
  return all[root];
}

}  // namespace

Result<void> frame_scene(const Scene& scene, const Bounds& box, std::span<const SectionPlane> cuts,
                         std::span<const Camera> turns, double aspect, Camera& camera,
                         const Execution& execution) {
  if (box.empty()) return {};
  std::vector<SectionPlane> planes;
  for (const SectionPlane& cut : cuts) planes.push_back(facing(cut, camera));
  const glm::dvec3 centre = box.low * 0.5 + box.high * 0.5;
  std::vector<Tree::NodeId> shown = scene.shown;
  if (shown.empty()) shown.push_back(scene.tree.root());
  shown.insert(shown.end(), scene.backgrounds.begin(), scene.backgrounds.end());
  shown.insert(shown.end(), scene.highlights.begin(), scene.highlights.end());
  constexpr double kHuge = std::numeric_limits<double>::max();
  const auto reach_for = [&](const FrameFit& fit) {
    SceneReach of(fit, planes);
    FrameReach reach = FrameFit::nothing();
    for (const Tree::NodeId node : shown) {
      const FrameReach one = of.of(scene.tree, node, execution);
      for (std::size_t side = 0; side < reach.size(); ++side) {
        reach[side] = std::max(reach[side], one[side]);
      }
    }
    if (!(reach[0] + reach[1] + reach[2] + reach[3] > -kHuge)) return fit.reach(box);
    const FrameReach whole = of.of(box);
    for (std::size_t side = 0; side < reach.size(); ++side) {
      reach[side] = std::min(reach[side], whole[side]);
    }
    return reach;
  };
  if (turns.empty()) {
    FrameFit fit(camera, aspect);
    for (int i = 0; i < kNarrowings && fit.narrow(reach_for(fit), centre); ++i) continue;
    fit.place(camera, reach_for(fit), centre);
  } else {
    camera.target = centre;
    double distance = 0;
    for (const Camera& turn : turns) {
      const FrameFit fit(turn, aspect);
      distance = std::max(distance, fit.distance(reach_for(fit), centre));
    }
    if (distance > 0) camera.distance = distance;
  }
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return {};
}

}  // namespace strata::csg
