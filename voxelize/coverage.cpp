// The sum of lengths is kept as its changes along a column of voxels, as font rasterizers keep the
// coverage of a row of pixels (R. Levien: Inside the fastest font renderer in the world, 2016): a
// solid that begins at a depth fills the rest of that voxel and all of those behind it. So each
// crossing costs the same, however long the solid is, and no interval of the finer grid is made.

#include "voxelize/coverage.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <type_traits>
#include <utility>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "voxelize/coverage.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "voxelize/open/winding_walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace strata {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Adds what changes at one crossing of each of a vector of rays: `sign` is 0 where nothing does.
HWY_INLINE void add_changes(Vec depth, VecInt sign, std::size_t u, CoverageWalker::Row& row) {
  const Lane d;
  const LaneInt di;
  const std::size_t lanes = hn::Lanes(d);
  const std::int32_t full = std::int32_t{1} << row.shift;
  const VecInt part =
      hn::BitCast(di, hn::And(depth, hn::Set(d, static_cast<std::uint32_t>(full - 1))));
  const VecInt later = hn::Mul(sign, part);
  const VecInt first = hn::Sub(hn::ShiftLeftSame(sign, row.shift), later);
  HWY_ALIGN std::uint32_t voxels[kMaxLanes];
  HWY_ALIGN std::int32_t firsts[kMaxLanes], laters[kMaxLanes];
  hn::Store(hn::ShiftRightSame(depth, row.shift), d, voxels);
  hn::Store(first, di, firsts);
  hn::Store(later, di, laters);
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    const std::size_t column = (u + lane) >> row.rays_bits, voxel = voxels[lane];
    std::int32_t* at = row.changes.data() + column * row.stride + voxel;
    at[0] += firsts[lane];
    at[1] += laters[lane];
    row.marks[column * row.words + voxel / 64] |= std::uint64_t{1} << voxel % 64;
  }
}

/// A vector of rays, the first of which is of column u.
template <InsideRule rule>
HWY_INLINE void cover_columns(const MergedLists& lists, std::size_t u, bool histogram,
                              CoverageWalker::Row& row, TileCounts& counts) {
  const Lane d;
  const LaneInt di;
  WindingWalk walk;
  Vec begin = hn::Zero(d);
  Vec least = hn::Set(d, row.least), most = hn::Set(d, row.most);
  int age = 0;
  for (; age < lists.ages; ++age) {
    const Vec record = hn::LoadU(d, lists.records[age]);
    const Mask present = hn::Ne(record, hn::Zero(d));
    if (hn::AllFalse(d, present)) break;
    Vec depth = walk.cross<rule>(record, present, histogram);
    const Mask moved = hn::Or(walk.starts, walk.ends);
    if (hn::AllFalse(d, moved)) continue;
    depth = hn::Add(depth, hn::Min(depth, hn::Set(d, 1u)));  // as upper_depth()
    const Vec there = hn::IfThenElseZero(moved, depth);
    begin = hn::IfThenElse(walk.starts, depth, begin);
    least = hn::Min(least, hn::IfThenElse(moved, depth, least));
    most = hn::Max(most, there);
    const VecInt sign =
        hn::BitCast(di, hn::Sub(hn::VecFromMask(d, walk.ends), hn::VecFromMask(d, walk.starts)));
    add_changes(there, sign, u, row);
  }
  if (age == 0) return;
  counts.max_depth = std::max<std::uint64_t>(counts.max_depth, static_cast<std::uint64_t>(age));
  row.least = hn::GetLane(hn::MinOfLanes(d, least));
  row.most = hn::GetLane(hn::MaxOfLanes(d, most));
  const auto still = inside<rule>(walk.winding);
  if (!hn::AllFalse(di, still)) {  // entered and never left: taken back
    add_changes(hn::IfThenElseZero(hn::RebindMask(d, still), begin), hn::VecFromMask(di, still), u,
                row);
  }
  walk.count(histogram, counts);
}

template <InsideRule rule>
void cover_rows(const TileLists<DepthKey>& lists, int row_begin, int row_end, bool histogram,
                CoverageWalker::Row& row, TileCounts& counts) {
  const std::size_t lanes = hn::Lanes(Lane());
  MergedLists merged;
  for (int v = std::max(row_begin, lists.row_begin); v < std::min(row_end, lists.row_end); ++v) {
    for (std::size_t u = 0; u < kTileSide; u += lanes) {
      merged.merge(lists.planes32 + static_cast<std::size_t>(v) * kTileSide + u, lists.ages);
      cover_columns<rule>(merged, u, histogram, row, counts);
    }
  }
}

void cover_key_rows(const TileLists<DepthKey>& lists, InsideRule rule, int row_begin, int row_end,
                    bool histogram, CoverageWalker::Row& row, TileCounts& counts) {
  switch (rule) {
    case InsideRule::kWinding:
      return cover_rows<InsideRule::kWinding>(lists, row_begin, row_end, histogram, row, counts);
    case InsideRule::kNonzero:
      return cover_rows<InsideRule::kNonzero>(lists, row_begin, row_end, histogram, row, counts);
    case InsideRule::kParity:
      return cover_rows<InsideRule::kParity>(lists, row_begin, row_end, histogram, row, counts);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata {
namespace {

HWY_EXPORT(cover_key_rows);

constexpr int kSide = VoxelIntervals::kTileSide;

std::size_t size(int value) { return static_cast<std::size_t>(value); }

/// Where a crossing ends up. The floor of a depth that is a whole number is the number before, by
/// the tie rule, so the ceiling is exact for planes of the lattice; and what begins before the grid
/// or ends behind it, where depths are clamped, ends up on its sides.
std::uint32_t upper_depth(std::uint32_t depth) { return depth + std::min(depth, 1u); }

/// The walk written plainly, one column at a time.
template <class Key>
void cover_column(const TileLists<Key>& lists, std::size_t pixel, InsideRule rule, bool histogram,
                  CoverageWalker::Row& row, TileCounts& counts) {
  const std::size_t u = pixel % size(kTileSide);
  int winding = 0, lowest = 0;
  std::size_t length = 0;
  std::uint32_t begin = 0;
  for_each_key(lists, pixel, [&](Key key) {
    const bool was = is_inside(rule, winding);
    winding += exit_of(key) ? -1 : 1;
    lowest = std::min(lowest, winding);
    ++length;
    const bool now = is_inside(rule, winding);
    if (was == now) return;
    const std::uint32_t depth = upper_depth(depth_of(key));
    if (now) begin = depth;
    row.change(u, depth, now ? 1 : -1);
  });
  if (is_inside(rule, winding)) row.change(u, begin, -1);
  counts.add(winding, lowest, length, histogram);
}

/// Whole voxels of the finer grid.
void cover_settled(const TileIntervals& settled, std::size_t pixel, CoverageWalker::Row& row) {
  for (std::uint32_t i = settled.offsets[pixel]; i < settled.offsets[pixel + 1]; ++i) {
    const Interval& interval = settled.items[i];
    const std::size_t u = pixel % size(kTileSide);
    row.change(u, static_cast<std::uint32_t>(interval.begin()) << kLatticeBits, 1);
    row.change(u, static_cast<std::uint32_t>(interval.end()) << kLatticeBits, -1);
  }
}

/// Rows [row_begin, row_end) of a tile. @param next  of the steps; moves on
template <class Key>
void cover_plain_rows(const TileLists<Key>& lists, InsideRule rule, int row_begin, int row_end,
                      bool histogram, std::span<const WindingStep> steps, std::size_t& next,
                      const TileIntervals& settled, CoverageWalker::Row& row, TileCounts& counts) {
  for (std::size_t pixel = size(row_begin * kTileSide); pixel < size(row_end * kTileSide);
       ++pixel) {
    const std::size_t first = next;
    while (next < steps.size() && steps[next].pixel == pixel) ++next;
    if (next == first) {
      cover_column(lists, pixel, rule, histogram, row, counts);
    } else {
      cover_settled(settled, pixel, row);
    }
  }
}

}  // namespace

CoverageWalker::CoverageWalker(int rays, int voxels) : rays_(rays) {
  row_.rays_bits = std::countr_zero(static_cast<unsigned>(rays));
  row_.shift = kLatticeBits + row_.rays_bits;
  row_.stride = size(voxels) + 2;
  row_.words = size(voxels) / 64 + 1;
  row_.changes.resize(size(kTileSide / rays) * row_.stride);
  row_.marks.resize(size(kTileSide / rays) * row_.words);
}

/// Sums up the changes of a row of voxels, and forgets them.
void CoverageWalker::emit(CoveragePiece& out) {
  const std::size_t columns = size(kTileSide / rays_);
  if (row_.least > row_.most) {
    out.ends.insert(out.ends.end(), columns, static_cast<std::uint32_t>(out.items.size()));
    return;
  }
  const std::size_t first_word = row_.least >> row_.shift >> 6;
  const std::size_t last_word =
      std::min<std::size_t>(((row_.most >> row_.shift) + 1) >> 6, row_.words - 1);
  for (std::size_t column = 0; column < columns; ++column) {
    std::int32_t* changes = row_.changes.data() + column * row_.stride;
    std::uint64_t* marks = row_.marks.data() + column * row_.words;
    std::int32_t label = 0;
    std::uint64_t carry = 0;
    for (std::size_t word = first_word; word <= last_word; ++word) {
      const std::uint64_t mark = std::exchange(marks[word], 0);
      for (std::uint64_t left = mark | mark << 1 | carry; left != 0; left &= left - 1) {
        const std::size_t voxel = word * 64 + size(std::countr_zero(left));
        const std::int32_t change = std::exchange(changes[voxel], 0);
        if (change == 0) continue;
        if (label != 0) out.items.back().last = static_cast<std::uint16_t>(voxel - 1);
        label += change;
        if (label == 0) continue;
        out.items.push_back({static_cast<std::uint16_t>(voxel), 0});
        out.labels.push_back(static_cast<std::uint32_t>(label));
      }
      carry = mark >> 63;
    }
    out.ends.push_back(static_cast<std::uint32_t>(out.items.size()));
  }
}

template <class Key>
void CoverageWalker::walk(const TileLists<Key>& lists, InsideRule rule, bool histogram,
                          std::span<const WindingStep> steps, const TileIntervals& settled,
                          TileCounts& counts, CoveragePiece& out) {
  counts.clear();
  std::size_t next = 0;
  for (int begin = 0; begin < kTileSide; begin += rays_) {
    row_.least = std::numeric_limits<std::uint32_t>::max();
    row_.most = 0;
    bool planes = false;
    if constexpr (std::is_same_v<Key, DepthKey>) {
      planes = lists.planes32 != nullptr && steps.empty();
      if (planes) {
        HWY_DYNAMIC_DISPATCH(cover_key_rows)
        (lists, rule, begin, begin + rays_, histogram, row_, counts);
      }
    }
    if (!planes) {
      cover_plain_rows(lists, rule, begin, begin + rays_, histogram, steps, next, settled, row_,
                       counts);
    }
    emit(out);
  }
}

template void CoverageWalker::walk(const TileLists<DepthKey>&, InsideRule, bool,
                                   std::span<const WindingStep>, const TileIntervals&, TileCounts&,
                                   CoveragePiece&);
template void CoverageWalker::walk(const TileLists<DepthItem>&, InsideRule, bool,
                                   std::span<const WindingStep>, const TileIntervals&, TileCounts&,
                                   CoveragePiece&);

CoverageTiles::CoverageTiles(const VoxelGrid& voxels, Axis axis, int rays, int v_begin, int v_end)
    : rays_(rays), result_(voxels, axis, v_begin / rays, v_end / rays) {
  tiles_u_ = (result_.columns() * rays + kTileSide - 1) / kTileSide;
  tiles_v_ = (v_end - v_begin + kTileSide - 1) / kTileSide;
  pieces_.resize(size(tiles_u_) * size(tiles_v_));
}

struct CoverageTiles::Worker {
  std::vector<std::uint32_t> offsets, labels;
  std::vector<Interval> items;
  std::uint64_t sum = 0;
};

void CoverageTiles::merge_tile(int tu, int tv, Worker& worker) {
  const int side = kTileSide / rays_;  // columns of a piece
  worker.offsets.assign(1, 0);
  worker.items.clear();
  worker.labels.clear();
  for (int v = 0; v < kSide; ++v) {
    for (int piece_u = 0; piece_u < rays_; ++piece_u) {
      const CoveragePiece* piece = find(tu * rays_ + piece_u, tv * rays_ + v / side);
      if (piece == nullptr) {
        worker.offsets.insert(worker.offsets.end(), size(side), worker.offsets.back());
        continue;
      }
      const std::size_t first = size(v % side * side);
      const std::uint32_t begin = first == 0 ? 0 : piece->ends[first - 1];
      const std::uint32_t end = piece->ends[first + size(side) - 1];
      const auto base = static_cast<std::uint32_t>(worker.items.size()) - begin;
      for (std::size_t i = first; i < first + size(side); ++i) {
        worker.offsets.push_back(base + piece->ends[i]);
      }
      worker.items.insert(worker.items.end(), piece->items.begin() + begin,
                          piece->items.begin() + end);
      worker.labels.insert(worker.labels.end(), piece->labels.begin() + begin,
                           piece->labels.begin() + end);
    }
  }
  if (worker.items.empty()) return;
  result_.set_tile(tu, tv, worker.offsets, worker.items, worker.labels);
  for (std::size_t i = 0; i < worker.items.size(); ++i) {
    worker.sum +=
        std::uint64_t{worker.labels[i]} * static_cast<std::uint64_t>(worker.items[i].length());
  }
}

VoxelIntervals CoverageTiles::merged(const Execution& execution, std::uint64_t& sum) {
  std::vector<Worker> workers(size(execution.thread_count()));
  parallel_for(execution, size(result_.tiles_u()) * size(result_.tiles_v()),
               [&](std::size_t index, int worker) {
                 merge_tile(static_cast<int>(index) % result_.tiles_u(),
                            static_cast<int>(index) / result_.tiles_u(), workers[size(worker)]);
               });
  for (const Worker& worker : workers) sum += worker.sum;
  pieces_.clear();
  return std::move(result_);
}

}  // namespace strata
#endif  // HWY_ONCE
