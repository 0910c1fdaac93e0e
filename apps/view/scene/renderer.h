#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/measure/guides.h"
#include "apps/view/measure/probe.h"
#include "apps/view/measure/value_range.h"
#include "apps/view/scene/document.h"
#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/picture/picture.h"
#include "strata/transparency/media/media.h"

// The seam between the window and what draws its pictures.

namespace strata::view {

enum class Heat : std::uint8_t {
  kOff,
  kThickness,  ///< of the material behind the visible surface, along the ray
  kWall,       ///< of the same, along the inward normal of the surface
  kDepth,      ///< depth complexity: how many crossings the ray has with all solids
  kError       ///< how much a picture that is seen through differs from the exact one
};

/// How a scene is seen through.
struct SeenThrough {
  float opacity = 0.5f;                  ///< of what is opaque by its colour
  std::string technique = "count-scan";  ///< of the picture at rest, as `strata oit` has it
  bool errors = false;                   ///< at rest, show Heat::kError instead
  /// At rest, light through these media inside the solids instead; null: none.
  std::shared_ptr<const transparency::MediaSettings> media = {};
  friend bool operator==(const SeenThrough&, const SeenThrough&) = default;
};
/// The technique while the picture moves: one pass, no lists.
inline constexpr const char* kMovingTechnique = "weighted-blended";

/// One picture that is wanted.
struct FrameRequest {
  std::uint64_t number = 0;  ///< counts up
  std::shared_ptr<const Arrangement> what;
  Camera camera;
  glm::ivec2 size{1};
  csg::PictureOptions look;
  Heat heat = Heat::kOff;
  std::optional<SeenThrough> see_through;  ///< unless there is a heat map
  std::optional<glm::dvec2> heat_range;    ///< of a thickness; none: from its values
  bool guides = false;                     ///< the frame's depth and box are wanted
  std::optional<ProbeWish> probe;          ///< what a pick measures
  bool moving = false;                     ///< a whole picture of this request follows
};

/// What the colours of a heat map stand for.
struct HeatScale {
  Heat heat = Heat::kOff;
  double low = 0, high = 0;           ///< values of the first and the last colour
  bool below = false, above = false;  ///< there are values outside
};

/// One picture that was drawn.
struct Frame {
  std::uint64_t number = 0;  ///< of the request
  csg::Picture picture;
  Camera camera;
  glm::ivec2 wanted{1};  ///< the size that was asked for
  int divisor = 1;       ///< 1: whole; n: a pixel stands for n x n
  int samples = 1;       ///< a pixel
  bool last = true;      ///< no other picture of this request follows
  std::string drawn_by;  ///< the CPU or a GPU, and why not something better
  csg::DrawReport report;
  HeatScale scale;
  DepthImage depth;                ///< of the size of the picture; empty unless wanted
  Bounds box;                      ///< around the result that is shown; empty unless wanted
  std::uint64_t longest_list = 0;  ///< heat maps only
  double prepare_ms = 0;           ///< of the tree, when it changed
  double draw_ms = 0;
};

/// What lies below a pixel.
struct Picked {
  glm::ivec2 pixel{0};
  bool hit = false;
  std::uint32_t solid = 0, triangle = 0;  ///< of the arrangement's tree; of the solid's mesh
  bool cut = false;                       ///< a face that a subtracted solid or a section leaves
  glm::dvec3 where{0};                    ///< world space
  double distance = 0;                    ///< from the eye, along the view axis
  std::optional<double> thickness;        ///< what the heat map has here, if it has one
  std::optional<Probe> probe;             ///< what was measured, if it was wanted
  std::string what;                       ///< of voxels: says what it is, without the place
};

/// Draws pictures. One thread at a time.
class Renderer {
 public:
  virtual ~Renderer() = default;
  /// @return as csg::Preview::picture()
  virtual Result<Frame> draw(const FrameRequest& request, const Execution& execution) = 0;
  /// The opaque surface below a pixel.
  virtual Result<Picked> pick(const FrameRequest& request, const glm::ivec2& pixel,
                              const Execution& execution) = 0;
};

/// Draws with csg::Preview; its pictures are those of `strata csg`. With a GPU (`backend`) surfaces
/// are found there, in a context of the drawing thread's own; what the GPU cannot do or fails at is
/// the CPU's work. Heat maps always are.
[[nodiscard]] std::unique_ptr<Renderer> make_renderer(apps::Backend backend = apps::Backend::kCpu);

}  // namespace strata::view
