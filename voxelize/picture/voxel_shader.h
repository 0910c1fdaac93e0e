#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "picture/studio_lights.h"
#include "strata/voxelize/picture/voxel_picture.h"
#include "voxelize/picture/seen_openness.h"
#include "voxelize/picture/view_rays.h"
#include "voxelize/picture/voxel_ray.h"

namespace strata {

/// From what a ray meets to a colour. Shared by threads.
class VoxelShader {
 public:
  /// @param style  not kAuto
  VoxelShader(const VoxelIntervals& set, const VoxelLook& look, const View& view,
              const ViewRays& rays, const VoxelPictureOptions& options, VoxelStyle style);

  /// Colour and distance alone.
  [[nodiscard]] SeenVoxel unlit(const RayHit& hit) const;
  [[nodiscard]] SeenVoxel look(const ViewRay& ray, const RayHit& hit) const;
  /// In light. @param open  as SeenOpenness::at() @param lines  whether lines along voxels count
  [[nodiscard]] glm::vec3 lit(const SeenVoxel& seen, float open, bool lines) const;
  /// Whether a voxel is solid and in the box of the rays.
  [[nodiscard]] bool solid(const glm::ivec3& voxel) const;

 private:
  [[nodiscard]] glm::dvec3 normal_of(const RayHit& hit, const glm::dvec3& point) const;
  [[nodiscard]] glm::vec3 base_of(const RayHit& hit) const;
  [[nodiscard]] float corner_light(const RayHit& hit, const glm::dvec3& point) const;
  [[nodiscard]] float line_light(const ViewRay& ray, const RayHit& hit,
                                 const glm::dvec3& point) const;

  const VoxelIntervals* set_;
  const VoxelLook* look_;
  const ViewRays* rays_;
  const VoxelPictureOptions* options_;
  VoxelStyle style_;
  bool labels_;
  glm::dmat3 eye_from_world_;
  StudioLights lights_;
};

/// The colour of a label: the look's own, else the palette's. @param labels  the set has labels
[[nodiscard]] Rgba label_colour(const VoxelLook& look, bool labels, std::uint32_t label);

}  // namespace strata
