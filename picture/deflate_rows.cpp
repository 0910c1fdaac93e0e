// DEFLATE: RFC 1951 (Deutsch, 1996). Each piece is one block of type 2, with codes made for it.

#include "picture/deflate_rows.h"

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <numeric>
#include <optional>
#include <span>

namespace strata {
namespace {

static_assert(std::endian::native == std::endian::little, "bits leave from the low end");

constexpr std::size_t kShortest = 3, kLongest = 258;  // copies
constexpr std::size_t kFarthest = 32768;
constexpr std::size_t kEndOfBlock = 256;
constexpr std::size_t kPieceBytes = std::size_t{1} << 18;  // so that codes cost little

/// What a symbol stands for: `first` and the numbers after it that its extra bits count.
struct Range {
  std::uint32_t first, bits;
};
/// RFC 1951, 3.2.5: the symbols of lengths begin at 257.
constexpr std::array<Range, 29> kLengths = [] {
  std::array<Range, 29> ranges{};
  std::uint32_t first = kShortest;
  for (std::uint32_t i = 0; i < 28; ++i) {
    ranges[i] = {first, i < 8 ? 0 : i / 4 - 1};
    first += 1u << ranges[i].bits;
  }
  ranges[28] = {kLongest, 0};
  return ranges;
}();
constexpr std::array<Range, 30> kDistances = [] {
  std::array<Range, 30> ranges{};
  std::uint32_t first = 1;
  for (std::uint32_t i = 0; i < 30; ++i) {
    ranges[i] = {first, i < 4 ? 0 : i / 2 - 1};
    first += 1u << ranges[i].bits;
  }
  return ranges;
}();
/// By length: its place in kLengths.
constexpr std::array<std::uint8_t, kLongest + 1> kLengthPlaces = [] {
  std::array<std::uint8_t, kLongest + 1> places{};
  for (std::size_t i = 0; i < kLengths.size(); ++i) {
    for (std::size_t n = kLengths[i].first; n <= kLongest; ++n) {
      places[n] = static_cast<std::uint8_t>(i);
    }
  }
  return places;
}();

std::size_t distance_place(std::uint32_t distance) {
  if (distance <= 4) return distance - 1;
  const auto high = static_cast<std::uint32_t>(std::bit_width(distance - 1)) - 1;
  return 2 * high + ((distance - 1) >> (high - 1) & 1);
}

/// A prefix code (D. A. Huffman, 1952) for symbols that come `counts` times, of at most kMost bits.
template <std::size_t kSymbols, std::uint32_t kMost>
struct Code {
  std::array<std::uint32_t, kSymbols> bits{};   ///< in the order of the stream
  std::array<std::uint8_t, kSymbols> length{};  ///< 0: never comes

  explicit Code(std::array<std::uint32_t, kSymbols> counts) {
    // Where codes are too long, rare symbols count more.
    while (!choose_lengths(counts)) {
      for (std::uint32_t& count : counts) count = (count + 1) / 2;
    }
    std::uint32_t code = 0;  // RFC 1951, 3.2.2
    for (std::uint32_t n = 1; n <= kMost; ++n, code <<= 1) {
      for (std::size_t symbol = 0; symbol < kSymbols; ++symbol) {
        if (length[symbol] != n) continue;
        for (std::uint32_t i = 0; i < n; ++i) bits[symbol] |= (code >> i & 1) << (n - 1 - i);
        ++code;
      }
    }
  }

 private:
  /// False when a code is too long.
  bool choose_lengths(const std::array<std::uint32_t, kSymbols>& counts) {
    std::array<std::uint16_t, kSymbols> symbols;
    std::size_t leaves = 0;
    for (std::size_t i = 0; i < kSymbols; ++i) {
      if (counts[i] > 0) symbols[leaves++] = static_cast<std::uint16_t>(i);
    }
    if (leaves == 1) length[symbols[0]] = 1;
    if (leaves <= 1) return true;
    std::stable_sort(symbols.begin(), symbols.begin() + static_cast<std::ptrdiff_t>(leaves),
                     [&](std::size_t a, std::size_t b) { return counts[a] < counts[b]; });
    // Leaves, then inner nodes as they are made: both in the order of their weights.
    std::array<std::uint64_t, 2 * kSymbols> weights;
    std::array<std::size_t, 2 * kSymbols> parents;
    for (std::size_t i = 0; i < leaves; ++i) weights[i] = counts[symbols[i]];
    const std::size_t root = 2 * leaves - 2;
    std::size_t leaf = 0, inner = leaves;
    for (std::size_t node = leaves; node <= root; ++node) {
      weights[node] = 0;
      for (int child = 0; child < 2; ++child) {
        const bool take_leaf = leaf < leaves && (inner >= node || weights[leaf] <= weights[inner]);
        const std::size_t taken = take_leaf ? leaf++ : inner++;
        weights[node] += weights[taken];
        parents[taken] = node;
      }
    }
    std::array<std::uint32_t, 2 * kSymbols> depths;
    depths[root] = 0;
    for (std::size_t node = root; node-- > 0;) {
      depths[node] = depths[parents[node]] + 1;
      if (node >= leaves) continue;
      if (depths[node] > kMost) return false;
      length[symbols[node]] = static_cast<std::uint8_t>(depths[node]);
    }
    return true;
  }
};

class BitWriter {
 public:
  explicit BitWriter(std::vector<std::uint8_t>& out) : out_(out) {}
  /// @pre count <= 32
  void put(std::uint64_t bits, std::uint32_t count) {
    pending_ |= bits << filled_;
    filled_ += count;
    if (filled_ < 32) return;
    const std::size_t at = out_.size();
    out_.resize(at + 4);
    std::memcpy(out_.data() + at, &pending_, 4);
    pending_ >>= 32;
    filled_ -= 32;
  }
  void to_byte() {
    for (; filled_ > 0; filled_ -= std::min(filled_, 8u), pending_ >>= 8) {
      out_.push_back(static_cast<std::uint8_t>(pending_));
    }
  }

 private:
  std::vector<std::uint8_t>& out_;
  std::uint64_t pending_ = 0;
  std::uint32_t filled_ = 0;
};

/// A literal, or a copy.
struct Token {
  std::uint16_t length = 0;    ///< 0: a literal
  std::uint16_t distance = 0;  ///< - 1; or the literal
};

class Deflater {
 public:
  Deflater(std::size_t row_bytes, std::size_t pixel_bytes)
      : row_(row_bytes), pixel_(pixel_bytes), places_(kSlots) {}

  /// Appends the block of bytes [begin, end) of `data`; copies may come from before.
  void deflate(const std::uint8_t* data, std::size_t begin, std::size_t end, bool last,
               std::vector<std::uint8_t>& out) {
    data_ = data;
    find_copies(begin, end);
    write(last, out);
  }

 private:
  static constexpr int kHashBits = 14;
  static constexpr std::size_t kSlots = std::size_t{1} << kHashBits;
  /// Of a copy so many bytes are remembered as places to copy from.
  static constexpr std::size_t kRemembered = 24;

  /// Where four bytes came last, and before: the offset in the piece + 1; 0: nowhere.
  using Places = std::array<std::uint32_t, 2>;

  [[nodiscard]] std::uint32_t word(std::size_t at) const {
    std::uint32_t value = 0;
    std::memcpy(&value, data_ + at, sizeof value);
    return value;
  }
  /// How many bytes from `at` on are those `distance` before.
  [[nodiscard]] std::size_t alike(std::size_t at, std::size_t distance, std::size_t end) const {
    const std::size_t most = std::min(kLongest, end - at);
    const std::uint8_t *now = data_ + at, *before = now - distance;
    std::size_t n = 0;
    for (; n + 8 <= most; n += 8) {
      std::uint64_t a = 0, b = 0;
      std::memcpy(&a, now + n, 8);
      std::memcpy(&b, before + n, 8);
      if (a != b) return n + static_cast<std::size_t>(std::countr_zero(a ^ b)) / 8;
    }
    while (n < most && now[n] == before[n]) ++n;
    return n;
  }

  Places& places_of(std::uint32_t four_bytes) {
    return places_[four_bytes * 0x9e3779b1u >> (32 - kHashBits)];
  }
  void remember(Places& places, std::size_t offset) {
    places = {static_cast<std::uint32_t>(offset + 1), places[0]};
  }

  /// The longest copy for the bytes at `at`, of those that are looked at. @pre at + 4 <= end
  Token longest_copy(std::size_t begin, std::size_t at, std::size_t end) {
    const std::uint32_t now = word(at);
    std::size_t length = 0, distance = 0;
    const auto consider = [&](std::size_t before, std::uint32_t mask) {
      if (before > std::min(at, kFarthest) || ((word(at - before) ^ now) & mask) != 0) return;
      const std::size_t n = alike(at, before, end);
      if (n > length) length = n, distance = before;
    };
    constexpr std::uint32_t kThreeBytes = 0xffffff, kFourBytes = 0xffffffff;
    consider(pixel_, kThreeBytes);
    if (length < kLongest) consider(row_, kThreeBytes);
    Places& places = places_of(now);
    for (const std::uint32_t place : places) {
      if (place != 0 && length < kLongest) consider(at - begin + 1 - place, kFourBytes);
    }
    remember(places, at - begin);
    if (length == 0) return {0, data_[at]};
    return {static_cast<std::uint16_t>(length), static_cast<std::uint16_t>(distance - 1)};
  }

  void find_copies(std::size_t begin, std::size_t end) {
    tokens_.clear();
    std::fill(places_.begin(), places_.end(), Places{});
    std::size_t at = begin;
    while (at + 4 <= end) {
      const Token token = longest_copy(begin, at, end);
      tokens_.push_back(token);
      const std::size_t next = at + std::max<std::size_t>(1, token.length);
      const std::size_t last = std::min({next, at + kRemembered, end - 3});
      for (++at; at < last; ++at) remember(places_of(word(at)), at - begin);
      at = next;
    }
    for (; at < end; ++at) tokens_.push_back({0, data_[at]});
  }

  void write(bool last, std::vector<std::uint8_t>& out) {
    std::array<std::uint32_t, 286> symbols{};
    std::array<std::uint32_t, 30> distances{};
    symbols[kEndOfBlock] = 1;
    for (const Token& token : tokens_) {
      if (token.length == 0) {
        ++symbols[token.distance];
      } else {
        ++symbols[257u + kLengthPlaces[token.length]];
        ++distances[distance_place(token.distance + 1u)];
      }
    }
    if (std::accumulate(distances.begin(), distances.end(), 0u) == 0) distances[0] = 1;
    const Code<286, 15> symbol_code(symbols);
    const Code<30, 15> distance_code(distances);
    BitWriter bits(out);
    bits.put(last ? 1 : 0, 1);
    bits.put(2, 2);
    write_codes(symbol_code.length, distance_code.length, bits);
    for (const Token& token : tokens_) {
      if (token.length == 0) {
        bits.put(symbol_code.bits[token.distance], symbol_code.length[token.distance]);
        continue;
      }
      const std::size_t place = kLengthPlaces[token.length];
      const std::uint64_t extra = token.length - kLengths[place].first;
      bits.put(symbol_code.bits[257 + place] | extra << symbol_code.length[257 + place],
               symbol_code.length[257 + place] + kLengths[place].bits);
      const std::uint32_t distance = token.distance + 1u;
      const std::size_t to = distance_place(distance);
      const std::uint64_t offset = distance - kDistances[to].first;
      bits.put(distance_code.bits[to] | offset << distance_code.length[to],
               distance_code.length[to] + kDistances[to].bits);
    }
    bits.put(symbol_code.bits[kEndOfBlock], symbol_code.length[kEndOfBlock]);
    if (!last) bits.put(0, 3);  // an empty stored block, so that the next begins on a whole byte
    bits.to_byte();
    if (!last) out.insert(out.end(), {0x00, 0x00, 0xff, 0xff});
  }

  /// The lengths of both codes, in a code of their own (RFC 1951, 3.2.7).
  static void write_codes(std::span<const std::uint8_t, 286> symbols,
                          std::span<const std::uint8_t, 30> distances, BitWriter& bits) {
    struct Repeat {
      std::uint8_t symbol, extra, extra_bits;
    };
    std::vector<std::uint8_t> all(symbols.begin(), symbols.end());
    all.insert(all.end(), distances.begin(), distances.end());
    std::vector<Repeat> repeats;
    std::array<std::uint32_t, 19> counts{};
    for (std::size_t i = 0; i < all.size();) {
      const std::uint8_t value = all[i];
      std::size_t n = 1;
      while (i + n < all.size() && all[i + n] == value) ++n;
      if (value == 0 && n >= 3) {
        n = std::min<std::size_t>(n, 138);
        repeats.push_back(n <= 10 ? Repeat{17, static_cast<std::uint8_t>(n - 3), 3}
                                  : Repeat{18, static_cast<std::uint8_t>(n - 11), 7});
      } else if (i > 0 && all[i - 1] == value && n >= 3) {
        n = std::min<std::size_t>(n, 6);
        repeats.push_back({16, static_cast<std::uint8_t>(n - 3), 2});
      } else {
        n = 1;
        repeats.push_back({value, 0, 0});
      }
      ++counts[repeats.back().symbol];
      i += n;
    }
    const Code<19, 7> code(counts);
    constexpr std::array<std::uint8_t, 19> kOrder{16, 17, 18, 0, 8,  7, 9,  6, 10, 5,
                                                  11, 4,  12, 3, 13, 2, 14, 1, 15};
    bits.put(286 - 257, 5);
    bits.put(30 - 1, 5);
    bits.put(19 - 4, 4);
    for (const std::uint8_t symbol : kOrder) bits.put(code.length[symbol], 3);
    for (const Repeat& repeat : repeats) {
      bits.put(code.bits[repeat.symbol], code.length[repeat.symbol]);
      bits.put(repeat.extra, repeat.extra_bits);
    }
  }

  const std::uint8_t* data_ = nullptr;
  std::size_t row_, pixel_;
  std::vector<Places> places_;  ///< by hash
  std::vector<Token> tokens_;
};

/// Of bytes whose sum is `before`, followed by `count` whose sum is `behind` (RFC 1950).
std::uint32_t joined_adler(std::uint32_t before, std::uint32_t behind, std::size_t count) {
  constexpr std::uint64_t kBase = 65521;
  const std::uint64_t a = before & 0xffff, more = behind & 0xffff;
  const std::uint64_t sums = (before >> 16) + (behind >> 16) + count % kBase * (a + kBase - 1);
  return static_cast<std::uint32_t>(sums % kBase << 16 | (a + more + kBase - 1) % kBase);
}

}  // namespace

std::vector<std::uint8_t> deflate_rows(std::size_t count, std::size_t row_bytes,
                                       std::size_t pixel_bytes, const Execution& execution,
                                       const MakeRow& make_row) {
  struct Piece {
    std::vector<std::uint8_t> bytes;
    std::uint32_t adler = 1;
    std::size_t size = 0;
  };
  struct Worker {
    Deflater deflater;
    std::vector<std::uint8_t> rows;
  };
  const std::size_t rows_a_piece = std::max<std::size_t>(1, kPieceBytes / row_bytes);
  std::vector<Piece> pieces((count + rows_a_piece - 1) / rows_a_piece);
  Execution whole;
  whole.threads = execution.threads;
  std::vector<std::optional<Worker>> workers(static_cast<std::size_t>(whole.thread_count()));
  parallel_for(whole, pieces.size(), [&](std::size_t i, int thread) {
    std::optional<Worker>& worker = workers[static_cast<std::size_t>(thread)];
    if (!worker) worker.emplace(Worker{Deflater(row_bytes, pixel_bytes), {}});
    // The row above is made again.
    const std::size_t begin = i * rows_a_piece, end = std::min(count, begin + rows_a_piece);
    const std::size_t above = begin > 0 ? begin - 1 : 0;
    worker->rows.resize((end - above) * row_bytes);
    std::uint8_t* const rows = worker->rows.data();
    for (std::size_t row = above; row < end; ++row) make_row(row, rows + (row - above) * row_bytes);
    const std::size_t before = (begin - above) * row_bytes;
    Piece& piece = pieces[i];
    piece.size = (end - begin) * row_bytes;
    piece.adler = libdeflate_adler32(1, rows + before, piece.size);
    worker->deflater.deflate(rows, before, before + piece.size, i + 1 == pieces.size(),
                             piece.bytes);
  });
  std::vector<std::uint8_t> out{0x78, 0x01};
  std::uint32_t adler = 1;
  for (const Piece& piece : pieces) {
    out.insert(out.end(), piece.bytes.begin(), piece.bytes.end());
    adler = joined_adler(adler, piece.adler, piece.size);
  }
  for (const int shift : {24, 16, 8, 0}) {
    out.push_back(static_cast<std::uint8_t>(adler >> shift & 0xff));
  }
  return out;
}

}  // namespace strata
