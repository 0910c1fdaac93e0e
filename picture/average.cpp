#include "picture/average.h"

#include <bit>
#include <glm/common.hpp>
#include <glm/vec3.hpp>

namespace strata {
namespace {

/// Whether all samples of a pixel are `first`, as those within a flat face are.
bool all_same(const Rgba* samples, std::size_t stride, int across, int down, Rgba first) {
  const auto bits = std::bit_cast<std::uint32_t>(first);
  std::uint32_t other = 0;
  for (int y = 0; y < down; ++y) {
    const Rgba* row = samples + static_cast<std::size_t>(y) * stride;
    for (int x = 0; x < across; ++x) other |= std::bit_cast<std::uint32_t>(row[x]) ^ bits;
  }
  return other == 0;
}

/// Two channels of 32 bits at once.
glm::uvec4 sum_of(const Rgba* samples, std::size_t stride, int across, int down) {
  std::uint64_t red_blue = 0, green_alpha = 0;
  for (int y = 0; y < down; ++y) {
    const Rgba* row = samples + static_cast<std::size_t>(y) * stride;
    for (int x = 0; x < across; ++x) {
      const std::uint64_t sample = std::bit_cast<std::uint32_t>(row[x]);
      red_blue += (sample & 0xff) | (sample & 0xff0000) << 16;
      green_alpha += (sample >> 8 & 0xff) | (sample & 0xff000000) << 8;
    }
  }
  return {red_blue & 0xffffffff, green_alpha & 0xffffffff, red_blue >> 32, green_alpha >> 32};
}

Rgba mean(const glm::uvec4& sum, unsigned count, Rgba background) {
  if (sum.a == 0) return background;
  if (sum.a == 255 * count) {
    return Rgba((sum + count / 2) >> static_cast<unsigned>(std::countr_zero(count)));
  }
  const glm::uvec3 colour(sum);
  if (background.a == 0) {
    const glm::uvec3 straight = (colour * 255u + sum.a / 2) / sum.a;
    return Rgba(glm::u8vec3(glm::min(straight, glm::uvec3(255))), (sum.a + count / 2) / count);
  }
  const glm::uvec3 behind = (255 * count - sum.a) * glm::uvec3(background);
  return Rgba(glm::u8vec3((colour * 255u + behind + 255 * count / 2) / (255 * count)), 255);
}

}  // namespace

std::uint64_t average_row(const Rgba* samples, std::size_t stride, int across, int down,
                          Rgba background, std::span<Rgba> pixels) {
  const auto count = static_cast<unsigned>(across * down);
  std::uint64_t seen = 0;
  for (Rgba& pixel : pixels) {
    const Rgba first = *samples;
    if ((first.a == 0 || first.a == 255) && all_same(samples, stride, across, down, first)) {
      pixel = first.a == 0 ? background : first;
      seen += first.a == 0 ? 0 : 1;
    } else {
      const glm::uvec4 sum = sum_of(samples, stride, across, down);
      seen += sum.a > 0 ? 1 : 0;
      pixel = mean(sum, count, background);
    }
    samples += across;
  }
  return seen;
}

}  // namespace strata
