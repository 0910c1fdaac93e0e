#pragma once

#include <string>

#include "hashbuffer/formats/npy_head.h"
#include "voxelize/output/dense_values.h"

namespace strata {

/// The head of a .npy file of voxels, x fastest: shape (nx, ny, nz); of colours (4, nx, ny, nz).
/// (Internal to voxelize/.)
inline std::string npy_head(const DenseValues& values, const glm::ivec3& dims) {
  std::string type = fmt::format("{}{}{}", values.number_bits() == 8 ? '|' : '<',
                                 values.is_float() ? 'f' : 'u', values.number_bits() / 8);
  if (values.kind == DenseValues::Kind::kFlags) type = "|b1";
  return npy_head(
      type, true,
      fmt::format("({}{}, {}, {})", values.components == 1 ? "" : "4, ", dims.x, dims.y, dims.z));
}

}  // namespace strata
