#include "contour/cell_blocks.h"

#include <algorithm>

namespace strata::contouring {
namespace {

constexpr std::uint64_t kAll = (std::uint64_t{1} << CellBlock::kWords) - 1;

/// Columns of a block's words from a block: those of its own places, or its last ones.
struct ColumnPart {
  int from = 0, to = 0;  ///< of the source
  int shift = 0;         ///< to the target
};
constexpr ColumnPart column_part(bool below) {
  return below ? ColumnPart{kBlockSide - 1, kBlockSide, -kBlockSide} : ColumnPart{0, kBlockSide, 0};
}

/// Counts what each column has, and finds the cells that the surface passes.
void count_columns(CellBlock& block) {
  std::array<std::uint32_t, 4> sum{};
  for (int i = 0; i < kBlockSide; ++i) {
    for (int j = 0; j < kBlockSide; ++j) {
      const std::size_t c = CellBlock::column(i, j);
      const std::uint64_t w[4] = {block.word(i - 1, j - 1), block.word(i, j - 1),
                                  block.word(i - 1, j), block.word(i, j)};
      const std::uint64_t all = w[0] & w[1] & w[2] & w[3], any = w[0] | w[1] | w[2] | w[3];
      block.active[c] = static_cast<std::uint32_t>((any | any >> 1) & ~(all & all >> 1));
      for (std::size_t n = 0; n < 4; ++n) block.before[n][c] = static_cast<std::uint16_t>(sum[n]);
      if (block.active[c] == 0) continue;  // no edge of the column is cut either
      for_each_axis([&](auto axis) { sum[axis] += bit_count(block.cut(axis, i, j)); });
      sum[3] += bit_count(block.active[c]);
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    block.first_crossing[axis + 1] = block.first_crossing[axis] + sum[axis];
  }
  block.cells = sum[3];
}

/// Lists the cells, and those that have several vertices.
void list_cells(CellBlock& block) {
  const auto& cases = cell_cases();
  block.places.reserve(block.cells);
  block.corners.reserve(block.cells);
  for (int i = 0; i < kBlockSide; ++i) {
    for (int j = 0; j < kBlockSide; ++j) {
      const std::size_t column = CellBlock::column(i, j);
      for (std::uint32_t left = block.active[column]; left != 0; left &= left - 1) {
        const int k = std::countr_zero(left);
        const unsigned corners = block.corners_at(i, j, k);
        const auto n = static_cast<std::uint32_t>(block.places.size());
        block.places.push_back(static_cast<std::uint16_t>(column * kBlockSide + size(k)));
        block.corners.push_back(static_cast<std::uint8_t>(corners));
        if (!cases[corners].special) continue;
        block.special = true;
        ++block.ambiguous;
        if (cases[corners].cycles < 2) continue;
        block.split.push_back({n, block.split_vertices});
        block.split_vertices += cases[corners].cycles - 1u;
      }
    }
  }
  block.at_fan.resize(block.cells);
  block.strip_uses.resize(block.cells);
}

}  // namespace

std::uint32_t CellBlock::split_point(std::uint32_t n, unsigned cycle) const {
  const auto found = std::lower_bound(
      split.begin(), split.end(), n,
      [](const SplitCell& one, std::uint32_t wanted) { return one.cell < wanted; });
  return cells + found->first + cycle - 1;
}

const CellBlocks::Place* CellBlocks::find(const glm::ivec3& at) const {
  if (at.x < 0 || at.y < 0 || at.z < 0) return nullptr;
  const Key key = packed(at);
  const auto found =
      std::lower_bound(places_.begin(), places_.end(), key,
                       [](const Place& one, Key wanted) { return one.key < wanted; });
  return found != places_.end() && found->key == key ? &*found : nullptr;
}

// Blocks with cut edges, and all blocks around them: cells reach up, and look at voxels below.
void CellBlocks::find_places(const GridCrossings& crossings) {
  std::vector<Key> own, keys;
  crossings.for_each_block([&](const glm::ivec3& block) { own.push_back(packed(block)); });
  std::sort(own.begin(), own.end());
  own.erase(std::unique(own.begin(), own.end()), own.end());
  // Three times over, along one axis each.
  keys = own;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t count = keys.size();
    for (std::size_t n = 0; n < count; ++n) {
      for (int step = -1; step <= 1; step += 2) {
        glm::ivec3 at = unpacked(keys[n]);
        at[axis] += step;
        if (at[axis] >= 0 && at[axis] < crossings.blocks()[axis]) keys.push_back(packed(at));
      }
    }
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  }
  places_.resize(keys.size());
  for (std::size_t n = 0; n < keys.size(); ++n) places_[n].key = keys[n];
  std::vector<Key> cells;  // own blocks and those above them
  for (const Key key : own) {
    for (int step = 0; step < 8; ++step) {
      const glm::ivec3 at = unpacked(key) + glm::ivec3(step & 1, step >> 1 & 1, step >> 2);
      const glm::ivec3 beyond = crossings.blocks() - at;
      if (std::min({beyond.x, beyond.y, beyond.z}) > 0) cells.push_back(packed(at));
    }
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  std::size_t n = 0;
  for (const Key key : cells) {
    while (places_[n].key != key) ++n;
    with_cells_.push_back(static_cast<std::uint32_t>(n));
  }
}

// Carries the inside along z from block to block.
void CellBlocks::find_starts(const GridCrossings& crossings, const Execution& execution) {
  std::vector<std::size_t> columns;
  for (std::size_t n = 0; n < places_.size(); ++n) {
    if (n == 0 || places_[n].key >> 20 != places_[n - 1].key >> 20) columns.push_back(n);
  }
  columns.push_back(places_.size());
  parallel_for(execution, columns.size() - 1, [&](std::size_t index, int) {
    std::array<std::uint32_t, kBlockSide> inside{};
    for (std::size_t n = columns[index]; n < columns[index + 1]; ++n) {
      places_[n].start = inside;
      for (const CutEdge edge : crossings.block(2, unpacked(places_[n].key))) {
        inside[size(edge.u())] ^= std::uint32_t{1} << edge.v();
      }
    }
  });
}

// The words of a block, its cells, and where its edges are cut.
void CellBlocks::fill(const GridCrossings& crossings, Place& place) const {
  CellBlock& block = *place.block;
  const glm::ivec3 here = unpacked(place.key);
  for (int part = 0; part < 4; ++part) {
    const bool below_x = (part & 1) != 0, below_y = (part & 2) != 0;
    const glm::ivec3 at = here - glm::ivec3(below_x ? 1 : 0, below_y ? 1 : 0, 0);
    const Place* source = find(at);
    if (source == nullptr) continue;
    const ColumnPart u = column_part(below_x), v = column_part(below_y);
    const auto word = [&](int i, int j) -> std::uint64_t& {
      return block.words[size((i + u.shift + 1) * CellBlock::kWords + j + v.shift + 1)];
    };
    for (int i = u.from; i < u.to; ++i) {
      for (int j = v.from; j < v.to; ++j) {
        word(i, j) = (source->start[size(i)] >> j & 1) != 0 ? kAll : 0;
      }
    }
    for (const CutEdge edge : crossings.block(2, at)) {
      if (edge.u() < u.from || edge.v() < v.from) continue;
      word(edge.u(), edge.v()) ^= kAll & ~((std::uint64_t{2} << edge.k()) - 1);
    }
  }
  count_columns(block);
  list_cells(block);
  block.crossings.resize(block.first_crossing[3]);
  std::uint64_t found = 0;
  for_each_axis([&](auto axis) {
    for (const CutEdge edge : crossings.block(axis, here)) {
      const LocalPlace at = axis == 0   ? LocalPlace{edge.k(), edge.u(), edge.v()}
                            : axis == 1 ? LocalPlace{edge.u(), edge.k(), edge.v()}
                                        : LocalPlace{edge.u(), edge.v(), edge.k()};
      if ((block.cut(axis, at.i, at.j) >> at.k & 1) == 0) continue;  // the axes disagree
      block.crossings[block.crossing(axis, at)] = {
          edge.triangle(), static_cast<std::uint8_t>(edge.offset()), EdgeShape::kFan};
      ++found;
    }
  });
  block.guessed = block.crossings.size() - found;
}

Result<CellBlocks> CellBlocks::create(const GridCrossings& crossings, const Execution& execution,
                                      std::uint64_t memory_left) {
  CellBlocks result;
  result.find_places(crossings);
  result.bytes_ = result.places_.size() * sizeof(Place) +
                  result.with_cells_.size() * (sizeof(CellBlock) + sizeof(std::uint32_t));
  if (result.bytes_ > memory_left) {
    return fail(ErrorCode::kLimit,
                "the cells of the contour need {} bytes, but the memory limit of {} bytes leaves "
                "{}",
                result.bytes_, execution.memory_limit, memory_left);
  }
  result.find_starts(crossings, execution);
  parallel_for(execution, result.with_cells_.size(), [&](std::size_t n, int) {
    Place& place = result.places_[result.with_cells_[n]];
    place.block = std::make_unique<CellBlock>();
    result.fill(crossings, place);
  });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  for (const std::uint32_t n : result.with_cells_) {
    const CellBlock& block = *result.places_[n].block;
    result.bytes_ += block.crossings.size() * sizeof(CellBlock::Crossing) +
                     block.cells * (2 * sizeof(std::uint16_t) + 3) +
                     (block.cells + block.split_vertices) * sizeof(CellBlock::CellPoint);
  }
  return result;
}

BlockNeighbours CellBlocks::neighbours(std::size_t n) const {
  BlockNeighbours result;
  const glm::ivec3 here = place(n);
  for (int which = 0; which < 8; ++which) {
    const Place* found = which == 0
                             ? &places_[with_cells_[n]]
                             : find(here - glm::ivec3(which & 1, which >> 1 & 1, which >> 2));
    if (found == nullptr || !found->block) continue;
    result.blocks_[static_cast<std::size_t>(which)] = found->block.get();
    result.special_ = result.special_ || found->block->special;
  }
  return result;
}

}  // namespace strata::contouring
