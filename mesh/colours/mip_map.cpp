#include "mesh/colours/mip_map.h"

#include <algorithm>
#include <cmath>

#include "core/srgb.h"

namespace strata {
namespace {

std::size_t place(int value) { return static_cast<std::size_t>(value); }

// The texels of a side of `from` texels that texel i of `to` covers, at most three, and how much of
// each.
struct Taps {
  int first = 0, count = 1;
  std::array<float, 3> weights{1.0f, 0.0f, 0.0f};
};
Taps taps_of(int i, int from, int to) {
  Taps taps;
  // Texel i covers [i from, (i + 1) from) / to: in whole numbers, parts of a texel are 1 / to.
  const std::int64_t begin = std::int64_t{i} * from, end = begin + from;
  taps.first = static_cast<int>(begin / to);
  taps.count = 0;
  for (std::int64_t at = taps.first; at * to < end; ++at) {
    const std::int64_t covered = std::min(end, (at + 1) * to) - std::max(begin, at * to);
    taps.weights[place(taps.count++)] = static_cast<float>(covered) / static_cast<float>(from);
  }
  return taps;
}

// A place along a side: from a multiple of the side to texels, and between which two it lies.
struct Between {
  std::size_t first = 0, second = 0;
  float part = 0.0f;  // of the second
};
Between between(double at, int size, TextureWrap wrap) {
  if (wrap == TextureWrap::kRepeat) {
    at -= std::floor(at);
  } else if (wrap == TextureWrap::kMirror) {
    at -= 2.0 * std::floor(at / 2.0);
    if (at > 1.0) at = 2.0 - at;
  } else {
    at = std::clamp(at, 0.0, 1.0);
  }
  const double x = at * size - 0.5, low = std::floor(x);
  int first = static_cast<int>(low), second = first + 1;
  if (wrap == TextureWrap::kRepeat) {
    if (first < 0) first += size;
    if (first >= size) first -= size;
    if (second >= size) second -= size;
  } else {  // the mirror's border texel is its own neighbour
    first = std::clamp(first, 0, size - 1);
    second = std::clamp(second, 0, size - 1);
  }
  return {place(first), place(second), static_cast<float>(x - low)};
}

}  // namespace

void MipMap::make_levels(const Execution& execution) {
  levels_.clear();
  for (int w = texture_->width, h = texture_->height; w > 1 || h > 1;) {
    w = std::max(1, w / 2), h = std::max(1, h / 2);
    levels_.push_back({w, h, {}});
    levels_.back().texels.resize(place(w) * place(h));
  }
  constexpr int kRows = 16;  // at a time
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    const int height = levels_[level].height;
    parallel_for(execution, place((height + kRows - 1) / kRows), [&](std::size_t block, int) {
      const int begin = static_cast<int>(block) * kRows;
      for (int y = begin; y < std::min(height, begin + kRows); ++y) make_row(level, y);
    });
    if (execution.stop.stop_requested()) return;
  }
}

glm::vec4 MipMap::texel(std::size_t level, std::size_t index) const {
  if (level > 0) {
    const Texel& t = levels_[level - 1].texels[index];
    return glm::vec4(t[0], t[1], t[2], t[3]) * (1.0f / 65535.0f);
  }
  const glm::u8vec4 t = texture_->texels[index];
  const std::array<float, 256>& light = linear_light();
  const float alpha = static_cast<float>(t.w) * (1.0f / 255.0f);
  return {light[t.x] * alpha, light[t.y] * alpha, light[t.z] * alpha, alpha};
}

void MipMap::make_row(std::size_t level, int y) {
  Level& to = levels_[level];
  const int from_width = level == 0 ? texture_->width : levels_[level - 1].width;
  const int from_height = level == 0 ? texture_->height : levels_[level - 1].height;
  const Taps rows = taps_of(y, from_height, to.height);
  for (int x = 0; x < to.width; ++x) {
    const Taps columns = taps_of(x, from_width, to.width);
    glm::vec4 sum(0.0f);
    for (int j = 0; j < rows.count; ++j) {
      glm::vec4 row(0.0f);
      const std::size_t start = place(rows.first + j) * place(from_width) + place(columns.first);
      for (int i = 0; i < columns.count; ++i) {
        row += texel(level, start + place(i)) * columns.weights[place(i)];
      }
      sum += row * rows.weights[place(j)];
    }
    Texel& out = to.texels[place(y) * place(to.width) + place(x)];
    for (int c = 0; c < 4; ++c) {
      out[place(c)] = static_cast<std::uint16_t>(std::min(sum[c] * 65535.0f + 0.5f, 65535.0f));
    }
  }
}

glm::vec4 MipMap::bilinear(const glm::dvec2& at, std::size_t level) const {
  const int width = level == 0 ? texture_->width : levels_[level - 1].width;
  const int height = level == 0 ? texture_->height : levels_[level - 1].height;
  const Between x = between(at.x, width, texture_->wrap_u);
  const Between y = between(at.y, height, texture_->wrap_v);
  const std::size_t first = y.first * place(width), second = y.second * place(width);
  const glm::vec4 upper =
      texel(level, first + x.first) * (1.0f - x.part) + texel(level, first + x.second) * x.part;
  const glm::vec4 lower =
      texel(level, second + x.first) * (1.0f - x.part) + texel(level, second + x.second) * x.part;
  return upper * (1.0f - y.part) + lower * y.part;
}

glm::vec4 MipMap::sample(const glm::dvec2& at, float level) const {
  const auto last = static_cast<float>(levels_.size());
  const float clamped = std::clamp(level, 0.0f, last);
  const auto low = static_cast<std::size_t>(clamped);
  const float part = clamped - static_cast<float>(low);
  const glm::vec4 fine = bilinear(at, low);
  return part == 0.0f ? fine : fine * (1.0f - part) + bilinear(at, low + 1) * part;
}

std::uint64_t MipMap::memory_bytes() const {
  std::uint64_t bytes = 0;
  for (const Level& level : levels_) bytes += level.texels.size() * sizeof(Texel);
  return bytes;
}

}  // namespace strata
