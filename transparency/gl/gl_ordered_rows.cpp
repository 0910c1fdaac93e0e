#include <epoxy/gl.h>

#include <algorithm>
#include <string>
#include <utility>

#include "hashbuffer/gl/store_glsl.h"
#include "strata/gl/shader_program.h"
#include "transparency/gl/gl_renderers.h"
#include "transparency/gl/image_set.h"

namespace strata::glsl {
extern const gl::GlslPiece transparency_gl_ordered_rows;
extern const gl::GlslPiece transparency_gl_ordered_resolve_comp;
}  // namespace strata::glsl

namespace strata::transparency {
namespace {

constexpr float kFar = 33554432.0f;  // of ordered_rows.glsl

/// Rows a pixel that fragments read and write in the order of the triangles.
class OrderedRows final : public GlRenderer {
 public:
  /// @param kind  the define that selects the technique
  OrderedRows(std::string kind, int rows, bool interlock)
      : kind_(std::move(kind)), rows_(rows), interlock_(interlock) {}

  Result<void> render(GlFrame& frame, Costs& costs, const Execution&) override {
    if (frame.hardware() == nullptr) {
      return fail(ErrorCode::kUsage, "rows in the order of triangles need the hardware rasterizer");
    }
    if (!resolve_) {
      const gl::GlslPiece piece = glsl::transparency_gl_ordered_resolve_comp;
      auto made = gl::Program::compute({&piece, 1}, settings(false));
      if (!made) return tl::unexpected(made.error());
      resolve_ = std::move(*made);
    }
    frame.faces().bind(9);
    const gl::StoreGlsl insert = gl::store_glsl(glsl::transparency_gl_ordered_rows, settings(true));
    auto drawn = interlock_ ? draw_to_buffer(frame, insert) : draw_to_images(frame, insert);
    if (!drawn) return drawn;
    costs.geometry_passes += 1;
    costs.allocated_bytes += std::uint64_t{frame.pixels()} * 16 * static_cast<unsigned>(rows_ + 1);
    frame.image().bind(1);
    if (interlock_) {
      buffer_.bind(8);
    } else {
      images_.bind_as_texture(0);
    }
    resolve_.set("width", frame.width());
    run_for_pixels(resolve_, frame.pixels());
    return gl::check_errors("transparency: rows");
  }

 private:
  [[nodiscard]] gl::GlslSettings settings(bool inserting) const {
    gl::GlslSettings settings;
    settings.defines = {{kind_, "1"}, {"ROWS", std::to_string(rows_)}};
    if (interlock_) settings.defines.emplace_back("STRATA_INTERLOCK", "1");
    if (inserting) {
      settings.extensions = {interlock_ ? "GL_ARB_fragment_shader_interlock"
                                        : "GL_EXT_shader_framebuffer_fetch"};
    }
    return settings;
  }
  /// What row `i` of an empty pixel holds; the last of a hybrid one sums from 0 on.
  [[nodiscard]] glm::vec4 empty_row(int i) const {
    if (i == rows_) return {kFar, kFar, kFar, kind_ == "ROWS_HYBRID" ? 0.0f : kFar};
    return {0.0f, 0.0f, 0.0f, i == rows_ - 1 && kind_ == "ROWS_HYBRID" ? 0.0f : 1.0f};
  }
  Result<void> draw_to_images(GlFrame& frame, const gl::StoreGlsl& insert) {
    if (auto made = images_.make(GL_RGBA32F, frame.width(), frame.height(), rows_ + 1); !made) {
      return made;
    }
    for (int i = 0; i <= rows_; ++i) images_.clear(i, empty_row(i));
    return frame.hardware()->draw_into(images_.framebuffer(), insert);
  }
  Result<void> draw_to_buffer(GlFrame& frame, const gl::StoreGlsl& insert) {
    std::vector<glm::vec4> empty;
    for (int i = 0; i <= rows_; ++i) empty.push_back(empty_row(i));
    if (auto done = frame.fill(buffer_, empty); !done) return done;
    buffer_.bind(8);
    return frame.producer().draw(insert, {0, frame.height()});
  }

  std::string kind_;
  int rows_;
  bool interlock_;
  gl::Program resolve_;
  gl::Buffer buffer_;
  ImageSet images_;
};

/// @param extra  rows beside the k of the technique
GlMaker make_rows(const gl::Context& context, const Settings& settings, const char* name,
                  const char* kind, unsigned extra) {
  const bool fetch = context.info().has_extension("GL_EXT_shader_framebuffer_fetch");
  const bool interlock = context.info().has_extension("GL_ARB_fragment_shader_interlock");
  if (!fetch && !interlock) {
    return fail(ErrorCode::kUsage,
                "{} needs framebuffer fetch or fragment shader interlock; {} has neither", name,
                context.info().renderer);
  }
  const unsigned most = 4 - extra;
  const unsigned k = settings.k == 0 ? most : settings.k;
  if (k + extra < 2 || k > most) {
    return fail(ErrorCode::kUsage, "{} on the GPU: k must be {} to {}, got {}", name, 2 - extra,
                most, k);
  }
  return std::make_unique<OrderedRows>(kind, static_cast<int>(k + extra), !fetch);
}

}  // namespace

GlMaker make_gl_mlab(const gl::Context& context, const Settings& settings) {
  return make_rows(context, settings, "mlab", "ROWS_MLAB", 0);
}
GlMaker make_gl_hybrid(const gl::Context& context, const Settings& settings) {
  return make_rows(context, settings, "ht", "ROWS_HYBRID", 0);
}
GlMaker make_gl_kbuffer(const gl::Context& context, const Settings& settings) {
  return make_rows(context, settings, "k-buffer", "ROWS_KBUFFER", 1);
}

}  // namespace strata::transparency
