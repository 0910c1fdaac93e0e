#include <epoxy/gl.h>

#include <algorithm>
#include <glm/vec2.hpp>
#include <string>
#include <utility>
#include <vector>

#include "hashbuffer/gl/store_glsl.h"
#include "strata/gl/shader_program.h"
#include "transparency/gl/gl_renderers.h"

// K. Myers, L. Bavoil, "Stencil routed A-buffer" (2007): samples of a pixel hold fragments, the
// stencil chooses the sample. We differ: the fragments of all rounds are kept, and sorted together.

namespace strata::glsl {
extern const gl::GlslPiece transparency_gl_stencil_routed;
extern const gl::GlslPiece transparency_gl_stencil_gather_comp;
extern const gl::GlslPiece transparency_gl_fixed_arrays;
extern const gl::GlslPiece transparency_gl_select_next;
extern const gl::GlslPiece transparency_gl_composite_lists_comp;
extern const gl::GlslPiece transparency_gl_screen_vert;
extern const gl::GlslPiece transparency_gl_nothing_frag;
}  // namespace strata::glsl

namespace strata::transparency {
namespace {

/// The stencil value at which a sample takes a fragment.
constexpr int kTakes = 2;
/// Fragments of a pixel that an 8-bit stencil can count.
constexpr std::uint32_t kMostLayers = 255 - kTakes + 1;

/// The multisampled images.
class RoutedImages {
 public:
  RoutedImages() = default;
  ~RoutedImages() { reset(); }
  RoutedImages(const RoutedImages&) = delete;
  RoutedImages& operator=(const RoutedImages&) = delete;

  Result<void> make(std::uint32_t width, std::uint32_t height, int samples) {
    if (framebuffer_ != 0 && width == width_ && height == height_) return {};
    reset();
    width_ = width, height_ = height;
    const auto w = static_cast<GLsizei>(width), h = static_cast<GLsizei>(height);
    glCreateTextures(GL_TEXTURE_2D_MULTISAMPLE, 1, &texture_);
    glTextureStorage2DMultisample(texture_, samples, GL_RG32UI, w, h, GL_TRUE);
    glCreateTextures(GL_TEXTURE_2D_MULTISAMPLE, 1, &stencil_);
    glTextureStorage2DMultisample(stencil_, samples, GL_DEPTH24_STENCIL8, w, h, GL_TRUE);
    glCreateFramebuffers(1, &framebuffer_);
    glNamedFramebufferTexture(framebuffer_, GL_COLOR_ATTACHMENT0, texture_, 0);
    glNamedFramebufferTexture(framebuffer_, GL_DEPTH_STENCIL_ATTACHMENT, stencil_, 0);
    if (auto good = gl::check_errors("stencil routing"); !good) return good;
    if (glCheckNamedFramebufferStatus(framebuffer_, GL_DRAW_FRAMEBUFFER) !=
        GL_FRAMEBUFFER_COMPLETE) {
      return fail(ErrorCode::kUsage, "the driver has no images of {} samples and a stencil",
                  samples);
    }
    return {};
  }
  [[nodiscard]] unsigned framebuffer() const { return framebuffer_; }
  [[nodiscard]] unsigned texture() const { return texture_; }

 private:
  void reset() noexcept {
    if (framebuffer_ != 0) glDeleteFramebuffers(1, &framebuffer_);
    if (texture_ != 0) glDeleteTextures(1, &texture_);
    if (stencil_ != 0) glDeleteTextures(1, &stencil_);
    framebuffer_ = texture_ = stencil_ = 0;
  }
  unsigned framebuffer_ = 0, texture_ = 0, stencil_ = 0;
  std::uint32_t width_ = 0, height_ = 0;
};

class StencilRouted final : public GlRenderer {
 public:
  explicit StencilRouted(int samples) : samples_(samples) {}
  ~StencilRouted() override {
    if (vertex_array_ != 0) glDeleteVertexArrays(1, &vertex_array_);
  }

  Result<void> render(GlFrame& frame, Costs& costs, const Execution& execution) override {
    if (frame.hardware() == nullptr) {
      return fail(ErrorCode::kUsage, "stencil routing needs the hardware rasterizer");
    }
    if (auto done = prepare(*frame.hardware()); !done) return done;
    const auto samples = static_cast<std::uint32_t>(samples_);
    for (std::uint32_t rounds = 4;; rounds = std::min(2 * rounds, kMostLayers / samples)) {
      const auto complete = gather(*frame.hardware(), rounds, costs, execution);
      if (!complete) return tl::unexpected(complete.error());
      if (*complete) return composite(frame);
      if (rounds >= kMostLayers / samples) {
        return fail(ErrorCode::kLimit,
                    "stencil routing: a pixel has more than {} fragments, all that an 8-bit "
                    "stencil counts",
                    rounds * samples);
      }
    }
  }

  /// Whether samples of a pixel can hold different fragments with multisampling off, as the
  /// technique needs: some drivers write all samples where one passes.
  Result<void> try_out(const gl::Context& context) {
    auto hardware = gl::HardwareRasterizer::create(context);
    if (!hardware) return tl::unexpected(hardware.error());
    LatticeMesh mesh;
    constexpr int kFarOut = 64 * kLatticeSteps;
    mesh.vertices = {{-kFarOut, -kFarOut, 0}, {kFarOut, -kFarOut, 0}, {0, kFarOut, 0}};
    const glm::uvec3 twice[2] = {{0, 1, 2}, {0, 1, 2}};
    mesh.triangles = twice;
    if (auto done = (*hardware)->set_mesh(mesh); !done) return done;
    (*hardware)->set_target({Axis::kZ, 4, 4, 1 << 24});
    if (auto done = prepare(**hardware); !done) return done;
    Costs costs;
    const auto complete = gather(**hardware, 1, costs, {});
    if (!complete) return tl::unexpected(complete.error());
    std::vector<std::uint32_t> counts(16);
    counts_.download(std::span(counts));
    glm::uvec2 fragments[2];
    slots_.download(std::span<glm::uvec2>(fragments));
    if (counts != std::vector<std::uint32_t>(16, 2) || fragments[0].x == fragments[1].x) {
      return fail(ErrorCode::kUsage,
                  "stencil routing: {} writes all samples of a pixel where one passes the stencil "
                  "test",
                  context.info().renderer);
    }
    return {};
  }

 private:
  [[nodiscard]] static std::uint32_t pixels_of(const gl::HardwareRasterizer& hardware) {
    return hardware.width() * hardware.height();
  }
  Result<void> prepare(const gl::HardwareRasterizer& hardware) {
    if (auto done = make_programs(); !done) return done;
    return images_.make(hardware.width(), hardware.height(), samples_);
  }
  Result<void> make_programs() {
    if (gather_) return {};
    const gl::GlslPiece gathering = glsl::transparency_gl_stencil_gather_comp;
    auto gather = gl::Program::compute({&gathering, 1});
    if (!gather) return tl::unexpected(gather.error());
    const gl::GlslPiece vertex = glsl::transparency_gl_screen_vert;
    const gl::GlslPiece fragment = glsl::transparency_gl_nothing_frag;
    auto screen = gl::Program::graphics({&vertex, 1}, {&fragment, 1});
    if (!screen) return tl::unexpected(screen.error());
    gl::GlslSettings settings;
    settings.defines = {{"STORE_READ", "1"}};
    gl::StoreGlsl read = gl::store_glsl(glsl::transparency_gl_fixed_arrays, settings);
    read.text += std::string(glsl::transparency_gl_select_next.text);
    const gl::GlslPiece pieces[] = {read.piece(), glsl::transparency_gl_composite_lists_comp};
    auto composite = gl::Program::compute(pieces, settings);
    if (!composite) return tl::unexpected(composite.error());
    gather_ = std::move(*gather);
    screen_ = std::move(*screen);
    composite_ = std::move(*composite);
    glCreateVertexArrays(1, &vertex_array_);
    return {};
  }

  /// Draws up to `rounds` times into the slots. False: there are more fragments.
  Result<bool> gather(gl::HardwareRasterizer& hardware, std::uint32_t rounds, Costs& costs,
                      const Execution& execution) {
    const auto samples = static_cast<std::uint32_t>(samples_);
    const std::uint32_t slots = rounds * samples;
    if (auto room = counts_.reserve(std::uint64_t{pixels_of(hardware)} * 4); !room) {
      return tl::unexpected(room.error());
    }
    if (auto room = slots_.reserve(std::uint64_t{pixels_of(hardware)} * slots * 8); !room) {
      return tl::unexpected(room.error());
    }
    if (auto room = found_.reserve(4); !room) return tl::unexpected(room.error());
    counts_.clear();
    const gl::StoreBlock block{0, pixels_of(hardware), 0, slots, 0};
    if (auto done = params_.assign(std::span(&block, 1)); !done) {
      return tl::unexpected(done.error());
    }
    costs.allocated_bytes = std::uint64_t{pixels_of(hardware)} * (4 + 8 * std::uint64_t{slots});
    for (std::uint32_t round = 0; round < rounds; ++round) {
      if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
      if (auto drawn = draw(hardware, static_cast<int>(round)); !drawn) {
        return tl::unexpected(drawn.error());
      }
      ++costs.geometry_passes;
      const auto more = append(hardware, slots);
      if (!more) return tl::unexpected(more.error());
      if (!*more) return true;
    }
    return false;
  }

  Result<void> draw(gl::HardwareRasterizer& hardware, int round) {
    const GLuint nothing[4] = {~0u, ~0u, ~0u, ~0u};
    glClearNamedFramebufferuiv(images_.framebuffer(), GL_COLOR, 0, nothing);
    // Some drivers hand over fragments of samples although the pixel's centre is not covered.
    gl::GlslSettings settings;
    settings.defines = {{"STRATA_EXACT_COVERAGE", "1"}};
    const gl::StoreGlsl insert = gl::store_glsl(glsl::transparency_gl_stencil_routed, settings);
    params_.bind_uniform(8);
    return hardware.draw_into(
        images_.framebuffer(), insert,
        [&] {
          start_stencil(hardware, round);
          glStencilFunc(GL_EQUAL, kTakes, 0xff);
          glStencilOp(GL_DECR, GL_DECR, GL_DECR);
        },
        [] { glDisable(GL_STENCIL_TEST); });
  }
  /// Sample i starts so far above kTakes that it takes the fragment of that number. Keeps what is
  /// bound for the drawing that follows.
  void start_stencil(const gl::HardwareRasterizer& hardware, int round) {
    GLint program = 0, vertices = 0, viewport[4];
    glGetIntegerv(GL_CURRENT_PROGRAM, &program);
    glGetIntegerv(GL_VERTEX_ARRAY_BINDING, &vertices);
    glGetIntegerv(GL_VIEWPORT, viewport);
    glViewport(0, 0, static_cast<GLsizei>(hardware.width()),
               static_cast<GLsizei>(hardware.height()));
    screen_.use();
    glBindVertexArray(vertex_array_);
    glEnable(GL_STENCIL_TEST);
    glEnable(GL_MULTISAMPLE);
    glEnable(GL_SAMPLE_MASK);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    glStencilOp(GL_REPLACE, GL_REPLACE, GL_REPLACE);
    for (int i = 0; i < samples_; ++i) {
      glSampleMaski(0, 1u << i);
      glStencilFunc(GL_ALWAYS, kTakes + round * samples_ + i, 0xff);
      glDrawArrays(GL_TRIANGLES, 0, 3);
    }
    glSampleMaski(0, ~0u);
    glDisable(GL_SAMPLE_MASK);
    glDisable(GL_MULTISAMPLE);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glUseProgram(static_cast<GLuint>(program));
    glBindVertexArray(static_cast<GLuint>(vertices));
    glViewport(viewport[0], viewport[1], viewport[2], viewport[3]);
  }

  /// Whether the last sample of a pixel was reached.
  Result<bool> append(const gl::HardwareRasterizer& hardware, std::uint32_t slots) {
    found_.clear();
    found_.bind(2);
    counts_.bind(8);
    slots_.bind(9);
    glTextureBarrier();
    glBindTextureUnit(0, images_.texture());
    gather_.set("width", hardware.width());
    gather_.set("sample_count", static_cast<std::uint32_t>(samples_));
    gather_.set("slots", slots);
    run_for_pixels(gather_, pixels_of(hardware));
    std::uint32_t found = 0;
    found_.download(std::span(&found, 1));
    if (auto good = gl::check_errors("stencil routing"); !good) return tl::unexpected(good.error());
    return found != 0;
  }

  Result<void> composite(GlFrame& frame) {
    frame.faces().bind(0);
    frame.image().bind(1);
    counts_.bind(8);
    slots_.bind(9);
    params_.bind_uniform(8);
    composite_.set("first_pixel", 0u);
    run_for_pixels(composite_, frame.pixels());
    return gl::check_errors("stencil routing");
  }

  int samples_;
  unsigned vertex_array_ = 0;
  RoutedImages images_;
  gl::Program gather_, screen_, composite_;
  gl::Buffer counts_, slots_, found_, params_;
};

}  // namespace

GlMaker make_gl_stencil_routed(const gl::Context& context, const Settings& settings) {
  GLint colours = 0, depths = 0;
  glGetIntegerv(GL_MAX_INTEGER_SAMPLES, &colours);
  glGetIntegerv(GL_MAX_DEPTH_TEXTURE_SAMPLES, &depths);
  int samples = std::min({colours, depths, 16});
  if (settings.k > 0) samples = std::min(samples, static_cast<int>(settings.k));
  if (samples < 2) {
    return fail(ErrorCode::kUsage, "stencil routing needs 2 samples a pixel; {} has {}",
                context.info().renderer, samples);
  }
  auto renderer = std::make_unique<StencilRouted>(samples);
  if (auto works = renderer->try_out(context); !works) return tl::unexpected(works.error());
  return renderer;
}

}  // namespace strata::transparency
