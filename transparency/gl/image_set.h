#pragma once

#include <cstdint>
#include <glm/vec4.hpp>

#include "strata/core/result.h"

// Private to transparency/gl/.

namespace strata::transparency {

/// A framebuffer with images of one size, which are the layers of one texture.
class ImageSet {
 public:
  ImageSet() = default;
  ~ImageSet() { reset(); }
  ImageSet(const ImageSet&) = delete;
  ImageSet& operator=(const ImageSet&) = delete;

  /// Makes images of an OpenGL format; those of an earlier call go if they differ. @return kLimit
  /// without the memory
  [[nodiscard]] Result<void> make(unsigned format, std::uint32_t width, std::uint32_t height,
                                  int count);
  void clear(int image, const glm::vec4& value) const;
  [[nodiscard]] unsigned framebuffer() const { return framebuffer_; }
  /// As a sampler2DArray of that binding.
  void bind_as_texture(unsigned binding) const;

 private:
  void reset() noexcept;

  unsigned framebuffer_ = 0, texture_ = 0, format_ = 0;
  std::uint32_t width_ = 0, height_ = 0;
  int count_ = 0;
};

}  // namespace strata::transparency
