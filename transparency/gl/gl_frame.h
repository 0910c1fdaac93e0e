#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "raster/gl/compute.h"
#include "raster/gl/hardware.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/gl/buffer.h"
#include "strata/gl/context.h"
#include "strata/gl/shader_program.h"
#include "strata/transparency/stream/frame.h"
#include "transparency/stream/fragment_source.h"

// Techniques of transparency on the GPU, as stores behind strata_insert or as passes over the
// producers of raster/gl.

namespace strata::transparency {

/// Which rasterizer makes the fragments.
enum class GlRasterizer : std::uint8_t {
  kCompute,   ///< the CPU's fragments, bit for bit, in no order
  kHardware,  ///< in the order of the triangles; may differ in pixels of silhouettes
};

class GlFrame;

/// Renders a frame on the GPU again and again. One context, one thread.
class GlRenderer {
 public:
  virtual ~GlRenderer() = default;
  /// Fills the frame's image; adds passes and bytes to `costs`.
  virtual Result<void> render(GlFrame& frame, Costs& costs, const Execution& execution) = 0;
};

/// A technique of the table gl_techniques().
struct GlTechnique {
  std::string_view name;  ///< of the CPU's technique with the same picture, where there is one
  std::string_view title = {};
  std::string_view paper = {};
  Accuracy accuracy = Accuracy::kExact;
  bool ordered = false;  ///< needs kHardware: it reads and writes pixels in the order of triangles
  /// @return kUsage with a sentence where the driver cannot
  Result<std::unique_ptr<GlRenderer>> (*make)(const gl::Context& context,
                                              const Settings& settings) = nullptr;
};

[[nodiscard]] std::span<const GlTechnique> gl_techniques();

/// Triangles in a view, on the GPU. Opaque triangles are fragments like all others: what lies
/// behind them is blended with nothing left.
class GlFrame {
 public:
  /// Uploads the triangles of `source`, whose samples are the pixels of the picture. The context
  /// must be current, then and later. @return kUsage without triangles or where the driver cannot;
  /// kLimit without the memory
  [[nodiscard]] static Result<std::unique_ptr<GlFrame>> make(const gl::Context& context,
                                                             const FragmentSource& source,
                                                             GlRasterizer rasterizer);

  /// The picture before `background`, which is not premultiplied. Rendering::technique_seconds is
  /// the time of the GPU without the download. @return as the renderer; kCancelled
  [[nodiscard]] Result<Rendering> render(GlRenderer& renderer, const glm::vec4& background = {},
                                         const Execution& execution = {});

  // --- for renderers ----------------------------------------------------------------------------

  [[nodiscard]] std::uint32_t width() const { return producer_->width(); }
  [[nodiscard]] std::uint32_t height() const { return producer_->height(); }
  [[nodiscard]] std::uint32_t pixels() const { return width() * height(); }
  [[nodiscard]] gl::Producer& producer() { return *producer_; }
  /// Null for kCompute.
  [[nodiscard]] gl::HardwareRasterizer* hardware() { return hardware_.get(); }
  /// vec4 faces[]: premultiplied colour and opacity by [triangle << 1 | exit].
  [[nodiscard]] const gl::Buffer& faces() const { return faces_; }
  /// vec4 image[]: colour and transmittance.
  [[nodiscard]] gl::Buffer& image() { return image_; }
  /// Makes every pixel of an image nothing: no colour, all light comes through.
  [[nodiscard]] Result<void> clear(gl::Buffer& image);
  /// Makes an image of copies of a few rows for each pixel.
  [[nodiscard]] Result<void> fill(gl::Buffer& image, std::span<const glm::vec4> rows);

 private:
  GlFrame() = default;

  std::unique_ptr<gl::ComputeRasterizer> compute_;
  std::unique_ptr<gl::HardwareRasterizer> hardware_;
  gl::Producer* producer_ = nullptr;
  gl::Buffer faces_, image_, rows_;
  gl::Program repeat_;  ///< of fill(), made when it is first called
};

/// Runs a compute shader with an invocation for each of `pixels` pixels, in groups of 64, and makes
/// what it wrote visible.
void run_for_pixels(const gl::Program& program, std::uint32_t pixels);

}  // namespace strata::transparency
