#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/grid.h"
#include "strata/voxelize/intervals.h"
#include "strata/voxelize/scalar_field.h"

namespace strata {

/// Which voxels of a field are solid.
enum class SolidRule {
  kAbove,  ///< value > threshold
  kBelow,  ///< value < threshold
  kIds,    ///< value > 0, which becomes the label: ids as floats
};

/// The solid voxels of a field as intervals along z. Work grows with the blocks that are not
/// constant, and with the columns. The same for any number of threads. After a stop the result is
/// not complete.
/// @pre field.dims() == grid.dims; kIds: values are below 2^32
[[nodiscard]] VoxelIntervals solid_voxels(const ScalarField& field, const VoxelGrid& grid,
                                          SolidRule rule, float threshold,
                                          const Execution& execution = {});

/// What the voxels of a file hold.
enum class VoxelKind {
  kMask,       ///< solid or not
  kIds,        ///< ids of solids or files: labels of the set
  kColours,    ///< palette indices: labels of the set, with VoxelVolume::colours
  kFog,        ///< densities, 0 outside: filled fractions
  kDistances,  ///< signed distances, negative inside
  kValues,     ///< any other numbers, such as those of a scanner
  kLists,      ///< depth lists of `strata ldi`: solid where a ray runs inside
};
/// "mask", "ids", "colours", "fog", "distances", "values", "lists".
[[nodiscard]] std::string_view name_of(VoxelKind kind);

/// The voxels of a file.
struct VoxelVolume {
  /// The solid voxels: those that are not 0; of densities and other values those above the
  /// threshold, of distances those below. With labels for ids and colours. Any axis, all rows.
  VoxelIntervals set;
  /// Label n has the colour colours[n - 1], as VoxelWriterOptions::colours. May be empty.
  std::vector<glm::u8vec4> colours;
  /// Densities, distances or other values. Empty for the other kinds.
  ScalarField values;
  VoxelKind kind = VoxelKind::kMask;  ///< what the voxels hold
  float threshold = 0.0f;             ///< that decided the set, where there are values
  std::string format;                 ///< "vdb", "npy", ...: as VoxelFormat::name, or "ldi"
  std::string name;                   ///< of the grid or array, if the file has one
  std::string type;                   ///< of a value, such as "bool", "uint8", "float"
  std::vector<std::string> grids;     ///< names of all grids of the file, where it can have several
  /// Facts that a user should know, a sentence each: a transform that turns, a missing origin.
  std::vector<std::string> notes;
  /// Index that the file gives to voxel (0, 0, 0). Zero, except for .vdb, whose grid here is the
  /// box of what it holds.
  glm::ivec3 first_index{0};
  bool placed = true;  ///< the file says where the voxels lie in the world

  /// The grid of the set.
  [[nodiscard]] const VoxelGrid& grid() const { return set.grid(); }
};

/// How integers are read.
enum class IntegerVoxels {
  /// As ids; as values if there is a negative one, or if they change too often to be ids, as in a
  /// scan.
  kAuto,
  kIds,     ///< a value is the label of the voxel
  kValues,  ///< a value is a number
};

/// Settings of read_voxels().
struct ReadVoxelsOptions {
  std::string format{};  ///< as VoxelFormat::name; empty: by extension and content
  std::string grid{};  ///< .vdb, .vti: name of the grid or array; empty: the first that can be read
  /// Voxels above it are solid, of distances those below. Unset: 0 for distances, else half of the
  /// greatest value; of densities 0.5.
  std::optional<float> threshold{};
  IntegerVoxels integers = IntegerVoxels::kAuto;  ///< how integers are read
};

/// Decides anew which voxels are solid. @pre values are not empty
void set_threshold(VoxelVolume& volume, float threshold, const Execution& execution = {});

}  // namespace strata
