#include "strata/hashbuffer/record.h"

#include <gtest/gtest.h>

#include <limits>

#include "hashbuffer/random.h"

namespace strata {
namespace {

template <class Record>
class RecordLaws : public testing::Test {};
using Records = testing::Types<Record32, Record64, Record64Deep>;
TYPED_TEST_SUITE(RecordLaws, Records);

std::uint32_t any_payload(Random& random) {
  return static_cast<std::uint32_t>(random.next()) & 0x9fffffffu;
}

TYPED_TEST(RecordLaws, UnpackGivesBackWhatPackTook) {
  using R = TypeParam;
  Random random(1);
  for (int i = 0; i < 10000; ++i) {
    const auto age = static_cast<unsigned>(1 + random.below(R::kAgeMax));
    const auto depth = static_cast<std::uint32_t>(random.below(R::kDepthMax + 1ull));
    const std::uint32_t payload = any_payload(random);
    const auto word = R::pack(age, depth, payload);
    EXPECT_EQ(R::age(word), age);
    EXPECT_EQ(R::depth(word), depth);
    EXPECT_EQ(R::payload(word), R::kPayloadBits == 0 ? 0 : payload);
    EXPECT_EQ(R::item(word), R::item(depth, payload));
    if (age < R::kAgeMax) {
      EXPECT_EQ(R::with_next_age(word), R::pack(age + 1, depth, payload));
    }
  }
}

TYPED_TEST(RecordLaws, LargerMeansOlderThenNearerThenOfSmallerPayload) {
  using R = TypeParam;
  Random random(2);
  for (int i = 0; i < 10000; ++i) {
    const auto age_a = static_cast<unsigned>(1 + random.below(3));
    const auto age_b = static_cast<unsigned>(1 + random.below(3));
    const auto depth_a = static_cast<std::uint32_t>(random.below(4));
    const auto depth_b = static_cast<std::uint32_t>(random.below(4));
    const std::uint32_t payload_a = any_payload(random), payload_b = any_payload(random);
    const auto a = R::pack(age_a, depth_a, payload_a), b = R::pack(age_b, depth_b, payload_b);
    const DepthItem item_a = R::item(depth_a, payload_a), item_b = R::item(depth_b, payload_b);
    EXPECT_EQ(a > b, age_a != age_b ? age_a > age_b : item_a < item_b);
    EXPECT_EQ(R::rank(a) > R::rank(b), item_a < item_b);
  }
}

TYPED_TEST(RecordLaws, NoRecordIsTheEmptyWord) {
  using R = TypeParam;
  const std::uint32_t farthest = R::kDepthMax;
  EXPECT_NE(R::pack(1, farthest, 0x9fffffffu), R::kEmpty);
  EXPECT_EQ(R::age(R::kEmpty), 0u);
}

TYPED_TEST(RecordLaws, DepthsAtBothEndsLeaveTheAgeAlone) {
  using R = TypeParam;
  for (const std::uint32_t depth : {0u, 1u, R::kDepthMax - 1, R::kDepthMax}) {
    for (const unsigned age : {1u, R::kAgeMax}) {
      EXPECT_EQ(R::age(R::pack(age, depth, 0)), age);
      EXPECT_EQ(R::depth(R::pack(age, depth, 0)), depth);
    }
  }
}

// Erratum E5: a factor of 2^24 turns the normalized depth 1 into 2^24, which runs into the age.
TYPED_TEST(RecordLaws, E5DepthNeverRunsIntoTheAge) {
  using R = TypeParam;
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double u : {0.0, 1.0, 1.0 - 1e-17, 1.0 + 1e-15, 2.0, -1.0, infinity, -infinity,
                         std::numeric_limits<double>::quiet_NaN()}) {
    ASSERT_LE(record_depth(u), R::kDepthMax) << u;
    EXPECT_EQ(R::age(R::pack(7, record_depth(u), 0)), 7u) << u;
  }
  EXPECT_EQ(record_depth(0.0), 0u);
  EXPECT_EQ(record_depth(1.0), R::kDepthMax);
  EXPECT_EQ(record_depth(0.5), R::kDepthMax / 2);
  EXPECT_EQ(R::age(R::pack(7, 0xffffffffu, 0)), 7u);
  EXPECT_EQ(R::depth(R::pack(7, 1u << 24, 0)), R::kDepthMax);
}

TEST(NormalizedDepth, IsTheInverseOfRecordDepth) {
  for (std::uint32_t depth = 0; depth <= kRecordDepthMax; ++depth) {
    ASSERT_EQ(record_depth(normalized_depth(depth)), depth);
  }
  Random random(9);
  for (int i = 0; i < 10000; ++i) {
    const double u = static_cast<double>(random.below(1u << 30)) / ((1u << 30) - 1);
    EXPECT_NEAR(normalized_depth(record_depth(u)), u, 0.5000001 / kRecordDepthMax);
  }
  EXPECT_EQ(normalized_depth(kRecordDepthMax), 1.0);
}

TEST(Record64Deep, KeepsTheExitBitAndTheLow29BitsOfTheTriangle) {
  const DepthItem item(12, true, (1u << 29) - 1);
  EXPECT_TRUE(Record64Deep::payload_fits(item.payload()));
  EXPECT_EQ(Record64Deep::item(Record64Deep::pack(3, 12, item.payload())), item);
  EXPECT_FALSE(Record64Deep::payload_fits(DepthItem(12, true, 1u << 29).payload()));
  EXPECT_TRUE(Record64::payload_fits(0xffffffffu));
  EXPECT_TRUE(Record32::payload_fits(0xffffffffu));
}

// Erratum E17: 8 bits of age end at 255 layers, the Power Plant has 590.
TEST(Record64Deep, E17CountsMoreLayersThanThePowerPlantHas) {
  EXPECT_EQ(Record64::kAgeMax, 255u);
  EXPECT_EQ(Record64Deep::kAgeMax, 1023u);
}

}  // namespace
}  // namespace strata
