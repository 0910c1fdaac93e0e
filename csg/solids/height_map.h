#pragma once

#include <string>

#include "strata/core/execution.h"
#include "strata/core/result.h"
#include "strata/mesh/triangle_soup.h"

namespace strata::csg {

/// OpenSCAD's `surface`: the closed solid below a height map. Each cell has a vertex in its middle.
/// A .png is read as grey levels 0 to 100; its last row is at y = 0, and the floor is one below the
/// lowest point. Any other file is read as rows of numbers; the first row is at y = 0, '#' begins a
/// comment, and the floor is at min(1, lowest) - 1. `centre` moves the middle to x = y = 0;
/// `invert` inverts grey levels.
/// @param short_rows  gets a sentence about rows with fewer numbers than others; their missing
/// numbers are 0
/// @return kInput naming file and line, also for maps of less than 2 x 2; kLimit beyond 20 million
/// cells or the memory limit; kCancelled
Result<TriangleSoup> read_surface(const std::string& path, bool centre, bool invert,
                                  std::string* short_rows = nullptr,
                                  const Execution& execution = {});

}  // namespace strata::csg
