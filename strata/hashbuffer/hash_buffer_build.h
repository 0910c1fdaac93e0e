#pragma once

#include <algorithm>
#include <optional>

#include "strata/hashbuffer/hash_buffer.h"

namespace strata {

namespace detail {

/// Ages are more than any table offers. @return kLimit naming the split to take
template <class Record, class Concurrency>
[[nodiscard]] Result<void> check_depth(
    const HashBuffer<Record, Concurrency>& buffer,
    const typename HashBuffer<Record, Concurrency>::FragmentCount& count) {
  if (count.deepest <= buffer.age_wanted()) return {};
  return fail(
      ErrorCode::kLimit, "hash buffer: pixel ({}, {}) has {} fragments, {} counts {} at most; {}",
      count.x, count.y, count.deepest, Record::kName, buffer.age_wanted(),
      buffer.age_wanted() < Record::kAgeMax ? "raise the option age_limit" : Record::kDeeper);
}

/// Room for that many fragments, from a table of `cells`, as far as `limit` (bytes, 0: none)
/// allows.
template <class Record, class Concurrency>
[[nodiscard]] std::uint64_t cells_for(const HashBuffer<Record, Concurrency>& buffer,
                                      std::uint64_t fragments, std::uint64_t cells,
                                      std::uint64_t limit) {
  while (is_too_full(fragments, cells)) cells = grown_cells(cells);
  return limit > 0 ? std::min(cells, buffer.largest_cells(limit)) : cells;
}

}  // namespace detail

/// Builds a frame: empties the buffer, adapts its table to the last frame's load, runs the
/// generator, and if a fragment did not fit, rebuilds the frame with more room until all fit. The
/// generator runs once a frame; twice for the first one, whose fragments are counted before
/// (HashBufferOptions::cells spares that), and for one that outgrew the frame before.
///
/// `execution.memory_limit` bounds the buffer's own bytes. Its threads are not used; the generator
/// brings its own. Exceptions of the generator pass through.
///
/// @return how the frame was built. ErrorCode::kLimit, and an empty buffer, if a pixel has more
/// fragments than the record can count (no room can mend that; the message names the split to
/// take), or if fragments were still missing in the largest table that memory allows (the message
/// says how many). ErrorCode::kCancelled on request.
template <class Record, class Concurrency, class Generator>
[[nodiscard]] Result<BuildReport> build(HashBuffer<Record, Concurrency>& buffer,
                                        Generator&& generator, const Execution& execution = {}) {
  const std::uint64_t limit = execution.memory_limit;
  if (auto begun = buffer.begin_frame(limit); !begun) {
    return tl::unexpected(std::move(begun.error()));
  }
  struct KeepFailures {  // again, whatever ends the frame
    explicit KeepFailures(HashBuffer<Record, Concurrency>& to_set) : buffer(to_set) {
      buffer.keep_failures(false);
    }
    ~KeepFailures() { buffer.keep_failures(true); }
    KeepFailures(const KeepFailures&) = delete;
    KeepFailures& operator=(const KeepFailures&) = delete;
    HashBuffer<Record, Concurrency>& buffer;
  } const keep_failures(buffer);
  int calls = 0, failed_frames = 0;
  std::optional<typename HashBuffer<Record, Concurrency>::FragmentCount> count;
  // With culling by opacity the count would be far more than what is kept.
  if (buffer.has_unknown_load() && buffer.options().opacity == nullptr) {
    count = buffer.count_fragments(generator);
    ++calls;
    if (!buffer.is_culling()) {
      if (auto held = detail::check_depth(buffer, *count); !held) {
        return tl::unexpected(std::move(held.error()));
      }
    }
    const std::uint64_t cells = buffer.cells().size();
    const std::uint64_t target = detail::cells_for(buffer, count->kept, cells, limit);
    if (target > cells) {
      if (auto resized = buffer.resize(target); !resized) {
        return fail(ErrorCode::kLimit, "hash buffer: {} fragments; {}", count->kept,
                    resized.error().message);
      }
    }
  }
  for (;;) {
    if (execution.stop.stop_requested()) {
      buffer.clear();
      return fail(ErrorCode::kCancelled, "hash buffer: stopped on request");
    }
    generator(buffer);
    ++calls;
    if (execution.stop.stop_requested()) continue;
    const std::uint64_t missing = buffer.failures();
    const std::uint64_t stored = buffer.stored();
    const std::uint64_t cells = buffer.cells().size();
    if (missing == 0) return BuildReport{stored, calls, buffer.memory_bytes()};

    // Where room does not help, the ages may not suffice. With culling, a pixel may have more
    // fragments than it keeps; then only a table that fails though it is nearly empty proves that.
    const bool lacks_ages = is_too_empty(stored + missing, cells);
    if (lacks_ages || (++failed_frames > 1 && !buffer.is_culling())) {
      if (!count) {
        count = buffer.count_fragments(generator);
        ++calls;
      }
      if (auto held = detail::check_depth(buffer, *count); !held) {
        buffer.clear();
        return tl::unexpected(std::move(held.error()));
      }
    }
    // All fragments are known now: stored + missing. At least one step up, since a table that is
    // not full fails by bad luck with its ages. Where luck fails again and again, one plane a
    // layer cannot.
    const std::uint64_t target =
        detail::cells_for(buffer, stored + missing, grown_cells(cells), limit);
    if (target <= cells) {
      buffer.clear();
      return fail(ErrorCode::kLimit,
                  "hash buffer: {} of {} fragments did not fit in {} cells, {} bytes; the limit is "
                  "{} bytes",
                  missing, stored + missing, cells, buffer.bytes_of(cells), limit);
    }
    const OffsetKind kind = lacks_ages ? OffsetKind::kPlaneFirst : buffer.options().offsets;
    if (auto resized = buffer.resize(target, kind); !resized) {
      return fail(ErrorCode::kLimit, "hash buffer: {} of {} fragments did not fit in {} cells; {}",
                  missing, stored + missing, cells, resized.error().message);
    }
  }
}

}  // namespace strata
