// Scenes of OpenSCAD's tests beside the pictures that those expect: made by another program, so
// that a scene that is read wrong shows.

#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "tests/apps/strata/run_tool.h"
#include "tests/support/corpus.h"

namespace strata::testkit {
namespace {

namespace fs = std::filesystem;

/// What is not the colour of the ground, of a picture of 512 x 512.
std::vector<bool> silhouette(const std::string& path) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&png, path.c_str()) == 0) return {};
  png.format = PNG_FORMAT_RGB;
  std::vector<png_byte> bytes(PNG_IMAGE_SIZE(png));
  png_color ground{255, 255, 229};
  if (png_image_finish_read(&png, &ground, bytes.data(), 0, nullptr) == 0) return {};
  std::vector<bool> covered(bytes.size() / 3);
  for (std::size_t i = 0; i < covered.size(); ++i) {
    const int off = std::max({std::abs(bytes[3 * i] - 255), std::abs(bytes[3 * i + 1] - 255),
                              std::abs(bytes[3 * i + 2] - 229)});
    covered[i] = off > 3;
  }
  return covered;
}

/// Scenes whose picture is another one, as docs/csg_conformance.md explains or because the scene
/// was dumped from another program of the same name. Text depends on the fonts that are installed.
bool differs(const std::string& name) {
  static const std::set<std::string> kOther = {"circle",
                                               "difference",
                                               "difference_cube",
                                               "difference_sphere",
                                               "example015",
                                               "example025",
                                               "children_indexed",
                                               "intersecting",
                                               "intersection",
                                               "offset-tests",
                                               "minkowski2-tests",
                                               "module_recursion",
                                               "null-polygons",
                                               "polygon-tests",
                                               "polyhedron",
                                               "intersection-tests",
                                               "polygon_areas",
                                               "polyhedron-tests",
                                               "recursion",
                                               "rotate",
                                               "projection-cut-tests",
                                               "resize-2d-tests",
                                               "root-modifier-if",
                                               "sphere",
                                               "surface",
                                               "translate",
                                               "union"};
  return kOther.contains(name) || name.find("text") != std::string::npos;
}

TEST(ExpectedPictures, OfOpenScadsTestsAreOurs) {
  if (scene_files().empty()) GTEST_SKIP() << kNoScenes;
  const fs::path pictures = "/usr/share/openscad/regression/cgalpngtest";
  // A test and an example of one name share a picture: the example's.
  std::set<std::string> examples;
  const auto folder_of = [](const CorpusScene& scene) {
    return scene.file.parent_path().filename().string();
  };
  for (const CorpusScene& scene : scene_files()) {
    if (folder_of(scene) == "dumptest-examples") examples.insert(scene.name);
  }
  const Workplace place;
  std::size_t compared = 0, empty = 0;
  for (const CorpusScene& scene : scene_files()) {
    const fs::path picture = pictures / (scene.name + "-expected.png");
    if (!fs::exists(picture) || differs(scene.name)) continue;
    if (folder_of(scene) != (examples.contains(scene.name) ? "dumptest-examples" : "dumptest")) {
      continue;
    }
    SCOPED_TRACE(scene.name);
    const auto expected = silhouette(picture);
    if (expected.size() != 512 * 512) continue;
    const auto run = place.run({"csg", scene.file, "--assets", scene.assets, "-o", "a.png",
                                "--size", "512,512", "--render", "--viewall", "--autocenter",
                                "--quality", "draft", "--colorscheme", "Cornfield", "-j", "1"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    // What examples import comes with the package openscad, which may be missing.
    if (run.err.find(", which is missing") != std::string::npos) continue;
    const auto found = silhouette(place.path("a.png"));
    ASSERT_EQ(found.size(), expected.size());
    std::size_t both = 0, either = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      both += found[i] && expected[i] ? 1 : 0;
      either += found[i] || expected[i] ? 1 : 0;
    }
    // Outlines of flat scenes lie up to a pixel elsewhere.
    EXPECT_GE(static_cast<double>(both), 0.97 * static_cast<double>(either));
    empty += either == 0 ? 1 : 0;
    ++compared;
  }
  EXPECT_GE(compared, 100u);
  EXPECT_LE(empty, compared / 5);
}

}  // namespace
}  // namespace strata::testkit
