// Checks and warnings for solids that are far larger than the others.
#include "csg/scene/vast_solids.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <set>
#include <unordered_map>

#include "mesh/clamp.h"

namespace strata::csg {
namespace {

/// Results beyond this could not be viewed or measured: cameras and volumes multiply lengths.
constexpr double kMostResult = 1e100;
/// Solids below this size are always exact enough.
constexpr double kFar = 1e8;

double largest(const glm::dvec3& p) {
  return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
}

double largest(const Bounds& box) { return std::max(largest(box.low), largest(box.high)); }

/// Whether a face that is not parallel to two axes passes through `box`, or may pass through it
/// given an error of `error`. @param reach  largest coordinate of the solid
bool has_skew_face(const Solid& solid, const Bounds& box, double error, double reach) {
  const glm::dvec3 middle = 0.5 * (box.low + box.high) / reach;
  const double within = (glm::length((box.high - box.low) / reach) + error / reach);
  for (const glm::uvec3& t : solid.mesh->triangles) {
    glm::dvec3 p[3];
    for (int k = 0; k < 3; ++k) {
      p[k] =
          glm::dvec3(solid.world_from_mesh * glm::dvec4(solid.mesh->positions[t[k]], 1.0)) / reach;
    }
    bool along_axes = false;
    for (int axis = 0; axis < 3; ++axis) {
      along_axes |= p[0][axis] == p[1][axis] && p[1][axis] == p[2][axis];
    }
    if (along_axes) continue;
    const glm::dvec3 across = glm::cross(p[1] - p[0], p[2] - p[0]);
    if (std::abs(glm::dot(across, middle - p[0])) <= within * glm::length(across)) return true;
  }
  return false;
}

/// An upper bound of each solid's coordinates.
std::vector<double> reaches_of(const Tree& tree) {
  std::unordered_map<const TriangleSoup*, double> sizes;  // the largest coordinate of each mesh
  std::vector<double> reaches;
  for (const Solid& solid : tree.solids()) {
    reaches.push_back(0.0);
    if (!solid.mesh) continue;
    const auto [size, is_new] = sizes.try_emplace(solid.mesh.get(), 0.0);
    if (is_new) {
      for (const glm::dvec3& p : solid.mesh->positions) {
        size->second = std::max(size->second, std::isnan(p.x + p.y + p.z) ? HUGE_VAL : largest(p));
      }
    }
    const glm::dmat4& m = solid.world_from_mesh;
    for (int i = 0; i < 3; ++i) {
      const double turned = std::abs(m[0][i]) + std::abs(m[1][i]) + std::abs(m[2][i]);
      const double reach = turned * size->second + std::abs(m[3][i]);
      reaches.back() = std::max(reaches.back(), std::isnan(reach) ? HUGE_VAL : reach);
    }
  }
  return reaches;
}

/// The place and the kind of a solid, from its name `cube at file:line:column`.
std::string named(const Solid& solid) {
  const std::size_t at = solid.name.find(" at ");
  return fmt::format("{}: '{}'", at != std::string::npos ? solid.name.substr(at + 4) : "scene",
                     solid.name.substr(0, at));
}

Error too_far(const Solid& solid, double reach, std::string_view what, double limit) {
  return {
      ErrorCode::kGeometry,
      fmt::format("{} has coordinates {}; in a {} they must be below {:g}", named(solid),
                  std::isfinite(reach) ? fmt::format("of about {:.3g}", reach) : "beyond 1e+308",
                  what, limit)};
}

}  // namespace

Result<void> check_coordinates(Scene& scene) {
  const Tree& tree = scene.tree;
  const std::vector<double> reaches = reaches_of(tree);
  double farthest = 0;
  for (std::size_t i = 0; i < reaches.size(); ++i) {
    farthest = std::max(farthest, reaches[i]);
    if (reaches[i] < kMostClamped) continue;
    return tl::unexpected(too_far(tree.solids()[i], reaches[i], "solid", kMostClamped));
  }
  if (farthest < kFar) return {};
  std::vector<Bounds> boxes;
  for (const Solid& solid : tree.solids()) boxes.push_back(bounds(solid));
  const std::vector<ActiveBox> active = active_boxes(tree, boxes);
  std::set<std::string> told;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Solid& solid = tree.solids()[i];
    if (boxes[i].empty() || active[i].box.empty()) continue;
    const Bounds own{glm::max(boxes[i].low, active[i].box.low),
                     glm::min(boxes[i].high, active[i].box.high)};
    if (!active[i].subtracted && !(largest(own) < kMostResult)) {
      return tl::unexpected(too_far(solid, reaches[i], "result", kMostResult));
    }
    const double reach = largest(boxes[i]), error = reach * 0x1p-52;
    const double size = active[i].box.longest_side();
    if (!(error > scene.relative_precision * size)) continue;
    if (!has_skew_face(solid, active[i].box, error, reach) || !told.insert(solid.name).second) {
      continue;
    }
    scene.warnings.push_back(
        {"approximate",
         fmt::format("{} has coordinates up to {:.3g}; its sloping faces are exact to about "
                     "{:.2g}, but the solids that they meet are only {:.3g} long",
                     named(solid), reach, error, size)});
  }
  return {};
}

}  // namespace strata::csg
