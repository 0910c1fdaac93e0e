#pragma once

#include <cstdint>
#include <vector>

// Offset sequences of a coherent hash, after: Garcia, Lefebvre, Hornus, Lasram, "Coherent Parallel
// Hashing", 2011 (random), and Lefebvre, Hornus, Lasram, "HA-Buffer", 2013, section 5 (farthest
// point).
// We differ: keys are one-dimensional (pixel = y * width + x), offsets never repeat, and the
// plane-first family is ours.

namespace strata {

/// Order in which a pixel probes cells.
enum class OffsetKind {
  /// Independent uniform draws without repetition. Robust against any arrangement of fragments.
  kRandom,
  /// Each offset is as far from all earlier ones as can be found. Probes of clustered fragments
  /// leave the cluster at small ages. Worse than random on a shallow, fully covered screen in a
  /// full table, where the near-lattice lets distant pixels share most of their cells.
  kFarthestPoint,
  /// Age a probes plane a - 1 of the table while whole planes of `pixels` cells last: there no two
  /// pixels meet, and neighbours probe neighbouring cells of one row. Then random.
  kPlaneFirst,
};

/// Parameters of an offset sequence. The same request gives the same offsets on every platform.
struct OffsetRequest {
  std::uint64_t pixels = 0;  ///< keys are in [0, pixels)
  std::uint64_t cells = 0;   ///< of the table, at least `pixels`
  std::uint64_t width = 0;   ///< pixels in a row; gives kFarthestPoint its second dimension
  unsigned ages = 0;         ///< offsets wanted; ages are 1 .. ages
  std::uint64_t seed = 0;    ///< of the random draws
};

/// The offsets by age: element a is the offset of age a, in [0, cells), all different; element 0 is
/// 0 and unused. There are min(ages, cells) of them, since more would repeat a probe. The cell of a
/// pixel at age a is (pixel + offsets[a]) mod cells.
///
/// kFarthestPoint measures on a torus of `width` columns and ceil(cells / width) rows, which
/// differs from the true neighbourhood of the key table by one row where a row wraps around. It
/// costs about ages * max(4096, 4 * ages) steps; the others about ages * log(ages).
///
/// @pre 1 <= pixels <= cells, width >= 1. Throws std::bad_alloc.
[[nodiscard]] std::vector<std::uint64_t> make_offsets(OffsetKind kind,
                                                      const OffsetRequest& request);

}  // namespace strata
