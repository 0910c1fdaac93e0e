#include "strata/transparency/stream/frame.h"

#include <chrono>
#include <cmath>
#include <mutex>
#include <new>

#include "core/did_you_mean.h"
#include "transparency/stream/lanes.h"
#include "transparency/stream/listed_source.h"
#include "transparency/stream/mesh_source.h"
#include "transparency/stream/render_tiles.h"

namespace strata::transparency {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

Result<void> check_options(const FrameOptions& options) {
  if (auto good = check_samples(options.samples); !good) return good;
  for (int i = 0; i < 4; ++i) {
    if (!(options.background[i] >= 0.0f && options.background[i] <= 1.0f)) {
      return fail(ErrorCode::kUsage, "the background's components must be 0 to 1, got {}",
                  options.background[i]);
    }
  }
  return {};
}

Result<void> check_size(const glm::ivec2& size) {
  if (size.x < 1 || size.y < 1 || size.x > kMaxPictureSide || size.y > kMaxPictureSide) {
    return fail(ErrorCode::kUsage,
                "a picture with its samples must be 1 to {} wide and high, got {} x {}",
                kMaxPictureSide, size.x, size.y);
  }
  return {};
}

Result<void> check_colour(const glm::vec4& colour, std::string_view what, std::size_t index) {
  for (int i = 0; i < 4; ++i) {
    if (!(colour[i] >= 0.0f && colour[i] <= 1.0f)) {
      return fail(ErrorCode::kUsage, "{} {}: colour and opacity must be 0 to 1, got {}", what,
                  index, colour[i]);
    }
  }
  return {};
}

/// What one thread has.
struct Worker {
  std::unique_ptr<FragmentSource::Worker> source;
  TileRenderer renderer;
  TileFragments fragments;
  TileImage image;
  Costs costs;
  double raster_seconds = 0.0, technique_seconds = 0.0;
};

/// One frame on its way.
class FramePass {
 public:
  FramePass(const FragmentSource& source, const FrameOptions& options, bool keep_hidden,
            Image& image)
      : info_(frame_info(source, options)), keep_hidden_(keep_hidden), image_(image) {
    const glm::vec4& b = options.background;
    background_ = glm::vec4(glm::vec3(b) * b.a, b.a);
  }

  [[nodiscard]] const FrameInfo& info() const { return info_; }
  [[nodiscard]] int tiles_u() const { return (info_.size.x + kTileSide - 1) / kTileSide; }
  [[nodiscard]] int tiles_v() const { return (info_.size.y + kTileSide - 1) / kTileSide; }

  Result<void> tile(int tile, Worker& worker) const {
    const int tu = tile % tiles_u(), tv = tile / tiles_u();
    const PixelRect rect{tu * kTileSide, tv * kTileSide,
                         std::min(info_.size.x, (tu + 1) * kTileSide),
                         std::min(info_.size.y, (tv + 1) * kTileSide)};
    const auto begin = Clock::now();
    if (auto made = worker.source->tile(tu, tv, keep_hidden_, worker.fragments); !made) return made;
    worker.raster_seconds += seconds_since(begin);
    const auto made = Clock::now();
    worker.image.clear();
    Costs costs;
    TileStream stream(worker.fragments, info_, rect, costs);
    costs.fragments = stream.size();
    if (auto done = worker.renderer(stream, worker.image); !done) return done;
    costs.geometry_passes = stream.passes();
    worker.costs.add(costs);
    resolve(worker, rect);
    worker.technique_seconds += seconds_since(made);
    return {};
  }

 private:
  /// What lies behind a pixel's fragments, premultiplied.
  [[nodiscard]] glm::vec4 behind(const TileFragments& fragments, std::size_t pixel) const {
    if (!fragments.any_opaque) return background_;
    const DepthItem item = fragments.opaque[pixel];
    if (item == TileFragments::kNothing) return background_;
    return info_.colours[face_of(item)];
  }
  /// One sample a pixel, and no opaque objects.
  void resolve_plain(const Worker& worker, const PixelRect& rect) const {
    const Lanes background = load_lanes(background_);
    const auto width = static_cast<std::size_t>(rect.u1 - rect.u0);
    for (int v = rect.v0; v < rect.v1; ++v) {
      glm::vec4* out = image_.pixels.data() + rect.u0 +
                       static_cast<std::size_t>(v) * static_cast<std::size_t>(image_.width);
      const glm::vec4* seen = worker.image.pixels.data() + (v - rect.v0) * kTileSide;
      for (std::size_t u = 0; u < width; ++u) {
        const Lanes own = load_lanes(seen[u]), through = last_lane(own);
        store_lanes(with_last(own, 1.0f - through) + through * background, out[u]);
      }
    }
  }
  /// The mean of the samples of each pixel.
  void resolve(const Worker& worker, const PixelRect& rect) const {
    const int across = info_.across, down = info_.down;
    if (across * down == 1 && !worker.fragments.any_opaque) return resolve_plain(worker, rect);
    const float share = 1.0f / static_cast<float>(across * down);
    for (int v = rect.v0; v < rect.v1; v += down) {
      glm::vec4* out = image_.pixels.data() +
                       static_cast<std::size_t>(v / down) * static_cast<std::size_t>(image_.width);
      for (int u = rect.u0; u < rect.u1; u += across) {
        glm::vec4 sum(0.0f);
        for (int dv = 0; dv < down; ++dv) {
          for (int du = 0; du < across; ++du) {
            const auto at =
                static_cast<std::size_t>((v - rect.v0 + dv) * kTileSide + (u - rect.u0 + du));
            sum += over(worker.image.pixels[at], behind(worker.fragments, at));
          }
        }
        out[u / across] = share == 1.0f ? sum : sum * share;
      }
    }
  }

  FrameInfo info_;
  bool keep_hidden_;
  Image& image_;
  glm::vec4 background_;
};

}  // namespace

void Costs::add(const Costs& other) {
  geometry_passes = std::max(geometry_passes, other.geometry_passes);
  most_layers = std::max(most_layers, other.most_layers);
  fragments += other.fragments;
  rasterized += other.rasterized;
  shaded += other.shaded;
  stored += other.stored;
  kept += other.kept;
  lost += other.lost;
  merged += other.merged;
  comparisons += other.comparisons;
  queries += other.queries;
  formula_bytes += other.formula_bytes;
  allocated_bytes += other.allocated_bytes;
}

Result<Settings> checked_settings(const Technique& technique, Settings settings) {
  if (settings.k == 0) settings.k = technique.default_k;
  const bool without_limit = technique.default_k == 0 && settings.k == 0;
  if (!technique.k_means.empty() && !without_limit &&
      (settings.k < technique.least_k || settings.k > technique.most_k)) {
    return fail(ErrorCode::kUsage, "{}: {} must be {} to {}, got {}", technique.name,
                technique.k_means, technique.least_k, technique.most_k, settings.k);
  }
  if (!(settings.load > 0.0 && settings.load <= 1.0)) {
    return fail(ErrorCode::kUsage, "{}: the load must be above 0 and at most 1, got {}",
                technique.name, settings.load);
  }
  if (!(settings.opacity_threshold > 0.0 && settings.opacity_threshold <= 1.0)) {
    return fail(ErrorCode::kUsage,
                "{}: the opacity threshold must be above 0 and at most 1, got {}", technique.name,
                settings.opacity_threshold);
  }
  std::string_view rest = technique.variants;
  if (settings.variant.empty()) {
    settings.variant = rest.substr(0, rest.find(' '));
    return settings;
  }
  std::vector<std::string_view> variants;
  while (!rest.empty()) {
    const std::size_t end = rest.find(' ');
    variants.push_back(rest.substr(0, end));
    if (variants.back() == settings.variant) return settings;
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  }
  if (technique.variants.empty()) {
    return fail(ErrorCode::kUsage, "{} has no variants, got '{}'", technique.name,
                settings.variant);
  }
  return fail(ErrorCode::kUsage, "{}: the variant must be one of {}, got '{}'{}", technique.name,
              technique.variants, settings.variant, did_you_mean(settings.variant, variants));
}

std::vector<glm::u8vec4> to_bytes(const Image& image) {
  std::vector<glm::u8vec4> bytes(image.pixels.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    glm::vec4 colour = image.pixels[i];
    if (colour.a > 0.0f && colour.a < 1.0f)
      colour = glm::vec4(glm::vec3(colour) / colour.a, colour.a);
    bytes[i] = glm::u8vec4(glm::clamp(colour, 0.0f, 1.0f) * 255.0f + 0.5f);
  }
  return bytes;
}

FrameInfo frame_info(const FragmentSource& source, const FrameOptions& options) {
  const SampleGrid grid = sample_grid(options.samples);
  return {source.size(),    grid.across,        grid.down, source.colours(),
          source.objects(), source.triangles(), &source};
}

Result<Rendering> render_tiles(const FragmentSource& source, const FrameOptions& options,
                               const std::function<Result<TileRenderer>()>& make, bool keep_hidden,
                               const Execution& execution) {
  const auto begin = Clock::now();
  Rendering rendering;
  const SampleGrid grid = sample_grid(options.samples);
  rendering.image.width = source.size().x / grid.across;
  rendering.image.height = source.size().y / grid.down;
  std::mutex mutex;
  Result<void> failure;
  try {
    rendering.image.pixels.resize(static_cast<std::size_t>(rendering.image.width) *
                                  static_cast<std::size_t>(rendering.image.height));
    const FramePass pass(source, options, keep_hidden, rendering.image);
    std::vector<std::unique_ptr<Worker>> workers(
        static_cast<std::size_t>(execution.thread_count()));
    const auto tiles =
        static_cast<std::size_t>(pass.tiles_u()) * static_cast<std::size_t>(pass.tiles_v());
    const auto work = [&](std::size_t tile, std::unique_ptr<Worker>& worker) -> Result<void> {
      if (!worker) {
        const std::lock_guard lock(mutex);
        auto renderer = make();
        if (!renderer) return tl::unexpected(renderer.error());
        worker = std::make_unique<Worker>();
        worker->source = source.worker();
        worker->renderer = std::move(*renderer);
      }
      return pass.tile(static_cast<int>(tile), *worker);
    };
    // Progress is told between bands of tiles.
    const std::size_t at_once = execution.progress ? std::max<std::size_t>(tiles / 50, 64) : tiles;
    for (std::size_t first = 0; first < tiles && failure; first += at_once) {
      parallel_for(execution, std::min(at_once, tiles - first), [&](std::size_t i, int worker) {
        auto done = work(first + i, workers[static_cast<std::size_t>(worker)]);
        if (done) return;
        const std::lock_guard lock(mutex);
        failure = std::move(done);
      });
      if (execution.progress) {
        execution.progress(static_cast<double>(std::min(tiles, first + at_once)) /
                           static_cast<double>(tiles));
      }
    }
    for (const auto& worker : workers) {
      if (!worker) continue;
      rendering.costs.add(worker->costs);
      rendering.raster_seconds += worker->raster_seconds;
      rendering.technique_seconds += worker->technique_seconds;
    }
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "no memory for a picture of {} x {} samples", source.size().x,
                source.size().y);
  }
  if (!failure) return tl::unexpected(failure.error());
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  rendering.seconds = seconds_since(begin);
  return rendering;
}

Frame::Frame(std::shared_ptr<const FragmentSource> source, const FrameOptions& options)
    : options_(options), source_(std::move(source)) {}

Result<void> check_frame(const Scene& scene, const View& view, const FrameOptions& options) {
  if (auto good = check_options(options); !good) return good;
  const SampleGrid grid = sample_grid(options.samples);
  if (auto good = check_size({view.size.x * grid.across, view.size.y * grid.down}); !good) {
    return good;
  }
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    if (auto good = check_colour(scene.objects[i].colour, "object", i); !good) return good;
  }
  return {};
}

Result<Frame> Frame::make(const Scene& scene, const View& view, const FrameOptions& options,
                          const Execution& execution) {
  if (auto good = check_frame(scene, view, options); !good) return tl::unexpected(good.error());
  auto source = make_mesh_source(scene, looks_of(scene, options), view, options.samples, execution);
  if (!source) return tl::unexpected(source.error());
  return Frame(std::move(*source), options);
}

Result<Frame> Frame::make(std::span<const ListedFragment> fragments,
                          std::span<const glm::vec4> colours, const FrameOptions& options) {
  if (auto good = check_options(options); !good) return tl::unexpected(good.error());
  const SampleGrid grid = sample_grid(options.samples);
  const glm::ivec2 size(options.size.x * grid.across, options.size.y * grid.down);
  if (auto good = check_size(size); !good) return tl::unexpected(good.error());
  for (std::size_t i = 0; i < colours.size(); ++i) {
    if (auto good = check_colour(colours[i], "face", i); !good) return tl::unexpected(good.error());
  }
  auto source = make_listed_source(fragments, colours, size);
  if (!source) return tl::unexpected(source.error());
  return Frame(std::move(*source), options);
}

Result<Rendering> Frame::render(const Technique& technique, const Settings& settings,
                                const Execution& execution) const {
  const auto checked = checked_settings(technique, settings);
  if (!checked) return tl::unexpected(checked.error());
  if (technique.needs_triangles && source_->triangles() == nullptr) {
    return fail(ErrorCode::kUsage, "{} needs triangles; this frame has bare fragments",
                technique.name);
  }
  const auto begin = Clock::now();
  const FrameInfo info = frame_info(*source_, options_);
  std::shared_ptr<const void> prepared;
  try {
    if (technique.prepare != nullptr) {
      auto made = technique.prepare(info, *checked, execution);
      if (!made) return tl::unexpected(made.error());
      prepared = std::move(*made);
    }
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: no memory for its work before the first tile",
                technique.name);
  }
  const double prepare_seconds = seconds_since(begin);
  auto rendering = render_tiles(
      *source_, options_, [&] { return technique.make(info, *checked, prepared); }, false,
      execution);
  if (rendering) {
    rendering->seconds += prepare_seconds;
    rendering->technique_seconds += prepare_seconds;
  }
  return rendering;
}

}  // namespace strata::transparency
