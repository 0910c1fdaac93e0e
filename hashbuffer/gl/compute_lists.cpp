#include "hashbuffer/gl/compute_lists.h"

#include <algorithm>
#include <utility>

#include "hashbuffer/gl/build_sized.h"

namespace strata::gl {

Result<BuildReport> build_sized(Store& store, ComputeRasterizer& rasterizer,
                                const Execution& execution) {
  std::uint64_t fragments = 0;
  if (store.gains_by_hint()) {
    const auto counted = rasterizer.count({0, rasterizer.height()});
    // Too much to be counted at once may be drawn in bands.
    if (!counted && counted.error().code != ErrorCode::kLimit) {
      return tl::unexpected(counted.error());
    }
    fragments = counted.value_or(0);
    if (counted) store.expect(fragments);
  }
  auto report = build(store, rasterizer, execution);
  if (report && report->fragments == 0) report->fragments = fragments;
  return report;
}

ComputeListSource::ComputeListSource(const Execution& execution) : execution_(execution) {
  execution_.progress = {};
}
ComputeListSource::~ComputeListSource() = default;

Result<std::unique_ptr<ComputeListSource>> ComputeListSource::create(const Context& context,
                                                                     std::unique_ptr<Store> store,
                                                                     std::unique_ptr<Store> spare,
                                                                     std::int64_t pixels_at_once,
                                                                     const Execution& execution) {
  std::unique_ptr<ComputeListSource> result(new ComputeListSource(execution));
  auto opened = result->open(context, std::move(store), std::move(spare), pixels_at_once);
  if (!opened) return tl::unexpected(opened.error());
  return result;
}

Result<void> ComputeListSource::open(const Context& context, std::unique_ptr<Store> store,
                                     std::unique_ptr<Store> spare, std::int64_t pixels_at_once) {
  auto rasterizer = ComputeRasterizer::create(context);
  if (!rasterizer) return tl::unexpected(rasterizer.error());
  rasterizer_ = *std::move(rasterizer);
  store_ = std::move(store);
  spare_ = std::move(spare);
  pixels_at_once_ = pixels_at_once;
  return {};
}

Result<void> ComputeListSource::set_mesh(const LatticeMesh& mesh) {
  return rasterizer_->set_mesh(mesh);
}

int ComputeListSource::rows_at_once(const RasterTarget& target) const {
  const std::int64_t rows = pixels_at_once_ / std::max(1, target.width) / kTileSide * kTileSide;
  return static_cast<int>(std::max<std::int64_t>(kTileSide, rows));
}

Result<LayeredDepthImage> ComputeListSource::lists(const RasterTarget& target, int v_begin,
                                                   int v_end) {
  rasterizer_->set_target(target, v_begin, v_end);
  auto built = build_sized(*store_, *rasterizer_, execution_);
  if (!built && built.error().code != ErrorCode::kCancelled && spare_) {
    const Error first = built.error();
    store_ = std::exchange(spare_, nullptr);
    built = build_sized(*store_, *rasterizer_, execution_);
    // What is too much for one may be too much for both; all else failed at the first.
    if (!built && built.error().code != ErrorCode::kCancelled && first.code != ErrorCode::kLimit) {
      built = tl::unexpected(first);
    }
  }
  if (!built) return tl::unexpected(built.error());
  auto image = read(*store_, target, v_begin, v_end);
  if (image) image->depth_limit = target.depth_limit;
  return image;
}

Result<LayeredDepthImage> ComputeListSource::read(Store& store, const RasterTarget&, int, int) {
  auto image = store.download();
  if (image) crossings_ = image->items.size();
  return image;
}

}  // namespace strata::gl
