#include "transparency/gl/image_set.h"

#include <epoxy/gl.h>

#include <vector>

#include "strata/gl/context.h"
#include "strata/gl/shader_program.h"

namespace strata::transparency {

void ImageSet::reset() noexcept {
  if (framebuffer_ != 0) glDeleteFramebuffers(1, &framebuffer_);
  if (texture_ != 0) glDeleteTextures(1, &texture_);
  framebuffer_ = texture_ = 0;
}

Result<void> ImageSet::make(unsigned format, std::uint32_t width, std::uint32_t height, int count) {
  if (texture_ != 0 && format == format_ && width == width_ && height == height_ &&
      count == count_) {
    return {};
  }
  reset();
  format_ = format, width_ = width, height_ = height, count_ = count;
  glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &texture_);
  glTextureStorage3D(texture_, 1, format, static_cast<GLsizei>(width), static_cast<GLsizei>(height),
                     count);
  glTextureParameteri(texture_, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTextureParameteri(texture_, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glCreateFramebuffers(1, &framebuffer_);
  std::vector<GLenum> images;
  for (int i = 0; i < count; ++i) {
    const auto attachment = static_cast<GLenum>(GL_COLOR_ATTACHMENT0 + i);
    glNamedFramebufferTextureLayer(framebuffer_, attachment, texture_, 0, i);
    images.push_back(attachment);
  }
  glNamedFramebufferDrawBuffers(framebuffer_, count, images.data());
  if (auto good = gl::check_errors("images"); !good) return good;
  if (glCheckNamedFramebufferStatus(framebuffer_, GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    return fail(ErrorCode::kLimit, "the driver cannot draw into {} images of {} x {} pixels", count,
                width, height);
  }
  return {};
}

void ImageSet::clear(int image, const glm::vec4& value) const {
  const float values[4] = {value.x, value.y, value.z, value.w};
  glClearNamedFramebufferfv(framebuffer_, GL_COLOR, image, values);
}

void ImageSet::bind_as_texture(unsigned binding) const {
  glTextureBarrier();
  glBindTextureUnit(binding, texture_);
}

}  // namespace strata::transparency
