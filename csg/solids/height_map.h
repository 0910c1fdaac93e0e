#pragma once

#include <string>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"

namespace strata::csg {

/// OpenSCAD's `surface`: a closed solid under a height map, each cell with a vertex in its middle.
/// A .png is read as grey levels 0 to 100, its last row at y = 0, floor one below the lowest; any
/// other file as rows of numbers, the first at y = 0, comments after '#', floor at
/// min(1, lowest) - 1. `centre` puts the middle at x = y = 0; `invert` turns grey levels around.
/// @return kInput naming file and line; kLimit beyond 20 million cells or the memory limit;
/// kCancelled. Maps of less than 2 x 2 are kInput
/// @param short_rows  gets a sentence about rows with fewer numbers than others, which end in 0
Result<TriangleSoup> read_surface(const std::string& path, bool centre, bool invert,
                                  std::string* short_rows = nullptr,
                                  const Execution& execution = {});

}  // namespace strata::csg
