#pragma once

#include <string>
#include <string_view>

#include "core/letters.h"
#include "strata/core/result.h"
#include "voxelize/heads/grid_axes.h"
#include "voxelize/heads/head_fields.h"

namespace strata {

/// The head of a NRRD file, attached or detached. (Internal to voxelize/.)
struct NrrdHead {
  HeadFields fields;     ///< names in small letters
  std::size_t data = 0;  ///< byte after the head
  [[nodiscard]] std::string_view get(std::string_view name, std::string_view other = {}) const {
    return fields.get(name, other);
  }
};

/// @return kInput naming path and line
Result<NrrdHead> parse_nrrd_head(std::string_view bytes, const std::string& path);

/// The grid of a head: of its three axes in space; a further axis, of colours or vectors, is left
/// out. @return kInput naming the field
Result<VoxelFileGrid> nrrd_grid(const NrrdHead& head, const std::string& path);

}  // namespace strata
