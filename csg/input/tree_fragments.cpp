#include "csg/input/tree_fragments.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>
#include <vector>

#include "csg/picture/ghosts.h"
#include "csg/surface/surface_tiles.h"
#include "hashbuffer/tile_store.h"
#include "strata/hashbuffer/depth_list_store.h"

namespace strata::csg {
namespace {

using transparency::FragmentSource;
using transparency::TileFragments;

class TreeFragments final : public FragmentSource {
 public:
  TreeFragments(TreeFragmentsInput input, std::shared_ptr<const void> owner)
      : input_(std::move(input)), owner_(std::move(owner)) {}

  Result<void> prepare(const Shader& shader, const Execution& execution);

  [[nodiscard]] glm::ivec2 size() const override { return input_.view.size; }
  [[nodiscard]] std::span<const glm::vec4> colours() const override { return colours_; }
  [[nodiscard]] std::span<const std::uint32_t> objects() const override { return objects_; }
  [[nodiscard]] std::unique_ptr<Worker> worker() const override;

 private:
  class TileWorker;

  [[nodiscard]] bool any_opaque() const { return input_.opaque != nullptr; }
  /// The numbers that triangles have as fragments: those of the slots, then those of opaque solids.
  Result<void> number_triangles();
  void colour_slots(const Shader& shader, const Execution& execution);
  void colour_opaque(const Shader& shader, const Execution& execution);
  void set_colour(std::size_t triangle, bool exit, const glm::vec4& colour) {
    colours_[2 * triangle + (exit ? 1 : 0)] = glm::vec4(glm::vec3(colour) * colour.a, colour.a);
  }

  TreeFragmentsInput input_;
  std::shared_ptr<const void> owner_;
  TranslucentView seen_;
  SurfaceTiles opaque_;  ///< if there is any
  std::vector<std::uint32_t> slot_firsts_, solid_firsts_;
  std::vector<glm::vec4> colours_;
  std::vector<std::uint32_t> objects_;
};

Result<void> TreeFragments::number_triangles() {
  const auto& parts = input_.trees.geometry().parts();
  std::uint64_t count = 0;
  const auto objects = static_cast<std::uint32_t>(input_.trees.parts().size());
  const auto add = [&](std::vector<std::uint32_t>& firsts, std::uint32_t solid,
                       std::uint32_t object) {
    firsts.push_back(static_cast<std::uint32_t>(count));
    count += parts[solid].triangles.size();
    if (count <= 0x7fffffffu) objects_.resize(count, object);
  };
  for (const TranslucentTrees::Slot& slot : input_.trees.slots()) {
    add(slot_firsts_, slot.solid, slot.part);
  }
  for (std::uint32_t solid = 0; any_opaque() && solid < parts.size(); ++solid) {
    add(solid_firsts_, solid, objects);
  }
  if (count > 0x7fffffffu) {
    return fail(ErrorCode::kLimit, "the scene has {} triangles; the limit is {}", count,
                0x7fffffffu);
  }
  colours_.resize(2 * count);
  return {};
}

void TreeFragments::colour_slots(const Shader& shader, const Execution& execution) {
  const auto slots = input_.trees.slots();
  parallel_for(execution, slots.size(), [&](std::size_t i, int) {
    const auto slot = static_cast<std::uint32_t>(i);
    const auto count = static_cast<std::uint32_t>(input_.trees.solid_of(slots[i]).triangles.size());
    for (std::uint32_t t = 0; t < count; ++t) {
      for (const bool exit : {false, true}) {
        set_colour(slot_firsts_[i] + t, exit,
                   translucent_colour(input_.trees, slot, t, exit, shader));
      }
    }
  });
}

void TreeFragments::colour_opaque(const Shader& shader, const Execution& execution) {
  parallel_for(execution, solid_firsts_.size(), [&](std::size_t i, int) {
    const auto solid = static_cast<std::uint32_t>(i);
    const auto count =
        static_cast<std::uint32_t>(input_.trees.geometry().parts()[i].triangles.size());
    for (std::uint32_t t = 0; t < count; ++t) {
      for (const bool exit : {false, true}) {
        const glm::vec3 base(shader.base(solid, exit));
        set_colour(solid_firsts_[i] + t, exit, glm::vec4(shader.lit(solid, t, exit, base), 1.0f));
      }
    }
  });
}

Result<void> TreeFragments::prepare(const Shader& shader, const Execution& execution) {
  if (auto done = number_triangles(); !done) return done;
  auto seen = TranslucentView::make(input_.trees, input_.view, execution);
  if (!seen) return tl::unexpected(seen.error());
  seen_ = std::move(*seen);
  colour_slots(shader, execution);
  if (any_opaque()) {
    const TranslucentTrees& trees = input_.trees;
    auto done = opaque_.prepare(*input_.opaque, trees.geometry(), trees.world_error(), input_.view,
                                execution);
    if (!done) return done;
    colour_opaque(shader, execution);
  }
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return {};
}

class TreeFragments::TileWorker final : public Worker {
 public:
  explicit TileWorker(const TreeFragments& source)
      : source_(&source), walk_(source.input_.trees, source.seen_, source.input_.view) {
    if (!source.any_opaque()) return;
    const SurfaceTiles& opaque = source.opaque_;
    finder_ = std::make_unique<TileFinder>(*source.input_.opaque, opaque.view_parts,
                                           source.input_.trees.geometry().parts(), opaque.view,
                                           opaque.coincidence);
    image_.resize(kTileSide, kTileSide);
  }

  Result<void> tile(int tu, int tv, bool keep_hidden, TileFragments& out) override {
    const glm::ivec2& size = source_->input_.view.size;
    clip_ = {tu * kTileSide, tv * kTileSide, std::min(size.x, (tu + 1) * kTileSide),
             std::min(size.y, (tv + 1) * kTileSide)};
    out.clear();
    if (finder_) place_opaque(tu, tv, out);
    rasterize();
    sort_lists();
    found_.clear();
    for (std::uint32_t pixel = 0; pixel < kTilePixels; ++pixel) {
      if (ends_[pixel] != ends_[pixel + 1]) walk(pixel, keep_hidden, out);
    }
    // In the order in which the triangles would have been submitted.
    std::sort(found_.begin(), found_.end());
    out.log.reserve(found_.size());
    for (const auto& [order, item] : found_) {
      out.add(static_cast<std::uint32_t>(order % kTilePixels), item);
    }
    return {};
  }

 private:
  void place_opaque(int tu, int tv, TileFragments& out) {
    const SurfaceTiles& tiles = source_->opaque_;
    const auto tile = static_cast<std::size_t>(tv) * static_cast<std::size_t>(tiles.tiles_u) +
                      static_cast<std::size_t>(tu);
    finder_->find(tu, tv, tiles.solids.at(tile), {&image_, clip_.u0, clip_.v0}, {});
    out.begin_opaque();
    for (int v = 0; v < clip_.v1 - clip_.v0; ++v) {
      for (int u = 0; u < clip_.u1 - clip_.u0; ++u) {
        const auto at = static_cast<std::size_t>(v * kTileSide + u);
        if (image_.depth[at] == SurfaceImage::kNone) continue;
        const std::uint32_t face = image_.triangle[at];
        out.opaque[at] =
            DepthItem(image_.depth[at], (face & SurfaceImage::kExit) != 0,
                      source_->solid_firsts_[image_.solid[at]] + (face & ~SurfaceImage::kExit));
      }
    }
  }
  /// The crossings of all slots in the tile; triangles are those of TranslucentView.
  void rasterize() {
    log_.count = 0;
    const TranslucentView& seen = source_->seen_;
    const RasterTarget target{Axis::kZ, source_->input_.view.size.x, source_->input_.view.size.y,
                              kPictureDepthLimit};
    for (std::size_t slot = 0; slot < seen.parts.size(); ++slot) {
      const ViewPart& part = seen.parts[slot];
      const PixelRect& rect = part.rect;
      if (rect.empty() || rect.u0 >= clip_.u1 || rect.u1 <= clip_.u0 || rect.v0 >= clip_.v1 ||
          rect.v1 <= clip_.v0) {
        continue;
      }
      if (part.binned) {
        const auto binned = part.bins.tile(clip_.u0 / kTileSide, clip_.v0 / kTileSide);
        triangles_.assign(binned.begin(), binned.end());
      } else {
        triangles_.resize(part.mesh.triangles.size());
        std::iota(triangles_.begin(), triangles_.end(), 0u);
      }
      const std::size_t first = log_.count;
      raster_into({part.mesh, target, triangles_, clip_}, log_);
      for (std::size_t i = first; i < log_.count; ++i) {
        const DepthItem item = log_.keys[i];
        log_.keys[i] =
            DepthItem(item.depth(), item.exit(), item.triangle() + seen.first_triangles[slot]);
      }
    }
  }
  void sort_lists() {
    ends_.fill(0);
    for (std::size_t i = 0; i < log_.count; ++i) ++ends_[log_.pixels[i] + 1];
    std::partial_sum(ends_.begin(), ends_.end(), ends_.begin());
    cursors_ = ends_;
    items_.resize(log_.count);
    for (std::size_t i = 0; i < log_.count; ++i) items_[cursors_[log_.pixels[i]]++] = log_.keys[i];
    for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
      strata::detail::sort_list(items_.data() + ends_[pixel], items_.data() + ends_[pixel + 1]);
    }
  }
  /// The surfaces of one pixel.
  void walk(std::uint32_t pixel, bool keep_hidden, TileFragments& out) {
    const auto crossings = std::span(items_).subspan(ends_[pixel], ends_[pixel + 1] - ends_[pixel]);
    const bool ends = out.any_opaque && out.opaque[pixel] != TileFragments::kNothing;
    const DepthItem opaque = ends ? out.opaque[pixel] : TileFragments::kNothing;
    const double last = ends ? opaque.depth() + walk_.slack(opaque.depth()) : 0.0;
    for (const TranslucentWalk::Fragment& fragment : walk_.surfaces(crossings)) {
      const std::uint32_t slot = source_->seen_.slot_of[fragment.triangle];
      const std::uint32_t triangle =
          source_->slot_firsts_[slot] + source_->seen_.source(fragment.triangle);
      const bool hidden = ends && fragment.depth > last;
      if (hidden && !keep_hidden) break;
      const DepthItem item(fragment.depth, fragment.exit, triangle);
      // A face that coincides with the opaque one is seen: that one is moved behind it.
      if (ends && !hidden && opaque < item) {
        const std::uint32_t behind = std::min(fragment.depth + 1, kPictureDepthLimit - 1);
        out.opaque[pixel] = DepthItem(behind, opaque.exit(), opaque.triangle());
      }
      found_.emplace_back(std::uint64_t{triangle} * kTilePixels + pixel, item);
    }
  }

  const TreeFragments* source_;
  TranslucentWalk walk_;
  std::unique_ptr<TileFinder> finder_;
  SurfaceImage image_;  ///< of the opaque surfaces of a tile
  PixelRect clip_;
  TileLog<Record64> log_;
  std::vector<std::uint32_t> triangles_;
  std::array<std::uint32_t, kTilePixels + 1> ends_{}, cursors_{};
  std::vector<DepthItem> items_;
  std::vector<std::pair<std::uint64_t, DepthItem>> found_;  ///< [triangle | pixel], fragment
};

std::unique_ptr<FragmentSource::Worker> TreeFragments::worker() const {
  return std::make_unique<TileWorker>(*this);
}

}  // namespace

Result<std::shared_ptr<const FragmentSource>> make_tree_fragments(TreeFragmentsInput input,
                                                                  const Shader& shader,
                                                                  std::shared_ptr<const void> owner,
                                                                  const Execution& execution) {
  auto source = std::make_shared<TreeFragments>(std::move(input), std::move(owner));
  if (auto done = source->prepare(shader, execution); !done) return tl::unexpected(done.error());
  return source;
}

}  // namespace strata::csg
