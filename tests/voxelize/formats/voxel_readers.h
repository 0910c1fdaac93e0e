#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

namespace strata::testing {

/// A voxel file as a reader that knows nothing of the writer sees it.
struct ReadVoxels {
  glm::ivec3 dims{0};
  std::vector<std::uint8_t> solid;   // 0 or 1; x fastest, then y, then z
  std::vector<std::uint32_t> ids;    // the values, of files with ids and colours
  int id_bits = 0;                   // of such a value
  bool floats = false;               // these bits are a float
  std::optional<glm::dvec3> origin;  // lower corner of the grid, if the format holds it
  std::optional<glm::dvec3> voxel_size;

  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(dims.y) +
            static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(dims.x) +
           static_cast<std::size_t>(i);
  }
};

/// All of them throw std::runtime_error on anything unexpected. A .vox file of several models and a
/// .binvox, whose grid is a cube, do not tell the size of the grid: it is given.
ReadVoxels read_npy(const std::string& path);
ReadVoxels read_npz(const std::string& path);
ReadVoxels read_nrrd(const std::string& path);
ReadVoxels read_vti(const std::string& path);
ReadVoxels read_binvox(const std::string& path, glm::ivec3 dims);
ReadVoxels read_vox(const std::string& path, glm::ivec3 dims);
ReadVoxels read_png_folder(const std::string& path);
ReadVoxels read_zarr(const std::string& path);
ReadVoxels read_nii(const std::string& path);  // or .nii.gz
ReadVoxels read_mha(const std::string& path);
ReadVoxels read_raw(const std::string& path);  // with the header path.nhdr
ReadVoxels read_tif(const std::string& path);
ReadVoxels read_h5(const std::string& path);  ///< by HDF5's library

/// zlib's inflate: 15 for a zlib stream, 31 for gzip, -15 for bare deflate.
std::string inflate_all(const std::string& data, int window_bits, std::size_t expected);

}  // namespace strata::testing
