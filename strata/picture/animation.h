#pragma once

#include <memory>
#include <string>

#include "strata/core/result.h"
#include "strata/picture/pixels.h"

namespace strata {

/// Settings of an animation.
struct AnimationOptions {
  int frames = 1;            ///< pictures that will be added, at least 1
  double fps = 25;           ///< pictures a second, 0.1 to 100; of a .gif up to 50
  bool transparent = false;  ///< the pictures have alpha; a .gif keeps it where it is above a half
  int threads = 0;           ///< as Execution::threads; a folder of PNG files is compressed by them
};

/// Writes pictures of one size one by one, as a file that repeats for ever or as a folder of PNG
/// files. Memory holds a few pictures; of a .webp also what is compressed already. Nothing appears
/// before finish().
class AnimationWriter {
 public:
  virtual ~AnimationWriter() = default;
  /// Adds the next picture. @pre it has the size of the first, and is not beyond options.frames
  /// @return kOutput, kLimit (sides above 65535 pixels, of a .webp 16383)
  virtual Result<void> add(const Picture& picture) = 0;
  /// Completes the file. @pre all pictures were added @return kOutput, kLimit
  virtual Result<void> finish() = 0;
};

/// Whether animations can be written under a name: .gif, .webp, .apng, or a folder, which ends in
/// `/`. @return kUsage for other names and for formats that this build was made without
Result<void> check_animation_name(const std::string& path);

/// Begins an animation. @return kUsage as check_animation_name() and for options out of range;
/// kOutput
Result<std::unique_ptr<AnimationWriter>> create_animation(const std::string& path,
                                                          const AnimationOptions& options);

}  // namespace strata
