#include <algorithm>

#include "csg/surface/tile_surface.h"

// Areas of convex solids that are just united; see csg/surface/united_surface_simd.cpp.

namespace strata::csg {

void UnitedLayers::clear(Arena& arena, int u, int v) {
  // Blocks of pixels may reach beyond the area.
  constexpr auto kWords = static_cast<std::size_t>(kSide * (kSide + 4) + 2 * kSide);
  u0 = u, v0 = v;
  for (std::uint32_t*& words : depths) {
    words = arena.words(kWords);
    std::fill_n(words, kWords, kEmpty);
  }
  for (std::uint32_t*& words : faces) words = arena.words(kWords);
  bound_behind = arena.words(kWords);
  std::fill_n(bound_behind, kWords, kEmpty);
  hidden_beyond = skipped_from = kEmpty;
  face_solids.clear();
  face_triangles.clear();
  extra_steps.clear();
}

std::uint32_t UnitedLayers::add_face(const LatticeMesh& mesh, std::uint32_t solid,
                                     std::uint32_t triangle, bool steep) {
  const auto face = static_cast<std::uint32_t>(face_solids.size());
  face_solids.push_back(solid);
  face_triangles.push_back(triangle);
  extra_steps.push_back(0);
  if (!steep) return face;
  // No bound is more than the triangle is deep.
  const glm::uvec3& t = mesh.triangles[triangle];
  const auto [low, high] =
      std::minmax({mesh.vertices[t.x].z, mesh.vertices[t.y].z, mesh.vertices[t.z].z});
  constexpr auto kLimit = static_cast<std::int32_t>(kPictureDepthLimit);
  extra_steps.back() =
      static_cast<std::uint32_t>(std::clamp(high, 0, kLimit) - std::min(low, kLimit)) + 1;
  return face | kSteep;
}

bool TileFinder::show_united(std::uint64_t pixel) {
  const auto width = static_cast<std::uint64_t>(part_.image->width);
  const std::size_t at = united_.index(part_.u0 + static_cast<int>(pixel % width),
                                       part_.v0 + static_cast<int>(pixel / width));
  const std::uint32_t nearest = united_.depths[0][at];
  const double first = nearest;
  const Coincidence::Range range = coincidence_->range();
  const double nearness = range.intercept - static_cast<double>(range.slope) * first;
  transitions_.clear();
  double reach = 0;  // the largest of all faces of the first depth
  for (int k = 0; k < UnitedLayers::kKept && united_.depths[k][at] == nearest; ++k) {
    const std::uint32_t face = united_.faces[k][at] & ~UnitedLayers::kSteep;
    reach = std::max<double>(reach, united_.extra_steps[face]);
  }
  const double last =
      first + range.constant + range.quadratic * nearness * nearness + 1 + 2 * reach;
  for (int k = 0; k < UnitedLayers::kKept; ++k) {
    const std::uint32_t depth = united_.depths[k][at];
    if (depth == UnitedLayers::kEmpty) break;
    const std::uint32_t face = united_.faces[k][at] & ~UnitedLayers::kSteep;
    if (depth - static_cast<double>(united_.extra_steps[face]) > last) continue;
    const std::uint32_t solid = united_.face_solids[face];
    // A ray enters a convex solid once, or nearly so.
    for (const Transition& transition : transitions_) {
      if (transition.solid == solid) return false;
    }
    transitions_.push_back({depth, solid, united_.face_triangles[face], false});
  }
  if (std::min(united_.bound_behind[at], united_.skipped_from) <= last) return false;
  if (transitions_.size() > 1) show(pixel);
  return true;
}

void TileFinder::find_united(const SearchArea& area) {
  const RasterTarget target{Axis::kZ, view_->size.x, view_->size.y, kPictureDepthLimit};
  const std::size_t index = area.index();
  // What begins behind a solid that covers the area is hidden.
  const std::uint64_t reach = farthest_reach(area.range);
  std::uint64_t last = UnitedLayers::kEmpty;
  for (const std::uint32_t slot : present_) {
    const AreaBounds& bounds = leaves_[slot].bounds;
    if ((bounds.covered >> index & 1) != 0) {
      last = std::min(last, bounds.entries.farthest[index] + reach);
    }
  }
  drawn_.clear();
  std::uint32_t skipped_from = UnitedLayers::kEmpty;
  for (const std::uint32_t slot : hidden_) {
    skipped_from = std::min(skipped_from, view_parts_[leaves_[slot].solid].nearest);
  }
  for (const std::uint32_t slot : present_) {
    const std::uint32_t nearest = leaves_[slot].nearest;
    if (nearest <= last) {
      drawn_.push_back(slot);
    } else {
      skipped_from = std::min(skipped_from, nearest);
    }
  }
  if (drawn_.size() == 1 && show_alone(area, leaves_[drawn_.front()])) return;
  united_.clear(area_arena_, area.rect.u0, area.rect.v0);
  united_.skipped_from = skipped_from;
  std::sort(drawn_.begin(), drawn_.end(), [&](std::uint32_t a, std::uint32_t b) {
    const std::uint32_t at_a = leaves_[a].nearest, at_b = leaves_[b].nearest;
    return at_a != at_b ? at_a < at_b : a < b;
  });
  for (const std::uint32_t slot : drawn_) {
    const LeafLayers& leaf = leaves_[slot];
    if (united_.hidden_beyond < leaf.nearest) {
      united_.skipped_from = std::min(united_.skipped_from, leaf.nearest);
      break;
    }
    const Input input = input_of(leaf);
    fragments_ += raster_united(view_parts_[leaf.solid].mesh, target, input.triangles, input.clip,
                                coincidence_->steep_from(), leaf.solid, united_);
    find_hidden(area.range, united_);
  }
  const PixelRect rect{area.rect.u0, area.rect.v0, std::min(tile_.u1, area.rect.u1), area.rect.v1};
  csg::find_united(united_, rect, area.range, part_, doubtful_);
  bool simplified = false;
  for (const std::uint64_t pixel : doubtful_) {
    if (show_united(pixel)) continue;
    if (!simplified) {
      for (const std::uint32_t slot : hidden_) {
        LeafLayers& leaf = leaves_[slot];
        find_bounds(leaf);
        in_tile_.push_back(slot);
        if (leaf.bounds.nearest(index) == AreaBounds::kNever) continue;
        enter_area(leaf, area, index);
        present_.push_back(slot);
      }
      hidden_.clear();
      std::sort(present_.begin(), present_.end());
      simplifier_.simplify(area.leaves, present_, tile_program_);
      simplified = true;
    }
    resolve(tile_program_, pixel);
  }
}

}  // namespace strata::csg
