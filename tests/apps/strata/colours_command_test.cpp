// What `strata voxelize --colours` makes.

#include <gtest/gtest.h>

#include <string>

#include "strata/mesh/shapes.h"
#include "strata/voxelize/readers/read_voxels.h"
#include "tests/apps/strata/voxelize_fixture.h"

namespace strata {
namespace {

using testkit::RunResult;

class Colours : public testkit::VoxelizeFixture {
 protected:
  void SetUp() override {
    // A box of 8, its left half red and its right half blue: colours of materials.
    place.write("box.mtl", "newmtl r\nKd 1 0 0\nnewmtl b\nKd 0 0 1\n");
    std::string obj = "mtllib box.mtl\n";
    for (const int x : {0, 8}) {
      for (const int y : {0, 8}) {
        for (const int z : {0, 8}) {
          obj +=
              "v " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + "\n";
        }
      }
    }
    obj += "usemtl r\nf 1 2 4 3\n";                                              // x = 0
    obj += "usemtl b\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n";  // the others
    place.write("box.obj", obj);
  }
  /// The colour of a voxel; all 0 where there is none.
  glm::u8vec4 colour(const std::string& name, int i, int j, int k) const {
    const auto volume = read_voxels(place.path(name));
    EXPECT_TRUE(volume) << volume.error().message;
    if (!volume) return glm::u8vec4(0);
    const AxisFrame frame(volume->set.axis());
    const glm::ivec3 at = glm::ivec3(i, j, k) - volume->first_index;
    glm::u8vec4 found(0);
    for_each_labelled(volume->set, at[frame.u], at[frame.v],
                      [&](const Interval& run, std::uint32_t label) {
                        const int w = at[frame.w];
                        if (w >= run.begin() && w < run.end()) found = volume->colours[label - 1];
                      });
    return found;
  }
  void run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "voxelize");
    const RunResult result = place.run(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }
  void refuses(std::vector<std::string> arguments, const std::string& message) const {
    arguments.insert(arguments.begin(), "voxelize");
    const RunResult result = place.run(arguments);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_NE(result.err.find(message), std::string::npos) << result.err;
  }
};

const glm::u8vec4 kRed(255, 0, 0, 255), kBlue(0, 0, 255, 255), kGrey(128, 128, 128, 255);

TEST_F(Colours, AreThoseOfTheMaterialsAndGreyInside) {
  for (const char* name : {"a.npy", "a.vox", "a.npz"}) {
    SCOPED_TRACE(name);
    run({"box.obj", "-r", "8", "--colours", "-o", name});
    EXPECT_EQ(colour(name, 0, 4, 3), kRed);
    EXPECT_EQ(colour(name, 7, 4, 3), kBlue);
    EXPECT_EQ(colour(name, 4, 0, 3), kBlue);
    EXPECT_EQ(colour(name, 4, 4, 4), kGrey);
  }
  run({"box.obj", "-r", "8", "--colors", "--fill-color", "#102030", "-o", "b.npy"});
  EXPECT_EQ(colour("b.npy", 4, 4, 4), glm::u8vec4(16, 32, 48, 255));
  run({"box.obj", "-r", "8", "--surface", "--colours", "-o", "c.npy"});
  EXPECT_EQ(colour("c.npy", 0, 4, 3), kRed);
  EXPECT_EQ(colour("c.npy", 4, 4, 4), glm::u8vec4(0));
}

TEST_F(Colours, OfAnySceneAreThoseOfItsSolids) {
  place.write("two.csg",
              "color([1,0,0,1]) cube([4,4,4]);\n"
              "color([0,0,1,1]) multmatrix([[1,0,0,4],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) "
              "cube([4,4,4]);\n");
  run({"two.csg", "-r", "16", "--colours", "-o", "a.npy"});
  EXPECT_EQ(colour("a.npy", 3, 4, 4), kRed);
  EXPECT_EQ(colour("a.npy", 12, 4, 4), kBlue);
  run({"two.csg", "-r", "16", "--colours", "--fill-colour", "lime", "-o", "b.npy"});
  EXPECT_EQ(colour("b.npy", 0, 4, 4), kRed);
  EXPECT_EQ(colour("b.npy", 12, 4, 4), glm::u8vec4(0, 255, 0, 255));
}

TEST_F(Colours, MeshesWithoutColoursAreGreyWithAWarning) {
  put("plain.ply", make_box({0, 0, 0}, {4, 4, 4}));
  const RunResult result =
      place.run({"voxelize", "plain.ply", "-r", "4", "--colours", "-o", "p.npy"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_NE(result.err.find("no colours are given"), std::string::npos) << result.err;
  EXPECT_EQ(colour("p.npy", 0, 0, 0), glm::u8vec4(204, 204, 204, 255));
}

TEST_F(Colours, AreInTheReport) {
  const nlohmann::json mesh = report({"box.obj", "-r", "8", "--colours", "-o", "a.npy"});
  EXPECT_EQ(mesh["colours"],
            (nlohmann::json{{"source", "mesh"}, {"count", 3}, {"fill", "#808080"}}));
  const nlohmann::json lime =
      report({"box.obj", "-r", "8", "--colours", "--fill-colour", "lime", "-o", "a.npy"});
  EXPECT_EQ(lime["colours"]["fill"], "#00ff00");
  const nlohmann::json surface =
      report({"box.obj", "-r", "8", "--surface", "--colours", "-o", "a.npy"});
  EXPECT_EQ(surface["colours"]["count"], 2);
  place.write("red.csg", "color([1,0,0,1]) cube([4,4,4]);\n");
  const nlohmann::json scene = report({"red.csg", "-r", "8", "--colours", "-o", "a.npy"});
  EXPECT_EQ(scene["colours"],
            (nlohmann::json{{"source", "solids"}, {"count", 1}, {"fill", nullptr}}));
}

TEST_F(Colours, AreRefusedWhereTheyMakeNoSense) {
  refuses({"box.obj", "-r", "8", "--colours", "-o", "a.binvox"}, "npy, npz, nrrd");
  refuses({"box.obj", "-r", "8", "--colours", "--ids", "-o", "a.npy"}, "--ids");
  refuses({"box.obj", "-r", "8", "--colours", "--mask", "-o", "a.vdb"}, "--mask");
  refuses({"box.obj", "-r", "8", "--colours", "--stats"}, "--colours needs -o");
  refuses({"box.obj", "-r", "8", "--fill-colour", "red", "-o", "a.npy"}, "needs --colours");
  refuses({"box.obj", "-r", "8", "--colours", "--fill-colour", "#12345", "-o", "a.npy"},
          "--fill-colour must be a colour, got '#12345'");
  refuses({"box.obj", "-r", "8", "--surface", "--colours", "--fill-colour", "red", "-o", "a.npy"},
          "needs a solid");
}

}  // namespace
}  // namespace strata
