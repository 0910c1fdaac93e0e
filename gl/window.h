#pragma once

#include <memory>
#include <string>

#include "strata/core/result.h"
#include "strata/gl/context.h"

struct GLFWwindow;

namespace strata::gl {

struct WindowOptions {
  std::string title = "Strata";
  int width = 1024, height = 768;  ///< in the window system's units
  bool scale_to_monitor = false;   ///< the size grows with the monitor's scale
  bool visible = true;
  bool vsync = true;
  bool debug = false;  ///< as ContextOptions::debug; also on with STRATA_GL_DEBUG=1
};

/// A window and the OpenGL 4.5 core context that draws into it. The library strata::gl_window holds
/// it, so that who needs no window does not link GLFW. Windows live on the main thread.
class Window : public Context {
 public:
  /// Opens a window and makes its context current. ErrorCode::kUsage with the reason if there is no
  /// display or no OpenGL 4.5.
  [[nodiscard]] static Result<std::unique_ptr<Window>> open(const WindowOptions& options = {});
  ~Window() override;

  [[nodiscard]] Result<void> make_current() override;
  void release_current() override;

  /// For GLFW's functions: input, clipboard, size.
  [[nodiscard]] GLFWwindow* glfw() const { return window_; }
  [[nodiscard]] bool should_close() const;
  struct Size {
    int width = 0, height = 0;
  };
  /// Of the framebuffer, in pixels; 0 x 0 while minimized.
  [[nodiscard]] Size framebuffer_size() const;
  void swap_buffers();

 private:
  Window() = default;
  GLFWwindow* window_ = nullptr;
};

}  // namespace strata::gl
