#include "voxelize/distance/tile_distance.h"

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "voxelize/distance/tile_distance.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/lanes-inl.h"
#include "voxelize/distance/triangle_frame.h"

// The distance of a point to a triangle is found from forms that are affine in the point: its
// height above the plane, its distance to each edge's line within the plane, outward, and its place
// along each edge. Rows of voxels along z are clipped by bounds on those forms before they are
// walked. Forms are set up in double from exact integers, relative to the middle of the tile, so
// that float holds them to about 1e-6 voxel.

#ifndef STRATA_VOXELIZE_DISTANCE_FORMS
#define STRATA_VOXELIZE_DISTANCE_FORMS
namespace strata {
namespace {

constexpr int kMiddle = DistanceTile::kSide / 2;  // the voxel that forms are relative to
constexpr int kForms = 7;                         // height; beside edges 0..2; along edges 0..2
constexpr int kBounds = 5;                        // height from above and below; beside edges
constexpr double kMargin = 1e-3;                  // of the band, far above rounding

/// Where a form lets a row go on: z <= (limit - form) / slope, or >= for a falling form.
struct RowBound {
  float inverse = 0.0f;              // of the slope; 0 where the form hardly changes along z
  float raise = 0.0f, lower = 0.0f;  // infinite where there is no bound above or below
  float flat = 0.0f;                 // the form may not exceed this
};

/// Forms of a triangle for a tile: constant + x slope[0] + y slope[1] + z slope[2], where (x, y, z)
/// are voxels relative to kMiddle.
struct TriangleForms {
  float constant[kForms];
  float slope[3][kForms];
  float before[3], beyond[3];  // along edge i: before - form, form + beyond are > 0 outside it
  RowBound bounds[kBounds];
  glm::ivec3 low, high;  // voxels of the tile that the band may reach, inclusive

  bool set(const glm::ivec3* corners, const DistanceTile& tile);

 private:
  bool set_box(const glm::ivec3* corners, const DistanceTile& tile);
  bool set_bounds(const DistanceTile& tile);
  void put(int form, double value, const glm::dvec3& direction, const glm::dvec3& scale) {
    constant[form] = static_cast<float>(value);
    for (int axis = 0; axis < 3; ++axis) {
      slope[axis][form] = static_cast<float>(direction[axis] * scale[axis]);
    }
  }
};

constexpr double kGreatestReach = 1 << 22;

/// std::ceil is a call where the machine's least common part has no instruction for it.
int next_whole(double value) {
  const int whole = static_cast<int>(value);
  return whole + (whole < value ? 1 : 0);
}

bool TriangleForms::set_box(const glm::ivec3* corners, const DistanceTile& tile) {
  for (int axis = 0; axis < 3; ++axis) {
    const int least = std::min({corners[0][axis], corners[1][axis], corners[2][axis]});
    const int greatest = std::max({corners[0][axis], corners[1][axis], corners[2][axis]});
    // Grids are far smaller than the greatest reach.
    const double reach = std::min((tile.band + kMargin) / tile.scale[axis] - 0.5, kGreatestReach);
    low[axis] = std::max(0, next_whole(least / 256.0 - reach - 1.0) - tile.low[axis]);
    high[axis] =
        std::min(tile.size[axis] - 1, -next_whole(-(greatest / 256.0 + reach)) - tile.low[axis]);
    if (low[axis] > high[axis]) return false;
  }
  return true;
}

/// @return false if no voxel of the tile is in reach
bool TriangleForms::set_bounds(const DistanceTile& tile) {
  const auto limit = static_cast<float>(tile.band + kMargin);
  constexpr float kFlat = 1e-3f, kInfinity = std::numeric_limits<float>::infinity();
  for (int i = 0; i < kBounds; ++i) {
    const int form = i == 0 ? 0 : i - 1;
    const float sign = i == 1 ? -1.0f : 1.0f;
    const float rise = sign * slope[2][form];
    float least = sign * constant[form];
    for (const auto& along : slope) {
      least -= std::abs(along[form]) * static_cast<float>(kMiddle);
    }
    if (least > limit) return false;
    RowBound& bound = bounds[i];
    const bool flat = std::abs(rise) < kFlat;
    bound.inverse = flat ? 0.0f : 1.0f / rise;
    bound.raise = !flat && rise > 0.0f ? 0.0f : kInfinity;
    bound.lower = !flat && rise < 0.0f ? 0.0f : -kInfinity;
    bound.flat = flat ? limit + kFlat * static_cast<float>(kMiddle) : kInfinity;
  }
  return true;
}

/// @return false if no voxel of the tile is in reach
bool TriangleForms::set(const glm::ivec3* given, const DistanceTile& tile) {
  if (!set_box(given, tile)) return false;
  const TriangleFrame frame =
      triangle_frame(given, tile.scale, (tile.low + kMiddle) * kLatticeSteps + kLatticeSteps / 2);
  put(0, -glm::dot(frame.normal, frame.corners[0]), frame.normal, tile.scale);
  for (int i = 0; i < 3; ++i) {
    if (frame.is_line && i > 0) {  // just outside the plane's part, and far from the edge
      put(1 + i, 1e-30, glm::dvec3(0.0), tile.scale);
      put(4 + i, 0.0, glm::dvec3(0.0), tile.scale);
      before[i] = beyond[i] = 1e9f;
      continue;
    }
    put(1 + i, -glm::dot(frame.beside[i], frame.corners[i]), frame.beside[i], tile.scale);
    put(4 + i, 0.0, frame.along[i], tile.scale);
    before[i] = static_cast<float>(glm::dot(frame.along[i], frame.corners[i]));
    beyond[i] = static_cast<float>(-glm::dot(frame.along[i], frame.corners[(i + 1) % 3]));
  }
  return set_bounds(tile);
}

}  // namespace
}  // namespace strata
#endif  // STRATA_VOXELIZE_DISTANCE_FORMS

HWY_BEFORE_NAMESPACE();
namespace strata {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Products and sums are kept apart: fused ones round otherwise.
using Lane = hn::CappedTag<float, 8>;
using LaneInt = hn::RebindToSigned<Lane>;
using LaneBits = hn::RebindToUnsigned<Lane>;
using Vec = hn::Vec<Lane>;
constexpr std::size_t kRows = 8;

/// Forms of rows along z at their voxel kMiddle, and what is left of the rows.
struct Rows {
  HWY_ALIGN float forms[kForms][kRows];
  HWY_ALIGN std::int32_t begin[kRows];
  HWY_ALIGN std::int32_t last[kRows];
};

/// Squares of voxels [begin, last] of row `r`, and of some beyond.
HWY_INLINE void lower_row(const TriangleForms& forms, const Rows& rows, std::size_t r,
                          float* squares) {
  const Lane d;
  const Vec zero = hn::Zero(d);
  const int step = static_cast<int>(hn::Lanes(d));
  for (int z = rows.begin[r]; z <= rows.last[r]; z += step) {
    const Vec at = count_from(d, static_cast<float>(z - kMiddle));
    const auto form = [&](int k) {
      return hn::Add(hn::Mul(hn::Set(d, forms.slope[2][k]), at), hn::Set(d, rows.forms[k][r]));
    };
    const auto outside = [&](int i, Vec along) {
      return hn::Max(hn::Max(hn::Sub(hn::Set(d, forms.before[i]), along),
                             hn::Add(along, hn::Set(d, forms.beyond[i]))),
                     zero);
    };
    const auto square = [&](Vec a, Vec b) { return hn::Add(hn::Mul(a, a), hn::Mul(b, b)); };
    const Vec beside0 = form(1), beside1 = form(2), beside2 = form(3);
    const Vec out0 = outside(0, form(4)), out1 = outside(1, form(5)), out2 = outside(2, form(6));
    Vec plane =
        hn::Min(hn::Min(square(beside0, out0), square(beside1, out1)), square(beside2, out2));
    // Edge 0 is the longest: beyond its ends is outside even where rounding of a sharp angle does
    // not say so.
    const Vec farthest = hn::Max(hn::Max(beside0, beside1), hn::Max(beside2, out0));
    plane = hn::IfThenZeroElse(hn::Le(farthest, zero), plane);
    const Vec height = form(0);
    const Vec found = hn::Add(hn::Mul(height, height), plane);
    hn::StoreU(hn::Min(hn::LoadU(d, squares + z), found), d, squares + z);
  }
}

/// Clips rows y, y + 1, ... at x. @return bit r is set if row y + r has anything left
HWY_INLINE unsigned clip_rows(const TriangleForms& forms, const float* at_x, int y, float limit,
                              Rows& rows) {
  const Lane d;
  const LaneInt di;
  unsigned left = 0;
  for (std::size_t r = 0; r < kRows; r += hn::Lanes(d)) {
    const Vec at = count_from(d, static_cast<float>(y + static_cast<int>(r) - kMiddle));
    for (int k = 0; k < kForms; ++k) {
      hn::Store(hn::Add(hn::Mul(hn::Set(d, forms.slope[1][k]), at), hn::Set(d, at_x[k])), d,
                rows.forms[k] + r);
    }
    Vec begin = hn::Set(d, static_cast<float>(forms.low.z - kMiddle));
    Vec last = hn::Set(d, static_cast<float>(forms.high.z - kMiddle));
    auto some = hn::Le(at, hn::Set(d, static_cast<float>(forms.high.y - kMiddle)));
    for (int i = 0; i < kBounds; ++i) {
      const RowBound& bound = forms.bounds[i];
      const Vec form = hn::Load(d, rows.forms[i == 0 ? 0 : i - 1] + r);
      const Vec signed_form = i == 1 ? hn::Neg(form) : form;
      const Vec reached =
          hn::Mul(hn::Sub(hn::Set(d, limit), signed_form), hn::Set(d, bound.inverse));
      last = hn::Min(last, hn::Add(reached, hn::Set(d, bound.raise)));
      begin = hn::Max(begin, hn::Add(reached, hn::Set(d, bound.lower)));
      some = hn::And(some, hn::Le(signed_form, hn::Set(d, bound.flat)));
    }
    const Vec slack = hn::Set(d, 0.01f);
    begin = hn::Ceil(hn::Sub(begin, slack));
    last = hn::Floor(hn::Add(last, slack));
    some = hn::And(some, hn::Le(begin, last));
    const auto middle = hn::Set(di, kMiddle);
    hn::Store(hn::Max(hn::Add(hn::ConvertTo(di, begin), middle), hn::Zero(di)), di, rows.begin + r);
    hn::Store(
        hn::Min(hn::Add(hn::ConvertTo(di, last), middle), hn::Set(di, DistanceTile::kSide - 1)), di,
        rows.last + r);
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, some, bits);
    left |= static_cast<unsigned>(bits[0]) << r;
  }
  return left;
}

void lower_squares(const LatticeMesh& mesh, std::span<const std::uint32_t> triangles,
                   const DistanceTile& tile, float* squares) {
  const auto limit = static_cast<float>(tile.band + kMargin);
  TriangleForms forms;
  Rows rows;
  for (const std::uint32_t t : triangles) {
    const glm::uvec3 index = mesh.triangles[t];
    const glm::ivec3 corners[3] = {mesh.vertices[index.x], mesh.vertices[index.y],
                                   mesh.vertices[index.z]};
    if (!forms.set(corners, tile)) continue;
    for (int x = forms.low.x; x <= forms.high.x; ++x) {
      float at_x[kForms];
      for (int k = 0; k < kForms; ++k) {
        at_x[k] = forms.constant[k] + forms.slope[0][k] * static_cast<float>(x - kMiddle);
      }
      for (int y = forms.low.y; y <= forms.high.y; y += static_cast<int>(kRows)) {
        unsigned left = clip_rows(forms, at_x, y, limit, rows);
        for (; left != 0; left &= left - 1) {
          const int r = std::countr_zero(left);
          lower_row(forms, rows, static_cast<std::size_t>(r),
                    squares + DistanceTile::offset(x, y + r, 0));
        }
      }
    }
  }
}

bool find_band(const float* squares, const glm::ivec3& at, float band_square) {
  const Lane d;
  Vec least = hn::Set(d, band_square);
  for (int x = 0; x < 8; ++x) {
    for (int y = 0; y < 8; ++y) {
      const float* row = squares + DistanceTile::offset(at.x + x, at.y + y, at.z);
      for (std::size_t z = 0; z < 8; z += hn::Lanes(d)) {
        least = hn::Min(least, hn::LoadU(d, row + z));
      }
    }
  }
  return !hn::AllFalse(d, hn::Lt(least, hn::Set(d, band_square)));
}

BlockCounts sign_block(const float* squares, const std::uint32_t* inside, const glm::ivec3& at,
                       const DistanceScale& scale, float* values) {
  const Lane d;
  const LaneInt di;
  const LaneBits du;
  const auto sign_bit = hn::Set(du, 0x80000000u);
  const Vec band = hn::Set(d, scale.band), band_square = hn::Set(d, scale.band_square),
            unit = hn::Set(d, scale.unit), least = hn::Set(d, FLT_MIN);
  Vec deepest = hn::Zero(d), farthest = hn::Zero(d);
  BlockCounts counts;
  for (int x = 0; x < 8; ++x) {
    const int shift = DistanceTile::kSide - 1 - (at.x + x);
    for (int y = 0; y < 8; ++y) {
      const float* row = squares + DistanceTile::offset(at.x + x, at.y + y, at.z);
      const std::uint32_t* words = inside + (at.y + y) * DistanceTile::kSide + at.z;
      for (std::size_t z = 0; z < 8; z += hn::Lanes(d), values += hn::Lanes(d)) {
        const Vec square = hn::LoadU(d, row + z);
        const auto in_band = hn::Lt(square, band_square);
        const auto sign = hn::And(hn::ShiftLeftSame(hn::LoadU(du, words + z), shift), sign_bit);
        const auto is_inside =
            hn::MaskFromVec(hn::BitCast(d, hn::BroadcastSignBit(hn::BitCast(di, sign))));
        Vec distance = hn::IfThenElse(in_band, hn::Mul(hn::Sqrt(square), unit), band);
        distance = hn::Min(distance, band);
        // -0 would not be below 0.
        distance = hn::IfThenElse(is_inside, hn::Max(distance, least), distance);
        hn::StoreU(hn::BitCast(d, hn::Or(hn::BitCast(du, distance), sign)), d, values);
        const auto inner = hn::And(in_band, is_inside), outer = hn::AndNot(is_inside, in_band);
        deepest = hn::Max(deepest, hn::IfThenElseZero(inner, distance));
        farthest = hn::Max(farthest, hn::IfThenElseZero(outer, distance));
        counts.inside += static_cast<std::uint32_t>(hn::CountTrue(d, inner));
        counts.voxels += static_cast<std::uint32_t>(hn::CountTrue(d, in_band));
      }
    }
  }
  counts.deepest = hn::GetLane(hn::MaxOfLanes(d, deepest));
  counts.farthest = hn::GetLane(hn::MaxOfLanes(d, farthest));
  return counts;
}

}  // namespace HWY_NAMESPACE
}  // namespace strata
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata {

HWY_EXPORT(lower_squares);
HWY_EXPORT(find_band);
HWY_EXPORT(sign_block);

void add_triangles(const LatticeMesh& mesh, std::span<const std::uint32_t> triangles,
                   const DistanceTile& tile, float* squares) {
  HWY_DYNAMIC_DISPATCH(lower_squares)(mesh, triangles, tile, squares);
}

bool block_has_band(const float* squares, const glm::ivec3& at, float band_square) {
  return HWY_DYNAMIC_DISPATCH(find_band)(squares, at, band_square);
}

BlockCounts finish_block(const float* squares,
                         std::span<const std::uint32_t, DistanceTile::kWords> inside,
                         const glm::ivec3& at, const DistanceScale& scale, float* values) {
  return HWY_DYNAMIC_DISPATCH(sign_block)(squares, inside.data(), at, scale, values);
}

}  // namespace strata
#endif  // HWY_ONCE
