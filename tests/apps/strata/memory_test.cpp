// Memory that runs out: every n-th allocation of a run fails, by itself or with all that follow it.
// The run ends with code 6 and without output, or makes what it makes otherwise; it never crashes,
// and never makes something else.

#include <gtest/gtest.h>

#include <png.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/apps/strata/run_tool.h"

namespace strata {
namespace {

using testkit::RunOptions;
using testkit::RunResult;
using testkit::Workplace;

struct Job {
  std::string name;
  std::vector<std::string> arguments;
  std::string output;
};

void PrintTo(const Job& job, std::ostream* out) { *out << job.name; }

constexpr const char* kText =
    "linear_extrude(height = 2) text(text = \"Ag\", size = 10, font = \"\", spacing = 1, "
    "direction = \"ltr\", language = \"en\", script = \"latin\", halign = \"left\", "
    "valign = \"baseline\");";
constexpr const char* kFlat =
    "linear_extrude(height = 2) difference() { offset(r = 1, $fn = 12) square(size = [10, 8]); "
    "circle($fn = 20, r = 3); }";
constexpr const char* kHull =
    "difference() { hull() { sphere($fn = 8, r = 5); multmatrix([[1,0,0,9],[0,1,0,0],[0,0,1,0],"
    "[0,0,0,1]]) cube(size = 3); } cube(size = [4, 40, 4], center = true); }";
constexpr const char* kSum =
    "minkowski() { difference() { cube(size = 10, center = true); cube(size = [4, 40, 4], center = "
    "true); } cube(size = 1); }";
constexpr const char* kImports =
    "import(file = \"ball.stl\"); surface(file = \"heights.png\"); "
    "linear_extrude(height = 3) import(file = \"shape.svg\"); "
    "linear_extrude(height = 5) import(file = \"lines.dxf\");";
constexpr const char* kSvg =
    "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"20mm\" height=\"20mm\">"
    "<path d=\"M1 1 L15 1 Q 18 9 15 15 L1 15 Z\"/><circle cx=\"8\" cy=\"8\" r=\"3\"/></svg>";
constexpr const char* kDxf =
    "0\nSECTION\n2\nENTITIES\n0\nLINE\n10\n0\n20\n0\n11\n4\n21\n0\n0\nLINE\n10\n4\n20\n0\n11\n0\n21"
    "\n4\n0\nLINE\n10\n0\n20\n4\n11\n0\n21\n0\n0\nENDSEC\n0\nEOF\n";

void write_heights(const std::string& path) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = image.height = 5;
  image.format = PNG_FORMAT_GRAY;
  std::vector<png_byte> grey(25);
  for (std::size_t i = 0; i < grey.size(); ++i) grey[i] = static_cast<png_byte>(i * 10);
  ASSERT_TRUE(png_image_write_to_file(&image, path.c_str(), 0, grey.data(), 0, nullptr));
}

class MemoryRunsOut : public testing::TestWithParam<Job> {
 protected:
  void SetUp() override {
    place.write("text.csg", kText);
    place.write("flat.csg", kFlat);
    place.write("hull.csg", kHull);
    place.write("sum.csg", kSum);
    place.write("imports.csg", kImports);
    place.write("shape.svg", kSvg);
    place.write("lines.dxf", kDxf);
    write_heights(place.path("heights.png"));
    ASSERT_TRUE(write_mesh(place.path("ball.stl"), make_icosphere(4.0, 2)));
  }
  RunResult run(const std::vector<std::string>& settings) const {
    std::vector<std::string> arguments = GetParam().arguments;
    arguments.insert(arguments.end(), {"-o", GetParam().output, "-j", "1"});
    RunOptions options;
    options.environment = settings;
    options.environment.emplace_back("LD_PRELOAD=" STRATA_FAIL_ALLOCATION);
    return place.run(arguments, options);
  }
  /// The allocation with this number fails, with `rest` also those that follow.
  RunResult run(long number, bool rest) const {
    std::vector<std::string> settings{"STRATA_FAIL_ALLOCATION=" + std::to_string(number)};
    if (rest) settings.emplace_back("STRATA_FAIL_REST=1");
    return run(settings);
  }
  Workplace place;
};

TEST_P(MemoryRunsOut, TheRunEndsWithCode6OrMakesWhatItAlwaysMakes) {
  const std::string output = GetParam().output;
  const RunResult whole = run({"STRATA_COUNT_ALLOCATIONS=" + place.path("count")});
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  const long count = std::stol(place.read("count"));
  ASSERT_GT(count, 100);
  const std::string expected = place.read(output);
  ASSERT_FALSE(expected.empty());
  std::filesystem::remove(place.path("count"));
  std::filesystem::remove_all(place.path(output));
  const std::vector<std::string> before = place.names();
  constexpr long kRuns = 40;
  int refused = 0;
  for (const bool rest : {false, true}) {
    for (long i = 0; i < kRuns; ++i) {
      // Spread over the run, and not in step with anything that repeats.
      const long number = 1 + (count - 1) * i / kRuns + (i * 7) % std::max(count / kRuns, 1L);
      const RunResult one = run(number, rest);
      const std::string where = "allocation " + std::to_string(number) + " of " +
                                std::to_string(count) + (rest ? " and the rest: " : ": ") + one.err;
      ASSERT_EQ(one.signal, 0) << where;
      if (one.exit_code == 0) {
        EXPECT_EQ(place.read(output), expected) << where;
        std::filesystem::remove_all(place.path(output));
      } else {
        ++refused;
        EXPECT_EQ(one.exit_code, 6) << where;
        EXPECT_NE(one.err.find("strata: error: "), std::string::npos) << where;
      }
      EXPECT_EQ(place.names(), before) << where;
      if (HasFailure()) return;
    }
  }
  EXPECT_GT(refused, kRuns);  // it is the memory of this run that fails
}

INSTANTIATE_TEST_SUITE_P(
    Jobs, MemoryRunsOut,
    testing::Values(Job{"Text", {"csg", "text.csg", "--size", "40,40"}, "out.png"},
                    Job{"Outlines", {"csg", "flat.csg", "--size", "40,40"}, "out.png"},
                    Job{"Hull", {"csg", "hull.csg", "--size", "40,40"}, "out.png"},
                    Job{"Minkowski", {"csg", "sum.csg", "--size", "40,40"}, "out.png"},
                    Job{"Imports", {"csg", "imports.csg", "--size", "40,40"}, "out.png"},
                    Job{"Mesh", {"voxelize", "ball.stl", "-r", "24"}, "out.vdb"},
                    Job{"Distances", {"voxelize", "ball.stl", "-r", "24", "--sdf"}, "out.vdb"},
                    Job{"AllDistances",
                        {"voxelize", "ball.stl", "-r", "8", "--sdf", "--band", "all"},
                        "out.npz"},
                    Job{"Boundary", {"mesh", "hull.csg", "--colours"}, "out.3mf"},
                    Job{"Groups", {"mesh", "flat.csg", "ball.stl", "--ids"}, "out.ply"},
                    Job{"Lists", {"ldi", "ball.stl", "-r", "24"}, "out.npz"}),
    [](const auto& each) { return each.param.name; });

TEST(ThreadsThatAreRefused, AreCode6AndLeaveNothing) {
  Workplace place;
  ASSERT_TRUE(write_mesh(place.path("ball.obj"), make_icosphere(1.0, 4)));
  const std::vector<std::string> before = place.names();
  int refused = 0;
  for (int most = 0; most < 7; ++most) {
    RunOptions options;
    options.environment = {"LD_PRELOAD=" STRATA_FAIL_ALLOCATION,
                           "STRATA_MOST_THREADS=" + std::to_string(most)};
    for (int round = 0; round < 4; ++round) {  // which thread starts which is chance
      const RunResult run = place.run(
          {"voxelize", "ball.obj", "-r", "300", "-o", "out.vdb", "-q", "-j", "8"}, options);
      EXPECT_EQ(run.signal, 0) << most << " threads: " << run.err;
      if (run.exit_code == 0) {
        std::filesystem::remove(place.path("out.vdb"));
        continue;
      }
      ++refused;
      EXPECT_EQ(run.exit_code, 6) << most << " threads: " << run.err;
      EXPECT_NE(run.err, "");
      EXPECT_EQ(place.names(), before) << most << " threads";
    }
  }
  EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace strata
