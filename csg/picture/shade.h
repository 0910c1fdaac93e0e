#pragma once

#include <array>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <span>
#include <vector>

#include "csg/geometry.h"
#include "csg/picture/curved_colours.h"
#include "csg/picture/solid_normals.h"
#include "csg/picture/view_openness.h"
#include "csg/surface/tile_surface.h"
#include "picture/studio_lights.h"
#include "strata/core/execution.h"
#include "strata/csg/picture/picture.h"

// From visible surfaces to colours. Private to csg/.

namespace strata::csg {

/// What a picture adds to colours and lights. Null, false: nothing.
struct ShadeLook {
  const SolidNormals* normals = nullptr;   ///< of curved surfaces
  const ViewOpenness* openness = nullptr;  ///< of the picture
  bool hatched_caps = false;               ///< caps have lines
};

/// Light on faces, by the lights of the scheme.
class Shader {
 public:
  /// @param view  of the whole picture, one sample a pixel. Keeps references to all but the scheme.
  Shader(const Tree& tree, const Geometry& geometry, const View& view, const ColourScheme& scheme,
         const ShadeLook& look = {});

  /// The colour of a flat face in its light; it is seen from its other side at an exit.
  [[nodiscard]] glm::vec3 lit(std::uint32_t solid, std::uint32_t triangle, bool exit,
                              const glm::vec3& base) const;
  /// The colour of a face before light.
  [[nodiscard]] glm::vec4 base(std::uint32_t solid, bool exit) const;
  /// Whether two faces, [exit:1 | triangle:31] of a solid, are parts of one plane seen from the
  /// same side.
  [[nodiscard]] bool same_plane(std::uint32_t solid_a, std::uint32_t face_a, std::uint32_t solid_b,
                                std::uint32_t face_b) const;

  /// A face of the picture, prepared for its pixels.
  struct Face {
    bool uniform = true;  ///< `colour` is that of all its pixels
    bool open = true;     ///< nothing can be in the way
    bool curved = false, hatched = false;
    Rgba colour{0};        ///< where all is open
    glm::vec3 base{0.0f};  ///< before light
    Lit light;             ///< where it is flat
    SeenPlane plane;
    CurvedFace corners;  ///< where it is curved
  };
  /// @param face  [exit:1 | triangle:31]
  [[nodiscard]] Face face(std::uint32_t solid, std::uint32_t face) const;
  /// The colours of a face at pixels of the picture from (u, v) on.
  void colours(const Face& face, int u, int v, std::span<Rgba> pixels) const;
  /// Whether `count` pixels of a face from (u, v) on have face.colour.
  [[nodiscard]] bool uniform_along(const Face& face, int u, int v, int count) const {
    return face.uniform ||
           (!face.curved && !face.hatched && look_.openness->open_along(u, v, count));
  }

 private:
  /// In world space, not of length 1.
  [[nodiscard]] glm::dvec3 across(std::uint32_t solid, std::uint32_t triangle) const {
    return geometry_->parts()[solid].across(triangle);
  }
  /// @param normal  in eye space, of length 1
  [[nodiscard]] Lit light_on(const glm::dvec3& normal) const;
  [[nodiscard]] glm::vec3 in_light(const glm::vec3& base, const Lit& light, float open) const;
  /// @param open  at the pixel
  [[nodiscard]] Rgba colour(const Face& face, int u, int v, float open) const;
  void set_corners(Face& face, std::uint32_t solid, std::uint32_t triangle, bool exit) const;

  const Tree* tree_;
  const Geometry* geometry_;
  glm::dmat4 image_from_world_, eye_from_world_;
  glm::vec4 face_, cut_, cap_;
  bool studio_;
  StudioLights lights_;
  ShadeLook look_;
  double size_;  ///< of the scene, for what counts as one plane
};

/// To 8 bits a channel, rounded.
[[nodiscard]] inline Rgba to_bytes(const glm::vec4& colour) {
  return Rgba(glm::clamp(colour, 0.0f, 1.0f) * 255.0f + 0.5f);
}

/// The backdrop of some rows of a picture.
struct Ground {
  Backdrop backdrop;
  int first = 0;   ///< the picture's row that is row 0 here
  int height = 1;  ///< rows of the picture
  [[nodiscard]] Rgba at(int row) const { return backdrop.at(first + row, height); }
};

/// The samples of rows of pixels: `across` x `down` each.
struct SampleRows {
  int across = 1, down = 1;
  Ground ground;
};

/// The colours of the samples of a surface image: alpha 255 where something is seen, else 0.
/// `colours` has as many elements as the image.
void shade(const SurfaceImage& image, const SampleRows& rows, const Shader& shader,
           const Execution& execution, std::span<Rgba> colours);

class SampleShader;

/// The same for a picture whose samples are found tile by tile; averages them at once, as average()
/// does. A thread has one of its own, which keeps faces from tile to tile.
class TileShader {
 public:
  /// @param pixels  `width` wide, from the first row of rows.ground on; borrowed as the shader is
  TileShader(const SampleRows& rows, const Shader& shader, int width, std::span<Rgba> pixels);
  TileShader(TileShader&&) noexcept;
  ~TileShader();

  /// Colours the pixels of the samples `rect`; `tile` begins there. @param faces  of its areas:
  /// they come before what `tile` has there @pre an area is whole pixels wide and high
  void shade(const SurfaceImage& tile, const AreaFaces& faces, const PixelRect& rect);
  /// The same where nothing is seen.
  void leave(const PixelRect& rect);
  /// Whether faces, [exit:1 | triangle:31] with `exit`, have the same colour at all of their
  /// pixels. @pre `triangles` is not empty
  [[nodiscard]] bool alike(std::uint32_t solid, std::span<const std::uint32_t> triangles,
                           std::uint32_t exit);
  /// The same in two steps, between which others may blend into the colours of the samples: those
  /// of `rect`, kTileSide a row, as csg::shade() gives them. @param tile  null: nothing is seen
  [[nodiscard]] Rgba* samples(const SurfaceImage* tile, const PixelRect& rect);
  void average_samples(const PixelRect& rect);
  /// How many pixels show something.
  [[nodiscard]] std::uint64_t covered() const { return covered_; }

 private:
  [[nodiscard]] Rgba* row_of(int u, int v) const {
    return pixels_.data() + static_cast<std::size_t>(v) * width_ + static_cast<std::size_t>(u);
  }
  void shade_row(const SurfaceImage& tile, const AreaFaces::Face* faces, std::size_t begin, int u,
                 int v, std::size_t count);
  void shade_areas(const SurfaceImage& tile, const AreaFaces& faces, const PixelRect& rect);
  bool shade_block(const SurfaceImage& tile, std::size_t begin, int u, int v,
                   std::span<Rgba> colours);
  void shade_runs(const SurfaceImage& tile, std::size_t begin, int u, int v, Rgba background,
                  std::span<Rgba> colours);
  Rgba mixed_pixel(const SurfaceImage& tile, std::size_t begin, int u, int v, Rgba background);

  SampleRows rows_;
  std::size_t width_;
  std::span<Rgba> pixels_;
  std::unique_ptr<SampleShader> samples_;
  std::array<Rgba, 64> colours_;  ///< of the samples of a pixel
  std::vector<Rgba> tile_;        ///< of the samples of a tile
  std::uint64_t covered_ = 0;
};

/// Darkens the colours where the faces of neighbours, `step_u` and `step_v` samples apart, differ.
void draw_edges(const SurfaceImage& image, const Shader& shader, int step_u, int step_v,
                const Execution& execution, std::span<Rgba> colours);

/// The mean of across x down samples for each pixel of rows `width` pixels wide, as average_row().
/// Gives how many pixels show something.
std::uint64_t average(std::span<const Rgba> samples, int across, int down, const Ground& ground,
                      const Execution& execution, int width, std::span<Rgba> pixels);

}  // namespace strata::csg
