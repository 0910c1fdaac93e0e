#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace strata {

/// Puts a PNG file together, chunk by chunk (ISO/IEC 15948:2004, 5.3):
/// [length:32 | type:32 | data | CRC-32 of type and data:32], numbers with the highest byte first.
/// @tparam Bytes  a vector of bytes of any kind
/// @tparam Crc  std::uint32_t(const void* data, std::size_t bytes), of the caller's library
template <class Bytes, class Crc>
class PngChunks {
 public:
  /// Replaces what `out` holds, which is borrowed.
  PngChunks(Bytes& out, Crc crc) : out_(out), crc_(crc) {
    out_.clear();
    for (const char byte : std::string_view("\x89PNG\r\n\x1a\n")) {
      put_byte(static_cast<unsigned char>(byte));
    }
  }
  /// The first chunk. @param colour_type PNG's number: 0 grey, 2 red, green, blue, 3 palette, ...
  void header(int width, int height, unsigned bits_a_channel, unsigned colour_type) {
    begin("IHDR");
    put_number(static_cast<std::uint32_t>(width));
    put_number(static_cast<std::uint32_t>(height));
    // Deflate; filters by row; not interlaced.
    for (const unsigned byte : {bits_a_channel, colour_type, 0u, 0u, 0u}) put_byte(byte);
    end();
  }
  /// A chunk whose data the caller appends to `out`, up to 2^31 - 1 bytes.
  void begin(std::string_view type) {
    begin_ = out_.size();
    put_number(0);  // the length, which end() knows
    for (const char letter : type) put_byte(static_cast<unsigned char>(letter));
  }
  void end() {
    const std::size_t length = out_.size() - begin_ - 8;
    for (std::size_t i = 0; i < 4; ++i) {
      out_[begin_ + i] = static_cast<Byte>(length >> (24 - 8 * i) & 0xff);
    }
    put_number(crc_(out_.data() + begin_ + 4, length + 4));
  }

 private:
  using Byte = typename Bytes::value_type;
  void put_byte(unsigned byte) { out_.push_back(static_cast<Byte>(byte)); }
  void put_number(std::uint32_t number) {
    for (const int shift : {24, 16, 8, 0}) put_byte(number >> shift & 0xff);
  }

  Bytes& out_;
  Crc crc_;
  std::size_t begin_ = 0;  // of the chunk
};

}  // namespace strata
