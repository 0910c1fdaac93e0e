#include "mesh/check/box_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <random>

namespace strata {
namespace {

std::vector<BoxPair> all_pairs(const std::vector<LatticeBox>& boxes,
                               const std::vector<std::uint32_t>& groups = {}) {
  std::vector<BoxPair> pairs;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    for (std::uint32_t j = i + 1; j < boxes.size(); ++j) {
      bool apart = !groups.empty() && groups[i] == groups[j];
      for (int k = 0; k < 3; ++k) {
        apart = apart || boxes[i].high[k] < boxes[j].low[k] || boxes[j].high[k] < boxes[i].low[k];
      }
      if (!apart) pairs.push_back({i, j});
    }
  }
  return pairs;
}

struct Draw {
  std::mt19937_64 random;

  std::int32_t up_to(std::int64_t most) {
    return static_cast<std::int32_t>(random() % static_cast<std::uint64_t>(most + 1));
  }
  LatticeBox box(std::int64_t space, std::int64_t size) {
    LatticeBox box{};
    for (int k = 0; k < 3; ++k) {
      box.low[k] = up_to(space - 1);
      box.high[k] = box.low[k] + up_to(std::min(size, space - 1 - box.low[k]));
    }
    return box;
  }
};

struct Kind {
  const char* name;
  std::size_t count;
  std::int64_t space, size;
  std::size_t large;  ///< boxes of any size among them
};
class BoxPairs : public testing::TestWithParam<Kind> {
 protected:
  std::vector<LatticeBox> boxes() {
    Draw draw{std::mt19937_64(5)};
    std::vector<LatticeBox> result;
    for (std::size_t i = 0; i < GetParam().count; ++i) {
      const bool large = i % 97 == 0 && i / 97 < GetParam().large;
      result.push_back(draw.box(GetParam().space, large ? GetParam().space : GetParam().size));
    }
    return result;
  }
  static std::vector<std::uint32_t> groups_of(std::size_t count) {
    std::vector<std::uint32_t> groups;
    for (std::size_t i = 0; i < count; ++i) groups.push_back(static_cast<std::uint32_t>(i / 40));
    return groups;
  }
};
INSTANTIATE_TEST_SUITE_P(
    Kinds, BoxPairs,
    testing::Values(Kind{"Few", 20, 1000, 300, 0}, Kind{"Small", 9000, 1 << 20, 1 << 16, 0},
                    Kind{"SmallAndLarge", 9000, 1 << 28, 1 << 23, 30},
                    Kind{"AllLarge", 1000, 1 << 20, 1 << 20, 0}, Kind{"Crowded", 2000, 8, 1, 0},
                    Kind{"OnePoint", 500, 1, 0, 0}, Kind{"Points", 5000, 16, 0, 5},
                    Kind{"WholeRange", 2000, std::numeric_limits<std::int32_t>::max(), 1 << 28, 9}),
    [](const auto& kind) { return kind.param.name; });

TEST_P(BoxPairs, AreAllThatShareAPoint) {
  const std::vector<LatticeBox> some = boxes();
  for (const int threads : {1, 2, 7}) {
    const auto found = box_pairs(some, {}, {.threads = threads});
    ASSERT_TRUE(found);
    EXPECT_EQ(*found, all_pairs(some));
    EXPECT_FALSE(found->empty());
  }
}

TEST_P(BoxPairs, OfDifferentGroupsOnly) {
  const std::vector<LatticeBox> some = boxes();
  const std::vector<std::uint32_t> groups = groups_of(some.size());
  const auto found = box_pairs(some, groups, {.threads = 3});
  ASSERT_TRUE(found);
  EXPECT_EQ(*found, all_pairs(some, groups));
}

TEST(BoxPairSearch, CoordinatesMayBeTheLeastAndTheLargest) {
  const auto low = std::numeric_limits<std::int32_t>::min();
  const auto high = std::numeric_limits<std::int32_t>::max();
  std::vector<LatticeBox> boxes(50, {glm::ivec3(low), glm::ivec3(high)});
  for (int i = 0; i < 50; ++i) boxes.push_back({glm::ivec3(high - i), glm::ivec3(high)});
  for (int i = 0; i < 50; ++i) boxes.push_back({glm::ivec3(low), glm::ivec3(low + i)});
  const auto found = box_pairs(boxes, {});
  ASSERT_TRUE(found);
  EXPECT_EQ(*found, all_pairs(boxes));
}

TEST(BoxPairSearch, NothingOrOneBoxHasNoPairs) {
  EXPECT_TRUE(box_pairs({}, {})->empty());
  const std::vector<LatticeBox> one{{glm::ivec3(1), glm::ivec3(2)}};
  EXPECT_TRUE(box_pairs(one, {})->empty());
}

// Patches of a surface, as triangles of a mesh lie, and boxes that cover large parts of it.
std::vector<LatticeBox> surface(int side, int large) {
  std::vector<LatticeBox> boxes;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      boxes.push_back({glm::ivec3(x * 100, y * 100, (x + y) * 30),
                       glm::ivec3(x * 100 + 100, y * 100 + 100, (x + y) * 30 + 60)});
    }
  }
  for (int i = 0; i < large; ++i) {
    boxes.push_back({glm::ivec3(i, 0, -5), glm::ivec3(i + side * 50, side * 80, -4)});
  }
  return boxes;
}

TEST(BoxPairSearch, WorkGrowsAsBoxesAndPairsDo) {
  for (const int side : {40, 320}) {
    const std::vector<LatticeBox> boxes = surface(side, 20);
    std::atomic<std::uint64_t> pairs = 0;
    ASSERT_TRUE(for_box_pairs(boxes, {}, [&](auto some, int) { pairs += some.size(); }));
    // Each patch touches four that were there before it; the large ones touch each other.
    const auto n = static_cast<std::uint64_t>(side);
    EXPECT_EQ(pairs, 2 * n * (n - 1) + 2 * (n - 1) * (n - 1) + 190);
  }
}

TEST(BoxPairSearch, OneGroupIsNotSearched) {
  const std::vector<LatticeBox> boxes(100000, {glm::ivec3(3), glm::ivec3(4)});
  const std::vector<std::uint32_t> groups(boxes.size(), 1);
  EXPECT_TRUE(box_pairs(boxes, groups)->empty());  // 5e9 pairs otherwise
}

TEST(BoxPairSearch, StopsOnRequest) {
  std::stop_source stop;
  const std::vector<LatticeBox> boxes(100000, {glm::ivec3(3), glm::ivec3(4)});
  Execution execution;
  execution.stop = stop.get_token();
  const auto done = for_box_pairs(
      boxes, {}, [&](auto, int) { stop.request_stop(); }, execution);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::kCancelled);
}

TEST(BoxPairSearch, KeepsTheMemoryLimit) {
  const std::vector<LatticeBox> boxes(20000, {glm::ivec3(3), glm::ivec3(4)});
  const auto found = box_pairs(boxes, {}, {.memory_limit = 8 << 20});  // 2e8 pairs
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::kLimit);
  EXPECT_NE(found.error().message.find("8388608"), std::string::npos) << found.error().message;
  const auto no_room = for_box_pairs(boxes, {}, [](auto, int) {}, {.memory_limit = 1000});
  ASSERT_FALSE(no_room);
  EXPECT_EQ(no_room.error().code, ErrorCode::kLimit);
}

}  // namespace
}  // namespace strata
