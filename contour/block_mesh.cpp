#include "contour/block_mesh.h"

#include <algorithm>
#include <utility>

#include "contour/edge_strips.h"

namespace strata::contouring {
namespace {

/// A vertex that no edge with two triangles has.
constexpr std::uint32_t kNone = 0xffffffffu;
/// The edges at a cell's lower sides.
constexpr unsigned kLowEdges = 1u << 0 | 1u << 4 | 1u << 8;

}  // namespace

void number_vertices(CellBlock& block) {
  for (CellBlock::Crossing& crossing : block.crossings) {
    if (crossing.shape == EdgeShape::kFan) crossing.triangle = block.fans++;
  }
  block.kept_cells = block.cells;
  if (std::all_of(block.strip_uses.begin(), block.strip_uses.end(),
                  [](std::uint8_t uses) { return uses == 0; })) {
    return;
  }
  const auto& cases = cell_cases();
  block.kept_cells = 0;
  block.kept_number.assign(block.cells, CellBlock::kDropped);
  for (std::size_t n = 0; n < block.cells; ++n) {
    if (block.strip_uses[n] == bit_count(cases[block.corners[n]].cut)) continue;
    block.kept_number[n] = static_cast<std::uint16_t>(block.kept_cells++);
  }
}

void count_block(CellBlock& block, const BlockNeighbours& blocks) {
  for_each_cell(block, [&](const Cell& cell) {
    block.triangles += 2 * bit_count(cell.kind->cut & kLowEdges);
    if (block.at_fan[cell.number] == 0) return;
    for (int axis = 0; axis < 3; ++axis) {
      const auto edge = static_cast<unsigned>(axis) * 4;
      const bool cut = (cell.kind->cut >> edge & 1) != 0;
      if (cut && crossing_at(blocks, cell.at, edge).shape == EdgeShape::kFan) block.triangles -= 2;
      const FaceSegments& lines = kFaceSegments[cell.kind->low_face[size(axis)]];
      if (lines.count == 0) continue;
      const bool middles = blocks.special() && has_middles(blocks, cell, axis);
      if (middles) block.middles += lines.count;
      for (std::size_t n = 0; n < lines.count; ++n) {
        for (const unsigned e : {lines.at[n].from, lines.at[n].to}) {
          const unsigned end = face_edge(static_cast<unsigned>(axis), 0, e);
          if (crossing_at(blocks, cell.at, end).shape == EdgeShape::kFan) {
            block.triangles += middles ? 2 : 1;
          }
        }
      }
    }
  });
  for (const Strip& strip : block.strips) {
    block.triangles -= 2u * strip.length * strip.width;
    block.triangles += StripOutline(blocks, strip).triangles();
  }
}

std::uint32_t BlockMesh::fan_vertex(const Cell& cell, unsigned edge) const {
  LocalPlace at = edge_place(cell.at, edge);
  const CellBlock& block = blocks_.of(at);
  const auto& crossing = block.crossings[block.crossing(static_cast<int>(edge / 4), at)];
  if (crossing.shape != EdgeShape::kFan) return kNone;
  return static_cast<std::uint32_t>(block.first_vertex) + crossing.triangle;
}

void BlockMesh::write_fans(std::span<glm::dvec3> positions) const {
  if (block_.fans == 0) return;
  std::size_t next = block_.first_vertex, n = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < kBlockSide; ++i) {
      for (int j = 0; j < kBlockSide; ++j) {
        for (std::uint32_t left = block_.cut(axis, i, j); left != 0; left &= left - 1) {
          const CellBlock::Crossing& crossing = block_.crossings[n++];
          if (crossing.shape != EdgeShape::kFan) continue;
          glm::ivec3 at = lower_corner(low_, {i, j, std::countr_zero(left)}) + kLatticeSteps;
          at[axis] += crossing.offset - kLatticeSteps;
          positions[next++] = world(at);
        }
      }
    }
  }
}

void BlockMesh::write_points(std::span<glm::dvec3> positions) const {
  std::size_t n_split = block_.cells;
  std::size_t next = block_.first_vertex + block_.fans, next_split = next + block_.kept_cells;
  for_each_cell(block_, [&](const Cell& cell) {
    const glm::ivec3 corner = lower_corner(low_, cell.at);
    for (unsigned cycle = 0; cycle < cell.kind->cycles; ++cycle) {
      const CellBlock::CellPoint& point = block_.points[cycle == 0 ? cell.number : n_split++];
      if (cycle == 0 && !block_.is_kept(cell.number)) continue;
      positions[cycle == 0 ? next++ : next_split++] =
          world(corner + glm::ivec3(point[0], point[1], point[2]));
    }
  });
}

/// The edges with two triangles at the lower side of a cell.
void BlockMesh::write_pairs(const Cell& cell, std::span<glm::uvec3> triangles) {
  for_each_axis([&](auto axis) {
    constexpr unsigned kEdge = 4 * axis;
    if ((cell.kind->cut >> kEdge & 1) == 0) return;
    const EdgeShape shape = crossing_at(blocks_, cell.at, kEdge).shape;
    if (shape == EdgeShape::kFan || shape == EdgeShape::kStrip) return;
    std::array<std::uint32_t, 4> v;
    for (std::size_t n = 0; n < 4; ++n) {
      const auto found = columns_.below(kRingBelow<axis>[n]);
      v[n] = found.block->cell_vertex(found.number, 0);
    }
    if (shape == EdgeShape::kDiagonal13) v = {v[1], v[2], v[3], v[0]};
    // Seen from the end of the edge they are counter-clockwise; the end is outside or inside.
    if (!cell.kind->low_inside) std::swap(v[1], v[3]);
    triangles[next_triangle_++] = {v[0], v[1], v[2]};
    triangles[next_triangle_++] = {v[0], v[2], v[3]};
  });
}

void BlockMesh::write_strip(const Strip& strip, std::span<glm::uvec3> triangles) {
  const bool outward = case_at(blocks_, strip.cell).low_inside;
  StripOutline(blocks_, strip).triangulate([&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    triangles[next_triangle_++] = outward ? glm::uvec3(x, y, z) : glm::uvec3(x, z, y);
  });
}

// The middle of a line through a cell's lower face. Where it cuts off a corner of the face it lies
// on the corner's side of the straight line, so that the lines of two opposite corners stay apart.
glm::dvec3 BlockMesh::middle(const Cell& cell, unsigned axis, const FaceSegment& line) const {
  const auto offset = [&](unsigned e) {
    return static_cast<int>(crossing_at(blocks_, cell.at, face_edge(axis, 0, e)).offset);
  };
  const int p = static_cast<int>((axis + 1) % 3), q = static_cast<int>((axis + 2) % 3);
  glm::ivec3 at = lower_corner(low_, cell.at);
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

/// The triangles of fans at a cell's lower face.
void BlockMesh::write_face(const Cell& cell, int axis, std::span<glm::dvec3> positions,
                           std::span<glm::uvec3> triangles) {
  const auto a = static_cast<unsigned>(axis);
  const FaceSegments& lines = kFaceSegments[cell.kind->low_face[a]];
  if (lines.count == 0) return;
  LocalPlace below = lowered(cell.at, axis);
  const CellCase* kind = blocks_.special() ? &case_at(blocks_, below) : nullptr;
  const bool middles = kind != nullptr && has_middles(blocks_, cell, axis);
  const CellBlock& block = blocks_.of(below);
  for (unsigned n = 0; n < lines.count; ++n) {
    const FaceSegment line = lines.at[n];
    const unsigned edge = face_edge(a, 0, line.from);
    const std::uint32_t from = fan_vertex(cell, edge);
    const std::uint32_t to = fan_vertex(cell, face_edge(a, 0, line.to));
    if (from == kNone && to == kNone) continue;
    const std::uint32_t low = block.cell_vertex(
        block.cell(below), kind != nullptr ? kind->cycle[face_edge(a, 1, line.from)] : 0);
    const std::uint32_t high = block_.cell_vertex(cell.number, cell.kind->cycle[edge]);
    const auto add = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
      if (x != kNone) triangles[next_triangle_++] = {x, y, z};
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

void BlockMesh::write(std::span<glm::dvec3> positions, std::span<glm::uvec3> triangles) {
  write_fans(positions);
  write_points(positions);
  next_triangle_ = block_.first_triangle;
  next_middle_ = block_.vertices() - block_.middles;
  for_each_cell(block_, [&](const Cell& cell) {
    columns_.go_to(cell.at);
    write_pairs(cell, triangles);
    if (block_.at_fan[cell.number] == 0) return;
    for (int axis = 0; axis < 3; ++axis) write_face(cell, axis, positions, triangles);
  });
  for (const Strip& strip : block_.strips) write_strip(strip, triangles);
}

}  // namespace strata::contouring
