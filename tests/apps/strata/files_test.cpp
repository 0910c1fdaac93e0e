// No file is lost because it stands in two places of a command line.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/apps/strata/run_tool.h"

namespace strata {
namespace {

using testkit::RunResult;
using testkit::Workplace;

class Files : public testing::Test {
 protected:
  Files() {
    EXPECT_TRUE(write_mesh(place.path("part.stl"), make_box({0, 0, 0}, {1, 1, 1})));
    place.write("scene.csg", "import(file = \"part.stl\");\ncube(size = [2, 2, 2]);\n");
    place.write("old.png", "old");
    std::filesystem::create_symlink("scene.csg", place.path("link.csg"));
    std::filesystem::create_symlink("new.png", place.path("dangling.png"));
    std::filesystem::create_hard_link(place.path("part.stl"), place.path("hard.stl"));
  }

  /// Expects a usage error that has the parts, and that no file has changed.
  void refuses(const std::vector<std::string>& arguments,
               const std::vector<std::string>& parts) const {
    const auto before = contents();
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    for (const std::string& part : parts) {
      EXPECT_NE(run.err.find(part), std::string::npos) << part << "\n" << run.err;
    }
    EXPECT_EQ(before, contents()) << arguments.back();
  }

  [[nodiscard]] std::vector<std::string> contents() const {
    std::vector<std::string> all;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(place.path(""))) {
      const std::string name = entry.path().lexically_relative(place.path("")).string();
      all.push_back(name + (entry.is_regular_file() ? place.read(name) : ""));
    }
    std::sort(all.begin(), all.end());
    return all;
  }

  Workplace place;
};

TEST_F(Files, InputsAreNotOverwritten) {
  const auto csg = [&](const std::vector<std::string>& options, const std::string& part) {
    std::vector<std::string> words{"csg", "scene.csg"};
    words.insert(words.end(), options.begin(), options.end());
    refuses(words, {part, options.back().substr(options.back().find('=') + 1)});
  };
  csg({"-o", "x.png", "--json=scene.csg"}, "--json scene.csg would overwrite the input scene.csg");
  csg({"-o", "x.png", "--json=./link.csg"}, "would overwrite the input scene.csg");
  csg({"-o", "x.png", "--json=part.stl"}, "would overwrite a file of the scene, part.stl");
  csg({"-o", "x.png", "--json=hard.stl"}, "would overwrite a file of the scene, part.stl");
  refuses({"csg", "old.png", "--input-format=csg", "--ids", "old.png"},
          {"--ids old.png would overwrite the input old.png"});
  refuses({"voxelize", "part.stl", "-r", "10", "--stats", "--json=part.stl"},
          {"--json part.stl would overwrite the input part.stl"});
  refuses({"voxelize", "part.stl", "-r", "10", "-o", "./part.stl", "--format", "npy"},
          {"-o ./part.stl would overwrite the input part.stl"});
  refuses({"voxelize", "scene.csg", "-r", "10", "-o", "part.stl", "--format", "npy"},
          {"-o part.stl would overwrite a file of the scene, part.stl"});
  for (const auto& [output, other] :
       {std::pair("x.raw", "x.nhdr"), std::pair("x.bin", "x.bin.nhdr"),
        std::pair("x.nhdr", "x.raw")}) {
    refuses({"voxelize", "part.stl", "-r", "10", "-o", output, "--format", "raw",
             std::string("--json=") + other},
            {std::string("the other file of -o ") + other});
  }
  refuses({"info", "part.stl", "--json=" + place.path("part.stl")}, {"the input part.stl"});
  refuses({"ldi", "old.png", "--input-format", "stl", "-r", "8", "-o", "old.png"},
          {"-o old.png would overwrite the input old.png"});
}

TEST_F(Files, WhatAScenesNamesMeanIsFoundAsTheSceneFindsIt) {
  // In a folder around the scene; after a quote with a backslash; with a blank in its name.
  std::filesystem::create_directories(place.path("a/b"));
  place.write("a/heights.png", "no picture");
  place.write("a/b/deep.csg", "surface(file = \"heights.png\"); cube();\n");
  refuses({"csg", "a/b/deep.csg", "-o", "a/heights.png", "--size=8,8"},
          {"would overwrite a file of the scene, ", "heights.png"});
  place.write("quotes.csg", "text(text = \"5\\\" x\"); surface(file = \"old.png\"); cube();\n");
  refuses({"csg", "quotes.csg", "-o", "old.png"}, {"would overwrite a file of the scene, old.png"});
}

/// What was opened counts, not what a text looks like.
TEST_F(Files, AFileOfASceneIsKeptHoweverItIsNamed) {
  const auto keeps = [&](const std::string& scene, const std::string& file) {
    place.write("named.csg", scene);
    refuses({"voxelize", "named.csg", "-r", "4", "-o", file, "--format", "npy"},
            {"-o " + file + " would overwrite a file of the scene, "});
  };
  keeps("import(file = \"p\\x61rt.stl\");", "part.stl");
  keeps("import(file = \"\\u0070art.stl\");", "part.stl");
  keeps("/* 5\" */ import(file = \"part.stl\"); // 3\"", "part.stl");
  keeps("import(file = \"./././part.stl\");", "hard.stl");
  std::filesystem::create_symlink("part.stl", place.path("soft.stl"));
  keeps("import(file = \"part.stl\");", "soft.stl");
  keeps("import(file = \"soft.stl\");", "part.stl");
  place.write("heights", "1 2\n3 4\n");
  keeps("surface(file = \"heights\");", "heights");
  keeps("surface(file = \"heights\"); import(file = \"missing.stl\");", "heights");
  keeps(std::string((std::size_t{64} << 20) + 1, ' ') + "import(file = \"part.stl\");", "part.stl");
  place.write("broken.off", "OFF of no kind");
  keeps("import(file = \"broken.off\"); cube();", "broken.off");
  // An unused name is free.
  place.write("named.csg", "*import(file = \"part.stl\"); text(\"old.png\"); cube();");
  const RunResult run = place.run({"csg", "named.csg", "-o", "old.png", "--size=8,8"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
}

TEST_F(Files, WhatOpenscadReadIsKept) {
  if (std::system("openscad --version > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "openscad is not installed";
  }
  std::filesystem::create_directories(place.path("lib"));
  place.write("lib/names", "name = str(\"pa\", \"rt\", \".stl\");\n");
  place.write("my lib.scad", "module m() import(name);\n");
  place.write("main.scad", "include <lib/names>\ninclude <my lib.scad>\nm();\n");
  for (const char* file : {"part.stl", "lib/names", "hard.stl", "my lib.scad"}) {
    refuses({"csg", "main.scad", "-o", "x.png", std::string("--json=") + file},
            {std::string("--json ") + file + " would overwrite a file of the scene, "});
  }
}

/// It goes on after files that it cannot read, but not over what a scene has opened.
TEST_F(Files, TheReportOfInfoIsHeldAgainstScenesToo) {
  refuses({"info", "scene.csg", "--json=part.stl"},
          {"--json part.stl would overwrite a file of the scene, part.stl"});
  place.write("broken.csg", "import(file = \"part.stl\"); cube(");
  const auto before = contents();
  RunResult run = place.run({"info", "broken.csg", "scene.csg", "--json=hard.stl"});
  EXPECT_EQ(run.exit_code, 2) << run.err;
  run = place.run({"info", "broken.csg", "--json=part.stl"});
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_NE(run.err.find("--json part.stl: the file is not overwritten"), std::string::npos)
      << run.err;
  EXPECT_EQ(before, contents());
  EXPECT_EQ(place.run({"info", "broken.csg", "--json=new.json"}).exit_code, 3);
  EXPECT_NE(place.read("new.json").find("\"files\": []"), std::string::npos);
}

TEST_F(Files, PicturesOfAnAnimationAndParametersAreHeldAgainstInputs) {
  if (std::system("openscad --version > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "openscad is not installed";
  }
  place.write("a00000.png", "1 2\n3 4\n");
  place.write("heights.scad", "surface(file = \"a00000.png\"); cube(1);\n");
  refuses({"csg", "heights.scad", "--animate=2", "-o", "a.png", "--size=8,8"},
          {"-o a00000.png would overwrite a file of the scene, a00000.png"});
  place.write("sets.json", R"({"parameterSets": {"wide": {"x": "4"}}, "fileFormatVersion": "1"})");
  place.write("main.scad", "x = 1; cube(x);\n");
  refuses({"csg", "main.scad", "-p", "sets.json", "-P", "wide", "-o", "x.png", "--json=sets.json"},
          {"--json sets.json would overwrite the parameters sets.json"});
  for (const char* no_set : {"x", "parameterSets", "fileFormatVersion", "1", "wid"}) {
    refuses({"csg", "main.scad", "-p", "sets.json", "-P", no_set},
            {std::string("-P ") + no_set + ": the file sets.json has no set of that name"});
  }
}

TEST_F(Files, AFolderThatHoldsAnInputIsNotReplaced) {
  std::filesystem::create_directories(place.path("slices/deep"));
  std::filesystem::rename(place.path("part.stl"), place.path("slices/deep/part.stl"));
  place.write("slices.csg", "import(file = \"slices/deep/part.stl\");");
  for (const char* format : {"png", "zarr"}) {
    refuses({"voxelize", "slices/deep/part.stl", "-r", "4", "-o", "slices", "--format", format},
            {"-o slices would overwrite the input slices/deep/part.stl"});
    refuses({"voxelize", "slices.csg", "-r", "4", "-o", "./slices/", "--format", format},
            {"would overwrite a file of the scene, slices/deep/part.stl"});
  }
}

TEST_F(Files, NothingIsPutIntoAFolderThatIsRead) {
  const testkit::RunResult made = place.run({"voxelize", "part.stl", "-r", "4", "-o", "v.zarr"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  refuses({"picture", "v.zarr", "-o", "v.zarr/a.png"},
          {"-o v.zarr/a.png must not lie in the input v.zarr"});
  refuses({"info", "v.zarr", "--json=./v.zarr/deep/../a.json"}, {"must not lie in the input"});
  refuses({"voxelize", "part.stl", "--like", "v.zarr", "-o", "v.zarr/a.npy"},
          {"-o v.zarr/a.npy must not lie in --like v.zarr"});
}

TEST_F(Files, OutputsAppearTogetherOrNotAtAll) {
  const auto fails = [&](const std::vector<std::string>& arguments) {
    const auto before = contents();
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 4) << run.err;
    EXPECT_EQ(before, contents()) << arguments.back();
  };
  fails({"csg", "scene.csg", "-o", "a.png", "--json=no/folder.json", "--size=8,8"});
  fails({"csg", "scene.csg", "-o", "old.png", "--ids=no/ids.png", "--size=8,8"});
  fails({"csg", "scene.csg", "-o", "a.png", "--ids=b.png", "--depth=no/z.exr", "--size=8,8"});
  fails({"voxelize", "part.stl", "-r", "4", "-o", "a.npy", "--json=no/folder.json"});
  fails({"voxelize", "part.stl", "-r", "4", "-o", "s", "--format=png", "--json=no/r.json"});
  // A report holds the size of a file that does not have its name yet.
  const RunResult run =
      place.run({"voxelize", "part.stl", "-r", "4", "-o", "a.npy", "--json=r.json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(place.read("r.json").find("\"bytes\": " + std::to_string(place.read("a.npy").size())),
            std::string::npos);
}

TEST_F(Files, TwoNamesOfOneFileAreNotTwoOutputs) {
  std::filesystem::create_hard_link(place.path("old.png"), place.path("twin.png"));
  refuses({"csg", "scene.csg", "-o", "old.png", "--ids=twin.png"},
          {"would be written to one file"});
}

TEST_F(Files, OutputsDoNotOverwriteEachOther) {
  refuses({"csg", "scene.csg", "-o", "same.png", "--ids", "same.png"},
          {"-o same.png and --ids same.png would be written to one file"});
  refuses({"csg", "scene.csg", "-o", "same.png", "--ids", "./same.png"},
          {"-o same.png and --ids ./same.png would be written to one file"});
  refuses({"csg", "scene.csg", "-o", "new.png", "--ids", "dangling.png"}, {"-o", "--ids"});
  refuses({"csg", "scene.csg", "--depth", "s.exr", "--json=s.exr"}, {"--depth", "--json", "s.exr"});
  refuses({"voxelize", "part.stl", "-r", "4", "-o", "both.npy", "--json=both.npy"},
          {"-o both.npy and --json both.npy would be written to one file"});
  refuses({"voxelize", "part.stl", "-r", "4", "-o", "slices/", "--format=png", "--json=slices"},
          {"-o slices/ and --json slices"});
}

TEST_F(Files, StreamsAndFilesOfTheirOwnAreNoConflict) {
  const auto runs = [&](const std::vector<std::string>& arguments) {
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
  };
  runs({"csg", "scene.csg", "-o", "/dev/null", "--ids", "/dev/null", "--size=8,8"});
  runs({"csg", "scene.csg", "-o", "-", "--json", "--size=8,8"});
  runs({"csg", "scene.csg", "-o", "/dev/stdout", "--json=/dev/stdout", "--size=8,8"});
  // What was written before is written again, and a name in a scene's text is no file elsewhere.
  for (int i = 0; i < 2; ++i) {
    runs({"csg", "scene.csg", "-o", "a.png", "--ids", "b.png", "--json=c.json", "--size=8,8"});
  }
  std::filesystem::create_directories(place.path("sub"));
  place.write("sub/scene.csg", "import(file = \"own.png\"); cube();\n");
  place.write("sub/own.png", "");
  for (int i = 0; i < 2; ++i) runs({"csg", "sub/scene.csg", "-o", "own.png", "--size=8,8"});
}

}  // namespace
}  // namespace strata
