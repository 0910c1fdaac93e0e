#include "voxelize/picture/patch_depths.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/mat4x4.hpp>

// This work is based on:
// S. Laine, T. Karras: Efficient Sparse Voxel Octrees. I3D 2010: "beam optimization".
// We differ: the boxes are projected, which is conservative for every ray of the patch.

namespace strata {
namespace {

/// What rounding may move the projection of a brick, in pixels, and its distance, relative.
constexpr double kPixelRoom = 1e-3, kDistanceRoom = 1e-9;

struct Rect {
  int u0 = 0, v0 = 0, u1 = -1, v1 = -1;  ///< of patches, both ends included
};

}  // namespace

PatchDepths::PatchDepths(const VoxelIntervals& set, const OccupiedBlocks& blocks, const View& view,
                         const Execution& execution)
    : across_((view.size.x + kSide - 1) / kSide) {
  const int down = (view.size.y + kSide - 1) / kSide;
  const std::size_t count = static_cast<std::size_t>(across_) * static_cast<std::size_t>(down);
  const AxisFrame frame(set.axis());
  const VoxelGrid& grid = set.grid();
  const glm::ivec3 bricks = blocks.bricks();
  const int side = 1 << blocks.brick_shift();

  /// Where a brick is seen, in what distances. False: nowhere.
  const auto project = [&](const glm::ivec3& brick, Rect& rect, Range& range) {
    glm::dvec3 corner[2];
    for (int end = 0; end < 2; ++end) {
      const glm::ivec3 at = (brick + end) * side;
      corner[end][frame.u] = at.x, corner[end][frame.v] = at.y + set.v_begin();
      corner[end][frame.w] = at.z;
      corner[end] = grid.origin + glm::min(corner[end], glm::dvec3(grid.dims)) * grid.voxel_size;
    }
    glm::dvec2 low(std::numeric_limits<double>::infinity()), high = -low;
    double reach = 0.0;
    for (int i = 0; i < 8; ++i) {
      const glm::dvec4 p(corner[i & 1].x, corner[i >> 1 & 1].y, corner[i >> 2].z, 1.0);
      const double away = -(view.eye_from_world * p).z;
      range.nearest = std::min(range.nearest, away);
      range.farthest = std::max(range.farthest, away);
      reach = std::max(reach, std::abs(away));
      const glm::dvec4 seen = view.image_from_world * p;
      low = glm::min(low, glm::dvec2(seen) / seen.w);
      high = glm::max(high, glm::dvec2(seen) / seen.w);
    }
    const double room = reach * kDistanceRoom;
    range.nearest -= room, range.farthest += room;
    if (view.perspective && range.farthest < 0) return false;
    // A brick beside the eye may be seen anywhere.
    if (view.perspective && range.nearest < 1e-3 * range.farthest) {
      low = glm::dvec2(0.0), high = glm::dvec2(view.size);
    }
    low -= kPixelRoom, high += kPixelRoom;
    if (!(high.x >= 0 && high.y >= 0 && low.x <= view.size.x && low.y <= view.size.y)) return false;
    const auto patch = [&](double pixel, int patches) {
      return std::clamp(static_cast<int>(std::clamp(pixel, 0.0, 1e6)) / kSide, 0, patches - 1);
    };
    rect = {patch(low.x, across_), patch(low.y, down), patch(high.x, across_), patch(high.y, down)};
    return true;
  };

  std::vector<std::vector<Range>> parts(static_cast<std::size_t>(execution.thread_count()));
  parallel_for(execution, static_cast<std::size_t>(bricks.y), [&](std::size_t v, int worker) {
    std::vector<Range>& part = parts[static_cast<std::size_t>(worker)];
    if (part.empty()) part.resize(count);
    for (int u = 0; u < bricks.x; ++u) {
      for (int w = 0; w < bricks.z; ++w) {
        const glm::ivec3 brick(u, static_cast<int>(v), w);
        if (blocks.brick_of(brick * side).some == 0) continue;
        Rect rect;
        Range range;
        if (!project(brick, rect, range)) continue;
        for (int y = rect.v0; y <= rect.v1; ++y) {
          for (int x = rect.u0; x <= rect.u1; ++x) {
            Range& at = part[static_cast<std::size_t>(y) * static_cast<std::size_t>(across_) +
                             static_cast<std::size_t>(x)];
            at.nearest = std::min(at.nearest, range.nearest);
            at.farthest = std::max(at.farthest, range.farthest);
          }
        }
      }
    }
  });
  ranges_.resize(count);
  for (const std::vector<Range>& part : parts) {
    for (std::size_t i = 0; i < part.size(); ++i) {
      ranges_[i].nearest = std::min(ranges_[i].nearest, part[i].nearest);
      ranges_[i].farthest = std::max(ranges_[i].farthest, part[i].farthest);
    }
  }
}

}  // namespace strata
