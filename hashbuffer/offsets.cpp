#include "strata/hashbuffer/offsets.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <limits>

#include "hashbuffer/random.h"

namespace strata {
namespace {

/// A set of numbers, of which it is known how many there will be at most.
class SmallSet {
 public:
  explicit SmallSet(std::size_t most) : slots_(std::bit_ceil(4 * most + 4), kFree) {}
  /// @return whether it was not there yet
  bool insert(std::uint64_t number) {
    std::size_t slot = number * 0x9e3779b97f4a7c15u >> 32;
    for (;; ++slot) {
      std::uint64_t& at = slots_[slot & (slots_.size() - 1)];
      if (at == number) return false;
      if (at != kFree) continue;
      at = number;
      return true;
    }
  }

 private:
  static constexpr std::uint64_t kFree = std::numeric_limits<std::uint64_t>::max();
  std::vector<std::uint64_t> slots_;
};

void append_random(const OffsetRequest& request, std::size_t count,
                   std::vector<std::uint64_t>& offsets) {
  Random random(request.seed);
  SmallSet used(count);
  for (std::size_t i = 1; i < offsets.size(); ++i) used.insert(offsets[i]);
  while (offsets.size() < count + 1) {
    const std::uint64_t offset = random.below(request.cells);
    if (used.insert(offset)) offsets.push_back(offset);
  }
}

/// One cell of each of `count` equal stretches of the table, or all cells of a small table.
std::vector<std::uint64_t> candidates_of(const OffsetRequest& request, std::uint64_t count,
                                         Random& random) {
  count = std::min(count, request.cells);
  std::vector<std::uint64_t> candidates(count);
  const std::uint64_t stretch = request.cells / count;
  for (std::uint64_t i = 0; i < count; ++i) {
    candidates[i] = i * stretch + random.below(stretch);
  }
  // A table a little larger than the number of stretches has cells beyond the last one; give the
  // last candidate a chance to reach them.
  candidates.back() += random.below(request.cells - candidates.back());
  return candidates;
}

std::uint64_t square_of_distance(std::uint64_t a, std::uint64_t b, std::uint64_t period) {
  const std::uint64_t straight = a > b ? a - b : b - a;
  const std::uint64_t shorter = std::min(straight, period - std::min(straight, period));
  return shorter * shorter;
}

void append_farthest(const OffsetRequest& request, std::size_t count,
                     std::vector<std::uint64_t>& offsets) {
  Random random(request.seed);
  const std::vector<std::uint64_t> candidates =
      candidates_of(request, std::max<std::uint64_t>(4096, 4 * std::uint64_t{count}), random);
  const std::uint64_t rows = (request.cells + request.width - 1) / request.width;
  std::vector<std::uint64_t> columns(candidates.size()), rows_of(candidates.size());
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    columns[i] = candidates[i] % request.width;
    rows_of[i] = candidates[i] / request.width;
  }
  std::vector<std::uint64_t> to_nearest(candidates.size(),
                                        std::numeric_limits<std::uint64_t>::max());
  std::size_t chosen = random.below(candidates.size());
  while (true) {
    offsets.push_back(candidates[chosen]);
    if (offsets.size() == count + 1) return;
    // A chosen candidate is at distance 0 of itself, so none is taken twice while others are left.
    std::size_t farthest = 0;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const std::uint64_t square = square_of_distance(columns[i], columns[chosen], request.width) +
                                   square_of_distance(rows_of[i], rows_of[chosen], rows);
      to_nearest[i] = std::min(to_nearest[i], square);
      if (to_nearest[i] > to_nearest[farthest]) farthest = i;
    }
    chosen = farthest;
  }
}

}  // namespace

std::vector<std::uint64_t> make_offsets(OffsetKind kind, const OffsetRequest& request) {
  const std::size_t count = std::min<std::uint64_t>(request.ages, request.cells);
  std::vector<std::uint64_t> offsets;
  offsets.reserve(count + 1);
  offsets.push_back(0);
  if (count == 0) return offsets;
  switch (kind) {
    case OffsetKind::kRandom:
      append_random(request, count, offsets);
      break;
    case OffsetKind::kFarthestPoint:
      append_farthest(request, count, offsets);
      break;
    case OffsetKind::kPlaneFirst:
      for (std::uint64_t plane = 0; offsets.size() < count + 1; ++plane) {
        if ((plane + 1) * request.pixels > request.cells) break;
        offsets.push_back(plane * request.pixels);
      }
      append_random(request, count, offsets);
      break;
  }
  return offsets;
}

}  // namespace strata
