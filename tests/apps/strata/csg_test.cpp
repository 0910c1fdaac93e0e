// `strata csg`: pictures through the tool, its options and what it says of mistakes.

#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>

#include "strata/mesh/formats/write_mesh.h"
#include "strata/mesh/shapes.h"
#include "tests/apps/strata/json_names.h"
#include "tests/apps/strata/run_tool.h"

namespace strata {
namespace {

using nlohmann::json;
using testkit::collect;
using testkit::documented;
using testkit::RunResult;
using testkit::Workplace;

using Pixel = std::array<std::uint8_t, 4>;

struct Image {
  int width = 0, height = 0;
  std::vector<Pixel> pixels;
  [[nodiscard]] const Pixel& at(int u, int v) const {
    return pixels[static_cast<std::size_t>(v * width + u)];
  }
  friend bool operator==(const Image&, const Image&) = default;
};

Image decode(const std::string& bytes) {
  Image image;
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) {
    ADD_FAILURE() << png.message;
    return image;
  }
  png.format = PNG_FORMAT_RGBA;
  image.width = static_cast<int>(png.width), image.height = static_cast<int>(png.height);
  image.pixels.resize(static_cast<std::size_t>(png.width) * png.height);
  EXPECT_NE(png_image_finish_read(&png, nullptr, image.pixels.data(), 0, nullptr), 0);
  return image;
}

constexpr Pixel kBackground{0xf4, 0xf5, 0xf7, 255};

std::size_t covered(const Image& image) {
  return image.pixels.size() - static_cast<std::size_t>(std::count(
                                   image.pixels.begin(), image.pixels.end(), kBackground));
}

void put(const Workplace& place, const std::string& name, const TriangleSoup& mesh) {
  const auto written = write_mesh(place.path(name), mesh);
  ASSERT_TRUE(written.has_value()) << written.error().message;
}

constexpr const char* kCube = "cube(size = [10, 10, 10], center = false);\n";
constexpr const char* kDrilled =
    "difference() {\n"
    "  cube(size = [10, 10, 10], center = true);\n"
    "  cube(size = [4, 4, 20], center = true);\n"
    "}\n";

class Csg : public testing::Test {
 protected:
  /// The picture of `scene` with these options.
  Image draw(const std::string& scene, std::vector<std::string> options = {}) {
    place.write("scene.csg", scene);
    std::vector<std::string> arguments{"csg", "scene.csg", "-o", "out.png"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    last = place.run(arguments);
    EXPECT_EQ(last.exit_code, 0) << last.err;
    return last.exit_code == 0 ? decode(place.read("out.png")) : Image{};
  }
  /// What the tool says of a mistake; checks the exit code and that nothing was written.
  std::string refused(std::vector<std::string> arguments, int code) {
    arguments.insert(arguments.begin(), "csg");
    last = place.run(arguments);
    EXPECT_EQ(last.exit_code, code) << last.err;
    EXPECT_FALSE(place.has("out.png"));
    return last.err;
  }
  Workplace place;
  RunResult last;
};

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST_F(Csg, APictureIs512PixelsASideAndShowsAllOfTheScene) {
  const Image image = draw(kCube);
  EXPECT_EQ(image.width, 512);
  EXPECT_EQ(image.height, 512);
  EXPECT_GT(covered(image), image.pixels.size() / 4);
  for (int i = 0; i < 512; ++i) {
    for (const Pixel& pixel :
         {image.at(i, 0), image.at(i, 511), image.at(0, i), image.at(511, i)}) {
      ASSERT_EQ(pixel, kBackground);
    }
  }
  EXPECT_EQ(last.err, "");
  EXPECT_EQ(last.out, "");
}

TEST_F(Csg, SizesAreWrittenInTwoWays) {
  for (const char* option : {"--size=30,20", "--imgsize=30,20", "--size=30x20"}) {
    const Image image = draw(kCube, {option});
    EXPECT_EQ(image.width, 30) << option;
    EXPECT_EQ(image.height, 20) << option;
  }
}

TEST_F(Csg, EyeAndTargetGiveThePictureOfTargetRotationAndDistance) {
  // From (0, -100, 0) towards the origin is a turn by 90 degrees about x.
  const Image gimbal = draw(kDrilled, {"--camera=0,0,0,90,0,0,100", "--size=100,100"});
  const Image eye = draw(kDrilled, {"--camera=0,-100,0,0,0,0", "--size=100,100"});
  EXPECT_GT(covered(gimbal), 100u);
  EXPECT_EQ(gimbal, eye);
  const Image apart = draw(kDrilled, {"--camera", "0,-100,0,0,0,0", "--size", "100,100"});
  EXPECT_EQ(eye, apart);
}

TEST_F(Csg, ViewAllAndAutoCenterFrameAsOpenScadDoesFromTheUsualSide) {
  const Image all = draw(kCube, {"--size=100,100", "--viewall"});
  EXPECT_EQ(all, draw(kCube, {"--size=100,100", "--autocenter"}));
  EXPECT_EQ(all, draw(kCube,
                      {"--size=100,100", "--camera=7,7,7,55,0,25,1", "--viewall", "--autocenter"}));
  EXPECT_EQ(all, draw(kCube, {"--size=100,100", "--camera=0,0,0,55,0,25,0", "--view-all",
                              "--auto-center"}));
  EXPECT_NE(all, draw(kCube, {"--size=100,100"}));
}

/// The pixels that are not background: the first column, row, and those after the last.
std::array<int, 4> extent(const Image& image) {
  std::array<int, 4> box{image.width, image.height, 0, 0};
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      if (image.at(u, v) == kBackground) continue;
      box = {std::min(box[0], u), std::min(box[1], v), std::max(box[2], u + 1),
             std::max(box[3], v + 1)};
    }
  }
  return box;
}

/// The longer side is filled up to the margin, and nothing is nearer to one border than to the
/// opposite one.
void expect_framed(const Image& image, const std::string& what) {
  const auto [left, top, right, bottom] = extent(image);
  const double across = static_cast<double>(right - left) / image.width;
  const double down = static_cast<double>(bottom - top) / image.height;
  const double pixels = 2.0 / std::min(image.width, image.height);
  EXPECT_NEAR(std::max(across, down), 1 - 2 / 24.0, pixels + 0.005) << what;
  EXPECT_NEAR(left, image.width - right, 2 + 0.005 * image.width) << what;
  EXPECT_NEAR(top, image.height - bottom, 2 + 0.005 * image.height) << what;
}

TEST_F(Csg, TheResultFillsThePicture) {
  const std::string ball = "sphere($fn = 64, r = 10);\n";
  const std::string rod =
      "multmatrix([[1, 0, 0, 40], [0, 1, 0, -7], [0, 0, 1, 3], [0, 0, 0, 1]])"
      " { cube(size = [1, 1, 90], center = true); }\n";
  for (const char* size : {"--size=200,200", "--size=300,120", "--size=90,240"}) {
    for (const char* projection : {"--projection=p", "--projection=o"}) {
      for (const std::string& scene : {std::string(kDrilled), ball, rod}) {
        expect_framed(draw(scene, {size, projection}), scene + size + projection);
      }
    }
  }
}

TEST_F(Csg, WhatIsTakenAwayDoesNotCountForTheFrame) {
  const std::string cutter =
      "multmatrix([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 300], [0, 0, 0, 1]])"
      " { cube(size = [2, 2, 700], center = true); }\n";
  const Image drilled =
      draw("difference() {\n  cube(size = [10, 10, 10], center = true);\n" + cutter + "}\n",
           {"--size=200,200"});
  expect_framed(drilled, "a long drill");
  EXPECT_EQ(extent(drilled),
            extent(draw("cube(size = [10, 10, 10], center = true);\n", {"--size=200,200"})));
  const std::string both = "intersection() {\n  sphere($fn = 64, r = 10);\n" + cutter + "}\n";
  expect_framed(draw(both, {"--size=200,200"}), "an intersection");
  const std::string bar = "cube(size = [100, 10, 10], center = true);\n";
  expect_framed(draw(bar, {"--size=200,200", "--cut=x<-30"}), "one section");
  expect_framed(draw(bar, {"--size=200,200", "--cut=x<-30", "--cut=1,1,1,-40"}), "two sections");
  expect_framed(draw("sphere($fn = 64, r = 10);\n",
                     {"--size=200,200", "--cut=x>0", "--cut=y<0", "--cut=z>0"}),
                "an eighth of a ball");
}

TEST_F(Csg, ThinTwigsAreWholeInADefaultPicture) {
  // A rod of 0.03 pixels: one sample a pixel meets it here and there.
  const std::string twig =
      "multmatrix([[1, 0, 0, 50.3], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])"
      " { cube(size = [0.3, 0.3, 100]); }\ncube(size = [1, 1, 100]);\n"
      "multmatrix([[1, 0, 0, 99], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])"
      " { cube(size = [1, 1, 100]); }\n";
  const auto rows_with_twig = [](const Image& image) {
    int rows = 0;
    for (int v = 20; v < 80; ++v) {
      bool seen = false;
      for (int u = 35; u < 65; ++u) seen = seen || image.at(u, v) != kBackground;
      rows += seen ? 1 : 0;
    }
    return rows;
  };
  const std::vector<std::string> front{"--camera=50,0,50,90,20,0,300", "--size=100,100"};
  const int all = rows_with_twig(draw(twig, front));
  EXPECT_EQ(all, 60);
  EXPECT_LT(rows_with_twig(draw(twig, {front[0], front[1], "--quality=draft"})), all);
}

TEST_F(Csg, QualitiesAreNumbersOfSamples) {
  const std::vector<std::pair<const char*, const char*>> same{{"--quality=draft", "--samples=1"},
                                                              {"--quality=normal", "--samples=8"},
                                                              {"--quality=high", "--samples=16"}};
  std::vector<Image> drawn;
  for (const auto& [quality, samples] : same) {
    drawn.push_back(draw(kDrilled, {"--size=60,60", quality}));
    EXPECT_EQ(drawn.back(), draw(kDrilled, {"--size=60,60", samples})) << quality;
    EXPECT_EQ(draw(kDrilled, {"--size=60,60", quality, "--samples=2"}),
              draw(kDrilled, {"--size=60,60", "--samples=2"}));
  }
  EXPECT_EQ(drawn[1], draw(kDrilled, {"--size=60,60"}));
  EXPECT_NE(drawn[0], drawn[1]);
  EXPECT_NE(drawn[1], drawn[2]);
}

TEST_F(Csg, BackgroundsLieBehindThePicture) {
  const std::vector<std::string> small{"--size=40,40"};
  const Image clear = draw(kCube, {"--size=40,40", "--background=transparent"});
  EXPECT_EQ(clear, draw(kCube, {"--size=40,40", "--transparent"}));
  for (const auto& [name, colour] :
       {std::pair("white", Pixel{255, 255, 255, 255}), std::pair("#102030", Pixel{16, 32, 48, 255}),
        std::pair("#fA0", Pixel{255, 170, 0, 255})}) {
    const Image image = draw(kCube, {"--size=40,40", std::string("--background=") + name});
    EXPECT_EQ(image.at(0, 0), colour) << name;
    EXPECT_EQ(image.at(39, 39), colour) << name;
    // Between the two: what covers a pixel in part is blended with it.
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      const int alpha = clear.pixels[i][3];
      for (std::size_t c = 0; c < 3; ++c) {
        const double blended = (clear.pixels[i][c] * alpha + colour[c] * (255.0 - alpha)) / 255.0;
        ASSERT_NEAR(image.pixels[i][c], blended, 2.0) << name << ' ' << i;
      }
    }
  }
  const Image gradient = draw(kCube, {"--size=40,40", "--background=gradient"});
  for (int v = 1; v < 40; ++v) {
    EXPECT_EQ(gradient.at(0, v), gradient.at(39, v));
    EXPECT_LE(gradient.at(0, v)[0], gradient.at(0, v - 1)[0]);
  }
  EXPECT_GT(gradient.at(0, 0)[0], gradient.at(0, 39)[0] + 20);
  EXPECT_EQ(gradient.at(20, 20), draw(kCube, small).at(20, 20));
}

TEST_F(Csg, ProjectionsHaveOpenScadsNames) {
  const Image perspective = draw(kCube, {"--size=100,100"});
  EXPECT_EQ(perspective, draw(kCube, {"--size=100,100", "--projection=p"}));
  EXPECT_EQ(perspective, draw(kCube, {"--size=100,100", "--projection=perspective"}));
  const Image ortho = draw(kCube, {"--size=100,100", "--projection=o"});
  EXPECT_NE(perspective, ortho);
  EXPECT_EQ(ortho, draw(kCube, {"--size=100,100", "--projection=ortho"}));
}

TEST_F(Csg, AnExpressionOverMeshesIsTheSameAsTheScene) {
  // In OpenSCAD's look, in which it does not matter how faces are divided into triangles.
  const std::vector<std::string> camera{"--camera=0,0,0,55,0,25,60", "--size=100,100",
                                        "--colorscheme=Cornfield"};
  const Image scene = draw(kDrilled, camera);
  put(place, "cube.stl", make_box({-5, -5, -5}, {5, 5, 5}));
  put(place, "hole.off", make_box({-2, -2, -10}, {2, 2, 10}));
  for (const char* text : {"a - b", "cube - hole", "cube-(hole)", "a - (b + b)", "(a ^ b) & a"}) {
    const RunResult run = place.run({"csg", "cube.stl", "hole.off", "--expr", text, camera[0],
                                     camera[1], camera[2], "-o", "out.png"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(decode(place.read("out.png")), scene) << text;
  }
  const RunResult all = place.run({"csg", "cube.stl", "hole.off", camera[0], camera[1], "-o", "-"});
  EXPECT_EQ(all.exit_code, 0) << all.err;
  EXPECT_GT(covered(decode(all.out)), covered(draw(kDrilled, {camera[0], camera[1]})));
}

TEST_F(Csg, ScenesAndMeshesStandTogether) {
  place.write("hole.csg", "cube(size = [4, 4, 20], center = true);\n");
  put(place, "cube.stl", make_box({-5, -5, -5}, {5, 5, 5}));
  const std::vector<std::string> camera{"--camera=0,0,0,55,0,25,60", "--size=100,100"};
  const RunResult run = place.run(
      {"csg", "cube.stl", "hole.csg", "--expr=cube - hole", camera[0], camera[1], "-o", "out.png"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Image mixed = decode(place.read("out.png"));
  EXPECT_EQ(mixed, draw(kDrilled, camera));
}

TEST_F(Csg, ASceneMayComeThroughAPipe) {
  const RunResult run =
      place.run({"csg", "-", "--input-format=csg", "-o", "-", "--size=50,50"}, {.input = kCube});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(decode(run.out), draw(kCube, {"--size=50,50"}));
  // Beside a mesh, whose name tells what it is.
  put(place, "box.stl", make_box({0, 0, 0}, {1, 1, 1}));
  const RunResult both =
      place.run({"csg", "box.stl", "-", "--input-format=csg", "--json"}, {.input = kCube});
  EXPECT_EQ(both.exit_code, 0) << both.err;
  EXPECT_NE(both.out.find("\"solids\": 2"), std::string::npos) << both.out;
}

TEST_F(Csg, MistakesInAnExpressionAreMarked) {
  put(place, "a.stl", make_box({0, 0, 0}, {1, 1, 1}));
  put(place, "part.stl", make_box({0, 0, 0}, {1, 1, 1}));
  const auto says = [&](const std::string& text) {
    return refused({"a.stl", "part.stl", "-o", "out.png", "--expr=" + text}, 2);
  };
  EXPECT_TRUE(has(says("a - "), "missing here\n  a - \n      ^"));
  EXPECT_TRUE(has(says("a - hole"), "no file is called hole\n  a - hole\n      ^"));
  EXPECT_TRUE(has(says("(a - b"), "a closing parenthesis is missing here"));
  EXPECT_TRUE(has(says("a) - b"), "no parenthesis is open here"));
  EXPECT_TRUE(has(says("a b"), "an operator is expected here"));
  EXPECT_TRUE(has(says("a - c"), "c would be file 3, but there are only 2"));
  EXPECT_TRUE(has(says("* a"), "a name or an opening parenthesis is expected here"));
  EXPECT_TRUE(has(says(std::string(2000, '(')), "more than 1000 parentheses are open here"));
  std::string doubling = "a";
  for (int i = 0; i < 40; ++i) doubling = "(" + doubling + " ^ part)";
  refused({"a.stl", "part.stl", "-o", "out.png", "--expr=" + doubling}, 6);
}

TEST_F(Csg, MistakesInOptionsAreNamed) {
  place.write("scene.csg", kCube);
  const auto says = [&](const std::string& option) {
    return refused({"scene.csg", "-o", "out.png", option}, 2);
  };
  EXPECT_TRUE(has(says("--size=5"), "--size must be width,height, got '5'"));
  EXPECT_TRUE(has(says("--size=0,5"), "each side must be 1 to 65536 pixels"));
  EXPECT_TRUE(has(says("--camera=1,2,3"), "--camera must be 6 or 7 numbers"));
  EXPECT_TRUE(has(says("--camera=1,2,3,1,2,3"), "eye and target must differ"));
  EXPECT_TRUE(has(says("--camera=1,2,3,1,2,3,0"), "the distance must be above 0"));
  EXPECT_TRUE(has(says("--projection=fisheye"), "--projection must be"));
  EXPECT_TRUE(has(says("--colorscheme=pink"), "Cornfield"));
  EXPECT_TRUE(has(says("--samples=3"), "--samples must be 1, 2, 4, 8, 16, 32 or 64"));
  EXPECT_TRUE(has(says("--quality=best"), "--quality must be draft, normal or high"));
  EXPECT_TRUE(has(says("--background=mauve"), "--background must be gradient, transparent or a"));
  EXPECT_TRUE(
      has(says("--background=#12345"), "got '#12345'; a colour is #rrggbb or one of black"));
  EXPECT_TRUE(has(refused({"scene.csg", "-o", "out.png", "--transparent", "--background=red"}, 2),
                  "--transparent and --background red cannot be combined"));
  EXPECT_TRUE(has(says("--cut=w=3"), "--cut must be a plane"));
  EXPECT_TRUE(has(says("--cut=x=far"), "--cut must be a plane"));
  EXPECT_TRUE(has(says("--cut=0,0,0,1"), "must be finite and not 0"));
  EXPECT_TRUE(has(says("--scad-timeout=0"), "--scad-timeout must be seconds above 0, got 0"));
  EXPECT_TRUE(has(refused({"-o", "out.png"}, 2), "no input file is given"));
  EXPECT_TRUE(has(refused({"scene.csg", "-o", "out.gif"}, 2), "written as .png"));
  EXPECT_TRUE(has(refused({"scene.csg", "--ids", "ids.jpg"}, 2),
                  "--ids ids.jpg: pictures are written as .png"));
  EXPECT_TRUE(has(refused({"scene.csg", "--depth", "d.png"}, 2),
                  "--depth d.png: distances are written as .exr"));
  // The whole value is quoted, one number is one, and an empty value takes no other option's name.
  EXPECT_TRUE(has(says("--cut=x>=5"), "got 'x>=5'"));
  EXPECT_TRUE(has(says("--size=5,five"), "got '5,five'"));
  EXPECT_TRUE(has(says("--scad-timeout=soon"), "must be a number, got 'soon'"));
  EXPECT_TRUE(has(refused({"scene.csg", "-o", "out.png", "--camera=", "--progress", "none"}, 2),
                  "--camera has an empty value"));
  EXPECT_TRUE(
      has(refused({"scene.csg", "-o", "out.png", "--expr", ""}, 2), "--expr has an empty value"));
}

TEST_F(Csg, NothingIsWrittenWhereTheMeasuresFail) {
  // Its volume is no number; pictures take it.
  put(place, "far.obj", make_box(glm::dvec3(0.0), glm::dvec3(1e110)));
  const auto drawn = place.run({"csg", "far.obj", "-o", "far.png", "--size=16,16"});
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
  const auto before = place.names();
  const auto failed = place.run({"csg", "far.obj", "-o", "new.png", "--ids", "ids.png", "--depth",
                                 "d.exr", "--json=j.json", "--size=16,16"});
  EXPECT_NE(failed.exit_code, 0);
  EXPECT_EQ(place.names(), before) << failed.err;
}

TEST_F(Csg, FlatScenesTogetherAreRenderedFromAboveLikeOne) {
  place.write("flat.csg", "square(size = [3, 2]);");
  place.write("left.csg",
              "multmatrix([[1,0,0,-1],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) "
              "{ square(size = [2, 2]); }");
  place.write("both.csg",
              "square(size = [3, 2]); multmatrix([[1,0,0,-1],[0,1,0,0],[0,0,1,0],"
              "[0,0,0,1]]) { square(size = [2, 2]); }");
  for (const std::vector<std::string>& inputs :
       {std::vector<std::string>{"both.csg"}, {"flat.csg", "left.csg"}}) {
    std::vector<std::string> words{"csg"};
    words.insert(words.end(), inputs.begin(), inputs.end());
    for (const char* word : {"--render", "--size=60,40", "-o"}) words.emplace_back(word);
    words.push_back(std::to_string(inputs.size()) + ".png");
    const auto run = place.run(words);
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
  EXPECT_EQ(place.read("1.png"), place.read("2.png"));
}

TEST_F(Csg, ResultsWhoseVolumeIsNoNumberAreNamed) {
  place.write("huge.csg", "sphere(r = 1);\n  cube(size = [1e200, 1e200, 1e200]);");
  EXPECT_TRUE(has(refused({"huge.csg", "-o", "out.png"}, 5),
                  "huge.csg:2:3: 'cube' has coordinates of about 1e+200"));
}

TEST_F(Csg, FilesThatAreNoScenesAreSaidToBeWhatTheyAre) {
  place.write("scene.csg", kCube);
  place.write("scene.txt", kCube);
  EXPECT_TRUE(has(refused({".", "-o", "out.png"}, 3), ".: it is a folder"));
  EXPECT_TRUE(has(refused({"scene.txt", "-o", "out.png"}, 3), "must end in .csg, .scad, .obj"));
  // A mesh is known by its content.
  place.write("box", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
  for (const char* command : {"info", "voxelize"}) {
    EXPECT_EQ(place.run({command, "box"}).exit_code, 0) << command;
  }
  EXPECT_EQ(place.run({"csg", "box", "-o", "box.png", "--size=9,9"}).exit_code, 0);
  EXPECT_TRUE(has(refused({"-", "-o", "out.png"}, 2), "--input-format: csg, obj"));
  const RunResult info = place.run({"info", "scene.csg"});
  EXPECT_EQ(info.exit_code, 0) << info.err;
  EXPECT_TRUE(has(info.out, "volume       1000, error at most")) << info.out;
  for (const char* command : {"voxelize", "ldi", "info"}) {
    EXPECT_TRUE(has(place.run({command, "--help"}).out, "(.csg .scad)")) << command;
  }
}

TEST_F(Csg, FilesWhoseNamesAreNoWordsAreUsedByPosition) {
  put(place, "my part.stl", make_box({0, 0, 0}, {1, 1, 1}));
  put(place, "hole.stl", make_box({0, 0, 0}, {1, 1, 1}));
  const auto says = [&](const std::string& text) {
    return refused({"my part.stl", "hole.stl", "-o", "out.png", "--expr=" + text}, 2);
  };
  EXPECT_TRUE(has(says("my part - hole"), "no file is called my; by position, a is my part.stl\n"));
  EXPECT_TRUE(has(says("'my part' - hole"), "expected here; by position, a is my part.stl\n"));
  EXPECT_TRUE(has(says("hole - nothing"), "by position, a is my part.stl"));
  EXPECT_EQ(place.run({"csg", "my part.stl", "hole.stl", "--expr=a - b", "--json"}).exit_code, 0);
}

TEST_F(Csg, ChainsOfOneOperatorDoNotRepeatAnInput) {
  put(place, "a.stl", make_box({-5, -5, -5}, {5, 5, 5}));
  put(place, "b.stl", make_box({-2, -2, -10}, {2, 2, 10}));
  const std::vector<std::string> camera{"--camera=0,0,0,55,0,25,60", "--size=100,100"};
  const auto solids = [&](const std::string& text) {
    const RunResult run = place.run({"csg", "a.stl", "b.stl", "--expr=" + text, "--json", "-o",
                                     "out.png", camera[0], camera[1]});
    EXPECT_EQ(run.exit_code, 0) << text << run.err;
    return json::parse(run.out)["scene"]["solids"].get<int>();
  };
  std::string chain = "a";
  for (int i = 0; i < 60000; ++i) chain += "*a";
  EXPECT_EQ(solids(chain), 1);
  const Image cube = decode(place.read("out.png"));
  EXPECT_GT(covered(cube), 1000u);
  EXPECT_EQ(solids("a + a * (a | a)"), 3);
  EXPECT_EQ(decode(place.read("out.png")), cube);
  EXPECT_EQ(solids("a - b - b - b"), 2);
  const Image drilled = decode(place.read("out.png"));
  EXPECT_NE(drilled, cube);
  EXPECT_EQ(solids("(a + a - b) * a * a"), 3);
  EXPECT_EQ(decode(place.read("out.png")), drilled);
  EXPECT_EQ(solids("a - b + b - b"), 4);
  EXPECT_EQ(decode(place.read("out.png")), drilled);
  EXPECT_EQ(solids("a - a"), 2);  // what stands first is not what is taken away
  EXPECT_EQ(covered(decode(place.read("out.png"))), 0u);
}

TEST_F(Csg, SolidsOfThePictureOfIdsHaveDifferentNames) {
  draw(
      "color([1, 0, 0, 0.5]) cube(size = [10, 10, 10], center = false);\n"
      "multmatrix([[1, 0, 0, 20], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) {\n"
      "  cube(size = [10, 10, 10], center = false);\n}\n",
      {"--cut=y>5", "--camera=15,5,5,90,0,0,100", "--ids=ids.png", "--json", "--size=100,100"});
  std::set<std::string> names;
  const json report = json::parse(last.out);
  for (const json& entry : report["ids"]) names.insert(entry["name"].get<std::string>());
  EXPECT_EQ(names.size(), report["ids"].size()) << report["ids"];
}

TEST_F(Csg, BadFilesHaveTheirCodes) {
  place.write("bad.csg", "cube(size = [1, 1\n");
  EXPECT_TRUE(has(refused({"bad.csg", "-o", "out.png"}, 3), "bad.csg:"));
  EXPECT_TRUE(has(refused({"none.csg", "-o", "out.png"}, 3), "none.csg"));
  place.write("scene.csg", kCube);
  refused({"scene.csg", "-o", "no/such/folder/out.png"}, 4);
  refused({"scene.csg", "--ids", "no/such/folder/out.png"}, 4);
}

TEST_F(Csg, WarningsOfASceneAreErrorsUnderStrict) {
  place.write("scene.csg", "import(file = \"missing.stl\");\ncube(size = [1, 1, 1]);\n");
  const RunResult run = place.run({"csg", "scene.csg", "-o", "out.png"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_TRUE(has(run.err, "warning: ")) << run.err;
  EXPECT_TRUE(has(run.err, "missing.stl")) << run.err;
  const RunResult strict = place.run({"csg", "scene.csg", "-o", "strict.png", "--strict"});
  EXPECT_EQ(strict.exit_code, 5);
  EXPECT_TRUE(has(strict.err, "missing.stl")) << strict.err;
  EXPECT_FALSE(place.has("strict.png"));
}

TEST_F(Csg, AnEmptyPictureSaysWhy) {
  const Image nothing = draw("group();\n", {"--size=40,30"});
  EXPECT_EQ(covered(nothing), 0u);
  EXPECT_EQ(nothing.width, 40);
  EXPECT_TRUE(has(last.err, "there is no solid in the scene")) << last.err;
  draw(
      "difference() {\n  cube(size = [1, 1, 1], center = true);\n"
      "  cube(size = [2, 2, 2], center = true);\n}\n");
  EXPECT_TRUE(has(last.err, ", but its operations leave nothing")) << last.err;
  draw(kCube, {"--camera=1000,0,0,0,0,0,10"});
  EXPECT_TRUE(has(last.err, "nothing is in the camera's view")) << last.err;
  EXPECT_EQ(place.run({"csg", "scene.csg", "-o", "a.png", "--camera=1000,0,0,0,0,0,10", "--strict"})
                .exit_code,
            5);
}

TEST_F(Csg, SectionsAreCappedInABrightColour) {
  // Seen from the front (-y); y=5 takes the near half away.
  const std::vector<std::string> front{"--camera=5,5,5,90,0,0,60", "--size=60,60"};
  const Image whole = draw(kCube, front);
  for (const char* cut : {"--cut=y=5", "--cut=y>5", "--cut=0,-1,0,-5", "--cut=0,-2,0,-10"}) {
    const Image image = draw(kCube, {front[0], front[1], cut});
    const Pixel cap = image.at(30, 30);
    EXPECT_GT(cap[0], cap[2] + 40) << cut;  // orange, not grey
    EXPECT_GT(cap[0], 150) << cut;
    EXPECT_NE(image, whole);
    EXPECT_LT(covered(image), covered(whole));  // it is farther away
  }
  EXPECT_EQ(draw(kCube, {front[0], front[1], "--cut=y<5"}), whole);  // only the far half is gone
  EXPECT_EQ(draw(kCube, {front[0], front[1], "--cut=y<50"}), whole);
  draw(kCube, {front[0], front[1], "--cut=y<-1"});
  EXPECT_TRUE(has(last.err, "the picture is empty")) << last.err;
}

TEST_F(Csg, TwoSectionsTakeAQuarterAway) {
  const std::vector<std::string> above{"--camera=5,5,5,0,0,0,60", "--size=60,60"};
  const std::size_t whole = covered(draw(kCube, above));
  const std::size_t quarter =
      covered(draw(kCube, {above[0], above[1], "--cut", "x<5", "--cut", "y<5"}));
  EXPECT_NEAR(static_cast<double>(quarter) / static_cast<double>(whole), 0.25, 0.02);
}

TEST_F(Csg, GhostsAreSeenAndRenderLeavesThemOut) {
  const std::string ghost = std::string(kCube) +
                            "%multmatrix([[1, 0, 0, 20], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])"
                            " {\n  cube(size = [10, 10, 10], center = false);\n}\n";
  const std::vector<std::string> camera{"--camera=10,5,5,55,0,25,140", "--size=100,100"};
  const Image both = draw(ghost, camera);
  const Image alone = draw(kCube, camera);
  EXPECT_GT(covered(both), covered(alone) * 3 / 2);
  EXPECT_EQ(draw(ghost, {camera[0], camera[1], "--render"}), alone);
}

TEST_F(Csg, IdsAreColoursThatTheReportExplains) {
  const Image shaded =
      draw(kDrilled, {"--ids=ids.png", "--json", "--size=100,100", "--quality=draft"});
  const json report = json::parse(last.out);
  std::set<std::string> legend;
  for (const json& entry : report["ids"]) legend.insert(entry["colour"].get<std::string>());
  EXPECT_EQ(legend.size(), 2u);
  EXPECT_TRUE(has(report["ids"][0]["name"], "scene.csg:2")) << report["ids"];
  const Image ids = decode(place.read("ids.png"));
  std::set<std::string> seen;
  for (std::size_t i = 0; i < ids.pixels.size(); ++i) {
    const Pixel& p = ids.pixels[i];
    EXPECT_EQ(p == (Pixel{0, 0, 0, 255}), shaded.pixels[i] == kBackground);
    if (p == Pixel{0, 0, 0, 255}) continue;
    char text[8];
    std::snprintf(text, sizeof text, "#%02x%02x%02x", p[0], p[1], p[2]);
    seen.insert(text);
  }
  EXPECT_EQ(seen, legend);
}

TEST_F(Csg, TransparentBackgroundsAndSchemes) {
  const Image clear = draw(kCube, {"--transparent", "--size=40,40"});
  EXPECT_EQ(clear.at(0, 0)[3], 0);
  EXPECT_EQ(clear.at(20, 20)[3], 255);
  const Image night = draw(kCube, {"--colorscheme=starnight", "--size=40,40"});
  EXPECT_EQ(night.at(0, 0), (Pixel{0, 0, 0, 255}));
}

TEST_F(Csg, SamplesAndEdgesChangeOnlyWhatTheySay) {
  const Image plain = draw(kCube, {"--size=100,100", "--samples=1"});
  const Image smooth = draw(kCube, {"--size=100,100", "--samples=16"});
  const Image edges = draw(kCube, {"--size=100,100", "--samples=1", "--edges"});
  std::size_t changed = 0, dark = 0;
  for (std::size_t i = 0; i < plain.pixels.size(); ++i) {
    changed += plain.pixels[i] != smooth.pixels[i] ? 1 : 0;
    dark += plain.pixels[i] != edges.pixels[i] ? 1 : 0;
  }
  EXPECT_GT(changed, 100u);
  EXPECT_LT(changed, 1500u);
  EXPECT_GT(dark, 100u);
  EXPECT_LT(dark, 1500u);
}

TEST_F(Csg, DepthIsAnOpenExrFileOrRefused) {
  place.write("scene.csg", kCube);
  const RunResult run = place.run({"csg", "scene.csg", "--depth", "z.exr", "--size=40,40"});
  if (run.exit_code == 2) {
    EXPECT_TRUE(has(run.err, "no OpenEXR")) << run.err;
    return;
  }
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(place.read("z.exr").substr(0, 4), "\x76\x2f\x31\x01");
  EXPECT_EQ(place.run({"csg", "scene.csg", "--depth", "-"}).exit_code, 2);
}

TEST_F(Csg, MeasuresAreExactWhereAllSolidsAreClosed) {
  place.write("scene.csg", kDrilled);
  const RunResult run = place.run({"csg", "scene.csg", "--json", "--size=8,8"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json result = json::parse(run.out)["result"];
  EXPECT_EQ(result["exact"], true);
  EXPECT_TRUE(result["why_not_exact"].is_null());
  EXPECT_EQ(result["volume"], 1000 - 160);
  EXPECT_LT(result["volume_error"], 1e-3);
  EXPECT_EQ(result["area"], 600 - 2 * 16 + 4 * 40);
  EXPECT_EQ(result["centre_of_mass"], (std::array{0.0, 0.0, 0.0}));
  EXPECT_EQ(result["low"], (std::array{-5.0, -5.0, -5.0}));
  EXPECT_EQ(result["high"], (std::array{5.0, 5.0, 5.0}));
  // A box of mass m and sides a, b, c has m (b b + c c) / 12 about its axis along a.
  const double across = 1000 * 200 / 12.0 - 160 * 116 / 12.0;
  const double along = 1000 * 200 / 12.0 - 160 * 32 / 12.0;
  const double expected[] = {across, across, along, 0, 0, 0};
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_DOUBLE_EQ(result["inertia"][i].get<double>(), expected[i]) << i;
  }
  EXPECT_TRUE(has(place.run({"csg", "scene.csg"}).out, "volume           840, exact"));
}

TEST_F(Csg, MeasuresByRaysSayWhyTheyAreNotExact) {
  place.write("scene.csg", kDrilled);
  RunResult run = place.run({"csg", "scene.csg", "--json", "--size=8,8", "--measure=64"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  json result = json::parse(run.out)["result"];
  EXPECT_EQ(result["exact"], false);
  EXPECT_EQ(result["why_not_exact"], "--measure is given");
  EXPECT_EQ(result["resolution"], 64);
  EXPECT_NEAR(result["volume"].get<double>(), 840, result["volume_error"].get<double>());
  TriangleSoup open = make_box({0, 0, 0}, {10, 10, 10});
  open.triangles.pop_back();
  put(place, "open.off", open);
  run = place.run({"csg", "open.off", "--json", "--size=8,8"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  result = json::parse(run.out)["result"];
  EXPECT_EQ(result["exact"], false);
  EXPECT_TRUE(has(result["why_not_exact"].get<std::string>(), "open.off")) << result;
  EXPECT_TRUE(has(place.run({"csg", "open.off"}).out, "by rays, not exactly: "));
}

TEST_F(Csg, TheDocumentationNamesExactlyWhatJsonPrints) {
  place.write("scene.csg", std::string(kCube) + "import(file = \"missing.stl\");\n");
  const RunResult run = place.run({"csg", "scene.csg", "--json", "--ids=ids.png"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  std::set<std::string> names;
  collect(json::parse(run.out), "", names);
  EXPECT_EQ(names, documented("`strata csg`"));
}

TEST_F(Csg, ThePictureDoesNotDependOnThreads) {
  const Image one = draw(kDrilled, {"-j1", "--samples=4", "--edges"});
  EXPECT_EQ(one, draw(kDrilled, {"-j3", "--samples=4", "--edges"}));
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

TEST_F(Csg, ATurntableIsPicturesOfTurnedCameras) {
  place.write("scene.csg", kDrilled);
  const auto run = place.run({"csg", "scene.csg", "--turntable=4", "-o", "turn/", "--size=60,40",
                              "--camera=1,2,3,60,0,20,60"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err + run.out, "");
  for (int i = 0; i < 4; ++i) {
    const std::string camera = "--camera=1,2,3,60,0," + std::to_string(20 + 90 * i) + ",60";
    EXPECT_EQ(decode(place.read("turn/000" + std::to_string(i) + ".png")),
              draw(kDrilled, {"--size=60,40", camera}))
        << i;
  }
  EXPECT_FALSE(place.has("turn/0004.png"));
}

TEST_F(Csg, ATurntableKeepsTheResultInViewFromAllSides) {
  place.write("scene.csg", "cube(size = [30, 3, 8], center = false);\n");
  const auto run = place.run({"csg", "scene.csg", "--turntable=12", "-o", "turn/", "--size=90,60"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  double widest = 0;
  for (int i = 0; i < 12; ++i) {
    const Image image = decode(
        place.read(std::string("turn/00") + (i < 10 ? "0" : "") + std::to_string(i) + ".png"));
    const auto [left, top, right, bottom] = extent(image);
    EXPECT_GT(left, 0);
    EXPECT_GT(top, 0);
    EXPECT_LT(right, 90);
    EXPECT_LT(bottom, 60);
    widest = std::max({widest, (right - left) / 90.0, (bottom - top) / 60.0});
  }
  EXPECT_GT(widest, 0.8);
}

TEST_F(Csg, FilmsAreFilesOfTheirKinds) {
  place.write("scene.csg", kDrilled);
  const std::vector<std::string> film{"csg", "scene.csg", "--turntable=3", "--size=40,30", "-o"};
  const auto write = [&](const std::string& name) {
    std::vector<std::string> words = film;
    words.push_back(name);
    return place.run(words);
  };
  ASSERT_EQ(write("a.apng").exit_code, 0);
  EXPECT_EQ(count_of(place.read("a.apng"), "fcTL"), 3u);
  for (const auto& [name, head] : {std::pair("a.gif", "GIF89a"), std::pair("a.webp", "RIFF")}) {
    const auto run = write(name);
    if (run.exit_code == 2) {
      EXPECT_TRUE(has(run.err, "this build has no lib") || has(run.err, "this build has no gif"));
      EXPECT_FALSE(place.has(name));
      continue;
    }
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(place.read(name).substr(0, std::string(head).size()), head);
  }
}

TEST_F(Csg, CameraFilesPlaceTheCamera) {
  const std::string file = "target 5 5 5 # the middle\n\nrotation 70 0 15\ndistance 50\nfov 30\n";
  place.write("camera.txt", file + "projection orthographic\n");
  const Image image = draw(kCube, {"--size=60,60", "--camera-file=camera.txt", "--projection=p"});
  place.write("eye.txt", "eye 5 -45 5\ntarget 5 5 5\n");
  EXPECT_EQ(draw(kCube, {"--size=60,60", "--camera-file=eye.txt"}),
            draw(kCube, {"--size=60,60", "--camera=5,-45,5,5,5,5"}));
  place.write("same.txt", file);
  EXPECT_EQ(image, draw(kCube, {"--size=60,60", "--camera-file=same.txt"}));
  EXPECT_NE(image, draw(kCube, {"--size=60,60", "--camera-file=camera.txt"}));
  const auto wrong = [&](const std::string& text, const std::string& says) {
    place.write("camera.txt", text);
    last = place.run({"csg", "scene.csg", "-o", "no.png", "--camera-file=camera.txt"});
    EXPECT_EQ(last.exit_code, 2);
    EXPECT_TRUE(has(last.err, says)) << last.err;
    EXPECT_FALSE(place.has("no.png"));
  };
  wrong("target 1 2\n", "camera.txt:1: target needs 3 numbers, got 2");
  wrong("\ndistance x\n", "camera.txt:2: distance must be a finite number, got 'x'");
  wrong("distance -1\n", "camera.txt:1: the distance must be above 0, got -1");
  wrong("fov 180\n", "camera.txt:1: fov must be between 0 and 180 degrees, got 180");
  wrong("zoom 2\n", "camera.txt:1: 'zoom' is none of target");
  wrong("time 1\ntime 1\n", "camera.txt:2: the time 1 must be above the one before it, 1");
  wrong("eye 1 2 3\ntarget 1 2 3\n", "eye and target must differ");
  wrong("# nothing\n", "camera.txt: there is no camera in it");
  wrong("projection fisheye\n", "camera.txt:1: projection must be perspective or orthographic");
  const auto none = place.run({"csg", "scene.csg", "-o", "no.png", "--camera-file=none.txt"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_TRUE(has(none.err, "none.txt: the file cannot be opened")) << none.err;
}

TEST_F(Csg, AFilmAlongAPathGoesThroughItsCameras) {
  place.write("scene.csg", kDrilled);
  place.write("path.txt",
              "eye 40 0 10\ntarget 0 0 0\ntime 1\neye 0 40 20\ntime 3\neye -40 0 5\nfov 40\n");
  const auto run = place.run(
      {"csg", "scene.csg", "--camera-file=path.txt", "--frames=4", "-o", "path/", "--size=40,40"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(decode(place.read("path/0000.png")),
            draw(kDrilled, {"--size=40,40", "--camera=40,0,10,0,0,0"}));
  EXPECT_EQ(decode(place.read("path/0001.png")),
            draw(kDrilled, {"--size=40,40", "--camera=0,40,20,0,0,0"}));
  EXPECT_NE(place.read("path/0002.png"), place.read("path/0003.png"));
}

TEST_F(Csg, MistakesInFilmsAreNamed) {
  place.write("scene.csg", kCube);
  place.write("one.txt", "distance 50\n");
  const auto says = [&](std::vector<std::string> options) {
    options.insert(options.begin(), "scene.csg");
    return refused(options, 2);
  };
  EXPECT_TRUE(
      has(says({"--turntable=0", "-o", "a.apng"}), "--turntable must be 1 to 99999, got 0"));
  EXPECT_TRUE(has(says({"--turntable=3", "-o", "a.png"}), "written as .gif, .webp or .apng"));
  EXPECT_TRUE(has(says({"--turntable=3", "-o", "-"}), "--turntable cannot write to the stream -"));
  EXPECT_TRUE(has(says({"--turntable=3"}), "--turntable needs -o FILE.gif"));
  EXPECT_TRUE(has(says({"--turntable=3", "-o", "a.apng", "--json"}), "cannot be combined with"));
  EXPECT_TRUE(has(says({"-o", "a.gif"}), "pictures are written as .png; films"));
  EXPECT_TRUE(has(says({"-o", "a.png", "--fps=3"}), "--fps needs --turntable"));
  EXPECT_TRUE(has(says({"-o", "a.apng", "--turntable=3", "--fps=200"}),
                  "--fps must be 0.1 to 100, got 200"));
  EXPECT_TRUE(has(says({"-o", "a.gif", "--turntable=3", "--fps=60"}),
                  "--fps must be 0.1 to 50 for a .gif, got 60"));
  EXPECT_TRUE(has(says({"-o", "a.apng", "--frames=3"}), "--frames needs --camera-file"));
  EXPECT_TRUE(has(says({"-o", "a.apng", "--frames=3", "--camera-file=one.txt"}),
                  "--frames needs several cameras, and one.txt has 1"));
  EXPECT_TRUE(has(says({"-o", "a.png", "--camera-file=one.txt", "--camera=0,0,0,0,0,0,5"}),
                  "--camera and --camera-file cannot be combined"));
  EXPECT_TRUE(has(says({"-o", "one.txt", "--camera-file=one.txt"}), "one.txt"));
  EXPECT_FALSE(place.has("a.apng"));
  EXPECT_FALSE(place.has("a.gif"));
}

}  // namespace
}  // namespace strata
