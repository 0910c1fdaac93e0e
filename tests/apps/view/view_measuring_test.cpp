// What scripts measure in the window, under Xvfb, on shapes whose numbers are known.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "apps/view/measure/guides.h"
#include "tests/apps/view/window_fixture.h"

namespace strata::testkit {
namespace {

constexpr int kWidth = 400, kHeight = 300;

/// A camera in a script, and where it shows points.
class Place {
 public:
  Place(const glm::dvec3& target, const glm::dvec3& rotation, double distance, bool perspective) {
    camera_.target = target;
    camera_.rotation = rotation;
    camera_.distance = distance;
    camera_.projection = perspective ? Projection::kPerspective : Projection::kOrthographic;
  }
  [[nodiscard]] std::string script() const {
    const auto& t = camera_.target;
    const auto& r = camera_.rotation;
    return fmt::format("projection {}\ncamera {},{},{},{},{},{},{}\n",
                       camera_.projection == Projection::kPerspective ? "p" : "o", t.x, t.y, t.z,
                       r.x, r.y, r.z, camera_.distance);
  }
  /// The pixel of a point, as words of a command.
  [[nodiscard]] std::string at(const glm::dvec3& world) const {
    const View view =
        *make_view(camera_, {kWidth, kHeight}, {camera_.target - 50.0, camera_.target + 50.0});
    const glm::dvec2 pixel = view::pixel_of(view, world).value_or(glm::dvec2(-1));
    EXPECT_GE(pixel.x, 0);
    return fmt::format(" {} {}", static_cast<int>(pixel.x), static_cast<int>(pixel.y));
  }

 private:
  Camera camera_;
};

class Measuring : public Window {
 protected:
  /// What the script's commands print.
  std::string says(const std::string& scene, const std::string& script) {
    place_.write("part.csg", scene);
    const RunResult run = view(script + "quit\n", {"--no-panels", "--size", "400,300"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.out;
  }
};

#define EXPECT_SAYS(text, words) EXPECT_NE((text).find(words), std::string::npos) << (text)

TEST_F(Measuring, DistancesOfABoxAreThoseOfItsCorners) {
  for (const bool perspective : {false, true}) {
    const Place place({5, 10, 15}, {60, 0, 25}, 120, perspective);
    const std::string said =
        says("cube(size = [10, 20, 30]);\n",
             place.script() + "distance" + place.at({0.3, 0.1, 29.9}) + place.at({9.8, 0, 0.3}) +
                 "\ndistance" + place.at({0.2, 0.2, 30}) + place.at({9.8, 19.8, 30}) +
                 "\ndistance 1 1" + place.at({0.2, 0.2, 30}) + "\n");
    EXPECT_SAYS(said, ": 31.6228, dx 10 dy 0 dz -30, from vertex 0 0 30 to vertex 10 0 0\n");
    EXPECT_SAYS(said, ": 22.3607, dx 10 dy 20 dz 0, from vertex 0 0 30 to vertex 10 20 30\n");
    EXPECT_SAYS(said, ": nothing at 1 1\n");
  }
}

TEST_F(Measuring, ACylinderHasTheRadiusOfItsVerticesAlsoBesideASection) {
  const Place place({0, 0, 5}, {60, 0, 20}, 60, true);
  const std::string said =
      says("cylinder($fn = 64, h = 10, r1 = 4, r2 = 4);\n",
           place.script() + "radius" + place.at({0.3, -4, 5}) + "\nradius" + place.at({1, 1, 10}) +
               "\nsection x>0\nradius" + place.at({1, -3.87, 5}) + "\nsection off\nradius 2 2\n");
  EXPECT_SAYS(said, ": 4, diameter 8, cylinder along 0 0 1 through 0 0 5, 10 long\n");
  EXPECT_SAYS(said, ": 4, diameter 8, circle around 0 0 10, axis 0 0 1\n");
  EXPECT_NE(said.find("cylinder along"), said.rfind("cylinder along")) << said;
  EXPECT_SAYS(said, "radius 2 2: nothing at 2 2\n");
  EXPECT_SAYS(says("cube(size = [8, 8, 8], center = true);\n", "view front\nradius 200 150\n"),
              "no cylinder here: the face is flat\n");
}

TEST_F(Measuring, AWedgeHasItsAngle) {
  // From between the two sides that meet at the origin.
  const Place place({2, 1, 5}, {90, 0, 285}, 60, true);
  const std::string said = says(
      "linear_extrude(height = 10) { polygon(points = [[0, 0], [10, 0], [8.66025403784439, 5]]); "
      "}\n",
      place.script() + "angle" + place.at({1, 0, 5}) + place.at({0.866, 0.5, 5}) + "\n");
  EXPECT_SAYS(said, ": 30 degrees between the faces, 150 between their normals\n");
}

TEST_F(Measuring, AWallSeenAtASlantIsAsThickAsItIsAlsoInTheMapAndOnACap) {
  const std::string plate = "cube(size = [40, 40, 2]);\n";
  const Place flat({20, 20, 1}, {55, 0, 25}, 150, false), deep({20, 20, 1}, {55, 0, 25}, 150, true);
  const std::string said =
      says(plate, flat.script() + "thickness" + flat.at({20, 21, 2}) + "\n" + deep.script() +
                      "thickness" + deep.at({20, 21, 2}) + "\nheat wall\npick" +
                      deep.at({20, 21, 2}) + "\nheat off\nsection y>20\nthickness" +
                      deep.at({20, 20, 1}) + "\nthickness" + deep.at({20, 30, 2}) + "\nbox on\n");
  const std::string slant = fmt::format("{:.6g}", 2 / std::cos(55 * std::acos(-1.0) / 180));
  EXPECT_SAYS(said, ": 2 along the normal, " + slant + " along the ray\n");
  EXPECT_SAYS(said, ", thickness 2\n");
  EXPECT_SAYS(said, ": 20 along the normal, ");
  std::size_t twos = 0;
  for (std::size_t at = 0; (at = said.find(": 2 along the normal", at)) != std::string::npos;
       ++at) {
    ++twos;
  }
  EXPECT_EQ(twos, 3u) << said;
  EXPECT_SAYS(said, "box: 40 x 20 x 2, from 0 20 0 to 40 40 2\n");
}

TEST_F(Measuring, ASolidHasItsOwnSizeAndGuidesSayTheirs) {
  const Place place({0, 0, 0}, {0, 0, 0}, 100, false);
  const std::string said = says(
      "difference() { cube(size = [20, 20, 6], center = true);\n"
      "cube(size = [4, 4, 10], center = true); }\n",
      place.script() + "size" + place.at({8, 8, 3}) +
          "\nscale-bar on\ngrid on\nticks on\nbox on\npicture plain.png\n"
          "screenshot guides.png\nbox off\ngrid off\nticks off\nscale-bar off\nclear\naxes off\n"
          "screenshot none.png\n");
  EXPECT_SAYS(said, ": 20 x 20 x 6, volume 2400, area 1280\n");
  EXPECT_SAYS(said, "box: 20 x 20 x 6, from -10 -10 -3 to 10 10 3\n");
  // 300 pixels are 2 * 100 * tan(11.25 degrees).
  EXPECT_SAYS(said, "scale-bar: 20, 150.8 pixels\n");
  EXPECT_SAYS(said, "grid: spacing 5\n");
  EXPECT_SAYS(said, "ticks: spacing 10\n");
  const Image plain = image_of(place_, "plain.png");
  EXPECT_EQ(different(plain, image_of(place_, "none.png"), kWidth, kHeight), 0);
  EXPECT_GT(different(plain, image_of(place_, "guides.png"), kWidth, kHeight), 1500);
}

TEST_F(Measuring, ToolsAreTakenUpByKeysAndPutAwayByEscape) {
  const std::string said =
      says("cube(size = [10, 20, 30]);\n",
           "axes off\nview top\nscreenshot before.png\nkey m\nclick 200 150\nclick 210 150\n"
           "screenshot ruler.png\nkey escape\nkey escape\nscreenshot after.png\n");
  const Image before = image_of(place_, "before.png");
  EXPECT_GT(different(before, image_of(place_, "ruler.png"), kWidth, kHeight), 300);
  EXPECT_EQ(different(before, image_of(place_, "after.png"), kWidth, kHeight), 0);
  EXPECT_EQ(said, "");
}

TEST_F(Measuring, SlicesAreExported) {
  EXPECT_SAYS(says("cube(size = [10, 20, 30]);\n", "export slices/ 30\n"),
              "export slices/: 10 x 20 x 30 voxels, 6000 solid\n");
  EXPECT_TRUE(place_.has("slices/slice_00029.png"));
}

}  // namespace
}  // namespace strata::testkit
