// The table of formats; voxel_writer.cpp opens their writers.

#include <utility>

#include "strata/voxelize/formats/voxel_writer.h"
#include "voxelize/output/writers.h"

namespace strata {
namespace {

constexpr std::uint32_t kAnyId = 0x7fffffff;
constexpr std::uint32_t kFloatIds = 1 << 24;  // that a float counts

/// An array, x fastest, of any values.
VoxelFormat dense(std::string name, std::string extension, std::string description,
                  std::string also = {}) {
  return {.name = std::move(name),
          .extension = std::move(extension),
          .description = std::move(description),
          .also = std::move(also),
          .axis = Axis::kX,
          .ids = kAnyId,
          .shares = true,
          .rgba = true,
          .distances = true,
          .turned = true};
}
VoxelFormat named(VoxelFormat format) {
  format.named = true;
  return format;
}

/// OpenVDB and the arrays, in the order of --list-formats.
std::vector<VoxelFormat> grids() {
  return {
      {.name = "vdb",
       .extension = ".vdb",
       .description =
           "OpenVDB: bool, float (fog volume, ids, level set), vec3s (colours); world transform",
       .ids = kFloatIds,
       .named = true,
       .shares = true,
       .rgba = true,
       .distances = true,
       .turned = true},
      dense("npy", ".npy", "NumPy: bool array indexed [x, y, z]; ids"),
      dense("npz", ".npz", "NumPy: arrays voxels (as .npy, deflated), origin, spacing; ids"),
      named(dense("nrrd", ".nrrd", "NRRD: uint8, gzip; world transform; ids")),
      named(dense("vti", ".vti", "VTK image data: uint8 cells, zlib; world transform; ids")),
      dense("nii", ".nii", "NIfTI: uint8; world transform; ids"),
      dense("nii.gz", ".nii.gz", "NIfTI, gzip"),
      dense("mha", ".mha", "MetaImage: uint8, zlib; world transform; ids; .mhd: two files", ".mhd"),
      named(dense("raw", ".raw", "uint8, and beside it a NRRD header, .nhdr; ids", ".nhdr")),
      dense("tif", ".tif", "TIFF: a page a layer of z, uint8, zlib; place for ImageJ; ids",
            ".tiff"),
#ifdef STRATA_HAVE_HDF5
      named(dense("h5", ".h5", "HDF5: data set voxels [z, y, x], uint8, deflate; place; ids",
                  ".hdf5")),
#endif
  };
}

/// All others, likewise.
std::vector<VoxelFormat> scenes_and_layers() {
  return {
      {.name = "binvox",
       .extension = ".binvox",
       .description = "binvox: run lengths; cubic voxels in a cube, world transform",
       .axis = Axis::kY},
      {.name = "vox",
       .extension = ".vox",
       .description = "MagicaVoxel: several files beyond 2000 voxels a side; 255 colours, ids",
       .colours = kVoxColours,
       .ids = kVoxColours,
       .rgba = true},
      {.name = "png",
       .extension = "/",
       .description = "folder of PNG slices, 1-bit, grey or ids, one a layer, and slices.json",
       .axis = Axis::kX,
       .ids = 0xffff,
       .shares = true,
       .rgba = true,
       .pictures = true},
      {.name = "sl1",
       .extension = ".sl1",
       .description = "PrusaSlicer's archive for resin printers: a grey PNG a layer",
       .axis = Axis::kX,
       .shares = true,
       .pictures = true},
      {.name = "ome.zarr",
       .extension = ".ome.zarr/",
       .description = "folder: OME-Zarr 0.4, axes z, y, x; levels of half resolution; ids",
       .axis = Axis::kX,
       .ids = kAnyId,
       .shares = true,
       .rgba = true,
       .distances = true,
       .levels = true},
      {.name = "zarr",
       .extension = ".zarr/",
       .description = "folder: Zarr 2 array, uint8, zlib; world transform; ids",
       .ids = kAnyId,
       .shares = true,
       .rgba = true,
       .distances = true},
      {.name = "ply",
       .extension = ".ply",
       .description = "PLY: points, the centres of voxels; colours, ids",
       .axis = Axis::kX,
       .ids = kAnyId,
       .rgba = true},
      {.name = "xyz",
       .extension = ".xyz",
       .description = "text: the centres of voxels, a line each; colours, ids",
       .axis = Axis::kX,
       .ids = kAnyId,
       .rgba = true},
      {.name = "schem",
       .extension = ".schem",
       .description = "Minecraft (Sponge schematic 2): z is up there too; blocks by colour",
       .axis = Axis::kX,
       .rgba = true},
  };
}

}  // namespace

const std::vector<VoxelFormat>& voxel_formats() {
  static const std::vector<VoxelFormat> kFormats = [] {
    std::vector<VoxelFormat> all = grids();
    for (VoxelFormat& format : scenes_and_layers()) all.push_back(std::move(format));
    return all;
  }();
  return kFormats;
}

}  // namespace strata
