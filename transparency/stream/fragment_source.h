#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "hashbuffer/tile_store.h"
#include "raster/view_part.h"
#include "strata/core/depth_list.h"
#include "strata/core/result.h"
#include "strata/raster/raster_target.h"

// Where fragments come from. Private to transparency/ and to the rooms above it.

namespace strata::transparency {

/// The face of a fragment, [triangle << 1 | exit].
[[nodiscard]] inline std::size_t face_of(DepthItem item) {
  return static_cast<std::size_t>(item.triangle()) << 1 | (item.exit() ? 1 : 0);
}

/// The fragments of one tile. A pixel is v * kTileSide + u within the tile.
struct TileFragments {
  static constexpr DepthItem kNothing{std::numeric_limits<std::uint64_t>::max()};

  TileLog<Record64> log;          ///< in submission order; hidden ones are left out
  bool any_opaque = false;        ///< the two arrays are filled
  std::vector<DepthItem> opaque;  ///< of each pixel: the nearest opaque fragment or kNothing

  /// In place of the log: fragments that the source keeps.
  std::span<const std::uint32_t> kept_pixels;
  std::span<const DepthItem> kept_items;

  [[nodiscard]] std::span<const std::uint32_t> pixels() const {
    return kept_pixels.empty() ? std::span(log.pixels).first(log.count) : kept_pixels;
  }
  [[nodiscard]] std::span<const DepthItem> items() const {
    return kept_pixels.empty() ? std::span(log.keys).first(log.count) : kept_items;
  }
  void clear() {
    log.count = 0;
    kept_pixels = {};
    kept_items = {};
    any_opaque = false;
  }
  /// Makes room for opaque fragments, none yet.
  void begin_opaque() {
    any_opaque = true;
    opaque.assign(kTilePixels, kNothing);
  }
  void add(std::uint32_t pixel, DepthItem item) {
    log.reserve(1);
    log.pixels[log.count] = pixel;
    log.keys[log.count++] = item;
  }
};

/// The triangles of a frame, for techniques that need more than fragments.
struct FrameTriangles {
  const ViewPart& part;  ///< in the image lattice of the samples; see ViewPart::source()
  const View& view;      ///< of the samples
  std::span<const std::uint32_t> object_of;  ///< of each source triangle; empty: all object 0
  std::span<const std::uint8_t> opaque;      ///< of each source triangle; empty: none
  std::size_t objects = 0;
};

/// The fragments of a frame, tile by tile.
class FragmentSource {
 public:
  virtual ~FragmentSource() = default;

  /// Samples of the picture: its pixels times the sample grid.
  [[nodiscard]] virtual glm::ivec2 size() const = 0;
  /// The lit colour of face [triangle << 1 | exit]: premultiplied red, green, blue, and opacity.
  [[nodiscard]] virtual std::span<const glm::vec4> colours() const = 0;
  /// The object of each triangle; empty: all are of object 0.
  [[nodiscard]] virtual std::span<const std::uint32_t> objects() const { return {}; }
  /// Null: there are no triangles.
  [[nodiscard]] virtual const FrameTriangles* triangles() const { return nullptr; }

  /// The scratch memory of one thread.
  class Worker {
   public:
    virtual ~Worker() = default;
    /// The fragments of tile (tu, tv). @param keep_hidden  also what lies behind opaque fragments
    virtual Result<void> tile(int tu, int tv, bool keep_hidden, TileFragments& out) = 0;
  };
  [[nodiscard]] virtual std::unique_ptr<Worker> worker() const = 0;
};

}  // namespace strata::transparency
