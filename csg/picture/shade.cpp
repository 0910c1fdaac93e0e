#include "csg/picture/shade.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <type_traits>

#include "picture/average.h"

namespace strata::csg {
namespace {

constexpr int kRowsAtOnce = 16;
/// What is left of a colour on an edge.
constexpr float kEdgeLight = 0.2f;
/// Lines of a hatch: pixels from one to the next, half the width of one, what is left of a colour.
constexpr float kHatchStep = 7.0f, kHatchHalf = 0.75f, kHatchLight = 0.80f;

/// Calls body(first row, end row) for bands of an image, on all threads.
template <class Body>
void for_each_band(int height, const Execution& execution, Body&& body) {
  parallel_for(execution, static_cast<std::size_t>((height + kRowsAtOnce - 1) / kRowsAtOnce),
               [&](std::size_t band, int) {
                 const int first = static_cast<int>(band) * kRowsAtOnce;
                 body(first, std::min(height, first + kRowsAtOnce));
               });
}

/// What is left of the colour of a hatched face at a pixel: lines at 45 degrees, with soft borders.
float hatch(int u, int v) {
  const float at = static_cast<float>(u + v) / kHatchStep;
  const float from_line = std::abs(at - std::floor(at + 0.5f)) * kHatchStep * 0.70710678f;
  const float line = std::clamp(kHatchHalf + 0.5f - from_line, 0.0f, 1.0f);
  return 1.0f - (1.0f - kHatchLight) * line;
}

}  // namespace

Shader::Shader(const Tree& tree, const Geometry& geometry, const View& view,
               const ColourScheme& scheme, const ShadeLook& look)
    : tree_(&tree),
      geometry_(&geometry),
      image_from_world_(view.image_from_world),
      eye_from_world_(view.eye_from_world),
      face_(glm::vec3(scheme.face) / 255.0f, 1.0f),
      cut_(glm::vec3(scheme.cut) / 255.0f, 1.0f),
      cap_(glm::vec3(scheme.cap) / 255.0f, 1.0f),
      studio_(scheme.studio_lights),
      lights_(glm::vec3(view.eye_from_world[2])),
      look_(look),
      size_(geometry.box().empty() ? 0.0 : glm::length(geometry.box().high - geometry.box().low)) {}

Lit Shader::light_on(const glm::dvec3& normal) const {
  if (studio_) return lights_.on(glm::vec3(normal));
  return {0.0f, eye_light(normal), 0.0f};
}

glm::vec3 Shader::in_light(const glm::vec3& base, const Lit& light, float open) const {
  if (studio_) return shaded(base, light, open);
  return base * (light.ambient * open);
}

glm::vec3 Shader::lit(std::uint32_t solid, std::uint32_t triangle, bool exit,
                      const glm::vec3& base) const {
  const glm::dvec3 in_eye = glm::dmat3(eye_from_world_) * across(solid, triangle);
  const double length = studio_ ? glm::length(in_eye) : 1.0;
  if (!(length > 0)) return base;
  return in_light(base, light_on((exit ? -in_eye : in_eye) / length), 1.0f);
}

glm::vec4 Shader::base(std::uint32_t solid, bool exit) const {
  const Solid& of = tree_->solids()[solid];
  return colour_or(of.colour, !exit ? face_ : is_section(of) ? cap_ : cut_);
}

void Shader::set_corners(Face& face, std::uint32_t solid, std::uint32_t triangle, bool exit) const {
  const CornerNormals* normals = look_.normals != nullptr ? look_.normals->of(solid) : nullptr;
  if (normals == nullptr || normals->flat(triangle)) return;
  face.curved = true;
  const Geometry::Part& part = geometry_->parts()[solid];
  std::array<glm::dvec3, 3> corners;
  for (int c = 0; c < 3; ++c) {
    const auto at = static_cast<std::size_t>(c);
    const glm::dvec3& p = part.positions[part.triangles[triangle][c]];
    const glm::dvec4 h = image_from_world_ * glm::dvec4(p, 1.0);
    corners[at] = {h.x, h.y, h.w};
    const glm::dvec3 normal = glm::dmat3(eye_from_world_) * normals->at(triangle, c);
    face.corners.normals[at] = exit ? -normal : normal;
  }
  // Homogeneous coordinates of the picture: shares are linear, and right in perspective (M. Olano
  // and T. Greer, "Triangle scan conversion using 2D homogeneous coordinates", 1997).
  const double area = glm::dot(corners[0], glm::cross(corners[1], corners[2]));
  for (std::size_t c = 0; c < 3; ++c) {
    face.corners.shares[c] =
        glm::cross(corners[(c + 1) % 3], corners[(c + 2) % 3]) * (area < 0 ? -1.0 : 1.0);
  }
}

Shader::Face Shader::face(std::uint32_t solid, std::uint32_t tagged) const {
  Face face;
  const bool exit = (tagged & SurfaceImage::kExit) != 0;
  const std::uint32_t triangle = tagged & ~SurfaceImage::kExit;
  face.base = glm::vec3(base(solid, exit));
  if (studio_ && is_section(tree_->solids()[solid])) {
    face.hatched = look_.hatched_caps;
    face.uniform = !face.hatched;
    face.colour = to_bytes(glm::vec4(face.base, 1.0f));
    return face;
  }
  glm::dvec3 normal = glm::dmat3(eye_from_world_) * across(solid, triangle);
  if (exit) normal = -normal;
  const bool openness = look_.openness != nullptr && !look_.openness->all_open();
  if (studio_ || openness || look_.normals != nullptr) {
    const double length = glm::length(normal);
    normal = length > 0 ? normal / length : glm::dvec3(0, 0, 1);
    set_corners(face, solid, triangle, exit);
  }
  face.light = light_on(normal);
  face.colour = to_bytes(glm::vec4(in_light(face.base, face.light, 1.0f), 1.0f));
  if (openness) {
    const Geometry::Part& part = geometry_->parts()[solid];
    const glm::dvec4 corner(part.positions[part.triangles[triangle].x], 1.0);
    face.plane = look_.openness->plane(normal, glm::dvec3(eye_from_world_ * corner));
    face.open = false;
  }
  face.uniform = face.open && !face.curved;
  return face;
}

void Shader::colours(const Face& face, int u, int v, std::span<Rgba> pixels) const {
  std::array<float, kCurvedPixels> open;
  open.fill(1.0f);
  while (!pixels.empty()) {
    const std::size_t count = std::min(open.size(), pixels.size());
    if (!face.open) look_.openness->along(u, v, face.plane, std::span(open).first(count));
    constexpr std::size_t kFew = 3;  // a vector costs as much as these
    if (!face.curved || !studio_ || count <= kFew ||
        !curved_colours(face.corners, face.base, lights_, u, v, open, pixels.first(count))) {
      for (std::size_t i = 0; i < count; ++i) {
        pixels[i] = colour(face, u + static_cast<int>(i), v, open[i]);
      }
    }
    u += static_cast<int>(count);
    pixels = pixels.subspan(count);
  }
}

Rgba Shader::colour(const Face& face, int u, int v, float open) const {
  if (face.hatched) return to_bytes(glm::vec4(face.base * hatch(u, v), 1.0f));
  if (!face.curved) {
    if (open == 1.0f) return face.colour;
    return to_bytes(glm::vec4(in_light(face.base, face.light, open), 1.0f));
  }
  // Where the pixel's centre is outside of the triangle, the nearest point of it counts.
  const glm::dvec3 at(u + 0.5, v + 0.5, 1.0);
  glm::dvec3 normal(0.0);
  for (std::size_t c = 0; c < 3; ++c) {
    normal += std::max(0.0, glm::dot(face.corners.shares[c], at)) * face.corners.normals[c];
  }
  const double length = glm::length(normal);
  const Lit light = length > 0 ? light_on(normal / length) : face.light;
  return to_bytes(glm::vec4(in_light(face.base, light, open), 1.0f));
}

bool Shader::same_plane(std::uint32_t solid_a, std::uint32_t face_a, std::uint32_t solid_b,
                        std::uint32_t face_b) const {
  const std::uint32_t triangle_a = face_a & ~SurfaceImage::kExit;
  const std::uint32_t triangle_b = face_b & ~SurfaceImage::kExit;
  glm::dvec3 a = across(solid_a, triangle_a), b = across(solid_b, triangle_b);
  const double length_a = glm::length(a), length_b = glm::length(b);
  if (!(length_a > 0) || !(length_b > 0)) return true;
  a /= (face_a & SurfaceImage::kExit) != 0 ? -length_a : length_a;
  b /= (face_b & SurfaceImage::kExit) != 0 ? -length_b : length_b;
  constexpr double kSameDirection = 1e-3, kSamePlace = 1e-5;
  if (glm::length(a - b) > kSameDirection) return false;
  const auto corner = [this](std::uint32_t solid, std::uint32_t triangle) {
    const Geometry::Part& part = geometry_->parts()[solid];
    return part.positions[part.triangles[triangle].x];
  };
  const glm::dvec3 between = corner(solid_b, triangle_b) - corner(solid_a, triangle_a);
  return std::min(std::abs(glm::dot(a, between)), std::abs(glm::dot(b, between))) <=
         kSamePlace * size_;
}

namespace {

/// What samples show that are looked at together.
enum class Seen { kNothing, kOneFace, kSeveral };
/// So many of a row: most show one face, or nothing.
constexpr std::size_t kAtOnce = 16;

/// Looks at some samples from `begin` on in each of some rows. @param columns  std::size_t, or
/// Block, which is quick
using Block = std::integral_constant<std::size_t, kAtOnce>;
template <class Columns>
Seen look_at(const SurfaceImage& image, std::size_t begin, Columns columns, int rows) {
  const auto width = static_cast<std::size_t>(image.width);
  const std::uint32_t* depths = image.depth.data() + begin;
  if (*depths == SurfaceImage::kNone) {
    std::uint32_t present = 0;
    for (int y = 0; y < rows; ++y, depths += width) {
      for (std::size_t i = 0; i < columns; ++i) present |= ~depths[i];
    }
    return present == 0 ? Seen::kNothing : Seen::kSeveral;
  }
  const std::uint32_t* solids = image.solid.data() + begin;
  const std::uint32_t* faces = image.triangle.data() + begin;
  const std::uint32_t solid = *solids, face = *faces;
  std::uint32_t other = 0;
  for (int y = 0; y < rows; ++y, depths += width, solids += width, faces += width) {
    for (std::size_t i = 0; i < columns; ++i) {
      other |= (solids[i] ^ solid) | (faces[i] ^ face);
      other |= depths[i] == SurfaceImage::kNone ? 1u : 0u;
    }
  }
  return other == 0 ? Seen::kOneFace : Seen::kSeveral;
}

}  // namespace

/// Colours samples one after another.
class SampleShader {
 public:
  explicit SampleShader(const Shader& shader) : shader_(&shader), kept_(kKept) {}

  /// Colours `count` samples from `begin` on, `across` a pixel: those of the picture from pixel
  /// (first, v) on.
  void row(const SurfaceImage& image, std::size_t begin, std::size_t count, int across, int first,
           int v, Rgba* colours) {
    for (std::size_t block = 0; block < count; block += kAtOnce) {
      const std::size_t end = std::min(count, block + kAtOnce), at_first = begin + block;
      const Seen seen =
          end - block == kAtOnce ? look_at(image, at_first, Block(), 1) : Seen::kSeveral;
      if (seen == Seen::kNothing) {
        std::fill(colours + block, colours + end, Rgba(0));
      } else if (seen == Seen::kOneFace &&
                 uniform(image.solid[at_first], image.triangle[at_first])) {
        std::fill(colours + block, colours + end, last_->colour);
      } else {
        for (std::size_t i = block; i < end; ++i) {
          const std::size_t from = begin + i;
          const std::uint32_t solid = image.solid[from], face = image.triangle[from];
          const int u = first + static_cast<int>(i) / across;
          if (image.depth[from] == SurfaceImage::kNone) {
            colours[i] = Rgba(0);
          } else if (i > block && first + static_cast<int>(i - 1) / across == u &&
                     image.depth[from - 1] != SurfaceImage::kNone &&
                     image.solid[from - 1] == solid && image.triangle[from - 1] == face) {
            colours[i] = colours[i - 1];
          } else {
            colours[i] = at(solid, face, u, v);
          }
        }
      }
    }
  }
  /// The colour of a face at pixel (u, v).
  Rgba at(std::uint32_t solid, std::uint32_t face, int u, int v) {
    Rgba colour;
    along(solid, face, u, v, std::span(&colour, 1));
    return colour;
  }
  /// The same for pixels from (u, v) on.
  void along(std::uint32_t solid, std::uint32_t face, int u, int v, std::span<Rgba> pixels) {
    if (uniform_along(solid, face, u, v, static_cast<int>(pixels.size()))) {
      std::fill(pixels.begin(), pixels.end(), last_->colour);
    } else {
      shader_->colours(*last_, u, v, pixels);
    }
  }
  /// Whether a face has one colour, colour() then.
  bool uniform(std::uint32_t solid, std::uint32_t face) {
    if (solid != solid_ || face != face_) {
      solid_ = solid, face_ = face;
      Kept& kept = kept_[(solid * 5 + face) % kKept];
      if (kept.solid != solid || kept.tagged != face)
        kept = {solid, face, shader_->face(solid, face)};
      last_ = &kept.face;
    }
    return last_->uniform;
  }
  /// The same for `count` pixels from (u, v) on.
  bool uniform_along(std::uint32_t solid, std::uint32_t face, int u, int v, int count) {
    return uniform(solid, face) || shader_->uniform_along(*last_, u, v, count);
  }
  [[nodiscard]] Rgba colour() const { return last_->colour; }

 private:
  /// Faces met before that are kept.
  static constexpr std::size_t kKept = 128;
  struct Kept {
    std::uint32_t solid = SurfaceImage::kNone, tagged = 0;
    Shader::Face face;
  };

  const Shader* shader_;
  std::uint32_t solid_ = SurfaceImage::kNone, face_ = 0;
  const Shader::Face* last_ = nullptr;
  std::vector<Kept> kept_;
};

void shade(const SurfaceImage& image, const SampleRows& rows, const Shader& shader,
           const Execution& execution, std::span<Rgba> colours) {
  const auto width = static_cast<std::size_t>(image.width);
  for_each_band(image.height, execution, [&](int first, int end) {
    SampleShader samples(shader);
    for (int row = first; row < end; ++row) {
      const std::size_t begin = static_cast<std::size_t>(row) * width;
      samples.row(image, begin, width, rows.across, 0, rows.ground.first + row / rows.down,
                  colours.data() + begin);
    }
  });
}

TileShader::TileShader(const SampleRows& rows, const Shader& shader, int width,
                       std::span<Rgba> pixels)
    : rows_(rows),
      width_(static_cast<std::size_t>(width)),
      pixels_(pixels),
      samples_(std::make_unique<SampleShader>(shader)) {}

TileShader::TileShader(TileShader&&) noexcept = default;
TileShader::~TileShader() = default;

void TileShader::shade(const SurfaceImage& tile, const AreaFaces& faces, const PixelRect& rect) {
  if (rows_.across * rows_.down == 1) return shade_areas(tile, faces, rect);
  const int left = rect.u0 / rows_.across, right = rect.u1 / rows_.across;
  for (int v = rect.v0 / rows_.down; v < rect.v1 / rows_.down; ++v) {
    const std::size_t begin =
        static_cast<std::size_t>(v * rows_.down - rect.v0) * static_cast<std::size_t>(tile.width);
    const int areas = (v * rows_.down - rect.v0) / AreaBounds::kSide * AreaBounds::kAcross;
    shade_row(tile, faces.of.data() + areas, begin, left, v,
              static_cast<std::size_t>(right - left));
  }
}

/// The same for one sample a pixel.
void TileShader::shade_areas(const SurfaceImage& tile, const AreaFaces& faces,
                             const PixelRect& rect) {
  constexpr int kSide = AreaBounds::kSide;
  std::size_t area = 0;
  for (int v = rect.v0; v < rect.v1; v += kSide) {
    const int end = std::min(rect.v1, v + kSide);
    for (int u = rect.u0, i = 0; i < AreaBounds::kAcross; ++i, ++area, u += kSide) {
      if (u >= rect.u1) continue;
      const int width = std::min(kSide, rect.u1 - u);
      const auto columns = static_cast<std::size_t>(width);
      const AreaFaces::Face& face = faces.of[area];
      std::size_t begin = static_cast<std::size_t>((v - rect.v0) * tile.width + u - rect.u0);
      for (int y = v; y < end; ++y, begin += static_cast<std::size_t>(tile.width)) {
        const std::span<Rgba> colours(row_of(u, y), columns);
        const int row = rows_.ground.first + y;
        if (face.solid != SurfaceImage::kNone) {
          covered_ += columns;
          samples_->along(face.solid, face.triangle, u, row, colours);
        } else if (width < kSide || !shade_block(tile, begin, u, row, colours)) {
          shade_runs(tile, begin, u, row, rows_.ground.at(y), colours);
        }
      }
    }
  }
}

bool TileShader::alike(std::uint32_t solid, std::span<const std::uint32_t> triangles,
                       std::uint32_t exit) {
  if (!samples_->uniform(solid, triangles.front() | exit)) return false;
  const Rgba colour = samples_->colour();
  return std::ranges::all_of(triangles.subspan(1), [&](std::uint32_t triangle) {
    return samples_->uniform(solid, triangle | exit) && samples_->colour() == colour;
  });
}

void TileShader::leave(const PixelRect& rect) {
  const int left = rect.u0 / rows_.across, right = rect.u1 / rows_.across;
  for (int v = rect.v0 / rows_.down; v < rect.v1 / rows_.down; ++v) {
    std::fill_n(row_of(left, v), right - left, rows_.ground.at(v));
  }
}

Rgba* TileShader::samples(const SurfaceImage* tile, const PixelRect& rect) {
  tile_.assign(kTilePixels, Rgba(0));
  if (tile == nullptr) return tile_.data();
  const auto count = static_cast<std::size_t>(rect.u1 - rect.u0);
  for (int row = rect.v0; row < rect.v1; ++row) {
    const auto down = static_cast<std::size_t>(row - rect.v0);
    samples_->row(*tile, down * static_cast<std::size_t>(tile->width), count, rows_.across,
                  rect.u0 / rows_.across, rows_.ground.first + row / rows_.down,
                  tile_.data() + down * kTileSide);
  }
  return tile_.data();
}

void TileShader::average_samples(const PixelRect& rect) {
  const int left = rect.u0 / rows_.across, right = rect.u1 / rows_.across;
  for (int v = rect.v0 / rows_.down; v < rect.v1 / rows_.down; ++v) {
    const auto row = static_cast<std::size_t>(v * rows_.down - rect.v0);
    covered_ +=
        average_row(tile_.data() + row * kTileSide, kTileSide, rows_.across, rows_.down,
                    rows_.ground.at(v), {row_of(left, v), static_cast<std::size_t>(right - left)});
  }
}

/// Colours pixels of row `v` from `u` on; their first sample is at `begin`. `faces`: of the row's
/// areas.
void TileShader::shade_row(const SurfaceImage& tile, const AreaFaces::Face* faces,
                           std::size_t begin, int u, int v, std::size_t count) {
  static_assert(kAtOnce == AreaBounds::kSide);
  Rgba* const colours = row_of(u, v);
  const Rgba background = rows_.ground.at(v);
  const auto across = static_cast<std::size_t>(rows_.across);
  const std::size_t at_once = kAtOnce / across;
  struct Sight {
    Seen seen;
    AreaFaces::Face face;
  };
  const auto look = [&](std::size_t block) -> Sight {
    const AreaFaces::Face& area = faces[block / at_once];
    if (area.solid != SurfaceImage::kNone) return {Seen::kOneFace, area};
    if (count - block < at_once) return {Seen::kSeveral, {}};
    const std::size_t first = begin + block * across;
    return {look_at(tile, first, Block(), rows_.down), {tile.solid[first], tile.triangle[first]}};
  };
  const int row = rows_.ground.first + v;
  // Neighbours that show the same face are coloured at once.
  struct Run {
    AreaFaces::Face face;
    std::size_t begin = 0, count = 0;
  } run;
  const auto end_run = [&] {
    if (run.count == 0) return;
    samples_->along(run.face.solid, run.face.triangle, u + static_cast<int>(run.begin), row,
                    std::span(colours + run.begin, run.count));
    covered_ += run.count;
    run.count = 0;
  };
  const auto show = [&](const AreaFaces::Face& face, std::size_t at, std::size_t pixels) {
    if (run.face != face || run.begin + run.count != at) {
      end_run();
      run = {face, at, 0};
    }
    run.count += pixels;
  };
  for (std::size_t block = 0; block < count; block += at_once) {
    const std::size_t pixels = std::min(at_once, count - block);
    const auto [seen, face] = look(block);
    if (seen == Seen::kNothing) {
      std::fill_n(colours + block, pixels, background);
      continue;
    }
    if (seen == Seen::kOneFace) {
      show(face, block, pixels);
      continue;
    }
    for (std::size_t i = block; i < block + pixels; ++i) {
      const std::size_t first = begin + i * across;
      const Seen pixel = look_at(tile, first, across, rows_.down);
      if (pixel == Seen::kNothing) {
        colours[i] = background;
      } else if (pixel == Seen::kOneFace) {
        show({tile.solid[first], tile.triangle[first]}, i, 1);
      } else {
        colours[i] = mixed_pixel(tile, first, u + static_cast<int>(i), row, background);
      }
    }
  }
  end_run();
}

/// A block of pixels of one sample each from (u, v) of the picture on, where it shows nothing but
/// the face, or the background, of its first pixel and that of its last, each of one colour. The
/// first is at `begin`. @return false: it shows something else
bool TileShader::shade_block(const SurfaceImage& tile, std::size_t begin, int u, int v,
                             std::span<Rgba> colours) {
  const std::uint32_t* depths = tile.depth.data() + begin;
  const std::uint32_t* solids = tile.solid.data() + begin;
  const std::uint32_t* faces = tile.triangle.data() + begin;
  struct End {
    std::uint32_t empty, solid, face;
  };
  const auto end_at = [&](std::size_t i) -> End {
    if (depths[i] == SurfaceImage::kNone) return {~0u, 0, 0};
    return {0, solids[i], faces[i]};
  };
  const auto unlike = [&](std::size_t i, const End& end) {
    const std::uint32_t empty = depths[i] == SurfaceImage::kNone ? ~0u : 0u;
    return (((solids[i] ^ end.solid) | (faces[i] ^ end.face)) & ~empty) | (empty ^ end.empty);
  };
  const auto colour_of = [&](const End& end, Rgba& colour) {
    if (end.empty != 0) {
      colour = rows_.ground.at(v - rows_.ground.first);
      return true;
    }
    if (!samples_->uniform_along(end.solid, end.face, u, v, kAtOnce)) return false;
    colour = samples_->colour();
    return true;
  };
  const End first = end_at(0);
  std::uint32_t differ = 0;
  for (std::size_t i = 0; i < kAtOnce; ++i) differ |= unlike(i, first);
  Rgba from, to;
  if (differ == 0) {
    if (!colour_of(first, from)) return false;
    std::fill(colours.begin(), colours.end(), from);
    covered_ += first.empty != 0 ? 0 : kAtOnce;
    return true;
  }
  const End last = end_at(kAtOnce - 1);
  std::array<std::uint32_t, kAtOnce> differs;  // from the first
  std::uint32_t others = 0, covered = 0;
  for (std::size_t i = 0; i < kAtOnce; ++i) {
    differs[i] = unlike(i, first);
    others |= differs[i] != 0 ? unlike(i, last) : 0u;
    covered += depths[i] != SurfaceImage::kNone ? 1u : 0u;
  }
  if (others != 0 || !colour_of(first, from) || !colour_of(last, to)) return false;
  for (std::size_t i = 0; i < kAtOnce; ++i) colours[i] = differs[i] != 0 ? to : from;
  covered_ += covered;
  return true;
}

/// Pixels of one sample each from (u, v) of the picture on, face by face; the first is at `begin`.
void TileShader::shade_runs(const SurfaceImage& tile, std::size_t begin, int u, int v,
                            Rgba background, std::span<Rgba> colours) {
  const std::uint32_t* depths = tile.depth.data() + begin;
  const std::uint32_t* solids = tile.solid.data() + begin;
  const std::uint32_t* faces = tile.triangle.data() + begin;
  for (std::size_t i = 0; i < colours.size();) {
    if (depths[i] == SurfaceImage::kNone) {
      colours[i++] = background;
      continue;
    }
    const std::uint32_t solid = solids[i], face = faces[i];
    const std::size_t begin_of_run = i;
    while (i < colours.size() && depths[i] != SurfaceImage::kNone && solids[i] == solid &&
           faces[i] == face) {
      ++i;
    }
    covered_ += i - begin_of_run;
    samples_->along(solid, face, u + static_cast<int>(begin_of_run), v,
                    colours.subspan(begin_of_run, i - begin_of_run));
  }
}

/// Pixel (u, v) of the picture, whose samples differ; the first is at `begin`.
Rgba TileShader::mixed_pixel(const SurfaceImage& tile, std::size_t begin, int u, int v,
                             Rgba background) {
  const auto across = static_cast<std::size_t>(rows_.across);
  const auto width = static_cast<std::size_t>(tile.width);
  // Faces of the pixel: in each row of samples they come again.
  struct Known {
    AreaFaces::Face face;
    Rgba colour;
  };
  std::array<Known, 4> known;
  std::size_t count = 0;
  const auto colour_of = [&](const AreaFaces::Face& face) {
    for (std::size_t i = 0; i < count; ++i) {
      if (known[i].face == face) return known[i].colour;
    }
    Known& one = known[std::min(count, known.size() - 1)];
    one = {face, samples_->at(face.solid, face.triangle, u, v)};
    count = std::min(count + 1, known.size());
    return one.colour;
  };
  Rgba pixel;
  auto sample = colours_.begin();
  for (int y = 0; y < rows_.down; ++y) {
    const std::size_t first = begin + static_cast<std::size_t>(y) * width;
    for (std::size_t at = first; at < first + across; ++at, ++sample) {
      *sample = tile.depth[at] == SurfaceImage::kNone
                    ? Rgba(0)
                    : colour_of({tile.solid[at], tile.triangle[at]});
    }
  }
  covered_ += average_row(colours_.data(), across, rows_.across, rows_.down, background,
                          std::span(&pixel, 1));
  return pixel;
}

void draw_edges(const SurfaceImage& image, const Shader& shader, int step_u, int step_v,
                const Execution& execution, std::span<Rgba> colours) {
  const auto at = [&](int u, int v) {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) +
           static_cast<std::size_t>(u);
  };
  const auto differ = [&](std::size_t a, std::size_t b) {
    const bool none_a = image.depth[a] == SurfaceImage::kNone;
    const bool none_b = image.depth[b] == SurfaceImage::kNone;
    if (none_a || none_b) return none_a != none_b;
    if (image.solid[a] == image.solid[b] && image.triangle[a] == image.triangle[b]) return false;
    return !shader.same_plane(image.solid[a], image.triangle[a], image.solid[b], image.triangle[b]);
  };
  for_each_band(image.height, execution, [&](int first, int end) {
    for (int v = first; v < end; ++v) {
      for (int u = 0; u < image.width; ++u) {
        const std::size_t here = at(u, v);
        if (image.depth[here] == SurfaceImage::kNone) continue;
        const auto on_edge = [&](int to_u, int to_v) {
          return to_u >= 0 && to_v >= 0 && to_u < image.width && to_v < image.height &&
                 differ(here, at(to_u, to_v));
        };
        // Between two faces the left or upper pixel is dark, at an outline the covered one.
        const auto outline = [&](int to_u, int to_v) {
          return to_u >= 0 && to_v >= 0 && image.depth[at(to_u, to_v)] == SurfaceImage::kNone;
        };
        if (on_edge(u + step_u, v) || on_edge(u, v + step_v) || outline(u - step_u, v) ||
            outline(u, v - step_v)) {
          const glm::vec3 dark = glm::vec3(colours[here]) * kEdgeLight;
          colours[here] = Rgba(glm::u8vec3(dark), colours[here].a);
        }
      }
    }
  });
}

std::uint64_t average(std::span<const Rgba> samples, int across, int down, const Ground& ground,
                      const Execution& execution, int width, std::span<Rgba> pixels) {
  const auto columns = static_cast<std::size_t>(width);
  const std::size_t stride = columns * static_cast<std::size_t>(across);
  std::atomic<std::uint64_t> covered{0};
  for_each_band(static_cast<int>(pixels.size() / columns), execution, [&](int first, int end) {
    std::uint64_t seen = 0;
    for (int row = first; row < end; ++row) {
      const auto v = static_cast<std::size_t>(row);
      seen += average_row(samples.data() + v * static_cast<std::size_t>(down) * stride, stride,
                          across, down, ground.at(row), pixels.subspan(v * columns, columns));
    }
    covered += seen;
  });
  return covered;
}

}  // namespace strata::csg
