#pragma once

#include <cmath>
#include <glm/vec3.hpp>

namespace strata {

/// Where colours that look equally different are equally far from each other.
/// (Bjorn Ottosson. A perceptual color space for image processing. 2020.) @param light of red,
/// green and blue, 0 to 1 (Internal to voxelize/.)
inline glm::vec3 oklab(const glm::dvec3& light) {
  const double l =
      std::cbrt(0.4122214708 * light.x + 0.5363325363 * light.y + 0.0514459929 * light.z);
  const double m =
      std::cbrt(0.2119034982 * light.x + 0.6806995451 * light.y + 0.1073969566 * light.z);
  const double s =
      std::cbrt(0.0883024619 * light.x + 0.2817188376 * light.y + 0.6299787005 * light.z);
  return {static_cast<float>(0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s),
          static_cast<float>(1.9779984951 * l - 2.4285922050 * m + 0.4505937099 * s),
          static_cast<float>(0.0259040371 * l + 0.7827717662 * m - 0.8086757660 * s)};
}

}  // namespace strata
