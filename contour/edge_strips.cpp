#include "contour/edge_strips.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <utility>

namespace strata::contouring {
namespace {

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

/// The axis that the runs of a strip lie side by side along.
int across(const Strip& strip) { return 3 - strip.axis - strip.along; }

/// The cell at a corner of a strip from which both axes go up.
LocalPlace low_corner(const Strip& strip) { return ring_of(strip.cell, strip.axis)[0]; }

Strip make_strip(const LocalPlace& cell, int axis, int along, int length) {
  Strip strip;
  strip.cell = cell;
  strip.axis = static_cast<std::uint8_t>(axis);
  strip.along = static_cast<std::uint8_t>(along);
  strip.length = static_cast<std::uint8_t>(length);
  return strip;
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
    std::array<std::uint32_t, 2> total{};
    for (std::size_t way = 0; way < 2; ++way) {
      for (const std::uint32_t bits : straight_[size(axis)][way]) total[way] += bit_count(bits);
    }
    // First along the axis that more edges are straight along.
    const std::size_t better = total[1] > total[0] ? 1 : 0;
    for (const std::size_t way : {better, 1 - better}) {
      if (total[way] == 0) continue;
      find_runs(axis, way);
      for (const Strip& strip : found_) {
        add_strip(blocks, strip);
        auto& rest = straight_[size(axis)][1 - way];
        for (int w = 0; w < strip.width; ++w) {
          for (int n = 0; n < strip.length; ++n) {
            const LocalPlace cell = moved(moved(strip.cell, strip.along, n), across(strip), w);
            rest[column_of(cell, across(strip))] &=
                ~(std::uint32_t{1} << along(cell, across(strip)));
          }
        }
      }
    }
  }
  straight_ = {};
}

/// Whether all edges of a line are straight along the other axis as well.
bool StripFinder::is_flat(const Strip& line, int other) const {
  const int axis = line.axis;
  const Columns& columns = straight_[size(axis)][other == (axis + 1) % 3 ? 0 : 1];
  for (int n = 0; n < line.length; ++n) {
    const LocalPlace cell = moved(line.cell, line.along, n);
    if ((columns[column_of(cell, other)] >> along(cell, other) & 1) == 0) return false;
  }
  return true;
}

/// The runs of edges along one axis, and those of equal length side by side as one.
void StripFinder::find_runs(int axis, std::size_t way) {
  const int run = (axis + 1 + static_cast<int>(way)) % 3, other = 3 - axis - run;
  found_.clear();
  for (int at = 0; at < kBlockSide; ++at) {
    open_.clear();  // of the line before; they may be widened
    for (int line = 0; line < kBlockSide; ++line) {
      next_.clear();
      const std::size_t column =
          axis < other ? CellBlock::column(at, line) : CellBlock::column(line, at);
      for (std::uint32_t bits = straight_[size(axis)][way][column]; bits != 0;) {
        const int first = std::countr_zero(bits);
        const int length = std::countr_one(bits >> first);
        bits &= ~static_cast<std::uint32_t>(((std::uint64_t{1} << length) - 1) << first);
        if (length < 2) continue;
        const Strip strip = make_strip(place_of(column, run, first), axis, run, length);
        if (!is_flat(strip, other)) {
          found_.push_back(strip);
          continue;
        }
        const auto before = std::find_if(open_.begin(), open_.end(), [&](const Strip& one) {
          return along(one.cell, run) == first && one.length == length;
        });
        next_.push_back(before == open_.end() ? strip : *before);
        if (before == open_.end()) continue;
        ++next_.back().width;
        open_.erase(before);
      }
      found_.insert(found_.end(), open_.begin(), open_.end());
      std::swap(open_, next_);
    }
    found_.insert(found_.end(), open_.begin(), open_.end());
  }
}

void StripFinder::add_strip(const BlockNeighbours& blocks, const Strip& strip) const {
  CellBlock& own = blocks.own();
  own.strips.push_back(strip);
  const LocalPlace begin = low_corner(strip);
  for (int w = 0; w <= strip.width; ++w) {
    for (int n = 0; n <= strip.length; ++n) {
      const bool side = w == 0 || w == strip.width, end = n == 0 || n == strip.length;
      if (w < strip.width && n < strip.length) {
        edge_of(blocks, moved(moved(strip.cell, strip.along, n), across(strip), w), strip.axis)
            .shape = EdgeShape::kStrip;
      }
      if (side && end) continue;  // a corner is needed
      LocalPlace at = moved(moved(begin, strip.along, n), across(strip), w);
      const auto edges = static_cast<std::uint8_t>(side || end ? 2 : 4);  // that meet here
      CellBlock& block = blocks.changeable(at);
      std::uint8_t& uses = block.strip_uses[block.cell(at)];
      if (&block == &own && std::max({at.i, at.j, at.k}) < kBlockSide - 1) {
        uses = static_cast<std::uint8_t>(uses + edges);
      } else {  // threads of other blocks may do so at the same time
        std::atomic_ref(uses).fetch_add(edges, std::memory_order_relaxed);
      }
    }
  }
}

StripOutline::StripOutline(const BlockNeighbours& blocks, const Strip& strip) {
  // The run goes up along the first side, so it is counter-clockwise if the other axis follows.
  const bool follows = strip.along == (strip.axis + 1) % 3;
  LocalPlace at = low_corner(strip);
  if (!follows) at = moved(at, across(strip), strip.width);
  const int up = follows ? 1 : -1;  // along the other axis, at the end of the run
  int place = 0;
  const auto go = [&](std::size_t side, int axis, int step, int cells) {
    corners_[side] = count_;
    for (int step_count = 0; step_count < cells; ++step_count) {
      LocalPlace cell = at;
      const CellBlock& block = blocks.of(cell);
      if (const std::uint32_t n = block.cell(cell); block.is_kept(n)) {
        along_[count_] = static_cast<std::uint8_t>(place);
        vertices_[count_++] = block.cell_vertex(n, 0);
      }
      at = moved(at, axis, step);
      if (axis == strip.along) place += step;
    }
  };
  go(0, strip.along, 1, strip.length);
  go(1, across(strip), up, strip.width);
  go(2, strip.along, -1, strip.length);
  go(3, across(strip), -up, strip.width);
  vertices_[count_] = vertices_[0];
}

}  // namespace strata::contouring
