// The lists of strata/lists.h against the sort of everything: each alias, by a generator and by
// insert() from several threads.

#include "strata/lists.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/hashbuffer/store_support.h"

namespace strata {
namespace {

using test::random_fragments;
using test::sort_everything;
using test::Submission;

template <class Lists>
class OwnLists : public testing::Test {};
using Every = testing::Types<DepthLists, PayloadLists, OnePassDepthLists, OnePassLists, DeepLists>;
TYPED_TEST_SUITE(OwnLists, Every);

template <class Lists>
void expect_lists(const Lists& lists, const std::vector<test::Fragment>& fragments) {
  const auto exact =
      sort_everything<typename Lists::Record>(lists.width(), lists.height(), fragments);
  for (int y = 0; y < lists.height(); ++y) {
    for (int x = 0; x < lists.width(); ++x) {
      std::vector<Fragment> expected;
      for (const DepthItem item : exact.list(x, y)) {
        expected.push_back({item.depth(), item.payload()});
      }
      ASSERT_EQ(lists.list(x, y), expected) << x << ", " << y;
    }
  }
}

TYPED_TEST(OwnLists, OfAGeneratorAreTheSortOfEverything) {
  Random random(71);
  for (const std::uint64_t expected_fragments : {0u, 100u, 3000u}) {
    auto lists = TypeParam::create(13, 9, expected_fragments).value();
    for (const std::size_t count : {std::size_t{3000}, std::size_t{0}, std::size_t{500}}) {
      const auto fragments = random_fragments(random, 13, 9, count, 60);
      const auto report = lists.build(Submission(fragments, 3));
      ASSERT_TRUE(report) << report.error().message;
      EXPECT_EQ(report->fragments, count);
      expect_lists(lists, fragments);
    }
  }
}

TYPED_TEST(OwnLists, OfInsertFromManyThreadsAreTheSortOfEverything) {
  if constexpr (TypeParam::kOnePass) {
    Random random(72);
    auto lists = TypeParam::create(13, 9).value();  // far too little room
    for (const std::size_t count : {2000u, 0u, 4000u}) {
      const auto fragments = random_fragments(random, 13, 9, count, 60);
      ASSERT_TRUE(lists.begin());
      test::submit(lists, fragments, 4);
      const auto report = lists.finish();
      ASSERT_TRUE(report) << report.error().message;
      EXPECT_EQ(report->fragments, count);
      expect_lists(lists, fragments);
    }
  } else {
    GTEST_SKIP() << "these lists take a generator";
  }
}

TYPED_TEST(OwnLists, AVisitorMayStop) {
  auto lists = TypeParam::create(1, 1).value();
  const std::vector<test::Fragment> fragments{{0, 0, 3, 0}, {0, 0, 1, 0}, {0, 0, 2, 0}};
  ASSERT_TRUE(lists.build(Submission(fragments)));
  std::vector<std::uint32_t> seen;
  lists.for_each(0, 0, [&](Fragment fragment) {
    seen.push_back(fragment.depth);
    return seen.size() < 2;
  });
  EXPECT_EQ(seen, (std::vector<std::uint32_t>{1, 2}));
}

TEST(OwnListsOfOnePass, RunTheGeneratorOnceWhereTheyKnowWhatToExpect) {
  Random random(73);
  const auto fragments = random_fragments(random, 40, 30, 12000);
  auto known = OnePassLists::create(40, 30, fragments.size()).value();
  EXPECT_EQ(known.build(Submission(fragments)).value().generator_calls, 1);
  auto unknown = OnePassLists::create(40, 30).value();
  EXPECT_EQ(unknown.build(Submission(fragments)).value().generator_calls, 2);
  EXPECT_EQ(unknown.build(Submission(fragments)).value().generator_calls, 1);
}

TEST(OwnListsOfOnePass, ThatAreTooLongNameTheListsToTake) {
  std::vector<test::Fragment> fragments;
  for (std::uint32_t i = 0; i < 600; ++i) fragments.push_back({1, 0, i, i});
  auto shallow = OnePassLists::create(2, 2).value();
  const auto report = shallow.build(Submission(fragments));
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::kLimit);
  EXPECT_NE(report.error().message.find("pixel (1, 0) has 600 fragments"), std::string::npos)
      << report.error().message;
  auto deep = DeepLists::create(2, 2).value();
  ASSERT_TRUE(deep.build(Submission(fragments)));
  expect_lists(deep, fragments);
}

TYPED_TEST(OwnLists, NameTheFragmentThatNoListCanKeep) {
  struct Case {
    int x, y;
    std::uint32_t depth;
    const char* said;
  };
  for (const Case& wrong :
       {Case{8, 3, 5, "a fragment of depth 5 was inserted at pixel (8, 3): "},
        Case{3, -1, 5, "at pixel (3, -1)"}, Case{0, 0, 1u << 24, "of depth 16777216"}}) {
    auto lists = TypeParam::create(8, 8).value();
    const auto draw = [&](int x, int y, std::uint32_t depth) {
      return [=](auto& sink) {
        if constexpr (TypeParam::kHasPayload) {
          sink.insert(x, y, depth, 1u);
        } else {
          sink.insert(x, y, depth);
        }
      };
    };
    const auto report = lists.build(draw(wrong.x, wrong.y, wrong.depth));
    ASSERT_FALSE(report) << wrong.said;
    EXPECT_EQ(report.error().code, ErrorCode::kUsage);
    EXPECT_NE(report.error().message.find(wrong.said), std::string::npos) << report.error().message;
    // The next frame is not held against the last one.
    ASSERT_TRUE(lists.build(draw(7, 7, (1u << 24) - 1)));
    EXPECT_EQ(lists.list(7, 7).size(), 1u);
  }
}

TEST(DeepLists, NameThePayloadThatTheyCannotKeep) {
  for (const std::uint32_t payload : {1u << 29, 1u << 30, 0xffffffffu}) {
    auto lists = DeepLists::create(8, 8).value();
    const auto report = lists.build([=](auto& sink) {
      sink.insert(1, 1, 5, 0x9fffffffu);
      sink.insert(3, 4, 5, payload);
    });
    ASSERT_FALSE(report) << payload;
    EXPECT_EQ(report.error().code, ErrorCode::kUsage);
    EXPECT_EQ(
        report.error().message,
        fmt::format("a fragment of payload 0x{:08x} was inserted at pixel (3, 4): bits 29 and "
                    "30 of payloads must be 0, these lists keep 30 bits",
                    payload));
    ASSERT_TRUE(lists.begin());
    lists.insert(3, 4, 5, payload);
    EXPECT_FALSE(lists.finish());
    // All payloads that they can keep come back, and the next frame is as good as the first.
    ASSERT_TRUE(lists.begin());
    lists.insert(0, 0, 1, 0x1fffffffu);
    lists.insert(0, 0, 2, 0x9fffffffu);
    ASSERT_TRUE(lists.finish());
    EXPECT_EQ(lists.list(0, 0), (std::vector<Fragment>{{1, 0x1fffffffu}, {2, 0x9fffffffu}}));
  }
  auto all = PayloadLists::create(1, 1).value();
  ASSERT_TRUE(all.build([](auto& sink) { sink.insert(0, 0, 1, 0x60000000u); }));
  EXPECT_EQ(all.list(0, 0), (std::vector<Fragment>{{1, 0x60000000u}}));
}

template <class Lists>
concept TakesARealDepth = requires(Lists& lists) {
  lists.insert(0, 0, 0.5f, 1u);
};
static_assert(!TakesARealDepth<OnePassLists> && !TakesARealDepth<DeepLists>);

// A sink of depth alone has no form with a payload that a concept could take for one without.
template <class Sink>
concept TakesDepthAlone = requires(Sink& sink) {
  sink.insert(0, 0, 1u);
};
static_assert(TakesDepthAlone<OnePassDepthLists> && !TakesDepthAlone<OnePassLists>);

}  // namespace
}  // namespace strata
