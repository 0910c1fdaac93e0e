#include <algorithm>
#include <numeric>

#include "csg/surface/tile_surface.h"

// Tiles of convex solids that are just united; see csg/surface/united_surface_simd.cpp.

namespace strata::csg {

void UnitedLayers::clear(Arena& arena, const PixelRect& tile) {
  // Blocks of pixels may reach beyond the tile.
  constexpr std::size_t kWords = static_cast<std::size_t>(kTilePixels + 4 * kTileSide);
  u0 = tile.u0, v0 = tile.v0;
  for (std::uint32_t*& words : depths) {
    words = arena.words(kWords);
    std::fill_n(words, kWords, kEmpty);
  }
  for (std::uint32_t*& words : faces) words = arena.words(kWords);
  bound_behind = arena.words(kWords);
  std::fill_n(bound_behind, kWords, kEmpty);
  std::fill(std::begin(hidden_beyond), std::end(hidden_beyond), kEmpty);
  std::fill(std::begin(skipped_from), std::end(skipped_from), kEmpty);
  face_solids.clear();
  face_triangles.clear();
  extra_steps.clear();
}

bool UnitedLayers::hides(const PixelRect& clip, std::uint32_t nearest) {
  bool all = true;
  for_each_area(clip, [&](std::size_t area) { all = all && hidden_beyond[area] < nearest; });
  if (!all) return false;
  for_each_area(
      clip, [&](std::size_t area) { skipped_from[area] = std::min(skipped_from[area], nearest); });
  return true;
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
  const double first = united_.depths[0][at];
  const Coincidence::Range range = coincidence_->range();
  const double nearness = range.intercept - static_cast<double>(range.slope) * first;
  transitions_.clear();
  double last = first + range.constant + range.quadratic * nearness * nearness + 1;
  for (int k = 0; k < UnitedLayers::kKept; ++k) {
    const std::uint32_t depth = united_.depths[k][at];
    if (depth == UnitedLayers::kEmpty) break;
    const std::uint32_t face = united_.faces[k][at] & ~UnitedLayers::kSteep;
    const double extra = united_.extra_steps[face];
    if (k == 0) {
      last += 2 * extra;
    } else if (depth - extra > last) {
      continue;
    }
    const std::uint32_t solid = united_.face_solids[face];
    // A ray enters a convex solid once, or nearly so.
    for (const Transition& transition : transitions_) {
      if (transition.solid == solid) return false;
    }
    transitions_.push_back({depth, solid, united_.face_triangles[face], false});
  }
  constexpr std::size_t kSide = LeafLayers::kLanes;
  const std::size_t area =
      at / kTileSide / kSide * UnitedLayers::kAreasAcross + at % kTileSide / kSide;
  if (std::min(united_.bound_behind[at], united_.skipped_from[area]) <= last) return false;
  if (transitions_.size() > 1) show(pixel);
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

}  // namespace strata::csg
