#include "csg/surface/visible_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numeric>
#include <utility>

namespace strata::csg {
namespace {

/// Lists from this length on are sorted in time that grows with it, byte by byte.
constexpr std::size_t kFewFlips = 64;

/// Sorts by the upper half, a byte at a time; what is equal stays in order.
void sort_by_bytes(std::vector<std::uint64_t>& keys, std::vector<std::uint64_t>& scratch) {
  constexpr std::size_t kBytes = 4;
  std::array<std::array<std::uint32_t, 256>, kBytes> begins{};
  for (const std::uint64_t key : keys) {
    for (std::size_t i = 0; i < kBytes; ++i) ++begins[i][key >> (32 + 8 * i) & 0xff];
  }
  scratch.resize(keys.size());
  for (std::size_t i = 0; i < kBytes; ++i) {
    const auto first_byte = keys.front() >> (32 + 8 * i) & 0xff;
    if (begins[i][first_byte] == keys.size()) continue;  // the top byte, mostly
    std::exclusive_scan(begins[i].begin(), begins[i].end(), begins[i].begin(), 0u);
    for (const std::uint64_t key : keys) scratch[begins[i][key >> (32 + 8 * i) & 0xff]++] = key;
    std::swap(keys, scratch);
  }
}

}  // namespace

Coincidence::Coincidence(const View& view, double world_error) : world_error_(world_error) {
  constexpr double kPixelPart = 0.1;
  const glm::dmat4 image_from_eye = view.image_from_world * glm::inverse(view.eye_from_world);
  const double scale = std::abs(image_from_eye[1][1]);  // pixels a world unit (at distance 1)
  if (view.perspective) {
    const double difference = 1.0 / view.near - 1.0 / view.far;
    a_ = 1.0 / view.near;
    b_ = difference / kPictureDepthLimit;
    const double steps = kPictureDepthLimit / difference;  // d(depth) = steps * d(1 / distance)
    flat_ = steps * world_error;
    // A pixel is distance / scale wide: steps / (scale * distance) depth steps, least far away.
    steep_from_ = 2.0 * kPixelPart * steps / (scale * view.far);
  } else {
    const double steps = kPictureDepthLimit / (view.far - view.near);
    flat_ = steps * world_error;
    steep_from_ = 2.0 * kPixelPart * steps / scale;
  }
}

Coincidence::Bound Coincidence::bound(const LatticeMesh& mesh, std::uint32_t triangle,
                                      std::uint32_t depth, double share) const {
  const glm::uvec3& t = mesh.triangles[triangle];
  const glm::ivec3 &p = mesh.vertices[t.x], &q = mesh.vertices[t.y], &r = mesh.vertices[t.z];
  TriangleSetup setup;
  if (!setup_triangle(p, q, r, AxisFrame(Axis::kZ), setup)) return {};
  const double slopes = 0.5 * setup.steepness();
  const auto [low, high] = std::minmax({p.z, q.z, r.z});
  const double least = flat(depth, share), at = depth;
  return {least + std::min(slopes, std::max(0.0, at - low)),
          least + std::min(slopes, std::max(0.0, high - at))};
}

Coincidence::Range Coincidence::range() const {
  constexpr double kMore = 2.0 * 1.01;
  return {static_cast<float>(a_), static_cast<float>(b_),
          static_cast<float>(kMore * (1.5 + 0.5 * steep_from_) + 1.0),
          static_cast<float>(kMore * flat_)};
}

bool FlipFaces::beneath(const Flip& below, const Flip& above) const {
  const auto corners = [&](const Flip& flip) {
    const Geometry::Part& part = (*parts_)[flip.solid];
    const glm::uvec3& t = part.triangles[(*view_parts_)[flip.solid].source(flip.triangle)];
    return std::array<glm::dvec3, 3>{part.positions[t.x], part.positions[t.y], part.positions[t.z]};
  };
  const auto of_above = corners(above), of_below = corners(below);
  const glm::dvec3 normal = glm::cross(of_above[1] - of_above[0], of_above[2] - of_above[0]);
  const double length = glm::length(normal);
  return std::all_of(of_below.begin(), of_below.end(), [&](const glm::dvec3& p) {
    const double rounding = 1e-10 * glm::length(p);
    return glm::dot(p - of_above[0], normal) <= (coincidence_->world_error() + rounding) * length;
  });
}

const Flip& SurfaceFinder::choose(const FlipFaces& faces) const {
  const auto first_of = [&](const auto& may) {
    const Candidate* best = nullptr;
    for (const Candidate& candidate : candidates_) {
      if (may(candidate) && (best == nullptr || goes_before(candidate, *best))) best = &candidate;
    }
    return best;
  };
  const Candidate* best = first_of([](const Candidate&) { return true; });
  // Of united solids the outermost face shows. Where solids are intersected, each is needed.
  if (candidates_.size() == 1 || best->flip->triangle == Surface::kNone ||
      (best->alone && !best->flip->exit)) {
    return *best->flip;
  }
  constexpr int kMostPlanes = 4;
  for (int i = 0; i < kMostPlanes; ++i) {
    const Candidate* above = first_of([&](const Candidate& candidate) {
      return candidate.alone == best->alone && candidate.flip->exit == best->flip->exit &&
             candidate.flip->solid != best->flip->solid &&
             faces.ends_at(*best->flip, *candidate.flip);
    });
    if (above == nullptr) break;
    best = above;
  }
  return *best->flip;
}

Surface SurfaceFinder::find(std::vector<Flip>& flips, const FlipFaces& faces) {
  sort(flips);
  Surface found;
  std::size_t at = 0;
  // Of the flips that the tree's value rests on.
  const auto group_bound = [&](std::size_t begin, std::size_t end) {
    Coincidence::Bound largest;
    for (std::size_t i = begin; i < end; ++i) {
      if (!state_.supports(flips[i].solid)) continue;
      const Coincidence::Bound one = faces.bound(flips[i]);
      largest.nearer = std::max(largest.nearer, one.nearer);
      largest.farther = std::max(largest.farther, one.farther);
    }
    return largest;
  };
  while (at < flips.size()) {
    const std::size_t begin = at;
    at = apply(flips, at);
    if (!state_.value()) continue;
    const std::uint32_t depth = flips[begin].depth;
    const Coincidence::Bound own = group_bound(begin, at);
    const bool embedded = depth == 0 && flips[begin].triangle == Surface::kNone;

    // On to where the interval ends. What lies within the bound of its beginning is settled with
    // it; that must not depend on flips that do not matter.
    const double settles = depth + 2.0 * own.farther;
    std::size_t settled = at, end_begin = at, end = at;
    bool plain = false;
    for (std::size_t i = begin; i < at; ++i) plain = plain || is_plain_entry(flips[i]);
    while (end < flips.size()) {
      end_begin = end;
      end = apply(flips, end);
      if (!state_.value()) break;
      if (flips[end_begin].depth <= settles) settled = end;
      for (std::size_t i = end_begin; i < end; ++i) plain = plain || is_plain_entry(flips[i]);
    }
    if (!state_.value()) {
      if (embedded) {
        for (std::size_t i = end_begin; i < end; ++i) {
          if (!state_.supports(flips[i].solid)) continue;
          found = surface_of(flips[i], flips[i].depth);
          break;
        }
        at = end;
        break;
      }
      if (!plain &&
          flips[end_begin].depth - depth <= own.farther + group_bound(end_begin, end).nearer) {
        at = end;
        continue;
      }
    }
    flip_all(flips, settled, end);

    // Of one solid only its last flip counts, unless it has one in the group.
    for (std::size_t i = 0; i < settled; ++i) last_[flips[i].solid] = i;
    for (std::size_t i = begin; i < at; ++i) last_[flips[i].solid] = i;
    candidates_.clear();
    for (std::size_t i = 0; i < settled; ++i) {
      const Flip& flip = flips[i];
      if (flip.triangle == Surface::kNone) continue;
      if (state_.inside(flip.solid) == flip.exit) continue;
      const bool in_group = i >= begin && i < at;
      if (!in_group) {
        const Coincidence::Bound its = faces.bound(flip);
        if (flip.depth < depth ? depth - flip.depth > own.nearer + its.farther
                               : flip.depth - depth > own.farther + its.nearer) {
          continue;
        }
        if (last_[flip.solid] != i) continue;
      }
      if (!state_.supports(flip.solid)) continue;  // last: it climbs the tree
      candidates_.push_back({&flip, state_.decides(flip.solid)});
    }
    found = surface_of(candidates_.empty() ? flips[begin] : choose(faces), depth);
    at = settled;
    break;
  }
  // Copying the state is a sixteenth of a flip's work for each solid and node.
  if (at * 16 > state_.program().nodes.size() + state_.program().leaves.size()) {
    state_.reset();
  } else {
    flip_all(flips, 0, at);
  }
  return found;
}

void SurfaceFinder::sort(std::vector<Flip>& flips) {
  order_.clear();
  for (const Flip& flip : flips) {
    order_.push_back(std::uint64_t{flip.depth} << 32 | order_.size());
  }
  if (order_.size() < kFewFlips) {
    std::sort(order_.begin(), order_.end());
  } else {
    sort_by_bytes(order_, other_order_);
  }
  sorted_.clear();
  for (const std::uint64_t key : order_) sorted_.push_back(flips[static_cast<std::uint32_t>(key)]);
  std::swap(flips, sorted_);
  for (auto begin = flips.begin(); begin != flips.end();) {
    auto end = begin + 1;
    while (end != flips.end() && end->depth == begin->depth) ++end;
    if (end - begin > 1) {
      std::sort(begin, end, [](const Flip& a, const Flip& b) { return a.solid < b.solid; });
    }
    begin = end;
  }
}

}  // namespace strata::csg
