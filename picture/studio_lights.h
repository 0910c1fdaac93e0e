#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

// The light of the scheme Neutral: a key light, a fill light and a rim light of the eye, and light
// from everywhere, more of it from above. Eye space: x right, y up, z towards the eye.
// Arithmetic is exactly rounded (no powers, no angles), so pictures have the same bytes everywhere.

namespace strata {

/// The light that falls on a face.
struct Lit {
  float direct = 0;   ///< of the three lights
  float ambient = 0;  ///< from everywhere, where nothing is in the way
  float gloss = 0;    ///< what is added to the colour where the key light is mirrored
};

/// Three lights and a sky.
class StudioLights {
 public:
  /// @param up  of the world, in eye space, of length 1
  explicit StudioLights(const glm::vec3& up) : up_(up) {}

  /// @param normal  of a face towards the side that is seen, of length 1
  [[nodiscard]] Lit on(const glm::vec3& normal) const;

 private:
  glm::vec3 up_;
};

/// A colour in its light. Light is summed as energy; the square root is nearly the curve of sRGB.
/// @param open  the part of the surroundings that nothing is in the way of, in [0, 1]
[[nodiscard]] glm::vec3 shaded(const glm::vec3& colour, const Lit& lit, float open);

}  // namespace strata
