#pragma once

#include <array>
#include <string>
#include <string_view>

#include "strata/voxelize/grid_frame.h"
#include "voxelize/volume/json_text.h"
#include "voxelize/volume/read_context.h"

namespace strata {

/// Readers of single formats, called by read_voxels() (internal to voxelize/readers). Each reads
/// context.bytes, or where it says so the folder context.path; format and name of the volume are
/// filled in by the caller unless they are known here.
Result<VoxelVolume> read_npy_voxels(ReadContext& context);
Result<VoxelVolume> read_npz_voxels(ReadContext& context);
Result<VoxelVolume> read_vdb_voxels(ReadContext& context);
Result<VoxelVolume> read_vti_voxels(ReadContext& context);
Result<VoxelVolume> read_binvox_voxels(ReadContext& context);
Result<VoxelVolume> read_vox_voxels(ReadContext& context);
Result<VoxelVolume> read_zarr_voxels(ReadContext& context);      ///< a folder
Result<VoxelVolume> read_ome_zarr_voxels(ReadContext& context);  ///< a folder
Result<VoxelVolume> read_slice_voxels(ReadContext& context);     ///< a folder
Result<VoxelVolume> read_sl1_voxels(ReadContext& context);
/// The voxels of depth lists: .npz or .exr, as `strata ldi` writes them.
Result<VoxelVolume> read_list_voxels(ReadContext& context, bool exr);

/// Where the voxels of a file lie, from its head: see read_voxel_grid().
Result<VoxelFileGrid> npz_grid(ReadContext& context);
Result<VoxelFileGrid> vti_grid(ReadContext& context);
Result<VoxelFileGrid> vdb_grid(ReadContext& context);
/// Voxels along x, y, z of a .npy.
Result<std::array<double, 3>> npy_sizes(ReadContext& context);

[[nodiscard]] bool is_folder(const std::string& path);
/// A JSON file of a folder, or beside a file. @return kInput, kLimit, kCancelled
Result<JsonValue> read_json_file(const std::string& path, const Execution& execution);

/// Reads bytes as a file of a format that is one file, as read_voxels() does.
Result<VoxelVolume> parse_voxels(std::string_view bytes, const std::string& format,
                                 const std::string& name, const ReadVoxelsOptions& options = {},
                                 const Execution& execution = {});

}  // namespace strata
