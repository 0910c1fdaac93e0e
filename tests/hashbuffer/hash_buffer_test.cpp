// What holds for the hash buffer beyond the laws of every store: the table itself, the errata of
// the paper (techniques.md, section 10), overflow, resizing.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "strata/hashbuffer/hash_buffer.h"
#include "tests/hashbuffer/store_support.h"

namespace strata {
namespace {

using test::Fragment;
using test::random_fragments;
using test::sort_everything;
using test::Submission;
using test::submit;

template <class Record, class Form = Exclusive>
HashBuffer<Record, Form> make(int width, int height, const HashBufferOptions& options = {}) {
  auto buffer = HashBuffer<Record, Form>::create(width, height, options);
  if (!buffer) throw std::runtime_error(buffer.error().message);
  return std::move(*buffer);
}

template <class Buffer>
LayeredDepthImage lists(const Buffer& buffer) {
  return buffer.depth_image(Execution{.threads = 1}).value();
}

constexpr OffsetKind kKinds[] = {OffsetKind::kRandom, OffsetKind::kFarthestPoint,
                                 OffsetKind::kPlaneFirst};

template <class Record>
class HashBufferTable : public testing::Test {};
using Records = testing::Types<Record32, Record64, Record64Deep>;
TYPED_TEST_SUITE(HashBufferTable, Records);

TYPED_TEST(HashBufferTable, IsBitIdenticalForEveryOrderFormAndThreadCount) {
  Random random(21);
  for (const OffsetKind kind : kKinds) {
    for (const double load : {0.3, 0.6, 0.8, 0.95, 1.0, 1.3}) {
      for (const unsigned age_limit : {0u, 4u}) {
        const HashBufferOptions options{.cells = 700, .offsets = kind, .age_limit = age_limit};
        auto fragments =
            random_fragments(random, 23, 11, static_cast<std::size_t>(load * 700), 40, 3);
        auto exclusive = make<TypeParam>(23, 11, options);
        submit(exclusive, fragments);
        exclusive.tighten_max_ages();
        for (const int threads : {1, 2, 3, 8}) {
          test::shuffle(random, fragments);
          auto concurrent = make<TypeParam, Concurrent>(23, 11, options);
          submit(concurrent, fragments, threads);
          EXPECT_EQ(concurrent.checksum(), exclusive.checksum());
          EXPECT_TRUE(std::equal(exclusive.cells().begin(), exclusive.cells().end(),
                                 concurrent.cells().begin()));
          EXPECT_EQ(concurrent.failures(), exclusive.failures());
          if (concurrent.failures() > 0) concurrent.tighten_max_ages();
          EXPECT_TRUE(std::equal(exclusive.max_ages().begin(), exclusive.max_ages().end(),
                                 concurrent.max_ages().begin()));
        }
      }
    }
  }
}

TYPED_TEST(HashBufferTable, LoadsUpTo99PercentHoldEverything) {
  Random random(22);
  for (const OffsetKind kind : kKinds) {
    for (const int percent : {50, 60, 70, 80, 90, 95, 99}) {
      // 2500 cells are no power of two; 40 x 25 pixels are not square.
      auto buffer = make<TypeParam>(40, 25, {.cells = 2500, .offsets = kind});
      const auto fragments =
          random_fragments(random, 40, 25, static_cast<std::size_t>(percent) * 25);
      submit(buffer, fragments);
      EXPECT_EQ(buffer.failures(), 0u) << percent;
      EXPECT_EQ(buffer.stored(), fragments.size());
      EXPECT_EQ(buffer.load(), percent / 100.0);
      EXPECT_EQ(lists(buffer), sort_everything<TypeParam>(40, 25, fragments)) << percent;
    }
  }
}

TYPED_TEST(HashBufferTable, OverFullItCountsWhatDoesNotFitAndListsHaveIt) {
  Random random(23);
  for (int scene = 0; scene < 600; ++scene) {
    const int width = 1 + static_cast<int>(random.below(9));
    const int height = 1 + static_cast<int>(random.below(6));
    const auto pixels = static_cast<std::uint64_t>(width * height);
    const std::uint64_t cells = pixels + random.below(pixels + 1);
    const std::size_t count = cells / 2 + random.below(2 * cells);
    const HashBufferOptions options{.cells = cells,
                                    .offsets = kKinds[scene % 3],
                                    .age_limit = static_cast<unsigned>(random.below(12))};
    auto buffer = make<TypeParam, Concurrent>(width, height, options);
    const auto fragments = random_fragments(random, width, height, count, 9, 2);
    submit(buffer, fragments, scene % 4 == 0 ? 3 : 1);
    EXPECT_EQ(buffer.stored() + buffer.failures(), count);
    const LayeredDepthImage exact = sort_everything<TypeParam>(width, height, fragments);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const auto list = exact.list(x, y);
        std::size_t kept = 0;
        buffer.for_each(x, y, [&](DepthItem item) {
          ASSERT_LT(kept, list.size());
          EXPECT_EQ(item, list[kept++]) << "scene " << scene;
        });
        EXPECT_EQ(kept, list.size());
      }
    }
  }
}

TYPED_TEST(HashBufferTable, NumberOfProbesIsTheSumOfAges) {
  // So it depends on nothing but the fragments. Counted by stepping.
  Random random(24);
  auto fragments = random_fragments(random, 16, 16, 900, 100);
  for (int round = 0; round < 3; ++round) {
    auto buffer = make<TypeParam>(16, 16, {.cells = 1200, .offsets = OffsetKind::kRandom});
    std::uint64_t probes = 0;
    for (const Fragment& f : fragments) {
      typename HashBuffer<TypeParam, Exclusive>::Insertion insertion(buffer, f.x, f.y, f.depth,
                                                                     f.payload);
      do ++probes;
      while (insertion.template step<false>());
    }
    std::uint64_t ages = 0;
    for (const auto word : buffer.cells()) ages += TypeParam::age(word);
    EXPECT_EQ(probes, ages);
    test::shuffle(random, fragments);
  }
}

TYPED_TEST(HashBufferTable, TraversalWithoutTheMaxAgeTableGivesTheSameLists) {
  Random random(25);
  auto buffer = make<TypeParam>(30, 20, {.cells = 1000});
  const auto fragments = random_fragments(random, 30, 20, 850);
  submit(buffer, fragments);
  const auto offsets = buffer.offsets();
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 30; ++x) {
      std::vector<DepthItem> walked, visited;
      for (unsigned age = 1; age <= buffer.age_limit(); ++age) {
        const auto word = buffer.cells()[(static_cast<unsigned>(y * 30 + x) + offsets[age]) % 1000];
        if (TypeParam::age(word) < age) break;
        if (TypeParam::age(word) == age) walked.push_back(TypeParam::item(word));
      }
      buffer.for_each(x, y, [&](DepthItem item) { visited.push_back(item); });
      EXPECT_EQ(visited, walked);
    }
  }
}

// ---- Errata -----------------------------------------------------------------------------------

// E1: the printed insertion stops when the cell holds the record itself, so of two surfaces at one
// depth one vanishes.
TYPED_TEST(HashBufferTable, E1EqualRecordsAreTwoFragments) {
  auto buffer = make<TypeParam, Concurrent>(3, 3);
  for (int copy = 0; copy < 5; ++copy) test::insert_into(buffer, {1, 1, 42, 7});
  EXPECT_EQ(buffer.stored(), 5u);
  EXPECT_EQ(lists(buffer).list(1, 1).size(), 5u);
}

// E2: the printed traversal never visits the largest age, shows nothing where it is 1, and runs
// away where it is 0.
TYPED_TEST(HashBufferTable, E2TraversalVisitsTheLargestAgeOfABlock) {
  for (unsigned layers = 0; layers <= 3; ++layers) {
    auto buffer = make<TypeParam>(8, 8, {.cells = 1000});
    for (unsigned layer = 0; layer < layers; ++layer) test::insert_into(buffer, {5, 5, layer, 0});
    EXPECT_EQ(buffer.max_ages()[0], layers);
    EXPECT_EQ(lists(buffer).list(5, 5).size(), layers);
  }
}

// E4: the printed loops never end on a full table and let the age overflow, or lose fragments
// silently.
TYPED_TEST(HashBufferTable, E4AFullTableEndsTheLoopAndCountsTheFailure) {
  for (const OffsetKind kind : kKinds) {
    auto buffer = make<TypeParam, Concurrent>(2, 2, {.cells = 4, .offsets = kind});
    for (std::uint32_t i = 0; i < 3000; ++i) test::insert_into(buffer, {0, 0, i * 7919 % 3000, 0});
    EXPECT_EQ(buffer.stored() + buffer.failures(), 3000u);
    EXPECT_LE(buffer.stored(), 4u);
    // Deeper than any age: in the table as many as the age field counts, the nearest ones.
    auto deep = make<TypeParam, Concurrent>(1, 1, {.cells = 5000, .offsets = kind});
    for (std::uint32_t i = 0; i < 3000; ++i) test::insert_into(deep, {0, 0, i * 7919 % 3000, 0});
    EXPECT_EQ(deep.stored(), TypeParam::kAgeMax);
    EXPECT_EQ(deep.failures(), 3000u - TypeParam::kAgeMax);
    std::uint32_t next = 0;
    deep.for_each(0, 0, [&](DepthItem item) { EXPECT_EQ(item.depth(), next++); });
    EXPECT_EQ(next, 3000u);
    const auto furthest = *std::ranges::max_element(deep.cells(), {}, [](auto word) {
      return TypeParam::age(word) == 0 ? 0 : TypeParam::depth(word);
    });
    EXPECT_EQ(TypeParam::depth(furthest), TypeParam::kAgeMax - 1);
  }
}

// E5 is tests/hashbuffer/record_test.cpp, E5DepthNeverRunsIntoTheAge; here through the table.
TYPED_TEST(HashBufferTable, E5TheNearestDepthStaysInItsField) {
  auto buffer = make<TypeParam>(4, 4);
  test::insert_into(buffer, {0, 0, record_depth(0.0), 0});
  test::insert_into(buffer, {0, 0, record_depth(1.0), 0});
  test::insert_into(buffer, {0, 0, 0xffffffffu, 0});
  const auto image = lists(buffer);
  ASSERT_EQ(image.list(0, 0).size(), 3u);
  EXPECT_EQ(image.list(0, 0)[0].depth(), 0u);
  EXPECT_EQ(image.list(0, 0)[2].depth(), (1u << 24) - 1);
}

// E8: the max-age table is addressed in three ways in print. Here: block (x / 8, y / 8), ceil(W /
// 8) blocks a row.
TYPED_TEST(HashBufferTable, E8MaxAgeBlocksAre8x8WithRoundedUpRows) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {17, 9}, {24, 16}, {9, 100}}) {
    const int columns = (width + 7) / 8, rows = (height + 7) / 8;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        auto buffer = make<TypeParam>(width, height, {.cells = 5000});
        ASSERT_EQ(buffer.max_ages().size(), static_cast<std::size_t>(columns * rows));
        test::insert_into(buffer, {x, y, 1, 1});
        test::insert_into(buffer, {x, y, 2, 2});
        for (int block = 0; block < columns * rows; ++block) {
          EXPECT_EQ(buffer.max_ages()[static_cast<std::size_t>(block)],
                    block == y / 8 * columns + x / 8 ? 2 : 0);
        }
      }
    }
  }
}

// E15: printed wrap arithmetic, (l - offset) % H with unsigned l, is right only where H divides
// 2^32: 8 % of evictions get a wrong column at H = 1280, 5.8 % at 1450, 4.5 % at 1600.
TYPED_TEST(HashBufferTable, E15EvictedRecordsGoBackToTheirOwnPixelAtAnyTableSize) {
  Random random(26);
  for (const std::uint64_t cells : {1280u, 1450u, 1600u, 1021u, 1024u, 1023u, 1025u, 2000u}) {
    auto buffer = make<TypeParam>(50, 20, {.cells = cells, .offsets = OffsetKind::kRandom});
    const auto fragments = random_fragments(random, 50, 20, cells * 9 / 10);
    submit(buffer, fragments);
    ASSERT_EQ(buffer.failures(), 0u);
    EXPECT_EQ(lists(buffer), sort_everything<TypeParam>(50, 20, fragments)) << cells;
  }
}

// E16: a table smaller than the screen cannot tell pixels apart by age.
TYPED_TEST(HashBufferTable, E16TheTableIsNeverSmallerThanTheScreen) {
  auto buffer = make<TypeParam>(31, 17, {.cells = 5});
  EXPECT_EQ(buffer.cells().size(), 31u * 17u);
  ASSERT_TRUE(buffer.resize(1));
  EXPECT_EQ(buffer.cells().size(), 31u * 17u);
  const std::vector<Fragment> none;
  for (int frame = 0; frame < 3; ++frame) {
    ASSERT_TRUE(build(buffer, Submission(none)));
    EXPECT_EQ(buffer.cells().size(), 31u * 17u);
  }
}

// E17: the age field must hold the scene's layers; where it does not, the error names the split.
TEST(HashBuffer, E17TooManyLayersNameTheSplitThatHoldsThem) {
  std::vector<Fragment> fragments;
  for (std::uint32_t i = 0; i < 590; ++i) fragments.push_back({3, 1, i, 0});
  auto shallow = make<Record64>(5, 5);
  const auto report = build(shallow, Submission(fragments));
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::kLimit);
  EXPECT_EQ(
      report.error().message,
      "hash buffer: pixel (3, 1) has 590 fragments, but Record64 [age:8|nearness:24|payload:32] "
      "counts at most 255; use Record64Deep [age:10|nearness:24|payload:30]");
  auto deep = make<Record64Deep>(5, 5);
  ASSERT_TRUE(build(deep, Submission(fragments)));
  EXPECT_EQ(lists(deep), sort_everything<Record64Deep>(5, 5, fragments));
}

// ---- Frames -----------------------------------------------------------------------------------

TEST(HashBuffer, ClearCountsWhatTheFrameStored) {
  Random random(27);
  auto buffer = make<Record64>(10, 10, {.cells = 300});
  submit(buffer, random_fragments(random, 10, 10, 123));
  EXPECT_EQ(buffer.clear(), 123u);
  EXPECT_EQ(buffer.clear(), 0u);
  EXPECT_EQ(buffer.stored(), 0u);
}

TEST(HashBuffer, AFrameThatWasCountedFirstHasTheBitsOfAFreshTable) {
  Random random(28);
  for (const OffsetKind kind : kKinds) {
    const auto fragments = random_fragments(random, 20, 15, 3000, 500);
    auto buffer = make<Record64, Concurrent>(20, 15, {.offsets = kind});
    const auto report = build(buffer, Submission(fragments, 2));
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->generator_calls, 2);
    EXPECT_EQ(report->fragments, 3000u);
    EXPECT_LT(buffer.load(), 0.8);
    auto fresh = make<Record64>(20, 15, {.cells = buffer.cells().size(), .offsets = kind});
    ASSERT_TRUE(build(fresh, Submission(fragments)));
    EXPECT_EQ(buffer.checksum(), fresh.checksum());
    EXPECT_EQ(lists(buffer), sort_everything<Record64>(20, 15, fragments));
  }
}

// What a first user writes: a screen, twelve layers, the lists. One in twelve fragments was there.
TYPED_TEST(HashBufferTable, InsertLosesNothingWhateverTheRoom) {
  Random random(35);
  const auto fragments = random_fragments(random, 64, 64, std::size_t{12} * 64 * 64);
  const LayeredDepthImage exact = sort_everything<TypeParam>(64, 64, fragments);
  for (const int threads : {1, 4}) {
    auto buffer = make<TypeParam, Concurrent>(64, 64);
    submit(buffer, fragments, threads);
    EXPECT_EQ(lists(buffer), exact);
    EXPECT_GT(buffer.failures(), fragments.size() / 2);
    // More of them, after lists were read.
    test::insert_into(buffer, {3, 5, 77, 1});
    test::insert_into(buffer, {3, 5, 0, 1});
    EXPECT_EQ(lists(buffer).items.size(), fragments.size() + 2);
    std::vector<DepthItem> list;
    buffer.for_each(3, 5, [&](DepthItem item) { list.push_back(item); });
    EXPECT_TRUE(std::ranges::is_sorted(list));
    EXPECT_EQ(list.size(), exact.list(3, 5).size() + 2);
    // A visitor that has seen enough is asked no more.
    int seen = 0;
    buffer.for_each(3, 5, [&](DepthItem) { return ++seen < 4; });
    EXPECT_EQ(seen, 4);
    // The next frame has the room from the start, and is empty.
    ASSERT_TRUE(buffer.begin_frame());
    EXPECT_EQ(buffer.failures(), 0u);
    EXPECT_TRUE(lists(buffer).items.empty());
    submit(buffer, fragments, threads);
    EXPECT_EQ(buffer.failures(), 0u);
    EXPECT_EQ(lists(buffer), exact);
  }
}

TEST(HashBuffer, TheGeneratorRunsTwiceForTheFirstFrameAndOnceForTheNext) {
  Random random(36);
  const auto fragments = random_fragments(random, 64, 64, std::size_t{12} * 64 * 64);
  const auto passes = [&](HashBuffer<Record64, Exclusive>& buffer) {
    int calls = 0;
    const auto report = build(buffer, [&](auto& sink) {
      ++calls;
      submit(sink, fragments);
    });
    EXPECT_EQ(report.value().generator_calls, calls);
    EXPECT_EQ(report->fragments, fragments.size());
    EXPECT_LT(buffer.load(), 0.8);
    return calls;
  };
  auto buffer = make<Record64>(64, 64);
  EXPECT_EQ(passes(buffer), 2);
  EXPECT_EQ(passes(buffer), 1);
  auto sized = make<Record64>(64, 64, {.cells = fragments.size() * 5 / 4 + 1});
  EXPECT_EQ(passes(sized), 1);
  // Not enough: once more, with room for all.
  auto small = make<Record64>(64, 64, {.cells = fragments.size() / 2});
  EXPECT_EQ(passes(small), 2);
}

TEST(HashBuffer, AFrameBuiltKeepsWhatIsInsertedLater) {
  auto buffer = make<Record64>(2, 2);
  const std::vector<Fragment> some{{0, 0, 5, 1}, {0, 0, 9, 1}};
  ASSERT_TRUE(build(buffer, Submission(some)));
  for (std::uint32_t i = 0; i < 100; ++i) test::insert_into(buffer, {0, 0, 10 + i, 1});
  EXPECT_EQ(lists(buffer).list(0, 0).size(), 102u);
  ASSERT_TRUE(build(buffer, Submission(some)));
  EXPECT_EQ(lists(buffer).list(0, 0).size(), 2u);
}

TEST(HashBuffer, ConstantFragmentsSettleAfterOneResize) {
  Random random(29);
  for (const std::size_t count : {10u, 400u, 500u, 700u, 850u, 1200u}) {
    const auto fragments = random_fragments(random, 16, 16, count);
    auto buffer = make<Record64>(16, 16, {.cells = 1000});
    std::set<std::size_t> sizes;
    for (int frame = 0; frame < 6; ++frame) {
      ASSERT_TRUE(build(buffer, Submission(fragments)));
      if (frame > 0) sizes.insert(buffer.cells().size());
    }
    EXPECT_EQ(sizes.size(), 1u) << count;
    EXPECT_LT(buffer.load(), 0.8);
    if (buffer.cells().size() > 256) {
      EXPECT_GE(buffer.load(), 0.3);
    }
  }
}

TEST(HashBuffer, OffsetsAreDrawnAnewForEachFrameButReproducibly) {
  const std::vector<Fragment> none;
  const auto draw = [&](OffsetKind kind, std::uint64_t seed, int frames) {
    auto buffer = make<Record64>(16, 16, {.offsets = kind, .seed = seed});
    for (int frame = 0; frame < frames; ++frame) EXPECT_TRUE(build(buffer, Submission(none)));
    return std::vector<std::uint64_t>(buffer.offsets().begin(), buffer.offsets().end());
  };
  EXPECT_EQ(draw(OffsetKind::kRandom, 1, 2), draw(OffsetKind::kRandom, 1, 2));
  EXPECT_NE(draw(OffsetKind::kRandom, 1, 2), draw(OffsetKind::kRandom, 1, 3));
  EXPECT_NE(draw(OffsetKind::kRandom, 1, 2), draw(OffsetKind::kRandom, 2, 2));
  EXPECT_EQ(draw(OffsetKind::kFarthestPoint, 1, 2), draw(OffsetKind::kFarthestPoint, 1, 3));
}

TEST(HashBuffer, AsManyLayersAsAgesInEveryPixelAreReached) {
  // No age to spare: random offsets would need a table of hopeless size, planes do not.
  Random random(30);
  std::vector<Fragment> fragments;
  for (int pixel = 0; pixel < 24; ++pixel) {
    for (std::uint32_t i = 0; i < 255; ++i) {
      fragments.push_back({pixel % 6, pixel / 6, static_cast<std::uint32_t>(random.below(999)), i});
    }
  }
  for (const OffsetKind kind : kKinds) {
    auto buffer = make<Record64>(6, 4, {.offsets = kind});
    const auto report = build(buffer, Submission(fragments));
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_LE(buffer.cells().size(), 255u * 24u * 16u);
    EXPECT_EQ(lists(buffer), sort_everything<Record64>(6, 4, fragments));
  }
}

TEST(HashBuffer, AMemoryLimitBelowTheScreenIsAnErrorWithNumbers) {
  auto buffer = make<Record64>(100, 100);
  const std::vector<Fragment> none;
  const auto report = build(buffer, Submission(none), Execution{.memory_limit = 50000});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::kLimit);
  EXPECT_NE(report.error().message.find("100 x 100"), std::string::npos);
  EXPECT_NE(report.error().message.find("50000"), std::string::npos);
}

TEST(HashBuffer, GrowsUpToTheLastByteOfTheMemoryLimit) {
  Random random(31);
  const auto fragments = random_fragments(random, 32, 32, 4000);
  auto roomy = make<Record64>(32, 32);
  // 4000 fragments in 4100 cells: a load of 98 % that no rule would choose, but the limit does.
  const std::uint64_t limit = roomy.bytes_of(4100);
  auto buffer = make<Record64>(32, 32);
  const auto report = build(buffer, Submission(fragments), Execution{.memory_limit = limit});
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(buffer.cells().size(), 4100u);
  EXPECT_EQ(lists(buffer), sort_everything<Record64>(32, 32, fragments));
}

TEST(HashBuffer, AFailedAllocationIsAnErrorAndTheBufferStaysUsable) {
  auto buffer = make<Record64>(4, 4);
  std::vector<std::uint64_t> sizes{1ull << 60, ~0ull};
  // The sanitizers' allocators end the program instead of throwing.
  if (!testkit::kSanitized) sizes.push_back(1ull << 44);
  for (const std::uint64_t cells : sizes) {
    const auto resized = buffer.resize(cells);
    ASSERT_FALSE(resized);
    EXPECT_EQ(resized.error().code, ErrorCode::kLimit);
  }
  test::insert_into(buffer, {1, 2, 3, 4});
  EXPECT_EQ(buffer.cells().size(), 16u);
  EXPECT_EQ(lists(buffer).list(1, 2).size(), 1u);
  EXPECT_FALSE((HashBuffer<Record64, Exclusive>::create(1 << 30, 1 << 30)));
}

TEST(HashBuffer, DepthImageStopsOnRequest) {
  auto buffer = make<Record64>(4, 4);
  std::stop_source stop;
  stop.request_stop();
  const auto image = buffer.depth_image(Execution{.threads = 1, .stop = stop.get_token()});
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace strata
