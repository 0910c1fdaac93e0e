#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "strata/core/execution.h"

// How much of its surroundings each visible point sees: ambient occlusion from one layer of depth.

namespace strata {

/// The visible points of a picture in eye space: x right, y up, z towards the eye.
struct EyeSurfaces {
  int width = 0;   ///< pixels
  int height = 0;  ///< pixels; width times height must be below 2^31
  bool perspective = true;
  double scale = 1.0;          ///< pixels a world unit; of a perspective view, at distance 1
  glm::dvec2 centre{0.0};      ///< where the view axis meets the picture, in pixels
  double origin_distance = 0;  ///< of the origin of `positions`, along the view axis
  /// Relative to a point on the view axis, so that floats suffice. kNowhere: nothing is seen.
  /// One more than there are pixels, as of normals.
  std::vector<glm::vec3> positions;
  std::vector<glm::vec3> normals;  ///< of the faces, of length 1, towards the eye
  /// Points of curved surfaces are not 0: their facets are none to be seen. Empty: there are none.
  std::vector<std::uint8_t> curved;

  static constexpr glm::vec3 kNowhere{0.0f, 0.0f, -3e18f};
  void resize(int columns, int rows);
};

/// For each pixel the part of its surroundings, weighted by the cosine, that no visible surface
/// within `radius` (world units) is in the way of: 255 all, 0 nothing. A surface counts the less
/// the farther it is; what rises from a face by less than 5 degrees does not, so a plane sees all,
/// exactly, and facets of a curved surface do not darken each other.
[[nodiscard]] std::vector<std::uint8_t> openness(const EyeSurfaces& surfaces, double radius,
                                                 const Execution& execution = {});

/// The openness of a face at a place between pixels, in pixels of `surfaces`, (0, 0) the middle of
/// the first, in [0, 1]: the mean of the four pixels around, of those most that lie on the face.
/// @param open  as openness() gives it @param normal  of the face
/// @param away  float(const glm::vec3& position): how far from the plane, 1: of no use
template <class Away>
[[nodiscard]] float openness_between(const EyeSurfaces& surfaces,
                                     std::span<const std::uint8_t> open, const glm::dvec2& place,
                                     const glm::vec3& normal, Away&& away) {
  // Cut to whole numbers, which floors them where it matters.
  const int left = std::clamp(static_cast<int>(place.x), 0, surfaces.width - 1);
  const int top = std::clamp(static_cast<int>(place.y), 0, surfaces.height - 1);
  const int right = std::min(left + 1, surfaces.width - 1);
  const int bottom = std::min(top + 1, surfaces.height - 1);
  const auto index = [&](int column, int row) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(surfaces.width) +
           static_cast<std::size_t>(column);
  };
  const std::size_t around[] = {index(left, top), index(right, top), index(left, bottom),
                                index(right, bottom)};
  if ((open[around[0]] & open[around[1]] & open[around[2]] & open[around[3]]) == 255) return 1.0f;
  const auto to_right = static_cast<float>(std::clamp(place.x - left, 0.0, 1.0));
  const auto down = static_cast<float>(std::clamp(place.y - top, 0.0, 1.0));
  const float shares[] = {(1 - to_right) * (1 - down), to_right * (1 - down), (1 - to_right) * down,
                          to_right * down};
  float sum = 0.0f, weights = 0.0f;
  for (int k = 0; k < 4; ++k) {
    const glm::vec3& there = surfaces.positions[around[k]];
    if (there.z <= EyeSurfaces::kNowhere.z) continue;
    const float same = glm::dot(normal, surfaces.normals[around[k]]);
    // Others count a little, for where there is no point of the face.
    const float like = std::max(0.0f, 1.0f - away(there)) * std::max(0.0f, 4.0f * same - 3.0f);
    const float weight = (shares[k] + 0.02f) * (like + 0.002f);
    sum += weight * static_cast<float>(open[around[k]]);
    weights += weight;
  }
  return weights > 0.0f ? sum / (255.0f * weights) : 1.0f;
}

/// Pixels in a row of a picture that has 1 / step pixels where EyeSurfaces has one.
struct PixelRow {
  int u = 0, v = 0;  ///< the first
  float step = 1.0f;
};

/// The plane of a face, where EyeSurfaces has positions.
struct SeenPlane {
  glm::vec3 normal{0.0f};  ///< of length 1, towards the eye
  float offset = 0.0f;     ///< along the normal
};

/// openness_between() for the middles of pixels that show one face, a value each: of no use is
/// what lies two pixels from its plane.
void openness_along(const EyeSurfaces& surfaces, std::span<const std::uint8_t> open,
                    const PixelRow& row, const SeenPlane& plane, std::span<float> values);

/// Directions, each turned from the last by an angle that is given by its cosine and sine: the same
/// on every machine. The first is (1, 0).
template <std::size_t kCount>
[[nodiscard]] std::array<glm::vec2, kCount> turned_directions(double cosine, double sine) {
  std::array<glm::vec2, kCount> directions;
  glm::dvec2 at(1, 0);
  for (glm::vec2& direction : directions) {
    direction = at;
    at = {at.x * cosine - at.y * sine, at.x * sine + at.y * cosine};
  }
  return directions;
}

}  // namespace strata
