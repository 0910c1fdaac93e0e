#include "transparency/stream/mesh_source.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <numeric>
#include <utility>

namespace strata::transparency {
namespace {

class MeshSource final : public FragmentSource {
 public:
  MeshSource(const Scene& scene, std::span<const Look> looks, const View& view)
      : scene_(scene),
        looks_(looks.begin(), looks.end()),
        view_(view),
        triangles_{part_, view_, scene.object_of, {}, 0} {
    for (const Look& look : looks) any_opaque_ |= look.opaque;
  }

  Result<void> prepare(const Execution& execution) {
    auto part = view_part({scene_.mesh.positions, scene_.mesh.triangles, bounds(scene_.mesh)},
                          view_, execution);
    if (!part) return tl::unexpected(part.error());
    part_ = std::move(*part);
    const std::size_t count = scene_.mesh.triangles.size();
    colours_.resize(2 * count);
    if (any_opaque_) opaque_.resize(count);
    const glm::dmat3 eye_from_world(view_.eye_from_world);
    constexpr std::size_t kAtOnce = 16384;
    parallel_for(execution, (count + kAtOnce - 1) / kAtOnce, [&](std::size_t chunk, int) {
      const std::size_t end = std::min(count, (chunk + 1) * kAtOnce);
      for (std::size_t t = chunk * kAtOnce; t < end; ++t) colour(t, eye_from_world);
    });
    triangles_.opaque = opaque_;
    triangles_.objects = scene_.objects.size();
    if (!part_.binned) {
      all_.resize(part_.mesh.triangles.size());
      std::iota(all_.begin(), all_.end(), 0u);
    }
    if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    return {};
  }

  [[nodiscard]] glm::ivec2 size() const override { return view_.size; }
  [[nodiscard]] std::span<const glm::vec4> colours() const override { return colours_; }
  [[nodiscard]] std::span<const std::uint32_t> objects() const override { return scene_.object_of; }
  [[nodiscard]] const FrameTriangles* triangles() const override { return &triangles_; }
  [[nodiscard]] std::unique_ptr<Worker> worker() const override;

 private:
  class TileWorker;

  void colour(std::size_t t, const glm::dmat3& eye_from_world) {
    const glm::uvec3& triangle = scene_.mesh.triangles[t];
    const glm::dvec3& a = scene_.mesh.positions[triangle.x];
    const glm::dvec3 normal = eye_from_world * glm::cross(scene_.mesh.positions[triangle.y] - a,
                                                          scene_.mesh.positions[triangle.z] - a);
    const Look& look = looks_[scene_.object_of.empty() ? 0 : scene_.object_of[t]];
    const glm::vec4& base = look.colour;
    const glm::vec3 premultiplied = glm::vec3(base) * base.a;
    colours_[2 * t] = glm::vec4(premultiplied * eye_light(normal), base.a);
    colours_[2 * t + 1] = glm::vec4(premultiplied * eye_light(-normal), base.a);
    if (any_opaque_) opaque_[t] = look.opaque ? 1 : 0;
  }

  const Scene& scene_;
  std::vector<Look> looks_;
  View view_;
  bool any_opaque_ = false;
  ViewPart part_;
  std::vector<std::uint32_t> all_;  ///< the triangles of every tile if they are not binned
  std::vector<glm::vec4> colours_;
  std::vector<std::uint8_t> opaque_;
  FrameTriangles triangles_;
};

class MeshSource::TileWorker final : public Worker {
 public:
  explicit TileWorker(const MeshSource& source) : source_(&source) {}

  Result<void> tile(int tu, int tv, bool keep_hidden, TileFragments& out) override {
    const ViewPart& part = source_->part_;
    out.clear();
    const PixelRect clip{tu * kTileSide, tv * kTileSide,
                         std::min(source_->view_.size.x, (tu + 1) * kTileSide),
                         std::min(source_->view_.size.y, (tv + 1) * kTileSide)};
    const PixelRect& rect = part.rect;
    if (rect.empty() || rect.u0 >= clip.u1 || rect.u1 <= clip.u0 || rect.v0 >= clip.v1 ||
        rect.v1 <= clip.v0) {
      return {};
    }
    std::span<const std::uint32_t> triangles = source_->all_;
    if (part.binned) {
      const auto binned = part.bins.tile(tu, tv);
      sorted_.assign(binned.begin(), binned.end());
      std::sort(sorted_.begin(), sorted_.end());
      triangles = sorted_;
    }
    if (source_->any_opaque_) {
      const auto split = [&](bool opaque) {
        chosen_.clear();
        for (const std::uint32_t t : triangles) {
          if ((source_->opaque_[part.source(t)] != 0) == opaque) chosen_.push_back(t);
        }
      };
      split(true);
      if (!chosen_.empty()) draw_opaque(clip, out);
      split(false);
      triangles = chosen_;
    }
    rasterize(triangles, clip, out.log);
    if (out.any_opaque && !keep_hidden) drop_hidden(out);
    return {};
  }

 private:
  void rasterize(std::span<const std::uint32_t> triangles, const PixelRect& clip,
                 TileLog<Record64>& log) const {
    const ViewPart& part = source_->part_;
    const RasterTarget target{Axis::kZ, source_->view_.size.x, source_->view_.size.y,
                              kPictureDepthLimit};
    raster_into({part.mesh, target, triangles, clip, true}, log);
    if (!part.cut) return;
    for (std::size_t i = 0; i < log.count; ++i) {
      const DepthItem item = log.keys[i];
      log.keys[i] = DepthItem(item.depth(), item.exit(), part.source(item.triangle()));
    }
  }
  void draw_opaque(const PixelRect& clip, TileFragments& out) {
    out.begin_opaque();
    opaque_.count = 0;
    rasterize(chosen_, clip, opaque_);
    for (std::size_t i = 0; i < opaque_.count; ++i) {
      DepthItem& nearest = out.opaque[opaque_.pixels[i]];
      nearest = std::min(nearest, opaque_.keys[i]);
    }
  }
  static void drop_hidden(TileFragments& out) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < out.log.count; ++i) {
      if (out.opaque[out.log.pixels[i]] < out.log.keys[i]) continue;
      out.log.pixels[kept] = out.log.pixels[i];
      out.log.keys[kept++] = out.log.keys[i];
    }
    out.log.count = kept;
  }

  const MeshSource* source_;
  std::vector<std::uint32_t> sorted_, chosen_;
  TileLog<Record64> opaque_;
};

std::unique_ptr<FragmentSource::Worker> MeshSource::worker() const {
  return std::make_unique<TileWorker>(*this);
}

}  // namespace

std::vector<Look> looks_of(const Scene& scene, const FrameOptions& options) {
  std::vector<Look> looks;
  looks.reserve(scene.objects.size());
  for (const Object& object : scene.objects) {
    looks.push_back({object.colour, options.opaque_first && object.colour.a >= 1.0f});
  }
  return looks;
}

Result<std::shared_ptr<const FragmentSource>> make_mesh_source(const Scene& scene,
                                                               std::span<const Look> looks,
                                                               const View& view, int samples,
                                                               const Execution& execution) {
  const SampleGrid grid = sample_grid(samples);
  auto source = std::make_shared<MeshSource>(scene, looks,
                                             band_of(view, 0, view.size.y, grid.across, grid.down));
  if (auto done = source->prepare(execution); !done) return tl::unexpected(done.error());
  return source;
}

}  // namespace strata::transparency
