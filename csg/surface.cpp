#include "csg/surface.h"

#include <algorithm>
#include <array>
#include <cmath>
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

Coincidence::Coincidence(const View& view, double world_error) {
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
                                      std::uint32_t depth) const {
  const glm::uvec3& t = mesh.triangles[triangle];
  const glm::ivec3 &p = mesh.vertices[t.x], &q = mesh.vertices[t.y], &r = mesh.vertices[t.z];
  TriangleSetup setup;
  if (!setup_triangle(p, q, r, AxisFrame(Axis::kZ), setup)) return {};
  const double slopes = 0.5 * setup.steepness();
  const auto [low, high] = std::minmax({p.z, q.z, r.z});
  const double least = flat(depth), at = depth;
  return {least + std::min(slopes, std::max(0.0, at - low)),
          least + std::min(slopes, std::max(0.0, high - at))};
}

Coincidence::Range Coincidence::range() const {
  constexpr double kMore = 2.0 * 1.01;
  return {static_cast<float>(a_), static_cast<float>(b_),
          static_cast<float>(kMore * (1.5 + 0.5 * steep_from_) + 1.0),
          static_cast<float>(kMore * flat_)};
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
