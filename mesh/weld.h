#pragma once

#include <glm/vec3.hpp>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "core/reserve_large.h"
#include "strata/core/execution.h"

/// Finds equal positions; private.
namespace strata::detail {

/// Three numbers as words, which are written and read whole: a load of eight bytes that were stored
/// as two floats would wait for both stores.
template <class Scalar>
struct WeldBits {
  std::uint64_t x = 0, y = 0, z = 0;

  WeldBits() = default;
  explicit WeldBits(const glm::vec<3, Scalar>& key)
      : x(std::bit_cast<std::uint64_t>(key.x)),
        y(std::bit_cast<std::uint64_t>(key.y)),
        z(std::bit_cast<std::uint64_t>(key.z)) {}

  [[nodiscard]] std::uint64_t hash() const {
    std::uint64_t h = x * 0x9e3779b97f4a7c15u;
    h = (std::rotl(h, 29) ^ y) * 0xbf58476d1ce4e5b9u;
    h = (std::rotl(h, 31) ^ z) * 0x94d049bb133111ebu;
    return h ^ h >> 32;
  }
  friend bool operator==(const WeldBits& a, const WeldBits& b) {
    return ((a.x ^ b.x) | (a.y ^ b.y) | (a.z ^ b.z)) == 0;
  }
};

template <class Scalar>
requires(sizeof(Scalar) ==
         4) struct [[gnu::packed]] WeldBits<Scalar> {  // 12 bytes: with a value it makes 16
  std::uint64_t xy = 0;
  std::uint32_t z = 0;

  WeldBits() = default;
  explicit WeldBits(const glm::vec<3, Scalar>& key)
      : xy(std::bit_cast<std::uint32_t>(key.x) | std::uint64_t{std::bit_cast<std::uint32_t>(key.y)}
                                                     << 32),
        z(std::bit_cast<std::uint32_t>(key.z)) {}

  [[nodiscard]] std::uint64_t hash() const {
    std::uint64_t h = xy * 0x9e3779b97f4a7c15u;
    h = (h ^ h >> 32 ^ std::uint64_t{z} << 32) * 0x94d049bb133111ebu;
    return h ^ h >> 32;
  }
  friend bool operator==(const WeldBits& a, const WeldBits& b) {
    return ((a.xy ^ b.xy) | (a.z ^ b.z)) == 0;
  }
};

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
  static std::uint64_t hash(const Key& key) { return WeldBits<Scalar>(key).hash(); }

  void prefetch(std::uint64_t hash) const { __builtin_prefetch(&slots_[hash & mask_]); }

  /// The value stored for a canonical key. If there is none, stores `value` first. @pre value <
  /// 2^32 - 1
  std::uint32_t find_or_insert(const Key& key, std::uint64_t hash, std::uint32_t value) {
    return find_or_insert(WeldBits<Scalar>(key), hash, value);
  }
  std::uint32_t find_or_insert(const WeldBits<Scalar>& key, std::uint64_t hash,
                               std::uint32_t value) {
    for (std::size_t at = hash & mask_;; at = (at + 1) & mask_) {
      Slot& slot = slots_[at];
      if (slot.value_plus_1 == 0) {
        slot = {key, value + 1};
        if (++size_ > slots_.size() / 8 * 5) grow();
        return value;
      }
      if (slot.key == key) return slot.value_plus_1 - 1;
    }
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  /// Forgets all keys; keeps the room.
  void clear() {
    std::fill(slots_.begin(), slots_.end(), Slot{});
    size_ = 0;
  }

 private:
  struct Slot {
    WeldBits<Scalar> key;
    std::uint32_t value_plus_1 = 0;  ///< 0: empty
  };

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
      std::size_t at = slot.key.hash() & mask_;
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

/// The keys of a table that were looked up last, as many as fit the second-level cache: neighbours
/// of a mesh lie close together in most files.
template <class Scalar>
class RecentKeys {
 public:
  RecentKeys() : slots_(kSlots) {}

  /// Whether a key is remembered, whose value is then `known`; if it is not, it gets `value`.
  bool replace(const WeldBits<Scalar>& key, std::uint64_t hash, std::uint32_t value,
               std::uint32_t& known) {
    Slot& slot = slots_[hash >> kShift];
    if (slot.value_plus_1 != 0 && slot.key == key) {
      known = slot.value_plus_1 - 1;
      return true;
    }
    slot = {key, value + 1};
    return false;
  }

 private:
  struct Slot {
    WeldBits<Scalar> key;
    std::uint32_t value_plus_1 = 0;  ///< 0: empty
  };
  static constexpr unsigned kShift = 64 - 12;
  static constexpr std::size_t kSlots = std::size_t{1} << 12;
  std::vector<Slot> slots_;
};

/// Sets value[i] of the given indices i, which increase, to fresh(j) of the least of these indices
/// j whose position equals that of i, if `own(hash)`; other indices are left alone.
/// @param index  index(k) -> the k-th index, for k in [0, count)
/// @param fresh  fresh(j) -> a value that no other position has
/// @param found  found(j) is called for indices that are the first of their position, in order,
/// before the next call of fresh
/// @return whether go_on(i), which is called now and then, never returned false
template <class Scalar, class Index, class Load, class Own, class GoOn, class Fresh, class Found>
bool weld_one_by_one(std::size_t count, Index&& index, Load&& load, Own&& own, GoOn&& go_on,
                     std::uint32_t* value, std::size_t expected, Fresh&& fresh, Found&& found) {
  using Table = WeldTable<Scalar>;
  constexpr std::size_t kBatch = 128;  // look-ups in flight, so that their cache misses overlap
  constexpr std::size_t kLookUp = std::size_t{1} << 16;
  Table table(expected);
  RecentKeys<Scalar> recent;
  WeldBits<Scalar> keys[kBatch];
  std::uint64_t hashes[kBatch];
  std::uint32_t indices[kBatch], known[kBatch];
  for (std::size_t begin = 0; begin < count; begin += kBatch) {
    if (begin % kLookUp == 0 && !go_on(index(begin))) return false;
    const std::size_t end = std::min(count, begin + kBatch);
    std::size_t held = 0, met = 0;
    for (std::size_t k = begin; k < end; ++k) {
      const std::uint32_t i = index(k);
      const WeldBits<Scalar> key(Table::canonical(load(i)));
      const std::uint64_t hash = key.hash();
      if (!own(hash)) continue;
      // One of equal keys, whose first may be found only below.
      if (recent.replace(key, hash, i, value[i])) {
        known[met++] = i;
        continue;
      }
      keys[held] = key;
      hashes[held] = hash;
      indices[held++] = i;
      table.prefetch(hash);
    }
    for (std::size_t k = 0; k < held; ++k) {
      const std::uint32_t mine = fresh(indices[k]);
      const std::uint32_t at = table.find_or_insert(keys[k], hashes[k], mine);
      value[indices[k]] = at;
      if (at == mine) found(indices[k]);
    }
    for (std::size_t k = 0; k < met; ++k) value[known[k]] = value[value[known[k]]];
  }
  return true;
}

/// Welds the points of some indices on all threads; each has those whose hash falls to it.
/// @param index  as for weld_one_by_one() @return number of different positions
template <class Scalar, class Index, class Load, class GoOn>
std::size_t weld_by_hash(const Execution& execution, std::size_t parts, std::size_t count,
                         Index&& index, Load&& load, GoOn&& go_on, std::uint32_t* first,
                         std::size_t expected) {
  std::atomic<std::size_t> different = 0;
  parallel_for(execution, parts, [&](std::size_t part, int) {
    std::size_t own = 0;
    (void)weld_one_by_one<Scalar>(
        count, index, load, [&](std::uint64_t hash) { return (hash >> 48) * parts >> 16 == part; },
        go_on, first, expected / parts, [](std::uint32_t i) { return i; },
        [&own](std::uint32_t) { ++own; });
    different += own;
  });
  return different;
}

/// Whether most of the first points equal one of a few before them, as in the files of most meshes.
template <class Scalar, class Load>
bool neighbours_follow(std::size_t count, Load&& load) {
  constexpr std::size_t kLooks = std::size_t{1} << 15;
  RecentKeys<Scalar> recent;
  const std::size_t looks = std::min(count, kLooks);
  std::size_t met = 0;
  for (std::size_t i = 0; i < looks; ++i) {
    const WeldBits<Scalar> key(WeldTable<Scalar>::canonical(load(i)));
    std::uint32_t known = 0;
    met += recent.replace(key, key.hash(), static_cast<std::uint32_t>(i), known) ? 1 : 0;
  }
  return met > looks / 2;
}

/// How many threads weld so many points.
inline std::size_t weld_parts(const Execution& execution, std::size_t count) {
  return count < 50000 ? 1 : static_cast<std::size_t>(execution.thread_count());
}

/// Numbers the different positions of the points [0, count) in the order of their first points, on
/// one thread: number[i] is that of the position of i.
/// @param load, go_on  as for weld_first() @param found  found(i) for the first point of each
template <class Scalar, class Load, class GoOn, class Found>
void weld_numbers(std::size_t count, Load&& load, std::uint32_t* number, GoOn&& go_on,
                  Found&& found) {
  std::uint32_t next = 0;
  (void)weld_one_by_one<Scalar>(
      count, [](std::size_t k) { return static_cast<std::uint32_t>(k); }, load,
      [](std::uint64_t) { return true; }, go_on, number, count / 5,
      [&next](std::uint32_t) { return next; },
      [&](std::uint32_t i) {
        ++next;
        found(i);
      });
}

/// Sets first[i], for every i in [0, count), to the least j whose position equals that of i. Each
/// thread welds a range of its own. Then it owns, of the positions that are left, those whose hash
/// falls to it; at once, if points that are equal lie far apart. So the result does not depend on
/// the number of threads.
/// @param load  load(i) -> glm::vec<3, Scalar> @pre count < 2^32 - 1
/// @param go_on  go_on(i) is called now and then by all threads; after it returns false, `first`
/// stays incomplete
/// @return number of different positions
template <class Scalar, class Load, class GoOn = bool (*)(std::size_t)>
std::size_t weld_first(
    const Execution& execution, std::size_t count, Load&& load, std::uint32_t* first,
    GoOn&& go_on = [](std::size_t) { return true; }) {
  const std::size_t parts = weld_parts(execution, count);
  Execution all = execution;
  all.stop = {};  // a skipped block would leave its corners unset
  std::vector<std::vector<std::uint32_t>> firsts(parts);  // of each range
  std::vector<std::size_t> different(parts);
  // A closed mesh has one vertex for six corners.
  if (parts > 1 && !neighbours_follow<Scalar>(count, load)) {
    return weld_by_hash<Scalar>(
        all, parts, count, [](std::size_t k) { return static_cast<std::uint32_t>(k); }, load, go_on,
        first, count / 5);
  }
  std::atomic<bool> stopped = false;
  parallel_for(all, parts, [&](std::size_t part, int) {
    const std::size_t begin = count * part / parts, end = count * (part + 1) / parts;
    const std::size_t expected = (end - begin) / 5;
    if (parts > 1) reserve_large(firsts[part], expected);
    const bool done = weld_one_by_one<Scalar>(
        end - begin, [begin](std::size_t k) { return static_cast<std::uint32_t>(begin + k); }, load,
        [](std::uint64_t) { return true; }, go_on, first, expected,
        [](std::uint32_t i) { return i; },
        [&](std::uint32_t i) {
          ++different[part];
          if (parts > 1) firsts[part].push_back(i);
        });
    if (!done) stopped = true;
  });
  if (stopped) return 0;
  if (parts == 1) return different[0];

  std::vector<std::uint32_t> left;
  for (std::vector<std::uint32_t>& of_range : firsts) {
    left.insert(left.end(), of_range.begin(), of_range.end());
    of_range = {};
  }
  const std::size_t total = weld_by_hash<Scalar>(
      all, parts, left.size(), [&](std::size_t k) { return left[k]; }, load,
      [](std::size_t) { return true; }, first, left.size());
  parallel_for(all, parts - 1, [&](std::size_t part, int) {
    const std::size_t begin = count * (part + 1) / parts, end = count * (part + 2) / parts;
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t least = first[first[i]];
      if (first[i] != least) first[i] = least;  // what other threads read stays untouched
    }
  });
  return total;
}

}  // namespace strata::detail
