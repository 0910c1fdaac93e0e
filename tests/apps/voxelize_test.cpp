// What `strata voxelize` makes.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/gtc/matrix_transform.hpp>
#include <nlohmann/json.hpp>

#include "mesh/shapes.h"
#include "mesh/soup_tools.h"
#include "mesh/write_mesh.h"
#include "tests/apps/run_tool.h"

namespace strata {
namespace {

using nlohmann::json;
using testkit::RunResult;
using testkit::Workplace;

class Voxelize : public testing::Test {
 protected:
  void put(const std::string& name, const TriangleSoup& mesh) const {
    const auto written = write_mesh(place.path(name), mesh);
    ASSERT_TRUE(written.has_value()) << written.error().message;
  }

  /// The report of a run that is expected to succeed.
  json report(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "voxelize");
    arguments.push_back("--json");
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    last_error = run.err;
    return json::parse(run.out, nullptr, false);
  }

  static std::vector<std::string> codes(const json& report) {
    std::vector<std::string> result;
    for (const json& warning : report["warnings"]) result.push_back(warning["code"]);
    return result;
  }

  Workplace place;
  mutable std::string last_error;
};

TEST_F(Voxelize, ABoxThatFillsTheGridHasEveryVoxel) {
  put("box.obj", make_box({-1, 2, 3}, {3, 4, 4}));
  const json found = report({"box.obj", "-r", "32"});
  EXPECT_EQ(found["grid"]["dims"], (json{32, 16, 8}));
  EXPECT_EQ(found["grid"]["origin"], (json{-1.0, 2.0, 3.0}));
  EXPECT_EQ(found["voxels"]["solid"], 32 * 16 * 8);
  EXPECT_EQ(found["voxels"]["volume"], 8.0);
  EXPECT_EQ(found["input"]["closed"], true);
  EXPECT_EQ(found["input"]["triangles"], 12);
  EXPECT_EQ(found["lists"]["depth_histogram"][2], found["lists"]["columns"]);
  EXPECT_TRUE(found["warnings"].empty());
}

TEST_F(Voxelize, TheChecksumDoesNotDependOnHowTheWorkIsDone) {
  put("knot.obj", make_torus_knot(2, 3, 0.4, 96, 16));
  const json first = report({"knot.obj", "-r", "100", "--checksum"});
  const std::string checksum = first["voxels"]["checksum"];
  EXPECT_EQ(checksum.size(), 16u);
  for (const std::vector<std::string>& way :
       std::vector<std::vector<std::string>>{{"--axis", "x"},
                                             {"--axis", "y"},
                                             {"--axis", "z", "--store", "ha"},
                                             {"--store", "scan"},
                                             {"--offsets", "random", "--store", "ha"},
                                             {"--offsets", "farthest", "--store", "ha"},
                                             {"-j", "1"},
                                             {"-j", "3"},
                                             {"--memory-limit", "100M"}}) {
    std::vector<std::string> arguments = {"knot.obj", "-r", "100", "--checksum"};
    arguments.insert(arguments.end(), way.begin(), way.end());
    EXPECT_EQ(report(arguments)["voxels"]["checksum"], checksum) << way.front() << " " << way[1];
  }
  // And alone it is one word.
  const RunResult alone = place.run({"voxelize", "knot.obj", "-r", "100", "--checksum"});
  EXPECT_EQ(alone.out, checksum + "\n");
}

TEST_F(Voxelize, SeveralInputsBecomeTheirUnionOnOneGrid) {
  const TriangleSoup sphere = make_icosphere(1.0, 4);
  const glm::dmat4 shift = glm::translate(glm::dmat4(1.0), glm::dvec3(1, 0, 0));
  TriangleSoup both = sphere;
  append(both, transform(sphere, shift));
  put("a.obj", sphere);
  put("b.ply", transform(sphere, shift));
  put("both.off", both);
  const json two = report({"a.obj", "b.ply", "-r", "96", "--checksum"});
  const json one = report({"both.off", "-r", "96", "--checksum"});
  EXPECT_EQ(two["voxels"]["checksum"], one["voxels"]["checksum"]);
  EXPECT_EQ(two["input"]["files"].size(), 2u);
  // Two unit spheres at distance 1: 27/12 pi.
  EXPECT_NEAR(two["voxels"]["volume"], 27.0 / 12.0 * M_PI, 0.05);
}

TEST_F(Voxelize, AMeshInsideOutIsTurnedAroundAndReported) {
  TriangleSoup sphere = make_icosphere(1.0, 4);
  put("good.obj", sphere);
  reverse_orientation(sphere);
  put("bad.obj", sphere);
  const json good = report({"good.obj", "-r", "64", "--checksum"});
  const json bad = report({"bad.obj", "-r", "64", "--checksum"});
  EXPECT_EQ(bad["voxels"]["checksum"], good["voxels"]["checksum"]);
  EXPECT_EQ(codes(bad), std::vector<std::string>{"inverted"});
  EXPECT_EQ(bad["input"]["files"][0]["turned_around"], true);
  EXPECT_NE(last_error.find("bad.obj: the mesh is inside out"), std::string::npos) << last_error;
  const json kept = report({"bad.obj", "-r", "64", "--keep-orientation"});
  EXPECT_EQ(kept["voxels"]["solid"], 0);
  const json nonzero =
      report({"bad.obj", "-r", "64", "--keep-orientation", "--rule", "nonzero", "--checksum"});
  EXPECT_EQ(nonzero["voxels"]["checksum"], good["voxels"]["checksum"]);
}

TEST_F(Voxelize, AnOpenMeshIsReportedWithNumbersAndVotedOn) {
  TriangleSoup sphere = make_icosphere(1.0, 5);
  put("whole.obj", sphere);
  sphere.triangles.resize(sphere.triangles.size() - 40);
  put("open.obj", sphere);
  const json whole = report({"whole.obj", "-r", "128"});
  const json open = report({"open.obj", "-r", "128"});
  EXPECT_EQ(open["input"]["closed"], false);
  EXPECT_GT(open["input"]["files"][0]["unbalanced_edges"], 0);
  EXPECT_GT(open["lists"]["unbalanced_columns"], 0);
  const auto found = codes(open);
  EXPECT_NE(std::find(found.begin(), found.end(), "open"), found.end());
  const double solid = open["voxels"]["solid"];
  EXPECT_NEAR(solid / whole["voxels"]["solid"].get<double>(), 1.0, 0.01);
  EXPECT_NE(last_error.find("open.obj: the mesh is not closed"), std::string::npos) << last_error;

  EXPECT_EQ(place.run({"voxelize", "open.obj", "-r", "64", "--stats", "--open", "fail"}).exit_code,
            5);
  EXPECT_EQ(place.run({"voxelize", "open.obj", "-r", "64", "--stats", "--strict"}).exit_code, 5);
  const json surface = report({"open.obj", "-r", "128", "--open", "surface"});
  EXPECT_LT(surface["voxels"]["solid"].get<double>(), 0.2 * solid);
}

TEST_F(Voxelize, APlateThinnerThanAVoxelIsReportedAndItsSurfaceHeld) {
  put("plate.obj", make_box({0, 0, 0}, {128, 128, 0.1}));
  const json solid = report({"plate.obj", "-r", "128"});
  EXPECT_EQ(codes(solid), std::vector<std::string>{"thin"});
  EXPECT_NE(last_error.find("1638.4"), std::string::npos) << last_error;
  EXPECT_NE(last_error.find("0.1 voxels thick along z"), std::string::npos) << last_error;
  const json surface = report({"plate.obj", "-r", "128", "--surface"});
  EXPECT_EQ(surface["voxels"]["solid"], 128 * 128);
  EXPECT_TRUE(surface["warnings"].empty());
  // A shell, thin everywhere but large.
  TriangleSoup shell = make_icosphere(1.0, 5);
  TriangleSoup inner = make_icosphere(0.995, 5);
  reverse_orientation(inner);
  append(shell, inner);
  put("shell.obj", shell);
  EXPECT_EQ(codes(report({"shell.obj", "-r", "64"})), std::vector<std::string>{"thin"});
  // And nothing of the kind for what is thick.
  put("ball.obj", make_icosphere(1.0, 5));
  EXPECT_TRUE(codes(report({"ball.obj", "-r", "16"})).empty()) << last_error;
}

TEST_F(Voxelize, SolidAndSurfaceTogetherAreTheUnion) {
  put("ball.obj", make_icosphere(1.0, 4));
  const auto count = [&](std::vector<std::string> kind) {
    kind.insert(kind.begin(), {"ball.obj", "-r", "48"});
    return report(kind)["voxels"]["solid"].get<std::uint64_t>();
  };
  const auto solid = count({"--solid"}), surface = count({"--surface"}),
             both = count({"--solid", "--surface"});
  EXPECT_EQ(count({}), solid);
  EXPECT_GT(both, solid);
  EXPECT_GT(both, surface);
  EXPECT_LT(both, solid + surface);
  EXPECT_LT(count({"--surface=6"}), count({"--surface=26"}));
  EXPECT_LE(count({"--surface=26"}), surface);
}

TEST_F(Voxelize, TheAreaEstimateIsRightForASphere) {
  put("ball.obj", make_icosphere(1.0, 5));
  for (const char* axis : {"x", "y", "z"}) {
    const json found = report({"ball.obj", "-r", "100", "--axis", axis});
    EXPECT_NEAR(found["voxels"]["area_estimate"].get<double>(), 4 * M_PI, 0.02 * 4 * M_PI);
  }
}

TEST_F(Voxelize, TheAreaEstimateDoesNotDependOnSlabs) {
  put("ball.obj", make_icosphere(1.0, 4));
  const json whole = report({"ball.obj", "-r", "700", "-j", "1"});
  const json slabs = report({"ball.obj", "-r", "700", "-j", "1", "--memory-limit", "32M"});
  EXPECT_EQ(slabs["voxels"]["area_estimate"], whole["voxels"]["area_estimate"]);
  EXPECT_EQ(slabs["voxels"]["solid"], whole["voxels"]["solid"]);
}

TEST_F(Voxelize, FilesOfEveryFormatAppearAndAreReported) {
  put("box.obj", make_box({0, 0, 0}, {2, 1, 1}));
  for (const char* name : {"a.vdb", "a.npy", "a.nrrd", "a.vti", "a.binvox", "a.vox"}) {
    const json found = report({"box.obj", "-r", "16", "-o", name});
    EXPECT_EQ(found["output"]["path"], name);
    EXPECT_EQ(found["output"]["bytes"], place.read(name).size()) << name;
    EXPECT_GT(place.read(name).size(), 100u) << name;
  }
  const json slices = report({"box.obj", "-r", "16", "-o", "slices/"});
  EXPECT_EQ(slices["output"]["format"], "png");
  EXPECT_TRUE(slices["output"]["bytes"].is_null());
  EXPECT_TRUE(place.has("slices"));
  (void)report({"box.obj", "-r", "16", "-o", "a.zarr"});
  EXPECT_TRUE(place.has("a.zarr/.zarray"));
}

TEST_F(Voxelize, AFileOnStandardOutputIsTheSameFileAndNothingElse) {
  put("box.obj", make_box({0, 0, 0}, {2, 1, 1}));
  ASSERT_EQ(place.run({"voxelize", "box.obj", "-r", "16", "-o", "a.npy"}).exit_code, 0);
  const RunResult piped = place.run(
      {"voxelize", "box.obj", "-r", "16", "-o", "-", "--format", "npy", "--stats", "--json"});
  EXPECT_EQ(piped.exit_code, 0) << piped.err;
  EXPECT_EQ(piped.out, place.read("a.npy"));
  EXPECT_NE(piped.err.find("\"dims\": [16, 8, 8]"), std::string::npos) << piped.err;
}

TEST_F(Voxelize, SuccessIsSilent) {
  put("box.obj", make_box({0, 0, 0}, {1, 1, 1}));
  const RunResult run = place.run({"voxelize", "box.obj", "-r", "8", "-o", "a.vdb"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_EQ(run.out, "");
  EXPECT_EQ(run.err, "");
}

TEST_F(Voxelize, AProgressBarTakesItselfAway) {
  put("ball.obj", make_icosphere(1.0, 4));
  const RunResult run =
      place.run({"voxelize", "ball.obj", "-r", "64", "-o", "a.vdb", "--progress", "bar"});
  EXPECT_NE(run.err.find("voxelizing"), std::string::npos);
  EXPECT_TRUE(run.err.ends_with("\r\x1b[K")) << run.err;
  EXPECT_EQ(place.run({"voxelize", "ball.obj", "-r", "64", "-o", "b.vdb"}).err, "");
}

// Reading, drawing and all the rest are shares of one bar.
TEST_F(Voxelize, TheProgressBarNeverGoesBack) {
  put("a.obj", make_icosphere(1.0, 6));
  put("b.obj", make_icosphere(0.9, 6));
  std::string scene;
  for (int i = 0; i < 400; ++i) scene += "sphere($fn = 16, r = " + std::to_string(i + 1) + ");\n";
  place.write("many.csg", scene);
  for (const std::vector<std::string>& files :
       std::vector<std::vector<std::string>>{{"a.obj", "b.obj"}, {"many.csg"}}) {
    std::vector<std::string> arguments = {"voxelize",   "-r",  "300", "-o", "a.vdb",
                                          "--progress", "bar", "-j",  "1"};
    arguments.insert(arguments.begin() + 1, files.begin(), files.end());
    const RunResult run = place.run(arguments);
    EXPECT_NE(run.err.find("reading"), std::string::npos);
    EXPECT_NE(run.err.find("voxelizing"), std::string::npos);
    std::vector<int> shown;
    for (std::size_t at = 0; (at = run.err.find(" %", at)) != std::string::npos; ++at) {
      shown.push_back(std::stoi(run.err.substr(at - 3, 3)));
    }
    EXPECT_GE(shown.size(), 2u) << run.err;
    EXPECT_TRUE(std::is_sorted(shown.begin(), shown.end())) << run.err;
  }
}

TEST_F(Voxelize, QuietHidesWarningsAndVerboseSaysMore) {
  put("plate.obj", make_box({0, 0, 0}, {8, 8, 0.1}));
  const std::vector<std::string> base = {"voxelize", "plate.obj", "-r", "8", "-o", "a.vdb"};
  const auto with = [&](const char* option) {
    std::vector<std::string> arguments = base;
    arguments.emplace_back(option);
    return place.run(arguments).err;
  };
  EXPECT_EQ(with("-q"), "");
  EXPECT_NE(place.run(base).err.find("strata: warning: "), std::string::npos);
  EXPECT_GT(with("-v").size(), place.run(base).err.size());
}

TEST_F(Voxelize, MeshesComeThroughAPipe) {
  put("box.stl", make_box({0, 0, 0}, {1, 1, 1}));
  const RunResult run = place.run({"voxelize", "-", "--input-format", "stl", "-r", "8", "--stats"},
                                  {.input = place.read("box.stl")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("512 voxels"), std::string::npos) << run.out;
  EXPECT_NE(place.run({"voxelize", "-", "-r", "8", "--stats"}).exit_code, 0);
}

TEST_F(Voxelize, ADryRunWritesNothing) {
  put("box.obj", make_box({0, 0, 0}, {1, 1, 1}));
  const RunResult run =
      place.run({"voxelize", "box.obj", "-r", "4000", "-o", "a.npy", "--dry-run"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("4000 x 4000 x 4000"), std::string::npos) << run.out;
  EXPECT_EQ(place.names(), std::vector<std::string>{"box.obj"});
}

TEST_F(Voxelize, StrictTurnsAWarningIntoExitCode5WithoutAFile) {
  put("plate.obj", make_box({0, 0, 0}, {8, 8, 0.1}));
  const RunResult run = place.run({"voxelize", "plate.obj", "-r", "8", "-o", "a.vdb", "--strict"});
  EXPECT_EQ(run.exit_code, 5);
  EXPECT_NE(run.err.find("--strict"), std::string::npos) << run.err;
  EXPECT_EQ(place.names(), std::vector<std::string>{"plate.obj"});
}

TEST_F(Voxelize, AVoxFileKeepsTheColoursOfAScene) {
  place.write("two.csg",
              "color([1, 0, 0, 1]) { cube(size = [2, 2, 2], center = false); }\n"
              "color([0, 0, 1, 1]) { multmatrix([[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], "
              "[0, 0, 0, 1]]) { cube(size = [3, 2, 2], center = false); } }\n");
  const json found = report({"two.csg", "-r", "8", "-o", "two.vox"});
  EXPECT_EQ(found["voxels"]["solid"], 8 * 4 * 4);
  const std::string bytes = place.read("two.vox");
  const std::size_t palette = bytes.find("RGBA"), voxels = bytes.find("XYZI");
  ASSERT_NE(palette, std::string::npos);
  ASSERT_NE(voxels, std::string::npos);
  EXPECT_EQ(bytes.substr(palette + 12, 8), std::string("\xff\0\0\xff\0\0\xff\xff", 8));
  std::size_t red = 0;  // the first of the tree where both are
  for (std::size_t i = 0; i < 128; ++i) {
    const std::string voxel = bytes.substr(voxels + 16 + 4 * i, 4);
    EXPECT_EQ(voxel[3], voxel[0] < 4 ? 1 : 2);
    red += voxel[3] == 1 ? 1 : 0;
  }
  EXPECT_EQ(red, 64u);
}

TEST_F(Voxelize, AReportOfScenesAndMeshesSaysWhatEachFileHolds) {
  place.write("cube.csg", "cube(size = [2, 2, 2], center = false);\n");
  put("box.stl", make_box({1, 0, 0}, {3, 2, 2}));
  TriangleSoup open = make_box({0, 0, 0}, {1, 1, 1});
  open.triangles.pop_back();
  put("open.obj", open);
  const auto files = [&](const std::vector<std::string>& names) {
    std::vector<std::string> words = names;
    words.insert(words.end(), {"-r", "12"});
    return report(words)["input"];
  };
  for (const std::vector<std::string>& names :
       {std::vector<std::string>{"cube.csg", "box.stl"}, {"box.stl", "cube.csg"}}) {
    const json input = files(names);
    EXPECT_EQ(input["closed"], true);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(input["files"][i]["path"], names[i]);
      EXPECT_EQ(input["files"][i]["triangles"], 12) << names[i];
      EXPECT_EQ(input["files"][i]["vertices"], 8) << names[i];
    }
  }
  const json input = files({"cube.csg", "open.obj"});
  EXPECT_EQ(input["closed"], false);
  EXPECT_EQ(input["files"][0]["closed"], true);
  EXPECT_EQ(input["files"][1]["closed"], false);
  EXPECT_EQ(input["files"][1]["triangles"], 11);
  EXPECT_EQ(input["files"][1]["unbalanced_edges"], 3);
}

TEST_F(Voxelize, TheSurfaceOfASceneIsThatOfItsResult) {
  place.write("hole.csg",
              "difference() { cube(size = [8, 8, 8], center = true); "
              "cylinder($fn = 32, h = 20, r1 = 2, r2 = 2, center = true); }\n");
  place.write("box.csg", "cube(size = [8, 8, 8], center = true);\n");
  put("box.obj", make_box({-4, -4, -4}, {4, 4, 4}));
  const auto checksum = [&](const std::string& file, const char* kind) {
    return report({file, "-r", "40", "--padding", "2", "--checksum", kind})["voxels"]["checksum"];
  };
  EXPECT_EQ(checksum("box.csg", "--surface"), checksum("box.obj", "--surface"));
  EXPECT_EQ(checksum("box.csg", "--surface=6"), checksum("box.obj", "--surface=6"));
  const auto count = [&](std::vector<std::string> kind) {
    kind.insert(kind.begin(), {"hole.csg", "-r", "40"});
    return report(kind)["voxels"]["solid"].get<std::uint64_t>();
  };
  const auto surface = count({"--surface"}), both = count({"--surface", "--solid"});
  EXPECT_GT(surface, 5 * 40 * 40u);
  EXPECT_LT(surface, both);
  EXPECT_LT(both, count({"--solid"}) + surface);
  // Colours are of solids.
  EXPECT_EQ(place.run({"voxelize", "hole.csg", "-r", "20", "--surface", "-o", "a.vox"}).exit_code,
            0);
}

/// The values of a .npy file with its type.
std::pair<std::string, std::vector<std::uint32_t>> npy_values(const std::string& bytes) {
  const std::size_t begin = 10 + static_cast<unsigned char>(bytes[8]) +
                            std::size_t{256} * static_cast<unsigned char>(bytes[9]);
  const std::size_t at = bytes.find("'descr': '");
  const std::string type = bytes.substr(at + 10, 3);
  const auto width = static_cast<std::size_t>(type[2] - '0');
  std::vector<std::uint32_t> values((bytes.size() - begin) / width);
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::memcpy(&values[i], bytes.data() + begin + i * width, width);
  }
  return {type, values};
}

TEST_F(Voxelize, IdsSayWhichFileAVoxelIsOf) {
  put("a.obj", make_box({0, 0, 0}, {2, 2, 2}));
  put("b.stl", make_box({1, 0, 0}, {4, 2, 2}));
  const json found = report({"a.obj", "b.stl", "-r", "8", "--ids", "-o", "a.npy"});
  const auto [type, values] = npy_values(place.read("a.npy"));
  EXPECT_EQ(type, "|u1");
  ASSERT_EQ(values.size(), 8u * 4 * 4);
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(values[i], i % 8 < 4 ? 1u : 2u);
  EXPECT_EQ(found["voxels"]["solid"], 8 * 4 * 4);
  EXPECT_EQ(found["voxels"]["intervals"], 4 * 4);
  EXPECT_EQ(found["input"]["files"][1]["triangles"], 12);
  EXPECT_EQ(found["ids"], (json{{{"id", 1}, {"solid", 0}, {"name", "a.obj"}, {"voxels", 64}},
                                {{"id", 2}, {"solid", 1}, {"name", "b.stl"}, {"voxels", 64}}}));
  const json plain = report({"a.obj", "b.stl", "-r", "8"});
  EXPECT_EQ(found["voxels"]["area_estimate"], plain["voxels"]["area_estimate"]);
  EXPECT_FALSE(plain.contains("ids"));
  // The other way around the other one wins.
  ASSERT_EQ(place.run({"voxelize", "b.stl", "a.obj", "-r", "8", "--ids", "-o", "b.npy"}).exit_code,
            0);
  const auto swapped = npy_values(place.read("b.npy")).second;
  for (std::size_t i = 0; i < swapped.size(); ++i) EXPECT_EQ(swapped[i], i % 8 < 2 ? 2u : 1u);
}

TEST_F(Voxelize, IdsOf300Solids) {
  std::string scene = "difference() { union() {\n";
  for (int i = 0; i < 300; ++i) {
    scene += "multmatrix([[1, 0, 0, " + std::to_string(i % 20) + "], [0, 1, 0, " +
             std::to_string(i / 20) +
             "], [0, 0, 1, 0], [0, 0, 0, 1]]) { cube(size = [2, 2, 1], center = false); }\n";
  }
  scene += "} cube(size = [1, 1, 4], center = true); }\n";
  place.write("many.csg", scene);
  const json found = report({"many.csg", "--voxel-size", "0.25", "--ids", "-o", "a.npy"});
  ASSERT_EQ(found["grid"]["dims"], (json{84, 64, 4}));
  const auto [type, values] = npy_values(place.read("a.npy"));
  EXPECT_EQ(type, "<u2");
  ASSERT_EQ(values.size(), 84u * 64 * 4);
  std::vector<std::uint64_t> counts(302, 0);
  for (std::size_t n = 0; n < values.size(); ++n) {
    const double x = 0.25 * (static_cast<double>(n % 84) + 0.5);
    const double y = 0.25 * (static_cast<double>(n / 84 % 64) + 0.5);
    std::uint32_t expected = 0;
    for (int i = 299; i >= 0; --i) {
      const double u = x - i % 20, v = y - i / 20;
      if (0 < u && u < 2 && 0 < v && v < 2) expected = static_cast<std::uint32_t>(i) + 1;
    }
    if (x < 0.5 && y < 0.5) expected = 0;
    ASSERT_EQ(values[n], expected) << x << " " << y;
    ++counts[values[n]];
  }
  for (const json& id : found["ids"]) {
    EXPECT_EQ(id["voxels"], counts[id["id"]]);
    EXPECT_EQ(id["solid"].get<int>() + 1, id["id"].get<int>());
    EXPECT_TRUE(id["name"].get<std::string>().starts_with("cube at many.csg:"));
  }
  EXPECT_EQ(found["ids"].size(),
            static_cast<std::size_t>(std::count_if(counts.begin() + 1, counts.end(),
                                                   [](std::uint64_t count) { return count > 0; })));
}

TEST_F(Voxelize, IdsThatCannotBeAreRefusedAtOnce) {
  put("box.obj", make_box({0, 0, 0}, {1, 1, 1}));
  const auto refused = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"voxelize", "box.obj", "-r", "8", "--ids"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    return run.err;
  };
  EXPECT_NE(refused({"-o", "a.binvox"}).find("npy, nrrd, vti"), std::string::npos);
  EXPECT_NE(refused({"-o", "a.npy", "--surface"}).find("--surface"), std::string::npos);
  EXPECT_NE(refused({"-o", "a.vdb", "--fog"}).find("--fog"), std::string::npos);
  EXPECT_EQ(place.names(), std::vector<std::string>{"box.obj"});
}

TEST_F(Voxelize, AGridThatMissesTheMeshIsReported) {
  put("box.obj", make_box({0, 0, 0}, {1, 1, 1}));
  EXPECT_EQ(codes(report({"box.obj", "-r", "8", "--bounds", "5,5,5,6,6,6"})),
            std::vector<std::string>{"empty"});
}

}  // namespace
}  // namespace strata
