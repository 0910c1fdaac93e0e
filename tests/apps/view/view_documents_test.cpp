// Files, tabs, parameters and what the window tells, under Xvfb.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/apps/view/window_fixture.h"

namespace strata::testkit {
namespace {

/// The text behind `"name": ` in a line of JSON, up to the next comma or brace.
std::string member(const std::string& json, const std::string& name, std::size_t from = 0) {
  const std::string key = "\"" + name + "\": ";
  const std::size_t at = json.find(key, from);
  if (at == std::string::npos) return "missing";
  const std::size_t begin = at + key.size();
  return json.substr(begin, json.find_first_of(",}", begin) - begin);
}

class Documents : public Window {
 protected:
  RunResult empty(const std::string& script, std::vector<std::string> arguments = {}) {
    place_.write("drive.txt", script);
    std::vector<std::string> words = {"view", "--script", "drive.txt", "--size", "900,600"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return place_.run(words, options());
  }
  static bool has_openscad() { return std::system("openscad --version > /dev/null 2>&1") == 0; }
};

TEST_F(Documents, AWindowWithoutAFileSaysWhatToDo) {
  RunResult run = empty("screenshot empty.png\npanels off\nscreenshot bare.png\nkey ctrl+q\n");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  const Image image = image_of(place_, "bare.png");
  ASSERT_EQ(image.width, 900);
  int words = 0;
  for (int u = 200; u < 700; ++u) {
    for (int v = 250; v < 350; ++v) words += image.at(u, v)[0] != image.at(5, 5)[0] ? 1 : 0;
  }
  EXPECT_GT(words, 1000);  // the box in the middle
  run = empty("stats\nundo\nview all\nkey ctrl+w\npick 5 5\nreload\nexport a.png\n");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("drive.txt:7: nothing is loaded"), std::string::npos) << run.err;
  EXPECT_EQ(empty("numbers\n").exit_code, 2);
  EXPECT_EQ(empty("quit\n", {"--expr", "a - b"}).exit_code, 2);
}

TEST_F(Documents, FilesAreOpenedAsTabsThatKeepTheirViews) {
  place_.write("other.csg", "sphere($fn = 40, r = 7);\n");
  const RunResult run = empty(
      "panels off\naxes off\nopen part.csg\npicture part.png\ncamera 1,2,0,70,0,200,60\n"
      "section z=1\npicture cut.png\n"
      "open other.csg\npicture other.png\nstats\n"
      "tab previous\npicture again.png\nstats\n"
      "key ctrl+tab\npicture forth.png\n"
      "open part.csg\npicture reloaded.png\n"  // is there already
      "tab close\npicture left.png\ntab 1\ntab close\nwait 0.5\npicture "
      "nothing.png\nstats\nquit\n");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(image_of(place_, "part.png"), csg({"--size", "900,600"}));
  EXPECT_EQ(image_of(place_, "again.png"), image_of(place_, "cut.png"));
  EXPECT_EQ(image_of(place_, "reloaded.png"), image_of(place_, "cut.png"));
  EXPECT_EQ(image_of(place_, "forth.png"), image_of(place_, "other.png"));
  EXPECT_EQ(image_of(place_, "left.png"), image_of(place_, "other.png"));
  const Image cut = image_of(place_, "cut.png");
  EXPECT_GT(different(cut, image_of(place_, "other.png"), 900, 600), 5000);
  EXPECT_GT(different(image_of(place_, "other.png"), image_of(place_, "nothing.png"), 900, 600),
            5000);
  const Image nothing = image_of(place_, "nothing.png");
  int others = 0;
  for (int v = 0; v < 600; ++v) {
    for (int u = 0; u < 900; ++u) {
      others += std::equal(nothing.at(u, v), nothing.at(u, v) + 3, nothing.at(0, 0)) ? 0 : 1;
    }
  }
  EXPECT_EQ(others, 0);  // the background alone
  EXPECT_EQ(member(run.out, "solids"), "1");
  EXPECT_EQ(member(run.out, "solids", run.out.find('\n')), "4");
  EXPECT_EQ(member(run.out, "solids", run.out.rfind("renderer")), "0");
  EXPECT_EQ(empty("open part.csg\ntab 3\n").exit_code, 2);
}

TEST_F(Documents, ABadFileEndsTheScriptThatOpensIt) {
  place_.write("bad.csg", "cube(size = [1, 1);\n");
  place_.write("broken.vdb", "no vdb");
  for (const auto& [name, why] :
       {std::pair("bad.csg", "bad.csg:1:"), std::pair("broken.vdb", "broken.vdb: byte 0"),
        std::pair("none.stl", "none.stl: ")}) {
    const RunResult run = view(std::string("open ") + name + "\nprint still here\nquit\n",
                               {"--no-panels", "--size", "400,300"});
    EXPECT_EQ(run.exit_code, 3) << name;
    EXPECT_EQ(run.out, "") << name;
    const std::size_t first = run.err.find(why);
    EXPECT_NE(run.err.find(std::string("drive.txt:1: ") + why), std::string::npos) << run.err;
    EXPECT_EQ(run.err.find(why, first + 1), std::string::npos) << run.err;  // once
  }
  const RunResult run = view("print ready\nwait 0.5\nreload\nprint still here\n",
                             {"--no-panels", "--size", "400,300"},
                             [this](int) { place_.write("part.csg", "cube(size = [1, 1);\n"); });
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_EQ(run.out.find("still here"), std::string::npos) << run.out;
}

TEST_F(Documents, TheCameraComesFromAFile) {
  place_.write("eye.txt", "target 1 2 0\nrotation 70 0 200\ndistance 60\n");
  const RunResult run = view(
      "axes off\npicture from.png\ncamera 1,2,0,70,0,200,60\npicture set.png\n"
      "quit\n",
      {"--no-panels", "--size", "400,300", "--camera-file", "eye.txt"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(image_of(place_, "from.png"), image_of(place_, "set.png"));
  EXPECT_EQ(image_of(place_, "from.png"), csg({"--size", "400,300", "--camera-file=eye.txt"}));
  EXPECT_EQ(view("quit\n", {"--camera-file", "none.txt"}).exit_code, 2);
}

TEST_F(Documents, UnattendedWindowsHaveTheirOwnSize) {
  std::filesystem::create_directories(place_.path("state/strata"));
  place_.write("state/strata/window-size", "700 500\n");
  const RunResult run = view("screenshot all.png\nquit\n");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(image_of(place_, "all.png").width, 1280);
  EXPECT_EQ(place_.read("state/strata/window-size"), "700 500\n");
}

TEST_F(Documents, RecentFilesAreRemembered) {
  place_.write("other.csg", "sphere($fn = 40, r = 7);\n");
  ASSERT_EQ(empty("open part.csg\nopen other.csg\nopen part.csg\nquit\n").exit_code, 0);
  ASSERT_EQ(empty("open no.csg\n").exit_code, 3);
  const std::string list = place_.read("state/strata/recent-files");
  const std::size_t other = list.find("other.csg"), part = list.find("part.csg");
  ASSERT_NE(other, std::string::npos) << list;
  ASSERT_NE(part, std::string::npos) << list;
  EXPECT_EQ(list.find("no.csg"), std::string::npos);
  ASSERT_EQ(view("", {"--screenshot", "x.png"}).exit_code, 0);
  EXPECT_EQ(place_.read("state/strata/recent-files"), list);
}

TEST_F(Documents, UndoBringsSectionsAndCamerasBack) {
  const RunResult run = view(
      "axes off\npicture a.png\nsection z=1\npicture b.png\nview front\npicture c.png\n"
      "hide sphere\npicture d.png\n"
      "key ctrl+z\npicture c2.png\nundo\npicture b2.png\nundo\npicture a2.png\nundo\n"
      "key ctrl+shift+z\nredo\nredo\npicture d2.png\nredo\n"
      "drag left 100 100 150 120\nundo\npicture d3.png\nquit\n",
      {"--no-panels", "--size", "300,200"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  for (const char* name : {"a", "b", "c", "d"}) {
    const std::string one = name;
    EXPECT_EQ(image_of(place_, one + ".png"), image_of(place_, one + "2.png")) << name;
  }
  EXPECT_EQ(image_of(place_, "d.png"), image_of(place_, "d3.png"));
  EXPECT_GT(different(image_of(place_, "a.png"), image_of(place_, "c.png"), 300, 200), 500);
}

TEST_F(Documents, NumbersAreThoseOfWhatIsNotHidden) {
  place_.write("part.csg",
               "cube(size = [20, 10, 5]);\nmultmatrix([[1,0,0,50],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) "
               "sphere($fn = 8, r = 3);\n");
  const RunResult run = view("hide sphere\nsection z=1\nmaterial steel\nnumbers\nquit\n");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NEAR(std::stod(member(run.out, "volume")), 1000, 1e-3) << run.out;
  EXPECT_NEAR(std::stod(member(run.out, "area")), 700, 1e-3);
  EXPECT_NEAR(std::stod(member(run.out, "weight_g")), 7.85, 1e-5);
  EXPECT_EQ(member(run.out, "size_x"), "20");
  EXPECT_EQ(member(run.out, "open_holes"), "0");
}

TEST_F(Documents, TheEditorIsStartedAtTheLineOfThePickedSolid) {
  place_.write("edit me", "#!/bin/sh\nprintf '%s\\n' \"$@\" > edited.tmp\nmv edited.tmp edited\n");
  ASSERT_EQ(::chmod(place_.path("edit me").c_str(), 0755), 0);
  const RunResult run = view("view top\nprojection o\nview all\nclick 150 100\nedit\nquit\n",
                             {"--no-panels", "--size", "300,200", "--editor",
                              "'" + place_.path("edit me") + "' -x %l '%f; true'"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  await("edited");
  const std::string words = place_.read("edited");
  EXPECT_EQ(words.find("-x\n2\n/"), 0u) << words;
  EXPECT_NE(words.find("/part.csg; true\n"), std::string::npos) << words;
  EXPECT_EQ(view("edit\n", {"--editor", "x"}).exit_code, 2);  // nothing is picked
  const RunResult none = view("click 300 300\nedit\n");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.err.find("--editor"), std::string::npos) << none.err;
}

TEST_F(Documents, OverlaysShowAndGo) {
  const RunResult run = view(
      "screenshot plain.png\nkeys on\nscreenshot keys.png\nkey escape\nscreenshot keys_gone.png\n"
      "dialog .\nscreenshot dialog.png\nkey escape\nscreenshot dialog_gone.png\n"
      "look light\nscreenshot light.png\nlook dark\n"
      "console on\nscreenshot console.png\nkey c\nscreenshot console_gone.png\nquit\n",
      {"--size", "900,600"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Image plain = image_of(place_, "plain.png");
  // What the side panel measures may come later.
  for (const char* name : {"keys", "dialog", "light", "console"}) {
    EXPECT_GT(different(plain, image_of(place_, std::string(name) + ".png"), 900, 600), 5000)
        << name;
  }
  for (const char* name : {"keys_gone", "dialog_gone", "console_gone"}) {
    EXPECT_EQ(different(plain, image_of(place_, std::string(name) + ".png"), 590, 560), 0) << name;
  }
}

TEST_F(Documents, ParametersRunOpenscadAgain) {
  if (!has_openscad()) GTEST_SKIP() << "no openscad";
  place_.write("box.scad",
               "width = 20; // [5:50]\nlid = false;\nname = \"a\";\necho(width, name);\n"
               "cube([width, 10, 5]);\nif (lid) translate([0, 0, 9]) cube(3);\nmodule m() {}\n");
  place_.write("sets.json", R"({"parameterSets": {"wide": {"width": "44", "lid": "true"}}})");
  const RunResult run = empty(
      "open box.scad\nnumbers\nparameter width 30\nnumbers\nmessages\n"
      "parameters load sets.json wide\nnumbers\nparameter name \"x y\"\n"
      "parameters save mine.json \"my set\"\nmessages\n"
      "parameters reset\nnumbers\nparameter width 7\nparameter width 8\nnumbers\nquit\n");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  std::vector<std::string> widths;
  for (std::size_t at = 0; (at = run.out.find("size_x", at)) != std::string::npos; ++at) {
    widths.push_back(member(run.out, "size_x", at - 1));
  }
  EXPECT_EQ(widths, (std::vector<std::string>{"20", "30", "44", "20", "8"})) << run.out;
  EXPECT_NE(run.out.find("ECHO: 30, \"a\"\n"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("ECHO: 44, \"x y\"\n"), std::string::npos) << run.out;
  const std::string saved = place_.read("mine.json");
  for (const char* text :
       {"\"my set\"", "\"width\": \"44\"", "\"lid\": \"true\"", "\"name\": \"x y\""}) {
    EXPECT_NE(saved.find(text), std::string::npos) << saved;
  }
  // OpenSCAD reads what was saved.
  EXPECT_EQ(place_.run({"csg", "box.scad", "-p", "mine.json", "-P", "my set", "--json"})
                    .out.find("\"high\": [44, 10, 12]") == std::string::npos,
            false);
  const RunResult wrong = empty("open box.scad\nparameter width wide\n");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err.find("drive.txt:2: the parameter width must be a number, got 'wide'"),
            std::string::npos)
      << wrong.err;
  EXPECT_EQ(empty("open box.scad\nparameter high 3\n").exit_code, 2);
}

TEST_F(Documents, TheCommandLinesParametersAreThoseOfTheWindow) {
  if (!has_openscad()) GTEST_SKIP() << "no openscad";
  place_.write("box.scad", "width = 20;\ndeep = 4;\ncube([width, deep, 5]);\n");
  place_.write("sets.json", R"({"parameterSets": {"wide": {"width": "44"}}})");
  place_.write("drive.txt",
               "numbers\nparameter deep 6\nnumbers\nparameters reset\nnumbers\nquit\n");
  for (const std::vector<std::string>& given :
       {std::vector<std::string>{"-p", "sets.json", "-P", "wide"}, {"-D", "width=44"}}) {
    std::vector<std::string> words = {"view", "box.scad", "--script", "drive.txt"};
    words.insert(words.end(), given.begin(), given.end());
    const RunResult run = place_.run(words, options());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const std::size_t second = run.out.find('\n'), third = run.out.find('\n', second + 1);
    EXPECT_EQ(member(run.out, "size_x"), "44");
    EXPECT_EQ(member(run.out, "size_x", second), "44");
    EXPECT_EQ(member(run.out, "size_y", second), "6");
    EXPECT_EQ(member(run.out, "size_x", third), "20");
    EXPECT_EQ(member(run.out, "size_y", third), "4");
  }
}

TEST_F(Documents, FingersMoveSidewaysAndZoomUpwards) {
  const RunResult run = view(
      "axes off\npicture a.png\nscroll 0 2.5\npicture zoomed.png\nscroll 0 -2.5\npicture b.png\n"
      "scroll 1.5 0.2\npicture moved.png\nscroll -1.5 0\npicture c.png\n"
      "scroll 1 2 shift\npicture shifted.png\nscroll -1 -2 shift\npicture d.png\nquit\n",
      {"--no-panels", "--size", "300,200"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Image before = image_of(place_, "a.png");
  for (const char* name : {"zoomed", "moved", "shifted"}) {
    EXPECT_GT(different(before, image_of(place_, std::string(name) + ".png"), 300, 200), 1000)
        << name;
  }
  // There and back again, but for rounding.
  for (const char* name : {"b", "c", "d"}) {
    EXPECT_LT(different(before, image_of(place_, std::string(name) + ".png"), 300, 200), 1500)
        << name;
  }
}

}  // namespace
}  // namespace strata::testkit
