#include "raster/gl/hardware.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <bit>

namespace strata::glsl {
extern const gl::GlslPiece raster_gl_hardware_vert;
extern const gl::GlslPiece raster_gl_hardware_frag;
}  // namespace strata::glsl

namespace strata::gl {
namespace {

constexpr unsigned kVertices = 0, kTriangles = 1;

/// The state that drawing needs, and back to what was there: a window may have its own.
class DrawState {
 public:
  DrawState(unsigned framebuffer, bool colours) {
    glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &framebuffer_);
    glGetIntegerv(GL_VIEWPORT, viewport_);
    glGetBooleanv(GL_COLOR_WRITEMASK, colour_mask_);
    glGetBooleanv(GL_DEPTH_WRITEMASK, &depth_mask_);
    for (Switch& s : switches_) {
      s.before = glIsEnabled(s.name);
      s.wanted ? glEnable(s.name) : glDisable(s.name);
    }
    const GLboolean written = colours ? GL_TRUE : GL_FALSE;
    glColorMask(written, written, written, written);
    glDepthMask(GL_FALSE);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
  }
  ~DrawState() {
    for (const Switch& s : switches_) s.before ? glEnable(s.name) : glDisable(s.name);
    glColorMask(colour_mask_[0], colour_mask_[1], colour_mask_[2], colour_mask_[3]);
    glDepthMask(depth_mask_);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, static_cast<GLuint>(framebuffer_));
    glViewport(viewport_[0], viewport_[1], viewport_[2], viewport_[3]);
    glBindVertexArray(0);
  }
  DrawState(const DrawState&) = delete;
  DrawState& operator=(const DrawState&) = delete;

 private:
  struct Switch {
    GLenum name;
    bool wanted;
    GLboolean before = GL_FALSE;
  };
  Switch switches_[9] = {{GL_DEPTH_TEST, false},
                         {GL_STENCIL_TEST, false},
                         {GL_SCISSOR_TEST, false},
                         {GL_CULL_FACE, false},
                         {GL_BLEND, false},
                         {GL_MULTISAMPLE, false},
                         {GL_SAMPLE_ALPHA_TO_COVERAGE, false},
                         {GL_RASTERIZER_DISCARD, false},
                         {GL_DEPTH_CLAMP, true}};
  GLint framebuffer_ = 0;
  GLint viewport_[4] = {};
  GLboolean colour_mask_[4] = {};
  GLboolean depth_mask_ = GL_TRUE;
};

}  // namespace

Result<std::unique_ptr<HardwareRasterizer>> HardwareRasterizer::create(const Context& context) {
  const Limits& limits = context.info().limits;
  // Two of the mesh, and up to four of a store.
  if (limits.fragment_storage_blocks < 6) {
    return fail(ErrorCode::kUsage,
                "{}: {} storage blocks in fragment shaders, the hardware rasterizer needs 6",
                context.info().renderer, limits.fragment_storage_blocks);
  }
  if (limits.subpixel_bits < static_cast<std::uint32_t>(kLatticeBits)) {
    return fail(ErrorCode::kUsage, "{}: places vertices to 1/{} of a pixel, Strata needs 1/{}",
                context.info().renderer, 1u << limits.subpixel_bits, kLatticeSteps);
  }
  auto made = std::unique_ptr<HardwareRasterizer>(new HardwareRasterizer(limits));
  glCreateVertexArrays(1, &made->vertex_array_);
  glCreateFramebuffers(1, &made->framebuffer_);
  return made;
}

HardwareRasterizer::~HardwareRasterizer() {
  glDeleteVertexArrays(1, &vertex_array_);
  glDeleteFramebuffers(1, &framebuffer_);
}

Result<void> HardwareRasterizer::set_mesh(const LatticeMesh& mesh) {
  triangle_count_ = 0;
  const std::uint64_t largest =
      std::max(mesh.vertices.size() * sizeof(glm::ivec3), mesh.triangles.size_bytes());
  if (largest > limits_.storage_block_bytes || mesh.triangles.size() > 0x7fffffffu) {
    return fail(ErrorCode::kLimit,
                "hardware rasterizer: a mesh of {} triangles needs {} bytes, but a binding holds "
                "at most {}",
                mesh.triangles.size(), largest, limits_.storage_block_bytes);
  }
  auto vertices = Buffer::of(std::span<const glm::ivec3>(mesh.vertices));
  if (!vertices) return tl::unexpected(vertices.error());
  auto triangles = Buffer::of(mesh.triangles);
  if (!triangles) return tl::unexpected(triangles.error());
  vertices_ = std::move(*vertices);
  triangles_ = std::move(*triangles);
  triangle_count_ = static_cast<std::uint32_t>(mesh.triangles.size());
  glVertexArrayVertexBuffer(vertex_array_, 0, vertices_.id(), 0, sizeof(glm::ivec3));
  glVertexArrayElementBuffer(vertex_array_, triangles_.id());
  glVertexArrayAttribIFormat(vertex_array_, 0, 3, GL_INT, 0);
  glVertexArrayAttribBinding(vertex_array_, 0, 0);
  glEnableVertexArrayAttrib(vertex_array_, 0);
  return check_errors("hardware rasterizer: mesh");
}

void HardwareRasterizer::set_target(const RasterTarget& target, int v_begin, int v_end) {
  target_ = target;
  v_begin_ = v_begin;
  v_end_ = v_end;
}

Result<const Program*> HardwareRasterizer::program_for(const StoreGlsl& store) {
  for (const auto& [text, program] : programs_) {
    if (text == store) return &program;
  }
  const GlslPiece vertex = glsl::raster_gl_hardware_vert;
  const GlslPiece fragment[] = {store.piece(), glsl::raster_gl_hardware_frag};
  GlslSettings settings = store.settings;
  settings.defines.emplace_back("STRATA_FRAGMENT_STAGE", "1");
  auto program = Program::graphics({&vertex, 1}, fragment, settings);
  if (!program) return tl::unexpected(program.error());
  programs_.emplace_back(store, std::move(*program));
  return &programs_.back().second;
}

std::uint32_t HardwareRasterizer::largest_tile() const {
  // Positions in a window of 2^14 pixels are exact in floats; half of it is margin (draw_tile).
  const std::uint32_t window = std::bit_floor(std::min(limits_.viewport_side, 1u << 14));
  return std::min(limits_.framebuffer_side, window / 2);
}

void HardwareRasterizer::bind(const Program& program) {
  const AxisFrame frame(target_.axis);
  program.set("axis_u", frame.u);
  program.set("axis_v", frame.v);
  program.set("axis_w", frame.w);
  program.set("row_of_screen", v_begin_);
  program.set("screen_width", width());
  program.set("depth_limit", target_.depth_limit);
  program.use();
  vertices_.bind(kVertices);
  triangles_.bind(kTriangles);
}

Result<void> HardwareRasterizer::draw(const StoreGlsl& store, PixelRows rows) {
  const auto program = program_for(store);
  if (!program) return tl::unexpected(program.error());
  if (triangle_count_ == 0) return {};
  const std::uint32_t side = largest_tile();
  bind(**program);
  {
    const DrawState state(framebuffer_, false);
    glBindVertexArray(vertex_array_);
    const std::uint32_t end = std::min(rows.end, height());
    for (std::uint32_t v = rows.begin; v < end; v += side) {
      for (std::uint32_t u = 0; u < width(); u += side) {
        const std::uint32_t columns = std::min(side, width() - u), lines = std::min(side, end - v);
        // A framebuffer without images: nothing but its size.
        glNamedFramebufferParameteri(framebuffer_, GL_FRAMEBUFFER_DEFAULT_WIDTH,
                                     static_cast<GLint>(columns));
        glNamedFramebufferParameteri(framebuffer_, GL_FRAMEBUFFER_DEFAULT_HEIGHT,
                                     static_cast<GLint>(lines));
        draw_tile(**program, u, v, columns, lines);
      }
    }
  }
  storage_barrier();
  return check_errors("hardware rasterizer");
}

Result<void> HardwareRasterizer::draw_into(unsigned framebuffer, const StoreGlsl& store,
                                           const std::function<void()>& set_state,
                                           const std::function<void()>& reset_state) {
  const auto program = program_for(store);
  if (!program) return tl::unexpected(program.error());
  if (std::max(width(), height()) > largest_tile()) {
    return fail(ErrorCode::kLimit,
                "hardware rasterizer: a screen with images must be at most {} pixels wide and "
                "high, got {} x {}",
                largest_tile(), width(), height());
  }
  if (triangle_count_ == 0) return {};
  bind(**program);
  {
    const DrawState state(framebuffer, true);
    glBindVertexArray(vertex_array_);
    if (set_state) set_state();
    draw_tile(**program, 0, 0, width(), height());
    if (reset_state) reset_state();
  }
  storage_barrier();
  return check_errors("hardware rasterizer");
}

void HardwareRasterizer::draw_tile(const Program& program, std::uint32_t u, std::uint32_t v,
                                   std::uint32_t width, std::uint32_t height) {
  // The viewport is a power of two, so that positions are exact, and reaches half its side beyond
  // the tile: drivers that clip at its border move the edges of what they clip by their rounding.
  const std::uint32_t inner = std::bit_ceil(std::max(width, height));
  const auto margin = static_cast<std::int32_t>(inner / 2);
  glViewport(-margin, -margin, static_cast<GLsizei>(2 * inner), static_cast<GLsizei>(2 * inner));
  program.set("origin_u", (static_cast<std::int32_t>(u) - margin) * kLatticeSteps);
  program.set("origin_v", (static_cast<std::int32_t>(v) + v_begin_ - margin) * kLatticeSteps);
  program.set("scale", 1.0f / static_cast<float>(inner * kLatticeSteps));
  program.set("pixel_u", u);
  program.set("pixel_v", v);
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(triangle_count_ * 3), GL_UNSIGNED_INT, nullptr);
}

}  // namespace strata::gl
