// `strata oit`: transparent pictures through the tool, its lists and what it says of mistakes.

#include <gtest/gtest.h>
#include <png.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/apps/strata/json_names.h"
#include "tests/apps/strata/run_tool.h"

namespace strata {
namespace {

using nlohmann::json;
using testkit::RunResult;
using testkit::Workplace;

using Colour = std::array<double, 4>;  ///< in [0, 1]

class Oit : public testing::Test {
 protected:
  Oit() {
    EXPECT_TRUE(write_mesh(place.path("box.obj"), make_box({0, 0, 0}, {10, 10, 10})));
    EXPECT_TRUE(write_mesh(place.path("high.obj"), make_box({0, 0, 20}, {10, 10, 30})));
  }

  /// Runs `strata oit` and expects success.
  RunResult run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "oit");
    RunResult result = place.run(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result;
  }
  /// The pixel in the middle of a picture of `files` seen from above.
  Colour middle(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(),
                     {"-o", "out.png", "--size=9,9", "--projection=o", "--camera=5,5,5,0,0,0,40"});
    run(std::move(arguments));
    return pixel("out.png", 4, 4);
  }
  Colour pixel(const std::string& name, int u, int v) {
    const std::string bytes = place.read(name);
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    EXPECT_NE(png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()), 0);
    png.format = PNG_FORMAT_RGBA;
    std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(png));
    EXPECT_NE(png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr), 0);
    const std::size_t at =
        4 * (static_cast<std::size_t>(v) * png.width + static_cast<std::size_t>(u));
    Colour colour{};
    for (std::size_t i = 0; i < 4; ++i) colour[i] = pixels.at(at + i) / 255.0;
    return colour;
  }
  /// Expects an exit code and a sentence with `part`, and no file that was not there.
  void refuses(std::vector<std::string> arguments, int code, const std::string& part) {
    const std::vector<std::string> before = place.names();
    arguments.insert(arguments.begin(), "oit");
    const RunResult result = place.run(arguments);
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
    EXPECT_EQ(place.names(), before);
  }

  Workplace place;
};

/// A face of colour `face`, `layers` times before `ground`.
double blended(double face, double ground, double opacity, int layers) {
  double seen = ground;
  for (int i = 0; i < layers; ++i) seen = opacity * face + (1 - opacity) * seen;
  return seen;
}

TEST_F(Oit, ABoxFromAboveIsTwoLayersOfItsFaces) {
  const Colour opaque = middle({"box.obj", "--opacity=1"});
  const Colour ground = middle({"box.obj", "--opacity=0"});
  EXPECT_NEAR(ground[2], 0xf7 / 255.0, 1e-9);
  for (const double opacity : {0.25, 0.5, 0.9}) {
    const std::string option = "--opacity=" + std::to_string(opacity);
    const Colour seen = middle({"box.obj", option});
    const Colour both = middle({"box.obj", "high.obj", option});
    for (std::size_t i = 0; i < 3; ++i) {
      // The opaque picture is rounded to 1/255, and so is this one.
      EXPECT_NEAR(seen[i], blended(opaque[i], ground[i], opacity, 2), 1.01 / 255) << opacity;
      EXPECT_NEAR(both[i], blended(opaque[i], ground[i], opacity, 4), 1.01 / 255) << opacity;
    }
    EXPECT_EQ(seen[3], 1.0);
  }
}

TEST_F(Oit, ATransparentBackgroundLeavesTheAlphaOfTheLayers) {
  const Colour seen = middle({"box.obj", "--opacity=0.5", "--transparent"});
  const Colour opaque = middle({"box.obj", "--opacity=1"});
  EXPECT_NEAR(seen[3], 0.75, 0.51 / 255);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(seen[i], opaque[i], 1.01 / 255);
}

TEST_F(Oit, HalfIsTheOpacityOfWhatHasNone) {
  const Colour without = middle({"box.obj"});
  EXPECT_EQ(without, middle({"box.obj", "--opacity=0.5"}));
  EXPECT_NE(without, middle({"box.obj", "--opacity=0.6"}));
}

TEST_F(Oit, OpenMeshesShowAllTheirFaces) {
  place.write("sheets.obj",
              "v 0 0 1\nv 10 0 1\nv 10 10 1\nv 0 10 1\nv 0 0 3\nv 10 0 3\nv 10 10 3\nv 0 10 3\n"
              "v 0 0 5\nv 10 0 5\nv 10 10 5\nv 0 10 5\nf 1 2 3 4\nf 5 6 7 8\nf 9 10 11 12\n");
  const Colour opaque = middle({"sheets.obj", "--opacity=1"});
  const Colour ground = middle({"sheets.obj", "--opacity=0"});
  const Colour seen = middle({"sheets.obj", "--opacity=0.3"});
  EXPECT_EQ(run({"sheets.obj", "-o", "out.png", "--strict"}).err, "");
  EXPECT_NEAR(seen[0], blended(opaque[0], ground[0], 0.3, 3), 1.01 / 255);
}

/// A scene of one block, drilled through, seen along the hole's side: `inside` looks through it.
constexpr const char* kDrilled =
    "difference() {\n"
    "  cube(size = [10, 10, 10], center = false);\n"
    "  multmatrix([[1, 0, 0, 4], [0, 1, 0, -1], [0, 0, 1, 4]]) cube(size = [2, 12, 2], center = "
    "false);\n"
    "}\n";

TEST_F(Oit, ADrilledBlockHasFourLayersWhereItsHoleIs) {
  place.write("drilled.csg", kDrilled);
  const Colour opaque = middle({"drilled.csg", "--opacity=1"});
  const Colour ground = middle({"drilled.csg", "--opacity=0"});
  const Colour hole = middle({"drilled.csg", "--opacity=0.3"});
  EXPECT_NEAR(hole[0], blended(opaque[0], ground[0], 0.3, 4), 1.01 / 255);
  // Beside the hole the block has two.
  run({"drilled.csg", "-o", "side.png", "--opacity=0.3", "--size=9,9", "--projection=o",
       "--camera=2,5,5,0,0,0,4"});
  EXPECT_NEAR(pixel("side.png", 4, 4)[0], blended(opaque[0], ground[0], 0.3, 2), 1.01 / 255);
}

TEST_F(Oit, FacesThatCoincideLeaveNoLayer) {
  // The pocket begins in the top face, at the same height.
  place.write("pocket.csg",
              "difference() {\n  cube(size = [10, 10, 10], center = false);\n"
              "  multmatrix([[1, 0, 0, 3], [0, 1, 0, 3], [0, 0, 1, 6]]) cube(size = [4, 4, 4], "
              "center = false);\n}\n");
  const Colour opaque = middle({"pocket.csg", "--opacity=1"});
  const Colour ground = middle({"pocket.csg", "--opacity=0"});
  const json report = json::parse(run({"pocket.csg", "--opacity=0.3", "--json", "--size=9,9",
                                       "--projection=o", "--camera=5,5,5,0,0,0,4"})
                                      .out);
  EXPECT_EQ(report["techniques"][0]["costs"]["most_layers"], 2);
  const Colour seen = middle({"pocket.csg", "--opacity=0.3"});
  // The bottom of a pocket has the light of the top; its colour is the block's, not that of a cut.
  EXPECT_NEAR(seen[2], blended(opaque[2], ground[2], 0.3, 2), 0.3);
  EXPECT_EQ(report["scene"]["objects"], 1);
}

TEST_F(Oit, OpaquePartsHideAndAreSeenThroughWhatIsBefore) {
  const std::string glass =
      "color([0, 0, 1, 0.25]) multmatrix([[1,0,0,0],[0,1,0,0],[0,0,1,20]]) "
      "cube(size = [10, 10, 2], center = false);\n";
  const std::string hidden =
      "color([1, 0, 0, 0.5]) multmatrix([[1,0,0,0],[0,1,0,0],[0,0,1,-20]]) "
      "cube(size = [10, 10, 2], center = false);\n";
  place.write("opaque.csg", "cube(size = [10, 10, 10], center = false);\n");
  place.write("scene.csg", glass + hidden + "cube(size = [10, 10, 10], center = false);\n");
  place.write("glass.csg", glass);
  const Colour opaque = middle({"opaque.csg", "--opacity=1"});
  const Colour ground = middle({"opaque.csg", "--opacity=0"});
  const Colour alone = middle({"glass.csg"});
  const Colour seen = middle({"scene.csg"});
  for (std::size_t i = 0; i < 3; ++i) {
    // Two layers of one colour: what they let through is (1 - 0.25)^2.
    const double light = alone[i] - 0.5625 * ground[i];
    EXPECT_NEAR(seen[i], light + 0.5625 * opaque[i], 1.6 / 255);
  }
  const json report = json::parse(run({"scene.csg", "--json", "--size=9,9", "--projection=o",
                                       "--camera=5,5,5,0,0,0,40", "--technique=all"})
                                      .out);
  EXPECT_EQ(report["scene"]["opacity"], 1.0);
  EXPECT_EQ(report["scene"]["objects"], 3);
  EXPECT_EQ(report["techniques"][0]["costs"]["most_layers"], 2);
}

TEST_F(Oit, TransparentScenesLookAsStrataCsgDrawsThem) {
  place.write(
      "scene.csg",
      "color([0.9, 0.2, 0.2, 0.4]) difference() {\n sphere(r = 10, $fn = 24);\n"
      " cylinder(h = 40, r1 = 4, r2 = 4, center = true, $fn = 16);\n}\n"
      "multmatrix([[1,0,0,-4],[0,1,0,6],[0,0,1,-9],[0,0,0,1]]) cube(size = [14, 10, 6]);\n"
      "%multmatrix([[1,0,0,0],[0,1,0,-10],[0,0,1,0],[0,0,0,1]]) sphere(r = 4, $fn = 12);\n");
  // Whose facets are plain, and whose corners are not dark.
  run({"scene.csg", "-o", "oit.png", "--size=60,60", "--colorscheme=Cornfield"});
  ASSERT_EQ(
      place.run({"csg", "scene.csg", "-o", "csg.png", "--size=60,60", "--colorscheme=Cornfield"})
          .exit_code,
      0);
  int transparent = 0;
  for (int v = 0; v < 60; ++v) {
    for (int u = 0; u < 60; ++u) {
      const Colour a = pixel("oit.png", u, v), b = pixel("csg.png", u, v);
      for (std::size_t i = 0; i < 3; ++i) ASSERT_NEAR(a[i], b[i], 1.01 / 255) << u << ' ' << v;
      transparent += a[1] < 0.8 && a[0] > 0.8 ? 1 : 0;
    }
  }
  EXPECT_GT(transparent, 50);
}

TEST_F(Oit, MaterialsOfAnObjGiveColourAndOpacity) {
  place.write("two.mtl", "newmtl red\nKd 1 0 0\nd 0.5\nnewmtl blue\nKd 0 0 1\nTr 0.75\n");
  place.write("two.obj",
              "mtllib two.mtl\nv 0 0 0\nv 10 0 0\nv 10 10 0\nv 0 10 0\nv 0 0 5\nv 10 0 5\n"
              "v 10 10 5\nv 0 10 5\nusemtl blue\nf 1 2 3 4\nusemtl red\nf 5 6 7 8\n");
  const Colour seen = middle({"two.obj", "--keep-orientation", "--transparent"});
  // Red before blue: alpha 1 - 0.5 * 0.75, red 0.5 of the light, blue 0.5 * 0.25 of it.
  EXPECT_NEAR(seen[3], 0.625, 1.01 / 255);
  EXPECT_EQ(seen[1], 0.0);
  EXPECT_NEAR(seen[0] / seen[2], 0.5 / 0.125, 0.1);
  std::filesystem::remove(place.path("two.mtl"));
  const RunResult without = run({"two.obj", "-o", "out.png", "--size=9,9"});
  EXPECT_NE(without.err.find("two.mtl is not there"), std::string::npos) << without.err;
  place.write("two.mtl", "newmtl red\nKd 1 zero 0\n");
  refuses({"two.obj", "-o", "bad.png"}, 3, "two.mtl:2: Kd: 'zero' is not a number");
  place.write("two.mtl", "newmtl red\n");
  refuses({"two.obj", "--json=two.mtl", "-o", "bad.png"}, 2, "overwrite");
}

TEST_F(Oit, MediaInSolidsLetThroughWhatBeerSays) {
  place.write("fog.json", R"({"ambient": 0, "media": [{"object": "*", "extinction": 0.1}]})");
  const Colour ground = middle({"box.obj", "--opacity=0"});
  const Colour seen = middle({"box.obj", "--media=fog.json"});
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(seen[i], ground[i] * std::exp(-0.1 * 10), 1.01 / 255);
  }
  refuses({"box.obj", "-o", "a.png", "--light=1,2,3"}, 2, "--light needs --media");
  refuses({"box.obj", "-o", "a.png", "--media=none.json"}, 3, "none.json");
  refuses({"box.obj", "-o", "a.png", "--media=fog.json", "--technique=all"}, 2, "--technique");
  refuses({"box.obj", "--json=fog.json", "-o", "a.png", "--media=fog.json"}, 2, "overwrite");
}

TEST_F(Oit, AMediumFillsASolidOfSeveralMaterials) {
  place.write("two.mtl", "newmtl red\nKd 1 0 0\nd 0.5\nnewmtl blue\nKd 0 0 1\nd 0.5\n");
  std::string obj = "mtllib two.mtl\nusemtl red\n";
  std::istringstream lines(place.read("box.obj"));
  int faces = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("f ", 0) == 0 && ++faces == 7) obj += "usemtl blue\n";
    obj += line + "\n";
  }
  ASSERT_EQ(faces, 12);
  place.write("two.obj", obj);
  place.write("fog.json", R"({"ambient": 0, "media": [{"object": "*.obj", "extinction": 0.1}]})");
  const Colour ground = middle({"box.obj", "--opacity=0"});
  const Colour seen = middle({"two.obj", "--media=fog.json", "--strict"});
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(seen[i], ground[i] * std::exp(-0.1 * 10), 1.01 / 255);
  }
}

TEST_F(Oit, TablesOfParticlesAreNotOverwritten) {
  place.write("drops.csv", "5,5,5,1\n");
  place.write("fog.json", R"({"particles": {"file": "drops.csv"}})");
  refuses({"box.obj", "--media=fog.json", "--json=drops.csv", "-o", "a.png"}, 2, "drops.csv");
  EXPECT_EQ(place.read("drops.csv"), "5,5,5,1\n");
}

TEST_F(Oit, FxaaBlendsStepsOfEdges) {
  const auto colours = [&](std::vector<std::string> more) {
    more.insert(more.end(), {"box.obj", "-o", "out.png", "--size=60,60", "--quality=draft",
                             "--camera=5,5,5,55,0,25,40"});
    run(std::move(more));
    std::set<Colour> all;
    for (int v = 0; v < 60; ++v) {
      for (int u = 0; u < 60; ++u) all.insert(pixel("out.png", u, v));
    }
    return all.size();
  };
  EXPECT_GT(colours({"--fxaa"}), 3 * colours({}));
}

TEST_F(Oit, SeveralTechniquesWriteAPictureEach) {
  run({"box.obj", "--technique=count-scan,dual-peeling", "-o", "out.png", "--size=20,20"});
  EXPECT_TRUE(place.has("out-count-scan.png"));
  EXPECT_TRUE(place.has("out-dual-peeling.png"));
  EXPECT_FALSE(place.has("out.png"));
  EXPECT_EQ(place.read("out-count-scan.png"), place.read("out-dual-peeling.png"));
  run({"box.obj", "--technique", "count-scan", "--technique", "dual-peeling", "-o", "folder/",
       "--size=20,20"});
  EXPECT_EQ(place.read("folder/count-scan.png"), place.read("out-count-scan.png"));
  EXPECT_EQ(place.read("folder/dual-peeling.png"), place.read("out-count-scan.png"));
}

TEST_F(Oit, AFloatPictureIsOpenExrOrRefused) {
  const RunResult written = place.run({"oit", "box.obj", "-o", "out.exr", "--size=20,20"});
  if (written.exit_code == 2) {
    EXPECT_NE(written.err.find("no OpenEXR"), std::string::npos) << written.err;
    return;
  }
  ASSERT_EQ(written.exit_code, 0) << written.err;
  EXPECT_EQ(place.read("out.exr").substr(0, 4), "\x76\x2f\x31\x01");
}

TEST_F(Oit, PicturesDoNotDependOnThreads) {
  run({"box.obj", "high.obj", "-o", "one.png", "--samples=4", "-j1"});
  run({"box.obj", "high.obj", "-o", "four.png", "--samples=4", "-j4"});
  EXPECT_EQ(place.read("one.png"), place.read("four.png"));
}

TEST_F(Oit, TheListHasTheNamesThatTheOptionTakes) {
  const json list = json::parse(run({"--list", "--json"}).out)["list"];
  ASSERT_GT(list.size(), 0u);
  const std::string text = run({"--list"}).out;
  std::string names;
  for (const json& technique : list) {
    const std::string name = technique["name"];
    EXPECT_NE(("\n" + text).find("\n" + name + " "), std::string::npos) << name;
    EXPECT_NE(text.find(technique["fails"].get<std::string>()), std::string::npos) << name;
    EXPECT_NE(technique["paper"], "") << name;
    names += (names.empty() ? "" : ",") + name;
  }
  const json report =
      json::parse(run({"box.obj", "--technique", names, "--json", "--size=8,8"}).out);
  EXPECT_EQ(report["techniques"].size(), list.size());
}

TEST_F(Oit, TheReportHasTheNamesThatItsPageHas) {
  std::set<std::string> names;
  const json report = json::parse(run({"box.obj", "--technique=all", "--json", "--size=8,8"}).out);
  testkit::collect(report, "", names);
  testkit::collect(json::parse(run({"--list", "--json"}).out), "", names);
  place.write("fog.json", R"({"media": [{"object": "*", "extinction": 0.1}]})");
  testkit::collect(json::parse(run({"box.obj", "--media=fog.json", "--json", "--size=8,8"}).out),
                   "", names);
  names.erase("techniques");
  auto documented = testkit::documented("`strata oit`");
  for (const char* only_with_one : {"warnings[].code", "warnings[].message"}) {
    EXPECT_EQ(documented.erase(only_with_one), 1u);
  }
  names.erase("warnings");
  EXPECT_EQ(names, documented);
}

TEST_F(Oit, ExactTechniquesDifferNowhereAndCountEveryFragment) {
  const json report =
      json::parse(run({"box.obj", "high.obj", "--technique=all", "--json", "--size=40,40"}).out);
  EXPECT_EQ(report["scene"]["objects"], 2);
  EXPECT_EQ(report["scene"]["triangles"], 24);
  int exact = 0;
  for (const json& technique : report["techniques"]) {
    if (technique["accuracy"] != "exact" || !technique["left_out"].is_null()) continue;
    ++exact;
    EXPECT_LE(technique["difference"]["largest"], 1e-5) << technique["name"];
    EXPECT_EQ(technique["difference"]["pixels"], 0) << technique["name"];
    EXPECT_EQ(technique["costs"]["lost"], 0) << technique["name"];
    EXPECT_EQ(technique["costs"]["fragments"], report["techniques"][0]["costs"]["fragments"]);
  }
  EXPECT_GT(exact, 1);
}

TEST_F(Oit, MistakesAreNamedAndLeaveNothing) {
  refuses({"box.obj", "-o", "a.png", "--opacity=1.5"}, 2, "--opacity must be 0 to 1, got 1.5");
  refuses({"box.obj", "-o", "a.png", "--opacity=nan"}, 2, "--opacity");
  refuses({"box.obj", "-o", "a.png", "--load=0"}, 2, "--load must be above 0 and at most 1, got 0");
  refuses({"box.obj", "-o", "a.png", "--threshold=2"}, 2, "--threshold must be");
  refuses({"box.obj", "-o", "a.png", "--seed=-1"}, 2, "--seed must be 0 or more, got -1");
  refuses({"box.obj", "-o", "a.png", "--technique=magic"}, 2, "there is no technique 'magic'");
  refuses({"box.obj", "-o", "a.png", "--technique=count-scan:3"}, 2, "takes no number");
  refuses({"box.obj", "-o", "a.jpg"}, 2, "pictures are written as .png or .exr");
  refuses({"box.obj"}, 2, "nothing to do");
  refuses({"-o", "a.png"}, 2, "no input file is given");
  refuses({"none.obj", "-o", "a.png"}, 3, "none.obj");
  refuses({"box.obj", "-o", "-", "--technique=count-scan,dual-peeling"}, 2, "is a stream");
  refuses({"box.obj", "-o", "no/a.png"}, 4, "no/a.png");
}

TEST_F(Oit, InputsAreNotOverwritten) {
  std::filesystem::create_hard_link(place.path("box.obj"), place.path("link-count-scan.png"));
  const std::string before = place.read("box.obj");
  refuses({"box.obj", "-o", "link.png", "--technique=count-scan,dual-peeling"}, 2, "overwrite");
  refuses({"box.obj", "--json=box.obj", "-o", "a.png"}, 2, "overwrite");
  EXPECT_EQ(place.read("box.obj"), before);
  std::filesystem::create_directory(place.path("full"));
  place.write("full/note.txt", "mine");
  refuses({"box.obj", "-o", "full/"}, 4, "full");
  EXPECT_EQ(place.read("full/note.txt"), "mine");
}

}  // namespace
}  // namespace strata
