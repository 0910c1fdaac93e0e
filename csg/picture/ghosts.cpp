#include "csg/picture/ghosts.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "hashbuffer/tile_builder.h"
#include "raster/tile_bins.h"

namespace strata::csg {
namespace {

/// Blends the surfaces of one ray before a colour. Scratch of one thread.
///
/// Neighbours mostly meet the same faces in the same order. Depths matter to the walk only where
/// crossings are close to each other, so where none are, what it found for the last such ray holds
/// for the next one that meets the same faces.
class PixelPainter {
 public:
  PixelPainter(const TranslucentTrees& trees, const TranslucentView& seen, const View& view,
               const Shader& shader)
      : trees_(&trees),
        seen_(&seen),
        shader_(&shader),
        walk_(trees, seen, view),
        apart_(static_cast<std::uint32_t>(std::min(walk_.slack(0), double{kPictureDepthLimit})) +
               kSheet + 1),
        kept_(kKept) {}

  /// @param items  the crossings of the ray @param opaque depth of the opaque surface, or kNone
  void paint(std::span<const DepthItem> items, std::uint32_t opaque, Rgba& colour) {
    if (!is_repeated(items)) blend_all(items);
    const double last = opaque + walk_.slack(opaque);
    std::size_t shown = layers_.size();
    if (opaque != SurfaceImage::kNone) {
      shown = 0;
      while (shown < layers_.size() && depth_of(layers_[shown], items) <= last) ++shown;
    }
    if (shown == 0) return;
    const Layer& layer = layers_[shown - 1];
    if (shown != last_shown_ || colour != last_colour_) {
      const glm::vec4 behind = glm::vec4(colour) / 255.0f;
      const float left = layer.left;
      last_shown_ = shown;
      last_colour_ = colour;
      painted_ = to_bytes(
          glm::vec4(layer.light + left * glm::vec3(behind), 1.0f - left * (1.0f - behind.a)));
    }
    colour = painted_;
  }

 private:
  /// A crossing without a partner becomes a sheet so thick, transitions_of().
  static constexpr std::uint32_t kSheet = 1;
  /// Faces met before that are kept.
  static constexpr std::size_t kKept = 256;
  struct Kept {
    std::uint32_t triangle = SurfaceImage::kNone;
    bool exit = false;
    glm::vec4 colour{0.0f};
  };
  /// A surface of a ray, and what is seen of it and those before it.
  struct Layer {
    std::uint32_t crossing;  ///< index; kNone: where the ray begins
    std::uint32_t depth;     ///< beyond that of the crossing
    glm::vec3 light;         ///< premultiplied
    float left;
  };

  [[nodiscard]] static std::uint32_t depth_of(const Layer& layer,
                                              std::span<const DepthItem> items) {
    return layer.depth +
           (layer.crossing == SurfaceImage::kNone ? 0 : items[layer.crossing].depth());
  }
  /// Whether layers_ are those of the ray. If not, faces_ become those of this ray.
  bool is_repeated(std::span<const DepthItem> items) {
    bool same = items.size() == faces_.size(), apart = true;
    std::uint32_t before = 0;
    for (const DepthItem item : items) {
      apart = apart && item.depth() - before >= apart_;
      before = item.depth();
    }
    for (std::size_t i = 0; same && i < items.size(); ++i) same = items[i].payload() == faces_[i];
    if (same && apart) return true;
    faces_.clear();
    if (apart) {  // else this ray is like no other
      for (const DepthItem item : items) faces_.push_back(item.payload());
    }
    return false;
  }
  /// layers_ become those of the ray.
  void blend_all(std::span<const DepthItem> items) {
    layers_.clear();
    last_shown_ = 0;
    glm::vec3 light(0.0f);  // front to back
    float left = 1.0f;
    for (const TranslucentWalk::Fragment& fragment : walk_.surfaces(items)) {
      const glm::vec4& face = colour_of(fragment.triangle, fragment.exit);
      light += left * face.a * glm::vec3(face);
      left *= 1.0f - face.a;
      Layer layer{SurfaceImage::kNone, fragment.depth, light, left};
      for (std::uint32_t i = 0; i < faces_.size(); ++i) {
        const DepthItem item = items[i];
        if (item.triangle() != fragment.triangle) continue;
        layer.crossing = i;
        layer.depth -= item.depth();
      }
      layers_.push_back(layer);
    }
  }

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
  /// From this distance on, crossings are not close: more than slack() anywhere, and sheets.
  std::uint32_t apart_;
  std::vector<std::uint32_t> faces_;  ///< of the last ray without close crossings, in order
  std::vector<Layer> layers_;
  std::size_t last_shown_ = 0;  ///< of layers_, over last_colour_: painted_; 0: none yet
  Rgba last_colour_{0}, painted_{0};
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

/// The trees in a view.
struct GhostPainter::Prepared {
  /// Of one thread, made when it meets its first tile.
  struct Worker {
    Worker(const TranslucentTrees& trees, const Prepared& prepared)
        : painter(trees, prepared.seen, prepared.view, *prepared.shader) {}
    ItemTileBuilder lists;
    PixelPainter painter;
    std::vector<DepthItem> items;
    std::uint64_t fragments = 0;
    Result<void> status;
  };

  View view;
  const Shader* shader;
  RasterTarget target;
  TranslucentView seen;
  TranslucentView::Mesh all;
  TileBins bins;
  std::vector<std::unique_ptr<Worker>> workers;
};

GhostPainter::GhostPainter(const Tree& tree, std::span<const Translucent> ghosts,
                           const Geometry& geometry, double world_error)
    : trees_(tree, ghosts, geometry, world_error) {}
GhostPainter::~GhostPainter() = default;

Result<void> GhostPainter::begin(const View& view, const Shader& shader,
                                 const Execution& execution) {
  auto seen = TranslucentView::make(trees_, view, execution);
  if (!seen) return tl::unexpected(seen.error());
  prepared_ = std::make_unique<Prepared>();
  Prepared& made = *prepared_;
  made.view = view;
  made.shader = &shader;
  made.target = {Axis::kZ, view.size.x, view.size.y, kPictureDepthLimit};
  made.seen = std::move(*seen);
  made.all = made.seen.joined();
  auto bins = bin_triangles(made.all.mesh, made.target, execution);
  if (!bins) return tl::unexpected(bins.error());
  made.bins = std::move(*bins);
  made.workers.resize(static_cast<std::size_t>(execution.thread_count()));
  return {};
}

bool GhostPainter::meets(const PixelRect& tile) const {
  return !prepared_->bins.tile(tile.u0 / kTileSide, tile.v0 / kTileSide).empty();
}

void GhostPainter::paint(const PixelRect& tile, const std::uint32_t* opaque, Rgba* colours,
                         std::size_t stride, std::size_t worker) {
  const Prepared& prepared = *prepared_;
  auto& made = prepared_->workers[worker];
  if (!made) made = std::make_unique<Prepared::Worker>(trees_, prepared);
  Prepared::Worker& own = *made;
  const int tile_u = tile.u0 / kTileSide, tile_v = tile.v0 / kTileSide;
  const auto triangles = prepared.bins.tile(tile_u, tile_v);
  if (triangles.empty()) return;
  const auto lists = own.lists.build(prepared.all.mesh, prepared.target, triangles, tile_u, tile_v);
  if (!lists) {
    own.status = tl::unexpected(lists.error());
    return;
  }
  own.fragments += lists->fragments;
  for (int v = 0; v < tile.v1 - tile.v0; ++v) {
    const std::size_t row = static_cast<std::size_t>(v) * stride;
    for (int u = 0; u < tile.u1 - tile.u0; ++u) {
      own.items.clear();
      for_each_item(*lists, static_cast<std::size_t>(v * kTileSide + u),
                    [&](DepthItem item) { own.items.push_back(item); });
      if (own.items.empty()) continue;
      const std::size_t at = row + static_cast<std::size_t>(u);
      own.painter.paint(own.items, opaque != nullptr ? opaque[at] : SurfaceImage::kNone,
                        colours[at]);
    }
  }
}

Result<void> GhostPainter::end() {
  const std::unique_ptr<Prepared> done = std::move(prepared_);
  fragments_ = 0;
  for (const auto& worker : done->workers) {
    if (!worker) continue;
    fragments_ += worker->fragments;
    if (!worker->status) return worker->status;
  }
  return {};
}

}  // namespace strata::csg
