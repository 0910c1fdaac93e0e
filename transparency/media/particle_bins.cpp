#include "transparency/media/particle_bins.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "strata/hashbuffer/depth_list_store.h"

// T. Umenhoffer, L. Szirmay-Kalos, G. Szijarto, "Spherical billboards and their application to
// rendering explosions" (2006). We differ: a particle is a ball of a homogeneous medium, and its
// chord is exact.

namespace strata::transparency {
namespace {

/// A float whose bits increase with it.
std::uint32_t ordered(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x + 0.0f);  // -0 becomes 0
  return (bits >> 31) != 0 ? ~bits : bits | 0x80000000u;
}

/// The ends of a ball's image along one axis, at distance 1 along the view axis.
/// @param across, along  of the centre, across and along the view axis @pre along > radius
glm::dvec2 tangents(double across, double along, double radius) {
  const double middle = across * along;
  const double half = radius * std::sqrt(across * across + along * along - radius * radius);
  const double part = along * along - radius * radius;
  return glm::dvec2(middle - half, middle + half) / part;
}

/// Pixels whose centres lie between `a` and `b`, and one more on each side.
glm::ivec2 pixels_between(double a, double b, int size) {
  const double low = std::clamp(std::min(a, b) - 1.5, 0.0, static_cast<double>(size));
  const double high = std::clamp(std::max(a, b) + 1.5, 0.0, static_cast<double>(size));
  return {static_cast<int>(std::floor(low)), static_cast<int>(std::ceil(high))};
}

PixelRect rect_of(const glm::dvec3& centre, double radius, const View& view,
                  const PixelRays& rays) {
  glm::dvec2 x(centre.x - radius, centre.x + radius), y(centre.y - radius, centre.y + radius);
  if (rays.perspective()) {
    const double along = -centre.z;
    if (along <= -radius) return {};
    if (along <= radius * (1.0 + 1e-9)) return {0, 0, view.size.x, view.size.y};
    x = tangents(centre.x, along, radius);
    y = tangents(centre.y, along, radius);
  }
  x = x * rays.scale().x - rays.shift().x;
  y = y * rays.scale().y - rays.shift().y;
  const glm::ivec2 u = pixels_between(x[0], x[1], view.size.x);
  const glm::ivec2 v = pixels_between(y[0], y[1], view.size.y);
  return {u[0], v[0], u[1], v[1]};
}

}  // namespace

ParticleEvent::ParticleEvent(float distance, std::uint32_t particle, bool exit)
    : bits(std::uint64_t{ordered(distance)} << 32 | particle << 1 | (exit ? 1u : 0u)) {}

float ParticleEvent::distance() const {
  const auto high = static_cast<std::uint32_t>(bits >> 32);
  return std::bit_cast<float>((high >> 31) != 0 ? high & 0x7fffffffu : ~high);
}

ParticleBins::ParticleBins(std::span<const Particle> particles, const View& view,
                           const PixelRays& rays)
    : rays_(rays), tiles_u_((view.size.x + kTileSide - 1) / kTileSide) {
  const int tiles_v = (view.size.y + kTileSide - 1) / kTileSide;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    Ball ball;
    ball.centre = glm::dvec3(rays.eye_from_world() * glm::dvec4(particles[i].centre, 1.0));
    ball.radius = particles[i].radius;
    ball.particle = static_cast<std::uint32_t>(i);
    ball.rect = rect_of(ball.centre, ball.radius, view, rays);
    if (!ball.rect.empty()) balls_.push_back(ball);
  }
  offsets_.assign(static_cast<std::size_t>(tiles_u_) * static_cast<std::size_t>(tiles_v) + 1, 0);
  const auto for_each_tile = [this](const PixelRect& rect, auto&& body) {
    for (int tv = rect.v0 / kTileSide; tv * kTileSide < rect.v1; ++tv) {
      for (int tu = rect.u0 / kTileSide; tu * kTileSide < rect.u1; ++tu) {
        body(static_cast<std::size_t>(tv * tiles_u_ + tu));
      }
    }
  };
  for (const Ball& ball : balls_) {
    for_each_tile(ball.rect, [&](std::size_t tile) { ++offsets_[tile + 1]; });
  }
  std::partial_sum(offsets_.begin(), offsets_.end(), offsets_.begin());
  members_.resize(offsets_.back());
  std::vector<std::size_t> next(offsets_.begin(), offsets_.end() - 1);
  for (std::uint32_t i = 0; i < balls_.size(); ++i) {
    for_each_tile(balls_[i].rect, [&](std::size_t tile) { members_[next[tile]++] = i; });
  }
}

void ParticleBins::add(const Ball& ball, const PixelRect& clip, Tile& out) const {
  const int u0 = std::max(ball.rect.u0, clip.u0), u1 = std::min(ball.rect.u1, clip.u1);
  const int v0 = std::max(ball.rect.v0, clip.v0), v1 = std::min(ball.rect.v1, clip.v1);
  const double square = ball.radius * ball.radius;
  for (int v = v0; v < v1; ++v) {
    for (int u = u0; u < u1; ++u) {
      const auto pixel = static_cast<std::uint32_t>((v - clip.v0) * kTileSide + (u - clip.u0));
      glm::dvec3 to_centre = ball.centre;
      if (!rays_.perspective()) to_centre -= glm::dvec3(rays_.place(u + 0.5, v + 0.5), 0.0);
      const glm::dvec3& direction = out.directions[pixel];
      const double middle = glm::dot(to_centre, direction);
      const glm::dvec3 beside = to_centre - middle * direction;
      const double left = square - glm::dot(beside, beside);
      if (!(left > 0.0)) continue;
      const double half = std::sqrt(left);
      double entry = middle - half;
      if (rays_.perspective()) {
        if (middle + half <= 0.0) continue;
        entry = std::max(entry, 0.0);
      }
      out.pixels.push_back(pixel);
      out.unordered.emplace_back(static_cast<float>(entry), ball.particle, false);
      out.pixels.push_back(pixel);
      out.unordered.emplace_back(static_cast<float>(middle + half), ball.particle, true);
    }
  }
}

void ParticleBins::tile(int tu, int tv, Tile& out) const {
  out.events.clear();
  const auto tile = static_cast<std::size_t>(tv * tiles_u_ + tu);
  const auto members =
      std::span(members_).subspan(offsets_[tile], offsets_[tile + 1] - offsets_[tile]);
  if (members.empty()) return;
  const PixelRect clip{tu * kTileSide, tv * kTileSide, (tu + 1) * kTileSide, (tv + 1) * kTileSide};
  out.directions.resize(kTilePixels);
  for (int v = 0; v < kTileSide; ++v) {
    for (int u = 0; u < kTileSide; ++u) {
      const PixelRay ray = rays_.ray(clip.u0 + u, clip.v0 + v);
      out.directions[static_cast<std::size_t>(v * kTileSide + u)] = ray.direction / ray.length;
    }
  }
  out.pixels.clear();
  out.unordered.clear();
  for (const std::uint32_t member : members) add(balls_[member], clip, out);
  out.ends.assign(kTilePixels + 1, 0);
  for (const std::uint32_t pixel : out.pixels) ++out.ends[pixel + 1];
  std::uint32_t sum = 0;
  for (std::uint32_t& end : out.ends) {
    const std::uint32_t count = end;
    end = sum;
    sum += count;
  }
  out.events.resize(sum);
  for (std::size_t i = 0; i < out.pixels.size(); ++i) {
    out.events[out.ends[out.pixels[i] + 1]++] = out.unordered[i];
  }
  for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
    strata::detail::sort_list(out.events.data() + out.ends[pixel],
                              out.events.data() + out.ends[pixel + 1]);
  }
}

}  // namespace strata::transparency
