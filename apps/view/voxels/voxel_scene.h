#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/soup_tools.h"
#include "strata/voxelize/picture/voxel_picture.h"
#include "strata/voxelize/readers/read_voxels.h"

// Voxels of a file as the window shows them.

namespace strata::view {

/// How voxels are looked at.
struct VoxelLooks {
  VoxelStyle style = VoxelStyle::kAuto;
  std::optional<VoxelSlice> slice;  ///< shown flat instead of the solid
  std::optional<float> threshold;   ///< of values; none: the file's
  friend bool operator==(const VoxelLooks& a, const VoxelLooks& b) {
    const auto same_slice = [&] {
      if (!a.slice || !b.slice) return a.slice.has_value() == b.slice.has_value();
      return a.slice->axis == b.slice->axis && a.slice->index == b.slice->index;
    };
    return a.style == b.style && a.threshold == b.threshold && same_slice();
  }
};

/// `auto`, `blocks`, `smooth`, `xray`.
[[nodiscard]] std::optional<VoxelStyle> find_voxel_style(std::string_view name);

/// Around the solid voxels; around the grid if there are none.
[[nodiscard]] Bounds solid_box(const VoxelIntervals& set);

/// A file of voxels as it was read. Does not change; any thread may look at it.
class VoxelScene {
 public:
  /// @return as read_voxels()
  static Result<std::shared_ptr<const VoxelScene>> load(const std::string& path,
                                                        const Execution& execution);

  [[nodiscard]] const VoxelVolume& volume() const { return *volume_; }
  /// Of the solid voxels; of the grid if there are none.
  [[nodiscard]] const Bounds& box() const { return box_; }
  /// The least and the greatest value. @pre there are values
  [[nodiscard]] const ScalarField::Range& range() const { return range_; }
  /// What a user asks first, as rows of a table.
  [[nodiscard]] const std::vector<std::pair<std::string, std::string>>& facts() const {
    return facts_;
  }
  /// What voxel (x, y, z) of the grid is: `voxel (3, 4, 5), label 2, value 0.25`.
  [[nodiscard]] std::string describe(const glm::ivec3& voxel, std::uint32_t label) const;
  /// The slice that `k=12` (an index of the file) or `z=3.5` (a world coordinate) means.
  /// @return kUsage
  [[nodiscard]] Result<VoxelSlice> slice_of(std::string_view text) const;
  /// The set with another threshold; that of the file without one or without values.
  [[nodiscard]] std::shared_ptr<const VoxelIntervals> solid(std::optional<float> threshold,
                                                            const Execution& execution) const;

 private:
  std::shared_ptr<const VoxelVolume> volume_;
  Bounds box_;
  ScalarField::Range range_;
  std::vector<std::pair<std::string, std::string>> facts_;
};

}  // namespace strata::view
