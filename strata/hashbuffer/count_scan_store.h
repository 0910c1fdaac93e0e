#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <new>
#include <stdexcept>
#include <utility>
#include <vector>

#include "strata/core/depth_list.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/hashbuffer/depth_list_store.h"
#include "strata/hashbuffer/record.h"

// After: Maule, Comba, Torchelsen, Bastos, "Memory-Optimized Order-Independent Transparency with
// Dynamic Fragment Buffer", 2012/2014.
// We differ: one 64-bit array serves as counter, base address and cursor, and ends as the offsets
// of the lists; lists are sorted by the total order (depth, payload), so no bit depends on threads.

namespace strata {

/// Two geometry passes: count the fragments of each pixel, sum up, store each in its place; then
/// sort the lists. Exact size, lists of any length. `RecordType` says which bits of a payload are
/// kept, so that lists equal those of a HashBuffer with the same policy; `Concurrency` is
/// Concurrent (the generator may insert from any thread) or Exclusive.
///
/// Memory: 8 bytes a fragment (of the largest frame so far) and 8 a pixel, plus 8.
template <RecordPolicy RecordType, class Concurrency>
class CountScanStore {
 public:
  using Record = RecordType;                                   ///< which bits are kept
  static constexpr bool kAnyThread = Concurrency::kAnyThread;  ///< any thread may insert

  /// A screen of width x height pixels, each at least 1 (ErrorCode::kUsage), with empty lists.
  /// ErrorCode::kLimit if memory does not allow it.
  [[nodiscard]] static Result<CountScanStore> create(int width, int height) {
    if (width < 1 || height < 1) {
      return fail(ErrorCode::kUsage,
                  "count/scan store: width and height must be at least 1, got {} x {}", width,
                  height);
    }
    try {
      CountScanStore store(width, height);
      store.ends_.resize(store.pixels() + 1);
      return store;
    } catch (const std::exception&) {
      return fail(ErrorCode::kLimit, "count/scan store: no memory for {} x {} pixels", width,
                  height);
    }
  }

  [[nodiscard]] int width() const { return width_; }    ///< pixels
  [[nodiscard]] int height() const { return height_; }  ///< pixels
  /// Fragments in the lists.
  [[nodiscard]] std::uint64_t stored() const { return items_.size(); }
  /// Bytes held: 8 a fragment of the largest frame so far, 8 a pixel, and 8.
  [[nodiscard]] std::uint64_t memory_bytes() const { return bytes_of(items_.capacity()); }
  /// Bytes that a frame of so many fragments needs.
  [[nodiscard]] std::uint64_t bytes_of(std::uint64_t fragments) const {
    return fragments * sizeof(DepthItem) + (pixels() + 1) * sizeof(std::uint64_t);
  }

  /// Pass 1: counts.
  class Counter : public detail::SinkForms<Counter, Record> {
   public:
    /// Borrows the store.
    explicit Counter(CountScanStore& store) : store_(&store) {}

   private:
    friend detail::SinkForms<Counter, Record>;
    void put(int x, int y, std::uint32_t, std::uint32_t) noexcept {
      Concurrency::fetch_increment(store_->ends_[store_->pixel_of(x, y) + 1]);
    }

    CountScanStore* store_;
  };

  /// Pass 2: stores.
  class Writer : public detail::SinkForms<Writer, Record> {
   public:
    /// Borrows the store. @pre the frame was counted
    explicit Writer(CountScanStore& store) : store_(&store) {}

   private:
    friend detail::SinkForms<Writer, Record>;
    void put(int x, int y, std::uint32_t depth, std::uint32_t payload) noexcept {
      assert(Record::payload_fits(payload));
      const std::uint64_t slot =
          Concurrency::fetch_increment(store_->ends_[store_->pixel_of(x, y) + 1]);
      // Only a generator that gives other fragments than it was counted with gets past the end.
      if (slot < store_->items_.size()) store_->items_[slot] = Record::item(depth, payload);
    }

    CountScanStore* store_;
  };

  /// Visits the list of pixel (x, y) front to back; stops early if `visit` returns false (it may
  /// also return nothing).
  template <class Visit>
  void for_each(int x, int y, Visit&& visit) const {
    const std::uint64_t pixel = pixel_of(x, y);
    for (std::uint64_t i = ends_[pixel]; i < ends_[pixel + 1]; ++i) {
      if constexpr (std::is_convertible_v<decltype(visit(items_[i])), bool>) {
        if (!visit(items_[i])) return;
      } else {
        visit(items_[i]);
      }
    }
  }

  /// A copy of all lists as an image (depth_limit 2^24, world_from_image left at identity).
  [[nodiscard]] Result<LayeredDepthImage> depth_image(const Execution& = {}) const {
    try {
      return image_of(ends_, items_);
    } catch (const std::exception&) {
      return fail(ErrorCode::kLimit, "count/scan store: no memory for a copy of {} fragments",
                  stored());
    }
  }
  /// All lists as an image, without copying. Leaves the store unusable.
  [[nodiscard]] LayeredDepthImage take_depth_image() && {
    return image_of(std::move(ends_), std::move(items_));
  }

  /// Builds a frame: runs the generator twice, then sorts the rows on `execution`'s threads.
  /// `execution.memory_limit` bounds the store's own bytes. Exceptions of the generator pass
  /// through.
  /// @return how it was built. ErrorCode::kLimit, and empty lists, with the number of fragments
  /// that do not fit; kInternal if the generator produced different fragments the second time;
  /// kCancelled on request.
  template <class Generator>
  [[nodiscard]] Result<BuildReport> build(Generator&& generator, const Execution& execution = {}) {
    clear();
    Counter counter(*this);
    generator(counter);
    const std::uint64_t fragments = scan();
    if (auto room = make_room(fragments, execution.memory_limit); !room) {
      clear();
      return tl::unexpected(std::move(room.error()));
    }
    Writer writer(*this);
    generator(writer);
    // Sorting must not be led astray by a generator that broke its promise.
    if (ends_.back() != fragments || !std::is_sorted(ends_.begin(), ends_.end())) {
      clear();
      return fail(ErrorCode::kInternal,
                  "count/scan store: the generator gave different fragments the second time");
    }
    sort(execution);
    if (execution.stop.stop_requested()) {
      clear();
      return fail(ErrorCode::kCancelled, "count/scan store: stopped on request");
    }
    return BuildReport{fragments, 2, memory_bytes()};
  }

 private:
  CountScanStore(int width, int height) : width_(width), height_(height) {}

  [[nodiscard]] std::uint64_t pixels() const {
    return static_cast<std::uint64_t>(width_) * static_cast<std::uint64_t>(height_);
  }
  [[nodiscard]] std::uint64_t pixel_of(int x, int y) const noexcept {
    assert(x >= 0 && x < width_ && y >= 0 && y < height_);
    return static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(width_) +
           static_cast<std::uint64_t>(x);
  }

  /// Room for that many fragments. @param limit bytes of the whole store, 0: none
  [[nodiscard]] Result<void> make_room(std::uint64_t fragments, std::uint64_t limit) {
    if (limit > 0 && bytes_of(fragments) > limit) {
      const std::uint64_t fixed = bytes_of(0);
      const std::uint64_t room = limit < fixed ? 0 : (limit - fixed) / sizeof(DepthItem);
      return fail(ErrorCode::kLimit,
                  "count/scan store: {} of {} fragments do not fit; they need {} bytes, the limit "
                  "is {}",
                  fragments - room, fragments, bytes_of(fragments), limit);
    }
    try {
      // The old array goes before the new one comes; one that is large enough is used again.
      if (items_.capacity() < fragments || (limit > 0 && memory_bytes() > limit)) {
        std::vector<DepthItem>().swap(items_);
      }
      items_.resize(fragments);
    } catch (const std::exception&) {
      return fail(ErrorCode::kLimit, "count/scan store: no memory for {} fragments, {} bytes",
                  fragments, bytes_of(fragments));
    }
    return {};
  }

  void clear() noexcept {
    std::fill(ends_.begin(), ends_.end(), 0);
    items_.clear();
  }

  /// Element p + 1 of `ends_` turns from the count of pixel p into the begin of its list. Pass 2
  /// advances it to the end, which is the begin of the next: then the array holds the offsets.
  std::uint64_t scan() noexcept {
    std::uint64_t sum = 0;
    for (std::uint64_t& entry : ends_) sum += std::exchange(entry, sum);
    return sum;
  }

  void sort(const Execution& execution) {
    const auto columns = static_cast<std::size_t>(width_);
    parallel_for(execution, static_cast<std::size_t>(height_), [&](std::size_t row, int) {
      for (std::size_t pixel = row * columns; pixel < (row + 1) * columns; ++pixel) {
        detail::sort_list(items_.data() + ends_[pixel], items_.data() + ends_[pixel + 1]);
      }
    });
  }

  template <class Ends, class Items>
  [[nodiscard]] LayeredDepthImage image_of(Ends&& ends, Items&& items) const {
    LayeredDepthImage image;
    image.width = width_;
    image.height = height_;
    image.depth_limit = kRecordDepthMax + 1;
    image.offsets = std::forward<Ends>(ends);
    image.items = std::forward<Items>(items);
    return image;
  }

  int width_;
  int height_;
  std::vector<std::uint64_t> ends_;
  std::vector<DepthItem> items_;
};

}  // namespace strata
