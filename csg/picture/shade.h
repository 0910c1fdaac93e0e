#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "csg/geometry.h"
#include "strata/core/execution.h"
#include "strata/csg/picture/picture.h"

// From visible surfaces to colours. Private to csg/.

namespace strata::csg {

/// Light on a flat face: two directional lights of the eye, and what comes from everywhere.
class Shader {
 public:
  Shader(const Tree& tree, const Geometry& geometry, const View& view, const ColourScheme& scheme);

  /// How bright the face is, in [0, 1]; it is seen from its other side at an exit.
  [[nodiscard]] float light(std::uint32_t solid, std::uint32_t triangle, bool exit) const;
  /// The colour of a face before light.
  [[nodiscard]] glm::vec4 base(std::uint32_t solid, bool exit) const;
  /// Whether two faces, [exit:1 | triangle:31] of a solid, are parts of one plane seen from the
  /// same side.
  [[nodiscard]] bool same_plane(std::uint32_t solid_a, std::uint32_t face_a, std::uint32_t solid_b,
                                std::uint32_t face_b) const;

 private:
  /// In world space, not of length 1.
  [[nodiscard]] glm::dvec3 across(std::uint32_t solid, std::uint32_t triangle) const;

  const Tree* tree_;
  const Geometry* geometry_;
  glm::dmat3 eye_from_world_;
  glm::vec4 face_, cut_;
  double size_;  ///< of the scene, for what counts as one plane
};

/// To 8 bits a channel, rounded.
[[nodiscard]] inline Rgba to_bytes(const glm::vec4& colour) {
  return Rgba(glm::clamp(colour, 0.0f, 1.0f) * 255.0f + 0.5f);
}

/// The colours of a surface image, alpha 255 where something is seen and `background` elsewhere.
/// `colours` has as many elements as the image. Gives how many of them show something.
std::uint64_t shade(const SurfaceImage& image, const Shader& shader, Rgba background,
                    const Execution& execution, std::span<Rgba> colours);

/// The backdrop of some rows of a picture.
struct Ground {
  Backdrop backdrop;
  int first = 0;   ///< the picture's row that is row 0 here
  int height = 1;  ///< rows of the picture
  [[nodiscard]] Rgba at(int row) const { return backdrop.at(first + row, height); }
};

/// The same for the pixels `rect` of an image `width` pixels wide; `tile` begins there.
std::uint64_t shade_tile(const SurfaceImage& tile, const PixelRect& rect, const Shader& shader,
                         const Ground& ground, int width, std::span<Rgba> colours);

/// Darkens the colours where the faces of neighbours, `step_u` and `step_v` samples apart, differ.
void draw_edges(const SurfaceImage& image, const Shader& shader, int step_u, int step_v,
                const Execution& execution, std::span<Rgba> colours);

/// The mean of across x down samples for each pixel of rows `width` pixels wide, as average_row().
/// Gives how many pixels show something.
std::uint64_t average(std::span<const Rgba> samples, int across, int down, const Ground& ground,
                      const Execution& execution, int width, std::span<Rgba> pixels);

}  // namespace strata::csg
