#pragma once

#include <atomic>
#include <cassert>
#include <concepts>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/hashbuffer/count_scan_store.h"
#include "strata/hashbuffer/hash_buffer.h"

// Depth lists of your own fragments: insert what you draw, trace or sample, from any threads, and
// read one list per pixel, sorted by depth, then payload. Nothing is dropped, equal fragments are
// kept, and no bit depends on the order of insertion or on threads.
//
//     auto lists = strata::PayloadLists::create(width, height);
//     auto report = lists->build([&](auto& sink) { sink.insert(x, y, depth, payload); ... });
//     lists->for_each(x, y, [](strata::Fragment f) { ... });   // front to back
//
// WHICH LISTS
//
//     alias              keeps            layers   generator runs     bytes
//     DepthLists         depth            any      twice              8 a fragment, 8 a pixel
//     PayloadLists       depth, 32 bits   any      twice              8 a fragment, 8 a pixel
//     OnePassDepthLists  depth            255      once, or insert()  about 6 a fragment
//     OnePassLists       depth, 32 bits   255      once, or insert()  about 12 a fragment
//     DeepLists          depth, 30 bits   1023     once, or insert()  about 12 a fragment
//
// Take DepthLists or PayloadLists (count/scan: count, sum up, store, sort) if you can give the same
// fragments twice: they are faster in most scenes, and no list is too long. Take the one-pass lists
// (the HA-buffer, a hash table) if you cannot, or if fragments are expensive to make. Their
// generator runs a second time for a frame that outgrew the one before. It also runs a second time
// for the first frame, unless create() is told how many fragments to expect. DeepLists are one-pass
// lists for more than 255 layers in a pixel; bits 29 and 30 of their payloads must be 0.
//
// Million fragments a second by one thread, 1024 x 1024 pixels, generator, lists and a walk over
// them (docs/performance.md has the whole table and the machine):
//
//     mean layers    count/scan    one pass, depth    one pass, payload    (load 0.5 of the table)
//          1            24.6            23.8                24.3
//          4            24.0            20.3                15.7
//         10            18.0            13.1                10.2
//         20            14.8             9.9                 8.2

namespace strata {

/// A fragment of a list.
struct Fragment {
  std::uint32_t depth = 0;    ///< [0, 2^24); record_depth() makes it, normalized_depth() reads it
  std::uint32_t payload = 0;  ///< as it was inserted; 0 where the lists keep depth alone
  /// Equal in both members.
  friend bool operator==(const Fragment&, const Fragment&) = default;
};

/// The first fragment that no list can keep.
struct RefusedFragment {
  std::atomic<bool> any = false;  ///< whether there is one
  int x = 0;                      ///< pixel, as it was given
  int y = 0;                      ///< the same
  std::uint32_t depth = 0;        ///< as it was given
  std::uint32_t payload = 0;      ///< as it was given, or 0
};

/// True if `Sink` takes a pixel, a depth and this payload.
template <class Sink, class... Payload>
concept TakesFragment = requires(Sink& sink, Payload... payload) {
  sink.insert(0, 0, 0u, payload...);
};

/// What a generator inserts into; any thread. A fragment outside of the screen, of a depth of 2^24
/// or more, or of a payload that `Record` cannot keep is in no list: build() and finish() name the
/// first one.
template <RecordPolicy Record, class Sink>
class CheckedSink {
 public:
  /// For a screen of width x height pixels. Borrows `sink` and `refused`.
  CheckedSink(Sink& sink, int width, int height, RefusedFragment& refused)
      : sink_(sink), width_(width), height_(height), refused_(refused) {}

  /// The payload is left out for lists of depth alone.
  template <class... Payload>
  requires TakesFragment<Sink, Payload...>
  void insert(int x, int y, std::uint32_t depth, Payload... payload) noexcept {
    if (static_cast<unsigned>(x) < static_cast<unsigned>(width_) &&
        static_cast<unsigned>(y) < static_cast<unsigned>(height_) && depth <= kRecordDepthMax &&
        (Record::payload_fits(payload) && ...)) {
      sink_.insert(x, y, depth, payload...);
    } else if (!refused_.any.exchange(true, std::memory_order_relaxed)) {
      refused_.x = x, refused_.y = y, refused_.depth = depth;
      ((refused_.payload = payload), ...);
    }
  }
  /// Depths are integers: record_depth() makes them.
  template <std::floating_point Depth, class... Payload>
  void insert(int x, int y, Depth depth, Payload... payload) = delete;

 private:
  Sink& sink_;
  int width_, height_;
  RefusedFragment& refused_;
};

/// The depth lists of a screen, kept by `Store`. Use the aliases below. One thread builds; several
/// may read.
template <DepthListStore Store>
class FragmentLists {
 public:
  using Record = typename Store::Record;  ///< which bits are kept
  /// False if the lists keep depth alone.
  static constexpr bool kHasPayload = Record::kPayloadBits > 0;
  /// True if insert() may add fragments at any time, without a generator.
  static constexpr bool kOnePass = requires(Store & store) { store.begin_frame(); };

  /// Empty lists of a screen of width x height pixels, each side at least 1 (ErrorCode::kUsage).
  /// ErrorCode::kLimit if memory does not suffice.
  /// @param expected_fragments  of a frame, roughly; 0: unknown. One-pass lists make room for them.
  [[nodiscard]] static Result<FragmentLists> create(int width, int height,
                                                    std::uint64_t expected_fragments = 0) {
    auto store = [&] {
      if constexpr (kOnePass) {
        return Store::create(width, height, {.cells = expected_fragments + expected_fragments / 2});
      } else {
        return Store::create(width, height);
      }
    }();
    if (!store) return tl::unexpected(std::move(store.error()));
    return FragmentLists(*std::move(store));
  }

  [[nodiscard]] int width() const { return store_.width(); }    ///< pixels
  [[nodiscard]] int height() const { return store_.height(); }  ///< pixels
  /// Bytes held.
  [[nodiscard]] std::uint64_t memory_bytes() const { return store_.memory_bytes(); }

  /// Replaces the lists by those of a new frame. `generator(sink)` calls sink.insert(x, y, depth,
  /// payload) for every fragment, without the payload for lists of depth alone. It may insert from
  /// any number of its own threads, in any order, and returns when all are inserted. If it runs
  /// again it must give the same fragments. `execution.memory_limit` bounds the bytes held.
  /// @return how it was built. ErrorCode::kLimit, and empty lists, if a list is too long (the
  /// message names pixel and length) or memory does not suffice (it says how many fragments are
  /// missing); kInternal if the generator produced different fragments the second time; kUsage
  /// naming the first fragment outside of the screen, of a depth of 2^24 or more, or of a payload
  /// that these lists cannot keep; kCancelled on request
  template <class Generator>
  [[nodiscard]] Result<BuildReport> build(Generator&& generator, const Execution& execution = {}) {
    refused_->any = false;
    auto report = store_.build(
        [&](auto& store_sink) {
          auto sink = checked(store_sink);
          generator(sink);
        },
        execution);
    return completed(std::move(report));
  }

  /// Empties one-pass lists for a new frame, with the room that the last frame would have needed.
  /// Then insert(), from any threads, and finish(). @return as build()
  [[nodiscard]] Result<void> begin() requires kOnePass {
    is_complete_ = false;
    refused_->any = false;
    return store_.begin_frame();
  }
  /// Adds a fragment to one-pass lists; any thread.
  /// @pre begin() before and finish() not yet
  void insert(int x, int y, std::uint32_t depth) noexcept requires(kOnePass && !kHasPayload) {
    checked(store_).insert(x, y, depth);
  }
  /// The same with a payload.
  void insert(int x, int y, std::uint32_t depth, std::uint32_t payload) noexcept requires kOnePass {
    checked(store_).insert(x, y, depth, payload);
  }
  template <std::floating_point Depth, class... Payload>
  void insert(int x, int y, Depth depth, Payload... payload) = delete;
  /// Ends the frame: call it when all threads have inserted, before lists are read.
  /// @return as build(): ErrorCode::kLimit says how many fragments are missing
  [[nodiscard]] Result<BuildReport> finish() requires kOnePass {
    return completed(store_.finish());
  }

  /// Visits the list of pixel (x, y) front to back; stops early if `visit` returns false (it may
  /// also return nothing). @pre build() or finish() succeeded
  template <class Visit>
  void for_each(int x, int y, Visit&& visit) const {
    assert(is_complete_);
    store_.for_each(x, y, [&](DepthItem item) {
      const Fragment fragment{item.depth(), item.payload()};
      if constexpr (std::is_convertible_v<decltype(visit(fragment)), bool>) {
        return static_cast<bool>(visit(fragment));
      } else {
        visit(fragment);
        return true;
      }
    });
  }
  /// A copy of the list of pixel (x, y). @pre as for_each()
  [[nodiscard]] std::vector<Fragment> list(int x, int y) const {
    std::vector<Fragment> fragments;
    for_each(x, y, [&](Fragment fragment) { fragments.push_back(fragment); });
    return fragments;
  }

 private:
  explicit FragmentLists(Store&& store) : store_(std::move(store)) {}

  template <class Sink>
  CheckedSink<Record, Sink> checked(Sink& sink) const noexcept {
    return {sink, width(), height(), *refused_};
  }

  Result<BuildReport> completed(Result<BuildReport>&& report) {
    if (report && refused_->any) report = refusal();
    is_complete_ = report.has_value();
    return std::move(report);
  }

  tl::unexpected<Error> refusal() const {
    const RefusedFragment& first = *refused_;
    if (!Record::payload_fits(first.payload)) {
      return fail(ErrorCode::kUsage,
                  "a fragment of payload 0x{:08x} was inserted at pixel ({}, {}): bits {} and "
                  "30 of payloads must be 0, these lists keep {} bits",
                  first.payload, first.x, first.y, Record::kPayloadBits - 1, Record::kPayloadBits);
    }
    return fail(ErrorCode::kUsage,
                "a fragment of depth {} was inserted at pixel ({}, {}): depths must be 0 to "
                "{}, pixels (0, 0) to ({}, {})",
                first.depth, first.x, first.y, kRecordDepthMax, width() - 1, height() - 1);
  }

  Store store_;
  std::unique_ptr<RefusedFragment> refused_ = std::make_unique<RefusedFragment>();
  bool is_complete_ = true;  ///< true of empty lists
};

/// Depth alone, any number of layers; the generator runs twice.
using DepthLists = FragmentLists<CountScanStore<Record32, Concurrent>>;
/// Depth and 32 bits of payload, any number of layers; the generator runs twice.
using PayloadLists = FragmentLists<CountScanStore<Record64, Concurrent>>;
/// Depth alone, at most 255 layers a pixel, in one pass.
using OnePassDepthLists = FragmentLists<HashBuffer<Record32, Concurrent>>;
/// Depth and 32 bits of payload, at most 255 layers a pixel, in one pass.
using OnePassLists = FragmentLists<HashBuffer<Record64, Concurrent>>;
/// Depth and a payload whose bits 29 and 30 are 0, at most 1023 layers a pixel, in one pass.
using DeepLists = FragmentLists<HashBuffer<Record64Deep, Concurrent>>;

}  // namespace strata
