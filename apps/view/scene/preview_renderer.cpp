#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "apps/session/session.h"
#include "apps/strata/library_session.h"
#include "apps/view/scene/camera_control.h"
#include "apps/view/scene/renderer.h"
#include "apps/view/scene/voxel_renderer.h"
#include "csg/measure/ray_image.h"
#include "csg/measure/result_bounds.h"
#include "strata/csg/input/see_through.h"
#include "strata/transparency/techniques.h"

namespace strata::view {
namespace {

using Clock = std::chrono::steady_clock;
double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

class PreviewRenderer final : public Renderer {
 public:
  explicit PreviewRenderer(apps::Backend backend) : backend_(backend) {}

  Result<Frame> draw(const FrameRequest& request, const Execution& execution) override {
    if (request.what->voxels) return voxels_.draw(request, execution);
    auto frame = draw_picture(request, execution);
    if (!frame || !request.guides) return frame;
    const auto image = surface_of(request, execution);
    if (!image) return tl::unexpected(image.error());
    frame->depth = depth_image(image->first, *image->second);
    if (!box_) {
      const auto box =
          csg::result_bounds(what_->tree, what_->tree.root(), what_->relative_precision, execution);
      if (!box) return tl::unexpected(box.error());
      box_ = *box;
    }
    frame->box = *box_;
    return frame;
  }

  Result<Picked> pick(const FrameRequest& request, const glm::ivec2& pixel,
                      const Execution& execution) override {
    if (request.what->voxels) return voxels_.pick(request, pixel, execution);
    Picked picked;
    picked.pixel = pixel;
    adopt(request.what);
    if (!preview_) prepare(execution);
    const auto whole = preview_->view(request.camera, request.size, execution);
    if (!whole) return tl::unexpected(whole.error());
    ProbeWish wish = request.probe.value_or(ProbeWish{});
    const bool mapped = request.heat == Heat::kThickness || request.heat == Heat::kWall;
    wish.thickness = wish.thickness || mapped;
    if (request.probe || mapped) {
      auto probed = probe(*preview_, rays(execution), *whole, pixel, wish, execution);
      if (!probed && fell_back(probed.error())) {
        probed = probe(*preview_, rays(execution), *whole, pixel, wish, execution);
      }
      if (!probed) return tl::unexpected(probed.error());
      if (mapped && probed->hit) {
        picked.thickness = request.heat == Heat::kWall ? probed->along_normal : probed->along_ray;
      }
      if (request.probe) picked.probe = *std::move(probed);
    }
    const auto image = surface(part_of(*whole, pixel, {1, 1}), execution);
    if (!image) return tl::unexpected(image.error());
    const csg::SurfaceImage& at = **image;
    const std::uint32_t depth = at.depth.front();
    if (depth == csg::SurfaceImage::kNone) return picked;
    picked.hit = true;
    picked.solid = at.solid.front();
    picked.triangle = at.triangle.front() & ~csg::SurfaceImage::kExit;
    picked.cut = (at.triangle.front() & csg::SurfaceImage::kExit) != 0;
    picked.where = world_of(*whole, glm::dvec2(pixel) + 0.5, depth + 0.5);
    picked.distance = whole->distance(depth + 0.5);
    return picked;
  }

 private:
  Result<Frame> draw_picture(const FrameRequest& request, const Execution& execution) {
    Frame frame;
    frame.number = request.number;
    frame.camera = request.camera;
    frame.wanted = request.size;
    frame.samples = request.look.samples;
    const auto begin = Clock::now();
    adopt(request.what);
    if (request.see_through && request.heat == Heat::kOff) {
      if (auto done = draw_through(request, execution, frame); !done) {
        return tl::unexpected(done.error());
      }
      return frame;
    }
    if (request.heat == Heat::kOff) {
      open_gpu(execution);
      if (!preview_) {
        prepare(execution);
        frame.prepare_ms = ms_since(begin);
      }
      const auto drawn = Clock::now();
      csg::PictureOptions look = request.look;
      if (request.moving) look.occlusion = false;
      auto picture = preview_->picture(request.camera, request.size, look, execution);
      if (!picture && surfaces_ != nullptr && picture.error().code != ErrorCode::kCancelled) {
        give_up_gpu(picture.error());
        picture = preview_->picture(request.camera, request.size, look, execution);
      }
      if (!picture) return tl::unexpected(picture.error());
      frame.picture = *std::move(picture);
      frame.drawn_by = drawn_by_;
      frame.report = preview_->report();
      frame.draw_ms = ms_since(drawn);
      return frame;
    }
    if (auto done = draw_heat(request, execution, frame); !done)
      return tl::unexpected(done.error());
    return frame;
  }

  void adopt(const std::shared_ptr<const Arrangement>& what) {
    if (what == what_) return;
    preview_.reset();
    meter_.reset();
    through_.reset();
    box_.reset();
    if (rays_) former_rays_ = std::move(rays_);
    what_ = what;
  }

  void prepare(const Execution& execution) {
    preview_.emplace(what_->tree, what_->ghosts, what_->relative_precision, execution);
    preview_->set_source(surfaces_);
  }

  const csg::TreeRays& rays(const Execution& execution) {
    if (!rays_) {
      Execution whole = execution;
      whole.stop = {};  // half of it would be of no use
      rays_ = std::make_unique<csg::TreeRays>(what_->tree, what_->tree.root(),
                                              what_->relative_precision, whole, former_rays_.get());
      former_rays_.reset();
    }
    return *rays_;
  }

  /// Whether a failure of the GPU is one, and the CPU may do it.
  bool fell_back(const Error& error) {
    if (surfaces_ == nullptr || error.code == ErrorCode::kCancelled) return false;
    give_up_gpu(error);
    return true;
  }
  Result<const csg::SurfaceImage*> surface(const View& view, const Execution& execution) {
    auto image = preview_->draw(view, execution);
    if (!image && fell_back(image.error())) image = preview_->draw(view, execution);
    return image;
  }
  /// What a request shows, with one sample a pixel.
  Result<std::pair<View, const csg::SurfaceImage*>> surface_of(const FrameRequest& request,
                                                               const Execution& execution) {
    if (!preview_) prepare(execution);
    const auto view = preview_->view(request.camera, request.size, execution);
    if (!view) return tl::unexpected(view.error());
    const auto image = surface(*view, execution);
    if (!image) return tl::unexpected(image.error());
    return std::pair(*view, *image);
  }

  /// Once, on the thread that draws: a context belongs to a thread.
  void open_gpu(const Execution& execution) {
    if (std::exchange(looked_for_gpu_, true) || backend_ == apps::Backend::kCpu) return;
    Execution own = execution;
    own.stop = {};
    own.progress = {};
    session_.emplace(Clock::now(), own);
    auto gpu = apps::open_gpu(backend_, *session_);
    if (!gpu) return say_why(gpu.error());
    if (*gpu == nullptr) return;  // auto, and there is none
    auto surfaces = (*gpu)->surfaces();
    if (!surfaces) return say_why(surfaces.error());
    if (*surfaces == nullptr) {
      const auto& warnings = session_->warnings();
      drawn_by_ = "CPU";
      if (!warnings.empty()) drawn_by_ += " (" + warnings.back().message + ")";
      return;
    }
    gpu_ = *std::move(gpu);
    surfaces_ = *surfaces;
    drawn_by_ = "GPU";
    if (preview_) preview_->set_source(surfaces_);
  }
  void give_up_gpu(const Error& error) {
    preview_->set_source(nullptr);
    surfaces_ = nullptr;
    say_why(error);
  }
  void say_why(const Error& error) { drawn_by_ = "CPU (" + error.message + ")"; }

  /// through_ becomes the arrangement with an opacity.
  Result<void> see_through(const FrameRequest& request, const Execution& execution) {
    const float opacity = request.see_through->opacity;
    const bool faces = request.see_through->media != nullptr;  // media need whole solids
    if (through_ && through_opacity_ == opacity && through_scheme_ == request.look.scheme &&
        (through_->faces() != nullptr) == faces) {
      return {};
    }
    csg::Scene scene;
    scene.tree = what_->tree;
    scene.relative_precision = what_->relative_precision;
    for (const csg::Ghost& ghost : what_->ghosts) {
      const bool red = ghost.colour == csg::kHighlightGhost;
      (red ? scene.highlights : scene.backgrounds).push_back(ghost.node);
    }
    csg::SeeThroughOptions options{
        opacity, request.look.scheme != nullptr ? request.look.scheme : &csg::default_scheme()};
    options.all_faces = faces;
    auto made = csg::SeeThrough::make(std::move(scene), options, execution);
    if (!made) return tl::unexpected(made.error());
    through_ = *std::move(made);
    through_opacity_ = opacity;
    through_scheme_ = request.look.scheme;
    return {};
  }

  Result<void> draw_through(const FrameRequest& request, const Execution& execution, Frame& frame) {
    const auto begin = Clock::now();
    if (auto done = see_through(request, execution); !done) return done;
    frame.prepare_ms = ms_since(begin);
    const auto prepared = Clock::now();
    const csg::ColourScheme& scheme =
        request.look.scheme != nullptr ? *request.look.scheme : csg::default_scheme();
    transparency::FrameOptions options;
    options.size = request.size;
    options.samples = request.look.samples;
    options.background = glm::vec4(glm::vec3(scheme.background) / 255.0f, 1.0f);
    if (request.see_through->media != nullptr && !request.moving) {
      auto done = draw_media(request, options, execution, frame);
      frame.draw_ms = ms_since(prepared);
      return done;
    }
    const auto seen = through_->frame(request.camera, request.size, options, execution);
    if (!seen) return tl::unexpected(seen.error());
    const std::string name = request.moving ? kMovingTechnique : request.see_through->technique;
    const auto chosen = transparency::parse_technique(name);
    if (!chosen) return tl::unexpected(chosen.error());
    auto drawn = seen->render(*chosen->technique, chosen->settings, execution);
    if (!drawn) return tl::unexpected(drawn.error());
    show(*drawn, name, csg::Rgba(scheme.background, 255), frame);
    if (request.see_through->errors && !request.moving) {
      const auto exact = transparency::find_technique(SeenThrough{}.technique);
      if (!exact) return tl::unexpected(exact.error());
      auto reference = seen->render(**exact, {}, execution);
      if (!reference) return tl::unexpected(reference.error());
      show_errors(drawn->image, reference->image, frame);
    }
    frame.draw_ms = ms_since(prepared);
    return {};
  }

  static void show(const transparency::Rendering& drawn, const std::string& by,
                   const csg::Rgba& ground, Frame& frame) {
    frame.drawn_by = "CPU, " + by;
    frame.report.fragments = drawn.costs.fragments;
    frame.longest_list = drawn.costs.most_layers;
    frame.picture = {drawn.image.width, drawn.image.height, transparency::to_bytes(drawn.image)};
    for (const csg::Rgba& pixel : frame.picture.pixels) {
      frame.report.covered += pixel != ground ? 1 : 0;
    }
  }

  Result<void> draw_media(const FrameRequest& request, const transparency::FrameOptions& options,
                          const Execution& execution, Frame& frame) {
    const auto view = through_->view(request.camera, request.size, execution);
    if (!view) return tl::unexpected(view.error());
    const auto drawn = transparency::render_media(*through_->faces(), *view,
                                                  *request.see_through->media, options, execution);
    if (!drawn) return tl::unexpected(drawn.error());
    const csg::Rgba ground(glm::vec4(options.background) * 255.0f + 0.5f);
    show(drawn->rendering, "media", ground, frame);
    return {};
  }

  static void show_errors(const transparency::Image& image, const transparency::Image& reference,
                          Frame& frame) {
    const double largest = transparency::difference(image, reference).largest;
    frame.scale = {Heat::kError, 0, largest};
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      const glm::vec4 by = glm::abs(image.pixels[i] - reference.pixels[i]);
      const double most = std::max({by.r, by.g, by.b, by.a});
      frame.picture.pixels[i] = heat_colour(largest > 0.0 ? most / largest : 0.0);
    }
  }

  /// The values of a heat map, and how bright its faces are, if it says that.
  struct HeatValues {
    std::vector<float> values, light;
  };
  Result<HeatValues> heat_values(const FrameRequest& request, const Execution& execution,
                                 Frame& frame) {
    HeatValues result;
    if (request.heat == Heat::kWall) {
      const auto image = surface_of(request, execution);
      if (!image) return tl::unexpected(image.error());
      auto walls =
          rays(execution).wall_image(image->first, *image->second, execution, &result.light);
      if (!walls) return tl::unexpected(walls.error());
      result.values = *std::move(walls);
      frame.report = preview_->report();
      return result;
    }
    if (!meter_) {
      meter_.emplace(what_->tree, what_->tree.root(), what_->relative_precision, execution,
                     what_->model_solids);
    }
    std::vector<Bounds> boxes;
    for (const csg::Solid& solid : what_->tree.solids()) boxes.push_back(csg::bounds(solid));
    const csg::Tree::NodeId root = what_->tree.root();
    const Bounds box = csg::picture_box(what_->tree, boxes, std::span(&root, 1));
    const auto view = make_view(request.camera, request.size, box);
    if (!view) return tl::unexpected(view.error());
    auto met = meter_->measure(*view, execution);
    if (!met) return tl::unexpected(met.error());
    for (const std::uint32_t count : met->crossings) {
      frame.longest_list = std::max<std::uint64_t>(frame.longest_list, count);
    }
    frame.report.fragments = met->fragments;
    result.values = std::move(met->thickness);
    if (request.heat == Heat::kDepth)
      result.values.assign(met->crossings.begin(), met->crossings.end());
    return result;
  }

  Result<void> draw_heat(const FrameRequest& request, const Execution& execution, Frame& frame) {
    const auto begin = Clock::now();
    frame.drawn_by = "CPU";
    auto map = heat_values(request, execution, frame);
    if (!map) return tl::unexpected(map.error());
    ValueRange range;
    if (request.heat == Heat::kDepth) {
      range.high = static_cast<double>(frame.longest_list);
    } else if (request.heat_range) {
      range = given_range(request.heat_range->x, request.heat_range->y, map->values);
    } else {
      range = percentile_range(map->values);
    }
    frame.scale = {request.heat, range.low, range.high, range.below, range.above};
    const csg::ColourScheme& scheme =
        request.look.scheme != nullptr ? *request.look.scheme : csg::default_scheme();
    frame.picture = {request.size.x, request.size.y, {}};
    frame.picture.pixels.resize(map->values.size(), csg::Rgba(scheme.background, 255));
    for (std::size_t i = 0; i < map->values.size(); ++i) {
      const double value = static_cast<double>(map->values[i]);
      if (!(value > 0)) continue;
      ++frame.report.covered;
      csg::Rgba& pixel = frame.picture.pixels[i];
      pixel = heat_colour(range.high > range.low ? (value - range.low) / (range.high - range.low)
                                                 : 0.0);
      // Faces of one value are told apart by their light.
      if (!map->light.empty()) {
        pixel = csg::Rgba(glm::u8vec3(glm::vec3(pixel) * (0.7f + 0.3f * map->light[i])), 255);
      }
    }
    frame.draw_ms = ms_since(begin);
    return {};
  }

  VoxelRenderer voxels_;
  apps::Backend backend_;
  bool looked_for_gpu_ = false;
  std::string drawn_by_ = "CPU";
  std::optional<apps::Session> session_;
  std::unique_ptr<csg::Gpu> gpu_;
  csg::SurfaceSource* surfaces_ = nullptr;
  std::shared_ptr<const Arrangement> what_;
  std::optional<csg::Preview> preview_;
  std::optional<csg::RayMeter> meter_;
  std::unique_ptr<csg::TreeRays> rays_, former_rays_;
  std::optional<Bounds> box_;  ///< around the result
  std::optional<csg::SeeThrough> through_;
  float through_opacity_ = 0.0f;
  const csg::ColourScheme* through_scheme_ = nullptr;
};

}  // namespace

std::unique_ptr<Renderer> make_renderer(apps::Backend backend) {
  return std::make_unique<PreviewRenderer>(backend);
}

}  // namespace strata::view
