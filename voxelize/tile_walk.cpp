#include "voxelize/tile_walk.h"

#include <algorithm>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "voxelize/tile_walk.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/lanes-inl.h"
#include "strata/hashbuffer/tile_lists.h"
#include "strata/raster/lattice_mesh.h"
#include "voxelize/open/winding_walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace strata {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Finished intervals of a vector of columns, in the order in which the walk meets them; there is
/// none at the first crossing, and at most one at each other and behind the last.
struct Finished {
  std::uint32_t packed[kMaxPlanes][kMaxLanes];  // [last:16 | first:16], an Interval's bytes
  std::uint32_t marks[kMaxPlanes][kMaxLanes];   // 1 where packed holds an interval
  std::size_t rounds = 0;

  HWY_INLINE void add(Mask where, Vec begin, Vec end) {
    const Lane d;
    hn::StoreU(hn::Or(begin, hn::ShiftLeft<16>(hn::Sub(end, hn::Set(d, 1)))), d, packed[rounds]);
    hn::StoreU(hn::IfThenElseZero(where, hn::Set(d, 1)), d, marks[rounds]);
    ++rounds;
  }
};

/// Walks the lists of a vector of columns. @return the length of the longest list
template <InsideRule rule>
HWY_INLINE int walk_columns(const MergedLists& lists, bool histogram, Finished& finished,
                            WindingWalk& walk) {
  const Lane d;
  Vec begin = hn::Zero(d);  // of the interval being walked
  Vec pending_begin = hn::Zero(d),
      pending_end = hn::Zero(d);  // the last one, not yet handed out
  int age = 0;
  for (; age < lists.ages; ++age) {
    const Vec record = hn::LoadU(d, lists.records[age]);
    const Mask present = hn::Ne(record, hn::Zero(d));
    if (hn::AllFalse(d, present)) break;
    const Vec voxel =
        hn::ShiftRight<kLatticeBits>(hn::Add(walk.cross<rule>(record, present, histogram),
                                             hn::Set(d, std::uint32_t{kLatticeSteps / 2})));
    const Mask starts = walk.starts;
    if (!hn::AllFalse(d, starts)) {
      // A start on the end of the last interval carries that one on.
      const Mask has_pending = hn::Gt(pending_end, pending_begin);
      const Mask joins = hn::And(has_pending, hn::Eq(voxel, pending_end));
      const Mask hand_out = hn::And(starts, hn::AndNot(joins, has_pending));
      if (!hn::AllFalse(d, hand_out)) finished.add(hand_out, pending_begin, pending_end);
      begin = hn::IfThenElse(starts, hn::IfThenElse(joins, pending_begin, voxel), begin);
      pending_end = hn::IfThenElse(hand_out, pending_begin, pending_end);
    }
    const Mask closes = hn::And(walk.ends, hn::Gt(voxel, begin));
    pending_begin = hn::IfThenElse(closes, begin, pending_begin);
    pending_end = hn::IfThenElse(closes, voxel, pending_end);
  }
  if (age == 0) return 0;
  const Mask has_pending = hn::Gt(pending_end, pending_begin);
  if (!hn::AllFalse(d, has_pending)) finished.add(has_pending, pending_begin, pending_end);
  return age;
}

/// Room for `more` intervals behind the first `count`.
HWY_INLINE std::uint32_t* room_for(std::size_t more, std::uint32_t count, TileIntervals& out) {
  if (out.items.size() < count + more) out.items.resize((count + more) * 2);
  return reinterpret_cast<std::uint32_t*>(out.items.data()) + count;
}

/// Hands out at most one interval a column, where `marked`. @return their number, with the `count`
/// that were there
HWY_INLINE std::uint32_t hand_out_ones(Vec packed, Mask marked, std::size_t pixel,
                                       std::uint32_t count, TileIntervals& out) {
  const Lane d;
  const std::size_t lanes = hn::Lanes(d);
  std::uint32_t* const items = room_for(lanes, count, out);
  std::uint32_t* const offsets = out.offsets.data() + pixel;
  if (hn::AllTrue(d, marked)) {
    hn::StoreU(packed, d, items);
    hn::StoreU(count_from(d, count), d, offsets);
    return count + static_cast<std::uint32_t>(lanes);
  }
  // A whole vector is stored: to store a compressed part takes some processors 100 cycles.
  hn::StoreU(hn::Compress(packed, marked), d, items);
  std::uint32_t marks[kMaxLanes];
  hn::StoreU(hn::IfThenElseZero(marked, hn::Set(d, 1)), d, marks);
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    offsets[lane] = count;
    count += marks[lane];
  }
  return count;
}

/// The first voxel behind the crossing in a record.
HWY_INLINE Vec voxel_of(Vec record) {
  const Lane d;
  const Vec key = hn::AndNot(record, hn::Set(d, 0xffffffu));
  const Vec depth = hn::ShiftRight<1>(key);
  return hn::ShiftRight<kLatticeBits>(hn::Add(depth, hn::Set(d, std::uint32_t{kLatticeSteps / 2})));
}

/// Where a record is behind the next one, both of one age. Records of the planes that walk_pairs()
/// and walk_two_pairs() look at, and those of no age, are positive numbers.
HWY_INLINE Mask not_in_turn(Vec record, Vec next) {
  const LaneInt di;
  return hn::RebindMask(Lane(), hn::Gt(hn::BitCast(di, next), hn::BitCast(di, record)));
}

/// Walks columns none of which has more than one crossing that enters and then one that leaves, as
/// most have. The inside rules agree on those. @return false, and nothing done, if there are others
HWY_INLINE bool walk_pairs(const std::uint32_t* cell, int ages, bool histogram, std::size_t pixel,
                           std::uint32_t& count, TileIntervals& out) {
  const Lane d;
  const Vec zero = hn::Zero(d), one = hn::Set(d, 1);
  const auto plane = [&](std::size_t i) { return hn::LoadU(d, cell + i * kTilePixels); };
  const Vec enter = plane(0), leave = plane(1);
  const Vec further = ages > 1 ? hn::Or(plane(2), plane(3)) : zero;
  const Mask present = hn::Ne(enter, zero);
  if (hn::AllFalse(d, hn::Ne(hn::Or(enter, leave), zero))) {
    hn::StoreU(hn::Set(d, count), d, out.offsets.data() + pixel);
    return true;
  }
  const Mask unpaired = hn::Or(not_in_turn(enter, leave), hn::Xor(present, hn::Ne(leave, zero)));
  if (!hn::AllFalse(d, hn::Or(hn::Ne(further, zero), unpaired))) return false;
  const Vec begin = voxel_of(enter), end = voxel_of(leave);
  // Absent records count as equally deep.
  count = hand_out_ones(hn::Or(begin, hn::ShiftLeft<16>(hn::Sub(end, one))), hn::Gt(end, begin),
                        pixel, count, out);
  out.counts.max_depth = std::max<std::uint64_t>(out.counts.max_depth, 2);
  if (histogram) out.counts.histogram[2] += hn::CountTrue(d, present);
  return true;
}

/// Walks columns none of which has more than two pairs of crossings, one that enters and then one
/// that leaves. @return false, and nothing done, if there are others, or intervals that touch
HWY_INLINE bool walk_two_pairs(const std::uint32_t* cell, int ages, bool histogram,
                               std::size_t pixel, std::uint32_t& count, TileIntervals& out) {
  const Lane d;
  const std::size_t lanes = hn::Lanes(d);
  const Vec zero = hn::Zero(d), one = hn::Set(d, 1);
  if (ages < 2) return false;
  const auto plane = [&](std::size_t i) { return hn::LoadU(d, cell + i * kTilePixels); };
  const Vec enter = plane(0), leave = plane(1), enter2 = plane(2), leave2 = plane(3);
  const Vec further = ages > 2 ? hn::Or(plane(4), plane(5)) : zero;
  const auto any = [&](Vec bits) { return hn::Ne(bits, zero); };
  const auto unpaired = [&](Vec in, Vec from) {
    return hn::Or(not_in_turn(in, from), hn::Xor(any(in), any(from)));
  };
  // Where there is no second one, it becomes negative, and is in turn.
  const Mask meets = not_in_turn(leave, hn::Sub(enter2, hn::Set(d, Record32::kAgeUnit)));
  const Mask other = hn::Or(any(further), meets);
  if (!hn::AllFalse(d, hn::Or(other, hn::Or(unpaired(enter, leave), unpaired(enter2, leave2))))) {
    return false;
  }
  const Vec begin = voxel_of(enter), end = voxel_of(leave);
  const Vec begin2 = voxel_of(enter2), end2 = voxel_of(leave2);
  const Mask marked = hn::Gt(end, begin), marked2 = hn::Gt(end2, begin2);
  if (!hn::AllFalse(d, hn::And(hn::And(marked, marked2), hn::Eq(end, begin2)))) return false;
  std::uint32_t packed[2 * kMaxLanes], marks[2 * kMaxLanes];
  hn::StoreInterleaved2(hn::Or(begin, hn::ShiftLeft<16>(hn::Sub(end, one))),
                        hn::Or(begin2, hn::ShiftLeft<16>(hn::Sub(end2, one))), d, packed);
  hn::StoreInterleaved2(hn::IfThenElseZero(marked, one), hn::IfThenElseZero(marked2, one), d,
                        marks);
  std::uint32_t* items = room_for(3 * lanes, count, out);
  for (std::size_t half = 0; half < 2 * lanes; half += lanes) {
    const Mask some = any(hn::LoadU(d, marks + half));
    hn::StoreU(hn::Compress(hn::LoadU(d, packed + half), some), d, items);
    items += hn::CountTrue(d, some);
  }
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    out.offsets[pixel + lane] = count;
    count += marks[2 * lane] + marks[2 * lane + 1];
  }
  const std::size_t deep = hn::CountTrue(d, any(enter2));
  out.counts.max_depth = std::max<std::uint64_t>(out.counts.max_depth, deep > 0 ? 4 : 2);
  if (histogram) {
    out.counts.histogram[4] += deep;
    out.counts.histogram[2] += hn::CountTrue(d, any(enter)) - deep;
  }
  return true;
}

/// Hands intervals out column by column. @return their number, with the `count` that were there
HWY_INLINE std::uint32_t hand_out_columns(const Finished& finished, std::size_t pixel,
                                          std::uint32_t count, TileIntervals& out) {
  const Lane d;
  const std::size_t lanes = hn::Lanes(d);
  if (finished.rounds == 1) {
    const Vec marks = hn::LoadU(d, finished.marks[0]);
    return hand_out_ones(hn::LoadU(d, finished.packed[0]), hn::Ne(marks, hn::Zero(d)), pixel, count,
                         out);
  }
  std::uint32_t* items = room_for((finished.rounds + 1) * lanes, count, out);
  Vec sum = hn::Zero(d);
  for (std::size_t round = 0; round < finished.rounds; ++round) {
    sum = hn::Add(sum, hn::LoadU(d, finished.marks[round]));
  }
  std::uint32_t counts[kMaxLanes];
  hn::StoreU(sum, d, counts);
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    out.offsets[pixel + lane] = count;
    if (counts[lane] == 0) continue;
    for (std::size_t round = 0; round < finished.rounds; ++round) {
      *items = finished.packed[round][lane];
      items += finished.marks[round][lane];
      count += finished.marks[round][lane];
    }
  }
  return count;
}

template <InsideRule rule>
void walk_planes(const TileLists<DepthKey>& lists, bool histogram, TileIntervals& out) {
  const std::size_t lanes = hn::Lanes(Lane());
  std::uint32_t count = 0;
  Finished finished;
  MergedLists merged;
  for (int row = lists.row_begin; row < lists.row_end; ++row) {
    for (std::size_t u = 0; u < kTileSide; u += lanes) {
      const std::size_t pixel = static_cast<std::size_t>(row) * kTileSide + u;
      const std::uint32_t* const cell = lists.planes32 + pixel;
      if (walk_pairs(cell, lists.ages, histogram, pixel, count, out)) continue;
      if (walk_two_pairs(cell, lists.ages, histogram, pixel, count, out)) continue;
      WindingWalk walk;
      finished.rounds = 0;
      merged.merge(cell, lists.ages);
      const int age = walk_columns<rule>(merged, histogram, finished, walk);
      out.counts.max_depth =
          std::max<std::uint64_t>(out.counts.max_depth, static_cast<std::uint64_t>(age));
      walk.count(histogram, out.counts);
      count = hand_out_columns(finished, pixel, count, out);
    }
  }
  const std::size_t end = static_cast<std::size_t>(lists.row_end) * kTileSide;
  std::fill(out.offsets.begin() + static_cast<std::ptrdiff_t>(end), out.offsets.end(), count);
}

void walk_key_planes(const TileLists<DepthKey>& lists, InsideRule rule, bool histogram,
                     TileIntervals& out) {
  switch (rule) {
    case InsideRule::kWinding:
      return walk_planes<InsideRule::kWinding>(lists, histogram, out);
    case InsideRule::kNonzero:
      return walk_planes<InsideRule::kNonzero>(lists, histogram, out);
    case InsideRule::kParity:
      return walk_planes<InsideRule::kParity>(lists, histogram, out);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata {
namespace {

HWY_EXPORT(walk_key_planes);

/// The walk written plainly, one column at a time: for the form of lists that is not planar, and
/// the yardstick of the other.
template <class Key>
void walk_column(std::span<const Key> list, InsideRule rule, bool histogram, TileIntervals& out) {
  const std::size_t first = out.items.size();
  int winding = 0, lowest = 0;
  std::uint32_t begin = 0;
  for (const Key key : list) {
    const bool was = is_inside(rule, winding);
    winding += exit_of(key) ? -1 : 1;
    lowest = std::min(lowest, winding);
    const bool now = is_inside(rule, winding);
    const std::uint32_t voxel = (depth_of(key) + kLatticeSteps / 2) >> kLatticeBits;
    if (now && !was) begin = voxel;
    if (was && !now && voxel > begin) {
      if (out.items.size() > first && static_cast<std::uint32_t>(out.items.back().end()) == begin) {
        out.items.back().last = static_cast<std::uint16_t>(voxel - 1);
      } else {
        out.items.push_back(
            {static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(voxel - 1)});
      }
    }
  }
  out.counts.add(winding, lowest, list.size(), histogram);
}

template <class Key>
void walk_rows(const TileLists<Key>& lists, InsideRule rule, bool histogram, TileIntervals& out) {
  out.items.clear();
  std::vector<Key> list;
  for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
    out.offsets[pixel] = static_cast<std::uint32_t>(out.items.size());
    if constexpr (std::is_same_v<Key, DepthItem>) {
      if (lists.planes64 != nullptr) {
        const int row = static_cast<int>(pixel / kTileSide);
        if (row < lists.row_begin || row >= lists.row_end) continue;
        list.clear();
        for (std::size_t age = 0; age < static_cast<std::size_t>(lists.ages); ++age) {
          const std::uint64_t record = lists.planes64[age * kTilePixels + pixel];
          if (record == 0) break;
          list.push_back(tile_key<Record64>(record));
        }
        walk_column(std::span<const Key>(list), rule, histogram, out);
        continue;
      }
    }
    walk_column(std::span<const Key>(lists.keys + lists.offsets[pixel],
                                     lists.keys + lists.offsets[pixel + 1]),
                rule, histogram, out);
  }
  out.offsets[kTilePixels] = static_cast<std::uint32_t>(out.items.size());
}

void begin_walk(TileIntervals& out) {
  out.offsets.resize(kTilePixels + 1);
  out.labels.clear();
  out.counts.clear();
}

}  // namespace

void walk_tile(const TileLists<DepthKey>& lists, InsideRule rule, bool histogram,
               TileIntervals& out) {
  begin_walk(out);
  if (lists.planes32 == nullptr) return walk_rows(lists, rule, histogram, out);
  std::fill_n(out.offsets.begin(), static_cast<std::ptrdiff_t>(lists.row_begin) * kTileSide, 0u);
  HWY_DYNAMIC_DISPATCH(walk_key_planes)(lists, rule, histogram, out);
}

void walk_tile(const TileLists<DepthItem>& lists, InsideRule rule, bool histogram,
               TileIntervals& out) {
  begin_walk(out);
  walk_rows(lists, rule, histogram, out);
}

void walk_labelled_tile(const TileLists<DepthItem>& lists, bool histogram, TileIntervals& out) {
  begin_walk(out);
  out.items.clear();
  for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
    const std::size_t first = out.items.size();
    out.offsets[pixel] = static_cast<std::uint32_t>(first);
    std::uint32_t label = 0, begin = 0;
    std::size_t length = 0;  // crossings of the set's own surface
    for_each_item(lists, pixel, [&](DepthItem item) {
      const std::uint32_t next = item.exit() ? 0 : item.triangle();
      const std::uint32_t voxel = (item.depth() + kLatticeSteps / 2) >> kLatticeBits;
      if ((next == 0) != (label == 0)) ++length;
      if (label != 0 && voxel > begin) {
        const auto last = static_cast<std::uint16_t>(voxel - 1);
        if (out.items.size() > first && out.labels.back() == label &&
            static_cast<std::uint32_t>(out.items.back().end()) == begin) {
          out.items.back().last = last;
        } else {
          out.items.push_back({static_cast<std::uint16_t>(begin), last});
          out.labels.push_back(label);
        }
      }
      label = next;
      begin = voxel;
    });
    out.counts.add(label != 0 ? 1 : 0, 0, length, histogram);
  }
  out.offsets[kTilePixels] = static_cast<std::uint32_t>(out.items.size());
}

template <class Key>
void add_winding_steps(const TileLists<Key>& lists, InsideRule rule,
                       std::span<const WindingStep> steps, TileIntervals& out) {
  std::vector<Interval> items;
  std::vector<std::pair<int, int>> changes;  // by the first voxel beyond them
  std::size_t next = 0;
  std::uint32_t begin = 0;  // of the column in what was there
  for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
    const std::uint32_t end = out.offsets[pixel + 1];
    out.offsets[pixel] = static_cast<std::uint32_t>(items.size());
    if (next == steps.size() || steps[next].pixel != pixel) {
      items.insert(items.end(), out.items.begin() + begin, out.items.begin() + end);
      begin = end;
      continue;
    }
    begin = end;
    changes.clear();
    for_each_key(lists, pixel, [&](Key key) {
      changes.emplace_back((depth_of(key) + kLatticeSteps / 2) >> kLatticeBits,
                           exit_of(key) ? -1 : 1);
    });
    for (; next < steps.size() && steps[next].pixel == pixel; ++next) {
      changes.emplace_back(steps[next].voxel, steps[next].change);
    }
    std::sort(changes.begin(), changes.end());
    int winding = 0, first = 0;
    for (std::size_t i = 0; i < changes.size();) {
      const bool was = is_inside(rule, winding);
      const int voxel = changes[i].first;
      for (; i < changes.size() && changes[i].first == voxel; ++i) winding += changes[i].second;
      const bool now = is_inside(rule, winding);
      if (now && !was) first = voxel;
      if (was && !now) {
        items.push_back({static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(voxel - 1)});
      }
    }
  }
  out.offsets[kTilePixels] = static_cast<std::uint32_t>(items.size());
  out.items = std::move(items);
}

template void add_winding_steps<DepthKey>(const TileLists<DepthKey>&, InsideRule,
                                          std::span<const WindingStep>, TileIntervals&);
template void add_winding_steps<DepthItem>(const TileLists<DepthItem>&, InsideRule,
                                           std::span<const WindingStep>, TileIntervals&);

}  // namespace strata
#endif  // HWY_ONCE
