// The laws of every store: each is run over every store, form, record and kind of offsets, and over
// 1 to 8 threads where the form allows it.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <ostream>
#include <stdexcept>
#include <string>
#include <utility>

#include "strata/hashbuffer/count_scan_store.h"
#include "strata/hashbuffer/hash_buffer.h"
#include "tests/hashbuffer/store_support.h"

namespace strata {
namespace {

using test::Fragment;
using test::random_fragments;
using test::sort_everything;
using test::Submission;

/// A store of any type. The laws are compiled once, not once a store.
class AnyStore {
 public:
  virtual ~AnyStore() = default;
  virtual Result<BuildReport> build_frame(const std::vector<Fragment>& fragments, int threads,
                                          const Execution& execution) = 0;
  virtual Result<LayeredDepthImage> depth_image(const Execution& execution) const = 0;
  virtual void for_each(int x, int y, const std::function<bool(DepthItem)>& visit) const = 0;
  virtual std::uint64_t memory_bytes() const = 0;
  virtual LayeredDepthImage expected(const std::vector<Fragment>& fragments) const = 0;
};

template <DepthListStore Store>
class StoreOf : public AnyStore {
 public:
  explicit StoreOf(Store store) : store_(std::move(store)) {}
  Result<BuildReport> build_frame(const std::vector<Fragment>& fragments, int threads,
                                  const Execution& execution) override {
    return build(store_, Submission(fragments, threads), execution);
  }
  Result<LayeredDepthImage> depth_image(const Execution& execution) const override {
    return store_.depth_image(execution);
  }
  void for_each(int x, int y, const std::function<bool(DepthItem)>& visit) const override {
    store_.for_each(x, y, visit);
  }
  std::uint64_t memory_bytes() const override { return store_.memory_bytes(); }
  LayeredDepthImage expected(const std::vector<Fragment>& fragments) const override {
    return sort_everything<typename Store::Record>(store_.width(), store_.height(), fragments);
  }

 private:
  Store store_;
};

/// How to make a store, and what the laws may ask of it.
struct StoreKind {
  std::string name;
  std::function<Result<std::unique_ptr<AnyStore>>(int width, int height)> create;
  std::uint64_t longest_list;
  std::vector<int> thread_counts;
};
void PrintTo(const StoreKind& kind, std::ostream* out) { *out << kind.name; }

template <class Store, class... Options>
StoreKind kind_of(std::string name, std::uint64_t longest_list, Options... options) {
  name += Store::kAnyThread ? "Concurrent" : "Exclusive";
  const auto create = [=](int width, int height) {
    return Store::create(width, height, options...)
        .map([](Store&& store) -> std::unique_ptr<AnyStore> {
          return std::make_unique<StoreOf<Store>>(std::move(store));
        });
  };
  return {name, create, longest_list,
          Store::kAnyThread ? std::vector{1, 2, 3, 4, 8} : std::vector{1}};
}

template <class Record, class Form>
std::vector<StoreKind> stores_of(const std::string& record) {
  const auto ha = [&](const std::string& name, OffsetKind offsets) {
    return kind_of<HashBuffer<Record, Form>>(name + record, Record::kAgeMax,
                                             HashBufferOptions{.offsets = offsets, .seed = 77});
  };
  // A new store joins with one line.
  return {
      ha("HaRandom", OffsetKind::kRandom),
      ha("HaFarthest", OffsetKind::kFarthestPoint),
      ha("HaPlanes", OffsetKind::kPlaneFirst),
      kind_of<CountScanStore<Record, Form>>("Scan" + record, ~0ull),
  };
}

std::vector<StoreKind> all_stores() {
  std::vector<StoreKind> all;
  for (auto&& kinds : {stores_of<Record32, Concurrent>("32"), stores_of<Record32, Exclusive>("32"),
                       stores_of<Record64, Concurrent>("64"), stores_of<Record64, Exclusive>("64"),
                       stores_of<Record64Deep, Concurrent>("64Deep"),
                       stores_of<Record64Deep, Exclusive>("64Deep")}) {
    all.insert(all.end(), kinds.begin(), kinds.end());
  }
  return all;
}

class StoreLaws : public testing::TestWithParam<StoreKind> {
 public:
  static std::unique_ptr<AnyStore> make(int width, int height) {
    auto store = GetParam().create(width, height);
    if (!store) throw std::runtime_error(store.error().message);
    return std::move(*store);
  }

  /// Builds the frame and compares its lists with the oracle's.
  static void expect_exact(AnyStore& store, const std::vector<Fragment>& fragments,
                           int threads = 1) {
    const auto report = store.build_frame(fragments, threads, {});
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->fragments, fragments.size());
    const auto image = store.depth_image(Execution{.threads = threads});
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(*image, store.expected(fragments));
  }
};

INSTANTIATE_TEST_SUITE_P(Every, StoreLaws, testing::ValuesIn(all_stores()),
                         [](const auto& store) { return store.param.name; });

constexpr struct {
  int width, height;
} kScreens[] = {{1, 1}, {7, 3}, {3, 7}, {8, 8}, {9, 1}, {1, 17}, {13, 9}, {17, 16}, {31, 33}};

TEST_P(StoreLaws, ListsEqualTheSortOfEverything) {
  Random random(11);
  for (const auto& [width, height] : kScreens) {
    for (const double layers : {0.2, 1.0, 3.0, 9.0}) {
      const auto count = static_cast<std::size_t>(layers * width * height);
      for (const std::uint32_t depths : {1u << 24, 5u}) {
        auto store = make(width, height);
        expect_exact(*store, random_fragments(random, width, height, count, depths));
        if (testing::Test::HasFailure()) FAIL() << width << " x " << height << ", " << count;
      }
    }
  }
}

TEST_P(StoreLaws, ListsOfAThousandSmallScenesAreExact) {
  Random random(12);
  for (int scene = 0; scene < (testkit::kSanitized ? 100 : 1000); ++scene) {
    const int width = 1 + static_cast<int>(random.below(5));
    const int height = 1 + static_cast<int>(random.below(4));
    auto store = make(width, height);
    expect_exact(*store, random_fragments(random, width, height, random.below(40), 3, 2));
    if (testing::Test::HasFailure()) FAIL() << "scene " << scene;
  }
}

TEST_P(StoreLaws, ListsDoNotDependOnInsertionOrder) {
  Random random(13);
  auto fragments = random_fragments(random, 13, 9, 600, 50);
  auto store = make(13, 9);
  for (int round = 0; round < 4; ++round) {
    test::shuffle(random, fragments);
    expect_exact(*store, fragments);
  }
  std::stable_sort(fragments.begin(), fragments.end(),
                   [](const Fragment& a, const Fragment& b) { return a.depth < b.depth; });
  expect_exact(*store, fragments);
  std::reverse(fragments.begin(), fragments.end());
  expect_exact(*store, fragments);
}

TEST_P(StoreLaws, ListsDoNotDependOnThreads) {
  Random random(14);
  for (const int threads : GetParam().thread_counts) {
    for (int round = 0; round < 3; ++round) {
      const auto fragments = random_fragments(random, 21, 10, 2000, 300);
      auto store = make(21, 10);
      expect_exact(*store, fragments, threads);
    }
  }
}

TEST_P(StoreLaws, ContendedPixelsKeepEverything) {
  Random random(15);
  for (const int threads : GetParam().thread_counts) {
    auto store = make(2, 2);
    expect_exact(*store, random_fragments(random, 2, 2, 700, 4, 2), threads);
  }
}

TEST_P(StoreLaws, EqualFragmentsAreAllKept) {
  for (const int threads : GetParam().thread_counts) {
    std::vector<Fragment> fragments;
    for (int copy = 0; copy < 50; ++copy) {
      for (int x = 0; x < 5; ++x) fragments.push_back({x, x % 2, 1000, 7});
    }
    auto store = make(5, 2);
    expect_exact(*store, fragments, threads);
  }
}

TEST_P(StoreLaws, ACoplanarFrontAndBackKeepsParityEven) {
  // A plate without thickness, drawn twice.
  std::vector<Fragment> fragments;
  for (int copy = 0; copy < 2; ++copy) {
    for (int pixel = 0; pixel < 12 * 11; ++pixel) {
      for (const bool exit : {false, true}) {
        fragments.push_back({pixel % 12, pixel / 12, 5000, DepthItem(0, exit, 3).payload()});
      }
    }
  }
  auto store = make(12, 11);
  expect_exact(*store, fragments);
  for (int pixel = 0; pixel < 12 * 11; ++pixel) {
    int crossings = 0;
    store->for_each(pixel % 12, pixel / 12, [&](DepthItem) { return ++crossings > 0; });
    EXPECT_EQ(crossings, 4);
  }
}

TEST_P(StoreLaws, DepthsAtBothEndsAndOneStepApart) {
  constexpr std::uint32_t kFar = (1u << 24) - 1;
  std::vector<Fragment> fragments;
  for (int pixel = 0; pixel < 7 * 3; ++pixel) {
    for (const std::uint32_t depth : {kFar, 0u, kFar - 1, 1u, 0u, kFar, 1u << 23, (1u << 23) - 1}) {
      fragments.push_back({pixel % 7, pixel / 7, depth, 0});
      fragments.push_back({pixel % 7, pixel / 7, depth, test::kCommonPayload});
    }
  }
  auto store = make(7, 3);
  expect_exact(*store, fragments);
}

TEST_P(StoreLaws, LongListsAreExactOrEndInAnErrorThatNamesThePixel) {
  Random random(16);
  for (const std::size_t layers : {255u, 300u, 600u, 1023u, 1100u}) {
    auto fragments = random_fragments(random, 6, 5, 60);
    for (std::size_t i = 0; i < layers; ++i) {
      fragments.push_back({4, 2, static_cast<std::uint32_t>(random.below(1u << 24)), 1});
    }
    const auto in_pixel = static_cast<std::uint64_t>(
        std::count_if(fragments.begin(), fragments.end(),
                      [](const Fragment& f) { return f.x == 4 && f.y == 2; }));
    auto store = make(6, 5);
    if (in_pixel <= GetParam().longest_list) {
      expect_exact(*store, fragments);
      continue;
    }
    const auto report = store->build_frame(fragments, 1, {});
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().code, ErrorCode::kLimit);
    EXPECT_NE(report.error().message.find("pixel (4, 2) has " + std::to_string(in_pixel)),
              std::string::npos)
        << report.error().message;
  }
}

TEST_P(StoreLaws, TheMemoryLimitIsKeptAndTheErrorCountsWhatIsMissing) {
  Random random(17);
  const auto fragments = random_fragments(random, 10, 10, 3000);
  std::uint64_t enough = 0;
  {
    auto store = make(10, 10);
    const auto report = store->build_frame(fragments, 1, {});
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->memory_bytes, store->memory_bytes());
    enough = report->memory_bytes;
  }
  {
    auto store = make(10, 10);
    const auto report = store->build_frame(fragments, 1, Execution{.memory_limit = enough});
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_LE(store->memory_bytes(), enough);
  }
  auto store = make(10, 10);
  const std::uint64_t too_little = enough / 3;
  const auto report = store->build_frame(fragments, 1, Execution{.memory_limit = too_little});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::kLimit);
  EXPECT_NE(report.error().message.find(" of 3000 fragments"), std::string::npos)
      << report.error().message;
  EXPECT_LE(store->memory_bytes(), too_little);
  // The store is not broken by it.
  expect_exact(*store, fragments);
}

TEST_P(StoreLaws, EachFrameReplacesTheLast) {
  Random random(18);
  auto store = make(19, 6);
  for (const std::size_t count : {500u, 0u, 20u, 2000u, 1u, 100u}) {
    expect_exact(*store, random_fragments(random, 19, 6, count));
  }
}

TEST_P(StoreLaws, AVisitorMayStopEarly) {
  auto store = make(1, 1);
  expect_exact(*store, {{0, 0, 3, 0}, {0, 0, 1, 0}, {0, 0, 2, 0}});
  std::vector<std::uint32_t> seen;
  store->for_each(0, 0, [&](DepthItem item) {
    seen.push_back(item.depth());
    return seen.size() < 2;
  });
  EXPECT_EQ(seen, (std::vector<std::uint32_t>{1, 2}));
}

TEST_P(StoreLaws, AStoppedBuildSaysSo) {
  std::stop_source stop;
  stop.request_stop();
  auto store = make(3, 3);
  const std::vector<Fragment> fragments{{1, 1, 5, 5}};
  const auto report = store->build_frame(fragments, 1, Execution{.stop = stop.get_token()});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::kCancelled);
}

TEST_P(StoreLaws, AScreenWithoutPixelsIsRefused) {
  for (const auto& [width, height] : {std::pair{0, 4}, {4, 0}, {-1, 4}}) {
    const auto store = GetParam().create(width, height);
    ASSERT_FALSE(store);
    EXPECT_EQ(store.error().code, ErrorCode::kUsage);
  }
}

}  // namespace
}  // namespace strata
