// Files of runs: what was written is read, and nothing else.

#include "voxelize/output/run_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "tests/support/temporary_folder.h"

namespace strata {
namespace {

constexpr VoxelGrid kRunGrid{{90, 130, 200}, {1, 2, 3}, {0.5, 0.25, 0.125}};

/// Random runs, of neighbours with different labels too.
VoxelIntervals random_runs(Axis axis, int begin, int end, bool labelled, std::mt19937& random) {
  VoxelIntervals set(kRunGrid, axis, begin, end);
  const AxisFrame frame(axis);
  for (int tv = 0; tv < set.tiles_v(); ++tv) {
    for (int tu = 0; tu < set.tiles_u(); ++tu) {
      if (random() % 4 == 0) continue;
      std::vector<std::uint32_t> offsets(1, 0), labels;
      std::vector<Interval> items;
      for (int column = 0; column < 64 * 64; ++column) {
        const int u = tu * 64 + column % 64, v = begin + tv * 64 + column / 64;
        int w = static_cast<int>(random() % 100);
        while (u < set.columns() && v < end && w < kRunGrid.dims[frame.w] && random() % 3 != 0) {
          const int last = std::min(w + static_cast<int>(random() % 9), kRunGrid.dims[frame.w] - 1);
          items.push_back({static_cast<std::uint16_t>(w), static_cast<std::uint16_t>(last)});
          if (labelled) labels.push_back(static_cast<std::uint32_t>(1 + random() % 1000000));
          w = last + (labelled ? 1 : 2) + static_cast<int>(random() % 5);
        }
        offsets.push_back(static_cast<std::uint32_t>(items.size()));
      }
      if (!items.empty()) set.set_tile(tu, tv, offsets, items, labels);
    }
  }
  return set;
}

std::vector<std::uint32_t> numbers_of(const VoxelIntervals& set) {
  std::vector<std::uint32_t> numbers;
  for_each_run(set, [&](const glm::ivec3& first, const glm::ivec3& last, std::uint32_t label) {
    for (int i = 0; i < 3; ++i) {
      numbers.push_back(static_cast<std::uint32_t>(first[i]));
      numbers.push_back(static_cast<std::uint32_t>(last[i]));
    }
    numbers.push_back(label);
  });
  return numbers;
}

struct RunFile : ::testing::Test {
  testkit::TemporaryFolder place;
  std::string path = (place.path() / "runs").string();
  void write(Axis axis, const std::vector<const VoxelIntervals*>& slabs) const {
    Execution execution;
    execution.threads = 2;
    auto writer = open_run_writer(path, kRunGrid, axis);
    ASSERT_TRUE(writer.has_value()) << writer.error().message;
    for (const VoxelIntervals* slab : slabs) {
      ASSERT_TRUE((*writer)->add(*slab, execution).has_value());
    }
    ASSERT_TRUE((*writer)->finish(execution).has_value());
  }
  /// Reads all of it. @return the numbers, or nothing
  [[nodiscard]] Result<std::vector<std::uint32_t>> read(Axis axis, int begin, int end) const {
    auto reader = RunFileReader::open(path, kRunGrid, axis, {begin, end}, 1000000);
    if (!reader) return tl::unexpected(reader.error());
    std::vector<std::uint32_t> all;
    for (int v = begin; v < end; v += 64) {
      const auto slab = reader->read(std::min(v + 64, end));
      if (!slab) return tl::unexpected(slab.error());
      const auto numbers = numbers_of(*slab);
      all.insert(all.end(), numbers.begin(), numbers.end());
    }
    if (auto done = reader->finish(); !done) return tl::unexpected(done.error());
    return all;
  }
};

TEST_F(RunFile, GivesBackWhatWasWritten) {
  std::mt19937 random(5);
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    for (const bool labelled : {false, true}) {
      const int end = kRunGrid.dims[AxisFrame(axis).v];
      const VoxelIntervals first = random_runs(axis, 0, 64, labelled, random);
      const VoxelIntervals second = random_runs(axis, 64, end, labelled, random);
      std::vector<std::uint32_t> expected = numbers_of(first);
      const auto more = numbers_of(second);
      expected.insert(expected.end(), more.begin(), more.end());
      write(axis, {&first, &second});
      const auto got = read(axis, 0, end);
      ASSERT_TRUE(got.has_value()) << got.error().message;
      EXPECT_EQ(*got == expected, true);
      EXPECT_GT(got->size(), 1000u);
      write(axis, {&second});
      EXPECT_EQ(read(axis, 64, end).value() == more, true);
    }
  }
}

TEST_F(RunFile, ThatIsCutOrChangedIsRefusedOrGivesSomeRuns) {
  std::mt19937 random(7);
  const VoxelIntervals set = random_runs(Axis::kX, 0, 200, true, random);
  write(Axis::kX, {&set});
  const std::string whole = testkit::bytes_of(path);
  ASSERT_TRUE(read(Axis::kX, 0, 200).has_value());
  int refused = 0;
  for (int n = 0; n < 400; ++n) {
    std::string changed = whole;
    if (n % 2 == 0) {
      changed.resize(n < 200 ? static_cast<std::size_t>(n) : random() % whole.size());
    } else {
      changed[n < 100 ? static_cast<std::size_t>(n) : random() % whole.size()] ^=
          static_cast<char>(1 + random() % 255);
    }
    std::ofstream(path, std::ios::binary) << changed;
    const auto got = read(Axis::kX, 0, 200);
    refused += got ? 0 : 1;
    if (!got) {
      EXPECT_EQ(got.error().message.find(path), 0u) << got.error().message;
    }
  }
  EXPECT_GE(refused, 390);  // zlib's sum finds changes of the runs, and the heads are checked
}

TEST_F(RunFile, OfOtherRowsIsRefused) {
  std::mt19937 random(9);
  const VoxelIntervals set = random_runs(Axis::kX, 64, 200, false, random);
  write(Axis::kX, {&set});
  EXPECT_TRUE(read(Axis::kX, 64, 200).has_value());
  EXPECT_FALSE(read(Axis::kX, 0, 64).has_value());
  EXPECT_FALSE(read(Axis::kX, 128, 200).has_value());
  EXPECT_FALSE(read(Axis::kX, 64, 128).has_value());
}

}  // namespace
}  // namespace strata
