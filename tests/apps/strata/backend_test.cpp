// --backend: the same files, byte for byte, whoever makes the lists and finds the surfaces.

#include <gtest/gtest.h>

#include <cstdlib>

#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/apps/strata/run_tool.h"

namespace strata {
namespace {

using testkit::RunResult;
using testkit::Workplace;

const char* const kKnot = STRATA_SOURCE_DIR "/data/knot.obj";
const char* const kOpen = STRATA_SOURCE_DIR "/data/open_sphere.off";

constexpr const char* kScene = R"(difference() {
  union() {
    cube(size = [20, 20, 5], center = false);
    multmatrix([[1, 0, 0, 10], [0, 1, 0, 10], [0, 0, 1, 5], [0, 0, 0, 1]])
      sphere($fn = 30, $fa = 12, $fs = 2, r = 6);
  }
  multmatrix([[1, 0, 0, 10], [0, 1, 0, 10], [0, 0, 1, -1], [0, 0, 0, 1]])
    cylinder($fn = 24, $fa = 12, $fs = 2, h = 20, r1 = 3, r2 = 3, center = false);
  cube(size = [5, 5, 5], center = false);
}
)";

/// Tests that need --backend gl.
class Backends : public testing::Test {
 protected:
  void SetUp() override {
    const RunResult run =
        place_.run({"voxelize", kKnot, "-r", "8", "--checksum", "--backend", "gl"});
    if (run.exit_code == 0) return;
    ASSERT_EQ(run.exit_code, 2) << run.err;
    EXPECT_NE(run.err.find("--backend gl: "), std::string::npos) << run.err;
    const bool built = run.err.find("without OpenGL") == std::string::npos;
    if (built && std::getenv("CI") != nullptr) FAIL() << run.err;
    GTEST_SKIP() << run.err;
  }

  /// Runs a command with both backends; `output` must be the same.
  void expect_same(const std::vector<std::string>& arguments, const std::string& extension) {
    std::string bytes[2];
    for (const bool gl : {false, true}) {
      const std::string name = (gl ? "gl" : "cpu") + extension;
      std::vector<std::string> all = arguments;
      all.insert(all.end(), {"-o", name, "--backend", gl ? "gl" : "cpu"});
      const RunResult run = place_.run(all);
      ASSERT_EQ(run.exit_code, 0) << run.err;
      bytes[gl ? 1 : 0] = place_.read(name);
    }
    EXPECT_FALSE(bytes[0].empty());
    EXPECT_TRUE(bytes[0] == bytes[1]) << arguments[0] << " " << arguments[1] << extension;
  }

  Workplace place_;
};

TEST_F(Backends, WriteTheSameVoxels) {
  for (const char* extension : {".npy", ".vdb", ".nrrd"}) {
    expect_same({"voxelize", kKnot, "-r", "150"}, extension);
  }
  for (const char* axis : {"x", "y", "z"}) {
    for (const char* grid : {"70,64,65", "7,3,100", "1,1,1"}) {
      std::string sums[2];
      for (const bool gl : {false, true}) {
        const RunResult run = place_.run({"voxelize", kKnot, "--grid", grid, "--axis", axis,
                                          "--checksum", "-q", "--backend", gl ? "gl" : "cpu"});
        ASSERT_EQ(run.exit_code, 0) << run.err;
        sums[gl ? 1 : 0] = run.out;
      }
      EXPECT_EQ(sums[0], sums[1]) << grid << " along " << axis;
    }
  }
  expect_same({"voxelize", kOpen, "-r", "90"}, ".npy");  // closed by caps
  expect_same({"voxelize", kKnot, "-r", "60", "--solid", "--surface"}, ".npy");
  for (const char* store : {"ha", "scan"}) {
    expect_same({"voxelize", kKnot, "-r", "100", "--store", store}, ".npy");
  }
}

TEST_F(Backends, WriteTheSameLists) {
  for (const char* axis : {"x", "y", "z"}) {
    expect_same({"ldi", kKnot, "-r", "130", "--axis", axis}, ".npz");
  }
  expect_same({"ldi", kOpen, "-r", "40"}, ".npz");
}

TEST_F(Backends, ListsOfHundredsOfLayersAreTheSame) {
  // 600 walls across the rays: more than a record's age counts.
  TriangleSoup walls;
  for (int i = 0; i < 300; ++i) {
    const TriangleSoup wall = make_box({2.0 * i, 0, 0}, {2.0 * i + 1, 10, 10});
    const auto first = static_cast<unsigned>(walls.positions.size());
    walls.positions.insert(walls.positions.end(), wall.positions.begin(), wall.positions.end());
    for (const auto& t : wall.triangles) walls.triangles.push_back(t + first);
  }
  ASSERT_TRUE(write_mesh(place_.path("walls.obj"), walls));
  for (const char* store : {"ha", "scan"}) {
    expect_same({"voxelize", "walls.obj", "-r", "1200", "--axis", "x", "--store", store}, ".npy");
    expect_same({"ldi", "walls.obj", "-r", "1200", "--axis", "x", "--store", store}, ".npz");
  }
}

TEST_F(Backends, WriteTheSamePicturesAndVoxelsOfScenes) {
  place_.write("scene.csg", kScene);
  expect_same({"csg", "scene.csg", "--size", "200,150"}, ".png");
  expect_same({"csg", "scene.csg", "--size", "80,60", "--samples", "4", "--edges"}, ".png");
  expect_same({"csg", "scene.csg", "--size", "90,90", "--cut", "x=10", "--transparent"}, ".png");
  expect_same({"csg", "scene.csg", "--size", "90,70", "--projection", "o"}, ".png");
  expect_same({"voxelize", "scene.csg", "-r", "90"}, ".npy");
  expect_same({"ldi", "scene.csg", "-r", "60"}, ".npz");
}

TEST_F(Backends, CutVastSolidsOffAlike) {
  for (const char* size : {"1e10", "1e20", "1e200"}) {
    std::string scene = "difference() { sphere($fn = 32, r = 5); cube(size = [S, S, S]); }";
    for (auto at = scene.find('S'); at != std::string::npos; at = scene.find('S')) {
      scene.replace(at, 1, size);
    }
    place_.write("vast.csg", scene);
    expect_same({"csg", "vast.csg", "--size", "120,90", "--camera=0,0,0,55,0,155,40"}, ".png");
    expect_same({"voxelize", "vast.csg", "-r", "60"}, ".npy");
    expect_same({"ldi", "vast.csg", "-r", "40"}, ".npz");
  }
  // A small part before a vast one, which surrounds the eye's side of the scene.
  place_.write("beside.csg",
               "cube(size = [1e5, 1e5, 1e5]); multmatrix([[1, 0, 0, -5], [0, 1, 0, -5], "
               "[0, 0, 1, -5], [0, 0, 0, 1]]) { cube(size = [1, 1, 1]); }");
  expect_same({"csg", "beside.csg", "--size", "120,90", "--camera=-4.5,-4.5,-4.5,55,0,25,8"},
              ".png");
}

TEST_F(Backends, MakeTheSameListsOfTrees) {
  place_.write("scene.csg", kScene);
  for (const char* axis : {"x", "y", "z"}) {
    expect_same({"ldi", "scene.csg", "-r", "140", "--axis", axis}, ".npz");
  }
  expect_same({"voxelize", "scene.csg", "-r", "150"}, ".vdb");
  for (const char* store : {"ha", "scan"}) {
    expect_same({"voxelize", "scene.csg", "-r", "100", "--store", store}, ".nrrd");
    expect_same({"ldi", "scene.csg", "-r", "65", "--store", store}, ".npz");
  }
  // What is said of them counts the solids' crossings, whoever makes the tree's of them.
  std::string counts[2];
  for (const bool gl : {false, true}) {
    const RunResult run = place_.run(
        {"voxelize", "scene.csg", "-r", "90", "--json=-", "-q", "--backend", gl ? "gl" : "cpu"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const std::size_t at = run.out.find("\"crossings\"");
    ASSERT_NE(at, std::string::npos) << run.out;
    counts[gl ? 1 : 0] = run.out.substr(at, run.out.find('\n', at) - at);
  }
  EXPECT_EQ(counts[0], counts[1]);
}

TEST_F(Backends, DriversThatLackSomethingAreNamed) {
  // Mesa can be told to lack things; another driver does not listen, and does the work.
  const bool listens = place_.run({"info", "--gl"}).out.find("Mesa") != std::string::npos;
  int refused = 0;
  for (const char* lack :
       {"MESA_EXTENSION_OVERRIDE=-GL_ARB_gpu_shader_int64", "MESA_GL_VERSION_OVERRIDE=3.3FC"}) {
    place_.write("scene.csg", kScene);
    const testkit::RunOptions options{.environment = {lack}};
    for (const auto& command :
         {std::vector<std::string>{"voxelize", kKnot, "-r", "50", "-o", "out.npy"},
          {"ldi", kKnot, "-r", "50", "-o", "out.npz"},
          {"csg", "scene.csg", "-o", "out.png"}}) {
      std::vector<std::string> arguments = command;
      arguments.insert(arguments.end(), {"--backend", "gl"});
      const RunResult run = place_.run(arguments, options);
      if (run.exit_code == 0 && !listens) continue;
      ++refused;
      EXPECT_EQ(run.exit_code, 2) << lack << ": " << run.err;
      EXPECT_NE(run.err.find("strata: error: --backend gl: "), std::string::npos) << run.err;
      EXPECT_FALSE(place_.has(command.back())) << lack;
    }
  }
  if (refused == 0) GTEST_SKIP() << "this driver cannot be told to lack anything";
}

/// A context that is lost, a shader that is refused: llvmpipe shows neither, so they are provoked.
class Faults : public Backends {
 protected:
  void SetUp() override {
    Backends::SetUp();
    place_.write("scene.csg", kScene);
    std::vector<std::string> depth = {"csg", "scene.csg", "--size=90,70", "--depth", "depth.exr"};
    commands_.push_back(depth);
    depth.insert(depth.end(), {"-o", "depth.png"});
    if (place_.run(depth).exit_code != 0) commands_.pop_back();  // built without OpenEXR
  }
  /// Runs a command whose output is `name`, under a fault, on what --backend auto takes for a GPU.
  RunResult run(std::vector<std::string> command, const std::string& name, const std::string& fault,
                const char* backend = "auto") {
    command.insert(command.end(), {"-o", name, "--backend", backend});
    return place_.run(command, {.environment = {"STRATA_GL_FAULTS=hardware," + fault}});
  }
  /// The bytes of all that a command writes: `name`, and what csg writes beside it.
  [[nodiscard]] std::string written(const std::vector<std::string>& command,
                                    const std::string& name) const {
    std::string bytes = place_.read(name);
    for (const std::string& word : command) {
      if (word == "ids.png" || word == "depth.exr") bytes += place_.read(word);
    }
    return bytes;
  }
  static std::size_t count(const std::string& text, const std::string& word) {
    std::size_t found = 0;
    for (std::size_t at = 0; (at = text.find(word, at)) != std::string::npos; ++at) ++found;
    return found;
  }
  /// The CPU's bytes, and one sentence that says `why`; nothing is said where nothing was provoked.
  void expect_cpu(const std::vector<std::string>& command, const std::string& extension,
                  const std::string& fault, const std::string& why, bool* quiet = nullptr) {
    if (expected_.first != command) {
      const RunResult cpu = run(command, "cpu" + extension, "", "cpu");
      ASSERT_EQ(cpu.exit_code, 0) << cpu.err;
      expected_ = {command, written(command, "cpu" + extension)};
    }
    const RunResult found = run(command, "found" + extension, fault);
    ASSERT_EQ(found.exit_code, 0) << fault << ": " << found.err;
    EXPECT_TRUE(written(command, "found" + extension) == expected_.second)
        << command[0] << " " << command.back() << " " << fault;
    const std::size_t said = count(found.err, "warning: the ");
    EXPECT_EQ(said, count(found.err, why)) << fault << ": " << found.err;
    EXPECT_LE(said, 1u) << fault << ": " << found.err;
    if (quiet == nullptr) {
      EXPECT_EQ(said, 1u) << fault << ": " << found.err;
    } else {
      *quiet = said == 0;
    }
  }

  std::pair<std::vector<std::string>, std::string> expected_;  ///< what a command writes
  std::vector<std::vector<std::string>> commands_ = {
      {"voxelize", "scene.csg", "-r", "70"},
      {"voxelize", kKnot, "-r", "70", "--store", "ha"},
      {"voxelize", kOpen, "-r", "40"},
      {"ldi", "scene.csg", "-r", "50"},
      {"csg", "scene.csg", "--size", "90,70"},
      {"voxelize", "scene.csg", "-r", "70", "--ids"},
      {"csg", "scene.csg", "--size", "90,70", "--ids", "ids.png"}};
  static std::string extension_of(const std::vector<std::string>& command) {
    return command[0] == "voxelize" ? ".npy" : command[0] == "ldi" ? ".npz" : ".png";
  }
};

TEST_F(Faults, ALostContextIsASentenceAndTheCpuGoesOn) {
  for (const auto& command : commands_) {
    // At the first downloads, then at some, until there are no more.
    bool quiet = false;
    int lost = 0;
    for (int at = 1; !quiet && at < 200; at += 1 + at / 10) {
      expect_cpu(command, extension_of(command), "lose-context=" + std::to_string(at),
                 "context was lost, for a reason that the driver does not know", &quiet);
      if (HasFailure()) return;
      lost += quiet ? 0 : 1;
    }
    EXPECT_TRUE(quiet) << command[0];
    EXPECT_GT(lost, 5) << command[0];
  }
}

TEST_F(Faults, ALostContextIsAnErrorWhereTheGpuWasAskedFor) {
  for (const auto& command : commands_) {
    const std::string name = "out" + extension_of(command);
    for (const int at : {2, 7}) {
      const RunResult lost = run(command, name, "lose-context=" + std::to_string(at), "gl");
      EXPECT_GT(lost.exit_code, 0) << lost.err;
      EXPECT_EQ(count(lost.err, "strata: error: "), 1u) << lost.err;
      EXPECT_NE(lost.err.find("context was lost"), std::string::npos) << lost.err;
      EXPECT_FALSE(place_.has(name));
    }
  }
}

TEST_F(Faults, ARefusedShaderIsNamedAndTheCpuDoesTheWork) {
  // Each with a command that needs it.
  for (const auto& [shader, i] : {std::pair<std::string, std::size_t>{"compute_bin", 0},
                                  {"compute_large", 1},
                                  {"prefix_sum", 2},
                                  {"sort_lists", 3},
                                  {"result.comp", 0},
                                  {"csg/gl/walk.comp", 4}}) {
    const auto& command = commands_[i];
    const std::string fault = "refuse-shader=" + shader, name = "out" + extension_of(command);
    expect_cpu(command, extension_of(command), fault, "refuses a shader");
    if (HasFailure()) return;
    const RunResult asked = run(command, name, fault, "gl");
    EXPECT_EQ(asked.exit_code, 2) << asked.err;
    EXPECT_NE(asked.err.find("strata: error: --backend gl: "), std::string::npos) << asked.err;
    EXPECT_NE(asked.err.find(shader), std::string::npos) << asked.err;
    EXPECT_FALSE(place_.has(name));
  }
  // Where a store is refused, the other one takes over.
  bool quiet = false;
  expect_cpu(commands_[1], ".npy", "refuse-shader=hashbuffer/gl/insert_", "nothing", &quiet);
  EXPECT_TRUE(quiet);
}

TEST(Backend, IsAutoCpuOrGl) {
  const Workplace place;
  const RunResult wrong =
      place.run({"voxelize", kKnot, "-r", "8", "--checksum", "--backend", "cuda"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err.find("--backend must be auto, cpu or gl, got 'cuda'"), std::string::npos)
      << wrong.err;
}

TEST(Backend, ThatCannotBeHadIsASentenceAndNothingToAuto) {
  const Workplace place;
  const testkit::RunOptions options{.environment = {"STRATA_GL_DEVICE=device:99"}};
  const RunResult gl =
      place.run({"voxelize", kKnot, "-r", "8", "--checksum", "--backend", "gl"}, options);
  EXPECT_EQ(gl.exit_code, 2);
  EXPECT_NE(gl.err.find("strata: error: --backend gl: "), std::string::npos) << gl.err;
  const RunResult automatic =
      place.run({"voxelize", kKnot, "-r", "100", "--checksum", "--backend", "auto"}, options);
  EXPECT_EQ(automatic.exit_code, 0) << automatic.err;
  EXPECT_EQ(automatic.err, "");
}

}  // namespace
}  // namespace strata
