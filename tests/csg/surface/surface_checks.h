#pragma once

// Visible surfaces compared: with each other, and with rays in double precision.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <optional>
#include <string>
#include <vector>

#include "strata/csg/surface/surface_image.h"
#include "strata/csg/tree.h"
#include "strata/raster/view.h"
#include "tests/csg/random_tree.h"

namespace strata::csg {

/// Compares all three planes, where something is seen. @return how many pixels show something
inline std::size_t expect_same_surface(const SurfaceImage& found, const SurfaceImage& expected,
                                       const std::string& what) {
  EXPECT_EQ(found.depth.size(), expected.depth.size()) << what;
  if (found.depth.size() != expected.depth.size()) return 0;
  std::size_t different = 0, covered = 0;
  for (std::size_t i = 0; i < expected.depth.size(); ++i) {
    const SurfaceImage &a = found, &b = expected;
    if (a.depth[i] == SurfaceImage::kNone && b.depth[i] == SurfaceImage::kNone) continue;
    ++covered;
    if (a.depth[i] == b.depth[i] && a.solid[i] == b.solid[i] && a.triangle[i] == b.triangle[i]) {
      continue;
    }
    if (++different > 3) continue;
    const auto width = static_cast<std::size_t>(expected.width);
    ADD_FAILURE() << what << ": pixel " << i % width << ", " << i / width << " shows depth "
                  << a.depth[i] << " solid " << a.solid[i] << " triangle " << a.triangle[i]
                  << ", expected " << b.depth[i] << " " << b.solid[i] << " " << b.triangle[i];
  }
  EXPECT_EQ(different, 0u) << what << ", of " << covered << " covered";
  return covered;
}

/// Somewhere among the solids of a RandomTree, looking anywhere.
inline Camera random_camera_inside(csg::RandomTree& random) {
  Camera camera = look_at({random.real(-6, 6), random.real(-6, 6), random.real(-6, 6)},
                          {random.real(-6, 6), random.real(-6, 6), random.real(-6, 6)});
  camera.field_of_view = 60;
  return camera;
}

inline Camera random_camera(RandomTree& random, const Bounds& box) {
  Camera camera;
  camera.projection = random.pick(0, 1) == 0 ? Projection::kPerspective : Projection::kOrthographic;
  centre_camera(camera, box);
  fit_camera(camera, box);
  camera.rotation = {random.real(0, 180), random.real(0, 360), random.real(0, 360)};
  return camera;
}

/// World position at a depth of a view, u and v in pixels from the corner.
inline glm::dvec3 position(const View& view, double u, double v, double depth) {
  const double distance = view.distance(depth);
  const glm::dmat4 image_from_eye = view.image_from_world * glm::inverse(view.eye_from_world);
  const double w = view.perspective ? distance : 1.0;
  const double x = (u - view.size.x / 2.0) * w / image_from_eye[0][0];
  const double y = (v - view.size.y / 2.0) * w / image_from_eye[1][1];
  return glm::dvec3(glm::inverse(view.eye_from_world) * glm::dvec4(x, y, -distance, 1.0));
}

/// What rays in double precision meet: every triangle is met one by one, the tree is evaluated by
/// recursion between all crossings. Shares no code with what it checks, and knows no lattice.
class RayOracle {
 public:
  RayOracle(const Tree& tree, const View& view) : tree_(tree), view_(view) {
    for (const Solid& solid : tree.solids()) {
      std::vector<glm::dvec3> corners;
      for (const glm::dvec3& p : solid.mesh->positions) {
        corners.emplace_back(solid.world_from_mesh * glm::dvec4(p, 1.0));
      }
      corners_.push_back(std::move(corners));
    }
  }

  /// Whether a pixel shows what a ray meets that passes within a 64th of a pixel of its centre, to
  /// a quarter of a pixel and a depth step. The snap moves corners by half a 256th of a pixel along
  /// each axis, so outlines by less than a 64th, and a face by that times its slope, which the rays
  /// around the centre have, too.
  [[nodiscard]] bool agrees(int u, int v, std::uint32_t depth) const {
    constexpr double kShift = 1.0 / 64;
    const double at = depth == SurfaceImage::kNone ? kPictureDepthLimit / 2.0 : depth + 0.5;
    double low = 1e300, high = -1e300;
    for (const glm::ivec2& to :
         {glm::ivec2(0, 0), {1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}}) {
      const double x = u + 0.5 + kShift * to.x, y = v + 0.5 + kShift * to.y;
      const glm::dvec3 from = position(view_, x, y, 0);
      const glm::dvec3 along = glm::normalize(position(view_, x, y, kPictureDepthLimit) - from);
      const glm::dvec3 seen = position(view_, x, y, at);
      const double pixel = glm::distance(position(view_, x + 1, y, at), seen);
      const auto met = first_inside(from, along, pixel / 100);
      if (!met) {
        if (depth == SurfaceImage::kNone) return true;
        continue;
      }
      if (depth == SurfaceImage::kNone) continue;
      const double shown = glm::dot(seen - from, along);
      low = std::min(low, *met - shown);
      high = std::max(high, *met - shown);
      const double step = std::abs(view_.distance(depth + 1.0) - view_.distance(depth));
      if (low < pixel / 4 + step && high > -pixel / 4 - step) return true;
    }
    return false;
  }

 private:
  struct Crossing {
    double distance;
    std::uint32_t solid;
    int turn;  ///< of the winding number
  };

  void meet(std::uint32_t index, const glm::dvec3& from, const glm::dvec3& along,
            std::vector<Crossing>& out) const {
    const Solid& solid = tree_.solids()[index];
    const std::vector<glm::dvec3>& corners = corners_[index];
    const double mirrored = glm::determinant(glm::dmat3(solid.world_from_mesh)) < 0 ? -1.0 : 1.0;
    for (const glm::uvec3& t : solid.mesh->triangles) {
      const glm::dvec3 a = corners[t.x], e = corners[t.y] - a, f = corners[t.z] - a;
      const glm::dvec3 q = glm::cross(along, f);
      const double area = glm::dot(e, q);
      if (area == 0) continue;
      const glm::dvec3 to = from - a, r = glm::cross(to, e);
      const double s = glm::dot(to, q) / area, w = glm::dot(along, r) / area;
      if (s < 0 || w < 0 || s + w > 1) continue;
      out.push_back({glm::dot(f, r) / area, index, area * mirrored > 0 ? 1 : -1});
    }
  }

  /// The distance where the tree is true first for longer than `least`; where it is true from the
  /// beginning of the ray, the distance where that ends.
  [[nodiscard]] std::optional<double> first_inside(const glm::dvec3& from, const glm::dvec3& along,
                                                   double least) const {
    std::vector<Crossing> met;
    for (std::uint32_t i = 0; i < tree_.solids().size(); ++i) meet(i, from, along, met);
    std::sort(met.begin(), met.end(),
              [](const Crossing& a, const Crossing& b) { return a.distance < b.distance; });
    std::vector<int> windings(tree_.solids().size(), 0);
    std::optional<double> begin;
    for (const Crossing& one : met) {
      windings[one.solid] += one.turn;
      const bool inside =
          evaluate(tree_, tree_.root(), [&](std::uint32_t s) { return windings[s] > 0; });
      if (inside && !begin) begin = one.distance;
      if (inside || !begin) continue;
      if (one.distance > 0) {
        if (*begin < 0) return one.distance;
        if (one.distance - *begin > least) return begin;
      }
      begin.reset();
    }
    return std::nullopt;
  }

  const Tree& tree_;
  const View& view_;
  std::vector<std::vector<glm::dvec3>> corners_;
};

}  // namespace strata::csg
