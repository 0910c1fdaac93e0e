#include <utility>

#include "hashbuffer/gl/hash_store.h"
#include "hashbuffer/gl/scan_store.h"
#include "strata/gl/shader_program.h"
#include "strata/hashbuffer/gl/store.h"
#include "transparency/gl/gl_renderers.h"
#include "transparency/gl/slot_stores.h"

namespace strata::glsl {
extern const gl::GlslPiece transparency_gl_composite_lists_comp;
}  // namespace strata::glsl

namespace strata::transparency {
namespace {

constexpr unsigned kFaces = 0, kImage = 1, kCulledFaces = 12;

/// Builds the lists in a store and blends them.
class ListRenderer final : public GlRenderer {
 public:
  /// @param threshold  pixels end at this much opacity; 0: they do not
  explicit ListRenderer(std::unique_ptr<gl::Store> store, double threshold = 0.0)
      : store_(std::move(store)), threshold_(threshold) {}

  Result<void> render(GlFrame& frame, Costs& costs, const Execution& execution) override {
    if (!composite_) {
      const gl::StoreGlsl read = store_->glsl_read();
      const gl::GlslPiece pieces[] = {read.piece(), glsl::transparency_gl_composite_lists_comp};
      gl::GlslSettings settings = read.settings;
      if (threshold_ > 0.0) {
        settings.defines.emplace_back("LEAST_TRANSMITTANCE", std::to_string(1.0 - threshold_));
      }
      auto made = gl::Program::compute(pieces, settings);
      if (!made) return tl::unexpected(made.error());
      composite_ = std::move(*made);
    }
    if (threshold_ > 0.0) frame.faces().bind(kCulledFaces);
    const auto built = gl::build(*store_, frame.producer(), execution);
    if (!built) return tl::unexpected(built.error());
    costs.geometry_passes += static_cast<std::uint64_t>(built->generator_calls);
    costs.allocated_bytes += store_->memory_bytes();
    frame.faces().bind(kFaces);
    frame.image().bind(kImage);
    for (int band = 0; band < store_->bands(); ++band) {
      const gl::PixelRows rows = store_->band_rows(band);
      store_->bind_for_reading(band);
      const std::uint32_t pixels = (rows.end - rows.begin) * frame.width();
      composite_.set("first_pixel", rows.begin * frame.width());
      run_for_pixels(composite_, pixels);
    }
    return gl::check_errors("transparency: lists");
  }

 private:
  std::unique_ptr<gl::Store> store_;
  double threshold_;
  gl::Program composite_;
};

GlMaker of_store(Result<std::unique_ptr<gl::Store>> store, double threshold = 0.0) {
  if (!store) return tl::unexpected(store.error());
  return std::make_unique<ListRenderer>(std::move(*store), threshold);
}

}  // namespace

GlMaker make_gl_hash(const gl::Context& context, const Settings&) {
  return of_store(gl::make_hash_store(context.info()));
}

GlMaker make_gl_hash_culled(const gl::Context& context, const Settings& settings) {
  if (!context.info().has_int64_atomics) {
    return fail(ErrorCode::kUsage, "culling in an HA-buffer needs 64-bit atomics: {}",
                context.info().int64_atomics_reason);
  }
  auto store = gl::HashStore::create(context.info(), {.cull_opacity = settings.opacity_threshold});
  if (!store) return tl::unexpected(store.error());
  return of_store(std::unique_ptr<gl::Store>(std::move(*store)), settings.opacity_threshold);
}

GlMaker make_gl_scan(const gl::Context& context, const Settings&) {
  return of_store(gl::make_scan_store(context.info()));
}

GlMaker make_gl_fixed(const gl::Context& context, const Settings& settings) {
  return of_store(gl::make_fixed_store(context.info(), settings.k == 0 ? 8 : settings.k));
}

GlMaker make_gl_linked(const gl::Context& context, const Settings&) {
  return of_store(gl::make_linked_store(context.info(), 1));
}

GlMaker make_gl_paged(const gl::Context& context, const Settings& settings) {
  return of_store(gl::make_linked_store(context.info(), settings.k == 0 ? 4 : settings.k));
}

}  // namespace strata::transparency
