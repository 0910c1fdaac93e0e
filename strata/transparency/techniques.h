#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/result.h"
#include "strata/transparency/stream/frame.h"
#include "strata/transparency/stream/technique.h"

namespace strata::transparency {

/// All techniques, in the order of the pages of docs/papers.md.
[[nodiscard]] std::span<const Technique* const> techniques();

/// @return kUsage naming the techniques with similar names
Result<const Technique*> find_technique(std::string_view name);

/// A technique with its settings, of a text NAME[:K][:VARIANT], such as "mlab:8".
struct ChosenTechnique {
  const Technique* technique = nullptr;  ///< of the table
  Settings settings;                     ///< k and variant are those of the text
};
/// @param settings  what the text does not say @return kUsage naming the text
Result<ChosenTechnique> parse_technique(std::string_view text, const Settings& settings = {});

/// How much a picture differs from a reference.
struct Difference {
  double psnr = 0.0;         ///< dB, of red, green and blue in [0, 1]; infinity: no difference
  double largest = 0.0;      ///< of any channel
  std::uint64_t pixels = 0;  ///< that differ by more than half of 1/255 in a channel
};
/// @pre the images have one size
[[nodiscard]] Difference difference(const Image& image, const Image& reference);

}  // namespace strata::transparency
