#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

#include "strata/hashbuffer/record.h"

namespace strata {

/// The records that a hash table had no room for, by pixel (internal to hashbuffer/). All records
/// of a pixel that are in the table lie in front of those here.
template <RecordPolicy Record>
class Overflow {
 public:
  using Word = typename Record::Word;

  Overflow() = default;
  /// Not while others use either.
  Overflow(Overflow&& other) noexcept
      : sorted_(other.sorted_.load()), entries_(std::move(other.entries_)), lost_(other.lost_) {}
  Overflow& operator=(Overflow&& other) noexcept {
    sorted_ = other.sorted_.load();
    entries_ = std::move(other.entries_);
    lost_ = other.lost_;
    return *this;
  }

  /// Any thread may add.
  void add(std::uint64_t pixel, Word record) noexcept {
    const std::lock_guard lock(mutex_);
    sorted_ = false;
    try {
      entries_.push_back({pixel, Record::rank(record)});
    } catch (const std::bad_alloc&) {
      ++lost_;
    }
  }

  void clear() noexcept {
    std::vector<Entry>().swap(entries_);
    lost_ = 0;
  }

  /// Visits the records of a pixel front to back while `visit` returns true. Not while others add;
  /// the first call sorts.
  template <class Visit>
  void for_each(std::uint64_t pixel, Visit&& visit) {
    sort();
    const auto first = std::lower_bound(
        entries_.begin(), entries_.end(), pixel,
        [](const Entry& entry, std::uint64_t wanted) { return entry.pixel < wanted; });
    for (auto entry = first; entry != entries_.end() && entry->pixel == pixel; ++entry) {
      if (!visit(entry->record)) return;
    }
  }

  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  /// Records for which memory did not suffice.
  [[nodiscard]] std::uint64_t lost() const { return lost_; }
  [[nodiscard]] std::uint64_t memory_bytes() const { return entries_.capacity() * sizeof(Entry); }

 private:
  struct Entry {
    std::uint64_t pixel = 0;
    Word record = 0;  // without its age
  };

  void sort() {
    if (sorted_.load(std::memory_order_acquire)) return;
    const std::lock_guard lock(mutex_);
    if (sorted_) return;
    std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
      return a.pixel != b.pixel ? a.pixel < b.pixel : a.record > b.record;
    });
    sorted_.store(true, std::memory_order_release);
  }

  std::mutex mutex_;
  std::atomic<bool> sorted_{true};
  std::vector<Entry> entries_;
  std::uint64_t lost_ = 0;
};

}  // namespace strata
