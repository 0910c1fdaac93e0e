#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/archives/xml_mesh.h"
#include "mesh/archives/zip_entry.h"

/// What slicers say of the objects of a 3MF beside the model. Private to this room.
namespace strata::detail {

/// A part of an object: PrusaSlicer's volume, a component of BambuStudio and OrcaSlicer.
struct SlicerPart {
  std::string name;
  std::string not_solid;  ///< "modifier", "negative volume", "support blocker", ...; empty: a solid
  /// Of a volume: triangles of the object's mesh, both ends included.
  std::uint64_t first = 0, last = 0;
};

struct SlicerObject {
  std::string name;
  std::map<std::string, SlicerPart, std::less<>> parts;  ///< by the id of the component's object
  std::vector<SlicerPart> volumes;                       ///< in the order of their triangles

  /// "object/part", or the object's name where it has one part.
  [[nodiscard]] std::string name_of(const SlicerPart& part) const;
};

/// By the ids of objects of the root model.
using SlicerSettings = std::map<std::string, SlicerObject, std::less<>>;

/// Reads Metadata/model_settings.config (BambuStudio, OrcaSlicer) and
/// Metadata/Slic3r_PE_model.config (PrusaSlicer), as far as the archive has them. A file that is
/// malformed is a warning.
/// @return kLimit, kCancelled
Result<SlicerSettings> read_slicer_settings(const ZipArchive& archive, const Execution& execution,
                                            std::vector<std::string>& warnings);

}  // namespace strata::detail
