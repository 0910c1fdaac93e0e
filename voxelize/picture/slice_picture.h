#pragma once

#include "strata/voxelize/picture/voxel_picture.h"

namespace strata {

/// A plane of a grid, drawn flat. @return as VoxelPicture::draw_slice()
Result<Picture> slice_picture(const VoxelIntervals& set, const VoxelLook& look,
                              const VoxelSlice& slice, const glm::ivec2& size,
                              const VoxelPictureOptions& options, const Execution& execution);

}  // namespace strata
