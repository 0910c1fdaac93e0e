#pragma once

#include <zlib.h>

#include <cstdint>
#include <string>
#include <string_view>

/// PNG files of any kind, for tests.
namespace strata::testing_textures {

inline void append_big_endian(std::string& to, std::uint32_t number) {
  for (int shift = 24; shift >= 0; shift -= 8) to += static_cast<char>((number >> shift) & 0xffu);
}

inline std::string png_chunk(std::string_view kind, std::string_view bytes) {
  std::string chunk;
  append_big_endian(chunk, static_cast<std::uint32_t>(bytes.size()));
  const std::string body = std::string(kind) + std::string(bytes);
  chunk += body;
  append_big_endian(
      chunk, static_cast<std::uint32_t>(::crc32(0, reinterpret_cast<const Bytef*>(body.data()),
                                                static_cast<uInt>(body.size()))));
  return chunk;
}

/// @param rows  of the file: each row has a filter byte, 0, before it
/// @param more  chunks between the header and the rows
inline std::string png_of(std::uint32_t width, std::uint32_t height, int bits, int colour_type,
                          std::string_view rows, std::string_view more = "") {
  std::string header;
  append_big_endian(header, width);
  append_big_endian(header, height);
  header += static_cast<char>(bits);
  header += static_cast<char>(colour_type);
  header += std::string(3, '\0');
  uLongf size = ::compressBound(static_cast<uLong>(rows.size()));
  std::string packed(size, '\0');
  ::compress(reinterpret_cast<Bytef*>(packed.data()), &size,
             reinterpret_cast<const Bytef*>(rows.data()), static_cast<uLong>(rows.size()));
  packed.resize(size);
  return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR", header) + std::string(more) +
         png_chunk("IDAT", packed) + png_chunk("IEND", "");
}

/// Texels of 4 bytes, row by row from the top.
inline std::string rgba_png(std::uint32_t width, std::uint32_t height, std::string_view texels) {
  std::string rows;
  for (std::uint32_t y = 0; y < height; ++y) {
    rows += '\0';
    rows += texels.substr(std::size_t{4} * y * width, std::size_t{4} * width);
  }
  return png_of(width, height, 8, 6, rows);
}

}  // namespace strata::testing_textures
