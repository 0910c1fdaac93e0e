#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "csg/geometry.h"
#include "csg/surface/clusters.h"
#include "csg/surface/leaf_layers.h"
#include "csg/surface/tile_program.h"
#include "csg/surface/visible_surface.h"
#include "hashbuffer/tile_builder.h"
#include "strata/core/depth_list.h"
#include "strata/csg/surface/surface_image.h"

// The visible surface of a Boolean tree in one tile of a picture. Private to csg/.

namespace strata::csg {

/// The nearest entries of each pixel of an area whose solids are all of
/// LeafLayers::Kind::kFirstEntryOnly.
struct UnitedLayers {
  static constexpr std::uint32_t kEmpty = LeafLayers::kEmpty, kSteep = LeafLayers::kSteep;
  static constexpr int kKept = 3, kSide = LeafLayers::kLanes;
  int u0 = 0, v0 = 0;                 ///< of the area
  std::uint32_t* depths[kKept] = {};  ///< sorted
  std::uint32_t* faces[kKept] = {};   ///< [steep:1 | index:31]; nothing where there is no entry
  /// Lower bound of the depths of all entries that were not kept; of steep faces minus their
  /// extra_steps.
  std::uint32_t* bound_behind = nullptr;
  /// The depth beyond which a face is hidden and coincides with nothing that is seen.
  std::uint32_t hidden_beyond = kEmpty;
  /// Lower bound of the depths of the solids that were skipped as hidden.
  std::uint32_t skipped_from = kEmpty;
  /// For each face that was rasterized: its solid, its triangle, and how many depth steps more than
  /// Coincidence::range() it may be off (0 unless it is steep).
  std::vector<std::uint32_t> face_solids, face_triangles, extra_steps;

  void clear(Arena& arena, int u, int v);
  std::uint32_t add_face(const LatticeMesh& mesh, std::uint32_t solid, std::uint32_t triangle,
                         bool steep);
  [[nodiscard]] std::size_t index(int u, int v) const {
    return static_cast<std::size_t>((v - v0) * kSide + (u - u0));
  }
};

/// The faces of those areas of a tile that show one face in all of their pixels, or faces that look
/// the same.
struct AreaFaces {
  struct Face {
    std::uint32_t solid = Surface::kNone;     ///< kNone: nothing, or more than one
    std::uint32_t triangle = Surface::kNone;  ///< as SurfaceImage has it
    friend bool operator==(const Face&, const Face&) = default;
  };
  std::array<Face, AreaBounds::kAreas> of;  ///< row by row
};

/// An image of a part of the picture that begins at its pixel (u0, v0).
struct SurfacePart {
  SurfaceImage* image = nullptr;
  int u0 = 0, v0 = 0;
  /// If not null: gets the faces of areas, whose pixels of the image are left undefined.
  AreaFaces* faces = nullptr;
  /// Whether faces of a solid, as SurfaceImage has them but for `exit`, look the same: then one may
  /// stand for all of them in `faces`. None: they do not.
  std::function<bool(std::uint32_t solid, std::span<const std::uint32_t> triangles,
                     std::uint32_t exit)>
      alike = nullptr;
  [[nodiscard]] std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v - v0) * static_cast<std::size_t>(image->width) +
           static_cast<std::size_t>(u - u0);
  }
};

struct SearchArea;

/// Scratch of one thread.
class TileFinder {
 public:
  static constexpr std::uint32_t kNoLeaf = 0xffffffffu;
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
  /// What rays show that meet some close transitions. @param inside  solids of leaves that they are
  /// in before, to which those are added that all rays are in
  const Cluster& cluster_of(std::vector<std::uint32_t>& inside,
                            std::span<const Transition> members);
  [[nodiscard]] const Coincidence& coincidence() const { return *coincidence_; }
  [[nodiscard]] TransitionFaces faces() {
    return TransitionFaces(parts_, view_parts_, *coincidence_, &kept_faces_);
  }
  /// Flips of one pixel in place of crossings, for pixels that are not entered and left in turn.
  void normalize_pixel(LeafLayers& leaf, std::size_t at);

 private:
  [[nodiscard]] bool meets_tile(const ViewPart& part) const;
  /// Prepares a leaf for a solid in the tile. @param cut  as kind_of() has it @return whether it
  /// may be met there
  [[nodiscard]] bool place(LeafLayers& leaf, std::uint32_t solid, bool cut) const;
  /// Whether bounds of a leaf by area may save time.
  [[nodiscard]] bool wants_bounds(const LeafLayers& leaf);
  /// Finds bounds of a leaf in the tile, in its areas alone, or in those after the tile.
  void find_tile_bounds(LeafLayers& leaf);
  void find_bounds(LeafLayers& leaf, bool bounds_of_tile = false);
  /// Whether bounds of the leaves of a tile may save more time than they take.
  [[nodiscard]] bool bounds_pay(std::span<const LeafLayers> leaves);
  /// Finds all bounds that pay. in_tile_ become the leaves that may matter in the tile.
  void find_all_bounds(std::span<LeafLayers> leaves);
  /// The same where all leaves are just united: hidden_ become those that begin behind others that
  /// cover the tile.
  void find_united_bounds(std::span<LeafLayers> leaves);
  /// Leaves out of in_tile_ what cannot matter in the tile: as narrow(), and narrowed_program_ is
  /// then what is left. Finds bounds in the tile. (csg/surface/narrow_program.cpp)
  void narrow_tile(std::span<LeafLayers> leaves);
  /// tile_program_ and around_ become those of an area of a tile that is narrowed_.
  /// @return false: nothing is seen there
  [[nodiscard]] bool take_narrowed_program();
  /// Fills the pixels of one area. @param cut  the near plane may cut solids of the tile
  void find_area(const SearchArea& area, bool cut);
  /// present_ becomes the leaves that may be met in an area, prepared for it.
  void list_present(const SearchArea& area);
  /// Leaves out of tile_program_ what cannot matter in an area, where it is an intersection of
  /// solids minus others, and finds alone_ (csg/surface/narrow_program.cpp).
  /// @return false: nothing is seen there
  [[nodiscard]] bool narrow(std::size_t area);
  /// Finds what a pixel shows from all transitions of the program's leaves.
  void resolve(const TileProgram& program, std::uint64_t pixel);
  /// The same from transitions_.
  void show(std::uint64_t pixel);
  /// Prepares a leaf of bounds for an area.
  void enter_area(LeafLayers& leaf, const SearchArea& area, std::size_t index) const;
  /// Fills an area where all solids are convex and just united.
  void find_united(const SearchArea& area);
  /// Fills an area that shows just the entries of a convex solid, or its exits where entries are
  /// left out, if they cover each pixel once. @pre nothing else matters
  [[nodiscard]] bool show_alone(const SearchArea& area, LeafLayers& leaf);
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
  /// The same of a leaf, in its rectangle.
  [[nodiscard]] Input input_of(const LeafLayers& leaf);
  /// Makes the transitions of a leaf that has too many crossings for layers.
  void make_deep(LeafLayers& leaf, const Input& input);

  const Program* program_;
  const std::vector<ViewPart>& view_parts_;
  const std::vector<Geometry::Part>& parts_;
  const View* view_;
  const Coincidence* coincidence_;
  Arena arena_, area_arena_;
  std::vector<LeafLayers> leaves_;
  Simplifier simplifier_;
  TileProgram tile_program_;
  UnitedLayers united_;
  FirstHit first_hit_;
  Clusters clusters_;
  KeptFaces kept_faces_;
  bool narrowed_ = false;  ///< narrowed_program_ is what is left in the tile
  TileProgram narrowed_program_;
  SurfaceWindow window_;                    ///< of the tile
  std::vector<std::uint32_t> tile_around_;  ///< as around_, of the tile
  std::vector<std::uint32_t> in_tile_, present_, drawn_, hidden_, all_triangles_, area_triangles_;
  std::vector<std::uint8_t> is_present_;
  std::vector<std::uint32_t> around_;  ///< solids that all rays of an area are in where it counts
  std::uint32_t alone_ = kNoLeaf;  ///< of an area: nothing but its entries, or exits, can be seen
  std::vector<std::uint64_t> doubtful_;
  std::vector<std::uint32_t> slot_solids_;
  std::vector<Transition> transitions_, leaf_transitions_;
  ItemTileBuilder lists_{{.store = StoreKind::kCountScan}};
  std::vector<DepthItem> crossings_;
  PixelRect tile_;
  SurfacePart part_;
  std::uint64_t fragments_ = 0, resolved_ = 0;
  std::stop_token stop_;
};

// The kernels, compiled once for each SIMD target (csg/surface/tile_surface_simd.cpp).

/// How far apart two faces may be at least without coinciding, whatever their depth; those that are
/// steep count from their nearest to their farthest corner.
[[nodiscard]] std::uint32_t farthest_reach(const Coincidence::Range& range);

/// Inserts the crossings of `triangles` of `mesh` within `clip` into the layers of `leaf`. Gives
/// their number.
std::uint64_t raster_layers(const LatticeMesh& mesh, const RasterTarget& target,
                            std::span<const std::uint32_t> triangles, const PixelRect& clip,
                            double steep_from, LeafLayers& leaf, Arena& arena);
/// Makes transitions of crossings; pixels whose crossings are not pairs of an entry and an exit go
/// through finder.normalize_pixel().
void normalize_layers(LeafLayers& leaf, bool all_pixels_special, TileFinder& finder);

/// A part of a tile, LeafLayers::kLanes columns wide.
struct SearchArea {
  /// Which of the tile's it is, row by row.
  [[nodiscard]] std::size_t index() const {
    constexpr int kSide = AreaBounds::kSide;
    return static_cast<std::size_t>(rect.v0 % kTileSide / kSide * AreaBounds::kAcross +
                                    rect.u0 % kTileSide / kSide);
  }
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
/// Updates layers.hidden_beyond.
void find_hidden(const Coincidence::Range& range, UnitedLayers& layers);
/// Shows the nearest entry of each pixel of `area`. `doubtful` gets pixels where another is close.
void find_united(const UnitedLayers& layers, const PixelRect& area, const Coincidence::Range& range,
                 const SurfacePart& part, std::vector<std::uint64_t>& doubtful);

/// How the crossings of a part are kept: what lies behind the first entry of a convex solid that is
/// an operand of the union at the top is not asked for, unless rays may begin inside the tree.
/// @param cut  the near plane may cut this solid or another of the tile
[[nodiscard]] LeafLayers::Kind kind_of(const Program& program, std::uint32_t solid,
                                       const Geometry::Part& part, bool cut);
/// The only transition of a LeafLayers::Kind::kFirstEntryOnly, if there is one.
void first_entry_of(std::span<const DepthItem> crossings, std::uint32_t solid,
                    std::vector<Transition>& transitions);

}  // namespace strata::csg
