#pragma once

#include <array>
#include <cstdint>

#include "voxelize/output/block_output.h"

namespace strata {

/// What the bytes of a run-length-like stream are, for the choice of code lengths.
enum class RunBytes {
  kBits,   ///< eight voxels a byte: mostly 0x00 and 0xff, and the bytes where a run begins or ends
  kFlags,  ///< one voxel a byte: 0 or 1
  kIds     ///< one voxel an element of 1, 2 or 4 bytes: 0, or any number
};

/// Compresses to DEFLATE (RFC 1951) what is known as runs of equal bytes, without ever having the
/// bytes: each run is a literal and copies at distance 1, in Huffman codes chosen beforehand (of
/// elements of several bytes: their literals, and copies at the distance of an element). Work and
/// output grow with the runs. Against zlib's level 1 over the bytes of a 1024 x 1024 layer:
/// 50 times faster or more, at about the same size. Any byte values are allowed.
class RunDeflater {
 public:
  /// @param element  bytes of an element: 1; 2 or 4 of kIds
  explicit RunDeflater(RunBytes bytes, std::size_t element = 1);

  /// Appends to `out` from here on: one block. `last`: it ends the stream.
  void begin(Bytes& out, bool last);
  /// Appends a run of `length` elements, whose bytes are those of `value` from the lowest on; a
  /// neighbour of the same value joins it.
  void run(std::uint32_t value, std::uint64_t length) {
    if (value == value_) {
      length_ += length;
      return;
    }
    flush_run();
    value_ = value;
    length_ = length;
  }
  /// Appends one byte, whatever the elements are.
  void byte(std::uint8_t value);
  /// Ends the block. One that is not the last is padded to a whole byte (by an empty stored block,
  /// as zlib's Z_SYNC_FLUSH does), so that pieces made apart may follow one another.
  void end();

  /// Adler-32 (RFC 1950) of the bytes since begin(); after end().
  [[nodiscard]] std::uint32_t adler() const { return adler_b_ << 16 | adler_a_; }

 private:
  struct Code {
    std::uint32_t bits = 0;  // in the order of the stream: first bit lowest
    std::uint32_t length = 0;
  };
  struct Book;
  static const Book& book(RunBytes bytes, std::size_t element);
  void flush_run();
  void add_to_adler();
  void put(std::uint64_t bits, std::uint32_t length);
  void put(Code code) { put(code.bits, code.length); }

  const Book& book_;
  std::size_t element_;
  Bytes* out_ = nullptr;
  bool last_ = false;
  std::uint64_t pending_ = 0;  // bits not yet in out_
  std::uint32_t pending_length_ = 0;
  std::uint32_t value_ = 0;
  std::uint64_t length_ = 0;
  std::uint32_t adler_a_ = 1, adler_b_ = 0;
};

/// Appends a whole zlib stream (RFC 1950) made of the runs that `emit(deflater)` gives.
template <class Emit>
void append_zlib_stream(RunDeflater& deflater, Bytes& out, Emit&& emit) {
  for (const int byte : {0x78, 0x01}) out.push_back(static_cast<std::byte>(byte));
  deflater.begin(out, true);
  emit(deflater);
  deflater.end();
  const std::uint32_t adler = deflater.adler();
  for (const int shift : {24, 16, 8, 0}) out.push_back(static_cast<std::byte>(adler >> shift));
}

}  // namespace strata
