#pragma once

#include <glm/vec3.hpp>
#include <memory>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/transparency/media/media.h"

namespace strata::transparency {

struct ShadowMapData;

/// The shadows of a scene with media, in colours: for each pixel of a picture seen from the light,
/// the list of all surfaces, media and particles in the way. A surface of opacity a and colour c
/// lets (1 - a) (1 - a + a c) of the light through: all of it for opacity 0, none for opacity 1.
/// A map serves as long as the light and the scene stay as they are. Several threads may ask.
class ShadowMap {
 public:
  /// A light far away has one map that holds the whole scene; a light at a point has six, the sides
  /// of a cube about it. @return kUsage (settings), kGeometry, kLimit, kCancelled
  static Result<ShadowMap> make(const Scene& scene, const MediaSettings& settings,
                                const Execution& execution = {});

  /// The part of the light that reaches a point in space; red, green and blue in [0, 1].
  [[nodiscard]] glm::vec3 transmittance(const glm::dvec3& point) const;
  /// The part that reaches a point of a surface, which does not lie in its own shadow: what is
  /// compared is where the light's ray through the middle of the pixel meets the surface's plane.
  /// @param normal  of the surface, of any length
  [[nodiscard]] glm::vec3 transmittance(const glm::dvec3& point, const glm::dvec3& normal) const;

 private:
  explicit ShadowMap(std::shared_ptr<const ShadowMapData> data) : data_(std::move(data)) {}
  std::shared_ptr<const ShadowMapData> data_;
};

}  // namespace strata::transparency
