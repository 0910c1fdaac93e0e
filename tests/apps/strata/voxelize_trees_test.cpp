// What `strata voxelize` makes of scenes, and of meshes whose solids are told apart.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "strata/mesh/shapes.h"
#include "strata/mesh/soup_tools.h"
#include "tests/apps/strata/voxelize_fixture.h"
#include "tests/support/sanitized.h"

namespace strata {
namespace {

using nlohmann::json;
using testkit::RunResult;

class VoxelizeTrees : public testkit::VoxelizeFixture {};

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

// Ids say of which solid a voxel is; they do not say which voxels are solid.

TEST_F(VoxelizeTrees, IdsOfOpenMeshesAreRefused) {
  TriangleSoup open = make_icosphere(1.0, 4);
  open.triangles.resize(open.triangles.size() - 20);
  put("open.obj", open);
  put("ball.obj", make_icosphere(1.0, 4));
  const auto run = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"voxelize", "-r", "32", "--checksum", "--ids"});
    return place.run(more);
  };
  for (const std::vector<std::string>& files :
       std::vector<std::vector<std::string>>{{"open.obj"}, {"ball.obj", "open.obj"}}) {
    const RunResult refused = run(files);
    EXPECT_EQ(refused.exit_code, 2) << refused.err;
    EXPECT_EQ(refused.out, "");
    EXPECT_NE(refused.err.find("winding numbers decide"), std::string::npos) << refused.err;
    EXPECT_NE(refused.err.find("close open.obj, or remove --ids"), std::string::npos)
        << refused.err;
  }
  EXPECT_EQ(run({"open.obj", "--open", "fail"}).exit_code, 5);
  const RunResult surface = run({"open.obj", "--open", "surface"});
  EXPECT_EQ(surface.exit_code, 2);
  EXPECT_NE(surface.err.find("--open surface"), std::string::npos) << surface.err;
  // What can be oriented is, unless that is not wanted. What parity takes as closed has ids, and
  // the same voxels as without.
  TriangleSoup turned = make_icosphere(1.0, 4);
  std::swap(turned.triangles[7].x, turned.triangles[7].y);
  put("turned.obj", turned);
  EXPECT_EQ(run({"turned.obj"}).out, run({"ball.obj"}).out);
  EXPECT_EQ(run({"turned.obj", "--keep-orientation"}).exit_code, 2);
  const RunResult parity = run({"turned.obj", "--rule", "parity"});
  EXPECT_EQ(parity.exit_code, 0) << parity.err;
  EXPECT_EQ(
      parity.out,
      place.run({"voxelize", "-r", "32", "--checksum", "turned.obj", "--rule", "parity"}).out);
}

TEST_F(VoxelizeTrees, OpenMeshesInScenesAreReportedWithTheRuleThatDecides) {
  TriangleSoup open = make_icosphere(1.0, 4);
  open.triangles.resize(open.triangles.size() - 20);
  put("open.obj", open);
  put("ball.obj", make_icosphere(1.0, 4));
  place.write("import.csg", "import(file = \"open.obj\");\n");
  place.write("cube.csg",
              "multmatrix([[1, 0, 0, 3], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) "
              "{ cube(size = [1, 1, 1], center = true); }\n");
  const json ball = report({"ball.obj", "-r", "40"});
  for (const std::vector<std::string>& files :
       std::vector<std::vector<std::string>>{{"import.csg"}, {"cube.csg", "open.obj"}}) {
    const auto with = [&](std::vector<std::string> more) {
      more.insert(more.begin(), files.begin(), files.end());
      more.insert(more.end(), {"--voxel-size", "0.05"});
      return more;
    };
    const auto run = [&](const std::vector<std::string>& more) {
      std::vector<std::string> words = with(more);
      words.insert(words.begin(), "voxelize");
      return place.run(words);
    };
    const json found = report(with({}));
    const auto said = codes(found);
    EXPECT_NE(std::find(said.begin(), said.end(), "open"), said.end()) << files.back();
    EXPECT_NE(last_error.find(files.back() + ": scenes do not use winding numbers"),
              std::string::npos)
        << last_error;
    EXPECT_EQ(found["input"]["closed"], false);
    const RunResult failed = run({"--checksum", "--open", "fail", "-q"});
    EXPECT_EQ(failed.exit_code, 5) << failed.err;
    EXPECT_NE(failed.err.find("is not closed: "), std::string::npos) << failed.err;
    EXPECT_NE(failed.err.find("(--open fail)"), std::string::npos) << failed.err;
    // Its surface alone, with colours asked for or not; the ids of nothing.
    const json surface = report(with({"--open", "surface", "-o", "a.vox"}));
    EXPECT_LT(surface["voxels"]["solid"].get<double>(),
              0.4 * found["voxels"]["solid"].get<double>());
    EXPECT_EQ(last_error.find("vote"), std::string::npos) << last_error;
    EXPECT_EQ(run({"--checksum", "--open", "surface", "--ids"}).exit_code, 2);
    // Ids change no voxel.
    EXPECT_EQ(run({"--checksum", "-q", "--ids"}).out, run({"--checksum", "-q"}).out);
  }
  place.write("closed.csg", "import(file = \"ball.obj\");\n");
  EXPECT_TRUE(report({"closed.csg", "-r", "40", "--open", "fail"})["warnings"].empty());
}

TEST_F(VoxelizeTrees, ThinSolidsOfTreesAreReportedLikeMeshes) {
  put("plate.obj", make_box({0, 0, 0}, {10, 10, 0.01}));
  place.write("plate.csg", "cube(size = [10, 10, 0.01], center = false);\n");
  const auto said = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"-r", "16"});
    return codes(report(arguments));
  };
  const std::vector<std::string> thin = {"thin"};
  EXPECT_EQ(said({"plate.obj"}), thin);
  const std::string of_mesh = last_error.substr(0, last_error.find(';'));
  EXPECT_NE(of_mesh.find("1 wall thinner than a voxel"), std::string::npos) << of_mesh;
  EXPECT_NE(last_error.find("0.016 voxels thick along z"), std::string::npos) << last_error;
  EXPECT_EQ(said({"plate.obj", "--ids"}), thin);
  EXPECT_TRUE(last_error.starts_with(of_mesh)) << last_error;
  EXPECT_NE(last_error.find("--surface, without --ids, keeps"), std::string::npos) << last_error;
  EXPECT_EQ(said({"plate.csg"}), thin);
  EXPECT_TRUE(last_error.starts_with(of_mesh)) << last_error;
  // Whose box is thick, and whose result is not; from a corner to the other.
  place.write("slice.csg",
              "difference() { cube(size = [10, 10, 10], center = false); "
              "multmatrix([[1, 0, 0, -1], [0, 1, 0, -1], [0, 0, 1, 0.01], [0, 0, 0, 1]]) "
              "{ cube(size = [12, 12, 12], center = false); } }\n");
  EXPECT_EQ(said({"slice.csg"}), thin);
  EXPECT_NE(last_error.find("1 wall thinner than a voxel"), std::string::npos) << last_error;
  // Walls between slots, whose faces are those of what is taken away, with ids or without.
  std::string slots = "difference() { cube(size = [20, 10, 10], center = false); union() {\n";
  for (int i = 0; i < 10; ++i) {
    slots += fmt::format(
        "multmatrix([[1, 0, 0, 10], [0, 1, 0, {}], [0, 0, 1, -1], [0, 0, 0, 1]]) "
        "{{ cube(size = [11, 0.9, 12], center = false); }}\n",
        0.1 + i);
  }
  place.write("slots.csg", slots + "} }\n");
  for (const bool ids : {false, true}) {
    std::vector<std::string> run = {"slots.csg", "--voxel-size", "1"};
    if (ids) run.emplace_back("--ids");
    const json found = report(run);
    EXPECT_EQ(found["lost_walls"]["count"], 10) << last_error;
    EXPECT_EQ(found["voxels"]["solid"], 1000);
    EXPECT_EQ(codes(found), thin);
  }
  // Nothing at all.
  place.write("nothing.csg",
              "difference() { cube(size = [10, 10, 10], center = false); "
              "cube(size = [12, 12, 12], center = false); }\n");
  EXPECT_EQ(said({"nothing.csg"}), std::vector<std::string>{"empty"});
  EXPECT_NE(last_error.find("the scene's result is empty, or thinner than a voxel; --surface"),
            std::string::npos)
      << last_error;
  place.write("cube.csg", "cube(size = [10, 10, 10], center = false);\n");
  EXPECT_TRUE(said({"cube.csg"}).empty()) << last_error;
}

// Reading, drawing and all the rest are shares of one bar.

TEST_F(VoxelizeTrees, AScenesMemoryIsEstimatedLikeThatOfItsMesh) {
  put("ball.obj", make_icosphere(10.0, 5));
  place.write("ball.csg", "import(file = \"ball.obj\");\n");
  const auto estimate = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"-r", "2000", "-o", "a.vdb", "--dry-run", "-j", "2"});
    return report(arguments)["memory"]["estimated_bytes"].get<double>();
  };
  const double mesh = estimate({"ball.obj"});
  EXPECT_GT(mesh, 30e6);  // most of it the leaves of the file
  EXPECT_NEAR(estimate({"ball.csg"}) / mesh, 1.0, 0.02);
  EXPECT_GT(estimate({"ball.obj", "--ids"}), 1.15 * mesh);
  for (const char* name : {"ball.obj", "ball.csg"}) {
    const RunResult run =
        place.run({"voxelize", name, "-r", "2000", "-o", "a.vdb", "--memory-limit", "25M"});
    EXPECT_EQ(run.exit_code, 6) << name << ": " << run.err;
    EXPECT_NE(run.err.find("--memory-limit"), std::string::npos) << run.err;
    EXPECT_FALSE(place.has("a.vdb"));
  }
  if (testkit::kSanitized) return;  // which hold more
  for (std::vector<std::string> words :
       {std::vector<std::string>{"ball.csg"}, {"ball.csg", "--ids"}}) {
    words.insert(words.end(), {"-r", "1600", "-o", "a.vdb", "-j", "2", "--memory-limit", "80M"});
    const json held = report(words)["memory"];
    EXPECT_LT(held["peak_bytes"], held["estimated_bytes"]) << words[1];
  }
}

TEST_F(VoxelizeTrees, AVoxFileKeepsTheColoursOfAScene) {
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

TEST_F(VoxelizeTrees, AReportOfScenesAndMeshesSaysWhatEachFileHolds) {
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

TEST_F(VoxelizeTrees, AReportOfASceneLeavesOutWhatIsNotKnown) {
  TriangleSoup open = make_box({0, 0, 0}, {1, 1, 1});
  open.triangles.pop_back();
  put("open.obj", open);
  place.write("cube.csg", "cube(size = [2, 2, 2], center = false);\n");
  // Twice the same mesh, which is diagnosed once.
  place.write("imports.csg",
              "import(file = \"open.obj\"); cube(size = [2, 2, 2], center = false);\n"
              "multmatrix([[1, 0, 0, 3], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) "
              "{ import(file = \"open.obj\"); }\n");
  // Two faces look the other way: they are turned.
  place.write("turned.csg",
              "polyhedron(points = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]], "
              "faces = [[0, 1, 2], [0, 1, 3], [1, 2, 3], [2, 0, 3]], convexity = 1);\n");
  place.write("open.csg",
              "difference() { cube(size = [4, 4, 4], center = true); "
              "import(file = \"open.obj\"); }\n");
  const std::vector<std::pair<std::string, std::uint64_t>> files = {
      {"cube.csg", 0}, {"imports.csg", 3}, {"open.csg", 3}};
  for (const auto& [name, unbalanced] : files) {
    const json input = report({name, "-r", "12"})["input"];
    EXPECT_EQ(input["closed"], unbalanced == 0) << name;
    const json file = input["files"][0];
    EXPECT_EQ(file["format"], "csg");
    EXPECT_EQ(file["bytes"], place.read(name).size());
    EXPECT_EQ(file["closed"], unbalanced == 0) << name;
    EXPECT_EQ(file["unbalanced_edges"], unbalanced) << name;
    for (const char* unknown : {"faces", "dropped_faces", "area", "volume", "turned_around"}) {
      EXPECT_FALSE(file.contains(unknown)) << unknown;
    }
  }
  const json turned = report({"turned.csg", "-r", "12"})["input"]["files"][0];
  EXPECT_EQ(turned["closed"], true);
  EXPECT_EQ(turned["unbalanced_edges"], 0);
  EXPECT_NE(last_error.find("triangles faced against"), std::string::npos) << last_error;
}

TEST_F(VoxelizeTrees, TheSurfaceOfASceneIsThatOfItsResult) {
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

TEST_F(VoxelizeTrees, IdsSayWhichFileAVoxelIsOf) {
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

/// A cube from `low` to `low + size`, as OBJ statements whose vertices count back.
std::string cube_statements(const glm::dvec3& low, double size) {
  std::string text;
  const TriangleSoup box = make_box(low, low + size);
  for (const glm::dvec3& p : box.positions) text += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
  for (const glm::uvec3& t : box.triangles) {
    text += "f";
    for (int i = 0; i < 3; ++i) text += fmt::format(" {}", int(t[i]) - int(box.positions.size()));
    text += "\n";
  }
  return text;
}

TEST_F(VoxelizeTrees, IdsOfOneFileAreThoseOfItsParts) {
  // The parts overlap: the first one has what both hold.
  const std::string two =
      "o left\n" + cube_statements({0, 0, 0}, 2) + "o right\n" + cube_statements({1, 0, 0}, 2);
  place.write("two.obj", two);
  const json found = report({"two.obj", "--voxel-size", "1", "--ids", "-o", "a.npy"});
  EXPECT_EQ(found["ids"], (json{{{"id", 1}, {"solid", 0}, {"name", "left"}, {"voxels", 8}},
                                {{"id", 2}, {"solid", 1}, {"name", "right"}, {"voxels", 4}}}));
  EXPECT_EQ(found["input"]["files"].size(), 1u);
  EXPECT_EQ(found["input"]["files"][0]["triangles"], 24);
  const auto values = npy_values(place.read("a.npy")).second;
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(values[i], i % 3 < 2 ? 1u : 2u);
  // Without --ids the file is one solid, and one part of it alone can be taken.
  EXPECT_EQ(report({"two.obj", "--voxel-size", "1"})["voxels"]["solid"], 12);
  EXPECT_EQ(report({"two.obj", "--voxel-size", "1", "--part", "right"})["voxels"]["solid"], 8);
  const RunResult wrong = place.run({"voxelize", "two.obj", "--part", "rihgt", "--stats"});
  EXPECT_EQ(wrong.exit_code, 3);
  EXPECT_NE(wrong.err.find("two.obj: there is no part 'rihgt'; did you mean right?; its parts are "
                           "'left', 'right'"),
            std::string::npos)
      << wrong.err;

  // Names that two files have are told apart.
  place.write("more.obj", "o right\n" + cube_statements({4, 0, 0}, 1) + "o far\n" +
                              cube_statements({6, 0, 0}, 1));
  put("ball.obj", make_box({8, 0, 0}, {9, 1, 1}));
  const json all =
      report({"two.obj", "more.obj", "ball.obj", "--voxel-size", "1", "--ids", "-o", "b.npy"});
  std::vector<std::string> names;
  for (const json& id : all["ids"]) names.push_back(id["name"]);
  EXPECT_EQ(names, (std::vector<std::string>{"left", "two.obj:right", "more.obj:right", "far",
                                             "ball.obj"}));
}

TEST_F(VoxelizeTrees, AnOpenPartIsNamedInTheRefusalOfIds) {
  const std::string box = cube_statements({0, 0, 0}, 2);
  std::string open = cube_statements({3, 0, 0}, 2);
  open.resize(open.rfind('f'));
  place.write("parts.obj", "o good\n" + box + "o bad\n" + open);
  const RunResult refused = place.run({"voxelize", "parts.obj", "-r", "8", "--ids", "-o", "a.npy"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("close part 'bad' of parts.obj"), std::string::npos) << refused.err;
  EXPECT_EQ(
      place.run({"voxelize", "parts.obj", "-r", "8", "--ids", "-o", "a.npy", "--part", "good"})
          .exit_code,
      0);
}

TEST_F(VoxelizeTrees, ScenesHaveNoPartsToChoose) {
  place.write("a.csg", "cube();\n");
  const RunResult refused = place.run({"voxelize", "a.csg", "--part", "x", "--stats"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("a.csg: a scene has no parts"), std::string::npos) << refused.err;
}

TEST_F(VoxelizeTrees, IdsOf300Solids) {
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

TEST_F(VoxelizeTrees, IdsAreAsLargeAsThoseThatVoxelsCanHave) {
  std::string scene = "difference() { cube(size = [40, 40, 2], center = false);\n";
  for (int i = 0; i < 300; ++i) {
    scene += "multmatrix([[1, 0, 0, " + std::to_string(2 * (i % 20)) + "], [0, 1, 0, " +
             std::to_string(2 * (i / 20)) +
             "], [0, 0, 1, -1], [0, 0, 0, 1]]) { cube(size = [1, 1, 4], center = false); }\n";
  }
  place.write("holes.csg", scene + "}\n");
  const json found = report({"holes.csg", "--voxel-size", "1", "--ids", "-o", "a.npy"});
  EXPECT_EQ(npy_values(place.read("a.npy")).first, "|u1");
  ASSERT_EQ(found["ids"].size(), 1u);
  EXPECT_EQ(found["ids"][0]["id"], 1);
  EXPECT_EQ(found["ids"][0]["voxels"], 2 * (40 * 40 - 300));
  (void)report({"holes.csg", "--voxel-size", "1", "--ids", "-o", "a.vox"});
  EXPECT_TRUE(place.has("a.vox"));
}

TEST_F(VoxelizeTrees, IdsThatCannotBeAreRefusedAtOnce) {
  put("box.obj", make_box({0, 0, 0}, {1, 1, 1}));
  const auto refused = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"voxelize", "box.obj", "-r", "8", "--ids"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    return run.err;
  };
  EXPECT_NE(refused({"-o", "a.binvox"}).find("npy, npz, nrrd, vti"), std::string::npos);
  EXPECT_NE(refused({"-o", "a.npy", "--surface"}).find("--surface"), std::string::npos);
  EXPECT_NE(refused({"-o", "a.vdb", "--fog"}).find("--fog"), std::string::npos);
  EXPECT_EQ(place.names(), std::vector<std::string>{"box.obj"});
}

}  // namespace
}  // namespace strata
