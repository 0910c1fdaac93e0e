#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "strata/core/execution.h"
#include "strata/core/result.h"

// What a technique of order-independent transparency is. WORDS:
//   fragment        a point where a pixel's ray meets a triangle, with a colour and an opacity
//   stream          the fragments of a tile in submission order: by triangle, then by pixel
//   geometry pass   one walk over the stream; a technique may need several
//   transmittance   the part of the light from behind that comes through: 1 - opacity, multiplied
//   layer           a fragment of a pixel's list, counted front to back

namespace strata::transparency {

/// What a technique's picture can be relied on for.
enum class Accuracy : std::uint8_t {
  kExact,    ///< the picture of the sorted lists, while memory lasts
  kBounded,  ///< memory a pixel is bounded; exact up to a number of layers or for some scenes
  kRandom,   ///< right on average; seeded
};

/// In which order an exact technique blends the layers. In exact numbers all give the same picture;
/// rounding differs.
enum class Blending : std::uint8_t {
  kFrontToBack,
  kBackToFront,
  /// The nearer half of the layers, rounded up, front to back, the others back to front.
  kFromBothEnds,
};

/// Settings of techniques. A technique ignores what it does not know.
struct Settings {
  /// Rows, slots, samples, nodes or buckets a pixel; 0: the technique's own number.
  unsigned k = 0;
  std::uint64_t seed = 1;  ///< of techniques that draw random numbers
  /// Records over cells that hash tables aim at, in (0, 1].
  double load = 0.5;
  /// Fragments behind this much opacity may be left out, where a technique does so; in (0, 1].
  double opacity_threshold = 0.99;
  /// One of the variants that a technique names in its description; empty: the first.
  std::string variant = {};
};

/// What a picture cost. Counts are sums over tiles; passes are the most of any tile.
struct Costs {
  std::uint64_t geometry_passes = 0;  ///< walks over the stream
  std::uint64_t fragments = 0;        ///< of the stream, once
  std::uint64_t rasterized = 0;       ///< fragments of all geometry passes together
  std::uint64_t shaded = 0;           ///< colours that were looked up
  std::uint64_t stored = 0;           ///< fragments that were written to memory
  std::uint64_t kept = 0;             ///< fragments that were in memory when the pixel was resolved
  std::uint64_t lost = 0;             ///< fragments that do not contribute though they are seen
  std::uint64_t merged = 0;           ///< fragments that were merged with others
  std::uint64_t comparisons = 0;      ///< of depths
  std::uint64_t queries = 0;          ///< occlusion queries that find an order of objects
  std::uint64_t most_layers = 0;      ///< fragments of the deepest pixel
  /// Bytes of the whole picture by the formula of the technique's paper.
  std::uint64_t formula_bytes = 0;
  /// Bytes of the technique's arrays for the whole picture, added up over its tiles. Only the tiles
  /// in work are in memory.
  std::uint64_t allocated_bytes = 0;

  /// Adds counts, and takes the larger passes and layers.
  void add(const Costs& other);
};

class TileStream;
struct TileImage;
struct FrameInfo;

/// Renders one tile after another, for one thread, and keeps its arrays from tile to tile.
using TileRenderer = std::function<Result<void>(TileStream& stream, TileImage& image)>;

/// A technique: a row of the table of techniques.
struct Technique {
  std::string_view name;                       ///< as options have it: "dual-peeling"
  std::string_view title;                      ///< "Dual depth peeling"
  std::string_view paper;                      ///< authors, title, year
  Accuracy accuracy = Accuracy::kExact;        ///< what its picture can be relied on for
  Blending blending = Blending::kFrontToBack;  ///< of an exact one
  std::string_view k_means = {};   ///< what Settings::k counts: "rows"; empty: it is ignored
  unsigned default_k = 0;          ///< where Settings::k is 0; 0: there is no limit
  unsigned least_k = 0;            ///< smallest Settings::k
  unsigned most_k = 0;             ///< largest Settings::k
  std::string_view variants = {};  ///< separated by spaces, the default first; empty: it has none
  std::string_view memory = {};    ///< bytes, by the paper's formula, in words
  std::string_view fails = {};     ///< where its picture is wrong, or what it cannot do
  bool needs_triangles = false;    ///< a stream of bare fragments is not enough
  /// Work that is done once a frame, such as an order of the triangles; may be null.
  Result<std::shared_ptr<const void>> (*prepare)(const FrameInfo& frame, const Settings& settings,
                                                 const Execution& execution) = nullptr;
  /// Makes the renderer of one thread. @param prepared  what `prepare` gave
  Result<TileRenderer> (*make)(const FrameInfo& frame, const Settings& settings,
                               const std::shared_ptr<const void>& prepared) = nullptr;
};

/// Settings with the numbers that the technique will use. @return kUsage naming the technique and
/// the number or word
Result<Settings> checked_settings(const Technique& technique, Settings settings);

}  // namespace strata::transparency
