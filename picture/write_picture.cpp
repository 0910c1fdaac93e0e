#include "picture/encode_png.h"

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string_view>

#include "core/atomic_file.h"
#include "core/png_chunks.h"
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
  std::vector<std::uint8_t> bytes;
  std::vector<std::uint8_t> palette;  ///< red, green, blue, ...
  std::vector<std::uint8_t> alpha;    ///< of the palette, unless all of it is opaque
};

/// Puts indices of few colours 2, 4 or 8 a byte: the fewer bytes, the less to compress.
void pack(PngImage& image, int width, std::size_t colours) {
  const std::size_t bits = colours <= 2 ? 1 : colours <= 4 ? 2 : colours <= 16 ? 4 : 8;
  if (bits == 8) return;
  const std::size_t per_byte = 8 / bits, columns = static_cast<std::size_t>(width);
  const std::size_t rows = image.bytes.size() / columns;
  const std::size_t row_bytes = (columns + per_byte - 1) / per_byte;
  std::uint8_t* to = image.bytes.data();  // never beyond what is read
  for (std::size_t row = 0; row < rows; ++row) {
    const std::uint8_t* from = image.bytes.data() + row * columns;
    for (std::size_t begin = 0; begin < columns; begin += per_byte) {
      unsigned byte = 0;
      const std::size_t end = std::min(columns, begin + per_byte);
      for (std::size_t i = begin; i < end; ++i) byte = byte << bits | from[i];
      *to++ = static_cast<std::uint8_t>(byte << bits * (begin + per_byte - end));
    }
  }
  image.bytes.resize(row_bytes * rows);
  image.row_bytes = row_bytes;
  image.bits = static_cast<std::uint8_t>(bits);
}

/// False when there are too many colours.
bool to_palette(const Picture& picture, PngImage& image) {
  Palette palette;
  image.bytes.resize(picture.pixels.size());
  std::uint32_t last = 0;
  std::optional<std::uint8_t> index;
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    const auto colour = std::bit_cast<std::uint32_t>(picture.pixels[i]);
    if (!index || colour != last) {
      index = palette.index(colour);
      if (!index) return false;
      last = colour;
    }
    image.bytes[i] = *index;
  }
  image.colour_type = 3;
  image.row_bytes = static_cast<std::size_t>(picture.width);
  bool opaque = true;
  for (const std::uint32_t colour : palette.colours()) {
    const auto rgba = std::bit_cast<Rgba>(colour);
    image.palette.insert(image.palette.end(), {rgba.r, rgba.g, rgba.b});
    image.alpha.push_back(rgba.a);
    opaque = opaque && rgba.a == 255;
  }
  if (opaque) image.alpha.clear();
  pack(image, picture.width, palette.colours().size());
  return true;
}

PngImage to_png_image(const Picture& picture) {
  PngImage image;
  if (to_palette(picture, image)) return image;
  const bool opaque = std::all_of(picture.pixels.begin(), picture.pixels.end(),
                                  [](const Rgba& pixel) { return pixel.a == 255; });
  const std::size_t channels = opaque ? 3 : 4;
  image.colour_type = opaque ? 2 : 6;
  image.row_bytes = static_cast<std::size_t>(picture.width) * channels;
  image.bytes.resize(picture.pixels.size() * channels);
  std::uint8_t* to = image.bytes.data();
  for (const Rgba& pixel : picture.pixels) {
    to[0] = pixel.r;
    to[1] = pixel.g;
    to[2] = pixel.b;
    if (!opaque) to[3] = pixel.a;
    to += channels;
  }
  return image;
}

/// All rows, each after the byte that says how it is filtered: not at all. Faces are runs of one
/// colour, which deflate finds as they are.
std::vector<std::uint8_t> compress(const PngImage& image, int height) {
  std::vector<std::uint8_t> rows;
  rows.reserve((image.row_bytes + 1) * static_cast<std::size_t>(height));
  for (auto row = image.bytes.begin(); row != image.bytes.end();
       row += static_cast<std::ptrdiff_t>(image.row_bytes)) {
    rows.push_back(0);
    rows.insert(rows.end(), row, row + static_cast<std::ptrdiff_t>(image.row_bytes));
  }
  struct Free {
    void operator()(libdeflate_compressor* c) const { libdeflate_free_compressor(c); }
  };
  const std::unique_ptr<libdeflate_compressor, Free> compressor(libdeflate_alloc_compressor(1));
  if (!compressor) throw std::bad_alloc();
  std::vector<std::uint8_t> out(libdeflate_zlib_compress_bound(compressor.get(), rows.size()));
  out.resize(
      libdeflate_zlib_compress(compressor.get(), rows.data(), rows.size(), out.data(), out.size()));
  return out;
}

}  // namespace

std::vector<std::uint8_t> encode_png(const Picture& picture) {
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
  const std::vector<std::uint8_t> data = compress(image, picture.height);
  for (std::size_t at = 0; at < data.size(); at += kMostBytes) {
    add_chunk("IDAT", std::span(data).subspan(at, std::min(kMostBytes, data.size() - at)));
  }
  add_chunk("IEND", {});
  return bytes;
}

Result<void> write_png(const Picture& picture, const std::string& path) {
  try {
    const std::vector<std::uint8_t> bytes = encode_png(picture);
    auto file = AtomicFile::create(path);
    if (!file) return tl::unexpected(file.error());
    if (auto done = file->write(bytes.data(), bytes.size()); !done) return done;
    return file->commit();
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory for a picture of {} x {} pixels", path,
                picture.width, picture.height);
  }
}

}  // namespace strata
