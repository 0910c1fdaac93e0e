// strata-view: the window of Strata. `strata view` becomes this program.

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <fmt/core.h>
#include <imgui.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "apps/session/session.h"
#include "apps/view/gl/canvas.h"
#include "apps/view/gl/key_names.h"
#include "apps/view/gl/panels.h"
#include "apps/view/script_runner.h"
#include "apps/view/view_options.h"
#include "apps/view/viewer.h"
#include "core/atomic_file.h"
#include "gl/window.h"

namespace strata::view {
namespace {

using Clock = std::chrono::steady_clock;

/// Says it on standard error; what was said last is not said again.
void complain(const Error& error) {
  static std::string last;
  if (error.message == last) return;
  last = error.message;
  std::fprintf(stderr, "strata view: error: %s\n", error.message.c_str());
}

/// What a window is called that shows something of that name.
std::string title_of(const std::string& name) {
  return name.empty() ? "Strata" : name + " - Strata";
}

/// The window, what is in it, and its loop.
class Program final : public Stage {
 public:
  /// @param media  null: none
  Program(ViewOptions options, std::unique_ptr<gl::Window> window, ScriptRunner script,
          std::shared_ptr<const transparency::MediaSettings> media)
      : options_(std::move(options)),
        window_(std::move(window)),
        script_(std::move(script)),
        media_(std::move(media)) {}

  Result<void> run() {
    start();
    auto result = loop();
    keep_size();
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
    canvas_.reset();
    leave_soon(result);
    if (auto checked = window_->check(); !checked && result) result = std::move(checked);
    if (!result) return result;
    // Nothing was ever shown: that is how the program ends, too.
    if (viewer_->model() == nullptr && !viewer_->load_error().empty()) {
      return tl::unexpected(Error{viewer_->load_error_code(), viewer_->load_error()});
    }
    return {};
  }

  /// The next window is as large as this one.
  void keep_size() const {
    if (!options_.attended()) return;
    GLFWwindow* glfw = window_->glfw();
    if (glfwGetWindowAttrib(glfw, GLFW_MAXIMIZED) != 0 ||
        glfwGetWindowAttrib(glfw, GLFW_ICONIFIED) != 0) {
      return;
    }
    glm::ivec2 size(0);
    glfwGetWindowSize(glfw, &size.x, &size.y);
    remember_size(viewer_->folders(), size);
  }

  /// A load that does not stop in time is left to the system; it has nothing to put in order.
  void leave_soon(const Result<void>& result) {
    viewer_->cancel_load();
    for (int i = 0; i < 50 && viewer_->loading(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    if (!viewer_->loading()) return;
    if (!result) complain(result.error());
    remove_temporary_files();
    std::_Exit(result ? 0 : static_cast<int>(result.error().code));
  }

  // --- Stage
  void resize(const glm::ivec2& size) override {
    glfwSetWindowSize(window_->glfw(), size.x, size.y);
  }
  Result<void> screenshot(const std::string& path, bool picture_only) override {
    // Drawn again: what is in the back buffer after a swap is not defined.
    draw(picture_only);
    const csg::Picture picture =
        read_back(picture_only ? area_ : Area{{0, 0}, window_size_}, window_size_);
    return csg::write_png(picture, path);
  }
  void print(const std::string& line) override {
    std::printf("%s\n", line.c_str());
    std::fflush(stdout);
  }

 private:
  void start() {
    viewer_.emplace(options_, make_renderer(options_.command.backend),
                    [] { glfwPostEmptyEvent(); });
    if (media_ != nullptr) viewer_->set_media(media_);
    canvas_.emplace();
    canvas_->warm_up();
    GLFWwindow* glfw = window_->glfw();
    glfwSetWindowUserPointer(glfw, this);
    glfwSetMouseButtonCallback(glfw, [](GLFWwindow* w, int button, int action, int modifiers) {
      self(w).on_button(button, action, modifiers);
    });
    glfwSetCursorPosCallback(glfw, [](GLFWwindow* w, double, double) {
      Program& program = self(w);
      // What a drag changes shows with the next picture.
      if (!program.viewer_->dragging()) return program.touch();
      program.viewer_->mouse_move(program.mouse());
    });
    glfwSetScrollCallback(glfw, [](GLFWwindow* w, double x, double y) {
      Program& program = self(w);
      program.touch();
      if (ImGui::GetIO().WantCaptureMouse) return;
      const bool shift = glfwGetKey(w, GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS ||
                         glfwGetKey(w, GLFW_KEY_RIGHT_SHIFT) == GLFW_PRESS;
      program.viewer_->scroll({x, y}, program.mouse(), shift);
    });
    glfwSetDropCallback(glfw, [](GLFWwindow* w, int count, const char** paths) {
      self(w).touch();
      self(w).viewer_->open_files(std::vector<std::string>(paths, paths + count));
    });
    glfwSetKeyCallback(glfw, [](GLFWwindow* w, int key, int, int action, int modifiers) {
      self(w).touch();
      if (action == GLFW_RELEASE || ImGui::GetIO().WantTextInput) return;
      self(w).viewer_->key(key_name(key, modifiers));
    });
    glfwSetCharCallback(glfw, [](GLFWwindow* w, unsigned letter) {
      self(w).touch();
      // Where it lies on the keyboard depends on the country.
      if (letter == '?' && !ImGui::GetIO().WantTextInput) self(w).viewer_->key("?");
    });
    glfwSetCursorEnterCallback(glfw, [](GLFWwindow* w, int) { self(w).touch(); });
    glfwSetWindowRefreshCallback(glfw, [](GLFWwindow* w) { self(w).touch(); });
    glfwSetFramebufferSizeCallback(glfw, [](GLFWwindow* w, int, int) { self(w).touch(); });
    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    float scale = 1, scale_y = 1;
    glfwGetWindowContentScale(glfw, &scale, &scale_y);
    panels_.emplace(std::max(1.0f, scale), short_name(window_->info().renderer));
    ImGui_ImplGlfw_InitForOpenGL(glfw, true);  // calls the callbacks from above, too
    ImGui_ImplOpenGL3_Init("#version 450 core");
  }

  Result<void> loop() {
    while (!window_->should_close() && !viewer_->wants_quit) {
      const bool hurried = viewer_->busy() || !script_.ended() || finishing();
      glfwWaitEventsTimeout(hurried ? 0.008 : options_.watch ? 0.1 : 0.5);
      lay_out();
      viewer_->tick();
      name_window();
      if (draw_due()) {
        const auto begin = Clock::now();
        draw(false);
        window_->swap_buffers();
        drawn_at_ = Clock::now();
        const std::chrono::duration<double, std::milli> took = drawn_at_ - begin;
        viewer_->presented(took.count());
        if (auto checked = window_->check(); !checked) return checked;
      }
      if (std::exchange(viewer_->wants_screenshot, false)) keep_screenshot();
      tell_export();
      const std::size_t before = script_.position();
      if (auto done = script_.step(*viewer_, *this); !done) {
        // Why a command finds nothing, unless that is what it says.
        if (done.error().message.find(viewer_->load_error()) == std::string::npos) {
          tell_load_error();
        }
        return done;
      }
      tell_load_error();
      if (script_.position() != before) touch();
      if (script_.quit()) return {};
      if (finishing() && viewer_->settled() && ++settled_turns_ > 2) {
        return screenshot(options_.screenshot, false);
      }
    }
    return {};
  }

  void name_window() {
    const std::string title = viewer_->title();
    if (title == titled_) return;
    titled_ = title;
    glfwSetWindowTitle(window_->glfw(), title_of(title).c_str());
    touch();
  }

  /// What the window says of a scene that cannot be read, for who does not look at it.
  void tell_load_error() {
    if (viewer_->loads() == loads_told_) return;
    loads_told_ = viewer_->loads();
    if (viewer_->load_error().empty() || viewer_->load_error_code() == ErrorCode::kCancelled)
      return;
    complain({viewer_->load_error_code(), viewer_->load_error()});
  }

  /// Writes a picture that the panel asked for, and says how an export ended.
  void tell_export() {
    if (std::string words = std::exchange(viewer_->wants_told, ""); !words.empty()) {
      panels_->tell(std::move(words));
      touch();
    }
    const std::string path = std::exchange(viewer_->wants_picture, "");
    if (!path.empty() && viewer_->frame() != nullptr) {
      const auto done = screenshot(path, true);
      panels_->tell(done ? "written: " + path : done.error().message);
      touch();
    }
    if (viewer_->exports() == exports_told_) return;
    exports_told_ = viewer_->exports();
    const Result<std::string>& result = viewer_->exported();
    panels_->tell(result ? "written: " + *result : result.error().message);
    touch();
  }

  /// Something that panels show may have changed. They take some turns to follow: what is below
  /// the mouse is known in the next one.
  void touch() { turns_to_draw_ = 3; }

  /// Drawing the window costs a software renderer as much as a coarse picture: it is done when
  /// there is something new.
  [[nodiscard]] bool draw_due() {
    const bool whole = viewer_->settled();
    if (whole != was_settled_) turns_to_draw_ = std::max(turns_to_draw_, 1);
    was_settled_ = whole;
    constexpr std::chrono::milliseconds kProgress{100}, kAtLeast{1000};
    const auto since = Clock::now() - drawn_at_;
    if (((viewer_->loading() || viewer_->exporting()) && since > kProgress) || since > kAtLeast)
      return true;
    if (viewer_->frame_serial() != uploaded_) return true;
    if (turns_to_draw_ == 0) return false;
    --turns_to_draw_;
    return true;
  }

  /// All commands are done, and only the last screenshot is left.
  [[nodiscard]] bool finishing() const { return script_.ended() && !options_.screenshot.empty(); }

  void lay_out() {
    const gl::Window::Size size = window_->framebuffer_size();
    window_size_ = {size.width, size.height};
    if (size.width < 1 || size.height < 1) return;  // minimized
    area_ = panels_->picture_area(window_size_, *viewer_);
    viewer_->set_viewport(area_.size);
  }

  void draw(bool picture_only) {
    if (window_size_.x < 1 || window_size_.y < 1) return;
    const Frame* frame = viewer_->frame();
    if (frame != nullptr && viewer_->frame_serial() != uploaded_) {
      canvas_->upload(frame->picture);
      uploaded_ = viewer_->frame_serial();
    }
    const csg::ColourScheme* scheme = viewer_->picture_options().scheme;
    if (scheme == nullptr) scheme = &csg::default_scheme();
    Area shown = area_;
    if (frame != nullptr && frame->wanted != area_.size) {
      // The window has just changed its size: the old picture is as high as the new one will be.
      shown.size.x = static_cast<int>(
          std::lround(static_cast<double>(area_.size.y) * frame->wanted.x / frame->wanted.y));
      shown.at.x += (area_.size.x - shown.size.x) / 2;
    }
    canvas_->draw(frame != nullptr ? shown : Area{}, window_size_, scheme->background);
    if (picture_only) return;
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    panels_->draw(*viewer_, window_size_, area_);
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  }

  void keep_screenshot() {
    for (int number = 1; number < 10000; ++number) {
      const std::string path = fmt::format("strata-view-{}.png", number);
      std::error_code error;
      if (std::filesystem::exists(path, error)) continue;
      const auto done = screenshot(path, false);
      panels_->tell(done ? "written: " + path : done.error().message);
      if (!done) complain(done.error());
      return;
    }
  }

  void on_button(int button, int action, int modifiers) {
    touch();
    if (button > GLFW_MOUSE_BUTTON_MIDDLE) return;
    const bool down = action == GLFW_PRESS;
    if (down && ImGui::GetIO().WantCaptureMouse) return;
    constexpr MouseButton kButtons[] = {MouseButton::kLeft, MouseButton::kRight,
                                        MouseButton::kMiddle};
    viewer_->mouse_button(kButtons[button], down, mouse(), (modifiers & GLFW_MOD_SHIFT) != 0,
                          (modifiers & GLFW_MOD_CONTROL) != 0);
  }

  /// The cursor in pixels of the picture.
  [[nodiscard]] glm::dvec2 mouse() const {
    double x = 0, y = 0;
    int width = 1, height = 1;
    glfwGetCursorPos(window_->glfw(), &x, &y);
    glfwGetWindowSize(window_->glfw(), &width, &height);
    const glm::dvec2 dots = glm::dvec2(window_size_) / glm::dvec2(width, height);
    return glm::dvec2(x, y) * dots - glm::dvec2(area_.at);
  }
  static Program& self(GLFWwindow* window) {
    return *static_cast<Program*>(glfwGetWindowUserPointer(window));
  }
  /// `llvmpipe` of `llvmpipe (LLVM 15.0.6, 256 bits)`.
  static std::string short_name(const std::string& renderer) {
    return renderer.substr(0, renderer.find(" ("));
  }

  ViewOptions options_;
  std::unique_ptr<gl::Window> window_;
  ScriptRunner script_;
  std::shared_ptr<const transparency::MediaSettings> media_;
  std::optional<Panels> panels_;
  std::optional<Canvas> canvas_;
  std::optional<Viewer> viewer_;  ///< last: its threads wake the window
  glm::ivec2 window_size_{0};
  Area area_;
  std::string titled_;
  std::uint64_t uploaded_ = 0, loads_told_ = 0, exports_told_ = 0;
  int settled_turns_ = 0, turns_to_draw_ = 3;
  bool was_settled_ = false;
  Clock::time_point drawn_at_{};
};

Result<void> run(ViewOptions options) {
  std::vector<ScriptCommand> commands;
  if (!options.script.empty()) {
    auto read = read_script(options.script);
    if (!read) return tl::unexpected(read.error());
    commands = *std::move(read);
  }
  if (auto kept = check_files(options, commands); !kept) return kept;
  std::shared_ptr<const transparency::MediaSettings> media;
  if (!options.media.empty()) {
    auto read = transparency::read_media(options.media);
    if (!read) return tl::unexpected(read.error());
    for (const FileIdentity& file : read->files) {
      if (auto kept = apps::check_opened(file, options.command.outputs); !kept) return kept;
    }
    media = std::make_shared<transparency::MediaSettings>(*std::move(read));
  }
  gl::WindowOptions wish;
  wish.title = title_of("");
  wish.scale_to_monitor = options.default_size;
  wish.width = options.command.size.x, wish.height = options.command.size.y;
  const auto last =
      options.default_size && options.attended() ? remembered_size(user_folders()) : std::nullopt;
  if (last) {
    wish.scale_to_monitor = false;  // it was scaled then
    wish.width = last->x, wish.height = last->y;
  }
  auto window = gl::Window::open(wish);
  if (!window) {
    Error error = std::move(window.error());
    error.message += "; strata csg draws pictures without a window";
    return tl::unexpected(std::move(error));
  }
  const std::string name = options.script == "-" ? "standard input" : options.script;
  Program program(std::move(options), *std::move(window), {std::move(commands), name},
                  std::move(media));
  return program.run();
}

int view_main(int argc, char** argv) {
  auto parsed = parse_view_options(argc, argv);
  if (const auto* outcome = std::get_if<apps::ParseOutcome>(&parsed)) {
    const bool shown = apps::write_text(outcome->to_stderr ? STDERR_FILENO : STDOUT_FILENO,
                                        outcome->text, "standard output")
                           .has_value();
    return shown || outcome->exit_code != 0 ? outcome->exit_code
                                            : static_cast<int>(ErrorCode::kOutput);
  }
  const Result<void> result = run(std::get<ViewOptions>(std::move(parsed)));
  if (result) return 0;
  complain(result.error());
  return static_cast<int>(result.error().code);
}

}  // namespace
}  // namespace strata::view

int main(int argc, char** argv) {
  try {
    return strata::view::view_main(argc, argv);
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "strata view: error: out of memory\n");
    return static_cast<int>(strata::ErrorCode::kLimit);
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "strata view: error: %s\n", failure.what());
    return static_cast<int>(strata::ErrorCode::kInternal);
  }
}
