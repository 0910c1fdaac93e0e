#pragma once

#include <string>

#include "core/result.h"
#include "mesh/triangle_soup.h"

namespace strata::csg {

/// The mesh of a 3MF file (core specification 1.2): all build items at their places, components
/// included, as one soup; numbers are taken as they are, whatever their unit. Materials and other
/// extensions are skipped. @return kInput naming file and line: no zip archive, no model, malformed
/// XML, an index that names nothing, components within themselves; kLimit; kUsage: a build without
/// libzip
Result<TriangleSoup> read_3mf(const std::string& path);

/// The mesh of an AMF file (ISO/ASTM 52915), plain or zipped: all volumes of all objects as one
/// soup, without constellations; numbers as they are. @return as read_3mf
Result<TriangleSoup> read_amf(const std::string& path);

}  // namespace strata::csg
