#include "csg/picture/ground_shadow.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <limits>

#include "picture/occlusion.h"

namespace strata::csg {
namespace {

constexpr int kSide = 192;  ///< pixels of the map
constexpr std::size_t kPixels = std::size_t{kSide} * kSide;
/// What a shadow covers of the background where all of the sky is hidden.
constexpr float kDarkest = 0.55f;
/// A point of the plane looks this far around it, in pixels of the map.
constexpr int kFarthest = 64;
/// Toward the border of the map shadows fade away, over this many pixels.
constexpr float kFade = 24.0f;
constexpr float kNothing = -1.0f;  ///< height where nothing is

/// The sky is cut into this many rings of equal light, of a plane that lies flat.
constexpr int kRings = 32;

/// A point looks in 16 directions, its neighbours in a square of 4 x 4 in others: 256 in all.
constexpr int kDirections = 16, kTurns = 16;
std::array<glm::vec2, kDirections * kTurns> make_directions() {  // by 2 pi / 256
  return turned_directions<kDirections * kTurns>(0.99969881869620425, 0.024541228522912288);
}

/// Looks at a square of the plane.
Result<View> square_view(const glm::dvec2& middle, double half, bool from_below,
                         const Bounds& box) {
  Camera camera;
  camera.projection = Projection::kOrthographic;
  camera.rotation = {from_below ? 180.0 : 0.0, 0.0, 0.0};
  camera.target = {middle, from_below ? box.low.z : box.high.z};
  camera.distance = half / std::tan(glm::radians(camera.field_of_view) / 2.0);
  return make_view(camera, {kSide, kSide}, box);
}

/// From (x, y, 1) on the plane z = height to (u w, v w, w) of a view's pixels.
glm::dmat3 image_from_ground(const View& view, double height) {
  const glm::dmat4& m = view.image_from_world;
  const auto row = [](const glm::dvec4& column) {
    return glm::dvec3(column.x, column.y, column.w);
  };
  return {row(m[0]), row(m[1]), row(m[2]) * height + row(m[3])};
}

/// Heights of a view from above or below, z; not a number where nothing is seen.
std::vector<double> heights_of(const View& view, const SurfaceImage& image, bool from_below) {
  const double eye = glm::inverse(view.eye_from_world)[3].z;
  std::vector<double> heights(kPixels, std::numeric_limits<double>::quiet_NaN());
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      const auto from = static_cast<std::size_t>(v * kSide + u);
      if (image.depth[from] == SurfaceImage::kNone) continue;
      const double distance = view.distance(image.depth[from] + 0.5);
      // Seen from below, y goes down, from above up.
      const auto to = static_cast<std::size_t>((from_below ? v : kSide - 1 - v) * kSide + u);
      heights[to] = eye + (from_below ? distance : -distance);
    }
  }
  return heights;
}

/// The rings between two heights at a distance, one bit each.
std::uint32_t rings(float low, float high, float distance) {
  const auto ring = [&](float height) {
    const float square = height * height;
    return static_cast<int>(kRings * square / (square + distance * distance) + 0.5f);
  };
  const int first = ring(low), end = ring(high);
  if (first >= end) return 0;
  return (0xffffffffu >> (kRings - (end - first))) << first;
}

/// Columns of the result over the plane, in pixels of the map.
struct Columns {
  std::vector<float> low, high;  ///< kNothing: none
  std::array<glm::vec2, kDirections* kTurns> directions = make_directions();

  /// Whether a column stands on the plane, so that nobody sees it there.
  [[nodiscard]] bool stands(std::size_t at) const { return low[at] >= 0 && low[at] < 1; }

  /// The part of the sky that they hide from a point of the plane, in [0, 1].
  [[nodiscard]] float hidden(int u, int v) const {
    const std::size_t at = index(u, v);
    // Right above, whatever the height is.
    const std::uint32_t above = low[at] < 0 ? 0 : rings(low[at], 1e6f, 0.5f);
    const auto turn = static_cast<std::size_t>((u & 3) * 4 + (v & 3));
    int count = 0;
    for (std::size_t k = 0; k < kDirections; ++k) {
      const glm::vec2& along = directions[k * kTurns + turn];
      std::uint32_t mask = above;
      for (int step = 1; step <= kFarthest; step += 1 + step / 16) {
        const int to_u =
            u + static_cast<int>(std::floor(along.x * static_cast<float>(step) + 0.5f));
        const int to_v =
            v + static_cast<int>(std::floor(along.y * static_cast<float>(step) + 0.5f));
        if (to_u < 0 || to_v < 0 || to_u >= kSide || to_v >= kSide) break;
        const std::size_t there = index(to_u, to_v);
        if (low[there] >= 0) mask |= rings(low[there], high[there], static_cast<float>(step));
      }
      count += std::popcount(mask);
    }
    return static_cast<float>(count) / static_cast<float>(kRings * kDirections);
  }

 private:
  [[nodiscard]] static std::size_t index(int u, int v) {
    return static_cast<std::size_t>(v) * kSide + static_cast<std::size_t>(u);
  }
};

/// The mean over the 16 turns around a pixel, of points of the plane that may be seen; 1 where
/// there are none.
float mean_around(const Columns& columns, const std::vector<float>& hidden, int x, int y) {
  constexpr float kWeights[] = {0.5f, 1.0f, 1.0f, 1.0f, 0.5f};
  float sum = 0.0f, weights = 0.0f;
  for (int v = std::max(0, y - 2); v <= std::min(kSide - 1, y + 2); ++v) {
    for (int u = std::max(0, x - 2); u <= std::min(kSide - 1, x + 2); ++u) {
      const auto at = static_cast<std::size_t>(v * kSide + u);
      if (columns.stands(at)) continue;
      const float weight = kWeights[v - y + 2] * kWeights[u - x + 2];
      sum += weight * hidden[at];
      weights += weight;
    }
  }
  return weights > 0.0f ? sum / weights : 1.0f;
}

/// 1 inside, falling to 0 at the border of the map.
float fade(int u, int v) {
  const int inside = std::min(std::min(u, v), kSide - 1 - std::max(u, v));
  const float part = std::min(1.0f, static_cast<float>(inside) / kFade);
  return part * part * (3.0f - 2.0f * part);
}

}  // namespace

Result<GroundShadow> GroundShadow::make(const Bounds& box, const Draw& draw,
                                        const Execution& execution) {
  GroundShadow shadow;
  if (box.empty()) return shadow;
  glm::dvec2 middle = 0.5 * (glm::dvec2(box.low) + glm::dvec2(box.high));
  double half = 0.51 * std::max(box.high.x - box.low.x, box.high.y - box.low.y);
  // First all of the box, of which cutters may be most.
  const auto whole = square_view(middle, half, true, box);
  if (!whole) return shadow;  // the box is flat
  const auto image = draw(*whole);
  if (!image) return tl::unexpected(image.error());
  glm::ivec2 low(kSide), high(-1);
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      if ((*image)->depth[static_cast<std::size_t>(v * kSide + u)] == SurfaceImage::kNone) continue;
      low = glm::min(low, glm::ivec2(u, v)), high = glm::max(high, glm::ivec2(u + 1, v + 1));
    }
  }
  if (high.x < low.x) return shadow;
  // Then what there is, with room around it. Seen from below, x goes right and y goes down.
  const double pixel = 2 * half / kSide;
  middle += pixel * 0.5 * glm::dvec2(low + high) - half;
  half = 0.95 * pixel * std::max(high.x - low.x, high.y - low.y) + pixel;
  View below;
  std::vector<double> heights[2];  // of the lowest and of the highest surface
  for (const bool from_below : {true, false}) {
    const auto view = square_view(middle, half, from_below, box);
    if (!view) return shadow;
    const auto seen = draw(*view);
    if (!seen) return tl::unexpected(seen.error());
    heights[from_below ? 0 : 1] = heights_of(*view, **seen, from_below);
    if (from_below) below = *view;
  }
  shadow.add_columns(heights[0], heights[1], kSide / (2 * half), execution);
  shadow.map_from_ground_ = image_from_ground(below, shadow.height_);
  return shadow;
}

void GroundShadow::add_columns(const std::vector<double>& low, const std::vector<double>& high,
                               double pixels_a_unit, const Execution& execution) {
  height_ = std::numeric_limits<double>::infinity();
  for (const double height : low)
    height_ = std::min(height_, std::isnan(height) ? height_ : height);
  if (!std::isfinite(height_)) return;
  Columns columns;
  columns.low.assign(kPixels, kNothing);
  columns.high.assign(kPixels, kNothing);
  for (std::size_t i = 0; i < kPixels; ++i) {
    if (std::isnan(low[i]) || std::isnan(high[i])) continue;
    columns.low[i] = static_cast<float>((low[i] - height_) * pixels_a_unit);
    columns.high[i] = static_cast<float>((high[i] - height_) * pixels_a_unit);
  }
  std::vector<float> hidden(kPixels, 0.0f);
  parallel_for(execution, kSide, [&](std::size_t v, int) {
    for (std::size_t u = 0; u < kSide; ++u) {
      if (columns.stands(v * kSide + u)) continue;
      hidden[v * kSide + u] = columns.hidden(static_cast<int>(u), static_cast<int>(v));
    }
  });
  dark_.assign(kPixels, 0.0f);
  parallel_for(execution, kSide, [&](std::size_t v, int) {
    for (std::size_t u = 0; u < kSide; ++u) {
      const int x = static_cast<int>(u), y = static_cast<int>(v);
      dark_[v * kSide + u] = fade(x, y) * mean_around(columns, hidden, x, y);
    }
  });
}

float GroundShadow::at(const glm::dvec2& pixel) const {
  const glm::dvec2 from = pixel - 0.5, whole = glm::floor(from);
  if (!(whole.x >= 0 && whole.y >= 0 && whole.x < kSide - 1 && whole.y < kSide - 1)) return 0.0f;
  const glm::vec2 part(from - whole);
  const std::size_t i =
      static_cast<std::size_t>(whole.y) * kSide + static_cast<std::size_t>(whole.x);
  const float above = dark_[i] * (1 - part.x) + dark_[i + 1] * part.x;
  const float below = dark_[i + kSide] * (1 - part.x) + dark_[i + kSide + 1] * part.x;
  return std::min(1.0f, above * (1 - part.y) + below * part.y);
}

void GroundShadow::lay_under(Picture& picture, const View& view, const Execution& execution) const {
  const glm::dmat4 world_from_eye = glm::inverse(view.eye_from_world);
  const bool from_above =
      view.perspective ? world_from_eye[3].z > height_ : world_from_eye[2].z > 0;
  if (dark_.empty() || !from_above) return;
  const glm::dmat3 map_from_image =
      map_from_ground_ * glm::inverse(image_from_ground(view, height_));
  parallel_for(execution, static_cast<std::size_t>(picture.height), [&](std::size_t v, int) {
    Rgba* row = picture.pixels.data() + v * static_cast<std::size_t>(picture.width);
    for (int u = 0; u < picture.width; ++u) {
      if (row[u].a == 255) continue;
      const glm::dvec3 to = map_from_image * glm::dvec3(u + 0.5, static_cast<double>(v) + 0.5, 1.0);
      if (!(to.z > 0)) continue;  // beyond the horizon
      const float dark = kDarkest * at(glm::dvec2(to) / to.z);
      if (!(dark > 0.0f)) continue;
      const float over = static_cast<float>(row[u].a) / 255.0f;
      const float alpha = over + (1.0f - over) * dark;
      const glm::vec3 colour = glm::vec3(row[u]) * (over / alpha);
      row[u] = Rgba(glm::u8vec3(colour + 0.5f), static_cast<std::uint8_t>(alpha * 255.0f + 0.5f));
    }
  });
}

}  // namespace strata::csg
