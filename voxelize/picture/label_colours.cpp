#include "voxelize/picture/label_colours.h"

#include <algorithm>
#include <cmath>

#include "core/srgb.h"

namespace strata {
namespace {

/// Chosen by eye so that neighbours differ in hue and in lightness.
constexpr Rgba kFirst[] = {{86, 148, 214, 255},  {240, 146, 58, 255},  {98, 178, 98, 255},
                           {222, 94, 98, 255},   {152, 124, 206, 255}, {232, 196, 84, 255},
                           {92, 188, 196, 255},  {226, 136, 186, 255}, {160, 122, 92, 255},
                           {168, 196, 104, 255}, {104, 118, 178, 255}, {190, 190, 190, 255}};

/// Oklab's lightness, chroma and hue to sRGB (B. Ottosson: A perceptual color space for image
/// processing, 2020).
Rgba from_oklch(double lightness, double chroma, double hue) {
  const double a = chroma * std::cos(hue), b = chroma * std::sin(hue);
  const double l = std::pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3);
  const double m = std::pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3);
  const double s = std::pow(lightness - 0.0894841775 * a - 1.2914855480 * b, 3);
  const double linear[3] = {4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
                            -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
                            -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s};
  Rgba colour(0, 0, 0, 255);
  for (int i = 0; i < 3; ++i) {
    const double value = srgb_of_linear(std::clamp(linear[i], 0.0, 1.0));
    colour[i] = static_cast<std::uint8_t>(std::lround(value * 255));
  }
  return colour;
}

}  // namespace

Rgba palette_colour(std::uint32_t label) {
  const std::uint32_t n = label == 0 ? 0 : label - 1;
  if (n < std::size(kFirst)) return kFirst[n];
  // Hues a golden angle apart, in three rings of lightness.
  constexpr double kGoldenAngle = 2.399963229728653;
  constexpr double kLightness[] = {0.72, 0.58, 0.82};
  return from_oklch(kLightness[n % 3], n % 2 == 0 ? 0.13 : 0.09, (n % 4096) * kGoldenAngle);
}

}  // namespace strata
