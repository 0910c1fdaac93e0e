#include "csg/picture/shade.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <cmath>
#include <glm/geometric.hpp>

#include "picture/average.h"

namespace strata::csg {
namespace {

constexpr ColourScheme kSchemes[] = {
    {"Cornfield", {0xff, 0xff, 0xe5}, {0xf9, 0xd7, 0x2c}, {0x9d, 0xcb, 0x51}},
    {"Metallic", {0xaa, 0xaa, 0xff}, {0xdd, 0xdd, 0xff}, {0xdd, 0x22, 0xdd}},
    {"Sunset", {0xaa, 0x44, 0x44}, {0xff, 0xaa, 0xaa}, {0x88, 0x22, 0x33}},
    {"Starnight", {0x00, 0x00, 0x00}, {0xff, 0xff, 0xe0}, {0x00, 0xff, 0xff}},
    {"BeforeDawn", {0x33, 0x33, 0x33}, {0xcc, 0xcc, 0xcc}, {0x55, 0x63, 0xdd}},
    {"Nature", {0xfa, 0xfa, 0xfa}, {0x16, 0xa0, 0x85}, {0xdb, 0xf4, 0xda}},
    {"DeepOcean", {0x33, 0x33, 0x33}, {0xee, 0xee, 0xee}, {0x0b, 0xab, 0xc8}},
    {"Solarized", {0xfd, 0xf6, 0xe3}, {0xb5, 0x88, 0x00}, {0x88, 0x22, 0x33}},
    {"Tomorrow", {0xf8, 0xf8, 0xf8}, {0x42, 0x71, 0xae}, {0xf5, 0x87, 0x1f}},
    {"Tomorrow Night", {0x1d, 0x1f, 0x21}, {0x81, 0xa2, 0xbe}, {0xde, 0x93, 0x5f}},
    {"Monotone", {0xff, 0xff, 0xe5}, {0xf9, 0xd7, 0x2c}, {0xf9, 0xd7, 0x2c}},
};

constexpr int kRowsAtOnce = 16;
/// What is left of a colour on an edge.
constexpr float kEdgeLight = 0.2f;

/// Calls body(first row, end row) for bands of an image, on all threads.
template <class Body>
void for_each_band(int height, const Execution& execution, Body&& body) {
  parallel_for(execution, static_cast<std::size_t>((height + kRowsAtOnce - 1) / kRowsAtOnce),
               [&](std::size_t band, int) {
                 const int first = static_cast<int>(band) * kRowsAtOnce;
                 body(first, std::min(height, first + kRowsAtOnce));
               });
}

}  // namespace

std::span<const ColourScheme> colour_schemes() { return kSchemes; }

const ColourScheme* find_colour_scheme(std::string_view name) {
  const auto same = [](char a, char b) {
    return std::tolower(static_cast<unsigned char>(a)) ==
           std::tolower(static_cast<unsigned char>(b));
  };
  for (const ColourScheme& scheme : kSchemes) {
    if (std::equal(scheme.name.begin(), scheme.name.end(), name.begin(), name.end(), same)) {
      return &scheme;
    }
  }
  return nullptr;
}

Shader::Shader(const Tree& tree, const Geometry& geometry, const View& view,
               const ColourScheme& scheme)
    : tree_(&tree),
      geometry_(&geometry),
      eye_from_world_(view.eye_from_world),
      face_(glm::vec3(scheme.face) / 255.0f, 1.0f),
      cut_(glm::vec3(scheme.cut) / 255.0f, 1.0f),
      size_(geometry.box().empty() ? 0.0 : glm::length(geometry.box().high - geometry.box().low)) {}

glm::dvec3 Shader::across(std::uint32_t solid, std::uint32_t triangle) const {
  const Geometry::Part& part = geometry_->parts()[solid];
  const glm::uvec3& t = part.triangles[triangle];
  const glm::dvec3& a = part.positions[t.x];
  return glm::cross(part.positions[t.y] - a, part.positions[t.z] - a);
}

float Shader::light(std::uint32_t solid, std::uint32_t triangle, bool exit) const {
  const glm::dvec3 in_eye = eye_from_world_ * across(solid, triangle);
  return eye_light(exit ? -in_eye : in_eye);
}

glm::vec4 Shader::base(std::uint32_t solid, bool exit) const {
  return colour_or(tree_->solids()[solid].colour, exit ? cut_ : face_);
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

/// Colours rows of surfaces one after another.
class RowShader {
 public:
  RowShader(const SurfaceImage& image, const Shader& shader, Rgba background)
      : image_(&image), shader_(&shader), background_(background) {}

  void set_background(Rgba background) { background_ = background; }
  /// Colours `count` pixels from `begin` on.
  void shade(std::size_t begin, std::size_t count, Rgba* colours) {
    const std::uint32_t* depths = image_->depth.data() + begin;
    const std::uint32_t* solids = image_->solid.data() + begin;
    const std::uint32_t* faces = image_->triangle.data() + begin;
    std::size_t i = 0;
    for (; i + kAtOnce <= count; i += kAtOnce) {
      // Most blocks show one face, or nothing.
      std::uint32_t other = 0, present = 0, absent = 0;
      for (std::size_t j = i; j < i + kAtOnce; ++j) {
        other |= (solids[j] ^ solids[i]) | (faces[j] ^ faces[i]);
        const std::uint32_t inverse = ~depths[j];  // 0: nothing
        present |= inverse;
        absent |= inverse == 0 ? 1u : 0u;
      }
      if (present == 0) {
        std::fill_n(colours + i, kAtOnce, background_);
      } else if ((other | absent) == 0) {
        if (solids[i] != solid_ || faces[i] != face_) meet(solids[i], faces[i]);
        std::fill_n(colours + i, kAtOnce, colour_);
        covered_ += kAtOnce;
      } else {
        for (std::size_t j = i; j < i + kAtOnce; ++j)
          one(depths[j], solids[j], faces[j], colours[j]);
      }
    }
    for (; i < count; ++i) one(depths[i], solids[i], faces[i], colours[i]);
  }
  [[nodiscard]] std::uint64_t covered() const { return covered_; }

 private:
  static constexpr std::size_t kAtOnce = 16;
  /// Faces met before whose colours are kept.
  static constexpr std::size_t kKept = 32;
  struct Kept {
    std::uint32_t solid = SurfaceImage::kNone, face = 0;
    Rgba colour{0};
  };

  void one(std::uint32_t depth, std::uint32_t solid, std::uint32_t face, Rgba& colour) {
    if (depth == SurfaceImage::kNone) {
      colour = background_;
      return;
    }
    ++covered_;
    if (solid != solid_ || face != face_) meet(solid, face);
    colour = colour_;
  }
  void meet(std::uint32_t solid, std::uint32_t face) {
    solid_ = solid;
    face_ = face;
    Kept& kept = kept_[(solid * 5 + face) % kKept];
    if (kept.solid != solid || kept.face != face) kept = {solid, face, colour_of(solid, face)};
    colour_ = kept.colour;
  }
  [[nodiscard]] Rgba colour_of(std::uint32_t solid, std::uint32_t face) const {
    const bool exit = (face & SurfaceImage::kExit) != 0;
    const float light = shader_->light(solid, face & ~SurfaceImage::kExit, exit);
    return to_bytes(glm::vec4(glm::vec3(shader_->base(solid, exit)) * light, 1.0f));
  }

  const SurfaceImage* image_;
  const Shader* shader_;
  Rgba background_, colour_{0};
  std::uint32_t solid_ = SurfaceImage::kNone, face_ = 0;
  std::uint64_t covered_ = 0;
  std::array<Kept, kKept> kept_;
};

}  // namespace

std::uint64_t shade(const SurfaceImage& image, const Shader& shader, Rgba background,
                    const Execution& execution, std::span<Rgba> colours) {
  const auto width = static_cast<std::size_t>(image.width);
  std::atomic<std::uint64_t> covered{0};
  for_each_band(image.height, execution, [&](int first, int end) {
    RowShader rows(image, shader, background);
    const std::size_t begin = static_cast<std::size_t>(first) * width;
    rows.shade(begin, static_cast<std::size_t>(end - first) * width, colours.data() + begin);
    covered += rows.covered();
  });
  return covered;
}

std::uint64_t shade_tile(const SurfaceImage& tile, const PixelRect& rect, const Shader& shader,
                         const Ground& ground, int width, std::span<Rgba> colours) {
  RowShader rows(tile, shader, ground.at(rect.v0));
  for (int v = rect.v0; v < rect.v1; ++v) {
    rows.set_background(ground.at(v));
    const std::size_t at = static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                           static_cast<std::size_t>(rect.u0);
    rows.shade(static_cast<std::size_t>(v - rect.v0) * static_cast<std::size_t>(tile.width),
               static_cast<std::size_t>(rect.u1 - rect.u0), colours.data() + at);
  }
  return rows.covered();
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
