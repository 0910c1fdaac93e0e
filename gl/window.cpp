#include "gl/window.h"

#include <epoxy/gl.h>
// After epoxy, so that GLFW does not bring another loader's headers.
#include <GLFW/glfw3.h>

#include <cstdlib>
#include <cstring>
#include <utility>

namespace strata::gl {
namespace {

/// Windows of this process. GLFW is one for the process too, and of the main thread.
int open_windows = 0;

std::string glfw_error() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text ? text : "no reason given";
}

void end_glfw() {
  if (open_windows == 0) glfwTerminate();
}

}  // namespace

Result<std::unique_ptr<Window>> Window::open(const WindowOptions& options) {
  if (!glfwInit()) return fail(ErrorCode::kUsage, "no window: {}", glfw_error());
  const char* wish = std::getenv("STRATA_GL_DEBUG");
  const bool debug = options.debug || (wish && std::strcmp(wish, "0") != 0);
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  glfwWindowHint(GLFW_OPENGL_DEBUG_CONTEXT, debug ? GLFW_TRUE : GLFW_FALSE);
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, options.scale_to_monitor ? GLFW_TRUE : GLFW_FALSE);
  glfwWindowHint(GLFW_VISIBLE, options.visible ? GLFW_TRUE : GLFW_FALSE);
  auto window = std::unique_ptr<Window>(new Window);
  // With a word when the context is lost, if the driver can say it.
  for (const int robustness : {GLFW_LOSE_CONTEXT_ON_RESET, GLFW_NO_ROBUSTNESS}) {
    glfwWindowHint(GLFW_CONTEXT_ROBUSTNESS, robustness);
    window->window_ =
        glfwCreateWindow(options.width, options.height, options.title.c_str(), nullptr, nullptr);
    if (window->window_) break;
  }
  if (!window->window_) {
    auto error = fail(ErrorCode::kUsage, "no window with OpenGL 4.5: {}", glfw_error());
    end_glfw();
    return error;
  }
  ++open_windows;
  if (auto current = window->make_current(); !current) return tl::unexpected(current.error());
  glfwSwapInterval(options.vsync ? 1 : 0);
  if (auto looked = window->look_around("GLFW window", debug); !looked) {
    return tl::unexpected(looked.error());
  }
  return window;
}

Window::~Window() {
  if (!window_) return;
  glfwDestroyWindow(window_);
  --open_windows;
  end_glfw();
}

Result<void> Window::make_current() {
  glfwMakeContextCurrent(window_);
  if (glfwGetCurrentContext() != window_) {
    return fail(ErrorCode::kInternal, "the window's OpenGL context: {}", glfw_error());
  }
  return {};
}

void Window::release_current() { glfwMakeContextCurrent(nullptr); }

bool Window::should_close() const { return glfwWindowShouldClose(window_) != 0; }

Window::Size Window::framebuffer_size() const {
  Size size;
  glfwGetFramebufferSize(window_, &size.width, &size.height);
  return size;
}

void Window::swap_buffers() { glfwSwapBuffers(window_); }

}  // namespace strata::gl
