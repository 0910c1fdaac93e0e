// The page of `strata oit --report`, as a file and in a browser.

#include <gtest/gtest.h>
#include <png.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/apps/strata/run_tool.h"

namespace strata {
namespace {

using nlohmann::json;
using testkit::RunResult;
using testkit::Workplace;

std::vector<std::string> all_matches(const std::string& text, const std::string& pattern) {
  std::vector<std::string> found;
  const std::regex expression(pattern);
  for (std::sregex_iterator at(text.begin(), text.end(), expression), end; at != end; ++at) {
    found.push_back((*at)[1]);
  }
  return found;
}

class OitPage : public testing::Test {
 protected:
  OitPage() {
    EXPECT_TRUE(write_mesh(place.path("box.obj"), make_box({0, 0, 0}, {10, 10, 10})));
    EXPECT_TRUE(write_mesh(place.path("ball.obj"), make_icosphere(7, 3)));
  }
  std::string make_page() {
    const RunResult run = place.run({"oit", "box.obj", "ball.obj", "--opacity=0.4",
                                     "--technique=all", "--report=page", "--size=64,64"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return place.read("page/index.html");
  }
  std::set<std::string> names() const {
    std::set<std::string> all;
    const json list = json::parse(place.run({"oit", "--list", "--json"}).out)["list"];
    for (const json& technique : list) all.insert(technique["name"].get<std::string>());
    return all;
  }
  /// What a command of the shell prints in this folder.
  [[nodiscard]] bool shell(const std::string& command) const {
    return std::system(("cd '" + place.path("") + "' && " + command).c_str()) == 0;
  }
  [[nodiscard]] bool browse(const std::string& options, const std::string& page) const {
    return shell("timeout 100 chromium --headless --no-sandbox --disable-gpu --hide-scrollbars " +
                 options + " 'file://" + place.path(page) + "' 2>/dev/null");
  }

  Workplace place;
};

/// `ha64:8` without what follows the name.
std::string bare(const std::string& name) { return name.substr(0, name.find(':')); }

constexpr const char* kRowHead = "<th scope=\"row\"><a href=\"#t[0-9]+\">([^<]*)</a>";

TEST_F(OitPage, HasEveryTechniqueAndNeedsNothingElse) {
  const std::string page = make_page();
  std::set<std::string> rows;
  for (const std::string& name : all_matches(page, kRowHead)) rows.insert(bare(name));
  EXPECT_EQ(rows, names());
  // The reference, and a picture and a heat map of each.
  const auto pictures = all_matches(page, "<img src=\"(data:image/png;base64,iVBOR)");
  EXPECT_EQ(pictures.size(), 1 + 2 * names().size() - 2 * all_matches(page, "(class=.out)").size());
  EXPECT_EQ(all_matches(page, "<img src=\"([^d])").size(), 0u);
  EXPECT_EQ(page.find("http"), std::string::npos);
  EXPECT_EQ(page.find("url("), std::string::npos);
}

TEST_F(OitPage, TakesThePlaceOfAnOlderPageAndLeavesOtherFilesAlone) {
  std::filesystem::create_directory(place.path("page"));
  place.write("page/index.html", "old");
  place.write("page/mine.txt", "mine");
  EXPECT_NE(make_page(), "old");
  EXPECT_EQ(place.read("page/mine.txt"), "mine");
  const RunResult run =
      place.run({"oit", "none.obj", "--technique=all", "--report=other", "--size=64,64"});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_FALSE(place.has("other"));
}

TEST_F(OitPage, ANameOfAFileCannotBeMarkup) {
  std::filesystem::copy_file(place.path("box.obj"), place.path("<b>&.obj"));
  const RunResult run = place.run({"oit", "<b>&.obj", "--report=page", "--size=8,8"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const std::string page = place.read("page/index.html");
  EXPECT_EQ(page.find("<b>"), std::string::npos);
  EXPECT_NE(page.find("&lt;b&gt;&amp;.obj"), std::string::npos);
}

TEST_F(OitPage, ABrowserSortsByTheColumnThatIsClicked) {
  if (!shell("command -v chromium >/dev/null")) GTEST_SKIP() << "chromium is not installed";
  std::string page = make_page();
  // PSNR, from the least on.
  page.insert(page.find("</script>"), "document.querySelectorAll('thead th')[2].click();");
  place.write("sorted.html", page);
  ASSERT_TRUE(
      shell("timeout 100 chromium --headless --no-sandbox --disable-gpu --dump-dom "
            "\"file://$PWD/sorted.html\" >dom.html 2>/dev/null"));
  const std::string dom = place.read("dom.html");
  std::set<std::string> rows;
  for (const std::string& name : all_matches(dom, kRowHead)) rows.insert(bare(name));
  EXPECT_EQ(rows, names());
  const auto values =
      all_matches(dom, "</th><td class=\"text\">[a-z]*</td><td data-v=\"([^\"]*)\"");
  ASSERT_GT(values.size(), 2u);
  for (std::size_t i = 1; i < values.size(); ++i) {
    EXPECT_LE(std::stod(values[i - 1]), std::stod(values[i]));
  }
  EXPECT_LT(std::stod(values.front()), std::stod(values.back()));
}

/// Whether a picture shows more than a few colours.
bool shows_something(const std::string& bytes, unsigned width) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) return false;
  png.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(png));
  if (png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr) == 0) return false;
  std::set<std::uint32_t> colours;
  for (std::size_t i = 0; i + 2 < pixels.size(); i += 3) {
    colours.insert(std::uint32_t{pixels[i]} << 16 | std::uint32_t{pixels[i + 1]} << 8 |
                   pixels[i + 2]);
  }
  return png.width == width && colours.size() > 50;
}

TEST_F(OitPage, ABrowserShowsItAtEverySize) {
  if (!shell("command -v chromium >/dev/null")) GTEST_SKIP() << "chromium is not installed";
  make_page();
  for (const unsigned width : {1440u, 500u}) {
    ASSERT_TRUE(browse("--screenshot=shot.png --window-size=" + std::to_string(width) + ",1500",
                       "page/index.html"));
    EXPECT_TRUE(shows_something(place.read("shot.png"), width)) << width;
  }
  ASSERT_TRUE(browse("--print-to-pdf=page.pdf", "page/index.html"));
  EXPECT_EQ(place.read("page.pdf").substr(0, 5), "%PDF-");
}

}  // namespace
}  // namespace strata
