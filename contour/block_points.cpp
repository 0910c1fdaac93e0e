#include "contour/block_points.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <glm/geometric.hpp>

#include "contour/block_walk.h"
#include "contour/edge_shape.h"

namespace strata::contouring {
namespace {

/// The cuts of a cycle of a cell.
class CellCuts {
 public:
  CellCuts(const BlockNeighbours& blocks, const glm::ivec3& low, std::span<const Plane> planes)
      : edges_(blocks), low_(low), all_planes_(planes) {}

  void gather(const Cell& cell, unsigned cycle) {
    sum_ = glm::ivec3(0);
    count_ = 0;
    planes_.clear();
    corner_ = lower_corner(low_, cell.at);
    edges_.go_to(cell.at);
    for_each_axis([&](auto axis) {
      for (unsigned left = cell.kind->cut >> 4 * axis & 15u; left != 0; left &= left - 1) {
        const auto place = static_cast<unsigned>(std::countr_zero(left));
        if (cell.kind->cycle[4 * axis + place] == cycle) add<axis>(place);
      }
    });
  }
  /// From the cell's lower corner.
  [[nodiscard]] glm::dvec3 mean() const { return glm::dvec3(sum_) / static_cast<double>(count_); }
  [[nodiscard]] const CellPlanes& planes() const { return planes_; }

 private:
  /// @param place  of the edge along the axis: 0 to 3
  template <int axis>
  void add(unsigned place) {
    const CellBlock::Crossing& found = edges_.at<axis>(place);
    constexpr int kFirst = axis == 0 ? 1 : 0, kSecond = axis == 2 ? 1 : 2;
    sum_[axis] += found.offset;
    sum_[kFirst] += static_cast<int>(place & 1) * kLatticeSteps;
    sum_[kSecond] += static_cast<int>(place >> 1) * kLatticeSteps;
    const std::uint32_t triangle = found.triangle;
    bool again = triangle == CutEdge::kNoTriangle;
    for (std::size_t i = 0; i < count_ && !again; ++i) again = triangles_[i] == triangle;
    triangles_[count_++] = triangle == CutEdge::kGridFace ? CutEdge::kNoTriangle : triangle;
    if (again) return;
    Plane plane;
    if (triangle == CutEdge::kGridFace) {
      plane.normal[axis] = 1.0;
      plane.offset = found.offset;
    } else {
      plane = all_planes_[triangle];
      plane.offset -= glm::dot(plane.normal, corner_);
    }
    planes_.add(plane);
  }

  EdgeColumns edges_;
  glm::ivec3 low_;
  std::span<const Plane> all_planes_;
  glm::dvec3 corner_{0.0};
  glm::ivec3 sum_{0};
  CellPlanes planes_;
  std::array<std::uint32_t, 12> triangles_{};
  std::size_t count_ = 0;
};

CellBounds bounds_of(const glm::ivec3& voxel, const VoxelGrid& grid) {
  CellBounds bounds;
  for (int axis = 0; axis < 3; ++axis) {
    if (voxel[axis] == 0) bounds.low[axis] = kLatticeSteps / 2;
    if (voxel[axis] == grid.dims[axis]) bounds.high[axis] = kLatticeSteps / 2;
  }
  return bounds;
}

/// Where the vertex of a cell with one lies, in the frame of edge_shape(): the edge along z.
template <int axis>
glm::ivec3 point_of(const CellColumns::Numbered& cell, unsigned below) {
  const CellBlock::CellPoint& point = cell.block->points[cell.number];
  const auto along = [&](std::size_t c) {
    return static_cast<int>(point[c]) - static_cast<int>(below >> c & 1) * kLatticeSteps;
  };
  return {along((axis + 1) % 3), along((axis + 2) % 3), along(axis)};
}

/// Marks the cells whose lower faces lie at an edge: all but the lowest. Other threads may mark
/// the same ones.
void mark_fan(const BlockNeighbours& blocks, const std::array<LocalPlace, 4>& ring) {
  for (std::size_t n = 1; n < 4; ++n) {
    LocalPlace at = ring[n];
    CellBlock& block = blocks.changeable(at);
    std::atomic_ref(block.at_fan[block.cell(at)]).store(1, std::memory_order_relaxed);
  }
}

}  // namespace

std::uint64_t place_points(CellBlock& block, const BlockNeighbours& blocks, const glm::ivec3& place,
                           const VoxelGrid& grid, std::span<const Plane> planes) {
  const glm::ivec3 low = place * kBlockSide;
  std::uint64_t clamped = 0;
  std::size_t next = 0, next_split = block.cells;
  block.points.resize(block.cells + block.split_vertices);
  CellCuts cuts(blocks, low, planes);
  for_each_cell(block, [&](const Cell& cell) {
    const CellBounds bounds = bounds_of(low + glm::ivec3(cell.at.i, cell.at.j, cell.at.k), grid);
    for (unsigned cycle = 0; cycle < cell.kind->cycles; ++cycle) {
      cuts.gather(cell, cycle);
      const CellVertex vertex = cell.kind->cycles == 1
                                    ? feature_vertex(cuts.mean(), cuts.planes(), bounds)
                                    : mean_vertex(cuts.mean(), bounds);
      clamped += vertex.clamped ? 1 : 0;
      CellBlock::CellPoint& point = block.points[cycle == 0 ? next++ : next_split++];
      point = {static_cast<std::uint8_t>(vertex.at.x), static_cast<std::uint8_t>(vertex.at.y),
               static_cast<std::uint8_t>(vertex.at.z)};
    }
  });
  return clamped;
}

void choose_shapes(const BlockNeighbours& blocks, StripFinder& strips) {
  CellColumns columns(blocks);
  for_each_cell(blocks.own(), [&](const Cell& cell) {
    columns.go_to(cell.at);
    for_each_axis([&](auto axis) {
      constexpr unsigned kEdge = 4 * axis;
      if ((cell.kind->cut >> kEdge & 1) == 0) return;
      LocalPlace at = edge_place(cell.at, kEdge);
      CellBlock& block = blocks.changeable(at);
      CellBlock::Crossing& crossing = block.crossings[block.crossing(axis, at)];
      std::array<glm::ivec3, 4> points;
      bool special = false;
      for (std::size_t n = 0; n < 4; ++n) {
        const unsigned below = kRingBelow<axis>[n];
        const auto found = columns.below(below);
        points[n] = point_of<axis>(found, below);
        special = special || (found.block->special &&
                              cell_cases()[found.block->corners[found.number]].special);
      }
      if (!special) {
        crossing.shape = edge_shape(points, crossing.offset);
        if (crossing.shape != EdgeShape::kFan) strips.add(cell.at, axis, points);
      }
      if (crossing.shape == EdgeShape::kFan) mark_fan(blocks, ring_of(cell.at, axis));
    });
  });
  strips.find(blocks);
}

}  // namespace strata::contouring
