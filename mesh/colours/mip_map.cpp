#include "mesh/colours/mip_map.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "mesh/colours/light_tables.h"

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

LightTexel rounded(const Float4& light) {
  Float4 whole = light + 0.5f;
  whole = whole > kLightOne ? kLightOne - Float4{} : whole;
  const Short4 numbers = __builtin_convertvector(__builtin_convertvector(whole, Int4), Short4);
  LightTexel texel;
  std::memcpy(texel.data(), &numbers, sizeof numbers);
  return texel;
}

}  // namespace

void MipMap::make_levels(const Execution& execution) {
  const std::vector<glm::u8vec4>& texels = texture_->texels;
  opaque_ = std::all_of(texels.begin(), texels.end(),
                        [](const glm::u8vec4& texel) { return texel.w == 255; });
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

void MipMap::make_row(std::size_t number, int y) {
  const TextureLevel from = level(number);
  if (from.texture == nullptr) {
    halve_row(number, y, [&](std::size_t at) { return light_of(from.half[at]); });
    return;
  }
  const LightTables& tables = LightTables::get(opaque_);
  if (opaque_) {
    halve_row(number, y, [&](std::size_t at) { return tables.light_of<true>(from.texture[at]); });
  } else {
    halve_row(number, y, [&](std::size_t at) { return tables.light_of<false>(from.texture[at]); });
  }
}

template <class Light>
void MipMap::halve_row(std::size_t number, int y, const Light& light) {
  Level& to = levels_[number];
  const TextureLevel from = level(number);
  const Taps rows = taps_of(y, from.height, to.height);
  LightTexel* out = to.texels.data() + place(y) * place(to.width);
  const std::size_t first_row = place(rows.first) * place(from.width);
  if (from.width == 2 * to.width && rows.count == 2) {  // most levels
    const auto mean = [&](std::size_t at) { return light(at) * 0.5f + light(at + 1) * 0.5f; };
    for (std::size_t x = 0; x < place(to.width); ++x) {
      const std::size_t at = first_row + 2 * x;
      out[x] = rounded(mean(at) * rows.weights[0] + mean(at + place(from.width)) * rows.weights[1]);
    }
    return;
  }
  for (int x = 0; x < to.width; ++x) {
    const Taps columns = taps_of(x, from.width, to.width);
    Float4 sum{};
    for (int j = 0; j < rows.count; ++j) {
      Float4 row{};
      const std::size_t start = first_row + place(j) * place(from.width) + place(columns.first);
      for (int i = 0; i < columns.count; ++i) {
        row += light(start + place(i)) * columns.weights[place(i)];
      }
      sum += row * rows.weights[place(j)];
    }
    out[x] = rounded(sum);
  }
}

TextureSampling MipMap::sampling(float level) const {
  TextureSampling how;
  how.wrap_u = texture_->wrap_u, how.wrap_v = texture_->wrap_v;
  how.opaque = opaque_;
  const float clamped = std::clamp(level, 0.0f, static_cast<float>(levels_.size()));
  const auto low = static_cast<std::size_t>(clamped);
  how.part = clamped - static_cast<float>(low);
  how.level = this->level(low);
  if (how.part != 0.0f) how.next = this->level(low + 1);
  return how;
}

TextureLevel MipMap::level(std::size_t number) const {
  if (number == 0) {
    return {texture_->width, texture_->height, texture_->texels.data(), nullptr};
  }
  const Level& half = levels_[number - 1];
  return {half.width, half.height, nullptr, half.texels.data()};
}

std::uint64_t MipMap::memory_bytes() const {
  std::uint64_t bytes = 0;
  for (const Level& level : levels_) bytes += level.texels.size() * sizeof(LightTexel);
  return bytes;
}

}  // namespace strata
