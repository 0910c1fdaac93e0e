#pragma once

#include <string>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/mesh_attributes.h"
#include "strata/mesh/triangle_soup.h"

namespace strata {

/// How to read an archive.
struct ArchiveOptions {
  bool attributes = false;  ///< parts, materials and colours are read too
  bool textures = true;     ///< with `attributes`: pictures are read
  bool parts = false;       ///< parts are read, with or without the other attributes
};

/// The contents of an archive.
struct ArchiveModel {
  TriangleSoup soup;  ///< triangle t is element t
  MeshAttributes attributes;
  double unit_metres = 1e-3;  ///< the numbers are in this unit
  std::vector<std::string> warnings;
};

/// The mesh of a 3MF file. It supports the core specification 1.3 and the components of the
/// production extension 1.1, which may lie in other model parts of the archive (Bambu Studio and
/// OrcaSlicer write such files). Build items are placed as the file says; an object that is several
/// times at the same place is taken once. A part is a mesh at its place, named by its object or the
/// one around it. Looks are base materials, colour groups and textures; composite materials and
/// multiple properties are skipped.
/// @return kInput naming file, part and line: no zip archive, no model, malformed XML, a missing
/// index, object or part, an object within itself; kLimit: more than 100 million triangles or a
/// million objects, or the memory limit; kCancelled; kUsage: a build without libzip
Result<ArchiveModel> read_3mf_model(const std::string& path, const ArchiveOptions& options,
                                    const Execution& execution = {});

/// The mesh of an AMF file (ISO/ASTM 52915), plain or zipped: all volumes of all objects. A part is
/// a volume, named by its metadata or those of its object. Looks are colours of materials, objects,
/// volumes, triangles and vertices; textures and formulas are skipped, and so are constellations.
/// @return as read_3mf_model()
Result<ArchiveModel> read_amf_model(const std::string& path, const ArchiveOptions& options,
                                    const Execution& execution = {});

/// The soups alone.
Result<TriangleSoup> read_3mf(const std::string& path, const Execution& execution = {});
Result<TriangleSoup> read_amf(const std::string& path, const Execution& execution = {});

}  // namespace strata
