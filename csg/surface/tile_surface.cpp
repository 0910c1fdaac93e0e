#include "csg/surface/tile_surface.h"

#include <algorithm>
#include <array>
#include <new>
#include <numeric>

#include "strata/hashbuffer/tile_lists.h"

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

LeafLayers::Kind kind_of(const Program& program, std::uint32_t solid, const Geometry::Part& part,
                         bool cut) {
  if (!part.convex) return LeafLayers::Kind::kSorted;
  return program.is_union_operand(solid) && !cut ? LeafLayers::Kind::kFirstEntryOnly
                                                 : LeafLayers::Kind::kConvex;
}

void first_entry_of(std::span<const DepthItem> crossings, std::uint32_t solid,
                    std::vector<Transition>& transitions) {
  const auto entry =
      std::find_if(crossings.begin(), crossings.end(), [](DepthItem item) { return !item.exit(); });
  if (entry != crossings.end())
    transitions.push_back({entry->depth(), solid, entry->triangle(), false});
}

// --- TileFinder ---------------------------------------------------------------------------------

namespace {

/// Deeper nesting is walked pixel by pixel: asking nodes again for each answer would multiply.
constexpr int kMaxSearchDepth = 3;
constexpr int kAreaSide = LeafLayers::kLanes;
static_assert(kAreaSide == AreaBounds::kSide);

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
      first_hit_(program) {}

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

TileFinder::Input TileFinder::input_of(const LeafLayers& leaf) {
  Input input = input_of(leaf.solid);
  if (!leaf.by_area) return input;
  SearchArea of;
  of.rect = leaf.rect;
  const std::size_t area = of.index();
  area_triangles_.clear();
  const bool entries = leaf.left_out != LeafLayers::LeftOut::kEntries;
  const bool exits = leaf.left_out != LeafLayers::LeftOut::kExits &&
                     leaf.kind != LeafLayers::Kind::kFirstEntryOnly;
  for (const AreaBounds::Face& face : leaf.bounds.faces) {
    if ((face.areas >> area & 1) != 0 && (face.exit ? exits : entries)) {
      area_triangles_.push_back(face.triangle);
    }
  }
  input.clip.u0 = std::max(input.clip.u0, leaf.rect.u0);
  input.clip.v0 = std::max(input.clip.v0, leaf.rect.v0);
  input.clip.u1 = std::min(input.clip.u1, leaf.rect.u1);
  input.clip.v1 = std::min(input.clip.v1, leaf.rect.v1);
  input.triangles = area_triangles_;
  return input;
}

void TileFinder::make(LeafLayers& leaf) {
  leaf.made = true;
  leaf.areas = 0;
  const ViewPart& part = view_parts_[leaf.solid];
  const RasterTarget target{Axis::kZ, view_->size.x, view_->size.y, kPictureDepthLimit};
  const Input input = input_of(leaf);
  Arena& arena = leaf.by_area ? area_arena_ : arena_;
  constexpr std::size_t kTrianglesAtOnce = 256;             // lists may be very long
  constexpr std::size_t kMost[] = {~std::size_t{0}, 1, 2};  // by what is left out
  std::uint64_t fragments = 0;
  for (std::size_t i = 0; i < input.triangles.size() && !stop_.stop_requested();
       i += kTrianglesAtOnce) {
    const auto some =
        input.triangles.subspan(i, std::min(kTrianglesAtOnce, input.triangles.size() - i));
    fragments +=
        raster_layers(part.mesh, target, some, input.clip, coincidence_->steep_from(), leaf, arena);
    if (leaf.keys.size() > kMost[static_cast<std::size_t>(leaf.left_out)]) {
      leaf.left_out = LeafLayers::LeftOut::kNothing;  // met twice: all that happens counts
      leaf.keys.clear();
      leaf.triangles.clear();
      return make(leaf);
    }
    if (leaf.keys.size() > LeafLayers::kMostLayers) return make_deep(leaf, input);
  }
  fragments_ += fragments;
  const std::uint32_t nearest = leaf.nearest;
  if (!leaf.keys.empty()) normalize_layers(leaf, part.cut, *this);
  // A steep face may stand for a place before its crossing.
  if (leaf.by_area) leaf.nearest = nearest;
}

void TileFinder::make_deep(LeafLayers& leaf, const Input& input) {
  const ViewPart& part = view_parts_[leaf.solid];
  const RasterTarget target{Axis::kZ, view_->size.x, view_->size.y, kPictureDepthLimit};
  leaf.deep = true;
  leaf.keys.clear();
  leaf.triangles.clear();
  leaf.transitions.clear();
  leaf.transition_ends.assign(kTilePixels, 0);
  leaf.areas = 0xffff;
  leaf.nearest = 0;
  leaf.farthest = kPictureDepthLimit;
  const auto lists =
      lists_.build(part.mesh, target, input.triangles, tile_.u0 / kTileSide, tile_.v0 / kTileSide);
  if (!lists) throw std::bad_alloc();  // its only error
  fragments_ += lists->fragments;
  for (std::size_t pixel = 0; pixel < kTilePixels && !stop_.stop_requested(); ++pixel) {
    crossings_.clear();
    for_each_item(*lists, pixel, [this](DepthItem item) { crossings_.push_back(item); });
    if (leaf.kind == LeafLayers::Kind::kFirstEntryOnly) {
      first_entry_of(crossings_, leaf.solid, leaf.transitions);
    } else {
      transitions_of(crossings_, leaf.solid, parts_[leaf.solid].rule, part.cut, leaf.transitions);
    }
    leaf.transition_ends[pixel] = static_cast<std::uint32_t>(leaf.transitions.size());
  }
}

void TileFinder::normalize_pixel(LeafLayers& leaf, std::size_t at) {
  crossings_.clear();
  bool steep = false;
  for (std::size_t k = 0; k < leaf.keys.size(); ++k) {
    if (leaf.keys[k][at] == LeafLayers::kEmpty) continue;
    const std::uint32_t key = leaf.keys[k][at], triangle = leaf.triangles[k][at];
    steep = steep || (triangle & LeafLayers::kSteep) != 0;
    if (leaf.kind == LeafLayers::Kind::kConvex && k < 2) {
      crossings_.emplace_back(key, k == 1, triangle & ~LeafLayers::kSteep);
    } else {
      crossings_.emplace_back(key >> 1, (key & 1) != 0, triangle & ~LeafLayers::kSteep);
    }
    leaf.keys[k][at] = LeafLayers::kEmpty;
  }
  // Layers of convex solids are not sorted, and others by marked triangles.
  std::sort(crossings_.begin(), crossings_.end());
  leaf_transitions_.clear();
  transitions_of(crossings_, leaf.solid, parts_[leaf.solid].rule, view_parts_[leaf.solid].cut,
                 leaf_transitions_);
  while (leaf.keys.size() < leaf_transitions_.size()) {
    leaf.add_layer(leaf.by_area ? area_arena_ : arena_);
  }
  for (std::size_t k = 0; k < leaf_transitions_.size(); ++k) {
    leaf.keys[k][at] = leaf_transitions_[k].depth;
    leaf.triangles[k][at] = leaf_transitions_[k].triangle | (steep ? LeafLayers::kSteep : 0);
  }
  leaf.steep = leaf.steep || steep;
  if (!leaf_transitions_.empty()) {
    leaf.nearest = std::min(leaf.nearest, leaf_transitions_.front().depth);
    leaf.farthest = std::max(leaf.farthest, leaf_transitions_.back().depth);
  }
}

const Cluster& TileFinder::cluster_of(std::vector<std::uint32_t>& inside,
                                      std::span<const Transition> members) {
  inside.insert(inside.end(), around_.begin(), around_.end());
  return clusters_.find(inside, members, first_hit_, faces());
}

void TileFinder::show(std::uint64_t pixel) {
  ++resolved_;
  const Surface surface = first_hit_.find(transitions_, faces());
  part_.image->depth[pixel] = surface.depth;
  part_.image->solid[pixel] = surface.solid;
  part_.image->triangle[pixel] = surface.triangle | (surface.exit ? SurfaceImage::kExit : 0u);
}

void TileFinder::resolve(const TileProgram& program, std::uint64_t pixel) {
  const auto width = static_cast<std::uint64_t>(part_.image->width);
  const int u = part_.u0 + static_cast<int>(pixel % width);
  const int v = part_.v0 + static_cast<int>(pixel / width);
  transitions_.clear();
  for (const std::uint32_t solid : around_) {
    transitions_.push_back({0, solid, Surface::kNone, false});
  }
  for (const std::uint32_t slot : program.leaves) {
    LeafLayers& leaf = leaves_[slot];
    if (v < leaf.rect.v0 || v >= leaf.rect.v1 || u < leaf.rect.u0 || u >= leaf.rect.u1) continue;
    if (!leaf.made) make(leaf);
    if (leaf.deep) {
      const auto place = static_cast<std::size_t>((v - tile_.v0) * kTileSide + (u - tile_.u0));
      const auto begin =
          leaf.transitions.begin() + (place > 0 ? leaf.transition_ends[place - 1] : 0);
      transitions_.insert(transitions_.end(), begin,
                          leaf.transitions.begin() + leaf.transition_ends[place]);
      continue;
    }
    const auto at = static_cast<std::size_t>((v - leaf.rect.v0) * leaf.stride + (u - leaf.rect.u0));
    for (std::size_t k = 0; k < leaf.keys.size(); ++k) {
      if (leaf.keys[k][at] == LeafLayers::kEmpty) break;
      std::uint32_t triangle = leaf.triangles[k][at];
      if (k == 0 && leaf.left_out == LeafLayers::LeftOut::kEntries) triangle = Surface::kNone;
      if (triangle != Surface::kNone) triangle &= ~LeafLayers::kSteep;
      transitions_.push_back({leaf.keys[k][at], leaf.solid, triangle, (k & 1) != 0});
    }
  }
  show(pixel);
}

bool TileFinder::meets_tile(const ViewPart& part) const {
  return !part.binned || !part.bins.tile(tile_.u0 / kTileSide, tile_.v0 / kTileSide).empty();
}

bool TileFinder::place(LeafLayers& leaf, std::uint32_t solid, bool cut) const {
  const ViewPart& part = view_parts_[solid];
  if (!meets_tile(part)) return false;
  leaf.made = leaf.deep = leaf.steep = false;
  leaf.kind = kind_of(*program_, solid, parts_[solid], cut);
  leaf.solid = solid;
  leaf.nearest = part.cut ? 0 : part.nearest;
  leaf.farthest = part.farthest;
  leaf.keys.clear();
  leaf.triangles.clear();
  const auto down = [&](int u) { return tile_.u0 + (u - tile_.u0) / kAreaSide * kAreaSide; };
  leaf.rect = {down(std::max(tile_.u0, part.rect.u0)), std::max(tile_.v0, part.rect.v0),
               down(std::min(tile_.u1, part.rect.u1) + kAreaSide - 1),
               std::min(tile_.v1, part.rect.v1)};
  leaf.stride = leaf.rect.u1 - leaf.rect.u0;
  leaf.by_area = false;
  leaf.left_out = LeafLayers::LeftOut::kNothing;
  return !leaf.rect.empty();
}

bool TileFinder::wants_bounds(const LeafLayers& leaf) {
  // Of concave solids so few triangles that their layers are few.
  constexpr std::size_t kMostOfConcave = LeafLayers::kMostLayers / 2;
  if (leaf.kind == LeafLayers::Kind::kFirstEntryOnly) return true;
  if (leaf.kind == LeafLayers::Kind::kSorted &&
      input_of(leaf.solid).triangles.size() > kMostOfConcave) {
    return false;
  }
  // In an area or two there is little to leave out.
  const PixelRect& rect = view_parts_[leaf.solid].rect;
  return rect.u1 - rect.u0 > kAreaSide || rect.v1 - rect.v0 > kAreaSide;
}

void TileFinder::find_tile_bounds(LeafLayers& leaf) {
  const Input input = input_of(leaf.solid);
  csg::find_tile_bounds(view_parts_[leaf.solid].mesh, input.triangles, {tile_.u0, tile_.v0},
                        coincidence_->steep_from(), leaf.kind != LeafLayers::Kind::kFirstEntryOnly,
                        leaf.bounds);
  if (leaf.kind == LeafLayers::Kind::kSorted) leaf.bounds.covered = 0;
}

void TileFinder::find_bounds(LeafLayers& leaf, bool bounds_of_tile) {
  const std::span<const std::uint32_t> triangles =
      bounds_of_tile ? leaf.bounds.triangles : input_of(leaf.solid).triangles;
  find_area_bounds(view_parts_[leaf.solid].mesh, triangles, {tile_.u0, tile_.v0},
                   coincidence_->steep_from(), leaf.kind != LeafLayers::Kind::kFirstEntryOnly,
                   bounds_of_tile, leaf.bounds);
  if (leaf.kind == LeafLayers::Kind::kSorted) leaf.bounds.covered = 0;
}

bool TileFinder::bounds_pay(std::span<const LeafLayers> leaves) {
  // Many small solids of many triangles each are rasterized faster than bounded. The numbers are
  // those at which plate400 and drill of bench_csg_frames gain or lose nothing.
  constexpr std::size_t kManyTriangles = 13, kFewAreas = 12;
  const std::size_t root = program_->nodes.size() - 1;
  std::size_t triangles = 0, areas = 0;
  for (const LeafLayers& leaf : leaves) {
    const Program::Up& up = program_->leaves[leaf.solid];
    // An intersection that is subtracted is not narrowed.
    if (up.inverted && up.parent != root && program_->nodes[up.parent].up.parent != root) {
      return false;
    }
    const int across = (leaf.rect.u1 - leaf.rect.u0 + kAreaSide - 1) / kAreaSide;
    const int down = (leaf.rect.v1 - leaf.rect.v0 + kAreaSide - 1) / kAreaSide;
    areas += static_cast<std::size_t>(across * down);
    triangles += input_of(leaf.solid).triangles.size();
  }
  return triangles <= kManyTriangles * areas || areas >= kFewAreas * leaves.size();
}

void TileFinder::find_all_bounds(std::span<LeafLayers> leaves) {
  const bool united = std::ranges::all_of(leaves, [](const LeafLayers& leaf) {
    return leaf.kind == LeafLayers::Kind::kFirstEntryOnly;
  });
  if (united) return find_united_bounds(leaves);
  const bool pays = bounds_pay(leaves);
  for (LeafLayers& leaf : leaves) {  // find_united() needs those of united solids
    leaf.by_area = leaf.kind == LeafLayers::Kind::kFirstEntryOnly || (pays && wants_bounds(leaf));
  }
  // Where few solids meet a tile, few of them are hidden in all of it.
  constexpr std::size_t kManySolids = 8;
  const bool many = pays && leaves.size() >= kManySolids;
  if (many) narrow_tile(leaves);
  for (const std::uint32_t slot : in_tile_) {
    if (leaves[slot].by_area) find_bounds(leaves[slot], many);
  }
}

void TileFinder::find_united_bounds(std::span<LeafLayers> leaves) {
  drawn_ = in_tile_;
  std::sort(drawn_.begin(), drawn_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return leaves[a].nearest != leaves[b].nearest ? leaves[a].nearest < leaves[b].nearest : a < b;
  });
  std::array<std::uint32_t, AreaBounds::kAreas> last;  // where each area is covered
  last.fill(AreaBounds::kNever);
  const std::uint64_t reach = farthest_reach(coincidence_->range());
  std::uint64_t hidden_from = last.front() + reach;
  in_tile_.clear();
  for (const std::uint32_t slot : drawn_) {
    LeafLayers& leaf = leaves[slot];
    leaf.by_area = true;
    if (leaf.nearest > hidden_from) {
      hidden_.push_back(slot);
      continue;
    }
    find_bounds(leaf);
    in_tile_.push_back(slot);
    for (std::size_t area = 0; area < last.size(); ++area) {
      if ((leaf.bounds.covered >> area & 1) == 0) continue;
      last[area] = std::min(last[area], leaf.bounds.entries.farthest[area]);
    }
    hidden_from = *std::ranges::max_element(last) + reach;
  }
  std::ranges::sort(in_tile_);
}

void TileFinder::find(int tile_u, int tile_v, std::span<const std::uint32_t> solids,
                      const SurfacePart& part, const std::stop_token& stop) {
  part_ = part;
  stop_ = stop;
  tile_ = {tile_u * kTileSide, tile_v * kTileSide,
           std::min(view_->size.x, (tile_u + 1) * kTileSide),
           std::min(view_->size.y, (tile_v + 1) * kTileSide)};
  arena_.clear();
  if (leaves_.size() < solids.size()) leaves_.resize(solids.size());
  std::size_t count = 0;
  const bool cut = std::ranges::any_of(solids, [&](std::uint32_t solid) {
    return view_parts_[solid].cut && meets_tile(view_parts_[solid]);
  });
  for (const std::uint32_t solid : solids) {
    if (place(leaves_[count], solid, cut)) ++count;
  }
  in_tile_.resize(count);
  std::iota(in_tile_.begin(), in_tile_.end(), 0u);
  narrowed_ = false;
  window_ = {};
  around_.clear();
  hidden_.clear();
  clusters_.clear();
  kept_faces_.clear();
  if (part.faces != nullptr) *part.faces = {};
  if (!cut) find_all_bounds(std::span(leaves_).first(count));
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
      area.rect = {u, v, u + kAreaSide, std::min(tile_.v1, v + kAreaSide)};
      find_area(area, cut);
      if (stop.stop_requested()) return;
    }
  }
  if (cut) number_sources();
}

void TileFinder::enter_area(LeafLayers& leaf, const SearchArea& area, std::size_t index) const {
  leaf.made = leaf.deep = leaf.steep = false;
  leaf.left_out = LeafLayers::LeftOut::kNothing;
  leaf.keys.clear();
  leaf.triangles.clear();
  leaf.rect = area.rect;
  leaf.stride = kAreaSide;
  leaf.nearest = leaf.bounds.nearest(index);
  leaf.farthest = leaf.bounds.farthest(index);
}

void TileFinder::list_present(const SearchArea& area) {
  const int u = area.rect.u0, v = area.rect.v0;
  const std::size_t area_index = area.index();
  present_.clear();
  area_arena_.clear();
  for (const std::uint32_t slot : in_tile_) {
    LeafLayers& leaf = area.leaves[slot];
    if (leaf.by_area) {
      if (leaf.bounds.nearest(area_index) == AreaBounds::kNever) continue;
      enter_area(leaf, area, area_index);
      present_.push_back(slot);
      continue;
    }
    if (leaf.made && (leaf.areas >> area_index & 1) == 0) continue;
    const PixelRect& rect = leaf.rect;
    if (rect.u0 <= u && u < rect.u1 && rect.v0 < area.rect.v1 && v < rect.v1) {
      present_.push_back(slot);
    }
  }
}

void TileFinder::find_area(const SearchArea& area, bool cut) {
  list_present(area);
  around_.clear();
  alone_ = kNoLeaf;
  doubtful_.clear();
  if (present_.empty()) return;
  if (!cut && std::ranges::all_of(present_, [&](std::uint32_t slot) {
        return leaves_[slot].kind == LeafLayers::Kind::kFirstEntryOnly;
      })) {
    return find_united(area);
  }
  if (narrowed_) {
    if (!take_narrowed_program()) return;
  } else {
    simplifier_.simplify(area.leaves, present_, tile_program_);
    if (tile_program_.constant) return;
  }
  if (!cut && !narrow(area.index())) return;
  if (alone_ != kNoLeaf && show_alone(area, leaves_[alone_])) return;
  const auto is_deep = [&] {
    return std::any_of(tile_program_.leaves.begin(), tile_program_.leaves.end(),
                       [&](std::uint32_t slot) { return leaves_[slot].deep; });
  };
  bool one_by_one = cut || tile_program_.depth > kMaxSearchDepth || is_deep();
  if (!one_by_one) {
    search_surface(area, *this);
    one_by_one = is_deep();  // it has made leaves
  }
  if (one_by_one) {
    doubtful_.clear();
    for (int y = area.rect.v0; y < area.rect.v1; ++y) {
      for (int x = area.rect.u0; x < std::min(tile_.u1, area.rect.u1); ++x) {
        doubtful_.push_back(part_.index(x, y));
      }
    }
  }
  for (const std::uint64_t pixel : doubtful_) {
    if (stop_.stop_requested()) return;  // lists may be very long
    resolve(tile_program_, pixel);
  }
}

bool TileFinder::show_alone(const SearchArea& area, LeafLayers& leaf) {
  const std::size_t index = area.index();
  if ((leaf.bounds.covered >> index & 1) == 0 || (leaf.bounds.steep_areas >> index & 1) != 0) {
    return false;
  }
  const LeafLayers::Kind kind = leaf.kind;
  const LeafLayers::LeftOut left_out = leaf.left_out;
  const std::size_t layer = left_out == LeafLayers::LeftOut::kEntries ? 1 : 0;
  const std::uint32_t nearest = leaf.nearest, tag = layer == 1 ? SurfaceImage::kExit : 0u;
  leaf.kind = LeafLayers::Kind::kConvex;
  if (layer == 0) leaf.left_out = LeafLayers::LeftOut::kExits;
  const RasterTarget target{Axis::kZ, view_->size.x, view_->size.y, kPictureDepthLimit};
  const Input input = input_of(leaf);
  const PixelRect& clip = input.clip;
  const int width = std::min(tile_.u1, area.rect.u1) - area.rect.u0;
  const int height = area.rect.v1 - area.rect.v0;
  const auto pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
  const bool one_face =
      part_.faces != nullptr &&
      (input.triangles.size() == 1 ||
       (part_.alike && !input.triangles.empty() && part_.alike(leaf.solid, input.triangles, tag)));
  std::uint64_t fragments = 0;
  if (!one_face) {
    fragments = raster_layers(view_parts_[leaf.solid].mesh, target, input.triangles, clip,
                              coincidence_->steep_from(), leaf, area_arena_);
  }
  leaf.kind = kind;
  leaf.left_out = left_out;
  if (one_face) {
    part_.faces->of[index] = {leaf.solid, input.triangles.front() | tag};
    return true;
  }
  if (leaf.keys.size() != layer + 1 || leaf.steep || fragments != pixels) {
    enter_area(leaf, area, index);
    leaf.left_out = left_out;
    leaf.nearest = nearest;
    return false;
  }
  fragments_ += fragments;
  for (int row = 0; row < height; ++row) {
    const auto from = static_cast<std::size_t>(row * leaf.stride);
    const std::size_t to = part_.index(area.rect.u0, area.rect.v0 + row);
    std::copy_n(leaf.keys[layer] + from, width, part_.image->depth.data() + to);
    std::transform(leaf.triangles[layer] + from, leaf.triangles[layer] + from + width,
                   part_.image->triangle.data() + to,
                   [tag](std::uint32_t triangle) { return triangle | tag; });
    std::fill_n(part_.image->solid.data() + to, width, leaf.solid);
  }
  return true;
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
