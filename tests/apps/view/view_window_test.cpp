// The window under Xvfb, driven by scripts, through the executable that people start.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <glm/geometric.hpp>
#include <string>
#include <utility>
#include <vector>

#include "strata/mesh/formats/read_mesh.h"
#include "tests/apps/strata/run_tool.h"
#include "tests/apps/view/window_fixture.h"

namespace strata::testkit {
namespace {

TEST_F(Window, ShowsThePicturesOfStrataCsg) {
  const RunResult run = view(
      "axes off\n"
      "screenshot plain.png\n"
      "edges on\npicture edges.png\nedges off\n"
      "camera 1,2,0,70,0,200,60\npicture camera.png\n"
      "section z=1\npicture section.png\nsection off\n"
      "projection orthographic\nscheme Nature\npicture ortho.png\n"
      "quit\n",
      {"--size", "403,301", "--no-panels"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string size = "403,301";
  EXPECT_EQ(image_of(place_, "plain.png"), csg({"--size", size}));
  EXPECT_EQ(image_of(place_, "edges.png"), csg({"--size", size, "--edges"}));
  const std::string camera = "--camera=1,2,0,70,0,200,60";
  EXPECT_EQ(image_of(place_, "section.png"), csg({"--size", size, camera, "--cut", "z=1"}));
  EXPECT_EQ(image_of(place_, "camera.png"), csg({"--size", size, camera}));
  EXPECT_EQ(image_of(place_, "ortho.png"),
            csg({"--size", size, camera, "--projection", "o", "--colorscheme", "Nature"}));
}

TEST_F(Window, WhoeverFindsTheSurfacesThePictureIsTheSame) {
  const RunResult run = view("axes off\norbit 40 -20\npicture gl.png\nstats\nquit\n",
                             {"--size", "203,151", "--no-panels", "--backend", "gl"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  // Or the CPU, and why.
  EXPECT_TRUE(run.out.find("\"renderer\": \"GPU\"") != std::string::npos ||
              run.out.find("\"renderer\": \"CPU (") != std::string::npos)
      << run.out;
  ASSERT_EQ(view("axes off\norbit 40 -20\npicture cpu.png\nquit\n",
                 {"--size", "203,151", "--no-panels", "--backend", "cpu"})
                .exit_code,
            0);
  EXPECT_EQ(image_of(place_, "gl.png"), image_of(place_, "cpu.png"));
}

TEST_F(Window, AContextThatIsLostIsTheCpusToReplace) {
  const std::vector<std::string> size{"--size", "203,151", "--no-panels"};
  const std::string script =
      "axes off\npicture a.png\norbit 40 -20\npicture b.png\npick 100 70\nstats\nquit\n";
  const auto run_with = [&](const char* backend) {
    std::vector<std::string> arguments = size;
    arguments.insert(arguments.end(), {"--backend", backend});
    return view(script, arguments);
  };
  ASSERT_EQ(run_with("cpu").exit_code, 0);
  const Image first = image_of(place_, "a.png"), second = image_of(place_, "b.png");
  // While it is tried, in the first picture, in a later one, and in a pick.
  int lost = 0;
  for (const int at : {1, 6, 11, 14, 17, 20, 23, 26, 30, 35}) {
    fault_ = "lose-context=" + std::to_string(at);
    const RunResult run = run_with("gl");
    ASSERT_EQ(run.exit_code, 0) << fault_ << ": " << run.err;
    EXPECT_EQ(image_of(place_, "a.png"), first) << fault_;
    EXPECT_EQ(image_of(place_, "b.png"), second) << fault_;
    const std::size_t said = run.out.find("context was lost");
    const bool by_gpu = run.out.find("\"renderer\": \"GPU\"") != std::string::npos;
    EXPECT_EQ(said == std::string::npos, by_gpu) << fault_ << ": " << run.out;
    lost += by_gpu ? 0 : 1;
  }
  EXPECT_GT(lost, 3);
  fault_ = "refuse-shader=csg/gl/walk.comp";
  const RunResult refused = run_with("gl");
  ASSERT_EQ(refused.exit_code, 0) << refused.err;
  EXPECT_EQ(image_of(place_, "b.png"), second);
  EXPECT_NE(refused.out.find("refuses a shader"), std::string::npos) << refused.out;
}

TEST_F(Window, LeavesThePictureAloneWhereNothingLiesOnIt) {
  const RunResult run =
      view("screenshot window.png\npicture picture.png\nquit\n", {"--size", "1000,700"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Image window = image_of(place_, "window.png"), picture = image_of(place_, "picture.png");
  EXPECT_EQ(window.width, 1000);
  EXPECT_EQ(window.height, 700);
  ASSERT_LT(picture.width, 1000);
  ASSERT_LT(picture.height, 700);
  EXPECT_EQ(picture,
            csg({"--size", std::to_string(picture.width) + "," + std::to_string(picture.height)}));
  // The axes stand in the lower left corner.
  EXPECT_EQ(different(window, picture, picture.width, picture.height - 120), 0);
  EXPECT_GT(different(window, picture, picture.width, picture.height), 50);
}

TEST_F(Window, TheMouseTurnsMovesAndZooms) {
  const RunResult run = view(
      "axes off\n"
      "picture before.png\n"
      "drag left 200 150 260 130\npicture turned.png\n"
      "drag left 260 130 200 150\npicture back.png\n"
      "drag right 100 100 130 120\npicture moved.png\n"
      "drag right 130 120 100 100\nzoom 3\npicture nearer.png\n"
      "view reset\npicture reset.png\n"
      "key ctrl+8\npicture front.png\n"
      "view left\nview front\npicture front2.png\nquit\n",
      {"--no-panels", "--size", "400,300"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Image before = image_of(place_, "before.png");
  for (const char* changed : {"turned.png", "moved.png", "nearer.png", "front.png"}) {
    EXPECT_GT(different(before, image_of(place_, changed), 400, 300), 1000) << changed;
  }
  // There and back again: angles are sums of rounded numbers.
  EXPECT_LT(different(before, image_of(place_, "back.png"), 400, 300), 40);
  EXPECT_EQ(before, image_of(place_, "reset.png"));
  EXPECT_EQ(image_of(place_, "front.png"), image_of(place_, "front2.png"));
}

TEST_F(Window, PicksSolidTriangleAndPlace) {
  const RunResult run = view(
      "view top\nprojection orthographic\nview all\n"
      "pick 200 150\n"
      "pick 2 2\n"
      "click 200 150\n"
      "hide cube\nshow @0\npick 200 150\n"
      "quit\n",
      {"--no-panels", "--size", "400,300"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out.find("pick 200 150: cube at part.csg:2:1, triangle "), 0u) << run.out;
  EXPECT_NE(run.out.find(" 3\npick 2 2: nothing\n"), std::string::npos) << run.out;
}

TEST_F(Window, HiddenSolidsAndColoursShow) {
  const RunResult run = view(
      "axes off\npicture before.png\n"
      "hide sphere\npicture hidden.png\n"
      "show all\npicture shown.png\n"
      "colour @0 #ff0000\npicture red.png\n"
      "colour @0 none\npicture none.png\n"
      "ghosts on\npicture ghosts.png\nghosts off\n"
      "heat thickness\npicture thickness.png\nheat depth\npicture depth.png\nheat off\n"
      "opacity 0.4\npicture glass.png\ntechnique weighted-sum\npicture sum.png\nopacity off\n"
      "picture after.png\nquit\n",
      {"--no-panels", "--size", "300,200"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Image before = image_of(place_, "before.png");
  for (const char* changed : {"hidden.png", "red.png", "ghosts.png", "thickness.png", "depth.png",
                              "glass.png", "sum.png"}) {
    EXPECT_GT(different(before, image_of(place_, changed), 300, 200), 200) << changed;
  }
  for (const char* same : {"shown.png", "none.png", "after.png"}) {
    EXPECT_EQ(before, image_of(place_, same)) << same;
  }
}

TEST_F(Window, ASectionIsDragged) {
  // What can be seen lies between z = -3 and 7: the section's arrow begins in the middle.
  const RunResult run = view(
      "axes off\nview front\nprojection orthographic\nview all\nsection z=2\n"
      "picture before.png\n"
      "drag left 200 150 200 190\npicture moved.png\n"
      "section z=2\npicture again.png\n"
      "drag left 20 20 20 60\npicture turned.png\nquit\n",
      {"--no-panels", "--size", "400,300"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Image before = image_of(place_, "before.png");
  EXPECT_GT(different(before, image_of(place_, "moved.png"), 400, 300), 500);
  EXPECT_EQ(before, image_of(place_, "again.png"));  // the camera has not turned
  EXPECT_GT(different(before, image_of(place_, "turned.png"), 400, 300), 500);
}

TEST_F(Window, ResizesAndClosesOnScreenshot) {
  const RunResult run = view("axes off\nresize 500 260\nresize 333 444\n",
                             {"--no-panels", "--size", "400,300", "--screenshot", "last.png"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Image last = image_of(place_, "last.png");
  EXPECT_EQ(last.width, 333);
  EXPECT_EQ(last.height, 444);
}

TEST_F(Window, ASmallWindowShowsThePictureInPlaceOfCutPanels) {
  const RunResult run = view(
      "axes off\nresize 900 500\npicture large.png\nresize 300 200\npicture small.png\n"
      "screenshot all.png\nresize 460 300\npicture half.png\nquit\n",
      {"--size", "300,200"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(image_of(place_, "large.png").width, 600);  // beside the panel
  EXPECT_EQ(image_of(place_, "small.png").width, 300);
  EXPECT_EQ(image_of(place_, "all.png").width, 300);
  EXPECT_EQ(image_of(place_, "half.png").width, 230);
}

TEST_F(Window, WatchesFilesAndKeepsTheCamera) {
  const RunResult run = view(
      "axes off\ncamera 1,2,0,70,0,200,60\npicture before.png\n"
      "wait reload\npicture broken.png\nscreenshot error.png\nstats\n"
      "wait reload\npicture after.png\nstats\nquit\n",
      {"--no-panels", "--size", "400,300", "--watch"}, [this](int) {
        await("before.png");
        place_.write("part.csg", "cube(size = [1, 1);\n");
        await("error.png");
        place_.write("part.csg", "sphere($fn = 40, r = 7);\n");
      });
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(image_of(place_, "before.png"), image_of(place_, "broken.png"));  // still the old one
  EXPECT_NE(run.out.find("part.csg:1:"), std::string::npos) << run.out;
  // The message lies on the picture.
  EXPECT_GT(different(image_of(place_, "error.png"), image_of(place_, "broken.png"), 400, 300),
            500);
  const std::size_t last = run.out.rfind("\"error\": ");
  EXPECT_EQ(run.out.substr(last, 12), "\"error\": \"\"}") << run.out;
  EXPECT_EQ(image_of(place_, "after.png"),
            csg({"--size", "400,300", "--camera=1,2,0,70,0,200,60"}));
}

TEST_F(Window, ASceneThatCannotBeReadIsShownAndIsTheExitCode) {
  place_.write("part.csg", "cube(size = [1, 1);\n");
  const RunResult run = view("", {"--size", "400,300", "--screenshot", "error.png"});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE(run.err.find("part.csg:1:"), std::string::npos) << run.err;
  EXPECT_TRUE(place_.has("error.png"));
}

TEST_F(Window, TheKeyOfAScreenshotIsWaitedFor) {
  const RunResult run = view("key ctrl+s\nquit\n", {"--size", "400,300"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(image_of(place_, "strata-view-1.png").width, 400);
}

TEST_F(Window, AMessageOfTheWindowIsOnStandardErrorWhileItIsOpen) {
  place_.write("part.csg", "cube(size = [1, 1);\n");
  const RunResult run = view("wait\nprint still here\nwait 0.2\nquit\n", {"--size", "400,300"});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE(run.out.find("still here"), std::string::npos);
  const std::size_t first = run.err.find("part.csg:1:");
  EXPECT_NE(first, std::string::npos) << run.err;
  EXPECT_EQ(run.err.find("part.csg:1:", first + 1), std::string::npos) << run.err;  // once
}

TEST_F(Window, WhatIsSeenIsExported) {
  const RunResult run = view(
      "hide sphere\nsection z=1\nexport part.ply\nexport part.npy 20\nsection off\n"
      "axes off\nexport shown.png\npicture expected.png\nquit\n",
      {"--size", "300,200", "--no-panels"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("export part.ply: "), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("export part.npy: 20 x 20 x 4 voxels, "), std::string::npos) << run.out;
  EXPECT_EQ(image_of(place_, "shown.png"), image_of(place_, "expected.png"));
  const auto mesh = read_mesh(place_.path("part.ply"));
  ASSERT_TRUE(mesh) << mesh.error().message;
  double volume = 0;
  for (const glm::uvec3& t : mesh->soup.triangles) {
    const auto& p = mesh->soup.positions;
    volume += glm::dot(p[t.x], glm::cross(p[t.y], p[t.z])) / 6;
  }
  const double hole = 12 * 9 * std::sin(2 * 3.14159265358979 / 24);  // 24 corners, radius 3
  EXPECT_NEAR(volume, 4 * (400 - hole), 1e-3);
}

TEST_F(Window, AnExportDoesNotOverwriteWhatIsRead) {
  place_.write("box.off",
               "OFF\n4 4 0\n0 0 0\n9 0 0\n0 9 0\n0 0 9\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
  const std::string before = place_.read("box.off");
  place_.write("part.csg", "import(file = \"box.off\");");
  const RunResult run = view("export box.off\nquit\n");
  EXPECT_EQ(run.exit_code, 2) << run.err;
  EXPECT_NE(run.err.find("would overwrite a file of the scene, box.off"), std::string::npos)
      << run.err;
  EXPECT_EQ(place_.read("box.off"), before);
}

TEST_F(Window, MistakesOfScriptsNameFileAndLine) {
  RunResult run = view("wait\nhide \"no such solid\"\n");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(run.err, "strata view: error: drive.txt:2: no solid has 'no such solid' in its name\n");
  run = view("\nscreenshot no/such/folder/x.png\n");
  EXPECT_EQ(run.exit_code, 4);
  EXPECT_NE(run.err.find("drive.txt:2: no/such/folder/x.png"), std::string::npos) << run.err;
  run = view("key hyper+q\n");
  EXPECT_EQ(run.exit_code, 2);
  run = view("jump\n");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(run.err, "strata view: error: drive.txt:1: unknown command 'jump'\n");
}

TEST(WithoutDisplay, IsASentence) {
  Workplace place;
  place.write("part.csg", kScene);
  RunOptions options;
  options.environment = {"DISPLAY=", "WAYLAND_DISPLAY="};
  const RunResult run = place.run({"view", "part.csg"}, options);
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(run.err.find("strata view: error: no window"), 0u) << run.err;
  EXPECT_NE(run.err.find("strata csg draws pictures without a window"), std::string::npos);
}

TEST(WithoutDisplay, HelpAndMistakesNeedNone) {
  Workplace place;
  RunOptions options;
  options.environment = {"DISPLAY=", "WAYLAND_DISPLAY="};
  RunResult run = place.run({"view", "--help"}, options);
  EXPECT_EQ(run.exit_code, 0);
  for (const char* word : {"--watch", "ctrl+4", "section PLANE", "screenshot FILE.png"}) {
    EXPECT_NE(run.out.find(word), std::string::npos) << word;
  }
  run = place.run({"view", "--version"}, options);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out, "strata-view" + place.run({"--version"}).out.substr(6));
  run = place.run({"view"}, options);
  EXPECT_EQ(run.exit_code, 2);
  for (const auto& [option, value] :
       {std::pair("--look", "pink"), std::pair("--editor", "'open"), std::pair("--editor", " ")}) {
    run = place.run({"view", "a.csg", option, value}, options);
    EXPECT_EQ(run.exit_code, 2) << option;
    EXPECT_NE(run.err.find(option), std::string::npos) << run.err;
    EXPECT_EQ(run.err.find("no window"), std::string::npos) << run.err;
  }
  run = place.run({"view", "a.csg", "--size", "x"}, options);
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(run.err.find("strata view: error: "), 0u) << run.err;
}

TEST(WithoutDisplay, NoFileIsWrittenThatIsReadOrThatIsWrittenAlready) {
  Workplace place;
  RunOptions options;
  options.environment = {"DISPLAY=", "WAYLAND_DISPLAY="};
  const auto says = [&](const std::string& script, std::vector<std::string> more = {}) {
    place.write("part.csg", kScene);
    place.write("drive.txt", script);
    std::vector<std::string> words = {"view", "part.csg", "--script", "drive.txt"};
    words.insert(words.end(), more.begin(), more.end());
    const RunResult run = place.run(words, options);
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_EQ(place.names(), (std::vector<std::string>{"drive.txt", "part.csg"}));
    return run.err;
  };
  EXPECT_EQ(says("picture a.png\nscreenshot ./a.png\n"),
            "strata view: error: drive.txt:1: picture a.png and drive.txt:2: screenshot ./a.png "
            "would be written to one file\n");
  EXPECT_EQ(says("picture a.png\n", {"--screenshot", "a.png"}),
            "strata view: error: drive.txt:1: picture a.png and --screenshot a.png would be "
            "written to one file\n");
  EXPECT_NE(says("quit\n").find("no window"), std::string::npos);
}

TEST(WithoutWindowProgram, IsASentence) {
  Workplace place;
  std::filesystem::copy_file(STRATA_TOOL, place.path("strata"));
  const std::string command = place.path("strata") + " view part.csg 2> " + place.path("said");
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 2);
  EXPECT_NE(place.read("said").find("strata-view"), std::string::npos);
}

}  // namespace
}  // namespace strata::testkit
