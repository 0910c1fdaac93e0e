#include "csg/picture/ghosts.h"

#include <memory>
#include <vector>

#include "strata/hashbuffer/build_ldi.h"

namespace strata::csg {
namespace {

/// Blends the surfaces of one ray before a colour. Scratch of one thread.
class PixelPainter {
 public:
  PixelPainter(const TranslucentTrees& trees, const TranslucentView& seen, const View& view,
               const Shader& shader)
      : trees_(&trees), seen_(&seen), shader_(&shader), walk_(trees, seen, view), kept_(kKept) {}

  /// @param opaque depth of the opaque surface, or kNone
  void paint(std::span<const DepthItem> items, std::uint32_t opaque, Rgba& colour) {
    glm::vec3 light(0.0f);  // premultiplied, front to back
    float left = 1.0f;
    bool painted = false;
    for (const TranslucentWalk::Fragment& fragment : walk_.surfaces(items)) {
      if (opaque != SurfaceImage::kNone && fragment.depth > opaque + walk_.slack(opaque)) break;
      const glm::vec4& face = colour_of(fragment.triangle, fragment.exit);
      light += left * face.a * glm::vec3(face);
      left *= 1.0f - face.a;
      painted = true;
    }
    if (!painted) return;
    const glm::vec4 behind = glm::vec4(colour) / 255.0f;
    colour = to_bytes(glm::vec4(light + left * glm::vec3(behind), 1.0f - left * (1.0f - behind.a)));
  }

 private:
  /// Faces met before that are kept.
  static constexpr std::size_t kKept = 256;
  struct Kept {
    std::uint32_t triangle = SurfaceImage::kNone;
    bool exit = false;
    glm::vec4 colour{0.0f};
  };

  const glm::vec4& colour_of(std::uint32_t triangle, bool exit) {
    Kept& kept = kept_[(triangle * 2 + (exit ? 1 : 0)) % kKept];
    if (kept.triangle != triangle || kept.exit != exit) {
      kept = {triangle, exit,
              translucent_colour(*trees_, seen_->slot_of[triangle], seen_->source(triangle), exit,
                                 *shader_)};
    }
    return kept.colour;
  }

  const TranslucentTrees* trees_;
  const TranslucentView* seen_;
  const Shader* shader_;
  TranslucentWalk walk_;
  std::vector<Kept> kept_;
};

}  // namespace

glm::vec4 translucent_colour(const TranslucentTrees& trees, std::uint32_t slot,
                             std::uint32_t source, bool exit, const Shader& shader) {
  const TranslucentTrees::Slot& one = trees.slots()[slot];
  const auto& colour = trees.parts()[one.part].colour;
  // The far wall of a translucent solid is no cut.
  const bool cut = exit && shader.base(one.solid, false).a == 1.0f;
  const glm::vec4 base = colour ? *colour : shader.base(one.solid, cut);
  return {shader.lit(one.solid, source, exit, glm::vec3(base)), base.a};
}

Result<void> GhostPainter::paint(const View& view, const SurfaceImage& opaque, const Shader& shader,
                                 const Execution& execution, std::span<Rgba> colours) {
  const auto seen = TranslucentView::make(trees_, view, execution);
  if (!seen) return tl::unexpected(seen.error());
  const TranslucentView::Mesh all = seen->joined();
  const auto lists =
      build_ldi(all.mesh, {Axis::kZ, view.size.x, view.size.y, kPictureDepthLimit}, {}, execution);
  if (!lists) return tl::unexpected(lists.error());
  fragments_ = lists->items.size();

  std::vector<std::unique_ptr<PixelPainter>> painters(
      static_cast<std::size_t>(execution.thread_count()));
  parallel_for(execution, static_cast<std::size_t>(view.size.y), [&](std::size_t v, int worker) {
    const auto width = static_cast<std::size_t>(view.size.x);
    const std::size_t begin = v * width, end = begin + width;
    if (lists->offsets[begin] == lists->offsets[end]) return;
    auto& painter = painters[static_cast<std::size_t>(worker)];
    if (!painter) painter = std::make_unique<PixelPainter>(trees_, *seen, view, shader);
    for (std::size_t i = begin; i < end; ++i) {
      const auto items = std::span(lists->items)
                             .subspan(lists->offsets[i], lists->offsets[i + 1] - lists->offsets[i]);
      if (!items.empty()) painter->paint(items, opaque.depth[i], colours[i]);
    }
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return {};
}

}  // namespace strata::csg
