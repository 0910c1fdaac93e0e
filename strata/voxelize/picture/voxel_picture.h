#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/soup_tools.h"
#include "strata/picture/pixels.h"
#include "strata/raster/view.h"
#include "strata/voxelize/intervals.h"

namespace strata {

/// How voxels are drawn.
enum class VoxelStyle {
  kAuto,    ///< blocks where a voxel is 3 pixels wide or more, else smooth
  kBlocks,  ///< every voxel with its faces; lines along them where they are large
  kSmooth,  ///< the same faces, lit by the slope of the set around them
  kXray     ///< the longer a ray is inside, the darker
};

/// Half of space, in world units: where dot(normal, p) < offset is kept. Faces where voxels are cut
/// are closed.
struct VoxelSection {
  glm::dvec3 normal{0.0};  ///< of any length but 0
  double offset = 0.0;     ///< dot(normal, p) on the plane
};

/// Where the colours of voxels come from.
enum class VoxelColours {
  kFile,    ///< VoxelLook::colours where a label has one, else as kLabels
  kLabels,  ///< a palette for the labels; one colour where there are none
  kPlain    ///< one colour
};

/// What a set's voxels look like.
struct VoxelLook {
  VoxelColours source = VoxelColours::kFile;  ///< of colours
  /// Label n has the colour colours[n - 1]. May be empty.
  std::vector<Rgba> colours;
  /// The value of voxel (x, y, z), for slices. Called from several threads at once. Empty: none.
  std::function<float(const glm::ivec3& voxel)> value;
  bool distances = false;  ///< values are signed distances; slices get lines of equal distance
};

/// Settings of a picture of voxels.
struct VoxelPictureOptions {
  VoxelStyle style = VoxelStyle::kAuto;  ///< what is drawn
  /// Rays a pixel where colours change: 1, 2, 4, 8, 16, 32 or 64. Elsewhere one decides.
  int samples = 8;
  std::vector<VoxelSection> sections{};  ///< what is kept lies in all of them
  Rgba background{255, 255, 255, 255};   ///< where nothing is; alpha 0: transparent
  bool edges = true;                     ///< lines along large voxels
  bool occlusion = true;                 ///< corners and hollows are darker
};

/// What a ray meets.
struct VoxelPick {
  glm::ivec3 voxel{0};      ///< x, y, z
  int axis = 0;             ///< of the face: 0, 1 or 2; -1: the cut of a section
  int side = 1;             ///< 1: the face looks towards larger coordinates, -1: smaller
  int section = -1;         ///< the section whose cut is seen; -1: none
  std::uint32_t label = 1;  ///< of the voxel
  double distance = 0.0;    ///< along the view axis, world units
  glm::dvec3 point{0.0};    ///< in world space
};

/// A plane of voxels.
struct VoxelSlice {
  Axis axis = Axis::kZ;  ///< across the plane
  int index = 0;         ///< of the plane, along `axis`
};

/// Draws a set of voxels for any camera, exactly: each ray finds the first voxel that it enters.
/// Columns of runs are searched and empty blocks are skipped, so that time depends on the picture
/// and little on the size of the grid. Pictures are the same bytes for any number of threads. The
/// voxels and faces that are seen do not depend on the axis of the intervals. Functions that are
/// const may be called by several threads at once.
class VoxelPicture {
 public:
  /// Reads all intervals once. @return kUsage (no set), kLimit, kCancelled
  static Result<VoxelPicture> create(std::shared_ptr<const VoxelIntervals> set, VoxelLook look = {},
                                     const Execution& execution = {});
  ~VoxelPicture();
  /// A moved-from object may only be destroyed or assigned to.
  VoxelPicture(VoxelPicture&&) noexcept;
  /// As the constructor.
  VoxelPicture& operator=(VoxelPicture&&) noexcept;

  [[nodiscard]] const VoxelIntervals& set() const;  ///< as given to create()
  /// The box of the solid voxels, in world space; empty without solid voxels.
  [[nodiscard]] Bounds box() const;
  /// The view of `camera` on box(). @return as make_view()
  [[nodiscard]] Result<View> view(const Camera& camera, const glm::ivec2& size) const;

  /// The picture of `camera`. @return kUsage (camera, size, samples, a section without a normal),
  /// kLimit, kCancelled
  [[nodiscard]] Result<Picture> draw(const Camera& camera, const glm::ivec2& size,
                                     const VoxelPictureOptions& options = {},
                                     const Execution& execution = {}) const;
  /// The plane of a slice, flat and as large as fits, x before y before z to the right and up. Sets
  /// without values show their labels' colours, values are grey, distances have lines.
  /// @return kUsage (size, a slice outside of the grid), kLimit, kCancelled
  [[nodiscard]] Result<Picture> draw_slice(const VoxelSlice& slice, const glm::ivec2& size,
                                           const VoxelPictureOptions& options = {},
                                           const Execution& execution = {}) const;
  /// What is seen at a point of a view, in pixels from the upper left corner; (0.5, 0.5) is the
  /// middle of the first pixel. Nothing: the background.
  [[nodiscard]] std::optional<VoxelPick> pick(const View& view, const glm::dvec2& at,
                                              const VoxelPictureOptions& options = {}) const;
  /// Length of the ray through a point of a view that is inside of solid voxels, in world units.
  [[nodiscard]] double solid_length(const View& view, const glm::dvec2& at,
                                    const VoxelPictureOptions& options = {}) const;
  /// The colour of a label's voxels before light.
  [[nodiscard]] Rgba colour(std::uint32_t label) const;

 private:
  struct Impl;
  explicit VoxelPicture(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace strata
