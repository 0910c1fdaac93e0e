#pragma once

#include <memory>
#include <string>

#include "strata/picture/animation.h"

// The formats of animations, one file each, and what they share. Private to picture/.

namespace strata {

Result<std::unique_ptr<AnimationWriter>> create_apng(const std::string& path,
                                                     const AnimationOptions& options);
Result<std::unique_ptr<AnimationWriter>> create_gif(const std::string& path,
                                                    const AnimationOptions& options);
Result<std::unique_ptr<AnimationWriter>> create_webp(const std::string& path,
                                                     const AnimationOptions& options);
Result<std::unique_ptr<AnimationWriter>> create_png_folder(const std::string& path,
                                                           const AnimationOptions& options);

/// A part of a picture, from (left, top) to before (right, bottom).
struct PictureBox {
  int left = 0, top = 0, right = 0, bottom = 0;
};
/// What differs between two pictures of one size: one pixel where nothing does.
[[nodiscard]] PictureBox changed_box(const Picture& before, const Picture& after);
/// All of a picture.
[[nodiscard]] inline PictureBox whole_box(const Picture& picture) {
  return {0, 0, picture.width, picture.height};
}

/// @return kLimit when a side is too long for the format
Result<void> check_side(const std::string& path, const Picture& picture, int most);

}  // namespace strata
