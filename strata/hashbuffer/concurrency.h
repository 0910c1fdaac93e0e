#pragma once

#include <atomic>

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

}  // namespace strata
