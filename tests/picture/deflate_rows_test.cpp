#include "picture/deflate_rows.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace strata {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes deflated(const Bytes& rows, std::size_t row_bytes, std::size_t pixel_bytes, int threads = 1) {
  Execution execution;
  execution.threads = threads;
  return deflate_rows(rows.size() / row_bytes, row_bytes, pixel_bytes, execution,
                      [&](std::size_t row, std::uint8_t* bytes) {
                        std::copy_n(rows.data() + row * row_bytes, row_bytes, bytes);
                      });
}

/// By zlib.
Bytes inflated(const Bytes& stream, std::size_t size) {
  Bytes bytes(size + 1);
  uLongf length = bytes.size();
  EXPECT_EQ(uncompress(bytes.data(), &length, stream.data(), stream.size()), Z_OK);
  bytes.resize(length);
  return bytes;
}

/// Rows of runs of `colours` random pixels, some of which repeat the row above.
Bytes random_rows(std::mt19937& random, std::size_t rows, std::size_t row_bytes,
                  std::size_t pixel_bytes, std::uint32_t colours, std::uint32_t longest_run) {
  Bytes bytes;
  for (std::size_t row = 0; row < rows; ++row) {
    if (row > 0 && random() % 3 == 0) {
      bytes.insert(bytes.end(), bytes.end() - static_cast<std::ptrdiff_t>(row_bytes), bytes.end());
      continue;
    }
    const std::size_t end = bytes.size() + row_bytes;
    bytes.push_back(0);
    while (bytes.size() < end) {
      const auto colour = static_cast<std::uint32_t>(random()) % colours;
      for (auto n = static_cast<std::uint32_t>(random()) % longest_run + 1; n > 0; --n) {
        for (unsigned k = 0; k < pixel_bytes && bytes.size() < end; ++k) {
          bytes.push_back(static_cast<std::uint8_t>(colour * 0x9e3779b1u >> 8 * k));
        }
      }
    }
  }
  return bytes;
}

TEST(DeflateRows, InflatesToTheRowsWhateverTheyAre) {
  std::mt19937 random(1);
  for (const std::size_t pixel_bytes : {1u, 3u, 4u}) {
    for (const std::size_t row_bytes : {1u, 2u, 5u, 257u, 3073u, 32768u, 32769u, 300000u}) {
      for (const unsigned colours : {1u, 2u, 300u, 1u << 30}) {
        for (const unsigned longest : {1u, 4u, 1000u}) {
          const std::size_t rows = random() % (row_bytes > 3073 ? 2 : 9) + 1;
          const Bytes bytes = random_rows(random, rows, row_bytes, pixel_bytes, colours, longest);
          const Bytes stream = deflated(bytes, row_bytes, pixel_bytes);
          ASSERT_EQ(inflated(stream, bytes.size()), bytes)
              << rows << " rows of " << row_bytes << " bytes, " << pixel_bytes << " a pixel, "
              << colours << " colours, runs of at most " << longest;
        }
      }
    }
  }
}

// Counts as those of Fibonacci numbers make the longest codes.
TEST(DeflateRows, CodesOfRareBytesAreNotTooLong) {
  Bytes bytes;
  std::size_t count = 1, next = 1;
  for (unsigned value = 0; value < 24; ++value) {
    bytes.insert(bytes.end(), count, static_cast<std::uint8_t>(37 * value));
    next += std::exchange(count, next);
  }
  std::shuffle(bytes.begin(), bytes.end(), std::mt19937(2));
  EXPECT_EQ(inflated(deflated(bytes, bytes.size(), 1), bytes.size()), bytes);
}

TEST(DeflateRows, BytesDoNotDependOnTheThreads) {
  std::mt19937 random(3);
  const Bytes bytes = random_rows(random, 700, 3073, 3, 1000, 40);
  const Bytes alone = deflated(bytes, 3073, 3);
  for (const int threads : {2, 5}) EXPECT_EQ(deflated(bytes, 3073, 3, threads), alone);
}

TEST(DeflateRows, RunsAndRowsTakeNoMoreThanByZlib) {
  std::mt19937 random(4);
  for (const unsigned longest : {30u, 300u}) {
    const Bytes bytes = random_rows(random, 700, 3073, 3, 50, longest);
    Bytes by_zlib(compressBound(bytes.size()));
    uLongf length = by_zlib.size();
    ASSERT_EQ(compress2(by_zlib.data(), &length, bytes.data(), bytes.size(), 1), Z_OK);
    EXPECT_LE(deflated(bytes, 3073, 3).size(), length);
  }
}

}  // namespace
}  // namespace strata
