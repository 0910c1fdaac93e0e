#include <string>
#include <utility>

#include "hashbuffer/gl/store_glsl.h"
#include "strata/gl/shader_program.h"
#include "transparency/gl/gl_renderers.h"

namespace strata::glsl {
extern const gl::GlslPiece transparency_gl_peel;
extern const gl::GlslPiece transparency_gl_peel_blend_comp;
extern const gl::GlslPiece transparency_gl_peel_join_comp;
}  // namespace strata::glsl

namespace strata::transparency {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

/// Peels a layer from the front, and with `dual` one from the back, until nothing is left. A layer
/// takes two geometry passes: 64-bit atomic minima are missing on many drivers.
class PeelingRenderer final : public GlRenderer {
 public:
  explicit PeelingRenderer(bool dual) : dual_(dual) {}

  Result<void> render(GlFrame& frame, Costs& costs, const Execution& execution) override {
    if (auto ready = prepare(frame); !ready) return ready;
    costs.allocated_bytes += bytes();
    const gl::StoreGlsl depths = passing(true), payloads = passing(false);
    for (;;) {
      if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
      bind(frame);
      for (const gl::StoreGlsl* pass : {&depths, &payloads}) {
        if (auto drawn = frame.producer().draw(*pass, {0, frame.height()}); !drawn) return drawn;
        ++costs.geometry_passes;
        bind(frame);
      }
      found_.clear();
      run_for_pixels(blend_, frame.pixels());
      std::uint32_t found = 0;
      found_.download(std::span(&found, 1));
      if (auto good = gl::check_errors("transparency: peeling"); !good) return good;
      if (found == 0) break;
    }
    if (!dual_) return {};
    bind(frame);
    run_for_pixels(join_, frame.pixels());
    return gl::check_errors("transparency: peeling");
  }

 private:
  [[nodiscard]] gl::GlslSettings settings() const {
    gl::GlslSettings settings;
    if (dual_) settings.defines.emplace_back("PEEL_DUAL", "1");
    return settings;
  }
  [[nodiscard]] gl::StoreGlsl passing(bool depths) const {
    gl::GlslSettings with = settings();
    if (depths) with.defines.emplace_back("PEEL_DEPTHS", "1");
    return gl::store_glsl(glsl::transparency_gl_peel, with);
  }
  Result<void> prepare(GlFrame& frame) {
    if (!blend_) {
      const gl::GlslPiece piece = glsl::transparency_gl_peel_blend_comp;
      auto made = gl::Program::compute({&piece, 1}, settings());
      if (!made) return tl::unexpected(made.error());
      blend_ = std::move(*made);
    }
    if (dual_ && !join_) {
      const gl::GlslPiece piece = glsl::transparency_gl_peel_join_comp;
      auto made = gl::Program::compute({&piece, 1});
      if (!made) return tl::unexpected(made.error());
      join_ = std::move(*made);
    }
    const std::uint64_t bytes = std::uint64_t{frame.pixels()} * 8;
    for (gl::Buffer* buffer : {&near_, &next_, &far_, &next_far_}) {
      if (!dual_ && (buffer == &far_ || buffer == &next_far_)) continue;
      if (auto room = buffer->reserve(bytes); !room) return room;
    }
    near_.clear(0);
    next_.clear(kNone);
    if (auto room = found_.reserve(4); !room) return room;
    if (dual_) {
      far_.clear(kNone);
      next_far_.clear(0);
      if (auto done = frame.clear(back_); !done) return done;
    }
    const gl::StoreBlock block{0, frame.pixels(), 0, 0, 0};
    if (auto done = params_.assign(std::span(&block, 1)); !done) return done;
    return frame.clear(frame.image());
  }
  [[nodiscard]] std::uint64_t bytes() const {
    return near_.bytes() + next_.bytes() + far_.bytes() + next_far_.bytes() + back_.bytes();
  }
  void bind(GlFrame& frame) const {
    frame.faces().bind(0);
    frame.image().bind(1);
    found_.bind(2);
    near_.bind(8);
    next_.bind(9);
    if (dual_) {
      back_.bind(3);
      far_.bind(10);
      next_far_.bind(11);
    }
    params_.bind_uniform(8);
  }

  bool dual_;
  gl::Program blend_, join_;
  gl::Buffer near_, next_, far_, next_far_, back_, found_, params_;
};

}  // namespace

GlMaker make_gl_peeling(const gl::Context&, const Settings&) {
  return std::make_unique<PeelingRenderer>(false);
}
GlMaker make_gl_dual_peeling(const gl::Context&, const Settings&) {
  return std::make_unique<PeelingRenderer>(true);
}

}  // namespace strata::transparency
