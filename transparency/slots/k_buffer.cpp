#include <algorithm>
#include <array>
#include <vector>

#include "transparency/slots/slot_techniques.h"
#include "transparency/stream/ordered_replay.h"
#include "transparency/stream/tile_stream.h"
#include "transparency/stream/triangle_distances.h"

// S. Callahan, M. Ikits, J. Comba, C. Silva, "Hardware-assisted visibility sorting for unstructured
// volume rendering" (2005), L. Bavoil et al., "Multi-fragment effects on the GPU using the
// k-buffer" (2007): triangles are sorted roughly, by their centroids; k entries a pixel sort the
// rest. Where all are taken, the nearest of the k + 1 is blended from the front and leaves. A
// figure of the survey by Maule et al. (2011) instead merges the newcomer with the entry of the
// nearest depth.

namespace strata::transparency {
namespace {

constexpr std::uint64_t kEntryBytes = 8, kColourBytes = 16, kPixelBytes = 16 + 4;

/// Entries that are blended when they leave.
class LeavingEntries {
 public:
  explicit LeavingEntries(unsigned k) : k_(k), entries_(std::size_t{k} * kTilePixels) {}

  static constexpr std::uint64_t kBytes = kEntryBytes;
  void clear() {
    counts_.fill(0);
    sums_.fill({});
  }
  void put(TileStream& stream, std::uint32_t pixel, DepthItem item) {
    DepthItem* const entries = entries_.data() + std::size_t{pixel} * k_;
    std::uint32_t& count = counts_[pixel];
    if (count < k_) {
      std::uint32_t at = count++;
      for (; at > 0 && item < entries[at - 1]; --at) entries[at] = entries[at - 1];
      entries[at] = item;
      comparisons_ += count - at;
      return;
    }
    ++comparisons_;
    if (!(entries[0] < item)) {
      sums_[pixel].add(stream.shade(item));
      return;
    }
    sums_[pixel].add(stream.shade(entries[0]));
    std::uint32_t at = 1;
    for (; at < k_ && entries[at] < item; ++at) entries[at - 1] = entries[at];
    entries[at - 1] = item;
    comparisons_ += at;
  }
  void finish(TileStream& stream, TileImage& image) {
    Costs& costs = stream.costs();
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (counts_[pixel] == 0) return;
      costs.kept += counts_[pixel];
      costs.most_layers = std::max<std::uint64_t>(costs.most_layers, counts_[pixel]);
      const DepthItem* const entries = entries_.data() + std::size_t{pixel} * k_;
      for (std::uint32_t i = 0; i < counts_[pixel]; ++i) sums_[pixel].add(stream.shade(entries[i]));
      image.pixels[pixel] = sums_[pixel].result();
    });
    costs.comparisons += comparisons_;
    comparisons_ = 0;
  }

 private:
  unsigned k_;
  std::uint64_t comparisons_ = 0;
  std::vector<DepthItem> entries_;  ///< k a pixel, increasing
  std::array<std::uint32_t, kTilePixels> counts_;
  std::array<FrontToBack, kTilePixels> sums_;  ///< of those that left
};

/// Entries that are merged.
class MergedEntries {
 public:
  explicit MergedEntries(unsigned k) : k_(k), entries_(std::size_t{k} * kTilePixels) {}

  static constexpr std::uint64_t kBytes = kEntryBytes + kColourBytes;
  void clear() { counts_.fill(0); }
  void put(TileStream& stream, std::uint32_t pixel, DepthItem item) {
    Entry* const entries = entries_.data() + std::size_t{pixel} * k_;
    std::uint32_t& count = counts_[pixel];
    FrontToBack colour;
    colour.add(stream.shade(item));
    if (count < k_) {
      std::uint32_t at = count++;
      for (; at > 0 && item < entries[at - 1].item; --at) entries[at] = entries[at - 1];
      entries[at] = {item, colour};
      stream.costs().comparisons += count - at;
      return;
    }
    std::uint32_t nearest = 0, away = distance(entries[0].item, item);
    for (std::uint32_t i = 1; i < k_; ++i) {
      const std::uint32_t here = distance(entries[i].item, item);
      if (here < away) nearest = i, away = here;
    }
    stream.costs().comparisons += k_;
    ++stream.costs().merged;
    merge(entries[nearest], {item, colour});
    for (std::uint32_t i = nearest; i > 0 && entries[i].item < entries[i - 1].item; --i) {
      std::swap(entries[i], entries[i - 1]);
    }
  }
  void finish(TileStream& stream, TileImage& image) {
    for_each_pixel(stream, [&](std::uint32_t pixel) {
      if (counts_[pixel] == 0) return;
      stream.costs().kept += counts_[pixel];
      stream.costs().most_layers =
          std::max<std::uint64_t>(stream.costs().most_layers, counts_[pixel]);
      const Entry* const entries = entries_.data() + std::size_t{pixel} * k_;
      FrontToBack sum;
      for (std::uint32_t i = 0; i < counts_[pixel]; ++i) {
        sum.colour += sum.transmittance * entries[i].colour.colour;
        sum.transmittance *= entries[i].colour.transmittance;
      }
      image.pixels[pixel] = sum.result();
    });
  }

 private:
  /// Where the nearest of the entry's fragments lies, and what all of them make.
  struct Entry {
    DepthItem item;
    FrontToBack colour;
  };
  static std::uint32_t distance(DepthItem a, DepthItem b) {
    return a.depth() > b.depth() ? a.depth() - b.depth() : b.depth() - a.depth();
  }
  static void merge(Entry& entry, const Entry& other) {
    const bool before = other.item < entry.item;
    const Entry& front = before ? other : entry;
    const Entry& back = before ? entry : other;
    Entry both = front;
    both.colour.colour += front.colour.transmittance * back.colour.colour;
    both.colour.transmittance *= back.colour.transmittance;
    entry = both;
  }

  unsigned k_;
  std::vector<Entry> entries_;  ///< k a pixel, increasing
  std::array<std::uint32_t, kTilePixels> counts_;
};

/// The place of each triangle from the front; none without triangles.
struct Order {
  std::vector<std::uint32_t> ranks;
  std::uint64_t comparisons = 0;  ///< that it took
};

Result<std::shared_ptr<const void>> prepare_k_buffer(const FrameInfo& frame, const Settings&,
                                                     const Execution&) {
  auto order = std::make_shared<Order>();
  if (frame.triangles != nullptr) {
    order->ranks = ranks_of(triangle_distances(frame).centroid, order->comparisons);
  }
  return order;
}

template <class Entries>
Result<TileRenderer> make_of(unsigned k, std::shared_ptr<const Order> order) {
  return [k, entries = std::make_shared<Entries>(k), replay = std::make_shared<OrderedReplay>(),
          order = std::move(order)](TileStream& stream, TileImage& image) -> Result<void> {
    Costs& costs = stream.costs();
    costs.formula_bytes = costs.allocated_bytes =
        (Entries::kBytes * k + kPixelBytes) * stream.pixel_count();
    costs.stored = stream.size();
    if (is_first_tile(stream)) costs.comparisons += order->comparisons;
    entries->clear();
    const auto put = [&](std::uint32_t pixel, DepthItem item) {
      entries->put(stream, pixel, item);
    };
    if (order->ranks.empty()) {
      stream.pass(put);
    } else {
      replay->pass(
          stream, [&](std::uint32_t, DepthItem item) { return order->ranks[item.triangle()]; },
          put);
    }
    entries->finish(stream, image);
    return {};
  };
}

Result<TileRenderer> make_k_buffer(const FrameInfo&, const Settings& settings,
                                   const std::shared_ptr<const void>& prepared) {
  auto order = std::static_pointer_cast<const Order>(prepared);
  if (settings.variant == "merge") return make_of<MergedEntries>(settings.k, std::move(order));
  return make_of<LeavingEntries>(settings.k, std::move(order));
}

}  // namespace

const Technique kKBuffer{
    .name = "k-buffer",
    .title = "k-buffer: roughly sorted triangles, k entries a pixel",
    .paper = "Callahan, Ikits, Comba, Silva 2005; Bavoil et al. 2007; merging: Maule et al. 2011",
    .accuracy = Accuracy::kBounded,
    .k_means = "entries",
    .default_k = 8,
    .least_k = 1,
    .most_k = 256,
    .variants = "nearest merge",
    .memory = "8 bytes an entry (merge: 24), 20 a pixel",
    .fails = "a fragment that comes after more than k that lie behind it is blended too late",
    .prepare = prepare_k_buffer,
    .make = make_k_buffer,
};

}  // namespace strata::transparency
