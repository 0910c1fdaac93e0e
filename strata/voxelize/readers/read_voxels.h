#pragma once

#include <span>
#include <string>
#include <string_view>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/voxelize/volume/voxel_volume.h"

namespace strata {

/// Names of the formats that read_voxels() reads, for messages and file dialogs.
[[nodiscard]] std::span<const std::string_view> readable_voxel_formats();
/// Whether the name of a file or folder is that of a format that read_voxels() reads: knot.vdb,
/// a folder with a slices.json. Looks into folders only.
[[nodiscard]] bool is_voxel_file(const std::string& path);

/// Reads the voxels of a file or folder: what `strata voxelize` and `strata ldi` write, and what
/// other programs write in these formats. Files may come from anyone. Sizes are checked before
/// memory is taken. Memory grows with the runs of voxels and with the values that are not constant,
/// not with the volume.
///
/// execution.memory_limit bounds what is held; without one, half of the machine's memory does.
/// @return kUsage: unknown format, a grid or a library that is missing; kInput naming the file, the
/// place and the number; kLimit; kCancelled
Result<VoxelVolume> read_voxels(const std::string& path, const ReadVoxelsOptions& options = {},
                                const Execution& execution = {});

}  // namespace strata
