#include "strata/gl/context.h"

#include <epoxy/gl.h>
#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>

#include "gl/faults.h"
#include "gl/workarounds.h"
#include "strata/gl/shader_program.h"

namespace strata::gl {
namespace {

/// Messages kept between two calls of check(); a driver may say thousands.
constexpr std::size_t kMaxMessages = 16;

void GLAPIENTRY collect_message(GLenum source, GLenum, GLuint, GLenum severity, GLsizei length,
                                const GLchar* text, const void* user) {
  // The compiler's words come back with the program that it refused.
  if (severity != GL_DEBUG_SEVERITY_HIGH || source == GL_DEBUG_SOURCE_SHADER_COMPILER) return;
  auto& messages = *static_cast<std::vector<std::string>*>(const_cast<void*>(user));
  if (messages.size() < kMaxMessages) {
    messages.emplace_back(
        text, length < 0 ? std::char_traits<char>::length(text) : static_cast<std::size_t>(length));
  }
}

std::string text_of(GLenum name) {
  const GLubyte* text = glGetString(name);
  return text ? reinterpret_cast<const char*>(text) : "";
}

std::uint32_t number_of(GLenum name) {
  GLint value = 0;
  glGetIntegerv(name, &value);
  return static_cast<std::uint32_t>(std::max(value, 0));
}

std::uint32_t number_of(GLenum name, GLuint index) {
  GLint value = 0;
  glGetIntegeri_v(name, index, &value);
  return static_cast<std::uint32_t>(std::max(value, 0));
}

Limits read_limits() {
  Limits limits;
  GLint64 bytes = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &bytes);
  limits.storage_block_bytes = static_cast<std::uint64_t>(std::max<GLint64>(bytes, 0));
  limits.storage_bindings = number_of(GL_MAX_SHADER_STORAGE_BUFFER_BINDINGS);
  limits.fragment_storage_blocks = number_of(GL_MAX_FRAGMENT_SHADER_STORAGE_BLOCKS);
  limits.compute_storage_blocks = number_of(GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS);
  limits.vertex_storage_blocks = number_of(GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS);
  limits.uniform_block_bytes = number_of(GL_MAX_UNIFORM_BLOCK_SIZE);
  for (GLuint axis = 0; axis < 3; ++axis) {
    limits.compute_groups[axis] = number_of(GL_MAX_COMPUTE_WORK_GROUP_COUNT, axis);
    limits.compute_group_size[axis] = number_of(GL_MAX_COMPUTE_WORK_GROUP_SIZE, axis);
  }
  limits.compute_invocations = number_of(GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS);
  limits.compute_shared_bytes = number_of(GL_MAX_COMPUTE_SHARED_MEMORY_SIZE);
  limits.texture_side = number_of(GL_MAX_TEXTURE_SIZE);
  limits.framebuffer_side =
      std::min(number_of(GL_MAX_FRAMEBUFFER_WIDTH), number_of(GL_MAX_FRAMEBUFFER_HEIGHT));
  GLint viewport[2] = {};
  glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport);
  limits.viewport_side =
      static_cast<std::uint32_t>(std::max(0, std::min(viewport[0], viewport[1])));
  limits.subpixel_bits = number_of(GL_SUBPIXEL_BITS);
  return limits;
}

/// Whether a compute shader with that extension and body compiles. Lists of extensions are not
/// believed: what counts is that a shader of this kind is taken.
Result<void> compiles(const std::vector<std::string>& extensions, std::string_view text) {
  const GlslPiece piece{"probe", text};
  return Program::compute({&piece, 1}, {.extensions = extensions, .defines = {}})
      .map([](Program&&) {});
}

void probe_int64(Info& info) {
  info.has_int64 = compiles({"GL_ARB_gpu_shader_int64"},
                            "layout(local_size_x = 1) in;\n"
                            "layout(std430, binding = 0) buffer probe { uint64_t value[]; };\n"
                            "void main() { value[1] = value[0] + 1ul; }\n")
                       .has_value();
  // Asked for by name where it is listed only: some drivers warn of unknown extensions and go on.
  if (!info.has_extension("GL_NV_shader_atomic_int64")) {
    info.int64_atomics_reason = "GL_NV_shader_atomic_int64 is missing";
    return;
  }
  const auto probe = compiles({"GL_ARB_gpu_shader_int64", "GL_NV_shader_atomic_int64"},
                              "layout(local_size_x = 1) in;\n"
                              "layout(std430, binding = 0) buffer probe { uint64_t value[]; };\n"
                              "void main() { value[1] = atomicMax(value[0], value[1]); }\n");
  info.has_int64_atomics = probe.has_value();
  info.int64_atomics_reason =
      probe ? "GL_NV_shader_atomic_int64 compiles"
            : "GL_NV_shader_atomic_int64 is listed but does not compile: " + probe.error().message;
}

const char* reset_text(GLenum status) {
  switch (status) {
    case GL_GUILTY_CONTEXT_RESET:
      return "by our own commands";
    case GL_INNOCENT_CONTEXT_RESET:
      return "by another program's commands";
    default:
      return "for a reason that the driver does not know";
  }
}

const char* error_text(GLenum error) {
  switch (error) {
    case GL_INVALID_ENUM:
      return "GL_INVALID_ENUM";
    case GL_INVALID_VALUE:
      return "GL_INVALID_VALUE";
    case GL_INVALID_OPERATION:
      return "GL_INVALID_OPERATION";
    case GL_INVALID_FRAMEBUFFER_OPERATION:
      return "GL_INVALID_FRAMEBUFFER_OPERATION";
    case GL_OUT_OF_MEMORY:
      return "GL_OUT_OF_MEMORY";
    case GL_CONTEXT_LOST:
      return "GL_CONTEXT_LOST";
    default:
      return "an unknown GL error";
  }
}

}  // namespace

bool Info::has_extension(std::string_view name) const {
  return std::binary_search(extensions.begin(), extensions.end(), name);
}

bool Info::works_around(std::string_view name) const {
  return std::any_of(workarounds.begin(), workarounds.end(), [&](const Workaround& workaround) {
    return workaround.name == name && workaround.in_force;
  });
}

Result<void> check_errors(std::string_view what) {
  const GLenum reset = has_lost_context() ? static_cast<GLenum>(GL_UNKNOWN_CONTEXT_RESET)
                                          : glGetGraphicsResetStatus();
  if (reset != GL_NO_ERROR) {
    return fail(ErrorCode::kInternal, "{}: the OpenGL context was lost, {}", what,
                reset_text(reset));
  }
  // A lost context may say so forever: this loop ends all the same.
  std::string said;
  bool out_of_memory = false;
  for (int i = 0; i < 8; ++i) {
    const GLenum error = glGetError();
    if (error == GL_NO_ERROR) break;
    out_of_memory |= error == GL_OUT_OF_MEMORY;
    said += said.empty() ? "" : ", ";
    said += error_text(error);
    if (error == GL_CONTEXT_LOST) break;
  }
  if (said.empty()) return {};
  return fail(out_of_memory ? ErrorCode::kLimit : ErrorCode::kInternal, "{}: {}", what, said);
}

Result<void> Context::check() {
  auto errors = check_errors("OpenGL (" + info_.renderer + ")");
  std::string said;
  for (const std::string& message : *messages_) said += "; " + message;
  messages_->clear();
  if (!errors) {
    errors.error().message += said;
    return errors;
  }
  if (!said.empty()) return fail(ErrorCode::kInternal, "OpenGL ({}){}", info_.renderer, said);
  return {};
}

Result<void> Context::look_around(std::string window_system, bool debug) {
  if (auto begun = begin_faults(); !begun) return begun;
  info_.window_system = std::move(window_system);
  info_.vendor = text_of(GL_VENDOR);
  info_.renderer = text_of(GL_RENDERER);
  info_.version = text_of(GL_VERSION);
  info_.glsl_version = text_of(GL_SHADING_LANGUAGE_VERSION);
  if (epoxy_gl_version() < 45) {
    return fail(ErrorCode::kUsage, "{} has OpenGL {}, Strata needs 4.5", info_.renderer,
                info_.version);
  }
  for (const std::string_view name : {"llvmpipe", "softpipe", "swrast", "SwiftShader"}) {
    info_.is_software |= info_.renderer.find(name) != std::string::npos;
  }
  if (pretends_hardware()) info_.is_software = false;
  const std::uint32_t count = number_of(GL_NUM_EXTENSIONS);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (const GLubyte* name = glGetStringi(GL_EXTENSIONS, i)) {
      info_.extensions.emplace_back(reinterpret_cast<const char*>(name));
    }
  }
  std::sort(info_.extensions.begin(), info_.extensions.end());
  info_.limits = read_limits();
  if (debug) {
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(collect_message, messages_.get());
  }
  probe_int64(info_);
  const char* switches = std::getenv("STRATA_GL_WORKAROUNDS");
  info_.workarounds = choose_workarounds(info_, switches ? switches : "");
  static_cast<void>(check_errors("start"));  // what the probes left
  messages_->clear();
  return {};
}

}  // namespace strata::gl
