#include "picture/studio_lights.h"

namespace strata {
namespace {

struct Light {
  glm::vec3 towards;  ///< the light
  float power;
};
const Light kKey{glm::normalize(glm::vec3(-0.45f, 0.62f, 0.64f)), 0.72f};
const Light kFill{glm::normalize(glm::vec3(0.80f, 0.05f, 0.60f)), 0.22f};
const Light kRim{glm::normalize(glm::vec3(0.35f, 0.70f, -0.62f)), 0.22f};
/// Half way between the key light and the eye.
const glm::vec3 kMirror = glm::normalize(kKey.towards + glm::vec3(0, 0, 1));
constexpr float kGloss = 0.10f;
constexpr float kSky = 0.30f;     ///< light from everywhere, on a face that looks sideways
constexpr float kFromUp = 0.12f;  ///< how much more comes from above, and less from below
/// The part of the three lights that corners keep from a face.
constexpr float kDirectShade = 0.50f;

float toward(const glm::vec3& normal, const Light& light) {
  return light.power * std::max(0.0f, glm::dot(normal, light.towards));
}

}  // namespace

Lit StudioLights::on(const glm::vec3& normal) const {
  float mirrored = std::max(0.0f, glm::dot(normal, kMirror));
  for (int doubling = 0; doubling < 5; ++doubling) mirrored *= mirrored;  // to the power 32
  return {toward(normal, kKey) + toward(normal, kFill) + toward(normal, kRim),
          kSky + kFromUp * glm::dot(normal, up_), kGloss * mirrored};
}

glm::vec3 shaded(const glm::vec3& colour, const Lit& lit, float open) {
  const float shade = 1.0f - kDirectShade * (1.0f - open);
  const float light = lit.direct * shade + lit.ambient * open;
  return colour * std::sqrt(light) + lit.gloss * shade;
}

}  // namespace strata
