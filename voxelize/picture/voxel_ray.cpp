#include "voxelize/picture/voxel_ray.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

// This work is based on:
// J. Amanatides, A. Woo: A Fast Voxel Traversal Algorithm for Ray Tracing. Eurographics 1987.
// We differ: steps are columns of voxels, whose solid runs are searched, and blocks of columns
// where nothing is; parameters are computed anew for each plane, so that skipping changes nothing.

namespace strata {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Nearer to 0 a component's inverse would not be finite.
constexpr double kLeastComponent = 1e-290;

}  // namespace

VoxelRays::VoxelRays(const VoxelIntervals& set, const OccupiedBlocks& blocks, const RayBox& box)
    : set_(&set), blocks_(&blocks), frame_(set.axis()) {
  const int axes[3] = {frame_.u, frame_.v, frame_.w};
  for (int a = 0; a < 3; ++a) {
    rank_[a] = axes[a];
    low_[a] = box.low[axes[a]];
    high_[a] = box.high[axes[a]];
    low_section_[a] = box.low_section[axes[a]];
    high_section_[a] = box.high_section[axes[a]];
  }
  low_[1] -= set.v_begin();
  high_[1] -= set.v_begin();
  low_ = glm::max(low_, glm::ivec3(0));
  high_ = glm::min(
      high_, glm::ivec3(set.columns(), set.v_end() - set.v_begin(), set.grid().dims[frame_.w]));
}

/// The same for all numbers.
int VoxelRays::compared_index_at(int axis, const Key& key, int low, int high) const {
  if (step_[axis] == 0) return p_[axis];
  const double guess = std::clamp(std::floor(o_[axis] + key.t * d_[axis]), low - 1.0, double(high));
  int at = std::isnan(guess) ? low : static_cast<int>(guess);
  if (step_[axis] > 0) {
    while (at < high && passed(axis, at + 1, key)) ++at;
    while (at >= low && !passed(axis, at, key)) --at;
  } else {
    while (at >= low && passed(axis, at, key)) --at;
    while (at < high && !passed(axis, at + 1, key)) ++at;
  }
  return at;
}

/// Moves to where the ray is in the box first. False: nowhere.
bool VoxelRays::begin(const glm::dvec3& origin, const glm::dvec3& direction,
                      const RayStart& start) {
  key_ = {start.t, -1};
  section_ = start.section;
  for (int a = 0; a < 3; ++a) {
    if (low_[a] >= high_[a]) return false;
    o_[a] = origin[rank_[a]] - (a == 1 ? set_->v_begin() : 0);
    d_[a] = direction[rank_[a]];
    step_[a] = d_[a] > kLeastComponent ? 1 : d_[a] < -kLeastComponent ? -1 : 0;
    inverse_[a] = step_[a] == 0 ? kInfinity : 1.0 / d_[a];
    if (step_[a] == 0) {
      if (!(o_[a] >= low_[a] && o_[a] < high_[a])) return false;
      p_[a] = static_cast<int>(std::floor(o_[a]));
      continue;
    }
    const Key enters{plane(a, step_[a] > 0 ? low_[a] : high_[a]), a};
    if (!(enters.t < key_.t) && (key_.axis < 0 || before(key_, enters))) key_ = enters;
  }
  for (int a = 0; a < 3; ++a) {
    p_[a] = index_at(a, key_, low_[a], high_[a]);
    if (p_[a] < low_[a] || p_[a] >= high_[a]) return false;
  }
  if (key_.axis >= 0) {
    section_ = step_[key_.axis] > 0 ? low_section_[key_.axis] : high_section_[key_.axis];
  }
  return true;
}

/// Leaves the cube of 2^shift voxels a side around p_. False: the ray has left the box.
bool VoxelRays::skip(int shift) {
  glm::ivec3 low, high;
  Key leaves{kInfinity, -1};
  for (int a = 0; a < 3; ++a) {
    low[a] = std::max((p_[a] >> shift) << shift, low_[a]);
    high[a] = std::min(((p_[a] >> shift) + 1) << shift, high_[a]);
    if (step_[a] == 0) continue;
    const Key key{plane(a, step_[a] > 0 ? high[a] : low[a]), a};
    if (leaves.axis < 0 || before(key, leaves)) leaves = key;
  }
  const int axis = leaves.axis;
  if (axis < 0) return false;
  key_ = leaves;
  for (int a = 0; a < 3; ++a) {
    if (a != axis) p_[a] = index_at(a, key_, low[a], high[a]);
  }
  p_[axis] = step_[axis] > 0 ? high[axis] : low[axis] - 1;
  return p_[axis] >= low_[axis] && p_[axis] < high_[axis];
}

VoxelRays::ColumnEnd VoxelRays::column_end() const {
  ColumnEnd end{{kInfinity, -1}, 0, false};
  for (int a = 0; a < 2; ++a) {
    if (step_[a] == 0) continue;
    const Key key{plane(a, p_[a] + (step_[a] > 0 ? 1 : 0)), a};
    if (end.key.axis < 0 || before(key, end.key)) end.key = key;
  }
  if (end.key.axis < 0) {  // along the column
    end.w = step_[2] > 0 ? high_[2] - 1 : step_[2] < 0 ? low_[2] : p_[2];
    end.leaves = true;
    return end;
  }
  end.w = index_at(2, end.key, low_[2], high_[2]);
  if (end.w < low_[2] || end.w >= high_[2]) {
    end.w = end.w < low_[2] ? low_[2] : high_[2] - 1;
    end.leaves = true;
  }
  return end;
}

/// False: the ray has left the box.
bool VoxelRays::next_column(const ColumnEnd& end) {
  if (end.leaves) return false;
  const int axis = end.key.axis;
  key_ = end.key;
  p_[2] = end.w;
  p_[axis] += step_[axis];
  return p_[axis] >= low_[axis] && p_[axis] < high_[axis];
}

void VoxelRays::fill(RayHit& hit, std::size_t run, int w, const Key& key) const {
  hit.voxel[frame_.u] = p_[0];
  hit.voxel[frame_.v] = p_[1] + set_->v_begin();
  hit.voxel[frame_.w] = w;
  hit.t = key.t;
  hit.face = key.axis < 0 ? 0 : 2 * rank_[key.axis] + (step_[key.axis] < 0 ? 1 : 0);
  const auto labels = set_->column_labels(p_[0], p_[1] + set_->v_begin());
  hit.label = labels.empty() ? 1 : labels[run];
}

/// Whether the ray meets a solid voxel in its column, from p_ on.
bool VoxelRays::search_column(const ColumnEnd& end, RayHit& hit) const {
  const std::span<const Interval> items = runs();
  if (items.empty()) return false;
  if (step_[2] >= 0) {
    const auto run = std::partition_point(items.begin(), items.end(),
                                          [&](Interval i) { return i.last < p_[2]; });
    if (run == items.end() || run->first > end.w) return false;
    const auto at = static_cast<std::size_t>(run - items.begin());
    if (run->first <= p_[2]) return fill(hit, at, p_[2], key_), true;
    fill(hit, at, run->first, {plane(2, run->first), 2});
    return true;
  }
  const auto after = std::partition_point(items.begin(), items.end(),
                                          [&](Interval i) { return i.first <= p_[2]; });
  if (after == items.begin()) return false;
  const auto run = std::prev(after);
  if (run->last < end.w) return false;
  const auto at = static_cast<std::size_t>(run - items.begin());
  if (run->last >= p_[2]) return fill(hit, at, p_[2], key_), true;
  fill(hit, at, run->last, {plane(2, run->end()), 2});
  return true;
}

/// Goes on to the first voxel that is not solid, from p_ on. False: there is none.
bool VoxelRays::leave_solid() {
  for (;;) {
    if ((blocks_->brick_of(p_).some >> blocks_->bit_of(p_) & 1) == 0) return true;
    const ColumnEnd end = column_end();
    const std::span<const Interval> items = runs();
    int w = p_[2];
    if (step_[2] >= 0) {
      for (const Interval& run : items) {
        if (run.first <= w && run.last >= w && w <= end.w) w = run.end();
      }
    } else {
      for (auto run = items.rbegin(); run != items.rend(); ++run) {
        if (run->first <= w && run->last >= w && w >= end.w) w = run->first - 1;
      }
    }
    if (w == p_[2]) return true;  // not solid
    const bool in_column = step_[2] > 0 ? w <= end.w : step_[2] < 0 ? w >= end.w : false;
    if (in_column) {
      key_ = {plane(2, step_[2] > 0 ? w : w + 1), 2};
      p_[2] = w;
      return true;
    }
    if (!next_column(end)) return false;
  }
}

RayHit VoxelRays::first(const glm::dvec3& origin, const glm::dvec3& direction,
                        const RayStart& start, double end) {
  RayHit hit;
  if (!begin(origin, direction, start)) return hit;
  if (section_ >= 0) {
    if (search_column({key_, p_[2], false}, hit)) {
      hit.face = RayHit::kSection + section_;
      if (hit.t > end) hit.label = RayHit::kNothing;
      return hit;
    }
  } else if (key_.axis < 0 && !leave_solid()) {
    return hit;
  }
  for (;;) {
    const OccupiedBlocks::Brick& brick = blocks_->brick_of(p_);
    bool inside;
    if (brick.some == 0) {
      inside = skip(blocks_->brick_shift());
    } else if ((brick.some >> blocks_->bit_of(p_) & 1) == 0) {
      inside = skip(blocks_->shift());
    } else {
      const ColumnEnd column = column_end();
      if (search_column(column, hit)) {
        if (hit.t > end) hit.label = RayHit::kNothing;
        return hit;
      }
      inside = next_column(column);
    }
    if (!inside || key_.t > end) return hit;
  }
}

/// Solid length of the ray in its column, from p_ on.
double VoxelRays::column_length(const ColumnEnd& end, double until) const {
  const std::span<const Interval> items = runs();
  const double leave = std::min(end.leaves ? kInfinity : end.key.t, until);
  double sum = 0.0;
  const int low = std::min(p_[2], end.w), high = std::max(p_[2], end.w);
  auto run =
      std::partition_point(items.begin(), items.end(), [&](Interval i) { return i.last < low; });
  for (; run != items.end() && run->first <= high; ++run) {
    double from = key_.t, to = leave;
    if (step_[2] > 0) {
      from = std::max(from, plane(2, std::max<int>(run->first, low_[2])));
      to = std::min(to, plane(2, std::min(run->end(), high_[2])));
    } else if (step_[2] < 0) {
      from = std::max(from, plane(2, std::min(run->end(), high_[2])));
      to = std::min(to, plane(2, std::max<int>(run->first, low_[2])));
    }
    if (to > from) sum += to - from;
  }
  return sum;
}

double VoxelRays::solid_length(const glm::dvec3& origin, const glm::dvec3& direction,
                               const RayStart& start, double end) {
  if (!begin(origin, direction, start)) return 0.0;
  double sum = 0.0;
  for (;;) {
    const OccupiedBlocks::Brick& brick = blocks_->brick_of(p_);
    const std::uint64_t bit = std::uint64_t{1} << blocks_->bit_of(p_);
    const double from = key_.t;
    bool inside;
    if (brick.some == 0 || brick.full == ~std::uint64_t{0}) {
      inside = skip(blocks_->brick_shift());
      if (brick.some != 0) sum += std::max(0.0, std::min(key_.t, end) - from);
    } else if ((brick.some & bit) == 0 || (brick.full & bit) != 0) {
      inside = skip(blocks_->shift());
      if ((brick.some & bit) != 0) sum += std::max(0.0, std::min(key_.t, end) - from);
    } else {
      const ColumnEnd column = column_end();
      sum += column_length(column, end);
      inside = next_column(column);
    }
    if (!inside || key_.t >= end) return sum;
  }
}

}  // namespace strata
