#include "contour/block_mesh.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "strata/raster/lattice_mesh.h"

namespace strata::contouring {
namespace {

std::size_t size(int value) { return static_cast<std::size_t>(value); }

/// Calls visit(i, j, k) for the cells of a block that the surface passes.
template <class Visit>
void for_each_cell(const CellBlock& block, Visit&& visit) {
  for (int i = 0; i < kBlockSide; ++i) {
    for (int j = 0; j < kBlockSide; ++j) {
      for (std::uint32_t left = block.active[CellBlock::column(i, j)]; left != 0;
           left &= left - 1) {
        visit(LocalPlace{i, j, std::countr_zero(left)});
      }
    }
  }
}

LocalPlace lowered(LocalPlace at, int axis) {
  (axis == 0 ? at.i : axis == 1 ? at.j : at.k) -= 1;
  return at;
}

/// The case of the cell below another across a face.
const CellCase& case_below(const BlockNeighbours& blocks, const LocalPlace& cell, int axis) {
  LocalPlace at = lowered(cell, axis);
  const CellBlock& block = blocks.of(at);
  return cell_cases()[block.corners(at.i, at.j, at.k)];
}

/// Whether the lines through a cell's lower face get vertices in their middles.
bool has_middles(const BlockNeighbours& blocks, const LocalPlace& at, const CellCase& kind,
                 int axis) {
  const unsigned face = kind.low_face[size(axis)];
  return is_ambiguous(face) || kind.cycles > 1 || case_below(blocks, at, axis).cycles > 1;
}

/// Where an edge of a cell is: what the block of the edge calls it.
LocalPlace edge_place(const LocalPlace& cell, unsigned edge) {
  const int d = static_cast<int>(edge & 1) - 1, e = static_cast<int>(edge >> 1 & 1) - 1;
  switch (edge / 4) {
    case 0:
      return {cell.i, cell.j + d, cell.k + e};
    case 1:
      return {cell.i + d, cell.j, cell.k + e};
    default:
      return {cell.i + d, cell.j + e, cell.k};
  }
}

/// Its lower end, in lattice steps from the cell's lower corner.
glm::ivec3 edge_start(unsigned edge) {
  const int d = static_cast<int>(edge & 1) * kLatticeSteps;
  const int e = static_cast<int>(edge >> 1 & 1) * kLatticeSteps;
  switch (edge / 4) {
    case 0:
      return {0, d, e};
    case 1:
      return {d, 0, e};
    default:
      return {d, e, 0};
  }
}

}  // namespace

void count_block(CellBlock& block, const BlockNeighbours& blocks) {
  const auto& cases = cell_cases();
  std::uint64_t segments = 0;
  for_each_cell(block, [&](const LocalPlace& at) {
    const CellCase& kind = cases[block.corners(at.i, at.j, at.k)];
    segments += kind.segments;
    if (!blocks.special()) return;
    for (int axis = 0; axis < 3; ++axis) {
      const std::uint32_t lines = kFaceSegments[kind.low_face[size(axis)]].count;
      if (lines > 0 && has_middles(blocks, at, kind, axis)) block.middles += lines;
    }
  });
  block.triangles = 2 * segments + 2 * block.middles;
}

const CellBlock::Crossing& BlockMesh::crossing_at(const Cell& cell, unsigned edge) const {
  LocalPlace at = edge_place(cell.at, edge);
  const CellBlock& block = blocks_.of(at);
  return block.crossings[block.crossing(static_cast<int>(edge / 4), at)];
}

std::uint32_t BlockMesh::crossing_vertex(const Cell& cell, unsigned edge) const {
  LocalPlace at = edge_place(cell.at, edge);
  const CellBlock& block = blocks_.of(at);
  return static_cast<std::uint32_t>(block.first_vertex) +
         block.crossing(static_cast<int>(edge / 4), at);
}

CellCut BlockMesh::cut_of(const Cell& cell, unsigned edge) const {
  const CellBlock::Crossing& found = crossing_at(cell, edge);
  const int axis = static_cast<int>(edge / 4);
  CellCut cut;
  cut.point = edge_start(edge);
  cut.point[axis] = found.offset;
  if (found.triangle == CutEdge::kGridFace) {
    cut.plane.normal[axis] = 1.0;
    cut.plane.offset = found.offset;
  } else if (found.triangle != CutEdge::kNoTriangle) {
    cut.plane = planes_[found.triangle];
    cut.plane.offset -= glm::dot(cut.plane.normal, glm::dvec3(corner(cell.at)));
  }
  return cut;
}

void BlockMesh::write_crossings(std::span<glm::dvec3> positions) const {
  std::size_t next = block_.first_vertex, n = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < kBlockSide; ++i) {
      for (int j = 0; j < kBlockSide; ++j) {
        for (std::uint32_t left = block_.cut(axis, i, j); left != 0; left &= left - 1) {
          glm::ivec3 at = corner({i, j, std::countr_zero(left)}) + kLatticeSteps;
          at[axis] += block_.crossings[n++].offset - kLatticeSteps;
          positions[next++] = world(at);
        }
      }
    }
  }
}

CellBounds BlockMesh::bounds_of(const LocalPlace& cell) const {
  CellBounds bounds;
  const glm::ivec3 voxel = low_ + glm::ivec3(cell.i, cell.j, cell.k);
  for (int axis = 0; axis < 3; ++axis) {
    if (voxel[axis] == 0) bounds.low[axis] = kLatticeSteps / 2;
    if (voxel[axis] == grid_.dims[axis]) bounds.high[axis] = kLatticeSteps / 2;
  }
  return bounds;
}

void BlockMesh::write_cells(std::span<glm::dvec3> positions) {
  const auto& cases = cell_cases();
  std::size_t next = block_.first_vertex + block_.first_crossing[3];
  std::size_t next_split = next + block_.cells;
  for_each_cell(block_, [&](const LocalPlace& at) {
    const Cell cell{at, &cases[block_.corners(at.i, at.j, at.k)]};
    for (unsigned cycle = 0; cycle < cell.kind->cycles; ++cycle) {
      std::array<CellCut, 12> cuts;
      std::size_t count = 0;
      for (unsigned left = cell.kind->cut; left != 0; left &= left - 1) {
        const auto edge = static_cast<unsigned>(std::countr_zero(left));
        if (cell.kind->cycle[edge] == cycle) cuts[count++] = cut_of(cell, edge);
      }
      const auto used = std::span(cuts).first(count);
      const CellVertex vertex = cell.kind->cycles == 1 ? feature_vertex(used, bounds_of(at))
                                                       : mean_vertex(used, bounds_of(at));
      clamped_ += vertex.clamped ? 1 : 0;
      positions[cycle == 0 ? next++ : next_split++] = world(corner(at) + vertex.at);
    }
  });
}

// The middle of a line through a cell's lower face. Where it cuts off a corner of the face it lies
// on the corner's side of the straight line, so that the lines of two opposite corners stay apart.
glm::dvec3 BlockMesh::middle(const Cell& cell, unsigned axis, const FaceSegment& line) const {
  const auto offset = [&](unsigned e) {
    return static_cast<int>(crossing_at(cell, face_edge(axis, 0, e)).offset);
  };
  const int p = static_cast<int>((axis + 1) % 3), q = static_cast<int>((axis + 2) % 3);
  glm::ivec3 at = corner(cell.at);
  if (line.from % 2 == line.to % 2) {  // opposite edges
    at[line.from % 2 == 0 ? q : p] += kLatticeSteps / 2;
    at[line.from % 2 == 0 ? p : q] += (offset(line.from) + offset(line.to)) / 2;
    return world(at);
  }
  const unsigned along_p = line.from % 2 == 0 ? line.from : line.to;
  const unsigned along_q = line.from % 2 == 0 ? line.to : line.from;
  const auto halved = [&](unsigned e, bool from_high) {
    const int distance = from_high ? kLatticeSteps - offset(e) : offset(e);
    const int half = std::max(1, distance / 2);
    return from_high ? kLatticeSteps - half : half;
  };
  at[p] += halved(along_p, along_q == 1);  // the corner's side: edge 1 lies at the far end of p
  at[q] += halved(along_q, along_p == 2);
  return world(at);
}

void BlockMesh::write_face(const Cell& cell, int axis, std::span<glm::dvec3> positions,
                           std::span<glm::uvec3> triangles) {
  const auto a = static_cast<unsigned>(axis);
  const FaceSegments& lines = kFaceSegments[cell.kind->low_face[a]];
  if (lines.count == 0) return;
  LocalPlace below = lowered(cell.at, axis);
  const CellBlock& block = blocks_.of(below);
  const CellCase* kind = nullptr;
  bool middles = false;
  if (blocks_.special()) {
    kind = &case_below(blocks_, cell.at, axis);
    middles = has_middles(blocks_, cell.at, *cell.kind, axis);
  }
  for (unsigned n = 0; n < lines.count; ++n) {
    const FaceSegment line = lines.at[n];
    const unsigned edge = face_edge(a, 0, line.from);
    const std::uint32_t from = crossing_vertex(cell, edge);
    const std::uint32_t to = crossing_vertex(cell, face_edge(a, 0, line.to));
    const std::uint32_t low =
        static_cast<std::uint32_t>(block.first_vertex) +
        block.cell_vertex(below, kind != nullptr ? kind->cycle[face_edge(a, 1, line.from)] : 0);
    const std::uint32_t high = static_cast<std::uint32_t>(block_.first_vertex) +
                               block_.cell_vertex(cell.at, cell.kind->cycle[edge]);
    const auto add = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
      triangles[next_triangle_++] = {x, y, z};
    };
    if (!middles) {
      add(from, low, high);
      add(to, high, low);
      continue;
    }
    const auto mid = static_cast<std::uint32_t>(block_.first_vertex) + next_middle_++;
    positions[mid] = middle(cell, a, line);
    add(from, low, mid);
    add(from, mid, high);
    add(to, high, mid);
    add(to, mid, low);
  }
}

std::uint64_t BlockMesh::write(std::span<glm::dvec3> positions, std::span<glm::uvec3> triangles) {
  const auto& cases = cell_cases();
  write_crossings(positions);
  write_cells(positions);
  next_triangle_ = block_.first_triangle;
  next_middle_ = block_.vertices() - block_.middles;
  for_each_cell(block_, [&](const LocalPlace& at) {
    const Cell cell{at, &cases[block_.corners(at.i, at.j, at.k)]};
    for (int axis = 0; axis < 3; ++axis) write_face(cell, axis, positions, triangles);
  });
  return clamped_;
}

}  // namespace strata::contouring
