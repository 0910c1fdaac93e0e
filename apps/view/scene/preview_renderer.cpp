#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "apps/session/session.h"
#include "apps/strata/library_session.h"
#include "apps/view/scene/camera_control.h"
#include "apps/view/scene/renderer.h"
#include "csg/measure/ray_image.h"
#include "strata/csg/input/see_through.h"
#include "strata/transparency/techniques.h"

namespace strata::view {
namespace {

using Clock = std::chrono::steady_clock;
double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

/// Samples of the colour map viridis (S. van der Walt, N. Smith, 2015): as even to the eye as to
/// the colour-blind eye.
constexpr glm::vec3 kHeat[] = {{68, 1, 84},    {72, 40, 120},  {62, 74, 137},  {49, 104, 142},
                               {38, 130, 142}, {31, 158, 137}, {53, 183, 121}, {109, 205, 89},
                               {180, 222, 44}, {253, 231, 37}};

class PreviewRenderer final : public Renderer {
 public:
  explicit PreviewRenderer(apps::Backend backend) : backend_(backend) {}

  Result<Frame> draw(const FrameRequest& request, const Execution& execution) override {
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
      auto picture = preview_->picture(request.camera, request.size, request.look, execution);
      if (!picture && surfaces_ != nullptr && picture.error().code != ErrorCode::kCancelled) {
        give_up_gpu(picture.error());
        picture = preview_->picture(request.camera, request.size, request.look, execution);
      }
      if (!picture) return tl::unexpected(picture.error());
      frame.picture = *std::move(picture);
      frame.drawn_by = drawn_by_;
      frame.report = preview_->report();
      frame.draw_ms = ms_since(drawn);
      return frame;
    }
    frame.drawn_by = "CPU";
    if (!meter_) {
      meter_.emplace(what_->tree, what_->tree.root(), what_->relative_precision, execution,
                     what_->model_solids);
      frame.prepare_ms = ms_since(begin);
    }
    if (auto done = draw_heat(request, execution, frame); !done)
      return tl::unexpected(done.error());
    return frame;
  }

  Result<Picked> pick(const FrameRequest& request, const glm::ivec2& pixel,
                      const Execution& execution) override {
    Picked picked;
    picked.pixel = pixel;
    adopt(request.what);
    if (!preview_) prepare(execution);
    const auto whole = preview_->view(request.camera, request.size, execution);
    if (!whole) return tl::unexpected(whole.error());
    // The picture's lattice, moved by whole pixels: the same bits.
    View view = *whole;
    view.size = {1, 1};
    for (int column = 0; column < 4; ++column) {
      glm::dvec4& m = view.image_from_world[column];
      m.x -= pixel.x * m.w;
      m.y -= pixel.y * m.w;
    }
    auto image = preview_->draw(view, execution);
    if (!image && surfaces_ != nullptr && image.error().code != ErrorCode::kCancelled) {
      give_up_gpu(image.error());
      image = preview_->draw(view, execution);
    }
    if (!image) return tl::unexpected(image.error());
    const csg::SurfaceImage& surface = **image;
    const std::uint32_t depth = surface.depth.front();
    if (depth == csg::SurfaceImage::kNone) return picked;
    picked.hit = true;
    picked.solid = surface.solid.front();
    picked.triangle = surface.triangle.front() & ~csg::SurfaceImage::kExit;
    picked.cut = (surface.triangle.front() & csg::SurfaceImage::kExit) != 0;
    picked.where = world_of(*whole, glm::dvec2(pixel) + 0.5, depth + 0.5);
    picked.distance = whole->distance(depth + 0.5);
    return picked;
  }

 private:
  void adopt(const std::shared_ptr<const Arrangement>& what) {
    if (what == what_) return;
    preview_.reset();
    meter_.reset();
    through_.reset();
    what_ = what;
  }

  void prepare(const Execution& execution) {
    preview_.emplace(what_->tree, what_->ghosts, what_->relative_precision, execution);
    preview_->set_source(surfaces_);
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
    csg::SeeThroughOptions options{opacity, request.look.scheme};
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
        request.look.scheme != nullptr ? *request.look.scheme : csg::colour_schemes().front();
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

  Result<void> draw_heat(const FrameRequest& request, const Execution& execution, Frame& frame) {
    const auto begin = Clock::now();
    std::vector<Bounds> boxes;
    for (const csg::Solid& solid : what_->tree.solids()) boxes.push_back(csg::bounds(solid));
    const csg::Tree::NodeId root = what_->tree.root();
    const Bounds box = csg::picture_box(what_->tree, boxes, std::span(&root, 1));
    const auto view = make_view(request.camera, request.size, box);
    if (!view) return tl::unexpected(view.error());
    const auto rays = meter_->measure(*view, execution);
    if (!rays) return tl::unexpected(rays.error());
    const bool thickness = request.heat == Heat::kThickness;
    const double diagonal = box.empty() ? 1.0 : glm::length(box.high - box.low);
    const auto value_at = [&](std::size_t i) {
      return thickness ? static_cast<double>(rays->thickness[i])
                       : static_cast<double>(rays->crossings[i]);
    };
    double high = 0;
    for (std::size_t i = 0; i < rays->crossings.size(); ++i) {
      frame.longest_list = std::max<std::uint64_t>(frame.longest_list, rays->crossings[i]);
      const double value = value_at(i);
      if (std::isfinite(value)) high = std::max(high, value);
    }
    frame.scale = {request.heat, 0, thickness ? round_up(std::min(high, diagonal)) : high};
    const csg::ColourScheme& scheme =
        request.look.scheme != nullptr ? *request.look.scheme : csg::colour_schemes().front();
    const csg::Rgba background(scheme.background, 255);
    frame.picture = {rays->width, rays->height, {}};
    frame.picture.pixels.resize(rays->crossings.size(), background);
    for (std::size_t i = 0; i < rays->crossings.size(); ++i) {
      const double value = value_at(i);
      if (!(value > 0)) continue;
      ++frame.report.covered;
      frame.picture.pixels[i] = heat_colour(frame.scale.high > 0 ? value / frame.scale.high : 0);
    }
    frame.report.fragments = rays->fragments;
    frame.draw_ms = ms_since(begin);
    return {};
  }

  /// To 1, 1.5, 2, 3, 5 or 7 times a power of ten: scales that do not flicker.
  static double round_up(double value) {
    if (!(value > 0)) return 0;
    const double power = std::pow(10.0, std::floor(std::log10(value)));
    for (const double step : {1.0, 1.5, 2.0, 3.0, 5.0, 7.0}) {
      if (value <= step * power * (1 + 1e-9)) return step * power;
    }
    return 10 * power;
  }

  apps::Backend backend_;
  bool looked_for_gpu_ = false;
  std::string drawn_by_ = "CPU";
  std::optional<apps::Session> session_;
  std::unique_ptr<csg::Gpu> gpu_;
  csg::SurfaceSource* surfaces_ = nullptr;
  std::shared_ptr<const Arrangement> what_;
  std::optional<csg::Preview> preview_;
  std::optional<csg::RayMeter> meter_;
  std::optional<csg::SeeThrough> through_;
  float through_opacity_ = 0.0f;
  const csg::ColourScheme* through_scheme_ = nullptr;
};

}  // namespace

std::unique_ptr<Renderer> make_renderer(apps::Backend backend) {
  return std::make_unique<PreviewRenderer>(backend);
}

csg::Rgba heat_colour(double part) {
  constexpr int kLast = static_cast<int>(std::size(kHeat)) - 1;
  const double at = std::clamp(part, 0.0, 1.0) * kLast;
  const int below = std::min(static_cast<int>(at), kLast - 1);
  const auto rest = static_cast<float>(at - below);
  const glm::vec3 colour = kHeat[below] * (1 - rest) + kHeat[below + 1] * rest;
  return csg::Rgba(glm::u8vec3(colour + 0.5f), 255);
}

}  // namespace strata::view
