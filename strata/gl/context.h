#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "strata/core/result.h"

// OpenGL 4.5 core, with a display or without. All of Strata's GL code stands on this folder.
//
// Nothing here links libEGL or libGL: they are opened when the first context is created. So a
// program without a context pays nothing, and a system without the libraries gives an error
// message.

namespace strata::gl {

/// Limits of the driver, queried once.
struct Limits {
  std::uint64_t storage_block_bytes = 0;      ///< largest buffer that a shader sees at one binding
  std::uint32_t storage_bindings = 0;         ///< bindings of such buffers
  std::uint32_t fragment_storage_blocks = 0;  ///< of them in a fragment shader
  std::uint32_t compute_storage_blocks = 0;   ///< in a compute shader
  std::uint32_t vertex_storage_blocks = 0;    ///< in a vertex shader; often 0
  std::uint32_t uniform_block_bytes = 0;      ///< largest block of uniforms
  std::uint32_t compute_groups[3] = {};       ///< work groups of one dispatch
  std::uint32_t compute_group_size[3] = {};   ///< invocations of a work group along each axis
  std::uint32_t compute_invocations = 0;      ///< of a work group in all
  std::uint32_t compute_shared_bytes = 0;     ///< shared memory of a work group
  std::uint32_t texture_side = 0;             ///< pixels of the largest texture's side
  std::uint32_t framebuffer_side = 0;         ///< pixels of the largest framebuffer's side
  std::uint32_t viewport_side = 0;            ///< pixels of the largest viewport's side
  std::uint32_t subpixel_bits = 0;            ///< of the hardware rasterizer
};

/// A driver's fault and what is done about it. Each can be switched by its name:
/// STRATA_GL_WORKAROUNDS="-name" turns it off, "+name" (or "name") on, "-all" all off; several are
/// separated by commas.
struct Workaround {
  std::string_view name;   ///< as STRATA_GL_WORKAROUNDS takes it
  std::string_view story;  ///< the fault, where it was seen, and the remedy
  bool in_force = false;   ///< for this context
};

/// Properties of a context.
struct Info {
  std::string window_system;            ///< "EGL surfaceless", "EGL device 0", "GLFW X11"
  std::string vendor;                   ///< GL_VENDOR
  std::string renderer;                 ///< GL_RENDERER: the device
  std::string version;                  ///< GL_VERSION: OpenGL and driver
  std::string glsl_version;             ///< of the shading language
  bool is_software = false;             ///< drawn by the CPU
  std::vector<std::string> extensions;  ///< sorted
  Limits limits;                        ///< of the driver
  bool has_int64 = false;               ///< 64-bit integers compile (ARB_gpu_shader_int64)
  bool has_int64_atomics = false;    ///< a 64-bit atomic maximum compiles (NV_shader_atomic_int64)
  std::string int64_atomics_reason;  ///< why, or why not
  std::vector<Workaround> workarounds;  ///< all that Strata knows, in force or not

  /// Whether the driver has an extension, such as "GL_ARB_gpu_shader_int64".
  [[nodiscard]] bool has_extension(std::string_view name) const;
  /// Whether the workaround of that name is in force.
  [[nodiscard]] bool works_around(std::string_view name) const;
};

/// How to get a context without a window.
struct ContextOptions {
  /// A debug context: Context::check() reports wrong uses of GL as sentences. Also on with
  /// STRATA_GL_DEBUG=1 in the environment. Slower with some drivers.
  bool debug = false;
  /// "": a GPU's EGL device if there is one, else Mesa without a surface, else any device.
  /// "surfaceless", or "device:N" as `strata info --gl` counts them. STRATA_GL_DEVICE in the
  /// environment takes its place if this is empty.
  std::string device = {};
};

/// An OpenGL 4.5 core context. One thread at a time may use it, after make_current(). Everything
/// made in it (Buffer, Program) must be destroyed before it.
class Context {
 public:
  /// A context without a window. @return kUsage with a sentence that tells what was tried and how
  /// each attempt failed
  [[nodiscard]] static Result<std::unique_ptr<Context>> headless(
      const ContextOptions& options = {});

  virtual ~Context() = default;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  /// Makes this the context of the calling thread.
  [[nodiscard]] virtual Result<void> make_current() = 0;
  /// Gives the context up, so that another thread may take it.
  virtual void release_current() = 0;

  /// Driver, limits and workarounds; known from the start.
  [[nodiscard]] const Info& info() const { return info_; }

  /// The errors since the last call: GL errors, debug messages of high severity, the loss of the
  /// context. ErrorCode::kInternal; ErrorCode::kLimit if the driver was out of memory.
  /// @pre the context is current
  [[nodiscard]] Result<void> check();

  /// Messages of the driver are collected here; tests may look at them.
  [[nodiscard]] const std::vector<std::string>& messages() const { return *messages_; }

 protected:
  Context() = default;
  /// Reads info() and starts collecting messages. Derived classes call it once, when current.
  [[nodiscard]] Result<void> look_around(std::string window_system, bool debug);

 private:
  Info info_;
  std::unique_ptr<std::vector<std::string>> messages_ =
      std::make_unique<std::vector<std::string>>();
};

/// Whether contexts shall pretend to be a GPU's (`hardware` in STRATA_GL_FAULTS); for tests.
[[nodiscard]] bool pretends_hardware();

/// Errors of the current context since the last call, and its loss, for code that has no Context at
/// hand: `what` begins the message. Debug messages are left to Context::check().
[[nodiscard]] Result<void> check_errors(std::string_view what);

}  // namespace strata::gl
