#include "core/did_you_mean.h"

#include <gtest/gtest.h>

#include <array>

namespace strata {
namespace {

constexpr std::array<std::string_view, 6> kWords{"voxelize", "mesh", "info", "csg", "view", "ldi"};
constexpr std::array<std::string_view, 3> kOptions{"--resolution", "--root", "--rule"};

TEST(DidYouMean, FindsTheWordWithOneLetterLeftOutPutInReplacedOrExchanged) {
  for (const char* word :
       {"voxelise", "voxlize", "voxxelize", "voxeilze", "Voxelize", "VOXELIZE"}) {
    EXPECT_EQ(nearest_word(word, kWords), "voxelize") << word;
  }
  EXPECT_EQ(nearest_word("mseh", kWords), "mesh");
  EXPECT_EQ(nearest_word("--resoluton", kOptions), "--resolution");
  EXPECT_EQ(nearest_word("--rull", kOptions), "--rule");
}

TEST(DidYouMean, TakesTheNearestOfSeveral) {
  constexpr std::array<std::string_view, 3> kFormats{"npz", "npy", "nrrd"};
  EXPECT_EQ(nearest_word("npyy", kFormats), "npy");
  EXPECT_EQ(nearest_word("nrd", kFormats), "nrrd");
}

TEST(DidYouMean, TakesTheOnlyWordThatBeginsSo) {
  EXPECT_EQ(nearest_word("vox", kWords), "voxelize");
  EXPECT_EQ(nearest_word("--res", kOptions), "--resolution");
  EXPECT_EQ(nearest_word("--r", kOptions), "");  // three begin so
}

TEST(DidYouMean, SaysNothingOfWordsThatAreFar) {
  for (const char* word : {"", "hello", "x", "render", "mash-potatoes", "vw"}) {
    EXPECT_EQ(nearest_word(word, kWords), "") << word;
  }
  EXPECT_EQ(nearest_word("b", std::array<std::string_view, 1>{"a"}), "");
  EXPECT_EQ(nearest_word(std::string(100'000, 'v'), kWords), "");
  EXPECT_EQ(nearest_word("mesh", {}), "");
}

TEST(DidYouMean, IsAnEndOfASentenceOrNothing) {
  EXPECT_EQ(did_you_mean("voxelise", kWords), "; did you mean voxelize?");
  EXPECT_EQ(did_you_mean("hello", kWords), "");
}

}  // namespace
}  // namespace strata
