#include "strata/mesh/colours/surface_colours.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <new>
#include <span>
#include <utility>

#include "core/srgb.h"
#include "mesh/colours/mip_map.h"

namespace strata {
namespace {

constexpr int kMostProbes = 16;

// Light times alpha, and alpha.
glm::vec4 light_of(const glm::u8vec4& colour) {
  const std::array<float, 256>& light = linear_light();
  const float alpha = static_cast<float>(colour.w) / 255.0f;
  return {light[colour.x] * alpha, light[colour.y] * alpha, light[colour.z] * alpha, alpha};
}

glm::u8vec4 colour_of(const glm::vec4& light) {
  if (!(light.w >= 0.5f / 255.0f)) return glm::u8vec4(0);
  const SrgbOfLight& srgb = srgb_of_light();
  const float scale = 1.0f / light.w;
  return {srgb(light.x * scale), srgb(light.y * scale), srgb(light.z * scale),
          static_cast<std::uint8_t>(std::min(light.w, 1.0f) * 255.0f + 0.5f)};
}

glm::u8vec4 rounded(const glm::vec4& colour) {
  return glm::u8vec4(glm::clamp(colour, 0.0f, 1.0f) * 255.0f + 0.5f);
}

/// What a triangle looks like: a colour, or the product of a light, a texture if there is one, and
/// the interpolated light of its corners.
struct Look {
  std::uint32_t triangle = 0xffffffffu;
  bool is_flat = true, has_texture = false, has_blend = false;
  glm::u8vec4 flat{0};
  glm::vec4 factor{1.0f};
  std::array<glm::vec4, 3> lights{};  // of the corners
  std::uint32_t texture = 0;
  std::array<glm::dvec2, 3> at{};  // of the corners; (0, 0) is the upper left corner
  float level = 0.0f;
  int probes = 1;
  glm::dvec2 step{0.0};  // from probe to probe
};

// How many texels a footprint covers: along the direction in which it covers most, and across it.
struct Stretch {
  double most = 1.0, least = 1.0;
  glm::dvec2 direction{1.0, 0.0};  // in texels, of length 1
};

// @param points of the triangle, in footprints @param texels at its corners
Stretch stretch_of(const std::array<glm::dvec3, 3>& points,
                   const std::array<glm::dvec2, 3>& texels) {
  const glm::dvec3 p = points[1] - points[0], q = points[2] - points[0];
  const glm::dvec2 s = texels[1] - texels[0], t = texels[2] - texels[0];
  const double a = glm::length(p), b = a > 0.0 ? glm::dot(q, p) / a : 0.0;
  const double c = std::sqrt(std::max(0.0, glm::dot(q, q) - b * b));
  Stretch result;
  if (!(a > 0.0) || c <= 1e-9 * (a + std::abs(b))) {  // no area: the longest edge decides
    double most = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double length = glm::distance(points[i], points[(i + 1) % 3]);
      if (length > 0.0)
        most = std::max(most, glm::distance(texels[i], texels[(i + 1) % 3]) / length);
    }
    result.most = result.least = most;
    return result;
  }
  const glm::dvec2 x = s / a, y = (t - x * b) / c;  // texels for one footprint along p, across it
  const double xx = x.x * x.x + y.x * y.x, xy = x.x * x.y + y.x * y.y, yy = x.y * x.y + y.y * y.y;
  const double half = (xx + yy) / 2, root = std::hypot((xx - yy) / 2, xy);
  result.most = std::sqrt(half + root);
  result.least = std::sqrt(std::max(0.0, half - root));
  const glm::dvec2 first(half + root - yy, xy), second(xy, half + root - xx);
  const glm::dvec2 along = glm::dot(first, first) >= glm::dot(second, second) ? first : second;
  if (const double length = glm::length(along); length > 0.0) result.direction = along / length;
  return result;
}

// Far from 0 a float does not tell texels any more.
bool is_place(const glm::vec2& at) {
  constexpr float kFarthest = 1e8f;
  return std::abs(at.x) <= kFarthest && std::abs(at.y) <= kFarthest;
}

}  // namespace

struct SurfaceColours::Impl {
  const TriangleSoup* mesh = nullptr;
  const MeshAttributes* attributes = nullptr;
  SurfaceColourOptions options;
  std::vector<MipMap> textures;
  std::vector<glm::u8vec4> triangle_colours;

  [[nodiscard]] Look look(std::uint32_t triangle) const;

 private:
  using Corners = std::array<const MeshAttributes::Corner*, 3>;
  [[nodiscard]] bool find_corners(std::uint64_t element, const glm::uvec3& t,
                                  Corners& corners) const;
  /// @return whether any colour is given
  bool set_colours(Look& look, std::uint64_t element, const glm::uvec3& t,
                   const SurfaceMaterial* material, const Corners* corners) const;
  void set_texture(Look& look, const SurfaceMaterial& material, const glm::uvec3& t,
                   const Corners& corners) const;
};

bool SurfaceColours::Impl::find_corners(std::uint64_t element, const glm::uvec3& t,
                                        Corners& corners) const {
  const std::span<const MeshAttributes::Corner> given = attributes->corners_of(element);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto found =
        std::find_if(given.begin(), given.end(), [&](const MeshAttributes::Corner& corner) {
          return corner.vertex == t[static_cast<int>(i)];
        });
    if (found == given.end()) return false;
    corners[i] = &*found;
  }
  return true;
}

void SurfaceColours::Impl::set_texture(Look& look, const SurfaceMaterial& material,
                                       const glm::uvec3& t, const Corners& corners) const {
  look.has_texture = true;
  look.texture = material.texture;
  const MipMap& map = textures[material.texture];
  const glm::dvec2 size(map.width(), map.height());
  std::array<glm::dvec3, 3> points;
  std::array<glm::dvec2, 3> texels;
  for (std::size_t i = 0; i < 3; ++i) {
    glm::dvec2 at(0.0);
    if (is_place(corners[i]->texture_at)) at = glm::dvec2(corners[i]->texture_at);
    look.at[i] = {at.x, 1.0 - at.y};
    texels[i] = look.at[i] * size;
    points[i] = mesh->positions[t[static_cast<int>(i)]] / options.footprint;
  }
  const Stretch stretch = stretch_of(points, texels);
  const double most = std::min(stretch.most, std::max(size.x, size.y));
  const double least = std::max(std::min(stretch.least, most), 1.0);
  look.probes = std::clamp(static_cast<int>(std::lround(most / least)), 1, kMostProbes);
  const double covered = std::max(most / look.probes, least);
  look.level = static_cast<float>(std::log2(std::max(covered, 1.0)));
  look.step = stretch.direction * (most / look.probes) / size;
}

bool SurfaceColours::Impl::set_colours(Look& look, std::uint64_t element, const glm::uvec3& t,
                                       const SurfaceMaterial* material,
                                       const Corners* corners) const {
  bool given = false;
  if (material != nullptr && material->coloured) {
    look.factor = light_of(rounded(material->colour));
    given = true;
  }
  if (element < attributes->element_colours.size()) {
    look.factor *= light_of(attributes->element_colours[element]);
    given = true;
  }
  look.lights.fill(look.factor);
  const auto& of_vertices = attributes->vertex_colours;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t vertex = t[static_cast<int>(i)];
    if (vertex < of_vertices.size()) {
      look.lights[i] *= light_of(of_vertices[vertex]);
      given = true;
    }
    if (corners != nullptr && attributes->corner_colours) {
      look.lights[i] *= light_of((*corners)[i]->colour);
      given = true;
    }
  }
  look.factor = look.lights[0];
  look.has_blend = look.lights[0] != look.lights[1] || look.lights[1] != look.lights[2];
  return given;
}

Look SurfaceColours::Impl::look(std::uint32_t triangle) const {
  Look look;
  look.triangle = triangle;
  if (!triangle_colours.empty()) {
    look.flat = triangle_colours[triangle];
    if (look.flat.w == 0) look.flat = glm::u8vec4(0);
    return look;
  }
  const glm::uvec3 t = mesh->triangles[triangle];
  const std::uint64_t element =
      mesh->face_elements.empty() ? triangle : mesh->face_elements[triangle];
  const std::uint32_t material_index = attributes->material_of(element);
  const SurfaceMaterial* material = material_index < attributes->materials.size()
                                        ? &attributes->materials[material_index]
                                        : nullptr;
  Corners corners{};
  const bool has_corners = !attributes->corners.empty() && find_corners(element, t, corners);
  bool given = set_colours(look, element, t, material, has_corners ? &corners : nullptr);
  if (has_corners && material != nullptr && material->texture < textures.size()) {
    set_texture(look, *material, t, corners);
    given = true;
  }
  look.is_flat = !look.has_texture && !look.has_blend;
  if (!look.is_flat) return look;
  look.flat = colour_of(look.factor);
  if (given) return look;
  const std::uint32_t part = attributes->part_of(element);
  const bool has_part = part < attributes->parts.size() && attributes->parts[part].colour;
  look.flat = has_part ? rounded(*attributes->parts[part].colour) : options.none;
  if (look.flat.w == 0) look.flat = glm::u8vec4(0);
  return look;
}

struct SurfaceColours::Probe::Cache {
  explicit Cache(const Impl& impl_of) : impl(&impl_of), looks(kLooks) {}

  const Look& look(std::uint32_t triangle);

  static constexpr std::size_t kPoints = 64;   // at a time
  static constexpr std::size_t kLooks = 1024;  // a power of two
  const Impl* impl;
  std::vector<Look> looks;
};

SurfaceColours::Probe::Probe(std::unique_ptr<Cache> cache) : cache_(std::move(cache)) {}
SurfaceColours::Probe::Probe(Probe&&) noexcept = default;
SurfaceColours::Probe& SurfaceColours::Probe::operator=(Probe&&) noexcept = default;
SurfaceColours::Probe::~Probe() = default;

const Look& SurfaceColours::Probe::Cache::look(std::uint32_t triangle) {
  Look& look = looks[triangle & (kLooks - 1)];
  if (look.triangle != triangle) look = impl->look(triangle);
  return look;
}

std::optional<glm::u8vec4> SurfaceColours::Probe::only_colour(std::uint32_t triangle) {
  const Look& look = cache_->look(triangle);
  if (look.is_flat) return look.flat;
  return std::nullopt;
}

void SurfaceColours::Probe::colours(std::uint32_t triangle, std::span<const glm::dvec3> weights,
                                    std::span<glm::u8vec4> colours) {
  const Look& look = cache_->look(triangle);
  if (look.is_flat) {
    std::fill_n(colours.begin(), weights.size(), look.flat);
    return;
  }
  std::array<glm::dvec2, Cache::kPoints> places;
  std::array<Float4, Cache::kPoints> texels;
  TextureSampling how;
  const float share = 1.0f / static_cast<float>(look.probes);
  if (look.has_texture) {
    how = cache_->impl->textures[look.texture].sampling(look.level);
    how.probes = look.probes, how.step = look.step;
  }
  for (std::size_t begin = 0; begin < weights.size(); begin += Cache::kPoints) {
    const std::size_t count = std::min(Cache::kPoints, weights.size() - begin);
    const std::span<const glm::dvec3> points = weights.subspan(begin, count);
    if (look.has_texture) {
      for (std::size_t i = 0; i < count; ++i) {
        places[i] = look.at[0] * points[i].x + look.at[1] * points[i].y + look.at[2] * points[i].z;
      }
      sample_texture(how, std::span(places).first(count), texels);
    }
    for (std::size_t i = 0; i < count; ++i) {
      glm::vec4 light = look.factor;
      if (look.has_blend) {
        light = look.lights[0] * static_cast<float>(points[i].x) +
                look.lights[1] * static_cast<float>(points[i].y) +
                look.lights[2] * static_cast<float>(points[i].z);
      }
      if (look.has_texture) {
        const Float4& sum = texels[i];
        light *= glm::vec4(sum[0], sum[1], sum[2], sum[3]) * share;
      }
      colours[begin + i] = colour_of(light);
    }
  }
}

glm::u8vec4 SurfaceColours::Probe::colour(std::uint32_t triangle, const glm::dvec3& weights) {
  glm::u8vec4 found;
  colours(triangle, std::span(&weights, 1), std::span(&found, 1));
  return found;
}

SurfaceColours::SurfaceColours(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SurfaceColours::SurfaceColours(SurfaceColours&&) noexcept = default;
SurfaceColours& SurfaceColours::operator=(SurfaceColours&&) noexcept = default;
SurfaceColours::~SurfaceColours() = default;

SurfaceColours::Probe SurfaceColours::probe() const {
  return Probe(std::make_unique<Probe::Cache>(*impl_));
}

std::uint64_t SurfaceColours::memory_bytes() const {
  std::uint64_t bytes = impl_->triangle_colours.size() * sizeof(glm::u8vec4);
  for (const MipMap& map : impl_->textures) bytes += map.memory_bytes();
  return bytes + Probe::Cache::kLooks * sizeof(Look);
}

Result<SurfaceColours> SurfaceColours::make(const TriangleSoup& mesh,
                                            const MeshAttributes& attributes,
                                            const SurfaceColourOptions& options,
                                            const Execution& execution) {
  try {
    auto impl = std::make_unique<Impl>();
    impl->mesh = &mesh;
    impl->attributes = &attributes;
    impl->options = options;
    std::uint64_t bytes = 0;
    for (const Texture& texture : attributes.textures) {
      const auto texels = static_cast<std::uint64_t>(std::max(texture.width, 0)) *
                          static_cast<std::uint64_t>(std::max(texture.height, 0));
      if (texels == 0 || texels != texture.texels.size()) {
        return fail(ErrorCode::kInput, "{}: a texture of {} x {} with {} texels", texture.name,
                    texture.width, texture.height, texture.texels.size());
      }
      bytes += texels * 8 / 3 + 64;
      if (execution.memory_limit != 0 && bytes > execution.memory_limit) {
        return fail(ErrorCode::kLimit,
                    "{}: the mip maps of the textures need more than the memory limit of {} bytes",
                    texture.name, execution.memory_limit);
      }
      impl->textures.emplace_back(texture).make_levels(execution);
      if (execution.stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
    }
    return SurfaceColours(std::move(impl));
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "mip maps of textures: out of memory");
  }
}

SurfaceColours SurfaceColours::of_triangles(std::vector<glm::u8vec4> colours) {
  auto impl = std::make_unique<Impl>();
  impl->triangle_colours = std::move(colours);
  return SurfaceColours(std::move(impl));
}

}  // namespace strata
