#include <utility>

#include "hashbuffer/gl/store_glsl.h"
#include "strata/gl/shader_program.h"
#include "transparency/gl/gl_renderers.h"

namespace strata::glsl {
extern const gl::GlslPiece transparency_gl_sums;
extern const gl::GlslPiece transparency_gl_sums_resolve_comp;
}  // namespace strata::glsl

namespace strata::transparency {
namespace {

class SumRenderer final : public GlRenderer {
 public:
  explicit SumRenderer(bool average) : average_(average) {}

  Result<void> render(GlFrame& frame, Costs& costs, const Execution&) override {
    if (!resolve_) {
      gl::GlslSettings settings;
      if (average_) settings.defines.emplace_back("SUMS_AVERAGE", "1");
      const gl::GlslPiece piece = glsl::transparency_gl_sums_resolve_comp;
      auto made = gl::Program::compute({&piece, 1}, settings);
      if (!made) return tl::unexpected(made.error());
      resolve_ = std::move(*made);
    }
    if (auto room = sums_.reserve(std::uint64_t{frame.pixels()} * 20); !room) return room;
    sums_.clear();
    const gl::StoreBlock block{0, frame.pixels(), 0, 0, 0};
    if (auto done = params_.assign(std::span(&block, 1)); !done) return done;
    gl::storage_barrier();
    sums_.bind(8);
    frame.faces().bind(9);
    params_.bind_uniform(8);
    const gl::StoreGlsl insert = gl::store_glsl(glsl::transparency_gl_sums);
    if (auto drawn = frame.producer().draw(insert, {0, frame.height()}); !drawn) return drawn;
    costs.geometry_passes += 1;
    costs.allocated_bytes += sums_.bytes();
    sums_.bind(8);
    frame.image().bind(1);
    run_for_pixels(resolve_, frame.pixels());
    return gl::check_errors("transparency: sums");
  }

 private:
  bool average_;
  gl::Program resolve_;
  gl::Buffer sums_, params_;
};

}  // namespace

GlMaker make_gl_weighted_sum(const gl::Context&, const Settings&) {
  return std::make_unique<SumRenderer>(false);
}
GlMaker make_gl_weighted_average(const gl::Context&, const Settings&) {
  return std::make_unique<SumRenderer>(true);
}

}  // namespace strata::transparency
