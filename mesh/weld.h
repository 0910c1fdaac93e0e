#pragma once

#include <glm/vec3.hpp>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstdint>
#include <numeric>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/reserve_large.h"
#include "mesh/no_vertex.h"
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

  [[nodiscard]] glm::vec<3, Scalar> position() const {
    return {std::bit_cast<Scalar>(x), std::bit_cast<Scalar>(y), std::bit_cast<Scalar>(z)};
  }
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

  [[nodiscard]] glm::vec<3, Scalar> position() const {
    return {std::bit_cast<Scalar>(static_cast<std::uint32_t>(xy)),
            std::bit_cast<Scalar>(static_cast<std::uint32_t>(xy >> 32)), std::bit_cast<Scalar>(z)};
  }
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

  WeldTable() = default;  ///< holds nothing, and must be assigned first
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

  /// The value stored for a canonical key, or kNoVertex.
  [[nodiscard]] std::uint32_t find(const WeldBits<Scalar>& key, std::uint64_t hash) const {
    for (std::size_t at = hash & mask_;; at = (at + 1) & mask_) {
      const Slot& slot = slots_[at];
      if (slot.value_plus_1 == 0 || slot.key == key) return slot.value_plus_1 - 1;
    }
  }
  /// Calls visit(key, value) for the slots of piece `piece` of `pieces`.
  template <class Visit>
  void for_slots(std::size_t piece, std::size_t pieces, Visit&& visit) const {
    const std::size_t end = slots_.size() * (piece + 1) / pieces;
    for (std::size_t at = slots_.size() * piece / pieces; at < end; ++at) {
      if (slots_[at].value_plus_1 != 0) visit(slots_[at].key, slots_[at].value_plus_1 - 1);
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

/// Sets value[i] of each point i of [begin, end) to fresh(j) of the least of them, j, that has its
/// position.
/// @param table  empty; then maps each position to its value
/// @param go_on  go_on(i) is called now and then @param fresh  fresh(j) -> a value that no other
/// position has
/// @param found  found(j, position) is called for points that are the first of their position, in
/// order, before the next call of fresh
/// @return whether go_on never returned false
template <class Scalar, class Load, class GoOn, class Fresh, class Found>
bool weld_range(WeldTable<Scalar>& table, std::size_t begin, std::size_t end, Load&& load,
                GoOn&& go_on, std::uint32_t* value, Fresh&& fresh, Found&& found) {
  constexpr std::size_t kBatch = 128;  // look-ups in flight, so that their cache misses overlap
  constexpr std::size_t kLookUp = std::size_t{1} << 16;
  RecentKeys<Scalar> recent;
  WeldBits<Scalar> keys[kBatch];
  std::uint64_t hashes[kBatch];
  std::uint32_t indices[kBatch], known[kBatch];
  for (std::size_t at = begin; at < end; at += kBatch) {
    if ((at - begin) % kLookUp == 0 && !go_on(at)) return false;
    const std::size_t stop = std::min(end, at + kBatch);
    std::size_t held = 0, met = 0;
    for (std::size_t k = at; k < stop; ++k) {
      const auto i = static_cast<std::uint32_t>(k);
      const WeldBits<Scalar> key(WeldTable<Scalar>::canonical(load(k)));
      const std::uint64_t hash = key.hash();
      // One of equal keys, whose first may be found only below.
      if (recent.replace(key, hash, i, value[k])) {
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
      const std::uint32_t there = table.find_or_insert(keys[k], hashes[k], mine);
      value[indices[k]] = there;
      if (there == mine) found(indices[k], keys[k].position());
    }
    for (std::size_t k = 0; k < met; ++k) value[known[k]] = value[value[known[k]]];
  }
  return true;
}

/// Ranges of points, one for each thread, that are welded apart.
template <class Scalar>
struct WeldRanges {
  Execution all;  ///< all threads, never stopped: a range that is skipped would stay unset
  std::vector<std::size_t> ends;  ///< of the ranges
  std::vector<WeldTable<Scalar>> tables;

  /// @param share  one position in so many points is expected
  WeldRanges(const Execution& execution, std::size_t count, std::size_t share) : all(execution) {
    all.stop = {};
    const std::size_t parts =
        count < 50000 ? 1 : static_cast<std::size_t>(execution.thread_count());
    for (std::size_t part = 0; part < parts; ++part) ends.push_back(count * (part + 1) / parts);
    tables.resize(parts);
    share_ = share;
  }
  [[nodiscard]] std::size_t parts() const { return ends.size(); }
  [[nodiscard]] std::size_t begin(std::size_t part) const { return part == 0 ? 0 : ends[part - 1]; }

  /// Welds each range. fresh(part, i) and found(part, i, position) are those of weld_range().
  template <class Load, class GoOn, class Fresh, class Found>
  bool weld(Load&& load, GoOn&& go_on, std::uint32_t* value, Fresh&& fresh, Found&& found) {
    std::atomic<bool> stopped = false;
    parallel_for(all, parts(), [&](std::size_t part, int) {
      const std::size_t first = begin(part), end = ends[part];
      WeldTable<Scalar> table((end - first) / share_);  // apart from those of other threads
      const bool done = weld_range<Scalar>(
          table, first, end, load, go_on, value,
          [&fresh, part](std::uint32_t i) { return fresh(part, i); },
          [&found, part](std::uint32_t i, const auto& position) { found(part, i, position); });
      tables[part] = std::move(table);
      if (!done) stopped = true;
    });
    return !stopped;
  }

  /// Calls meet(part, value, earlier part, value there) for each position of a range that an
  /// earlier range has, too; of these the earliest. Several threads call it. Tables are read in the
  /// order of the hashes, so almost in step. @return number of calls
  template <class Meet>
  std::size_t meet_earlier(Meet&& meet) const {
    constexpr std::size_t kPieces = 16;
    std::atomic<std::size_t> all_calls = 0;
    parallel_for(all, kPieces * (parts() - 1), [&](std::size_t task, int) {
      const std::size_t part = task / kPieces + 1, piece = task % kPieces;
      std::size_t calls = 0;
      tables[part].for_slots(piece, kPieces, [&](const WeldBits<Scalar>& key, std::uint32_t value) {
        const std::uint64_t hash = key.hash();
        for (std::size_t earlier = 0; earlier < part; ++earlier) {
          const std::uint32_t there = tables[earlier].find(key, hash);
          if (there == kNoVertex) continue;
          meet(part, value, earlier, there);
          ++calls;
          return;
        }
      });
      all_calls += calls;
    });
    return all_calls;
  }

  /// Calls body(part, begin, end) for pieces of all ranges but the first, on all threads.
  template <class Body>
  void for_later_points(Body&& body) const {
    constexpr std::size_t kPieces = 8;
    parallel_for(all, kPieces * (parts() - 1), [&](std::size_t task, int) {
      const std::size_t part = task / kPieces + 1, piece = task % kPieces;
      const std::size_t first = begin(part), size = ends[part] - first;
      body(part, first + size * piece / kPieces, first + size * (piece + 1) / kPieces);
    });
  }

 private:
  std::size_t share_;
};

/// Numbers the different positions of the points [0, count) in the order of their first points:
/// number[i] is that of the position of i. Appends the positions, -0 replaced by +0, to
/// `positions`, which is empty. The result does not depend on the number of threads.
/// @param load, go_on  as for weld_first() @return false after go_on returned false
template <class Scalar, class Load, class GoOn>
bool weld_numbers(const Execution& execution, std::size_t count, Load&& load, std::uint32_t* number,
                  GoOn&& go_on, std::vector<glm::dvec3>& positions) {
  WeldRanges<Scalar> ranges(execution, count, 5);  // a closed mesh has one vertex for six corners
  const std::size_t parts = ranges.parts();
  struct alignas(64) Own {                       // of a range, in cache lines of its own
    std::vector<glm::vec<3, Scalar>> positions;  // but of the first range
    std::uint32_t count = 0;
  };
  std::vector<Own> own(parts);
  const bool done = ranges.weld(
      load, go_on, number, [&](std::size_t part, std::uint32_t) { return own[part].count; },
      [&](std::size_t part, std::uint32_t, const glm::vec<3, Scalar>& position) {
        ++own[part].count;
        if (part == 0) {
          positions.emplace_back(position);
        } else {
          own[part].positions.push_back(position);
        }
      });
  if (!done || parts == 1) return done;
  // The numbers of all ranges one after another; equal positions share that of the first range.
  std::vector<std::size_t> base(parts + 1);
  for (std::size_t part = 0; part < parts; ++part) base[part + 1] = base[part] + own[part].count;
  std::vector<std::uint32_t> joined(base[parts]);
  std::iota(joined.begin(), joined.end(), 0u);
  ranges.meet_earlier(
      [&](std::size_t part, std::uint32_t value, std::size_t earlier, std::uint32_t there) {
        joined[base[part] + value] = static_cast<std::uint32_t>(base[earlier] + there);
      });
  for (std::size_t part = 1; part < parts; ++part) {
    for (std::uint32_t i = 0; i < own[part].count; ++i) {
      std::uint32_t& to = joined[base[part] + i];
      if (to != base[part] + i) {
        to = joined[to];
      } else {
        to = static_cast<std::uint32_t>(positions.size());
        positions.emplace_back(own[part].positions[i]);
      }
    }
  }
  ranges.for_later_points([&](std::size_t part, std::size_t begin, std::size_t end) {
    const std::uint32_t* const to = joined.data() + base[part];
    for (std::size_t i = begin; i < end; ++i) number[i] = to[number[i]];
  });
  return true;
}

/// Sets first[i], for every i in [0, count), to the least j whose position equals that of i. Each
/// thread welds a range of its own; then each range looks its positions up in the earlier ones. So
/// the result does not depend on the number of threads. Most positions are expected to differ.
/// @param load  load(i) -> glm::vec<3, Scalar> @pre count < 2^32 - 1
/// @param go_on  go_on(i) is called now and then by all threads; after it returns false, `first`
/// stays incomplete
/// @return number of different positions
template <class Scalar, class Load, class GoOn = bool (*)(std::size_t)>
std::size_t weld_first(
    const Execution& execution, std::size_t count, Load&& load, std::uint32_t* first,
    GoOn&& go_on = [](std::size_t) { return true; }) {
  WeldRanges<Scalar> ranges(execution, count, 1);
  if (!ranges.weld(
          load, go_on, first, [](std::size_t, std::uint32_t i) { return i; },
          [](std::size_t, std::uint32_t, const auto&) {})) {
    return 0;
  }
  std::size_t different = 0;
  for (const WeldTable<Scalar>& table : ranges.tables) different += table.size();
  const std::size_t again =
      ranges.meet_earlier([first](std::size_t, std::uint32_t own, std::size_t,
                                  std::uint32_t there) { first[own] = there; });
  if (again == 0) return different;
  ranges.for_later_points([&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t least = first[first[i]];
      if (first[i] != least) first[i] = least;  // what other threads read stays untouched
    }
  });
  return different - again;
}

}  // namespace strata::detail
