#pragma once

#include <string>

#include "mesh/text/input_bytes.h"
#include "voxelize/heads/grid_axes.h"
#include "voxelize/volume/dense_array.h"
#include "voxelize/volume/read_context.h"

namespace strata {

/// Readers of what scanners and microscopes write, called by read_voxels(). (Internal to
/// voxelize/.)
Result<VoxelVolume> read_nrrd_voxels(ReadContext& context);
Result<VoxelVolume> read_raw_voxels(ReadContext& context);  ///< by the .nhdr beside it
Result<VoxelVolume> read_nifti_voxels(ReadContext& context);
Result<VoxelVolume> read_metaimage_voxels(ReadContext& context);
Result<VoxelVolume> read_tiff_voxels(ReadContext& context);
Result<VoxelVolume> read_hdf5_voxels(ReadContext& context);  ///< of the file context.path

/// Where the voxels of a file lie, from its head: see read_voxel_grid().
Result<VoxelFileGrid> nrrd_file_grid(ReadContext& context);
Result<VoxelFileGrid> raw_grid(ReadContext& context);
Result<VoxelFileGrid> nifti_file_grid(ReadContext& context);
Result<VoxelFileGrid> metaimage_file_grid(ReadContext& context);
Result<VoxelFileGrid> tiff_grid(ReadContext& context);
Result<VoxelFileGrid> hdf5_grid(ReadContext& context);

/// A layout whose axes are those of the file. Axes that run along the world's in any order and sign
/// are followed; others are shown along the grid's own axes, and `note` says so.
struct PlacedLayout {
  DenseLayout layout;
  std::string note;
};
Result<PlacedLayout> placed_layout(const ReadContext& context, const GridAxes& axes);

/// read_dense(), with the note. @param is_placed  whether the file says where its voxels lie
Result<VoxelVolume> read_placed(ReadContext& context, const PlacedLayout& placed,
                                const DenseData& data, bool is_placed);

/// A file of voxels that a head names. @return kInput: it is not in the folder of the head
Result<detail::InputBytes> open_data_file(const ReadContext& context, const std::string& name);

/// `size` bytes of `data` from `at` on. @return kInput if there are fewer
Result<std::string_view> voxel_bytes(const ReadContext& context, std::string_view data,
                                     std::uint64_t at, const DenseLayout& layout);

}  // namespace strata
