#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <optional>
#include <string>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/voxelize/grid_frame.h"
#include "strata/voxelize/intervals.h"
#include "strata/voxelize/scalar_field.h"

namespace strata {

/// How layers become pictures, in a folder of PNG slices or an .sl1.
struct LayerOptions {
  /// Across the pictures. Those of z show x to the right and y up, those of y (seen from the front)
  /// x and z, those of x y and z. An .sl1 has layers of z.
  Axis axis = Axis::kZ;
  bool mirror_left_right = false;  ///< of each picture
  bool mirror_up_down = false;     ///< of each picture
  /// With shares: grey is 255 * share^gamma, rounded; 0: 255 from a half on, else 0.
  double gamma = 1.0;
  // Of an .sl1.
  glm::ivec2 display{0};   ///< pixels of a picture, in whose middle the layer lies; 0: its own
  double exposure = 10.0;  ///< seconds a layer
  double first_exposure = 15.0;   ///< of the first layers
  std::int64_t time = 315532800;  ///< seconds since 1970; the first of the year 1980
};

/// The part of one process in a file that several write together. Its slabs are some rows of the
/// grid, along VoxelFormat::axis; finish() completes them, and gives nothing its name.
struct VoxelPart {
  /// .zarr, .ome.zarr: the folder that the processes write into.
  std::string folder{};
  /// .npy, .raw: writes bytes at their place in the file.
  std::function<Result<void>(std::uint64_t offset, const void* data, std::size_t bytes)> write_at{};
  /// This process writes what is there once: the head, the metadata.
  bool head = false;
};

/// Settings of open_voxel_writer().
struct VoxelWriterOptions {
  /// Labels say how much of a voxel is filled: label / fog. A .vdb is a float fog volume. Slabs
  /// without labels are filled. 0: labels say something else. Not with ids.
  std::uint32_t fog = 0;
  /// With fog: values are floats from 0 to 1; false: whole numbers from 0 to 255.
  bool fog_floats = true;
  /// Labels are colours: red + 2^8 green + 2^16 blue + 2^24 alpha, each 0 to 255, sRGB. Alpha is
  /// not 0. Not with ids, fog or `colours`.
  bool rgba = false;
  /// Values are signed distances in world units, which come by add_distances() instead of add();
  /// those beyond +-band are +-band. 0: no distances.
  float band = 0.0f;
  /// .vdb: a MaskGrid, which is smaller; not all programs can read it. Otherwise a BoolGrid.
  bool mask = false;
  /// .vdb, .vti, .nrrd: name of the grid. Empty: `density` of a fog volume, `ids` with ids, else
  /// `solid`.
  std::string name{};
  /// The largest label of the slabs. Labels become the values of voxels, in the narrowest unsigned
  /// type that holds the largest (.vdb: float). 0: a voxel is solid or not. Slabs have labels with
  /// ids, fog or colours only.
  std::uint32_t ids = 0;
  /// Label n has the colour colours[n - 1]: red, green, blue, alpha. Empty: one colour. Not with
  /// ids.
  std::vector<glm::u8vec4> colours{};
  /// .ome.zarr: arrays, each of half the resolution of the one before it, down to one voxel. A
  /// voxel is solid if one of the eight is, has the label that most of the solid ones have, or the
  /// mean of the shares.
  int levels = 1;
  GridFrame frame{};      ///< of the grid in the world
  LayerOptions layers{};  ///< of pictures
  /// .npy: a file beside it, `x.npy.json`, says where the grid lies.
  bool sidecar = false;
  /// .zarr, .ome.zarr with one level, .npy, .raw, .vdb: this process writes a part. A .vdb is then
  /// a file that holds these voxels alone. Other formats ignore it.
  std::optional<VoxelPart> part{};
};

/// Writes a voxel set slab by slab: every slab of one axis, in increasing v, then finish(). Any
/// axis is accepted. The file appears under its name only when finish() succeeds; a writer
/// destroyed before leaves nothing behind. The writer holds one slab and the data that the format
/// itself must hold. For slabs of another axis than VoxelFormat::axis it holds the intervals of the
/// whole set, twice; they grow with the surface.
class VoxelWriter {
 public:
  virtual ~VoxelWriter() = default;
  /// Adds the voxels of one slab. Uses the threads of `execution`; same bytes for any number.
  virtual Result<void> add(const VoxelIntervals& slab, const Execution& execution) = 0;
  /// Adds the distances of layers z_begin, z_begin + 1, ... of the grid, of all x and y, in
  /// increasing z. z_begin is a multiple of 64. @return kUsage if the format holds no distances
  virtual Result<void> add_distances(const ScalarField& layers, int z_begin,
                                     const Execution& execution);
  /// Completes the file. Call it once, after the last slab. @return kOutput, kLimit, kCancelled
  virtual Result<void> finish(const Execution& execution) = 0;
  /// After finish(): the paths of the files, where the writer made other ones than that of its
  /// path, as a .vox beyond 2000 voxels a side. Empty: it did not.
  [[nodiscard]] virtual std::vector<std::string> pieces() const { return {}; }
};

}  // namespace strata
