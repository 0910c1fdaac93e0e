#include "csg/lattice/solid_voxels.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "core/buckets.h"

namespace strata::csg {
namespace {

using exact::LatticePoint;

// The bits from `low` to `high`, both counted.
std::uint64_t bits(int low, int high) { return (~std::uint64_t{0} >> (63 - (high - low))) << low; }

LatticeBox box_of(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
  return {glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c))};
}

// A triangle seen along x, from its first corner. Doubles: they are off by much less than the
// margin.
class Shadow {
 public:
  Shadow(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
    const LatticePoint corners[3] = {a, b, c};
    const exact::Normal normal = exact::normal_of(a, b, c);
    facing_ = normal.x > 0 ? 1 : normal.x < 0 ? -1 : 0;
    for (int k = 0; k < 3; ++k) {
      const LatticePoint from = corners[k] - a, along = corners[k == 2 ? 0 : k + 1] - corners[k];
      sides_[k] = {static_cast<double>(from.y), static_cast<double>(from.z),
                   static_cast<double>(along.y), static_cast<double>(along.z)};
    }
    if (facing_ == 0) return;
    rise_y_ = -static_cast<double>(normal.y) / static_cast<double>(normal.x);
    rise_z_ = -static_cast<double>(normal.z) / static_cast<double>(normal.x);
  }

  // Whether it may meet the square of the given half side around a point.
  bool meets(double y, double z, double reach) const {
    for (const Side& side : sides_) {
      const double turn = side.along_y * (z - side.z) - side.along_z * (y - side.y);
      const double most = (std::abs(side.along_y) + std::abs(side.along_z)) * reach;
      if (facing_ != 0 ? turn * facing_ < -most : std::abs(turn) > most) return false;
    }
    return true;
  }
  // Along x within the square.
  std::pair<double, double> range(double y, double z, double reach) const {
    constexpr double kFar = 0x1p40;
    if (facing_ == 0) return {-kFar, kFar};
    const double middle = y * rise_y_ + z * rise_z_;
    const double half = (std::abs(rise_y_) + std::abs(rise_z_)) * reach;
    return {middle - half, middle + half};
  }

 private:
  struct Side {
    double y, z, along_y, along_z;
  };
  Side sides_[3];
  double facing_, rise_y_ = 0, rise_z_ = 0;
};

class SolidVoxelizer {
 public:
  SolidVoxelizer(const CoarseGrid& grid, SolidVoxels& out) : grid_(grid), out_(out) {}

  void add(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
    touch(a, b, c);
    cross_rows(a, b, c);
  }
  void finish(InsideRule rule);

 private:
  void touch(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c);
  void cross_rows(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c);
  // The middle of a voxel, twice, and odd: no lattice point lies there.
  std::int64_t middle(int axis, int voxel) const {
    return (2 * (std::int64_t{grid_.low[axis]} + (std::int64_t{voxel} << grid_.shift)) +
            (std::int64_t{1} << grid_.shift)) |
           1;
  }

  const CoarseGrid& grid_;
  SolidVoxels& out_;
  struct Crossing {
    std::uint32_t row;
    std::int32_t voxel, change;
  };
  std::vector<Crossing> crossings_;
};

void SolidVoxelizer::touch(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
  const LatticeBox box = grid_.voxels_of(box_of(a, b, c), CoarseGrid::kMargin);
  if (glm::any(glm::greaterThan(box.low, box.high))) return;
  const glm::ivec3 size = box.high - box.low + 1;
  if (size.x * size.y * size.z <= 8) {
    for (int z = box.low.z; z <= box.high.z; ++z) {
      for (int y = box.low.y; y <= box.high.y; ++y) {
        out_.may[out_.row(y, z)] |= bits(box.low.x, box.high.x);
      }
    }
    return;
  }
  const Shadow shadow(a, b, c);
  const double half = std::ldexp(0.5, grid_.shift), reach = half + CoarseGrid::kMargin;
  const auto middle_of = [&](int axis, int voxel) {
    return grid_.low[axis] + (2 * voxel + 1) * half - a[axis];
  };
  for (int z = box.low.z; z <= box.high.z; ++z) {
    for (int y = box.low.y; y <= box.high.y; ++y) {
      const double at_y = middle_of(1, y), at_z = middle_of(2, z);
      if (!shadow.meets(at_y, at_z, reach)) continue;
      const auto [low, high] = shadow.range(at_y, at_z, reach);
      const auto voxel = [&](double x) {
        return std::clamp(std::ldexp(x + a.x - grid_.low.x, -grid_.shift), -1.0, 64.0);
      };
      const int first = std::max(static_cast<int>(std::floor(voxel(low - CoarseGrid::kMargin))),
                                 box.low.x),
                last = std::min(static_cast<int>(std::floor(voxel(high + CoarseGrid::kMargin))),
                                box.high.x);
      if (first <= last) out_.may[out_.row(y, z)] |= bits(first, last);
    }
  }
}

// Where rays along the middles of rows go through a triangle. A ray through an edge is moved a
// little along y and much less along z.
void SolidVoxelizer::cross_rows(const LatticePoint& a, const LatticePoint& b,
                                const LatticePoint& c) {
  const exact::Normal normal = exact::normal_of(a, b, c);
  if (normal.x == 0) return;
  const int facing = normal.x > 0 ? 1 : -1;
  const LatticeBox box = box_of(a, b, c);
  const LatticeBox voxels = grid_.voxels_of(
      {{grid_.low.x, box.low.y, box.low.z}, {grid_.low.x, box.high.y, box.high.z}}, 0);
  const LatticePoint* const corners[3] = {&a, &b, &c};
  for (int z = voxels.low.z; z <= voxels.high.z; ++z) {
    const std::int64_t at_z = middle(2, z);
    if (at_z < 2 * std::int64_t{box.low.z} || at_z > 2 * std::int64_t{box.high.z}) continue;
    for (int y = voxels.low.y; y <= voxels.high.y; ++y) {
      const std::int64_t at_y = middle(1, y);
      if (at_y < 2 * std::int64_t{box.low.y} || at_y > 2 * std::int64_t{box.high.y}) continue;
      bool through = true;
      for (int k = 0; k < 3 && through; ++k) {
        const LatticePoint &p = *corners[k], &q = *corners[k == 2 ? 0 : k + 1];
        const std::int64_t along_y = std::int64_t{q.y} - p.y, along_z = std::int64_t{q.z} - p.z;
        std::int64_t turn = along_y * (at_z - 2 * std::int64_t{p.z}) -
                            along_z * (at_y - 2 * std::int64_t{p.y});  // below 2^62
        if (turn == 0) turn = along_z != 0 ? -along_z : along_y;
        through = (turn > 0) == (facing > 0);
      }
      if (!through) continue;
      const double up_y = 0.5 * static_cast<double>(at_y) - a.y,
                   up_z = 0.5 * static_cast<double>(at_z) - a.z;
      const double x =
          a.x - (static_cast<double>(normal.y) * up_y + static_cast<double>(normal.z) * up_z) /
                    static_cast<double>(normal.x);
      const double voxel = std::floor(std::ldexp(x - grid_.low.x, -grid_.shift));
      crossings_.push_back({static_cast<std::uint32_t>(out_.row(y, z)),
                            static_cast<int>(std::clamp(voxel, -1.0, 64.0)), -facing});
    }
  }
}

void SolidVoxelizer::finish(InsideRule rule) {
  const detail::Buckets rows = detail::bucket(crossings_.size(), out_.may.size(),
                                              [&](std::size_t i) { return crossings_[i].row; });
  std::vector<Crossing> sorted;
  for (std::size_t row = 0; row < out_.may.size(); ++row) {
    if (rows.first[row] == rows.first[row + 1]) continue;
    sorted.clear();
    for (std::uint32_t i = rows.first[row]; i < rows.first[row + 1]; ++i) {
      sorted.push_back(crossings_[rows.items[i]]);
    }
    std::ranges::sort(sorted, {}, &Crossing::voxel);
    std::uint64_t inside = 0;
    std::int32_t winding = 0;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      winding += sorted[i].change;
      const int first = sorted[i].voxel + 1,
                end = i + 1 < sorted.size() ? std::min(sorted[i + 1].voxel + 1, grid_.dims.x)
                                            : grid_.dims.x;
      if (first < end && is_inside(rule, winding)) inside |= bits(first, end - 1);
    }
    out_.must[row] = inside & ~out_.may[row];
    out_.may[row] |= inside;
  }
}

}  // namespace

std::uint64_t rows_of_triangles(const LatticeSolids& solids, const CoarseGrid& grid) {
  constexpr std::size_t kSample = 4096;
  const std::size_t stride = solids.triangles.size() / kSample + 1;
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < solids.triangles.size(); i += stride) {
    const glm::uvec3& t = solids.triangles[i];
    const LatticeBox box =
        grid.voxels_of(box_of(solids.vertices[t.x], solids.vertices[t.y], solids.vertices[t.z]), 0);
    const glm::ivec3 size = glm::max(box.high - box.low + 1, glm::ivec3(0));
    sum +=
        size.x == 0 ? 0u : static_cast<std::uint64_t>(size.y) * static_cast<std::uint64_t>(size.z);
  }
  return sum * stride;
}

SolidVoxels find_solid_voxels(const LatticeSolids& solids, std::uint32_t solid, InsideRule rule,
                              const CoarseGrid& grid) {
  SolidVoxels result;
  const auto triangles =
      std::span(solids.triangles)
          .subspan(solids.first_triangle[solid],
                   solids.first_triangle[solid + 1] - solids.first_triangle[solid]);
  if (triangles.empty()) return result;
  LatticeBox box{solids.vertices[triangles[0].x], solids.vertices[triangles[0].x]};
  for (const glm::uvec3& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      box.low = glm::min(box.low, solids.vertices[t[k]]);
      box.high = glm::max(box.high, solids.vertices[t[k]]);
    }
  }
  const LatticeBox rows = grid.voxels_of(box, CoarseGrid::kMargin);
  if (glm::any(glm::greaterThan(rows.low, rows.high))) return result;
  result.rows = rows;
  const std::size_t count = result.row(rows.high.y, rows.high.z) + 1;
  result.may.assign(count, 0);
  result.must.assign(count, 0);
  SolidVoxelizer voxelizer(grid, result);
  for (const glm::uvec3& t : triangles) {
    voxelizer.add(solids.vertices[t.x], solids.vertices[t.y], solids.vertices[t.z]);
  }
  voxelizer.finish(rule);
  return result;
}

}  // namespace strata::csg
