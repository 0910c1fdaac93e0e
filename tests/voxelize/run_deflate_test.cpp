#include "voxelize/run_deflate.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/voxelize/voxel_readers.h"

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
INSTANTIATE_TEST_SUITE_P(Books, RunDeflate, ::testing::Values(RunBytes::kBits, RunBytes::kFlags));

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

}  // namespace
}  // namespace strata::testing
