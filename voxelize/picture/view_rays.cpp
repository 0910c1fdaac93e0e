#include "voxelize/picture/view_rays.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace strata {
namespace {

/// A section this near to a border of voxels, in voxels, lies on it: coordinates that a user writes
/// are rounded.
constexpr double kOnBorder = 1e-6;

glm::dvec3 row(const glm::dmat4& m, int i) { return {m[0][i], m[1][i], m[2][i]}; }

/// The axis that a normal is along, or -1.
int axis_of(const glm::dvec3& normal) {
  int axis = -1;
  for (int a = 0; a < 3; ++a) {
    if (normal[a] == 0) continue;
    if (axis >= 0) return -1;
    axis = a;
  }
  return axis;
}

}  // namespace

ViewRays::ViewRays(const View& view, const VoxelGrid& grid, std::span<const VoxelSection> sections)
    : perspective_(view.perspective) {
  const glm::dmat4& image = view.image_from_world;
  const glm::dmat4& eye = view.eye_from_world;
  // Rows that a point of the world goes through to become u w, v w and its distance.
  const glm::dmat3 rows = glm::transpose(glm::dmat3(row(image, 0), row(image, 1), -row(eye, 2)));
  const glm::dmat3 world = glm::inverse(rows);
  const glm::dvec3 shift(image[3][0], image[3][1], -eye[3][2]);
  const auto voxels = [&](const glm::dvec3& v) { return v / grid.voxel_size; };
  across_ = voxels(world[0]);
  down_ = voxels(world[1]);
  if (perspective_) {
    corner_ = voxels(world[2]);  // the direction through pixel (0, 0)
    fixed_ = voxels(world * -shift - grid.origin);
  } else {
    corner_ = voxels(world * -shift - grid.origin);
    fixed_ = voxels(world[2]);
  }
  // A row of the rotation has length 1; the image's middle has the w row taken off.
  const glm::dvec3 u = row(image, 0);
  const glm::dvec3 right = row(eye, 0);
  scale_ = std::abs(glm::dot(u, right));

  box_.high = grid.dims;
  for (std::size_t i = 0; i < sections.size(); ++i) {
    const VoxelSection& section = sections[i];
    const int axis = axis_of(section.normal);
    const auto index = static_cast<int>(i);
    if (axis >= 0) {
      const double at =
          (section.offset / section.normal[axis] - grid.origin[axis]) / grid.voxel_size[axis];
      const double border = std::round(at);
      if (std::abs(at - border) < kOnBorder) {
        const int limit = static_cast<int>(std::clamp(border, 0.0, double(grid.dims[axis])));
        if (section.normal[axis] > 0 && limit < box_.high[axis]) {
          box_.high[axis] = limit;
          box_.high_section[axis] = index;
        } else if (section.normal[axis] < 0 && limit > box_.low[axis]) {
          box_.low[axis] = limit;
          box_.low_section[axis] = index;
        }
        continue;
      }
    }
    cuts_.push_back({section.normal * grid.voxel_size,
                     section.offset - glm::dot(section.normal, grid.origin), index});
  }
}

ViewRay ViewRays::at(const glm::dvec2& at) const {
  const glm::dvec3 moved = corner_ + at.x * across_ + at.y * down_;
  ViewRay ray;
  ray.origin = perspective_ ? fixed_ : moved;
  ray.direction = perspective_ ? moved : fixed_;
  ray.start.t = perspective_ ? 0.0 : -std::numeric_limits<double>::infinity();
  for (const Cut& cut : cuts_) {
    const double begin = glm::dot(cut.normal, ray.origin) - cut.offset;
    const double speed = glm::dot(cut.normal, ray.direction);
    if (speed == 0) {
      if (begin >= 0) ray.end = -std::numeric_limits<double>::infinity();
    } else if (speed > 0) {
      ray.end = std::min(ray.end, -begin / speed);
    } else if (-begin / speed > ray.start.t) {
      ray.start = {-begin / speed, cut.section};
    }
  }
  return ray;
}

}  // namespace strata
