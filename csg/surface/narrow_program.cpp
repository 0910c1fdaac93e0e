#include <algorithm>

#include "csg/surface/tile_surface.h"

// What cannot matter in a tile, and then in an area of it, is left out, where the tree is an
// intersection of solids, or of unions of them, minus others there: the bounds of their crossings
// tell between which depths the surface lies. A solid that ends before or begins behind is nothing,
// and one that all rays are in is everything.

namespace strata::csg {
namespace {

/// What is known of the crossings of a leaf, or of a union of leaves, in an area or a tile.
struct Extent {
  std::uint32_t nearest, farthest;  ///< of all crossings
  /// A ray that meets it is in it between these, at least.
  std::uint32_t last_entry, first_exit;
  bool covers;  ///< each ray meets it
};

/// Narrows the program of an area, or of a tile.
class Narrower {
 public:
  /// @param area  or AreaBounds::kTile @param window  that of the tile, which `program` is left of
  Narrower(std::span<LeafLayers> leaves, std::span<const ViewPart> parts, TileProgram& program,
           std::size_t area, const SurfaceWindow& window, std::vector<std::uint32_t>& around)
      : leaves_(leaves),
        parts_(parts),
        program_(program),
        area_(area),
        around_(around),
        window_(window) {}

  /// Whether the program is of the kind that is narrowed.
  bool fits();
  /// @param reach  of faces that coincide @return false: nothing is seen
  bool find_window(std::uint64_t reach);
  /// Leaves out what is not in the window.
  void filter();
  /// After that, the leaf whose entries, or whose exits, are all that is seen; kNoLeaf if there is
  /// none.
  [[nodiscard]] std::uint32_t alone() const { return alone_; }
  [[nodiscard]] const SurfaceWindow& window() const { return window_; }

 private:
  [[nodiscard]] LeafLayers& leaf_of(Program::Edge edge) { return leaves_[edge.child()]; }
  [[nodiscard]] TileProgram::Node& root() { return program_.nodes[program_.root]; }
  [[nodiscard]] std::span<Program::Edge> edges_of(const TileProgram::Node& node) {
    return std::span(program_.edges).subspan(node.first, node.count);
  }
  [[nodiscard]] Extent extent_of(const LeafLayers& leaf) const;
  [[nodiscard]] Extent extent_of(Program::Edge edge);
  [[nodiscard]] bool outside_of_window(const Extent& of) const {
    return of.nearest > window_.end + window_.margin ||
           of.farthest + window_.margin < window_.begin;
  }
  /// Keeps what of a union is in the window. @return the edge that is left of it
  Program::Edge filter_union(Program::Edge edge);
  void leave_out_exits(LeafLayers& leaf);
  /// The same for entries of a solid that is subtracted.
  void leave_out_entries(LeafLayers& leaf);
  void set_edges(TileProgram::Node& node, std::span<const Program::Edge> edges);
  /// TileProgram has edges so. @pre all are of leaves
  void sort_by_nearest(std::span<Program::Edge> edges) {
    std::ranges::sort(edges, [&](Program::Edge a, Program::Edge b) {
      const std::uint32_t at_a = leaf_of(a).nearest, at_b = leaf_of(b).nearest;
      return at_a != at_b ? at_a < at_b : a.bits < b.bits;
    });
  }

  std::span<LeafLayers> leaves_;
  std::span<const ViewPart> parts_;  ///< of the solids
  TileProgram& program_;
  std::size_t area_;
  std::vector<std::uint32_t>& around_;
  SurfaceWindow window_;
  std::uint32_t common_ = 0;  ///< edges of the root that are common to the result
  Program::Edge last_;        ///< the common edge that begins last
  std::vector<Program::Edge> kept_;
  std::uint32_t alone_ = TileFinder::kNoLeaf;
};

Extent Narrower::extent_of(const LeafLayers& leaf) const {
  if (!leaf.by_area || leaf.kind == LeafLayers::Kind::kSorted) {
    return {leaf.nearest, leaf.farthest, leaf.farthest, leaf.nearest, false};
  }
  // What holds in the tile holds in its areas, which are bounded with other roundings.
  constexpr std::size_t kTile = AreaBounds::kTile;
  const AreaBounds& of = leaf.bounds;
  return {of.nearest(area_), of.farthest(area_),
          std::min(of.entries.farthest[area_], of.entries.farthest[kTile]),
          std::max(of.exits.nearest[area_], of.exits.nearest[kTile]),
          (of.covered & (1u << area_ | 1u << kTile)) != 0};
}

Extent Narrower::extent_of(Program::Edge edge) {
  if (edge.leaf()) return extent_of(leaf_of(edge));
  Extent all{AreaBounds::kNever, 0, AreaBounds::kNever, 0, false};
  for (const Program::Edge operand : edges_of(program_.nodes[edge.child()])) {
    const Extent of = extent_of(leaf_of(operand));
    all.nearest = std::min(all.nearest, of.nearest);
    all.farthest = std::max(all.farthest, of.farthest);
    if (of.covers && of.last_entry < all.last_entry) {
      all.last_entry = of.last_entry;
      all.first_exit = of.first_exit;
      all.covers = true;
    }
  }
  if (!all.covers) all.last_entry = all.farthest, all.first_exit = all.nearest;
  return all;
}

bool Narrower::fits() {
  if (program_.depth > 2) return false;
  Program::Edge& first = program_.edges[root().first];
  if (!program_.root_inverted) {  // a solid alone is an intersection, too
    if (root().count > 1 || !first.leaf() || first.inverted() ||
        leaf_of(first).kind == LeafLayers::Kind::kFirstEntryOnly) {
      return false;
    }
    program_.root_inverted = true;
    first = Program::Edge(first.child(), true, true);
    program_.nearest[root().first] = 0;
  }
  const std::span<Program::Edge> edges = edges_of(root());
  const auto is_plain = [](Program::Edge edge) { return edge.leaf() && !edge.inverted(); };
  for (const Program::Edge edge : edges) {
    if (edge.leaf()) continue;
    if (!edge.inverted() ||
        !std::ranges::all_of(edges_of(program_.nodes[edge.child()]), is_plain)) {
      return false;
    }
  }
  const auto others = std::stable_partition(edges.begin(), edges.end(),
                                            [](Program::Edge edge) { return edge.inverted(); });
  common_ = static_cast<std::uint32_t>(others - edges.begin());
  return common_ > 0;
}

bool Narrower::find_window(std::uint64_t reach) {
  // A steep face may stand for any depth of its triangle, whatever its crossing, and coincides
  // with what is as far before or behind.
  std::uint64_t steep = 0;
  for (const std::uint32_t slot : program_.leaves) {
    const LeafLayers& leaf = leaves_[slot];
    if (!leaf.by_area) {
      if (program_.depth > 1) return true;
      const ViewPart& part = parts_[leaf.solid];
      steep = std::max<std::uint64_t>(steep, part.farthest - part.nearest);
    } else if ((leaf.bounds.steep_areas >> area_ & 1) != 0) {
      steep = std::max<std::uint64_t>(steep, leaf.bounds.steep_depth);
    }
  }
  window_.margin = std::min(window_.margin, reach + 2 * steep);
  const std::uint64_t margin = window_.margin;
  std::uint64_t &begin = window_.begin, &end = window_.end;
  const std::span<Program::Edge> edges = edges_of(root());
  // Others that end before the tile's window are left out already: the surface may lie behind them.
  std::uint64_t last_entry = begin, first_exit = AreaBounds::kNever, latest = 0;
  for (const Program::Edge edge : edges.first(common_)) {
    const Extent of = extent_of(edge);
    if (of.nearest >= latest) last_ = edge;
    latest = std::max<std::uint64_t>(latest, of.nearest);
    end = std::min<std::uint64_t>(end, of.farthest);
    last_entry = std::max<std::uint64_t>(last_entry, of.last_entry);
    first_exit = std::min<std::uint64_t>(first_exit, of.first_exit);
  }
  begin = std::max(begin, latest);
  // Where all rays are in one of the others there, the surface is behind it.
  for (bool moved = true; moved;) {
    moved = false;
    for (const Program::Edge edge : edges.subspan(common_)) {
      const Extent of = extent_of(edge);
      if (of.covers && of.last_entry + margin < begin && of.first_exit > begin) {
        begin = of.first_exit;
        window_.cover = edge;
        moved = true;
      }
      if (of.nearest <= last_entry + margin && of.farthest > last_entry) {
        last_entry = of.farthest;
        moved = true;
      }
    }
  }
  if (last_entry + margin < first_exit) end = std::min(end, last_entry);
  return begin <= end;
}

void Narrower::leave_out_exits(LeafLayers& leaf) {
  if (!leaf.by_area || leaf.kind != LeafLayers::Kind::kConvex) return;
  if (extent_of(leaf).first_exit > window_.end + window_.margin) {
    leaf.left_out = LeafLayers::LeftOut::kExits;
  }
}

void Narrower::leave_out_entries(LeafLayers& leaf) {
  if (!leaf.by_area || leaf.kind != LeafLayers::Kind::kConvex) return;
  if (extent_of(leaf).last_entry + window_.margin >= window_.begin) return;
  leaf.left_out = LeafLayers::LeftOut::kEntries;
  leaf.nearest = 0;
}

void Narrower::set_edges(TileProgram::Node& node, std::span<const Program::Edge> edges) {
  std::copy(edges.begin(), edges.end(), program_.edges.begin() + node.first);
  node.count = static_cast<std::uint32_t>(edges.size());
  for (std::uint32_t i = 0; i < node.count; ++i) {
    const Program::Edge edge = edges[i];
    program_.nearest[node.first + i] = edge.inverted() ? 0 : leaf_of(edge).nearest;
    if (edge.leaf()) program_.leaves.push_back(edge.child());
  }
}

Program::Edge Narrower::filter_union(Program::Edge edge) {
  TileProgram::Node& node = program_.nodes[edge.child()];
  kept_.clear();
  for (const Program::Edge operand : edges_of(node)) {
    if (outside_of_window(extent_of(leaf_of(operand)))) continue;
    leave_out_exits(leaf_of(operand));
    kept_.push_back(operand);
  }
  if (kept_.size() == 1) return Program::Edge(kept_.front().child(), true, true);
  sort_by_nearest(kept_);
  set_edges(node, kept_);
  return edge;
}

void Narrower::filter() {
  const std::span<Program::Edge> edges = edges_of(root());
  program_.leaves.clear();
  program_.depth = 1;
  std::uint32_t count = 0;
  bool last_is_around = false;
  for (Program::Edge edge : edges.first(common_)) {
    if (!edge.leaf()) {
      edge = filter_union(edge);
      if (!edge.leaf()) program_.depth = 2;
    } else {
      LeafLayers& leaf = leaf_of(edge);
      leave_out_exits(leaf);
      const Extent of = extent_of(leaf);
      if (of.covers && of.first_exit > window_.end + window_.margin &&
          of.last_entry + window_.margin < window_.begin) {
        if (edge.bits != last_.bits) {
          around_.push_back(leaf.solid);
          continue;
        }
        last_is_around = true;  // kept: the tree must not be true before the window
      }
    }
    edges[count++] = edge;
  }
  const std::uint32_t common = count;
  for (const Program::Edge edge : edges.subspan(common_)) {
    LeafLayers& leaf = leaf_of(edge);
    if (outside_of_window(extent_of(leaf))) continue;
    leave_out_exits(leaf);
    leave_out_entries(leaf);
    edges[count++] = edge;
  }
  sort_by_nearest(edges.first(count).subspan(common));
  set_edges(root(), edges.first(count));
  if (common == 1 && edges.front().leaf()) {
    const LeafLayers& first = leaf_of(edges.front());
    if (count == 1 && first.left_out == LeafLayers::LeftOut::kExits) alone_ = edges.front().child();
    if (count == 2 && last_is_around && edges[1].bits == window_.cover.bits)
      alone_ = edges[1].child();
  }
}

}  // namespace

std::uint32_t farthest_reach(const Coincidence::Range& range) {
  const double nearness = range.intercept;
  const double reach = range.constant + range.quadratic * nearness * nearness + 4.0;
  return static_cast<std::uint32_t>(std::min(reach, static_cast<double>(kPictureDepthLimit)));
}

bool TileFinder::narrow(std::size_t area) {
  Narrower narrower(leaves_, view_parts_, tile_program_, area, window_, around_);
  if (!narrower.fits()) return true;
  if (!narrower.find_window(farthest_reach(coincidence_->range()))) return false;
  narrower.filter();
  alone_ = narrower.alone();
  return true;
}

void TileFinder::narrow_tile(std::span<LeafLayers> leaves) {
  present_.clear();
  for (const std::uint32_t slot : in_tile_) {
    LeafLayers& leaf = leaves[slot];
    if (leaf.by_area) {
      find_tile_bounds(leaf);
      leaf.nearest = leaf.bounds.nearest(AreaBounds::kTile);
      leaf.farthest = leaf.bounds.farthest(AreaBounds::kTile);
      if (leaf.nearest == AreaBounds::kNever) continue;
    }
    present_.push_back(slot);
  }
  in_tile_ = present_;
  simplifier_.simplify(leaves, present_, tile_program_);
  if (tile_program_.constant) return in_tile_.clear();
  Narrower narrower(leaves, view_parts_, tile_program_, AreaBounds::kTile, window_, around_);
  if (!narrower.fits()) return;
  narrowed_ = true;
  in_tile_.clear();
  if (!narrower.find_window(farthest_reach(coincidence_->range()))) return;
  narrower.filter();
  in_tile_ = tile_program_.leaves;
  window_ = narrower.window();
  tile_around_ = around_;
  narrowed_program_ = tile_program_;
}

bool TileFinder::take_narrowed_program() {
  is_present_.assign(leaves_.size(), 0);
  for (const std::uint32_t slot : present_) is_present_[slot] = 1;
  const auto absent = [&](Program::Edge edge) {
    return edge.leaf() && is_present_[edge.child()] == 0;
  };
  tile_program_ = narrowed_program_;
  around_ = tile_around_;
  TileProgram::Node& root = tile_program_.nodes[tile_program_.root];
  tile_program_.depth = 1;
  std::uint32_t count = 0;
  for (std::uint32_t i = root.first; i < root.first + root.count; ++i) {
    Program::Edge edge = tile_program_.edges[i];
    if (!edge.leaf()) {
      TileProgram::Node& node = tile_program_.nodes[edge.child()];
      const auto edges = std::span(tile_program_.edges).subspan(node.first, node.count);
      node.count = static_cast<std::uint32_t>(std::remove_if(edges.begin(), edges.end(), absent) -
                                              edges.begin());
      if (node.count == 0) return false;
      if (node.count == 1) {
        edge = Program::Edge(edges.front().child(), true, true);
      } else {
        tile_program_.depth = 2;
      }
    } else if (absent(edge)) {
      if (edge.inverted()) return false;
      continue;
    }
    tile_program_.edges[root.first + count++] = edge;
  }
  root.count = count;
  tile_program_.leaves = present_;
  return true;
}

}  // namespace strata::csg
