#pragma once

#include <algorithm>
#include <atomic>
#include <concepts>
#include <cstddef>
#include <cstdint>

#include "strata/core/depth_list.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"

// The two forms of a store. Both obey the same law and give the same bits. The maximum by
// compare-and-swap follows Lefebvre, Hornus, Lasram, "HA-Buffer", 2013, section 3.1.

namespace strata {

/// Any thread may insert at any pixel. All accesses are relaxed: a record is one word, nothing is
/// published through it. Whoever reads the lists must synchronize with the inserting threads first
/// (join them).
struct Concurrent {
  static constexpr bool kAnyThread = true;  ///< any thread may insert

  /// Raises `cell` to at least `value`; returns what it held before. Reads first, so a probe that
  /// loses costs a plain load.
  template <class Word>
  static Word fetch_max(Word& cell, Word value) noexcept {
    static_assert(std::atomic_ref<Word>::is_always_lock_free);
    const std::atomic_ref<Word> shared(cell);
    Word seen = shared.load(std::memory_order_relaxed);
    while (seen < value && !shared.compare_exchange_weak(seen, value, std::memory_order_relaxed,
                                                         std::memory_order_relaxed)) {
    }
    return seen;
  }

  /// Adds 1; returns what `counter` held before.
  template <class Word>
  static Word fetch_increment(Word& counter) noexcept {
    return std::atomic_ref<Word>(counter).fetch_add(1, std::memory_order_relaxed);
  }

  /// Sets `cell`.
  template <class Word>
  static void store(Word& cell, Word value) noexcept {
    std::atomic_ref<Word>(cell).store(value, std::memory_order_relaxed);
  }
};

/// One thread inserts; plain loads and stores.
struct Exclusive {
  static constexpr bool kAnyThread = false;  ///< one thread inserts

  /// Raises `cell` to at least `value`; returns what it held before.
  template <class Word>
  static Word fetch_max(Word& cell, Word value) noexcept {
    const Word seen = cell;
    if (seen < value) cell = value;
    return seen;
  }

  /// Adds 1; returns what `counter` held before.
  template <class Word>
  static Word fetch_increment(Word& counter) noexcept {
    return counter++;
  }

  /// Sets `cell`.
  template <class Word>
  static void store(Word& cell, Word value) noexcept {
    cell = value;
  }
};

/// Anything that takes fragments. A generator of fragments is a callable that accepts any sink:
/// `[&](auto& sink) { sink.insert(x, y, depth, payload); }`, without the payload where the store's
/// records keep depth alone. It may be called several times for one frame. Each time it must insert
/// the same fragments, in any order, from any number of its own threads (one if the store is
/// Exclusive), and return when all are inserted.
template <class S>
concept FragmentSink = requires(S& sink, int x, int y, std::uint32_t depth, std::uint32_t payload) {
  { sink.insert(x, y, depth, payload) }
  noexcept;
}
|| requires(S& sink, int x, int y, std::uint32_t depth) {
  { sink.insert(x, y, depth) }
  noexcept;
};

/// How a frame was built.
struct BuildReport {
  std::uint64_t fragments = 0;     ///< in the lists
  int generator_calls = 0;         ///< geometry passes
  std::uint64_t memory_bytes = 0;  ///< held by the store
};

namespace detail {

/// The two forms of insert(), which end in Self::put(x, y, depth, payload).
template <class Self, class Record>
class SinkForms {
 public:
  /// Adds a fragment at pixel (x, y). Depths beyond 2^24 - 1 are clamped. Any thread, if the store
  /// is Concurrent. @pre 0 <= x < width, 0 <= y < height
  void insert(int x, int y, std::uint32_t depth) noexcept requires(Record::kPayloadBits == 0) {
    static_cast<Self*>(this)->put(x, y, depth, 0);
  }
  /// The same with a payload. @pre Record::payload_fits(payload)
  void insert(int x, int y, std::uint32_t depth, std::uint32_t payload) noexcept {
    static_assert(
        Record::kPayloadBits > 0,
        "Record32 keeps depth alone and would drop the payload: call insert(x, y, depth), "
        "or take a store of Record64");
    static_cast<Self*>(this)->put(x, y, depth, payload);
  }
};

/// Sorts a list in place: by insertion, which few and nearly sorted fragments like best, or by
/// std::sort if it is long.
template <class Item>
void sort_list(Item* begin, Item* end) {
  constexpr std::ptrdiff_t kInsertionSortLimit = 32;
  if (end - begin > kInsertionSortLimit) {
    std::sort(begin, end);
    return;
  }
  for (Item* next = begin; next != end; ++next) {
    const Item item = *next;
    Item* place = next;
    for (; place != begin && item < place[-1]; --place) *place = place[-1];
    *place = item;
  }
}

/// A generator for use in concepts.
struct NoFragments {
  void operator()(FragmentSink auto& sink) const { static_cast<void>(sink); }
};
struct IgnoreItem {
  void operator()(DepthItem item) const { static_cast<void>(item); }
};
}  // namespace detail

/// store.build(generator, execution): replaces the frame that the store holds. See the store.
template <class Store, class Generator>
requires requires { typename Store::Record; }
[[nodiscard]] Result<BuildReport> build(Store& store, Generator&& generator,
                                        const Execution& execution = {}) {
  return store.build(generator, execution);
}

/// A store of a frame's fragments that gives them back as sorted depth lists. The law: the list of
/// a pixel holds every fragment that was inserted there, sorted by (depth, payload), equal ones as
/// often as they came; no bit depends on the order of insertion, the threads, or the store. What
/// does not fit is never dropped silently: build() fails with ErrorCode::kLimit and the number.
template <class S>
concept DepthListStore = requires(S store, const S built, int x, int y,
                                  const Execution& execution) {
  typename S::Record;
  { built.width() } -> std::same_as<int>;
  { built.height() } -> std::same_as<int>;
  /// Replaces the frame that the store holds.
  { build(store, detail::NoFragments{}, execution) } -> std::same_as<Result<BuildReport>>;
  /// Visits the list of pixel (x, y) front to back.
  built.for_each(x, y, detail::IgnoreItem{});
  { built.depth_image(execution) } -> std::same_as<Result<LayeredDepthImage>>;
  { built.memory_bytes() } -> std::same_as<std::uint64_t>;
};

}  // namespace strata
