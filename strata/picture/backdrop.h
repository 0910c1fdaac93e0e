#pragma once

#include <glm/vec3.hpp>

#include "strata/picture/pixels.h"

namespace strata {

/// What a picture shows behind everything else: nothing, a colour, or a gradient downwards.
struct Backdrop {
  Rgba top{0};     ///< of the first row; alpha is 0 or 255
  Rgba bottom{0};  ///< of the last row, with the same alpha

  /// The colour of a row of a picture of `height` rows.
  [[nodiscard]] Rgba at(int row, int height) const;
  /// Nothing is behind the picture: its alpha is 0 where it is empty.
  [[nodiscard]] bool transparent() const { return top.a == 0; }
};

/// One colour.
[[nodiscard]] inline Backdrop plain_backdrop(const glm::u8vec3& colour) {
  return {Rgba(colour, 255), Rgba(colour, 255)};
}
/// From a lighter to a darker tone of a colour.
[[nodiscard]] Backdrop gradient_backdrop(const glm::u8vec3& colour);

/// Puts a backdrop behind a picture; the result is opaque unless the backdrop is transparent.
void lay_over(Picture& picture, const Backdrop& backdrop);

}  // namespace strata
