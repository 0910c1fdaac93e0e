#pragma once

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "csg/bounds/area_bounds.h"
#include "csg/transition.h"
#include "raster/tile_bins.h"

// The crossings of one solid in a tile. Private to csg/.

namespace strata::csg {

/// 64-byte aligned blocks that are given back all at once.
class Arena {
 public:
  std::uint32_t* words(std::size_t count);
  void clear() { block_ = used_ = 0; }

 private:
  static constexpr std::size_t kBlockWords = std::size_t{1} << 18;
  struct Free {
    void operator()(std::uint32_t* p) const { std::free(p); }
  };
  struct Block {
    std::unique_ptr<std::uint32_t, Free> words;
    std::size_t size = 0;
  };
  std::vector<Block> blocks_;
  std::size_t block_ = 0, used_ = 0;
};

/// The depths where rays enter and leave one solid in a tile, in layers: layer k holds the k-th
/// crossing of each pixel, and after normalizing the k-th transition (even: enters, odd: leaves).
struct LeafLayers {
  static constexpr std::uint32_t kEmpty = 0xffffffffu;
  /// Marks triangles beyond Coincidence::steep_from().
  static constexpr std::uint32_t kSteep = 0x80000000u;
  static constexpr int kLanes = 16;  ///< columns begin and end at multiples of this

  PixelRect rect;      ///< of the picture; u0 is a multiple of kLanes away from the tile's edge
  int stride = 0;      ///< words a row
  bool made = false;   ///< rasterized and normalized
  bool steep = false;  ///< some triangle is marked
  /// How crossings are kept.
  enum class Kind : std::uint8_t {
    kSorted,
    kConvex,  ///< a ray should enter and leave once: layer 0 takes entries, layer 1 exits, further
              ///< ones what happens all the same
    kFirstEntryOnly  ///< only the nearest entry, as a depth: of convex union operands
  } kind = Kind::kSorted;
  std::uint32_t solid = 0;
  /// There are bounds for each area, and layers of one area at a time: `rect` is its rectangle.
  bool by_area = false;
  /// Crossings of a convex solid that are not rasterized: exits behind all that counts, or entries
  /// before it of a solid that all rays are in. Those count as entered at depth 0, by no triangle.
  enum class LeftOut : std::uint8_t { kNothing, kExits, kEntries } left_out = LeftOut::kNothing;
  AreaBounds bounds;
  /// Once made: which areas of kLanes x kLanes pixels of the tile it meets, row by row.
  std::uint16_t areas = 0;
  /// Bounds of its depths; those of the tile once it is made.
  std::uint32_t nearest = 0, farthest = 0;
  /// While rasterizing depth << 1 | exit (of kConvex in layers 0 and 1 depths), then depths of
  /// transitions. kEmpty where there is none.
  std::vector<std::uint32_t*> keys;
  std::vector<std::uint32_t*> triangles;  ///< [steep:1 | triangle:31]
  /// With more crossings a pixel than kMostLayers there are no layers: inserting into them takes
  /// time that grows with the square. Then these are the transitions of each pixel of the tile, one
  /// after the other, and all pixels are decided one by one.
  static constexpr std::size_t kMostLayers = 192;
  bool deep = false;
  std::vector<std::uint32_t>
      transition_ends;  ///< of each pixel of the tile: where its transitions end
  std::vector<Transition> transitions;

  [[nodiscard]] std::size_t words() const {  // vectors may reach beyond the last row
    return static_cast<std::size_t>((rect.v1 - rect.v0 + 4) * stride + 2 * kLanes);
  }
  void add_layer(Arena& arena);
};

}  // namespace strata::csg
