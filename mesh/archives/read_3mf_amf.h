#pragma once

#include <string>
#include <vector>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"

namespace strata {

/// The mesh of a 3MF file as one soup. It supports the core specification 1.2 and the components of
/// the production extension 1.1, which may lie in other model parts of the archive (Bambu Studio
/// and OrcaSlicer write such files). Build items are placed as the file says; an object that is
/// several times at the same place is taken once. Numbers are taken as they are, whatever their
/// unit, as in OpenSCAD; `warnings` gets a sentence about a unit that is not the millimetre.
/// Materials and other extensions are skipped.
/// @return kInput naming file, part and line: no zip archive, no model, malformed XML, a missing
/// index, object or part, an object within itself; kLimit: more than 100 million triangles or a
/// million objects, or the memory limit; kCancelled; kUsage: a build without libzip
Result<TriangleSoup> read_3mf(const std::string& path, const Execution& execution = {},
                              std::vector<std::string>* warnings = nullptr);

/// The mesh of an AMF file (ISO/ASTM 52915), plain or zipped: all volumes of all objects as one
/// soup. Constellations are ignored; units are handled as in read_3mf(). @return as read_3mf()
Result<TriangleSoup> read_amf(const std::string& path, const Execution& execution = {},
                              std::vector<std::string>* warnings = nullptr);

}  // namespace strata
