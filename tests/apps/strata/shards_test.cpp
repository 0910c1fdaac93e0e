// `strata voxelize --shard` and `strata merge`: many processes make what one makes.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>

#include "strata/mesh/shapes.h"
#include "tests/apps/strata/json_names.h"
#include "tests/apps/strata/voxelize_fixture.h"

namespace strata {
namespace {

using nlohmann::json;
using testkit::RunResult;
namespace fs = std::filesystem;

class Shards : public testkit::VoxelizeFixture {
 protected:
  void SetUp() override {
    put("knot.obj", make_torus_knot(2, 3, 0.4, 90, 14));
    put("ball.stl", make_icosphere(1.3, 3));
    TriangleSoup open = make_torus_knot(2, 3, 0.4, 60, 12);
    open.triangles.resize(open.triangles.size() - 30);
    put("open.off", open);
    place.write("plate.csg",
                "difference() { cube([30, 20, 9]); translate([8, 8, -1]) sphere(6); }\n");
  }

  /// Names and bytes of a file, of a folder and all that is in it, and of files beside it.
  [[nodiscard]] std::map<std::string, std::string> bytes_of(const std::string& name) const {
    std::map<std::string, std::string> files;
    const fs::path path = place.path(name);
    if (fs::is_regular_file(path)) files["itself"] = place.read(name);
    if (fs::is_directory(path)) {
      for (const auto& entry : fs::recursive_directory_iterator(path)) {
        const std::string inside = entry.path().lexically_relative(path).string();
        files[inside] = entry.is_regular_file() ? place.read(name + "/" + inside) : "folder";
      }
    }
    fs::path head = path, sidecar = path;
    head.replace_extension(".nhdr"), sidecar += ".json";
    for (const fs::path& other : {head, sidecar}) {
      if (other != path && fs::exists(other)) {
        files[other.extension().string()] = testkit::bytes_of(other);
      }
    }
    return files;
  }

  /// Makes the shards of a job. @return their folders, the last one first
  std::vector<std::string> make_shards(std::vector<std::string> arguments,
                                       const std::string& output, int count) const {
    std::vector<std::string> folders;
    arguments.insert(arguments.begin(), "voxelize");
    arguments.insert(arguments.end(), {"-o", output, "--shard", ""});
    for (int index = count; index > 0; --index) {
      arguments.back() = fmt::format("{}/{}", index, count);
      const RunResult run = place.run(arguments);
      EXPECT_EQ(run.exit_code, 0) << run.err;
      folders.push_back(fmt::format("{}.shard-{}-of-{}", output, index, count));
      EXPECT_TRUE(place.has(folders.back()));
      EXPECT_FALSE(place.has(output));
    }
    return folders;
  }

  RunResult merge(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "merge");
    return place.run(arguments);
  }
  RunResult merge(const std::vector<std::string>& shards, std::vector<std::string> more) const {
    more.insert(more.begin(), shards.begin(), shards.end());
    return merge(std::move(more));
  }

  /// What reports of two runs of the same job have in common.
  static json numbers_of(json report) {
    for (const char* other : {"command", "output", "timings_ms", "memory", "shard"}) {
      report.erase(other);
    }
    report["options"].erase("threads");
    report["lists"].erase("rebuilt_tiles");  // depends on how many threads there are
    return report;
  }

  /// One process, and several: the same bytes and the same numbers.
  void expect_same(const std::vector<std::string>& arguments, const std::string& name,
                   int count) const {
    SCOPED_TRACE(fmt::format("{} {} shards: {}", name, count, arguments.back()));
    std::vector<std::string> whole = arguments;
    whole.insert(whole.end(), {"-o", "whole/" + name, "--checksum"});
    fs::create_directory(place.path("whole"));
    const json one = report(whole);
    const std::vector<std::string> shards = make_shards(arguments, name, count);
    const RunResult run = merge(shards, {"-o", name, "--json", "--checksum"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(numbers_of(json::parse(run.out)), numbers_of(one));
    EXPECT_GT(one["voxels"]["solid"], 1000);
    const auto expected = bytes_of("whole/" + name), got = bytes_of(name);
    ASSERT_FALSE(expected.empty());
    EXPECT_TRUE(got == expected) << got.size() << " files, expected " << expected.size();
    for (const std::string& shard : shards) fs::remove_all(place.path(shard));
    fs::remove_all(place.path("whole"));
    for (const auto& entry : place.names()) {
      if (entry.starts_with(name.substr(0, name.find('.')) + "."))
        fs::remove_all(place.path(entry));
    }
  }

  const std::vector<std::string> kKnot = {"knot.obj", "--grid", "200,210,220"};
};

TEST_F(Shards, MergeToTheBytesOfOneProcessInEveryFormat) {
  for (const char* name : {"a.npy", "a.raw", "a.nhdr", "a.zarr", "a.ome.zarr", "a.vdb", "a.nrrd",
                           "a.vti", "a.npz", "a.nii.gz", "a.binvox", "a.xyz"}) {
    std::vector<std::string> arguments = kKnot;
    if (std::string(name) == "a.binvox") arguments = {"knot.obj", "--cubic", "200"};
    expect_same(arguments, name, 3);
  }
}

TEST_F(Shards, MayBeOneOrAsManyAsThereAreRowsOfTiles) {
  for (const int count : {1, 2, 4}) {
    expect_same(kKnot, "a.npy", count);
    expect_same(kKnot, "a.zarr", count);
  }
}

TEST_F(Shards, HoldIdsSharesSurfacesAndScenesToo) {
  const std::string grid = "200,210,220";
  const std::vector<std::vector<std::string>> jobs = {
      {"knot.obj", "ball.stl", "--grid", grid, "--ids"},
      {"knot.obj", "--grid", grid, "--coverage=2"},
      {"knot.obj", "--grid", grid, "--coverage=2", "--floats"},
      {"knot.obj", "--grid", grid, "--surface"},
      {"knot.obj", "--grid", grid, "--surface=6", "--solid"},
      {"open.off", "--grid", grid},
      {"open.off", "--grid", grid, "--open", "surface"},
      {"plate.csg", "--grid", grid},
      {"knot.obj", "--grid", grid, "--rule", "parity"}};
  for (const std::vector<std::string>& job : jobs) {
    expect_same(job, "a.ome.zarr", 3);
    expect_same(job, "a.nrrd", 2);
  }
  expect_same({"knot.obj", "--grid", grid, "--coverage=2"}, "a.sl1", 3);
  expect_same({"knot.obj", "--grid", grid, "--fog=2"}, "a.vdb", 3);
  expect_same({"knot.obj", "--grid", grid, "--mask", "--name", "it is"}, "a.vdb", 3);
  expect_same({"knot.obj", "ball.stl", "--grid", grid, "--ids"}, "a.vdb", 4);
}

TEST_F(Shards, OfGridsOfAFileKeepItsPlace) {
  ASSERT_EQ(place.run({"voxelize", "ball.stl", "--grid", "70,80,190", "-o", "like.nrrd"}).exit_code,
            0);
  expect_same({"knot.obj", "--like", "like.nrrd"}, "a.npy", 3);  // with a.npy.json
  expect_same({"knot.obj", "--like", "like.nrrd"}, "a.nrrd", 2);
}

TEST_F(Shards, WithoutVoxelsMergeToTheReport) {
  const json one = report({"knot.obj", "-r", "500", "--checksum"});
  for (const char* index : {"1", "2", "3"}) {
    ASSERT_EQ(place
                  .run({"voxelize", "knot.obj", "-r", "500", "--shard", fmt::format("{}/3", index),
                        fmt::format("--json={}.json", index)})
                  .exit_code,
              0);
  }
  const RunResult run = merge({"3.json", "1.json", "2.json", "--json", "--checksum"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(numbers_of(json::parse(run.out)), numbers_of(one));
  const RunResult text = merge({"3.json", "1.json", "2.json"});
  EXPECT_NE(text.out.find("columns by crossings"), std::string::npos) << text.out;
  const RunResult file = merge({"3.json", "1.json", "2.json", "-o", "a.npy"});
  EXPECT_EQ(file.exit_code, 2);
  EXPECT_NE(file.err.find("holds no voxels"), std::string::npos) << file.err;
}

TEST_F(Shards, ReportsHaveTheNamesOfTheDocument) {
  const auto shards = make_shards(kKnot, "a.npy", 2);
  std::set<std::string> all, names;
  testkit::collect(json::parse(place.read(shards[0] + "/shard.json")), "", all);
  for (const std::string& name : all) {
    if (name.starts_with("shard.")) names.insert(name);
  }
  EXPECT_EQ(names, testkit::documented("`strata voxelize --shard`"));
}

TEST_F(Shards, ThatAreMissingTwiceOrForeignAreNamed) {
  const auto shards = make_shards(kKnot, "a.npy", 3);
  const auto refuses = [&](const std::vector<std::string>& given, const std::string& what) {
    const auto before = place.names();
    const RunResult run = merge(given, {"-o", "b.npy"});
    EXPECT_EQ(run.exit_code, 3) << what;
    EXPECT_NE(run.err.find(what), std::string::npos) << run.err;
    EXPECT_EQ(place.names(), before);
  };
  const std::string &three = shards[0], &two = shards[1], &one = shards[2];
  refuses({one, three}, "shard 2 of 3 is missing");
  refuses({two}, "shards 1, 3 of 3 are missing");
  refuses({one, two, three, two}, two + " and " + two + " are both shard 2 of 3");
  refuses({one, "ball.stl"}, "ball.stl");
  refuses({one, "nothing"}, "nothing");
  fs::create_directory(place.path("empty"));
  refuses({one, "empty"}, "empty/shard.json");

  struct Foreign {
    std::vector<std::string> arguments;
    std::string what;
  };
  for (const Foreign& foreign :
       {Foreign{{"ball.stl", "--grid", "200,210,220"}, "it is of another input"},
        Foreign{{"knot.obj", "--grid", "200,210,221"}, "its grid is 200 x 210 x 221 voxels"},
        Foreign{{"knot.obj", "--grid", "200,210,220", "--surface"}, "its options are"},
        Foreign{{"knot.obj", "--grid", "200,210,220", "--rule", "nonzero"}, "--rule nonzero"}}) {
    const auto others = make_shards(foreign.arguments, "other.npy", 3);
    refuses({one, others[1], three}, foreign.what);
    refuses({one, others[1], three}, others[1] + " is no shard of the job of " + one);
    for (const std::string& other : others) fs::remove_all(place.path(other));
  }
  refuses({one, make_shards(kKnot, "other.npy", 2)[0]}, "it is one of 2 shards, not of 3");
  refuses({one, make_shards(kKnot, "other.vdb", 3)[0]}, "format");
}

TEST_F(Shards, ThatAreDamagedLeaveNothing) {
  auto shards = make_shards(kKnot, "a.npy", 2);
  const std::string runs = place.read(shards[1] + "/runs");
  for (const std::size_t length :
       {std::size_t{0}, std::size_t{20}, runs.size() / 2, runs.size() - 1}) {
    place.write(shards[1] + "/runs", runs.substr(0, length));
    const auto before = place.names();
    const RunResult run = merge(shards, {"-o", "b.npy"});
    EXPECT_EQ(run.exit_code, 3) << length;
    EXPECT_NE(run.err.find(shards[1] + "/runs"), std::string::npos) << run.err;
    EXPECT_EQ(place.names(), before);
  }
  place.write(shards[1] + "/runs", runs);
  const std::string report = place.read(shards[1] + "/shard.json");
  for (std::size_t length = 0; length < report.size(); length += report.size() / 40 + 1) {
    place.write(shards[1] + "/shard.json", report.substr(0, length));
    EXPECT_EQ(merge(shards, {"-o", "b.npy"}).exit_code, 3) << length;
  }
  json changed = json::parse(report);
  for (const char* member :
       {"grid", "input", "options", "voxels", "lists", "lost_walls", "shard"}) {
    json without = changed;
    without.erase(member);
    place.write(shards[1] + "/shard.json", without.dump());
    const RunResult run = merge(shards, {"-o", "b.npy"});
    EXPECT_EQ(run.exit_code, 3) << member;
    EXPECT_NE(run.err.find(member), std::string::npos) << run.err;
  }
  EXPECT_FALSE(place.has("b.npy"));
}

TEST_F(Shards, ThatAreManyAndMissingAreCounted) {
  const auto shards = make_shards(kKnot, "a.npy", 3);
  const std::string report = place.read(shards[2] + "/shard.json");
  const auto with_count = [&](const std::string& count) {
    json changed = json::parse(report);
    changed["shard"]["count"] = json::parse(count);
    place.write(shards[2] + "/shard.json", changed.dump());
    const RunResult run = merge({shards[2], "-o", "b.npy"});
    EXPECT_EQ(run.exit_code, 3) << run.err;
    return run.err;
  };
  EXPECT_NE(with_count("1024").find("shards 2, 3, 4, 5, 6, 7, 8, 9, 10, 11 and 1013 more of 1024 "
                                    "are missing\n"),
            std::string::npos);
  for (const char* count : {"1025", "1000000", "1e300", "0", "-1", "1.5"}) {
    EXPECT_NE(with_count(count).find("shard."), std::string::npos) << count;
  }
}

/// A number of a shard's report that cannot be, as a JSON pointer and text.
struct WrongNumber {
  const char *place, *text;
};
void PrintTo(const WrongNumber& wrong, std::ostream* out) {
  *out << wrong.place << " " << wrong.text;
}

TEST_F(Shards, WhoseNumbersCannotBeAreRefused) {
  std::vector<std::string> arguments = kKnot;
  arguments.insert(arguments.begin() + 1, "ball.stl");
  arguments.emplace_back("--ids");
  const auto shards = make_shards(arguments, "a.npy", 2);
  const std::string report = place.read(shards[1] + "/shard.json");
  for (const WrongNumber& wrong :
       std::vector<WrongNumber>{{"/grid/dims/0", "65537"},
                                {"/grid/dims/1", "0"},
                                {"/grid/dims/2", "100.5"},
                                {"/grid/dims/2", "null"},
                                {"/grid/origin/0", "nan"},
                                {"/grid/voxel_size/1", "inf"},
                                {"/grid/voxel_size/1", "-1"},
                                {"/grid/direction/0/0", "\"x\""},
                                {"/grid/direction/1/1", "1e300"},
                                {"/grid/direction/2/0", "null"},
                                {"/grid/direction/2", "[0, 1]"},
                                {"/input/unit_metres", "-1"},
                                {"/input/bounds/low/0", "nan"},
                                {"/input/files/0/triangles", "1e300"},
                                {"/voxels/solid", "-3"},
                                {"/voxels/solid", "1e19"},
                                {"/lists/crossings", "0.5"},
                                {"/lists/depth_histogram/1", "1e300"},
                                {"/lists/depth_histogram/1", "-1"},
                                {"/lists/depth_histogram/1", "\"many\""},
                                {"/lists/depth_histogram", "{}"},
                                {"/lost_walls/count", "1e300"},
                                {"/ids/0/solid", "100000000000"},
                                {"/ids/1/solid", "100000000"},
                                {"/ids/0/voxels", "1e300"},
                                {"/ids", "7"},
                                {"/shard/version", "2"},
                                {"/shard/version", "1e300"},
                                {"/shard/index", "3"},
                                {"/shard/input", "\"12345678901234567\""},
                                {"/shard/checksum_sum", "\"-1\""},
                                {"/shard/coverage", "1e9"},
                                {"/shard/filled_steps", "1e300"},
                                {"/shard/faces/0", "1e300"},
                                {"/shard/faces", "[1, 2]"},
                                {"/shard/seams/0/row", "-1"},
                                {"/shard/seams/0/row", "65536"},
                                {"/shard/seams/0/runs", "\"00000000000z\""},
                                {"/shard/format", "\"none\""},
                                {"/shard/file/ids", "4000000000.5"},
                                {"/shard/file/fog", "-1"},
                                {"/shard/file/colours", "[\"fffffffff\"]"},
                                {"/shard/file/colours", "[3]"},
                                {"/shard/file/unit_metres", "-1"},
                                {"/shard/file/unit_metres", "inf"},
                                {"/shard/file/layers/gamma", "-1"},
                                {"/shard/file/layers/gamma", "1e300"},
                                {"/shard/file/layers/display/0", "1e300"},
                                {"/shard/file/layers/display/1", "1.5"},
                                {"/shard/file/layers/exposure", "nan"},
                                {"/shard/file/layers/first_exposure", "-1"},
                                {"/shard/file/layers/time", "1e18"}}) {
    json changed = json::parse(report);
    const json::json_pointer at(wrong.place);
    ASSERT_TRUE(changed.contains(at)) << wrong.place;
    changed[at] = "HERE";
    std::string text = changed.dump();
    text.replace(text.find("\"HERE\""), 6, wrong.text);
    place.write(shards[1] + "/shard.json", text);
    const auto before = place.names();
    const RunResult run = merge(shards, {"-o", "b.npy", "--memory-limit", "2G"});
    EXPECT_EQ(run.signal, 0) << testing::PrintToString(wrong);
    EXPECT_EQ(run.exit_code, std::string(wrong.text) == "100000000" ? 6 : 3)
        << testing::PrintToString(wrong) << run.err;
    EXPECT_NE(run.err.find(shards[1]), std::string::npos)
        << testing::PrintToString(wrong) << run.err;
    EXPECT_EQ(place.names(), before);
  }
  place.write(shards[1] + "/shard.json", report);
  EXPECT_EQ(merge(shards, {"-o", "b.npy"}).exit_code, 0);
}

TEST_F(Shards, AreNamedWhereTheyAreNoInput) {
  const auto shards = make_shards(kKnot, "a.zarr", 1);
  for (const char* command : {"info", "picture", "voxelize"}) {
    std::vector<std::string> arguments = {command, shards[0]};
    if (std::string(command) != "info") arguments.insert(arguments.end(), {"-o", "b.png"});
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 3) << run.err;
    EXPECT_NE(run.err.find(shards[0] + ": it is a shard of strata voxelize --shard; strata merge"),
              std::string::npos)
        << run.err;
  }
}

TEST_F(Shards, WhoseChunksOrRunsAreOthersAreRefused) {
  const auto refuses = [&](const std::vector<std::string>& shards,
                           const std::vector<std::string>& words, int code,
                           const std::string& what) {
    const auto before = place.names();
    const RunResult run = merge(shards, words);
    EXPECT_EQ(run.exit_code, code) << what << run.err;
    EXPECT_NE(run.err.find(what), std::string::npos) << run.err;
    EXPECT_EQ(place.names(), before);
  };
  const auto chunks = make_shards(kKnot, "a.zarr", 2);
  const std::vector<std::string> to_zarr = {"-o", "b.zarr"};
  fs::path chunk;
  for (const auto& entry : fs::directory_iterator(place.path(chunks[1] + "/chunks"))) {
    if (entry.is_regular_file() && entry.path().filename().string()[0] != '.') chunk = entry;
  }
  ASSERT_FALSE(chunk.empty());
  const fs::path kept = place.path("kept");
  fs::rename(chunk, kept);
  refuses(chunks, to_zarr, 3, chunks[1] + ": the chunks must have ");
  fs::create_symlink(kept, chunk);
  refuses(chunks, to_zarr, 3, "no regular file");
  fs::remove(chunk);
  fs::rename(kept, chunk);
  refuses(chunks, {"-o", chunks[1] + "/b.zarr"}, 2, "must not lie in the shard " + chunks[1]);
  refuses(chunks, {"--json=" + chunks[1] + "/shard.json"}, 2, "must not lie in the shard");
  EXPECT_EQ(merge(chunks, to_zarr).exit_code, 0);

  std::vector<std::string> arguments = kKnot;
  arguments.insert(arguments.begin() + 1, "ball.stl");
  arguments.emplace_back("--ids");
  const auto labelled = make_shards(arguments, "c.npy", 2);
  for (const auto& [from, to, what] : std::vector<std::array<std::string, 3>>{
           {"\"ids\": 2", "\"ids\": 1", "a label must be at most 1, got 2"},
           {"\"solid\": ", "\"solid\": 1", "solid voxels, got"}}) {
    std::map<std::string, std::string> reports;
    for (const std::string& shard : labelled) {
      const std::string report = reports[shard] = place.read(shard + "/shard.json");
      const std::size_t at = report.find(from, report.find("\"voxels\": {"));
      const std::size_t part = at == std::string::npos ? report.find(from) : at;
      ASSERT_NE(part, std::string::npos) << report;
      place.write(shard + "/shard.json", std::string(report).replace(part, from.size(), to));
    }
    refuses(labelled, {"-o", "d.nrrd"}, 3, what);
    for (const auto& [shard, report] : reports) place.write(shard + "/shard.json", report);
  }
  EXPECT_EQ(merge(labelled, {"-o", "d.nrrd"}).exit_code, 0);
  ASSERT_EQ(mkfifo(place.path("pipe").c_str(), 0600), 0);
  refuses({"pipe"}, {"--stats"}, 3, "no regular file");
}

TEST_F(Shards, DoNotReplaceAFolderWithContent) {
  const auto shards = make_shards(kKnot, "a.zarr", 2);
  const auto again = place.run(
      {"voxelize", "knot.obj", "--grid", "200,210,220", "-o", "a.zarr", "--shard", "1/2"});
  EXPECT_EQ(again.exit_code, 4);
  fs::create_directory(place.path("b.zarr"));
  place.write("b.zarr/mine", "mine");
  EXPECT_EQ(merge(shards, {"-o", "b.zarr"}).exit_code, 4);
  EXPECT_EQ(place.read("b.zarr/mine"), "mine");
  const RunResult other = merge(shards, {"-o", "c.npy"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_NE(other.err.find("the shards are of format zarr, not npy"), std::string::npos);
}

TEST_F(Shards, AreRefusedWhereTheyCannotBe) {
  const auto refuses = [&](std::vector<std::string> arguments, const std::string& what) {
    arguments.insert(arguments.begin(), {"voxelize", "knot.obj", "-r", "100"});
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 2) << what;
    EXPECT_NE(run.err.find(what), std::string::npos) << run.err;
  };
  const auto before = place.names();
  refuses({"-o", "a.npy", "--shard", "0/3"}, "--shard must be 1/N to N/N");
  refuses({"-o", "a.npy", "--shard", "4/3"}, "got 4/3");
  refuses({"-o", "a.npy", "--shard", "3"}, "--shard must be I/N, like 1/8, got '3'");
  for (const char* other : {"1/x", "1/", "/2", "/", "+1/2", "1/+2", " 1/2", "1/2/3", "-1/2"}) {
    refuses({"-o", "a.npy", "--shard", other},
            fmt::format("--shard must be I/N, like 1/8, got '{}'", other));
  }
  refuses({"-o", "a.npy", "--shard", "1/99999999999999999999"}, "N from 1 to 1024");
  refuses({"-o", "a.npy", "--shard", "1/2000"}, "1024");
  refuses({"-o", "a.npy", "--shard", "1/3"}, "it makes 1 shard, which needs no --shard");
  refuses({"-o", "a.npy", "--shard", "1/3"}, "3 shards need 129 rows, by a higher -r");
  refuses({"-o", "a.npy", "--sdf", "--shard", "1/2"}, "--sdf");
  refuses({"-o", "a.ome.zarr", "--levels", "3", "--shard", "1/2"}, "--levels");
  refuses({"-o", "a.npy", "--colours", "--shard", "1/2"}, "--colours");
  refuses({"-o", "a.npy", "--dry-run", "--shard", "1/2"}, "--dry-run");
  refuses({"-o", "-", "--format", "npy", "--shard", "1/2"}, "-o -");
  refuses({"--shard", "1/2"}, "--shard needs -o FILE or --json");
  const RunResult many = place.run(
      {"voxelize", "knot.obj", "--grid", "200,210,220", "-o", "a.npy", "--shard", "1/30"});
  EXPECT_NE(many.err.find("it makes at most 4 shards; 30 shards need 1857 rows"), std::string::npos)
      << many.err;
  EXPECT_EQ(place.names(), before);
  EXPECT_EQ(merge({"-o", "a.npy"}).exit_code, 2);
}

TEST_F(Shards, MergeTellsOfThinWallsOnce) {
  put("sheet.obj", make_box({0, 0, 0}, {100, 100, 0.01}));
  const json one = report({"sheet.obj", "--voxel-size", "0.5", "--padding", "2", "-o", "w.npy"});
  const std::vector<std::string> job = {"sheet.obj", "--voxel-size", "0.5", "--padding", "2"};
  EXPECT_FALSE(one["warnings"].empty());
  const auto shards = make_shards(job, "a.zarr", 3);
  const RunResult run = merge(shards, {"--json", "-o", "a.zarr"});
  const json all = json::parse(run.out);
  EXPECT_EQ(all["warnings"], one["warnings"]);
  EXPECT_EQ(all["lost_walls"], one["lost_walls"]);
}

}  // namespace
}  // namespace strata
