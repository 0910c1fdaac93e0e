#include "picture/occlusion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

// Horizons in a depth image, as J. Jimenez, X. Wu, A. Pesce and A. Jarabo, "Practical real-time
// strategies for accurate indirect occlusion" (2016): planes through the ray of the eye, and in
// each of them the cosine-weighted light between two horizons, in closed form. We differ:
// neighbours look in other directions, in squares of 4 x 4 pixels, and the mean over such a square,
// of points that lie in one plane, has 16 times as many directions and shows no pattern.

namespace strata {
namespace {

constexpr int kPlanes = 2;  ///< of one pixel
constexpr int kSteps = 5;   ///< to each side
constexpr int kTurns = 16;  ///< of the planes, in a square of 4 x 4 pixels
/// Sines of points above a face: up to the first nothing is hidden, from the second on all.
constexpr float kFlat = 0.08f, kSteep = 0.20f;
constexpr float kMostPixels = 160.0f;  ///< that a plane is followed to each side
constexpr float kPi = 3.14159265f;

/// Pixel (x, y) of a square: an order in which neighbours are far apart.
constexpr std::array<std::uint8_t, 16> kOrder{0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5};

/// The directions of all planes of a square: half a circle, by pi / 32.
std::array<glm::vec2, kPlanes * kTurns> make_directions() {
  static_assert(kPlanes * kTurns == 32);
  return turned_directions<kPlanes * kTurns>(0.99518472667219688624, 0.09801714032956060199);
}

/// The angle of a cosine, off by less than 1e-4 (M. Abramowitz and I. Stegun, 4.4.45), from
/// arithmetic that is the same on every machine.
float angle_of(float cosine) {
  const float x = std::min(1.0f, std::abs(cosine));
  const float angle =
      std::sqrt(1.0f - x) * (1.5707288f + x * (-0.2121144f + x * (0.0742610f + x * -0.0187293f)));
  return cosine < 0.0f ? kPi - angle : angle;
}

/// Looks around from the pixels of rows.
class Horizons {
 public:
  Horizons(const EyeSurfaces& seen, double radius)
      : seen_(&seen), radius_(static_cast<float>(radius)), directions_(make_directions()) {}

  void row(int y, std::uint8_t* open) const {
    const std::size_t begin = static_cast<std::size_t>(y) * static_cast<std::size_t>(seen_->width);
    for (int x = 0; x < seen_->width; ++x) {
      const std::size_t at = begin + static_cast<std::size_t>(x);
      const bool none = seen_->positions[at].z <= EyeSurfaces::kNowhere.z;
      open[at] = none ? 255 : static_cast<std::uint8_t>(255.0f * pixel(x, y, at) + 0.5f);
    }
  }

 private:
  /// A point that looks around.
  struct Point {
    int x, y;
    glm::vec3 here, normal, to_eye;
    float within;                     ///< 1 / radius squared
    std::array<float, kSteps> steps;  ///< pixels
  };

  [[nodiscard]] float pixel(int x, int y, std::size_t at) const {
    Point point{x, y, seen_->positions[at], seen_->normals[at], {0.0f, 0.0f, 1.0f}, 0.0f, {}};
    auto scale = static_cast<float>(seen_->scale);  // pixels a world unit
    if (seen_->perspective) {
      const double distance = seen_->origin_distance - static_cast<double>(point.here.z);
      scale = static_cast<float>(seen_->scale / distance);
      point.to_eye = glm::normalize(glm::vec3((seen_->centre.x - x - 0.5) / seen_->scale,
                                              (y + 0.5 - seen_->centre.y) / seen_->scale, 1.0));
    }
    const float pixels = std::min(radius_ * scale, kMostPixels);
    point.within = scale * scale / (pixels * pixels);
    const unsigned turn = kOrder[static_cast<unsigned>((y & 3) * 4 + (x & 3))];
    const unsigned shift = kOrder[static_cast<unsigned>((x & 3) * 4 + (y & 3))];
    for (int k = 0; k < kSteps; ++k) {
      const float part =
          (static_cast<float>(k) + 0.2f + 0.05f * static_cast<float>(shift)) / kSteps;
      point.steps[static_cast<std::size_t>(k)] = 1.0f + pixels * part * part;
    }
    float open = 0.0f, all = 0.0f;
    for (unsigned plane = 0; plane < kPlanes; ++plane) {
      add_plane(point, directions_[plane * kTurns + turn], open, all);
    }
    return all > 0.0f ? std::min(1.0f, open / all) : 1.0f;
  }

  /// The light in the plane of the eye's ray and a direction: what comes, and what would.
  void add_plane(const Point& point, const glm::vec2& direction, float& open, float& all) const {
    const glm::vec3 along(direction, 0.0f);
    const glm::vec3 axis = glm::normalize(glm::cross(along, point.to_eye));
    const glm::vec3 projected = point.normal - axis * glm::dot(point.normal, axis);
    const float length = std::sqrt(glm::dot(projected, projected));
    if (!(length > 1e-4f)) return;
    const float cosine = std::clamp(glm::dot(projected, point.to_eye) / length, -1.0f, 1.0f);
    const glm::vec3 across = along - point.to_eye * glm::dot(along, point.to_eye);
    const float side = glm::dot(across, projected) < 0.0f ? -1.0f : 1.0f;
    const float sine = side * std::sqrt(1.0f - cosine * cosine);
    const auto light = [&](float ahead, float behind) {
      // An arc from the horizon behind to the one ahead; angles are those to the eye's ray.
      const auto part = [&](float to, float cos_to) {
        const float sin_to = (to < 0.0f ? -1.0f : 1.0f) * std::sqrt(1.0f - cos_to * cos_to);
        const float twice =
            (2.0f * cos_to * cos_to - 1.0f) * cosine + 2.0f * sin_to * cos_to * sine;
        return cosine + 2.0f * to * sine - twice;
      };
      return length * (part(angle_of(ahead), ahead) + part(-angle_of(behind), behind));
    };
    const float ahead = horizon(point, direction, -sine), behind = horizon(point, -direction, sine);
    all += light(-sine, sine);
    open += light(ahead, behind);
  }

  /// The cosine to the eye's ray of the highest point in a direction. @param flat  of the face
  [[nodiscard]] float horizon(const Point& point, const glm::vec2& direction, float flat) const {
    float highest = flat;
    for (const float step : point.steps) {
      const int u =
          static_cast<int>(std::floor(static_cast<float>(point.x) + 0.5f + direction.x * step));
      const int v = static_cast<int>(  // rows go down
          std::floor(static_cast<float>(point.y) + 0.5f - direction.y * step));
      if (u < 0 || v < 0 || u >= seen_->width || v >= seen_->height) break;
      const glm::vec3 to =
          seen_->positions[static_cast<std::size_t>(v) * static_cast<std::size_t>(seen_->width) +
                           static_cast<std::size_t>(u)] -
          point.here;
      const float above = glm::dot(point.normal, to), far = glm::dot(to, to);
      const float part = far * point.within, near = 1.0f - part * part;
      if (above <= 0.0f || near <= 0.0f) continue;
      const float over = 1.0f / std::sqrt(far);
      const float weight =
          near * std::clamp((above * over - kFlat) * (1.0f / (kSteep - kFlat)), 0.0f, 1.0f);
      const float cosine = std::min(1.0f, glm::dot(to, point.to_eye) * over);
      highest = std::max(highest, flat + (cosine - flat) * weight);
    }
    return highest;
  }

  const EyeSurfaces* seen_;
  float radius_;
  std::array<glm::vec2, kPlanes * kTurns> directions_;
};

/// Means over 5 pixels along rows or columns, of which the ends count half, so that all of the
/// 4 x 4 turns count alike; only of points near the plane of the middle one.
/// @param stride  pixels from one to the next; above 1 of curved surfaces alone
void smooth(const EyeSurfaces& seen, int y, int step_x, int step_y, int stride,
            const std::vector<std::uint8_t>& from, std::vector<std::uint8_t>& to) {
  const auto width = static_cast<std::size_t>(seen.width);
  const std::size_t begin = static_cast<std::size_t>(y) * width;
  constexpr float kWeights[] = {0.5f, 1.0f, 1.0f, 1.0f, 0.5f};
  for (int x = 0; x < seen.width; ++x) {
    const std::size_t at = begin + static_cast<std::size_t>(x);
    const glm::vec3 here = seen.positions[at], normal = seen.normals[at];
    if (here.z <= EyeSurfaces::kNowhere.z) {
      to[at] = 255;
      continue;
    }
    if (stride > 1 && seen.curved[at] == 0) {
      to[at] = from[at];
      continue;
    }
    const double distance = seen.origin_distance - static_cast<double>(here.z);
    const auto pixel = static_cast<float>((seen.perspective ? distance : 1.0) / seen.scale);
    float sum = 0.0f, weights = 0.0f;
    for (int k = -2; k <= 2; ++k) {
      const int u = x + k * stride * step_x, v = y + k * stride * step_y;
      if (u < 0 || v < 0 || u >= seen.width || v >= seen.height) continue;
      const std::size_t there = static_cast<std::size_t>(v) * width + static_cast<std::size_t>(u);
      const float off = std::abs(glm::dot(normal, seen.positions[there] - here));
      const float same = glm::dot(normal, seen.normals[there]);
      const float away = off / (1.5f * static_cast<float>(stride) * pixel);
      float weight = kWeights[k + 2] * std::max(0.0f, 1.0f - away);
      weight *= std::max(0.0f, 4.0f * same - 3.0f);
      if (stride > 1 && seen.curved[there] == 0) weight = 0.0f;
      sum += weight * static_cast<float>(from[there]);
      weights += weight;
    }
    to[at] = static_cast<std::uint8_t>(sum / weights + 0.5f);
  }
}

}  // namespace

void EyeSurfaces::resize(int columns, int rows) {
  width = columns, height = rows;
  const std::size_t count = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  positions.resize(count);
  normals.resize(count);
}

std::vector<std::uint8_t> openness(const EyeSurfaces& surfaces, double radius,
                                   const Execution& execution) {
  std::vector<std::uint8_t> open(surfaces.positions.size(), 255), other(open.size());
  const Horizons horizons(surfaces, radius);
  const auto rows = static_cast<std::size_t>(surfaces.height);
  parallel_for(execution, rows,
               [&](std::size_t y, int) { horizons.row(static_cast<int>(y), open.data()); });
  // Facets of curved surfaces are often as small as a square of turns, and each has a plane of its
  // own: means over ever more of them leave no grain (H. Dammertz, D. Sewtz, J. Hanika and H.
  // Lensch, "Edge-avoiding a-trous wavelet transform", 2010).
  for (const int stride : {1, 2, 4}) {
    if (stride > 1 && surfaces.curved.empty()) break;
    parallel_for(execution, rows, [&](std::size_t y, int) {
      smooth(surfaces, static_cast<int>(y), 1, 0, stride, open, other);
    });
    parallel_for(execution, rows, [&](std::size_t y, int) {
      smooth(surfaces, static_cast<int>(y), 0, 1, stride, other, open);
    });
  }
  return open;
}

}  // namespace strata
