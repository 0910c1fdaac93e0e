#include "voxelize/picture/isolines.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <map>
#include <string>

#include "voxelize/picture/small_text.h"

namespace strata {
namespace {

constexpr double kLines = 10.0;   // about as many are seen
constexpr int kNumbersALine = 2;  // at most
constexpr glm::vec3 kInsideNear{0.80f, 0.89f, 0.98f}, kInsideFar{0.36f, 0.58f, 0.84f};
constexpr glm::vec3 kOutsideNear{1.00f, 0.95f, 0.87f}, kOutsideFar{0.98f, 0.74f, 0.45f};
constexpr glm::vec3 kLine{0.25f, 0.25f, 0.28f}, kZeroLine{0.0f, 0.0f, 0.0f};
constexpr double kLineWidth = 1.1, kZeroWidth = 2.4;  // pixels

std::size_t at(const ValueImage& image, int u, int v) {
  return static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) +
         static_cast<std::size_t>(u);
}

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;
};
Range range_of(const ValueImage& image) {
  Range range;
  for (const float value : image.values) {
    if (!std::isfinite(value)) continue;
    range.low = std::min<double>(range.low, value);
    range.high = std::max<double>(range.high, value);
  }
  return range;
}

/// How much the value changes with a pixel; 0 at borders of what is known.
double slope_at(const ValueImage& image, int u, int v) {
  const auto change = [&](int u0, int v0, int u1, int v1) {
    u0 = std::clamp(u0, 0, image.width - 1), u1 = std::clamp(u1, 0, image.width - 1);
    v0 = std::clamp(v0, 0, image.height - 1), v1 = std::clamp(v1, 0, image.height - 1);
    const double d = (double(image.values[at(image, u1, v1)]) - image.values[at(image, u0, v0)]) /
                     std::max(1, u1 - u0 + v1 - v0);
    return std::isfinite(d) ? d : 0.0;
  };
  return std::hypot(change(u - 1, v, u + 1, v), change(u, v - 1, u, v + 1));
}

/// Boxes of text that are taken.
class Places {
 public:
  /// False if the box meets another one or the border.
  bool take(const glm::ivec2& low, const glm::ivec2& high, const Picture& picture) {
    if (low.x < 2 || low.y < 2 || high.x > picture.width - 2 || high.y > picture.height - 2) {
      return false;
    }
    for (const auto& [l, h] : taken_) {
      if (low.x < h.x && l.x < high.x && low.y < h.y && l.y < high.y) return false;
    }
    taken_.emplace_back(low, high);
    return true;
  }

 private:
  std::vector<std::pair<glm::ivec2, glm::ivec2>> taken_;
};

std::string number_of(double value) { return fmt::format("{:.4g}", value == 0 ? 0.0 : value); }

/// Puts numbers on the lines where they meet a few rows and columns of the picture.
void draw_numbers(const ValueImage& image, double step, Picture& picture) {
  const int scale = std::max(1, std::min(image.width, image.height) / 360);
  Places places;
  std::map<long, int> numbers;
  const auto crossing = [&](int u0, int v0, int u1, int v1) {
    const double a = image.values[at(image, u0, v0)] / step;
    const double b = image.values[at(image, u1, v1)] / step;
    if (!std::isfinite(a) || !std::isfinite(b) || std::abs(a) > 1e6 || std::abs(b) > 1e6) return;
    const long level = static_cast<long>(std::ceil(std::min(a, b)));
    if (static_cast<double>(level) > std::max(a, b) || a == b) return;
    int& used = numbers[level];
    if (used >= kNumbersALine) return;
    const std::string text = number_of(static_cast<double>(level) * step);
    const glm::ivec2 size = small_text_size(text, scale), corner(u0 - size.x / 2, v0 - size.y / 2);
    if (!places.take(corner - 3 * scale, corner + size + 3 * scale, picture)) return;
    ++used;
    for (int v = corner.y - 2 * scale; v < corner.y + size.y + 2 * scale; ++v) {
      for (int u = corner.x - 2 * scale; u < corner.x + size.x + 2 * scale; ++u) {
        if (u < 0 || v < 0 || u >= image.width || v >= image.height) continue;
        Rgba& pixel = picture.pixels[at(image, u, v)];
        pixel = Rgba(glm::u8vec3((glm::uvec3(pixel) + 3u * glm::uvec3(255)) / 4u), 255);
      }
    }
    draw_small_text(picture, corner, text, scale, Rgba(20, 20, 24, 255));
  };
  for (const int part : {4, 2, 6, 1, 3, 5, 7}) {
    const int v = image.height * part / 8;
    for (int u = 0; u + 1 < image.width; ++u) crossing(u, v, u + 1, v);
    const int u = image.width * part / 8;
    for (int y = 0; y + 1 < image.height; ++y) crossing(u, y, u, y + 1);
  }
}

}  // namespace

double isoline_step(const ValueImage& image) {
  const Range range = range_of(image);
  const double wanted = (range.high - range.low) / kLines;
  if (!(wanted > 0) || !std::isfinite(wanted)) return 1.0;
  const double power = std::pow(10.0, std::floor(std::log10(wanted)));
  for (const double times : {1.0, 2.0, 5.0}) {
    if (wanted <= times * power * (1 + 1e-9)) return times * power;
  }
  return 10.0 * power;
}

void draw_isolines(const ValueImage& image, double step, Picture& picture,
                   const Execution& execution) {
  const Range range = range_of(image);
  const double deepest = std::max(-range.low, step), farthest = std::max(range.high, step);
  parallel_for(execution, static_cast<std::size_t>(image.height), [&](std::size_t row, int) {
    const int v = static_cast<int>(row);
    for (int u = 0; u < image.width; ++u) {
      const double value = image.values[at(image, u, v)];
      if (!std::isfinite(value)) continue;
      const auto part =
          static_cast<float>(std::clamp(value < 0 ? -value / deepest : value / farthest, 0.0, 1.0));
      glm::vec3 colour = value < 0 ? glm::mix(kInsideNear, kInsideFar, part)
                                   : glm::mix(kOutsideNear, kOutsideFar, part);
      const double slope = slope_at(image, u, v);
      const double level = std::round(value / step);
      if (slope > 0) {
        const double away = std::abs(value - level * step) / slope;
        const double width = level == 0 ? kZeroWidth : kLineWidth;
        const double cover = std::clamp(width / 2 + 0.5 - away, 0.0, 1.0);
        const float strength = level == 0 ? 1.0f : 0.75f;
        colour =
            glm::mix(colour, level == 0 ? kZeroLine : kLine, strength * static_cast<float>(cover));
      }
      picture.pixels[at(image, u, v)] = Rgba(glm::u8vec3(colour * 255.0f + 0.5f), 255);
    }
  });
  draw_numbers(image, step, picture);
}

}  // namespace strata
