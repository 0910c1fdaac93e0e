// PNG, second edition (ISO/IEC 15948:2004): pictures as write_slices.cpp and scanners make them.
// Not by libpng, whose errors jump over C++'s destructors.

#include "voxelize/volume/slice_png.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "strata/core/grid.h"
#include "voxelize/volume/inflate_stream.h"
#include "voxelize/volume/read_context.h"

namespace strata {
namespace {

static_assert(std::endian::native == std::endian::little, "bytes of colours are copied");

std::uint32_t big_endian(ByteCursor& cursor) {
  const auto value = cursor.get<std::uint32_t>();
  return value >> 24 | (value >> 8 & 0xff00) | (value << 8 & 0xff0000) | value << 24;
}

unsigned paeth(int left, int up, int corner) {
  const int guess = left + up - corner;
  const int a = std::abs(guess - left), b = std::abs(guess - up), c = std::abs(guess - corner);
  return static_cast<unsigned>(a <= b && a <= c ? left : b <= c ? up : corner);
}

// Undoes the filter of a row. @return false for a filter that PNG does not have
bool unfilter(unsigned filter, std::size_t step, const std::vector<std::uint8_t>& above,
              std::uint8_t* row, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) {
    const int left = i < step ? 0 : row[i - step], up = above[i];
    const int corner = i < step ? 0 : above[i - step];
    unsigned add = 0;
    if (filter == 1) add = static_cast<unsigned>(left);
    if (filter == 2) add = static_cast<unsigned>(up);
    if (filter == 3) add = static_cast<unsigned>((left + up) / 2);
    if (filter == 4) add = paeth(left, up, corner);
    row[i] = static_cast<std::uint8_t>(row[i] + add);
  }
  return filter <= 4;
}

}  // namespace

Result<SlicePng> SlicePng::open(std::string_view bytes, const std::string& path) {
  ByteCursor cursor(bytes);
  if (cursor.take(8) != "\x89PNG\r\n\x1a\n") {
    return fail(ErrorCode::kInput, "{}: byte 0: no PNG file", path);
  }
  SlicePng png;
  png.path_ = path;
  while (!cursor.failed()) {
    const std::uint64_t at = cursor.at();
    const std::uint32_t length = big_endian(cursor);
    const std::string_view id = cursor.take(4);
    const std::string_view content = cursor.take(length);
    cursor.take(4);  // CRC: zlib's own sum guards the pixels
    if (cursor.failed()) break;
    if (id == "IHDR") {
      ByteCursor head(content);
      const std::uint32_t width = big_endian(head), height = big_endian(head);
      png.bits_ = head.get<std::uint8_t>();
      const int colour = head.get<std::uint8_t>();
      head.take(2);
      const int interlace = head.get<std::uint8_t>();
      const bool fits =
          width >= 1 && height >= 1 && width <= kMaxGridSide && height <= kMaxGridSide;
      constexpr int kGrey = 0, kRgba = 6;
      png.colours_ = colour == kRgba && png.bits_ == 8;
      const bool grey = colour == kGrey && (png.bits_ == 1 || png.bits_ == 8 || png.bits_ == 16);
      if (!fits || interlace != 0 || !(grey || png.colours_)) {
        return fail(
            ErrorCode::kInput,
            "{}: byte {}: {} x {} pixels, {} bits, colour type {}, interlace {}; grey of 1, 8 or "
            "16 bits and colours with alpha of 8 bits up to {} a side are read",
            path, at, width, height, png.bits_, colour, interlace, kMaxGridSide);
      }
      png.width_ = static_cast<int>(width);
      png.height_ = static_cast<int>(height);
    } else if (id == "IDAT") {
      png.packed_ += content;
    } else if (id == "IEND") {
      if (png.width_ == 0) break;
      return png;
    }
  }
  return fail(ErrorCode::kInput, "{}: the file of {} bytes ends before its last chunk", path,
              bytes.size());
}

Result<void> SlicePng::rows(
    const std::function<void(int y, std::span<const std::uint32_t> values)>& take_row) const {
  const auto width = static_cast<std::size_t>(width_);
  const std::size_t bits = static_cast<std::size_t>(bits_) * (colours_ ? 4 : 1);
  const std::size_t bytes = (width * bits + 7) / 8;
  const std::size_t step = std::max<std::size_t>(1, bits / 8);
  std::vector<std::uint32_t> values(width);
  std::vector<std::uint8_t> row(bytes + 1), above(bytes, 0);
  InflateStream stream(packed_, InflateStream::kZlib, path_);
  for (int y = 0; y < height_; ++y) {
    if (auto got = stream.read(reinterpret_cast<std::byte*>(row.data()), row.size()); !got) {
      return got;
    }
    if (!unfilter(row[0], step, above, row.data() + 1, bytes)) {
      return fail(ErrorCode::kInput, "{}: row {} has filter {}; 0 to 4 exist", path_, y, row[0]);
    }
    const std::uint8_t* from = row.data() + 1;
    for (std::size_t x = 0; x < width; ++x) {
      if (bits == 1) {
        values[x] = from[x / 8] >> (7 - x % 8) & 1;
      } else if (bits == 32) {
        std::memcpy(&values[x], from + 4 * x, 4);  // red is the lowest byte
      } else {
        values[x] = bits == 8 ? from[x] : std::uint32_t{from[2 * x]} << 8 | from[2 * x + 1];
      }
    }
    take_row(y, values);
    above.assign(row.begin() + 1, row.end());
  }
  return {};
}

}  // namespace strata
