#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

// The light of the scheme Neutral: a key light, a fill light and a rim light of the eye, and light
// from everywhere, more of it from above. Eye space: x right, y up, z towards the eye.
// Arithmetic is exactly rounded (no powers, no angles), so pictures have the same bytes everywhere.

namespace strata {

/// What the lights are made of.
namespace studio {

struct Light {
  glm::vec3 towards;  ///< the light
  float power;
};
extern const Light kKey, kFill, kRim;
/// Half way between the key light and the eye.
extern const glm::vec3 kMirror;
constexpr float kGloss = 0.10f;
constexpr int kGlossDoublings = 5;  ///< of the power of the cosine to the mirror: 32
constexpr float kSky = 0.30f;       ///< light from everywhere, on a face that looks sideways
constexpr float kFromUp = 0.12f;    ///< how much more comes from above, and less from below
/// The part of the three lights that corners keep from a face.
constexpr float kDirectShade = 0.50f;

}  // namespace studio

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
  [[nodiscard]] const glm::vec3& up() const { return up_; }

 private:
  glm::vec3 up_;
};

/// A colour in its light. Light is summed as energy; the square root is nearly the curve of sRGB.
/// @param open  the part of the surroundings that nothing is in the way of, in [0, 1]
[[nodiscard]] glm::vec3 shaded(const glm::vec3& colour, const Lit& lit, float open);

}  // namespace strata
