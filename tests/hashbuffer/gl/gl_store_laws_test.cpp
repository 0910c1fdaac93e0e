// The laws of tests/hashbuffer/store_laws_test.cpp, over the stores on the GPU; and that a table is
// the CPU's, bit for bit.

#include <algorithm>
#include <functional>
#include <memory>
#include <ostream>
#include <string>

#include "hashbuffer/gl/hash_store.h"
#include "hashbuffer/gl/scan_store.h"
#include "strata/hashbuffer/hash_buffer.h"
#include "tests/gl/gl_testing.h"
#include "tests/hashbuffer/gl/submission.h"

namespace strata::gl {
namespace {

using test::Fragment;
using test::GlSubmission;
using test::random_fragments;
using test::shuffle;
using test::sort_everything;
using test::Submission;

/// How to make a store, and what the laws may ask of it.
struct StoreKind {
  std::string name;
  std::function<Result<std::unique_ptr<Store>>(const Info&)> create;
  std::uint64_t longest_list;
  bool needs_int64_atomics = false;
};
void PrintTo(const StoreKind& kind, std::ostream* out) { *out << kind.name; }

StoreKind hash(const std::string& name, const HashStoreOptions& options) {
  return {name,
          [options](const Info& info) {
            return HashStore::create(info, options).map([](std::unique_ptr<HashStore>&& store) {
              return std::unique_ptr<Store>(std::move(store));
            });
          },
          255, options.record_bits == 64 && options.path == WordPath::kAtomic && !options.serial};
}
StoreKind scan(const std::string& name, const ScanStoreOptions& options) {
  return {name,
          [options](const Info& info) {
            return ScanStore::create(info, options).map([](std::unique_ptr<ScanStore>&& store) {
              return std::unique_ptr<Store>(std::move(store));
            });
          },
          ~0ull};
}

std::vector<StoreKind> all_stores() {
  const auto random = OffsetKind::kRandom, far = OffsetKind::kFarthestPoint;
  const auto two = WordPath::kTwoPass, atomic = WordPath::kAtomic;
  // Bands: bindings so small that screens of the tests are cut into several.
  return {
      hash("Ha32Planes", {.record_bits = 32, .seed = 77}),
      hash("Ha32Random", {.record_bits = 32, .offsets = random, .seed = 77}),
      hash("Ha32Farthest", {.record_bits = 32, .offsets = far, .seed = 77}),
      hash("Ha32NoReadFirst", {.record_bits = 32, .seed = 77, .read_first = false}),
      hash("Ha32Bands", {.record_bits = 32, .seed = 77, .binding_bytes = 2048}),
      hash("Ha64TwoPass", {.path = two, .seed = 77}),
      hash("Ha64TwoPassRandom", {.path = two, .offsets = random, .seed = 77}),
      hash("Ha64TwoPassBands", {.path = two, .seed = 77, .binding_bytes = 2048}),
      hash("Ha64TwoPassFixed", {.path = two, .seed = 77, .resize = false}),
      hash("Ha64Atomic", {.path = atomic, .seed = 77}),
      hash("Ha64AtomicRandom", {.path = atomic, .offsets = random, .seed = 77}),
      hash("Ha64AtomicSerial", {.path = atomic, .seed = 77, .serial = true}),
      hash("Ha64AtomicBands", {.path = atomic, .seed = 77, .binding_bytes = 4096}),
      scan("Scan", {}),
      scan("ScanDepthOnly", {.payload = false}),
      scan("ScanBands", {.binding_bytes = 12000}),
  };
}

class GlStoreLaws : public test::GlTest, public testing::WithParamInterface<StoreKind> {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (!context_) return;
    if (GetParam().needs_int64_atomics && !context_->info().has_int64_atomics) {
      GTEST_SKIP() << context_->info().int64_atomics_reason;
    }
  }
  std::unique_ptr<Store> make() const {
    auto store = GetParam().create(context_->info());
    EXPECT_TRUE(store) << store.error().message;
    return std::move(*store);
  }
  static LayeredDepthImage expected(const Store& store, int width, int height,
                                    const std::vector<Fragment>& fragments) {
    return store.payload_mask() == 0 ? sort_everything<Record32>(width, height, fragments)
                                     : sort_everything<Record64>(width, height, fragments);
  }
  void expect_exact(Store& store, int width, int height, const std::vector<Fragment>& fragments) {
    GlSubmission submission(width, height, fragments);
    const auto report = build(store, submission);
    ASSERT_TRUE(report) << report.error().message;
    const auto image = store.download();
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_TRUE(*image == expected(store, width, height, fragments));
  }
};

INSTANTIATE_TEST_SUITE_P(Stores, GlStoreLaws, testing::ValuesIn(all_stores()),
                         [](const auto& store) { return store.param.name; });

constexpr struct {
  int width, height;
} kScreens[] = {{1, 1}, {7, 3}, {3, 7}, {8, 8}, {9, 1}, {1, 17}, {13, 9}, {17, 16}, {31, 33}};

TEST_P(GlStoreLaws, ListsEqualTheSortOfEverything) {
  Random random(11);
  auto store = make();
  for (const auto& [width, height] : kScreens) {
    for (const double layers : {0.2, 1.0, 3.0, 9.0}) {
      const auto count = static_cast<std::size_t>(layers * width * height);
      for (const std::uint32_t depths : {1u << 24, 5u}) {
        expect_exact(*store, width, height, random_fragments(random, width, height, count, depths));
        if (testing::Test::HasFailure()) FAIL() << width << " x " << height << ", " << count;
      }
    }
  }
}

TEST_P(GlStoreLaws, ListsOfAHundredSmallScenesAreExact) {
  Random random(12);
  auto store = make();
  for (int scene = 0; scene < 100; ++scene) {
    const int width = 1 + static_cast<int>(random.below(5));
    const int height = 1 + static_cast<int>(random.below(4));
    expect_exact(*store, width, height,
                 random_fragments(random, width, height, random.below(40), 3, 2));
    if (testing::Test::HasFailure()) FAIL() << "scene " << scene;
  }
}

TEST_P(GlStoreLaws, ListsDoNotDependOnInsertionOrder) {
  Random random(13);
  auto fragments = random_fragments(random, 13, 9, 600, 50);
  auto store = make();
  for (int round = 0; round < 4; ++round) {
    shuffle(random, fragments);
    expect_exact(*store, 13, 9, fragments);
  }
}

TEST_P(GlStoreLaws, ContendedPixelsKeepEverything) {
  Random random(15);
  auto store = make();
  for (int round = 0; round < 5; ++round) {
    expect_exact(*store, 2, 2, random_fragments(random, 2, 2, 700, 4, 2));
  }
}

TEST_P(GlStoreLaws, EqualFragmentsAreAllKept) {
  std::vector<Fragment> fragments;
  for (int copy = 0; copy < 50; ++copy) {
    for (int x = 0; x < 5; ++x) fragments.push_back({x, x % 2, 1000, 7});
  }
  auto store = make();
  expect_exact(*store, 5, 2, fragments);
}

TEST_P(GlStoreLaws, DepthsAndPayloadsAtBothEnds) {
  constexpr std::uint32_t kFar = (1u << 24) - 1;
  std::vector<Fragment> fragments;
  for (int pixel = 0; pixel < 7 * 3; ++pixel) {
    for (const std::uint32_t depth : {kFar, 0u, kFar - 1, 1u, 0u, kFar, 1u << 23, kFar + 5}) {
      for (const std::uint32_t payload : {0u, ~0u, ~0u, 1u << 31, test::kCommonPayload}) {
        fragments.push_back({pixel % 7, pixel / 7, depth, payload});
      }
    }
  }
  auto store = make();
  expect_exact(*store, 7, 3, fragments);
}

TEST_P(GlStoreLaws, LongListsAreExactOrEndInAnErrorThatNamesThePixel) {
  Random random(16);
  for (const std::size_t layers : {255u, 300u, 600u, 1023u, 1100u, 9000u}) {
    // A binding must hold a row of the screen.
    if (layers > 1100 && GetParam().name == "ScanBands") continue;
    auto fragments = random_fragments(random, 6, 5, 60);
    std::erase_if(fragments, [](const Fragment& f) { return f.x == 4 && f.y == 2; });
    for (std::size_t i = 0; i < layers; ++i) {
      fragments.push_back({4, 2, static_cast<std::uint32_t>(random.below(1u << 24)), 1});
    }
    auto store = make();
    if (layers <= GetParam().longest_list) {
      expect_exact(*store, 6, 5, fragments);
      continue;
    }
    GlSubmission submission(6, 5, fragments);
    const auto report = build(*store, submission);
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().code, ErrorCode::kLimit);
    EXPECT_NE(report.error().message.find("pixel (4, 2) has " + std::to_string(layers)),
              std::string::npos)
        << report.error().message;
    expect_exact(*store, 6, 5, random_fragments(random, 6, 5, 60));  // it is not broken by it
  }
}

TEST_P(GlStoreLaws, TheMemoryLimitIsKeptAndTheErrorCountsWhatIsMissing) {
  Random random(17);
  const auto fragments = random_fragments(random, 10, 10, 3000);
  auto store = make();
  GlSubmission submission(10, 10, fragments);
  auto report = build(*store, submission);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->memory_bytes, store->memory_bytes());
  const std::uint64_t enough = report->memory_bytes;
  store = make();
  report = build(*store, submission, Execution{.memory_limit = enough});
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_LE(store->memory_bytes(), enough);
  store = make();
  report = build(*store, submission, Execution{.memory_limit = enough / 3});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::kLimit);
  EXPECT_NE(report.error().message.find("limit is"), std::string::npos) << report.error().message;
  expect_exact(*store, 10, 10, fragments);
}

TEST_P(GlStoreLaws, EachFrameReplacesTheLast) {
  Random random(18);
  auto store = make();
  for (const std::size_t count : {500u, 0u, 20u, 2000u, 1u, 100u}) {
    expect_exact(*store, 19, 6, random_fragments(random, 19, 6, count));
  }
}

TEST_P(GlStoreLaws, AStoppedBuildSaysSo) {
  std::stop_source stop;
  stop.request_stop();
  auto store = make();
  GlSubmission submission(3, 3, {{1, 1, 5, 5}});
  const auto report = build(*store, submission, Execution{.stop = stop.get_token()});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::kCancelled);
}

TEST_P(GlStoreLaws, AScreenWithoutPixelsIsRefused) {
  auto store = make();
  const auto begun = store->begin(0, 4);
  ASSERT_FALSE(begun);
  EXPECT_EQ(begun.error().code, ErrorCode::kUsage);
}

// --- the table ----------------------------------------------------------------------------------

using GlHashTable = test::GlTest;

/// Over several frames, so that tables grow, shrink and draw new offsets: each as on the CPU.
template <class Record>
void expect_tables_of_the_cpu(const Info& info, HashStoreOptions options, int width, int height,
                              std::uint64_t seed) {
  options.seed = seed;
  auto made = HashStore::create(info, options);
  ASSERT_TRUE(made) << made.error().message;
  HashStore& store = **made;
  auto cpu = HashBuffer<Record, Exclusive>::create(width, height,
                                                   {.cells = options.cells,
                                                    .offsets = options.offsets,
                                                    .seed = seed,
                                                    .age_limit = options.age_limit});
  ASSERT_TRUE(cpu);
  Random random(seed);
  for (const double layers : {0.3, 2.0, 7.0, 7.0, 1.0, 0.1, 20.0}) {
    for (const std::uint32_t depths : {1u << 24, 3u}) {
      const auto count = static_cast<std::size_t>(layers * width * height);
      const auto fragments =
          random_fragments(random, width, height, count, depths, depths == 3 ? 2 : 0);
      GlSubmission submission(width, height, fragments);
      const auto on_gpu = build(store, submission);
      const auto on_cpu = build(*cpu, Submission(fragments));
      ASSERT_EQ(on_gpu.has_value(), on_cpu.has_value())
          << (on_gpu ? on_cpu.error().message : on_gpu.error().message);
      if (!on_cpu) continue;
      ASSERT_EQ(store.bands(), 1);
      const auto words = store.table(0);
      ASSERT_EQ(words.size(), cpu->cells().size());
      ASSERT_TRUE(std::equal(words.begin(), words.end(), cpu->cells().begin()))
          << width << " x " << height << ", " << layers << " layers, seed " << seed;
      EXPECT_EQ(store.checksum(0), cpu->checksum());
    }
  }
}

template <class Record>
void expect_tables_of_the_cpu(const Info& info, const HashStoreOptions& options) {
  std::uint64_t seed = 100;
  for (const auto& [width, height] : kScreens) {
    expect_tables_of_the_cpu<Record>(info, options, width, height, ++seed);
    if (testing::Test::HasFailure()) return;
  }
}

TEST_F(GlHashTable, Of32BitsIsTheCpusBitForBit) {
  for (const auto offsets :
       {OffsetKind::kPlaneFirst, OffsetKind::kRandom, OffsetKind::kFarthestPoint}) {
    expect_tables_of_the_cpu<Record32>(context_->info(), {.record_bits = 32, .offsets = offsets});
  }
}

TEST_F(GlHashTable, Of64BitsInTwoPassesIsTheCpusBitForBit) {
  for (const auto offsets :
       {OffsetKind::kPlaneFirst, OffsetKind::kRandom, OffsetKind::kFarthestPoint}) {
    expect_tables_of_the_cpu<Record64>(context_->info(),
                                       {.path = WordPath::kTwoPass, .offsets = offsets});
  }
}

TEST_F(GlHashTable, Of64BitsWithAtomicsIsTheCpusBitForBit) {
  if (!context_->info().has_int64_atomics) GTEST_SKIP() << context_->info().int64_atomics_reason;
  for (const auto offsets :
       {OffsetKind::kPlaneFirst, OffsetKind::kRandom, OffsetKind::kFarthestPoint}) {
    expect_tables_of_the_cpu<Record64>(context_->info(),
                                       {.path = WordPath::kAtomic, .offsets = offsets});
  }
}

TEST_F(GlHashTable, Of64BitsWithAPlainMaximumIsTheCpusBitForBit) {
  // The text of the atomic path, where the driver has no such atomics.
  if (!context_->info().has_int64) GTEST_SKIP() << "no 64-bit integers";
  expect_tables_of_the_cpu<Record64>(context_->info(), {.path = WordPath::kAtomic, .serial = true});
}

TEST_F(GlHashTable, WithFewAgesAndLittleRoomIsTheCpusToo) {
  for (const unsigned ages : {3u, 12u, 40u}) {
    expect_tables_of_the_cpu<Record64>(
        context_->info(),
        {.path = WordPath::kTwoPass, .offsets = OffsetKind::kRandom, .age_limit = ages});
  }
}

TEST_F(GlHashTable, ALargeFrameIsTheCpusToo) {
  const int width = 201, height = 155;
  Random random(5);
  const auto fragments = random_fragments(random, width, height, 200000, 4000, 3);
  auto cpu = HashBuffer<Record64, Exclusive>::create(width, height, {.cells = 260000});
  ASSERT_TRUE(cpu);
  ASSERT_TRUE(build(*cpu, Submission(fragments)));
  auto store = HashStore::create(context_->info(), {.cells = 260000});
  ASSERT_TRUE(store);
  GlSubmission submission(width, height, fragments);
  ASSERT_TRUE(build(**store, submission));
  EXPECT_EQ((*store)->checksum(0), cpu->checksum());
}

TEST_F(GlHashTable, ABandIsTheTableOfItsRows) {
  const int width = 23, height = 41;
  Random random(6);
  const auto fragments = random_fragments(random, width, height, 4000, 90, 4);
  for (const int bits : {32, 64}) {
    auto made = HashStore::create(context_->info(), {.record_bits = bits,
                                                     .path = WordPath::kAuto,
                                                     .offsets = OffsetKind::kRandom,
                                                     .binding_bytes = 5000});
    ASSERT_TRUE(made);
    HashStore& store = **made;
    GlSubmission submission(width, height, fragments);
    const auto report = build(store, submission);
    ASSERT_TRUE(report) << report.error().message;
    ASSERT_GT(store.bands(), 3);
    for (int band = 0; band < store.bands(); ++band) {
      const PixelRows rows = store.band_rows(band);
      std::vector<Fragment> own;
      for (Fragment f : fragments) {
        if (f.y < static_cast<int>(rows.begin) || f.y >= static_cast<int>(rows.end)) continue;
        f.y -= static_cast<int>(rows.begin);
        own.push_back(f);
      }
      const auto words = store.table(band);
      const auto expect_equal = [&](auto cpu) {
        ASSERT_TRUE(cpu);
        ASSERT_TRUE(build(*cpu, Submission(own)));
        EXPECT_TRUE(
            std::equal(words.begin(), words.end(), cpu->cells().begin(), cpu->cells().end()))
            << "band " << band << ", " << bits << " bits";
      };
      const HashBufferOptions options{.cells = words.size(), .offsets = OffsetKind::kRandom};
      const auto own_rows = static_cast<int>(rows.end - rows.begin);
      if (bits == 32) {
        expect_equal(HashBuffer<Record32, Exclusive>::create(width, own_rows, options));
      } else {
        expect_equal(HashBuffer<Record64, Exclusive>::create(width, own_rows, options));
      }
    }
  }
}

TEST_F(GlHashTable, AScreenLargerThanABindingIsCutIntoBands) {
  const std::uint64_t limit = context_->info().limits.storage_block_bytes;
  if (limit > 1u << 28) GTEST_SKIP() << "this driver binds " << limit << " bytes";
  // One cell a pixel, and a row more than a binding holds.
  const int width = 4096, height = static_cast<int>(limit / 4 / 4096) + 1;
  auto store = HashStore::create(context_->info(), {.record_bits = 32});
  ASSERT_TRUE(store);
  const std::vector<Fragment> fragments{{5, 0, 9, 0}, {7, height - 1, 3, 0}, {7, height - 1, 2, 0}};
  GlSubmission submission(width, height, fragments);
  const auto report = build(**store, submission);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ((*store)->bands(), 2);
  EXPECT_EQ((*store)->cells(), static_cast<std::uint64_t>(width) * height);
  const auto last = (*store)->table(1);
  EXPECT_EQ(std::count(last.begin(), last.end(), 0u), static_cast<std::ptrdiff_t>(last.size()) - 2);
}

TEST_F(GlHashTable, TheSecondPassCountsStrangers) {
  /// Gives one fragment more in its second pass.
  class Fickle : public GlSubmission {
   public:
    using GlSubmission::GlSubmission;
    Result<void> draw(const StoreGlsl& store, PixelRows rows) override {
      if (++passes_ == 2) set({{1, 1, 5, 1}, {2, 2, 9, 9}});
      return GlSubmission::draw(store, rows);
    }

   private:
    int passes_ = 0;
  };
  auto store = HashStore::create(context_->info(), {.path = WordPath::kTwoPass});
  ASSERT_TRUE(store);
  Fickle fickle(4, 4, {{1, 1, 5, 1}});
  const auto report = build(**store, fickle);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::kInternal);
  EXPECT_NE(report.error().message.find("1 fragments of the second pass"), std::string::npos);
}

}  // namespace
}  // namespace strata::gl
