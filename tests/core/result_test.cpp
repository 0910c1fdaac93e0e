#include "strata/core/result.h"

#include <gtest/gtest.h>

#include <memory>

namespace strata {
namespace {

Result<int> half(int number) {
  if (number % 2 != 0) return fail(ErrorCode::kInput, "{}: {} is odd", "numbers.txt:3", number);
  return number / 2;
}

TEST(Result, CarriesTheValueOrTheSentence) {
  ASSERT_TRUE(half(8));
  EXPECT_EQ(*half(8), 4);
  const Result<int> failed = half(7);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, ErrorCode::kInput);
  EXPECT_EQ(failed.error().message, "numbers.txt:3: 7 is odd");
}

TEST(Result, HoldsMoveOnlyValues) {
  Result<std::unique_ptr<int>> result = std::make_unique<int>(3);
  ASSERT_TRUE(result);
  const std::unique_ptr<int> taken = std::move(*result);
  EXPECT_EQ(*taken, 3);
}

TEST(ErrorCode, ValuesAreTheDocumentedExitCodes) {
  EXPECT_EQ(static_cast<int>(ErrorCode::kInternal), 1);
  EXPECT_EQ(static_cast<int>(ErrorCode::kUsage), 2);
  EXPECT_EQ(static_cast<int>(ErrorCode::kInput), 3);
  EXPECT_EQ(static_cast<int>(ErrorCode::kOutput), 4);
  EXPECT_EQ(static_cast<int>(ErrorCode::kGeometry), 5);
  EXPECT_EQ(static_cast<int>(ErrorCode::kLimit), 6);
  EXPECT_EQ(static_cast<int>(ErrorCode::kVerification), 7);
  EXPECT_EQ(static_cast<int>(ErrorCode::kCancelled), 130);
}

}  // namespace
}  // namespace strata
