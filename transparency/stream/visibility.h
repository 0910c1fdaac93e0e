#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

// Visibility functions in a fixed number of words: T(z), the share of light that passes all
// occluders strictly in front of depth z. Occluders are added in any order.
//
// An object of a kind has the parameters alone. The caller owns the words of each pixel:
//   clear(pixel)                  nothing is in the way
//   add(pixel, depth, opacity)    an occluder; opacity in [0, 1]
//   finish(pixel)                 once, after the last add() and before the first of these:
//   transmittance(pixel, depth)   T(depth)
//   total(pixel)                  T behind all occluders
// Occluders at one depth do not shade one another, nor do those that a kind cannot tell apart. All
// functions may be called by any threads for different pixels.

namespace strata::transparency {

/// Depths outside are treated as the nearer end. The default is the depth of pictures.
struct DepthRange {
  float nearest = 0.0f;
  float farthest = 16777216.0f;

  /// 0 at the nearest depth, 1 at the farthest one.
  [[nodiscard]] float place(float depth) const {
    return std::clamp((depth - nearest) / (farthest - nearest), 0.0f, 1.0f);
  }
  /// The slice of `count` equal ones.
  [[nodiscard]] unsigned slice(float depth, unsigned count) const {
    return std::min(count - 1, static_cast<unsigned>(place(depth) * static_cast<float>(count)));
  }
};

/// What an add() did.
struct Added {
  unsigned comparisons = 0;  ///< of depths
  bool merged = false;       ///< the occluder or another one lost its own depth
};

namespace detail {

/// Nothing passes this much: exp(-16) is 1e-7.
inline constexpr float kMostAbsorbance = 16.0f;

/// -ln(1 - opacity).
inline float absorbance(float opacity) {
  return opacity >= 1.0f ? kMostAbsorbance : std::min(kMostAbsorbance, -std::log1p(-opacity));
}
inline float passing(float absorbance) {
  return absorbance >= kMostAbsorbance ? 0.0f : std::min(1.0f, std::exp(-absorbance));
}

}  // namespace detail

/// Fixed slices of depth, each with the transmittance behind it.
/// T. Kim, U. Neumann, "Opacity shadow maps" (2001). We differ: T is a step a slice, not linear, so
/// that an occluder does not shade itself.
class OpacityShadowMap {
 public:
  using Word = float;  ///< of a slice: absorbance, after finish() the transmittance behind it

  explicit OpacityShadowMap(unsigned slices, const DepthRange& range = {})
      : slices_(slices), range_(range) {}

  [[nodiscard]] std::size_t words() const { return slices_; }
  void clear(Word* pixel) const { std::fill_n(pixel, slices_, 0.0f); }
  Added add(Word* pixel, float depth, float opacity) const {
    float& slice = pixel[range_.slice(depth, slices_)];
    const bool merged = slice > 0.0f;
    slice += detail::absorbance(opacity);
    return {0, merged};
  }
  void finish(Word* pixel) const {
    float sum = 0.0f;
    for (unsigned i = 0; i < slices_; ++i) {
      sum += pixel[i];
      pixel[i] = detail::passing(sum);
    }
  }
  [[nodiscard]] float transmittance(const Word* pixel, float depth) const {
    const unsigned slice = range_.slice(depth, slices_);
    return slice == 0 ? 1.0f : pixel[slice - 1];
  }
  [[nodiscard]] float total(const Word* pixel) const { return pixel[slices_ - 1]; }

 private:
  unsigned slices_;
  DepthRange range_;
};

/// A bit a slice that says whether it holds an occluder; all such slices absorb alike.
/// E. Sintorn, U. Assarsson, "Hair self shadowing and transparency depth ordering using occupancy
/// maps" (2009).
class OccupancyMap {
 public:
  using Word = std::uint32_t;  ///< word 0: the bits of a float, absorbance; then 32 slices a word

  /// @param slices  rounded up to a multiple of 32
  explicit OccupancyMap(unsigned slices, const DepthRange& range = {})
      : groups_((slices + 31) / 32), range_(range) {}

  [[nodiscard]] std::size_t words() const { return groups_ + 1; }
  void clear(Word* pixel) const { std::fill_n(pixel, words(), Word{0}); }
  Added add(Word* pixel, float depth, float opacity) const {
    pixel[0] = std::bit_cast<Word>(absorbance(pixel) + detail::absorbance(opacity));
    const unsigned slice = range_.slice(depth, 32 * groups_);
    Word& group = pixel[1 + slice / 32];
    const Word bit = Word{1} << slice % 32;
    const bool merged = (group & bit) != 0;
    group |= bit;
    return {0, merged};
  }
  void finish(Word* pixel) const {
    int occupied = 0;
    for (unsigned i = 1; i <= groups_; ++i) occupied += std::popcount(pixel[i]);
    // From here on word 0 has the absorbance of one slice.
    if (occupied > 0)
      pixel[0] = std::bit_cast<Word>(absorbance(pixel) / static_cast<float>(occupied));
  }
  [[nodiscard]] float transmittance(const Word* pixel, float depth) const {
    const unsigned slice = range_.slice(depth, 32 * groups_);
    const Word nearer = (Word{1} << slice % 32) - 1;
    return passing(pixel, slice / 32, std::popcount(pixel[1 + slice / 32] & nearer));
  }
  [[nodiscard]] float total(const Word* pixel) const { return passing(pixel, groups_, 0); }

 private:
  static float absorbance(const Word* pixel) { return std::bit_cast<float>(pixel[0]); }
  [[nodiscard]] static float passing(const Word* pixel, unsigned groups, int occupied) {
    for (unsigned i = 1; i <= groups; ++i) occupied += std::popcount(pixel[i]);
    return detail::passing(absorbance(pixel) * static_cast<float>(occupied));
  }

  unsigned groups_;
  DepthRange range_;
};

/// The first terms of a Fourier series of the absorbance over depth.
/// J. Jansen, L. Bavoil, "Fourier opacity mapping" (2010). T rings about sharp steps.
class FourierOpacityMap {
 public:
  using Word = float;  ///< the sum of absorbance, then cosine and sine of each term

  explicit FourierOpacityMap(unsigned terms, const DepthRange& range = {})
      : terms_(terms), range_(range) {}

  [[nodiscard]] std::size_t words() const { return 1 + 2 * std::size_t{terms_}; }
  void clear(Word* pixel) const { std::fill_n(pixel, words(), 0.0f); }
  Added add(Word* pixel, float depth, float opacity) const {
    const float absorbance = detail::absorbance(opacity);
    const bool merged = pixel[0] > 0.0f;
    pixel[0] += absorbance;
    turn(depth, [&](std::size_t term, float cosine, float sine) {
      pixel[2 * term - 1] += absorbance * cosine;
      pixel[2 * term] += absorbance * sine;
    });
    return {0, merged};
  }
  void finish(Word*) const {}
  [[nodiscard]] float transmittance(const Word* pixel, float depth) const {
    float sum = 0.0f;
    turn(depth, [&](std::size_t term, float cosine, float sine) {
      sum += (pixel[2 * term - 1] * sine + pixel[2 * term] * (1.0f - cosine)) /
             static_cast<float>(term);
    });
    constexpr float kPi = 3.14159265f;
    return detail::passing(std::max(0.0f, pixel[0] * range_.place(depth) + sum / kPi));
  }
  [[nodiscard]] float total(const Word* pixel) const { return detail::passing(pixel[0]); }

 private:
  /// Calls body(k, cos(2 pi k z), sin(2 pi k z)) for each term k from 1.
  template <class Body>
  void turn(float depth, Body&& body) const {
    constexpr float kTurn = 6.28318531f;
    const float c = std::cos(kTurn * range_.place(depth)),
                s = std::sin(kTurn * range_.place(depth));
    float cosine = c, sine = s;
    for (std::size_t term = 1; term <= terms_; ++term) {
      body(term, cosine, sine);
      const float next = cosine * c - sine * s;
      sine = sine * c + cosine * s;
      cosine = next;
    }
  }

  unsigned terms_;
  DepthRange range_;
};

/// Steps at depths of its own: nodes (depth, transmittance behind it). With one node too many, the
/// one goes whose absence changes the area under T least, and its step moves to the node before it,
/// so that T is never too large.
/// M. Salvi, K. Vidimce, A. Lauritzen, A. Lefohn, "Adaptive volumetric shadow maps" (2010); M.
/// Salvi, J. Montgomery, A. Lefohn, "Adaptive transparency" (2011).
class AdaptiveNodes {
 public:
  struct Word {
    float depth;          ///< infinity: this node and those after it are unused
    float transmittance;  ///< behind it
  };
  static constexpr unsigned kMostNodes = 64;

  /// @param nodes  1 to kMostNodes
  explicit AdaptiveNodes(unsigned nodes) : nodes_(nodes) {}

  [[nodiscard]] std::size_t words() const { return nodes_; }
  void clear(Word* pixel) const { end(pixel, 0); }
  Added add(Word* pixel, float depth, float opacity) const {
    const float through = 1.0f - opacity;
    const unsigned place = before(pixel, depth);
    Added added{place + 1, true};
    if (place < nodes_ && pixel[place].depth == depth) {
      for (unsigned i = place; i < nodes_ && pixel[i].depth < kUnused; ++i) {
        pixel[i].transmittance *= through;
      }
      return added;
    }
    Word last{depth, through * (place == 0 ? 1.0f : pixel[place - 1].transmittance)};
    for (unsigned i = place; i < nodes_; ++i) {
      std::swap(pixel[i], last);
      if (last.depth == kUnused) {
        end(pixel, i + 1);
        added.merged = false;
        return added;
      }
      last.transmittance *= through;
    }
    remove_least(pixel, last);
    return added;
  }
  void finish(Word*) const {}
  [[nodiscard]] float transmittance(const Word* pixel, float depth) const {
    const unsigned place = before(pixel, depth);
    return place == 0 ? 1.0f : pixel[place - 1].transmittance;
  }
  [[nodiscard]] float total(const Word* pixel) const { return transmittance(pixel, kUnused); }
  /// Nodes strictly in front of a depth.
  [[nodiscard]] unsigned before(const Word* pixel, float depth) const {
    unsigned place = 0;
    while (place < nodes_ && pixel[place].depth < depth) ++place;
    return place;
  }

 private:
  static constexpr float kUnused = std::numeric_limits<float>::infinity();

  void end(Word* pixel, unsigned count) const {
    if (count < nodes_) pixel[count].depth = kUnused;
  }
  /// Makes room for a last node behind all that are full.
  void remove_least(Word* pixel, const Word& last) const {
    unsigned least = nodes_;
    float least_area = area(pixel[nodes_ - 1], last);
    for (unsigned i = nodes_ - 1; i > 0; --i) {
      const float here = area(pixel[i - 1], pixel[i]);
      if (here > least_area) continue;  // of equal ones the nearest goes
      least_area = here;
      least = i;
    }
    pixel[least - 1].transmittance =
        least == nodes_ ? last.transmittance : pixel[least].transmittance;
    if (least == nodes_) return;
    std::copy(pixel + least + 1, pixel + nodes_, pixel + least);
    pixel[nodes_ - 1] = last;
  }
  /// Under T, that goes if the second of two neighbours is left out.
  static float area(const Word& node, const Word& next) {
    return (next.depth - node.depth) * (node.transmittance - next.transmittance);
  }

  unsigned nodes_;
};

}  // namespace strata::transparency
