// `strata picture`: voxels through the tool, what it says of mistakes, and the line of `voxelize`.

#include <gtest/gtest.h>
#include <png.h>

#include <cstdlib>

#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/apps/strata/run_tool.h"

namespace strata {
namespace {

using testkit::RunResult;
using testkit::Workplace;

class PictureCommand : public testing::Test {
 protected:
  void SetUp() override {
    const auto written = write_mesh(place_.path("ball.stl"), make_icosphere(1.0, 3));
    ASSERT_TRUE(written.has_value());
    ASSERT_EQ(place_.run({"voxelize", "ball.stl", "-r", "40", "-o", "ball.npz"}).exit_code, 0);
    ASSERT_EQ(place_.run({"voxelize", "ball.stl", "-r", "40", "-o", "ball.vdb"}).exit_code, 0);
  }
  /// The bytes of the picture of a run that is expected to succeed.
  std::string drawn(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"-o", "out.png"});
    const RunResult run = place_.run(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.exit_code == 0 ? place_.read("out.png") : std::string();
  }
  /// What the tool says of a mistake.
  std::string mistake(const std::vector<std::string>& arguments) const {
    const RunResult run = place_.run(arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    return run.err.substr(0, run.err.find('\n'));
  }
  Workplace place_;
};

/// How many pixels differ from the first one of their row, which is background.
std::size_t covered(const std::string& bytes, png_uint_32 width) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) return 0;
  EXPECT_EQ(png.width, width);
  png.format = PNG_FORMAT_RGBA;
  std::vector<std::uint32_t> pixels(std::size_t{png.width} * png.height);
  EXPECT_NE(png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr), 0);
  std::size_t count = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    count += pixels[i] != pixels[i - i % png.width] ? 1 : 0;
  }
  return count;
}

TEST_F(PictureCommand, DrawsVoxelsAndTheFileMayComeWithoutACommand) {
  const std::string picture = drawn({"picture", "ball.npz", "--size", "120,90"});
  EXPECT_GT(covered(picture, 120), 1500u);
  EXPECT_EQ(drawn({"ball.npz", "--size", "120,90"}), picture);
  EXPECT_EQ(drawn({"picture", "ball.npz", "--size", "120,90", "-j", "3"}), picture);
  EXPECT_EQ(drawn({"picture", "ball.npz", "--size", "120,90", "--style", "auto"}), picture);
  for (const char* style : {"blocks", "smooth", "xray"}) {
    EXPECT_GT(covered(drawn({"picture", "ball.vdb", "--style", style}), 512), 20'000u) << style;
  }
}

TEST_F(PictureCommand, BackgroundsAndFilmsAreThoseOfCsg) {
  // The first pixel is background: the same as csg's.
  const auto corner = [&](const std::string& bytes) {
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    EXPECT_NE(png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()), 0);
    png.format = PNG_FORMAT_RGBA;
    std::vector<std::uint32_t> pixels(std::size_t{png.width} * png.height);
    EXPECT_NE(png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr), 0);
    return pixels.front();
  };
  for (const char* background : {"white", "#204060", "transparent"}) {
    EXPECT_EQ(corner(drawn({"picture", "ball.npz", "--background", background})),
              corner(drawn({"csg", "ball.stl", "--background", background})))
        << background;
  }
  const RunResult film =
      place_.run({"picture", "ball.npz", "--turntable", "3", "--size", "80,80", "-o", "turn/"});
  EXPECT_EQ(film.exit_code, 0) << film.err;
  EXPECT_GT(covered(place_.read("turn/0002.png"), 80), 500u);
}

TEST_F(PictureCommand, CutsTakeAwayTheHalfOfTheCamera) {
  const auto whole = covered(drawn({"picture", "ball.vdb", "--camera=0,0,0,0,0,0,9"}), 512);
  const auto half =
      covered(drawn({"picture", "ball.vdb", "--camera=0,0,0,0,0,0,9", "--cut", "x<0"}), 512);
  EXPECT_NEAR(static_cast<double>(half), static_cast<double>(whole) / 2,
              0.05 * static_cast<double>(whole));
}

TEST_F(PictureCommand, SlicesByPlaceAndByIndexAreTheSame) {
  // 40 voxels from -1 to 1: z = 0.21 lies in voxel 24.
  EXPECT_EQ(drawn({"picture", "ball.npz", "--slice", "z=0.21"}),
            drawn({"picture", "ball.npz", "--slice", "k=24"}));
  EXPECT_NE(drawn({"picture", "ball.npz", "--slice", "z=0.21"}),
            drawn({"picture", "ball.npz", "--slice", "k=30"}));
}

TEST_F(PictureCommand, DrawsScenesAsCsgDoes) {
  place_.write("box.csg", "difference() { cube([2, 2, 2]); sphere(1); }");
  EXPECT_EQ(drawn({"picture", "box.csg", "--cut", "y=1"}),
            drawn({"csg", "box.csg", "--cut", "y=1"}));
  EXPECT_EQ(drawn({"picture", "ball.stl"}), drawn({"csg", "ball.stl"}));
}

TEST_F(PictureCommand, MistakesAreNamed) {
  EXPECT_EQ(mistake({"picture", "ball.stl"}),
            "strata: error: no output is given: give -o FILE.png");
  EXPECT_EQ(mistake({"picture", "ball.npz", "-o", "x.png", "--slice", "q=1"}),
            "strata: error: --slice must be a plane such as z=0.5 or k=12, got 'q=1'");
  EXPECT_EQ(mistake({"picture", "ball.npz", "-o", "x.gif", "--slice", "k=4", "--turntable", "3"}),
            "strata: error: --slice draws one picture, not a film");
  EXPECT_EQ(mistake({"picture", "ball.npz", "-o", "x.png", "--slice", "k=40"}),
            "strata: error: --slice k=40: ball.npz has voxels k=0 to k=39");
  EXPECT_EQ(mistake({"picture", "ball.npz", "-o", "x.png", "--slice", "z=3"}),
            "strata: error: --slice z=3: the voxels of ball.npz lie from z=-1 to 1");
  EXPECT_EQ(mistake({"picture", "ball.stl", "-o", "x.png", "--style", "blocks"}),
            "strata: error: --style is for voxels, but ball.stl is not a file of voxels");
  EXPECT_EQ(mistake({"picture", "ball.npz", "-o", "x.png", "--expr", "a"}),
            "strata: error: --expr is for scenes and meshes, but ball.npz holds voxels");
  EXPECT_EQ(mistake({"csg", "ball.vdb", "-o", "x.png"}),
            "strata: error: ball.vdb: it holds voxels; `strata picture` draws them, `strata view` "
            "shows and exports them");
  EXPECT_EQ(mistake({"voxelize", "ball.vdb", "-o", "x.npy"}),
            mistake({"mesh", "ball.vdb", "-o", "x.stl"}));
  EXPECT_EQ(mistake({"voxelize", "ball.vdb", "-o", "x.npy"}),
            mistake({"csg", "ball.vdb", "-o", "x.png"}));
  EXPECT_EQ(mistake({"picture", "ball.vdb", "-o", "x.png", "--slice", "k=2", "--cut", "y=0"}),
            "strata: error: --slice draws a plane of voxels, of which --cut takes nothing away");
  EXPECT_EQ(mistake({"picture", "ball.vdb", "-o", "x.png", "--slice", "k=2", "--style", "xray"}),
            "strata: error: --slice draws a plane of voxels, which has no --style");
  const RunResult nothing =
      place_.run({"picture", "ball.vdb", "-o", "x.png", "--cut", "x>100", "--strict"});
  EXPECT_EQ(nothing.exit_code, 5);
  EXPECT_NE(nothing.err.find("the picture is empty: --cut takes all away"), std::string::npos);
  EXPECT_EQ(mistake({"picture", "ball.vdb", "ball.npz", "-o", "x.png"}),
            "strata: error: ball.vdb holds voxels, which are drawn alone, but 2 inputs are given");
  EXPECT_FALSE(place_.has("x.png"));
}

TEST_F(PictureCommand, VoxelizeShowsNothingWithoutADisplayAndSaysSoFirst) {
  testkit::RunOptions options;
  options.environment = {"DISPLAY=", "WAYLAND_DISPLAY="};
  const RunResult run = place_.run({"voxelize", "ball.stl", "-o", "new.vdb", "--show"}, options);
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("--show needs a display"), std::string::npos) << run.err;
  EXPECT_FALSE(place_.has("new.vdb"));
  EXPECT_EQ(mistake({"voxelize", "ball.stl", "--stats", "--show"}),
            "strata: error: --show needs -o FILE, which it opens");
}

TEST_F(PictureCommand, VoxelizeSaysOnATerminalWhatWasMade) {
  // script(1) gives the tool a terminal.
  const auto said = [&](const std::string& more) {
    const std::string command = "cd '" + place_.path("") +
                                "' && script -qec '" STRATA_TOOL
                                " voxelize ball.stl -r 40 -o line.npz" +
                                more + "' /dev/null > said.txt 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0);
    return place_.read("said.txt");
  };
  if (std::system("script --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "needs script(1)";
  const std::string line = "line.npz: 40 x 40 x 40 voxels of 0.05, ";
  EXPECT_NE(said("").find(line), std::string::npos) << said("");
  EXPECT_EQ(said(" -q").find(line), std::string::npos);
  EXPECT_EQ(said(" --stats").find(line), std::string::npos);
  EXPECT_EQ(place_.run({"voxelize", "ball.stl", "-r", "40", "-o", "line.npz"}).err, "");
}

}  // namespace
}  // namespace strata
