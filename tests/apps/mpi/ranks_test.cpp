// `mpirun strata-mpi voxelize`: the ranks of a job make what one process makes.

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <thread>

#include "apps/mpi/peers.h"
#include "strata/mesh/shapes.h"
#include "tests/apps/strata/voxelize_fixture.h"

namespace strata {
namespace {

using nlohmann::json;
using testkit::RunOptions;
using testkit::RunResult;
namespace fs = std::filesystem;

/// Processes that run strata-mpi below another one.
std::vector<pid_t> ranks_below(pid_t parent) {
  std::vector<pid_t> ranks;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream in(entry.path() / "stat");
    std::string line;
    std::getline(in, line);
    const std::size_t end = line.rfind(')');
    if (end == std::string::npos || line.find("(strata-mpi)") == std::string::npos) continue;
    char state = 0;
    pid_t above = 0;
    std::istringstream(line.substr(end + 1)) >> state >> above;
    if (above == parent) ranks.push_back(static_cast<pid_t>(std::stol(name)));
  }
  return ranks;
}

class Ranks : public testkit::VoxelizeFixture {
 protected:
  void SetUp() override {
    put("knot.obj", make_torus_knot(2, 3, 0.4, 90, 14));
    put("ball.stl", make_icosphere(1.3, 3));
    fs::create_directory(place.path("whole"));
  }

  RunResult mpi(int ranks, std::vector<std::string> arguments, RunOptions options = {}) const {
    options.program = STRATA_MPIRUN;
    options.environment = {"OMPI_ALLOW_RUN_AS_ROOT=1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1",
                           "OMPI_MCA_rmaps_base_oversubscribe=1",
                           "OMPI_MCA_hwloc_base_binding_policy=none"};
    std::vector<std::string> words = {"-n", std::to_string(ranks), STRATA_MPI, "voxelize"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return place.run(words, options);
  }

  [[nodiscard]] std::map<std::string, std::string> bytes_of(const std::string& name) const {
    std::map<std::string, std::string> files;
    const fs::path path = place.path(name);
    if (fs::is_regular_file(path)) files["itself"] = place.read(name);
    if (!fs::is_directory(path)) return files;
    for (const auto& entry : fs::recursive_directory_iterator(path)) {
      const std::string inside = entry.path().lexically_relative(path).string();
      files[inside] = entry.is_regular_file() ? place.read(name + "/" + inside) : "folder";
    }
    return files;
  }

  static json numbers_of(json report) {
    for (const char* other : {"output", "timings_ms", "memory"}) report.erase(other);
    report["options"].erase("threads");
    report["lists"].erase("rebuilt_tiles");  // depends on how many threads there are
    return report;
  }

  void expect_same(const std::vector<std::string>& job, const std::vector<std::string>& files,
                   int ranks) const {
    SCOPED_TRACE(fmt::format("{} by {} ranks, {}", files.front(), ranks, job.back()));
    std::vector<std::string> whole = job, together = job;
    whole.insert(whole.end(), {"-o", "whole/" + files.front(), "--checksum"});
    together.insert(together.end(), {"-o", files.front(), "--checksum", "--json"});
    const json one = report(whole);
    const RunResult run = mpi(ranks, together);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(numbers_of(json::parse(run.out)), numbers_of(one));
    EXPECT_GT(one["voxels"]["solid"], 1000);
    for (const std::string& file : files) {
      const auto expected = bytes_of("whole/" + file);
      ASSERT_FALSE(expected.empty());
      EXPECT_TRUE(bytes_of(file) == expected) << file;
      fs::remove_all(place.path(file));
      fs::remove_all(place.path("whole/" + file));
    }
  }

  const std::vector<std::string> kKnot = {"knot.obj", "--grid", "200,210,220"};
};

TEST_F(Ranks, WriteTheBytesOfOneProcess) {
  for (const int ranks : {1, 2, 3, 5}) {
    for (const std::vector<std::string>& files :
         {std::vector<std::string>{"a.npy"}, {"a.raw", "a.nhdr"}, {"a.zarr"}, {"a.ome.zarr"}}) {
      expect_same(kKnot, files, ranks);
    }
  }
}

TEST_F(Ranks, ShareIdsFractionsAndSurfaces) {
  const std::string grid = "200,210,220";
  expect_same({"knot.obj", "ball.stl", "--grid", grid, "--ids"}, {"a.zarr"}, 3);
  expect_same({"knot.obj", "ball.stl", "--grid", grid, "--ids"}, {"a.npy"}, 2);
  expect_same({"knot.obj", "--grid", grid, "--coverage=2"}, {"a.ome.zarr"}, 3);
  expect_same({"knot.obj", "--grid", grid, "--coverage=2", "--floats"}, {"a.npy"}, 3);
  expect_same({"knot.obj", "--grid", grid, "--surface", "--solid"}, {"a.zarr"}, 3);
}

TEST_F(Ranks, TellTheNumbersOfOneProcess) {
  const json one = report({"knot.obj", "-r", "600", "--checksum"});
  for (const int ranks : {2, 5}) {
    const RunResult run = mpi(ranks, {"knot.obj", "-r", "600", "--checksum", "--json"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(numbers_of(json::parse(run.out)), numbers_of(one));
  }
  const RunResult checksum = mpi(3, {"knot.obj", "-r", "600", "--checksum"});
  EXPECT_EQ(checksum.out, std::string(one["voxels"]["checksum"]) + "\n");
}

TEST_F(Ranks, WriteOneVdbEachWithAnIndex) {
  const RunResult run = mpi(3, {"knot.obj", "--grid", "200,210,220", "-o", "a.vdb", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json index = json::parse(place.read("a.vdb/index.json"));
  EXPECT_EQ(index["dims"], (json{200, 210, 220}));
  EXPECT_EQ(index["solid"], json::parse(run.out)["voxels"]["solid"]);
  std::uint64_t solid = 0;
  for (const json& file : index["files"]) {
    const RunResult info = place.run({"info", "a.vdb/" + std::string(file), "--json"});
    ASSERT_EQ(info.exit_code, 0) << info.err;
    const json facts = json::parse(info.out);
    solid += facts["files"][0]["solid"].get<std::uint64_t>();
  }
  EXPECT_EQ(index["files"].size(), 3u);
  EXPECT_EQ(solid, index["solid"].get<std::uint64_t>());
}

TEST(RanksOfLargeJobs, GatherWhatAnIntCanCount) {
  constexpr std::size_t kMost = std::numeric_limits<int>::max();
  for (const std::size_t ranks : {1u, 2u, 2047u, 2048u, 2049u, 4096u, 100'000u, 10'000'000u}) {
    EXPECT_LE(ranks * apps::gathered_at_once(ranks), kMost) << ranks;
    EXPECT_GT(ranks * apps::gathered_at_once(ranks), std::min(kMost / 2, ranks * 1'000'000));
  }
}

TEST_F(Ranks, EndWithOneSentenceAndWithoutOutput) {
  const auto fails = [&](const std::vector<std::string>& arguments, int code,
                         const std::string& what) {
    const auto before = place.names();
    const RunResult run = mpi(3, arguments);
    EXPECT_EQ(run.exit_code, code) << what;
    EXPECT_NE(run.err.find(what), std::string::npos) << run.err;
    const std::size_t first = run.err.find("strata: error: ");
    EXPECT_NE(first, std::string::npos) << run.err;
    EXPECT_EQ(run.err.find("strata: error: ", first + 1), std::string::npos) << run.err;
    EXPECT_EQ(place.names(), before);
  };
  place.write("bad.obj", "v 0 0 0\nv 1 0 0\nf 1 2 9\n");
  fails({"none.obj", "-r", "100", "-o", "a.npy"}, 3, "none.obj");
  fails({"knot.obj", "-r", "100", "-o", "nowhere/a.npy"}, 4, "nowhere");
  fails({"knot.obj", "-r", "100", "-o", "a.nrrd"}, 2, "strata merge write all");
  fails({"knot.obj", "-r", "100", "-o", "a.npy", "--sdf"}, 2, "--sdf cannot be made by several");
  fails({"knot.obj", "-r", "100", "-o", "a.ome.zarr", "--levels", "3"}, 2, "--levels cannot be");
  fails({"knot.obj", "-r", "100", "-o", "a.npy", "--shard", "1/2"}, 2, "--shard cannot be");
  fails({"knot.obj", "-r", "100", "-o", "a.npy", "--bogus"}, 2, "--bogus");
  place.write("whole/x", "x");
  fails({"knot.obj", "-r", "100", "-o", "whole", "--format", "zarr"}, 4, "not empty");
}

TEST_F(Ranks, ThatAreKilledLeaveNothing) {
  // Long enough to be met at work; a rank, the whole job, and an interrupt of the job.
  for (const auto& [signal, of_rank] : {std::pair(SIGKILL, true), {SIGINT, false}}) {
    RunOptions options;
    options.while_running = [&, signal = signal, of_rank = of_rank](int pid) {
      // The store is there under its temporary name.
      for (int i = 0; i < 3000 && place.names().size() < 4; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
      const std::vector<pid_t> ranks = ranks_below(pid);
      EXPECT_EQ(ranks.size(), 2u);
      if (!ranks.empty()) kill(of_rank ? ranks.back() : pid, signal);
    };
    const RunResult run = mpi(2, {"knot.obj", "-r", "6000", "-o", "a.zarr"}, options);
    EXPECT_NE(run.exit_code, 0);
    EXPECT_FALSE(place.has("a.zarr"));
    for (const std::string& name : place.names()) {
      if (!name.starts_with(".a.zarr")) continue;
      EXPECT_FALSE(place.has(name + "/.zarray")) << name;
      fs::remove_all(place.path(name));
    }
    if (of_rank) {
      EXPECT_NE(run.err.find("signal 9"), std::string::npos) << run.err;
    }
  }
}

}  // namespace
}  // namespace strata
