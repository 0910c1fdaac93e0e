#include "csg/picture/view_openness.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <iterator>

namespace strata::csg {
namespace {

/// How far around it a point looks, as a part of the diagonal of what is seen.
constexpr double kReach = 0.15;

double step_of(const glm::ivec2& size) {
  constexpr int kSmall = 384, kMost = 1024;
  const int longest = std::max(size.x, size.y);
  if (longest <= kSmall) return 1.0;
  return std::min(0.5, static_cast<double>(kMost) / longest);
}

/// The diagonal of the box around all visible points.
double extent(const EyeSurfaces& seen, const Execution& execution) {
  const auto width = static_cast<std::size_t>(seen.width);
  const auto rows = static_cast<std::size_t>(seen.height);
  std::vector<glm::vec3> lows(rows, glm::vec3(3e38f)), highs(rows, glm::vec3(-3e38f));
  parallel_for(execution, rows, [&](std::size_t row, int) {
    for (std::size_t i = row * width; i < (row + 1) * width; ++i) {
      if (seen.positions[i].z <= EyeSurfaces::kNowhere.z) continue;
      lows[row] = glm::min(lows[row], seen.positions[i]);
      highs[row] = glm::max(highs[row], seen.positions[i]);
    }
  });
  glm::vec3 low(3e38f), high(-3e38f);
  for (std::size_t row = 0; row < rows; ++row) {
    low = glm::min(low, lows[row]);
    high = glm::max(high, highs[row]);
  }
  return high.x >= low.x ? glm::length(glm::dvec3(high) - glm::dvec3(low)) : 0.0;
}

/// Distances along the view axis, finer than the steps of depth are where a scene is vast.
class FaceDistance {
 public:
  explicit FaceDistance(const View& view) : view_(&view) {
    const double range = view.perspective ? 1.0 / view.near - 1.0 / view.far : view.far - view.near;
    step_ = range / kPictureDepthLimit;
  }
  /// Of the plane of a face where the ray through (x, y) meets it, at most two steps from `depth`.
  /// (x, y) is in world units, for a perspective view at distance 1.
  [[nodiscard]] double at(double depth, double x, double y, const glm::dvec3& normal,
                          double offset) const {
    const double distance = view_->distance(depth + 0.5);
    const double reach = 2.0 * step_ * (view_->perspective ? distance * distance : 1.0);
    const double sideways = normal.x * x + normal.y * y;
    const double exact =
        view_->perspective ? offset / (sideways - normal.z) : (sideways - offset) / normal.z;
    if (!std::isfinite(exact)) return distance;
    return std::clamp(exact, distance - reach, distance + reach);
  }

 private:
  const View* view_;
  double step_;  ///< of the distance, or of its reciprocal
};

}  // namespace

View ViewOpenness::reduced(const View& whole) {
  const double step = step_of(whole.size);
  View view = whole;
  view.size = glm::max(glm::ivec2(glm::ceil(glm::dvec2(whole.size) * step)), glm::ivec2(1));
  for (int column = 0; column < 4; ++column) {
    view.image_from_world[column].x *= step;
    view.image_from_world[column].y *= step;
  }
  return view;
}

ViewOpenness::ViewOpenness(const View& whole, const SurfaceImage& image, const Geometry& geometry,
                           const SolidNormals& normals, const Execution& execution)
    : step_(static_cast<float>(step_of(whole.size))) {
  const View view = reduced(whole);
  const glm::dmat4 image_from_eye = view.image_from_world * glm::inverse(view.eye_from_world);
  const glm::dvec4& axis = image_from_eye[view.perspective ? 2 : 3];
  surfaces_.perspective = view.perspective;
  surfaces_.scale = image_from_eye[0][0];
  surfaces_.centre = glm::dvec2(axis) / axis.w;
  // Floats are finest near the origin, and pixels where surfaces are nearest.
  const auto nearest = std::min_element(image.depth.begin(), image.depth.end());
  surfaces_.origin_distance = nearest != image.depth.end() ? view.distance(*nearest) : view.near;
  surfaces_.resize(image.width, image.height);
  if (!normals.empty()) surfaces_.curved.assign(image.depth.size(), 0);
  const auto width = static_cast<std::size_t>(image.width);
  const glm::dmat3 eye_from_world(view.eye_from_world);
  const FaceDistance face_distance(view);
  parallel_for(execution, static_cast<std::size_t>(image.height), [&](std::size_t v, int) {
    std::uint32_t solid = SurfaceImage::kNone, face = 0;
    glm::dvec3 normal(0.0, 0.0, 1.0);
    double offset = 0.0;  // of the face's plane
    bool curved = false;
    for (std::size_t u = 0; u < width; ++u) {
      const std::size_t i = v * width + u;
      surfaces_.positions[i] = EyeSurfaces::kNowhere;
      surfaces_.normals[i] = {0.0f, 0.0f, 1.0f};
      if (image.depth[i] == SurfaceImage::kNone) continue;
      if (image.solid[i] != solid || image.triangle[i] != face) {
        solid = image.solid[i], face = image.triangle[i];
        const Geometry::Part& part = geometry.parts()[solid];
        const glm::uvec3& t = part.triangles[face & ~SurfaceImage::kExit];
        const glm::dvec3& a = part.positions[t.x];
        glm::dvec3 across = eye_from_world * part.across(face & ~SurfaceImage::kExit);
        if ((face & SurfaceImage::kExit) != 0) across = -across;
        const double length = glm::length(across);
        normal = length > 0 ? across / length : glm::dvec3(0, 0, 1);
        offset = glm::dot(normal, glm::dvec3(view.eye_from_world * glm::dvec4(a, 1.0)));
        const CornerNormals* of = normals.of(solid);
        curved = of != nullptr && !of->flat(face & ~SurfaceImage::kExit);
      }
      const double x = (static_cast<double>(u) + 0.5 - surfaces_.centre.x) / surfaces_.scale;
      const double y = (surfaces_.centre.y - static_cast<double>(v) - 0.5) / surfaces_.scale;
      const double distance = face_distance.at(image.depth[i], x, y, normal, offset);
      const double wide = view.perspective ? distance : 1.0;
      surfaces_.positions[i] = {x * wide, y * wide, surfaces_.origin_distance - distance};
      surfaces_.normals[i] = normal;
      if (curved) surfaces_.curved[i] = 1;
    }
  });
  if (std::ranges::count(surfaces_.curved, 0) == std::ssize(surfaces_.curved)) {
    surfaces_.curved.clear();
  }
  const double reach = kReach * extent(surfaces_, execution);
  if (reach > 0) open_ = openness(surfaces_, reach, execution);
}

SeenPlane ViewOpenness::plane(const glm::dvec3& normal, const glm::dvec3& point) const {
  const glm::dvec3 from_origin = point + glm::dvec3(0, 0, surfaces_.origin_distance);
  return {glm::vec3(normal), static_cast<float>(glm::dot(normal, from_origin))};
}

void ViewOpenness::along(int u, int v, const SeenPlane& plane, std::span<float> values) const {
  // Pixels at edges come alone, and a vector costs as much as these.
  constexpr std::size_t kFew = 2;
  if (values.size() > kFew) return openness_along(surfaces_, open_, {u, v, step_}, plane, values);
  const auto away = [&](const glm::vec3& there) {
    const auto distance =
        static_cast<float>(surfaces_.origin_distance - static_cast<double>(there.z));
    const float pixel =
        (surfaces_.perspective ? distance : 1.0f) / static_cast<float>(surfaces_.scale);
    return std::abs(glm::dot(plane.normal, there) - plane.offset) / (2.0f * pixel);
  };
  for (float& value : values) {
    const glm::dvec2 between(place(u++), place(v));
    value = openness_between(surfaces_, open_, between, plane.normal, away);
  }
}

bool ViewOpenness::open_along(int u, int v, int count) const {
  // What along() looks at.
  const auto first = [&](int pixel, int end) {
    return std::clamp(static_cast<int>(place(pixel)), 0, end - 1);
  };
  const int left = first(u, surfaces_.width), top = first(v, surfaces_.height);
  const int right = std::min(first(u + count - 1, surfaces_.width) + 1, surfaces_.width - 1);
  const int bottom = std::min(top + 1, surfaces_.height - 1);
  const auto row = [&](int y) { return open_.data() + std::ptrdiff_t{y} * surfaces_.width; };
  int all = 255;
  for (int x = left; x <= right; ++x) all &= row(top)[x] & row(bottom)[x];
  return all == 255;
}

}  // namespace strata::csg
