// What `strata voxelize` makes of meshes.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/gtc/matrix_transform.hpp>

#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "tests/apps/strata/voxelize_fixture.h"

namespace strata {
namespace {

using nlohmann::json;
using testkit::RunResult;

class Voxelize : public testkit::VoxelizeFixture {};

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

TEST_F(Voxelize, PartsAndTrianglesThatAreInsideOutAreTurnedAndCounted) {
  const TriangleSoup left = make_box({0, 0, 0}, {1, 1, 1}), right = make_box({2, 0, 0}, {3, 1, 1});
  TriangleSoup part = right, sphere = make_icosphere(1.0, 3), both = left;
  reverse_orientation(part);
  append(part, left);
  put("part.stl", part);
  json found = report({"part.stl", "-r", "30"});
  EXPECT_EQ(found["voxels"]["solid"], 2000);
  EXPECT_EQ(found["input"]["files"][0]["turned_parts"], 1);
  EXPECT_EQ(found["input"]["files"][0]["turned_around"], false);
  EXPECT_EQ(found["input"]["volume"], 2.0);
  EXPECT_EQ(codes(found), std::vector<std::string>{"inverted"});
  EXPECT_NE(last_error.find("part.stl: 1 of 2 parts were inside out and were reversed"),
            std::string::npos)
      << last_error;
  EXPECT_EQ(report({"part.stl", "-r", "30", "--keep-orientation"})["voxels"]["solid"], 1000);
  const RunResult told = place.run({"info", "part.stl"});
  EXPECT_NE(told.out.find("1 of 2 parts are inside out"), std::string::npos) << told.out;

  put("sphere.obj", sphere);
  for (std::size_t t = 0; t < sphere.triangles.size(); t += 3) {
    std::swap(sphere.triangles[t].x, sphere.triangles[t].y);
  }
  put("turned.obj", sphere);
  found = report({"turned.obj", "-r", "64", "--checksum"});
  EXPECT_EQ(found["voxels"]["checksum"],
            report({"sphere.obj", "-r", "64", "--checksum"})["voxels"]["checksum"]);
  EXPECT_EQ(found["input"]["closed"], true);
  EXPECT_EQ(found["input"]["files"][0]["turned_triangles"], 427);
  report({"turned.obj", "-r", "64"});
  EXPECT_NE(last_error.find("427 triangles faced against"), std::string::npos) << last_error;

  reverse_orientation(both);
  append(both, left);
  put("both.stl", both);
  found = report({"both.stl", "-r", "20"});
  EXPECT_EQ(found["voxels"]["solid"], 8000);
  EXPECT_EQ(found["input"]["files"][0]["double_faces"], 12);
  EXPECT_NE(last_error.find("both.stl: double-sided: 12 triangles"), std::string::npos)
      << last_error;
}

TEST_F(Voxelize, WhereNoSideIsOutsideParityDecides) {
  // A bottle of Klein, as a tube whose section is an 8.
  TriangleSoup bottle;
  constexpr int kAround = 48, kAlong = 24;
  for (int i = 0; i < kAround; ++i) {
    const double u = 2 * M_PI * i / kAround;
    for (int j = 0; j < kAlong; ++j) {
      const double v = 2 * M_PI * j / kAlong, s = std::sin(v), d = std::sin(2 * v);
      const double r = 3 + std::cos(u / 2) * s - std::sin(u / 2) * d;
      bottle.positions.emplace_back(r * std::cos(u), r * std::sin(u),
                                    std::sin(u / 2) * s + std::cos(u / 2) * d);
    }
  }
  const auto vertex = [&](int i, int j) {
    if (i == kAround) j = kAlong - j;
    return static_cast<std::uint32_t>(i % kAround * kAlong + (j + kAlong) % kAlong);
  };
  for (int i = 0; i < kAround; ++i) {
    for (int j = 0; j < kAlong; ++j) {
      const auto a = vertex(i, j), b = vertex(i + 1, j), c = vertex(i + 1, j + 1),
                 d = vertex(i, j + 1);
      bottle.triangles.emplace_back(a, b, c);
      bottle.triangles.emplace_back(a, c, d);
    }
  }
  put("bottle.obj", bottle);
  const json found = report({"bottle.obj", "-r", "64", "--checksum"});
  const json parity = report({"bottle.obj", "-r", "64", "--checksum", "--rule", "parity"});
  EXPECT_GT(found["voxels"]["solid"], 10000);
  EXPECT_EQ(found["voxels"]["checksum"], parity["voxels"]["checksum"]);
  EXPECT_EQ(found["input"]["files"][0]["rule"], "parity");
  EXPECT_EQ(codes(found).front(), "not-orientable");
  EXPECT_EQ(last_error.find("unequally"), std::string::npos) << last_error;
  // Beside other meshes each keeps its rule: what overlaps is a union.
  put("ball.obj", transform(make_icosphere(2.0, 3), glm::translate(glm::dmat4(1.0), {3, 0, 0})));
  put("far.obj", transform(make_icosphere(2.0, 3), glm::translate(glm::dmat4(1.0), {30, 0, 0})));
  const std::vector<std::string> grid = {"--voxel-size", "0.2", "--bounds=-6,-6,-6,36,6,6"};
  const auto count = [&](std::vector<std::string> files) {
    files.insert(files.end(), grid.begin(), grid.end());
    return report(files)["voxels"]["solid"].get<int>();
  };
  const int bottle_alone = count({"bottle.obj"}), ball = count({"ball.obj"});
  EXPECT_EQ(count({"bottle.obj", "far.obj"}), bottle_alone + count({"far.obj"}));
  const int together = count({"bottle.obj", "ball.obj"});
  EXPECT_EQ(together, count({"ball.obj", "bottle.obj"}));
  EXPECT_GT(together, std::max(bottle_alone, ball));
  EXPECT_LT(together, bottle_alone + ball);
  // Parity of both at once would leave out what they share.
  EXPECT_GT(together, count({"bottle.obj", "ball.obj", "--rule", "parity"}));
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

TEST_F(Voxelize, OpenFailNamesTheOpenMeshWhateverElseIsSaid) {
  TriangleSoup open = make_icosphere(1.0, 3);
  open.triangles.resize(open.triangles.size() - 10);
  reverse_orientation(open);
  put("open.obj", open);
  TriangleSoup turned = make_box({0, 0, 0}, {1, 1, 1});
  reverse_orientation(turned);
  put("turned.obj", turned);
  const RunResult run = place.run(
      {"voxelize", "open.obj", "turned.obj", "-r", "32", "--stats", "--open", "fail", "-q"});
  EXPECT_EQ(run.exit_code, 5);
  EXPECT_TRUE(run.err.starts_with("strata: error: open.obj: the mesh is not closed: ")) << run.err;
  EXPECT_NE(run.err.find("(--open fail)"), std::string::npos) << run.err;
}

TEST_F(Voxelize, APlateThinnerThanAVoxelIsReportedAndItsSurfaceHeld) {
  put("plate.obj", make_box({0, 0, 0}, {128, 128, 0.1}));
  const json solid = report({"plate.obj", "-r", "128"});
  EXPECT_EQ(codes(solid), std::vector<std::string>{"thin"});
  EXPECT_NE(last_error.find("1 wall thinner than a voxel fell between voxel centres; it is 0.1 "
                            "voxels thick along z, from (0, 0, 0) to (128, 128, 0.1); the solid "
                            "holds 0 voxels; --surface keeps all of it"),
            std::string::npos)
      << last_error;
  EXPECT_EQ(solid["lost_walls"]["count"], 1);
  EXPECT_EQ(solid["lost_walls"]["largest"][0]["axis"], "z");
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
  put("cube.obj", make_box(glm::dvec3(-1), glm::dvec3(1)));
  const json cube = report({"cube.obj", "-r", "2"});
  EXPECT_EQ(cube["voxels"]["solid"], 8);
  EXPECT_TRUE(codes(cube).empty()) << last_error;
  EXPECT_EQ(cube["lost_walls"]["count"], 0);
  // A plate that is thin, but whose middle is hit everywhere.
  put("hit.obj", make_box({0, 0, 0.45}, {16, 16, 0.55}));
  const json hit = report({"hit.obj", "--voxel-size", "1", "--bounds=0,0,0,16,16,1"});
  EXPECT_EQ(hit["voxels"]["solid"], 256);
  EXPECT_TRUE(codes(hit).empty()) << last_error;
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
  for (const char* name : {"a.vdb", "a.npy", "a.npz", "a.nrrd", "a.vti", "a.binvox", "a.vox"}) {
    const json found = report({"box.obj", "-r", "16", "-o", name});
    EXPECT_EQ(found["output"]["path"], name);
    EXPECT_EQ(found["output"]["bytes"], place.read(name).size()) << name;
    EXPECT_GT(place.read(name).size(), 100u) << name;
  }
  const auto has = [&](const char* file, const char* word) {
    return place.read(file).find(word) != std::string::npos;
  };
  EXPECT_TRUE(has("a.vdb", "Tree_bool_5_4_3") && has("a.vdb", "solid"));
  (void)report({"box.obj", "-r", "16", "--mask", "--name", "mine", "-o", "a.vdb"});
  EXPECT_TRUE(has("a.vdb", "Tree_mask_5_4_3") && has("a.vdb", "mine") && !has("a.vdb", "solid"));
  (void)report({"box.obj", "-r", "16", "--name", "mine", "-o", "a.vti"});
  EXPECT_TRUE(has("a.vti", "Name=\"mine\""));
  const json slices = report({"box.obj", "-r", "16", "-o", "slices/"});
  EXPECT_EQ(slices["output"]["format"], "png");
  EXPECT_TRUE(slices["output"]["bytes"].is_null());
  EXPECT_TRUE(place.has("slices"));
  (void)report({"box.obj", "-r", "16", "-o", "a.zarr"});
  EXPECT_TRUE(place.has("a.zarr/.zarray"));
}

// The numbers are of the voxels whose centre is inside, whatever the file's values are.
TEST_F(Voxelize, FogHasTheReportOfTheSolid) {
  put("ball.obj", make_icosphere(1.0, 4));
  const json solid = report({"ball.obj", "-r", "50", "--checksum", "-o", "solid.vdb"});
  const json fog = report({"ball.obj", "-r", "50", "--checksum", "--fog", "-o", "fog.vdb"});
  EXPECT_EQ(fog["voxels"], solid["voxels"]);
  EXPECT_EQ(fog["lists"], solid["lists"]);
  const auto bytes = [](const json& found) { return found["output"]["bytes"].get<int>(); };
  EXPECT_GT(bytes(fog), bytes(solid));
  // A surface has no filled fraction: its voxels are 1, with or without a number.
  (void)report({"ball.obj", "-r", "50", "--surface", "--fog", "-o", "a.vdb"});
  (void)report({"ball.obj", "-r", "50", "--surface", "--fog=1", "-o", "b.vdb"});
  EXPECT_EQ(place.read("a.vdb"), place.read("b.vdb"));
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

TEST_F(Voxelize, TheFormatOfAPipeIsNotThatOfFilesBesideIt) {
  put("box.stl", make_box({4, 0, 0}, {5, 1, 1}));
  put("other.obj", make_box({0, 0, 0}, {1, 1, 1}));
  put("other.txt.stl", make_box({0, 0, 0}, {1, 1, 1}));
  place.write("other.txt", place.read("other.txt.stl"));
  place.write("cube.csg", "cube(size = [1, 1, 1], center = false);\n");
  const auto run = [&](std::vector<std::string> more) {
    more.insert(more.begin(), "voxelize");
    more.insert(more.end(), {"--voxel-size", "0.25", "--stats"});
    return place.run(more, {.input = place.read("box.stl")});
  };
  for (const char* file : {"other.obj", "cube.csg", "other.txt"}) {
    for (const bool first : {false, true}) {
      const RunResult both = first ? run({file, "-", "--input-format", "stl"})
                                   : run({"-", file, "--input-format=stl"});
      EXPECT_EQ(both.exit_code, 0) << file << ": " << both.err;
      EXPECT_NE(both.out.find("128 voxels"), std::string::npos) << both.out;
    }
    const RunResult untold = run({file, "-"});
    EXPECT_EQ(untold.exit_code, 2) << untold.err;
    EXPECT_NE(untold.err.find("needs --input-format: obj, stl, ply, off or glb"), std::string::npos)
        << untold.err;
  }
  // Without a pipe it is that of all files.
  const RunResult wrong = run({"other.obj", "--input-format", "ply"});
  EXPECT_EQ(wrong.exit_code, 3) << wrong.err;
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

TEST_F(Voxelize, AGridThatMissesTheMeshIsReported) {
  put("box.obj", make_box({0, 0, 0}, {1, 1, 1}));
  EXPECT_EQ(codes(report({"box.obj", "-r", "8", "--bounds", "5,5,5,6,6,6"})),
            std::vector<std::string>{"empty"});
}

class VoxPieces : public testkit::VoxelizeFixture {
 protected:
  void SetUp() override { put("rod.obj", make_box({0, 0, 0}, {4500, 3, 2})); }
  [[nodiscard]] bool is_there(const char* name) const {
    return std::filesystem::exists(place.path(name));
  }
};

TEST_F(VoxPieces, AreNamedByTheReportAndTheLine) {
  const json found = report({"rod.obj", "--voxel-size", "1", "-o", "rod.vox"});
  EXPECT_EQ(found["output"]["files"].size(), 3u);
  EXPECT_EQ(found["output"]["files"][2], "rod_2_0_0.vox");
  std::uint64_t bytes = 0;
  for (const char* name : {"rod_0_0_0.vox", "rod_1_0_0.vox", "rod_2_0_0.vox"}) {
    ASSERT_TRUE(is_there(name));
    bytes += std::filesystem::file_size(place.path(name));
  }
  EXPECT_EQ(found["output"]["bytes"], bytes);
  EXPECT_FALSE(is_there("rod.vox"));
  const RunResult told =
      place.run({"voxelize", "rod.obj", "--voxel-size", "1", "-o", "rod.vox", "--stats"});
  EXPECT_NE(told.out.find("rod_0_0_0.vox to rod_2_0_0.vox (3 files): vox, "), std::string::npos)
      << told.out;
}

TEST_F(VoxPieces, DoNotReplaceWhatIsRead) {
  std::filesystem::rename(place.path("rod.obj"), place.path("rod_1_0_0.vox"));
  const std::string before = place.read("rod_1_0_0.vox");
  const auto refused = [&](const std::vector<std::string>& more, const std::string& message) {
    std::vector<std::string> arguments = {"voxelize", "--voxel-size", "1", "-o", "rod.vox"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_NE(run.err.find(message), std::string::npos) << run.err;
    EXPECT_EQ(place.read("rod_1_0_0.vox"), before);
    EXPECT_FALSE(is_there("rod_0_0_0.vox"));
  };
  std::filesystem::create_symlink("rod_1_0_0.vox", place.path("link.obj"));
  refused({"link.obj"}, "would overwrite the input link.obj");
  place.write("rod.csg", "import(file = \"link.obj\");\n");
  refused({"rod.csg"}, "would overwrite a file of the scene");
}

TEST_F(VoxPieces, DoNotGoToAPipe) {
  const auto run =
      place.run({"voxelize", "rod.obj", "--voxel-size", "1", "-o", "-", "--format", "vox"});
  EXPECT_EQ(run.exit_code, 2) << run.err;
  EXPECT_NE(run.err.find("are 3 .vox files"), std::string::npos) << run.err;
  EXPECT_TRUE(run.out.empty());
}

}  // namespace
}  // namespace strata
