#include "tests/support/simd_targets.h"

#include <gtest/gtest.h>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/support/simd_targets.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace strata::testkit {
namespace HWY_NAMESPACE {

std::int64_t dispatched_target() { return HWY_TARGET; }

}  // namespace HWY_NAMESPACE
}  // namespace strata::testkit
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace strata::testkit {

HWY_EXPORT(dispatched_target);

int for_each_simd_target(const std::function<void(const std::string&)>& body) {
  const auto targets = hwy::SupportedAndGeneratedTargets();
  for (const std::int64_t target : targets) {
    hwy::SetSupportedTargetsForTest(target);
    EXPECT_EQ(HWY_DYNAMIC_DISPATCH(dispatched_target)(), target);
    body(hwy::TargetName(target));
  }
  hwy::SetSupportedTargetsForTest(0);
  return static_cast<int>(targets.size());
}

}  // namespace strata::testkit
#endif  // HWY_ONCE
