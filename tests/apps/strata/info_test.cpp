// What `strata info` tells, and that docs/json.md says what --json prints.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "tests/apps/strata/json_names.h"
#include "tests/apps/strata/run_tool.h"
#include "tests/mesh/textures/picture_bytes.h"

namespace strata {
namespace {

using nlohmann::json;
using testkit::collect;
using testkit::documented;
using testkit::RunResult;
using testkit::Workplace;

void put(const Workplace& place, const std::string& name, const TriangleSoup& mesh) {
  const auto written = write_mesh(place.path(name), mesh);
  ASSERT_TRUE(written.has_value()) << written.error().message;
}

TriangleSoup open_box() {
  TriangleSoup box = make_box({0, 0, 0}, {1, 2, 3});
  box.triangles.pop_back();
  return box;
}

TEST(Info, TellsTheMeasuresOfABox) {
  const Workplace place;
  put(place, "box.obj", make_box({0, 0, 0}, {1, 2, 3}));
  const RunResult run = place.run({"info", "--json", "box.obj"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json file = json::parse(run.out)["files"][0];
  EXPECT_EQ(file["path"], "box.obj");
  EXPECT_EQ(file["triangles"], 12);
  EXPECT_EQ(file["vertices"], 8);
  EXPECT_EQ(file["components"], 1);
  EXPECT_DOUBLE_EQ(file["area"], 22.0);
  EXPECT_DOUBLE_EQ(file["volume"], 6.0);
  EXPECT_EQ(file["bounds"]["high"], (json{1.0, 2.0, 3.0}));
  EXPECT_EQ(file["closed"], true);
  EXPECT_EQ(file["inverted"], false);
  EXPECT_EQ(file["edges"]["total"], 18);
  const RunResult text = place.run({"info", "box.obj"});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_EQ(text.err, "");
  EXPECT_NE(text.out.find("12 of 12 faces"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("outward"), std::string::npos) << text.out;
}

TEST(Info, SaysWhereAMeshIsOpen) {
  const Workplace place;
  put(place, "open.obj", open_box());
  const RunResult run = place.run({"info", "open.obj"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("3 of 18 edges are unbalanced"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("of face"), std::string::npos) << run.out;
  EXPECT_EQ(place.run({"info", "open.obj", "--strict"}).exit_code, 5);
}

TEST(Info, SaysThatAMeshIsInsideOut) {
  const Workplace place;
  TriangleSoup box = make_box({0, 0, 0}, {1, 2, 3});
  reverse_orientation(box);
  put(place, "box.obj", box);
  EXPECT_NE(place.run({"info", "box.obj"}).out.find("inside out"), std::string::npos);
}

TEST(Info, LooksAtTheOtherFilesWhenOneCannotBeRead) {
  const Workplace place;
  put(place, "box.obj", make_box({0, 0, 0}, {1, 2, 3}));
  const RunResult run = place.run({"info", "missing.obj", "box.obj", "--json=report.json"});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_EQ(run.out, "");
  EXPECT_NE(run.err.find("missing.obj"), std::string::npos) << run.err;
  EXPECT_EQ(json::parse(place.read("report.json"))["files"].size(), 1u);
}

TriangleSoup two_boxes(double second) {
  TriangleSoup mesh = make_box(glm::dvec3(0), glm::dvec3(2));
  append(mesh, make_box(glm::dvec3(second), glm::dvec3(second + 2)));
  return mesh;
}

TEST(Info, ChecksThatAMeshIsTheBoundaryOfASolid) {
  const Workplace place;
  for (const char* name : {"sound.obj", "sound.stl", "sound.ply", "sound.off"}) {
    put(place, name, two_boxes(3));
    const RunResult run = place.run({"info", "--check", "--strict", name});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_NE(run.out.find("passed: closed, 2-manifold, no two triangles meet"), std::string::npos)
        << run.out;
    EXPECT_NE(run.out.find("exact volume 16\n"), std::string::npos) << run.out;
    EXPECT_NE(run.out.find("(2.5, 2.5, 2.5), of mass"), std::string::npos) << run.out;
    EXPECT_NE(run.out.find("shells       2\n"), std::string::npos) << run.out;
  }
  EXPECT_EQ(place.run({"info", "sound.obj"}).out.find("check"), std::string::npos);
}

TEST(Info, TellsWhichTrianglesMeetAndFailsUnderStrict) {
  const Workplace place;
  put(place, "crossing.obj", two_boxes(1));
  const RunResult run = place.run({"info", "--check", "crossing.obj"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.err.find("crossing.obj: the mesh is not the boundary of a solid: "),
            std::string::npos)
      << run.err;
  EXPECT_NE(run.out.find("pairs of triangles cross"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find(" cross at ("), std::string::npos) << run.out;
  const RunResult strict = place.run({"info", "--check", "--strict", "--json", "crossing.obj"});
  EXPECT_EQ(strict.exit_code, 5);
  const json check = json::parse(strict.out)["files"][0]["check"];
  EXPECT_EQ(check["passed"], false);
  EXPECT_EQ(check["closed"], true);
  EXPECT_EQ(check["manifold"], true);
  EXPECT_GT(check["meetings"]["crossing"], 0);
  EXPECT_EQ(check["meetings"]["examples"].size(), 8u);
  EXPECT_EQ(check["volume"], 16.0);
  EXPECT_EQ(place.run({"info", "--strict", "crossing.obj"}).exit_code, 0);
}

TEST(Info, ChecksOrientationAndFacesThatTheReaderDrops) {
  const Workplace place;
  TriangleSoup turned = two_boxes(3);
  for (std::size_t t = 12; t < 24; ++t) std::swap(turned.triangles[t].x, turned.triangles[t].y);
  turned.positions.front() = glm::dvec3(-1);  // the first box is the larger one
  put(place, "turned.obj", turned);
  const RunResult run = place.run({"info", "--check", "--strict", "turned.obj"});
  EXPECT_EQ(run.exit_code, 5);
  EXPECT_NE(run.out.find("1 part inside out"), std::string::npos) << run.out;
  place.write("sliver.obj",
              "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n"
              "f 3 1 4\nf 1 1 2\n");
  const RunResult sliver = place.run({"info", "--check", "--strict", "sliver.obj"});
  EXPECT_EQ(sliver.exit_code, 5);
  EXPECT_NE(sliver.out.find("1 face without area"), std::string::npos) << sliver.out;
}

TEST(Info, ChecksTheMeshesOfAScene) {
  const Workplace place;
  put(place, "crossing.stl", two_boxes(1));
  place.write("scene.csg", "cube();\nsphere(3);\nimport(file = \"crossing.stl\");\n");
  const RunResult run = place.run({"info", "--check", "scene.csg", "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const json check = json::parse(run.out)["files"][0]["check"];
  EXPECT_EQ(check["passed"], false);
  EXPECT_EQ(check["meshes"], 3);
  ASSERT_EQ(check["faulty"].size(), 1u);
  EXPECT_EQ(place.run({"info", "--check", "--strict", "scene.csg"}).exit_code, 5);
  place.write("sound.csg", "cube(); sphere(3); multmatrix([[1, 0, 0, 9]]) cube();\n");
  const RunResult sound = place.run({"info", "--check", "--strict", "sound.csg"});
  EXPECT_EQ(sound.exit_code, 0) << sound.err;
  EXPECT_NE(sound.out.find("passed by"), std::string::npos) << sound.out;
}

TEST(Info, WhatStrataMeshWritesPassesTheCheck) {
  const Workplace place;
  place.write("scene.csg",
              "difference() { cube(size = [3, 3, 3], center = true); sphere(r = 1.9, $fn = 30); "
              "multmatrix([[0.8, -0.6, 0, 0], [0.6, 0.8, 0, 0]]) cylinder(h = 4, r1 = 1, r2 = 1.2, "
              "center = true, $fn = 40); }\n");
  for (const std::string name : {"a.obj", "a.stl", "a.ply", "a.off", "a.3mf"}) {
    const RunResult made = place.run({"mesh", "scene.csg", "-o", name});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    const RunResult run = place.run({"info", "--check", "--strict", "--json", name});
    if (name == "a.3mf" && run.exit_code == 2) continue;  // built without libzip or pugixml
    EXPECT_EQ(run.exit_code, 0) << run.err;
    const json check = json::parse(run.out)["files"][0]["check"];
    EXPECT_EQ(check["passed"], true) << run.out;
    EXPECT_GT(check["edges"], 100);
    EXPECT_EQ(check["moved_vertices"], 0);  // the check is of the file as it is
  }
}

TEST(Info, TellsPartsMaterialsAndPictures) {
  const Workplace place;
  place.write("a.mtl", "newmtl red\nKd 1 0 0\nd 0.5\nnewmtl wood\nmap_Kd wood.png\n");
  place.write("wood.png", testing_textures::rgba_png(2, 1, "abcdefgh"));
  place.write("a.obj",
              "mtllib a.mtl gone.mtl\nv 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\n"
              "o shell\nusemtl red\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\ng fl\x1b[2Jap\n"
              "usemtl wood\nf 1/1 2/1 3/1\n");
  const RunResult text = place.run({"info", "a.obj", "--strict"});
  EXPECT_EQ(text.err.find("gone.mtl"), std::string::npos) << text.err;
  for (const char* line :
       {"parts        2", "'shell': 4 triangles, (0, 0, 0) to (1, 1, 1), closed",
        "'shell/fl\\x1b[2Jap': 1 triangle, (0, 0, 0) to (1, 1, 0), open", "materials    2",
        "'red', 1 0 0, opacity 0.5", "'wood', texture 1", "textures     1", "wood.png: 2 x 1",
        "colours      of vertices", "gone.mtl is not there"}) {
    EXPECT_NE(text.out.find(line), std::string::npos) << line << "\n" << text.out;
  }
  EXPECT_EQ(text.out.find('\x1b'), std::string::npos);
  const json file = json::parse(place.run({"info", "a.obj", "--json"}).out)["files"][0];
  EXPECT_EQ(file["parts"][0]["triangles"], 4);
  EXPECT_EQ(file["parts"][0]["closed"], true);
  EXPECT_EQ(file["materials"][0]["opacity"], 0.5);
  EXPECT_EQ(file["materials"][1]["texture"], 0);
  EXPECT_EQ(file["textures"][0]["width"], 2);
  EXPECT_EQ(file["missing"].size(), 1u);
  // Materials that are wrong do not keep the mesh from being looked at.
  place.write("a.mtl", "newmtl red\nKd x\n");
  const RunResult wrong = place.run({"info", "a.obj", "--json"});
  EXPECT_EQ(wrong.exit_code, 0) << wrong.err;
  EXPECT_NE(wrong.err.find("a.mtl:2: Kd: 'x' is not a number"), std::string::npos) << wrong.err;
  EXPECT_EQ(json::parse(wrong.out)["files"][0]["triangles"], 5);
}

TEST(Info, TellsWhatOpenGlThereIsOrSaysWhyNot) {
  const Workplace place;
  const RunResult run = place.run({"info", "--gl"});
  if (run.exit_code != 0) {
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_NE(run.err.find("OpenGL"), std::string::npos) << run.err;
    const bool built_without = run.err.find("built without") != std::string::npos;
    ASSERT_TRUE(built_without || !std::getenv("CI")) << run.err;
    GTEST_SKIP() << run.err;
  }
  EXPECT_EQ(run.err, "");
  for (const char* word : {"renderer", "GL_NV_shader_atomic_int64", "storage_block_bytes",
                           "ha32: ", "ha64: ", "workarounds"}) {
    EXPECT_NE(run.out.find(word), std::string::npos) << word << " in\n" << run.out;
  }
}

TEST(Info, WithoutAContextIsASentenceAndAnExitCode) {
  const Workplace place;
  const RunResult run =
      place.run({"info", "--gl"}, {.environment = {"STRATA_GL_DEVICE=device:4711"}});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(run.signal, 0);
  EXPECT_NE(run.err.find("OpenGL"), std::string::npos) << run.err;
  // Files are told of all the same.
  put(place, "box.obj", make_box({0, 0, 0}, {1, 2, 3}));
  const RunResult both = place.run({"info", "--gl", "--json", "box.obj"},
                                   {.environment = {"STRATA_GL_DEVICE=device:4711"}});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_EQ(json::parse(both.out)["files"].size(), 1u);
  EXPECT_FALSE(json::parse(both.out).contains("gl"));
}

TEST(Json, TheDocumentationNamesExactlyWhatInfoPrints) {
  const Workplace place;
  std::set<std::string> names;
  put(place, "crossing.stl", two_boxes(1));
  place.write("scene.csg", "cube(); import(file = \"crossing.stl\");\n");
  TriangleSoup crossing = two_boxes(1);
  crossing.triangles.pop_back();
  put(place, "open.obj", crossing);
  place.write("a.mtl", "newmtl a\nmap_Kd a.png\n");
  place.write("a.png", testing_textures::rgba_png(1, 1, "abcd"));
  place.write("a.obj",
              "mtllib a.mtl none.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\ng a\n"
              "usemtl a\nf 1/1 2/1 3/1\n");
  collect(json::parse(place.run({"info", "a.obj", "--json"}).out), "", names);
  for (const char* name : {"scene.csg", "open.obj"}) {
    collect(json::parse(place.run({"info", name, "--check", "--json"}).out), "", names);
  }
  place.run({"voxelize", "open.obj", "-r", "8", "-o", "voxels.vdb"});
  collect(json::parse(place.run({"info", "voxels.vdb", "--json"}).out), "", names);
  names.erase("warnings");  // empty here
  names.insert({"warnings[].code", "warnings[].message"});
  std::set<std::string> told = documented("`strata info`"), of_gl;
  for (const std::string& name : told) {
    if (name.starts_with("gl.")) of_gl.insert(name);
  }
  for (const std::string& name : of_gl) told.erase(name);
  EXPECT_EQ(names, told);

  const RunResult with_gl = place.run({"info", "--gl", "--json"});
  if (with_gl.exit_code != 0) GTEST_SKIP() << with_gl.err;
  std::set<std::string> printed;
  collect(json::parse(with_gl.out)["gl"], "gl", printed);
  EXPECT_EQ(printed, of_gl);
}

TEST(Json, TheDocumentationNamesExactlyWhatVersionPrints) {
  const RunResult run = Workplace().run({"--version", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  json report = json::parse(run.out);
  EXPECT_EQ("strata " + report["strata"].get<std::string>() + "\n",
            Workplace().run({"--version"}).out);
  EXPECT_EQ(report["commit"].is_null(), report["modified"].is_null());
  if (!report["commit"].is_null()) {
    EXPECT_TRUE(std::regex_match(report["commit"].get<std::string>(), std::regex("[0-9a-f]{40}")));
  }
  EXPECT_GE(report["libraries"].size(), 10u);
  for (const auto& [name, version] : report["libraries"].items()) {
    EXPECT_TRUE(version.is_string()) << name << ": CMake did not tell its version";
  }
  report["libraries"] = {{"NAME", ""}};
  std::set<std::string> names;
  collect(report, "", names);
  EXPECT_EQ(names, documented("`strata --version`"));
}

TEST(Json, TheDocumentationNamesExactlyWhatVoxelizePrints) {
  const Workplace place;
  put(place, "open.obj", open_box());
  put(place, "box.obj", make_box({0, 0, 0}, {1, 2, 3}));
  put(place, "plate.obj", make_box({0, 0, 0}, {1, 1, 0.001}));
  std::set<std::string> names;
  for (const std::vector<std::string>& more : std::vector<std::vector<std::string>>{
           {"open.obj", "--stats", "--json=report.json"},
           {"open.obj", "-o", "a.vdb", "--json=report.json"},
           {"plate.obj", "--json=report.json"},
           {"box.obj", "-o", "a.npy", "--ids", "--json=report.json"},
           {"box.obj", "-o", "a.npy", "--coverage", "--json=report.json"},
           {"box.obj", "-o", "a.npy", "--colours", "--json=report.json"},
           {"box.obj", "-o", "a.npy", "--sdf", "--json=report.json"},
           {"box.obj", "-o", "a.npy", "--dry-run", "--json=report.json"}}) {
    std::vector<std::string> arguments = {"voxelize", "-r", "8", "--checksum"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const RunResult run = place.run(arguments);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    collect(json::parse(place.read("report.json")), "", names);
  }
  names.erase("warnings");  // empty of the box
  names.erase("lost_walls.largest");
  EXPECT_EQ(names, documented("`strata voxelize`"));
}

/// Codes of warnings in a source: in quotes as first or second argument of a function warn(), as
/// value of a constant that stands there, or first in braces.
void collect_codes(const std::string& text, std::set<std::string>& codes, int& unknown) {
  const std::regex calls(
      R"re(\bwarn\(\s*(?:[\w.>-]+,\s*)?(?:"([a-z-]+)"|(k\w+))|warnings\.push_back\(\s*\{"([a-z-]+)")re");
  for (std::sregex_iterator at(text.begin(), text.end(), calls), end; at != end; ++at) {
    if ((*at)[2].matched) {
      std::smatch value;
      const std::regex constant((*at)[2].str() + R"re( = "([a-z-]+)";)re");
      if (!std::regex_search(text, value, constant)) {
        ++unknown;
        continue;
      }
      codes.insert(value[1]);
    } else {
      codes.insert((*at)[(*at)[1].matched ? 1 : 3]);
    }
  }
}

TEST(Json, TheDocumentationNamesExactlyTheCodesOfWarnings) {
  std::set<std::string> codes;
  int unknown = 0;
  namespace fs = std::filesystem;
  for (const char* folder : {"/apps", "/csg"}) {
    for (const auto& entry :
         fs::recursive_directory_iterator(std::string(STRATA_SOURCE_DIR) + folder)) {
      if (entry.path().extension() != ".cpp") continue;
      std::ifstream in(entry.path());
      collect_codes({std::istreambuf_iterator<char>(in), {}}, codes, unknown);
    }
  }
  EXPECT_EQ(unknown, 0);
  EXPECT_EQ(codes, documented("Codes of warnings"));
}

TEST(Json, FileNamesOfAnyBytesGiveValidText) {
  const Workplace place;
  const std::string name = "a \"b\\c\n\xff\xc3\xa9.obj";
  place.write(name, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const RunResult run = place.run({"info", name, "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json report = json::parse(run.out, nullptr, false);
  ASSERT_FALSE(report.is_discarded()) << run.out;
  EXPECT_EQ(report["files"][0]["path"], "a \"b\\c\n\xef\xbf\xbd\xc3\xa9.obj");
}

}  // namespace
}  // namespace strata
