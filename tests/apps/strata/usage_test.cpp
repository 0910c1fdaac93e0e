// What the command line takes and refuses.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/apps/strata/run_tool.h"

namespace strata {
namespace {

using testkit::RunResult;
using testkit::Workplace;

class Usage : public testing::Test {
 protected:
  Usage() { EXPECT_TRUE(write_mesh(place.path("box.obj"), make_box({0, 0, 0}, {1, 1, 1}))); }

  /// Expects exit code 2 and a sentence with `part`, on standard error alone.
  void refuses(const std::vector<std::string>& arguments, const std::string& part) const {
    const RunResult run = place.run(arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_EQ(run.out, "");
    EXPECT_TRUE(run.err.starts_with("strata: error: ")) << run.err;
    EXPECT_NE(run.err.find(part), std::string::npos) << run.err;
    EXPECT_EQ(place.names(), std::vector<std::string>{"box.obj"});
  }

  Workplace place;
};

TEST_F(Usage, NoArgumentsPrintsAScreenOfCommandsOnStandardError) {
  const RunResult run = place.run({});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(run.out, "");
  EXPECT_NE(run.err.find("strata voxelize data/knot.obj -o knot.vdb"), std::string::npos);
  EXPECT_NE(run.err.find("`strata --help`"), std::string::npos);
  EXPECT_LT(std::count(run.err.begin(), run.err.end(), '\n'), 20);
}

#ifdef STRATA_OPEN_ON_CALL
TEST_F(Usage, LibrariesThatFewJobsNeedAreNotLoadedAtTheStart) {
  // The dynamic linker lists what it would load, and runs nothing.
  const RunResult run = place.run({"--version"}, {.environment = {"LD_TRACE_LOADED_OBJECTS=1"}});
  ASSERT_NE(run.out.find("libc.so"), std::string::npos) << run.err;
  for (const char* library :
       {"hdf5",     "OpenEXR",  "Imath",   "epoxy",   "fontconfig", "freetype",
        "harfbuzz", "libzip",   "libpng",  "libjpeg", "libgif",     "libwebp",
        "blosc",    "libz.",    "deflate", "libisal", "pugixml",    "polyclipping",
        "qhull",    "OpenMesh", "libtbb",  "libhwy"}) {
    EXPECT_EQ(run.out.find(library), std::string::npos) << run.out;
  }
}

TEST_F(Usage, ALibraryThatCannotBeOpenedEndsTheJobThatNeedsIt) {
  place.write("libisal.so.2", "not a library");
  const testkit::RunOptions here = {.environment = {"LD_LIBRARY_PATH=" + place.path("")}};
  const RunResult run = place.run({"csg", "box.obj", "-o", "box.png"}, here);
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("a library that this job needs cannot be opened: "), std::string::npos);
  EXPECT_NE(run.err.find("libisal.so.2"), std::string::npos) << run.err;
  EXPECT_EQ(place.names(), (std::vector<std::string>{"box.obj", "libisal.so.2"}));
  EXPECT_EQ(place.run({"voxelize", "box.obj", "-r", "8", "-o", "box.npy"}, here).exit_code, 0);
}

TEST_F(Usage, ALibraryWhosePathSpeaksOfMemoryIsNoLackOfIt) {
  std::filesystem::create_directory(place.path("out of memory"));
  place.write("out of memory/libisal.so.2", "not a library");
  const RunResult run =
      place.run({"csg", "box.obj", "-o", "box.png"},
                {.environment = {"LD_LIBRARY_PATH=" + place.path("out of memory")}});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("out of memory/libisal.so.2"), std::string::npos) << run.err;
}
#endif

TEST_F(Usage, DevicesNeedAFormat) {
  const RunResult run = place.run({"info", "/dev/null"});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE(run.err.find("/dev/null: it is no regular file, so the input format must be given"),
            std::string::npos)
      << run.err;
}

TEST_F(Usage, HelpTakesACommand) {
  const RunResult run = place.run({"help", "voxelize"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out, place.run({"voxelize", "--help"}).out);
  EXPECT_EQ(place.run({"help"}).out, place.run({"--help"}).out);
  refuses({"help", "voxelise"}, "no such command 'voxelise'; did you mean voxelize?");
}

TEST_F(Usage, WordsThatAreNearlyRightAreNamed) {
  refuses({"voxelise", "box.obj"}, "no such command 'voxelise'; did you mean voxelize?");
  refuses({"vox", "box.obj"}, "did you mean voxelize?");
  refuses({"render", "box.obj"}, "no such command 'render'; did you mean csg?");
  refuses({"hello"}, "no such command 'hello'\n");
  refuses({"none.vdb"}, "none.vdb: there is no such file or command");
  refuses({"voxelize", "box.obj", "--resoluton", "20", "--stats"},
          "unknown option --resoluton; did you mean --resolution?");
  refuses({"voxelize", "box.obj", "--resoluton=20", "--stats"}, "did you mean --resolution?");
  refuses({"voxelize", "box.obj", "--stats", "--rule", "windign"}, "did you mean winding?");
  refuses({"voxelize", "box.obj", "-o", "a.vbd"}, "did you mean vdb?");
  refuses({"voxelize", "box.obj", "-o", "a.x", "--format", "nrd"}, "did you mean nrrd?");
  refuses({"csg", "box.obj", "-o", "a.png", "--colorscheme", "cornfeild"},
          "did you mean Cornfield?");
  refuses({"oit", "box.obj", "-o", "a.png", "--technique", "dual-peling"},
          "did you mean dual-peeling?");
  refuses({"csg", "box.obj", "--expr", "bax - b"}, "no file is called bax; did you mean box?");
  refuses({"mesh", "box.obj", "-o", "a.3mf", "--unit", "milimeter"}, "did you mean millimeter?");
  for (const char* other : {"gpu", "opengl", "cuda"}) {
    refuses({"voxelize", "box.obj", "--backend", other}, "did you mean gl?");
  }
}

TEST_F(Usage, AValueBehindAnOptionThatTakesItAfterAnEqualSignIsSaidToBe) {
  for (const auto& [option, value] :
       {std::pair("--coverage", "4"), std::pair("--fog", "2"), std::pair("--surface", "6")}) {
    refuses({"voxelize", "box.obj", "-r", "4", "-o", "a.vdb", option, value},
            fmt::format("{0}: there is no such file; a value of {1} is written {1}={0}", value,
                        option));
  }
  place.write("4", place.read("box.obj"));
  const RunResult run =
      place.run({"voxelize", "--input-format", "obj", "-r", "4", "--surface", "4", "--stats"});
  EXPECT_EQ(run.exit_code, 0) << run.err << ": it is a file";
  std::filesystem::remove(place.path("4"));
}

TEST_F(Usage, AFormatThatContradictsTheNameIsRefused) {
  refuses({"voxelize", "box.obj", "-r", "4", "-o", "x.zarr", "--format", "npy"},
          "-o x.zarr: the name is that of the format zarr, but --format is npy");
  refuses({"voxelize", "box.obj", "-r", "4", "-o", "x.nrrd", "--format", "vdb"}, "format nrrd");
}

TEST_F(Usage, ABoxWithoutAnExtentIsTheOptionsFault) {
  for (const char* command : {"voxelize", "ldi"}) {
    refuses({command, "box.obj", "-r", "4", "-o", "a.npz", "--bounds", "0,0,0,0,0,0"},
            "--bounds must be a box with an extent, got 0,0,0,0,0,0");
    refuses({command, "box.obj", "-r", "4", "-o", "a.npz", "--bounds", "0,0,0,1,-1,1"},
            "--bounds must have its lower corner first, got 0 to -1 along y");
  }
}

TEST_F(Usage, TheCommandComesFirstAndAnOutputBehindItsOption) {
  refuses({"box.obj", "voxelize"}, "the command comes first: strata voxelize box.obj");
  refuses({"voxelize", "box.obj", "a.vdb"}, "to write it, give -o a.vdb");
  refuses({"mesh", "box.obj", "a.stl"}, "to write it, give -o a.stl");
  refuses({"csg", "box.obj", "a.png"}, "to write it, give -o a.png");
  refuses({"--verison"}, "unknown option --verison; did you mean --version?");
  refuses({"voxelize", "box.obj", "-R", "4"}, "unknown option -R; did you mean -r?");
  EXPECT_EQ(place.run({"version"}).out, place.run({"--version"}).out);
  EXPECT_EQ(place.run({"-h", "mesh"}).out, place.run({"mesh", "--help"}).out);
}

TEST_F(Usage, AFileOfVoxelsAloneIsDescribed) {
  ASSERT_EQ(
      place.run({"voxelize", "box.obj", "-r", "4", "--padding", "1", "-o", "a.npz"}).exit_code, 0);
  const RunResult run = place.run({"a.npz"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("6 x 6 x 6"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("64"), std::string::npos) << run.out;
  EXPECT_EQ(place.run({"info", "a.npz"}).out, run.out);
  std::filesystem::remove(place.path("a.npz"));
}

TEST_F(Usage, VoxelsWithoutAnOutputAreStatistics) {
  const RunResult run = place.run({"voxelize", "box.obj", "-r", "4"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("solid     64 voxels"), std::string::npos) << run.out;
}

TEST_F(Usage, ANameThatAnotherCommandWritesIsSaidToBe) {
  refuses({"csg", "box.obj", "-o", "a.stl"}, "; strata mesh writes meshes");
  refuses({"csg", "box.obj", "-o", "a.vdb"}, "; strata voxelize writes voxels");
  refuses({"voxelize", "box.obj", "-o", "a.stl"}, "; strata mesh writes meshes");
  refuses({"voxelize", "box.obj", "-o", "a.png"}, "; strata csg writes pictures");
  refuses({"voxelize", "box.obj", "-o", "a.png"},
          "a.png: voxels are written as a folder of PNG slices; its name must end with /, as a/");
  refuses({"voxelize", "box.obj", "-o", "a.png", "--format", "png"},
          "a.png: format png is a folder of files; its name must end with /, as a/");
  refuses({"mesh", "box.obj", "-o", "a.png"}, "; strata csg writes pictures");
  refuses({"mesh", "box.obj", "-o", "a.npy"}, "; strata voxelize writes voxels");
}

TEST_F(Usage, AGridThatCannotBeIsNoFaultOfTheFile) {
  for (const char* command : {"voxelize", "mesh", "ldi"}) {
    std::vector<std::string> words = {command, "box.obj"};
    if (words[0] == "mesh") words.insert(words.end(), {"--method", "contour"});
    words.insert(words.end(), {"-o", words[0] == "ldi" ? "a.npz" : "a.ply"});
    const auto with = [&](const char* option, const char* value) {
      std::vector<std::string> all = words;
      all.insert(all.end(), {option, value});
      return all;
    };
    refuses(with("-r", "-5"), "strata: error: the resolution must be at least 1 voxel, got -5");
    refuses(with("--voxel-size", "-1"), "strata: error: the voxel size along x must be above 0");
    const RunResult large = place.run(with("-r", "70000"));
    EXPECT_EQ(large.exit_code, 6) << command;
    EXPECT_EQ(large.err.find("strata: error: a resolution of 70000 voxels"), 0u) << large.err;
  }
}

TEST_F(Usage, AFileThatTheDiskHasNoRoomForIsNotBegun) {
  for (const char* name : {"a.npy", "a.raw", "a.nii"}) {
    const RunResult run = place.run({"voxelize", "box.obj", "-r", "65536", "-o", name, "-q"});
    EXPECT_EQ(run.exit_code, 6) << name;
    EXPECT_NE(run.err.find(std::string(name) + ": the file takes 281."), std::string::npos)
        << run.err;
  }
}

TEST_F(Usage, HelpBeginsWithExamplesAndEndsWithTheExitCodes) {
  const RunResult run = place.run({"--help"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_EQ(run.err, "");
  EXPECT_LT(run.out.find("strata voxelize knot.obj"), run.out.find("Commands:"));
  for (const char* code : {"0 ", "1 ", "2 ", "3 ", "4 ", "5 ", "6 ", "7 ", "130 ", "141 "}) {
    EXPECT_NE(run.out.find(std::string("\n  ") + code, run.out.find("Exit codes")),
              std::string::npos)
        << code;
  }
  EXPECT_EQ(place.run({"-h"}).out, run.out);
}

TEST_F(Usage, EveryCommandHasHelpThatBeginsWithExamples) {
  for (const char* command : {"voxelize", "mesh", "info", "ldi"}) {
    const RunResult run = place.run({command, "--help"});
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_EQ(run.err, "");
    const auto example = run.out.find(std::string("  strata ") + command);
    EXPECT_LT(example, run.out.find("Usage")) << run.out;
    EXPECT_NE(run.out.find("--memory-limit"), std::string::npos);
  }
}

TEST_F(Usage, HelpLeavesOutWhatHelpAllShowsToDevelopers) {
  for (const char* command : {"voxelize", "ldi", "info"}) {
    const RunResult help = place.run({command, "--help"}), all = place.run({command, "--help-all"});
    EXPECT_EQ(all.exit_code, 0);
    EXPECT_EQ(all.err, "");
    for (const char* option : {"--reader", "--store", "--offsets"}) {
      EXPECT_EQ(help.out.find(option), std::string::npos) << command << option;
      EXPECT_EQ(all.out.find(option) != std::string::npos,
                command != std::string("info") || option == std::string("--reader"))
          << command << option;
    }
    EXPECT_NE(all.out.find("For developers"), std::string::npos);
    const std::string everything = place.run({"--help-all"}).out;
    EXPECT_NE(everything.find(all.out), std::string::npos) << command;
  }
}

TEST_F(Usage, HelpIsTidy) {
  for (const char* command : {"voxelize", "mesh", "ldi", "info", "csg"}) {
    const std::string help = place.run({command, "--help-all"}).out;
    EXPECT_EQ(help.find("\n\n\n"), std::string::npos) << help;
    EXPECT_EQ(help.find_first_of("{}"), std::string::npos) << help;
    EXPECT_EQ(help.find("--json[=FILE]") != std::string::npos, command != std::string("ldi"));
    EXPECT_EQ(help.find("Print this help and exit"), help.rfind("Print this help and exit"));
    std::istringstream lines(help);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80u) << line;
  }
  const std::string csg = place.run({"csg", "--help"}).out;
  EXPECT_GT(csg.find("--imgsize"), csg.find("OpenSCAD's options:"));
}

TEST_F(Usage, VersionIsPrintedWithoutAnythingElse) {
  const RunResult run = place.run({"--version"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_TRUE(run.out.starts_with("strata ")) << run.out;
  EXPECT_EQ(run.out.find('\n'), run.out.size() - 1);
  EXPECT_EQ(place.run({"-V"}).out, run.out);
  refuses({"--version", "box.obj"}, "--version takes nothing but --json, got box.obj");
}

TEST_F(Usage, FormatsAreListedWithoutAnInput) {
  const RunResult run = place.run({"voxelize", "--list-formats"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  for (const char* name : {"vdb", "npy", "npz", "nrrd", "vti", "nii", "nii.gz", "mha", "raw", "tif",
                           "binvox", "vox", "png", "ome.zarr", "zarr", "ply", "xyz", "schem"}) {
    EXPECT_NE(run.out.find(std::string(name) + " "), std::string::npos) << name;
  }
}

TEST_F(Usage, UnknownWordsAreNamed) {
  refuses({"voxelise", "box.obj"}, "voxelise");
  refuses({"--resolution", "4"}, "--resolution");
  refuses({"voxelize", "box.obj", "-r", "4", "--stats", "--no-such"}, "unknown option --no-such");
  refuses({"voxelize", "box.obj", "--stats", "-r"}, "--resolution needs a value: N");
  refuses({"voxelize", "box.obj", "--stats", "-r", "4", "-r", "5"},
          "--resolution is given 2 times");
  refuses({"voxelize", "box.obj", "-r", "4", "--stats", "--rule", "maybe"}, "'maybe'");
  refuses({"voxelize", "box.obj", "-r", "4", "--stats", "--surface=18"}, "'18'");
  refuses({"voxelize", "box.obj", "-r", "4", "--stats", "--axis", "w"}, "'w'");
  refuses({"voxelize", "box.obj", "-r", "4", "-o", "box.cube"}, "box.cube");
  refuses({"voxelize", "box.obj", "-r", "4", "-o", "box"}, "box");
  refuses({"voxelize", "box.obj", "-r", "4", "-o", "box.x", "--format", "cube"}, "cube");
  refuses({"ldi", "box.obj", "-r", "4", "-o", "box.tif"}, "box.tif");
  refuses({"voxelize", "box.obj", "-r", "4", "--axis", "x", "-o", "box.vdb"}, "along z");
}

TEST_F(Usage, AFileAloneIsMeasuredAndOnATerminalTheNextStepsAreNamed) {
  const RunResult run = place.run({"box.obj"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("volume           1,"), std::string::npos) << run.out;
  EXPECT_EQ(run.out.find("next"), std::string::npos) << run.out;
  if (std::system("command -v script >/dev/null") != 0) GTEST_SKIP() << "needs script(1)";
  const std::string shown = place.path("shown");
  const std::string command = "script -qec '" STRATA_TOOL " " + place.path("box.obj") +
                              "' /dev/null >" + shown + " </dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_NE(place.read("shown").find("strata voxelize " + place.path("box.obj") + " -o box.vdb"),
            std::string::npos)
      << place.read("shown");
}

TEST_F(Usage, ThereIsOneSizeAtMostAndOneByDefault) {
  const RunResult run = place.run({"voxelize", "box.obj", "--stats"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("256 x 256 x 256 voxels"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("; -r 256 by default\n"), std::string::npos) << run.out;
  const RunResult told = place.run({"voxelize", "box.obj", "--stats", "-r", "256"});
  EXPECT_EQ(told.out.find("by default"), std::string::npos) << told.out;
  refuses({"voxelize", "box.obj", "--stats", "-r", "4", "--voxel-size", "1"},
          "can be given, got -r, --voxel-size");
  refuses({"voxelize", "box.obj", "--stats", "-r", "4", "--voxel-size", "1", "--grid", "1,1,1"},
          "can be given, got -r, --voxel-size, --grid");
}

TEST_F(Usage, NumbersThatAreNoneAreNamed) {
  refuses({"voxelize", "box.obj", "--stats", "-r", "4x"}, "'4x'");
  refuses({"voxelize", "box.obj", "--stats", "-r", "4.5"}, "'4.5'");
  refuses({"voxelize", "box.obj", "--stats", "-r", "99999999999999999999"}, "99999999999999999999");
  refuses({"voxelize", "box.obj", "--stats", "--voxel-size", "1,2"}, "'1,2'");
  refuses({"voxelize", "box.obj", "--stats", "--voxel-size", "nan"}, "'nan'");
  refuses({"voxelize", "box.obj", "--stats", "--grid", "1,2"}, "'1,2'");
  refuses({"voxelize", "box.obj", "--stats", "--grid", "1,2,"}, "''");
  refuses({"voxelize", "box.obj", "--stats", "-r", "4", "--bounds", "0,0,0,1,1"}, "0,0,0,1,1");
  refuses({"voxelize", "box.obj", "--stats", "-r", "4", "-j", "-1"}, "-1");
  refuses({"voxelize", "box.obj", "--stats", "-r", "4", "--memory-limit", "much"}, "'much'");
  refuses({"voxelize", "box.obj", "--stats", "-r", "4", "--memory-limit", "0"}, "'0'");
}

TEST_F(Usage, SizesOutOfRangeAreNamed) {
  refuses({"voxelize", "box.obj", "--stats", "-r", "0"}, "must be at least 1 voxel, got 0");
  refuses({"voxelize", "box.obj", "--stats", "-r", "-5"}, "-5");
  refuses({"voxelize", "box.obj", "--stats", "--voxel-size", "0"}, "0");
  refuses({"voxelize", "box.obj", "--stats", "--voxel-size", "-0.5"}, "-0.5");
  refuses({"voxelize", "box.obj", "--stats", "--grid", "4,0,4"}, "at least 1 voxel along y, got 0");
  refuses({"voxelize", "box.obj", "--stats", "-r", "4", "--padding", "-1"}, "-1");
  refuses({"voxelize", "box.obj", "--stats", "-r", "4", "--bounds", "0,0,0,1,-1,1"}, "-1");
}

TEST_F(Usage, OptionsThatWouldHaveNoEffectAreRefused) {
  refuses({"voxelize", "box.obj", "-r", "4", "--fog", "-o", "a.npy"}, "--fog needs a .vdb file");
  refuses({"voxelize", "box.obj", "-r", "4", "--fog", "-o", "a.x", "--format", "nrrd"},
          "format nrrd cannot store a fog");
  refuses({"voxelize", "box.obj", "-r", "4", "--fog", "--stats"}, "--fog needs -o");
  refuses({"voxelize", "box.obj", "-r", "4", "--fog", "--surface=6", "--ids", "-o", "a.vdb"},
          "--ids");
  refuses({"voxelize", "box.obj", "-r", "4", "--fog=4", "--surface", "-o", "a.vdb"}, "--surface");
  refuses({"voxelize", "box.obj", "-r", "4", "--fog=0", "-o", "a.vdb"}, "1 to 16, got 0");
  refuses({"voxelize", "box.obj", "-r", "4", "--fog=17", "-o", "a.vdb"}, "1 to 16, got 17");
  refuses({"voxelize", "box.obj", "-r", "4", "--fog=x", "-o", "a.vdb"}, "'x'");
  refuses({"voxelize", "box.obj", "-r", "4", "--mask", "-o", "a.npy"}, "--mask needs a .vdb file");
  refuses({"voxelize", "box.obj", "-r", "4", "--mask", "--ids", "-o", "a.vdb"},
          "--ids cannot be combined with --mask");
  refuses({"voxelize", "box.obj", "-r", "4", "--mask", "--fog", "-o", "a.vdb"}, "--mask");
  refuses({"voxelize", "box.obj", "-r", "4", "--mask", "--stats"}, "--mask needs -o");
  refuses({"voxelize", "box.obj", "-r", "4", "--name", "a", "-o", "a.npy"},
          "format npy cannot store a name");
  refuses({"voxelize", "box.obj", "-r", "4", "--name", "a", "--stats"}, "--name needs -o");
  refuses({"voxelize", "box.obj", "-r", "4", "--name",
           "a\x1e"
           "b",
           "-o", "a.vdb"},
          "control");
  refuses({"voxelize", "box.obj", "-r", "4", "--stats", "--surface", "--backend", "gl"},
          "--surface alone, which needs no depth lists");
  for (const char* backend : {"cpu", "auto"}) {
    const RunResult run = place.run(
        {"voxelize", "box.obj", "-r", "4", "--checksum", "--surface", "--backend", backend});
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
}

TEST_F(Usage, SomethingMustComeOut) {
  refuses({"mesh", "box.obj"}, "-o FILE");
  refuses({"voxelize", "-r", "4", "--stats"}, "no input file is given");
  refuses({"info"}, "no input file is given");
  refuses({"voxelize", "box.obj", "-r", "4", "-o", "-"}, "format");
  refuses({"voxelize", "box.obj", "-r", "4", "-o", "-", "--format", "png"}, "folder");
}

TEST_F(Usage, AnInputIsNotOverwritten) {
  const std::string before = place.read("box.obj");
  refuses({"voxelize", "box.obj", "-r", "4", "-o", "./box.obj", "--format", "npy"}, "box.obj");
  EXPECT_EQ(place.read("box.obj"), before);
}

TEST_F(Usage, NegativeNumbersAreValuesAndNotOptions) {
  const RunResult run = place.run(
      {"voxelize", "box.obj", "--voxel-size", "0.5", "--bounds", "-1,-1,-1,1,1,1", "--stats"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("4 x 4 x 4 voxels"), std::string::npos) << run.out;
}

TEST_F(Usage, SurfaceWithoutAKindDoesNotTakeTheNextWord) {
  const RunResult run =
      place.run({"voxelize", "--stats", "-r", "4", "--json=report.json", "--surface", "box.obj"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(place.read("report.json").find("\"surface\": \"conservative\""), std::string::npos);
}

}  // namespace
}  // namespace strata
