#include "picture/studio_lights.h"

namespace strata {
namespace studio {

const Light kKey{glm::normalize(glm::vec3(-0.45f, 0.62f, 0.64f)), 0.72f};
const Light kFill{glm::normalize(glm::vec3(0.80f, 0.05f, 0.60f)), 0.22f};
const Light kRim{glm::normalize(glm::vec3(0.35f, 0.70f, -0.62f)), 0.22f};
const glm::vec3 kMirror = glm::normalize(kKey.towards + glm::vec3(0, 0, 1));

}  // namespace studio

using namespace studio;
namespace {

float toward(const glm::vec3& normal, const Light& light) {
  return light.power * std::max(0.0f, glm::dot(normal, light.towards));
}

}  // namespace

Lit StudioLights::on(const glm::vec3& normal) const {
  float mirrored = std::max(0.0f, glm::dot(normal, kMirror));
  for (int i = 0; i < kGlossDoublings; ++i) mirrored *= mirrored;
  return {toward(normal, kKey) + toward(normal, kFill) + toward(normal, kRim),
          kSky + kFromUp * glm::dot(normal, up_), kGloss * mirrored};
}

glm::vec3 shaded(const glm::vec3& colour, const Lit& lit, float open) {
  const float shade = 1.0f - kDirectShade * (1.0f - open);
  const float light = lit.direct * shade + lit.ambient * open;
  return colour * std::sqrt(light) + lit.gloss * shade;
}

}  // namespace strata
