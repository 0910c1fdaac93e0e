#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/csg/surface/surface_image.h"
#include "strata/csg/tree.h"
#include "strata/picture/backdrop.h"
#include "strata/picture/pixels.h"
#include "strata/raster/view.h"

namespace strata::csg {

using strata::Picture;
using strata::Rgba;
using strata::write_png;

/// Colours of a picture; the names and values are OpenSCAD's, but for "Neutral".
struct ColourScheme {
  std::string_view name;   ///< such as "Cornfield"
  glm::u8vec3 background;  ///< where no solid is
  glm::u8vec3 face;        ///< of solids without a colour
  glm::u8vec3 cut;         ///< of faces where a solid without a colour is cut away
  glm::u8vec3 cap = cut;   ///< of faces where a section cuts
  /// Three lights and a sky, and pictures are soft unless told otherwise: see PictureOptions.
  /// False: OpenSCAD's two lights.
  bool studio_lights = false;
};
/// What the names of solids begin with that a section cuts away: the faces that they leave are
/// caps.
inline constexpr std::string_view kSectionName = "section ";
/// Whether a solid is one of those.
[[nodiscard]] inline bool is_section(const Solid& solid) {
  return solid.name.starts_with(kSectionName);
}

/// All schemes.
[[nodiscard]] std::span<const ColourScheme> colour_schemes();
/// Null when there is none of that name (case does not matter).
[[nodiscard]] const ColourScheme* find_colour_scheme(std::string_view name);

/// The scheme of pictures for which none is chosen: "Neutral".
[[nodiscard]] const ColourScheme& default_scheme();
/// What solids without a colour have in files, which know no scheme: OpenSCAD's, "Cornfield".
[[nodiscard]] glm::vec4 plain_solid_colour();

/// A part of the tree that is also shown as a transparent ghost.
struct Ghost {
  Tree::NodeId node = Tree::kNone;           ///< the subtree to show
  glm::vec4 colour{0.7f, 0.7f, 0.7f, 0.5f};  ///< red, green, blue, alpha in [0, 1]
};
/// The colour of `%` in OpenSCAD.
inline constexpr glm::vec4 kBackgroundGhost{180 / 255.f, 180 / 255.f, 180 / 255.f, 128 / 255.f};
/// The colour of `#` in OpenSCAD.
inline constexpr glm::vec4 kHighlightGhost{255 / 255.f, 81 / 255.f, 81 / 255.f, 128 / 255.f};

/// Settings of a shaded picture.
struct PictureOptions {
  const ColourScheme* scheme = nullptr;  ///< null: default_scheme()
  /// Samples a pixel: 1, 2, 4, 8, 16, 32 or 64, on a regular grid within it.
  int samples = 1;
  std::optional<Backdrop> backdrop;  ///< what no solid covers; empty: the scheme's background
  bool edges = false;                ///< dark lines where the faces of neighbouring pixels differ
  /// Faces of a solid that meet at less than this many degrees are drawn as one curved surface; 0:
  /// as facets. Empty: 30 under studio lights, else 0.
  std::optional<double> crease;
  /// Corners and holes, which see less of their surroundings, are darker. Empty: under studio
  /// lights only. Of what is seen, with steps of one or two pixels.
  std::optional<bool> occlusion;
  /// A soft shadow on the plane that the result stands on, seen from above. A transparent backdrop
  /// gets it as alpha.
  bool ground_shadow = false;
  bool hatched_caps = true;  ///< lines on the faces of sections, under studio lights
};

class SurfaceSource;

/// Draws a tree repeatedly; keeps what does not change from frame to frame.
class Preview {
 public:
  /// Keeps the tree's meshes alive. Draws the tree's root and, transparent, the ghosts.
  /// @param relative_precision error of coordinates relative to the scene's size; faces nearer than
  /// this coincide (see Scene::relative_precision)
  /// @pre check_tree() of the root and of the ghosts
  explicit Preview(Tree tree, std::vector<Ghost> ghosts = {}, double relative_precision = 0.0,
                   const Execution& execution = {});
  ~Preview();
  /// A moved-from preview may only be destroyed or assigned to.
  Preview(Preview&&) noexcept;
  /// As the constructor.
  Preview& operator=(Preview&&) noexcept;

  /// The box around all drawn solids, which a camera should see. Cutters more than a thousand times
  /// larger than the result do not count.
  [[nodiscard]] Bounds box() const;
  /// The view of pictures: make_view() of box(). If solids surround the eye, its depths begin at
  /// the nearest face in the picture, so that small near solids are resolved in front of vast far
  /// ones. @return as make_view()
  [[nodiscard]] Result<View> view(const Camera& camera, const glm::ivec2& size,
                                  const Execution& execution = {}) const;
  /// The tree, with its solids where they were moved to.
  [[nodiscard]] const Tree& tree() const;

  /// Lets `source`, such as a GPU, find the surfaces from now on, bit-identical. Borrowed; used by
  /// the thread that draws. Null: this process's threads, which always do ghosts and light.
  void set_source(SurfaceSource* source);

  /// The visible surfaces. Valid until the next call.
  /// @return kUsage, kGeometry (coordinates too large), kCancelled
  Result<const SurfaceImage*> draw(const View& view, const Execution& execution = {});
  /// Moves a solid and redraws only the tiles it touches, in the view of the last draw().
  Result<const SurfaceImage*> move_solid(std::uint32_t solid, const glm::dmat4& world_from_mesh,
                                         const Execution& execution = {});
  /// Statistics of the last draw() or move_solid().
  [[nodiscard]] const DrawReport& report() const;

  /// The shaded picture of `camera`. @return as draw()
  Result<Picture> picture(const Camera& camera, const glm::ivec2& size,
                          const PictureOptions& options = {}, const Execution& execution = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Draws the root of a tree once. @param camera  none: OpenSCAD's direction, with all in view
/// @return kUsage (camera, size, options, a tree that check_tree() refuses), kGeometry, kLimit,
/// kCancelled
Result<Picture> picture(const Tree& tree, const std::optional<Camera>& camera = {},
                        const glm::ivec2& size = {512, 512}, const PictureOptions& options = {},
                        const Execution& execution = {});

/// Writes the distances of visible surfaces along the view axis, in world units, as an OpenEXR file
/// with one channel, Z, of 32-bit floats; infinity where no solid is visible.
/// @return kUsage in builds without OpenEXR and for "-"; kOutput naming the file
Result<void> write_depth_exr(const SurfaceImage& image, const View& view, const std::string& path);

}  // namespace strata::csg
