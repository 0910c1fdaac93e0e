#include "transparency/stream/listed_source.h"

#include <numeric>
#include <vector>

#include "strata/raster/view.h"

namespace strata::transparency {
namespace {

class ListedSource final : public FragmentSource {
 public:
  ListedSource(std::span<const ListedFragment> fragments, std::span<const glm::vec4> colours,
               const glm::ivec2& size)
      : size_(size), tiles_u_((size.x + kTileSide - 1) / kTileSide) {
    for (const glm::vec4& colour : colours) {
      const glm::vec4 premultiplied(glm::vec3(colour) * colour.a, colour.a);
      colours_.insert(colours_.end(), 2, premultiplied);
    }
    const int tiles_v = (size.y + kTileSide - 1) / kTileSide;
    offsets_.assign(static_cast<std::size_t>(tiles_u_) * static_cast<std::size_t>(tiles_v) + 1, 0);
    for (const ListedFragment& f : fragments) ++offsets_[tile_of(f) + 1];
    std::partial_sum(offsets_.begin(), offsets_.end(), offsets_.begin());
    std::vector<std::size_t> cursor(offsets_.begin(), offsets_.end() - 1);
    pixels_.resize(fragments.size());
    items_.resize(fragments.size());
    for (const ListedFragment& f : fragments) {
      const std::size_t at = cursor[tile_of(f)]++;
      pixels_[at] = static_cast<std::uint32_t>(f.v % kTileSide * kTileSide + f.u % kTileSide);
      items_[at] = DepthItem(f.depth, f.exit, f.face);
    }
  }

  [[nodiscard]] glm::ivec2 size() const override { return size_; }
  [[nodiscard]] std::span<const glm::vec4> colours() const override { return colours_; }
  [[nodiscard]] std::unique_ptr<Worker> worker() const override {
    return std::make_unique<TileWorker>(*this);
  }

 private:
  class TileWorker final : public Worker {
   public:
    explicit TileWorker(const ListedSource& source) : source_(&source) {}
    Result<void> tile(int tu, int tv, bool, TileFragments& out) override {
      out.clear();
      const auto tile = static_cast<std::size_t>(tv * source_->tiles_u_ + tu);
      const std::size_t begin = source_->offsets_[tile], end = source_->offsets_[tile + 1];
      out.kept_pixels = std::span(source_->pixels_).subspan(begin, end - begin);
      out.kept_items = std::span(source_->items_).subspan(begin, end - begin);
      return {};
    }

   private:
    const ListedSource* source_;
  };

  [[nodiscard]] std::size_t tile_of(const ListedFragment& f) const {
    return static_cast<std::size_t>(f.v / kTileSide * tiles_u_ + f.u / kTileSide);
  }

  glm::ivec2 size_;
  int tiles_u_;
  std::vector<glm::vec4> colours_;
  std::vector<std::size_t> offsets_;  ///< of each tile
  std::vector<std::uint32_t> pixels_;
  std::vector<DepthItem> items_;
};

}  // namespace

Result<std::shared_ptr<const FragmentSource>> make_listed_source(
    std::span<const ListedFragment> fragments, std::span<const glm::vec4> colours,
    const glm::ivec2& size) {
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    const ListedFragment& f = fragments[i];
    if (f.u < 0 || f.u >= size.x || f.v < 0 || f.v >= size.y || f.depth >= kPictureDepthLimit) {
      return fail(ErrorCode::kUsage,
                  "fragment {} lies at pixel ({}, {}), depth {}: pixels must be (0, 0) to ({}, "
                  "{}), depths 0 to {}",
                  i, f.u, f.v, f.depth, size.x - 1, size.y - 1, kPictureDepthLimit - 1);
    }
    if (f.face >= colours.size()) {
      return fail(ErrorCode::kUsage, "fragment {} has face {}: there are {} colours", i, f.face,
                  colours.size());
    }
  }
  return std::make_shared<ListedSource>(fragments, colours, size);
}

}  // namespace strata::transparency
