// What people know from openscad's command line: options, programs, views, and a file in the place
// of a command.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "tests/apps/strata/run_tool.h"

namespace strata {
namespace {

using nlohmann::json;
using testkit::RunOptions;
using testkit::RunResult;
using testkit::Workplace;

constexpr const char* kCube = "cube(size = [10, 10, 10], center = false);\n";
constexpr const char* kProgram =
    "x = 20;\nlabel = \"A\";\necho(label, x);\n"
    "difference() { cube([x, 10, 4]); translate([5, 5, -1]) cylinder(d = 4, h = 6, $fn = 24); }\n";

bool has_openscad() { return std::system("openscad --version > /dev/null 2>&1") == 0; }

class Openscad : public testing::Test {
 protected:
  Openscad() {
    place.write("part.csg", kCube);
    place.write("part.scad", kProgram);
  }
  /// A program of that name which is found first.
  void fake(const std::string& script) {
    place.write("openscad", "#!/bin/sh\n" + script);
    std::filesystem::permissions(place.path("openscad"), std::filesystem::perms::owner_all);
    with_fake.environment = {"PATH=" + place.path("") + ":" + std::getenv("PATH")};
  }
  void refuses(const std::vector<std::string>& arguments, const std::string& part) const {
    const auto before = place.names();
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_NE(run.err.find(part), std::string::npos) << run.err;
    EXPECT_EQ(place.names(), before);
  }
  [[nodiscard]] json camera_of(const std::vector<std::string>& arguments) const {
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.exit_code == 0 ? json::parse(run.out)["camera"] : json();
  }

  Workplace place;
  RunOptions with_fake;
};

TEST_F(Openscad, AFileInThePlaceOfACommandMeansCsg) {
  for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
           {"part.csg", "-o", "a.png", "--size=8,8"}, {"-o", "b.png", "--size=8,8", "part.csg"}}) {
    const RunResult run = place.run(words);
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
  EXPECT_FALSE(place.read("a.png").empty());
  EXPECT_EQ(place.read("a.png"), place.read("b.png"));
  EXPECT_EQ(place.run({"missing.csg", "-o", "c.png"}).exit_code, 3);
  refuses({"no_command", "-o", "c.png"}, "no such command 'no_command'");
  refuses({"-o", "c.png"}, "the command comes first");
}

TEST_F(Openscad, WithoutAnOutputTheReportIsPrinted) {
  const RunResult run = place.run({"csg", "part.csg"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  EXPECT_NE(run.out.find("volume           1000, exact"), std::string::npos) << run.out;
  EXPECT_EQ(place.run({"part.csg", "--summary"}).out, run.out);
  EXPECT_EQ(place.run({"part.csg", "--summary=all", "-o", "a.png"}).out, run.out);
  EXPECT_TRUE(place.has("a.png"));
}

TEST_F(Openscad, OptionsForProgramsAreHandedOn) {
  fake("printf '%s\\n' \"$@\" > words\necho 'cube([2,1,1]);' > \"$2\"\n");
  place.write("sets.json", "{\"parameterSets\": {\"wide\": {\"x\": \"40\"}}}");
  for (const char* command : {"csg", "info", "voxelize"}) {
    std::vector<std::string> words{command, "part.scad", "-D", "x=40", "-Dlabel=\"B\"",
                                   "-p",    "sets.json", "-P", "wide", "--check-parameters=true"};
    if (std::string_view(command) == "voxelize") words.insert(words.end(), {"-r", "4", "--stats"});
    const RunResult run = place.run(words, with_fake);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    const std::string handed = place.read("words");
    EXPECT_NE(handed.find("-D\nx=40\n-D\nlabel=\"B\"\n-p\nsets.json\n-P\nwide\n"
                          "--check-parameters\ntrue\n"),
              std::string::npos)
        << handed;
  }
  refuses({"part.csg", "-D", "x=40"}, "-D needs a .scad input");
  refuses({"part.scad", "-D", "x"}, "-D must be NAME=VALUE, got 'x'");
  refuses({"part.scad", "-P", "wide"}, "-p is missing");
  refuses({"part.scad", "-p", "none.json", "-P", "wide"}, "there is no such file");
  refuses({"part.scad", "-p", "sets.json", "-P", "narrow"}, "has no set of that name");
}

TEST_F(Openscad, OptionsThatCannotBeDoneSayWhatToUse) {
  for (const char* harmless : {"--preview", "--view=edges", "--export-format=png", "--csglimit=9",
                               "--render=cgal", "--hardwarnings"}) {
    const RunResult run = place.run({"part.csg", "-o", "a.png", "--size=8,8", harmless});
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
  refuses({"part.csg", "--preview=throwntogether"}, "strata view --ghosts");
  refuses({"part.csg", "--preview", "--render"}, "cannot be combined");
  refuses({"part.csg", "--view=axes"}, "openscad -o FILE.png --view axes");
  refuses({"part.csg", "--view=edges,wireframe"}, "--view edges");
  refuses({"part.csg", "--view=edge"}, "got 'edge'");
  refuses({"part.csg", "--export-format=stl"}, "strata voxelize");
  refuses({"part.csg", "--summary-file", "a.json"}, "use --json=a.json");
  refuses({"part.csg", "--summary=some"}, "--summary");
  refuses({"part.csg", "--measure=9", "-o", "a.png"}, "--measure needs --summary or --json");
  refuses({"part.csg", "--animate", "3", "-o", "a.png"}, "--animate needs a .scad input");
  refuses({"part.scad", "--animate", "0", "-o", "a.png"}, "--animate must be 1 to 99999, got 0");
  refuses({"part.scad", "--animate", "2", "-o", "-"}, "- is a stream");
  refuses({"part.scad", "--animate", "2"}, "--animate needs -o FILE.png");
}

TEST_F(Openscad, WarningsEndTheRunUnderHardwarnings) {
  fake("echo 'cube([2,1,1]);' > \"$2\"\necho 'WARNING: odd in file part.scad, line 2' >&2\n");
  EXPECT_EQ(place.run({"part.scad", "-o", "a.png"}, with_fake).exit_code, 0);
  const RunResult run = place.run({"part.scad", "-o", "b.png", "--hardwarnings"}, with_fake);
  EXPECT_EQ(run.exit_code, 5) << run.err;
  EXPECT_FALSE(place.has("b.png"));
}

TEST_F(Openscad, WhatAProgramEchoesIsPrinted) {
  fake("echo 'cube([2,1,1]);' > \"$2\"\nprintf 'ECHO: \"a\", 3\\033[2J\\nTRACE: x\\n' >&2\n");
  const RunResult run = place.run({"part.scad"}, with_fake);
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_EQ(run.err, "ECHO: \"a\", 3\\x1b[2J\n");
  EXPECT_EQ(place.run({"part.scad", "-q"}, with_fake).err, "");
  fake("echo 'cube([2,1,1]);' > \"$2\"\nseq -f 'ECHO: %g' 1234 >&2\n");
  const RunResult many = place.run({"part.scad"}, with_fake);
  EXPECT_EQ(std::count(many.err.begin(), many.err.end(), '\n'), 1001);
  EXPECT_TRUE(many.err.ends_with("ECHO: 1000\nECHO: [... 234 more lines]\n")) << many.err;
}

/// Also where nothing can be done about it any more.
TEST_F(Openscad, ItDiesWithTheTool) {
  fake("echo $$ > pid.new; mv pid.new pid; exec sleep 600\n");
  with_fake.while_running = [this](int tool) {
    for (int i = 0; i < 1000 && !place.has("pid"); ++i) usleep(10'000);
    kill(tool, SIGKILL);
  };
  const RunResult run = place.run({"part.scad", "-o", "a.png"}, with_fake);
  EXPECT_EQ(run.signal, SIGKILL);
  const int child = std::atoi(place.read("pid").c_str());
  ASSERT_GT(child, 1);
  const auto runs = [child] {  // what ended may wait for its new parent to look
    std::ifstream status("/proc/" + std::to_string(child) + "/stat");
    const std::string text{std::istreambuf_iterator<char>(status), {}};
    return text.find("(sleep) ") != std::string::npos &&
           text.find("(sleep) Z") == std::string::npos;
  };
  for (int i = 0; i < 1000 && runs(); ++i) usleep(10'000);
  EXPECT_FALSE(runs());
}

TEST_F(Openscad, RealProgramsTakeDefinitionsAndSets) {
  if (!has_openscad()) GTEST_SKIP() << "openscad is not installed";
  place.write("sets.json",
              "{\"parameterSets\": {\"wide\": {\"x\": \"60\"}}, \"fileFormatVersion\": \"1\"}");
  const auto width = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words{"info", "part.scad", "--json"};
    words.insert(words.end(), more.begin(), more.end());
    const RunResult run = place.run(words);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return json::parse(run.out)["files"][0]["bounds"]["high"][0].get<double>();
  };
  EXPECT_NEAR(width({}), 20, 0.3);
  EXPECT_NEAR(width({"-D", "x=40"}), 40, 0.3);
  place.write("commented.scad", "x = 20; // [5:50]\ncube(x);");
  EXPECT_EQ(place.run({"part.scad", "-D", "label=\"B\"", "-q"}).exit_code, 0);
  EXPECT_EQ(place.run({"part.scad", "-D", "label=\"B\""}).err, "ECHO: \"B\", 20\n");
  const RunResult wide =
      place.run({"info", "commented.scad", "-p", "sets.json", "-P", "wide", "--json"});
  EXPECT_NEAR(json::parse(wide.out)["files"][0]["volume"].get<double>(), 216'000, 30);
}

/// As `openscad -o x.png` of 2021.01: what is not set is (55, 0, 25) and 140 from the origin, and
/// nothing is fitted.
TEST_F(Openscad, ProgramsPlaceTheCamera) {
  if (!has_openscad()) GTEST_SKIP() << "openscad is not installed";
  const auto camera = [&](const std::string& variables, std::vector<std::string> more = {}) {
    place.write("view.scad", "// $vpd = 77;\n" + variables + "\ncube([20, 10, 4]);");
    std::vector<std::string> words{"view.scad", "--json", "--strict"};
    words.insert(words.end(), more.begin(), more.end());
    return camera_of(words);
  };
  const json all = camera("$vpr = [90, 0, 0]; $vpt = [0, 0, 2]; $vpd = 60; $vpf = 30;");
  EXPECT_EQ(all["rotation"], json({90.0, 0.0, 0.0}));
  EXPECT_EQ(all["target"], json({0.0, 0.0, 2.0}));
  EXPECT_EQ(all["distance"], 60.0);
  EXPECT_EQ(all["field_of_view"], 30.0);
  const json distance = camera("$vpd = 60;");
  EXPECT_EQ(distance["rotation"], json({55.0, 0.0, 25.0}));
  EXPECT_EQ(distance["target"], json({0.0, 0.0, 0.0}));
  EXPECT_EQ(distance["distance"], 60.0);
  // The values that openscad's variables have where a program does not set them.
  EXPECT_EQ(camera("$vpr = [0, 0, 0];")["rotation"], json({0.0, 0.0, 0.0}));
  EXPECT_EQ(camera("$vpr = [0, 0, 0];")["distance"], 140.0);
  EXPECT_EQ(camera("$vpd = 500;")["distance"], 500.0);
  EXPECT_EQ(camera("$vpr = [30 + 15, 10];")["rotation"], json({45.0, 10.0, 0.0}));
  // Without one all is fitted, and --camera overrules the program.
  EXPECT_NE(camera("module m() { $vpd = 500; }")["distance"], 500.0);
  EXPECT_EQ(camera("$vpd = 60;", {"--camera=1,2,3,0,0,0,99"})["distance"], 99.0);
  const RunResult told = place.run({"view.scad", "--view-all", "-o", "a.png"});
  EXPECT_NE(told.err.find("--view-all and --auto-center have no effect"), std::string::npos);
}

TEST_F(Openscad, AnAnimationIsNumberedAsOpenscadNumbersIt) {
  if (!has_openscad()) GTEST_SKIP() << "openscad is not installed";
  place.write("turn.scad", "rotate(90 * $t) cube([20, 10, 4]);");
  const RunResult run = place.run(
      {"turn.scad", "--animate=3", "-o", "a.png", "--size=40,40", "--camera=0,0,0,0,0,0,90"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_FALSE(place.has("a00003.png"));
  place.write("still.scad", "rotate(60) cube([20, 10, 4]);");
  ASSERT_EQ(
      place.run({"still.scad", "-o", "b.png", "--size=40,40", "--camera=0,0,0,0,0,0,90"}).exit_code,
      0);
  EXPECT_EQ(place.read("a00002.png"), place.read("b.png"));
  EXPECT_NE(place.read("a00000.png"), place.read("a00001.png"));
  RunOptions options;
  options.while_running = [this](int tool) {
    for (int i = 0; i < 3000 && !place.has("long00001.png"); ++i) usleep(10'000);
    kill(tool, SIGTERM);
  };
  const RunResult cut =
      place.run({"turn.scad", "--animate=9000", "-o", "long.png", "--size=9,9"}, options);
  EXPECT_EQ(cut.exit_code, 130) << cut.err;
  EXPECT_NE(cut.err.find("interrupted; complete outputs are kept"), std::string::npos) << cut.err;
}

}  // namespace
}  // namespace strata
