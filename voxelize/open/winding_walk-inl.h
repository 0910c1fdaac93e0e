// Winding numbers of a vector of rays, from crossing to crossing. Compiled once for each SIMD
// target (Highway's dynamic dispatch).

#if defined(STRATA_WINDING_WALK_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef STRATA_WINDING_WALK_INL_H
#undef STRATA_WINDING_WALK_INL_H
#else
#define STRATA_WINDING_WALK_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>

#include "hashbuffer/tile_builder.h"
#include "strata/core/inside_rule.h"
#include "strata/raster/raster_target.h"
#include "voxelize/open/tile_counts.h"

HWY_BEFORE_NAMESPACE();
namespace strata {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Lane = hn::ScalableTag<std::uint32_t>;
using LaneInt = hn::RebindToSigned<Lane>;
using Vec = hn::Vec<Lane>;
using VecInt = hn::Vec<LaneInt>;
using Mask = hn::Mask<Lane>;
constexpr std::size_t kMaxLanes = HWY_MAX_BYTES / 4;

template <InsideRule rule>
HWY_INLINE hn::Mask<LaneInt> inside(VecInt winding) {
  const LaneInt di;
  if constexpr (rule == InsideRule::kWinding) return hn::Gt(winding, hn::Zero(di));
  if constexpr (rule == InsideRule::kNonzero) return hn::Ne(winding, hn::Zero(di));
  return hn::TestBit(winding, hn::Set(di, 1));
}

/// The lists of a vector of rays, the first of which is that of `cell` in planes of keys, as one:
/// the crossings where rays enter and those where they leave. Ages are left out.
struct MergedLists {
  std::uint32_t records[kMaxPlanes][kMaxLanes];
  int ages = 0;  ///< no list is longer

  HWY_INLINE void merge(const std::uint32_t* cell, int most) {
    const Lane d;
    const Vec zero = hn::Zero(d);
    ages = 0;
    const auto for_each = [&](std::size_t side, const auto& body) {
      for (int age = 0; age < most; ++age) {
        const Vec record =
            hn::LoadU(d, cell + side + static_cast<std::size_t>(age) * 2 * kTilePixels);
        const Mask present = hn::Ne(record, zero);
        if (hn::AllFalse(d, present)) return;
        const Vec value = hn::Or(hn::And(record, hn::Set(d, 0xffffffu)), hn::Set(d, 1u << 24));
        body(hn::IfThenElseZero(present, value));
      }
    };
    for_each(0, [&](Vec record) { hn::StoreU(record, d, records[ages++]); });
    for_each(kTilePixels, [&](Vec carry) {
      for (int age = 0; age < ages; ++age) {  // the larger stays, the smaller goes on
        const Vec old = hn::LoadU(d, records[age]);
        hn::StoreU(hn::Max(old, carry), d, records[age]);
        carry = hn::Min(old, carry);
      }
      hn::StoreU(carry, d, records[ages++]);
    });
  }
};

/// The state of a vector of rays behind their crossings so far.
struct WindingWalk {
  VecInt winding, lowest;
  Vec length;         // of the lists; counted for a histogram alone
  Mask starts, ends;  // where a solid begins or ends at the crossing

  HWY_INLINE WindingWalk()
      : winding(hn::Zero(LaneInt())), lowest(hn::Zero(LaneInt())), length(hn::Zero(Lane())) {}

  /// Goes on to a crossing. @param present  where a ray has one @return its depth
  template <InsideRule rule>
  HWY_INLINE Vec cross(Vec record, Mask present, bool histogram) {
    const Lane d;
    const LaneInt di;
    const Vec key = hn::AndNot(record, hn::Set(d, 0xffffffu));
    const Vec exit = hn::And(key, hn::Set(d, 1u));
    // +1 on entering, -1 on leaving, 0 where the list has ended.
    const VecInt change =
        hn::BitCast(di, hn::IfThenElseZero(present, hn::Sub(hn::Set(d, 1u), hn::Add(exit, exit))));
    const auto was = inside<rule>(winding);
    winding = hn::Add(winding, change);
    lowest = hn::Min(lowest, winding);
    const auto now = inside<rule>(winding);
    starts = hn::RebindMask(d, hn::AndNot(was, now));
    ends = hn::RebindMask(d, hn::AndNot(now, was));
    if (histogram) length = hn::Sub(length, hn::VecFromMask(d, present));
    return hn::ShiftRight<1>(key);
  }

  /// What the report counts of the rays.
  HWY_INLINE void count(bool histogram, TileCounts& out) const {
    const Lane d;
    const LaneInt di;
    const std::size_t lanes = hn::Lanes(d);
    // Rays whose winding number is not 0 again, or was negative, are rare.
    const auto unbalanced = hn::Ne(winding, hn::Zero(di));
    const auto negative = hn::Lt(lowest, hn::Zero(di));
    if (!hn::AllFalse(di, hn::Or(unbalanced, negative))) {
      std::int32_t windings[kMaxLanes];
      hn::StoreU(winding, di, windings);
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        if (windings[lane] != 0) ++out.unbalanced;
      }
      out.negative += hn::CountTrue(di, negative);
    }
    if (!histogram) return;
    std::uint32_t depths[kMaxLanes];
    hn::StoreU(length, d, depths);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      if (depths[lane] > 0) ++out.histogram[std::min<std::uint32_t>(depths[lane], 64)];
    }
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#endif  // STRATA_WINDING_WALK_INL_H
