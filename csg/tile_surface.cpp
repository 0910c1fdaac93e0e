#include "csg/tile_surface.h"

#include <algorithm>
#include <new>
#include <numeric>

namespace strata::csg {

// --- Arena --------------------------------------------------------------------------------------

std::uint32_t* Arena::words(std::size_t count) {
  const std::size_t rounded = (count + 15) / 16 * 16;
  while (block_ < blocks_.size() && used_ + rounded > blocks_[block_].size) {
    ++block_;
    used_ = 0;
  }
  if (block_ == blocks_.size()) {
    const std::size_t size = std::max(rounded, kBlockWords);
    auto* words = static_cast<std::uint32_t*>(std::aligned_alloc(64, size * 4));
    if (words == nullptr) throw std::bad_alloc();
    blocks_.push_back({std::unique_ptr<std::uint32_t, Free>(words), size});
    used_ = 0;
  }
  std::uint32_t* result = blocks_[block_].words.get() + used_;
  used_ += rounded;
  return result;
}

void LeafLayers::add_layer(Arena& arena) {
  const std::size_t count = words();
  keys.push_back(arena.words(count));
  std::fill_n(keys.back(), count, kEmpty);
  triangles.push_back(arena.words(count));  // means nothing where there is no key
}

void UnitedLayers::clear(Arena& arena, const PixelRect& tile) {
  // Blocks of pixels may reach beyond the tile.
  constexpr std::size_t kWords = static_cast<std::size_t>(kTilePixels + 4 * kTileSide);
  u0 = tile.u0, v0 = tile.v0;
  for (std::uint32_t*& words : depths) {
    words = arena.words(kWords);
    std::fill_n(words, kWords, kEmpty);
  }
  for (std::uint32_t*& words : faces) words = arena.words(kWords);
  rest = arena.words(kWords);
  std::fill_n(rest, kWords, kEmpty);
  std::fill(std::begin(far), std::end(far), kEmpty);
  std::fill(std::begin(hidden), std::end(hidden), kEmpty);
  face_solids.clear();
  face_triangles.clear();
  more.clear();
}

bool UnitedLayers::hides(const PixelRect& clip, std::uint32_t nearest) {
  bool all = true;
  for_each_area(clip, [&](std::size_t area) { all = all && far[area] < nearest; });
  if (!all) return false;
  for_each_area(clip, [&](std::size_t area) { hidden[area] = std::min(hidden[area], nearest); });
  return true;
}

std::uint32_t UnitedLayers::add_face(const LatticeMesh& mesh, std::uint32_t solid,
                                     std::uint32_t triangle, bool steep) {
  const auto face = static_cast<std::uint32_t>(face_solids.size());
  face_solids.push_back(solid);
  face_triangles.push_back(triangle);
  more.push_back(0);
  if (!steep) return face;
  // No bound is more than the triangle is deep.
  const glm::uvec3& t = mesh.triangles[triangle];
  const auto [low, high] =
      std::minmax({mesh.vertices[t.x].z, mesh.vertices[t.y].z, mesh.vertices[t.z].z});
  constexpr auto kLimit = static_cast<std::int32_t>(kPictureDepthLimit);
  more.back() = static_cast<std::uint32_t>(std::clamp(high, 0, kLimit) - std::min(low, kLimit)) + 1;
  return face | kSteep;
}

// --- Simplifier ---------------------------------------------------------------------------------

Simplifier::Simplifier(const Program& program) : program_(&program), seen_(program.nodes.size()) {}

void Simplifier::simplify(std::span<const LeafLayers> leaves,
                          std::span<const std::uint32_t> present, TileProgram& out) {
  out.edges.clear();
  out.nearest.clear();
  out.nodes.clear();
  out.leaves.clear();
  out_idle_.clear();
  out_depth_.clear();
  out.constant = true;
  out.value = program_->idle_value();
  out.depth = 0;
  if (program_->nodes.empty()) return;

  // Marks what is above the leaves present, and lists the marked children of each node.
  ++stamp_;
  marked_.clear();
  children_.clear();
  for (const std::uint32_t slot : present) {
    Program::Up up = program_->leaves[leaves[slot].solid];
    std::uint32_t id = slot;
    bool leaf = true;
    while (up.parent != Program::kNone) {
      Seen& seen = seen_[up.parent];
      const bool known = seen.stamp == stamp_;
      if (!known) {
        seen.stamp = stamp_;
        seen.first_child = Program::kNone;
        marked_.push_back(up.parent);
      }
      children_.push_back({id, leaf, up.inverted, seen.first_child});
      seen.first_child = static_cast<std::uint32_t>(children_.size() - 1);
      if (known) break;
      id = up.parent;
      leaf = false;
      up = program_->nodes[id].up;
    }
  }
  const auto root = static_cast<std::uint32_t>(program_->nodes.size() - 1);
  if (marked_.empty() || seen_[root].stamp != stamp_) return;
  std::sort(marked_.begin(), marked_.end());

  for (const std::uint32_t id : marked_) {
    Seen& seen = seen_[id];
    seen.inverted = false;
    std::uint32_t absent_true = program_->nodes[id].idle_true;
    gathered_.clear();
    bool is_true = false;
    for (std::uint32_t c = seen.first_child; c != Program::kNone; c = children_[c].next) {
      const Child& child = children_[c];
      const bool idle = !child.leaf && program_->idle(child.id);
      absent_true -= idle != child.inverted ? 1 : 0;
      if (child.leaf) {
        const std::uint32_t nearest = child.inverted ? 0 : leaves[child.id].nearest;
        gathered_.push_back({Program::Edge(child.id, true, child.inverted), nearest});
        continue;
      }
      const Seen& below = seen_[child.id];
      const bool inverted = child.inverted != below.inverted;
      switch (below.kind) {
        case Seen::Kind::kTrue:
          is_true = is_true || !inverted;
          break;
        case Seen::Kind::kFalse:
          is_true = is_true || inverted;
          break;
        case Seen::Kind::kLeaf: {
          const std::uint32_t nearest = inverted ? 0 : leaves[below.leaf].nearest;
          gathered_.push_back({Program::Edge(below.leaf, true, inverted), nearest});
          break;
        }
        case Seen::Kind::kNode: {
          const TileProgram::Node& node = out.nodes[below.out];
          if (inverted) {
            const std::uint32_t nearest = out_idle_[below.out] != 0 ? node.nearest : 0;
            gathered_.push_back({Program::Edge(below.out, false, true), nearest});
          } else {  // a union in a union
            for (std::uint32_t e = node.first; e < node.first + node.count; ++e) {
              gathered_.push_back({out.edges[e], out.nearest[e]});
            }
          }
        }
      }
    }
    if (is_true || absent_true > 0) {
      seen.kind = Seen::Kind::kTrue;
    } else if (gathered_.empty()) {
      seen.kind = Seen::Kind::kFalse;
    } else if (gathered_.size() == 1) {
      const Program::Edge edge = gathered_.front().edge;
      seen.inverted = edge.inverted();
      seen.kind = edge.leaf() ? Seen::Kind::kLeaf : Seen::Kind::kNode;
      (edge.leaf() ? seen.leaf : seen.out) = edge.child();
    } else {
      std::sort(gathered_.begin(), gathered_.end(), [](const Sorted& a, const Sorted& b) {
        return a.nearest != b.nearest ? a.nearest < b.nearest : a.edge.bits < b.edge.bits;
      });
      seen.kind = Seen::Kind::kNode;
      seen.out = static_cast<std::uint32_t>(out.nodes.size());
      TileProgram::Node node{static_cast<std::uint32_t>(out.edges.size()),
                             static_cast<std::uint32_t>(gathered_.size()), 0xffffffffu};
      bool idle = false;
      int depth = 0;
      for (const Sorted& sorted : gathered_) {
        out.edges.push_back(sorted.edge);
        out.nearest.push_back(sorted.nearest);
        const std::uint32_t child = sorted.edge.child();
        node.nearest = std::min(
            node.nearest, sorted.edge.leaf() ? leaves[child].nearest : out.nodes[child].nearest);
        if (sorted.edge.leaf()) {
          idle = idle || sorted.edge.inverted();
        } else {
          idle = idle || (out_idle_[child] != 0) != sorted.edge.inverted();
          depth = std::max<int>(depth, out_depth_[child]);
        }
      }
      out.nodes.push_back(node);
      out_idle_.push_back(idle ? 1 : 0);
      out_depth_.push_back(static_cast<std::uint8_t>(std::min(255, depth + 1)));
    }
  }

  const Seen& top = seen_[root];
  const bool inverted = program_->root_inverted != top.inverted;
  if (top.kind == Seen::Kind::kTrue || top.kind == Seen::Kind::kFalse) {
    out.value = (top.kind == Seen::Kind::kTrue) != inverted;
    return;
  }
  out.constant = false;
  out.root_inverted = inverted;
  if (top.kind == Seen::Kind::kLeaf) {
    out.root = static_cast<std::uint32_t>(out.nodes.size());
    out.nodes.push_back(
        {static_cast<std::uint32_t>(out.edges.size()), 1, leaves[top.leaf].nearest});
    out.edges.emplace_back(top.leaf, true, false);
    out.nearest.push_back(leaves[top.leaf].nearest);
    out.leaves.push_back(top.leaf);
    out.depth = 1;
    return;
  }
  out.root = top.out;
  out.depth = out_depth_[top.out];
  stack_.assign(1, top.out);
  while (!stack_.empty()) {
    const TileProgram::Node& node = out.nodes[stack_.back()];
    stack_.pop_back();
    for (std::uint32_t e = node.first; e < node.first + node.count; ++e) {
      const Program::Edge edge = out.edges[e];
      (edge.leaf() ? out.leaves : stack_).push_back(edge.child());
    }
  }
}

// --- flips --------------------------------------------------------------------------------------

void flips_of(std::span<const DepthItem> crossings, std::uint32_t solid, InsideRule rule, bool cut,
              std::vector<Flip>& flips) {
  const auto is_inside = [rule](int winding) {
    switch (rule) {
      case InsideRule::kWinding:
        return winding > 0;
      case InsideRule::kNonzero:
        return winding != 0;
      case InsideRule::kParity:
        break;
    }
    return winding % 2 != 0;
  };
  int sum = 0;
  for (const DepthItem item : crossings) sum += item.exit() ? -1 : 1;
  const bool unbalanced = rule == InsideRule::kParity ? sum % 2 != 0 : sum != 0;
  if (unbalanced && !cut) {
    // Partners from the front, the last entry with the next exit; what is left becomes a sheet.
    struct Span {
      std::uint32_t begin, end, first, last;
    };
    std::vector<Span> spans;
    std::vector<DepthItem> open;
    for (const DepthItem item : crossings) {
      const bool closes = rule == InsideRule::kParity ? !open.empty() : item.exit();
      if (!closes) {
        open.push_back(item);
      } else if (open.empty()) {
        spans.push_back({item.depth(), item.depth() + 1, item.triangle(), item.triangle()});
      } else {
        spans.push_back(
            {open.back().depth(), item.depth(), open.back().triangle(), item.triangle()});
        open.pop_back();
      }
    }
    for (const DepthItem item : open) {
      spans.push_back({item.depth(), item.depth() + 1, item.triangle(), item.triangle()});
    }
    std::sort(spans.begin(), spans.end(), [](const Span& a, const Span& b) {
      if (a.begin != b.begin) return a.begin < b.begin;
      return a.end != b.end ? a.end < b.end : a.first < b.first;
    });
    for (std::size_t i = 0; i < spans.size();) {
      Span all = spans[i];
      for (++i; i < spans.size() && spans[i].begin <= all.end; ++i) {
        if (spans[i].end > all.end) all.end = spans[i].end, all.last = spans[i].last;
      }
      if (all.begin == all.end) continue;
      flips.push_back({all.begin, solid, all.first, false});
      flips.push_back({all.end, solid, all.last, true});
    }
    return;
  }
  int winding = cut ? -sum : 0;
  bool inside = is_inside(winding);
  if (inside) flips.push_back({0, solid, Surface::kNone, false});
  for (std::size_t i = 0; i < crossings.size();) {
    const std::size_t begin = i;
    const std::uint32_t depth = crossings[begin].depth();
    for (; i < crossings.size() && crossings[i].depth() == depth; ++i) {
      winding += crossings[i].exit() ? -1 : 1;
    }
    if (is_inside(winding) == inside) continue;
    std::size_t turns = begin;  // the first that faces the right way
    while (turns < i && crossings[turns].exit() != inside) ++turns;
    if (turns == i) turns = begin;
    flips.push_back({depth, solid, crossings[turns].triangle(), inside});
    inside = !inside;
  }
}

LeafLayers::Kind kind_of(const Program& program, std::uint32_t solid, const Geometry::Part& part,
                         const ViewPart& view_part) {
  if (!part.convex) return LeafLayers::Kind::kSorted;
  return program.plain(solid) && !view_part.cut ? LeafLayers::Kind::kFirst
                                                : LeafLayers::Kind::kConvex;
}

void first_entry_of(std::span<const DepthItem> crossings, std::uint32_t solid,
                    std::vector<Flip>& flips) {
  const auto entry =
      std::find_if(crossings.begin(), crossings.end(), [](DepthItem item) { return !item.exit(); });
  if (entry != crossings.end()) flips.push_back({entry->depth(), solid, entry->triangle(), false});
}

// --- TileFinder ---------------------------------------------------------------------------------

namespace {

/// Deeper nesting is walked pixel by pixel: asking nodes again for each answer would multiply.
constexpr int kMaxSearchDepth = 3;
constexpr int kAreaSide = LeafLayers::kLanes;

}  // namespace

TileFinder::TileFinder(const Program& program, const std::vector<ViewPart>& view_parts,
                       const std::vector<Geometry::Part>& parts, const View& view,
                       const Coincidence& coincidence)
    : program_(&program),
      view_parts_(view_parts),
      parts_(parts),
      view_(&view),
      coincidence_(&coincidence),
      simplifier_(program),
      finder_(program) {}

TileFinder::~TileFinder() = default;

TileFinder::Input TileFinder::input_of(std::uint32_t solid) {
  const ViewPart& part = view_parts_[solid];
  Input input;
  input.clip = {std::max(tile_.u0, part.rect.u0), std::max(tile_.v0, part.rect.v0),
                std::min(tile_.u1, part.rect.u1), std::min(tile_.v1, part.rect.v1)};
  if (part.binned) {
    input.triangles = part.bins.tile(tile_.u0 / kTileSide, tile_.v0 / kTileSide);
  } else {
    while (all_triangles_.size() < part.mesh.triangles.size()) {
      all_triangles_.push_back(static_cast<std::uint32_t>(all_triangles_.size()));
    }
    input.triangles = std::span(all_triangles_).first(part.mesh.triangles.size());
  }
  return input;
}

void TileFinder::make(LeafLayers& leaf) {
  leaf.made = true;
  leaf.areas = 0;
  const ViewPart& part = view_parts_[leaf.solid];
  const RasterTarget target{Axis::kZ, view_->size.x, view_->size.y, kPictureDepthLimit};
  const Input input = input_of(leaf.solid);
  fragments_ += raster_layers(part.mesh, target, input.triangles, input.clip,
                              coincidence_->steep_from(), leaf, arena_);
  if (!leaf.keys.empty()) normalize_layers(leaf, part.cut, *this);
}

void TileFinder::normalize_pixel(LeafLayers& leaf, std::size_t at) {
  crossings_.clear();
  bool steep = false;
  for (std::size_t k = 0; k < leaf.keys.size(); ++k) {
    if (leaf.keys[k][at] == LeafLayers::kEmpty) continue;
    const std::uint32_t key = leaf.keys[k][at], triangle = leaf.triangles[k][at];
    steep = steep || (triangle & LeafLayers::kSteep) != 0;
    crossings_.emplace_back(key >> 1, (key & 1) != 0, triangle & ~LeafLayers::kSteep);
    leaf.keys[k][at] = LeafLayers::kEmpty;
  }
  // Layers of convex solids are not sorted, and others by marked triangles.
  std::sort(crossings_.begin(), crossings_.end());
  leaf_flips_.clear();
  flips_of(crossings_, leaf.solid, parts_[leaf.solid].rule, view_parts_[leaf.solid].cut,
           leaf_flips_);
  while (leaf.keys.size() < leaf_flips_.size()) leaf.add_layer(arena_);
  for (std::size_t k = 0; k < leaf_flips_.size(); ++k) {
    leaf.keys[k][at] = leaf_flips_[k].depth;
    leaf.triangles[k][at] = leaf_flips_[k].triangle | (steep ? LeafLayers::kSteep : 0);
  }
  leaf.steep = leaf.steep || steep;
  if (!leaf_flips_.empty()) {
    leaf.nearest = std::min(leaf.nearest, leaf_flips_.front().depth);
    leaf.farthest = std::max(leaf.farthest, leaf_flips_.back().depth);
  }
}

void TileFinder::show(std::uint64_t pixel) {
  ++resolved_;
  const Surface surface = finder_.find(flips_, [&](const Flip& flip) {
    if (flip.triangle == Surface::kNone) return Coincidence::Bound{};
    return coincidence_->bound(view_parts_[flip.solid].mesh, flip.triangle, flip.depth);
  });
  part_.image->depth[pixel] = surface.depth;
  part_.image->solid[pixel] = surface.solid;
  part_.image->triangle[pixel] = surface.triangle | (surface.exit ? SurfaceImage::kExit : 0u);
}

void TileFinder::resolve(const TileProgram& program, std::uint64_t pixel) {
  const auto width = static_cast<std::uint64_t>(part_.image->width);
  const int u = part_.u0 + static_cast<int>(pixel % width);
  const int v = part_.v0 + static_cast<int>(pixel / width);
  flips_.clear();
  for (const std::uint32_t slot : program.leaves) {
    LeafLayers& leaf = leaves_[slot];
    if (v < leaf.rect.v0 || v >= leaf.rect.v1 || u < leaf.rect.u0 || u >= leaf.rect.u1) continue;
    if (!leaf.made) make(leaf);
    const auto at = static_cast<std::size_t>((v - leaf.rect.v0) * leaf.stride + (u - leaf.rect.u0));
    for (std::size_t k = 0; k < leaf.keys.size(); ++k) {
      if (leaf.keys[k][at] == LeafLayers::kEmpty) break;
      std::uint32_t triangle = leaf.triangles[k][at];
      if (triangle != Surface::kNone) triangle &= ~LeafLayers::kSteep;
      flips_.push_back({leaf.keys[k][at], leaf.solid, triangle, (k & 1) != 0});
    }
  }
  show(pixel);
}

bool TileFinder::show_united(std::uint64_t pixel) {
  const auto width = static_cast<std::uint64_t>(part_.image->width);
  const std::size_t at = united_.index(part_.u0 + static_cast<int>(pixel % width),
                                       part_.v0 + static_cast<int>(pixel / width));
  const double first = united_.depths[0][at];
  const Coincidence::Range range = coincidence_->range();
  const double nearness = range.a - static_cast<double>(range.b) * first;
  flips_.clear();
  double last = first + range.offset + range.square * nearness * nearness + 1;
  for (int k = 0; k < UnitedLayers::kKept; ++k) {
    const std::uint32_t depth = united_.depths[k][at];
    if (depth == UnitedLayers::kEmpty) break;
    const std::uint32_t face = united_.faces[k][at] & ~UnitedLayers::kSteep;
    const double more = united_.more[face];
    if (k == 0) {
      last += 2 * more;
    } else if (depth - more > last) {
      continue;
    }
    const std::uint32_t solid = united_.face_solids[face];
    // A ray enters a convex solid once, or nearly so.
    for (const Flip& flip : flips_) {
      if (flip.solid == solid) return false;
    }
    flips_.push_back({depth, solid, united_.face_triangles[face], false});
  }
  const auto area = static_cast<std::size_t>(
      static_cast<int>(pixel / width) % kTileSide / kAreaSide * UnitedLayers::kAreasAcross +
      static_cast<int>(pixel % width) % kTileSide / kAreaSide);
  if (std::min(united_.rest[at], united_.hidden[area]) <= last) return false;
  if (flips_.size() > 1) show(pixel);
  return true;
}

void TileFinder::find_united(std::span<LeafLayers> leaves) {
  const RasterTarget target{Axis::kZ, view_->size.x, view_->size.y, kPictureDepthLimit};
  united_.clear(arena_, tile_);
  present_.resize(leaves.size());
  std::iota(present_.begin(), present_.end(), 0u);
  std::sort(present_.begin(), present_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return leaves[a].nearest != leaves[b].nearest ? leaves[a].nearest < leaves[b].nearest : a < b;
  });
  for (const std::uint32_t slot : present_) {
    const LeafLayers& leaf = leaves[slot];
    const Input input = input_of(leaf.solid);
    if (united_.hides(input.clip, leaf.nearest)) continue;
    fragments_ += raster_united(view_parts_[leaf.solid].mesh, target, input.triangles, input.clip,
                                coincidence_->steep_from(), leaf.solid, united_);
    find_hidden(input.clip, coincidence_->range(), united_);
  }
  doubtful_.clear();
  csg::find_united(united_, tile_, coincidence_->range(), part_, doubtful_);
  bool simplified = false;
  for (const std::uint64_t pixel : doubtful_) {
    if (show_united(pixel)) continue;
    if (!simplified) {
      simplifier_.simplify(leaves, present_, tile_program_);
      simplified = true;
    }
    resolve(tile_program_, pixel);
  }
}

void TileFinder::find(int tile_u, int tile_v, std::span<const std::uint32_t> solids,
                      const SurfacePart& part) {
  part_ = part;
  tile_ = {tile_u * kTileSide, tile_v * kTileSide,
           std::min(view_->size.x, (tile_u + 1) * kTileSide),
           std::min(view_->size.y, (tile_v + 1) * kTileSide)};
  arena_.clear();
  if (leaves_.size() < solids.size()) leaves_.resize(solids.size());
  std::size_t count = 0;
  bool cut = false, united = true;
  for (const std::uint32_t solid : solids) {
    const ViewPart& view_part = view_parts_[solid];
    if (view_part.binned && view_part.bins.tile(tile_u, tile_v).empty()) continue;
    LeafLayers& leaf = leaves_[count++];
    leaf.made = false;
    leaf.steep = false;
    leaf.kind = kind_of(*program_, solid, parts_[solid], view_part);
    leaf.solid = solid;
    leaf.nearest = view_part.cut ? 0 : view_part.nearest;
    leaf.farthest = view_part.farthest;
    leaf.keys.clear();
    leaf.triangles.clear();
    const auto down = [&](int u) { return tile_.u0 + (u - tile_.u0) / kAreaSide * kAreaSide; };
    leaf.rect = {down(std::max(tile_.u0, view_part.rect.u0)), std::max(tile_.v0, view_part.rect.v0),
                 down(std::min(tile_.u1, view_part.rect.u1) + kAreaSide - 1),
                 std::min(tile_.v1, view_part.rect.v1)};
    leaf.stride = leaf.rect.u1 - leaf.rect.u0;
    if (leaf.rect.empty()) {
      --count;
      continue;
    }
    cut = cut || view_part.cut;
    united = united && leaf.kind == LeafLayers::Kind::kFirst;
  }
  if (count > 0 && united) return find_united(std::span(leaves_).first(count));
  for (int v = tile_.v0; v < tile_.v1; ++v) {
    const std::size_t row = part.index(tile_.u0, v);
    std::fill_n(part.image->depth.data() + row, tile_.u1 - tile_.u0, Surface::kNone);
  }
  if (count == 0) return;
  SearchArea area;
  area.leaves = std::span(leaves_).first(count);
  area.program = &tile_program_;
  area.end = view_->size.x;
  area.range = coincidence_->range();
  area.part = part;
  area.doubtful = &doubtful_;
  slot_solids_.clear();
  for (std::size_t i = 0; i < count; ++i) slot_solids_.push_back(leaves_[i].solid);
  area.solids = slot_solids_.data();
  for (int v = tile_.v0; v < tile_.v1; v += kAreaSide) {
    for (int u = tile_.u0; u < tile_.u1; u += kAreaSide) {
      const int area_index =
          (v - tile_.v0) / kAreaSide * (kTileSide / kAreaSide) + (u - tile_.u0) / kAreaSide;
      area.rect = {u, v, u + kAreaSide, std::min(tile_.v1, v + kAreaSide)};
      present_.clear();
      for (std::uint32_t slot = 0; slot < count; ++slot) {
        const LeafLayers& leaf = leaves_[slot];
        if (leaf.made && (leaf.areas >> area_index & 1) == 0) continue;
        const PixelRect& rect = leaf.rect;
        if (rect.u0 <= u && u < rect.u1 && rect.v0 < area.rect.v1 && area.rect.v0 < rect.v1) {
          present_.push_back(slot);
        }
      }
      simplifier_.simplify(area.leaves, present_, tile_program_);
      if (tile_program_.constant) continue;
      doubtful_.clear();
      if (cut || tile_program_.depth > kMaxSearchDepth) {
        for (int y = area.rect.v0; y < area.rect.v1; ++y) {
          for (int x = u; x < std::min(tile_.u1, u + kAreaSide); ++x) {
            doubtful_.push_back(part.index(x, y));
          }
        }
      } else {
        search_surface(area, *this);
      }
      for (const std::uint64_t pixel : doubtful_) resolve(tile_program_, pixel);
    }
  }
  if (cut) number_sources();
}

void TileFinder::number_sources() {
  for (int v = tile_.v0; v < tile_.v1; ++v) {
    for (int u = tile_.u0; u < tile_.u1; ++u) {
      const std::size_t pixel = part_.index(u, v);
      if (part_.image->depth[pixel] == SurfaceImage::kNone) continue;
      std::uint32_t& face = part_.image->triangle[pixel];
      const std::uint32_t exit = face & SurfaceImage::kExit;
      const ViewPart& view_part = view_parts_[part_.image->solid[pixel]];
      face = view_part.source(face & ~SurfaceImage::kExit) | exit;
    }
  }
}

}  // namespace strata::csg
