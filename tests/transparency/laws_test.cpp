// The laws of techniques, over the whole table: what an exact one must equal, what every one must
// do with one layer, with none, and with any number of threads.

#include <gtest/gtest.h>

#include <cctype>

#include "tests/transparency/choices.h"

namespace strata::transparency {

/// So that a test's name does not hold an address.
static void PrintTo(const Technique* technique, std::ostream* out) { *out << technique->name; }

namespace {

std::vector<ListedFrame> frames() {
  std::vector<ListedFrame> all;
  all.push_back(random_frame("Mixed", {130, 70}, 4.0, 1 << 24, 1));
  all.push_back(random_frame("Ties", {70, 66}, 6.0, 4, 2));
  all.push_back(random_frame("OnePixel", {1, 1}, 12.0, 1 << 24, 3));
  all.push_back(random_frame("OddSize", {7, 3}, 5.0, 100, 4));
  all.push_back(random_frame("Sparse", {200, 9}, 0.3, 1 << 24, 5));
  all.push_back(random_frame("SomeOpaque", {66, 20}, 5.0, 1 << 24, 6, 0.5f, 1.0f));
  for (std::size_t i = 0; i < 10; ++i) all.back().colours[i].a = 1.0f;
  for (std::size_t i = 10; i < 15; ++i) all.back().colours[i].a = 0.0f;
  all.push_back(random_frame("DepthExtremes", {66, 20}, 5.0, 6, 11));
  for (ListedFragment& f : all.back().fragments) {
    if (f.depth >= 3) f.depth = (1 << 24) - 6 + f.depth;  // 0, 1, 2 and the last three
  }
  all.push_back(deep_frame(300, 7));
  all.push_back(deep_frame(590, 8));
  all.push_back(random_frame("Background", {66, 20}, 3.0, 1 << 24, 9));
  all.back().options.background = glm::vec4(0.2f, 0.4f, 0.9f, 0.75f);
  all.push_back(random_frame("EndsOfDepth", {33, 20}, 4.0, 4, 11));
  for (ListedFragment& f : all.back().fragments) {
    if (f.depth >= 2) f.depth += (1u << 24) - 4;
  }
  ListedFrame twice = random_frame("Duplicates", {33, 17}, 3.0, 64, 10);
  const auto once = twice.fragments;
  twice.fragments.insert(twice.fragments.end(), once.begin(), once.end());
  all.push_back(std::move(twice));
  return all;
}

class Techniques : public testing::TestWithParam<const Technique*> {
 protected:
  [[nodiscard]] const Technique& technique() const { return *GetParam(); }
};

class ExactTechniques : public Techniques {};

TEST_P(ExactTechniques, GiveThePictureOfTheSortedLists) {
  for (const ListedFrame& frame : frames()) {
    const Rendering rendering = render(frame, technique());
    const auto reference = oracle_picture(frame, technique().blending);
    EXPECT_TRUE(same_bits(rendering.image, reference))
        << frame.name << ": differs by " << largest_difference(rendering.image, reference);
    EXPECT_EQ(rendering.costs.fragments, frame.fragments.size()) << frame.name;
    EXPECT_EQ(rendering.costs.lost, 0u) << frame.name;
  }
}

TEST_P(ExactTechniques, DoNotDependOnTheOrderOfSubmissionOrOnThreads) {
  ListedFrame frame = random_frame("Mixed", {130, 70}, 5.0, 16, 21);
  const auto reference = oracle_picture(frame, technique().blending);
  std::mt19937 random(5);
  for (int threads = 1; threads <= 4; ++threads) {
    std::shuffle(frame.fragments.begin(), frame.fragments.end(), random);
    EXPECT_TRUE(same_bits(render(frame, technique(), {}, threads).image, reference)) << threads;
  }
}

TEST_P(Techniques, GiveTheSameBitsForAnyNumberOfThreads) {
  const ListedFrame frame = random_frame("Mixed", {200, 130}, 5.0, 1 << 24, 22);
  const Image one = render(frame, technique(), {}, 1).image;
  for (const int threads : {2, 4}) {
    EXPECT_TRUE(same_bits(render(frame, technique(), {}, threads).image, one.pixels)) << threads;
  }
}

TEST_P(Techniques, GiveFiniteColoursWhateverTheFragments) {
  // The weight of its background may be negative.
  const float least = technique().name == "weighted-sum" ? -100.0f : -1e-4f;
  for (const ListedFrame& listed : frames()) {
    const auto frame = Frame::make(listed.fragments, listed.colours, listed.options);
    ASSERT_TRUE(frame);
    const auto rendering = frame->render(technique());
    if (!rendering) {  // more fragments than it can hold
      EXPECT_EQ(rendering.error().code, ErrorCode::kLimit) << listed.name;
      continue;
    }
    for (const glm::vec4& pixel : rendering->image.pixels) {
      for (int c = 0; c < 4; ++c) {
        ASSERT_GE(pixel[c], least) << listed.name;
        ASSERT_LT(pixel[c], 100.0f) << listed.name;
      }
    }
  }
}

TEST_P(Techniques, ShowOneLayerExactlyUnlessTheyAreRandom) {
  if (technique().accuracy == Accuracy::kRandom) return;
  const ListedFrame frame = single_layers();
  const auto reference = oracle_picture(frame, Blending::kFrontToBack);
  const bool bytes = technique().name.find("packed") != std::string_view::npos;
  EXPECT_LE(largest_difference(render(frame, technique()).image, reference),
            bytes ? 1.01f / 255.0f : 2e-6f);
}

TEST_P(Techniques, LeaveTheBackgroundWhereNothingIsDrawn) {
  ListedFrame frame;
  frame.options.size = {70, 5};
  frame.options.background = {0.25f, 0.5f, 0.75f, 1.0f};
  frame.colours = {{1, 0, 0, 0.5f}};
  const Rendering rendering = render(frame, technique());
  ASSERT_EQ(rendering.image.pixels.size(), 350u);
  for (const glm::vec4& pixel : rendering.image.pixels) {
    ASSERT_EQ(pixel, glm::vec4(0.25f, 0.5f, 0.75f, 1.0f));
  }
}

std::string test_name(const testing::TestParamInfo<const Technique*>& info) {
  std::string name;
  bool upper = true;
  for (const char c : info.param->name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) {
      upper = true;
      continue;
    }
    name += upper ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
    upper = false;
  }
  return name;
}

/// Those that can render bare fragments.
std::vector<const Technique*> those(bool exact_only) {
  std::vector<const Technique*> some;
  for (const Technique* technique : techniques()) {
    if (technique->needs_triangles) continue;
    if (!exact_only || technique->accuracy == Accuracy::kExact) some.push_back(technique);
  }
  return some;
}

INSTANTIATE_TEST_SUITE_P(All, ExactTechniques, testing::ValuesIn(those(true)), test_name);
INSTANTIATE_TEST_SUITE_P(All, Techniques, testing::ValuesIn(those(false)), test_name);

}  // namespace
}  // namespace strata::transparency
