#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "voxelize/heads/grid_axes.h"
#include "voxelize/volume/dense_array.h"

namespace strata {

/// What the head of a NIfTI file says (nifti.nimh.nih.gov: nifti1.h, nifti2.h). (Internal to
/// voxelize/.)
struct NiftiHead {
  GridAxes axes;             ///< by sform, else qform, else pixdim alone; the world is NIfTI's: RAS
  double unit_metres = 0.0;  ///< of xyzt_units; 0: unknown
  bool placed = false;       ///< by sform or qform
  double volumes = 1.0;      ///< product of the sizes of axes 4 to 7
  NumberType type = NumberType::kU8;  ///< of a voxel
  bool colours = false;               ///< red, green, blue, alpha: `type` is that of all four
  bool big_endian = false;
  std::uint64_t data_at = 0;            ///< byte of the file where voxels begin, x fastest
  double slope = 0.0, intercept = 0.0;  ///< value = slope * number + intercept; slope 0: as it is
};

/// Bytes that a head can have: NIfTI-2's, and the word that says whether extensions follow.
inline constexpr std::size_t kNiftiHeadBytes = 544;

/// @param bytes  the first of the file, unpacked; kNiftiHeadBytes are enough
/// @return kInput naming path and number: no NIfTI, a type that is not a number
Result<NiftiHead> parse_nifti_head(std::string_view bytes, const std::string& path);

/// The grid of a head, with its unit, in NIfTI's world.
Result<VoxelFileGrid> nifti_grid(const NiftiHead& head, const std::string& path);

}  // namespace strata
