#include "picture/encode_png.h"

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string_view>

#include "core/atomic_file.h"
#include "core/png_chunks.h"
#include "core/reserve_large.h"
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
  std::uint8_t bits = 8;      ///< a channel
  std::size_t row_bytes = 0;  ///< with the byte that says how the row is filtered: not at all
  std::size_t size = 0;       ///< of all rows
  std::unique_ptr<std::uint8_t[]> rows;
  std::vector<std::uint8_t> palette;  ///< red, green, blue, ...
  std::vector<std::uint8_t> alpha;    ///< of the palette, unless all of it is opaque
};

/// Makes room for rows of `row_bytes` bytes, and calls fill(row, bytes) for each. Nothing is
/// filtered: faces are runs of one colour, which deflate finds as they are.
template <class Fill>
void make_rows(PngImage& image, int height, std::size_t row_bytes, std::size_t slack, Fill&& fill) {
  image.row_bytes = row_bytes + 1;
  image.size = image.row_bytes * static_cast<std::size_t>(height);
  image.rows = std::make_unique_for_overwrite<std::uint8_t[]>(image.size + slack);
  detail::ask_for_large_pages(image.rows.get(), image.size);
  for (std::size_t row = 0; row < static_cast<std::size_t>(height); ++row) {
    std::uint8_t* const to = image.rows.get() + row * image.row_bytes;
    *to = 0;
    fill(row, to + 1);
  }
}

/// The end of the run of pixels of one colour that starts at `begin`. @pre begin != end
const Rgba* end_of_run(const Rgba* begin, const Rgba* end) {
  constexpr std::ptrdiff_t kAtOnce = 16;
  const Rgba colour = *begin;
  const auto differs = [&](const Rgba& pixel) {
    return std::bit_cast<std::uint32_t>(pixel) ^ std::bit_cast<std::uint32_t>(colour);
  };
  for (; end - begin >= kAtOnce; begin += kAtOnce) {
    std::uint32_t other = 0;
    for (std::ptrdiff_t i = 0; i < kAtOnce; ++i) other |= differs(begin[i]);
    if (other != 0) break;
  }
  return std::find_if(begin, end, differs);
}

/// Calls use(index, count) for the runs of one colour from `begin` to `end`.
/// @return false when there are too many colours
template <class Use>
bool for_each_run(Palette& palette, const Rgba* begin, const Rgba* end, Use&& use) {
  while (begin != end) {
    const auto index = palette.index(std::bit_cast<std::uint32_t>(*begin));
    if (!index) return false;
    const Rgba* const next = end_of_run(begin, end);
    use(*index, static_cast<std::size_t>(next - begin));
    begin = next;
  }
  return true;
}

/// False when there are too many colours.
bool to_palette(const Picture& picture, PngImage& image) {
  Palette palette;
  const Rgba* const pixels = picture.pixels.data();
  if (!for_each_run(palette, pixels, pixels + picture.pixels.size(),
                    [](std::uint8_t, std::size_t) {})) {
    return false;
  }
  // Indices of few colours are put 2, 4 or 8 a byte: the fewer bytes, the less to compress.
  const std::size_t colours = palette.colours().size();
  const unsigned bits = colours <= 2 ? 1 : colours <= 4 ? 2 : colours <= 16 ? 4 : 8;
  const auto columns = static_cast<std::size_t>(picture.width);
  image.colour_type = 3;
  image.bits = static_cast<std::uint8_t>(bits);
  make_rows(
      image, picture.height, (columns * bits + 7) / 8, 0, [&](std::size_t row, std::uint8_t* to) {
        unsigned byte = 0, filled = 0;
        const auto add = [&](std::uint8_t index) {
          byte = byte << bits | index;
          filled += bits;
          if (filled < 8) return;
          *to++ = static_cast<std::uint8_t>(byte);
          filled = 0;
        };
        const Rgba* const begin = pixels + row * columns;
        for_each_run(palette, begin, begin + columns, [&](std::uint8_t index, std::size_t count) {
          for (; count > 0 && filled > 0; --count) add(index);
          const std::size_t bytes = count * bits / 8;
          // The index in each of a byte's places.
          to = std::fill_n(to, bytes,
                           static_cast<std::uint8_t>(index * (255u / ((1u << bits) - 1))));
          for (count -= bytes * 8 / bits; count > 0; --count) add(index);
        });
        if (filled > 0) *to = static_cast<std::uint8_t>(byte << (8 - filled));
      });
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
  const auto columns = static_cast<std::size_t>(picture.width);
  const auto row_at = [&](std::size_t row) { return picture.pixels.data() + row * columns; };
  // Most pictures are opaque. Each pixel is stored with its alpha, which the next one overwrites.
  image.colour_type = 2;
  unsigned alpha = 255;
  make_rows(image, picture.height, columns * 3, 1, [&](std::size_t row, std::uint8_t* to) {
    const Rgba* const pixels = row_at(row);
    for (std::size_t i = 0; i < columns; ++i) {
      std::memcpy(to + i * 3, &pixels[i], sizeof(Rgba));
      alpha &= pixels[i].a;
    }
  });
  if (alpha == 255) return image;
  image.colour_type = 6;
  image.rows.reset();
  make_rows(image, picture.height, columns * 4, 0, [&](std::size_t row, std::uint8_t* to) {
    std::memcpy(to, row_at(row), columns * sizeof(Rgba));
  });
  return image;
}

/// Appends a zlib stream of all rows.
void compress(const PngImage& image, std::vector<std::uint8_t>& out) {
  struct Free {
    void operator()(libdeflate_compressor* c) const { libdeflate_free_compressor(c); }
  };
  const std::unique_ptr<libdeflate_compressor, Free> compressor(libdeflate_alloc_compressor(1));
  if (!compressor) throw std::bad_alloc();
  const std::size_t bound = libdeflate_zlib_compress_bound(compressor.get(), image.size);
  const auto room = std::make_unique_for_overwrite<std::uint8_t[]>(bound);
  const std::size_t size =
      libdeflate_zlib_compress(compressor.get(), image.rows.get(), image.size, room.get(), bound);
  out.assign(room.get(), room.get() + size);
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
  std::vector<std::uint8_t> data;
  compress(image, data);
  for (std::size_t at = 0; at < data.size(); at += kMostBytes) {
    add_chunk("IDAT", std::span(data).subspan(at, std::min(kMostBytes, data.size() - at)));
  }
  add_chunk("IEND", {});
  return bytes;
}

Result<void> write_png(const Picture& picture, const std::string& path) {
  try {
    const std::vector<std::uint8_t> bytes = encode_png(picture);
    return write_file(path, bytes.data(), bytes.size());
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}: out of memory for a picture of {} x {} pixels", path,
                picture.width, picture.height);
  }
}

}  // namespace strata
