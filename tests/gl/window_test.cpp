#include "gl/window.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "strata/gl/buffer.h"

namespace strata::gl {
namespace {

TEST(GlWindow, WithoutADisplayIsASentence) {
  const char* display = std::getenv("DISPLAY");
  const std::string kept = display ? display : "";
  setenv("DISPLAY", ":4711", 1);
  const auto window = Window::open();
  if (display) {
    setenv("DISPLAY", kept.c_str(), 1);
  } else {
    unsetenv("DISPLAY");
  }
  ASSERT_FALSE(window);
  EXPECT_EQ(window.error().code, ErrorCode::kUsage);
  EXPECT_TRUE(window.error().message.starts_with("no window: ")) << window.error().message;
}

TEST(GlWindow, IsAContextLikeTheOthers) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "no display; run under xvfb-run";
  auto window = Window::open({.title = "test",
                              .width = 320,
                              .height = 200,
                              .visible = true,
                              .vsync = false,
                              .debug = true});
  ASSERT_TRUE(window) << window.error().message;
  EXPECT_EQ((*window)->framebuffer_size().width, 320);
  EXPECT_EQ((*window)->framebuffer_size().height, 200);
  EXPECT_FALSE((*window)->should_close());
  auto buffer = Buffer::allocate(16);
  ASSERT_TRUE(buffer);
  buffer->clear(3);
  EXPECT_EQ(buffer->download_all<std::uint32_t>()[3], 3u);
  (*window)->swap_buffers();
  const auto checked = (*window)->check();
  EXPECT_TRUE(checked) << checked.error().message;
}

}  // namespace
}  // namespace strata::gl
