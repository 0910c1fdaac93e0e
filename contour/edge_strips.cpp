#include "contour/edge_strips.h"

#include <atomic>
#include <bit>

namespace strata::contouring {
namespace {

std::size_t size(int value) { return static_cast<std::size_t>(value); }

int along(const LocalPlace& at, int axis) { return axis == 0 ? at.i : axis == 1 ? at.j : at.k; }

/// Where a run's cells are kept: their places along the two other axes.
std::size_t column_of(const LocalPlace& at, int run) {
  const int u = run == 0 ? at.j : at.i, v = run == 2 ? at.j : at.k;
  return CellBlock::column(u, v);
}
LocalPlace place_of(std::size_t column, int run, int at) {
  const int u = static_cast<int>(column) / kBlockSide, v = static_cast<int>(column) % kBlockSide;
  return run == 0 ? LocalPlace{at, u, v} : run == 1 ? LocalPlace{u, at, v} : LocalPlace{u, v, at};
}

LocalPlace moved(LocalPlace at, int axis, int by) {
  (axis == 0 ? at.i : axis == 1 ? at.j : at.k) += by;
  return at;
}

CellBlock::Crossing& edge_of(const BlockNeighbours& blocks, const LocalPlace& cell, int axis) {
  LocalPlace at = edge_place(cell, static_cast<unsigned>(axis) * 4);
  CellBlock& block = blocks.changeable(at);
  return block.crossings[block.crossing(axis, at)];
}

/// The four cells at the ends of a strip: the beginning of the rail that is gone forward, its end,
/// the end of the other rail and its beginning.
std::array<LocalPlace, 4> ends_of(const Strip& strip) {
  const auto first = ring_of(strip.cell, strip.axis);
  const int length = strip.length;
  if (strip.along == (strip.axis + 1) % 3) {
    return {first[0], moved(first[0], strip.along, length), moved(first[3], strip.along, length),
            first[3]};
  }
  return {first[1], moved(first[1], strip.along, length), moved(first[0], strip.along, length),
          first[0]};
}

}  // namespace

void StripFinder::add(const LocalPlace& cell, int axis, const std::array<glm::ivec3, 4>& points) {
  const int p = (axis + 1) % 3, q = (axis + 2) % 3;
  const glm::ivec3 step_p(kLatticeSteps, 0, 0), step_q(0, kLatticeSteps, 0);
  if (points[1] - points[0] == step_p && points[2] - points[3] == step_p) {
    straight_[size(axis)][0][column_of(cell, p)] |= std::uint32_t{1} << along(cell, p);
  }
  if (points[3] - points[0] == step_q && points[2] - points[1] == step_q) {
    straight_[size(axis)][1][column_of(cell, q)] |= std::uint32_t{1} << along(cell, q);
  }
}

void StripFinder::find(const BlockNeighbours& blocks) {
  for (int axis = 0; axis < 3; ++axis) {
    auto& ways = straight_[size(axis)];
    std::array<std::uint32_t, 2> total{};
    for (std::size_t way = 0; way < 2; ++way) {
      for (const std::uint32_t bits : ways[way]) total[way] += bit_count(bits);
    }
    // First along the axis that more edges are straight along.
    for (const std::size_t way : {total[1] > total[0] ? 1u : 0u, total[1] > total[0] ? 0u : 1u}) {
      const int run = (axis + 1 + static_cast<int>(way)) % 3;
      const int other = (axis + 2 - static_cast<int>(way)) % 3;
      for (std::size_t column = 0; column < ways[way].size(); ++column) {
        for (std::uint32_t bits = ways[way][column]; bits != 0;) {
          const int first = std::countr_zero(bits);
          const int length = std::countr_one(bits >> first);
          const std::uint64_t gone = ((std::uint64_t{1} << length) - 1) << first;
          bits &= ~static_cast<std::uint32_t>(gone);
          if (length < 2) continue;
          const Strip strip{place_of(column, run, first), static_cast<std::uint8_t>(axis),
                            static_cast<std::uint8_t>(run), static_cast<std::uint8_t>(length)};
          add_strip(blocks, strip);
          for (int n = 0; n < length; ++n) {
            const LocalPlace cell = moved(strip.cell, run, n);
            ways[1 - way][column_of(cell, other)] &= ~(std::uint32_t{1} << along(cell, other));
          }
        }
      }
    }
  }
  straight_ = {};
}

void StripFinder::add_strip(const BlockNeighbours& blocks, const Strip& strip) {
  blocks.own().strips.push_back(strip);
  for (int n = 0; n < strip.length; ++n) {
    edge_of(blocks, moved(strip.cell, strip.along, n), strip.axis).shape = EdgeShape::kStrip;
  }
  const auto ends = ends_of(strip);
  for (const LocalPlace& begin : {ends[0], ends[3]}) {
    for (int n = 1; n < strip.length; ++n) {
      LocalPlace at = moved(begin, strip.along, n);
      CellBlock& block = blocks.changeable(at);
      // Other threads may do so at the same time. Two edges of the strip meet here.
      std::atomic_ref(block.strip_uses[block.cell(at)]).fetch_add(2, std::memory_order_relaxed);
    }
  }
}

StripRails::StripRails(const BlockNeighbours& blocks, const Strip& strip) {
  const auto ends = ends_of(strip);
  for (int n = 0; n <= strip.length; ++n) {
    LocalPlace right = moved(ends[0], strip.along, n), left = moved(ends[3], strip.along, n);
    const CellBlock& right_block = blocks.of(right);
    if (right_block.is_kept(right_block.cell(right))) {
      forward_at[forward_count] = static_cast<std::uint8_t>(n);
      forward[forward_count++] = right_block.cell_vertex(right, 0);
    }
    const CellBlock& left_block = blocks.of(left);
    if (left_block.is_kept(left_block.cell(left))) {
      back_at[back_count] = static_cast<std::uint8_t>(n);
      back[back_count++] = left_block.cell_vertex(left, 0);
    }
  }
}

}  // namespace strata::contouring
