#include "strata/hashbuffer/formats/ldi_io.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <functional>
#include <ostream>
#include <random>
#include <stop_token>
#include <string>
#include <vector>

#include "tests/hashbuffer/formats/ldi_testing.h"

namespace strata {
namespace {

using namespace ldi_testing;  // NOLINT: the vocabulary of this file

struct Format {
  std::string name;
  std::function<Result<void>(const std::string&, const LayeredDepthImage&, const Execution&)> write;
  std::function<Result<LayeredDepthImage>(const std::string&, const Execution&)> read;
  friend void PrintTo(const Format& format, std::ostream* out) { *out << format.name; }
};

std::vector<Format> formats() {
  std::vector<Format> all;
#ifdef STRATA_HAVE_OPENEXR
  for (const bool samples : {false, true}) {
    all.push_back({samples ? "ExrSamples" : "ExrIntervals",
                   [samples](const auto& path, const auto& image, const auto& execution) {
                     return write_ldi_exr(path, image, {.samples = samples}, execution);
                   },
                   read_ldi_exr});
  }
#endif
#ifdef STRATA_HAVE_LIBZIP
  for (const bool compress : {false, true}) {
    all.push_back({compress ? "NpzDeflated" : "NpzStored",
                   [compress](const auto& path, const auto& image, const auto& execution) {
                     return write_ldi_npz(path, image, {.compress = compress}, execution);
                   },
                   read_ldi_npz});
  }
#endif
  return all;
}

class LdiFile : public testing::TestWithParam<Format> {
 protected:
  // Writes, reads, compares.
  void expect_round_trip(const LayeredDepthImage& image) {
    const std::string path = folder.file("lists");
    const auto written = GetParam().write(path, image, {});
    ASSERT_TRUE(written.has_value()) << written.error().message;
    const auto read = GetParam().read(path, {});
    ASSERT_TRUE(read.has_value()) << read.error().message;
    EXPECT_EQ(read->width, image.width);
    EXPECT_EQ(read->height, image.height);
    EXPECT_EQ(read->depth_limit, image.depth_limit);
    EXPECT_EQ(read->world_from_image, image.world_from_image);
    EXPECT_EQ(read->offsets, image.offsets);
    EXPECT_TRUE(read->items == image.items);
    EXPECT_EQ(folder.names().size(), 1) << "something was left beside the file";
  }
  TemporaryFolder folder;
};

INSTANTIATE_TEST_SUITE_P(Formats, LdiFile, testing::ValuesIn(formats()),
                         [](const auto& which) { return which.param.name; });
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(LdiFile);

TEST_P(LdiFile, ReadsBackExactlyWhatWasWritten) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    expect_round_trip(random_image(seed, 1 + static_cast<int>(seed * 7 % 23),
                                   1 + static_cast<int>(seed * 5 % 17)));
  }
  expect_round_trip(random_image(41, 1000, 70));  // several batches of rows
}

TEST_P(LdiFile, KeepsEmptyImagesAndDeepLists) {
  expect_round_trip(image_of(1, 1, {{}}));
  expect_round_trip(image_of(3, 2, {{}, {}, {}, {}, {}, {}}));
  std::mt19937_64 random(2);
  expect_round_trip(image_of(2, 1, {clean_list(random, 1600), {}}));
  expect_round_trip(image_of(1, 2, {{}, wild_list(random, 20000)}));
}

TEST_P(LdiFile, KeepsCrossingsThatMakeNoInterval) {
  const DepthItem in(5, false, 1), out(5, true, 2), later_out(9, true, 3), later_in(9, false, 4);
  const DepthItem deepest((1 << 24) - 1, true, 0x7fffffff), nearest(0, false, 0);
  const std::vector<std::vector<DepthItem>> lists = {
      {in},                                     // never left
      {out},                                    // never entered
      {out, later_in},                          // inside out
      {in, in},                                 // twice
      {in, in, in, out, later_out, later_out},  // overlapping, equal depths
      {in, out},                                // no thickness
      {out, out, later_in, later_in, deepest},
      {nearest, nearest, deepest},
      {nearest, deepest, deepest},
  };
  expect_round_trip(image_of(3, 3, lists));
}

TEST_P(LdiFile, EveryTruncationIsAnErrorThatNamesTheFile) {
  const std::string path = folder.file("lists"), cut = folder.file("cut");
  ASSERT_TRUE(GetParam().write(path, random_image(3, 4, 3), {}));
  const std::string bytes = testkit::bytes_of(path);
  ASSERT_GT(bytes.size(), 300u);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    write_bytes(cut, bytes.substr(0, length));
    const auto read = GetParam().read(cut, {});
    ASSERT_FALSE(read.has_value()) << "the first " << length << " bytes were enough";
    ASSERT_EQ(read.error().code, ErrorCode::kInput) << length;
    ASSERT_TRUE(read.error().message.starts_with(cut)) << read.error().message;
  }
}

TEST_P(LdiFile, DamageIsAnErrorOrHarmless) {
  const std::string path = folder.file("lists"), damaged = folder.file("damaged");
  ASSERT_TRUE(GetParam().write(path, random_image(4, 5, 4), {}));
  const std::string bytes = testkit::bytes_of(path);
  std::mt19937_64 random(5);
  Execution execution;
  execution.memory_limit = 1 << 24;
  int errors = 0;
  constexpr int kRounds = 1000;
  for (int round = 0; round < kRounds; ++round) {
    std::string copy = bytes;
    for (std::uint64_t i = 0; i <= random() % 3; ++i) {
      copy[random() % copy.size()] = static_cast<char>(random() % 4 == 0 ? 0xff : random());
    }
    write_bytes(damaged, copy);
    const auto read = GetParam().read(damaged, execution);
    errors += !read.has_value();
    if (read) {
      EXPECT_TRUE(check_layered_depth_image(*read).has_value());
    }
  }
  EXPECT_GT(errors, kRounds / 4);
}

TEST_P(LdiFile, FilesOfOthersAndMissingFilesAreRefused) {
  const std::string path = folder.file("other");
  EXPECT_EQ(GetParam().read(path, {}).error().code, ErrorCode::kInput);
  EXPECT_EQ(GetParam().read(folder.file(""), {}).error().code, ErrorCode::kInput);
  for (const std::string& content :
       {std::string(), std::string("text that is long enough to be a header of some kind"),
        std::string("PK\3\4 but no archive"), std::string("\x76\x2f\x31\x01\2\0\0\0", 8),
        std::string(5000, '\0')}) {
    write_bytes(path, content);
    const auto read = GetParam().read(path, {});
    ASSERT_FALSE(read.has_value());
    EXPECT_EQ(read.error().code, ErrorCode::kInput);
    EXPECT_NE(read.error().message.find(path), std::string::npos);
  }
}

TEST_P(LdiFile, AFullDiskIsAnErrorAndLeavesNothing) {
  const LayeredDepthImage image = random_image(6, 120, 120);
  const auto device = GetParam().write("/dev/full", image, {});
  ASSERT_FALSE(device.has_value());
  EXPECT_EQ(device.error().code, ErrorCode::kOutput);
  EXPECT_NE(device.error().message.find("/dev/full"), std::string::npos);

  // A limit on the length of files stands for a disk that fills up midway.
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  const std::string path = folder.file("lists");
  for (const rlim_t limit : {rlim_t{0}, rlim_t{3000}, rlim_t{20000}}) {
    small.rlim_cur = limit;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    const auto written = GetParam().write(path, image, {});
    setrlimit(RLIMIT_FSIZE, &before);
    ASSERT_FALSE(written.has_value());
    EXPECT_EQ(written.error().code, ErrorCode::kOutput) << written.error().message;
    EXPECT_EQ(folder.names().size(), 0);
  }
  std::signal(SIGXFSZ, handler);
}

TEST_P(LdiFile, AnUnwritablePathIsAnError) {
  const auto written = GetParam().write(folder.file("no/such/folder"), random_image(7, 2, 2), {});
  ASSERT_FALSE(written.has_value());
  EXPECT_EQ(written.error().code, ErrorCode::kOutput);
}

TEST_P(LdiFile, TheSameBytesForAnyNumberOfThreadsAndOnStandardOutput) {
  const LayeredDepthImage image = random_image(8, 300, 90);
  const std::string one = folder.file("one"), four = folder.file("four"), out = folder.file("out");
  Execution execution;
  execution.threads = 1;
  ASSERT_TRUE(GetParam().write(one, image, execution));
  execution.threads = 4;
  ASSERT_TRUE(GetParam().write(four, image, execution));
  EXPECT_EQ(testkit::bytes_of(one), testkit::bytes_of(four));

  std::fflush(stdout);
  const int saved = dup(STDOUT_FILENO);
  const int file = open(out.c_str(), O_WRONLY | O_CREAT, 0600);
  dup2(file, STDOUT_FILENO);
  const auto written = GetParam().write("-", image, {});
  dup2(saved, STDOUT_FILENO);
  close(file);
  close(saved);
  ASSERT_TRUE(written.has_value()) << written.error().message;
  EXPECT_EQ(testkit::bytes_of(one), testkit::bytes_of(out));
}

TEST_P(LdiFile, AMemoryLimitStopsReadingWithItsNumber) {
  const std::string path = folder.file("lists");
  const LayeredDepthImage image = random_image(9, 64, 64);
  ASSERT_TRUE(GetParam().write(path, image, {}));
  Execution execution;
  for (const std::uint64_t limit : {1000u, 40000u, 100000u}) {
    execution.memory_limit = limit;
    const auto read = GetParam().read(path, execution);
    ASSERT_FALSE(read.has_value());
    EXPECT_EQ(read.error().code, ErrorCode::kLimit) << read.error().message;
    EXPECT_NE(read.error().message.find(std::to_string(limit)), std::string::npos);
  }
  execution.memory_limit = 100 << 20;
  EXPECT_TRUE(GetParam().read(path, execution).has_value());
}

TEST_P(LdiFile, AStopRequestCancelsAndLeavesNothing) {
  std::stop_source stop;
  stop.request_stop();
  Execution execution;
  execution.stop = stop.get_token();
  const std::string path = folder.file("lists");
  const auto written = GetParam().write(path, random_image(10, 20, 20), execution);
  ASSERT_FALSE(written.has_value());
  EXPECT_EQ(written.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(folder.names().size(), 0);
  ASSERT_TRUE(GetParam().write(path, random_image(10, 20, 20), {}));
  EXPECT_EQ(GetParam().read(path, execution).error().code, ErrorCode::kCancelled);
}

TEST_P(LdiFile, InvalidListsAreNotWritten) {
  const DepthItem near(5, false, 1), far(7, true, 1);
  LayeredDepthImage unsorted = image_of(2, 1, {{near}, {far, near}});
  LayeredDepthImage too_deep = image_of(1, 1, {{near, far}});
  too_deep.depth_limit = 7;
  LayeredDepthImage short_offsets = image_of(2, 2, {{near}, {far}});
  LayeredDepthImage falling = image_of(2, 1, {{near}, {far}});
  falling.offsets[1] = 3;
  LayeredDepthImage nothing;
  for (const auto& image : {unsorted, too_deep, short_offsets, falling, nothing}) {
    const auto written = GetParam().write(folder.file("lists"), image, {});
    ASSERT_FALSE(written.has_value());
    EXPECT_EQ(written.error().code, ErrorCode::kUsage);
  }
  EXPECT_EQ(folder.names().size(), 0);
  const auto error = check_layered_depth_image(unsorted).error().message;
  EXPECT_NE(error.find("pixel (1, 0)"), std::string::npos) << error;
}

TEST_P(LdiFile, ProgressEndsAtOne) {
  Execution execution;
  double last = 0;
  execution.progress = [&](double fraction) { last = fraction; };
  const std::string path = folder.file("lists");
  ASSERT_TRUE(GetParam().write(path, random_image(11, 30, 30), execution));
  EXPECT_EQ(last, 1.0);
}

#ifdef STRATA_HAVE_LIBZIP
TEST(LdiNpz, ArraysStandWhereNumpyLooksForThem) {
  // A stored archive holds each array as a .npy file, as it is: look for the bytes.
  TemporaryFolder folder;
  const std::string path = folder.file("lists.npz");
  LayeredDepthImage image = image_of(2, 1, {{DepthItem(7, false, 3)}, {}});
  image.world_from_image[3][0] = 42.5;  // a shift along x: first row, last column for NumPy
  ASSERT_TRUE(write_ldi_npz(path, image));
  const std::string bytes = testkit::bytes_of(path);
  EXPECT_EQ(bytes.substr(0, 4), std::string("PK\3\4"));
  const auto array = [&](const std::string& head, const void* data, std::size_t size) {
    const std::size_t at = bytes.find(head);
    ASSERT_NE(at, std::string::npos) << head;
    const std::size_t line_end = bytes.find('\n', at);
    EXPECT_EQ((line_end + 1 - bytes.rfind("\x93NUMPY", at)) % 64, 0u) << "data is not aligned";
    EXPECT_EQ(bytes.compare(line_end + 1, size, static_cast<const char*>(data), size), 0) << head;
  };
  const std::vector<std::uint64_t> offsets = {0, 1, 1};
  const std::uint32_t depth = 7, payload = 3;
  double matrix[16] = {1, 0, 0, 42.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  array("{'descr': '<u8', 'fortran_order': False, 'shape': (3,), }", offsets.data(), 24);
  array("{'descr': '<f8', 'fortran_order': False, 'shape': (4, 4), }", matrix, sizeof matrix);
  array("{'descr': '<u4', 'fortran_order': False, 'shape': (1,), }", &depth, 4);
  const std::size_t payload_file = bytes.find("payload.npy");
  ASSERT_NE(payload_file, std::string::npos);
  const std::size_t data = bytes.find('\n', payload_file) + 1;
  EXPECT_EQ(std::memcmp(bytes.data() + data, &payload, 4), 0);
}
#endif

}  // namespace
}  // namespace strata
