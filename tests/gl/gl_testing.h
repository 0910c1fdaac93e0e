#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <utility>

#include "strata/gl/context.h"

namespace strata::test {

/// A test that needs OpenGL. Without a context it is skipped with the reason, or fails where the
/// environment variable CI is set; and it fails on any GL error that it leaves.
class GlTest : public testing::Test {
 protected:
  void SetUp() override {
    auto made = gl::Context::headless({.debug = true, .device = ""});
    if (made) {
      context_ = std::move(*made);
      return;
    }
    if (std::getenv("CI")) FAIL() << made.error().message;
    GTEST_SKIP() << made.error().message;
  }
  void TearDown() override {
    if (!context_) return;
    const auto checked = context_->check();
    EXPECT_TRUE(checked) << checked.error().message;
  }

  std::unique_ptr<gl::Context> context_;
};

}  // namespace strata::test
