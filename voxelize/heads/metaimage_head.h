#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "voxelize/heads/grid_axes.h"
#include "voxelize/volume/dense_array.h"

namespace strata {

/// What the head of a MetaImage says (itk.org/Wiki/ITK/MetaIO). (Internal to voxelize/.)
struct MetaImageHead {
  GridAxes axes;
  double unit_metres = 0.0;                     ///< of DistanceUnits; 0: unknown
  bool placed = false;                          ///< by an offset
  NumberType type = NumberType::kU8;            ///< of a voxel
  bool big_endian = false, compressed = false;  ///< compressed: zlib
  int channels = 1;                             ///< ElementNumberOfChannels
  std::int64_t skip = 0;      ///< HeaderSize: bytes before the voxels; -1: they are the last
  std::string data_file;      ///< "LOCAL": the voxels follow the head; else a file beside it
  std::uint64_t data_at = 0;  ///< byte after the head
};

/// @return kInput naming path, line and number
Result<MetaImageHead> parse_metaimage_head(std::string_view bytes, const std::string& path);

/// The grid of a head, with its unit.
Result<VoxelFileGrid> metaimage_grid(const MetaImageHead& head, const std::string& path);

}  // namespace strata
