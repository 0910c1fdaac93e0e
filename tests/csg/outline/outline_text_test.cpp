#include <gtest/gtest.h>

#include <glm/common.hpp>
#include <limits>

#include "csg/outline/outline.h"
#include "csg/outline/text.h"
#include "tests/csg/outline/outline_checks.h"

namespace strata::csg {
namespace {

using testing::area;

struct Box {
  glm::dvec2 low{std::numeric_limits<double>::infinity()}, high{-low};
  explicit Box(const Outline& outline) {
    for (const glm::dvec2& p : testing::points(outline))
      low = glm::min(low, p), high = glm::max(high, p);
  }
};

/// With the font that text has by default, so that numbers are the font's.
class Text : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string missing;
    const auto text = make_text(of("H"), missing);
    if (!text && text.error().code == ErrorCode::kUsage) GTEST_SKIP() << text.error().message;
    if (!text || !missing.empty()) GTEST_SKIP() << "needs Debian's fonts-liberation";
  }
  static Outline set(TextOptions options) {
    std::string missing;
    options.language = "en";
    const auto outline = make_text(options, missing);
    EXPECT_TRUE(outline) << (outline ? "" : outline.error().message);
    return outline ? *outline : Outline{};
  }
  static TextOptions of(const char* text) {
    TextOptions options;
    options.text = text;
    options.font = "Liberation Sans";
    return options;
  }
};

TEST_F(Text, SizeScalesEverything) {
  TextOptions options = of("Hxg8");
  options.segments.fn = 16;
  const Outline small = set(options);
  options.size = 30;
  const Outline large = set(options);
  EXPECT_NEAR(area(large), 9 * area(small), 1e-6 * area(large));
  EXPECT_NEAR(Box(large).high.x, 3 * Box(small).high.x, 1e-6);
  // A capital of the font is 1409 of 2048 units high; a size of 72 is an em of 100.
  EXPECT_NEAR(Box(set(of("H"))).high.y, 10 * 100.0 / 72 * 1409 / 2048, 0.01);
}

TEST_F(Text, HolesOfLettersAreHoles) {
  const Outline eight = set(of("8"));
  EXPECT_EQ(eight.contours.size(), 3u);
  EXPECT_GT(area(without_holes(eight)), area(eight));
}

TEST_F(Text, AlignsByAdvanceAndInk) {
  TextOptions options = of("Hg");
  const Box start(set(options));
  options.halign = "right";
  options.valign = "top";
  const Box end(set(options));
  EXPECT_LT(end.high.x, 1e-9);
  EXPECT_NEAR(end.high.y, 0, 0.01);
  options.halign = "center";
  options.valign = "bottom";
  const Box middle(set(options));
  EXPECT_NEAR(middle.low.x, (start.low.x + end.low.x) / 2, 1e-9);
  EXPECT_NEAR(middle.low.y, 0, 0.01);
  options.valign = "center";
  const Box centre(set(options));
  EXPECT_NEAR(centre.low.y, -centre.high.y, 0.02);
}

TEST_F(Text, SpacingMovesLettersApart) {
  TextOptions options = of("HH");
  const double normal = Box(set(options)).high.x, one = Box(set(of("H"))).high.x;
  options.spacing = 2;
  EXPECT_NEAR(Box(set(options)).high.x - one, 2 * (normal - one), 1e-6);
}

TEST_F(Text, FragmentsRefineCurves) {
  TextOptions options = of("O");
  const std::size_t coarse = testing::points(set(options)).size();
  options.segments.fn = 100;
  EXPECT_GT(testing::points(set(options)).size(), 3 * coarse);
}

TEST_F(Text, NamesAFontThatIsReplaced) {
  TextOptions options = of("H");
  options.font = "Strata Has No Such Font:style=Bold";
  std::string missing;
  ASSERT_TRUE(make_text(options, missing));
  EXPECT_EQ(missing, "Strata Has No Such Font");
  options.font = "sans";
  ASSERT_TRUE(make_text(options, missing));
  EXPECT_EQ(missing, "");
}

TEST_F(Text, EmptyOddAndBrokenTexts) {
  EXPECT_TRUE(set(of("")).empty());
  EXPECT_TRUE(set(of("   ")).empty());
  (void)set(of("\xff\xfe broken \xc3"));
  TextOptions options = of("H");
  options.size = 0;
  EXPECT_TRUE(set(options).empty());
  options.size = std::numeric_limits<double>::quiet_NaN();
  std::string missing;
  EXPECT_FALSE(make_text(options, missing));
  options = of("H");
  options.script = options.direction = options.halign = "nonsense";
  EXPECT_FALSE(set(options).empty());
}

TEST_F(Text, VerticalTextGoesDown) {
  TextOptions options = of("HHH");
  options.direction = "ttb";
  const Box down(set(options));
  EXPECT_GT(down.high.y - down.low.y, 2 * (down.high.x - down.low.x));
  EXPECT_LT(down.low.y, -10);
}

}  // namespace
}  // namespace strata::csg
