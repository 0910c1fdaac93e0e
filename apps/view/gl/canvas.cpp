#include "apps/view/gl/canvas.h"

#include <epoxy/gl.h>

#include <algorithm>

namespace strata::view {

Canvas::~Canvas() {
  if (framebuffer_ != 0) glDeleteFramebuffers(1, &framebuffer_);
  if (texture_ != 0) glDeleteTextures(1, &texture_);
}

void Canvas::warm_up() {
  upload({2, 2, std::vector<csg::Rgba>(4, csg::Rgba(0, 0, 0, 255))});
  for (const int side : {2, 5}) draw({{0, 0}, {side, side}}, {side, side}, {});
}

void Canvas::upload(const csg::Picture& picture) {
  const glm::ivec2 size(picture.width, picture.height);
  if (size != size_ || texture_ == 0) {
    if (texture_ != 0) glDeleteTextures(1, &texture_);
    if (framebuffer_ == 0) glCreateFramebuffers(1, &framebuffer_);
    glCreateTextures(GL_TEXTURE_2D, 1, &texture_);
    glTextureStorage2D(texture_, 1, GL_RGBA8, size.x, size.y);
    glNamedFramebufferTexture(framebuffer_, GL_COLOR_ATTACHMENT0, texture_, 0);
    size_ = size;
  }
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glTextureSubImage2D(texture_, 0, 0, 0, size.x, size.y, GL_RGBA, GL_UNSIGNED_BYTE,
                      picture.pixels.data());
}

void Canvas::draw(const Area& area, const glm::ivec2& window, const glm::u8vec3& background) const {
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glDisable(GL_SCISSOR_TEST);
  glViewport(0, 0, window.x, window.y);
  glClearColor(background.r / 255.0f, background.g / 255.0f, background.b / 255.0f, 1.0f);
  glClear(GL_COLOR_BUFFER_BIT);
  if (texture_ == 0 || area.size.x < 1 || area.size.y < 1) return;
  // Rows of the texture go down, those of the window up.
  const int top = window.y - area.at.y, bottom = top - area.size.y;
  glBlitNamedFramebuffer(framebuffer_, 0, 0, 0, size_.x, size_.y, area.at.x, top,
                         area.at.x + area.size.x, bottom, GL_COLOR_BUFFER_BIT,
                         size_ == area.size ? GL_NEAREST : GL_LINEAR);
}

csg::Picture read_back(const Area& area, const glm::ivec2& window) {
  csg::Picture picture{area.size.x, area.size.y, {}};
  const auto width = static_cast<std::size_t>(area.size.x);
  std::vector<csg::Rgba> rows(width * static_cast<std::size_t>(area.size.y));
  picture.pixels.resize(rows.size());
  glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
  glReadBuffer(GL_BACK);
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glReadPixels(area.at.x, window.y - area.at.y - area.size.y, area.size.x, area.size.y, GL_RGBA,
               GL_UNSIGNED_BYTE, rows.data());
  for (int v = 0; v < area.size.y; ++v) {
    const auto from = rows.begin() + static_cast<std::ptrdiff_t>(width) * (area.size.y - 1 - v);
    const auto to = picture.pixels.begin() + static_cast<std::ptrdiff_t>(width) * v;
    std::transform(from, from + static_cast<std::ptrdiff_t>(width), to, [](csg::Rgba pixel) {
      pixel.a = 255;  // a window has none
      return pixel;
    });
  }
  return picture;
}

}  // namespace strata::view
