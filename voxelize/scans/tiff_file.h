#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/result.h"
#include "voxelize/heads/grid_axes.h"
#include "voxelize/volume/dense_array.h"

namespace strata {

/// The pages of a TIFF or BigTIFF that are one array (TIFF 6.0). (Internal to voxelize/.)
struct TiffFile {
  struct Strip {
    std::uint64_t at = 0, bytes = 0;  ///< in the file
    std::uint64_t dense = 0;          ///< unpacked
  };
  GridAxes axes;  ///< x and y along the rows and columns of a page, z along the pages
  std::string space;
  double unit_metres = 0.0;  ///< 0: unknown
  bool placed = false;       ///< by an origin
  NumberType type = NumberType::kU8;
  bool colours = false;                     ///< red, green, blue, alpha: `type` is that of all four
  bool big_endian = false, packed = false;  ///< packed: zlib
  std::vector<Strip> strips;                ///< of all pages, in their order
};

/// @return kInput naming path, page and what is not read: tiles, other compressions, colours
Result<TiffFile> parse_tiff(std::string_view bytes, const std::string& path);

}  // namespace strata
