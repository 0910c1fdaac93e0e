#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "strata/core/result.h"
#include "strata/mesh/soup_tools.h"

namespace strata {

/// How rays leave the eye: from one point, or in parallel.
enum class Projection { kPerspective, kOrthographic };

/// The camera of a picture, in OpenSCAD's terms.
struct Camera {
  Projection projection = Projection::kPerspective;  ///< perspective if not said otherwise
  glm::dvec3 target{0.0};                            ///< world point in the middle of the picture
  glm::dvec3 rotation{55.0, 0.0, 25.0};  ///< $vpr: degrees; 0, 0, 0 looks down from +z, +y up
  double distance = 140.0;               ///< of the eye from the target, > 0
  double field_of_view = 22.5;           ///< degrees, of the picture's height; in (0, 180)
};

/// A camera at `eye` that looks at `centre`, +z up as far as possible.
[[nodiscard]] Camera look_at(const glm::dvec3& eye, const glm::dvec3& centre);

/// Moves the target to the middle of `box` (--auto-center).
void centre_camera(Camera& camera, const Bounds& box);
/// Sets the distance so that the ball around `box` and the target just fits (--view-all).
/// @param aspect the picture's width / height. OpenSCAD considers the height alone, so that its
/// narrow pictures lose their sides
void fit_camera(Camera& camera, const Bounds& box, double aspect = 1.0);

/// Moves the target and the distance so that `box` fills the picture up to a margin of 1/24 of its
/// sides. The rotation stays. Nothing happens for an empty box.
/// @param aspect the picture's width / height
void frame_camera(Camera& camera, const Bounds& box, double aspect = 1.0);

/// Eye space: x right, y up, the camera looks along -z.
[[nodiscard]] glm::dmat4 eye_from_world(const Camera& camera);

/// How world space becomes the image lattice: pixel (u, v) of `size`, v downwards, depth away from
/// the eye, spread over the 24 bits of a crossing.
struct View {
  glm::ivec2 size{0};  ///< pixels
  /// (u w, v w, depth w, w), w = 1 for an orthographic view and the distance along the view axis
  /// for a perspective one.
  glm::dmat4 image_from_world{1.0};
  glm::dmat4 eye_from_world{1.0};  ///< as eye_from_world() of the camera
  bool perspective = true;         ///< false: orthographic
  /// Distance along the view axis at depth 0, in world units. Depth is linear in the distance for
  /// an orthographic view, in its reciprocal for a perspective one. Parts nearer than `near` are
  /// cut off there; the state of the ray at `near` is kept.
  double near = 1.0;
  double far = 2.0;  ///< distance along the view axis at the largest depth

  /// The box that the view was made for reaches behind or beside the eye, or nearer than `near`.
  bool cut_short = false;

  /// Spreads the depths of a perspective view from one distance to another, both above 0.
  void set_distances(double nearest, double farthest);
  /// Distance along the view axis of a depth.
  [[nodiscard]] double distance(double depth) const;
};

/// Depth steps of a picture: 24 bits.
inline constexpr std::uint32_t kPictureDepthLimit = std::uint32_t{1} << 24;
/// Largest side of a picture, samples included.
inline constexpr int kMaxPictureSide = 65536;

/// The view of `camera` on what lies in `box`. Where a perspective one is cut short, its depths
/// begin at 1/1024 of their end: Preview::view() knows better. Solids may be larger. @return kUsage
/// when the size or camera is out of range
Result<View> make_view(const Camera& camera, const glm::ivec2& size, const Bounds& box);

/// The part of a view that begins at row `first` of the picture and has `rows` rows, each pixel
/// `across` x `down` samples on a regular grid.
[[nodiscard]] View band_of(const View& view, int first, int rows, int across, int down);

/// How a pixel is divided into samples: `across` x `down`, as square as can be.
struct SampleGrid {
  int across = 1;  ///< samples in a row
  int down = 1;    ///< samples in a column
};
/// @return kUsage unless it is a number of samples a pixel: 1, 2, 4, 8, 16, 32 or 64
Result<void> check_samples(int samples);
/// @pre check_samples(samples)
[[nodiscard]] SampleGrid sample_grid(int samples);

/// How bright a flat face is, in [0, 1]: two directional lights of the eye, and what comes from
/// everywhere. @param normal  of the face, towards the side that is seen, in eye space; its length
/// does not matter
[[nodiscard]] float eye_light(const glm::dvec3& normal);

}  // namespace strata
