// DEFLATE: RFC 1951 (Deutsch, 1996). Block type 2, codes that do not depend on the data.

#include "voxelize/output/run_deflate.h"

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

// The sum of 2^-length is 1 in all tables, as inflaters demand (a test holds it).
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
  } else if (bytes == RunBytes::kIds) {
    set_lengths(lengths, 1, kEndOfBlock, 10);
    lengths[0] = 3;
    set_lengths(lengths, 257, 264, 7);
    set_lengths(lengths, 265, 276, 6);
    set_lengths(lengths, 277, 284, 5);
    lengths[kLongest] = 3;
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

  // Copies are at distance `element`: 1, 2 or 4, the last of so many distances of equal length.
  Book(const CodeLengths& lengths, std::uint32_t element) {
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
    // Of one distance the code is one bit, 0; else all bits of the last one are set.
    const std::uint32_t distance_length = element == 4 ? 2 : 1;
    const std::uint32_t distance = element == 1 ? 0 : (1u << distance_length) - 1;
    std::size_t copy = kShortestCopy;
    for (std::size_t symbol = 257; symbol <= kLongest; ++symbol) {
      const int extra = extra_bits(symbol);
      if (symbol == kLongest) copy = kLongestCopy;  // the symbol before reaches it too, for more
      for (std::uint32_t offset = 0; offset < 1u << extra && copy < copies.size(); ++offset) {
        const std::uint32_t length = symbols[symbol].length + static_cast<std::uint32_t>(extra);
        copies[copy++] = {
            symbols[symbol].bits | offset << symbols[symbol].length | distance << length,
            length + distance_length};
      }
    }
    make_header(lengths, element, distance_length);
  }

 private:
  // The code lengths themselves in a code: 4 bits for each of the symbols 1 .. 16 of that alphabet,
  // where 16 repeats the one before 3 to 6 times.
  void make_header(const CodeLengths& lengths, std::uint32_t distances,
                   std::uint32_t distance_length) {
    header = {{kSymbols - 257, 5}, {distances - 1, 5}, {19 - 4, 4}};  // all symbols, 19 lengths
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
    for (std::uint32_t i = 0; i < distances; ++i) put_symbol(distance_length);
  }
};

const RunDeflater::Book& RunDeflater::book(RunBytes bytes, std::size_t element) {
  static const Book kBits(choose_lengths(RunBytes::kBits), 1);
  static const Book kFlags(choose_lengths(RunBytes::kFlags), 1);
  if (bytes == RunBytes::kBits) return kBits;
  if (bytes == RunBytes::kFlags) return kFlags;
  static const Book kIds1(choose_lengths(RunBytes::kIds), 1);
  static const Book kIds2(choose_lengths(RunBytes::kIds), 2);
  static const Book kIds4(choose_lengths(RunBytes::kIds), 4);
  return element == 1 ? kIds1 : element == 2 ? kIds2 : kIds4;
}

RunDeflater::RunDeflater(RunBytes bytes, std::size_t element)
    : book_(book(bytes, element)), element_(element) {}

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
  const auto byte_at = [this](std::uint64_t k) { return value_ >> 8 * (k % element_) & 0xff; };
  add_to_adler();

  for (std::size_t k = 0; k < element_; ++k) put(book_.symbols[byte_at(k)]);
  const std::uint64_t bytes = length_ * element_;
  std::uint64_t rest = bytes - element_;
  const Code longest = book_.copies[kLongestCopy];
  for (; rest >= kLongestCopy; rest -= kLongestCopy) put(longest);
  if (rest >= kShortestCopy) {
    put(book_.copies[rest]);
  } else {
    for (; rest > 0; --rest) put(book_.symbols[byte_at(bytes - rest)]);
  }
}

// After N bytes x_0 .. the sum a has grown by all of them, and b, the sum of what a is after each,
// by N a + sum of (N - k) x_k. Byte k of an element of m stands at k, k + m, .. of n elements,
// which adds n (N - k) - m n (n - 1) / 2 times it.
void RunDeflater::add_to_adler() {
  if (element_ == 1 && length_ < kAdlerBase) {  // no product is near 2^64
    const std::uint64_t n = length_, value = value_ & 0xff;
    adler_b_ = static_cast<std::uint32_t>((adler_b_ + n * adler_a_ + n * (n + 1) / 2 * value) %
                                          kAdlerBase);
    adler_a_ = static_cast<std::uint32_t>((adler_a_ + n * value) % kAdlerBase);
    return;
  }
  const std::uint64_t bytes = length_ * element_, count = length_ % kAdlerBase;
  const std::uint64_t pairs = (length_ % 2 == 0 ? length_ / 2 : length_) % kAdlerBase *
                              ((length_ % 2 == 0 ? length_ - 1 : length_ / 2) % kAdlerBase) %
                              kAdlerBase * element_ % kAdlerBase;
  std::uint64_t a = adler_a_, b = adler_b_ + bytes % kAdlerBase * adler_a_ % kAdlerBase;
  for (std::size_t k = 0; k < element_; ++k) {
    const std::uint64_t value = value_ >> 8 * k & 0xff;
    const std::uint64_t weight = count * ((bytes - k) % kAdlerBase) + kAdlerBase - pairs;
    a += count * value;
    b += weight % kAdlerBase * value;
  }
  adler_a_ = static_cast<std::uint32_t>(a % kAdlerBase);
  adler_b_ = static_cast<std::uint32_t>(b % kAdlerBase);
}

void RunDeflater::byte(std::uint8_t value) {
  flush_run();
  length_ = 0;
  put(book_.symbols[value]);
  adler_a_ = (adler_a_ + value) % kAdlerBase;
  adler_b_ = (adler_b_ + adler_a_) % kAdlerBase;
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
