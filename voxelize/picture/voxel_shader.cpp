#include "voxelize/picture/voxel_shader.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "voxelize/picture/label_colours.h"
#include "voxelize/picture/voxel_slope.h"

namespace strata {
namespace {

/// Of sets without labels: their faces, and where a section cuts them.
constexpr Rgba kPlainFace{150, 190, 232, 255};
constexpr Rgba kPlainCut{250, 172, 84, 255};

/// A face shows where its own direction leaves the slope without one: thin walls have slopes of 0.
constexpr double kFaceShare = 0.15;

/// Light of three lamps that move with the eye, and of the surroundings, brighter above.
float three_lights(const glm::dvec3& n) {
  const glm::dvec3 key = glm::normalize(glm::dvec3(-0.35, 0.75, 0.56));
  const glm::dvec3 fill = glm::normalize(glm::dvec3(-0.80, -0.15, 0.58));
  const glm::dvec3 back = glm::normalize(glm::dvec3(0.55, 0.45, -0.70));
  const double light = 0.40 + 0.10 * n.y + 0.56 * std::max(0.0, glm::dot(n, key)) +
                       0.36 * std::max(0.0, glm::dot(n, fill)) +
                       0.18 * std::max(0.0, glm::dot(n, back));
  return static_cast<float>(std::clamp(light, 0.0, 1.15));
}

/// Light at a corner of a face by how many of the three voxels around it stand in front.
constexpr float kCornerLight[] = {1.0f, 0.82f, 0.68f, 0.56f};

/// Lines along voxels: from this many pixels a voxel on they show, and from the second on fully.
constexpr double kLinesFrom = 6.0, kLinesFull = 16.0;
constexpr float kLineLight = 0.66f;
constexpr double kLineWidth = 1.1;  // pixels

}  // namespace

Rgba label_colour(const VoxelLook& look, bool labels, std::uint32_t label) {
  if (look.source == VoxelColours::kFile && label > 0 && label <= look.colours.size()) {
    return look.colours[label - 1];
  }
  return labels && look.source != VoxelColours::kPlain ? palette_colour(label) : kPlainFace;
}

VoxelShader::VoxelShader(const VoxelIntervals& set, const VoxelLook& look, const View& view,
                         const ViewRays& rays, const VoxelPictureOptions& options, VoxelStyle style)
    : set_(&set),
      look_(&look),
      rays_(&rays),
      options_(&options),
      style_(style),
      labels_(set.has_labels()),
      eye_from_world_(view.eye_from_world) {}

bool VoxelShader::solid(const glm::ivec3& voxel) const {
  const RayBox& box = rays_->box();
  for (int a = 0; a < 3; ++a) {
    if (voxel[a] < box.low[a] || voxel[a] >= box.high[a]) return false;
  }
  return set_->contains(voxel.x, voxel.y, voxel.z);
}

glm::dvec3 VoxelShader::normal_of(const RayHit& hit, const glm::dvec3& point) const {
  if (hit.face >= RayHit::kSection) {
    return options_->sections[static_cast<std::size_t>(hit.face - RayHit::kSection)].normal;
  }
  glm::dvec3 face(0.0);
  face[hit.face / 2] = hit.face % 2 != 0 ? 1.0 : -1.0;
  if (style_ == VoxelStyle::kBlocks) return face;
  // The slope along x falls by a voxel's length.
  const glm::dvec3 out = -occupancy_slope(*set_, point) / set_->grid().voxel_size;
  const double least =
      std::min({set_->grid().voxel_size.x, set_->grid().voxel_size.y, set_->grid().voxel_size.z});
  return out * least + face * kFaceShare;
}

glm::vec3 VoxelShader::base_of(const RayHit& hit) const {
  Rgba colour = label_colour(*look_, labels_, hit.label);
  if (hit.face >= RayHit::kSection && colour == kPlainFace) colour = kPlainCut;
  return glm::vec3(colour) / 255.0f;
}

/// Less light in corners: each corner of the face counts the voxels that stand in front of the face
/// around it, and the point lies between corners.
float VoxelShader::corner_light(const RayHit& hit, const glm::dvec3& point) const {
  const int axis = hit.face / 2, a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
  glm::ivec3 front = hit.voxel;
  front[axis] += hit.face % 2 != 0 ? 1 : -1;
  bool stands[3][3] = {};
  for (int i = -1; i <= 1; ++i) {
    for (int j = -1; j <= 1; ++j) {
      if (i == 0 && j == 0) continue;
      glm::ivec3 at = front;
      at[a] += i;
      at[b] += j;
      stands[i + 1][j + 1] = solid(at);
    }
  }
  const auto corner = [&](int i, int j) {
    const bool one = stands[i][1], other = stands[1][j];
    return kCornerLight[one && other ? 3
                                     : (one ? 1 : 0) + (other ? 1 : 0) + (stands[i][j] ? 1 : 0)];
  };
  const auto ease = [](double x) {
    x = std::clamp(x, 0.0, 1.0);
    return static_cast<float>(x);
  };
  const float x = ease(point[a] - hit.voxel[a]), y = ease(point[b] - hit.voxel[b]);
  return glm::mix(glm::mix(corner(0, 0), corner(2, 0), x), glm::mix(corner(0, 2), corner(2, 2), x),
                  y);
}

/// Less light along the sides of a face, a pixel wide.
float VoxelShader::line_light(const ViewRay& ray, const RayHit& hit,
                              const glm::dvec3& point) const {
  const int axis = hit.face / 2;
  float light = 1.0f;
  for (int c = 0; c < 3; ++c) {
    if (c == axis) continue;
    // How far the point on the face's plane moves along c for a pixel to the right and down.
    double speed = 0.0;
    for (const glm::dvec3* change : {&rays_->across(), &rays_->down()}) {
      const double moved = (*change)[c] - ray.direction[c] * (*change)[axis] / ray.direction[axis];
      speed += moved * moved;
    }
    speed = std::sqrt(speed) * (rays_->perspective() ? hit.t : 1.0);
    if (!(speed > 0)) continue;
    const double fade = std::clamp((1 / speed - kLinesFrom) / (kLinesFull - kLinesFrom), 0.0, 1.0);
    if (fade == 0) continue;
    const double part = std::clamp(point[c] - hit.voxel[c], 0.0, 1.0);
    const double away = std::min(part, 1 - part) / speed;  // pixels; half of the line is ours
    const double cover = std::clamp(kLineWidth / 2 + 0.5 - away, 0.0, 1.0);
    light = std::min(light, static_cast<float>(1 - (1 - kLineLight) * fade * cover));
  }
  return light;
}

VoxelShader::Seen VoxelShader::shade(const ViewRay& ray, const RayHit& hit) const {
  const glm::dvec3 point = ray.origin + ray.direction * hit.t;
  glm::dvec3 normal = eye_from_world_ * normal_of(hit, point);
  const double length = glm::length(normal);
  normal = length > 0 ? normal / length : glm::dvec3(0, 0, 1);
  float light = three_lights(normal);
  const bool cut = hit.face >= RayHit::kSection;
  if (cut) light = std::max(light, 0.92f);
  if (options_->occlusion && !cut && style_ == VoxelStyle::kBlocks) {
    light *= corner_light(hit, point);
  }
  const glm::vec3 colour = glm::min(base_of(hit) * light, glm::vec3(1.0f));
  Seen seen{colour, colour};
  if (options_->edges && !cut && style_ == VoxelStyle::kBlocks) {
    seen.drawn *= line_light(ray, hit, point);
  }
  return seen;
}

}  // namespace strata
