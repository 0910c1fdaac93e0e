#pragma once

#include <string>

#include "hashbuffer/formats/npy_head.h"
#include "voxelize/output/dense_values.h"

namespace strata {

/// The head of a .npy file of voxels, x fastest: shape (nx, ny, nz); of colours (4, nx, ny, nz).
/// (Internal to voxelize/.)
inline std::string npy_head(const DenseValues& values, const glm::ivec3& dims) {
  return npy_head(
      values.kind == DenseValues::Kind::kFlags ? "|b1" : values.numpy_type(), true,
      fmt::format("({}{}, {}, {})", values.components == 1 ? "" : "4, ", dims.x, dims.y, dims.z));
}

}  // namespace strata
