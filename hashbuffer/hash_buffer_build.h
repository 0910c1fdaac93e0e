#pragma once

#include "hashbuffer/hash_buffer.h"

namespace strata {

/// Builds a frame: empties the buffer, adapts its table to the last frame's load, runs the
/// generator, and if a fragment did not fit, rebuilds the frame with more room until all fit.
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
  std::uint64_t deepest_fragments = 0;  // 0: not counted
  for (int calls = 1;; ++calls) {
    generator(buffer);
    if (execution.stop.stop_requested()) {
      buffer.clear();
      return fail(ErrorCode::kCancelled, "hash buffer: stopped on request");
    }
    const std::uint64_t missing = buffer.failures();
    const std::uint64_t stored = buffer.stored();
    const std::uint64_t cells = buffer.cells().size();
    if (missing == 0) return BuildReport{stored, calls, buffer.memory_bytes()};

    // With culling, a pixel may have more fragments than it keeps; then only a table that fails
    // though it is nearly empty proves that room is not what it lacks.
    const bool lacks_ages = is_too_empty(stored + missing, cells);
    if (deepest_fragments == 0 && (!buffer.is_culling() || lacks_ages)) {
      const auto deepest = buffer.count_deepest(generator);
      ++calls;
      if (deepest.fragments > buffer.age_wanted()) {
        return fail(
            ErrorCode::kLimit,
            "hash buffer: pixel ({}, {}) has {} fragments, {} counts {} at most; {}", deepest.x,
            deepest.y, deepest.fragments, Record::kName, buffer.age_wanted(),
            buffer.age_wanted() < Record::kAgeMax ? "raise the option age_limit" : Record::kDeeper);
      }
      deepest_fragments = deepest.fragments;
    }
    // All fragments are known now: stored + missing. At least one step up, since a table that is
    // not full fails by bad luck with its ages. Where luck fails again and again, one plane a
    // layer cannot.
    std::uint64_t target = grown_cells(cells);
    while (is_too_full(stored + missing, target)) target = grown_cells(target);
    if (limit > 0) target = std::min(target, buffer.largest_cells(limit));
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
