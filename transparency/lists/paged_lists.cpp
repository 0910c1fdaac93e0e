#include "transparency/lists/blend_list.h"
#include "transparency/lists/list_bytes.h"
#include "transparency/lists/list_techniques.h"

// C. Crassin, "OpenGL 4.0+ ABuffer V2.0: linked lists of fragment pages" (2010), as M. Maule, J.
// Comba, R. Torchelsen, R. Bastos (2014) compare it: a pixel's list is of pages of K fragments, so
// that K fragments share a link and a step of the counter. A pool that overflows is doubled, and
// filled again, until all fits: the counter of pages does not say how many are needed.

namespace strata::transparency {
namespace {

constexpr std::uint32_t kPagedListsEnd = 0xffffffffu;

class PagedLists {
 public:
  explicit PagedLists(std::uint32_t page) : page_(page) {}

  /// @param capacity  pages @return fragments that found no page
  std::uint64_t build(TileStream& stream, std::size_t capacity) {
    heads_.assign(kTilePixels, kPagedListsEnd);
    counts_.assign(kTilePixels, 0);
    used_ = 0;
    std::uint64_t lost = 0;
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const std::uint32_t slot = counts_[pixel] % page_;
      if (slot == 0) {
        if (used_ == capacity) {
          ++lost;
          return;
        }
        push_page(pixel);
      }
      items_[std::size_t{heads_[pixel]} * page_ + slot] = item;
      ++counts_[pixel];
    });
    return lost;
  }
  /// Pages in use.
  [[nodiscard]] std::size_t used() const { return used_; }

  /// Only the page at the head has free slots.
  void gather(std::uint32_t pixel, std::vector<DepthItem>& list) const {
    std::uint32_t filled = counts_[pixel] % page_;
    if (filled == 0) filled = page_;
    for (std::uint32_t page = heads_[pixel]; page != kPagedListsEnd;
         page = next_[page], filled = page_) {
      const DepthItem* first = items_.data() + std::size_t{page} * page_;
      list.insert(list.end(), first, first + filled);
    }
  }

 private:
  void push_page(std::uint32_t pixel) {
    if (used_ == next_.size()) {
      next_.resize(std::max<std::size_t>(1024, 2 * used_));
      items_.resize(next_.size() * page_);
    }
    next_[used_] = heads_[pixel];
    heads_[pixel] = static_cast<std::uint32_t>(used_++);
  }

  std::uint32_t page_;
  std::vector<std::uint32_t> heads_, counts_, next_;
  std::vector<DepthItem> items_;
  std::size_t used_ = 0;
};

struct PagedListsState {
  PagedLists lists;
  ListBlender blender;
};

void blend(TileStream& stream, TileImage& image, PagedListsState& state) {
  if (stream.size() == 0) return;
  for_each_pixel(stream, [&](std::uint32_t pixel) {
    state.lists.gather(pixel, state.blender.begin());
    state.blender.finish(stream, image, pixel);
  });
}

void count_bytes(TileStream& stream, std::uint64_t pages, std::uint64_t page) {
  Costs& costs = stream.costs();
  costs.formula_bytes = list_bytes::paged(stream.pixel_count(), pages, page);
  costs.allocated_bytes = stream.pixel_count() * 2 * sizeof(std::uint32_t) +
                          pages * (page * sizeof(DepthItem) + sizeof(std::uint32_t));
}

Result<TileRenderer> make_paged_lists(const FrameInfo&, const Settings& settings,
                                      const std::shared_ptr<const void>&) {
  return [state = std::make_shared<PagedListsState>(PagedListsState{PagedLists(settings.k), {}}),
          page = settings.k](TileStream& stream, TileImage& image) -> Result<void> {
    state->lists.build(stream, stream.size());
    stream.costs().stored = stream.size();
    count_bytes(stream, state->lists.used(), page);
    blend(stream, image, *state);
    return {};
  };
}

/// Fragments of a page of the lists that grow.
constexpr std::uint32_t kPage = 4;

Result<TileRenderer> make_growing(const FrameInfo&, const Settings& settings,
                                  const std::shared_ptr<const void>&) {
  return [state = std::make_shared<PagedListsState>(PagedListsState{PagedLists(kPage), {}}),
          k = settings.k](TileStream& stream, TileImage& image) -> Result<void> {
    std::size_t capacity = (k * stream.pixel_count() + kPage - 1) / kPage;
    for (;; capacity *= 2) {
      const std::uint64_t lost = state->lists.build(stream, capacity);
      stream.costs().stored += stream.size() - lost;
      if (lost == 0) break;
    }
    count_bytes(stream, capacity, kPage);
    blend(stream, image, *state);
    return {};
  };
}

}  // namespace

const Technique kPagedLists{
    .name = "paged",
    .title = "Linked lists of pages",
    .paper = "Crassin 2010",
    .k_means = "fragments a page",
    .default_k = 4,
    .least_k = 1,
    .most_k = 256,
    .memory = "8 k + 4 bytes a page of k fragments, 8 a pixel",
    .fails = "the last page of each pixel is partly empty",
    .make = make_paged_lists,
};
const Technique kPagedListsGrow{
    .name = "paged-grow",
    .title = "Linked pages of 4 in a pool that overflows, doubles, and is filled again",
    .paper = "Maule, Comba, Torchelsen, Bastos 2014",
    .k_means = "fragments a pixel in the first pool",
    .default_k = 2,
    .least_k = 1,
    .most_k = 1024,
    .memory = "36 bytes a page of the last pool, 8 a pixel",
    .fails = "a frame that outgrows the pool is rendered again until the pool suffices",
    .make = make_growing,
};

}  // namespace strata::transparency
