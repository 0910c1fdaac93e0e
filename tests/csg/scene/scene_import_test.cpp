#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "csg/scene/scad.h"
#include "csg/solids/height_map.h"
#include "mesh/archives/read_3mf_amf.h"
#include "strata/mesh/diagnose.h"
#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/csg/scene/scene_checks.h"
#include "tests/csg/scene/scene_inputs.h"

namespace strata::csg {
namespace {

namespace fs = std::filesystem;

// --- files of a scene
// -------------------------------------------------------------------------------

TEST_F(SceneFiles, MeshesOfAllKindsAreImportedBesideTheScene) {
  for (const char* name : {"a.stl", "b.off", "c.obj", "d.ply"}) {
    write_box(name);
    const Scene scene =
        read(write("scene.csg", fmt::format("import(file = \"{}\", scale = 1);", name)));
    EXPECT_EQ(codes_of(scene), "") << name;
    EXPECT_NEAR(volume_of(scene), 8.0, 1e-6) << name;
  }
}

TEST_F(SceneFiles, NamesAreRelativeToTheSceneOrAFolderAroundIt) {
  write_box("meshes/a.stl");
  write_box("up.stl");
  const std::string text = "import(file = \"{}\");";
  const auto solids = [&](const std::string& scene, const std::string& name) {
    return read(write(scene, fmt::format(fmt::runtime(text), name))).tree.solids().size();
  };
  EXPECT_EQ(solids("scene.csg", "meshes/a.stl"), 1u);
  EXPECT_EQ(solids("sub/scene.csg", "../meshes/a.stl"), 1u);
  EXPECT_EQ(solids("sub/deep/scene.csg", "meshes/a.stl"), 1u);
  EXPECT_EQ(solids("sub/deep/scene.csg", "up.stl"), 1u);
  EXPECT_EQ(solids("other.csg", (folder_ / "up.stl").string()), 1u);
  ReadSceneOptions options;
  options.asset_folder = (folder_ / "meshes").string();
  EXPECT_EQ(read(write("scene.csg", "import(file = \"a.stl\");"), options).tree.solids().size(),
            1u);
}

TEST_F(SceneFiles, MissingFilesAreNamedAndLeftOut) {
  const Scene scene = read(write("s.csg",
                                 "cube();\n import(file = \"no.stl\"); surface(file = \"no.dat\");"
                                 "import(file = \"no.svg\"); import(file = \"\");"));
  EXPECT_EQ(codes_of(scene), "missing-file missing-file missing-file ");
  EXPECT_NE(scene.warnings[0].message.find("s.csg:2:2: "), std::string::npos);
  EXPECT_NE(scene.warnings[0].message.find("'no.stl'"), std::string::npos);
  EXPECT_EQ(scene.tree.solids().size(), 1u);
}

TEST_F(SceneFiles, BrokenAndUnknownFilesAreNamedAndLeftOut) {
  write("bad.stl", "solid x\nfacet normal 0 0 0\nouter loop\nvertex 1 2 blah\n");
  write("bad.3mf", "no archive");
  write("bad.amf", "<amf><object><mesh><vertices><vertex/></vertices></mesh></object></amf>");
  write("x.nef3", "");
  write("x.blend", "");
  const Scene scene =
      read(write("s.csg",
                 "import(file=\"bad.stl\");import(file=\"bad.3mf\");import(file=\"bad.amf\");"
                 "import(file=\"x.nef3\");import(file=\"x.blend\");"));
  EXPECT_EQ(codes_of(scene), "geometry geometry geometry not-done not-done ");
  EXPECT_NE(scene.warnings[3].message.find("Nef"), std::string::npos);
  EXPECT_TRUE(scene.tree.solids().empty());
}

TEST_F(SceneFiles, ImportsAreReadOnceAndInspected) {
  TriangleSoup box = make_box(glm::dvec3(0), glm::dvec3(2));
  reverse_orientation(box);
  ASSERT_TRUE(write_mesh(write("inside_out.off", ""), box).has_value());
  box.triangles.pop_back();
  ASSERT_TRUE(write_mesh(write("open.off", ""), box).has_value());
  const Scene scene = read(write("s.csg",
                                 "import(file=\"inside_out.off\"); import(file=\"inside_out.off\");"
                                 "import(file=\"open.off\");"));
  EXPECT_EQ(codes_of(scene), "geometry geometry ");
  const auto solids = scene.tree.solids();
  ASSERT_EQ(solids.size(), 3u);
  EXPECT_EQ(solids[0].mesh, solids[1].mesh);
  EXPECT_NEAR(signed_volume(*solids[0].mesh), 8.0, 1e-12);
}

TEST_F(SceneFiles, CentredImportsStandAboutTheOrigin) {
  write_box("a.stl");
  const Scene scene = read(write("s.csg", "import(file = \"a.stl\", center = true);"));
  expect_box(box_of(scene), {-1, -1, -1}, {1, 1, 1}, 1e-6);
}

TEST_F(SceneFiles, TheDeprecatedFormsTakeAFileInPlaceOfChildren) {
  write_box("a.stl");
  const Scene scene = read(write("s.csg", "projection(file = \"a.stl\", cut = false);"));
  EXPECT_TRUE(scene.flat);
  EXPECT_NEAR(volume_of(scene), 4.0, 1e-5);
  EXPECT_EQ(codes_of(read(write("t.csg",
                                "linear_extrude(file = \"no.dxf\", layer = \"a\");"
                                "rotate_extrude(file = \"no.dxf\");"))),
            "missing-file missing-file ");
}

TEST_F(SceneFiles, UnreadableScenesAreErrors) {
  for (const std::string& path : {(folder_ / "no.csg").string(), folder_.string()}) {
    const auto scene = read_scene(path);
    ASSERT_FALSE(scene.has_value());
    EXPECT_EQ(scene.error().code, ErrorCode::kInput);
    EXPECT_NE(scene.error().message.find(path), std::string::npos);
  }
}

// --- 3MF and AMF
// --------------------------------------------------------------------------------------

constexpr std::string_view kTetra =
    "<mesh><vertices><vertex><coordinates><x>0</x><y>0</y><z>0</z></coordinates></vertex>"
    "<vertex><coordinates><x> 1 </x><y>0</y><z>0</z></coordinates></vertex>"
    "<vertex><coordinates><x>0</x><y>1</y><z>0</z></coordinates></vertex>"
    "<vertex><coordinates><x>0</x><y>0</y><z>1</z></coordinates></vertex></vertices>"
    "<volume><triangle><v1>0</v1><v2>2</v2><v3>1</v3></triangle>"
    "<triangle><v1>0</v1><v2>1</v2><v3>3</v3></triangle>"
    "<triangle><v1>0</v1><v2>3</v2><v3>2</v3></triangle>"
    "<triangle><v1>1</v1><v2>2</v2><v3>3</v3></triangle></volume></mesh>";

TEST_F(SceneFiles, AmfVolumesAreOneSoup) {
  const std::string object = "<object>" + std::string(kTetra) + "</object>";
  auto mesh =
      read_amf(write("a.amf", "<?xml version=\"1.0\"?>\n<amf>" + object + object + "</amf>"));
  if (!mesh && mesh.error().code == ErrorCode::kUsage) GTEST_SKIP() << mesh.error().message;
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 8u);
  EXPECT_TRUE(is_closed(*mesh));
  EXPECT_NEAR(signed_volume(*mesh), 2.0 / 6, 1e-12);
}

TEST_F(SceneFiles, BrokenAmfNamesTheLine) {
  const auto message = [&](std::string from, const std::string& to) {
    std::string text = "<amf>\n<object>\n" + std::string(kTetra) + "</object></amf>";
    text.replace(text.find(from), from.size(), to);
    const auto mesh = read_amf(write("a.amf", text));
    EXPECT_FALSE(mesh.has_value());
    return mesh ? std::string() : mesh.error().message;
  };
  if (message("<v3>3</v3>", "<v3>4</v3>").find("libpugixml") != std::string::npos) {
    GTEST_SKIP() << "no pugixml";
  }
  EXPECT_NE(message("<v3>3</v3>", "<v3>4</v3>")
                .find("a.amf:3: a triangle refers to vertex 4, the mesh has 4"),
            std::string::npos);
  EXPECT_NE(message("<v3>3</v3>", "<v3>-1</v3>").find("a.amf:3: '-1' is not a vertex index"),
            std::string::npos);
  EXPECT_NE(message("<x> 1 </x>", "<x>one</x>").find("a.amf:3: a vertex has no valid x"),
            std::string::npos);
  EXPECT_NE(message("</object>", "</objekt>").find("a.amf:3: "), std::string::npos);
}

/// A file of Debian's openscad-testing-data.
fs::path asset(const std::string& name) { return fs::path("/usr/share/openscad") / name; }
constexpr char kNoAssets[] = "needs Debian's openscad-testing-data";

TEST(SceneAssets, ThreeMfOfLib3mfIsRead) {
  const fs::path path = asset("testdata/scad/3D/features/import.3mf");
  if (!fs::exists(path)) GTEST_SKIP() << kNoAssets;
  const auto mesh = read_3mf(path);
  if (!mesh && mesh.error().code == ErrorCode::kUsage) GTEST_SKIP() << mesh.error().message;
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  EXPECT_TRUE(is_closed(*mesh));
  EXPECT_EQ(mesh->triangles.size(), 36u);
  EXPECT_NEAR(signed_volume(*mesh), 48.810974174, 1e-9);  // from its XML, by another program
}

TEST(SceneAssets, ZippedAmfIsRead) {
  const fs::path path = asset("testdata/amf/split_pyramid.amf");
  if (!fs::exists(path)) GTEST_SKIP() << kNoAssets;
  const auto mesh = read_amf(path);
  if (!mesh && mesh.error().code == ErrorCode::kUsage) GTEST_SKIP() << mesh.error().message;
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  EXPECT_NEAR(signed_volume(*mesh), 1.0 / 3, 1e-9);
}

// --- surface
// -------------------------------------------------------------------------------------------

TEST_F(SceneFiles, SurfacesStandOnAFloorBelowTheLowestPoint) {
  const auto mesh =
      read_surface(write("a.dat", "# a comment\n1 2 3\n\n 4 5 6 # more\n"), false, false);
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  EXPECT_TRUE(is_closed(*mesh));
  const Bounds box = bounds(*mesh);
  expect_box(box, {0, 0, 0}, {2, 1, 6});
  // Two cells of four triangles each, whose middle is the mean: the volume is that of the means.
  EXPECT_NEAR(signed_volume(*mesh), (1 + 2 + 4 + 5) / 4.0 + (2 + 3 + 5 + 6) / 4.0, 1e-12);
  EXPECT_EQ(mesh->positions[0], glm::dvec3(0, 0, 1));
  EXPECT_EQ(mesh->positions[5], glm::dvec3(2, 1, 6));
}

TEST_F(SceneFiles, TextMayBeginWithAByteOrderMark) {
  const std::string mark = "\xef\xbb\xbf";
  const auto plain = read_surface(write("a.dat", "1 2 3\n4 5 6\n"), false, false);
  const auto marked = read_surface(write("a.dat", mark + "1 2 3\n4 5 6\n"), false, false);
  ASSERT_TRUE(plain.has_value() && marked.has_value());
  EXPECT_EQ(plain->positions, marked->positions);
  EXPECT_FALSE(plain->positions.empty());
  write("b.obj", mark + "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
  const Scene scene = read(write("scene.csg", mark + "import(file = \"b.obj\");"));
  ASSERT_EQ(scene.tree.solids().size(), 1u);
  EXPECT_NEAR(signed_volume(*scene.tree.solids()[0].mesh), 1.0 / 6.0, 1e-12);
}

TEST_F(SceneFiles, FloorsGoDownWithNegativeHeights) {
  const auto mesh = read_surface(write("a.dat", "-5 2\n3 4\n"), true, false);
  ASSERT_TRUE(mesh.has_value());
  expect_box(bounds(*mesh), {-0.5, -0.5, -6}, {0.5, 0.5, 4});
  const auto high = read_surface(write("b.dat", "5 7\n8 9\n"), false, false);
  ASSERT_TRUE(high.has_value());
  EXPECT_EQ(bounds(*high).low.z, 0.0);
  const auto uneven = read_surface(write("c.dat", "5 7\n8\n"), false, false);
  ASSERT_TRUE(uneven.has_value());
  EXPECT_TRUE(is_closed(*uneven));
  expect_box(bounds(*uneven), {0, 0, 0}, {1, 1, 8});
}

TEST_F(SceneFiles, BadSurfacesAreRefused) {
  for (const char* text : {"", "1\n", "1 2 3\n", "1 x\n2 3\n", "1 2\nnan 3\n", "1 2\n3 4e\n"}) {
    const auto mesh = read_surface(write("a.dat", text), false, false);
    ASSERT_FALSE(mesh.has_value()) << text;
    EXPECT_EQ(mesh.error().code, ErrorCode::kInput);
  }
  EXPECT_FALSE(read_surface(write("a.png", "no picture"), false, false).has_value());
}

TEST_F(SceneFiles, FaultsOfSurfacesAreNamedByTheirPlace) {
  const auto warning_of = [&](std::string_view text) {
    write("a.dat", text);
    const Scene scene = read(write("scene.csg", "surface(file = \"a.dat\");"));
    EXPECT_EQ(codes_of(scene), "geometry ");
    return scene.warnings.empty() ? std::string() : scene.warnings[0].message;
  };
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  const std::string bad = warning_of("# heights\n1 2\n3 4x5 6\n");
  EXPECT_TRUE(has(bad, "a.dat:3: number 2 of row 2 is not a finite number; the surface")) << bad;
  // A scene may name any file: a warning shows nothing of what stands in it.
  for (const char* text : {"secret:x:0:0\n", "1 2\n3 secret\n", "# secret\nsecret\n"}) {
    EXPECT_FALSE(has(warning_of(text), "secret")) << text;
  }
  const std::string one = warning_of("1 2 3\n4 5\n6 7 8\n");
  EXPECT_TRUE(has(one, "a.dat: row 2 has 2 numbers, the longest 3; missing numbers are 0")) << one;
  EXPECT_TRUE(has(warning_of("1 2\n4\n6\n"), "missing numbers are 0 (2 rows are short)"));
}

TEST_F(SceneFiles, AFolderIsNoFile) {
  write("parts.stl/readme", "");
  const Scene scene = read(write("scene.csg", "import(file = \"parts.stl\"); cube();"));
  ASSERT_EQ(codes_of(scene), "missing-file ");
  EXPECT_NE(scene.warnings[0].message.find("'parts.stl', which is a folder; it is left out"),
            std::string::npos);
}

TEST_F(SceneFiles, LayersThatAreNotThereAreNamed) {
  write("a.dxf",
        "0\nSECTION\n2\nENTITIES\n0\nCIRCLE\n8\nholes\n10\n0\n20\n0\n40\n1\n"
        "0\nCIRCLE\n8\nrim\n10\n0\n20\n0\n40\n2\n0\nENDSEC\n0\nEOF\n");
  const auto import = [&](const char* layer) {
    return read(
        write("scene.csg", fmt::format("import(file = \"a.dxf\", layer = \"{}\");", layer)));
  };
  EXPECT_EQ(codes_of(import("rim")), "");
  const Scene scene = import("hole");
  ASSERT_EQ(codes_of(scene), "geometry ");
  EXPECT_NE(scene.warnings[0].message.find("a.dxf: layer 'hole' is empty; there are 'holes', "
                                           "'rim'; it is left out"),
            std::string::npos)
      << scene.warnings[0].message;
}

/// 3 x 2 pixels: red, green, blue above grey 51, grey 102, white.
constexpr char kPicture[] =
    "\211\120\116\107\015\012\032\012\000\000\000\015\111\110\104\122\000\000\000\003\000"
    "\000\000\002\010\002\000\000\000\022\026\361\115\000\000\000\030\111\104\101\124\170"
    "\332\143\370\317\300\300\000\301\306\306\306\151\151\151\377\377\377\007\000\075\243"
    "\007\306\141\155\026\116\000\000\000\000\111\105\116\104\256\102\140\202";

TEST_F(SceneFiles, PicturesAreHeightMapsWithTheLastRowInFront) {
  const std::string path = write("a.png", {kPicture, sizeof kPicture - 1});
  const auto mesh = read_surface(path, false, false), turned = read_surface(path, false, true);
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  ASSERT_TRUE(turned.has_value());
  EXPECT_TRUE(is_closed(*mesh));
  const double heights[] = {20, 40, 100, 21.26, 71.52, 7.22};
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(mesh->positions[i].z, heights[i], 1e-9) << i;
    EXPECT_NEAR(turned->positions[i].z, 100 - heights[i], 1e-9) << i;
  }
  expect_box(bounds(*mesh), {0, 0, 6.22}, {2, 1, 100});
}

// --- programs
// -----------------------------------------------------------------------------------------

/// Puts a folder before all others that programs are looked for in, or instead of them.
class ProgramPath {
 public:
  explicit ProgramPath(const std::string& path) : old_(std::getenv("PATH")) {
    ::setenv("PATH", path.c_str(), 1);
  }
  ~ProgramPath() { ::setenv("PATH", old_.c_str(), 1); }
  [[nodiscard]] const std::string& old() const { return old_; }

 private:
  std::string old_;
};

TEST_F(SceneFiles, WithoutOpenscadAProgramSaysWhatToDo) {
  const std::string path = write("a.scad", "cube();");
  const ProgramPath nothing(folder_.string());
  const auto scene = read_scene(path);
  ASSERT_FALSE(scene.has_value());
  EXPECT_EQ(scene.error().code, ErrorCode::kInput);
  EXPECT_NE(scene.error().message.find("install the package openscad"), std::string::npos);
  EXPECT_NE(scene.error().message.find("openscad -o scene.csg"), std::string::npos);
}

TEST_F(SceneFiles, TheOutputOfOpenscadIsRead) {
  const std::string path = write("a.scad", "anything");
  const std::string fake = write("openscad", "#!/bin/sh\necho 'cube([2,1,1]);' > \"$2\"\n");
  fs::permissions(fake, fs::perms::owner_all);
  const ProgramPath first(folder_.string() + ":" + std::getenv("PATH"));
  EXPECT_NEAR(volume_of(read(path)), 2.0, 1e-9);
}

TEST_F(SceneFiles, WhatOpenscadSaysIsReported) {
  const std::string path = write("a.scad", "anything");
  const std::string fake =
      write("openscad", "#!/bin/sh\necho 'ERROR: Parser error in line 3' >&2\nexit 1\n");
  fs::permissions(fake, fs::perms::owner_all);
  const ProgramPath first(folder_.string() + ":" + std::getenv("PATH"));
  const auto scene = read_scene(path);
  ASSERT_FALSE(scene.has_value());
  EXPECT_NE(scene.error().message.find("Parser error in line 3"), std::string::npos)
      << scene.error().message;
}

/// openscad ends with 0 also where the program failed.
TEST_F(SceneFiles, WarningsAndErrorsOfOpenscadAreOurs) {
  const auto says = [&](const std::string& text) {
    fs::permissions(
        write("openscad",
              "#!/bin/sh\necho 'cube([2,1,1]);' > \"$2\"\ncat >&2 <<'END'\n" + text + "\nEND\n"),
        fs::perms::owner_all);
  };
  const std::string path = write("a.scad", "anything");
  const ProgramPath first(folder_.string() + ":" + std::getenv("PATH"));
  std::string chatter;  // much more than is kept of its last words
  for (int i = 0; i < 20'000; ++i) chatter += fmt::format("ECHO: \"line {} of many\"\n", i);
  says("WARNING: Ignoring unknown module 'foo' in file a.scad, line 7\n" + chatter +
       "DEPRECATED: child() will be removed\nWARNING: Can't open include file 'b.scad'.\n"
       "WARNING: odd in file lib/c.scad, line 2");
  const Scene scene = read(path);
  EXPECT_NEAR(volume_of(scene), 2.0, 1e-9);
  ASSERT_EQ(codes_of(scene), "openscad openscad openscad ");
  EXPECT_EQ(scene.warnings[0].message,
            path + ":7: openscad: WARNING: Ignoring unknown module 'foo'");
  EXPECT_EQ(scene.warnings[1].message,
            path + ": openscad: WARNING: Can't open include file 'b.scad'.");
  EXPECT_EQ(scene.warnings[2].message, "lib/c.scad:2: openscad: WARNING: odd");
  ASSERT_EQ(scene.notes.size(), 1001u);
  EXPECT_EQ(scene.notes.back(), "ECHO: [... 19001 more lines]");
  EXPECT_EQ(scene.notes[1], "ECHO: \"line 1 of many\"");
  says(
      "ERROR: Assertion 'false' failed: \"boo\" in file a.scad, line 1\n"
      "TRACE: called by 'assert' in file a.scad, line 1\n" +
      chatter);
  const auto failed = read_scene(path);
  ASSERT_FALSE(failed.has_value());
  EXPECT_EQ(failed.error().code, ErrorCode::kInput);
  EXPECT_EQ(failed.error().message,
            path + ":1: openscad: ERROR: Assertion 'false' failed: \"boo\"");
}

TEST(OpenscadRule, NamesAreReadAsOpenscadWritesThem) {
  EXPECT_EQ(
      files_of_rule("/proc/self/fd/5: \\\n\t/a/b\\ c$d.stl \\\n\t/a/my\\ lib.scad \\\n\te.scad\n"),
      (std::vector<std::string>{"/a/b c$d.stl", "/a/my lib.scad", "e.scad"}));
  EXPECT_EQ(files_of_rule("a: b\\c: d"), (std::vector<std::string>{"b\\c:", "d"}));
  EXPECT_TRUE(files_of_rule("").empty());
  EXPECT_TRUE(files_of_rule("a:").empty());
}

TEST(OpenscadRule, AnAssignmentIsFoundInATextButNotInACommentOrABlock) {
  for (const char* yes : {"$vpr=[0,0,0];", "a = 1; $vpr\n = 3;", "/* */$vpr=1;", "\"\\\"\";$vpr=1;",
                          "module m() { } $vpr = 1;"}) {
    EXPECT_TRUE(assigns(yes, "$vpr")) << yes;
  }
  for (const char* no :
       {"// $vpr=1;", "/* $vpr = 1; */", "\"$vpr=1;\"", "module m() { $vpr = 1; }", "f($vpr = 1);",
        "assert($vpr == 1);", "a = $vpr == 1;", "$vprx = 1;", ""}) {
    EXPECT_FALSE(assigns(no, "$vpr")) << no;
  }
}

TEST_F(SceneFiles, WhatWasOpenedIsKept) {
  write_box("box.stl", 1.0);
  const std::string path =
      write("a.csg", "import(file = \"b\\x6fx.stl\"); import(file = \"box.stl\"); // \"no.stl\"\n");
  const Scene scene = read(path);
  ASSERT_EQ(scene.files.size(), 2u);
  for (const std::string& name : {path, (folder_ / "box.stl").string()}) {
    EXPECT_TRUE(std::any_of(scene.files.begin(), scene.files.end(), [&](const auto& file) {
      return file.is_same_file(identify_file(name));
    })) << name;
  }
  const Scene missing = read(write("b.csg", "import(file = \"none.stl\"); cube();"));
  EXPECT_EQ(std::count_if(missing.files.begin(), missing.files.end(),
                          [](const auto& file) { return file.is_there(); }),
            1);
}

TEST_F(SceneFiles, OpenscadIsEndedInTimeOrOnAStop) {
  const std::string path = write("a.scad", "anything");
  const std::string fake = write("openscad", "#!/bin/sh\nsleep 600\n");
  fs::permissions(fake, fs::perms::owner_all);
  const ProgramPath first(folder_.string() + ":" + std::getenv("PATH"));
  ReadSceneOptions options;
  options.scad_timeout_s = 0.2;
  const auto late = read_scene(path, options);
  ASSERT_FALSE(late.has_value());
  EXPECT_NE(late.error().message.find("more than 0.2 s"), std::string::npos);
  std::stop_source source;
  source.request_stop();
  Execution execution;
  execution.stop = source.get_token();
  const auto stopped = run_openscad(path, {}, execution);
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
}

TEST_F(SceneFiles, RealProgramsAreRunWhereOpenscadIsInstalled) {
  if (std::system("openscad --version > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "openscad is not installed";
  }
  write_box("box.stl", 3.0);
  const Scene scene =
      read(write("a.scad", "for (i = [0:2]) translate([10 * i, 0, 0]) import(\"box.stl\");"));
  EXPECT_EQ(codes_of(scene), "");
  EXPECT_NEAR(volume_of(scene), 81.0, 1e-5);
  const auto broken = read_scene(write("b.scad", "cube(;"));
  ASSERT_FALSE(broken.has_value());
  EXPECT_NE(broken.error().message.find("b.scad:1: openscad: ERROR: Parser error"),
            std::string::npos)
      << broken.error().message;
  EXPECT_EQ(codes_of(read(write("c.scad", "foo(); cube();"))), "openscad ");
  write("lib.scad", "module m() import(\"box.stl\");");
  const Scene parts = read(write("e.scad", "use <lib.scad>\nm();"));
  EXPECT_EQ(
      std::count_if(parts.files.begin(), parts.files.end(),
                    [&](const auto& file) {
                      return file.is_same_file(identify_file((folder_ / "lib.scad").string()));
                    }),
      1);
  const std::string path = write("d.scad", "echo(\"hi\");\nassert(false, \"boo\"); cube(1);");
  const auto asserted = read_scene(path);
  ASSERT_FALSE(asserted.has_value());
  EXPECT_EQ(asserted.error().message,
            path + ":2: openscad: ERROR: Assertion 'false' failed: \"boo\"");
}

}  // namespace
}  // namespace strata::csg
