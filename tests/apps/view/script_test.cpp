#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <sstream>
#include <vector>

#include "apps/view/script.h"
#include "apps/view/viewer.h"

namespace strata::view {
namespace {

std::string error_of(const std::string& text) {
  const auto script = parse_script(text, "drive.txt");
  if (script) return "none";
  EXPECT_EQ(script.error().code, ErrorCode::kUsage);
  return script.error().message;
}

TEST(Script, ReadsCommandsWithTheirLines) {
  const auto script = parse_script(
      "# a tour\n"
      "orbit 30 -12.5   # to the right\n"
      "\n"
      "hide \"cube at plate one.csg:12:3\"\r\n"
      "colour @7 #ff8000\n"
      "section z 3.5\n"
      "section 0,0,1,2\n"
      "zoom 2\n"
      "zoom 2 10 20\n"
      "drag left 10 20 30 40\n"
      "edges on\n"
      "wait reload\n"
      "wait 0.5\n"
      "quit",
      "drive.txt");
  ASSERT_TRUE(script) << script.error().message;
  ASSERT_EQ(script->size(), 12u);
  const auto& c = *script;
  EXPECT_EQ(c[0].line, 2);
  EXPECT_EQ(c[0].action, Action::kOrbit);
  EXPECT_EQ(c[0].numbers, (std::vector<double>{30, -12.5}));
  EXPECT_EQ(c[1].line, 4);
  EXPECT_EQ(c[1].word, "cube at plate one.csg:12:3");
  EXPECT_EQ(c[2].word, "@7");
  EXPECT_EQ(c[2].value, "#ff8000");
  EXPECT_EQ(c[3].word, "z=3.5");
  EXPECT_EQ(c[4].word, "0,0,1,2");
  EXPECT_EQ(c[5].numbers.size(), 1u);
  EXPECT_EQ(c[6].numbers.size(), 3u);
  EXPECT_EQ(c[7].word, "left");
  EXPECT_EQ(c[7].numbers.size(), 4u);
  EXPECT_TRUE(c[8].on);
  EXPECT_EQ(c[9].word, "reload");
  EXPECT_EQ(c[10].numbers.front(), 0.5);
  EXPECT_EQ(c[11].action, Action::kQuit);
  EXPECT_EQ(c.back().line, 14);
}

TEST(Script, MistakesNameFileAndLine) {
  EXPECT_EQ(error_of("wait\norbitt 1 2\n"),
            "drive.txt:2: unknown command 'orbitt'; did you mean orbit?");
  EXPECT_EQ(error_of("orbit 1\n"), "drive.txt:1: usage: orbit DX DY");
  EXPECT_EQ(error_of("orbit 1 x\n"), "drive.txt:1: 'x' is not a number; usage: orbit DX DY");
  EXPECT_EQ(error_of("orbit 1 nan\n"), "drive.txt:1: 'nan' is not a number; usage: orbit DX DY");
  EXPECT_EQ(error_of("\n\nhide \"cube\n"), "drive.txt:3: a quote is not closed");
  EXPECT_EQ(error_of("export"), "drive.txt:1: usage: export FILE [N]");
  EXPECT_EQ(error_of("export a.3mf 9"), "drive.txt:1: usage: export FILE [N]");
  EXPECT_EQ(error_of("export a.npy 0"), "drive.txt:1: the voxels must be 1 to 65536, got 0");
  EXPECT_EQ(error_of("export a.npy 1.5"), "drive.txt:1: the voxels must be 1 to 65536, got 1.5");
  EXPECT_NE(error_of("export a.step").find("drive.txt:1: a.step: the name must end as"),
            std::string::npos);
  EXPECT_EQ(error_of("edges maybe"), "drive.txt:1: usage: edges on|off");
  EXPECT_EQ(error_of("zoom 1 2"), "drive.txt:1: usage: zoom STEPS [X Y]");
  EXPECT_EQ(error_of("resize 0 5"),
            "drive.txt:1: the window must be 1 to 16384 pixels wide and high, got 0 x 5");
  for (const char* colour : {"#f00", "red", "#ff0000", "#ff000080", "none"}) {
    EXPECT_EQ(error_of(std::string("colour solid ") + colour), "none") << colour;
  }
  EXPECT_EQ(error_of("colour @1 reddish")
                .find("drive.txt:1: the colour must be none, #rgb, #rrggbbaa or a colour, got "
                      "'reddish'; a colour is #rrggbb or one of black"),
            0u)
      << error_of("colour @1 reddish");
  EXPECT_NE(error_of("view sideways").find("drive.txt:1: unknown view 'sideways'"),
            std::string::npos);
  EXPECT_NE(error_of("section q=1").find("drive.txt:1: "), std::string::npos);
  EXPECT_NE(error_of("camera 1,2").find("drive.txt:1: "), std::string::npos);
  EXPECT_NE(error_of("scheme Mud").find("'Mud'"), std::string::npos);
  EXPECT_EQ(error_of("\npicture a.jpg"), "drive.txt:2: a.jpg: pictures are written as .png");
  EXPECT_EQ(error_of("screenshot a.tif"),
            "drive.txt:1: a.tif: pictures are written as .png; strata voxelize writes voxels");
  EXPECT_NE(error_of("projection fisheye").find("'fisheye'"), std::string::npos);
  for (const char* word : {"o", "p", "ortho", "orthographic", "perspective"}) {
    EXPECT_EQ(error_of(std::string("projection ") + word), "none");
  }
  EXPECT_NE(error_of("heat wave").find("off, wall, ray, thickness, depth"), std::string::npos);
  for (const char* word : {"wall", "ray", "thickness"}) {
    EXPECT_EQ(error_of(std::string("heat ") + word), "none");
  }
  EXPECT_NE(error_of("heat-range 3 2").find("must begin at 0 or more and rise, got 3 2"),
            std::string::npos);
  EXPECT_NE(error_of("distance 1 2 3").find("usage: distance X Y X Y"), std::string::npos);
  for (const char* word : {"0", "0.5", "1", "off"}) {
    EXPECT_EQ(error_of(std::string("opacity ") + word), "none");
  }
  EXPECT_NE(error_of("opacity 2").find("must be 0 to 1 or off, got '2'"), std::string::npos);
  EXPECT_EQ(error_of("technique mlab:8"), "none");
  EXPECT_EQ(error_of("media on"), "none");
  EXPECT_NE(error_of("media perhaps"), "none");
  EXPECT_NE(error_of("technique magic").find("no technique 'magic'"), std::string::npos);
}

TEST(Script, NothingIsAScript) {
  const auto script = parse_script("\n  \n# only talk\n#more", "x");
  ASSERT_TRUE(script);
  EXPECT_TRUE(script->empty());
}

TEST(Script, AMissingFileIsAnInputError) {
  const auto script = read_script("no/such/script.txt");
  ASSERT_FALSE(script);
  EXPECT_EQ(script.error().code, ErrorCode::kInput);
  EXPECT_NE(script.error().message.find("no/such/script.txt"), std::string::npos);
}

TEST(Script, TheHelpNamesEveryCommand) {
  const std::string help = script_help();
  std::istringstream lines(help);
  std::string line;
  int count = 0;
  while (std::getline(lines, line)) {
    ++count;
    std::istringstream words(line);
    std::string name;
    words >> name;
    // Without arguments each is known, whether or not it needs some.
    const auto script = parse_script(name, "x");
    if (!script) {
      EXPECT_EQ(script.error().message.find("unknown command"), std::string::npos) << name;
    }
  }
  EXPECT_GT(count, 25);
}

/// The lines of a help text as rows of a Markdown table. @param width  of the first column
std::vector<std::string> rows_of(const std::string& help, std::size_t width, const char* quote) {
  std::vector<std::string> rows;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    std::string name = line.substr(2, width);
    name.erase(name.find_last_not_of(' ') + 1);
    rows.push_back("| " + (quote + name + quote) + " | " + line.substr(2 + width) + " |");
  }
  return rows;
}

TEST(Script, TheDocumentHasTheKeysAndCommandsOfTheHelp) {
  std::ifstream file(STRATA_SOURCE_DIR "/docs/view.md");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  ASSERT_FALSE(text.empty());
  for (std::size_t at = 0; (at = text.find("\\|", at)) != std::string::npos;) text.erase(at, 1);
  std::vector<std::string> rows = rows_of(key_help(), 24, "");
  const std::vector<std::string> commands = rows_of(script_help(), 36, "`");
  rows.insert(rows.end(), commands.begin(), commands.end());
  EXPECT_GT(rows.size(), 60u);
  for (const std::string& row : rows) {
    EXPECT_NE(text.find("\n" + row + "\n"), std::string::npos) << row;
  }
}

}  // namespace
}  // namespace strata::view
