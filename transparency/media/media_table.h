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

/// What a medium adds to the sums at a point, red, green and blue: extinction, and extinction times
/// albedo. All are multiples of one power of two and so small that sums of any of them are exact:
/// what was added and is subtracted again leaves exactly nothing.
struct MediumTerms {
  std::array<double, 3> extinction{}, scattering{};
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
    for (std::size_t i = 0; i < 3; ++i) {
      extinction_[i] += terms.extinction[i];
      scattering_[i] += terms.scattering[i];
    }
  }
  void remove(const MediumTerms& terms) {
    --media_;
    for (std::size_t i = 0; i < 3; ++i) {
      extinction_[i] -= terms.extinction[i];
      scattering_[i] -= terms.scattering[i];
    }
  }
  [[nodiscard]] int media() const { return media_; }
  /// All sums are exactly 0.
  [[nodiscard]] bool vacuum() const {
    return media_ == 0 && extinction_ == std::array<double, 3>{} &&
           scattering_ == std::array<double, 3>{};
  }
  [[nodiscard]] Float4 extinction() const {
    return Float4{static_cast<float>(extinction_[0]), static_cast<float>(extinction_[1]),
                  static_cast<float>(extinction_[2]), 0.0f};
  }
  /// Q / S, the albedo of the media together; 0 without extinction.
  [[nodiscard]] Float4 albedo() const {
    const Float4 s = extinction();
    const Float4 q{static_cast<float>(scattering_[0]), static_cast<float>(scattering_[1]),
                   static_cast<float>(scattering_[2]), 0.0f};
    const Float4 none = splat(0.0f);
    return s > none ? q / s : none;
  }

 private:
  std::array<double, 3> extinction_{}, scattering_{};
  int media_ = 0;
};

}  // namespace strata::transparency
