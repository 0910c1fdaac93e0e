// DEFLATE: RFC 1951 (Deutsch, 1996). Block type 2, codes that do not depend on the data.

#include "voxelize/run_deflate.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <vector>

namespace strata {
namespace {

static_assert(std::endian::native == std::endian::little, "bits leave from the low end");

constexpr std::size_t kSymbols = 286;
constexpr std::size_t kEndOfBlock = 256;
constexpr std::size_t kLongest = 285;  // a copy of 258 bytes
constexpr std::uint64_t kLongestCopy = 258;
constexpr std::uint64_t kShortestCopy = 3;
constexpr int kLongestCode = 15;
constexpr std::uint32_t kAdlerBase = 65521;

using CodeLengths = std::array<std::uint8_t, kSymbols>;

void set_lengths(CodeLengths& lengths, std::size_t first, std::size_t last, int length) {
  for (std::size_t i = first; i <= last; ++i) lengths[i] = static_cast<std::uint8_t>(length);
}

// The sum of 2^-length is 1 in both tables, as inflaters demand (a test holds it).
CodeLengths choose_lengths(RunBytes bytes) {
  CodeLengths lengths{};
  if (bytes == RunBytes::kFlags) {
    set_lengths(lengths, 0, 255, 15);
    set_lengths(lengths, 0, 1, 3);
    lengths[kEndOfBlock] = 14;
    set_lengths(lengths, 257, 264, 10);  // copies of 3 .. 10
    set_lengths(lengths, 265, 268, 8);   // .. 18
    set_lengths(lengths, 269, 272, 7);   // .. 34
    set_lengths(lengths, 273, 276, 6);   // .. 66
    set_lengths(lengths, 277, 280, 5);   // .. 130
    set_lengths(lengths, 281, 284, 4);   // .. 257
    lengths[kLongest] = 2;
  } else {
    set_lengths(lengths, 0, 255, 13);
    lengths[0x00] = lengths[0xff] = 3;
    for (int bit = 1; bit < 8; ++bit) {
      lengths[0xffu >> bit] = lengths[0xffu << bit & 0xffu] = 6;
    }
    lengths[kEndOfBlock] = 9;
    set_lengths(lengths, 257, 264, 8);
    set_lengths(lengths, 265, 268, 7);
    set_lengths(lengths, 269, 276, 5);
    set_lengths(lengths, 277, 284, 6);
    lengths[kLongest] = 4;
  }
  return lengths;
}

std::uint32_t reversed(std::uint32_t bits, int length) {
  std::uint32_t result = 0;
  for (int i = 0; i < length; ++i) result |= (bits >> i & 1u) << (length - 1 - i);
  return result;
}

// Extra bits of a copy's symbol, and the shortest copy it stands for (RFC 1951, 3.2.5).
int extra_bits(std::size_t symbol) {
  return symbol < 265 || symbol == kLongest ? 0 : static_cast<int>(symbol - 261) / 4;
}

}  // namespace

struct RunDeflater::Book {
  std::array<Code, kSymbols> symbols;
  std::array<Code, kLongestCopy + 1> copies;  // by length: symbol, extra bits and the distance
  std::vector<Code> header;                   // of a block, after its first three bits

  explicit Book(const CodeLengths& lengths) {
    // Canonical codes (RFC 1951, 3.2.2): by length, then by symbol.
    std::uint32_t code = 0;
    for (int length = 1; length <= kLongestCode; ++length) {
      for (std::size_t symbol = 0; symbol < kSymbols; ++symbol) {
        if (lengths[symbol] != length) continue;
        symbols[symbol] = {reversed(code, length), static_cast<std::uint32_t>(length)};
        ++code;
      }
      code <<= 1;
    }
    // The only distance is 1: symbol 0, whose code is one bit, 0.
    std::size_t copy = kShortestCopy;
    for (std::size_t symbol = 257; symbol <= kLongest; ++symbol) {
      const int extra = extra_bits(symbol);
      if (symbol == kLongest) copy = kLongestCopy;  // the symbol before reaches it too, for more
      for (std::uint32_t offset = 0; offset < 1u << extra && copy < copies.size(); ++offset) {
        copies[copy++] = {symbols[symbol].bits | offset << symbols[symbol].length,
                          symbols[symbol].length + static_cast<std::uint32_t>(extra) + 1};
      }
    }
    make_header(lengths);
  }

 private:
  // The code lengths themselves in a code: 4 bits for each of the symbols 1 .. 16 of that alphabet,
  // where 16 repeats the one before 3 to 6 times.
  void make_header(const CodeLengths& lengths) {
    header = {{kSymbols - 257, 5}, {0, 5}, {19 - 4, 4}};  // all symbols, one distance, 19 lengths
    for (const int symbol : {16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15}) {
      header.push_back({symbol >= 1 && symbol <= 16 ? 4u : 0u, 3});
    }
    const auto put_symbol = [&](std::size_t symbol) {
      header.push_back({reversed(static_cast<std::uint32_t>(symbol - 1), 4), 4});
    };
    for (std::size_t i = 0; i < kSymbols;) {
      std::size_t alike = 1;
      while (i + alike < kSymbols && lengths[i + alike] == lengths[i]) ++alike;
      i += alike;
      put_symbol(lengths[i - 1]);
      for (--alike; alike >= 3;) {
        const std::size_t repeat = std::min<std::size_t>(alike, 6);
        put_symbol(16);
        header.push_back({static_cast<std::uint32_t>(repeat - 3), 2});
        alike -= repeat;
      }
      for (; alike > 0; --alike) put_symbol(lengths[i - 1]);
    }
    put_symbol(1);  // the distance
  }
};

const RunDeflater::Book& RunDeflater::book(RunBytes bytes) {
  static const Book kBits(choose_lengths(RunBytes::kBits));
  static const Book kFlags(choose_lengths(RunBytes::kFlags));
  return bytes == RunBytes::kBits ? kBits : kFlags;
}

RunDeflater::RunDeflater(RunBytes bytes) : book_(book(bytes)) {}

// @pre length <= 32
void RunDeflater::put(std::uint64_t bits, std::uint32_t length) {
  pending_ |= bits << pending_length_;
  pending_length_ += length;
  if (pending_length_ < 32) return;
  const auto low = static_cast<std::uint32_t>(pending_);
  out_->resize(out_->size() + sizeof low);
  std::memcpy(out_->data() + out_->size() - sizeof low, &low, sizeof low);
  pending_ >>= 32;
  pending_length_ -= 32;
}

void RunDeflater::begin(Bytes& out, bool last) {
  out_ = &out;
  last_ = last;
  pending_ = 0;
  pending_length_ = 0;
  value_ = 0;
  length_ = 0;
  adler_a_ = 1;
  adler_b_ = 0;
  put(last ? 1 : 0, 1);
  put(2, 2);  // codes of our own
  for (const Code& code : book_.header) put(code);
}

void RunDeflater::flush_run() {
  if (length_ == 0) return;
  // b grows by the sum of a after each byte: length * a + value * (1 + 2 + .. + length).
  const std::uint64_t length = length_ % kAdlerBase;
  const std::uint64_t triangle = length_ % 2 == 0
                                     ? length_ / 2 % kAdlerBase * ((length_ + 1) % kAdlerBase)
                                     : (length_ + 1) / 2 % kAdlerBase * length;
  adler_b_ = static_cast<std::uint32_t>(
      (adler_b_ + length * adler_a_ + triangle % kAdlerBase * value_) % kAdlerBase);
  adler_a_ = static_cast<std::uint32_t>((adler_a_ + length * value_) % kAdlerBase);

  put(book_.symbols[value_]);
  std::uint64_t rest = length_ - 1;
  const Code longest = book_.copies[kLongestCopy];
  for (; rest >= kLongestCopy; rest -= kLongestCopy) put(longest);
  if (rest >= kShortestCopy) {
    put(book_.copies[rest]);
  } else {
    for (; rest > 0; --rest) put(book_.symbols[value_]);
  }
}

void RunDeflater::end() {
  flush_run();
  length_ = 0;
  put(book_.symbols[kEndOfBlock]);
  if (!last_) put(0, 3);  // an empty stored block; it begins on a whole byte
  while (pending_length_ > 0) {
    out_->push_back(static_cast<std::byte>(pending_));
    pending_ >>= 8;
    pending_length_ -= std::min(pending_length_, 8u);
  }
  if (last_) return;
  for (const int byte : {0x00, 0x00, 0xff, 0xff}) out_->push_back(static_cast<std::byte>(byte));
}

}  // namespace strata
