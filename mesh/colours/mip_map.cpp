#include "mesh/colours/mip_map.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/srgb.h"

namespace strata {
namespace {

constexpr float kOne = 65535.0f;  // light, alpha

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

// std::floor is a call where the machine's least common part has no instruction for it.
double below(double value) {
  const auto whole = static_cast<double>(static_cast<std::int64_t>(value));
  return whole > value ? whole - 1.0 : whole;
}

// A place within the texture, from 0 to 1.
double wrapped(double at, TextureWrap wrap) {
  if (wrap == TextureWrap::kRepeat) return at - below(at);
  if (wrap == TextureWrap::kClamp) return std::clamp(at, 0.0, 1.0);
  at -= 2.0 * below(at / 2.0);
  return at > 1.0 ? 2.0 - at : at;
}

// A place along a side, from 0 to 1: between which two texels it lies.
struct Between {
  std::size_t first = 0, second = 0;
  float part = 0.0f;  // of the second
};
Between between(double at, int size, bool repeats) {
  const double x = at * size + 0.5;  // texel i has its middle at i + 1
  int second = static_cast<int>(x);
  const auto part = static_cast<float>(x - second);
  int first = second - 1;
  if (repeats) {
    if (first < 0) first += size;
    if (second >= size) second -= size;
  } else {  // the mirror's border texel is its own neighbour
    first = std::max(first, 0);
    second = std::min(second, size - 1);
  }
  return {place(first), place(second), part};
}

Float4 numbers_of(const std::array<std::uint16_t, 4>& texel) {
  __extension__ typedef std::uint16_t Short4 __attribute__((vector_size(8)));
  Short4 t;
  std::memcpy(&t, texel.data(), sizeof t);
  return __builtin_convertvector(t, Float4);
}

Float4 all(float value) { return Float4{value, value, value, value}; }

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

Float4 MipMap::texel(std::size_t level, std::size_t index) const {
  if (level > 0) {
    return numbers_of(levels_[level - 1].texels[index]);
  }
  const glm::u8vec4 t = texture_->texels[index];
  const std::array<float, 256>& light = linear_light();
  const Float4 straight{light[t.x], light[t.y], light[t.z], 1.0f};
  return straight * all(static_cast<float>(t.w) * (kOne / 255.0f));
}

void MipMap::make_row(std::size_t level, int y) {
  Level& to = levels_[level];
  const int from_width = level == 0 ? texture_->width : levels_[level - 1].width;
  const int from_height = level == 0 ? texture_->height : levels_[level - 1].height;
  const Taps rows = taps_of(y, from_height, to.height);
  for (int x = 0; x < to.width; ++x) {
    const Taps columns = taps_of(x, from_width, to.width);
    Float4 sum{};
    for (int j = 0; j < rows.count; ++j) {
      Float4 row{};
      const std::size_t start = place(rows.first + j) * place(from_width) + place(columns.first);
      for (int i = 0; i < columns.count; ++i) {
        row += texel(level, start + place(i)) * all(columns.weights[place(i)]);
      }
      sum += row * all(rows.weights[place(j)]);
    }
    Texel& out = to.texels[place(y) * place(to.width) + place(x)];
    for (int c = 0; c < 4; ++c) {
      out[place(c)] = static_cast<std::uint16_t>(std::min(sum[c] + 0.5f, kOne));
    }
  }
}

Float4 MipMap::bilinear(const glm::dvec2& at, std::size_t level) const {
  const int width = level == 0 ? texture_->width : levels_[level - 1].width;
  const int height = level == 0 ? texture_->height : levels_[level - 1].height;
  const Between x = between(at.x, width, texture_->wrap_u == TextureWrap::kRepeat);
  const Between y = between(at.y, height, texture_->wrap_v == TextureWrap::kRepeat);
  const std::size_t first = y.first * place(width), second = y.second * place(width);
  const Float4 right = all(x.part), left = all(1.0f - x.part);
  const auto blend = [&](auto&& at_index) {
    const Float4 upper = at_index(first + x.first) * left + at_index(first + x.second) * right;
    const Float4 lower = at_index(second + x.first) * left + at_index(second + x.second) * right;
    return upper * all(1.0f - y.part) + lower * all(y.part);
  };
  if (level == 0) return blend([&](std::size_t index) { return texel(0, index); });
  const Texel* texels = levels_[level - 1].texels.data();
  return blend([&](std::size_t index) { return numbers_of(texels[index]); });
}

Float4 MipMap::sample(const glm::dvec2& at, float level) const {
  const glm::dvec2 within(wrapped(at.x, texture_->wrap_u), wrapped(at.y, texture_->wrap_v));
  const float clamped = std::clamp(level, 0.0f, static_cast<float>(levels_.size()));
  const auto low = static_cast<std::size_t>(clamped);
  const float part = clamped - static_cast<float>(low);
  Float4 sum = bilinear(within, low);
  if (part != 0.0f) sum = sum * all(1.0f - part) + bilinear(within, low + 1) * all(part);
  return sum * all(1.0f / kOne);
}

std::uint64_t MipMap::memory_bytes() const {
  std::uint64_t bytes = 0;
  for (const Level& level : levels_) bytes += level.texels.size() * sizeof(Texel);
  return bytes;
}

}  // namespace strata
