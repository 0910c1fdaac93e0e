#pragma once

#include <array>
#include <cstdint>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "strata/core/result.h"
#include "strata/transparency/media/media.h"
#include "transparency/media/float4.h"
#include "transparency/stream/mesh_source.h"

namespace strata::transparency {

/// What a medium adds to the sums at a point, red, green, blue and nothing: extinction, and
/// extinction times albedo. All are multiples of one power of two and so small that sums of any of
/// them are exact: what was added and is subtracted again leaves exactly nothing.
struct MediumTerms {
  std::array<Double2, 2> extinction{}, scattering{};
};

/// The media of a scene.
struct MediaTable {
  static constexpr std::uint32_t kNone = 0xffffffffu;

  std::vector<MediumTerms> solids, particles;
  std::vector<std::uint32_t> medium_of;  ///< of each object: index into `solids`, or kNone
  std::vector<std::uint32_t> objects;    ///< of each of `solids`
  std::vector<std::uint8_t> surface;     ///< of each of `solids`: its surface is drawn
  std::vector<Look> looks;               ///< of each object
};

/// @return kUsage, naming the medium or particle and the number
Result<void> check_media(const MediaSettings& settings);

/// Finds the media of a scene's objects. @return kUsage naming a medium without an object
Result<MediaTable> make_media_table(const Scene& scene, const MediaSettings& settings,
                                    const FrameOptions& options);

/// The sums S and Q at a point of a ray.
class MediaSums {
 public:
  void add(const MediumTerms& terms) {
    ++media_;
    for (std::size_t i = 0; i < 2; ++i) {
      sums_.extinction[i] += terms.extinction[i];
      sums_.scattering[i] += terms.scattering[i];
    }
  }
  void remove(const MediumTerms& terms) {
    --media_;
    for (std::size_t i = 0; i < 2; ++i) {
      sums_.extinction[i] -= terms.extinction[i];
      sums_.scattering[i] -= terms.scattering[i];
    }
  }
  [[nodiscard]] int media() const { return media_; }
  /// All sums are exactly 0.
  [[nodiscard]] bool vacuum() const {
    bool none = media_ == 0;
    for (int c = 0; c < 3; ++c) {
      const auto i = static_cast<std::size_t>(c / 2);
      none = none && sums_.extinction[i][c % 2] == 0.0 && sums_.scattering[i][c % 2] == 0.0;
    }
    return none;
  }
  [[nodiscard]] Float4 extinction() const { return joined(sums_.extinction); }
  /// Q / S, the albedo of the media together; 0 without extinction.
  [[nodiscard]] Float4 albedo() const {
    const Float4 s = extinction(), none = splat(0.0f);
    return s > none ? joined(sums_.scattering) / s : none;
  }

 private:
  MediumTerms sums_;
  int media_ = 0;
};

}  // namespace strata::transparency
