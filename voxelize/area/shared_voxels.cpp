#include "voxelize/area/shared_voxels.h"

#include <algorithm>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "voxelize/area/shared_voxels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/lanes-inl.h"
#include "strata/raster/raster_target.h"

HWY_BEFORE_NAMESPACE();
namespace strata {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// A lane a column.
using Lane = hn::CappedTag<std::int32_t, kTileSide>;
using Vec = hn::Vec<Lane>;

/// A row of a tile: the first intervals of all columns, then the second ones, and so on.
class PlaneRow {
 public:
  static constexpr int kMostPlanes = 4;

  void set(const ColumnRow& row) {
    row_ = row;
    planes_ = 0;
    if (row.offsets == nullptr || row.offsets[0] == row.offsets[kTileSide]) return;
    const Lane d;
    const hn::RebindToUnsigned<Lane> du;
    open_plane();
    for (int u = 0; u < kTileSide; u += static_cast<int>(hn::Lanes(d))) {
      const std::uint32_t first = row.offsets[u];
      const auto ends = hn::LoadU(du, row.offsets + u + 1);
      // Most columns have one interval.
      const auto ones = count_from(du, first + 1);
      if (hn::AllTrue(du, hn::Eq(ends, ones))) {
        const auto words = hn::LoadU(du, row.intervals + first);
        hn::Store(hn::BitCast(d, hn::And(words, hn::Set(du, 0xffff))), d, begin_[0] + u);
        hn::Store(hn::BitCast(d, hn::Add(hn::ShiftRight<16>(words), hn::Set(du, 1))), d,
                  end_[0] + u);
      } else if (!hn::AllTrue(du, hn::Eq(ends, hn::Set(du, first)))) {
        for (std::size_t i = 0; i < hn::Lanes(d); ++i) add_column(u + static_cast<int>(i));
      }
    }
  }

  [[nodiscard]] bool empty() const { return planes_ == 0; }
  [[nodiscard]] bool deep() const { return planes_ > kMostPlanes; }
  [[nodiscard]] std::span<const std::uint32_t> column(int u) const {
    return {row_.intervals + row_.offsets[u], row_.offsets[u + 1] - row_.offsets[u]};
  }

  /// Adds, a column a lane, what column u of this row shares with column u + `shift` of the other.
  /// @pre neither is deep
  HWY_INLINE void add_shared(const PlaneRow& other, int shift, Vec& sum) const {
    const Lane d;
    for (int mine = 0; mine < planes_; ++mine) {
      for (int theirs = 0; theirs < other.planes_; ++theirs) {
        for (int u = 0; u < kTileSide; u += static_cast<int>(hn::Lanes(d))) {
          const Vec begin = hn::Max(hn::Load(d, begin_[mine] + u),
                                    hn::LoadU(d, other.begin_[theirs] + u + shift));
          const Vec end =
              hn::Min(hn::Load(d, end_[mine] + u), hn::LoadU(d, other.end_[theirs] + u + shift));
          sum = hn::Add(sum, hn::Max(hn::Sub(end, begin), hn::Zero(d)));
        }
      }
    }
  }

 private:
  void open_plane() {
    if (planes_ < kMostPlanes) {
      std::fill_n(begin_[planes_], kTileSide + 1, 0);
      std::fill_n(end_[planes_], kTileSide + 1, 0);
    }
    ++planes_;
  }
  void add_column(int u) {
    int plane = 0;
    for (const std::uint32_t interval : column(u)) {
      if (plane == planes_) open_plane();
      if (plane == kMostPlanes) return;
      begin_[plane][u] = static_cast<std::int32_t>(interval & 0xffff);
      end_[plane][u] = static_cast<std::int32_t>(interval >> 16) + 1;
      ++plane;
    }
  }

  // The column behind the last one is empty.
  static constexpr int kRoom = kTileSide + static_cast<int>(HWY_MAX_BYTES / 4);
  ColumnRow row_;
  int planes_ = 0;  ///< the most intervals of a column; more than kMostPlanes are not laid out
  alignas(HWY_MAX_BYTES) std::int32_t begin_[kMostPlanes][kRoom];
  alignas(HWY_MAX_BYTES) std::int32_t end_[kMostPlanes][kRoom];
};

NeighbourVoxels tile_neighbours(const ColumnRow& tile, const ColumnRow& above) {
  NeighbourVoxels result;
  const Lane d;
  Vec along_u = hn::Zero(d), along_v = hn::Zero(d);  // below 2^6 rows of 2^6 columns of 2^16
  PlaneRow rows[2];
  rows[1].set(above);
  for (int v = 0; v < kTileSide; ++v) {
    PlaneRow& row = rows[v % 2];
    const PlaneRow& before = rows[1 - v % 2];
    row.set({tile.offsets + v * kTileSide, tile.intervals});
    if (row.deep() || before.deep()) {
      for (int u = 0; !row.empty() && u < kTileSide; ++u) {
        if (u + 1 < kTileSide) result.u += shared_voxels(row.column(u), row.column(u + 1));
        if (!before.empty()) result.v += shared_voxels(row.column(u), before.column(u));
      }
    } else {
      row.add_shared(row, 1, along_u);
      row.add_shared(before, 0, along_v);
    }
  }
  result.u += static_cast<std::uint32_t>(hn::GetLane(hn::SumOfLanes(d, along_u)));
  result.v += static_cast<std::uint32_t>(hn::GetLane(hn::SumOfLanes(d, along_v)));
  return result;
}

}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata {

HWY_EXPORT(tile_neighbours);

std::uint64_t shared_voxels(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    const std::uint32_t first = std::max(a[i] & 0xffff, b[j] & 0xffff);
    const std::uint32_t last_a = a[i] >> 16, last_b = b[j] >> 16;
    const std::uint32_t end = std::min(last_a, last_b) + 1;
    if (end > first) sum += end - first;
    if (last_a < last_b) {
      ++i;
    } else {
      ++j;
    }
  }
  return sum;
}

NeighbourVoxels neighbour_voxels(const ColumnRow& tile, const ColumnRow& above) {
  return HWY_DYNAMIC_DISPATCH(tile_neighbours)(tile, above);
}

}  // namespace strata
#endif  // HWY_ONCE
