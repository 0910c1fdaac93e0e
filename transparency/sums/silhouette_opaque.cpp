#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <glm/matrix.hpp>
#include <vector>

#include "transparency/stream/tile_stream.h"
#include "transparency/sums/seeded_random.h"
#include "transparency/sums/sum_techniques.h"

// O. Sen, C. Chemudugunta, M. Gopi, "Silhouette-opaque transparency rendering" (2003): surfaces are
// drawn as opaque points into a finer picture. A triangle is turned about its vertex nearest to the
// eye until it faces the eye; the finer pixels that it then covers are its points, of which a
// random share stays, as large as its opacity. They are drawn on the triangle as it lies: where it
// is seen at an angle they crowd, and it is more opaque, as matter is when light takes a longer
// way.
//
// We differ: each point stays or goes by itself, so that a tile needs only its own points. Where
// the view has perspective, the turned triangle is projected by the scale at its nearest vertex,
// and triangles larger than their distance are split first.

namespace strata::transparency {
namespace {

/// Triangles that are not opaque, by the tiles that their boxes meet.
struct TileTriangles {
  int tiles_u = 0;
  std::vector<std::uint32_t> offsets, triangles;

  [[nodiscard]] std::span<const std::uint32_t> tile(int tu, int tv) const {
    const auto i = static_cast<std::size_t>(tv * tiles_u + tu);
    return std::span(triangles).subspan(offsets[i], offsets[i + 1] - offsets[i]);
  }
};

/// Calls body(tile) for each tile that the box of a triangle meets.
template <class Body>
void for_each_tile(const FrameInfo& frame, const TileTriangles& tiles, const glm::uvec3& corners,
                   Body&& body) {
  const auto& vertices = frame.triangles->part.mesh.vertices;
  const glm::ivec3 &a = vertices[corners.x], &b = vertices[corners.y], &c = vertices[corners.z];
  constexpr int kTileSteps = kTileSide * kLatticeSteps;
  const glm::ivec3 low = glm::min(a, glm::min(b, c)), high = glm::max(a, glm::max(b, c));
  const auto tile = [&](int position, int pixels) {
    return std::clamp(position, 0, pixels * kLatticeSteps - 1) / kTileSteps;
  };
  if (high.x < 0 || high.y < 0 || low.x >= frame.size.x * kLatticeSteps ||
      low.y >= frame.size.y * kLatticeSteps) {
    return;
  }
  for (int tv = tile(low.y, frame.size.y); tv <= tile(high.y, frame.size.y); ++tv) {
    for (int tu = tile(low.x, frame.size.x); tu <= tile(high.x, frame.size.x); ++tu) {
      body(static_cast<std::size_t>(tv * tiles.tiles_u + tu));
    }
  }
}

Result<std::shared_ptr<const void>> prepare_silhouette_opaque(const FrameInfo& frame,
                                                              const Settings&,
                                                              const Execution& execution) {
  const FrameTriangles& triangles = *frame.triangles;
  auto tiles = std::make_shared<TileTriangles>();
  tiles->tiles_u = (frame.size.x + kTileSide - 1) / kTileSide;
  const int tiles_v = (frame.size.y + kTileSide - 1) / kTileSide;
  std::vector<std::uint32_t>& offsets = tiles->offsets;
  offsets.assign(static_cast<std::size_t>(tiles->tiles_u * tiles_v) + 1, 0);
  const std::span<const glm::uvec3> all = triangles.part.mesh.triangles;
  const auto each = [&](auto&& body) {
    for (std::uint32_t t = 0; t < all.size(); ++t) {
      if (t % 65536 == 0 && execution.stop.stop_requested()) return;
      const std::uint32_t source = triangles.part.source(t);
      if (!triangles.opaque.empty() && triangles.opaque[source] != 0) continue;
      for_each_tile(frame, *tiles, all[t], [&](std::size_t tile) { body(t, tile); });
    }
  };
  std::uint64_t sum = 0;
  each([&](std::uint32_t, std::size_t tile) {
    ++offsets[tile + 1];
    ++sum;
  });
  if (sum > 0xffffffffu) return fail(ErrorCode::kLimit, "sot: {} triangles in tiles", sum);
  for (std::size_t i = 1; i < offsets.size(); ++i) offsets[i] += offsets[i - 1];
  tiles->triangles.resize(sum);
  std::vector<std::uint32_t> cursor(offsets.begin(), offsets.end() - 1);
  each([&](std::uint32_t t, std::size_t tile) { tiles->triangles[cursor[tile]++] = t; });
  if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
  return std::shared_ptr<const void>(std::move(tiles));
}

using Corners = std::array<glm::dvec3, 3>;

/// A triangle with its points. `weights` are barycentric, in space.
class PointedTriangle {
 public:
  /// @param eye  corners in eye space @param clip  the same times `image_from_eye`
  /// @param side  finer pixels of a pixel
  PointedTriangle(bool perspective, const glm::dmat4& image_from_eye, const Corners& eye,
                  const glm::dmat3x4& clip, int side)
      : clip_(clip) {
    turn(perspective, image_from_eye, eye, side);
  }

  /// The surface has no area.
  [[nodiscard]] bool empty() const { return empty_; }
  /// (u w, v w, depth w, w).
  [[nodiscard]] glm::dvec4 clip(const glm::dvec3& weights) const { return clip_ * weights; }
  /// Where the point lies on the turned triangle, in finer pixels.
  [[nodiscard]] glm::dvec2 turned(const glm::dvec3& weights) const { return turned_ * weights; }
  [[nodiscard]] glm::dvec3 weights(const glm::dvec2& turned) const {
    const glm::dvec2 two = weights_from_turned_ * (turned - turned_[0]);
    return {1.0 - two.x - two.y, two.x, two.y};
  }

 private:
  void turn(bool perspective, const glm::dmat4& image_from_eye, const Corners& eye, int side) {
    const auto nearness = [&](const glm::dvec3& p) { return perspective ? glm::dot(p, p) : -p.z; };
    const glm::dvec3& near = *std::min_element(
        eye.begin(), eye.end(), [&](auto& a, auto& b) { return nearness(a) < nearness(b); });
    const glm::dvec3 to_eye = perspective ? glm::normalize(-near) : glm::dvec3(0, 0, 1);
    glm::dvec3 normal = glm::cross(eye[1] - eye[0], eye[2] - eye[0]);
    const double area = glm::length(normal);
    empty_ = !(area > 0.0);
    if (empty_) return;
    normal /= area;
    if (glm::dot(normal, to_eye) < 0.0) normal = -normal;
    // u and v change by these for a step in eye space at the nearest vertex.
    const glm::dvec4 at = image_from_eye * glm::dvec4(near, 1.0);
    const glm::dmat4 rows = glm::transpose(image_from_eye);
    const double scale = side / at.w;
    const glm::dvec2 origin = glm::dvec2(at) / at.w * static_cast<double>(side);
    const glm::dvec3 by_u = glm::dvec3(rows[0] - at.x / at.w * rows[3]) * scale;
    const glm::dvec3 by_v = glm::dvec3(rows[1] - at.y / at.w * rows[3]) * scale;
    // The least rotation that takes the normal to the eye: p + a x p + a x (a x p) / (1 + cos).
    const glm::dvec3 axis = glm::cross(normal, to_eye);
    const double cosine = glm::dot(normal, to_eye);
    for (int i = 0; i < 3; ++i) {
      const glm::dvec3 p = eye[static_cast<std::size_t>(i)] - near;
      const glm::dvec3 across = glm::cross(axis, p);
      const glm::dvec3 r = p + across + glm::cross(axis, across) / (1.0 + cosine);
      turned_[i] = origin + glm::dvec2(glm::dot(by_u, r), glm::dot(by_v, r));
    }
    const glm::dmat2 edges(turned_[1] - turned_[0], turned_[2] - turned_[0]);
    empty_ = !(std::abs(glm::determinant(edges)) > 0.0);
    if (!empty_) weights_from_turned_ = glm::inverse(edges);
  }

  glm::dmat3x4 clip_{0.0};
  glm::dmat3x2 turned_{0.0};
  glm::dmat2 weights_from_turned_{0.0};
  bool empty_ = false;
};

/// A convex part of a triangle, by the weights of its corners.
struct Part {
  std::array<glm::dvec3, 8> corners;
  std::size_t count = 3;

  Part() : corners{glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1)} {}
  /// Keeps what has dot(side, weights) >= 0.
  void clip(const glm::dvec3& side) {
    std::array<glm::dvec3, 8> kept;
    std::size_t some = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const glm::dvec3 &a = corners[i], &b = corners[(i + 1) % count];
      const double da = glm::dot(side, a), db = glm::dot(side, b);
      if (da >= 0.0) kept[some++] = a;
      if ((da >= 0.0) != (db >= 0.0)) kept[some++] = a + (b - a) * (da / (da - db));
    }
    corners = kept;
    count = some;
  }
  /// Keeps what is seen in some pixels. @param clip_of  (u w, v w, depth w, w) of the corners
  void clip_to(const PixelRect& rect, const glm::dmat3x4& clip_of) {
    const glm::dmat4x3 rows = glm::transpose(clip_of);
    clip(rows[0] - static_cast<double>(rect.u0) * rows[3]);
    clip(static_cast<double>(rect.u1) * rows[3] - rows[0]);
    clip(rows[1] - static_cast<double>(rect.v0) * rows[3]);
    clip(static_cast<double>(rect.v1) * rows[3] - rows[1]);
  }
};

/// A triangle of the frame, or a piece of one that was split.
struct Piece {
  DepthItem face;
  double opacity = 0.0;
  std::uint64_t triangle = 0;
  std::uint64_t path = 1;  ///< a bit a split, after the first one
  Corners eye{};
};

class SilhouetteOpaque {
 public:
  SilhouetteOpaque(const FrameInfo& frame, const Settings& settings,
                   std::shared_ptr<const TileTriangles> tiles)
      : side_(static_cast<int>(settings.k)),
        seed_(settings.seed),
        tiles_(std::move(tiles)),
        view_(frame.triangles->view),
        image_from_eye_(view_.image_from_world * glm::inverse(view_.eye_from_world)),
        eye_from_image_(glm::inverse(image_from_eye_)),
        nearest_(static_cast<std::size_t>(kTilePixels * side_ * side_)) {}

  void render(TileStream& stream, TileImage& image) {
    std::fill(nearest_.begin(), nearest_.end(), TileFragments::kNothing);
    stream.count_pass(stream.size());
    points_ = 0;
    const PixelRect& rect = stream.rect();
    for (const std::uint32_t t : tiles_->tile(rect.u0 / kTileSide, rect.v0 / kTileSide)) {
      draw_triangle(stream, t);
    }
    for_each_pixel(stream, [&](std::uint32_t pixel) { resolve(stream, image, pixel); });
    Costs& costs = stream.costs();
    costs.stored = costs.comparisons = points_;
    costs.formula_bytes = costs.allocated_bytes =
        sizeof(DepthItem) * static_cast<std::uint64_t>(side_ * side_) * stream.pixel_count();
  }

 private:
  /// Halves of halves, at most.
  static constexpr unsigned kMostSplits = 60;
  /// Of the distance from the eye: then the scale at the nearest vertex serves all of a piece.
  static constexpr double kLargestEdge = 1.0 / 16.0;
  /// Points of a triangle for each finer pixel of a tile, at most.
  static constexpr double kMostCrowding = 64.0;

  void draw_triangle(TileStream& stream, std::uint32_t t) {
    const ViewPart& part = stream.frame().triangles->part;
    const glm::uvec3& corners = part.mesh.triangles[t];
    Piece piece;
    for (int i = 0; i < 3; ++i) {
      const glm::ivec3& c = part.mesh.vertices[corners[i]];
      const glm::dvec4 eye =
          eye_from_image_ * glm::dvec4(static_cast<double>(c.x) / kLatticeSteps,
                                       static_cast<double>(c.y) / kLatticeSteps, c.z, 1.0);
      piece.eye[static_cast<std::size_t>(i)] = glm::dvec3(eye) / eye.w;
    }
    const glm::dvec3 &a = piece.eye[0], &b = piece.eye[1], &c = piece.eye[2];
    const glm::dvec3 to_eye = view_.perspective ? -a : glm::dvec3(0, 0, 1);
    const bool away = glm::dot(glm::cross(b - a, c - a), to_eye) < 0.0;
    piece.face = DepthItem(0, away, part.source(t));
    piece.opacity = static_cast<double>(stream.opacity(piece.face));
    piece.triangle = t;
    if (piece.opacity > 0.0) draw(stream, piece);
  }
  void draw(TileStream& stream, const Piece& piece) {
    glm::dmat3x4 clip;
    for (int i = 0; i < 3; ++i) {
      clip[i] = image_from_eye_ * glm::dvec4(piece.eye[static_cast<std::size_t>(i)], 1.0);
    }
    Part part;
    part.clip_to(stream.rect(), clip);
    if (part.count == 0 || split(stream, piece)) return;
    const PointedTriangle triangle(view_.perspective, image_from_eye_, piece.eye, clip, side_);
    if (triangle.empty()) return;
    for_each_candidate(triangle, part, [&](std::int64_t i, std::int64_t j, double step) {
      const glm::dvec3 weights = triangle.weights(
          step * glm::dvec2(static_cast<double>(i) + 0.5, static_cast<double>(j) + 0.5));
      if (!(weights.x >= 0.0 && weights.y >= 0.0 && weights.z >= 0.0)) return;
      SeededRandom random{seed_, piece.triangle, piece.path, static_cast<std::uint64_t>(i),
                          static_cast<std::uint64_t>(j)};
      const double opacity =
          step == 1.0 ? piece.opacity : 1.0 - std::pow(1.0 - piece.opacity, step * step);
      if (random.unit() < opacity) draw_point(stream, triangle.clip(weights), piece.face);
    });
  }
  /// Draws both halves of a piece that is too large for one scale. @return whether it is
  bool split(TileStream& stream, const Piece& piece) {
    if (!view_.perspective || piece.path >> kMostSplits != 0) return false;
    std::size_t longest = 0;
    double length = 0.0, distance = 1e300;
    for (std::size_t i = 0; i < 3; ++i) {
      const double edge = glm::distance(piece.eye[i], piece.eye[(i + 1) % 3]);
      if (edge > length) length = edge, longest = i;
      distance = std::min(distance, glm::length(piece.eye[i]));
    }
    if (length <= kLargestEdge * distance) return false;
    const std::size_t next = (longest + 1) % 3;
    const glm::dvec3 middle = 0.5 * (piece.eye[longest] + piece.eye[next]);
    for (const std::size_t moved : {longest, next}) {
      Piece half = piece;
      half.eye[moved] = middle;
      half.path = piece.path << 1 | (moved == next ? 1 : 0);
      draw(stream, half);
    }
    return true;
  }
  /// Calls body(i, j, step) for the finer pixels of the turned triangle whose centres, step times
  /// (i
  /// + 1/2, j + 1/2), lie in a part of it, and for some at its rim. The step is 1 unless points
  /// would crowd beyond need: then each stands for step x step.
  template <class Body>
  void for_each_candidate(const PointedTriangle& triangle, const Part& part, Body&& body) const {
    std::array<glm::dvec2, 8> at;
    double twice_area = 0.0;
    for (std::size_t i = 0; i < part.count; ++i) {
      at[i] = triangle.turned(part.corners[i]);
      const glm::dvec2 a = at[i == 0 ? 0 : i - 1] - at[0], b = at[i] - at[0];
      twice_area += a.x * b.y - a.y * b.x;
    }
    const double most = kMostCrowding * kTilePixels * side_ * side_;
    const double step = std::max(1.0, std::ceil(std::sqrt(0.5 * std::abs(twice_area) / most)));
    double low = 1e300, high = -1e300;
    for (std::size_t i = 0; i < part.count; ++i) {
      at[i] /= step;
      low = std::min(low, at[i].y);
      high = std::max(high, at[i].y);
    }
    for (auto j = static_cast<std::int64_t>(std::floor(low - 0.5));
         static_cast<double>(j) <= std::ceil(high - 0.5); ++j) {
      const double y = std::clamp(static_cast<double>(j) + 0.5, low, high);
      double left = 1e300, right = -1e300;
      for (std::size_t i = 0; i < part.count; ++i) {
        const glm::dvec2 &a = at[i], &b = at[(i + 1) % part.count];
        if (y < std::min(a.y, b.y) || y > std::max(a.y, b.y)) continue;
        const double along = a.y == b.y ? 0.0 : (y - a.y) / (b.y - a.y);
        left = std::min({left, a.x + along * (b.x - a.x), a.y == b.y ? b.x : left});
        right = std::max({right, a.x + along * (b.x - a.x), a.y == b.y ? b.x : right});
      }
      for (auto i = static_cast<std::int64_t>(std::floor(left - 0.5));
           static_cast<double>(i) <= std::ceil(right - 0.5); ++i) {
        body(i, j, step);
      }
    }
  }
  void draw_point(TileStream& stream, const glm::dvec4& clip, DepthItem face) {
    const PixelRect& rect = stream.rect();
    const double u = std::floor(clip.x / clip.w * side_) - rect.u0 * side_;
    const double v = std::floor(clip.y / clip.w * side_) - rect.v0 * side_;
    if (!(u >= 0 && v >= 0 && u < stream.width() * side_ && v < stream.height() * side_)) return;
    ++points_;
    const int fine_u = static_cast<int>(u), fine_v = static_cast<int>(v);
    const auto pixel = static_cast<std::uint32_t>(fine_v / side_ * kTileSide + fine_u / side_);
    const double depth = std::clamp(clip.z / clip.w, 0.0, kPictureDepthLimit - 1.0);
    const DepthItem item(static_cast<std::uint32_t>(depth), face.exit(), face.triangle());
    if (stream.opaque(pixel) < item) return;
    DepthItem& nearest =
        nearest_[pixel * static_cast<std::size_t>(side_ * side_) +
                 static_cast<std::size_t>(fine_v % side_ * side_ + fine_u % side_)];
    nearest = std::min(nearest, item);
  }

  void resolve(TileStream& stream, TileImage& image, std::uint32_t pixel) const {
    const auto samples = static_cast<std::size_t>(side_ * side_);
    glm::vec3 sum(0.0f);
    unsigned covered = 0;
    for (std::size_t i = 0; i < samples; ++i) {
      const DepthItem item = nearest_[pixel * samples + i];
      if (item == TileFragments::kNothing) continue;
      const glm::vec4& fragment = stream.shade(item);
      sum += glm::vec3(fragment) / fragment.a;
      ++covered;
    }
    if (covered == 0) return;
    const auto all = static_cast<float>(samples);
    image.pixels[pixel] = {sum / all, (all - static_cast<float>(covered)) / all};
  }

  int side_;
  std::uint64_t seed_;
  std::shared_ptr<const TileTriangles> tiles_;
  View view_;
  glm::dmat4 image_from_eye_, eye_from_image_;
  std::vector<DepthItem> nearest_;  ///< of each finer pixel
  std::uint64_t points_ = 0;
};

Result<TileRenderer> make_silhouette_opaque(const FrameInfo& frame, const Settings& settings,
                                            const std::shared_ptr<const void>& prepared) {
  return renderer_of<SilhouetteOpaque>(frame, settings,
                                       std::static_pointer_cast<const TileTriangles>(prepared));
}

}  // namespace

const Technique kSilhouetteOpaque{
    .name = "sot",
    .title = "Silhouette-opaque transparency: random points",
    .paper = "Sen, Chemudugunta, Gopi 2003",
    .accuracy = Accuracy::kRandom,
    .k_means = "finer pixels along a pixel's side",
    .default_k = 4,
    .least_k = 1,
    .most_k = 8,
    .memory = "8 bytes a finer pixel",
    .fails = "noise; surfaces that are seen at an angle are more opaque, as intended",
    .needs_triangles = true,
    .prepare = prepare_silhouette_opaque,
    .make = make_silhouette_opaque,
};

}  // namespace strata::transparency
