#include "transparency/gl/gl_frame.h"

#include <chrono>

#include "strata/raster/view.h"
#include "transparency/stream/tile_stream.h"

namespace strata::glsl {
extern const gl::GlslPiece transparency_gl_repeat_rows_comp;
}  // namespace strata::glsl

namespace strata::transparency {

Result<std::unique_ptr<GlFrame>> GlFrame::make(const gl::Context& context,
                                               const FragmentSource& source,
                                               GlRasterizer rasterizer) {
  const FrameTriangles* triangles = source.triangles();
  if (triangles == nullptr) {
    return fail(ErrorCode::kUsage, "the GPU needs triangles; this frame has bare fragments");
  }
  auto frame = std::unique_ptr<GlFrame>(new GlFrame);
  const LatticeMesh& mesh = triangles->part.mesh;
  const RasterTarget target{Axis::kZ, source.size().x, source.size().y, kPictureDepthLimit};
  Result<void> uploaded;
  if (rasterizer == GlRasterizer::kCompute) {
    auto made = gl::ComputeRasterizer::create(context);
    if (!made) return tl::unexpected(made.error());
    frame->compute_ = std::move(*made);
    uploaded = frame->compute_->set_mesh(mesh);
    frame->compute_->set_target(target, 0, target.height);
    frame->producer_ = frame->compute_.get();
  } else {
    auto made = gl::HardwareRasterizer::create(context);
    if (!made) return tl::unexpected(made.error());
    frame->hardware_ = std::move(*made);
    uploaded = frame->hardware_->set_mesh(mesh);
    frame->hardware_->set_target(target);
    frame->producer_ = frame->hardware_.get();
  }
  if (!uploaded) return tl::unexpected(uploaded.error());
  std::vector<glm::vec4> faces(2 * mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::size_t from = 2 * static_cast<std::size_t>(triangles->part.source(t));
    faces[2 * t] = source.colours()[from];
    faces[2 * t + 1] = source.colours()[from + 1];
  }
  const std::uint64_t bytes =
      std::max(faces.size(), static_cast<std::size_t>(frame->pixels())) * sizeof(glm::vec4);
  if (bytes > context.info().limits.storage_block_bytes) {
    return fail(ErrorCode::kLimit,
                "a frame of {} x {} pixels and {} triangles needs {} bytes at one binding, which "
                "holds {}",
                frame->width(), frame->height(), mesh.triangles.size(), bytes,
                context.info().limits.storage_block_bytes);
  }
  if (auto done = frame->faces_.assign(std::span<const glm::vec4>(faces)); !done) {
    return tl::unexpected(done.error());
  }
  return frame;
}

void run_for_pixels(const gl::Program& program, std::uint32_t pixels) {
  constexpr std::uint32_t kPixelsOfGroup = 64;
  program.set("pixels", pixels);
  const gl::Groups groups = gl::groups_for(pixels, kPixelsOfGroup);
  program.dispatch(groups.x, groups.y);
  gl::storage_barrier();
}

Result<void> GlFrame::clear(gl::Buffer& image) {
  const glm::vec4 nothing(0, 0, 0, 1);
  return fill(image, std::span(&nothing, 1));
}

Result<void> GlFrame::fill(gl::Buffer& image, std::span<const glm::vec4> rows) {
  if (!repeat_) {
    const gl::GlslPiece piece = glsl::transparency_gl_repeat_rows_comp;
    auto made = gl::Program::compute({&piece, 1});
    if (!made) return tl::unexpected(made.error());
    repeat_ = std::move(*made);
  }
  const auto count = static_cast<std::uint32_t>(rows.size());
  if (auto room = image.reserve(std::uint64_t{pixels()} * rows.size_bytes()); !room) return room;
  if (auto done = rows_.assign(rows); !done) return done;
  rows_.bind(0);
  image.bind(1);
  repeat_.set("count", count);
  run_for_pixels(repeat_, pixels() * count);
  return {};
}

Result<Rendering> GlFrame::render(GlRenderer& renderer, const glm::vec4& background,
                                  const Execution& execution) {
  using Clock = std::chrono::steady_clock;
  const auto seconds_since = [](Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
  };
  const auto begin = Clock::now();
  Rendering rendering;
  if (auto room = image_.reserve(std::uint64_t{pixels()} * sizeof(glm::vec4)); !room) {
    return tl::unexpected(room.error());
  }
  gl::finish();
  const auto ready = Clock::now();
  if (auto done = renderer.render(*this, rendering.costs, execution); !done) {
    return tl::unexpected(done.error());
  }
  gl::finish();
  rendering.technique_seconds = seconds_since(ready);
  rendering.image.width = static_cast<int>(width());
  rendering.image.height = static_cast<int>(height());
  rendering.image.pixels.resize(pixels());
  image_.download(std::span(rendering.image.pixels));
  if (auto good = gl::check_errors("transparency"); !good) return tl::unexpected(good.error());
  const glm::vec4 behind(glm::vec3(background) * background.a, background.a);
  for (glm::vec4& pixel : rendering.image.pixels) {
    pixel = over(pixel, behind);
  }
  rendering.seconds = seconds_since(begin);
  return rendering;
}

}  // namespace strata::transparency
