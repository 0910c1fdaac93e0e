#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "strata/csg/surface/surface_image.h"
#include "strata/mesh/soup_tools.h"
#include "strata/raster/view.h"

// Lines and numbers over a picture: where they lie, and which parts of them faces hide.

namespace strata::view {

/// 1, 2 or 5 times a power of ten: the least that is not below `least`. @pre least > 0
[[nodiscard]] double round_step(double least);

/// Distances along the view axis of what a picture shows; infinity where there is nothing.
struct DepthImage {
  int width = 0, height = 0;
  std::vector<float> distance;
};
[[nodiscard]] DepthImage depth_image(const View& view, const csg::SurfaceImage& image);

/// A stretch of a line in pixels of the picture.
struct Stretch {
  glm::dvec2 from{0.0}, to{0.0};
  bool hidden = false;  ///< by a face that lies more than two pixels before it
};

/// Where a view shows a point. Empty behind the eye.
[[nodiscard]] std::optional<glm::dvec2> pixel_of(const View& view, const glm::dvec3& world);

/// Whether a face lies more than two pixels before a point.
[[nodiscard]] bool is_hidden(const View& view, const DepthImage& depth, const glm::dvec3& world);

/// What the picture has of a line, in order. @param depth  of the same view, which may be coarser;
/// without one nothing is hidden
[[nodiscard]] std::vector<Stretch> stretches(const View& view, const DepthImage& depth,
                                             const glm::dvec3& from, const glm::dvec3& to);

/// A line of the world.
struct Guide {
  glm::dvec3 from{0.0}, to{0.0};
};
/// A number that stands in the world.
struct GuideLabel {
  glm::dvec3 at{0.0};
  std::string text;
};

/// The twelve edges of a box, and its three sizes beside those of its edges that lie farthest
/// outside in the view. @pre the box is not empty
struct BoxGuide {
  std::vector<Guide> edges;
  GuideLabel sizes[3];
};
[[nodiscard]] BoxGuide box_guide(const View& view, const Bounds& box);

/// Lines of the plane z = 0 below a box and around the origin.
struct GridGuide {
  double spacing = 0;
  std::vector<Guide> lines, strong;  ///< strong: every fifth
  glm::dvec3 corner{0.0};            ///< where the spacing is written
};
/// @param pixel  world units of a pixel: lines are at least 24 pixels apart, and 160 at most
[[nodiscard]] GridGuide grid_guide(const Bounds& box, double pixel);

/// The three axes through the origin, as far as a box reaches, with a number at each step.
struct TicksGuide {
  double spacing = 0;
  Guide axes[3];
  std::vector<GuideLabel> marks[3];
};
[[nodiscard]] TicksGuide ticks_guide(const Bounds& box, double pixel);

/// A bar of a round length. @param pixel  world units of a pixel, > 0
struct ScaleBar {
  double length = 0, pixels = 0;
};
[[nodiscard]] ScaleBar scale_bar(double pixel, double most_pixels = 180);

}  // namespace strata::view
