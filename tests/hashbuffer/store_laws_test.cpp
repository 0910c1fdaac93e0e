// The laws of every store: each is run over every store, form, record and kind of offsets, and over
// 1 to 8 threads where the form allows it.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "hashbuffer/count_scan_store.h"
#include "hashbuffer/hash_buffer_build.h"
#include "tests/hashbuffer/store_support.h"

namespace strata {
namespace {

using test::Fragment;
using test::random_fragments;
using test::sort_everything;
using test::Submission;

template <class R, class Form, OffsetKind kind>
struct Ha {
  using Store = HashBuffer<R, Form>;
  static constexpr std::uint64_t kLongestList = R::kAgeMax;
  static Result<Store> create(int width, int height) {
    return Store::create(width, height, {.offsets = kind, .seed = 77});
  }
};

template <class R, class Form>
struct Scan {
  using Store = CountScanStore<R, Form>;
  static constexpr std::uint64_t kLongestList = ~0ull;
  static Result<Store> create(int width, int height) { return Store::create(width, height); }
};

template <class R, class Form>
using HaRandom = Ha<R, Form, OffsetKind::kRandom>;
template <class R, class Form>
using HaFarthest = Ha<R, Form, OffsetKind::kFarthestPoint>;
template <class R, class Form>
using HaPlanes = Ha<R, Form, OffsetKind::kPlaneFirst>;

template <class C>
class StoreLaws : public testing::Test {
 public:
  using Store = typename C::Store;
  using Record = typename Store::Record;
  static_assert(DepthListStore<Store>);
  static constexpr auto kThreadCounts = [] {
    if constexpr (Store::kAnyThread) {
      return std::array{1, 2, 3, 4, 8};
    } else {
      return std::array{1};
    }
  }();

  static Store make(int width, int height) {
    auto store = C::create(width, height);
    if (!store) throw std::runtime_error(store.error().message);
    return std::move(*store);
  }

  /// Builds the frame and compares its lists with the oracle's.
  static void expect_exact(Store& store, const std::vector<Fragment>& fragments, int threads = 1) {
    const auto report = build(store, Submission(fragments, threads));
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->fragments, fragments.size());
    const auto image = store.depth_image(Execution{.threads = threads});
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(*image, sort_everything<Record>(store.width(), store.height(), fragments));
  }
};

// A new store joins with one line.
using Stores =
    testing::Types<HaRandom<Record32, Concurrent>, HaRandom<Record32, Exclusive>,              //
                   HaRandom<Record64, Concurrent>, HaRandom<Record64, Exclusive>,              //
                   HaRandom<Record64Deep, Concurrent>, HaRandom<Record64Deep, Exclusive>,      //
                   HaFarthest<Record32, Concurrent>, HaFarthest<Record32, Exclusive>,          //
                   HaFarthest<Record64, Concurrent>, HaFarthest<Record64, Exclusive>,          //
                   HaFarthest<Record64Deep, Concurrent>, HaFarthest<Record64Deep, Exclusive>,  //
                   HaPlanes<Record32, Concurrent>, HaPlanes<Record32, Exclusive>,              //
                   HaPlanes<Record64, Concurrent>, HaPlanes<Record64, Exclusive>,              //
                   HaPlanes<Record64Deep, Concurrent>, HaPlanes<Record64Deep, Exclusive>,      //
                   Scan<Record32, Concurrent>, Scan<Record32, Exclusive>,                      //
                   Scan<Record64, Concurrent>, Scan<Record64, Exclusive>,                      //
                   Scan<Record64Deep, Concurrent>, Scan<Record64Deep, Exclusive>>;
TYPED_TEST_SUITE(StoreLaws, Stores);

constexpr struct {
  int width, height;
} kScreens[] = {{1, 1}, {7, 3}, {3, 7}, {8, 8}, {9, 1}, {1, 17}, {13, 9}, {17, 16}, {31, 33}};

TYPED_TEST(StoreLaws, ListsEqualTheSortOfEverything) {
  Random random(11);
  for (const auto& [width, height] : kScreens) {
    for (const double layers : {0.2, 1.0, 3.0, 9.0}) {
      const auto count = static_cast<std::size_t>(layers * width * height);
      for (const std::uint32_t depths : {1u << 24, 5u}) {
        auto store = TestFixture::make(width, height);
        TestFixture::expect_exact(store, random_fragments(random, width, height, count, depths));
        if (testing::Test::HasFailure()) FAIL() << width << " x " << height << ", " << count;
      }
    }
  }
}

TYPED_TEST(StoreLaws, ListsOfAThousandSmallScenesAreExact) {
  Random random(12);
  for (int scene = 0; scene < (test::kSanitized ? 100 : 1000); ++scene) {
    const int width = 1 + static_cast<int>(random.below(5));
    const int height = 1 + static_cast<int>(random.below(4));
    auto store = TestFixture::make(width, height);
    TestFixture::expect_exact(store,
                              random_fragments(random, width, height, random.below(40), 3, 2));
    if (testing::Test::HasFailure()) FAIL() << "scene " << scene;
  }
}

TYPED_TEST(StoreLaws, ListsDoNotDependOnInsertionOrder) {
  Random random(13);
  auto fragments = random_fragments(random, 13, 9, 600, 50);
  auto store = TestFixture::make(13, 9);
  for (int round = 0; round < 4; ++round) {
    test::shuffle(random, fragments);
    TestFixture::expect_exact(store, fragments);
  }
  std::stable_sort(fragments.begin(), fragments.end(),
                   [](const Fragment& a, const Fragment& b) { return a.depth < b.depth; });
  TestFixture::expect_exact(store, fragments);
  std::reverse(fragments.begin(), fragments.end());
  TestFixture::expect_exact(store, fragments);
}

TYPED_TEST(StoreLaws, ListsDoNotDependOnThreads) {
  Random random(14);
  for (const int threads : TestFixture::kThreadCounts) {
    for (int round = 0; round < 3; ++round) {
      const auto fragments = random_fragments(random, 21, 10, 2000, 300);
      auto store = TestFixture::make(21, 10);
      TestFixture::expect_exact(store, fragments, threads);
    }
  }
}

TYPED_TEST(StoreLaws, ContendedPixelsKeepEverything) {
  Random random(15);
  for (const int threads : TestFixture::kThreadCounts) {
    auto store = TestFixture::make(2, 2);
    TestFixture::expect_exact(store, random_fragments(random, 2, 2, 700, 4, 2), threads);
  }
}

TYPED_TEST(StoreLaws, EqualFragmentsAreAllKept) {
  for (const int threads : TestFixture::kThreadCounts) {
    std::vector<Fragment> fragments;
    for (int copy = 0; copy < 50; ++copy) {
      for (int x = 0; x < 5; ++x) fragments.push_back({x, x % 2, 1000, 7});
    }
    auto store = TestFixture::make(5, 2);
    TestFixture::expect_exact(store, fragments, threads);
  }
}

TYPED_TEST(StoreLaws, ACoplanarFrontAndBackKeepsParityEven) {
  // A plate without thickness, drawn twice.
  std::vector<Fragment> fragments;
  for (int copy = 0; copy < 2; ++copy) {
    for (int pixel = 0; pixel < 12 * 11; ++pixel) {
      for (const bool exit : {false, true}) {
        fragments.push_back({pixel % 12, pixel / 12, 5000, DepthItem(0, exit, 3).payload()});
      }
    }
  }
  auto store = TestFixture::make(12, 11);
  TestFixture::expect_exact(store, fragments);
  for (int pixel = 0; pixel < 12 * 11; ++pixel) {
    int crossings = 0;
    store.for_each(pixel % 12, pixel / 12, [&](DepthItem) { ++crossings; });
    EXPECT_EQ(crossings, 4);
  }
}

TYPED_TEST(StoreLaws, DepthsAtBothEndsAndOneStepApart) {
  constexpr std::uint32_t kFar = (1u << 24) - 1;
  std::vector<Fragment> fragments;
  for (int pixel = 0; pixel < 7 * 3; ++pixel) {
    for (const std::uint32_t depth : {kFar, 0u, kFar - 1, 1u, 0u, kFar, 1u << 23, (1u << 23) - 1}) {
      fragments.push_back({pixel % 7, pixel / 7, depth, 0});
      fragments.push_back({pixel % 7, pixel / 7, depth, test::kCommonPayload});
    }
  }
  auto store = TestFixture::make(7, 3);
  TestFixture::expect_exact(store, fragments);
}

TYPED_TEST(StoreLaws, LongListsAreExactOrEndInAnErrorThatNamesThePixel) {
  Random random(16);
  for (const std::size_t layers : {255u, 300u, 600u, 1023u, 1100u}) {
    auto fragments = random_fragments(random, 6, 5, 60);
    for (std::size_t i = 0; i < layers; ++i) {
      fragments.push_back({4, 2, static_cast<std::uint32_t>(random.below(1u << 24)), 1});
    }
    const auto in_pixel = static_cast<std::uint64_t>(
        std::count_if(fragments.begin(), fragments.end(),
                      [](const Fragment& f) { return f.x == 4 && f.y == 2; }));
    auto store = TestFixture::make(6, 5);
    if (in_pixel <= TypeParam::kLongestList) {
      TestFixture::expect_exact(store, fragments);
      continue;
    }
    const auto report = build(store, Submission(fragments));
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().code, ErrorCode::kLimit);
    EXPECT_NE(report.error().message.find("pixel (4, 2) has " + std::to_string(in_pixel)),
              std::string::npos)
        << report.error().message;
  }
}

TYPED_TEST(StoreLaws, TheMemoryLimitIsKeptAndTheErrorCountsWhatIsMissing) {
  Random random(17);
  const auto fragments = random_fragments(random, 10, 10, 3000);
  std::uint64_t enough = 0;
  {
    auto store = TestFixture::make(10, 10);
    const auto report = build(store, Submission(fragments));
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->memory_bytes, store.memory_bytes());
    enough = report->memory_bytes;
  }
  {
    auto store = TestFixture::make(10, 10);
    const auto report = build(store, Submission(fragments), Execution{.memory_limit = enough});
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_LE(store.memory_bytes(), enough);
  }
  auto store = TestFixture::make(10, 10);
  const std::uint64_t too_little = enough / 3;
  const auto report = build(store, Submission(fragments), Execution{.memory_limit = too_little});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::kLimit);
  EXPECT_NE(report.error().message.find(" of 3000 fragments"), std::string::npos)
      << report.error().message;
  EXPECT_LE(store.memory_bytes(), too_little);
  // The store is not broken by it.
  TestFixture::expect_exact(store, fragments);
}

TYPED_TEST(StoreLaws, EachFrameReplacesTheLast) {
  Random random(18);
  auto store = TestFixture::make(19, 6);
  for (const std::size_t count : {500u, 0u, 20u, 2000u, 1u, 100u}) {
    TestFixture::expect_exact(store, random_fragments(random, 19, 6, count));
  }
}

TYPED_TEST(StoreLaws, AVisitorMayStopEarly) {
  auto store = TestFixture::make(1, 1);
  TestFixture::expect_exact(store, {{0, 0, 3, 0}, {0, 0, 1, 0}, {0, 0, 2, 0}});
  std::vector<std::uint32_t> seen;
  store.for_each(0, 0, [&](DepthItem item) {
    seen.push_back(item.depth());
    return seen.size() < 2;
  });
  EXPECT_EQ(seen, (std::vector<std::uint32_t>{1, 2}));
}

TYPED_TEST(StoreLaws, AStoppedBuildSaysSo) {
  std::stop_source stop;
  stop.request_stop();
  auto store = TestFixture::make(3, 3);
  const std::vector<Fragment> fragments{{1, 1, 5, 5}};
  const auto report = build(store, Submission(fragments), Execution{.stop = stop.get_token()});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::kCancelled);
}

TYPED_TEST(StoreLaws, AScreenWithoutPixelsIsRefused) {
  for (const auto& [width, height] : {std::pair{0, 4}, {4, 0}, {-1, 4}}) {
    const auto store = TypeParam::create(width, height);
    ASSERT_FALSE(store);
    EXPECT_EQ(store.error().code, ErrorCode::kUsage);
  }
}

}  // namespace
}  // namespace strata
