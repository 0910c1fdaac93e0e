#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <type_traits>
#include <vector>

#include "contour/cell_cycles.h"
#include "contour/grid_crossings.h"

// Blocks of 32 x 32 x 32 cells, and the numbers of all vertices. Private to contour/.
//
// Cell (i, j, k) has the corners (voxels) i - 1, i and so on, and belongs to the block of its upper
// corner, as the edges between i - 1 and i do. Places in a block are local: 0 to 31, or -1 for what
// the block below owns.

namespace strata::contouring {

/// A cell, edge or voxel in its own block.
struct LocalPlace {
  int i = 0, j = 0, k = 0;
};

/// Bits that are set; without the call that std::popcount is where no instruction may be assumed.
inline std::uint32_t bit_count(std::uint32_t bits) {
  bits -= bits >> 1 & 0x55555555u;
  bits = (bits & 0x33333333u) + (bits >> 2 & 0x33333333u);
  return ((bits + (bits >> 4)) & 0x0f0f0f0fu) * 0x01010101u >> 24;
}

/// Calls visit(axis) for 0, 1 and 2 as constants, which the code for each axis is made with.
template <class Visit>
void for_each_axis(Visit&& visit) {
  visit(std::integral_constant<int, 0>{});
  visit(std::integral_constant<int, 1>{});
  visit(std::integral_constant<int, 2>{});
}

/// The triangles around a cut edge: about the point where it is cut, or two between the four cells
/// there, which are numbered around the edge; or the edge is part of a strip.
enum class EdgeShape : std::uint8_t { kFan, kDiagonal02, kDiagonal13, kStrip };

/// Cut edges along `axis` side by side: those at the lower sides of cells of a block, from `cell`
/// on, `length` along one axis and `width` along the other.
struct Strip {
  LocalPlace cell;
  std::uint8_t axis = 0, along = 0, length = 1, width = 1;
};

/// The vertices of a block's part of a contour come in this order: fans, cells, further vertices of
/// cells, middles of faces.
class CellBlock {
 public:
  /// Of one cut edge: how far beyond the lower centre, and the triangle there.
  struct Crossing {
    std::uint32_t triangle = CutEdge::kNoTriangle;  ///< later the vertex in the block, of a fan
    std::uint8_t offset = CutEdge::kMiddle;
    EdgeShape shape = EdgeShape::kFan;
  };
  /// Lattice steps from a cell's lower corner.
  using CellPoint = std::array<std::uint8_t, 3>;
  /// A cell with several vertices.
  struct SplitCell {
    std::uint32_t cell = 0;   ///< its number
    std::uint32_t first = 0;  ///< of its further vertices in the block
  };

  static constexpr int kWords = kBlockSide + 1;

  /// Bit k + 1 is set where voxel (i, j, k) is inside; i, j, k from -1.
  [[nodiscard]] std::uint64_t word(int i, int j) const {
    return words[static_cast<std::size_t>((i + 1) * kWords + j + 1)];
  }
  /// Bit k is set where the edge along `axis` below voxel (i, j, k) is cut; from 0.
  [[nodiscard]] std::uint32_t cut(int axis, int i, int j) const {
    const std::uint64_t here = word(i, j);
    const std::uint64_t below = axis == 0 ? word(i - 1, j) : axis == 1 ? word(i, j - 1) : here << 1;
    return static_cast<std::uint32_t>((here ^ below) >> 1);
  }
  /// Which of the corners of a cell are inside; see contour/cell_cycles.h.
  [[nodiscard]] unsigned corners_at(int i, int j, int k) const {
    const auto two = [&](int a, int b) {
      return static_cast<unsigned>(word(a, b) >> static_cast<unsigned>(k)) & 3u;
    };
    const unsigned a = two(i - 1, j - 1), b = two(i, j - 1), c = two(i - 1, j), d = two(i, j);
    return (a & 1) | (b & 1) << 1 | (c & 1) << 2 | (d & 1) << 3 | (a >> 1) << 4 | (b >> 1) << 5 |
           (c >> 1) << 6 | (d >> 1) << 7;
  }
  static std::size_t column(int i, int j) { return static_cast<std::size_t>(i * kBlockSide + j); }
  /// The number of a cut edge in `crossings`. @pre it is cut and its place is not below 0
  [[nodiscard]] std::uint32_t crossing(int axis, const LocalPlace& at) const {
    const std::uint32_t below = (std::uint32_t{1} << at.k) - 1;
    return first_crossing[static_cast<std::size_t>(axis)] +
           before[static_cast<std::size_t>(axis)][column(at.i, at.j)] +
           bit_count(cut(axis, at.i, at.j) & below);
  }
  /// The number of a cell among the block's cells. @pre the surface passes it
  [[nodiscard]] std::uint32_t cell(const LocalPlace& at) const {
    const std::uint32_t below = (std::uint32_t{1} << at.k) - 1;
    const std::size_t c = column(at.i, at.j);
    return before[3][c] + bit_count(active[c] & below);
  }
  /// Whether the vertex of a cell is needed. @param n  number of the cell
  [[nodiscard]] bool is_kept(std::uint32_t n) const {
    return kept_number.empty() || kept_number[n] != kDropped;
  }
  /// The vertex of a cycle of a cell, in the mesh. @param n  number of the cell @pre it is kept
  [[nodiscard]] std::uint32_t cell_vertex(std::uint32_t n, unsigned cycle) const {
    const std::uint32_t first = static_cast<std::uint32_t>(first_vertex) + fans;
    if (cycle != 0) return first + kept_cells + split_point(n, cycle) - cells;
    return first + (kept_number.empty() ? n : kept_number[n]);
  }

  static constexpr std::uint16_t kDropped = 0xffff;

  std::array<std::uint64_t, kWords * kWords> words{};
  std::array<std::uint32_t, kBlockSide * kBlockSide> active{};  ///< bit k: cells passed
  /// By column: cut edges along x, y, z and cells that come before it.
  std::array<std::array<std::uint16_t, kBlockSide * kBlockSide>, 4> before{};
  std::array<std::uint32_t, 4> first_crossing{};  ///< by axis, and their number
  std::vector<Crossing> crossings;
  std::vector<SplitCell> split;  ///< increasing
  std::vector<Strip> strips;
  // By the number of a cell:
  std::vector<std::uint16_t> places;  ///< (i * 32 + j) * 32 + k
  std::vector<std::uint8_t> corners;  ///< which are inside
  std::vector<std::uint8_t> at_fan;   ///< whether its lower faces lie at a fan
  /// Cut edges of the cell in strips that do not end at it: without all others its vertex is not
  /// needed.
  std::vector<std::uint8_t> strip_uses;
  std::vector<std::uint16_t> kept_number;  ///< among the kept ones; none if all are kept
  std::vector<CellPoint> points;           ///< the vertices of cells, then the further ones
  std::uint32_t fans = 0, cells = 0, kept_cells = 0, split_vertices = 0, middles = 0;
  std::uint64_t triangles = 0;
  std::uint64_t ambiguous = 0, guessed = 0;            ///< counted for the report
  bool special = false;                                ///< some cell is
  std::uint64_t first_vertex = 0, first_triangle = 0;  ///< of the mesh

  [[nodiscard]] std::uint32_t vertices() const {
    return fans + kept_cells + split_vertices + middles;
  }

 private:
  [[nodiscard]] std::uint32_t split_point(std::uint32_t n, unsigned cycle) const;
};

/// A block and the seven below it.
class BlockNeighbours {
 public:
  [[nodiscard]] CellBlock& own() const { return *blocks_[0]; }
  /// The block of a place from -1, which becomes local there.
  [[nodiscard]] const CellBlock& of(LocalPlace& at) const { return *blocks_[which(at)]; }
  /// The same; null where there is no block.
  [[nodiscard]] const CellBlock* find(LocalPlace& at) const { return blocks_[which(at)]; }
  /// The same, to change an edge or a cell there.
  [[nodiscard]] CellBlock& changeable(LocalPlace& at) const { return *blocks_[which(at)]; }
  /// Whether a cell of one of the blocks is special.
  [[nodiscard]] bool special() const { return special_; }

 private:
  friend class CellBlocks;
  static unsigned which(LocalPlace& at) {
    const unsigned result = (at.i < 0 ? 1u : 0u) | (at.j < 0 ? 2u : 0u) | (at.k < 0 ? 4u : 0u);
    at = {at.i & (kBlockSide - 1), at.j & (kBlockSide - 1), at.k & (kBlockSide - 1)};
    return result;
  }
  std::array<CellBlock*, 8> blocks_{};  ///< null where there is none
  bool special_ = false;
};

/// All blocks that the surface passes, sorted by place.
class CellBlocks {
 public:
  /// Finds the cells. @return kLimit, kCancelled
  static Result<CellBlocks> create(const GridCrossings& crossings, const Execution& execution,
                                   std::uint64_t memory_left);

  [[nodiscard]] std::size_t count() const { return with_cells_.size(); }
  [[nodiscard]] CellBlock& block(std::size_t n) { return *places_[with_cells_[n]].block; }
  /// Blocks from the first one along each axis.
  [[nodiscard]] glm::ivec3 place(std::size_t n) const {
    return unpacked(places_[with_cells_[n]].key);
  }
  [[nodiscard]] BlockNeighbours neighbours(std::size_t n) const;
  [[nodiscard]] std::uint64_t memory_bytes() const { return bytes_; }

 private:
  using Key = std::uint64_t;  ///< [x:20 | y:20 | z:20]
  struct Place {
    Key key = 0;
    std::array<std::uint32_t, kBlockSide> start{};  ///< by u, bit v: inside below the block
    std::unique_ptr<CellBlock> block;
  };
  static Key packed(const glm::ivec3& at) {
    return static_cast<Key>(at.x) << 40 | static_cast<Key>(at.y) << 20 | static_cast<Key>(at.z);
  }
  static glm::ivec3 unpacked(Key key) {
    constexpr Key kMask = (Key{1} << 20) - 1;
    return {static_cast<int>(key >> 40), static_cast<int>(key >> 20 & kMask),
            static_cast<int>(key & kMask)};
  }
  [[nodiscard]] const Place* find(const glm::ivec3& at) const;
  void find_places(const GridCrossings& crossings);
  void find_starts(const GridCrossings& crossings, const Execution& execution);
  void fill(const GridCrossings& crossings, Place& place) const;

  std::vector<Place> places_;  ///< sorted by key
  std::vector<std::uint32_t> with_cells_;
  std::uint64_t bytes_ = 0;
};

}  // namespace strata::contouring
