// `strata mesh`: meshes through the tool, its options, and what it says of mistakes.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/read_mesh.h"
#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/apps/strata/json_names.h"
#include "tests/apps/strata/run_tool.h"

namespace strata {
namespace {

using nlohmann::json;
using testkit::collect;
using testkit::documented;
using testkit::RunOptions;
using testkit::RunResult;
using testkit::Workplace;

constexpr const char* kDrilled =
    "difference() {\n"
    "  color([1, 0, 0, 1]) cube(size = [10, 10, 10], center = true);\n"
    "  color([0, 0, 1, 1]) cube(size = [4, 4, 20], center = true);\n"
    "}\n";
constexpr double kDrilledVolume = 1000 - 160;

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

class MeshTool : public testing::Test {
 protected:
  MeshTool() {
    place.write("drilled.csg", kDrilled);
    place.write("apart.csg",
                "cube(size = [1, 1, 1], center = false);\n"
                "multmatrix([[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) "
                "color([0, 0.5, 0, 1]) cube(size = [2, 2, 2], center = false);\n");
    EXPECT_TRUE(write_mesh(place.path("box.obj"), make_box({0, 0, 0}, {4, 4, 4})));
    EXPECT_TRUE(write_mesh(place.path("hole.stl"), make_box({1, 1, -1}, {3, 3, 5})));
  }
  /// The mesh of a file that the tool wrote; empty for a build that does not read it.
  [[nodiscard]] TriangleSoup read(const std::string& name) const {
    auto file = read_mesh(place.path(name));
    if (!file && file.error().code == ErrorCode::kUsage) return {};
    EXPECT_TRUE(file) << file.error().message;
    return file ? std::move(file->soup) : TriangleSoup();
  }
  /// Expects a mistake with this code and a sentence that has `part`, and that nothing is left.
  void refuses(std::vector<std::string> arguments, int code, const std::string& part) const {
    const auto before = place.names();
    arguments.insert(arguments.begin(), "mesh");
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, code) << run.err;
    EXPECT_EQ(run.out, "");
    EXPECT_TRUE(has(run.err, part)) << part << "\n" << run.err;
    EXPECT_EQ(place.names(), before);
  }
  Workplace place;
};

TEST_F(MeshTool, EachFormatIsTheClosedBoundaryOfTheScene) {
  for (const char* name : {"a.3mf", "a.stl", "a.obj", "a.ply", "a.off"}) {
    const RunResult run = place.run({"mesh", "drilled.csg", "-o", name});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.out, "");
    EXPECT_TRUE(has(run.err, name)) << run.err;
    EXPECT_TRUE(has(run.err, "closed, manifold")) << run.err;
    const TriangleSoup soup = read(name);
    if (soup.triangles.empty() && std::string(name) == "a.3mf") continue;
    const MeshDiagnosis found = diagnose(soup);
    EXPECT_TRUE(found.closed) << name;
    EXPECT_EQ(found.non_manifold_edges, 0u);
    EXPECT_NEAR(found.volume, kDrilledVolume, 1e-6) << name;
    EXPECT_EQ(found.triangles, 32u) << "a plate with a hole has no more";
  }
}

TEST_F(MeshTool, AnExpressionTakesMeshesByPlaceAndByName) {
  for (const char* expression : {"a - b", "box - hole"}) {
    const RunResult run =
        place.run({"mesh", "box.obj", "hole.stl", "--expr", expression, "-o", "c.stl", "-q"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.err, "");
    EXPECT_NEAR(diagnose(read("c.stl")).volume, 64 - 16, 1e-6);
  }
}

TEST_F(MeshTool, BytesAreTheSameOnStandardOutputAndForAnyThreads) {
  ASSERT_EQ(place.run({"mesh", "drilled.csg", "-o", "a.3mf", "-j", "1"}).exit_code, 0);
  for (const char* threads : {"2", "5"}) {
    const RunResult run =
        place.run({"mesh", "drilled.csg", "-o", "-", "--format", "3mf", "-j", threads});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_TRUE(run.out == place.read("a.3mf")) << threads;
  }
}

TEST_F(MeshTool, TheDocumentationNamesExactlyWhatJsonPrints) {
  TriangleSoup open = make_box({0, 0, 0}, {4, 4, 4});
  open.triangles.pop_back();
  open.triangles.pop_back();
  ASSERT_TRUE(write_mesh(place.path("open.obj"), open));
  std::set<std::string> names;
  const RunResult without = place.run({"mesh", "drilled.csg", "--json", "-q"});
  ASSERT_EQ(without.exit_code, 0) << without.err;
  EXPECT_EQ(without.err, "");
  EXPECT_TRUE(json::parse(without.out)["output"].is_null());
  collect(json::parse(without.out), "", names);
  const RunResult run = place.run({"mesh", "open.obj", "--ids", "-o", "a.ply", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json report = json::parse(run.out);
  collect(report, "", names);
  const RunResult contour =
      place.run({"mesh", "open.obj", "--method", "contour", "-r", "8", "--json", "-q"});
  ASSERT_EQ(contour.exit_code, 0) << contour.err;
  collect(json::parse(contour.out), "", names);
  names.erase("warnings"), names.erase("boundary.caps");  // of a run without any
  EXPECT_EQ(names, documented("`strata mesh`"));
  EXPECT_EQ(report["output"]["bytes"], place.read("a.ply").size());
  ASSERT_EQ(report["boundary"]["caps"].size(), 1u);
  EXPECT_EQ(report["boundary"]["caps"][0]["edges"], 4);
  EXPECT_NEAR(report["boundary"]["caps"][0]["area"].get<double>(), 16, 1e-5);
  EXPECT_TRUE(has(run.err, "1 hole with 4 edges")) << run.err;
  EXPECT_NEAR(diagnose(read("a.ply")).volume, 64, 1e-5);
}

TEST_F(MeshTool, ColoursAndIdsMakeParts) {
  RunResult run = place.run({"mesh", "drilled.csg", "--colours", "-o", "a.obj", "--json", "-q"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  std::set<std::string> colours;
  std::uint64_t triangles = 0;
  const json drilled = json::parse(run.out)["mesh"];
  for (const json& part : drilled["parts"]) {
    colours.insert(part["colour"]);
    triangles += part["triangles"].get<std::uint64_t>();
  }
  EXPECT_EQ(colours, (std::set<std::string>{"#0000ffff", "#ff0000ff"}));
  EXPECT_EQ(triangles, drilled["triangles"]);
  EXPECT_TRUE(has(place.read("a.mtl"), "newmtl rgba_0000ffff\nKd 0 0 1\n"));
  EXPECT_TRUE(has(place.read("a.obj"), "mtllib a.mtl\n"));
  EXPECT_NEAR(diagnose(read("a.obj")).volume, kDrilledVolume, 1e-6);

  run = place.run({"mesh", "apart.csg", "--ids", "-o", "b.ply", "--json", "-q"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json apart = json::parse(run.out)["mesh"]["parts"];
  ASSERT_EQ(apart.size(), 2u) << apart;
  EXPECT_EQ(apart[0]["triangles"], 12);
  EXPECT_TRUE(has(apart[0]["name"].get<std::string>(), "cube at apart.csg:1:"));
  EXPECT_FALSE(apart[0]["colour"].is_null()) << "parts without a colour get one";
  EXPECT_EQ(apart[1]["colour"], "#008000ff");
}

/// Two boxes that touch no other: the first with a red side, in an OBJ with a library of materials.
void write_toys(const Workplace& place) {
  place.write("toys.mtl", "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\nnewmtl green\nKd 0 1 0\n");
  std::string text = "mtllib toys.mtl\n";
  for (const int x : {0, 5}) {
    for (int corner = 0; corner < 8; ++corner) {
      text += fmt::format("v {} {} {}\n", x + 2 * (corner & 1), corner & 2, (corner & 4) / 2);
    }
  }
  const auto sides = [&](int base, int from, int to) {
    const int quads[6][4] = {{1, 5, 7, 3}, {2, 4, 8, 6}, {1, 2, 6, 5},
                             {3, 7, 8, 4}, {1, 3, 4, 2}, {5, 6, 8, 7}};
    for (int side = from; side < to; ++side) {
      text += 'f';
      for (const int corner : quads[side]) text += fmt::format(" {}", corner + base);
      text += '\n';
    }
  };
  text += "o car\nusemtl red\n", sides(0, 0, 1);
  text += "usemtl blue\n", sides(0, 1, 6);
  text += "o ball\nusemtl green\n", sides(8, 0, 6);
  place.write("toys.obj", text);
}

/// The area of each part and colour of a mesh file: "car #ff0000".
std::map<std::string, double> coloured_areas(const std::string& path) {
  const auto file = read_mesh(path, {.attributes = true});
  EXPECT_TRUE(file.has_value()) << (file ? "" : file.error().message);
  std::map<std::string, double> areas;
  if (!file) return areas;
  const MeshAttributes& all = file->attributes;
  for (std::size_t t = 0; t < file->soup.triangles.size(); ++t) {
    const std::uint64_t element =
        file->soup.face_elements.empty() ? t : file->soup.face_elements[t];
    const std::uint32_t part = all.part_of(element), material = all.material_of(element);
    std::string name = part == MeshAttributes::kNone ? "-" : all.parts[part].name;
    glm::vec3 colour(-1.0f);
    if (material != MeshAttributes::kNone) colour = glm::vec3(all.materials[material].colour);
    if (!all.element_colours.empty()) {
      colour = glm::vec3(glm::u8vec3(all.element_colours[element])) / 255.0f;
    }
    if (colour.r >= 0) name += fmt::format(" {} {} {}", colour.r, colour.g, colour.b);
    const glm::uvec3& c = file->soup.triangles[t];
    const auto& p = file->soup.positions;
    areas[name] += glm::length(glm::cross(p[c.y] - p[c.x], p[c.z] - p[c.x])) / 2;
  }
  for (auto& [name, area] : areas) area = std::round(area * 1e4) / 1e4;
  return areas;
}

using Areas = std::map<std::string, double>;

TEST_F(MeshTool, PartsAndColoursOfMeshFilesAreKept) {
  write_toys(place);
  const Areas parts = {{"car 1 0 0", 4}, {"car 0 0 1", 20}, {"ball 0 1 0", 24}};
  const Areas colours = {{"- 1 0 0", 4}, {"- 0 0 1", 20}, {"- 0 1 0", 24}};
  for (const char* name : {"a.3mf", "a.obj"}) {
    const RunResult run = place.run({"mesh", "toys.obj", "--ids", "-o", name, "--json", "-q"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.err, "");
    EXPECT_EQ(json::parse(run.out)["mesh"]["parts"].size(), 3u);
    EXPECT_EQ(coloured_areas(place.path(name)), parts) << name;
    // And once more, from what was written.
    const std::string again = std::string("b") + (name + 1);
    ASSERT_EQ(place.run({"mesh", name, "--ids", "-o", again, "-q"}).exit_code, 0);
    EXPECT_EQ(coloured_areas(place.path(again)), parts) << again;
    const RunResult one =
        place.run({"mesh", name, "--part", "car", "--colours", "-o", "c.ply", "-q"});
    ASSERT_EQ(one.exit_code, 0) << one.err;
    EXPECT_EQ(coloured_areas(place.path("c.ply")), (Areas{{"- 1 0 0", 4}, {"- 0 0 1", 20}}));
  }
  for (const char* name : {"a.ply", "a.off"}) {
    const RunResult run = place.run({"mesh", "toys.obj", "--colours", "-o", name, "-q"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(coloured_areas(place.path(name)), colours) << name;
    const std::string again = std::string("b") + (name + 1);
    ASSERT_EQ(place.run({"mesh", name, "--colours", "-o", again, "-q"}).exit_code, 0);
    EXPECT_EQ(coloured_areas(place.path(again)), colours) << again;
  }
  // The set does not depend on parts.
  ASSERT_EQ(place.run({"mesh", "toys.obj", "-o", "plain.stl", "-q"}).exit_code, 0);
  EXPECT_NEAR(diagnose(read("plain.stl")).volume, diagnose(read("a.obj")).volume, 1e-6);
}

TEST_F(MeshTool, ExpressionsKeepThePartsOfTheirMeshes) {
  write_toys(place);
  ASSERT_TRUE(write_mesh(place.path("bar.off"), make_box({-1, 0.5, 0.5}, {10, 1.5, 1.5})));
  const RunResult run = place.run({"mesh", "toys.obj", "bar.off", "--expr", "toys - bar", "--ids",
                                   "-o", "a.obj", "--json", "-q"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  Areas areas = coloured_areas(place.path("a.obj"));
  EXPECT_EQ(areas["toys.obj:car 1 0 0"], 3) << run.out;
  EXPECT_EQ(areas["toys.obj:car 0 0 1"], 19);
  EXPECT_EQ(areas["toys.obj:ball 0 1 0"], 22);
  EXPECT_EQ(areas.size(), 4u) << "and the bar's hole, which is one colour";
}

TEST_F(MeshTool, ColoursOfVerticesBecomeThoseOfFacesWithAWarning) {
  place.write("tetra.off",
              "COFF\n4 4 0\n0 0 0 255 0 0 255\n1 0 0 255 0 0 255\n0 1 0 255 0 0 255\n0 0 1 255 0 0 "
              "255\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
  const RunResult run = place.run({"mesh", "tetra.off", "--colours", "-o", "a.ply"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(has(run.err,
                  "tetra.off: each face gets one colour, of its middle, in place of "
                  "colours of vertices"))
      << run.err;
  const Areas areas = coloured_areas(place.path("a.ply"));
  ASSERT_EQ(areas.size(), 1u);
  EXPECT_EQ(areas.begin()->first, "- 1 0 0");
  const RunResult none = place.run({"mesh", "box.obj", "--colours", "-o", "b.ply"});
  EXPECT_EQ(none.exit_code, 0);
  EXPECT_TRUE(has(none.err, "box.obj: no colours are given")) << none.err;
}

TEST_F(MeshTool, AContourIsClosedAndKeepsEdges) {
  for (const auto& input : {std::vector<std::string>{"drilled.csg"},
                            std::vector<std::string>{"box.obj", "hole.stl", "--expr", "a - b"}}) {
    std::vector<std::string> words = {"mesh", "--method", "contour", "-r", "20", "-o", "c.ply"};
    words.insert(words.end(), input.begin(), input.end());
    const RunResult run = place.run(words);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_TRUE(has(run.err, "20 x 20 x 20 voxels")) << run.err;
    const MeshDiagnosis found = diagnose(read("c.ply"));
    EXPECT_TRUE(found.closed);
    const double volume = input.size() == 1 ? kDrilledVolume : 64 - 16;
    EXPECT_NEAR(found.volume, volume, 0.02 * volume);
  }
  TriangleSoup open = make_icosphere(10, 4);
  open.triangles.resize(open.triangles.size() - 3);
  ASSERT_TRUE(write_mesh(place.path("ball.off"), open));
  const RunResult run =
      place.run({"mesh", "ball.off", "--method", "contour", "-r", "32", "-o", "c.stl", "-q"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(diagnose(read("c.stl")).closed);
  EXPECT_NEAR(diagnose(read("c.stl")).volume, 4188.8, 50);
  // Far from the origin floats cannot hold the voxels' lattice.
  ASSERT_TRUE(write_mesh(place.path("far.ply"),
                         transform(make_icosphere(1, 3), glm::dmat4(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1,
                                                                    0, 1e6, 1e6, 1e6, 1))));
  refuses({"far.ply", "--method", "contour", "-r", "64", "-o", "d.stl"}, 5,
          "3mf and ply hold doubles");
  EXPECT_EQ(
      place.run({"mesh", "far.ply", "--method", "contour", "-r", "64", "-o", "far.3mf"}).exit_code,
      0);
  refuses({"ball.off", "--method", "contour", "-r", "32", "-o", "d.stl", "--open", "fail"}, 5,
          "--open fail");
}

TEST_F(MeshTool, MistakesOnTheCommandLineAreNamed) {
  const auto usage = [this](std::vector<std::string> options, const std::string& part) {
    options.insert(options.begin(), "drilled.csg");
    refuses(options, 2, part);
  };
  refuses({"-o", "a.stl"}, 2, "no input file is given");
  usage({}, "nothing to do: give -o FILE or --json");
  usage({"-o", "a.amf"}, "a.amf: meshes are written as .3mf, .stl, .obj, .ply or .off");
  usage({"-o", "-"}, "-: meshes are written as");
  usage({"-o", "a.x", "--format", "step"}, "'step'");
  usage({"-o", "a.3mf", "--unit", "mile"}, "'mile'");
  usage({"-o", "a.stl", "--colours"}, "--colours cannot be written as STL");
  usage({"-o", "a.stl", "--ids"}, "--ids cannot be written as STL");
  usage({"-o", "a.ply", "--ids", "--colours"}, "--ids and --colours cannot be combined");
  usage({"-o", "-", "--format", "obj", "--colours"}, "--colours needs an OBJ file with a name");
  usage({"--json", "--ids"}, "--ids needs -o");
  usage({"-o", "a.ply", "--bits", "9"}, "--bits must be 10 to 28, got 9");
  usage({"-o", "a.ply", "--bits", "29"}, "--bits must be 10 to 28, got 29");
  usage({"-o", "a.ply", "--bits", "x"}, "'x'");
  usage({"-o", "a.ply", "--faces", "big"}, "'big'");
  usage({"-o", "a.ply", "--open", "maybe"}, "'maybe'");
  usage({"-o", "a.ply", "--open", "vote"}, "--open vote needs --method contour");
  usage({"-o", "a.ply", "-r", "64"}, "-r needs --method contour");
  usage({"-o", "a.ply", "--method", "contour", "-r", "9", "--voxel-size", "1"},
        "only one of -r and --voxel-size can be given");
  usage({"-o", "a.ply", "--voxel-size", "1"}, "--voxel-size needs --method contour");
  usage({"-o", "a.ply", "--method", "contour", "-r", "8", "--voxel-size", "1"}, "got both");
  usage({"-o", "a.ply", "--method", "contour", "--voxel-size", "1,2"}, "--voxel-size");
  usage({"-o", "a.ply", "--method", "contour", "--voxel-size", "0"}, "voxel size");
  usage({"-o", "a.ply", "--method", "contour", "-r", "8", "--bits", "20"},
        "--bits needs --method exact");
  usage({"-o", "a.ply", "--method", "contour", "-r", "8", "--open", "cap"},
        "--open cap needs --method exact");
  usage({"-o", "a.ply", "--method", "guess"}, "'guess'");
}

TEST_F(MeshTool, NoInputIsOverwritten) {
  EXPECT_TRUE(write_mesh(place.path("c.mtl"), make_box({0, 0, 0}, {1, 1, 1}), MeshFormat::kObj));
  place.write("scene.csg", "import(file = \"hole.stl\");\n");
  refuses({"box.obj", "-o", "./box.obj"}, 2, "-o ./box.obj would overwrite the input box.obj");
  refuses({"scene.csg", "-o", "hole.stl"}, 2, "would overwrite a file of the scene, hole.stl");
  refuses({"c.mtl", "--input-format", "obj", "--ids", "-o", "c.obj"}, 2,
          "the materials of -o c.mtl would overwrite the input c.mtl");
  refuses({"box.obj", "-o", "a.ply", "--json=a.ply"}, 2, "a.ply");
}

TEST_F(MeshTool, AnOutputThatCannotBeWrittenIsToldBeforeTheWork) {
  place.write("missing.csg", "import(file = \"no.stl\");");
  refuses({"missing.csg", "-o", "none/a.3mf"}, 4, "none/a.3mf");
  std::filesystem::create_directories(place.path("b.mtl"));
  refuses({"drilled.csg", "--colours", "-o", "b.obj"}, 4, "b.mtl");
  refuses({"drilled.csg", "--colours", "--format", "obj", "-o", "c.mtl"}, 2, "c.mtl");
}

TEST_F(MeshTool, ScenesComeThroughStandardInputToo) {
  RunOptions options;
  options.input = kDrilled;
  const RunResult run = place.run(
      {"mesh", "-", "--input-format", "csg", "-o", "-", "--format", "off", "-q"}, options);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  place.write("piped.off", run.out);
  EXPECT_NEAR(diagnose(read("piped.off")).volume, kDrilledVolume, 1e-6);
}

TEST_F(MeshTool, AnEmptyResultIsNoFile) {
  refuses({"box.obj", "hole.stl", "--expr", "(a - b) * b", "-o", "a.3mf"}, 5,
          "the result is empty, so there is no mesh to write");
  const RunResult run =
      place.run({"mesh", "box.obj", "hole.stl", "--expr", "(a - b) * b", "--json", "-q"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(json::parse(run.out)["mesh"]["triangles"], 0);
}

TEST_F(MeshTool, OpenMeshesAreCappedWithAWarningOrRefused) {
  TriangleSoup open = make_box({0, 0, 0}, {4, 4, 4});
  open.triangles.pop_back();
  ASSERT_TRUE(write_mesh(place.path("open.off"), open));
  refuses({"open.off", "-o", "a.3mf", "--open", "fail"}, 5, "open.off");
  refuses({"open.off", "-o", "a.3mf", "--strict"}, 5, "open.off");
  const RunResult run = place.run({"mesh", "open.off", "-o", "a.off"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(has(run.err, "warning: open.off: 1 hole with 3 edges closed")) << run.err;
  EXPECT_NEAR(diagnose(read("a.off")).volume, 64, 1e-5);
}

TEST_F(MeshTool, AFullDiskLeavesNoFile) {
  RunOptions options;
  options.file_size = 100;
  const auto before = place.names();
  for (const char* name : {"a.3mf", "a.stl", "a.obj", "a.ply", "a.off"}) {
    const RunResult run = place.run({"mesh", "drilled.csg", "-o", name, "-q"}, options);
    EXPECT_EQ(run.exit_code, 4) << run.err;
    EXPECT_TRUE(has(run.err, name)) << run.err;
    EXPECT_EQ(place.names(), before);
  }
  // The file of materials would fit; without its OBJ it must not be there.
  const RunResult run = place.run({"mesh", "drilled.csg", "--ids", "-o", "a.obj", "-q"}, options);
  EXPECT_EQ(run.exit_code, 4) << run.err;
  EXPECT_EQ(place.names(), before);
}

TEST_F(MeshTool, WhatIsWrittenIsAnInputAgain) {
  ASSERT_EQ(place.run({"mesh", "drilled.csg", "--colours", "-o", "a.3mf", "-q"}).exit_code, 0);
  if (read("a.3mf").triangles.empty()) GTEST_SKIP() << "this build reads no 3MF";
  const RunResult info = place.run({"info", "a.3mf", "--json"});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  const json file = json::parse(info.out)["files"][0];
  EXPECT_EQ(file["format"], "3mf");
  EXPECT_EQ(file["closed"], true);
  EXPECT_EQ(file["bytes"], place.read("a.3mf").size());
  EXPECT_NEAR(file["volume"].get<double>(), kDrilledVolume, 1e-6);
  ASSERT_EQ(place.run({"mesh", "a.3mf", "-o", "b.3mf", "-q"}).exit_code, 0);
  ASSERT_EQ(place.run({"mesh", "drilled.csg", "-o", "c.3mf", "-q"}).exit_code, 0);
  EXPECT_NEAR(diagnose(read("b.3mf")).volume, kDrilledVolume, 1e-6);
  EXPECT_EQ(read("b.3mf").triangles, read("c.3mf").triangles) << "faces depend on the set alone";
}

TEST_F(MeshTool, OpenscadImportsWhatIsWritten) {
  if (std::system("openscad --version > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "openscad is not installed";
  }
  for (const char* name : {"a.3mf", "a.stl", "a.off"}) {
    ASSERT_EQ(place.run({"mesh", "drilled.csg", "-o", name, "-q"}).exit_code, 0);
    place.write("back.scad", std::string("render() union() { import(\"") + name +
                                 "\"); translate([20, 0, 0]) cube(1); }");
    const std::string call = "cd '" + place.path("") +
                             "' && QT_QPA_PLATFORM=offscreen openscad -o back.off back.scad "
                             "> /dev/null 2>&1";
    if (std::system(call.c_str()) != 0) {
      if (std::string(name) == "a.3mf") continue;  // openscad may be without lib3mf
      FAIL() << name;
    }
    EXPECT_NEAR(diagnose(read("back.off")).volume, kDrilledVolume + 1, 1e-4) << name;
  }
}

}  // namespace
}  // namespace strata
