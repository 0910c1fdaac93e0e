#include "voxelize/output/palette.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <utility>

#include "core/srgb.h"
#include "strata/voxelize/packed_colour.h"
#include "voxelize/output/oklab.h"

namespace strata {
namespace {

constexpr double kOne = 65535.0;  // light 1

/// The mean colour of a cell.
struct Shade {
  std::uint32_t cell = 0;
  glm::vec3 place{0.0f};  // in Oklab
  glm::dvec4 light{0.0};  // alpha too: 0 to 1
  double count = 0.0;
};

/// Shades that stand together for one colour.
struct ShadeBox {
  std::size_t begin = 0, end = 0;
  glm::dvec3 mean{0.0};
  double error = 0.0;  // sum of the squares of distances from the mean
  int axis = 0;        // in which they differ most
};

ShadeBox box_of(const std::vector<Shade>& shades, std::size_t begin, std::size_t end) {
  ShadeBox box{begin, end, glm::dvec3(0.0), 0.0, 0};
  double count = 0.0;
  for (std::size_t i = begin; i < end; ++i) {
    box.mean += glm::dvec3(shades[i].place) * shades[i].count;
    count += shades[i].count;
  }
  box.mean /= count;
  glm::dvec3 spread(0.0);
  for (std::size_t i = begin; i < end; ++i) {
    const glm::dvec3 away = glm::dvec3(shades[i].place) - box.mean;
    spread += away * away * shades[i].count;
  }
  box.error = spread.x + spread.y + spread.z;
  for (int axis = 1; axis < 3; ++axis) {
    if (spread[axis] > spread[box.axis]) box.axis = axis;
  }
  return box;
}

/// Cuts the box of the largest error until there are `most`.
std::vector<ShadeBox> cut(std::vector<Shade>& shades, std::size_t most) {
  std::vector<ShadeBox> boxes{box_of(shades, 0, shades.size())};
  while (boxes.size() < most) {
    const auto worst =
        std::max_element(boxes.begin(), boxes.end(),
                         [](const ShadeBox& a, const ShadeBox& b) { return a.error < b.error; });
    if (!(worst->error > 0.0)) break;
    const ShadeBox box = *worst;
    const auto at = [&](std::size_t i) { return shades.begin() + static_cast<std::ptrdiff_t>(i); };
    const auto middle = std::stable_partition(at(box.begin), at(box.end), [&](const Shade& shade) {
      return static_cast<double>(shade.place[box.axis]) < box.mean[box.axis];
    });
    const auto cut_at = static_cast<std::size_t>(middle - shades.begin());
    if (cut_at == box.begin || cut_at == box.end) {  // they differ by less than numbers can say
      worst->error = 0.0;
      continue;
    }
    *worst = box_of(shades, box.begin, cut_at);
    boxes.push_back(box_of(shades, cut_at, box.end));
  }
  return boxes;
}

/// The light of each value, in whole parts of kOne.
const std::array<std::uint64_t, 256>& whole_light() {
  static const std::array<std::uint64_t, 256> kLight = [] {
    std::array<std::uint64_t, 256> light{};
    for (std::size_t i = 0; i < 256; ++i) {
      light[i] = static_cast<std::uint64_t>(linear_light()[i] * static_cast<float>(kOne) + 0.5f);
    }
    return light;
  }();
  return kLight;
}

glm::u8vec4 colour_of_light(const glm::dvec4& light) {
  const SrgbOfLight& srgb = srgb_of_light();
  return {srgb(static_cast<float>(light.x)), srgb(static_cast<float>(light.y)),
          srgb(static_cast<float>(light.z)),
          static_cast<std::uint8_t>(std::clamp(light.w * 255.0 + 0.5, 1.0, 255.0))};
}

}  // namespace

std::uint8_t Palette::index_of(std::uint32_t colour) const {
  if (!cells_.empty()) return cells_[ColourCounts::cell_of(colour)];
  const auto found = std::lower_bound(exact_.begin(), exact_.end(), colour);
  return static_cast<std::uint8_t>(found - exact_.begin());
}

void ColourCounts::add_exact(std::uint32_t colour) {
  if (exact_.size() > kMostExact) return;
  const auto at = std::lower_bound(exact_.begin(), exact_.end(), colour);
  if (at == exact_.end() || *at != colour) exact_.insert(at, colour);
}

void ColourCounts::add(std::span<const std::uint32_t> colours, std::span<const Interval> runs) {
  constexpr std::size_t kAhead = 16;
  if (cells_.empty()) cells_.resize(kCells);
  const std::array<std::uint64_t, 256>& light = whole_light();
  for (std::size_t i = 0; i < colours.size(); ++i) {
    // Cells lie far apart: they are fetched before they are needed.
    if (i + kAhead < colours.size()) {
      __builtin_prefetch(&cells_[cell_of(colours[i + kAhead])], 1);
    }
    const std::uint32_t colour = colours[i];
    const auto count = static_cast<std::uint64_t>(runs[i].length());
    if (colour != last_ && exact_.size() <= kMostExact) add_exact(colour);
    last_ = colour;
    Cell& cell = cells_[cell_of(colour)];
    cell.count += count;
    for (std::size_t c = 0; c < 3; ++c) cell.light[c] += count * light[colour >> (8 * c) & 0xff];
    if (const std::uint64_t clear = 255 - (colour >> 24); clear != 0) {
      if (clear_.empty()) clear_.resize(kCells);
      clear_[cell_of(colour)] += count * clear;
    }
  }
}

void ColourCounts::add(ColourCounts&& other) {
  if (other.cells_.empty()) return;
  if (cells_.empty()) {
    *this = std::move(other);
    return;
  }
  for (const std::uint32_t colour : other.exact_) add_exact(colour);
  for (std::size_t i = 0; i < kCells; ++i) {
    cells_[i].count += other.cells_[i].count;
    for (std::size_t c = 0; c < 3; ++c) cells_[i].light[c] += other.cells_[i].light[c];
  }
  if (other.clear_.empty()) return;
  clear_.resize(kCells);
  for (std::size_t i = 0; i < kCells; ++i) clear_[i] += other.clear_[i];
}

Palette ColourCounts::palette(std::size_t most, const Execution& execution) const {
  Palette palette;
  if (exact_.size() <= most) {
    palette.exact_ = exact_;
    for (const std::uint32_t colour : exact_) palette.colours_.push_back(unpacked_colour(colour));
    return palette;
  }
  std::vector<Shade> shades;
  for (std::size_t i = 0; i < kCells; ++i) {
    const Cell& cell = cells_[i];
    if (cell.count == 0) continue;
    Shade shade;
    shade.cell = static_cast<std::uint32_t>(i);
    shade.count = static_cast<double>(cell.count);
    for (std::size_t c = 0; c < 3; ++c) {
      shade.light[static_cast<int>(c)] = static_cast<double>(cell.light[c]) / kOne / shade.count;
    }
    const std::uint64_t alpha = 255 * cell.count - (clear_.empty() ? 0 : clear_[i]);
    shade.light.w = static_cast<double>(alpha) / 255.0 / shade.count;
    shade.place = oklab(glm::dvec3(shade.light));
    shades.push_back(shade);
  }
  std::vector<glm::vec3> places;
  for (const ShadeBox& box : cut(shades, most)) {
    glm::dvec4 light(0.0);
    double count = 0.0;
    for (std::size_t i = box.begin; i < box.end; ++i) {
      light += shades[i].light * shades[i].count;
      count += shades[i].count;
    }
    palette.colours_.push_back(colour_of_light(light / count));
    places.push_back(oklab(glm::dvec3(light / count)));
  }
  palette.cells_.resize(kCells);
  constexpr std::size_t kBlock = 1024;
  parallel_for(execution, (shades.size() + kBlock - 1) / kBlock, [&](std::size_t block, int) {
    for (std::size_t i = block * kBlock; i < std::min(shades.size(), (block + 1) * kBlock); ++i) {
      float best = 1e9f;
      for (std::size_t p = 0; p < places.size(); ++p) {
        const glm::vec3 away = places[p] - shades[i].place;
        const float far = glm::dot(away, away);
        if (far < best) best = far, palette.cells_[shades[i].cell] = static_cast<std::uint8_t>(p);
      }
    }
  });
  return palette;
}

}  // namespace strata
