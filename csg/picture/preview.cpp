#include <algorithm>
#include <functional>
#include <glm/geometric.hpp>
#include <new>
#include <numeric>

#include "core/reserve_large.h"
#include "csg/picture/ghosts.h"
#include "csg/picture/ground_shadow.h"
#include "csg/picture/shade.h"
#include "csg/program.h"
#include "csg/surface/frame_input.h"
#include "csg/surface/surface_source.h"
#include "csg/surface/surface_tiles.h"
#include "csg/surface/tile_surface.h"
#include "strata/csg/picture/picture.h"

namespace strata::csg {
namespace {

/// One tree of solids in one view.
class Frame {
 public:
  Frame(const Program& program, const Geometry& geometry, double world_error)
      : program_(&program), geometry_(&geometry), world_error_(world_error) {}

  /// What is to be done with the surfaces of tiles. None: they stay in image().
  struct OnTile {
    /// Pixels `rect` of the picture; a null tile shows nothing.
    std::function<void(const SurfaceImage* tile, const AreaFaces& faces, const PixelRect& rect,
                       std::size_t worker)>
        take;
    /// Whether `faces` must not stand for pixels of `tile`.
    std::function<bool(const PixelRect& rect)> needs_pixels;
    /// As SurfacePart has it.
    std::function<bool(std::uint32_t solid, std::span<const std::uint32_t> triangles,
                       std::uint32_t exit, std::size_t worker)>
        alike;
    explicit operator bool() const { return take != nullptr; }
  };

  /// Finds all surfaces. With `on_tile` they are handed to it, from any thread, and image() is not
  /// kept: memory is slower than the search.
  Result<void> draw(const View& view, const Execution& execution, const OnTile& on_tile = {}) {
    auto done = tiles_.prepare(*program_, *geometry_, world_error_, view, execution);
    if (!done) return done;
    report_ = {};
    whole_ = false;
    return find_all(execution, on_tile);
  }

  Result<void> moved(std::uint32_t solid, const Execution& execution) {
    const PixelRect before = tiles_.view_parts[solid].rect;
    auto part = view_part(geometry_->parts()[solid].placed(), tiles_.view, execution);
    if (!part) return tl::unexpected(part.error());
    tiles_.view_parts[solid] = std::move(*part);
    const PixelRect after = tiles_.view_parts[solid].rect;
    tiles_.solids.build(tiles_.view_parts, tiles_.tiles_u, tiles_.tiles_v);
    if (!whole_ || source_ != nullptr) return find_all(execution, {});
    std::vector<std::uint32_t> tiles;
    for (int tv = 0; tv < tiles_.tiles_v; ++tv) {
      for (int tu = 0; tu < tiles_.tiles_u; ++tu) {
        const auto meets = [&](const PixelRect& rect) {
          return !rect.empty() && rect.u0 < (tu + 1) * kTileSide && rect.u1 > tu * kTileSide &&
                 rect.v0 < (tv + 1) * kTileSide && rect.v1 > tv * kTileSide;
        };
        if (meets(before) || meets(after)) {
          tiles.push_back(static_cast<std::uint32_t>(tv * tiles_.tiles_u + tu));
        }
      }
    }
    return find(tiles, execution, {});
  }

  /// Null: the surfaces are found here.
  void set_source(SurfaceSource* source) { source_ = source; }
  [[nodiscard]] bool has_source() const { return source_ != nullptr; }

  [[nodiscard]] const SurfaceImage& image() const { return image_; }
  [[nodiscard]] const View& view() const { return tiles_.view; }
  [[nodiscard]] const DrawReport& report() const { return report_; }

 private:
  Result<void> find_all(const Execution& execution, const OnTile& on_tile) {
    std::vector<std::uint32_t> tiles(static_cast<std::size_t>(tiles_.tiles_u * tiles_.tiles_v));
    std::iota(tiles.begin(), tiles.end(), 0u);
    if (!on_tile) image_.resize(tiles_.view.size.x, tiles_.view.size.y);
    if (source_ != nullptr && !on_tile) {
      DrawReport elsewhere;
      tiles.clear();
      const FrameInput input{*program_,      geometry_->parts(),    tiles_.view_parts,
                             tiles_.view,    tiles_.coincidence,    tiles_.tiles_u,
                             tiles_.tiles_v, tiles_.solids.offsets, tiles_.solids.solids};
      auto found = source_->find(input, image_, elsewhere, tiles, execution);
      if (found) found = find(tiles, execution, {});
      report_.fragments += elsewhere.fragments;
      report_.resolved += elsewhere.resolved;
      whole_ = found.has_value();
      return found;
    }
    auto done = find(tiles, execution, on_tile);
    whole_ = done.has_value() && !on_tile;
    return done;
  }

  Result<void> find(std::span<const std::uint32_t> tiles, const Execution& execution,
                    const OnTile& on_tile) {
    const auto workers = static_cast<std::size_t>(execution.thread_count());
    while (finders_.size() < workers) {
      finders_.push_back(std::make_unique<TileFinder>(
          *program_, tiles_.view_parts, geometry_->parts(), tiles_.view, tiles_.coincidence));
      tile_images_.emplace_back().resize(kTileSide, kTileSide);
      tile_faces_.emplace_back();
    }
    for (const auto& finder : finders_) finder->reset_counts();
    parallel_for(execution, tiles.size(), [&](std::size_t i, int thread) {
      const auto worker = static_cast<std::size_t>(thread);
      const auto tile = static_cast<int>(tiles[i]);
      const int tile_u = tile % tiles_.tiles_u, tile_v = tile / tiles_.tiles_u;
      const PixelRect rect{tile_u * kTileSide, tile_v * kTileSide,
                           std::min(tiles_.view.size.x, (tile_u + 1) * kTileSide),
                           std::min(tiles_.view.size.y, (tile_v + 1) * kTileSide)};
      const auto solids = tiles_.solids.at(static_cast<std::size_t>(tile));
      AreaFaces& faces = tile_faces_[worker];
      if (on_tile && solids.empty()) return on_tile.take(nullptr, faces, rect, worker);
      SurfacePart part{&image_};
      if (on_tile) {
        part = {&tile_images_[worker], rect.u0, rect.v0,
                on_tile.needs_pixels(rect) ? nullptr : &faces,
                [&on_tile, worker](std::uint32_t solid, std::span<const std::uint32_t> triangles,
                                   std::uint32_t exit) {
                  return on_tile.alike(solid, triangles, exit, worker);
                }};
      }
      finders_[worker]->find(tile_u, tile_v, solids, part, execution.stop);
      if (on_tile) on_tile.take(part.image, faces, rect, worker);
    });
    report_.fragments = report_.resolved = 0;
    for (const auto& finder : finders_) {
      report_.fragments += finder->fragments();
      report_.resolved += finder->resolved();
    }
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    return {};
  }

  const Program* program_;
  const Geometry* geometry_;
  double world_error_;
  SurfaceTiles tiles_;
  std::vector<std::unique_ptr<TileFinder>> finders_;
  std::vector<SurfaceImage> tile_images_;  ///< of each worker
  std::vector<AreaFaces> tile_faces_;
  bool whole_ = false;  ///< image_ shows all of tiles_.view
  SurfaceSource* source_ = nullptr;
  SurfaceImage image_;
  DrawReport report_;
};

/// Samples of a picture that are drawn at once: memory stays bounded.
constexpr std::int64_t kSamplesAtOnce = std::int64_t{1} << 22;
/// The same where they become pixels tile by tile and only the triangles' tiles are held.
constexpr std::int64_t kDirectSamplesAtOnce = std::int64_t{1} << 26;
/// Degrees, of pictures under studio lights.
constexpr double kStudioCrease = 30.0;

}  // namespace

struct Preview::Impl {
  Impl(Tree t, std::span<const Ghost> given, double relative_precision, const Execution& execution)
      : tree(std::move(t)),
        opaque_root(take_translucent(tree, translucent)),
        geometry(tree, execution),
        program(compile(tree, opaque_root)),
        error(geometry.world_error(tree, relative_precision)),
        frame(program, geometry, error),
        painter(tree, with_ghosts(given), geometry, error) {}

  [[nodiscard]] std::vector<Tree::NodeId> shown() const {
    std::vector<Tree::NodeId> nodes{tree.root()};
    for (const Translucent& part : translucent) nodes.push_back(part.node);
    return nodes;
  }
  [[nodiscard]] Bounds box() const { return picture_box(tree, geometry.boxes(), shown()); }
  Result<View> view(const Camera& camera, const glm::ivec2& size, const Execution& execution) const;
  std::span<const Translucent> with_ghosts(std::span<const Ghost> given) {
    for (const Ghost& ghost : given) translucent.push_back({ghost.node, ghost.colour});
    return translucent;
  }

  Result<const SurfaceImage*> draw(const View& view, const Execution& execution) {
    if (auto done = frame.draw(view, execution); !done) return tl::unexpected(done.error());
    return surfaces();
  }
  const SurfaceImage* surfaces() {
    report = frame.report();
    report_covers = false;
    return &frame.image();
  }

  Result<Picture> picture(const Camera& camera, const glm::ivec2& size,
                          const PictureOptions& options, const Execution& execution);

  /// How a picture is shaded.
  struct Look {
    const PictureOptions& options;
    SampleGrid samples;
    Shader shader;
    Backdrop backdrop;
    int height;  ///< rows of the whole picture
    [[nodiscard]] Ground ground(int first) const { return {backdrop, first, height}; }
  };
  /// The report of a picture, and the samples of the band that is drawn.
  struct Work {
    DrawReport total;
    std::vector<Rgba> samples;
  };
  /// Rows of a picture that are drawn at once.
  struct Band {
    View view;      ///< of their samples
    int first = 0;  ///< row
    int width = 0;  ///< pixels a row
    std::span<Rgba> pixels;
  };
  Result<void> look_around(const View& whole, const ColourScheme& scheme,
                           const PictureOptions& options, const Execution& execution);
  Result<void> lay_shadow(const View& whole, const Backdrop& backdrop, const Execution& execution,
                          Picture& picture);
  Result<void> begin_ghosts(const Band& band, const Look& look, const Execution& execution);
  Result<void> end_ghosts(Work& work);
  Result<void> paint_ghosts(const Band& band, const SurfaceImage& image, const Look& look,
                            const Execution& execution, Work& work);
  Result<void> shade_tiles(const Band& band, const Look& look, const Execution& execution,
                           Work& work);
  Result<void> shade_samples(const Band& band, const Look& look, Execution execution, Work& work);

  Tree tree;
  std::vector<Translucent> translucent;
  Tree::NodeId opaque_root;
  Geometry geometry;
  Program program;
  double error;
  Frame frame;
  SolidNormals normals{geometry};
  ViewOpenness openness;  ///< of the picture that is drawn
  GhostPainter painter;
  DrawReport report;
  bool report_covers = false;  ///< report.covered is known
};

Result<View> Preview::Impl::view(const Camera& camera, const glm::ivec2& size,
                                 const Execution& execution) const {
  return view_of_tree(tree, geometry, shown(), camera, size, execution);
}

/// Looks at the picture once at a lower resolution: which solids need normals, what is in whose
/// way.
Result<void> Preview::Impl::look_around(const View& whole, const ColourScheme& scheme,
                                        const PictureOptions& options, const Execution& execution) {
  const double crease = options.crease.value_or(scheme.studio_lights ? kStudioCrease : 0.0);
  const bool occlusion = options.occlusion.value_or(scheme.studio_lights);
  openness = {};
  normals.make({}, crease, execution);
  Execution quiet = execution;
  quiet.progress = {};
  if (!occlusion) {  // without another look at the picture
    normals.make(std::vector<std::uint8_t>(geometry.parts().size(), 1), crease, quiet);
    return {};
  }
  const auto drawn = frame.draw(ViewOpenness::reduced(whole), quiet);
  if (!drawn) return drawn;
  const SurfaceImage& image = frame.image();
  if (crease > 0) {
    std::vector<std::uint8_t> seen(geometry.parts().size(), 0);
    for (std::size_t i = 0; i < image.depth.size(); ++i) {
      if (image.depth[i] != SurfaceImage::kNone) seen[image.solid[i]] = 1;
    }
    normals.make(seen, crease, quiet);
  }
  openness = ViewOpenness(whole, image, geometry, normals, quiet);
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return {};
}

/// Puts a shadow and a backdrop behind a picture that has none.
Result<void> Preview::Impl::lay_shadow(const View& whole, const Backdrop& backdrop,
                                       const Execution& execution, Picture& picture) {
  Execution quiet = execution;
  quiet.progress = {};
  const auto draw = [&](const View& view) -> Result<const SurfaceImage*> {
    if (auto done = frame.draw(view, quiet); !done) return tl::unexpected(done.error());
    return &frame.image();
  };
  const auto shadow = GroundShadow::make(box(), draw, quiet);
  if (!shadow) return tl::unexpected(shadow.error());
  shadow->lay_under(picture, whole, quiet);
  if (!backdrop.transparent()) lay_over(picture, backdrop);
  return {};
}

Result<void> Preview::Impl::begin_ghosts(const Band& band, const Look& look,
                                         const Execution& execution) {
  if (painter.empty()) return {};
  return painter.begin(band.view, look.shader, execution);
}

Result<void> Preview::Impl::end_ghosts(Work& work) {
  if (painter.empty()) return {};
  const auto done = painter.end();
  work.total.fragments += painter.fragments();
  return done;
}

/// Paints the ghosts of a band over all of its samples.
Result<void> Preview::Impl::paint_ghosts(const Band& band, const SurfaceImage& image,
                                         const Look& look, const Execution& execution, Work& work) {
  if (painter.empty()) return {};
  if (auto done = begin_ghosts(band, look, execution); !done) return done;
  const auto tiles_u = static_cast<std::size_t>((image.width + kTileSide - 1) / kTileSide);
  const auto tiles_v = static_cast<std::size_t>((image.height + kTileSide - 1) / kTileSide);
  parallel_for(execution, tiles_u * tiles_v, [&](std::size_t tile, int worker) {
    const int u = static_cast<int>(tile % tiles_u) * kTileSide;
    const int v = static_cast<int>(tile / tiles_u) * kTileSide;
    const auto width = static_cast<std::size_t>(image.width);
    const std::size_t first = static_cast<std::size_t>(v) * width + static_cast<std::size_t>(u);
    const PixelRect rect{u, v, std::min(image.width, u + kTileSide),
                         std::min(image.height, v + kTileSide)};
    painter.paint(rect, image.depth.data() + first, work.samples.data() + first, width,
                  static_cast<std::size_t>(worker));
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return end_ghosts(work);
}

/// Shades the pixels of a band tile by tile, while the tiles are drawn, and ghosts over them.
Result<void> Preview::Impl::shade_tiles(const Band& band, const Look& look,
                                        const Execution& execution, Work& work) {
  const SampleRows rows{look.samples.across, look.samples.down, look.ground(band.first)};
  std::vector<TileShader> shaders;  // by worker
  for (int i = 0; i < execution.thread_count(); ++i) {
    shaders.emplace_back(rows, look.shader, band.width, band.pixels);
  }
  if (auto done = begin_ghosts(band, look, execution); !done) return done;
  const auto has_ghosts = [&](const PixelRect& rect) {
    return !painter.empty() && painter.meets(rect);
  };
  const auto take = [&](const SurfaceImage* tile, const AreaFaces& faces, const PixelRect& rect,
                        std::size_t worker) {
    TileShader& shader = shaders[worker];
    if (has_ghosts(rect)) {
      Rgba* const samples = shader.samples(tile, rect);
      painter.paint(rect, tile != nullptr ? tile->depth.data() : nullptr, samples, kTileSide,
                    worker);
      return shader.average_samples(rect);
    }
    return tile != nullptr ? shader.shade(*tile, faces, rect) : shader.leave(rect);
  };
  const auto alike = [&](std::uint32_t solid, std::span<const std::uint32_t> triangles,
                         std::uint32_t exit, std::size_t worker) {
    return shaders[worker].alike(solid, triangles, exit);
  };
  if (auto done = frame.draw(band.view, execution, {take, has_ghosts, alike}); !done) return done;
  if (auto done = end_ghosts(work); !done) return done;
  work.total.fragments += frame.report().fragments;
  work.total.resolved += frame.report().resolved;
  for (const TileShader& shader : shaders) work.total.covered += shader.covered();
  return {};
}

/// Draws all samples of a band, then edges and ghosts over them, and averages them to pixels.
Result<void> Preview::Impl::shade_samples(const Band& band, const Look& look, Execution execution,
                                          Work& work) {
  const auto image = draw(band.view, execution);
  if (!image) return tl::unexpected(image.error());
  work.total.fragments += report.fragments;
  work.total.resolved += report.resolved;
  execution.progress = {};
  const auto [across, down] = look.samples;
  work.samples.resize((*image)->depth.size());
  shade(**image, {across, down, look.ground(band.first)}, look.shader, execution, work.samples);
  if (look.options.edges) draw_edges(**image, look.shader, across, down, execution, work.samples);
  if (auto done = paint_ghosts(band, **image, look, execution, work); !done) return done;
  work.total.covered += average(work.samples, across, down, look.ground(band.first), execution,
                                band.width, band.pixels);
  return {};
}

Result<Picture> Preview::Impl::picture(const Camera& camera, const glm::ivec2& size,
                                       const PictureOptions& options, const Execution& execution) {
  if (auto good = check_samples(options.samples); !good) return tl::unexpected(good.error());
  const auto [across, down] = sample_grid(options.samples);
  const auto whole = view(camera, size, execution);
  if (!whole) return tl::unexpected(whole.error());
  if (size.x > kMaxPictureSide / across) {
    return fail(ErrorCode::kUsage,
                "a row of {} pixels with {} samples each exceeds the limit of {} samples", size.x,
                across, kMaxPictureSide);
  }
  const ColourScheme& scheme = options.scheme != nullptr ? *options.scheme : default_scheme();
  if (auto done = look_around(*whole, scheme, options, execution); !done) {
    return tl::unexpected(done.error());
  }
  const Backdrop backdrop = options.backdrop.value_or(plain_backdrop(scheme.background));
  const Look look{options,
                  {across, down},
                  Shader(tree, geometry, *whole, scheme,
                         {normals.empty() ? nullptr : &normals, &openness, options.hatched_caps}),
                  options.ground_shadow ? Backdrop{} : backdrop,
                  size.y};
  Picture result{size.x, size.y, {}};
  const auto width = static_cast<std::size_t>(size.x);
  detail::reserve_large(result.pixels, width * static_cast<std::size_t>(size.y));
  result.pixels.resize(width * static_cast<std::size_t>(size.y));
  // One row of tiles at least.
  const std::int64_t samples_a_row = std::int64_t{size.x} * across * down;
  const bool direct = !options.edges && !frame.has_source();
  const std::int64_t most = direct ? kDirectSamplesAtOnce : kSamplesAtOnce;
  const int rows_at_once = static_cast<int>(
      std::min<std::int64_t>(std::max<std::int64_t>(most / samples_a_row, kTileSide / down),
                             std::min(size.y, kMaxPictureSide / down)));
  Work work;
  for (int first = 0; first < size.y; first += rows_at_once) {
    const int rows = std::min(rows_at_once, size.y - first);
    // Edges look one row down.
    const int drawn = options.edges ? std::min(rows + 1, size.y - first) : rows;
    Execution part = execution;
    if (execution.progress) {
      part.progress = [&](double done) {
        execution.progress((first + done * rows) / static_cast<double>(size.y));
      };
    }
    const Band band{band_of(*whole, first, drawn, across, down), first, size.x,
                    std::span(result.pixels)
                        .subspan(static_cast<std::size_t>(first) * width,
                                 static_cast<std::size_t>(rows) * width)};
    const auto done =
        direct ? shade_tiles(band, look, part, work) : shade_samples(band, look, part, work);
    if (!done) return tl::unexpected(done.error());
  }
  if (options.ground_shadow) {
    if (auto done = lay_shadow(*whole, backdrop, execution, result); !done) {
      return tl::unexpected(done.error());
    }
  }
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  report = work.total;
  report_covers = true;
  return result;
}

Preview::Preview(Tree tree, std::vector<Ghost> ghosts, double relative_precision,
                 const Execution& execution)
    : impl_(std::make_unique<Impl>(std::move(tree), ghosts, relative_precision, execution)) {}
Preview::~Preview() = default;
Preview::Preview(Preview&&) noexcept = default;
Preview& Preview::operator=(Preview&&) noexcept = default;

Bounds Preview::box() const { return impl_->box(); }
Result<View> Preview::view(const Camera& camera, const glm::ivec2& size,
                           const Execution& execution) const {
  return impl_->view(camera, size, execution);
}
const Tree& Preview::tree() const { return impl_->tree; }
void Preview::set_source(SurfaceSource* source) { impl_->frame.set_source(source); }

const DrawReport& Preview::report() const {
  if (!impl_->report_covers) {
    const auto& depth = impl_->frame.image().depth;
    impl_->report.covered =
        static_cast<std::uint64_t>(depth.size()) -
        static_cast<std::uint64_t>(std::count(depth.begin(), depth.end(), SurfaceImage::kNone));
    impl_->report_covers = true;
  }
  return impl_->report;
}

Result<const SurfaceImage*> Preview::draw(const View& view, const Execution& execution) try {
  return impl_->draw(view, execution);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory for a picture of {} x {} pixels", view.size.x,
              view.size.y);
}

Result<const SurfaceImage*> Preview::move_solid(std::uint32_t solid,
                                                const glm::dmat4& world_from_mesh,
                                                const Execution& execution) {
  const bool others = impl_->geometry.move_solid(impl_->tree, solid, world_from_mesh);
  impl_->normals.forget(solid, others);
  auto done = others ? impl_->frame.draw(impl_->frame.view(), execution)
                     : impl_->frame.moved(solid, execution);
  if (!done) return tl::unexpected(done.error());
  return impl_->surfaces();
}

Result<Picture> Preview::picture(const Camera& camera, const glm::ivec2& size,
                                 const PictureOptions& options, const Execution& execution) try {
  return impl_->picture(camera, size, options, execution);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "out of memory for a picture of {} x {} pixels", size.x, size.y);
}

Result<Picture> picture(const Tree& tree, const std::optional<Camera>& camera,
                        const glm::ivec2& size, const PictureOptions& options,
                        const Execution& execution) {
  if (auto checked = check_tree(tree, tree.root()); !checked) {
    return tl::unexpected(checked.error());
  }
  Preview preview(tree, {}, 0.0, execution);
  if (camera) return preview.picture(*camera, size, options, execution);
  Camera all;
  const Bounds box = preview.box();
  if (!box.empty()) {
    centre_camera(all, box);
    const double aspect = size.y > 0 ? static_cast<double>(size.x) / size.y : 1.0;
    fit_camera(all, box, std::min(aspect, 1.0));
  }
  return preview.picture(all, size, options, execution);
}

}  // namespace strata::csg
