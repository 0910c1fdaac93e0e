#pragma once

#include <glm/vec3.hpp>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

#include "core/reserve_large.h"
#include "strata/core/execution.h"

/// Finds equal positions; private.
namespace strata::detail {

/// An open-addressing hash table that maps three numbers, compared bit by bit, to a 32-bit value.
/// It probes linearly and grows at a load of 5/8. Slots hold their keys, so a look-up touches one
/// cache line.
template <class Scalar>
class WeldTable {
 public:
  using Key = glm::vec<3, Scalar>;

  explicit WeldTable(std::size_t expected) { allocate(std::bit_ceil(expected * 8 / 5 + 16)); }

  /// Replaces -0 by +0, so that both are one position.
  static Key canonical(const Key& key) {
    if constexpr (std::is_floating_point_v<Scalar>) {
      return {key.x + Scalar(0), key.y + Scalar(0), key.z + Scalar(0)};
    } else {
      return key;
    }
  }
  static std::uint64_t hash(const Key& key) {
    std::uint64_t h = bits(key.x) * 0x9e3779b97f4a7c15u;
    h = (std::rotl(h, 29) ^ bits(key.y)) * 0xbf58476d1ce4e5b9u;
    h = (std::rotl(h, 31) ^ bits(key.z)) * 0x94d049bb133111ebu;
    return h ^ h >> 32;
  }

  void prefetch(std::uint64_t hash) const { __builtin_prefetch(&slots_[hash & mask_]); }

  /// The value stored for a canonical key. If there is none, stores `value` first. @pre value <
  /// 2^32 - 1
  std::uint32_t find_or_insert(const Key& key, std::uint64_t hash, std::uint32_t value) {
    for (std::size_t at = hash & mask_;; at = (at + 1) & mask_) {
      Slot& slot = slots_[at];
      if (slot.value_plus_1 == 0) {
        slot = {key, value + 1};
        if (++size_ > slots_.size() / 8 * 5) grow();
        return value;
      }
      if (same(slot.key, key)) return slot.value_plus_1 - 1;
    }
  }

  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  struct Slot {
    Key key{};
    std::uint32_t value_plus_1 = 0;  ///< 0: empty
  };

  static std::uint64_t bits(Scalar value) {
    if constexpr (sizeof(Scalar) == 8) {
      return std::bit_cast<std::uint64_t>(value);
    } else {
      return std::bit_cast<std::uint32_t>(value);
    }
  }
  static bool same(const Key& a, const Key& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

  void allocate(std::size_t slots) {
    slots_ = {};
    reserve_large(slots_, slots);
    slots_.resize(slots);
    mask_ = slots - 1;
  }
  void grow() {
    std::vector<Slot> old;
    old.swap(slots_);
    allocate(2 * old.size());
    for (const Slot& slot : old) {
      if (slot.value_plus_1 == 0) continue;
      std::size_t at = hash(slot.key) & mask_;
      while (slots_[at].value_plus_1 != 0) at = (at + 1) & mask_;
      slots_[at] = slot;
    }
  }

  std::vector<Slot> slots_;
  std::size_t mask_ = 0, size_ = 0;
};

/// The index of a position in `kept`. Appends the position if it is not there yet.
/// @param table  holds the indices of all positions in `kept`
inline std::uint32_t find_or_keep(WeldTable<double>& table, std::vector<glm::dvec3>& kept,
                                  const glm::dvec3& position) {
  const glm::dvec3 key = WeldTable<double>::canonical(position);
  const auto next = static_cast<std::uint32_t>(kept.size());
  const std::uint32_t at = table.find_or_insert(key, WeldTable<double>::hash(key), next);
  if (at == next) kept.push_back(key);
  return at;
}

/// Sets first[i], for every i in [0, count), to the least j whose position equals that of i. Each
/// thread owns the positions whose hash falls to it, so the result does not depend on the number of
/// threads.
/// @param load  load(i) -> glm::vec<3, Scalar> @pre count < 2^32 - 1
/// @param go_on  go_on(i) is called now and then by all threads; after it returns false, `first`
/// stays incomplete
/// @return number of different positions
template <class Scalar, class Load, class GoOn = bool (*)(std::size_t)>
std::size_t weld_first(
    const Execution& execution, std::size_t count, Load&& load, std::uint32_t* first,
    GoOn&& go_on = [](std::size_t) { return true; }) {
  using Table = WeldTable<Scalar>;
  constexpr std::size_t kBatch = 32;  // look-ups in flight, so that their cache misses overlap
  constexpr std::size_t kLookUp = std::size_t{1} << 16;
  const std::size_t parts = count < 50000 ? 1 : static_cast<std::size_t>(execution.thread_count());
  std::vector<std::size_t> different(parts);
  Execution all = execution;
  all.stop = {};  // a skipped block would leave its corners unset
  parallel_for(all, parts, [&](std::size_t part, int) {
    Table table(count / 5 / parts);  // a closed mesh has one vertex for six corners
    typename Table::Key keys[kBatch];
    std::uint64_t hashes[kBatch];
    std::uint32_t indices[kBatch];
    for (std::size_t begin = 0; begin < count; begin += kBatch) {
      if (begin % kLookUp == 0 && !go_on(begin)) return;
      const std::size_t end = std::min(count, begin + kBatch);
      std::size_t held = 0;
      for (std::size_t i = begin; i < end; ++i) {
        keys[held] = Table::canonical(load(i));
        const std::uint64_t hash = Table::hash(keys[held]);
        hashes[held] = hash;
        indices[held] = static_cast<std::uint32_t>(i);
        held += (hash >> 48) * parts >> 16 == part;
      }
      for (std::size_t i = 0; i < held; ++i) table.prefetch(hashes[i]);
      for (std::size_t i = 0; i < held; ++i) {
        first[indices[i]] = table.find_or_insert(keys[i], hashes[i], indices[i]);
      }
    }
    different[part] = table.size();
  });
  std::size_t total = 0;
  for (const std::size_t n : different) total += n;
  return total;
}

}  // namespace strata::detail
