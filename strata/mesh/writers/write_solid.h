#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/solid_mesh.h"

namespace strata {

/// The files that a SolidMesh is written to.
enum class SolidFormat : std::uint8_t {
  kAuto,  ///< by the extension of the path
  k3mf,   ///< 3MF: text of doubles in a zip archive; units, colours, an object for each closed part
  kStl,   ///< binary STL: floats, without connectivity, parts and colours
  kObj,   ///< Wavefront OBJ: text of doubles, a group for each part, colours in a file of materials
  kPly,   ///< binary PLY, little-endian: doubles, a colour and a part for each face
  kOff    ///< OFF: text of doubles, a colour for each face
};

/// The length of a world unit, for formats that hold it (3MF).
enum class LengthUnit : std::uint8_t { kMicron, kMillimetre, kCentimetre, kMetre, kInch, kFoot };

/// Settings of write_solid().
struct SolidWriteOptions {
  SolidFormat format = SolidFormat::kAuto;    ///< kAuto: by the name of the file
  LengthUnit unit = LengthUnit::kMillimetre;  ///< of the mesh, for a 3MF
  /// OBJ: the file of materials (.mtl) that is written too if a part has a colour. Empty: an OBJ
  /// without colours.
  std::string materials;
};

/// Writes a mesh. Colours are written where a part has one; a part without one then has the colour
/// of solids in pictures, #f9d72c. The bytes do not depend on the time, the machine and the number
/// of threads. Text has the shortest decimals that give back each double.
/// @param path  a file, which appears only when complete, or "-" for standard output
/// @return kUsage: no format for the path; kGeometry: no triangle, an index or coordinate out of
/// range, also of float for STL; kOutput; kLimit: memory, more than 2^32 - 1 STL triangles, a 3MF
/// model of 4 GiB; kCancelled
Result<void> write_solid(const std::string& path, const SolidMesh& mesh,
                         const SolidWriteOptions& options = {}, const Execution& execution = {});

/// The format for a path's extension, in any letter case; kAuto when it names none.
[[nodiscard]] SolidFormat solid_format_of(std::string_view path);

/// "3mf", "stl", "obj", "ply", "off"; "auto" for kAuto.
[[nodiscard]] const char* solid_format_name(SolidFormat format);

}  // namespace strata
