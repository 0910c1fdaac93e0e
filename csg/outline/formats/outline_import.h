#pragma once

#include <glm/vec2.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "csg/outline/outline.h"
#include "csg/outline/segments.h"
#include "strata/core/execution.h"

namespace strata::csg {

struct OutlineImport {
  std::string layer;  ///< read only this DXF layer, or this SVG group by its id; empty: all
  glm::dvec2 origin{0};
  double scale = 1;
  double dpi = 72;  ///< SVG: pixels per inch, where the file gives no unit
  bool centre = false;
  Segments segments;
};
/// Reads an SVG or DXF file, chosen by its extension. Lines of a DXF file are joined into contours
/// when their ends are no farther apart than one unit of the file's last decimal place, provided
/// the file writes at least three places. `warnings` gets a sentence about contours that do not
/// close and about lines that belong to no contour. @return kInput naming file and line; kLimit;
/// kCancelled
Result<Outline> read_outline(const std::string& path, const OutlineImport& options,
                             const Execution& execution = {},
                             std::vector<std::string>* warnings = nullptr);

/// The readers behind read_outline(). They parse the text of a file, which messages call `name`.
/// The result is not centred.
Result<Outline> read_dxf(std::string_view text, const std::string& name,
                         const OutlineImport& options, const Execution& execution = {},
                         std::vector<std::string>* warnings = nullptr);
Result<Outline> read_svg(std::string_view text, const std::string& name,
                         const OutlineImport& options, const Execution& execution = {});

}  // namespace strata::csg
