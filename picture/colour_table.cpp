// This work is based on:
// Paul Heckbert. Color Image Quantization for Frame Buffer Display. SIGGRAPH 1982 (median cut).
// Robert W. Floyd, Louis Steinberg. An Adaptive Algorithm for Spatial Greyscale. 1976.
// We differ: a box is cut at the mean of the channel with the largest variance, the box of the
// largest sum of squares first.

#include "picture/colour_table.h"

#include <algorithm>

namespace strata {
namespace {

/// Colours whose channels have their upper five bits in common.
struct Cell {
  std::uint32_t count = 0;
  std::array<std::uint64_t, 3> sum{};
};
constexpr std::size_t kCells = 32768;

std::size_t cell_of(int r, int g, int b) {
  return static_cast<std::size_t>(r >> 3 << 10 | g >> 3 << 5 | b >> 3);
}

/// Cells that become one colour.
class Box {
 public:
  explicit Box(std::span<const Cell*> cells) : cells_(cells) {
    std::array<double, 3> sum{}, squares{};
    for (const Cell* cell : cells_) {
      count_ += cell->count;
      for (std::size_t c = 0; c < 3; ++c) {
        const double value = mean(*cell, c);
        sum[c] += value * cell->count;
        squares[c] += value * value * cell->count;
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      mean_[c] = sum[c] / static_cast<double>(count_);
      const double spread = squares[c] - sum[c] * mean_[c];
      if (spread > spread_) spread_ = spread, channel_ = c;
    }
  }
  [[nodiscard]] double spread() const { return cells_.size() < 2 ? 0.0 : spread_; }
  [[nodiscard]] Rgba colour() const {
    Rgba result(0, 0, 0, 255);
    for (std::size_t c = 0; c < 3; ++c) {
      result[static_cast<int>(c)] = static_cast<std::uint8_t>(std::min(255.0, mean_[c] + 0.5));
    }
    return result;
  }
  /// The cells up to the mean, and those above it.
  [[nodiscard]] std::pair<Box, Box> cut() const {
    auto middle = std::stable_partition(cells_.begin(), cells_.end(), [&](const Cell* cell) {
      return mean(*cell, channel_) <= mean_[channel_];
    });
    // Rounding may leave a side empty.
    if (middle == cells_.begin()) ++middle;
    if (middle == cells_.end()) --middle;
    const auto first = static_cast<std::size_t>(middle - cells_.begin());
    return {Box(cells_.first(first)), Box(cells_.subspan(first))};
  }

 private:
  static double mean(const Cell& cell, std::size_t channel) {
    return static_cast<double>(cell.sum[channel]) / cell.count;
  }
  std::span<const Cell*> cells_;
  std::uint64_t count_ = 0;
  std::array<double, 3> mean_{};
  double spread_ = 0;
  std::size_t channel_ = 0;
};

std::vector<Rgba> choose_colours(const std::vector<Cell>& cells, std::size_t most) {
  std::vector<const Cell*> used;
  for (const Cell& cell : cells) {
    if (cell.count > 0) used.push_back(&cell);
  }
  if (used.empty()) return {Rgba(0, 0, 0, 255)};
  std::vector<Box> boxes{Box(used)};
  while (boxes.size() < most) {
    const auto widest =
        std::max_element(boxes.begin(), boxes.end(),
                         [](const Box& a, const Box& b) { return a.spread() < b.spread(); });
    if (!(widest->spread() > 0)) break;
    auto [low, high] = widest->cut();
    *widest = low;
    boxes.push_back(high);
  }
  std::vector<Rgba> colours;
  for (const Box& box : boxes) colours.push_back(box.colour());
  return colours;
}

/// Finds the nearest colour, for the middles of cells.
class Nearest {
 public:
  explicit Nearest(const std::vector<Rgba>& colours) : colours_(colours), known_(kCells, -1) {}
  std::uint8_t operator()(const std::array<int, 3>& of) {
    std::int16_t& known = known_[cell_of(of[0], of[1], of[2])];
    if (known < 0) {
      int least = 1 << 30;
      for (std::size_t i = 0; i < colours_.size(); ++i) {
        int distance = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          const int off = (of[c] & ~7) + 4 - colours_[i][static_cast<int>(c)];
          distance += off * off;
        }
        if (distance < least) least = distance, known = static_cast<std::int16_t>(i);
      }
    }
    return static_cast<std::uint8_t>(known);
  }

 private:
  const std::vector<Rgba>& colours_;
  std::vector<std::int16_t> known_;
};

/// Errors that rows hand on, in sixteenths.
void diffuse(std::span<const Rgba> pixels, int width, IndexedPicture& picture) {
  Nearest nearest(picture.colours);
  const auto columns = static_cast<std::size_t>(width);
  using Errors = std::vector<std::array<int, 3>>;
  Errors here(columns + 2), below(columns + 2);  // one more at each side
  for (std::size_t at = 0; at < pixels.size(); at += columns) {
    std::fill(below.begin(), below.end(), std::array<int, 3>{});
    for (std::size_t u = 0; u < columns; ++u) {
      const Rgba pixel = pixels[at + u];
      if (picture.transparent >= 0 && pixel.a < 128) {
        picture.indices[at + u] = static_cast<std::uint8_t>(picture.transparent);
        continue;
      }
      std::array<int, 3> wanted;
      for (std::size_t c = 0; c < 3; ++c) {
        wanted[c] = std::clamp(pixel[static_cast<int>(c)] + here[u + 1][c] / 16, 0, 255);
      }
      const std::uint8_t index = nearest(wanted);
      picture.indices[at + u] = index;
      for (std::size_t c = 0; c < 3; ++c) {
        const int off = wanted[c] - picture.colours[index][static_cast<int>(c)];
        here[u + 2][c] += 7 * off;
        below[u][c] += 3 * off;
        below[u + 1][c] += 5 * off;
        below[u + 2][c] += off;
      }
    }
    here.swap(below);
  }
}

}  // namespace

IndexedPicture index_picture(std::span<const Rgba> pixels, int width, bool transparent) {
  std::vector<Cell> cells(kCells);
  for (const Rgba& pixel : pixels) {
    if (transparent && pixel.a < 128) continue;
    Cell& cell = cells[cell_of(pixel.r, pixel.g, pixel.b)];
    ++cell.count;
    for (int c = 0; c < 3; ++c) cell.sum[static_cast<std::size_t>(c)] += pixel[c];
  }
  IndexedPicture result;
  result.colours = choose_colours(cells, transparent ? 255 : 256);
  result.indices.resize(pixels.size());
  if (transparent) result.transparent = static_cast<int>(result.colours.size());
  diffuse(pixels, width, result);
  if (transparent) result.colours.emplace_back(0, 0, 0, 0);
  return result;
}

}  // namespace strata
