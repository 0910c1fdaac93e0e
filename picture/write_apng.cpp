// Animated PNG: a PNG file whose further pictures are chunks of its own, fcTL and fdAT.
// The Portable Network Graphics (PNG) Specification, third edition, W3C 2023, 11.3.6.

#include <libdeflate.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <new>
#include <vector>

#include "core/atomic_file.h"
#include "core/png_chunks.h"
#include "picture/animation_formats.h"

namespace strata {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::uint32_t crc(const void* data, std::size_t count) { return libdeflate_crc32(0, data, count); }

/// PNG's filters of a row, by their numbers: none, the pixel before, the row above, their mean, and
/// the one of three neighbours that is nearest to left + above - corner (Paeth).
std::uint8_t predicted(int filter, int left, int above, int corner) {
  switch (filter) {
    case 1:
      return static_cast<std::uint8_t>(left);
    case 2:
      return static_cast<std::uint8_t>(above);
    case 3:
      return static_cast<std::uint8_t>((left + above) / 2);
    case 4: {
      const int p = left + above - corner;
      const int to_left = std::abs(p - left), to_above = std::abs(p - above);
      const int to_corner = std::abs(p - corner);
      if (to_left <= to_above && to_left <= to_corner) return static_cast<std::uint8_t>(left);
      return static_cast<std::uint8_t>(to_above <= to_corner ? above : corner);
    }
    default:
      return 0;
  }
}

/// Appends a row after the number of the filter that leaves the least: the sum of what is left, as
/// signed bytes. @param above  the row before it, of as many bytes
void append_filtered(const Bytes& row, const Bytes& above, std::size_t channels, Bytes& out) {
  std::array<Bytes, 5> tries;
  std::size_t best = 0;
  std::uint64_t least = ~std::uint64_t{0};
  for (std::size_t filter = 0; filter < tries.size(); ++filter) {
    tries[filter].resize(row.size());
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const int left = i < channels ? 0 : row[i - channels];
      const int corner = i < channels ? 0 : above[i - channels];
      const auto rest = static_cast<std::uint8_t>(
          row[i] - predicted(static_cast<int>(filter), left, above[i], corner));
      tries[filter][i] = rest;
      sum += rest < 128 ? rest : 256u - rest;
    }
    if (sum < least) least = sum, best = filter;
  }
  out.push_back(static_cast<std::uint8_t>(best));
  out.insert(out.end(), tries[best].begin(), tries[best].end());
}

struct FreeCompressor {
  void operator()(libdeflate_compressor* c) const { libdeflate_free_compressor(c); }
};

class ApngWriter final : public AnimationWriter {
 public:
  ApngWriter(AtomicFile file, const AnimationOptions& options)
      : file_(std::move(file)),
        options_(options),
        png_(bytes_, crc),
        compressor_(libdeflate_alloc_compressor(6)) {
    if (!compressor_) throw std::bad_alloc();
  }

  Result<void> add(const Picture& picture) override try {
    if (auto small = check_side(file_.path(), picture, 65535); !small) return small;
    PictureBox box = whole_box(picture);
    if (added_ == 0) {
      png_.header(picture.width, picture.height, 8, options_.transparent ? 6 : 2);
      png_.begin("acTL");
      put(static_cast<std::uint32_t>(options_.frames));
      put(0);  // plays for ever
      png_.end();
    } else {
      box = changed_box(before_, picture);
    }
    frame_control(box);
    const bool first = added_ == 0;
    png_.begin(first ? "IDAT" : "fdAT");
    if (!first) put(sequence_++);
    append_pixels(picture, box);
    png_.end();
    ++added_;
    before_ = picture;
    return flush();
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory for a picture of {} x {} pixels",
                file_.path(), picture.width, picture.height);
  }

  Result<void> finish() override {
    png_.begin("IEND");
    png_.end();
    if (auto done = flush(); !done) return done;
    return file_.commit();
  }

 private:
  void put(std::uint32_t number) {
    for (const int shift : {24, 16, 8, 0}) {
      bytes_.push_back(static_cast<std::uint8_t>(number >> shift & 0xff));
    }
  }
  void put_short(unsigned number) {
    bytes_.push_back(static_cast<std::uint8_t>(number >> 8 & 0xff));
    bytes_.push_back(static_cast<std::uint8_t>(number & 0xff));
  }
  void frame_control(const PictureBox& box) {
    png_.begin("fcTL");
    put(sequence_++);
    for (const int number : {box.right - box.left, box.bottom - box.top, box.left, box.top}) {
      put(static_cast<std::uint32_t>(number));
    }
    // The time is a fraction of a second.
    put_short(100);
    put_short(static_cast<unsigned>(std::lround(options_.fps * 100)));
    bytes_.push_back(0);  // the picture stays
    bytes_.push_back(0);  // pixels replace others, alpha too
    png_.end();
  }
  void append_pixels(const Picture& picture, const PictureBox& box) {
    const std::size_t channels = options_.transparent ? 4 : 3;
    const auto columns = static_cast<std::size_t>(box.right - box.left);
    rows_.clear();
    Bytes row(columns * channels), above(row.size(), 0);
    for (int v = box.top; v < box.bottom; ++v) {
      const Rgba* pixel = picture.pixels.data() +
                          static_cast<std::size_t>(v) * static_cast<std::size_t>(picture.width) +
                          static_cast<std::size_t>(box.left);
      for (std::size_t i = 0; i < row.size(); ++i) {
        row[i] = pixel[i / channels][static_cast<int>(i % channels)];
      }
      append_filtered(row, above, channels, rows_);
      above.swap(row);
    }
    const std::size_t at = bytes_.size();
    bytes_.resize(at + libdeflate_zlib_compress_bound(compressor_.get(), rows_.size()));
    bytes_.resize(at + libdeflate_zlib_compress(compressor_.get(), rows_.data(), rows_.size(),
                                                bytes_.data() + at, bytes_.size() - at));
  }
  Result<void> flush() {
    auto done = file_.write(bytes_.data(), bytes_.size());
    bytes_.clear();
    return done;
  }

  AtomicFile file_;
  AnimationOptions options_;
  Bytes bytes_, rows_;
  PngChunks<Bytes, std::uint32_t (*)(const void*, std::size_t)> png_;
  std::unique_ptr<libdeflate_compressor, FreeCompressor> compressor_;
  Picture before_;
  int added_ = 0;
  std::uint32_t sequence_ = 0;
};

}  // namespace

Result<std::unique_ptr<AnimationWriter>> create_apng(const std::string& path,
                                                     const AnimationOptions& options) try {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  return std::make_unique<ApngWriter>(*std::move(file), options);
} catch (const std::bad_alloc&) {
  return fail(ErrorCode::kLimit, "{}: out of memory", path);
}

}  // namespace strata
