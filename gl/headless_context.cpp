#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <fmt/core.h>

#include <charconv>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "strata/gl/context.h"

// Contexts of EGL, without a display.

namespace strata::gl {
namespace {

/// One way to a display.
struct Way {
  std::string name;  ///< "EGL device 0"
  EGLDisplay display = EGL_NO_DISPLAY;
};

/// libepoxy ends the program when it cannot open a library: so we look first.
Result<void> can_open_libraries() {
  const auto opens = [](const char* name) {
    return dlopen(name, RTLD_LAZY | RTLD_LOCAL) != nullptr;
  };
  if (!opens("libEGL.so.1")) {
    return fail(ErrorCode::kUsage, "no OpenGL: libEGL.so.1 cannot be opened (Debian: libegl1)");
  }
  if (!opens("libOpenGL.so.0") && !opens("libGL.so.1")) {
    return fail(ErrorCode::kUsage,
                "no OpenGL: neither libOpenGL.so.0 nor libGL.so.1 can be opened (Debian: "
                "libopengl0)");
  }
  return {};
}

bool has_word(const char* list, std::string_view word) {
  std::string_view rest = list ? list : "";
  while (!rest.empty()) {
    const std::size_t space = rest.find(' ');
    if (rest.substr(0, space) == word) return true;
    rest.remove_prefix(space == std::string_view::npos ? rest.size() : space + 1);
  }
  return false;
}

/// By eglGetProcAddress, since libepoxy ends the program on a function that is not there.
template <class Function>
Function function(const char* name) {
  return reinterpret_cast<Function>(eglGetProcAddress(name));
}

struct EglDevices {
  std::vector<EGLDeviceEXT> devices;
  std::vector<bool> software;
};

EglDevices list_devices(const char* client_extensions) {
  EglDevices found;
  if (!has_word(client_extensions, "EGL_EXT_device_base") &&
      !has_word(client_extensions, "EGL_EXT_device_enumeration")) {
    return found;
  }
  const auto query = function<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
  const auto describe = function<PFNEGLQUERYDEVICESTRINGEXTPROC>("eglQueryDeviceStringEXT");
  EGLint count = 0;
  if (!query || !query(0, nullptr, &count) || count <= 0) return found;
  found.devices.resize(static_cast<std::size_t>(count));
  if (!query(count, found.devices.data(), &count)) count = 0;
  found.devices.resize(static_cast<std::size_t>(count));
  for (EGLDeviceEXT device : found.devices) {
    const char* extensions = describe ? describe(device, EGL_EXTENSIONS) : nullptr;
    found.software.push_back(has_word(extensions, "EGL_MESA_device_software"));
  }
  return found;
}

class EglContext final : public Context {
 public:
  ~EglContext() override {
    if (display_ == EGL_NO_DISPLAY) return;
    if (context_ != EGL_NO_CONTEXT) {
      if (eglGetCurrentContext() == context_) release_current();
      eglDestroyContext(display_, context_);
    }
    // The display stays initialized: another context of this process may share it.
  }

  static Result<std::unique_ptr<Context>> create(const Way& way, bool debug) {
    auto context = std::unique_ptr<EglContext>(new EglContext);
    if (auto made = context->open(way, debug); !made) return tl::unexpected(made.error());
    return context;
  }

  Result<void> make_current() override {
    if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) {
      return fail(ErrorCode::kInternal, "{}: eglMakeCurrent failed, error {:#x}", name_,
                  eglGetError());
    }
    return {};
  }
  void release_current() override {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  }

 private:
  Result<void> open(const Way& way, bool debug) {
    display_ = way.display;
    name_ = way.name;
    if (display_ == EGL_NO_DISPLAY) {
      return fail(ErrorCode::kUsage, "{}: no display, error {:#x}", name_, eglGetError());
    }
    EGLint major = 0, minor = 0;
    if (!eglInitialize(display_, &major, &minor)) {
      return fail(ErrorCode::kUsage, "{}: cannot be started, error {:#x}", name_, eglGetError());
    }
    const char* extensions = eglQueryString(display_, EGL_EXTENSIONS);
    if (!has_word(extensions, "EGL_KHR_surfaceless_context")) {
      return fail(ErrorCode::kUsage, "{}: no context without a surface", name_);
    }
    if (!eglBindAPI(EGL_OPENGL_API)) {
      return fail(ErrorCode::kUsage, "{}: no OpenGL, only OpenGL ES", name_);
    }
    const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_DONT_CARE, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                             EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (!eglChooseConfig(display_, wanted, &config, 1, &count) || count == 0) {
      if (!has_word(extensions, "EGL_KHR_no_config_context")) {
        return fail(ErrorCode::kUsage, "{}: no configuration draws OpenGL", name_);
      }
      config = nullptr;
    }
    // With a word when the context is lost, if the driver can say it.
    for (const bool robust : {true, false}) {
      std::vector<EGLint> attributes{
          EGL_CONTEXT_MAJOR_VERSION,       4,
          EGL_CONTEXT_MINOR_VERSION,       5,
          EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT};
      if (debug) attributes.insert(attributes.end(), {EGL_CONTEXT_OPENGL_DEBUG, EGL_TRUE});
      if (robust) {
        attributes.insert(attributes.end(), {EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY,
                                             EGL_LOSE_CONTEXT_ON_RESET});
      }
      attributes.push_back(EGL_NONE);
      context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, attributes.data());
      if (context_ != EGL_NO_CONTEXT) break;
    }
    if (context_ == EGL_NO_CONTEXT) {
      return fail(ErrorCode::kUsage, "{}: no OpenGL 4.5 core context, error {:#x}", name_,
                  eglGetError());
    }
    if (auto current = make_current(); !current) return current;
    return look_around(name_, debug);
  }

  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
  std::string name_;
};

/// The ways to try, in order; displays are made one by one, since making one may load a driver.
class Ways {
 public:
  Ways() {
    const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    get_display_ = function<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
    has_surfaceless_ = has_word(extensions, "EGL_MESA_platform_surfaceless");
    if (has_word(extensions, "EGL_EXT_platform_device")) found_ = list_devices(extensions);
  }
  [[nodiscard]] std::size_t devices() const { return get_display_ ? found_.devices.size() : 0; }
  [[nodiscard]] bool is_software(std::size_t device) const { return found_.software[device]; }
  [[nodiscard]] bool has_surfaceless() const { return get_display_ && has_surfaceless_; }
  [[nodiscard]] Way device(std::size_t i) const {
    return {fmt::format("EGL device {}", i),
            get_display_(EGL_PLATFORM_DEVICE_EXT, found_.devices[i], nullptr)};
  }
  [[nodiscard]] Way surfaceless() const {
    return {"EGL surfaceless",
            get_display_(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr)};
  }

 private:
  PFNEGLGETPLATFORMDISPLAYEXTPROC get_display_ = nullptr;
  bool has_surfaceless_ = false;
  EglDevices found_;
};

Result<std::unique_ptr<Context>> open_named(const Ways& ways, const std::string& name, bool debug) {
  if (name == "surfaceless") {
    if (!ways.has_surfaceless()) {
      return fail(ErrorCode::kUsage, "no OpenGL: EGL has no surfaceless platform");
    }
    return EglContext::create(ways.surfaceless(), debug);
  }
  std::size_t number = 0;
  const std::string_view prefix = "device:";
  const char* end = name.data() + name.size();
  if (!name.starts_with(prefix) ||
      std::from_chars(name.data() + prefix.size(), end, number).ptr != end) {
    return fail(ErrorCode::kUsage, "the OpenGL device must be surfaceless or device:N, got '{}'",
                name);
  }
  if (number >= ways.devices()) {
    return fail(ErrorCode::kUsage, "OpenGL device '{}': EGL has {} devices, counted from 0", name,
                ways.devices());
  }
  return EglContext::create(ways.device(number), debug);
}

}  // namespace

Result<std::unique_ptr<Context>> Context::headless(const ContextOptions& options) {
  if (auto opened = can_open_libraries(); !opened) return tl::unexpected(opened.error());
  const char* debug_wish = std::getenv("STRATA_GL_DEBUG");
  const bool debug = options.debug || (debug_wish && std::strcmp(debug_wish, "0") != 0);
  const char* device_wish = std::getenv("STRATA_GL_DEVICE");
  const std::string device =
      options.device.empty() && device_wish ? std::string(device_wish) : options.device;

  const Ways ways;
  if (!device.empty()) return open_named(ways, device, debug);

  std::string tried;
  std::optional<std::unique_ptr<Context>> context;
  const auto attempt = [&](const Way& way) {
    auto made = EglContext::create(way, debug);
    if (made) {
      context = std::move(*made);
    } else {
      tried += (tried.empty() ? "" : "; ") + made.error().message;
    }
    return made.has_value();
  };
  for (std::size_t i = 0; i < ways.devices(); ++i) {
    if (!ways.is_software(i) && attempt(ways.device(i))) return std::move(*context);
  }
  if (ways.has_surfaceless() && attempt(ways.surfaceless())) return std::move(*context);
  for (std::size_t i = 0; i < ways.devices(); ++i) {
    if (ways.is_software(i) && attempt(ways.device(i))) return std::move(*context);
  }
  return fail(ErrorCode::kUsage, "no OpenGL 4.5 context: {}",
              tried.empty() ? "EGL offers neither devices nor the surfaceless platform" : tried);
}

}  // namespace strata::gl
