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
constexpr Rgba kPlainFace{116, 166, 222, 255};
constexpr Rgba kPlainCut{0xf6, 0xa8, 0x45, 255};

/// A face shows where its own direction leaves the slope without one: thin walls have slopes of 0.
constexpr double kFaceShare = 0.15;

/// Light at a corner of a face by how many of the three voxels around it stand in front.
constexpr float kCornerLight[] = {1.0f, 0.70f, 0.46f, 0.28f};

/// Lines along voxels: from this many pixels a voxel on they show, and from the second on fully.
constexpr double kLinesFrom = 6.0, kLinesFull = 16.0;
constexpr float kBorderLight = 0.66f;
constexpr double kBorderWidth = 1.1;  // pixels
/// Planes that do not cross the borders along an axis move less than this along it, by rounding.
constexpr double kNoSpeed = 1e-9;

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
      eye_from_world_(view.eye_from_world),
      lights_(glm::normalize(glm::vec3(eye_from_world_[2]))) {}

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

/// Less light along the sides of a voxel on its face, or on the cut of a section; a pixel wide.
float VoxelShader::line_light(const ViewRay& ray, const RayHit& hit,
                              const glm::dvec3& point) const {
  // Of the plane, in voxels.
  glm::dvec3 normal(0.0);
  if (hit.face < RayHit::kSection) {
    normal[hit.face / 2] = 1.0;
  } else {
    normal = options_->sections[static_cast<std::size_t>(hit.face - RayHit::kSection)].normal *
             set_->grid().voxel_size;
  }
  const double towards = glm::dot(normal, ray.direction);
  float light = 1.0f;
  for (int c = 0; c < 3; ++c) {
    // How far the point on the plane moves along c for a pixel to the right and down.
    double speed = 0.0;
    for (const glm::dvec3* change : {&rays_->across(), &rays_->down()}) {
      const double moved = (*change)[c] - ray.direction[c] * glm::dot(normal, *change) / towards;
      speed += moved * moved;
    }
    speed = std::sqrt(speed) * (rays_->perspective() ? hit.t : 1.0);
    if (!(speed > kNoSpeed)) continue;
    const double fade = std::clamp((1 / speed - kLinesFrom) / (kLinesFull - kLinesFrom), 0.0, 1.0);
    if (fade == 0) continue;
    const double part = std::clamp(point[c] - hit.voxel[c], 0.0, 1.0);
    const double away = std::min(part, 1 - part) / speed;  // pixels; half of the line is ours
    const double cover = std::clamp(kBorderWidth / 2 + 0.5 - away, 0.0, 1.0);
    light = std::min(light, static_cast<float>(1 - (1 - kBorderLight) * fade * cover));
  }
  return light;
}

SeenVoxel VoxelShader::unlit(const RayHit& hit) const {
  SeenVoxel seen;
  seen.distance = static_cast<float>(hit.t);
  seen.colour = base_of(hit);
  seen.cut = hit.face >= RayHit::kSection;
  return seen;
}

SeenVoxel VoxelShader::look(const ViewRay& ray, const RayHit& hit) const {
  const glm::dvec3 point = ray.origin + ray.direction * hit.t;
  const glm::dvec3 normal = eye_from_world_ * normal_of(hit, point);
  const double length = glm::length(normal);
  SeenVoxel seen = unlit(hit);
  if (length > 0) seen.normal = glm::vec3(normal / length);
  seen.face = seen.normal;
  if (style_ != VoxelStyle::kBlocks) return seen;
  if (options_->occlusion && !seen.cut) seen.corner = corner_light(hit, point);
  if (options_->edges) seen.line = line_light(ray, hit, point);
  return seen;
}

glm::vec3 VoxelShader::lit(const SeenVoxel& seen, float open, bool lines) const {
  if (seen.cut) return seen.colour * (lines ? seen.line : 1.0f);
  const Lit light = lights_.on(seen.normal);
  const glm::vec3 colour = shaded(seen.colour, light, std::min(open, seen.corner));
  return glm::clamp(colour, 0.0f, 1.0f) * (lines ? seen.line : 1.0f);
}

}  // namespace strata
