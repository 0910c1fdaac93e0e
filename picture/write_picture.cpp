#include "picture/encode_png.h"

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <new>
#include <optional>
#include <span>
#include <string_view>

#include "core/atomic_file.h"
#include "core/png_chunks.h"
#include "picture/deflate_rows.h"
#include "strata/picture/pixels.h"

namespace strata {
namespace {

/// The colours of a picture of at most 256, as flat faces have.
class Palette {
 public:
  /// The index of a colour, or nothing when there are too many.
  std::optional<std::uint8_t> index(std::uint32_t colour) {
    for (std::size_t at = (colour * 0x9e3779b1u) >> 22;; at = (at + 1) % kSlots) {
      if (slots_[at] == 0) {
        if (colours_.size() == 256) return std::nullopt;
        colours_.push_back(colour);
        slots_[at] = static_cast<std::uint16_t>(colours_.size());
      }
      const std::size_t found = slots_[at] - 1u;
      if (colours_[found] == colour) return static_cast<std::uint8_t>(found);
    }
  }
  [[nodiscard]] std::span<const std::uint32_t> colours() const { return colours_; }

 private:
  static constexpr std::size_t kSlots = 1024;
  std::array<std::uint16_t, kSlots> slots_{};  ///< index + 1
  std::vector<std::uint32_t> colours_;
};

/// A picture in the smallest of PNG's forms that holds it.
struct PngImage {
  /// PNG's numbers: 2 red, green, blue; 3 palette; 6 with alpha.
  std::uint8_t colour_type = 6;
  std::uint8_t bits = 8;  ///< a channel
  std::size_t row_bytes = 0;
  std::size_t pixel_bytes = 1;
  MakeRow make_row;                   ///< without the byte before it that says how it is filtered
  std::vector<std::uint8_t> palette;  ///< red, green, blue, ...
  std::vector<std::uint8_t> alpha;    ///< of the palette, unless all of it is opaque
};

/// Calls use(index, length) for the runs of one colour.
/// @return false when there are too many colours
template <class Use>
bool for_each_run(Palette& palette, std::span<const Rgba> pixels, Use&& use) {
  for (std::size_t begin = 0; begin < pixels.size();) {
    const auto colour = std::bit_cast<std::uint32_t>(pixels[begin]);
    std::size_t end = begin + 1;
    while (end < pixels.size() && std::bit_cast<std::uint32_t>(pixels[end]) == colour) ++end;
    const std::optional<std::uint8_t> index = palette.index(colour);
    if (!index) return false;
    use(*index, end - begin);
    begin = end;
  }
  return true;
}

/// Puts indices of few colours 2, 4 or 8 a byte: the fewer bytes, the less to compress.
class IndexPacker {
 public:
  IndexPacker(unsigned bits, std::uint8_t* to) : bits_(bits), to_(to) {}
  void run(unsigned index, std::size_t length) {
    for (; length > 0 && filled_ > 0; --length) add(index);
    const std::size_t bytes = length * bits_ / 8;
    to_ = std::fill_n(to_, bytes, static_cast<std::uint8_t>(index * (255 / ((1u << bits_) - 1))));
    for (length -= bytes * 8 / bits_; length > 0; --length) add(index);
  }
  void end() {
    if (filled_ > 0) *to_ = static_cast<std::uint8_t>(byte_ << (8 - filled_));
  }

 private:
  void add(unsigned index) {
    byte_ = byte_ << bits_ | index;
    filled_ += bits_;
    if (filled_ < 8) return;
    *to_++ = static_cast<std::uint8_t>(byte_);
    filled_ = 0;
  }
  unsigned bits_, byte_ = 0, filled_ = 0;
  std::uint8_t* to_;
};

/// False when there are too many colours.
bool to_palette(const Picture& picture, PngImage& image) {
  Palette palette;
  const std::span<const Rgba> pixels = picture.pixels;
  if (!for_each_run(palette, pixels, [](std::uint8_t, std::size_t) {})) return false;
  const std::size_t colours = palette.colours().size();
  const unsigned bits = colours <= 2 ? 1 : colours <= 4 ? 2 : colours <= 16 ? 4 : 8;
  const auto columns = static_cast<std::size_t>(picture.width);
  image.colour_type = 3;
  image.bits = static_cast<std::uint8_t>(bits);
  image.row_bytes = (columns * bits + 7) / 8;
  // A copy of the palette for each row, since looking for a colour may add it.
  image.make_row = [palette, pixels, columns, bits](std::size_t row, std::uint8_t* to) {
    Palette colours_of_row = palette;
    IndexPacker packer(bits, to);
    for_each_run(colours_of_row, pixels.subspan(row * columns, columns),
                 [&](std::uint8_t index, std::size_t n) { packer.run(index, n); });
    packer.end();
  };
  bool opaque = true;
  for (const std::uint32_t colour : palette.colours()) {
    const auto rgba = std::bit_cast<Rgba>(colour);
    image.palette.insert(image.palette.end(), {rgba.r, rgba.g, rgba.b});
    image.alpha.push_back(rgba.a);
    opaque = opaque && rgba.a == 255;
  }
  if (opaque) image.alpha.clear();
  return true;
}

PngImage to_png_image(const Picture& picture) {
  PngImage image;
  if (to_palette(picture, image)) return image;
  unsigned alpha = 255;
  for (const Rgba& pixel : picture.pixels) alpha &= pixel.a;
  const std::size_t channels = alpha == 255 ? 3 : 4;
  const auto columns = static_cast<std::size_t>(picture.width);
  image.colour_type = channels == 3 ? 2 : 6;
  image.pixel_bytes = channels;
  image.row_bytes = columns * channels;
  image.make_row = [&picture, columns, channels](std::size_t row, std::uint8_t* to) {
    const Rgba* const pixels = picture.pixels.data() + row * columns;
    // All but the last are stored with their alpha, which the next one overwrites.
    for (std::size_t i = 0; i + 1 < columns; ++i) {
      std::memcpy(to + i * channels, &pixels[i], sizeof(Rgba));
    }
    std::memcpy(to + (columns - 1) * channels, &pixels[columns - 1], channels);
  };
  return image;
}

}  // namespace

std::vector<std::uint8_t> encode_png(const Picture& picture, const Execution& execution) {
  const PngImage image = to_png_image(picture);
  std::vector<std::uint8_t> bytes;
  PngChunks png(
      bytes, [](const void* data, std::size_t count) { return libdeflate_crc32(0, data, count); });
  const auto add_chunk = [&](std::string_view type, std::span<const std::uint8_t> data) {
    png.begin(type);
    bytes.insert(bytes.end(), data.begin(), data.end());
    png.end();
  };
  png.header(picture.width, picture.height, image.bits, image.colour_type);
  if (!image.palette.empty()) add_chunk("PLTE", image.palette);
  if (!image.alpha.empty()) add_chunk("tRNS", image.alpha);
  // A chunk's length has 31 bits.
  constexpr std::size_t kMostBytes = 0x7fffffff;
  // Nothing is filtered: faces are runs of one colour, which are found as they are.
  const std::vector<std::uint8_t> data =
      deflate_rows(static_cast<std::size_t>(picture.height), image.row_bytes + 1, image.pixel_bytes,
                   execution, [&](std::size_t row, std::uint8_t* to) {
                     *to = 0;
                     image.make_row(row, to + 1);
                   });
  for (std::size_t at = 0; at < data.size(); at += kMostBytes) {
    add_chunk("IDAT", std::span(data).subspan(at, std::min(kMostBytes, data.size() - at)));
  }
  add_chunk("IEND", {});
  return bytes;
}

Result<void> write_png(const Picture& picture, const std::string& path) {
  return write_png(picture, path, {});
}

Result<void> write_png(const Picture& picture, const std::string& path,
                       const Execution& execution) {
  try {
    const std::vector<std::uint8_t> bytes = encode_png(picture, execution);
    return write_file(path, bytes.data(), bytes.size());
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory for a picture of {} x {} pixels", path,
                picture.width, picture.height);
  }
}

}  // namespace strata
