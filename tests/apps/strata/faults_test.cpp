// Bad input, bad output, too little memory, interrupts: the exit code of its class, a sentence, and
// no partial file.

#include <gtest/gtest.h>

#include <sys/stat.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <limits>
#include <thread>

#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/apps/strata/run_tool.h"
#include "tests/support/sanitized.h"

namespace strata {
namespace {

using testkit::RunOptions;
using testkit::RunResult;
using testkit::Workplace;

constexpr const char* kTetrahedron =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

class Faults : public testing::Test {
 protected:
  Faults() {
    EXPECT_TRUE(write_mesh(place.path("ball.obj"), make_icosphere(1.0, 4)));
    before = place.names();
  }

  /// Expects this exit code, a sentence with `part` on standard error, nothing on standard output,
  /// and no new file.
  void fails(const std::vector<std::string>& arguments, int code, const std::string& part,
             const RunOptions& options = {}) const {
    const RunResult run = place.run(arguments, options);
    EXPECT_EQ(run.signal, 0) << run.err;
    EXPECT_EQ(run.exit_code, code) << run.err;
    EXPECT_EQ(run.out, "");
    EXPECT_NE(run.err.find("strata: "), std::string::npos) << run.err;
    EXPECT_NE(run.err.find(part), std::string::npos) << run.err;
    EXPECT_EQ(place.names(), before);
  }

  void put(const std::string& name, const std::string& bytes) {
    place.write(name, bytes);
    before = place.names();
  }

  static std::vector<std::string> to_vdb(const std::string& mesh) {
    return {"voxelize", mesh, "-r", "32", "-o", "out.vdb"};
  }

  Workplace place;
  std::vector<std::string> before;
};

TEST_F(Faults, FilesThatCannotBeReadAreCode3) {
  fails(to_vdb("missing.obj"), 3, "missing.obj");
  fails({"info", "missing.obj"}, 3, "missing.obj");
  fails(to_vdb("."), 3, ".");
  put("empty.obj", "");
  fails(to_vdb("empty.obj"), 3, "empty.obj");
  put("words.obj", "this is no mesh\n");
  fails(to_vdb("words.obj"), 3, "words.obj");
  put("mesh.unknown", "neither name nor content\n");
  fails(to_vdb("mesh.unknown"), 3, "mesh.unknown");
  put("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  fails(to_vdb("points.obj"), 3, "points.obj");
}

TEST_F(Faults, EveryTruncationOfABinaryFileEndsInAnOrderlyWay) {
  const Workplace other;
  ASSERT_TRUE(write_mesh(other.path("box.stl"), make_box({0, 0, 0}, {1, 1, 1})));
  const std::string bytes = other.read("box.stl");
  for (std::size_t length = 0; length < bytes.size(); length += 37) {
    put("cut.stl", bytes.substr(0, length));
    const RunResult run = place.run(to_vdb("cut.stl"));
    // Whole triangles are read, with a warning, whatever the header claims.
    const bool is_whole = length > 84 && (length - 84) % 50 == 0;
    EXPECT_EQ(run.exit_code, is_whole ? 0 : 3) << length << ": " << run.err;
    EXPECT_NE(run.err.find("cut.stl"), std::string::npos) << length;
    EXPECT_EQ(place.has("out.vdb"), is_whole) << length;
    std::filesystem::remove(place.path("out.vdb"));
  }
}

TEST_F(Faults, FacesThatHadToBeDroppedAreCounted) {
  put("bad.obj", std::string(kTetrahedron) + "v nan 0 0\nf 1 2 5\nf 1 2 77\n");
  const RunResult run = place.run({"voxelize", "bad.obj", "-r", "8", "--stats"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.err.find("2 of 6 faces dropped"), std::string::npos) << run.err;
  EXPECT_NE(place.run({"voxelize", "bad.obj", "-r", "8", "--stats", "--strict"}).exit_code, 0);
}

TEST_F(Faults, GeometryThatCannotBeVoxelizedIsCode5) {
  put("point.obj", "v 1 2 3\nv 1 2 3\nv 1 2 3\nf 1 2 3\n");
  fails(to_vdb("point.obj"), 5, "(1, 2, 3)");
  put("huge.obj", "v -1e308 0 0\nv 1e308 0 0\nv 0 1e308 0\nf 1 2 3\n");
  fails({"voxelize", "huge.obj", "-r", "32", "-o", "out.vdb", "-q"}, 5, "huge.obj");
  put("far.obj", "v 1e17 0 0\nv 100000000000000064 0 0\nv 1e17 64 0\nf 1 2 3\n");
  fails({"voxelize", "far.obj", "-r", "64", "-o", "out.vdb", "-q"}, 5, "far.obj");
}

TEST_F(Faults, GridsBeyondTheLimitsAreCode6) {
  fails({"voxelize", "ball.obj", "-r", "1000000000", "-o", "out.vdb"}, 6, "1000000000");
  fails({"voxelize", "ball.obj", "--voxel-size", "1e-9", "--stats"}, 6, "2000000000");
  fails({"voxelize", "ball.obj", "--grid", "65537,1,1", "--stats"}, 6, "65537");
  fails({"voxelize", "ball.obj", "-r", "256", "-o", "out.vdb", "--memory-limit", "1M"}, 6,
        "--memory-limit");
}

TEST_F(Faults, OutputsThatCannotBeMadeAreCode4) {
  fails({"voxelize", "ball.obj", "-r", "16", "-o", "no/such/out.vdb"}, 4, "no/such/out.vdb");
  fails({"voxelize", "ball.obj", "-r", "16", "-o", "ball.obj/out.vdb"}, 4, "ball.obj/out.vdb");
  fails({"voxelize", "ball.obj", "-r", "16", "-o", "/dev/full", "--format", "npy"}, 4, "/dev/full");
  fails({"voxelize", "ball.obj", "-r", "16", "--json=no/such.json"}, 4, "no/such.json");
}

TEST_F(Faults, AFullDiskBehindStandardOutputIsCode4) {
  const RunOptions full{.stdout_path = "/dev/full"};
  fails({"voxelize", "ball.obj", "-r", "64", "-o", "-", "--format", "npy"}, 4, "", full);
  fails({"voxelize", "ball.obj", "-r", "64", "--stats"}, 4, "standard output", full);
  fails({"info", "ball.obj", "--json"}, 4, "standard output", full);
  EXPECT_EQ(place.run({"--help"}, full).exit_code, 4);
}

TEST_F(Faults, AClosedPipeEndsQuietlyWithTheCodeThatShellsGiveIt) {
  const RunOptions closed{.closed_stdout_pipe = true};
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"voxelize", "ball.obj", "-r", "64", "-o", "-", "--format", "npy"},
        {"voxelize", "ball.obj", "-r", "64", "--stats"},
        {"mesh", "ball.obj", "-q", "-o", "-", "--format", "obj"},
        {"info", "ball.obj"}}) {
    const RunResult run = place.run(command, closed);
    EXPECT_EQ(run.exit_code, 128 + SIGPIPE) << command[0];
    EXPECT_EQ(run.err, "") << command[0];
    EXPECT_EQ(place.names(), before);
  }
}

TEST_F(Faults, AFileSizeLimitIsCode4AndLeavesNothing) {
  for (const char* name : {"out.vdb", "out.npy", "out.nrrd", "out.vti", "out.binvox", "out.vox"}) {
    fails({"voxelize", "ball.obj", "-r", "200", "-o", name}, 4, name, {.file_size = 4096});
  }
  fails({"voxelize", "ball.obj", "-r", "200", "-o", "out.zarr"}, 4, "out.zarr", {.file_size = 64});
  fails({"voxelize", "ball.obj", "-r", "200", "-o", "slices/"}, 4, "slices", {.file_size = 64});
}

TEST_F(Faults, AnInterruptIsCode130AndLeavesNothing) {
  if (testkit::kSanitized) GTEST_SKIP() << "the job would take minutes";
  for (const int signal : {SIGINT, SIGTERM}) {
    RunOptions options;
    options.while_running = [&](int pid) {
      // The temporary file appears when voxelizing begins; it takes seconds from there.
      for (int i = 0; i < 20000 && place.names() == before; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      EXPECT_NE(place.names(), before) << "the run was over too soon";
      kill(pid, signal);
    };
    fails({"voxelize", "ball.obj", "-r", "30000", "-o", "out.vdb", "-j", "1"}, 130, "interrupted",
          options);
  }
}

TEST_F(Faults, AnInterruptEndsTheWaitForAPipe) {
  RunOptions options;
  options.silent_stdin_pipe = true;
  options.while_running = [](int pid) {
    // Wait until the handler is there: bit 1 of the signals that are caught.
    const auto catches_interrupts = [pid] {
      std::ifstream in("/proc/" + std::to_string(pid) + "/status");
      for (std::string line; std::getline(in, line);) {
        if (line.starts_with("SigCgt:")) return (std::stoull(line.substr(7), nullptr, 16) & 2) != 0;
      }
      return false;
    };
    for (int i = 0; i < 20000 && !catches_interrupts(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    kill(pid, SIGINT);
  };
  fails({"info", "-", "--input-format", "obj"}, 130, "interrupted", options);
}

TEST_F(Faults, TooLittleAddressSpaceIsCode6AndLeavesNothing) {
  if (testkit::kSanitized) GTEST_SKIP() << "sanitizers take address space without limit";
  int refused = 0, done = 0;
  for (rlim_t megabytes = 24; megabytes <= 400; megabytes += megabytes < 100 ? 4 : 50) {
    const RunOptions options{.address_space = megabytes << 20};
    if (place.run({"--version"}, options).exit_code != 0) continue;  // the loader has too little
    for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
             {"voxelize", "ball.obj", "-r", "500", "-o", "out.vdb", "-q"},
             {"voxelize", "ball.obj", "-r", "300", "-o", "slices/", "-q"},
             {"voxelize", "ball.obj", "-r", "300", "-o", "out.vti", "-q", "--surface"},
             {"info", "ball.obj"}}) {
      const RunResult run = place.run(arguments, options);
      EXPECT_EQ(run.signal, 0) << megabytes << " MB: " << run.err;
      if (run.exit_code == 0) {
        ++done;
        std::filesystem::remove_all(place.path("out.vdb"));
        std::filesystem::remove_all(place.path("out.vti"));
        std::filesystem::remove_all(place.path("slices"));
        continue;
      }
      ++refused;
      EXPECT_EQ(run.exit_code, 6) << megabytes << " MB: " << run.err;
      EXPECT_NE(run.err, "");
      EXPECT_EQ(place.names(), before) << megabytes << " MB";
    }
  }
  EXPECT_GT(refused, 0);
  EXPECT_GT(done, 0);
}

TEST_F(Faults, AnExistingFileSurvivesAFailedRun) {
  put("out.vdb", "precious");
  fails(to_vdb("missing.obj"), 3, "missing.obj");
  fails({"voxelize", "ball.obj", "-r", "200", "-o", "out.vdb"}, 4, "out.vdb", {.file_size = 4096});
  EXPECT_EQ(place.read("out.vdb"), "precious");
}

TEST_F(Faults, AClosedStandardInputIsNotAnotherFile) {
  RunOptions closed;
  closed.closed_stdin = true;
  fails({"info", "-", "--input-format", "stl"}, 3, "standard input is closed", closed);
  fails({"csg", "-", "--input-format", "csg", "-o", "a.png"}, 3, "is closed", closed);
  const RunResult run = place.run({"info", "ball.obj"}, closed);
  EXPECT_EQ(run.exit_code, 0) << run.err;
}

/// A pipe with a name and nobody who writes to it.
TEST_F(Faults, APipeWithoutAWriterHearsAStop) {
  ASSERT_EQ(mkfifo(place.path("pipe.stl").c_str(), 0600), 0);
  before = place.names();
  RunOptions options;
  double seconds = 0.0;
  options.while_running = [&seconds](int pid) {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    kill(pid, SIGTERM);
    const auto begin = std::chrono::steady_clock::now();
    siginfo_t ended{};
    waitid(P_PID, static_cast<id_t>(pid), &ended, WEXITED | WNOWAIT);
    seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  fails({"voxelize", "pipe.stl", "-r", "8", "--stats"}, 130, "interrupted", options);
  EXPECT_LT(seconds, 10.0);  // without end it was
}

TEST_F(Faults, CommandsReadAPipeOnce) {
  ASSERT_EQ(mkfifo(place.path("pipe.stl").c_str(), 0600), 0);
  ASSERT_EQ(mkfifo(place.path("pipe.obj").c_str(), 0600), 0);
  before = place.names();
  std::string text;
  const auto writes = [&](const std::string& name) {
    RunOptions options;
    options.while_running = [&text, path = place.path(name)](int) { std::ofstream(path) << text; };
    return options;
  };
  const std::vector<std::vector<std::string>> commands = {
      {"info"}, {"csg"}, {"voxelize", "-r", "8", "--stats"}, {"picture", "-o", "out.png"}};
  for (std::vector<std::string> words : commands) {
    SCOPED_TRACE(words.front());
    words.insert(words.begin() + 1, "pipe.stl");
    text = "solid a\nfacet\nendsolid a\n";
    fails(words, 3, "pipe.stl", writes("pipe.stl"));
    words[1] = "pipe.obj";
    text =
        "mtllib none.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\n"
        "f 2 3 4\nf 3 1 4\n";
    const RunResult run = place.run(words, writes("pipe.obj"));
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
}

TEST_F(Faults, ATimeLimitEndsTheCommand) {
  ASSERT_EQ(mkfifo(place.path("pipe.csg").c_str(), 0600), 0);
  before = place.names();
  fails({"csg", "pipe.csg", "-o", "a.png", "--time-limit", "0.2"}, 6,
        "not finished within 0.2 s (--time-limit); no output was written");
  fails({"info", "ball.obj", "--time-limit", "0"}, 2,
        "--time-limit must be seconds above 0, got 0");
  const RunResult run = place.run({"info", "ball.obj", "--time-limit", "1e300"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
}

TEST_F(Faults, ARootFolderKeepsAScenesFilesInside) {
  std::filesystem::create_directories(place.path("root/in"));
  std::filesystem::copy_file(place.path("ball.obj"), place.path("root/ball.obj"));
  std::filesystem::create_symlink("../ball.obj", place.path("root/link.obj"));
  put("root/in/inside.csg", "cube();\nimport(file = \"../ball.obj\");\n");
  put("root/in/outside.csg", "cube();\n  import(file = \"../../ball.obj\");\n");
  put("root/linked.csg", "import(file = \"link.obj\");");
  put("root/absolute.csg", "surface(file = \"" + place.path("ball.obj") + "\");");
  put("root/around.csg", "group() { import(file = \"in/../../root/ball.obj\"); }");
  fails({"csg", "root/in/outside.csg", "--root", "root"}, 3,
        "root/in/outside.csg:2:3: 'import' needs the file '../../ball.obj', which lies outside of "
        "the root folder root");
  fails({"csg", "root/linked.csg", "--root", "root"}, 3, "root/linked.csg:1:1: 'import' needs");
  fails({"voxelize", "root/absolute.csg", "--root", "root", "-r", "4", "--stats"}, 3,
        "root/absolute.csg:1:1: 'surface' needs");
  for (const char* scene : {"root/in/inside.csg", "root/around.csg"}) {
    const RunResult run = place.run({"csg", scene, "--root", "root", "--strict"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
  fails({"csg", "root/in/inside.csg", "--root", "no"}, 2, "--root no: there is no such folder");
}

TEST_F(Faults, NamesInAFileDoNotDriveTheTerminal) {
  const std::string escapes = "\\x1b[31mred\\x1b]0;title\\x07\\nstrata: error: forged\\u202e";
  const std::string raw = "\x1b[2J\x7f\xc2\x9b\xff\r";
  for (const std::string& text :
       {"import(file = \"" + escapes + ".stl\"); cube();",
        "surface(file = \"" + raw + "\"); cube();",
        "text(text = \"" + escapes + "\", font = \"" + raw + "\"); cube();",
        "import(file = \"" + raw + ".xyz\"); cube();",
        "import(file = \"" + std::string(100'000, 'n') + ".stl\"); cube();",
        std::string(100'000, 'm') + "(); cube();", "cube(size = \"" + raw + "\");",
        std::string(100'000, 'm') + " cube();", "cube(" + raw + ");"}) {
    put("scene.csg", text);
    for (const RunResult& run :
         {place.run({"csg", "scene.csg"}), place.run({"csg", "scene.csg", "--json", "-q"})}) {
      const std::string all = run.out + run.err;
      const bool controls = std::any_of(all.begin(), all.end(), [](char c) {
        return (static_cast<unsigned char>(c) < 0x20 && c != '\n') || c == 0x7f;
      });
      EXPECT_FALSE(controls) << all;
      EXPECT_EQ(all.find("\xc2\x9b"), std::string::npos) << all;
      EXPECT_EQ(all.find("\nstrata: error: forged"), std::string::npos) << all;
      EXPECT_LT(all.size(), 4000u);
    }
  }
}

}  // namespace
}  // namespace strata
