#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "strata/core/depth_list.h"
#include "strata/raster/raster_target.h"
#include "strata/transparency/stream/technique.h"
#include "transparency/stream/fragment_source.h"

// What techniques are written with. Private to transparency/.

namespace strata::transparency {

/// C += T a c, T *= 1 - a, from the front to the back.
struct FrontToBack {
  glm::vec3 colour{0.0f};
  float transmittance = 1.0f;

  /// @param fragment  premultiplied
  void add(const glm::vec4& fragment) {
    colour += transmittance * glm::vec3(fragment);
    transmittance *= 1.0f - fragment.a;
  }
  [[nodiscard]] glm::vec4 result() const { return {colour, transmittance}; }
};

/// C = a c + (1 - a) C from the back to the front. In exact numbers the same as FrontToBack.
struct BackToFront {
  glm::vec3 colour{0.0f};
  float transmittance = 1.0f;

  void add(const glm::vec4& fragment) {
    colour = glm::vec3(fragment) + (1.0f - fragment.a) * colour;
    transmittance *= 1.0f - fragment.a;
  }
  [[nodiscard]] glm::vec4 result() const { return {colour, transmittance}; }
};

/// What is seen through `seen`, a colour and a transmittance: with `behind`, premultiplied.
[[nodiscard]] inline glm::vec4 over(const glm::vec4& seen, const glm::vec4& behind) {
  return {glm::vec3(seen) + seen.a * glm::vec3(behind), (1.0f - seen.a) + seen.a * behind.a};
}

/// What a technique makes of a tile: for each pixel, at v * kTileSide + u, the premultiplied colour
/// of what is seen through, and the transmittance for what lies behind it. Techniques write pixels
/// with fragments; all others stay as they are, nothing.
struct TileImage {
  std::array<glm::vec4, kTilePixels> pixels;

  void clear() { pixels.fill(glm::vec4(0.0f, 0.0f, 0.0f, 1.0f)); }
};

/// The facts about a frame that a technique may need before the first tile.
struct FrameInfo {
  glm::ivec2 size{0};        ///< samples
  int across = 1, down = 1;  ///< samples of a pixel
  std::span<const glm::vec4> colours;
  std::span<const std::uint32_t> objects;  ///< of each triangle; empty: all are of object 0
  const FrameTriangles* triangles = nullptr;
  const FragmentSource* source = nullptr;  ///< for what is prepared before the first tile
};

/// The fragments of a tile, to be replayed, with the costs that this has.
class TileStream {
 public:
  TileStream(const TileFragments& fragments, const FrameInfo& frame, const PixelRect& rect,
             Costs& costs)
      : fragments_(&fragments),
        pixels_(fragments.pixels()),
        items_(fragments.items()),
        frame_(&frame),
        rect_(rect),
        costs_(&costs) {}

  /// Pixels (samples) of the tile, at most kTileSide each. The last tiles of a picture are smaller.
  [[nodiscard]] int width() const { return rect_.u1 - rect_.u0; }
  [[nodiscard]] int height() const { return rect_.v1 - rect_.v0; }
  [[nodiscard]] std::uint64_t pixel_count() const {
    return static_cast<std::uint64_t>(width()) * static_cast<std::uint64_t>(height());
  }
  /// Where the tile lies in the picture.
  [[nodiscard]] const PixelRect& rect() const { return rect_; }
  [[nodiscard]] const FrameInfo& frame() const { return *frame_; }
  [[nodiscard]] Costs& costs() { return *costs_; }
  [[nodiscard]] std::size_t size() const { return pixels_.size(); }

  /// A geometry pass: calls body(pixel, item) for each fragment, in submission order; pixel is
  /// v * kTileSide + u.
  template <class Body>
  void pass(Body&& body) {
    ++passes_;
    costs_->rasterized += size();
    const std::uint32_t* pixels = pixels_.data();
    const DepthItem* items = items_.data();
    for (std::size_t i = 0, count = size(); i < count; ++i) body(pixels[i], items[i]);
  }
  /// Counts a geometry pass of which only `fragments` were rasterized, such as one that a query
  /// ends early.
  void count_pass(std::uint64_t fragments) {
    ++passes_;
    costs_->rasterized += fragments;
  }
  [[nodiscard]] std::uint64_t passes() const { return passes_; }

  /// The fragments as arrays, for techniques that hand them to a store; count_pass() counts.
  [[nodiscard]] std::span<const std::uint32_t> pixels() const { return pixels_; }
  [[nodiscard]] std::span<const DepthItem> items() const { return items_; }

  /// The index of a fragment's colour.

  /// The colour of a fragment, premultiplied, and its opacity.
  [[nodiscard]] const glm::vec4& shade(DepthItem item) {
    ++costs_->shaded;
    return frame_->colours[face_of(item)];
  }
  /// The same, to be counted by count_shaded().
  [[nodiscard]] const glm::vec4& colour(DepthItem item) const {
    return frame_->colours[face_of(item)];
  }
  void count_shaded(std::uint64_t fragments) { costs_->shaded += fragments; }
  /// The nearest opaque fragment of a pixel, or TileFragments::kNothing.
  [[nodiscard]] DepthItem opaque(std::uint32_t pixel) const {
    return fragments_->any_opaque ? fragments_->opaque[pixel] : TileFragments::kNothing;
  }
  [[nodiscard]] float opacity(DepthItem item) const { return frame_->colours[face_of(item)].a; }
  [[nodiscard]] std::uint32_t object(DepthItem item) const {
    return frame_->objects.empty() ? 0 : frame_->objects[item.triangle()];
  }

 private:
  const TileFragments* fragments_;
  std::span<const std::uint32_t> pixels_;
  std::span<const DepthItem> items_;
  const FrameInfo* frame_;
  PixelRect rect_;
  Costs* costs_;
  std::uint64_t passes_ = 0;
};

/// Calls body(pixel) for each pixel of a tile.
template <class Body>
void for_each_pixel(const TileStream& stream, Body&& body) {
  for (int v = 0; v < stream.height(); ++v) {
    for (int u = 0; u < stream.width(); ++u) {
      body(static_cast<std::uint32_t>(v * kTileSide + u));
    }
  }
}

/// The renderer that calls render(stream, image) of an `Object` of its own, made of `arguments`.
template <class Object, class... Arguments>
[[nodiscard]] TileRenderer renderer_of(Arguments&&... arguments) {
  return [object = std::make_shared<Object>(std::forward<Arguments>(arguments)...)](
             TileStream& stream, TileImage& image) -> Result<void> {
    if constexpr (std::is_void_v<decltype(object->render(stream, image))>) {
      object->render(stream, image);
      return {};
    } else {
      return object->render(stream, image);
    }
  };
}

}  // namespace strata::transparency
