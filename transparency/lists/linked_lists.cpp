#include "transparency/lists/blend_list.h"
#include "transparency/lists/list_bytes.h"
#include "transparency/lists/list_techniques.h"

// J. Yang, J. Hensley, H. Gruen, N. Thibieroz, "Real-time concurrent linked list construction on
// the GPU" (2010): a counter gives each fragment a node, which becomes the head of its pixel's
// list. M. Salvi, K. Vaidyanathan, "Multi-layer alpha blending" (2014) compares with such an
// A-buffer. When the nodes do not suffice, the counter still says how many are needed: M. Maule et
// al. (2014) grow the pool and render again; we differ and ask for the exact number, once.

namespace strata::transparency {
namespace {

constexpr std::uint32_t kLinkedListsEnd = 0xffffffffu;

class LinkedLists {
 public:
  void build(TileStream& stream, std::size_t capacity) {
    heads_.assign(kTilePixels, kLinkedListsEnd);
    if (items_.size() < capacity) {
      items_.resize(capacity);
      next_.resize(capacity);
    }
    std::uint32_t used = 0;
    stream.pass([&](std::uint32_t pixel, DepthItem item) {
      const std::uint32_t node = used++;
      if (node >= capacity) return;
      items_[node] = item;
      next_[node] = heads_[pixel];
      heads_[pixel] = node;
    });
    used_ = used;
  }
  /// Nodes that were asked for.
  [[nodiscard]] std::size_t used() const { return used_; }

  void gather(std::uint32_t pixel, std::vector<DepthItem>& list) const {
    for (std::uint32_t node = heads_[pixel]; node != kLinkedListsEnd; node = next_[node]) {
      list.push_back(items_[node]);
    }
  }

 private:
  std::vector<std::uint32_t> heads_, next_;
  std::vector<DepthItem> items_;
  std::size_t used_ = 0;
};

/// @tparam grows  the pool starts with settings.k nodes a pixel
template <bool grows>
Result<TileRenderer> make_linked_lists(const FrameInfo&, const Settings& settings,
                                       const std::shared_ptr<const void>&) {
  struct State {
    LinkedLists lists;
    ListBlender blender;
  };
  return [state = std::make_shared<State>(), k = settings.k](TileStream& stream,
                                                             TileImage& image) -> Result<void> {
    Costs& costs = stream.costs();
    std::size_t capacity = stream.size();
    if (grows) capacity = k * stream.pixel_count();
    state->lists.build(stream, capacity);
    costs.stored = std::min(capacity, state->lists.used());
    if (state->lists.used() > capacity) {
      capacity = state->lists.used();
      state->lists.build(stream, capacity);
      costs.stored += capacity;
    }
    costs.formula_bytes = list_bytes::linked(stream.pixel_count(), capacity);
    costs.allocated_bytes = stream.pixel_count() * sizeof(std::uint32_t) +
                            capacity * (sizeof(DepthItem) + sizeof(std::uint32_t));
    if (stream.size() == 0) return {};
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      state->lists.gather(pixel, state->blender.begin());
      state->blender.finish(stream, image, pixel);
    });
    return {};
  };
}

}  // namespace

const Technique kLinkedLists{
    .name = "linked",
    .title = "Linked lists: a node a fragment",
    .paper = "Yang, Hensley, Gruen, Thibieroz 2010",
    .memory = "12 bytes a fragment, 4 a pixel",
    .fails = "loses fragments on a GPU when its pool is too small; here the pool is known to fit",
    .make = make_linked_lists<false>,
};
const Technique kLinkedListsGrow{
    .name = "linked-grow",
    .title = "Linked lists in a pool that overflows, grows to the exact need, and is filled again",
    .paper = "Maule, Comba, Torchelsen, Bastos 2014",
    .k_means = "fragments a pixel in the first pool",
    .default_k = 2,
    .least_k = 1,
    .most_k = 1024,
    .memory = "12 bytes a node of the last pool, 4 a pixel",
    .fails = "a frame that outgrows the pool is rendered twice",
    .make = make_linked_lists<true>,
};
const Technique kMlabABuffer{
    .name = "a-buffer",
    .title = "A-buffer, the reference of multi-layer alpha blending",
    .paper = "Salvi, Vaidyanathan 2014",
    .memory = "12 bytes a fragment, 4 a pixel",
    .fails = "memory has no bound",
    .make = make_linked_lists<false>,
};

}  // namespace strata::transparency
