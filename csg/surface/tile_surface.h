#pragma once

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <stop_token>
#include <vector>

#include "csg/geometry.h"
#include "csg/surface/visible_surface.h"
#include "hashbuffer/tile_builder.h"
#include "strata/core/depth_list.h"
#include "strata/csg/surface/surface_image.h"

// The visible surface of a Boolean tree in one tile of a picture. Private to csg/.

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
/// crossing of each pixel, and after normalizing the k-th flip (even: enters, odd: leaves).
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
    kFirst    ///< only the nearest entry, as a depth: of convex solids united with all the rest
  } kind = Kind::kSorted;
  std::uint32_t solid = 0;
  /// Once made: which areas of kLanes x kLanes pixels of the tile it meets, row by row.
  std::uint16_t areas = 0;
  /// Bounds of its depths; those of the tile once it is made.
  std::uint32_t nearest = 0, farthest = 0;
  /// While rasterizing depth << 1 | exit, then depths of flips. kEmpty where there is none.
  std::vector<std::uint32_t*> keys;
  std::vector<std::uint32_t*> triangles;  ///< [steep:1 | triangle:31]
  /// With more crossings a pixel than kMostLayers there are no layers: inserting into them takes
  /// time that grows with the square. Then these are the flips of each pixel of the tile, one
  /// after the other, and all pixels are decided one by one.
  static constexpr std::size_t kMostLayers = 192;
  bool deep = false;
  std::vector<std::uint32_t> flip_ends;  ///< of each pixel of the tile: where its flips end
  std::vector<Flip> flips;

  [[nodiscard]] std::size_t words() const {  // vectors may reach beyond the last row
    return static_cast<std::size_t>((rect.v1 - rect.v0 + 4) * stride + 2 * kLanes);
  }
  void add_layer(Arena& arena);
};

/// The nearest entries of each pixel of a tile whose solids are all of LeafLayers::Kind::kFirst.
struct UnitedLayers {
  static constexpr std::uint32_t kEmpty = LeafLayers::kEmpty, kSteep = LeafLayers::kSteep;
  static constexpr int kKept = 3;
  int u0 = 0, v0 = 0;                 ///< of the tile
  std::uint32_t* depths[kKept] = {};  ///< sorted
  std::uint32_t* faces[kKept] = {};   ///< [steep:1 | index:31]; nothing where there is no entry
  std::uint32_t* rest = nullptr;      ///< how near those behind may be: a depth, of steep ones less
                                      ///< their `more`
  /// Of each area of LeafLayers::kLanes x kLanes pixels, row by row: what lies farther is hidden
  /// there and coincides with nothing seen; how near what was left out for that may be.
  static constexpr int kAreasAcross = kTileSide / LeafLayers::kLanes;
  std::uint32_t far[kAreasAcross * kAreasAcross], hidden[kAreasAcross * kAreasAcross];
  /// Of each face that was rasterized: its solid, triangle, and how many depth steps more than
  /// Coincidence::range() it may be off, 0 unless it is steep.
  std::vector<std::uint32_t> face_solids, face_triangles, more;

  void clear(Arena& arena, const PixelRect& tile);
  std::uint32_t add_face(const LatticeMesh& mesh, std::uint32_t solid, std::uint32_t triangle,
                         bool steep);
  /// Whether all of a solid that begins at depth `nearest` is hidden in `clip`, and notes it.
  bool hides(const PixelRect& clip, std::uint32_t nearest);
  /// Calls body(area) for the areas that `clip` meets.
  template <class Body>
  void for_each_area(const PixelRect& clip, Body&& body) const {
    constexpr int kSide = LeafLayers::kLanes;
    for (int v = (clip.v0 - v0) / kSide; v <= (clip.v1 - 1 - v0) / kSide; ++v) {
      for (int u = (clip.u0 - u0) / kSide; u <= (clip.u1 - 1 - u0) / kSide; ++u) {
        body(static_cast<std::size_t>(v * kAreasAcross + u));
      }
    }
  }
  [[nodiscard]] std::size_t index(int u, int v) const {
    return static_cast<std::size_t>((v - v0) * kTileSide + (u - u0));
  }
};

/// An image of a part of the picture that begins at its pixel (u0, v0).
struct SurfacePart {
  SurfaceImage* image = nullptr;
  int u0 = 0, v0 = 0;
  [[nodiscard]] std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v - v0) * static_cast<std::size_t>(image->width) +
           static_cast<std::size_t>(u - u0);
  }
};

/// What remains of a program in a part of a tile, where all other solids are absent. Leaves are
/// indices into the tile's leaves.
struct TileProgram {
  struct Node {
    std::uint32_t first = 0, count = 0;  ///< edges
    std::uint32_t nearest = 0;           ///< no flip lies before
  };
  std::vector<Program::Edge> edges;    ///< of a node: true while idle first, then nearest first
  std::vector<std::uint32_t> nearest;  ///< of each edge: no flip lies before; 0 for true while idle
  std::vector<Node> nodes;             ///< children before parents
  std::vector<std::uint32_t> leaves;   ///< that occur
  std::uint32_t root = 0;
  bool root_inverted = false;
  bool constant = false;  ///< no leaf matters; then `value` is the tree's value
  bool value = false;
  int depth = 0;  ///< nodes on the longest way from the root to a leaf, 255 at most
};

/// Simplifies a program for the leaves at hand.
class Simplifier {
 public:
  explicit Simplifier(const Program& program);
  /// @param present indices into `leaves` of those that may be met here
  void simplify(std::span<const LeafLayers> leaves, std::span<const std::uint32_t> present,
                TileProgram& out);

 private:
  struct Seen {
    std::uint32_t stamp = 0;
    std::uint32_t first_child = Program::kNone;  ///< into children_
    std::uint32_t out = 0;                       ///< node of the output
    std::uint32_t leaf = 0;                      ///< where the node is just a leaf
    enum class Kind : std::uint8_t { kNode, kLeaf, kTrue, kFalse } kind = Kind::kNode;
    bool inverted = false;  ///< kLeaf, kNode: it is the opposite of that
  };
  struct Child {
    std::uint32_t id;
    bool leaf, inverted;
    std::uint32_t next;
  };
  struct Sorted {
    Program::Edge edge;
    std::uint32_t nearest;
  };
  const Program* program_;
  std::vector<Seen> seen_;
  std::vector<Child> children_;
  std::vector<std::uint32_t> marked_, stack_;
  std::vector<Sorted> gathered_;
  std::vector<std::uint8_t> out_idle_;  ///< of the output's nodes
  std::vector<std::uint8_t> out_depth_;
  std::uint32_t stamp_ = 0;
};

/// Scratch of one thread.
class TileFinder {
 public:
  /// Keeps references to all of them, whatever view they are of.
  TileFinder(const Program& program, const std::vector<ViewPart>& view_parts,
             const std::vector<Geometry::Part>& parts, const View& view,
             const Coincidence& coincidence);
  ~TileFinder();

  /// Fills the tile's pixels of `part`, not all of them if it is stopped. `solids`: those that may
  /// be met in the tile.
  void find(int tile_u, int tile_v, std::span<const std::uint32_t> solids, const SurfacePart& part,
            const std::stop_token& stop);

  void reset_counts() { fragments_ = resolved_ = 0; }
  [[nodiscard]] std::uint64_t fragments() const { return fragments_; }
  [[nodiscard]] std::uint64_t resolved() const { return resolved_; }

  /// Rasterizes and normalizes a leaf that is needed after all.
  void make(LeafLayers& leaf);
  /// Flips of one pixel in place of crossings, for pixels that are not plain.
  void normalize_pixel(LeafLayers& leaf, std::size_t at);

 private:
  /// Finds what a pixel shows from all flips of the program's leaves.
  void resolve(const TileProgram& program, std::uint64_t pixel);
  /// The same from flips_.
  void show(std::uint64_t pixel);
  /// Fills the tile where all solids are convex and just united.
  void find_united(std::span<LeafLayers> leaves);
  /// Decides a doubtful pixel of united_ by the entries kept. @return false: more of them matter
  bool show_united(std::uint64_t pixel);
  /// Triangles of the tile's pixels become those of the meshes: those of a solid that the near
  /// plane cuts are numbered otherwise.
  void number_sources();
  /// What a part shows in the tile: its pixels, and the triangles to look at.
  struct Input {
    PixelRect clip;
    std::span<const std::uint32_t> triangles;
  };
  [[nodiscard]] Input input_of(std::uint32_t solid);
  /// Makes the flips of a leaf that has too many crossings for layers.
  void make_deep(LeafLayers& leaf, const Input& input);

  const Program* program_;
  const std::vector<ViewPart>& view_parts_;
  const std::vector<Geometry::Part>& parts_;
  const View* view_;
  const Coincidence* coincidence_;
  Arena arena_;
  std::vector<LeafLayers> leaves_;
  Simplifier simplifier_;
  TileProgram tile_program_;
  UnitedLayers united_;
  SurfaceFinder finder_;
  std::vector<std::uint32_t> present_, all_triangles_;
  std::vector<std::uint64_t> doubtful_;
  std::vector<std::uint32_t> slot_solids_;
  std::vector<Flip> flips_, leaf_flips_;
  ItemTileBuilder lists_{{.store = StoreKind::kCountScan}};
  std::vector<DepthItem> crossings_;
  PixelRect tile_;
  SurfacePart part_;
  std::uint64_t fragments_ = 0, resolved_ = 0;
  std::stop_token stop_;
};

// The kernels, compiled once for each SIMD target (csg/surface/tile_surface_simd.cpp).

/// Inserts the crossings of `triangles` of `mesh` within `clip` into the layers of `leaf`. Gives
/// their number.
std::uint64_t raster_layers(const LatticeMesh& mesh, const RasterTarget& target,
                            std::span<const std::uint32_t> triangles, const PixelRect& clip,
                            double steep_from, LeafLayers& leaf, Arena& arena);
/// Turns crossings into flips; pixels that are not plain pairs go through finder.normalize_pixel().
void normalize_layers(LeafLayers& leaf, bool all_pixels_special, TileFinder& finder);

/// A part of a tile, LeafLayers::kLanes columns wide.
struct SearchArea {
  std::span<LeafLayers> leaves;
  const std::uint32_t* solids = nullptr;  ///< of the leaves
  const TileProgram* program = nullptr;
  PixelRect rect;  ///< of the picture; u1 may lie beyond its right edge
  int end = 0;     ///< columns of the picture
  Coincidence::Range range;
  SurfacePart part;
  std::vector<std::uint64_t>* doubtful = nullptr;  ///< gets pixels (indices into the part) where
                                                   ///< crossings of several solids are close
};
/// Finds the visible surface of each pixel.
void search_surface(const SearchArea& area, TileFinder& finder);

/// Inserts the entries of `triangles` of `mesh` within `clip`. Gives their number.
std::uint64_t raster_united(const LatticeMesh& mesh, const RasterTarget& target,
                            std::span<const std::uint32_t> triangles, const PixelRect& clip,
                            double steep_from, std::uint32_t solid, UnitedLayers& layers);
/// Brings layers.far up to date in `clip`.
void find_hidden(const PixelRect& clip, const Coincidence::Range& range, UnitedLayers& layers);
/// Shows the nearest entry of each pixel of `tile`. `doubtful` gets pixels where another is close.
void find_united(const UnitedLayers& layers, const PixelRect& tile, const Coincidence::Range& range,
                 const SurfacePart& part, std::vector<std::uint64_t>& doubtful);

/// How the crossings of a part are kept: what lies behind the first entry of a convex solid that is
/// united with all the rest is not asked for.
[[nodiscard]] LeafLayers::Kind kind_of(const Program& program, std::uint32_t solid,
                                       const Geometry::Part& part, const ViewPart& view_part);
/// The only flip of a LeafLayers::Kind::kFirst, if there is one.
void first_entry_of(std::span<const DepthItem> crossings, std::uint32_t solid,
                    std::vector<Flip>& flips);

}  // namespace strata::csg
