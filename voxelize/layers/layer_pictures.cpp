#include "voxelize/layers/layer_pictures.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>

#include "core/png_chunks.h"
#include "voxelize/output/run_deflate.h"

namespace strata {
namespace {

constexpr std::uint8_t kNoFilter = 0;

// Pictures hold no floats.
VoxelWriterOptions bytes_of_shares(VoxelWriterOptions options) {
  options.fog_floats = false;
  return options;
}

/// A row of pixels that are bits, the first one highest; solid is 1. Runs come in their order.
class BitRow {
 public:
  explicit BitRow(RunDeflater& deflater) : deflater_(deflater) {}

  void run(int begin, int end) {
    const int first = begin / 8, last = end / 8;
    advance(first);
    const unsigned head = 0xffu >> begin % 8;
    const unsigned tail = 0xff00u >> end % 8 & 0xffu;
    if (first == last) {
      bits_ |= head & tail;
      return;
    }
    deflater_.run(static_cast<std::uint8_t>(bits_ | head), 1);
    if (last > first + 1) deflater_.run(0xff, static_cast<std::uint64_t>(last - first - 1));
    done_ = last;
    bits_ = tail;
  }
  void advance(int to) {
    if (bits_ != 0 && done_ < to) {
      deflater_.run(static_cast<std::uint8_t>(bits_), 1);
      ++done_;
      bits_ = 0;
    }
    if (done_ < to) deflater_.run(0x00, static_cast<std::uint64_t>(to - done_));
    done_ = to;
  }

 private:
  RunDeflater& deflater_;
  int done_ = 0;       // bytes given out
  unsigned bits_ = 0;  // of byte `done_`, so far; 0 if it is not begun
};

/// The least label of each grey but 0 by the rule of LayerOptions::gamma.
std::vector<std::uint32_t> least_labels(double gamma, std::uint32_t full) {
  std::vector<std::uint32_t> least(255);
  for (std::size_t i = 0; i < least.size(); ++i) {
    const double share =
        gamma == 0 ? 0.5 : std::pow((static_cast<double>(i) + 0.5) / 255, 1 / gamma);
    least[i] = static_cast<std::uint32_t>(std::clamp(std::ceil(share * full), 1.0, 1.0 * full));
  }
  return least;
}

const char* order(bool descending) { return descending ? "descending" : "ascending"; }

}  // namespace

LayerPictures::LayerPictures(const VoxelGrid& grid, const VoxelWriterOptions& options)
    : values_(bytes_of_shares(options)),
      options_(options.layers),
      dims_(grid.dims),
      layer_(static_cast<int>(options.layers.axis)),
      columns_(layer_ == 0 ? 1 : 0),
      rows_(layer_ == 2 ? 1 : 2),
      size_(options.layers.display.x > 0 ? options.layers.display
                                         : glm::ivec2(dims_[columns_], dims_[rows_])),
      corner_((size_ - glm::ivec2(dims_[columns_], dims_[rows_])) / 2) {
  if (values_.kind == DenseValues::Kind::kShares && options_.gamma != 1) {
    least_ = least_labels(options_.gamma, options.fog);
  }
}

std::uint32_t LayerPictures::grey(std::uint32_t label) const {
  if (least_.empty()) return values_.bits_of(label);
  return static_cast<std::uint32_t>(std::upper_bound(least_.begin(), least_.end(), label) -
                                    least_.begin());
}

/// Calls run(begin, end, value, label) for the runs of pixels of a row, from the left.
template <class Run>
void LayerPictures::for_each_run(const VoxelIntervals& set, int u, int v, Run&& run) const {
  const std::span<const Interval> column = set.column(u, v);
  const std::span<const std::uint32_t> labels = set.column_labels(u, v);
  const std::size_t count = column.size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = options_.mirror_left_right ? count - 1 - i : i;
    int begin = corner_.x + column[k].begin(), end = corner_.x + column[k].end();
    if (options_.mirror_left_right) {
      std::swap(begin, end);
      begin = size_.x - begin, end = size_.x - end;
    }
    run(begin, end, labels.empty() ? values_.unlabelled() : grey(labels[k]),
        labels.empty() ? std::uint32_t{1} : labels[k]);
  }
}

std::uint64_t LayerPictures::make(const VoxelIntervals& set, int layer, Bytes& out) const {
  PngChunks png(out, [](const void* data, std::size_t bytes) {
    return static_cast<std::uint32_t>(crc32_z(0, static_cast<const Bytef*>(data), bytes));
  });
  const bool flags = values_.kind == DenseValues::Kind::kFlags;
  constexpr unsigned kGrey = 0, kRgba = 6;
  png.header(size_.x, size_.y, flags ? 1 : static_cast<unsigned>(values_.number_bits()),
             values_.kind == DenseValues::Kind::kColours ? kRgba : kGrey);
  png.begin("IDAT");
  RunDeflater deflater(flags ? RunBytes::kBits : RunBytes::kIds, values_.bytes);
  const bool wide = values_.bytes == 2;  // the higher byte first
  std::uint64_t sum = 0;
  append_zlib_stream(deflater, out, [&](RunDeflater& to) {
    for (int pixel = 0; pixel < size_.y; ++pixel) {
      const int from_top = (options_.mirror_up_down ? size_.y - 1 - pixel : pixel) - corner_.y;
      const int row = dims_[rows_] - 1 - from_top;  // the greatest coordinate is above
      const bool there = row >= 0 && row < dims_[rows_];
      const int u = layer_ == 2 ? row : layer, v = layer_ == 2 ? layer : row;
      if (flags) {
        to.run(kNoFilter, 1);
        BitRow bits(to);
        if (there) {
          for_each_run(set, u, v, [&](int begin, int end, std::uint32_t, std::uint32_t label) {
            bits.run(begin, end);
            sum += std::uint64_t{label} * static_cast<std::uint64_t>(end - begin);
          });
        }
        bits.advance((size_.x + 7) / 8);
        continue;
      }
      to.byte(kNoFilter);
      int done = 0;
      if (there) {
        for_each_run(set, u, v, [&](int begin, int end, std::uint32_t value, std::uint32_t label) {
          to.run(0, static_cast<std::uint64_t>(begin - done));
          to.run(wide ? (value >> 8 | (value & 0xff) << 8) : value,
                 static_cast<std::uint64_t>(end - begin));
          done = end;
          sum += std::uint64_t{label} * static_cast<std::uint64_t>(end - begin);
        });
      }
      to.run(0, static_cast<std::uint64_t>(size_.x - done));
    }
  });
  png.end();
  png.begin("IEND");
  png.end();
  return sum;
}

std::string LayerPictures::description() const {
  const char* outside = values_.kind == DenseValues::Kind::kFlags ? "\"solid\": 1"
                        : values_.kind == DenseValues::Kind::kShares
                            ? "\"outside\": 0, \"full\": 255"
                            : "\"outside\": 0";
  std::string text = fmt::format(
      "  \"slice_axis\": \"{}\",\n  \"slice_order\": \"ascending\",\n"
      "  \"row_axis\": \"{}\",\n  \"row_order\": \"{}\",\n"
      "  \"column_axis\": \"{}\",\n  \"column_order\": \"{}\",\n",
      "xyz"[layer_], "xyz"[rows_], order(!options_.mirror_up_down), "xyz"[columns_],
      order(options_.mirror_left_right));
  if (options_.gamma != 1) text += fmt::format("  \"gamma\": {},\n", options_.gamma);
  return text + "  " + outside + "\n";
}

}  // namespace strata
