#pragma once

#include <glm/vec2.hpp>

#include "strata/core/result.h"
#include "strata/csg/picture/picture.h"

namespace strata::view {

/// A rectangle of the window in pixels, from its upper left corner.
struct Area {
  glm::ivec2 at{0}, size{0};
};

/// Shows pictures in the window: a texture that is copied to the framebuffer, pixel by pixel where
/// sizes agree, so that what is seen is what was drawn. Needs its context, also when it ends.
class Canvas {
 public:
  Canvas() = default;
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;
  ~Canvas();

  /// Draws something small in each way that draw() knows, so that software renderers compile their
  /// code (a fifth of a second) before a hand waits for it.
  void warm_up();

  /// Takes a picture over.
  void upload(const csg::Picture& picture);
  /// Clears the window and puts the picture into `area`. A picture of another size is scaled.
  void draw(const Area& area, const glm::ivec2& window, const glm::u8vec3& background) const;

 private:
  unsigned texture_ = 0, framebuffer_ = 0;
  glm::ivec2 size_{0};
};

/// What the back buffer holds.
[[nodiscard]] csg::Picture read_back(const Area& area, const glm::ivec2& window);

}  // namespace strata::view
