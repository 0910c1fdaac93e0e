#include "voxelize/output/run_deflate.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/voxelize/formats/voxel_readers.h"

namespace strata::testing {
namespace {

struct ByteRun {
  std::uint8_t value;
  std::uint64_t length;
};

std::string expand(const std::vector<ByteRun>& runs) {
  std::string bytes;
  for (const ByteRun& run : runs) bytes.append(run.length, static_cast<char>(run.value));
  return bytes;
}

std::string zlib_stream(RunBytes kind, const std::vector<ByteRun>& runs) {
  Bytes out;
  RunDeflater deflater(kind);
  append_zlib_stream(deflater, out, [&](RunDeflater& to) {
    for (const ByteRun& run : runs) to.run(run.value, run.length);
  });
  return {reinterpret_cast<const char*>(out.data()), out.size()};
}

class RunDeflate : public ::testing::TestWithParam<RunBytes> {};
INSTANTIATE_TEST_SUITE_P(Books, RunDeflate,
                         ::testing::Values(RunBytes::kBits, RunBytes::kFlags, RunBytes::kIds));

// inflate also compares the Adler-32.
TEST_P(RunDeflate, InflatesToTheRuns) {
  std::mt19937 random(1);
  for (int round = 0; round < 300; ++round) {
    std::vector<ByteRun> runs;
    const int count = static_cast<int>(random() % 200);
    for (int i = 0; i < count; ++i) {
      const bool common = random() % 4 != 0;
      const auto value = static_cast<std::uint8_t>(common ? random() % 2 * 255 : random());
      runs.push_back({value, 1 + random() % (1u << random() % 12)});
    }
    const std::string expected = expand(runs);
    ASSERT_EQ(inflate_all(zlib_stream(GetParam(), runs), 15, expected.size()), expected) << round;
  }
}

TEST_P(RunDeflate, EveryLengthAndEveryValueIsRight) {
  for (std::uint64_t length = 1; length < 800; ++length) {
    const std::vector<ByteRun> runs = {{7, length}, {static_cast<std::uint8_t>(length), length}};
    ASSERT_EQ(inflate_all(zlib_stream(GetParam(), runs), 15, 2 * length), expand(runs)) << length;
  }
  std::vector<ByteRun> all;
  for (int value = 0; value < 256; ++value) all.push_back({static_cast<std::uint8_t>(value), 1});
  EXPECT_EQ(inflate_all(zlib_stream(GetParam(), all), 15, 256), expand(all));
}

TEST_P(RunDeflate, NothingIsAStreamToo) {
  EXPECT_EQ(inflate_all(zlib_stream(GetParam(), {}), 15, 0), "");
  EXPECT_EQ(inflate_all(zlib_stream(GetParam(), {{0, 0}, {1, 0}, {0, 0}}), 15, 0), "");
}

TEST_P(RunDeflate, PiecesMadeApartFollowOneAnother) {
  std::string expected;
  Bytes stream;
  for (int piece = 0; piece < 40; ++piece) {
    RunDeflater deflater(GetParam());
    deflater.begin(stream, piece == 39);
    for (int i = 0; i <= piece; ++i) {
      const ByteRun run{static_cast<std::uint8_t>(i % 2 * 255),
                        1 + static_cast<std::uint64_t>(i) * 7};
      deflater.run(run.value, run.length);
      expected += expand({run});
    }
    deflater.end();
  }
  const std::string data(reinterpret_cast<const char*>(stream.data()), stream.size());
  EXPECT_EQ(inflate_all(data, -15, expected.size()), expected);
}

TEST_P(RunDeflate, LongRunsCostLittle) {
  const std::vector<ByteRun> runs = {{0, 10'000'000}, {1, 10'000'000}};
  const std::string stream = zlib_stream(GetParam(), runs);
  EXPECT_LT(stream.size(), 60'000u);
  EXPECT_EQ(inflate_all(stream, 15, 20'000'000), expand(runs));
}

// Elements of one, two and four bytes, with single bytes between, as the rows of a PNG have them.
TEST(RunDeflateElements, InflateToTheRuns) {
  std::mt19937 random(2);
  for (const std::size_t element : {1u, 2u, 4u}) {
    for (int round = 0; round < 300; ++round) {
      Bytes out;
      std::string expected;
      RunDeflater deflater(RunBytes::kIds, element);
      append_zlib_stream(deflater, out, [&](RunDeflater& to) {
        for (int i = static_cast<int>(random() % 100); i > 0; --i) {
          const std::uint32_t bits = element == 4 ? ~0u : (1u << 8 * element) - 1;
          const std::uint32_t value = random() % 3 == 0 ? 0 : static_cast<std::uint32_t>(random());
          const std::uint64_t length = random() % (1u << random() % 15);
          to.run(value & bits, length);
          for (std::uint64_t n = 0; n < length; ++n) {
            for (std::size_t b = 0; b < element; ++b) {
              expected += static_cast<char>((value & bits) >> 8 * b);
            }
          }
          if (random() % 4 == 0) {
            to.byte(static_cast<std::uint8_t>(i));
            expected += static_cast<char>(i);
          }
        }
      });
      const std::string stream(reinterpret_cast<const char*>(out.data()), out.size());
      ASSERT_EQ(inflate_all(stream, 15, expected.size()), expected) << element << " " << round;
    }
  }
}

TEST(RunDeflateElements, TheSumOfAVeryLongRunIsRight) {
  for (const std::uint64_t length : {std::uint64_t{1} << 22, (std::uint64_t{1} << 22) + 1}) {
    const std::uint32_t value = 0x89abfffe;
    Bytes out;
    RunDeflater deflater(RunBytes::kIds, 4);
    append_zlib_stream(deflater, out, [&](RunDeflater& to) { to.run(value, length); });
    const std::string stream(reinterpret_cast<const char*>(out.data()), out.size());
    EXPECT_EQ(inflate_all(stream, 15, length * 4).size(), length * 4);
  }
}

}  // namespace
}  // namespace strata::testing
