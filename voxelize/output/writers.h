#pragma once

#include <memory>
#include <string>
#include <utility>

#include "strata/voxelize/output/voxel_output.h"

namespace strata {

/// The writers behind open_voxel_writer, one a format (internal to voxelize/). The grid is valid.
using VoxelWriterResult = Result<std::unique_ptr<VoxelWriter>>;

/// The writer, after its begin(arguments...); or the error of that.
template <class Writer, class... Arguments>
VoxelWriterResult begun(std::unique_ptr<Writer> writer, Arguments&&... arguments) {
  Result<void> written = writer->begin(std::forward<Arguments>(arguments)...);
  if (!written) return tl::unexpected(written.error());
  return writer;
}

/// Colours of a .vox palette; index 0 means no voxel.
inline constexpr std::size_t kVoxColours = 255;

VoxelWriterResult open_vdb_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options);
VoxelWriterResult open_ply_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options);
VoxelWriterResult open_xyz_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options);
VoxelWriterResult open_schem_writer(const std::string& path, const VoxelGrid& grid,
                                    const VoxelWriterOptions& options);
VoxelWriterResult open_png_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options);
VoxelWriterResult open_sl1_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options);
VoxelWriterResult open_npy_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options);
VoxelWriterResult open_npz_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options);
VoxelWriterResult open_nrrd_writer(const std::string& path, const VoxelGrid& grid,
                                   const VoxelWriterOptions& options);
VoxelWriterResult open_vti_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options);
VoxelWriterResult open_binvox_writer(const std::string& path, const VoxelGrid& grid);
VoxelWriterResult open_vox_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options);
VoxelWriterResult open_raw_writer(const std::string& path, const VoxelGrid& grid,
                                  const VoxelWriterOptions& options);
VoxelWriterResult open_metaimage_writer(const std::string& path, const VoxelGrid& grid,
                                        const VoxelWriterOptions& options);
/// @param packed  by gzip, as it is for a path that ends with .gz
VoxelWriterResult open_nifti_writer(const std::string& path, const VoxelGrid& grid,
                                    const VoxelWriterOptions& options, bool packed);
VoxelWriterResult open_tiff_writer(const std::string& path, const VoxelGrid& grid,
                                   const VoxelWriterOptions& options);
/// Needs STRATA_HAVE_HDF5.
VoxelWriterResult open_hdf5_writer(const std::string& path, const VoxelGrid& grid,
                                   const VoxelWriterOptions& options);
VoxelWriterResult open_ome_zarr_writer(const std::string& path, const VoxelGrid& grid,
                                       const VoxelWriterOptions& options);
VoxelWriterResult open_zarr_writer(const std::string& path, const VoxelGrid& grid,
                                   const VoxelWriterOptions& options);

}  // namespace strata
