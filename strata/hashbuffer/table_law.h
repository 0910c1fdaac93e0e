#pragma once

#include <cstdint>

// After: Lefebvre, Hornus, Lasram, "HA-Buffer: Coherent Hashing for single-pass A-buffer", INRIA
// RR-8282, 2013.
// We differ: equal records are kept, since a second crossing at the same depth is a crossing; the
// age is bounded and what does not fit is counted; wrapping is done on reduced numbers, so tables
// of any size work.
//
// THE TABLE LAW (every form of the table, tile-private, SIMD and GPU ones included, obeys it)
//
//  1. Cells. A screen of `pixels` = width * height pixels is keyed by pixel = y * width + x,
//     64-bit. The table has `cells` >= pixels cells, all 0 at first. With distinct offsets
//     o[1..n], each in [0, cells), the cell of a pixel at age a is
//         cell(pixel, a) = (pixel + o[a]) mod cells        (one conditional subtraction),
//     and the pixel of a record found in cell c at age a is
//         pixel(c, a) = (c + cells - o[a]) mod cells       (one conditional subtraction).
//     As cells >= pixels, no two pixels share a cell at the same age: no key is stored.
//  2. Order. A record is the word [age | nearness | payload'], nearness = kDepthMax - depth and
//     payload' the complement of the payload (record.h). Words compare as unsigned numbers: the
//     larger one is older, then nearer, then of smaller payload.
//  3. Ages start at 1 and count probes. A record proposes to its cell at its age; the cell keeps
//     the larger word; the loser goes on at its own age + 1 (an evicted record from the age it had
//     in the cell). An equal word loses too: duplicates are kept, at different ages.
//  4. The limit n = min(kAgeMax, cells, the option age_limit). A record that loses at age n leaves
//     the table and is counted as a failure.
//
// What follows (tests/hashbuffer hold the code to it). Cells only grow. The final table is unique:
// this is deferred acceptance (proposals in order of age, a fixed strict order in every cell), so
// its bits depend neither on the order of insertion nor on threads, nor does the set of failures.
// Along a pixel's list, ages rise with (depth, payload). When fragments fail, the table keeps the
// nearest ones of every pixel: cells only grow, so where a record has lost, the records behind it
// lose as well. (With culling only the visible part is unique.)

namespace strata::detail {

/// A record on its way to a cell. Its age is that of the next proposal.
template <class Record>
struct Flight {
  typename Record::Word record;
  std::uint64_t pixel;
  unsigned age;

  /// On to the next age; false if `limit` is the last.
  bool grow_older(unsigned limit) noexcept {
    if (age >= limit) return false;
    ++age;
    record = Record::with_next_age(record);
    return true;
  }
};

/// Result of a proposal.
enum class Outcome {
  kLost,          ///< the cell keeps what it has
  kPlaced,        ///< the cell was empty; nothing is in flight any more
  kEvictedOwn,    ///< in flight is now a record of the same pixel, of the same age
  kEvictedOther,  ///< in flight is now a record of another pixel, of the age that it had
};

/// Rule 3 of the law, once.
/// @param offset_of o of an age
/// @param found what the cell held before
template <class Record, class Concurrency, class OffsetOf>
inline Outcome propose(Flight<Record>& flight, typename Record::Word* table, std::uint64_t cells,
                       OffsetOf&& offset_of, typename Record::Word& found) noexcept {
  std::uint64_t cell = flight.pixel + offset_of(flight.age);
  if (cell >= cells) cell -= cells;
  found = Concurrency::fetch_max(table[cell], flight.record);
  // Equality falls through to the next age: two equal records are two fragments.
  if (!(found < flight.record)) return Outcome::kLost;
  if (found == Record::kEmpty) return Outcome::kPlaced;
  flight.record = found;
  if (Record::age(found) == flight.age) return Outcome::kEvictedOwn;
  flight.age = Record::age(found);
  // Both numbers are below `cells`, so neither branch wraps around 2^64.
  const std::uint64_t back = offset_of(flight.age);
  flight.pixel = cell >= back ? cell - back : cell + cells - back;
  return Outcome::kEvictedOther;
}

/// A hash of a raw table, cell by cell: the same bits, the same checksum.
template <class Words>
[[nodiscard]] std::uint64_t table_checksum(const Words& table) {
  std::uint64_t hash = 0x9e3779b97f4a7c15u ^ table.size();
  for (const auto word : table) {
    hash = (hash ^ word) * 0xff51afd7ed558ccdu;
    hash ^= hash >> 29;
  }
  return hash;
}

}  // namespace strata::detail
